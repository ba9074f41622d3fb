"""Options that several commands share: the same name, meaning and words everywhere."""

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

import typer

from frictionlab.cli.output import complain
from frictionlab.log_options import LogOptions

if TYPE_CHECKING:
    from frictionlab.scene import Scene

RECORDINGS = "Recordings made by ingest, or logs; folders, patterns; - is standard input."
SceneFile = Annotated[
    Path | None,
    typer.Option("--scene", metavar="TOML", help="Scene (default: a frictionlab.toml here or beside the first input)."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON Lines on stdout, one object per input, nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No tables and no progress; errors are still told.")]
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
    Setting("transient_s", float, "S", "Cut this much off the start (scene: 20 s)."),
    Setting("cycles", str, "RULE", "Cycles the energy is of: last, all, or window:S."),
    Setting("padding", int, "N", "Length of the FFT over the record's (scene: 4)."),
)


def takes(*settings: Setting) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command these options: it gets what was said as a mapping, in place of its parameter ``settings``."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @wraps(command)
        def run(*args: Any, **kwargs: Any) -> None:
            said = {setting.key: kwargs.pop(setting.key, None) for setting in settings}
            command(*args, **kwargs, settings={key: value for key, value in said.items() if value is not None})

        own = inspect.signature(command)
        hints = get_type_hints(command, include_extras=True)
        mine: list[inspect.Parameter] = []
        for name, parameter in own.parameters.items():
            if name == "settings":
                mine += [setting.parameter() for setting in settings]
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
