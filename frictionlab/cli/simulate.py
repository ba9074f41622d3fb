"""``frictionlab simulate``: one steady state, the last of N cycles from rest, or the response to a recorded base."""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from frictionlab.cli.drawing import figure_file
from frictionlab.cli.inputs import exit_status, report_rows
from frictionlab.cli.options import ANALYSIS, LOG, numbers, takes
from frictionlab.cli.output import complain, print_turned, print_warnings
from frictionlab.errors import SimulationError, UsageError
from frictionlab.files import make_folder, refuse_inputs
from frictionlab.schema import MOTIONS, RESPONSES
from frictionlab.tables import Row, check_output, json_line, write_rows

if TYPE_CHECKING:
    from frictionlab.base_motion import RecordResponse
    from frictionlab.scene import Scene
    from frictionlab.simulator import Problem, SteadyState

SAMPLES = 1000  # per cycle, of the motion in an .h5
SETTINGS = (
    *(s for s in ANALYSIS if s.key == "natural_frequency_hz"),
    *(s for s in LOG if s.key in ("time", "base", "unit", "time_unit", "sampling_rate_hz", "separator", "decimal")),
)
SERIES = (".h5", ".csv")
HEAD = ("time [s]", "base [m]", "mass [m]")
FORCE = "contact force"


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


@takes(*SETTINGS)
def simulate(
    *,
    r: float | None = None,
    rubbing: Rubbing,
    scene: Path | None = None,
    base_motion: Path | None = None,
    highpass: float | None = None,
    settings: Mapping[str, object],
    solver: Literal["auto", "closed-form", "exact", "numeric", "thesis"] = "auto",
    cycles: int | None = None,
    every: bool = False,
    as_json: bool = False,
    plot: Path | None = None,
    output: Path | None = None,
    force: bool = False,
    quiet: bool = False,
) -> None:
    """Solve one steady state of the friction oscillator, run N cycles from rest, or follow a recorded base.

    Example: frictionlab simulate --r 0.5 --beta 0.4 --law coulomb+place --parameter gradient=0.05 --plot motion.pdf

    In newtons: frictionlab simulate --scene my.toml --r 0.32 --coefficient 0.3 --normal-force 2.45

    A record: frictionlab simulate --base-motion quake.csv --natural-frequency 3.1 --beta 0.2 -o response.h5
    """
    others = {"--cycles": cycles, "--all": every, "--solver": None if solver == "auto" else solver}
    _refuse_strangers(r, base_motion, highpass, settings, others)
    problem, units = _problem(1.0 if r is None else r, rubbing, scene, dimensionless=base_motion is not None)
    ask = _Ask(problem, units, output, plot, force=force, as_json=as_json, quiet=quiet)
    if base_motion is not None:
        ask.follow(base_motion, scene, settings, highpass)
    elif every:
        ask.find_all()
    else:
        ask.solve(solver, cycles)


def _refuse_strangers(
    r: float | None,
    base_motion: Path | None,
    highpass: float | None,
    settings: Mapping[str, object],
    others: Mapping[str, object],
) -> None:
    """Refuse options that belong to another of the three things that this command does."""
    given = [option for option, value in others.items() if value not in (None, False)]
    if base_motion is None:
        stray = [setting.flag for setting in SETTINGS if setting.key in settings]
        stray += ["--highpass"] if highpass is not None else []
        if stray:
            raise UsageError(f"{stray[0]}: belongs to --base-motion FILE; got none")
        if r is None:
            raise UsageError("expected --r R (a steady state) or --base-motion FILE (the response to it); got neither")
        if "--all" in given and len(given) > 1:
            raise UsageError(f"--all: expected neither --cycles nor --solver; got {', '.join(given[:1] + given[2:])}")
    elif r is not None:
        raise UsageError("expected --r R or --base-motion FILE; got both: a recorded base has its own times")
    elif given:
        raise UsageError(f"{given[0]}: a recorded base is followed once, by the solver that its law has: leave it out")


@dataclass(frozen=True)
class Units:
    """What turns a dimensionless answer into metres, joules and newtons, as far as the scene knows it."""

    base_amplitude_m: float
    stiffness_n_per_m: float | None

    def of(self, row: Row, beta: float) -> Row:
        """The contract's keys in SI units."""
        y, k = self.base_amplitude_m, self.stiffness_n_per_m
        amplitude, energy = row.get("response_amplitude"), row.get("energy_per_cycle")
        found: dict[str, object] = {"response_amplitude_m": amplitude * y if isinstance(amplitude, float) else None}
        if k is not None:
            found["energy_per_cycle_j"] = energy * k * y**2 if isinstance(energy, float) else None
            found["friction_force_n"] = beta * k * y
        return found


def _problem(r: float, rubs: Rubbing, file: Path | None, *, dimensionless: bool) -> "tuple[Problem, Units | None]":
    """The problem that the options and the scene pose, and its units where a scene is given."""
    from frictionlab.scene import read_scene
    from frictionlab.simulator import Problem

    if rubs.mu is not None and rubs.mu < 1.0:
        raise UsageError(
            f"--mu {rubs.mu:g}: mu is static over kinetic friction, 1 or more; the friction coefficient is"
            f" --coefficient {rubs.mu:g}, with --normal-force N and --scene TOML"
        )
    scene = None if file is None else read_scene(file)
    units = None if scene is None or dimensionless else _units(scene, rubs)
    beta = _beta(rubs, scene, units)
    model = None if scene is None else scene.model
    values = numbers(rubs.parameter, {"mu": rubs.mu, "zeta": rubs.zeta})
    if scene is not None and model is not None:
        held = {} if rubs.law is not None and rubs.law != model.law else model.parameters
        damping = {"frame_damping_ratio": scene.frame_damping_ratio} if not dimensionless else {}
        values = {**damping, **held, **values}
    mu = rubs.mu if rubs.mu is not None or model is None or model.static_ratio == 1.0 else model.static_ratio
    law = rubs.law or ("coulomb" if model is None or model.law == "auto" else model.law)
    wall = rubs.wall or ("fixed" if model is None else model.wall)
    try:
        return Problem(r, beta, mu, rubs.zeta, wall, law=law, parameters=values), units
    except SimulationError as error:
        raise UsageError(str(error)) from error


def _units(scene: "Scene", rubs: Rubbing) -> Units:
    amplitude = rubs.base_amplitude or scene.plan.base_amplitudes_m[0]
    return Units(amplitude, scene.rig.stiffness)


def _beta(rubs: Rubbing, scene: "Scene | None", units: Units | None) -> float:
    """The friction ratio: as given, or from coefficient, normal force, stiffness and base amplitude; eq. (2.8)."""
    if rubs.beta is not None:
        if rubs.coefficient is not None:
            raise UsageError("expected --beta or --coefficient; got both")
        return rubs.beta
    prior = scene.plan.friction_coefficient if scene is not None else None
    coefficient = rubs.coefficient if rubs.coefficient is not None or prior is None else prior[0]
    force = rubs.normal_force or (None if scene is None else scene.experiment.normal_force_n)
    stiffness = None if units is None else units.stiffness_n_per_m
    lacking = {
        "--coefficient MU": coefficient,
        "--normal-force N": force,
        "--scene TOML with stiffness_n_per_m (or mass_kg and natural_frequency_hz) in [rig]": stiffness,
    }
    if coefficient is None or force is None or stiffness is None or units is None:
        missing = ", ".join(name for name, value in lacking.items() if value is None)
        raise UsageError(f"friction: expected --beta BETA (friction force over k Y), or, all of them: {missing}")
    return coefficient * force / (stiffness * units.base_amplitude_m)


@dataclass(frozen=True)
class _Ask:
    """A problem, and what is done with its answer."""

    problem: "Problem"
    units: Units | None
    output: Path | None
    plot: Path | None
    force: bool
    as_json: bool
    quiet: bool

    def solve(self, solver: Literal["auto", "closed-form", "exact", "numeric", "thesis"], cycles: int | None) -> None:
        """Solve the steady state, or run so many cycles from rest."""
        from frictionlab.verbs.simulating import simulate

        plot = figure_file(self.plot, "motion", force=self.force)
        if self.output is not None:
            check_output(self.output, MOTIONS, force=self.force)
            _refuse_a_map(self.output, force=self.force)
        start = time.perf_counter()
        state = simulate(self.problem, cycles=cycles, solver=solver)
        row = self._row(state, time.perf_counter() - start)
        if self.as_json:
            typer.echo(json_line(row))
        else:
            self._print([row])
            typer.echo(state.verdict)
            if "response_amplitude_m" in row:
                typer.echo(_in_units(row))
            self._warn(said for said in state.warnings if said not in state.verdict)
        if self.output is not None:
            _write(state, row, self.output, force=self.force)
        if plot is not None:
            from frictionlab.verbs.presenting import plot as draw

            draw(state, plot, force=self.force)

    def find_all(self) -> None:
        """Find, print, write and draw all steady states: one row each, the most visited first."""
        from frictionlab.simulator.coexisting import coexisting

        plot = figure_file(self.plot, "coexisting", force=self.force)
        if self.output is not None:
            check_output(self.output, MOTIONS, force=self.force)
            if self.output.suffix == ".h5":
                raise UsageError(
                    f"{self.output}: --all gives rows without motions; expected .csv, .jsonl, .xlsx or .parquet"
                )
        start = time.perf_counter()
        found = coexisting(self.problem)
        seconds = time.perf_counter() - start
        rows: list[Row] = [{**self._row(each.state, seconds), "basin_share": each.share} for each in found]
        for row in rows if self.as_json else ():
            typer.echo(json_line(row))
        if not self.as_json:
            self._print(rows)
            for each in found:
                typer.echo(f"{each.share:.3g} of the starts: {each.state.verdict}")
            self._warn(said for each in found for said in each.state.warnings if said not in each.state.verdict)
        if self.output is not None:
            write_rows(rows, self.output, MOTIONS, force=self.force)
        if plot is not None:
            from frictionlab.figures.coexisting import coexisting_figure
            from frictionlab.figures.style import save

            make_folder(plot.parent)
            save(coexisting_figure(found), plot, force=self.force)

    def follow(self, path: Path, scene: Path | None, settings: Mapping[str, object], highpass_hz: float | None) -> None:
        """Simulate the response to a file's base motion; print, write and draw it."""
        from frictionlab.verbs.rows import row_of

        plot = figure_file(self.plot, "response", force=self.force, inputs=[path])
        _check_series(self.output, [path, *([] if scene is None else [scene])], force=self.force)
        job = partial(
            _respond, problem=self.problem, scene=scene, settings=settings, highpass_hz=highpass_hz,
            output=self.output, plot=plot, force=self.force,
        )  # fmt: skip
        rows = report_rows([row_of(job, path, folder=None)], as_json=self.as_json)
        for row in () if self.as_json else rows:
            if row["status"] == "ok":
                print_turned([_numbers_of(row)], RESPONSES)
            else:
                complain(f"{row['source']}: {row['reason']}")
        if not (self.as_json or self.quiet):
            print_warnings(rows)
        exit_status(rows)

    def _row(self, state: "SteadyState", seconds: float) -> Row:
        """The row of a state with the contract's lists over masses and contacts, and in SI units where it can be."""
        problem, row = self.problem, state.row()
        contact = {
            "mass": 1,
            "against": "base" if problem.wall == "base" else "wall",
            "law": problem.law.name,
            **{key: row[key] for key in ("energy_per_cycle", "stops_per_cycle", "stuck_fraction")},
        }
        more: Row = {
            "wall_s": seconds,
            "law": problem.law.name,
            "parameters": problem.parameters,
            "response_amplitudes": [row["response_amplitude"]],
            "contacts": [contact],
        }
        units = {} if self.units is None else self.units.of(row, problem.beta)
        return {**row, **more, **units}

    def _print(self, rows: list[Row]) -> None:
        print_turned(map(_numbers_of, rows), MOTIONS)

    def _warn(self, sentences: Iterator[str]) -> None:
        if not self.quiet:
            print_warnings([{"warnings": list(dict.fromkeys(sentences))}])


def _in_units(row: Row) -> str:
    """A state in mm, mJ and N, as far as they are known."""
    known = {
        "X": ("response_amplitude_m", 1e3, "mm"),
        "E": ("energy_per_cycle_j", 1e3, "mJ"),
        "F": ("friction_force_n", 1, "N"),
    }
    found = {name: (row.get(key), times, unit) for name, (key, times, unit) in known.items()}
    return ", ".join(f"{n} {times * v:.4g} {unit}" for n, (v, times, unit) in found.items() if isinstance(v, float))


def _numbers_of(row: Row) -> Row:
    """The row of a state as it stands on a screen: warnings stand below it, and growth where it is known."""
    hidden = {"warnings", "response_amplitudes", "contacts"} | (
        {"growth_per_cycle"} if row.get("growth_per_cycle") is None else set()
    )
    return {key: value for key, value in row.items() if key not in hidden}


def _refuse_a_map(output: Path, *, force: bool) -> None:
    """Refuse to replace the map of a sweep: hours of work, whose first columns are those of one state too."""
    if force or output.suffix not in (".csv", ".jsonl") or not output.exists():
        return
    with output.open(encoding="utf-8") as file:
        head = file.readline()
    if head.strip() and "wall_s" not in head:
        raise UsageError(f"{output}: exists, and is the map of a sweep: choose another output, or give --force")


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


def _respond(
    path: Path,
    *,
    problem: "Problem",
    scene: Path | None,
    settings: Mapping[str, object],
    highpass_hz: float | None,
    output: Path | None,
    plot: Path | None,
    force: bool,
) -> Row:
    """The row of a file's base motion, its response written and drawn."""
    from frictionlab.verbs.presenting import plot as draw
    from frictionlab.verbs.simulating import respond

    start = time.perf_counter()
    answer = respond(path, problem, scene, highpass_hz=highpass_hz, **settings)
    row = answer.row() | {"wall_s": time.perf_counter() - start}
    if output is not None:
        _write_series(answer, output, force=force)
    if plot is not None:
        draw(answer, plot, force=force)
    return row


def _check_series(output: Path | None, read: list[Path], *, force: bool) -> None:
    """Refuse outputs that could not be written before the work."""
    from frictionlab.files import check_replaceable
    from frictionlab.hdf5 import check_writable

    if output is None:
        return
    if output.suffix not in SERIES:
        raise UsageError(f"{output}: expected a recording (.h5) or a log (.csv); got {output.suffix!r}")
    refuse_inputs([output], read)
    if output.suffix == ".h5":
        check_writable(output, force=force)
    else:
        check_replaceable(output, replace=force or _is_series)


def _is_series(path: Path) -> bool:
    """Whether a file is a log that this command wrote."""
    try:
        with path.open(encoding="utf-8") as file:
            head, _, last = file.readline(1000).rpartition(",")
    except (OSError, UnicodeDecodeError):
        return False
    return head == ",".join(HEAD) and last.startswith(FORCE)


def _write_series(answer: "RecordResponse", output: Path, *, force: bool) -> None:
    force_, unit = answer.contact_force
    name = FORCE if unit == "N" else f"{FORCE} over stiffness"
    if output.suffix == ".h5":
        from frictionlab.hdf5 import write_recording
        from frictionlab.recording import Channel

        contact = Channel("contact_force", force_, f"{name}, on the mass", unit)
        write_recording(answer.recording.changed(channels=(contact,)), output, force=force)
        return
    from frictionlab.files import write_whole

    part = answer.recording
    columns = (part.time, part.base_displacement, part.mass_displacement, force_)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    head = f"{','.join((*HEAD, f'{name} [{unit}]'))}\n".encode()
    lines = (f"{t!r},{y!r},{x!r},{n!r}\n".encode() for t, y, x, n in rows)
    write_whole(output, chain([head], lines), replace=force or _is_series)
