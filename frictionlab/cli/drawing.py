"""Where a command's figures go: into a folder under names of their own, or into the file that the user named."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from frictionlab.cli.inputs import result_names
from frictionlab.errors import UsageError

SUFFIXES = (".pdf", ".svg", ".png")
Figures = Mapping[Path, Mapping[str, Path]]
"""Input -> kind of figure -> its file."""


def figure_places(
    plot: Path | None, inputs: Sequence[Path], kinds: Sequence[str], *, force: bool = False
) -> Figures | None:
    """Name the figures of each input, and refuse those that would replace another kind of file or an input.

    Parameters
    ----------
    plot
        A folder, or for one input a file; None: nothing is drawn.
    inputs
        What is drawn of; like-named ones get names that differ.
    kinds
        Kinds of figures of each input, the first being the one that the named file holds; others stand beside it.

    Raises
    ------
    UsageError
        A file for several inputs, a suffix of another kind of file, or a figure that would replace something else.
    """
    if plot is None:
        return None
    from frictionlab.figures.mark import check_figures

    places = _in_folder(plot, inputs, kinds) if _is_folder(plot) else _one_file(plot, inputs, kinds)
    check_figures([p for figures in places.values() for p in figures.values()], force=force, inputs=inputs)
    return places


def _is_folder(plot: Path) -> bool:
    return plot.is_dir() or not plot.suffix


def _in_folder(folder: Path, inputs: Sequence[Path], kinds: Sequence[str]) -> Figures:
    named = result_names(inputs).items()
    return {path: {kind: folder / f"{name}.{kind}.png" for kind in kinds} for path, name in named}


def _one_file(file: Path, inputs: Sequence[Path], kinds: Sequence[str]) -> Figures:
    check_figure_name(file)
    if len(inputs) > 1:
        raise UsageError(f"--plot {file}: expected a folder for the figures of {len(inputs)} inputs; got a file's name")
    beside = {kind: file.with_name(f"{file.stem}.{kind}{file.suffix}") for kind in kinds[1:]}
    return {inputs[0]: {kinds[0]: file, **beside}}


def figure_file(plot: Path | None, kind: str, *, force: bool, inputs: Sequence[Path] = ()) -> Path | None:
    """The file of a command's only figure: as named, or of its kind's name in the folder named.

    Raises
    ------
    UsageError
        No figure's suffix, or a figure that would replace something else.
    """
    if plot is None:
        return None
    from frictionlab.figures.mark import check_figures

    file = plot / f"{kind}.png" if _is_folder(plot) else plot
    check_figure_name(file)
    check_figures([file], force=force, inputs=inputs)
    return file


def check_figure_name(file: Path) -> None:
    """Refuse a suffix that is no figure's.

    Raises
    ------
    UsageError
        As said.
    """
    if file.suffix not in SUFFIXES:
        raise UsageError(f"{file}: expected a figure ending in .pdf, .svg or .png, or a folder; got {file.suffix!r}")
