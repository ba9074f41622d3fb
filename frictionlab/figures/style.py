"""One look for every figure: sizes for print, a colour-blind safe palette, files that are the same bytes each time."""

import io
import logging
import math
import textwrap
import warnings
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colorbar import Colorbar
from matplotlib.colors import BoundaryNorm, ListedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.image import imsave
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.figures.mark import MAKER, METADATA, is_figure
from frictionlab.files import write_whole

AT_REST = -1.0
"""Stands for a mass that rests during the whole cycle, in arrays of stops."""
SINGLE = 8  # stops up to which each number has a colour of its own; beyond, classes double
REST, NONE = "#B0B0B0", "#F2EFE6"
TURN = 2.0 * np.pi
MOST_POINTS = 4000  # of a line: more cannot be seen in print
# Okabe and Ito, "Color universal design" (2008): told apart with any common colour blindness, and in grey.
BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY, BLACK = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#000000",
)  # fmt: skip
GREY = "#8A8A8A"
MEASURED, PREDICTED, BASE = BLUE, VERMILION, "#4A4A4A"
PALETTE = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK)
PAGE = 7.2  # width of a journal's page, inches
HEADLINE = 105  # letters a line above a figure of the whole page
LETTERS, FORE = 150, 40  # of a line below a figure; where the name of a number ends

logging.getLogger("matplotlib").setLevel(logging.ERROR)
"""It says at length where it keeps its fonts when nothing can be written at home: nothing that a figure depends on."""

SQUEEZE = {"compress_level": 3}  # of 1 to 9: files 8 % larger than at 6, in three quarters of the time
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
LOOK: dict[Any, Any] = {  # matplotlib spells out every key in its type
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # where a title goes anyway: not said, it is looked for at each drawing, a tenth of the time
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 7.0,
    "figure.dpi": 100.0,
    "savefig.dpi": 200.0,
    "image.cmap": "viridis",
    "pdf.fonttype": 42,
    "svg.hashsalt": "frictionlab",
    "svg.fonttype": "path",
}


def shades(count: int) -> list[str]:
    """Colours of an ordered family: the palette, or light to dark where it is too short."""
    if count <= len(PALETTE):
        return list(PALETTE[:count])
    return [to_hex(colormaps["viridis_r"](0.1 + 0.9 * i / (count - 1))) for i in range(count)]


def look() -> AbstractContextManager[None]:
    """The house's look as a context: whole figures are drawn inside it, so that a notebook's own look stays its own."""
    return rc_context(LOOK)


def new_figure(width: float = PAGE, height: float = 3.0) -> Figure:
    """An empty figure (inches), laid out so that nothing is cut; call it and draw inside :func:`look`."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def headline(figure: Figure, text: str) -> None:
    """Say above a figure what it shows, in as many lines as it takes; a file's name is never read as mathematics."""
    lines = textwrap.wrap(text, HEADLINE)
    figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=8, parse_math=False)


def plain_decades(ax: Axes) -> None:
    """Number the decades of a logarithmic upright axis in plain text, and nothing between them: a fifth of the time.

    By default each number is set as mathematics, and eight ticks a decade are as dear as those with a number.
    """
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"10{f'{math.log10(value):.0f}'.translate(RAISED)}"))
    ax.minorticks_off()


def caution(figure: Figure, warnings: Sequence[str]) -> None:
    """Write two lines of warnings below a figure, in small: a figure travels without its table.

    What begins with the name of a number comes first: it says what that number is worth.
    """
    if not warnings:
        return
    first = sorted(warnings, key=lambda sentence: ":" not in sentence[:FORE])[:2]
    rest = f" (and {len(warnings) - len(first)} more in the table)" if len(warnings) > len(first) else ""
    room = [LETTERS] * (len(first) - 1) + [LETTERS - len(rest)]
    lines = [textwrap.shorten(f"! {said}", width, placeholder=" ...") for said, width in zip(first, room, strict=True)]
    figure.supxlabel("\n".join(lines) + rest, x=0.01, ha="left", fontsize=6.0, color=VERMILION, parse_math=False)


def save(figure: Figure, path: Path, *, force: bool = False) -> Path:
    """Write a figure whole or not at all; the suffix (.png, .pdf, .svg) says how. Same figure, same bytes.

    An earlier figure of this tool is replaced, any other file only with ``force``.

    Raises
    ------
    OutputError
        The file cannot be written, or another kind of file stands there.
    """
    image = io.BytesIO()
    _make_drawable(figure)
    with look(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name in letters that the font lacks is drawn as boxes
        if path.suffix == ".png":
            _draw_once(figure, image)
        else:
            _lay_out_once(figure)
            figure.savefig(image, format=path.suffix.lstrip("."), metadata=METADATA[path.suffix])
    write_whole(path, image.getvalue(), replace=force or is_figure)
    return path


def _make_drawable(figure: Figure) -> None:
    """Show the bytes of a file's name that are no text as they are escaped: no font draws them."""
    for label in figure.findobj(Text):
        if not (words := label.get_text()).isascii():
            label.set_text(words.encode("utf-8", "backslashreplace").decode())


def _lay_out_once(figure: Figure) -> None:
    """Give every part its place, and keep it: ``savefig`` lays out and draws twice, a third of a figure's time."""
    engine = figure.get_layout_engine()
    if engine is not None and figure.axes:  # one without axes has nothing to lay out, and matplotlib warns
        engine.execute(figure)
        figure.set_layout_engine("none")


def _draw_once(figure: Figure, image: io.BytesIO) -> None:
    """What ``savefig`` does, which draws twice: once for the layout alone and once more for the picture."""
    canvas: Any = FigureCanvasAgg(figure)  # untyped in matplotlib
    dpi = LOOK["savefig.dpi"]
    figure.set_dpi(dpi)
    canvas.draw()
    imsave(image, canvas.buffer_rgba(), format="png", dpi=dpi, metadata={"Software": MAKER}, pil_kwargs=SQUEEZE)


@dataclass(frozen=True)
class StopColours:
    """Classes of stops with their colours; ``edges`` (n + 1,) between the classes, ``names`` (n,).

    Examples
    --------
    >>> stop_colours(np.array([0.0, 2.0, AT_REST, np.nan])).names
    ('at rest', '0', '1', '2')
    >>> stop_colours(np.array([0.0, 131.0])).names[-3:]
    ('25-40', '41-72', '73-136')
    """

    edges: tuple[float, ...]
    names: tuple[str, ...]

    @property
    def mapped(self) -> dict[str, Any]:
        """The colours and their norm, for ``pcolormesh``."""
        rest = [REST] if self.names[0] == "at rest" else []
        none = [NONE] if self.edges[len(rest)] < 0.0 else []
        more = len(self.names) - len(rest) - len(none)
        shades = [*rest, *none, *colormaps["viridis_r"](np.linspace(0.05, 1.0, max(more, 1)))]
        return {"cmap": ListedColormap(shades[: len(self.names)]), "norm": BoundaryNorm(self.edges, len(self.names))}

    def bar(self, figure: Figure, mesh: Any, ax: Any) -> Colorbar:
        """A colour bar with the name of each class at its middle."""
        middles = [0.5 * (low + high) for low, high in zip(self.edges, self.edges[1:], strict=False)]
        bar = figure.colorbar(mesh, ax=ax, ticks=middles, spacing="uniform", aspect=30)
        bar.ax.set_yticklabels(self.names)
        bar.ax.tick_params(length=0)
        bar.ax.minorticks_off()
        return bar


def stop_colours(values: FloatArray) -> StopColours:
    """The classes that these stops per cycle need, up to the largest."""
    known = np.round(values[np.isfinite(values)])
    most = int(known.max(initial=0.0))
    edges = [-1.5] if np.any(known == AT_REST) else []
    names = ["at rest"] if edges else []
    for number in range(min(most, SINGLE) + 1):
        edges.append(number - 0.5)
        names.append(str(number))
    last, wide = min(most, SINGLE), SINGLE
    while last < most:
        edges.append(last + 0.5)
        names.append(f"{last + 1}-{last + wide}")
        last, wide = last + wide, 2 * wide if last > SINGLE else wide
    return StopColours((*edges, last + 0.5), tuple(names))


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


def shade(ax: Axes, stops: Iterable[Sequence[float]], color: str = GREY, label: str | None = None) -> None:
    """Shade stops from their begin to their end."""
    for number, (begin, end) in enumerate(stops):
        ax.axvspan(begin, end, color=color, alpha=0.3, lw=0, label=None if number else label)


def closed(values: FloatArray) -> FloatArray:
    """A cycle with its first point repeated at the end."""
    return np.append(values, values[:1])
