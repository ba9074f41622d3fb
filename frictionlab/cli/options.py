"""Options that several commands share: the same name, meaning and words everywhere; and how their texts are read."""

import csv
import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer

from frictionlab.cli import MORE, complain
from frictionlab.errors import UsageError
from frictionlab.log_options import LogOptions
from frictionlab.tables import Row, check_output, write_rows
from frictionlab.tables.texts import few_of, kinds_of

if TYPE_CHECKING:
    from frictionlab.cli.screen import Rows, Shown
    from frictionlab.scene import Scene
    from frictionlab.schema import Table


def complete_law(begun: str) -> list[str]:
    """Laws that begin so, for the completion of a shell: a term may follow a plus."""
    from frictionlab.simulator.laws import TERMS

    before, plus, last = begun.rpartition("+")
    return [f"{before}{plus}{term}" for term in ("auto", *TERMS) if term.startswith(last)]


@dataclass(frozen=True)
class Words:
    """An option or argument: its flags (none: an argument), what it takes, the least value, and what it does.

    Options that are ``more`` stand in the help of ``--help-all`` alone.
    """

    flags: str
    takes: str
    least: str
    more: bool
    words: str

    def declared(self, hint: Any) -> Any:
        """The option or argument of this type as Typer takes it."""
        kind = next((kind for kind in (Path, float, int, str) if kind in {hint, *_parts(hint)}), None)
        how: dict[str, Any] = {"metavar": self.takes or None, "help": self.words}
        if kind is not None:
            least = float(self.least) if self.least else None
            how["parser"] = partial(value_of, kind=kind, least=least, is_option=bool(self.flags))
        if not self.flags:
            return typer.Argument(**how)
        complete = complete_law if self.takes == "LAW" else None
        panel = MORE if self.more else None
        return typer.Option(*self.flags.split(), **how, autocompletion=complete, rich_help_panel=panel)


def _parts(hint: Any) -> set[Any]:
    """What a type is made of: a list's members, the sides of a union."""
    return {each for part in get_args(hint) for each in (part, *_parts(part))}


def value_of(said: Any, *, kind: Any, least: float | None = None, is_option: bool = False) -> Any:
    """The value of a word on the command line; ValueError: what was expected. Python takes ``1_0`` as a number."""
    text = str(said)
    if not text:
        raise ValueError("expected a name or a value; got an empty one: is a variable of the shell not set?")
    if kind is Path and is_option and text.startswith("-"):
        raise ValueError(f"expected a name; got {text!r}, which looks like an option: if it is meant, give ./{text}")
    if kind not in (int, float):
        return kind(text)
    try:
        value = kind(text if text.isascii() and "_" not in text else "")
    except ValueError as error:
        raise ValueError(f"expected a {'whole ' * (kind is int)}number; got {text!r}") from error
    if least is not None and not value >= least:
        raise ValueError(f"expected {least:g} or more; got {text!r}")
    return value


with Path(__file__).with_name("options.csv").open(encoding="utf-8", newline="") as _file:
    WORDS = {
        f"{command}.{name}".lstrip("."): Words(flags, takes, least, more == "yes", words)
        for command, name, flags, takes, least, more, words in list(csv.reader(_file))[1:]
    }
"""The options, by PARAMETER or, where one means its own thing, COMMAND.PARAMETER."""
Settings = Mapping[str, tuple[type, Words]]
"""Keys of a scene's table that a command takes as options: what each takes, and its option."""
NO_SHEET = "a sheet of facts that the scene does not name: [experiment] sheet"
FEW = ("mass", "base", "contact_force", "units", "variable", "test")  # options of a log that its short help shows


def _log_settings() -> dict[str, tuple[type, Words]]:
    """All of ``[log]``: an option is the key without its unit, ``sampling_rate_hz`` is ``--sampling-rate``."""
    found: dict[str, tuple[type, Words]] = {}
    for name, field in LogOptions.model_fields.items():
        extra: Any = field.json_schema_extra
        takes, words = extra["takes"], field.description or ""
        stem = name.removesuffix(f"_{takes.lower()}") if takes in ("HZ", "S", "M") else name
        said = str(field.annotation)
        kind = float if "float" in said else list[str] if "dict" in said else str
        found[name] = (kind, Words(f"--{stem.replace('_', '-')}", takes, "", name not in FEW, words))
    return found


LOG: Settings = _log_settings()
_ANALYSIS = {"natural_frequency_hz": float, "transient_s": float, "cycles": str, "padding": int, "accuracy": str}
ANALYSIS: Settings = {key: (kind, WORDS[key]) for key, kind in _ANALYSIS.items()}
LogSettings = Annotated[Mapping[str, object], LOG]
AnalysisSettings = Annotated[Mapping[str, object], ANALYSIS]
"""Of a command's parameter ``settings``: it gets what was said of the keys that its options stand for."""


def with_options(name: str, command: Callable[..., None]) -> Callable[..., None]:
    """The command as Typer reads it: each parameter with its words, ``settings`` and groups of options opened up.

    A parameter that is a dataclass stands for the options that its fields are.
    """
    own = inspect.signature(command)
    hints = get_type_hints(command, include_extras=True)
    groups = {key: hints[key] for key in own.parameters if is_dataclass(hints[key])}
    settings: Settings = hints["settings"].__metadata__[0] if "settings" in hints else {}

    @wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        if settings:
            said = {key: kwargs.pop(key, None) for key in settings}
            kwargs["settings"] = {
                key: ", ".join(value) if isinstance(value, list) else value
                for key, value in said.items()
                if value is not None
            }
        for key, group in groups.items():
            kwargs[key] = group(**{f.name: kwargs.pop(f.name) for f in fields(group) if f.name in kwargs})
        command(*args, **kwargs)

    opened: list[tuple[str, Any, object, Words | None]] = []
    for key, parameter in own.parameters.items():
        if key in groups:
            inner = get_type_hints(groups[key])
            opened += [(f.name, inner[f.name], f.default, None) for f in fields(groups[key])]
        elif key == "settings":
            opened += [(each, kind | None, None, words) for each, (kind, words) in settings.items()]
        else:
            opened.append((key, hints[key], parameter.default, None))
    mine = []
    for key, hint, default, words in opened:
        declared = (words or WORDS.get(f"{name}.{key}") or WORDS[key]).declared(hint)
        annotated: Any = Annotated[hint, declared]
        mine.append(inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotated))
    run.__signature__ = own.replace(parameters=mine)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in mine} | {"return": None}
    return run


@dataclass(frozen=True, kw_only=True)
class Results:
    """Where the results of a command go, and how much it says."""

    output: Path | None = None
    as_json: bool = False
    force: bool = False
    quiet: bool = False


@dataclass(frozen=True, kw_only=True)
class Drawn(Results):
    """The same of a command that draws one figure."""

    plot: Path | None = None

    def figure(self, kind: str, inputs: Sequence[Path] = ()) -> Path | None:
        """The file of a command's only figure: as named, or of its kind's name in the folder named."""
        if self.plot is None:
            return None
        from frictionlab.figures import check_figures

        file = self.plot / f"{kind}.png" if self.plot.is_dir() or not self.plot.suffix else self.plot
        check_figures([file], force=self.force, inputs=inputs)
        return file

    def draw(self, found: object, figure: Path | None) -> None:
        """Draw a result into that file, if there is one."""
        if figure is not None:
            from frictionlab.figures import plot

            plot(found, figure, force=self.force)


def scene_of(path: Path | None, *, beside: Path | None = None, quiet: bool = False) -> "Scene":
    """The scene of a command: the file given, else one found in the working folder or ``beside`` the first input.

    That it was found is said, unless ``quiet``; where there is none all is default.
    """
    from frictionlab.scene import Scene, find_scene, read_scene

    found = find_scene(beside) if path is None else path
    if path is None and found is not None and not quiet:
        complain(
            f"scene: {found} is used (found in the working folder or beside the input); --scene FILE takes another"
        )
    return Scene() if found is None else read_scene(found)


Made = tuple[Row, Mapping[str, object]]
"""The row of an input, and by kind of figure what is drawn of it."""
Job = Callable[[Path], Made]
Places = Mapping[Path, Mapping[str, Path]]
"""Input -> kind of figure -> its file."""


def _done(path: Path, *, job: Job, places: Places, force: bool) -> Row:
    """Do the job on one input, here or where a worker is, and draw what is to be drawn of it."""
    from frictionlab.figures import plot

    row, drawn = job(path)
    wanted = places.get(path, {})
    results = [(result, place) for kind, place in wanted.items() if (result := drawn.get(kind)) is not None]
    for kind, place in list(wanted.items())[:1]:
        if len(results) == 1 and not place.stem.endswith(f".{kind}"):  # a file was named: of the one figure there is
            results = [(results[0][0], place)]
    for result, place in results:
        plot(result, place, title=path.name, force=force)
    return {**row, "source": str(path), "_figures": [str(place) for _, place in results]}


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """The options that commands over many inputs share, and the way through these."""

    as_json: bool = False
    quiet: bool = False
    scene: Path | None = None
    verbose: bool = False
    workers: int | None = None
    scheduler: str | None = None

    def scene_for(self, first: Path | None, settings: Mapping[str, object], tables: tuple[str, ...]) -> "Scene":
        """The scene, with what the command line says in place of its keys."""
        from frictionlab.verbs.inputs import scene_given

        return scene_given(scene_of(self.scene, beside=first, quiet=self.quiet or self.as_json), settings, tables)

    def note_not_read(self, places: Sequence[Path], scene: "Scene") -> None:
        """Say which files of these folders look like data and are passed over, and which the sheet alone names."""
        from frictionlab.experiment import rows_without_log
        from frictionlab.verbs.inputs import not_read_in, sheets_in

        if self.quiet or self.as_json:
            return
        sheets = {path: NO_SHEET for path in sheets_in(places) if path.name != Path(scene.experiment.sheet or "").name}
        for reason, names in kinds_of((path.name, why) for path, why in (not_read_in(places) | sheets).items()):
            complain(f"note: passed over: {few_of(names)}: {reason}")
        if lost := rows_without_log(scene, places):
            complain(f"note: rows of {scene.experiment.sheet} without a log, {len(lost)} in all: {few_of(lost)}")

    def rows(
        self,
        inputs: Sequence[Path],
        job: Job,
        title: str,
        places: Places | None = None,
        *,
        force: bool = False,
        silent: bool = False,
    ) -> "Rows":
        """The rows of all inputs; those of --json are printed unless ``silent``. Keys in _ are the command's own."""
        from frictionlab.cli.screen import each_of, report_rows, track
        from frictionlab.verbs.inputs import rows_of

        one = partial(_done, job=job, places=places or {}, force=force)
        made = rows_of(inputs, one, workers=self.workers, scheduler=self.scheduler)
        watching = track(made, total=len(inputs), title=title, quiet=self.quiet or self.as_json)
        rows = report_rows(watching, as_json=self.as_json and not silent)
        drawn = [figure for row in rows for figure in each_of(row.get("_figures"))]
        if drawn and not (self.quiet or self.as_json):
            complain(f"drawn: {', '.join(drawn[:3])}{f', ... {len(drawn)} figures' * (len(drawn) > 3)}")
        return rows


@dataclass(frozen=True, kw_only=True)
class ManyInputs(Inputs, Drawn):
    """The options of commands over recordings, and what they do with the rows."""

    wide: bool = False

    def places(self, inputs: Sequence[Path], scene: "Scene", table: "Table", kinds: Sequence[str]) -> Places:
        """Where the figures go; refuses outputs that would replace something else, before the work."""
        if self.output is not None:
            check_output(self.output, table, force=self.force, inputs=[*inputs, *scene.files])
        plot = self.plot
        if plot is None:
            return {}
        from frictionlab.figures import check_figures
        from frictionlab.verbs.inputs import names_of

        if plot.is_dir() or not plot.suffix:
            places = {path: {kind: plot / f"{n}.{kind}.png" for kind in kinds} for path, n in names_of(inputs).items()}
        elif len(inputs) > 1:
            raise UsageError(f"--plot {plot}: expected a folder for figures of {len(inputs)} inputs; got a file's name")
        else:  # the first kind of figure is the file, the others stand beside it
            beside = {kind: plot.with_name(f"{plot.stem}.{kind}{plot.suffix}") for kind in kinds[1:]}
            places = {inputs[0]: {kinds[0]: plot, **beside}}
        files = [file for figures in places.values() for file in figures.values()]
        check_figures(files, inputs=inputs, force=self.force)
        return places

    def write(self, rows: Sequence[Row], inputs: Sequence[Path], scene: "Scene", table: "Table", **more: Any) -> None:
        """Write the table, where one is asked for."""
        if self.output is not None:
            kept = [{key: value for key, value in row.items() if key[0] != "_"} for row in rows]
            write_rows(kept, self.output, table, force=self.force, inputs=[*inputs, *scene.files], **more)

    def show(
        self, rows: Sequence[Row], table: "Table", columns: "Sequence[Shown]", scene: "Scene", *, noun: str
    ) -> list[Row]:
        """Print the table and its warnings, unless JSON was printed; return the rows that did not fail."""
        from frictionlab.cli.screen import assumed, headline, print_tests, print_warnings

        if self.as_json:
            return []
        seen: list[Row] = [{key.removeprefix("_"): value for key, value in row.items()} for row in rows]
        good = [row for row in seen if row.get("status") == "ok"]
        print_tests(seen, columns, headline(seen, noun), table if self.wide else None)
        if not self.quiet:
            print_warnings(seen, verbose=self.verbose, notes=assumed(scene, good))
        return good


@dataclass(frozen=True, kw_only=True)
class Judged(ManyInputs):
    """The options of analyze, compare-numeric and explain."""

    budget: bool = False


MOST_VALUES = 10_000_000
LARGEST_BASE = 0.2  # m
NEARLY = 1e-9  # of a step: how far the last value may lie beyond the end
SAME_AS = {"mu": ("static_ratio_up", "static_ratio_down", "static_ratio"), "zeta": ("contact_damping_ratio",)}


def named_values(said: Sequence[str] | None, given: Mapping[str, object]) -> dict[str, str]:
    """What each ``--parameter NAME=VALUE`` says, by name; ``given``: what ``--mu`` and ``--zeta`` say, or None."""
    values: dict[str, str] = {}
    for text in said or ():
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise UsageError(f"--parameter: expected NAME=VALUE; got {text!r}")
        if name == "beta":
            raise UsageError(f"--parameter beta: it has an option of its own: give --beta {value}")
        if name in values:
            raise UsageError(f"--parameter {name}: given twice; expected one value")
        values[name] = value
    for option, names in SAME_AS.items():
        for name in values if given.get(option) is not None else ():
            if name in names:
                raise UsageError(f"--{option} and --parameter {name} say the same: leave one out")
    return values


def doubt_amplitude(metres: float | None) -> None:
    """Say of a base amplitude that no bench has that it may be in millimetres."""
    if metres is not None and metres > LARGEST_BASE:
        complain(f"warning: --base-amplitude {metres:g}: metres are meant; {metres:g} mm are {1e-3 * metres:g}")


def check_law(law: str | None) -> None:
    """Refuse a law that does not exist, before the work."""
    from frictionlab.simulator.laws import law_of

    if law is not None and law != "auto":
        law_of(law)


def number_of(text: str, option: str) -> float:
    """The number that a text is."""
    try:
        return float(value_of(text, kind=float))
    except ValueError as error:
        raise UsageError(f"{option}: {error}") from error


def values_of(text: str, option: str) -> list[float]:
    """Read a list ``0.1,0.2`` or a range ``START:STOP:STEP`` with both ends; decimal, so that 0.3 is 0.3."""
    try:
        if re.fullmatch(r"\d+,\d+", text):
            first, last = text.split(",")
            complain(f"warning: {option}: {first} and {last} are two values; a decimal is written {first}.{last}")
        if ":" not in text:
            return [value_of(part, kind=float) for part in text.split(",")]
        start, stop, step = (value_of(part.strip(), kind=float) for part in text.split(":"))
        number = math.floor((stop - start) / step + NEARLY) + 1
    except (ArithmeticError, ValueError) as error:
        raise UsageError(f"{option}: expected a list 0.1,0.2 or a range START:STOP:STEP; got {text!r}") from error
    if not 0 < number <= MOST_VALUES or step <= 0.0 or stop < start or (number == 1 and stop > start):
        raise UsageError(
            f"{option}: expected START:STOP:STEP, going up, of at most {MOST_VALUES} values;"
            f" got {text!r}, whose step is {step:g}"
        )
    return [float(f"{start + i * step:.14g}") for i in range(number)]
