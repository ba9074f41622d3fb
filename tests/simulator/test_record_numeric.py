"""Laws without exact phases under a sampled base: against scipy knot by knot, the steady state, the exact kernel."""

import importlib
from typing import Any

import numpy as np
import pytest

from frictionlab.errors import SimulationError
from frictionlab.simulator import Problem, steady_state
from frictionlab.simulator.record import BaseRecord, respond
from tests.simulator import numeric_oracle as oracle
from tests.simulator.test_record import cosine_record, some_base

carrier = importlib.import_module("frictionlab.simulator.record.carry")
LAWS = {name.removeprefix("coulomb+"): parameters for name, parameters in oracle.LAWS.items()}


def problem_of(law: str, wall: Any = "fixed") -> Problem:
    more = {"contact_damping_ratio": 0.02}
    if law != "rate-state":  # where friction depends on place, the twin's age is another than the law's
        more["gradient"] = 0.05
    name = f"coulomb+{law}+speed" + "+place" * (law != "rate-state")
    return Problem(1.0, 0.15, wall=wall, law=name, parameters=LAWS[law] | more, frame_damping_ratio=0.03)


def drive_of(problem: Problem, base: BaseRecord) -> Any:
    """F of the equation in z, by scipy's spline."""
    from scipy.interpolate import CubicSpline  # noqa: PLC0415

    f: Any = CubicSpline(base.time, base.values)
    if problem.wall == "base":
        return lambda t: -float(f(t, 2))
    return lambda t: float(f(t) + 2.0 * problem.frame_damping_ratio * f(t, 1))


@pytest.mark.parametrize(("law", "wall"), [*((law, "fixed") for law in LAWS), ("stribeck", "base"), ("dahl", "base")])
def test_it_is_scipys_from_knot_to_knot(law: str, wall: str) -> None:
    problem = problem_of(law, wall)
    base = BaseRecord(*some_base(7, 9, even=False))
    start = np.zeros(2 + (problem.law.kind == "inner") + (law == "rate-state"))
    start[:2] = (0.1, 0.3)
    first = (base.values[0], base.speeds[0]) if wall == "base" else (0.0, 0.0)
    if law == "rate-state":
        start[3] = problem.beta  # the twin's age is not over beta
    seen = respond(problem, base, x0=0.1 + first[0], v0=0.3 + first[1])
    slow = oracle.along(problem, drive_of(problem, base), base.time, start)
    moved = base.values if wall == "base" else 0.0
    assert seen.solver == "numeric"
    assert seen.displacement - moved == pytest.approx(slow[:, 0], abs=1e-8)
    assert seen.closure_error < 1e-11


@pytest.mark.parametrize("law", ["stribeck", "lugre"])
def test_it_reaches_the_steady_state(law: str) -> None:
    """An orbit that forgets its start: what is left is the steady state, to its own tolerance."""
    more = LAWS[law] | {"contact_damping_ratio": 0.1}
    r, base = 0.5, cosine_record(0.5, 16, 300)
    over_drive = {
        "stribeck_speed": r,
        "bristle_damping": 1.0 / r,
    }  # a speed over omega_n Y is r times that over omega Y
    own = {name: value * over_drive.get(name, 1.0) for name, value in more.items()}
    steady = steady_state(Problem(r, 0.4, law=f"coulomb+{law}+speed", parameters=more))
    assert steady.orbit is not None
    last = slice(-401, None)
    seen = respond(Problem(1.0, 0.4, law=f"coulomb+{law}+speed", parameters=own), base)
    assert seen.displacement[last] == pytest.approx(steady.orbit.at(r * base.time[last])[0], abs=1e-8)
    assert seen.contact_force[last] == pytest.approx(steady.orbit.force(r * base.time[last]), abs=1e-6)


@pytest.mark.parametrize("wall", ["fixed", "base"])
def test_plain_friction_is_the_exact_kernels(wall: Any) -> None:
    base = BaseRecord(*some_base(3, 60, even=True))
    more = {"gradient": 0.05, "contact_damping_ratio": 0.02}
    problem = Problem(1.0, 0.2, wall=wall, law="coulomb+place+speed", parameters=more, frame_damping_ratio=0.03)
    exact, numeric = (respond(problem, base, x0=0.2, v0=0.1, solver=solver) for solver in ("auto", "numeric"))
    assert numeric.stuck_in(0) == pytest.approx(exact.stuck_in(0), abs=1e-9)
    for key in ("displacement", "velocity", "contact_force"):
        assert getattr(numeric, key) == pytest.approx(getattr(exact, key), abs=1e-9), key
    assert numeric.contact_events[0] == pytest.approx(exact.contact_events[0], abs=1e-8)
    for key in ("energy", "friction_energy", "energy_input", "path", "stops", "time_stuck"):
        assert getattr(numeric, key) == pytest.approx(getattr(exact, key), abs=1e-8), key


def test_a_contact_that_creeps_has_the_stops_of_the_rigid_one() -> None:
    """Dahl's contact, stiff: as many stops as the rigid contact, nearly as long; its slip is the rigid one's way."""
    base = cosine_record(0.3, 6, 60)
    rigid = respond(Problem(1.0, 0.6), base)
    stiff = respond(Problem(1.0, 0.6, law="coulomb+dahl", parameters={"stiffness_ratio": 3e4}), base)
    assert stiff.stops == rigid.stops
    assert stiff.stuck_fraction == pytest.approx(rigid.stuck_fraction, abs=0.005)
    assert stiff.path == pytest.approx(rigid.path, rel=1e-3)
    assert stiff.friction_energy == pytest.approx(rigid.friction_energy, rel=1e-3)


def test_what_cannot_be_integrated_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    base = BaseRecord(*some_base(5, 20, even=True))
    with pytest.raises(SimulationError, match="friction turns negative"):
        respond(Problem(1.0, 0.1, law="coulomb+stribeck+place", parameters=LAWS["stribeck"] | {"gradient": 2.0}), base)
    monkeypatch.setattr(carrier, "ALLOWED", 3)
    with pytest.raises(SimulationError, match=r"more steps than allowed.* too stiff"):
        respond(Problem(1.0, 0.1, law="coulomb+dahl", parameters={"stiffness_ratio": 1e5}), base)
