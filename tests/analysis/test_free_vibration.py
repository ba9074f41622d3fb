"""Free vibration of whole records: taps found, both dampings, what is no free decay refused by name."""

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from frictionlab.analysis.decay import Decay
from frictionlab.analysis.free_vibration import averages, free_vibrations, scene_snippet
from frictionlab.errors import AnalysisError
from frictionlab.estimate import Average, average
from frictionlab.scene import scene_from_tables
from tests.analysis.seen import through_laser

RATE, HZ = 500.0, 3.126
OMEGA = 2 * math.pi * HZ


def decaying(zeta: float, friction: float = 0.0, seconds: float = 25.0, swing: float = 5e-3) -> np.ndarray:
    t = np.arange(round(seconds * RATE)) / RATE
    return Decay(0.0, swing, 0.0, OMEGA, zeta, friction).at(t)


def viscous(zeta: float, seconds: float = 25.0) -> np.ndarray:
    return decaying(zeta, 0.0, seconds)


def clock(x: np.ndarray) -> np.ndarray:
    return np.arange(len(x)) / RATE


def seen(x: np.ndarray, seed: int = 1) -> np.ndarray:
    return through_laser(x, np.random.default_rng(seed))


@pytest.mark.parametrize("zeta", [0.002, 0.0055, 0.02, 0.1])
def test_viscous_decay(zeta: float) -> None:
    x = seen(viscous(zeta))
    (tap,) = free_vibrations(clock(x), x)
    assert tap.natural_frequency_hz == pytest.approx(HZ, rel=1e-4)
    assert tap.damped_frequency_hz == pytest.approx(HZ * math.sqrt(1 - zeta**2), rel=1e-4)
    assert tap.damping_ratio == pytest.approx(zeta, rel=0.002)
    assert tap.friction_m < 1e-7


@pytest.mark.parametrize(("zeta", "friction"), [(0.004, 50e-6), (0.0055, 5e-6), (0.0, 100e-6)])
def test_viscous_and_friction_damping_together(zeta: float, friction: float) -> None:
    x = seen(decaying(zeta, friction) + 0.02, 2)
    (tap,) = free_vibrations(clock(x), x)
    assert tap.damping_ratio == pytest.approx(zeta, abs=2e-5)
    assert tap.friction_m == pytest.approx(friction, rel=0.003)
    assert tap.misfit < 1e-3
    assert not tap.warnings


def test_several_taps_in_one_file_are_found() -> None:
    rest = np.zeros(round(2 * RATE))
    parts = [rest, decaying(0.01, swing=3e-3), rest, decaying(0.01, swing=-4e-3), decaying(0.01, swing=5e-3)]
    x = seen(np.concatenate(parts))
    taps = free_vibrations(clock(x), x)
    assert [round(tap.start_s) for tap in taps] == [2, 29, 54]
    assert [tap.damping_ratio for tap in taps] == pytest.approx([0.01] * 3, rel=0.005)
    means = averages(taps)
    assert means["natural_frequency_hz"].mean == pytest.approx(HZ, rel=1e-5)
    assert 0.0 < means["damping_ratio"].se < 5e-5


def test_a_tap_by_a_hammer_begins_with_a_velocity() -> None:
    t = np.arange(round(25 * RATE)) / RATE
    struck = np.where(t > 1.0, 5e-3 * np.exp(-0.01 * OMEGA * (t - 1.0)) * np.sin(OMEGA * (t - 1.0)), 0.0)
    x = seen(struck)
    (tap,) = free_vibrations(t, x)
    assert tap.start_s == pytest.approx(1.0 + 0.75 / HZ, abs=0.01)
    assert tap.damping_ratio == pytest.approx(0.01, rel=0.01)


def test_rest_before_the_release_and_the_sensors_zero_do_not_matter() -> None:
    held = np.concatenate([np.full(1000, 5e-3), viscous(0.01)]) + 0.02
    x = seen(held, 3)
    (tap,) = free_vibrations(clock(x), x)
    assert tap.natural_frequency_hz == pytest.approx(HZ, rel=1e-4)
    assert tap.damping_ratio == pytest.approx(0.01, rel=0.005)


def test_a_coarse_clock_and_missing_samples_do_not_matter() -> None:
    x = seen(decaying(0.0055, 5e-6))
    keep = np.delete(np.arange(0, len(x), 16), [40, 41, 100])  # 31 Hz: ten samples a cycle
    (tap,) = free_vibrations(clock(x)[keep], x[keep])
    assert tap.damping_ratio == pytest.approx(0.0055, rel=0.01)
    assert tap.friction_m == pytest.approx(5e-6, rel=0.05)


def test_a_mass_that_does_not_swing_is_refused() -> None:
    for x in (seen(np.zeros(5000), 4), seen(viscous(0.5), 5)):
        with pytest.raises(AnalysisError, match=r"at least 6 half-cycles above the noise; got [0-5]:"):
            free_vibrations(clock(x), x)


def test_a_driven_motion_is_refused_by_name() -> None:
    t = np.arange(round(30 * RATE)) / RATE
    x = seen(3e-3 * np.sin(2 * math.pi * 2.35 * t))
    with pytest.raises(AnalysisError, match="a driven motion, not a free decay"):
        free_vibrations(t, x)


def test_a_growing_motion_is_refused_by_name() -> None:
    t = np.arange(round(10 * RATE)) / RATE
    x = seen(1e-4 * np.exp(0.01 * OMEGA * t) * np.sin(OMEGA * t))
    with pytest.raises(AnalysisError, match=r"the motion grows .* negative damping"):
        free_vibrations(t, x)


def test_a_base_that_moves_is_a_drive_and_one_that_moves_a_little_is_said() -> None:
    x = seen(viscous(0.01))
    with pytest.raises(AnalysisError, match="the base moves by 21% of the mass's swing"):
        free_vibrations(clock(x), x, 1e-3 * np.sin(OMEGA * clock(x)))
    (tap,) = free_vibrations(clock(x), x, 5e-5 * np.sin(OMEGA * clock(x)))
    assert "the base moves by 1.0% of the mass's swing" in tap.warnings[0]


def test_a_stiffness_that_grows_with_the_swing_is_said() -> None:
    t = np.arange(round(25 * RATE)) / RATE
    size = 5e-3 * np.exp(-0.01 * OMEGA * t)
    phase = OMEGA * np.cumsum(1 + 0.02 * (size / 5e-3) ** 2) / RATE
    x = seen(size * np.cos(phase))
    (tap,) = free_vibrations(t, x)
    assert any("the spring is not linear" in sentence for sentence in tap.warnings)
    assert tap.natural_frequency_hz == pytest.approx(HZ, rel=1e-3)
    assert tap.cubic_share == pytest.approx(0.02 * 8 / 3, rel=0.15)  # the frequency rises by 3/8 of it


def test_average_weighs_errors_and_scatter() -> None:
    assert average([3.0], [0.1]) == Average(3.0, 0.1, None)
    alike = average([3.1, 3.2, 3.3], [1e-6] * 3)
    assert (alike.mean, alike.spread, alike.se) == pytest.approx((3.2, 0.1, 0.1 / math.sqrt(3)), rel=1e-6)
    assert average([1.0, 2.0], [1e-3, 1.0]).mean == pytest.approx(1.0, abs=0.01)
    assert average([1.0, 1.0], [0.1, 0.1]).se == pytest.approx(0.1 / math.sqrt(2))
    with pytest.raises(AnalysisError, match="expected at least one tap"):
        averages([])


def test_what_is_held_at_zero_weighs_by_its_limit() -> None:
    x = seen(viscous(0.01))
    (tap,) = free_vibrations(clock(x), x)
    at_zero = replace(tap, friction_m=0.0, friction_m_se=None, friction_m_upper=1.645e-6)
    found = averages([at_zero])["friction_m"]
    assert (found.mean, found.se) == pytest.approx((0.0, 1e-6))


def test_the_snippet_is_a_scene() -> None:
    x = seen(decaying(0.0055, 5e-6))
    found = averages(free_vibrations(clock(x), x))
    scene = scene_from_tables(tomllib.loads(scene_snippet(found)))
    assert scene.rig.natural_frequency_hz == pytest.approx(HZ, rel=1e-5)
    assert scene.rig.damping_ratio == pytest.approx(0.0055, rel=1e-3)
    assert 0.0 < (scene.rig.damping_ratio_u or 0.0) < 1e-5


@pytest.mark.parametrize("size", [5e-6, 20e-6, 50e-6])
@pytest.mark.parametrize("zeta", [0.0055, 0.02])
def test_hum_of_the_mains_is_taken_out(size: float, zeta: float) -> None:
    """In both channels; 34 of 57 such decays were refused as driven."""
    t = clock(viscous(zeta))
    hum = size * np.cos(2 * np.pi * 50.02 * t + 1.0)
    x, base = seen(decaying(zeta, 10e-6) + hum), seen(0.5 * hum, 2)
    (tap,) = free_vibrations(t, x, base)
    assert tap.natural_frequency_hz == pytest.approx(HZ, rel=1e-4)
    assert tap.damping_ratio == pytest.approx(zeta, rel=0.01)
    assert abs(tap.friction_m - 10e-6) < 3 * (tap.friction_m_se or 0.0)


def test_a_pendulum_of_large_angles() -> None:
    t = np.arange(0.0, 30.0, 0.01)
    x = Decay(0.0, 1.0, 0.02, 4.0, 0.002, 0.004, pendulum=True).at(t) + 1e-4 * np.random.default_rng(1).normal(
        size=len(t)
    )
    (tap,) = free_vibrations(t, x, pendulum=True)
    assert tap.natural_frequency_hz == pytest.approx(4.0 / (2 * math.pi), rel=2e-4)
    assert abs(tap.friction_m - 0.004) < 3 * (tap.friction_m_se or 0.0)
    assert tap.damping_ratio == pytest.approx(0.002, rel=0.05)
