"""Steady states at hard points against the textbook at 50 digits (`reference`), and what is said of digits lost."""

import json
import math
from pathlib import Path
from typing import Any

import mpmath
import pytest

from frictionlab.simulator import Base, Problem, Solver, steady_state
from tests.desk import present
from tests.simulator.closed_form import of_modes, off
from tests.simulator.twin import problem_of

FOLDER = Path(__file__).parent / "reference"
RIGID, ELASTIC, RESONANCE = (
    json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8")) for name in ("rigid", "elastic", "resonance")
)


def point(row: dict[str, Any]) -> Problem:
    """The problem of a row."""
    base = Base(*map(tuple, row.get("base", [[1.0], [0.0]])))
    return problem_of(row["r"], row["beta"], row.get("wall", "fixed"), base, **row["parameters"])


def name_of(row: dict[str, Any]) -> str:
    numbers = " ".join(f"{name}={value!r}" for name, value in row["parameters"].items())
    return f"r={row['r']!r} beta={row['beta']!r} {row.get('why', numbers)}"


def of_what_is_not_told(row: dict[str, Any], problem: Problem) -> float:
    """What rounding takes of a motion beside its drive, of rates that are one, of little force over friction."""
    damping, stiffness = problem.zeta + problem.frame_damping_ratio, problem.parameter("stiffness_ratio")
    parted = max(1e-9, 1e-11 * problem.r) if damping**2 == 1.0 + stiffness else 0.0
    beside = 2e-18 / float(row["response_amplitude"]) if problem.r > 1.5 else 0.0
    excess = 2.0**-50 / (1.0 - problem.mu * problem.beta)  # |cos(tau) - x| <= 1 is rounded at both ends of a way
    return max(parted, beside, excess, 1e-11 if stiffness >= 1e9 else 0.0)


def viscous(r: float, zeta: float) -> dict[str, Any]:
    """A row of the motion without friction, by the textbook's formulas."""
    with mpmath.workdps(50):
        ratio, damp = mpmath.mpf(r), 2 * mpmath.mpf(zeta) * mpmath.mpf(r)
        square = 1 / ((1 - ratio**2) ** 2 + damp**2)
        energy, amplitude = (mpmath.nstr(value, 40) for value in (mpmath.pi * damp * square, mpmath.sqrt(square)))
    parameters = {"contact_damping_ratio": zeta} if zeta else {}
    numbers = {"energy_per_cycle": energy, "response_amplitude": amplitude, "stops_per_cycle": 0}
    return {"r": r, "beta": 0.0, "parameters": parameters, **numbers}


ANYWHERE = (1e-3, 0.1, 0.5, math.nextafter(0.5, 1), 1 / 3, 0.999999, 1.0, 1.5, 30.0, 1e3)
POINTS = [
    *((row, solver) for row in RIGID for solver in ("auto", "exact")),
    *((row, "auto") for row in (*ELASTIC, *RESONANCE)),
    *((viscous(1.0 + sign * 10.0**-k, 0.0), "auto") for k in range(1, 16) for sign in (1, -1)),
    *((viscous(r, zeta), "auto") for zeta in (1e-9, 0.05, 0.5, 1.0, 10.0) for r in ANYWHERE),
]


@pytest.mark.parametrize(("row", "solver"), POINTS, ids=lambda x: name_of(x) if isinstance(x, dict) else x)
def test_a_steady_state_agrees_with_fifty_digits(row: dict[str, Any], solver: Solver) -> None:
    problem = point(row)
    state, lost = steady_state(problem, solver=solver), of_modes(problem)
    if row in RESONANCE and state.outcome == "not found":  # refused by name, where the distance leaves too few digits
        assert lost > 1e-6
        return
    few, told = max(1e-12, lost, of_what_is_not_told(row, problem)), any("good to" in w for w in state.warnings)
    energy, amplitude = row["energy_per_cycle"], row["response_amplitude"]
    assert state.outcome == "periodic"
    errors = [off(state.energy_taken, energy)] if energy is not None else []
    if amplitude is not None and float(amplitude) > 1e-20:  # below, the mass rests anywhere within more than it moves
        errors.append(off(state.response_amplitude, amplitude))
    assert max(errors) < few
    assert told or max(errors) <= max(1e-10, of_what_is_not_told(row, problem))
    assert not told or lost > 1e-10 or row not in RESONANCE
    assert state.stops_per_cycle == row["stops_per_cycle"]
    if "stuck_fraction" in row:
        assert state.stuck_fraction == pytest.approx(float(row["stuck_fraction"]), rel=max(1e-10, few), abs=1e-12)
    size = present(state.energy_taken) or present(state.response_amplitude)
    assert present(state.closure_error) <= max(1e-11, few) * size + 1e-14
    assert abs(present(state.floquet_multiplier)) <= 1.0 + 1e-15
