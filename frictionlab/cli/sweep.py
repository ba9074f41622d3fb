"""``frictionlab sweep``: a map of steady states."""

import os
from collections import Counter
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from frictionlab.cli.options import AsJson, Force, Quiet
from frictionlab.cli.progress import count
from frictionlab.errors import UsageError
from frictionlab.tables import check_output, json_line, write_rows

if TYPE_CHECKING:
    from frictionlab.simulator import StateMap

KIND = "frictionlab map"
MOST_VALUES = 10_000_000
WORTH_A_PROCESS = 50_000  # points; a process takes seconds to start
VALUES = "START:STOP:STEP"


def sweep(
    *,
    r: Annotated[str, typer.Option("--r", metavar=VALUES, help="Frequency ratios: a range, or a list 0.1,0.2.")],
    beta: Annotated[str, typer.Option("--beta", metavar=VALUES, help="Friction ratios.")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Write here: .csv, .jsonl or .h5.")],
    mu: Annotated[str, typer.Option("--mu", metavar=VALUES, help="Static over kinetic friction.")] = "1",
    zeta: Annotated[str, typer.Option("--zeta", metavar=VALUES, help="Viscous damping ratios.")] = "0",
    wall: Annotated[
        Literal["fixed", "base"], typer.Option("--wall", help="What the mass rubs against: a fixed wall, or the base.")
    ] = "fixed",
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", min=1, help="Processes (default: all cores if worth it).")
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Map steady states over frequency ratio, friction ratio, static friction and damping.

    Each of the four takes a list (0.1,0.2), a range with both ends (0.1:0.9:0.1), or one number.

    Example: frictionlab sweep --r 0.02:2.5:0.01 --beta 0.1:0.9:0.1 -o map.h5
    """
    from frictionlab import simulator

    if output.suffix != ".h5":
        check_output(output)
    elif not output.parent.is_dir():
        raise UsageError(f"{output}: there is no folder {output.parent}: make it first")
    axes = [values_of(text, name) for name, text in (("--r", r), ("--beta", beta), ("--mu", mu), ("--zeta", zeta))]
    points = len(axes[0]) * len(axes[1]) * len(axes[2]) * len(axes[3])
    if workers is None:
        workers = (os.cpu_count() or 1) if points > WORTH_A_PROCESS else 1
    with count("sweep", quiet=quiet) as progress:
        states = simulator.sweep(axes[0], axes[1], axes[2], axes[3], wall=wall, workers=workers, progress=progress)
    _write(states, output, force=force)
    if as_json:
        for row in states.rows():
            typer.echo(json_line(row))
    elif not quiet:
        outcomes = Counter(states.datasets()["outcome"].ravel().tolist())
        told = ", ".join(f"{number} {outcome}" for outcome, number in outcomes.most_common())
        typer.echo(f"{points} steady states ({told}) are in {output}")


def values_of(text: str, option: str) -> list[float]:
    """Read a list ``0.1,0.2`` or a range ``START:STOP:STEP`` with both ends; decimal, so that 0.3 is 0.3.

    Examples
    --------
    >>> values_of("0.1:0.4:0.1", "--beta"), values_of("0.5,1", "--r")
    ([0.1, 0.2, 0.3, 0.4], [0.5, 1.0])
    """
    try:
        if ":" not in text:
            return [float(Decimal(part)) for part in text.split(",")]
        start, stop, step = (Decimal(part) for part in text.split(":"))
        number = int((stop - start) / step) + 1
    except (InvalidOperation, ValueError, ZeroDivisionError, OverflowError) as error:
        raise UsageError(f"{option}: expected a list 0.1,0.2 or a range START:STOP:STEP; got {text!r}") from error
    if not (0 < number <= MOST_VALUES and step > 0):
        raise UsageError(f"{option}: expected 1 to {MOST_VALUES} values going up; got {number} from {text!r}")
    return [float(start + i * step) for i in range(number)]


def _write(states: "StateMap", output: Path, *, force: bool) -> None:
    if output.suffix != ".h5":
        write_rows(states.rows(), output)
        return
    from frictionlab.hdf5 import write_map

    axes = {"r": states.r, "beta": states.beta, "mu": states.mu, "zeta": states.zeta}
    write_map(axes, states.datasets(), {"wall": states.wall}, output, kind=KIND, force=force)
