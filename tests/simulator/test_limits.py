"""Each term tends to plain friction in its limit's order: under harmonics, on a moving wall, with a damped frame."""

from typing import Any

import numpy as np
import pytest

from frictionlab.simulator import Base, Problem, SteadyState, steady_state
from tests.desk import present

TERMS = "coulomb+place+speed+breakaway"
NEUTRAL = {"gradient": 0.0, "contact_damping_ratio": 0.0, "static_ratio_up": 1.0, "static_ratio_down": 1.0}
HARMONICS = Base((1.0, 0.15, 0.05), (0.0, 0.1, 0.03))
SETTINGS: dict[str, tuple[float, float, dict[str, Any]]] = {  # r and beta at which the mass stops
    "harmonics": (0.45, 0.5, {"base": HARMONICS}),
    "moving wall": (0.9, 0.7, {"wall": "base"}),
    "frame": (0.45, 0.5, {"frame_damping_ratio": 0.02}),
    "all": (0.9, 0.75, {"wall": "base", "base": HARMONICS, "frame_damping_ratio": 0.02}),
}


def distance(one: SteadyState, other: SteadyState) -> float:
    """The largest difference of two orbits' displacements."""
    tau = np.linspace(0.0, 2.0 * np.pi, 200)
    return float(np.abs(present(one.orbit).at(tau)[0] - present(other.orbit).at(tau)[0]).max())


def orders(sizes: tuple[float, ...], distances: list[float]) -> list[float]:
    """With which power of the size the distance falls, from one size to the next."""
    return list(np.diff(np.log(distances)) / np.diff(np.log(sizes)))


@pytest.mark.parametrize("setting", SETTINGS)
@pytest.mark.parametrize(
    ("name", "sizes", "order"),
    [
        ("gradient", (1e-3, 1e-5, 1e-7), 1.0),
        ("contact_damping_ratio", (1e-3, 1e-5, 1e-7), 1.0),
        (
            "static_ratio_up",
            (1e-3, 1e-5, 1e-6),
            2.0,
        ),  # released dt late, the mass has missed F' dt^2 / 2 of its speed
    ],
)
def test_a_rigid_term_vanishes_in_its_order(setting: str, name: str, sizes: tuple[float, ...], order: float) -> None:
    r, beta, more = SETTINGS[setting]
    plain = steady_state(Problem(r, beta, **more))
    assert plain.stops_per_cycle
    changed = [NEUTRAL | {name: NEUTRAL[name] + size} for size in sizes]
    states = [steady_state(Problem(r, beta, law=TERMS, parameters=values, **more)) for values in changed]
    assert orders(sizes, [distance(state, plain) for state in states]) == pytest.approx([order] * 2, abs=0.02)


@pytest.mark.parametrize(("setting", "order"), [("harmonics", 1.0), ("moving wall", 1.0), ("frame", 1.0), ("all", 0.5)])
def test_a_stiff_contact_becomes_rigid_in_the_limits_order(setting: str, order: float) -> None:
    # under all together one turn has no stop: there the force takes a time of kappa^(-1/2) to change its sign
    r, beta, more = SETTINGS[setting]
    plain, sizes = steady_state(Problem(r, beta, **more)), (1e-3, 1e-7)
    assert plain.stops_per_cycle == 2.0 * order
    stiff = [{"stiffness_ratio": 1.0 / size} for size in sizes]
    states = [steady_state(Problem(r, beta, law="coulomb+compliance", parameters=values, **more)) for values in stiff]
    assert orders(sizes, [distance(state, plain) for state in states]) == pytest.approx([order], abs=0.06)
