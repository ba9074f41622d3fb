"""Small charts as SVG inside the page: a campaign has hundreds of tests, and these take a millisecond each."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
WIDTH, HEIGHT, WIDE = 460.0, 270.0, 920.0
LEFT, RIGHT, TOP, BOTTOM = 62.0, 12.0, 12.0, 44.0
MOST_POINTS = 1500  # of a line: more than its pixels
TICKS = 5
FEWER = 0.75  # of the step asked for is near enough
COLOURS = 6  # of groups in the page's style; further groups begin again


@dataclass(frozen=True)
class Line:
    """One line (n,) of a chart; ``kind``: its class in the page's style; dots instead of a line with ``dots``."""

    x: FloatArray
    y: FloatArray
    label: str
    kind: str = "measured"
    dots: bool = False


@dataclass(frozen=True)
class Point:
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
    def over(cls, values: Sequence[FloatArray], start: float, end: float) -> "_Axis":
        low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
        margin = 0.04 * (high - low) or 0.05 * abs(high) or 1.0
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


def chart(lines: Sequence[Line], x_label: str, y_label: str) -> str:
    """Return lines as an SVG element; empty if no line has two finite points.

    Examples
    --------
    >>> chart([], "time [s]", "x [mm]")
    ''
    """
    shown = [line for line in map(_finite, lines) if len(line.x) > 1]
    if not shown:
        return ""
    x, y = _axes([line.x for line in shown], [line.y for line in shown], WIDTH)
    return _sheet((_drawn(line, x, y) for line in shown), x, y, x_label, y_label, WIDTH)


def scatter(points: Sequence[Point], x_label: str, y_label: str, groups: Sequence[str]) -> str:
    """Return points as an SVG element, each a link to its page; the groups' names stand above. Empty without points.

    Examples
    --------
    >>> '<a href="tests/a.html">' in scatter([Point(0.3, 1.2, "a", "tests/a.html")], "r", "E", ["steel"])
    True
    """
    known = [p for p in points if math.isfinite(p.x) and math.isfinite(p.y)]
    if not known:
        return ""
    x, y = _axes([np.array([p.x for p in known])], [np.array([p.y for p in known])], WIDE)
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


def _axes(x: Sequence[FloatArray], y: Sequence[FloatArray], width: float) -> tuple[_Axis, _Axis]:
    return _Axis.over(x, LEFT, width - RIGHT), _Axis.over(y, HEIGHT - BOTTOM, TOP)


def _sheet(inner: Iterator[str] | Sequence[str], x: _Axis, y: _Axis, x_label: str, y_label: str, width: float) -> str:
    """The SVG element: grid, ticks, labels, and what is drawn inside."""
    middle, low = (TOP + HEIGHT - BOTTOM) / 2, HEIGHT - BOTTOM
    ticks = [
        f'<path class="grid" d="M{a:.1f} {TOP}V{low}"/>'
        f'<text class="tick x" x="{a:.1f}" y="{low + 15:.0f}">{text}</text>'
        for a, text in _places(x)
    ]
    ticks += [
        f'<path class="grid" d="M{LEFT} {a:.1f}H{width - RIGHT}"/>'
        f'<text class="tick y" x="{LEFT - 5:.0f}" y="{a + 4:.1f}">{text}</text>'
        for a, text in _places(y)
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


def _places(axis: _Axis) -> Iterator[tuple[float, str]]:
    """Where the ticks of an axis stand, and their numbers."""
    for value in axis.ticks:
        yield float(axis.at(value)), f"{round(value, 12):.6g}".replace("-", "\N{MINUS SIGN}")


def _finite(line: Line) -> Line:
    good = np.isfinite(line.x) & np.isfinite(line.y)
    x, y = line.x[good], line.y[good]
    step = max(1, math.ceil(len(x) / MOST_POINTS))
    return Line(x[::step], y[::step], line.label, line.kind, line.dots)


def _drawn(line: Line, x: _Axis, y: _Axis) -> str:
    pairs = list(zip(x.at(line.x), y.at(line.y), strict=True))
    title = f"<title>{escape(line.label)}</title>"
    if line.dots:
        dots = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in pairs)
        return f'<path class="dots {line.kind}" d="{dots}">{title}</path>'
    return f'<path class="line {line.kind}" d="M{"L".join(f"{a:.1f} {b:.1f}" for a, b in pairs)}">{title}</path>'
