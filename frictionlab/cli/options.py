"""Options that several commands share: the same name, meaning and words everywhere; and how their texts are read."""

import csv
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from decimal import Decimal
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from frictionlab.cli import MORE, complain
from frictionlab.errors import UsageError
from frictionlab.log_options import LogOptions

if TYPE_CHECKING:
    from frictionlab.scene import Scene


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

    def declared(self) -> Any:
        """The option or argument as Typer takes it."""
        takes, least = self.takes or None, float(self.least) if self.least else None
        if not self.flags:
            return typer.Argument(metavar=takes, help=self.words)
        complete = complete_law if takes == "LAW" else None
        panel = MORE if self.more else None
        return typer.Option(
            *self.flags.split(),
            metavar=takes,
            min=least,
            help=self.words,
            autocompletion=complete,
            rich_help_panel=panel,
        )


def _read_words() -> dict[str, Words]:
    """The list of options, ``options.csv``, by PARAMETER or, where it means its own thing, COMMAND.PARAMETER."""
    with Path(__file__).with_name("options.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    return {
        f"{command}.{name}".lstrip("."): Words(flags, takes, least, more == "yes", words)
        for command, name, flags, takes, least, more, words in rows
    }


WORDS = _read_words()
Settings = Mapping[str, tuple[type, Words]]
"""Keys of a scene's table that a command takes as options: what each takes, and its option."""
FEW = ("mass", "base", "contact_force", "units", "variable", "test")  # options of a log that its short help shows


def _log_settings() -> dict[str, tuple[type, Words]]:
    """All of ``[log]``: an option is the key without its unit, ``sampling_rate_hz`` is ``--sampling-rate``."""
    found: dict[str, tuple[type, Words]] = {}
    for f in fields(LogOptions):
        metavar = f.metadata["metavar"]
        stem = f.name.removesuffix(f"_{metavar.lower()}") if metavar in ("HZ", "S", "M") else f.name
        flag = f"--{stem.replace('_', '-')}"
        kind = float if "float" in str(f.type) else str
        found[f.name] = (kind, Words(flag, metavar, "", f.name not in FEW, f.metadata["words"]))
    return found


LOG: Settings = _log_settings()
_ANALYSIS = {"natural_frequency_hz": float, "transient_s": float, "cycles": str, "padding": int}
ANALYSIS: Settings = {key: (kind, WORDS[key]) for key, kind in _ANALYSIS.items()}


def takes(settings: Settings) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command these options of a scene's keys: it gets what was said as its parameter ``settings``."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        command.settings = settings  # type: ignore[attr-defined]
        return command

    return decorate


def with_options(name: str, command: Callable[..., None]) -> Callable[..., None]:
    """The command as Typer reads it: each parameter with its words, ``settings`` and groups of options opened up.

    A parameter that is a dataclass stands for the options that its fields are.
    """
    own = inspect.signature(command)
    hints = get_type_hints(command, include_extras=True)
    groups = {key: hints[key] for key in own.parameters if is_dataclass(hints[key])}
    settings: Settings = getattr(command, "settings", {})

    @wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        if settings:
            said = {key: kwargs.pop(key, None) for key in settings}
            kwargs["settings"] = {key: value for key, value in said.items() if value is not None}
        for key, group in groups.items():
            kwargs[key] = group(**{f.name: kwargs.pop(f.name) for f in fields(group) if f.name in kwargs})
        command(*args, **kwargs)

    mine: list[inspect.Parameter] = []

    def add(key: str, hint: Any, default: object, words: Words) -> None:
        annotated: Any = Annotated[hint, words.declared()]
        mine.append(inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotated))

    for key, parameter in own.parameters.items():
        if key in groups:
            inner = get_type_hints(groups[key])
            for f in fields(groups[key]):
                add(f.name, inner[f.name], f.default, WORDS.get(f"{name}.{f.name}") or WORDS[f.name])
        elif key == "settings":
            for each, (kind, words) in settings.items():
                add(each, kind | None, None, words)
        else:
            add(key, hints[key], parameter.default, WORDS.get(f"{name}.{key}") or WORDS[key])
    run.__signature__ = own.replace(parameters=mine)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in mine} | {"return": None}
    return run


@dataclass(frozen=True, kw_only=True)
class Results:
    """Where the results of a command go, and how much it says."""

    output: Path | None = None
    plot: Path | None = None
    as_json: bool = False
    force: bool = False
    quiet: bool = False


def scene_of(path: Path | None, *, beside: Path | None = None, quiet: bool = False) -> "Scene":
    """The scene of a command: the file given, else one that is found, else all defaults.

    Parameters
    ----------
    path
        What ``--scene`` says.
    beside
        The first input: ``frictionlab.toml`` is looked for in the working folder, then beside it, and said to be used.
    quiet
        Do not say it.
    """
    from frictionlab.scene import Scene, find_scene, read_scene

    found = find_scene(beside) if path is None else path
    if path is None and found is not None and not quiet:
        complain(
            f"scene: {found} is used (found in the working folder or beside the input); --scene FILE takes another"
        )
    return Scene() if found is None else read_scene(found)


MOST_VALUES = 10_000_000
NEARLY = Decimal("1e-12")  # how far a factor's last value may lie beyond the end
SAME_AS = {"mu": ("static_ratio_up", "static_ratio_down", "static_ratio"), "zeta": ("contact_damping_ratio",)}


def named_values(said: Sequence[str] | None, given: Mapping[str, object]) -> dict[str, str]:
    """What each ``--parameter NAME=VALUE`` says, by name; ``given``: what ``--mu`` and ``--zeta`` say, or None.

    Raises
    ------
    UsageError
        One has no ``=``, stands twice, or has an option of its own.

    Examples
    --------
    >>> named_values(["gradient=0.05"], {})
    {'gradient': '0.05'}
    """
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


def check_law(law: str | None) -> None:
    """Refuse a law that does not exist, before the work."""
    from frictionlab.simulator.laws import law_of

    if law is not None and law != "auto":
        law_of(law)


def number_of(text: str, option: str) -> float:
    """The number that a text is, in ASCII digits; Python alone would take ``1_0`` and Arabic digits too."""
    try:
        return float(text if is_plain(text) else "")
    except ValueError as error:
        raise UsageError(f"{option}: expected a number; got {text!r}") from error


def is_plain(text: str) -> bool:
    """Whether a text may be a number as people write it."""
    return text.isascii() and "_" not in text


def values_of(text: str, option: str) -> list[float]:
    """Read a list ``0.1,0.2`` or a range ``START:STOP:STEP`` with both ends; decimal, so that 0.3 is 0.3.

    A step that begins with x is a factor.

    Examples
    --------
    >>> values_of("0.1:0.4:0.1", "--beta"), values_of("0.5,1", "--r"), values_of("10:1e4:x10", "--parameter kappa")
    ([0.1, 0.2, 0.3, 0.4], [0.5, 1.0], [10.0, 100.0, 1000.0, 10000.0])
    """
    try:
        said = text if is_plain(text) else ""
        if ":" not in said:
            return [float(Decimal(part)) for part in said.split(",")]
        first, last, by = (part.strip() for part in said.split(":"))
        start, stop, step = Decimal(first), Decimal(last), Decimal(by.removeprefix("x"))
        is_factor = by.startswith("x")
        goes_up = (0 < start <= stop and step > 1) if is_factor else step > 0
        steps = (stop * (1 + NEARLY) / start).ln() / step.ln() if goes_up and is_factor else (stop - start) / step
        number = math.floor(steps) + 1
    except (ArithmeticError, ValueError) as error:
        raise UsageError(
            f"{option}: expected a list 0.1,0.2 or a range START:STOP:STEP or START:STOP:xFACTOR; got {text!r}"
        ) from error
    if not (goes_up and 0 < number <= MOST_VALUES):
        raise UsageError(f"{option}: expected 1 to {MOST_VALUES} values going up; got {number} from {text!r}")
    return [float(start * step**i if is_factor else start + i * step) for i in range(number)]
