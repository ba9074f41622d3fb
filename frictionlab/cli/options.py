"""Options that several commands share: the same name, meaning and words everywhere; and how their texts are read."""

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from decimal import Decimal
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from frictionlab.cli import complain
from frictionlab.errors import UsageError
from frictionlab.log_options import LogOptions

if TYPE_CHECKING:
    from frictionlab.scene import Scene


def complete_law(begun: str) -> list[str]:
    """Laws that begin so, for the completion of a shell: a term may follow a plus."""
    from frictionlab.simulator.laws import TERMS

    before, plus, last = begun.rpartition("+")
    return [f"{before}{plus}{term}" for term in ("auto", *TERMS) if term.startswith(last)]


WORDS = {
    "accuracy": "--accuracy | Set the knobs that trade speed for accuracy (see `frictionlab tradeoff`).",
    "again": "--again | Make everything again, changed or not.",
    "against": "--against LAW | Another law: choose the tests that tell the two apart.",
    "aim": "--for NAME | Parameter whose error counts (several times); else all.",
    "as_json": "--json | Print JSON Lines on stdout, one object per input, nothing else.",
    "base_amplitude": "--base-amplitude M | Y, in metres (default: the first of [plan]).",
    "base_log": "--base-log FILE | Log of the base alone, or -.",
    "base_motion": "--base-motion FILE | The response to the base of a recording, a log, or one column of any table.",
    "beta": "--beta >=0 | Friction ratio, friction force over k Y.",
    "budget": "--budget | Print what adds how much to the uncertainty of each number.",
    "campaign": "--campaign | Measure all tests, then evaluate them together up to report.html.",
    "coefficient": "--coefficient >=0 | Friction coefficient, with --normal-force and a scene's rig.",
    "cycles": "--cycles N >=1 | The last of N cycles from rest instead.",
    "dry_run": "--dry-run | Report what is found, write nothing.",
    "fit": "--fit | What the law is fitted to: the mean steady cycle, or the whole record (a sweep has no cycle).",
    "force": "--force | Replace an existing output even if it is not this tool's own.",
    "highpass": "--highpass HZ | A base given as an acceleration is integrated twice, without what is slower.",
    "hours": "--hours H >=0 | Laboratory time there is.",
    "law": "--law LAW | Contact law, a sum like coulomb+place, in place of the scene's.",
    "batch.law": "--law LAW | Contact law like coulomb+speed, or auto: the simplest that the data require.",
    "campaign.law": "--law LAW | Contact law like coulomb+speed, or auto: the one that each material requires.",
    "compare-numeric.law": "--law LAW | Contact law like coulomb+speed, or auto: the simplest that is required.",
    "law_file": "--law-file TOML | The law of a material, law_MATERIAL.toml of a campaign.",
    "mass_log": "--mass-log FILE | Log of the mass alone, or -.",
    "measured": "--measured FILE | Comparisons at hand (compare-numeric -o): they are known.",
    "mu": "--mu | Static over kinetic friction, in both directions (1).",
    "normal_force": "--normal-force N | In place of the scene's.",
    "output": "--output -o FILE | Write a table: .csv .jsonl .xlsx .h5",
    "batch.output": "--output -o FOLDER | Where all results go (default: LOGS_results here).",
    "campaign.output": "--output -o FOLDER | Tables, figures and report.",
    "ingest.output": "--output -o FILE_OR_FOLDER | Without it: LOG's name + .h5, beside it.",
    "plan.output": "--output -o SHEET | Write the tests here as a sheet (.csv) to fill in.",
    "simulate.output": "--output -o FILE | Write a table, .h5 with the motion; with --base-motion a recording.",
    "synthesize.output": "--output -o FOLDER | Where the logs go.",
    "tradeoff.output": "--output -o FOLDER | Write tradeoff.csv and one figure a family here.",
    "parameter": "--parameter NAME=VALUE | A parameter of the law, or frame_damping_ratio; repeatable.",
    "plot": "--plot PLACE | Draw figures into this folder, or one into this file (.pdf .svg .png).",
    "quiet": "--quiet -q | No warnings, notes and progress; tables and errors stay.",
    "r": "--r | Frequency ratio, drive over natural frequency.",
    "report": "--report FOLDER | Write a page of each recording into this folder.",
    "resume": "--resume | Continue a sweep that was stopped, if one was.",
    "scene": "--scene TOML | Scene (default: a frictionlab.toml here or beside the first input).",
    "scheduler": "--scheduler ADDRESS | Let a Dask cluster do it, like tcp://host:8786.",
    "solver": "--solver | auto: the closed form where valid, else exact phases, else numeric. thesis: RK45.",
    "tests": "--tests N >=1 | How many tests to plan at most (default: ten, between two laws until they are decided).",
    "verbose": "--verbose -v | All warnings in full; else ten lines, one a cause.",
    "wall": "--wall | What the mass rubs against: a fixed wall, or the base.",
    "whole": "--whole | Compare the whole record too, from its first sample, under the measured base.",
    "wide": "--wide | All that a screen can show, in place of one line a test.",
    "workers": "--workers N >=1 | Processes (default: all cores when the work is worth it).",
    "zeta": "--zeta | Damping ratio of a dashpot beside the contact (0).",
    "compare-numeric.beta": "--beta >=0 | Predict with this friction ratio instead of identifying it.",
    "init.every": "--all | Every key, not only the ten most used.",
    "init.force": "--force | Replace a scene that stands there.",
    "plan.every": "--all | Every candidate, not only those chosen.",
    "predict.base_amplitude": "--base-amplitude M | Y, in metres (default: the middle of those tested).",
    "predict.base_motion": "--base-motion FILE | From rest, under the base of a recording or a log.",
    "predict.normal_force": "--normal-force N | In newtons (default: the middle of those tested).",
    "predict.r": "--r START:STOP:STEP | Frequency ratio, list or range (default: the middle of those tested).",
    "simulate.every": "--all | All steady states that many starts settle on, with their shares.",
    "sweep.r": "--r START:STOP:STEP | Frequency ratios: a range, or a list 0.1,0.2.",
    "sweep.beta": "--beta START:STOP:STEP | Friction ratios.",
    "sweep.mu": "--mu START:STOP:STEP | Static over kinetic friction, in both directions (1).",
    "sweep.zeta": "--zeta START:STOP:STEP | Damping ratios of a dashpot beside the contact (0).",
    "laws.name": "NAME | A law, like coulomb+place, or one of its terms.",
    "laws.plot": "--plot PLACE | Draw the loop of the law named, at the middle of the usual ranges.",
    "file": "FILE | A recording, scene or result.",
    "folder": "FOLDER | A folder of logs; the scene goes there (made if not there).",
    "inputs": "LOG_OR_RECORDING... | Free decays of the mass; folders, patterns; - is standard input.",
    "logs": "LOG... | Logs with both channels, folders of them, patterns, - for standard input.",
    "batch.logs": "FOLDER_OR_LOG... | Logs, folders of them, patterns.",
    "measurements": "MEASUREMENTS... | Files that analyze and compare-numeric wrote; folders, patterns.",
    "recordings": "RECORDING... | Recordings made by ingest, or logs; folders, patterns; - is standard input.",
}
"""Every option and argument by the name of its parameter: flags, what it takes, the least value; what it does.

``COMMAND.NAME`` is that of one command where it means something else than elsewhere.
"""


def option(text: str) -> Any:
    """The option or argument of a line of `WORDS`, as Typer takes it."""
    said, _, words = text.partition(" | ")
    flags = [word for word in said.split() if word.startswith("-")]
    least = next((float(word[2:]) for word in said.split() if word.startswith(">=")), None)
    metavar = next((word for word in said.split() if word[0] not in "->"), None)
    if not flags:
        return typer.Argument(metavar=metavar, help=words)
    complete = complete_law if metavar == "LAW" else None
    return typer.Option(*flags, metavar=metavar, min=least, help=words, autocompletion=complete)


Settings = Mapping[str, tuple[type, str]]
"""Keys of a scene's table that a command takes as options: what each takes, its option and words as in `WORDS`."""


def _log_settings() -> dict[str, tuple[type, str]]:
    """All of ``[log]``: an option is the key without its unit, ``sampling_rate_hz`` is ``--sampling-rate``."""
    found: dict[str, tuple[type, str]] = {}
    for f in fields(LogOptions):
        metavar = f.metadata["metavar"]
        stem = f.name.removesuffix(f"_{metavar.lower()}") if metavar in ("HZ", "S", "M") else f.name
        kind = float if "float" in str(f.type) else str
        found[f.name] = (kind, f"--{stem.replace('_', '-')} {metavar} | {f.metadata['words']}")
    return found


LOG: Settings = _log_settings()
ANALYSIS: Settings = {
    "natural_frequency_hz": (float, "--natural-frequency HZ | In place of the scene's."),
    "transient_s": (float, "--transient S | Cut this much off the start (else where the motion settles)."),
    "cycles": (str, "--cycles RULE | Cycles the energy is of: all, last, or window:S."),
    "padding": (int, "--padding N | Length of the FFT over the record's."),
}


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
    words = WORDS | {key.removeprefix(f"{name}."): text for key, text in WORDS.items() if key.startswith(f"{name}.")}

    @wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        if settings:
            said = {key: kwargs.pop(key, None) for key in settings}
            kwargs["settings"] = {key: value for key, value in said.items() if value is not None}
        for key, group in groups.items():
            kwargs[key] = group(**{f.name: kwargs.pop(f.name) for f in fields(group) if f.name in kwargs})
        command(*args, **kwargs)

    mine: list[inspect.Parameter] = []
    for key, parameter in own.parameters.items():
        if key in groups:
            inner = get_type_hints(groups[key])
            mine += [_parameter(f.name, inner[f.name], f.default, words[f.name]) for f in fields(groups[key])]
        elif key == "settings":
            mine += [_parameter(each, kind | None, None, text) for each, (kind, text) in settings.items()]
        else:
            mine.append(_parameter(key, hints[key], parameter.default, words[key]))
    run.__signature__ = own.replace(parameters=mine)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in mine} | {"return": None}
    return run


def _parameter(name: str, hint: Any, default: object, words: str) -> inspect.Parameter:
    """A parameter as Typer reads it."""
    annotated: Any = Annotated
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotated[hint, option(words)]
    )


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
        text = text if is_plain(text) else ""
        if ":" not in text:
            return [float(Decimal(part)) for part in text.split(",")]
        first, last, by = (part.strip() for part in text.split(":"))
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
