"""The motion of a phase, against the textbook at 50 digits and against itself in two parts."""

from math import nextafter, pi

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.simulator import Base, Problem, simulate
from frictionlab.simulator.exact.answer import gap

RATIOS = st.floats(0.01, 30.0)
DAMPINGS = st.sampled_from([0.0, 1e-9, 0.01, 0.3, 0.999999, 1.0, 1.000001, 3.0, 10.0])


def few_of(zeta: float, few: float) -> float:
    """What rounding may do; of critical damping two rates are parted by 1e-10 of zeta (design, "One engine")."""
    return max(few, 1e-9) if abs(zeta - 1.0) < 1e-10 else few


def from_rest(r: float, zeta: float, k: int, t: float) -> mp.mpc:
    """Motion from rest under exp(i k t), at 50 digits: the integral of the free motion against the force, solved."""
    with mp.workdps(50):
        r, zeta, t = mp.mpf(r), mp.mpf(zeta), mp.mpf(t)
        if zeta == 1 or (zeta == 0 and k * r == 1):
            zeta += mp.mpf(10) ** -30  # the limit, to more digits than are compared
        root = mp.sqrt(mp.mpc(zeta * zeta - 1))
        l1, l2, s = (-zeta + root) / r, (-zeta - root) / r, mp.mpc(0, k)
        parts = [mp.exp(a * t) / ((a - b) * (a - c)) for a, b, c in ((s, l1, l2), (l1, s, l2), (l2, s, l1))]
        return sum(parts) / r**2


@pytest.mark.parametrize("zeta", [0.0, 1e-12, 1e-3, 0.5, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 2.0, 10.0])
@pytest.mark.parametrize("r", [0.01, 0.5, 1.0 - 1e-12, nextafter(1, 0), 1.0, 1.0 + 1e-9, 1.2, 3.0, 10.0])
def test_motion_from_rest_agrees_with_fifty_digits_also_through_resonance(r: float, zeta: float) -> None:
    runs = [simulate(Problem(r, 0.0, zeta=zeta, base=base), cycles=1) for base in (Base(), Base((0.0,), (1.0,)))]
    for t in (0.3 * min(r, 1.0), 0.7, pi):
        found, truth = complex(*(float(run.at(t)[0]) for run in runs)), from_rest(r, zeta, 1, t)
        few = few_of(zeta, 5e-15 * (1.0 + t / r))
        assert abs(found - complex(truth)) <= few * (abs(truth) + min(1.0, t * t / (r * r))) + 1e-19


@settings(deadline=None, max_examples=40)
@given(r=RATIOS, zeta=DAMPINGS, t=st.floats(0.01, 2.0), u=st.floats(0.01, 2.0))
def test_two_slides_in_a_row_are_one(r: float, zeta: float, t: float, u: float) -> None:
    problem = Problem(r, 0.0, zeta=zeta)
    whole = simulate(problem, cycles=1, x0=0.2, v0=-0.3, tau0=0.4)
    (x, last), (v, speed) = whole.at(np.array([0.4 + t, 0.4 + t + u]))
    rest = simulate(problem, cycles=1, x0=float(x), v0=float(v), tau0=0.4 + t).at(0.4 + t + u)
    few = few_of(zeta, 1e-12)
    assert float(rest[0]) == pytest.approx(float(last), abs=few * (1 + 1 / r))
    assert float(rest[1]) == pytest.approx(float(speed), abs=few * (1 + 1 / r**2))


@given(r=st.floats(0.001, 3.0), k=st.integers(1, 1000))
def test_the_distance_from_resonance_has_no_rounding_in_its_product(r: float, k: int) -> None:
    with mp.workdps(50):
        truth = 1 - mp.mpf(k) * mp.mpf(r)
        assert gap(r, float(k)) == pytest.approx(float(truth), rel=3e-16, abs=0.0 if truth else 1e-300)
