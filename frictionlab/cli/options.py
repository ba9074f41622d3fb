"""Options that several commands share: the same name, meaning and words everywhere."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
PlotFolder = Annotated[Path | None, typer.Option("--plot", metavar="FOLDER", help="Draw figures into this folder.")]


def scene_of(path: Path | None) -> "Scene":
    """The scene of a command: the file given, or all defaults."""
    from frictionlab.scene import Scene, read_scene

    return Scene() if path is None else read_scene(path)
