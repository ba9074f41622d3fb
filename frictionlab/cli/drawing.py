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
    if plot.is_dir() or not plot.suffix:
        names = result_names(inputs).items()
        places = {path: {kind: plot / f"{name}.{kind}.png" for kind in kinds} for path, name in names}
    elif len(inputs) > 1:
        raise UsageError(f"--plot {plot}: expected a folder for the figures of {len(inputs)} inputs; got a file's name")
    else:
        beside = {kind: plot.with_name(f"{plot.stem}.{kind}{plot.suffix}") for kind in kinds[1:]}
        places = {inputs[0]: {kinds[0]: plot, **beside}}
    _check([place for figures in places.values() for place in figures.values()], inputs, force=force)
    return places


def figure_file(plot: Path | None, kind: str, *, force: bool, inputs: Sequence[Path] = ()) -> Path | None:
    """The file of a command's only figure: as named, or of its kind's name in the folder named."""
    if plot is None:
        return None
    file = plot / f"{kind}.png" if plot.is_dir() or not plot.suffix else plot
    _check([file], inputs, force=force)
    return file


def _check(files: Sequence[Path], inputs: Sequence[Path], *, force: bool) -> None:
    """Refuse a suffix that is no figure's, and a figure that would replace something else."""
    from frictionlab.figures.mark import check_figures

    for file in files:
        if file.suffix not in SUFFIXES:
            raise UsageError(
                f"{file}: expected a figure ending in .pdf, .svg or .png, or a folder; got {file.suffix!r}"
            )
    check_figures(files, force=force, inputs=inputs)
