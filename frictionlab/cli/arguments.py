"""Inputs on a command line: files, folders, patterns, standard input; figures of each; rows, and the exit status."""

import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import typer

from frictionlab.cli.screen import complain
from frictionlab.cli.standard_output import LostOutputError, standard_output
from frictionlab.errors import UsageError
from frictionlab.tables import Row, json_line
from frictionlab.verbs.inputs import FAILED

STOPPED = 128 + 2  # the exit status that shells give to what Ctrl-C has stopped
STANDARD_INPUT = Path("-")
HDF5 = b"\x89HDF"  # as a recording begins
Files = Mapping[Path, Path]
"""Input -> the file that holds it, where that is not itself."""
Figures = Mapping[Path, Mapping[str, Path]]
"""Input -> kind of figure -> its file."""


def expanded(logs: Sequence[Path], *, recordings: bool = False) -> list[Path]:
    """The logs that are meant, each once: of a folder all logs in it, of a pattern all files that fit it, in order.

    With ``recordings`` a folder's recordings are meant where it holds any.

    Raises
    ------
    UsageError
        A folder without logs, or a pattern that fits nothing.
    """
    from frictionlab.verbs.inputs import logs_of

    found: dict[Path, None] = {}
    for log in opened(logs):
        made = sorted(log.glob("*.h5")) if recordings and log.is_dir() else []
        found |= dict.fromkeys(made or (logs_of([log]) if log.is_dir() else [log]))
    return list(found)


def tables_in(places: Sequence[Path]) -> list[Path]:
    """The tables that are meant, each once: of a folder all that stand in it, of a pattern all files that fit it.

    Raises
    ------
    UsageError
        A folder without tables, or a pattern that fits nothing.
    """
    from frictionlab.tables import SUFFIXES

    found: dict[Path, None] = {}
    for place in opened(places):
        tables = [p for p in sorted(place.iterdir()) if p.suffix in SUFFIXES] if place.is_dir() else [place]
        if not tables:
            raise UsageError(f"no tables in {place}: expected files ending in {', '.join(SUFFIXES)}")
        found |= dict.fromkeys(tables)
    return list(found)


def opened(places: Sequence[Path]) -> list[Path]:
    """The files and folders that are meant: of a pattern that no shell has opened up, all files that fit it.

    Raises
    ------
    UsageError
        A pattern that fits nothing.
    """
    found: list[Path] = []
    for place in places:
        if place.exists() or not any(sign in str(place) for sign in "*?["):
            found.append(place)
            continue
        root = place.parent if place.parent.is_dir() else Path(place.anchor)
        files = sorted(path for path in root.glob(str(place.relative_to(root))) if path.is_file())
        if not files:
            raise UsageError(f"{place}: no file fits this pattern")
        found += files
    return found


def result_names(logs: Sequence[Path]) -> Mapping[Path, str]:
    """A name for the results of each input that no other has; standard input has one too."""
    from frictionlab.verbs.inputs import names_of

    files = {log: Path("standard_input") if log == STANDARD_INPUT else log for log in dict.fromkeys(logs)}
    names = names_of(list(files.values()))
    return {log: names[file] for log, file in files.items()}


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
    from frictionlab.figures.mark import METADATA

    if plot is None:
        return None
    if plot.is_dir() or not plot.suffix:
        names = result_names(inputs).items()
        places = {path: {kind: plot / f"{name}.{kind}.png" for kind in kinds} for path, name in names}
    elif len(inputs) > 1 and plot.suffix in METADATA:
        raise UsageError(f"--plot {plot}: expected a folder for the figures of {len(inputs)} inputs; got a file's name")
    else:
        beside = {kind: plot.with_name(f"{plot.stem}.{kind}{plot.suffix}") for kind in kinds[1:]}
        places = {inputs[0]: {kinds[0]: plot, **beside}}
    _check_drawable([place for figures in places.values() for place in figures.values()], inputs, force=force)
    return places


def figure_file(plot: Path | None, kind: str, *, force: bool, inputs: Sequence[Path] = ()) -> Path | None:
    """The file of a command's only figure: as named, or of its kind's name in the folder named."""
    if plot is None:
        return None
    file = plot / f"{kind}.png" if plot.is_dir() or not plot.suffix else plot
    _check_drawable([file], inputs, force=force)
    return file


def _check_drawable(files: Sequence[Path], inputs: Sequence[Path], *, force: bool) -> None:
    """Refuse a suffix that is no figure's, and a figure that would replace something else."""
    from frictionlab.figures.mark import METADATA, check_figures

    for file in files:
        if file.suffix not in METADATA:
            raise UsageError(
                f"{file}: expected a figure ending in .pdf, .svg or .png, or a folder; got {file.suffix!r}"
            )
    check_figures(files, force=force, inputs=inputs)


@contextmanager
def on_disk(inputs: Iterable[Path]) -> Iterator[Files]:
    """Where inputs stand that are no files: standard input is copied, here and at once, because workers have none."""
    if STANDARD_INPUT not in inputs:
        yield {}
        return
    with tempfile.TemporaryDirectory(prefix="frictionlab-") as folder:
        file = Path(folder) / "standard_input"
        with file.open("wb") as copy:
            shutil.copyfileobj(sys.stdin.buffer, copy)
        with file.open("rb") as copied:
            is_recording = copied.read(len(HDF5)) == HDF5
        yield {STANDARD_INPUT: file.rename(file.with_suffix(".h5")) if is_recording else file}


class Rows(list[Row]):
    """The rows of the inputs that are done."""

    stopped = False  # whether Ctrl-C came before the last
    lost: LostOutputError | None = None  # why standard output took no more before the last


def report_rows(rows: Iterable[Row], *, as_json: bool) -> Rows:
    """Return all rows; with ``as_json`` print each as it comes, a line of JSON.

    Ctrl-C and a standard output that takes no more (a full disk, a pipe that was closed) end it; the rows until then
    are returned, so that the command can still write them.
    """
    seen = Rows()
    try:
        for row in rows:
            seen.append(row)
            if as_json:
                with standard_output():
                    typer.echo(json_line(row))
    except KeyboardInterrupt:
        seen.stopped = True
        complain(f"stopped: {len(seen)} inputs are done, the others are not")
    except LostOutputError as error:
        seen.lost = error
        if not error.is_closed:
            complain(f"{error}: {len(seen)} inputs are done, the others are not")
    return seen


def exit_status(rows: Iterable[Row]) -> None:
    """Leave with status 1 if some input failed (contract: 0 all well, 1 some input failed), as shells do if stopped."""
    if isinstance(rows, Rows) and rows.stopped:
        raise typer.Exit(STOPPED)
    if isinstance(rows, Rows) and rows.lost is not None:
        raise typer.Exit(rows.lost.status)
    if any(row.get("status") == FAILED for row in rows):
        raise typer.Exit(1)
