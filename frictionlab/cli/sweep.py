"""``frictionlab sweep``: a map of steady states."""

import math
from collections import Counter
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from frictionlab.cli.inputs import STOPPED
from frictionlab.cli.law_options import LawName, Parameters, named_values
from frictionlab.cli.map_picture import MapPicture
from frictionlab.cli.options import AsJson, Force, Quiet, Scheduler, Workers
from frictionlab.cli.output import complain
from frictionlab.cli.progress import count
from frictionlab.cli.standard_output import LostOutputError
from frictionlab.errors import UsageError
from frictionlab.schema import STEADY_STATES
from frictionlab.tables import check_output, json_line

if TYPE_CHECKING:
    from collections.abc import Generator

    from frictionlab.maps import Grid, Step

AXES = ("r", "beta", "mu", "zeta")
MOST_VALUES = 10_000_000
VALUES = "START:STOP:STEP"
TIMES = "x"  # before a factor, in the place of a step
NEARLY = Decimal("1e-12")  # how far a factor's last value may lie beyond the end


def sweep(
    *,
    r: Annotated[str, typer.Option("--r", metavar=VALUES, help="Frequency ratios: a range, or a list 0.1,0.2.")],
    beta: Annotated[str, typer.Option("--beta", metavar=VALUES, help="Friction ratios.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="Write here: .csv .jsonl .h5 .xlsx .parquet")
    ],
    law: LawName = "coulomb",
    parameter: Parameters = None,
    mu: Annotated[
        str | None, typer.Option("--mu", metavar=VALUES, help="Static over kinetic friction, in both directions (1).")
    ] = None,
    zeta: Annotated[
        str | None, typer.Option("--zeta", metavar=VALUES, help="Damping ratios of a dashpot beside the contact (0).")
    ] = None,
    wall: Annotated[
        Literal["fixed", "base"], typer.Option("--wall", help="What the mass rubs against: a fixed wall, or the base.")
    ] = "fixed",
    workers: Workers = None,
    scheduler: Scheduler = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue a sweep that was stopped, if one was.")] = False,
    as_json: AsJson = False,
    plot: Annotated[
        Path | None,
        typer.Option("--plot", metavar="PLACE", help="Draw the map, over one axis or two (.pdf .svg .png)."),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Map steady states over frequency ratio, friction ratio, static friction, damping and parameters of a law.

    Each takes a list (0.1,0.2), a range with both ends (0.1:0.9:0.1), or one number; so does --parameter, as in
    --parameter gradient=0:0.1:0.02. A range may go by a factor: stiffness_ratio=10:1e6:x10. What is solved is saved as
    it goes; --resume continues after Ctrl-C or a power cut and ends in the same file.

    Example: frictionlab sweep --r 0.02:2.5:0.01 --beta 0.1:0.9:0.1 -o map.h5
    """
    from frictionlab import maps

    said = named_values(parameter, {"mu": mu, "zeta": zeta})
    four = zip(AXES, (r, beta, mu or "1", zeta or "0"), strict=True)
    axes = {name: tuple(values_of(text, f"--{name}")) for name, text in four}
    more = tuple((name, tuple(values_of(text, f"--parameter {name}"))) for name, text in said.items())
    grid = maps.Grid(**axes, wall=wall, law=law, parameters=more)
    check_output(output, STEADY_STATES, force=force, rows=len(grid))
    picture = None if plot is None else MapPicture(grid, plot, force=force)
    steps = maps.make_map(grid, output, workers=workers, scheduler=scheduler, resume=resume, force=force)
    outcomes = _follow(grid, steps if picture is None else picture.seen(steps), output, as_json=as_json, quiet=quiet)
    if not (as_json or quiet):
        told = ", ".join(f"{number} {outcome}" for outcome, number in outcomes.most_common())
        typer.echo(f"{len(grid)} steady states ({told}) are in {output}")
    if picture is not None:
        picture.draw()
    if outcomes[maps.FAILED]:
        raise typer.Exit(1)


def _follow(grid: "Grid", steps: "Generator[Step]", output: Path, *, as_json: bool, quiet: bool) -> "Counter[str]":
    """Print each step of the sweep as it comes; return how many points have which outcome."""
    from frictionlab import maps

    outcomes: Counter[str] = Counter()
    warned = maps.Warned()
    done = 0
    try:
        with count("sweep", quiet=quiet) as progress:
            for step in steps:
                done = step.done
                for row in maps.rows(grid, step) if as_json else ():
                    typer.echo(json_line(row))
                for sentence in maps.faults(grid, step):
                    complain(sentence)
                outcomes.update(step.records["outcome"].astype(str).tolist())
                warned.add(grid, step.start, step.records["warnings"])
                if progress is not None:
                    progress(step.done, step.total)
    except KeyboardInterrupt:
        _leave(steps, f"stopped: {done} of {len(grid)} points are saved beside {output}")
        raise typer.Exit(STOPPED) from None
    except LostOutputError:
        _leave(steps, f"note: standard output takes no more: {done} of {len(grid)} points are saved beside {output}")
        raise
    for sentence in () if as_json or quiet else warned.sentences():
        complain(f"warning: {sentence}")
    return outcomes


def _leave(steps: "Generator[Step]", words: str) -> None:
    """Save what is solved, and say what to do with it."""
    steps.close()
    complain(f"{words}: give --resume to continue")


def values_of(text: str, option: str) -> list[float]:
    """Read a list ``0.1,0.2`` or a range ``START:STOP:STEP`` with both ends; decimal, so that 0.3 is 0.3.

    A step that begins with x is a factor.

    Examples
    --------
    >>> values_of("0.1:0.4:0.1", "--beta"), values_of("0.5,1", "--r"), values_of("10:1e4:x10", "--parameter kappa")
    ([0.1, 0.2, 0.3, 0.4], [0.5, 1.0], [10.0, 100.0, 1000.0, 10000.0])
    """
    try:
        if ":" not in text:
            return [float(Decimal(part)) for part in text.split(",")]
        first, last, by = text.split(":")
        if by.strip().startswith(TIMES):
            return _by_factor(Decimal(first), Decimal(last), Decimal(by.strip().removeprefix(TIMES)), option)
        start, stop, step = Decimal(first), Decimal(last), Decimal(by)
        number = math.floor((stop - start) / step) + 1
    except (ArithmeticError, ValueError) as error:
        raise UsageError(
            f"{option}: expected a list 0.1,0.2 or a range START:STOP:STEP or START:STOP:xFACTOR; got {text!r}"
        ) from error
    if not (0 < number <= MOST_VALUES and step > 0):
        raise UsageError(f"{option}: expected 1 to {MOST_VALUES} values going up; got {number} from {text!r}")
    return [float(start + i * step) for i in range(number)]


def _by_factor(start: Decimal, stop: Decimal, factor: Decimal, option: str) -> list[float]:
    """The values from start to stop, each a factor larger than the one before."""
    if not (0 < start <= stop < Decimal("Infinity") and 1 < factor < Decimal("Infinity")):
        raise UsageError(
            f"{option}: expected START:STOP:xFACTOR with 0 < START <= STOP and FACTOR > 1; got {start}:{stop}:x{factor}"
        )
    number = int((stop * (1 + NEARLY) / start).ln() / factor.ln()) + 1
    if number > MOST_VALUES:
        raise UsageError(f"{option}: expected 1 to {MOST_VALUES} values; got {number}")
    return [float(start * factor**i) for i in range(number)]
