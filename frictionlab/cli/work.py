"""What commands over files share: which are meant, the way through them, what is shown of them, the exit status."""

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

from frictionlab.cli import STOPPED, LostOutputError, complain
from frictionlab.cli.options import scene_of
from frictionlab.cli.screen import Shown, print_table, print_tests, print_warnings, track
from frictionlab.errors import UsageError
from frictionlab.tables import SUFFIXES, Row, check_output, json_line, write_rows
from frictionlab.verbs.inputs import FAILED, logs_of, names_of, rows_of, scene_given

if TYPE_CHECKING:
    from frictionlab.scene import Scene
    from frictionlab.schema import Table

STANDARD_INPUT = Path("-")
HDF5 = b"\x89HDF"  # as a recording begins
Places = Mapping[Path, Mapping[str, Path]]
"""Input -> kind of figure -> its file."""
PAGE = "page"  # kind of the page of a test, beside the kinds of figures
LAG = (
    "lag_s_u of [sensors] is not declared: half a sampling interval of lag between the channels, either way, is assumed"
    " in the uncertainties"
)
BUDGET = {"quantity": "quantity", "cause": "cause", "uncertainty": "standard uncertainty", "share": "share [%]"}
_COPIES: list[tempfile.TemporaryDirectory[str]] = []  # of standard input; removed when this process ends


def logs_in(folder: Path) -> list[Path]:
    """All logs of a folder."""
    return logs_of([folder])


def recordings_in(folder: Path) -> list[Path]:
    """The recordings of a folder, or its logs where it holds none."""
    return sorted(folder.glob("*.h5")) or logs_of([folder])


def tables_in(folder: Path) -> list[Path]:
    """All tables of a folder."""
    found = [path for path in sorted(folder.iterdir()) if path.suffix in SUFFIXES]
    if not found:
        raise UsageError(f"no tables in {folder}: expected files ending in {', '.join(SUFFIXES)}")
    return found


def files_of(places: Sequence[Path], of_folder: Callable[[Path], list[Path]] | None = None) -> list[Path]:
    """The files that are meant, each once: of a pattern that no shell has opened up, all files that fit it, in order.

    A folder stands for the files that ``of_folder`` finds in it; without, for itself.

    Raises
    ------
    UsageError
        A pattern that fits nothing, or a folder without such files.
    """
    found: dict[Path, None] = {}
    for place in places:
        named = [place]
        if not place.exists() and any(sign in str(place) for sign in "*?["):
            root = place.parent if place.parent.is_dir() else Path(place.anchor)
            named = sorted(path for path in root.glob(str(place.relative_to(root))) if path.is_file())
            if not named:
                raise UsageError(f"{place}: no file fits this pattern")
        for path in named:
            found |= dict.fromkeys(of_folder(path) if of_folder is not None and path.is_dir() else [path])
    return list(found)


def result_names(logs: Sequence[Path]) -> Mapping[Path, str]:
    """A name for the results of each input that no other has; standard input has one too."""
    files = {log: Path("standard_input") if log == STANDARD_INPUT else log for log in dict.fromkeys(logs)}
    names = names_of(list(files.values()))
    return {log: names[file] for log, file in files.items()}


def figure_places(plot: Path | None, inputs: Sequence[Path], kinds: Sequence[str], *, force: bool = False) -> Places:
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
    from frictionlab.figures import FORMATS

    if plot is None:
        return {}
    if plot.is_dir() or not plot.suffix:
        names = result_names(inputs).items()
        places = {path: {kind: plot / f"{name}.{kind}.png" for kind in kinds} for path, name in names}
    elif len(inputs) > 1 and plot.suffix in FORMATS:
        raise UsageError(f"--plot {plot}: expected a folder for the figures of {len(inputs)} inputs; got a file's name")
    else:
        beside = {kind: plot.with_name(f"{plot.stem}.{kind}{plot.suffix}") for kind in kinds[1:]}
        places = {inputs[0]: {kinds[0]: plot, **beside}}
    _check_figures([place for figures in places.values() for place in figures.values()], inputs, force=force)
    return places


def figure_file(plot: Path | None, kind: str, *, force: bool, inputs: Sequence[Path] = ()) -> Path | None:
    """The file of a command's only figure: as named, or of its kind's name in the folder named."""
    if plot is None:
        return None
    file = plot / f"{kind}.png" if plot.is_dir() or not plot.suffix else plot
    _check_figures([file], inputs, force=force)
    return file


def _check_figures(files: Sequence[Path], inputs: Sequence[Path], *, force: bool) -> None:
    from frictionlab.figures import FORMATS, check_figures

    for file in files:
        if file.suffix not in FORMATS:
            expected = "a figure ending in .pdf, .svg or .png, or a folder"
            raise UsageError(f"{file}: expected {expected}; got {file.suffix!r}")
    check_figures(files, force=force, inputs=inputs)


def on_disk(path: Path) -> Path:
    """The file that holds an input: standard input is copied, here and at once, because workers have none."""
    if path != STANDARD_INPUT:
        return path
    _COPIES.append(tempfile.TemporaryDirectory(prefix="frictionlab-"))
    file = Path(_COPIES[-1].name) / "standard_input"
    with file.open("wb") as copy:
        shutil.copyfileobj(sys.stdin.buffer, copy)
    with file.open("rb") as copied:
        is_recording = copied.read(len(HDF5)) == HDF5
    return file.rename(file.with_suffix(".h5")) if is_recording else file


class Rows(list[Row]):
    """The rows of the inputs that are done."""

    ended = 0  # the exit status that follows from what came before the last


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
                typer.echo(json_line(plainly(row)))
    except KeyboardInterrupt:
        seen.ended = STOPPED
        complain(f"stopped: {len(seen)} inputs are done, the others are not")
    except LostOutputError as error:
        seen.ended = error.status
        if not error.is_closed:
            complain(f"{error}: {len(seen)} inputs are done, the others are not")
    return seen


def plainly(row: Row) -> Row:
    """A row without what it holds for the command alone, whose keys begin with a dash below."""
    return {key: value for key, value in row.items() if not key.startswith("_")}


def exit_status(rows: Iterable[Row]) -> None:
    """Leave with status 1 if some input failed (contract: 0 all well, 1 some input failed), as shells do if stopped."""
    status = rows.ended if isinstance(rows, Rows) else 0
    if status or any(row.get("status") == FAILED for row in rows):
        raise typer.Exit(status or 1)


@dataclass(frozen=True)
class _One:
    """What is done to one input, here or where a worker is: its row is made, and what is to be drawn of it is drawn."""

    job: Callable[[Path, Path], tuple[Row, Mapping[str, object]]]
    files: Mapping[Path, Path]
    places: Places
    scene: "Scene"
    force: bool

    def __call__(self, path: Path) -> Row:
        row, drawn = self.job(path, self.files[path])
        for kind, place in self.places.get(path, {}).items():
            result: Any = drawn.get(kind)
            if result is not None:
                from frictionlab.verbs.presenting import plot, sheet

                if kind == PAGE:
                    sheet(result, self.files[path], place, self.scene, force=self.force)
                else:
                    plot(result, place, title=path.name, force=self.force)
        return {**row, "source": str(path)}


@dataclass(frozen=True, kw_only=True)
class Work:
    """The options that commands over many inputs share, and the way through these."""

    as_json: bool = False
    quiet: bool = False
    scene: Path | None = None
    verbose: bool = False
    workers: int | None = None
    scheduler: str | None = None

    def scene_for(self, first: Path | None, settings: Mapping[str, object], tables: tuple[str, ...]) -> "Scene":
        """The scene, with what the command line says in place of its keys."""
        return scene_given(scene_of(self.scene, beside=first, quiet=self.quiet or self.as_json), settings, tables)

    def rows(
        self,
        inputs: Sequence[Path],
        job: Callable[[Path, Path], tuple[Row, Mapping[str, object]]],
        title: str,
        scene: "Scene",
        places: Places | None = None,
        *,
        force: bool = False,
        silent: bool = False,
        watched: bool = True,
    ) -> Rows:
        """The rows of all inputs; those of --json are printed unless ``silent``.

        ``job`` gives, of an input and the file that holds it (not itself for standard input), the row, and by kind
        what is drawn of it at its places. Keys that begin with a dash below are for the command alone.
        """
        one = _One(job, {path: on_disk(path) for path in inputs}, places or {}, scene, force)
        made = rows_of(inputs, one, workers=self.workers, scheduler=self.scheduler)
        quiet = self.quiet or self.as_json or not watched
        return report_rows(
            track(made, total=len(inputs), title=title, quiet=quiet), as_json=self.as_json and not silent
        )


@dataclass(frozen=True, kw_only=True)
class ManyInputs(Work):
    """The options of commands over recordings, and what they do with the rows."""

    output: Path | None = None
    plot: Path | None = None
    wide: bool = False
    force: bool = False

    def places(self, inputs: Sequence[Path], scene: "Scene", table: "Table", kinds: Sequence[str]) -> Places:
        """Where the figures go; refuses outputs that would replace something else, before the work."""
        if self.output is not None:
            check_output(self.output, table, force=self.force, inputs=[*inputs, *scene.files])
        return figure_places(self.plot, inputs, kinds, force=self.force)

    def write(self, rows: Sequence[Row], inputs: Sequence[Path], scene: "Scene", table: "Table", **more: Any) -> None:
        """Write the table, where one is asked for."""
        if self.output is not None:
            read = [*inputs, *scene.files]
            write_rows([plainly(row) for row in rows], self.output, table, force=self.force, inputs=read, **more)

    def show(
        self, rows: Sequence[Row], table: "Table", columns: Sequence[Shown], scene: "Scene", *, noun: str
    ) -> list[Row]:
        """Print the table and its warnings, unless JSON was printed; return the rows that did not fail."""
        if self.as_json:
            return []
        seen: list[Row] = [{key.removeprefix("_"): value for key, value in row.items()} for row in rows]
        good = [row for row in seen if row.get("status") == "ok"]
        if good and self.wide:
            print_table(good, table)
            print_tests([row for row in seen if row.get("status") != "ok"], columns, "")
        else:
            print_tests(seen, columns, headline(seen, noun))
        if not self.quiet:
            print_warnings(seen, verbose=self.verbose, notes=assumed(scene, good))
        return good


@dataclass(frozen=True, kw_only=True)
class Judged(ManyInputs):
    """The options of analyze, compare-numeric and explain."""

    budget: bool = False
    accuracy: Literal["fast", "balanced", "exact"] | None = None

    def scene_for(self, first: Path | None, settings: Mapping[str, object], tables: tuple[str, ...]) -> "Scene":
        """The scene, its knobs set to the level of accuracy."""
        scene = super().scene_for(first, settings, tables)
        return scene if self.accuracy is None else scene.with_accuracy(self.accuracy)

    def show(
        self, rows: Sequence[Row], table: "Table", columns: Sequence[Shown], scene: "Scene", *, noun: str
    ) -> list[Row]:
        """The table, then the budget of each row: cause, standard uncertainty, its share of the combined variance."""
        good = super().show(rows, table, columns, scene, noun=noun)
        for row in good if self.budget else ():
            budget: Any = row.get("budget")
            if budget:
                typer.echo(f"\n{row['source']}: what adds to the uncertainty")
                print_table(list(_causes(budget)), BUDGET, elsewhere="--json gives")
        return good


def headline(rows: Sequence[Row], noun: str) -> str:
    """How many inputs went well, and the law where it is one for all."""
    good = [row for row in rows if row.get("status") == "ok"]
    laws = {row.get("law") for row in good} - {None}
    law = f", law {laws.pop()}" if len(laws) == 1 else ""
    return f"{len(good)} of {len(rows)} {noun}{law}"


def assumed(scene: "Scene", good: Sequence[Row]) -> list[str]:
    """What the uncertainties assume that nobody declared."""
    moved = [row.get("nuisances") or {"lag_s": None} for row in good]
    lags = any(isinstance(names, Mapping) and "lag_s" in names for names in moved)  # a table over frequency has none
    return [LAG] if lags and scene.sensors.lag_s_u is None else []


def _causes(budget: Mapping[str, Mapping[str, float]]) -> Iterator[Row]:
    for quantity, causes in budget.items():
        variance = sum(size**2 for size in causes.values())
        for cause, size in causes.items():
            share = 100.0 * size**2 / variance if variance else 0.0
            yield {"quantity": quantity, "cause": cause, "uncertainty": size, "share": float(f"{share:.3g}")}
