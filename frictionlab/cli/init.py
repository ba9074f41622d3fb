"""``frictionlab init``: a folder of logs -> the scene that they need, and the next command."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from frictionlab.cli.options import number_of
from frictionlab.cli.output import paragraph, printable
from frictionlab.errors import UsageError

if TYPE_CHECKING:
    from frictionlab.verbs.starting import Found

QUESTIONS = {
    "rig.natural_frequency_hz": "natural frequency of the frame in Hz",
    "rig.mass_kg": "mass that moves in kg (or stiffness, like 1191 N/m)",
    "experiment.material": "material of the tests",
    "experiment.normal_force_n": "normal force in N",
}
TEXTS = ("material",)


def init(
    folder: Path = Path(),
    *,
    every: bool = False,
    force: bool = False,
    quiet: bool = False,
) -> None:
    """Look at logs and write the scene that they need, frictionlab.toml, with what was found in them.

    Taps among the logs give the natural frequency, names and a sheet the facts of each test, the tests the time after
    which they have settled. On a terminal it asks for what logs cannot tell; an empty answer leaves it open. Every
    command finds the scene in the working folder or beside its first input.

    Example: frictionlab init my_logs
    """
    from frictionlab.scene import SCENE_NAME
    from frictionlab.verbs.starting import init, look

    if (folder / SCENE_NAME).exists() and not force:
        raise UsageError(f"{folder / SCENE_NAME}: exists: fill it in, or give --force to replace it")
    found = look(folder)
    asks = sys.stdin.isatty() and sys.stdout.isatty() and not (quiet or every) and bool(found.tests)
    answers = {key: value for key in found.lacks if asks and (value := _answer(key)) is not None}
    facts = dict(_fact(key, value) for key, value in answers.items())
    path = init(folder, force=force, everything=every, found=found, **facts)
    if not quiet:
        _tell(found, path, open_keys=[key for key in found.lacks if key not in answers])


def _answer(key: str) -> str | None:
    said: str = typer.prompt(QUESTIONS[key], default="", show_default=False)
    return said.strip() or None


def _fact(key: str, said: str) -> tuple[str, object]:
    """A key of the scene and its value, of what was answered; a stiffness may be given in place of the mass."""
    name = key.partition(".")[2]
    if name in TEXTS:
        return name, said
    if name == "mass_kg" and said.replace(" ", "").endswith("N/m"):
        return "stiffness_n_per_m", number_of(said.replace(" ", "").removesuffix("N/m"), "stiffness")
    return name, number_of(said, QUESTIONS[key])


def _tell(found: "Found", path: Path, open_keys: list[str]) -> None:
    """What was found, what is still to be filled in, and the one next command."""
    if found.tests or found.taps or found.unread:
        counts = {"tests": found.tests, "taps": found.taps, "not read": found.unread}
        typer.echo(", ".join(f"{len(logs)} {kind}" for kind, logs in counts.items() if logs))
    for log, reason in found.unread.items():
        paragraph(printable(f"not read: {log.name}: {reason}"), indent="    ")
    if found.frame:
        from frictionlab.cli.output import with_error

        mean = found.frame["natural_frequency_hz"]
        typer.echo(f"natural frequency {with_error(mean.mean, mean.se)} Hz, from the taps")
    if found.sheet:
        typer.echo(printable(f"facts of the tests: from the sheet {found.sheet}"))
    elif found.name_pattern:
        typer.echo(printable(f"facts of the tests: from their names, {found.name_pattern}"))
    typer.echo(printable(f"the scene is {path}" + (f"; to fill in: {', '.join(open_keys)}" if open_keys else "")))
    several = " --campaign" if len(found.tests) > 1 else ""
    typer.echo(printable(f"next: frictionlab batch {path.parent}{several}"))
