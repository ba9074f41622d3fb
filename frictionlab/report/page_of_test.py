"""A page of one test: its motion, its loop, the force of its contact, its cycles, and what is to be warned of.

Charts are SVG inside the page: a campaign has hundreds of tests, and these take a millisecond each.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from frictionlab import __version__
from frictionlab.analysis.measurement import Measurement
from frictionlab.arrays import FloatArray
from frictionlab.campaign import Campaign, Trial, Verdict
from frictionlab.campaign.trials import short_name
from frictionlab.estimate import Estimate
from frictionlab.files import write_whole
from frictionlab.inference.comparison import contact_force
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.tables import Row

WIDTH, HEIGHT, WIDE = 460.0, 270.0, 920.0
LEFT, RIGHT, TOP, BOTTOM = 62.0, 12.0, 12.0, 44.0
MOST_POINTS = 1500  # of a line: more than its pixels
TICKS = 5
FEWER = 0.75  # of the step asked for is near enough
LEAST = 0.02  # of a value: a scatter plot is not drawn tighter, for measurements differ by so much
LEGEND = 22.0  # above the points of a scatter plot
COLOURS = 6  # of groups in the page's style; further groups begin again
HERE = Path(__file__).parent
CYCLES = 8  # of the time response, the last ones
MARK = f'<meta name="generator" content="frictionlab {__version__}">'
NO_RECORDING = "The recording is not at hand, so nothing is drawn: numbers alone."
AREA = "Its area is the energy per cycle over the stiffness."
SPEED = "The same over the speed."
FORCE = (
    "Force of the contact recovered from the mean cycle by the equation of motion: no law assumed. Above 25 harmonics"
    " it fades out, so corners are rounded."
)
AS_FITTED = "Lag, frequency and damping are those that the fit of its material's tests gives."


@dataclass(frozen=True)
class ChartLine:
    """One line (n,) of a chart; ``kind``: its class in the page's style; dots instead of a line with ``dots``."""

    x: FloatArray
    y: FloatArray
    label: str
    kind: str = "measured"
    dots: bool = False


@dataclass(frozen=True)
class Dot:
    """One point of a scatter plot: what it says when it is pointed at, the page it opens, and its group's number."""

    x: float
    y: float
    label: str
    link: str
    group: int = 0


@dataclass(frozen=True)
class _Axis:
    """Range of an axis and its round ticks; values between `start` and `end` on the sheet."""

    low: float
    high: float
    start: float
    end: float
    ticks: tuple[float, ...]

    @classmethod
    def over(cls, values: Sequence[FloatArray], start: float, end: float, least: float = 0.0) -> "_Axis":
        low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
        margin = max(0.04 * (high - low), least * abs(high)) or 0.05 * abs(high) or 1.0
        low, high = low - margin, high + margin
        about = (high - low) / TICKS
        ten = 10.0 ** math.floor(math.log10(about))
        step = next(ten * m for m in (1.0, 2.0, 5.0, 10.0) if ten * m >= FEWER * about)
        ticks = tuple(step * n for n in range(math.ceil(low / step), math.floor(high / step) + 1))
        return cls(low, high, start, end, ticks)

    def at(self, value: FloatArray | float) -> FloatArray:
        """Where values stand on the sheet."""
        return np.asarray(
            self.start + (self.end - self.start) * (np.asarray(value) - self.low) / (self.high - self.low)
        )


def chart(lines: Sequence[ChartLine], x_label: str, y_label: str) -> str:
    """Return lines as an SVG element; empty if no line has two finite points.

    Examples
    --------
    >>> chart([], "time [s]", "x [mm]")
    ''
    """
    shown = [line for line in map(_finite, lines) if len(line.x) > 1]
    if not shown:
        return ""
    x = _Axis.over([line.x for line in shown], LEFT, WIDTH - RIGHT)
    y = _Axis.over([line.y for line in shown], HEIGHT - BOTTOM, TOP)
    return _sheet((_drawn(line, x, y) for line in shown), x, y, x_label, y_label, WIDTH)


def scatter(points: Sequence[Dot], x_label: str, y_label: str, groups: Sequence[str]) -> str:
    """Return points as an SVG element, each a link to its page; the groups' names stand above. Empty without points.

    Examples
    --------
    >>> '<a href="tests/a.html">' in scatter([Dot(0.3, 1.2, "a", "tests/a.html")], "r", "E", ["steel"])
    True
    """
    known = [p for p in points if math.isfinite(p.x) and math.isfinite(p.y)]
    if not known:
        return ""
    x = _Axis.over([np.array([p.x for p in known])], LEFT, WIDE - RIGHT, LEAST)
    y = _Axis.over([np.array([0.0, *(p.y for p in known)])], HEIGHT - BOTTOM, TOP + LEGEND)
    legend = (
        f'<text class="legend group{n % COLOURS}" x="{LEFT + 8 + 130 * n:.0f}" y="{TOP + 14:.0f}">\N{BLACK CIRCLE}'
        f" {escape(name)}</text>"
        for n, name in enumerate(groups[:COLOURS])
    )
    dots = (
        f'<a href="{escape(p.link)}"><circle class="group{p.group % COLOURS}" cx="{float(x.at(p.x)):.1f}"'
        f' cy="{float(y.at(p.y)):.1f}" r="4"><title>{escape(p.label)}</title></circle></a>'
        for p in known
    )
    return _sheet((*legend, *dots), x, y, x_label, y_label, WIDE)


def _sheet(inner: Iterator[str] | Sequence[str], x: _Axis, y: _Axis, x_label: str, y_label: str, width: float) -> str:
    """The SVG element: grid, ticks, labels, and what is drawn inside."""
    middle, low = (TOP + HEIGHT - BOTTOM) / 2, HEIGHT - BOTTOM
    ticks = [
        f'<path class="grid" d="M{x.at(v):.1f} {TOP}V{low}"/>'
        f'<text class="tick x" x="{x.at(v):.1f}" y="{low + 15:.0f}">{_number(v)}</text>'
        for v in x.ticks
    ]
    ticks += [
        f'<path class="grid" d="M{LEFT} {y.at(v):.1f}H{width - RIGHT}"/>'
        f'<text class="tick y" x="{LEFT - 5:.0f}" y="{y.at(v) + 4:.1f}">{_number(v)}</text>'
        for v in y.ticks
    ]
    labels = (
        f'<text class="axis" x="{(LEFT + width - RIGHT) / 2:.0f}" y="{HEIGHT - 8:.0f}">{escape(x_label)}</text>'
        f'<text class="axis" transform="translate(14 {middle:.0f}) rotate(-90)">{escape(y_label)}</text>'
    )
    about = escape(f"{y_label} over {x_label}")
    view = f"0 0 {width:.0f} {HEIGHT:.0f}"
    return (
        f'<svg class="chart" viewBox="{view}" role="img" aria-label="{about}">{"".join(ticks)}{"".join(inner)}{labels}'
        "</svg>"
    )


def _number(value: float) -> str:
    return f"{round(value, 12):.6g}".replace("-", "\N{MINUS SIGN}")


def _finite(line: ChartLine) -> ChartLine:
    good = np.isfinite(line.x) & np.isfinite(line.y)
    x, y = line.x[good], line.y[good]
    step = max(1, math.ceil(len(x) / MOST_POINTS))
    return ChartLine(x[::step], y[::step], line.label, line.kind, line.dots)


def _drawn(line: ChartLine, x: _Axis, y: _Axis) -> str:
    pairs = list(zip(x.at(line.x), y.at(line.y), strict=True))
    title = f"<title>{escape(line.label)}</title>"
    if line.dots:
        dots = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in pairs)
        return f'<path class="dots {line.kind}" d="{dots}">{title}</path>'
    return f'<path class="line {line.kind}" d="M{"L".join(f"{a:.1f} {b:.1f}" for a, b in pairs)}">{title}</path>'


@dataclass(frozen=True)
class PageOfTest:
    """What a page of one test shows; ``measurement``, ``recording``: where the recording is at hand.

    ``verdict``: what the campaign's fit says of it; ``comparison``: the row of `compare-numeric`, where it is given;
    ``fitted``: what the fit of all tests simulates for this one, and the phase (rad) by which its base's channel is
    late.
    """

    trial: Trial
    scene: Scene
    verdict: Verdict | None = None
    comparison: Row | None = None
    fitted: tuple[Problem, float] | None = None
    measurement: Measurement | None = None
    recording: Recording | None = None

    @property
    def title(self) -> str:
        """The test's name."""
        return short_name(self.trial.source)

    @property
    def warnings(self) -> tuple[str, ...]:
        """All that is to be warned of, each once."""
        again = () if self.measurement is None else self.measurement.warnings
        own = (self.comparison or {}).get("warnings")
        compared = [str(text) for text in own] if isinstance(own, (list, tuple)) else []
        return tuple(dict.fromkeys((*self.trial.warnings, *again, *compared)))


def sheet_name(number: int, trial: Trial) -> str:
    """File name of a test's page: any source becomes a plain one.

    Examples
    --------
    >>> sheet_name(7, Trial(source="a/<b> c.h5"))
    'test-0007-b_c.html'
    """
    stem = re.sub(r"[^A-Za-z0-9.-]+", "_", short_name(trial.source)).strip("_.")[:60]
    return f"test-{number:04d}-{stem or 'test'}.html"


def write_sheet(sheet: PageOfTest, path: Path, *, back: str | None = None, force: bool = False) -> None:
    """Write a page into an existing folder; ``back``: link to the page of all tests.

    Raises
    ------
    OutputError
        A file of this name is there that is no such page, or it cannot be written.
    """
    write_whole(path, sheet_page(sheet, back=back).encode(), replace=force or _is_sheet)


def _is_sheet(path: Path) -> bool:
    with path.open("rb") as file:
        return b'<meta name="generator" content="frictionlab' in file.read(4000)


def sheet_page(sheet: PageOfTest, *, back: str | None = None) -> str:
    """The page's text; whatever stood in a log is escaped by the template."""
    templates = Environment(loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return templates.get_template("sheet.html").render(
        title=sheet.title,
        source=sheet.trial.source,
        mark=MARK,
        style=(HERE / "page.css").read_text(encoding="utf-8"),
        back=back,
        reason=sheet.trial.reason,
        warnings=sheet.warnings,
        facts=list(_facts(sheet)),
        verdicts=list(_verdicts(sheet)),
        charts=[{"title": t, "svg": svg, "words": w} for t, svg, w in _charts(sheet) if svg],
        silent=NO_RECORDING if sheet.measurement is None and not sheet.trial.failed else "",
        version=__version__,
    )


def _facts(sheet: PageOfTest) -> Iterator[tuple[str, str]]:
    """Names and values of what was measured; energies in joules too where stiffness and amplitude are known."""
    trial = sheet.trial
    energy, amplitude = trial.means
    stiffness, base = sheet.scene.rig.stiffness, trial.base_amplitude_m
    unit = None if stiffness is None or not np.isfinite(base) else stiffness * base**2  # k Y² in J
    yield "material", trial.material or "not known"
    yield "normal force", _with_unit(Estimate(trial.normal_force_n), "N")
    yield "frequency ratio r", str(trial.ratio)
    yield "base amplitude Y", _with_unit(Estimate(trial.base_amplitude_m).scaled(1e3), "mm")
    yield "energy per cycle", _with_unit(energy, "k Y²")
    if unit is not None:
        yield "energy per cycle", _with_unit(energy.scaled(1e3 * unit), "mJ")
    yield "response amplitude", _with_unit(amplitude, "Y")
    yield "stops per cycle", "not known" if trial.stops is None else f"{trial.stops:.3g}"
    yield "regime", trial.regime or "not known"
    yield "irregularity", "not known" if trial.irregularity is None else f"{trial.irregularity:.2g}"


def _with_unit(number: Estimate, unit: str) -> str:
    return f"{number} {unit}" if number.known else "not known"


def _verdicts(sheet: PageOfTest) -> Iterator[tuple[str, str]]:
    verdict, row = sheet.verdict, sheet.comparison or {}
    if verdict is not None:
        yield "friction ratio of this test alone", str(verdict.alone)
        if verdict.predicted is not None:
            yield "energy that the group's friction predicts", f"{verdict.predicted.energy:.4g} k Y²"
        if verdict.residual is not None:
            yield "measured over predicted energy", f"{verdict.residual:+.2%}"
        if verdict.nrmse is not None and verdict.floor:
            yield "nrmse of its cycle under its material's law", f"{verdict.nrmse:.3g}"
            yield "that over what noise alone leaves", f"{verdict.nrmse / verdict.floor:.2g}"
        elif verdict.misfit is not None:
            count = f"{verdict.misfit:.2g}"
            yield "energy and amplitude differ from it by", f"{count} standard error{'' if count == '1' else 's'}"
        yield "in the fit of its group", "used" if verdict.excluded is None else f"left out: {verdict.excluded}"
    for key, words in (("law", "law (compare-numeric)"), ("verdict", "verdict"), ("model", "model")):
        if row.get(key):
            yield words, str(row[key])
    for key, words in (("response_nrmse", "nrmse of the cycle"), ("misfit", "misfit over noise")):
        if isinstance(number := row.get(key), (int, float)):
            yield words, f"{number:.3g}"


def _charts(sheet: PageOfTest) -> Iterator[tuple[str, str, str]]:
    """Title, chart and caption."""
    measured = sheet.measurement
    if measured is None:
        return
    unit = 1e3 * (measured.base_amplitude.value or np.nan)  # Y in mm
    if sheet.recording is not None:
        yield "Time response", _response(sheet.recording, measured), f"The last {CYCLES} cycles, about their means."
    cycle = measured.cycle
    loop = [ChartLine(_closed(unit * cycle.mass), _closed(unit * cycle.base), "mean cycle")]
    yield "Loop", chart(loop, "mass displacement x [mm]", "base displacement y [mm]"), AREA
    if measured.frequency_ratio is not None:
        yield from _forces(sheet, measured, unit)
    series = measured.series
    used = ChartLine(series.time[series.used], series.energy[series.used], "used", dots=True)
    other = ChartLine(series.time[~series.used], series.energy[~series.used], "not used", "other", dots=True)
    words = "Each full steady cycle; in colour those that the energy is the mean of."
    yield "Cycles", chart([other, used], "time [s]", "energy per cycle [k Y²]"), words


def _forces(sheet: PageOfTest, measured: Measurement, unit: float) -> Iterator[tuple[str, str, str]]:
    stiffness = sheet.scene.rig.stiffness
    newtons, name = (1.0, "k Y") if stiffness is None else (stiffness * unit * 1e-3, "N")
    problem, late = (None, 0.0) if sheet.fitted is None else sheet.fitted
    force = _closed(newtons * contact_force(measured, problem, late))
    cycle, turn = measured.cycle, 2.0 * np.pi * (measured.drive.value or np.nan)
    place, speed = _closed(unit * cycle.mass_smooth), _closed(unit * turn * cycle.mass_velocity)
    label = f"friction force [{name}]"
    words = FORCE if sheet.fitted is None else f"{FORCE} {AS_FITTED}"
    yield "Force over displacement", chart([ChartLine(place, force, "force")], "mass displacement x [mm]", label), words
    yield "Force over speed", chart([ChartLine(speed, force, "force")], "mass speed [mm/s]", label), SPEED


def _closed(values: np.ndarray) -> np.ndarray:
    return np.append(values, values[:1])


def _response(recording: Recording, measured: Measurement) -> str:
    span = CYCLES / (measured.drive.value or np.nan)
    inside = recording.time >= recording.time[-1] - span
    time = recording.time[inside]
    mass, base = (1e3 * s[inside] for s in (recording.mass_displacement, recording.base_displacement))
    lines = [
        ChartLine(time, base - np.nanmean(base), "base", "other"),
        ChartLine(time, mass - np.nanmean(mass), "mass"),
    ]
    return chart(lines, "time [s]", "displacement [mm]: mass, base")


def sheets_of(campaign: Campaign) -> list[PageOfTest]:
    """The pages of a campaign, in the order of its tests, without what their recordings would add."""
    fitted = {} if campaign.joint is None else campaign.joint.problems()
    verdicts, rows, sources = campaign.verdicts, campaign.comparisons, [t.source for t in campaign.trials]
    known = [(verdicts.get(name), rows.get(name), fitted.get(name)) for name in sources]
    return [PageOfTest(t, campaign.scene, *more) for t, more in zip(campaign.trials, known, strict=True)]
