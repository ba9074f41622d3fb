"""The formulas of a slide, against the textbook at 50 digits and against the equation of motion itself."""

from math import cos, nextafter, pi, sin

import mpmath as mp
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.simulator.kernel.layout import Force, Oscillator, State
from frictionlab.simulator.kernel.motion import forced_motion, free_motion, gap, local_force, make_oscillator, motion_at

RATIOS = st.floats(0.01, 30.0)
DAMPINGS = st.sampled_from([0.0, 1e-9, 0.01, 0.3, 0.999999, 1.0, 1.000001, 3.0, 10.0])


def force_of(*coefficients: float) -> Force:
    zeros = [0.0] * len(coefficients)
    return Force(list(coefficients), list(zeros), list(zeros), list(zeros))


def slide_of(r: float, zeta: float, force: Force) -> Oscillator:
    return make_oscillator(r, zeta, 1.0, force)


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
@pytest.mark.parametrize("r", [0.01, 0.5, 1.0 - 1e-12, nextafter(1, 0), 1.0, 1.0 + 1e-9, 1.2, 3.0, 1e3])
def test_motion_from_rest_agrees_with_fifty_digits_also_through_resonance(r: float, zeta: float) -> None:
    slide = slide_of(r, zeta, force_of(1.0))
    for t in (0.3 * min(r, 1.0), 0.7, pi):
        _, h, lost = free_motion(t, slide)
        c, s, rest, low, high = forced_motion(t, 1.0, slide, h, lost)
        assert (low, high) == pytest.approx((cos(t), sin(t)), abs=1e-15)
        assert rest == pytest.approx(c - lost, abs=1e-15 * (1.0 + abs(c)))
        truth = from_rest(r, zeta, 1, t)
        few = 5e-15 * (1.0 + t / r)
        assert abs(complex(c, s) - complex(truth)) <= few * (abs(truth) + min(1.0, t * t / (r * r)))


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.9999999, 1.0, 1.5])
def test_free_motion_is_the_motion_of_unit_displacement_and_unit_velocity(zeta: float) -> None:
    slide = slide_of(0.37, zeta, force_of(1.0))
    with mp.workdps(50):
        odd = mp.mpf(zeta) + (mp.mpf(10) ** -30 if zeta == 1.0 else 0)
        root = mp.sqrt(mp.mpc(odd**2 - 1))
        l1, l2 = (-odd + root) / mp.mpf(0.37), (-odd - root) / mp.mpf(0.37)
        for t in (1e-6, 0.2, 2.0):
            e1, e2 = mp.exp(l1 * t), mp.exp(l2 * t)
            g, h, lost = free_motion(t, slide)
            assert g == pytest.approx(float(((l1 * e2 - l2 * e1) / (l1 - l2)).real), abs=1e-15)
            assert h == pytest.approx(float(((e1 - e2) / (l1 - l2)).real), rel=1e-14, abs=1e-16)
            assert lost == pytest.approx(float((1 - (l1 * e2 - l2 * e1) / (l1 - l2)).real), rel=1e-9)


@settings(deadline=None)
@given(r=RATIOS, zeta=DAMPINGS, tau=st.floats(0.0, 6.28), z=st.floats(-2, 2), v=st.floats(-2, 2), t=st.floats(0.0, 3.0))
def test_a_slide_satisfies_the_equation_of_motion(
    r: float, zeta: float, tau: float, z: float, v: float, t: float
) -> None:
    force = force_of(1.0, 0.1, 0.05)
    force.sine[1] = 0.07
    slide, beta, side = slide_of(r, zeta, force), 0.3, 1.0
    push, _ = local_force(tau, force)
    start = State(z, v, (push - z - beta * side - 2 * zeta * r * v) / r**2)
    way, speed, acceleration, _ = motion_at(t, slide, force, start)
    now = sum(
        a * cos(k * (tau + t)) + b * sin(k * (tau + t))
        for k, (a, b) in enumerate(zip(force.cosine, force.sine, strict=True), 1)
    )
    left = r**2 * acceleration + 2 * zeta * r * speed + (z + way) - now + beta * side
    assert abs(left) <= 2e-13 * (1.0 + abs(z) + r * abs(v)) * (1.0 + zeta) * (1.0 + 1.0 / r)


@settings(deadline=None)
@given(r=RATIOS, zeta=DAMPINGS, t=st.floats(0.01, 2.0), u=st.floats(0.01, 2.0))
def test_two_slides_in_a_row_are_one(r: float, zeta: float, t: float, u: float) -> None:
    force = force_of(1.0)
    slide = slide_of(r, zeta, force)
    local_force(0.4, force)
    start = State(0.2, -0.3, (cos(0.4) - 0.2 + 0.3 + 2 * zeta * r * 0.3) / r**2)
    whole = motion_at(t + u, slide, force, start)
    way, v, a, _ = motion_at(t, slide, force, start)
    local_force(0.4 + t, force)
    rest, v2, _, _ = motion_at(u, slide, force, State(0.2 + way, v, a))
    assert way + rest == pytest.approx(whole[0], abs=1e-12 * (1 + 1 / r))
    assert v2 == pytest.approx(whole[1], abs=1e-12 * (1 + 1 / r**2))


@given(r=st.floats(0.001, 3.0), k=st.integers(1, 1000))
def test_the_distance_from_resonance_has_no_rounding_in_its_product(r: float, k: int) -> None:
    with mp.workdps(50):
        truth = 1 - mp.mpf(k) * mp.mpf(r)
        assert gap(r, float(k)) == pytest.approx(float(truth), rel=3e-16, abs=0.0 if truth else 1e-300)
