"""``frictionlab simulate``: a steady state, N cycles from rest, the response to a recorded base; ``sweep``: a map."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from frictionlab.cli import complain
from frictionlab.cli.options import ANALYSIS, LOG, Drawn, doubt_amplitude, named_values, number_of, scene_of
from frictionlab.errors import SimulationError, UsageError
from frictionlab.schema import AMPLITUDE, BASE, ENERGY, MOTIONS
from frictionlab.tables import Row, check_output, json_line, write_rows

if TYPE_CHECKING:
    from frictionlab.scene import Scene
    from frictionlab.simulator import Problem, SteadyState, Structure

SAMPLES = 1000  # per cycle, of the motion in an .h5
READ = ("time", "base", "unit", "time_unit", "sampling_rate_hz", "separator", "decimal")
SETTINGS = {"natural_frequency_hz": ANALYSIS["natural_frequency_hz"], **{key: LOG[key] for key in READ}}
ASSUMED = "base_amplitude_m: not given: {:.4g} mm is assumed: --base-amplitude M, or base_amplitudes_m under [plan]"
SolverName = Literal["auto", "closed-form", "exact", "numeric", "thesis"]


@dataclass(frozen=True, kw_only=True)
class Rubbing:
    """What rubs, in the options: friction as a ratio or as a coefficient, the law, what the mass rubs against."""

    beta: float | None = None
    coefficient: float | None = None
    normal_force: float | None = None
    base_amplitude: float | None = None
    law: str | None = None
    parameter: list[str] | None = None
    mu: float | None = None
    zeta: float | None = None
    wall: Literal["fixed", "base"] | None = None


def simulate(
    *,
    r: float | None = None,
    rubbing: Rubbing,
    scene: Path | None = None,
    base_motion: Path | None = None,
    highpass: float | None = None,
    settings: Annotated[Mapping[str, object], SETTINGS],
    solver: SolverName = "auto",
    cycles: int | None = None,
    every: bool = False,
    to: Drawn,
) -> None:
    """Solve one steady state of the friction oscillator, run N cycles from rest, or follow a recorded base.

    Example: frictionlab simulate --r 0.5 --beta 0.4 --law coulomb+place --parameter gradient=0.05 --plot motion.pdf

    In newtons: frictionlab simulate --scene my.toml --r 0.32 --coefficient 0.3 --normal-force 2.45

    A record: frictionlab simulate --base-motion quake.csv --natural-frequency 3.1 --beta 0.2 -o response.h5
    """
    doubt_amplitude(rubbing.base_amplitude)
    known = None if scene is None else scene_of(scene)
    others = {"--cycles": cycles, "--all": every, "--solver": None if solver == "auto" else solver}
    given = [option for option, value in others.items() if value not in (None, False)]
    if base_motion is not None:
        if r is not None:
            raise UsageError("expected --r R or --base-motion FILE; got both: a recorded base has its own times")
        if given:
            raise UsageError(f"{given[0]}: a recorded base is followed once, by its law's own solver: leave it out")
        pose = _posed(rubbing, known, ())
        pose(1.0, 1.0)  # a contradiction is refused before anything is read
        _follow(partial(pose, 1.0), base_motion, scene, settings, highpass, to)
        return
    stray = [words.flags for key, (_, words) in SETTINGS.items() if key in settings]
    stray += ["--highpass"] if highpass is not None else []
    if stray:
        raise UsageError(f"{stray[0]}: belongs to --base-motion FILE; got none")
    if r is None:
        raise UsageError("expected --r R (a steady state) or --base-motion FILE (the response to it); got neither")
    if every and len(given) > 1:
        raise UsageError(f"--all: expected neither --cycles nor --solver; got {', '.join(given[:1] + given[2:])}")
    amplitude = 1.0 if known is None else rubbing.base_amplitude or known.plan.base_amplitudes_m[0]
    problem = _posed(rubbing, known, [option for option in given if option != "--all"])(r, amplitude)
    in_si = partial(_in_si, y=amplitude, k=None if known is None else known.rig.stiffness)
    given_y = known is None or rubbing.base_amplitude or "base_amplitudes_m" in known.plan.model_fields_set
    if not (given_y or to.quiet):
        complain(ASSUMED.format(1e3 * amplitude))
    _settle(problem, None if known is None else in_si, to, every=every, solver=solver, cycles=cycles)


def _in_si(row: Row, *, y: float, k: float | None) -> Row:
    """The contract's keys of a row in SI units, by Y [m] and stiffness [N/m]; several contacts have none of them."""
    amplitude, energy, beta = (row.get(key) for key in (AMPLITUDE, ENERGY, "beta"))
    if not isinstance(beta, float):
        return {}
    known = {BASE: y, f"{AMPLITUDE}_m": amplitude * y if isinstance(amplitude, float) else None}
    if k is None:
        return known
    joules = energy * k * y**2 if isinstance(energy, float) else None
    return {**known, f"{ENERGY}_j": joules, "friction_force_n": beta * k * y}


def _posed(
    rubs: Rubbing, scene: "Scene | None", given: Sequence[str]
) -> "Callable[[float, float], Problem | Structure]":
    """What the options and the scene pose, by frequency ratio and base amplitude [m].

    A frame of several masses or contacts is as its scene has it: ``given`` are further options that it does not take.
    """
    from frictionlab.simulator import Problem

    if scene is not None and (scene.rig.masses or scene.rig.contacts):
        from frictionlab.scene.physical import structure_of

        named = ("beta", "law", "mu", "parameter", "wall", "zeta")
        if stray := [f"--{name}" for name in named if getattr(rubs, name) is not None] + list(given):
            raise UsageError(
                f"{stray[0]}: belongs to one mass with one contact; {scene.files[0]} has [[rig.masses]] or"
                " [[rig.contacts]]: say it there"
            )
        return partial(structure_of, scene, coefficient=rubs.coefficient, normal_force_n=rubs.normal_force)
    if rubs.mu is not None and rubs.mu < 1.0:
        raise UsageError(
            f"--mu {rubs.mu:g}: mu is static over kinetic friction, 1 or more; the friction coefficient is"
            f" --coefficient {rubs.mu:g}, with --normal-force N and --scene TOML"
        )
    said = named_values(rubs.parameter, {"mu": rubs.mu, "zeta": rubs.zeta})
    values = {name: number_of(text, f"--parameter {name}") for name, text in said.items()}
    mu, law, wall = rubs.mu, rubs.law or "coulomb", rubs.wall or "fixed"
    if scene is not None:
        model = scene.model
        held = model.parameters if rubs.law in (None, model.law) else {}
        values = {"frame_damping_ratio": scene.frame_damping_ratio, **held, **values}
        mu = model.static_ratio if mu is None and model.static_ratio != 1.0 else mu
        law, wall = rubs.law or ("coulomb" if model.law == "auto" else model.law), rubs.wall or model.wall

    def problem(r: float, amplitude: float) -> Problem:
        try:
            return Problem(r, _beta(rubs, scene, amplitude), mu, rubs.zeta, wall, law=law, parameters=values)
        except SimulationError as error:
            raise UsageError(str(error)) from error

    return problem


def _beta(rubs: Rubbing, scene: "Scene | None", amplitude: float) -> float:
    """The friction ratio: as given, or from coefficient, normal force, stiffness and base amplitude; eq. (2.8)."""
    if rubs.beta is not None:
        if rubs.coefficient is not None:
            raise UsageError("expected --beta or --coefficient; got both")
        return rubs.beta
    prior = scene.plan.friction_coefficient if scene is not None else None
    coefficient = rubs.coefficient if rubs.coefficient is not None or prior is None else prior[0]
    force = rubs.normal_force or (None if scene is None else scene.experiment.normal_force_n)
    stiffness = None if scene is None else scene.rig.stiffness
    if coefficient is None or force is None or stiffness is None:
        rig = "--scene TOML with stiffness_n_per_m (or mass_kg and natural_frequency_hz) in [rig]"
        asked = zip(("--coefficient MU", "--normal-force N", rig), (coefficient, force, stiffness), strict=True)
        missing = ", ".join(option for option, value in asked if value is None)
        raise UsageError(f"friction: expected --beta BETA (friction force over k Y), or, all of them: {missing}")
    return coefficient * force / (stiffness * amplitude)


def _settle(
    problem: "Problem | Structure",
    in_si: Callable[[Row], Row] | None,
    to: Drawn,
    *,
    every: bool,
    solver: Any,
    cycles: int | None,
) -> None:
    """Solve the steady state, run some cycles from rest, or find all states: one row each, the most visited first."""
    from frictionlab.simulator import coexisting
    from frictionlab.simulator.state import KEYS
    from frictionlab.verbs.simulating import simulate

    is_tree = to.output is not None and to.output.suffix == ".h5"
    if to.output is not None:
        check_output(to.output, MOTIONS, force=to.force)
        if every and is_tree:
            raise UsageError(f"{to.output}: --all gives rows without motions; expected .csv or .jsonl")
    figure, start = to.figure("motion"), time.perf_counter()
    found = coexisting(problem) if every else ()
    states: list[SteadyState] = [each.state for each in found] or [simulate(problem, cycles=cycles, solver=solver)]
    seconds = time.perf_counter() - start
    rows: list[Row] = [{**dict.fromkeys(KEYS), "wall_s": seconds, **state.row()} for state in states]
    rows = rows if in_si is None else [{**row, **in_si(row)} for row in rows]
    if every:
        rows = [{**row, "basin_share": each.share} for row, each in zip(rows, found, strict=True)]
    for row in rows if to.as_json else ():
        typer.echo(json_line(row))
    if not to.as_json:
        _print_states(rows, [state.verdict for state in states], quiet=to.quiet)
    if to.output is not None and is_tree:
        _write_motion(states[0], rows[0], to.output, force=to.force)
    elif to.output is not None:
        write_rows(rows, to.output, MOTIONS, force=to.force)
    to.draw(states[0], figure)  # of all states the most visited


def _print_states(rows: Sequence[Row], verdicts: Sequence[str], *, quiet: bool) -> None:
    """A line for each state, in mm, mJ and N as far as they are known, and its verdict; then the warnings."""
    from frictionlab.cli.screen import SIMULATED, paragraph, print_table, print_warnings, warnings_of

    _print_law(rows[0])
    print_table(rows, SIMULATED)
    for row, verdict in zip(rows, verdicts, strict=True):
        share = row.get("basin_share")
        paragraph(f"{100.0 * share:.3g} % of the starts: {verdict}" if isinstance(share, float) else verdict)
    for row in rows:
        _print_parts(row, "amplitude of each mass: ", "response_amplitudes")
    if not quiet:
        warned = zip(rows, verdicts, strict=True)
        warnings = dict.fromkeys(said for row, verdict in warned for said in warnings_of(row) if said not in verdict)
        print_warnings([{"warnings": list(warnings)}])


def _print_law(row: Row) -> None:
    """The law with its parameters, and the wall; several contacts have a table of their own."""
    from frictionlab.cli.screen import cell, each_of, paragraph

    held = row.get("parameters")
    if isinstance(held, Mapping) and len(each_of(row.get("contacts"))) < 2:
        shown = {name: number for name, number in held.items() if number or name != "frame_damping_ratio"}
        paragraph(f"{row['law']}: {cell(shown)}; {row['wall']} wall")


def _print_parts(row: Row, words: str, key: str) -> None:
    """What each mass and contact does, where there are several."""
    from frictionlab.cli.screen import heads, print_table

    sizes, contacts = row.get(key), row.get("contacts")
    if isinstance(sizes, list) and isinstance(contacts, list) and max(len(sizes), len(contacts)) > 1:
        typer.echo(words + ", ".join(f"{size:.6g} Y" for size in sizes))
        print_table(contacts, {name: h for name, h in heads("contacts").items() if contacts and name in contacts[0]})


def _write_motion(state: "SteadyState", row: Row, output: Path, *, force: bool) -> None:
    """Write a state with its motion over a period."""
    import numpy as np

    from frictionlab.files import make_folder
    from frictionlab.hdf5 import write_tree

    # no time: the same input gives the same bytes
    tree: dict[str, object] = {key: value for key, value in row.items() if value is not None and key != "wall_s"}
    motion = state.orbit
    if motion is not None:
        tau = np.linspace(motion.start, motion.end, SAMPLES * (state.period_cycles or 1) + 1)
        ends = [""] if state.structure is None else [f"_{i + 1}" for i in range(state.structure.masses)]
        both = zip(("displacement", "velocity"), motion.all_at(np.minimum(tau, motion.end)), strict=False)
        moved = {f"{name}{end}": each for name, every in both for end, each in zip(ends, every.T, strict=True)}
        tree |= {"stops": motion.stops} if state.structure is None else {}
        tree["motion"] = {"tau": tau, **moved, "base": state.problem.base.at(tau)}
    make_folder(output.parent)
    write_tree(tree, output, kind=MOTIONS.format, force=force, columns=MOTIONS.column)


def _follow(
    problem: "Callable[[float], Problem | Structure]",
    path: Path,
    scene: Path | None,
    settings: Mapping[str, object],
    highpass_hz: float | None,
    to: Drawn,
) -> None:
    """Simulate the response to a file's base motion; print, write and draw it."""
    from frictionlab.cli.screen import exit_status, paragraph, print_table, print_warnings, report_rows
    from frictionlab.files import refuse_inputs
    from frictionlab.hdf5 import check_writable, write_recording
    from frictionlab.recording import Channel
    from frictionlab.schema import RESPONSES
    from frictionlab.verbs.inputs import row_of
    from frictionlab.verbs.simulating import respond

    figure = to.figure("response", [path])
    if to.output is not None:
        if to.output.suffix != ".h5":
            raise UsageError(f"{to.output}: expected a recording, a name ending in .h5; got {to.output.suffix!r}")
        refuse_inputs([to.output], [path, *([] if scene is None else [scene])])
        check_writable(to.output, force=to.force)

    def responded(path: Path) -> Row:
        start = time.perf_counter()
        answer = respond(path, problem, scene, highpass_hz=highpass_hz, **settings)
        row = answer.row() | {"wall_s": time.perf_counter() - start}
        if to.output is not None:
            force, unit = answer.contact_force
            name = f"contact force{'' if unit == 'N' else ' over stiffness'}, on the mass"
            channel = Channel("contact_force", force, name, unit)
            write_recording(answer.recording.changed(contact_force=channel), to.output, force=to.force)
        to.draw(answer, figure)
        return row

    rows = report_rows([row_of(responded, path, folder=None)], as_json=to.as_json)
    if rows[0]["status"] != "ok" and not to.as_json:
        complain(f"{rows[0]['source']}: {rows[0]['reason']}")
    elif not to.as_json:
        _print_law(rows[0])
        print_table(rows, RESPONSES)
        paragraph("Y is here the largest displacement of the base from its first value, and beta is over k times that.")
        _print_parts(rows[0], "peak of each mass: ", "peak_displacements")
        print_warnings(() if to.quiet else rows)
    exit_status(rows)
