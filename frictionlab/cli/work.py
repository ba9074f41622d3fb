"""What commands over files share: which are meant, the way through them, what a screen shows, the exit status."""

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

from frictionlab.cli import STOPPED, LostOutputError, complain
from frictionlab.cli.options import Results, scene_of
from frictionlab.cli.screen import Shown, print_table, print_tests, print_warnings, track
from frictionlab.errors import UsageError
from frictionlab.tables import Row, check_output, json_line, write_rows
from frictionlab.tables.texts import with_error
from frictionlab.verbs.inputs import FAILED, logs_of, names_of, rows_of, scene_given

if TYPE_CHECKING:
    from frictionlab.scene import Scene
    from frictionlab.schema import Table

STANDARD_INPUT = Path("-")
HDF5 = b"\x89HDF"  # as a recording begins
Figures = Mapping[Path, Mapping[str, Path]]
"""Input -> kind of figure -> its file."""
HIDDEN = "of the command"  # key of what travels with a row for the command alone
LAG = (
    "lag_s_u of [sensors] is not declared: half a sampling interval of lag between the channels, either way, is assumed"
    " in the uncertainties"
)
BUDGET = {"quantity": "quantity", "cause": "cause", "uncertainty": "standard uncertainty", "share": "share [%]"}


def expanded(logs: Sequence[Path], *, recordings: bool = False) -> list[Path]:
    """The logs that are meant, each once: of a folder all logs in it, of a pattern all files that fit it, in order.

    With ``recordings`` a folder's recordings are meant where it holds any.

    Raises
    ------
    UsageError
        A folder without logs, or a pattern that fits nothing.
    """
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
def on_disk(inputs: Iterable[Path]) -> Iterator[Mapping[Path, Path]]:
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
                typer.echo(json_line(row))
    except KeyboardInterrupt:
        seen.ended = STOPPED
        complain(f"stopped: {len(seen)} inputs are done, the others are not")
    except LostOutputError as error:
        seen.ended = error.status
        if not error.is_closed:
            complain(f"{error}: {len(seen)} inputs are done, the others are not")
    return seen


def exit_status(rows: Iterable[Row]) -> None:
    """Leave with status 1 if some input failed (contract: 0 all well, 1 some input failed), as shells do if stopped."""
    status = rows.ended if isinstance(rows, Rows) else 0
    if status or any(row.get("status") == FAILED for row in rows):
        raise typer.Exit(status or 1)


def _on_file(path: Path, job: Callable[[Path, Path], Row], files: Mapping[Path, Path]) -> Row:
    return job(path, files.get(path, path))


@dataclass(frozen=True, kw_only=True)
class ManyInputs(Results):
    """The options that commands over recordings share, and what they do with the rows."""

    scene: Path | None = None
    wide: bool = False
    verbose: bool = False
    workers: int | None = None
    scheduler: str | None = None

    def scene_for(self, first: Path, settings: Mapping[str, object], tables: tuple[str, ...]) -> "Scene":
        """The scene, with what the command line says in place of its keys."""
        found = scene_of(self.scene, beside=first, quiet=self.quiet or self.as_json)
        return scene_given(found, settings, tables)

    def places(self, inputs: Sequence[Path], scene: "Scene", table: "Table", kinds: Sequence[str]) -> Figures | None:
        """Where the figures go; refuses outputs that would replace something else, before the work."""
        if self.output is not None:
            check_output(self.output, table, force=self.force, inputs=[*inputs, *scene.files])
        return figure_places(self.plot, inputs, kinds, force=self.force)

    def rows(
        self, inputs: Sequence[Path], job: Callable[[Path, Path], Row], title: str, *, silent: bool = False
    ) -> tuple[Rows, list[Row]]:
        """The rows of all inputs, and the same with what the command alone sees (`HIDDEN`).

        ``job`` makes a row of an input and the file that holds it, which is not itself for standard input.
        """
        shown: list[Row] = []

        def parted(made: Iterable[Row]) -> Iterator[Row]:
            for row in made:
                plain = {key: value for key, value in row.items() if key != HIDDEN}
                more = row.get(HIDDEN)
                shown.append({**plain, **more} if isinstance(more, Mapping) else plain)
                yield plain

        with on_disk(inputs) as files:
            made = rows_of(
                inputs, partial(_on_file, job=job, files=files), workers=self.workers, scheduler=self.scheduler
            )
            watched = track(made, total=len(inputs), title=title, quiet=self.quiet or self.as_json)
            rows = report_rows(parted(watched), as_json=self.as_json and not silent)
        return rows, shown

    def write(self, rows: Sequence[Row], inputs: Sequence[Path], scene: "Scene", table: "Table", **more: Any) -> None:
        """Write the table, where one is asked for."""
        if self.output is not None:
            write_rows(rows, self.output, table, force=self.force, inputs=[*inputs, *scene.files], **more)

    def show(
        self, rows: Sequence[Row], table: "Table", columns: Sequence[Shown], scene: "Scene", *, noun: str
    ) -> list[Row]:
        """Print the table and its warnings, unless JSON was printed; return the rows that did not fail."""
        if self.as_json:
            return []
        good = [row for row in rows if row.get("status") == "ok"]
        if good and self.wide:
            print_table(good, table)
            print_tests([row for row in rows if row.get("status") != "ok"], columns, "")
        else:
            print_tests(rows, columns, headline(rows, noun))
        if not self.quiet:
            print_warnings(rows, verbose=self.verbose, notes=assumed(scene, good))
        return good


@dataclass(frozen=True, kw_only=True)
class Judged(ManyInputs):
    """The options of analyze, compare-numeric and explain."""

    budget: bool = False
    accuracy: Literal["fast", "balanced", "exact"] | None = None

    def scene_for(self, first: Path, settings: Mapping[str, object], tables: tuple[str, ...]) -> "Scene":
        """The scene, its knobs set to the level of accuracy."""
        scene = super().scene_for(first, settings, tables)
        return scene if self.accuracy is None else scene.with_accuracy(self.accuracy)

    def show(
        self, rows: Sequence[Row], table: "Table", columns: Sequence[Shown], scene: "Scene", *, noun: str
    ) -> list[Row]:
        """The table, then the budget of each row: cause, standard uncertainty, its share of the combined variance."""
        good = super().show(rows, table, columns, scene, noun=noun)
        for row in good if self.budget else ():
            budget = row.get("budget")
            if isinstance(budget, Mapping):
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


def _causes(budget: Mapping[str, Mapping[str, float]]) -> Iterable[Row]:
    for quantity, causes in budget.items():
        variance = sum(size**2 for size in causes.values())
        for cause, size in causes.items():
            share = 100.0 * size**2 / variance if variance else 0.0
            yield {"quantity": quantity, "cause": cause, "uncertainty": size, "share": float(f"{share:.3g}")}


def _scaled(unit: str, title: str, key: str, factor: Callable[[Row], float | None], keep: int) -> tuple[Shown, Shown]:
    """A number with its uncertainty in physical units, and beside it dimensionless where those are not known."""

    def text(row: Row, *, physical: bool) -> str:
        times = factor(row)
        return with_error(row.get(key), row.get(f"{key}_u"), times or 1.0) if physical == (times is not None) else "-"

    plain = "kY²" if title == "E" else "Y"
    return (
        Shown(f"{title} [{unit}]", partial(text, physical=True), keep),
        Shown(f"{title} [{plain}]", partial(text, physical=False), keep),
    )


def _millijoules(row: Row) -> float | None:
    joules, plain = row.get("energy_per_cycle_j"), row.get("energy_per_cycle")
    return 1e3 * joules / plain if isinstance(joules, float) and isinstance(plain, float) and plain else None


def _millimetres(row: Row) -> float | None:
    base = row.get("base_amplitude_m")
    return 1e3 * base if isinstance(base, float) else None


def _word(title: str, key: str, keep: int, form: str = ".3g") -> Shown:
    """A text or a plain number of a row."""

    def text(row: Row) -> str:
        value = row.get(key)
        return "-" if value is None else f"{value:{form}}" if isinstance(value, float) else str(value)

    return Shown(title, text, keep)


def _known(title: str, key: str, keep: int) -> Shown:
    """A number of a row with its combined uncertainty."""
    return Shown(title, lambda row: with_error(row.get(key), row.get(f"{key}_u")), keep)


_R, _ENERGY = _word("r", "frequency_ratio", 9, ".3f"), _scaled("mJ", "E", "energy_per_cycle", _millijoules, 9)
MEASURED = (
    *(_R, *_ENERGY, *_scaled("mm", "X", "response_amplitude", _millimetres, 7)),
    *(_word("stops", "stops_per_cycle", 5), _word("regime", "regime", 8)),
)
COMPARED = (
    *(_R, *_ENERGY, _known("beta", "friction_ratio", 4)),
    *(_known("F [N]", "friction_force_n", 5), _known("mu", "friction_coefficient", 8)),
    *(_word("law", "law", 6), _word("verdict", "verdict", 9)),
)
