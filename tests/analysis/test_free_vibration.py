import math

import numpy as np
import pytest

from frictionlab.analysis.free_vibration import average, free_vibration, scene_snippet
from frictionlab.errors import AnalysisError
from tests.analysis.seen import through_laser

RATE, HZ = 500.0, 3.126


def viscous(zeta: float, seconds: float = 25.0) -> np.ndarray:
    t = np.arange(round(seconds * RATE)) / RATE
    omega, damped = 2 * math.pi * HZ, 2 * math.pi * HZ * math.sqrt(1 - zeta**2)
    return 5e-3 * np.exp(-zeta * omega * t) * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t))


def coulomb(drop: float, seconds: float = 20.0) -> np.ndarray:
    """Piece by piece: in each half-cycle a cosine about +-drop, until the mass rests within it."""
    t = np.arange(round(seconds * RATE)) / RATE
    x, start, side, begin = np.zeros(len(t)), 5e-3, 1.0, 0.0
    while abs(start) > drop:
        end = begin + 0.5 / HZ
        inside = (t >= begin) & (t < end)
        x[inside] = side * drop + (start - side * drop) * np.cos(2 * math.pi * HZ * (t[inside] - begin))
        start, side, begin = 2 * side * drop - start, -side, end
    x[t >= begin] = start
    return x


@pytest.mark.parametrize("zeta", [0.002, 0.0055, 0.02, 0.1])
def test_viscous_decay(zeta: float) -> None:
    seen = through_laser(viscous(zeta), np.random.default_rng(1))
    decay = free_vibration(seen, 1 / RATE)
    assert decay.natural_frequency_hz == pytest.approx(HZ, rel=2e-4 + 0.05 * zeta)
    assert decay.damping_ratio == pytest.approx(zeta, rel=0.01)
    assert decay.decay == "viscous"
    assert decay.amplitude_m == pytest.approx(5e-3 * (1 + math.exp(-math.pi * zeta)) / 2, rel=0.3)


def test_coulomb_decay() -> None:
    seen = through_laser(coulomb(0.1e-3), np.random.default_rng(2))
    decay = free_vibration(seen, 1 / RATE)
    assert decay.natural_frequency_hz == pytest.approx(HZ, rel=3e-3)
    assert decay.coulomb_m == pytest.approx(0.1e-3, rel=0.01)
    assert decay.decay == "Coulomb"
    assert decay.coulomb_misfit < 0.1 * decay.viscous_misfit


def test_rest_before_the_release_and_the_sensors_zero_do_not_matter() -> None:
    held = np.concatenate([np.full(1000, 5e-3), viscous(0.01)]) + 0.02
    decay = free_vibration(through_laser(held, np.random.default_rng(3)), 1 / RATE)
    assert decay.natural_frequency_hz == pytest.approx(HZ, rel=1e-3)
    assert decay.damping_ratio == pytest.approx(0.01, rel=0.02)


def test_a_mass_that_does_not_swing_is_refused() -> None:
    with pytest.raises(AnalysisError, match="at least 6 half-cycles above the noise; got 0"):
        free_vibration(through_laser(np.zeros(5000), np.random.default_rng(4)), 1 / RATE)
    with pytest.raises(AnalysisError, match="half-cycles above the noise; got"):
        free_vibration(through_laser(viscous(0.5), np.random.default_rng(5)), 1 / RATE)


def test_average_and_snippet() -> None:
    assert average([3.0]) == average([3.0])
    assert average([3.0]).spread is None
    mean = average([3.1, 3.2, 3.3])
    assert (mean.mean, mean.spread, mean.se) == pytest.approx((3.2, 0.1, 0.1 / math.sqrt(3)))
    assert "natural_frequency_hz = 3.2" in scene_snippet(3.2, 0.01)
