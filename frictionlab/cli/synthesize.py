"""``frictionlab synthesize``: logs of a virtual rig whose truth is known."""

from pathlib import Path
from typing import Annotated

import typer

from frictionlab.cli.options import Quiet
from frictionlab.cli.progress import track


def synthesize(
    scene: Annotated[Path, typer.Option("--scene", metavar="TOML", help="Scene with [[synthetic.tests]].")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Where the logs go.")],
    quiet: Quiet = False,
) -> None:
    """Write logs of a virtual rig whose truth is known, with truth.jsonl beside them.

    Example: frictionlab synthesize --scene configs/sample_data.toml -o build/logs
    """
    from frictionlab import synthetic
    from frictionlab.scene import read_scene

    what = read_scene(scene)
    total = len(synthetic.virtual_tests(what))
    for _test in track(synthetic.synthesize(what, output), total=total, title="synthesize", quiet=quiet):
        pass
    if not quiet:
        typer.echo(f"{total} synthetic logs and their truth.jsonl are in {output}")
