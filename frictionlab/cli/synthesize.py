"""``frictionlab synthesize``: logs of a virtual rig whose truth is known."""

from pathlib import Path

import typer

from frictionlab.cli.options import scene_of
from frictionlab.cli.progress import count


def synthesize(
    output: Path,
    *,
    scene: Path | None = None,
    quiet: bool = False,
) -> None:
    """Write logs of a virtual rig whose truth is known, with truth.jsonl beside them.

    Example: frictionlab synthesize --scene configs/sample_data.toml -o build/logs
    """
    from frictionlab.verbs.simulating import synthesize

    what = scene_of(scene, quiet=quiet)
    with count("synthesize", quiet=quiet) as progress:
        tests = synthesize(what, output, progress=progress)
    if not quiet:
        typer.echo(f"{len(tests)} synthetic logs and their truth.jsonl are in {output}")
