"""``frictionlab init``: a commented scene to fill in."""

from pathlib import Path
from typing import Annotated

import typer

from frictionlab.cli.options import Quiet
from frictionlab.cli.output import printable


def init(
    folder: Annotated[Path, typer.Argument(metavar="[FOLDER]", help="Where it goes; made if not there.")] = Path(),
    *,
    force: Annotated[bool, typer.Option("--force", help="Replace a scene that stands there.")] = False,
    quiet: Quiet = False,
) -> None:
    """Look at logs and write the scene that they need, frictionlab.toml, with what was found in them.

    Every command finds it in the working folder or beside its first input when it is given no --scene.

    Example: frictionlab init my_tests
    """
    from frictionlab.verbs.init import init

    path = init(folder, force=force)
    if not quiet:
        typer.echo(printable(f"{path}: fill in what is known of the rig; `frictionlab show {path}` tells what is used"))
