"""``frictionlab synthesize``: logs of a virtual rig whose truth is known."""

from pathlib import Path
from typing import Annotated

import typer

from frictionlab.cli.options import Quiet
from frictionlab.cli.progress import count


def synthesize(
    scene: Annotated[Path, typer.Option("--scene", metavar="TOML", help="Scene with [[synthetic.tests]].")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Where the logs go.")],
    quiet: Quiet = False,
) -> None:
    """Write logs of a virtual rig whose truth is known, with truth.jsonl beside them.

    Example: frictionlab synthesize --scene configs/sample_data.toml -o build/logs
    """
    from frictionlab.verbs.synthesize import synthesize

    with count("synthesize", quiet=quiet) as progress:
        tests = synthesize(scene, output, progress=progress)
    if not quiet:
        typer.echo(f"{len(tests)} synthetic logs and their truth.jsonl are in {output}")
