"""One look for every figure: sizes for print, a colour-blind safe palette, files that are the same bytes each time."""

import io
import logging
import math
import textwrap
import warnings
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context, rc_params_from_file
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colorbar import Colorbar
from matplotlib.colors import BoundaryNorm, ListedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.figures import FORMATS, is_figure
from frictionlab.files import write_whole

AT_REST = -1.0
"""Stands for a mass that rests during the whole cycle, in arrays of stops."""
SINGLE = 8  # stops up to which each number has a colour of its own; beyond, classes double
REST, NONE = "#B0B0B0", "#F2EFE6"
TURN = 2.0 * np.pi
MOST_POINTS = 4000  # of a line: more cannot be seen in print
# Okabe and Ito, "Color universal design" (2008): distinct with any common colour blindness, and in grey.
BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY, BLACK = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#000000",
)  # fmt: skip
GREY = "#8A8A8A"
MEASURED, PREDICTED, BASE = BLUE, VERMILION, "#4A4A4A"
PALETTE = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK)
MARKERS = "os^Dv<>p"
PAGE = 7.2  # width of a journal's page, inches
ONE_WAY = "cycle: a revolution, or a tenth of the way"
SMALL = 6  # points: words inside a panel
HEADLINE = 105  # letters a line above a figure of the whole page
LETTERS, FORE = 150, 40  # of a line below a figure; where the name of a number ends
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
LINES: Mapping[str, Mapping[str, Any]] = {
    "base": {"color": BASE, "linewidth": 0.8},
    "measured": {"color": MEASURED, "linewidth": 2.0, "alpha": 0.55},  # broad and pale under a prediction
    "predicted": {"color": PREDICTED, "linewidth": 1.0},
}
"""First word of a line's label -> how it is drawn in every figure."""

logging.getLogger("matplotlib").setLevel(logging.ERROR)
"""It says at length where it keeps its fonts when nothing can be written at home: nothing that a figure depends on."""

LOOK: dict[Any, Any] = rc_params_from_file(Path(__file__).with_name("print.mplstyle"), use_default_template=False)
PLAIN_TEXT: dict[Any, Any] = {"text.parse_math": False}  # a material or a file may well be called "$5"


def new_figure(width: float = PAGE, height: float = 3.0) -> Figure:
    """An empty figure (inches), laid out so that nothing is cut; call it and draw inside ``rc_context(LOOK)``."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


@contextmanager
def drawing(height: float = 3.0, title: str = "", cautions: Sequence[str] = ()) -> Iterator[Figure]:
    """A figure of a page's width to draw in, in the house's look; its title above it, what is to be warned of below.

    What begins with the name of a number comes first: it says what that number is worth. The rest is in the table.
    """
    with rc_context({**LOOK, **PLAIN_TEXT}):
        figure = new_figure(PAGE, height)
        yield figure
        if title:
            lines = textwrap.wrap(title, HEADLINE)
            figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=8)
        if cautions:
            first = sorted(cautions, key=lambda sentence: ":" not in sentence[:FORE])[:2]
            rest = f" (and {len(cautions) - len(first)} more in the table)" if len(cautions) > len(first) else ""
            widths = [LETTERS] * (len(first) - 1) + [LETTERS - len(rest)]
            said = [
                textwrap.shorten(f"! {s}", width, placeholder=" ...") for s, width in zip(first, widths, strict=True)
            ]
            figure.supxlabel("\n".join(said) + rest, x=0.01, ha="left", fontsize=6.0, color=VERMILION)


def save(figure: Figure, path: Path, *, force: bool = False) -> Path:
    """Write a figure whole or not at all; the suffix (.png, .pdf, .svg) says how. Same figure, same bytes.

    An earlier figure of this tool is replaced, any other file only with ``force``; else `OutputError`.
    """
    image = io.BytesIO()
    for label in figure.findobj(Text):  # bytes of a file's name that are no text are shown escaped: no font draws them
        if not (words := label.get_text()).isascii():
            label.set_text(words.encode("utf-8", "backslashreplace").decode())
    with rc_context(LOOK), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name in letters that the font lacks is drawn as boxes
        engine = figure.get_layout_engine()
        if engine is not None:  # `savefig` lays out by drawing twice; what is laid out already is drawn once
            if figure.axes:
                engine.execute(figure)
            figure.set_layout_engine(None)
        figure.savefig(image, format=path.suffix.lstrip("."), **FORMATS[path.suffix])
    write_whole(path, image.getvalue(), replace=force or is_figure)
    return path


def shades(count: int) -> list[str]:
    """Colours of an ordered family: the palette, or light to dark where it is too short."""
    if count <= len(PALETTE):
        return list(PALETTE[:count])
    return [to_hex(colormaps["viridis_r"](0.1 + 0.9 * i / (count - 1))) for i in range(count)]


def plain_numbers(axis: Axis) -> None:
    """Number the decades of a logarithmic axis in plain text, or 1, 2, 5 of each where it has less than two.

    matplotlib's own labels, set as mathematics, and its eight ticks a decade take a fifth of the time of a figure.
    """
    low, high = sorted(axis.get_view_interval())
    few = 0.0 < high < 100.0 * low

    def said(value: float, _: object) -> str:
        return f"{value:g}" if few or value <= 0.0 else f"10{f'{math.log10(value):.0f}'.translate(RAISED)}"

    locator = LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,))
    axis.set_major_locator(MaxNLocator(3) if 0.0 < high < 5.0 * low else locator)  # two of 1, 2, 5 at most
    axis.set_major_formatter(FuncFormatter(said))
    axis.set_minor_formatter(NullFormatter())
    axis.minorticks_off()


def over_time(
    ax: Axes,
    time: FloatArray,
    lines: Mapping[str, FloatArray],
    colors: Sequence[str] = (MEASURED,),
    *,
    stops: Iterable[Sequence[float]] = (),
    xlabel: str = "time [s]",
    **labels: str,
) -> Axes:
    """Draw a motion: lines over time by their labels, stops shaded; ``colors``: of those that `LINES` does not know."""
    for number, (begin, end) in enumerate(stops):
        ax.axvspan(begin, end, color=GREY, alpha=0.3, lw=0, label=None if number else "stop")
    rest = iter(colors)
    for label, values in lines.items():
        shown, known = thinned(values), LINES.get(label.split()[0])
        ax.plot(time[shown], values[shown], label=label, **(known or {"color": next(rest)}))
    ax.set(xlim=(time[0], time[-1]), xlabel=xlabel, **labels)
    ax.margins(y=0.25)
    ax.legend(loc="upper right", ncols=4)
    return ax


def thinned(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return indices that show a long line as it is: the least and the largest of each part, in order."""
    part = -(-2 * len(values) // MOST_POINTS)
    if part < 3:
        return np.arange(len(values))
    whole = len(values) // part * part
    rows = values[:whole].reshape(-1, part)
    begin = np.arange(0, whole, part)
    both = np.sort(np.stack([begin + rows.argmin(axis=1), begin + rows.argmax(axis=1)], axis=1), axis=1)
    return np.concatenate([both.ravel(), np.arange(whole, len(values))])


def panels(figure: Figure, count: int, across: int = 2, **how: Any) -> list[Axes]:
    """So many panels in rows of ``across``; what is left of the last row stays empty."""
    axes: list[Axes] = figure.subplots(-(-count // across), min(across, count), squeeze=False, **how).ravel().tolist()
    for ax in axes[count:]:
        ax.remove()
    return axes[:count]


def unfolded(force: FloatArray, velocity: FloatArray) -> FloatArray:
    """A cycle (p,) of a contact that slides one way, which the analysis has folded; NaN where the fold turns."""
    slides = np.abs(velocity) > 0.1 * np.abs(velocity).max()
    return np.roll(np.where(slides, np.sign(velocity) * force, np.nan), len(force) // 2)


def closed(values: FloatArray) -> FloatArray:
    """A cycle with its first point repeated at the end."""
    return np.concatenate([values, values[:1]])


class StopColours:
    """Classes of these stops per cycle, up to the largest, with their colours; at rest: `AT_REST`."""

    def __init__(self, values: FloatArray) -> None:
        known = np.round(values[np.isfinite(values)])
        ends = [*range(SINGLE + 1), *(SINGLE * (1 + 2**n) for n in range(50))]
        ends = ends[: 1 + bisect_left(ends, known.max(initial=0.0))]
        rests = ["at rest"] * bool(np.any(known == AT_REST))
        self.names = rests + [f"{b}" if b == a + 1 else f"{a + 1}-{b}" for a, b in pairwise((-1, *ends))]
        self.edges = [*(-1.5 for _ in rests), -0.5, *(end + 0.5 for end in ends)]

    @property
    def mapped(self) -> dict[str, Any]:
        """The colours and their norm, for ``pcolormesh``."""
        plain = [REST, NONE] if self.names[0] == "at rest" else [NONE]
        more = colormaps["viridis_r"](np.linspace(0.05, 1.0, max(1, len(self.names) - len(plain))))
        colours = [*plain, *more][: len(self.names)]
        return {"cmap": ListedColormap(colours), "norm": BoundaryNorm(self.edges, len(self.names))}

    def bar(self, figure: Figure, mesh: Any, ax: Any) -> Colorbar:
        """A colour bar with the name of each class at its middle."""
        middles = [0.5 * (low + high) for low, high in pairwise(self.edges)]
        bar = figure.colorbar(mesh, ax=ax, ticks=middles, spacing="uniform", aspect=30)
        bar.ax.set_yticklabels(self.names)
        bar.ax.tick_params(length=0)
        bar.ax.minorticks_off()
        return bar
