"""Small line charts as SVG inside the page: a campaign has hundreds of tests, and these take a millisecond each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
WIDTH, HEIGHT = 460.0, 270.0
LEFT, RIGHT, TOP, BOTTOM = 62.0, 12.0, 12.0, 44.0
MOST_POINTS = 1500  # of a line: more than its pixels
TICKS = 5
FEWER = 0.75  # of the step asked for is near enough


@dataclass(frozen=True)
class Line:
    """One line (n,) of a chart; ``kind``: its class in the page's style; dots instead of a line with ``dots``."""

    x: FloatArray
    y: FloatArray
    label: str
    kind: str = "measured"
    dots: bool = False


def chart(lines: Sequence[Line], x_label: str, y_label: str) -> str:
    """Return a chart as an SVG element; empty if no line has two finite points.

    Examples
    --------
    >>> chart([], "time [s]", "x [mm]")
    ''
    """
    shown = [line for line in map(_finite, lines) if len(line.x) > 1]
    if not shown:
        return ""
    x, y = _Axis.over([line.x for line in shown]), _Axis.over([line.y for line in shown])
    middle = (TOP + HEIGHT - BOTTOM) / 2
    inner = (
        *(_tick_x(x, value) for value in x.ticks),
        *(_tick_y(y, value) for value in y.ticks),
        *(_drawn(line, x, y) for line in shown),
        f'<text class="axis" x="{(LEFT + WIDTH - RIGHT) / 2:.0f}" y="{HEIGHT - 8:.0f}">{escape(x_label)}</text>',
        f'<text class="axis" transform="translate(14 {middle:.0f}) rotate(-90)">{escape(y_label)}</text>',
    )
    told = escape(f"{y_label} over {x_label}")
    view = f"0 0 {WIDTH:.0f} {HEIGHT:.0f}"
    return f'<svg class="chart" viewBox="{view}" role="img" aria-label="{told}">{"".join(inner)}</svg>'


def _finite(line: Line) -> Line:
    good = np.isfinite(line.x) & np.isfinite(line.y)
    x, y = line.x[good], line.y[good]
    step = max(1, math.ceil(len(x) / MOST_POINTS))
    return Line(x[::step], y[::step], line.label, line.kind, line.dots)


@dataclass(frozen=True)
class _Axis:
    """Range of an axis and its round ticks."""

    low: float
    high: float
    ticks: tuple[float, ...]

    @classmethod
    def over(cls, values: Sequence[FloatArray]) -> "_Axis":
        low = min(float(v.min()) for v in values)
        high = max(float(v.max()) for v in values)
        room = 0.04 * (high - low) or 0.05 * abs(high) or 1.0
        low, high = low - room, high + room
        step = _round_step((high - low) / TICKS)
        first = math.ceil(low / step)
        return cls(low, high, tuple(step * n for n in range(first, math.floor(high / step) + 1)))

    def place(self, value: FloatArray | float, start: float, end: float) -> FloatArray:
        return np.asarray(start + (end - start) * (np.asarray(value) - self.low) / (self.high - self.low))


def _round_step(about: float) -> float:
    """The step of 1, 2 or 5 times a power of ten that gives at most about so many ticks."""
    ten = 10.0 ** math.floor(math.log10(about))
    return next(ten * m for m in (1.0, 2.0, 5.0, 10.0) if ten * m >= FEWER * about)


def _tick_x(axis: _Axis, value: float) -> str:
    at = float(axis.place(value, LEFT, WIDTH - RIGHT))
    line = f'<path class="grid" d="M{at:.1f} {TOP}V{HEIGHT - BOTTOM}"/>'
    return f'{line}<text class="tick x" x="{at:.1f}" y="{HEIGHT - BOTTOM + 15:.0f}">{_said(value)}</text>'


def _tick_y(axis: _Axis, value: float) -> str:
    at = float(axis.place(value, HEIGHT - BOTTOM, TOP))
    line = f'<path class="grid" d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}"/>'
    return f'{line}<text class="tick y" x="{LEFT - 5:.0f}" y="{at + 4:.1f}">{_said(value)}</text>'


def _said(value: float) -> str:
    return f"{round(value, 12):.6g}".replace("-", "\N{MINUS SIGN}")


def _drawn(line: Line, x: _Axis, y: _Axis) -> str:
    across, up = x.place(line.x, LEFT, WIDTH - RIGHT), y.place(line.y, HEIGHT - BOTTOM, TOP)
    title = f"<title>{escape(line.label)}</title>"
    if line.dots:
        dots = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(across, up, strict=True))
        return f'<path class="dots {line.kind}" d="{dots}">{title}</path>'
    points = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(across, up, strict=True))
    return f'<path class="line {line.kind}" d="M{points}">{title}</path>'
