"""Options that several commands share: the same name, meaning and words everywhere."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from frictionlab.scene import Scene

SceneFile = Annotated[Path | None, typer.Option("--scene", metavar="TOML", help="Scene: rig, experiment, log, model.")]
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
PlotFolder = Annotated[Path | None, typer.Option("--plot", metavar="FOLDER", help="Draw figures into this folder.")]


def scene_of(path: Path | None, accuracy: str | None = None) -> "Scene":
    """The scene of a command: the file given, or all defaults; with the knobs of an accuracy level if one is given."""
    from frictionlab.accuracy import with_accuracy
    from frictionlab.scene import Scene, read_scene

    scene = Scene() if path is None else read_scene(path)
    return scene if accuracy is None else with_accuracy(scene, accuracy)
