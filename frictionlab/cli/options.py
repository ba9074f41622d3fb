"""Options that several commands share: the same name, meaning and words everywhere; and how their texts are read."""

import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from decimal import Decimal
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

import typer

from frictionlab.cli.output import complain
from frictionlab.errors import UsageError
from frictionlab.log_options import LogOptions

if TYPE_CHECKING:
    from frictionlab.scene import Scene


def complete_law(begun: str) -> list[str]:
    """Laws that begin so, for the completion of a shell: a term may follow a plus."""
    from frictionlab.simulator.laws import TERMS

    before, plus, last = begun.rpartition("+")
    return [f"{before}{plus}{term}" for term in ("auto", *TERMS) if term.startswith(last)]


Recordings = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORDING...", help="Recordings made by ingest, or logs; folders, patterns; - is standard input."
    ),
]
SceneFile = Annotated[
    Path | None,
    typer.Option("--scene", metavar="TOML", help="Scene (default: a frictionlab.toml here or beside the first input)."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON Lines on stdout, one object per input, nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No warnings, notes and progress; tables and errors stay.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="All warnings in full; else ten lines, one a cause.")]
Wide = Annotated[bool, typer.Option("--wide", help="All that a screen can show, in place of one line a test.")]
Budget = Annotated[bool, typer.Option("--budget", help="Print what adds how much to the uncertainty of each number.")]
Force = Annotated[bool, typer.Option("--force", help="Replace an existing output even if it is not this tool's own.")]
Workers = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", min=1, help="Processes (default: all cores when the work is worth it)."),
]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Let a Dask cluster do it, like tcp://host:8786."),
]
Accuracy = Annotated[
    Literal["fast", "balanced", "exact"] | None,
    typer.Option("--accuracy", help="Set the knobs that trade speed for accuracy (see `frictionlab tradeoff`)."),
]
LawName = Annotated[
    str | None,
    typer.Option(
        "--law", metavar="LAW", autocompletion=complete_law, help="Contact law: coulomb, or a sum like coulomb+place."
    ),
]
LawOrAuto = Annotated[
    str | None,
    typer.Option(
        "--law",
        metavar="LAW",
        autocompletion=complete_law,
        help="Contact law like coulomb+place+speed, or auto: the simplest that the data require.",
    ),
]
Parameters = Annotated[
    list[str] | None,
    typer.Option(
        "--parameter", metavar="NAME=VALUE", help="A parameter of the law, or frame_damping_ratio; repeatable."
    ),
]
Table = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE", help="Write a table: .csv .jsonl .xlsx .parquet .h5"),
]
PlotFolder = Annotated[
    Path | None,
    typer.Option("--plot", metavar="PLACE", help="Draw figures into this folder; of one input, a .pdf .svg .png."),
]


_UNITS = ("HZ", "S", "M")


@dataclass(frozen=True)
class Setting:
    """A key of a scene's table that a command takes as an option; what it is given wins over the scene.

    Parameters
    ----------
    key
        Of the table.
    kind
        What it takes: ``str``, ``int`` or ``float``.
    metavar, words
        What ``--help`` shows.
    """

    key: str
    kind: type
    metavar: str
    words: str

    @property
    def flag(self) -> str:
        """The option: the key without its unit, ``sampling_rate_hz`` is ``--sampling-rate``."""
        stem = self.key.removesuffix(f"_{self.metavar.lower()}") if self.metavar in _UNITS else self.key
        return "--" + stem.replace("_", "-")

    def parameter(self) -> inspect.Parameter:
        """The parameter that Typer reads."""
        annotated: Any = Annotated
        hint = annotated[self.kind | None, typer.Option(self.flag, metavar=self.metavar, help=self.words)]
        return inspect.Parameter(self.key, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=hint)


def _log_settings() -> Iterable[Setting]:
    """All of ``[log]``: its fields are the options."""
    for f in fields(LogOptions):
        kind = float if "float" in str(f.type) else str
        yield Setting(f.name, kind, f.metadata["metavar"], f.metadata["words"])


LOG = tuple(_log_settings())
ANALYSIS = (
    Setting("natural_frequency_hz", float, "HZ", "In place of the scene's."),
    Setting("transient_s", float, "S", "Cut this much off the start (else where the motion settles)."),
    Setting("cycles", str, "RULE", "Cycles the energy is of: all, last, or window:S."),
    Setting("padding", int, "N", "Length of the FFT over the record's."),
)


def takes(*settings: Setting) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command these options: it gets what was said as a mapping, in place of its parameter ``settings``.

    A parameter that is a dataclass stands for the options that its fields are.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        own = inspect.signature(command)
        hints = get_type_hints(command, include_extras=True)
        groups = {name: hints[name] for name in own.parameters if is_dataclass(hints[name])}

        @wraps(command)
        def run(*args: Any, **kwargs: Any) -> None:
            if "settings" in own.parameters:
                said = {setting.key: kwargs.pop(setting.key, None) for setting in settings}
                kwargs["settings"] = {key: value for key, value in said.items() if value is not None}
            for name, group in groups.items():
                kwargs[name] = group(**{f.name: kwargs.pop(f.name) for f in fields(group) if f.name in kwargs})
            command(*args, **kwargs)

        mine: list[inspect.Parameter] = []
        for name, parameter in own.parameters.items():
            if name == "settings":
                mine += [setting.parameter() for setting in settings]
            elif name in groups:
                inner = get_type_hints(groups[name], include_extras=True)
                mine += [
                    inspect.Parameter(
                        f.name, inspect.Parameter.KEYWORD_ONLY, default=f.default, annotation=inner[f.name]
                    )
                    for f in fields(groups[name])
                ]
            else:
                mine.append(parameter.replace(annotation=hints[name]))
        run.__signature__ = own.replace(parameters=mine)  # type: ignore[attr-defined]
        run.__annotations__ = {parameter.name: parameter.annotation for parameter in mine} | {"return": None}
        return run

    return decorate


def scene_of(
    path: Path | None, accuracy: str | None = None, *, beside: Path | None = None, quiet: bool = False
) -> "Scene":
    """The scene of a command: the file given, else one that is found, else all defaults.

    Parameters
    ----------
    path
        What ``--scene`` says.
    accuracy
        An accuracy level, whose knobs are set.
    beside
        The first input: ``frictionlab.toml`` is looked for in the working folder, then beside it, and said to be used.
    quiet
        Do not say it.
    """
    from frictionlab.accuracy import with_accuracy
    from frictionlab.scene import Scene, find_scene, read_scene

    found = find_scene(beside) if path is None else path
    if path is None and found is not None and not quiet:
        complain(
            f"scene: {found} is used (found in the working folder or beside the input); --scene FILE takes another"
        )
    scene = Scene() if found is None else read_scene(found)
    return scene if accuracy is None else with_accuracy(scene, accuracy)


MOST_VALUES = 10_000_000
TIMES = "x"  # before a factor, in the place of a step
NEARLY = Decimal("1e-12")  # how far a factor's last value may lie beyond the end
OWN_OPTION = {"beta": "--beta"}
SAME_AS = {"mu": ("static_ratio_up", "static_ratio_down", "static_ratio"), "zeta": ("contact_damping_ratio",)}


def named_values(said: Sequence[str] | None, given: Mapping[str, object]) -> dict[str, str]:
    """What each ``--parameter NAME=VALUE`` says, by name.

    Parameters
    ----------
    said : sequence of str
    given : mapping
        What ``--mu`` and ``--zeta`` say, or None.

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
        if name in OWN_OPTION:
            raise UsageError(f"--parameter {name}: it has an option of its own: give {OWN_OPTION[name]} {value}")
        if name in values:
            raise UsageError(f"--parameter {name}: given twice; expected one value")
        values[name] = value
    for option, names in SAME_AS.items():
        for name in values if given.get(option) is not None else ():
            if name in names:
                raise UsageError(f"--{option} and --parameter {name} say the same: leave one out")
    return values


def numbers(said: Sequence[str] | None, given: Mapping[str, object]) -> dict[str, float]:
    """As `named_values`, each value read as one number."""
    return {name: number_of(text, f"--parameter {name}") for name, text in named_values(said, given).items()}


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
        text = text if is_plain(text) else ""
        if ":" not in text:
            return [float(Decimal(part)) for part in text.split(",")]
        first, last, by = text.split(":")
        if by.strip().startswith(TIMES):
            return _by_factor(Decimal(first), Decimal(last), Decimal(by.strip().removeprefix(TIMES)), option)
        start, stop, step = Decimal(first), Decimal(last), Decimal(by)
        number = math.floor((stop - start) / step) + 1
    except (ArithmeticError, ValueError) as error:
        raise UsageError(
            f"{option}: expected a list 0.1,0.2 or a range START:STOP:STEP or START:STOP:xFACTOR; got {text!r}"
        ) from error
    if not (0 < number <= MOST_VALUES and step > 0):
        raise UsageError(f"{option}: expected 1 to {MOST_VALUES} values going up; got {number} from {text!r}")
    return [float(start + i * step) for i in range(number)]


def _by_factor(start: Decimal, stop: Decimal, factor: Decimal, option: str) -> list[float]:
    """The values from start to stop, each a factor larger than the one before."""
    if not (0 < start <= stop < Decimal("Infinity") and 1 < factor < Decimal("Infinity")):
        raise UsageError(
            f"{option}: expected START:STOP:xFACTOR with 0 < START <= STOP and FACTOR > 1; got {start}:{stop}:x{factor}"
        )
    number = int((stop * (1 + NEARLY) / start).ln() / factor.ln()) + 1
    if number > MOST_VALUES:
        raise UsageError(f"{option}: expected 1 to {MOST_VALUES} values; got {number}")
    return [float(start * factor**i) for i in range(number)]
