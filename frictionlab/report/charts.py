"""Charts as SVG inside a page: a campaign has hundreds of tests, and these take a millisecond each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from frictionlab import __version__
from frictionlab.arrays import FloatArray
from frictionlab.tables.texts import encodable

HERE = Path(__file__).parent
TEMPLATES = Environment(loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True)
"""Of the pages and charts; whatever stood in a log or a file name is escaped by them, what steers a terminal too."""
TEMPLATES.finalize = lambda value: encodable(value) if type(value) is str else value
TEMPLATES.globals |= {"style": (HERE / "page.css").read_text(encoding="utf-8"), "version": __version__}
WIDTH, HEIGHT, WIDE = 460.0, 270.0, 920.0
LEFT, RIGHT, TOP, BOTTOM = 62.0, 12.0, 12.0, 44.0
MOST_POINTS = 1500  # of a line: more than its pixels
TICKS = 5
FEWER = 0.75  # of the step asked for is near enough
LEAST = 0.02  # of a value: a scatter plot is not drawn tighter, for measurements differ by so much
LEGEND = 22.0  # above the points of a scatter plot
COLOURS = 6  # of groups in the page's style; further groups begin again


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


class _Axis:
    """Values between the places `start` and `end` on the sheet, and their round ticks."""

    def __init__(self, values: FloatArray, start: float, end: float, least: float = 0.0) -> None:
        low, high = float(values.min()), float(values.max())
        margin = max(0.04 * (high - low), least * abs(high)) or 0.05 * abs(high) or 1.0
        self.low, self.high, self.start, self.end = low - margin, high + margin, start, end

    def at(self, value: FloatArray | float) -> FloatArray:
        """Where values stand on the sheet."""
        share = (np.asarray(value) - self.low) / (self.high - self.low)
        return np.asarray(np.round(self.start + (self.end - self.start) * share, 1))

    def ticks(self) -> list[tuple[float, str]]:
        """Places and words of the round values."""
        about = (self.high - self.low) / TICKS
        ten = 10.0 ** math.floor(math.log10(about))
        step = next(ten * m for m in (1.0, 2.0, 5.0, 10.0) if ten * m >= FEWER * about)
        values = [step * n for n in range(math.ceil(self.low / step), math.floor(self.high / step) + 1)]
        return [(float(self.at(v)), f"{round(v, 12):.6g}".replace("-", "\N{MINUS SIGN}")) for v in values]


def chart(
    lines: Sequence[ChartLine], x_label: str, y_label: str, *, dots: Sequence[Dot] = (), groups: Sequence[str] = ()
) -> str:
    """Return lines, or dots over a whole page under the names of their groups, as an SVG element; empty without any.

    A line needs two finite points; each dot is a link to its page, and their ordinate begins at 0.
    """
    shown = []
    for line in lines:
        x, y = np.column_stack([line.x, line.y])[np.isfinite(line.x) & np.isfinite(line.y)].T
        step = max(1, math.ceil(len(x) / MOST_POINTS))
        shown += [(x[::step], y[::step], line)] if len(x) > 1 else []
    known = [dot for dot in dots if math.isfinite(dot.x) and math.isfinite(dot.y)]
    if not shown and not known:
        return ""
    right = (WIDE if known else WIDTH) - RIGHT
    points = [(x, y) for x, y, _ in shown] + [(np.array([dot.x, dot.x]), np.array([0.0, dot.y])) for dot in known]
    x, y = map(np.concatenate, zip(*points, strict=True))
    across, up = _Axis(x, LEFT, right, LEAST * bool(known)), _Axis(y, HEIGHT - BOTTOM, TOP + LEGEND * bool(known))
    drawn = []
    for x, y, line in shown:
        places = [f"{a} {b}" for a, b in zip(across.at(x).tolist(), up.at(y).tolist(), strict=True)]
        drawn.append(("".join(f"M{place}h0" for place in places) if line.dots else f"M{'L'.join(places)}", line))
    return TEMPLATES.get_template("chart.svg").render(
        width=right + RIGHT, height=HEIGHT, left=LEFT, right=right, top=TOP, bottom=HEIGHT - BOTTOM,
        x_ticks=across.ticks(), y_ticks=up.ticks(), x_label=x_label, y_label=y_label, lines=drawn,
        dots=[(float(across.at(dot.x)), float(up.at(dot.y)), dot) for dot in known], groups=groups[:COLOURS],
    )  # fmt: skip
