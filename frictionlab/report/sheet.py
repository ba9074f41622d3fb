"""A page of one test: its motion, its loop, the force of its contact, its cycles, and what is to be warned of."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from frictionlab import __version__
from frictionlab.analysis.measurement import Measurement
from frictionlab.campaign import Trial, Verdict
from frictionlab.campaign.trials import short_name
from frictionlab.estimate import Estimate
from frictionlab.files import write_whole
from frictionlab.inference.contact import contact_force
from frictionlab.recording import Recording
from frictionlab.report.chart import Line, chart
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.tables import Row

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
class Sheet:
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


def write_sheet(sheet: Sheet, path: Path, *, back: str | None = None, force: bool = False) -> None:
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


def sheet_page(sheet: Sheet, *, back: str | None = None) -> str:
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


def _facts(sheet: Sheet) -> Iterator[tuple[str, str]]:
    """Names and values of what was measured; energies in joules too where stiffness and amplitude are known."""
    trial = sheet.trial
    energy, amplitude = trial.means
    unit = _energy_unit(sheet)
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


def _energy_unit(sheet: Sheet) -> float | None:
    """``k Y²`` in J."""
    stiffness, amplitude = sheet.scene.rig.stiffness, sheet.trial.base_amplitude_m
    return None if stiffness is None or not np.isfinite(amplitude) else stiffness * amplitude**2


def _verdicts(sheet: Sheet) -> Iterator[tuple[str, str]]:
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


def _charts(sheet: Sheet) -> Iterator[tuple[str, str, str]]:
    """Title, chart and caption."""
    measured = sheet.measurement
    if measured is None:
        return
    unit = 1e3 * (measured.base_amplitude.value or np.nan)  # Y in mm
    if sheet.recording is not None:
        yield "Time response", _response(sheet.recording, measured), f"The last {CYCLES} cycles, about their means."
    cycle = measured.cycle
    loop = [Line(_closed(unit * cycle.mass), _closed(unit * cycle.base), "mean cycle")]
    yield (
        "Loop",
        chart(loop, "mass displacement x [mm]", "base displacement y [mm]"),
        AREA,
    )
    if measured.frequency_ratio is not None:
        yield from _forces(sheet, measured, unit)
    series = measured.series
    used = Line(series.time[series.used], series.energy[series.used], "used", dots=True)
    other = Line(series.time[~series.used], series.energy[~series.used], "not used", "other", dots=True)
    words = "Each full steady cycle; in colour those that the energy is the mean of."
    yield "Cycles", chart([other, used], "time [s]", "energy per cycle [k Y²]"), words


def _forces(sheet: Sheet, measured: Measurement, unit: float) -> Iterator[tuple[str, str, str]]:
    stiffness = sheet.scene.rig.stiffness
    newtons, name = (1.0, "k Y") if stiffness is None else (stiffness * unit * 1e-3, "N")
    problem, late = (None, 0.0) if sheet.fitted is None else sheet.fitted
    force = _closed(newtons * contact_force(measured, problem, late))
    cycle, turn = measured.cycle, 2.0 * np.pi * (measured.drive.value or np.nan)
    place, speed = _closed(unit * cycle.mass_smooth), _closed(unit * turn * cycle.mass_velocity)
    label = f"friction force [{name}]"
    words = FORCE if sheet.fitted is None else f"{FORCE} {AS_FITTED}"
    yield "Force over displacement", chart([Line(place, force, "force")], "mass displacement x [mm]", label), words
    yield (
        "Force over speed",
        chart([Line(speed, force, "force")], "mass speed [mm/s]", label),
        SPEED,
    )


def _closed(values: np.ndarray) -> np.ndarray:
    return np.append(values, values[:1])


def _response(recording: Recording, measured: Measurement) -> str:
    span = CYCLES / (measured.drive.value or np.nan)
    inside = recording.time >= recording.time[-1] - span
    time = recording.time[inside]
    mass, base = (1e3 * s[inside] for s in (recording.mass_displacement, recording.base_displacement))
    lines = [
        Line(time, base - np.nanmean(base), "base", "other"),
        Line(time, mass - np.nanmean(mass), "mass"),
    ]
    return chart(lines, "time [s]", "displacement [mm]: mass, base")


def sheets_of(
    trials: Sequence[Trial],
    verdicts: Mapping[str, Verdict],
    comparisons: Mapping[str, Row],
    scene: Scene,
    fitted: Mapping[str, tuple[Problem, float]],
) -> list[Sheet]:
    """The pages of a campaign, in the order of its tests, without what their recordings would add."""
    sources = ((t, t.source) for t in trials)
    return [Sheet(t, scene, verdicts.get(name), comparisons.get(name), fitted.get(name)) for t, name in sources]
