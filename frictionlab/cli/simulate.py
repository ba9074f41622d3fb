"""``frictionlab simulate``: one steady state, the last of N cycles from rest, or the response to a recorded base."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from frictionlab.cli.all_states import All, print_all
from frictionlab.cli.base_motion import SETTINGS, BaseMotion, Highpass, Ride, one_of_both, ride
from frictionlab.cli.drawing import figure_file
from frictionlab.cli.inputs import numbers_of, tell_warnings
from frictionlab.cli.law_options import LawName, Parameters, numbers
from frictionlab.cli.options import AsJson, Force, Quiet, SceneFile, takes
from frictionlab.cli.output import print_turned
from frictionlab.errors import SimulationError, UsageError
from frictionlab.files import make_folder
from frictionlab.schema import MOTIONS
from frictionlab.tables import Row, check_output, json_line, write_rows

if TYPE_CHECKING:
    from frictionlab.simulator import SteadyState

SAMPLES = 1000  # per cycle, of the motion in an .h5


@takes(*SETTINGS)
def simulate(
    *,
    r: Annotated[float | None, typer.Option("--r", help="Frequency ratio, drive over natural frequency.")] = None,
    beta: Annotated[float, typer.Option("--beta", help="Friction ratio, friction force over k Y.")],
    base_motion: BaseMotion = None,
    highpass: Highpass = None,
    settings: Mapping[str, object],
    scene: SceneFile = None,
    law: LawName = "coulomb",
    parameter: Parameters = None,
    mu: Annotated[
        float | None, typer.Option("--mu", help="Static over kinetic friction, in both directions (1).")
    ] = None,
    zeta: Annotated[
        float | None, typer.Option("--zeta", help="Damping ratio of a dashpot beside the contact (0).")
    ] = None,
    wall: Annotated[
        Literal["fixed", "base"], typer.Option("--wall", help="What the mass rubs against: a fixed wall, or the base.")
    ] = "fixed",
    solver: Annotated[
        Literal["auto", "closed-form", "exact", "numeric", "thesis"],
        typer.Option(
            "--solver", help="auto: the closed form where valid, else exact phases, else numeric. thesis: RK45."
        ),
    ] = "auto",
    cycles: Annotated[
        int | None, typer.Option("--cycles", metavar="N", min=1, help="The last of N cycles from rest instead.")
    ] = None,
    every: All = False,
    as_json: AsJson = False,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="PLACE", help="Draw motion and loop here (.pdf, .svg, .png).")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Write here: .csv .jsonl .xlsx .parquet, .h5 with the motion; with --base-motion a recording.",
        ),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Solve one steady state of the friction oscillator, run N cycles from rest, or follow a recorded base.

    Example: frictionlab simulate --r 0.5 --beta 0.4 --law coulomb+place --parameter gradient=0.05 --plot motion.pdf

    Example: frictionlab simulate --base-motion quake.csv --natural-frequency 3.1 --beta 0.2 -o response.h5
    """
    from frictionlab.simulator import Problem, last_cycle, steady_state

    ratio = one_of_both(
        r, base_motion, settings, scene, others={"--cycles": cycles, "--solver": solver, "--all": every}
    )
    if base_motion is None and highpass is not None:
        raise UsageError("--highpass: belongs to --base-motion FILE; got none")
    try:
        values = numbers(parameter, {"mu": mu, "zeta": zeta})
        problem = Problem(ratio, beta, mu, zeta, wall, law=law, parameters=values)
    except SimulationError as error:
        raise UsageError(str(error)) from error
    if base_motion is not None:
        plot = figure_file(plot, "response", force=force, inputs=[base_motion])
        ride(base_motion, Ride(problem, scene, settings, output, plot, force, highpass), as_json=as_json, quiet=quiet)
        return
    if every:
        _refuse_beside_all({"--cycles": cycles, "--solver": None if solver == "auto" else solver})
        print_all(problem, output, plot, force=force, as_json=as_json, quiet=quiet)
        return
    plot = figure_file(plot, "motion", force=force)
    if output is not None:
        check_output(output, MOTIONS, force=force)
    start = time.perf_counter()
    state = (
        steady_state(problem, solver=solver) if cycles is None else last_cycle(problem, cycles=cycles, solver=solver)
    )
    asked = {"wall_s": time.perf_counter() - start, "law": problem.law.name, "parameters": problem.parameters}
    row: Row = state.row() | asked
    if as_json:
        typer.echo(json_line(row))
    elif not quiet:
        print_turned([numbers_of(row)], MOTIONS)
        typer.echo(state.verdict)
        tell_warnings({"warnings": [said for said in state.warnings if said not in state.verdict]})
    if output is not None:
        _write(state, row, output, force=force)
    if plot is not None:
        _draw(state, plot, force=force)


def _refuse_beside_all(others: Mapping[str, object]) -> None:
    """Refuse options that ask for something else than all steady states."""
    given = [option for option, value in others.items() if value is not None]
    if given:
        raise UsageError(f"--all: expected neither --cycles nor --solver; got {', '.join(given)}")


def _write(state: "SteadyState", row: Row, output: Path, *, force: bool) -> None:
    if output.suffix != ".h5":
        write_rows([row], output, MOTIONS, force=force)
        return
    import numpy as np

    from frictionlab.hdf5 import write_tree

    timeless = {key: value for key, value in row.items() if key != "wall_s"}  # the same input gives the same bytes
    tree: dict[str, object] = {key: value for key, value in timeless.items() if value is not None}
    if state.orbit is not None:
        begin = state.orbit.start
        tau = np.linspace(begin, state.orbit.end, SAMPLES * (state.period_cycles or 1) + 1)
        x, v = state.orbit.at(np.minimum(tau, state.orbit.end))
        tree["motion"] = {"tau": tau, "displacement": x, "velocity": v, "base": state.problem.base.at(tau)}
        tree["stops"] = state.orbit.stops
    make_folder(output.parent)
    write_tree(tree, output, kind=MOTIONS.format, force=force, columns=MOTIONS.column)


def _draw(state: "SteadyState", path: Path, *, force: bool) -> None:
    if state.orbit is None:
        raise UsageError(f"{path}: there is no motion to draw (outcome {state.outcome}, solver {state.solver})")
    from frictionlab.figures.motion import motion_figure
    from frictionlab.figures.style import save

    make_folder(path.parent)
    save(motion_figure(state), path, force=force)
