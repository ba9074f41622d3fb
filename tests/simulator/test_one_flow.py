"""One compiled flow for every exact law: plain Python as its twin, its derivative, phases that are forgotten."""

import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from frictionlab.errors import SimulationError
from frictionlab.simulator import Base, Contact, Problem, Structure, simulate, steady_state
from frictionlab.simulator.compiled import record_of
from frictionlab.simulator.exact import answer, orbit
from frictionlab.simulator.exact.motion import WORK
from frictionlab.simulator.exact.phase import DONE, MISSING, SLOTS, make_phase
from frictionlab.simulator.exact.solve import system_of
from frictionlab.simulator.laws import law_of

IWAN = {"stiffness_ratio": 20.0, "sliders": 3, "chi": -0.3}
NUMBERS = ("energy_per_cycle", "contact_energy_per_cycle", "floquet_multiplier")


def rubs(law: str, mass: int, against: int | str, /, **values: float) -> Contact:
    chosen = law_of(law)
    return Contact(mass, against, chosen, chosen.complete(values))


def frame(*contacts: Contact) -> Structure:
    return Structure.of_storeys(0.6, [1.0, 0.7], [1.0, 1.3], [0.02, 0.01], list(contacts))


TWO = frame(rubs("coulomb+place", 2, "base", beta=0.2, gradient=0.1), rubs("coulomb", 1, 2, beta=0.2))
ONE = (
    Problem(0.5, 0.4, law="coulomb+place", parameters={"gradient": 0.1}),
    Problem(0.6, 0.3, law="coulomb+iwan", parameters=IWAN, base=Base((1.0, 0.1))),
)


def numbers() -> list[list[float]]:
    """What three problems say: rigid with a gradient, Iwan's sliders, two masses with two contacts."""
    one, two = [steady_state(problem) for problem in ONE], steady_state(TWO)
    found = [[*(getattr(state, name) for name in NUMBERS), state.response_amplitude] for state in one]
    return [*found, [*(getattr(two, name) for name in NUMBERS), *two.response_amplitudes]]


def test_plain_python_is_the_twin_of_the_compiled_flow() -> None:
    code = "import json; from tests.simulator.test_one_flow import numbers; print(json.dumps(numbers()))"
    env = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=env, check=False)
    assert told.returncode == 0, told.stderr
    for fast, plain in zip(numbers(), json.loads(told.stdout), strict=True):
        np.testing.assert_allclose(fast, plain, rtol=1e-13, atol=1e-13)


BREAKAWAY = {"static_ratio_up": 1.2, "static_ratio_down": 1.1}
ALL = IWAN | BREAKAWAY | {"gradient": 0.1}
SYSTEMS = {
    "gradient": system_of(ONE[0]),
    "iwan": system_of(ONE[1]),
    "break-away": system_of(Problem(0.5, 0.4, zeta=0.02, wall="base", law="coulomb+breakaway", parameters=BREAKAWAY)),
    "iwan, all": system_of(Problem(0.6, 0.3, law="coulomb+iwan+place+breakaway", parameters=ALL)),
    "two masses": system_of(TWO),
    "two masses, iwan": system_of(
        frame(rubs("coulomb+iwan", 1, 2, beta=0.3, **IWAN), rubs("coulomb", 2, "wall", beta=0.1))
    ),
}


@pytest.mark.parametrize("systems", SYSTEMS.values(), ids=SYSTEMS)
def test_the_derivative_of_a_run_is_its_difference_quotient(systems: Any) -> None:
    size = int(2 * systems[0]["masses"] + systems[0]["sliders"])
    works, legs, h = record_of(WORK), record_of(orbit.LEG), 1e-6

    def end_of(start: np.ndarray, tau: float, span: float) -> np.ndarray:
        legs[0], end, code = (tau, span, 1, 1.0), np.empty(size), MISSING
        works[0]["left"] = np.inf
        while code == MISSING:
            code = answer.carry_on(systems, works, np.empty((0, 0)), legs, start.copy(), end, True)
            if code == MISSING:
                make_phase(systems, works)
        assert code == DONE
        return end

    state = end_of(np.zeros(size), 0.0, 7.0)
    masses = int(systems[0]["masses"])
    state[2 * masses :] = systems[0]["row"][0, :masses] @ state[:masses]  # relaxed: no slider is about to give way
    end_of(state, 0.7, 5.0)
    exact = works[0]["jacobian"][:size, :size].copy()
    for k in range(size):
        step = h * np.eye(size)[k]
        quotient = (end_of(state + step, 0.7, 5.0) - end_of(state - step, 0.7, 5.0)) / (2 * h)
        np.testing.assert_allclose(exact[:, k], quotient, atol=1e-5)


def test_more_phases_than_are_kept_are_refused_by_name() -> None:
    many = {"stiffness_ratio": 20.0, "sliders": 90, "chi": -0.3}
    rich = frame(rubs("coulomb+iwan", 1, "wall", beta=0.4, **many), rubs("coulomb+iwan", 2, 1, beta=0.3, **many))
    with pytest.raises(SimulationError, match=f"expected at most {SLOTS} in a motion; got more; do: give its contacts"):
        simulate(rich, cycles=2)
