"""The end of a sensor's range against turning points and stops, and the range that the step betrays under spikes."""

import numpy as np
import pytest

from frictionlab.logs.sensor import examine, step_and_range
from frictionlab.recording import Quality
from tests.analysis.hostile import motion, seen
from tests.analysis.seen import STEP_M

QUIET = [  # r, beta, rate (Hz), base amplitude (m), noise (m): a tenth of a step and less
    (0.1, 0.3, 1000.0, 0.1e-3, 0.05e-6),
    (0.3, 0.6, 4000.0, 0.5e-3, 0.07e-6),
    (0.7, 0.5, 4000.0, 1.8e-3, 0.02e-6),
    (1.2, 0.3, 4000.0, 0.1e-3, 0.25e-6),
]


def held(values: np.ndarray) -> int:
    channel = examine(np.array(values), "mass")
    assert bool(channel.warnings) == bool(channel.quality.any())
    return int(np.count_nonzero(channel.quality & np.uint8(Quality.HELD)))


def cut(values: np.ndarray, share: float) -> np.ndarray:
    """The values as a sensor shows them whose range ends at this share of the motion's amplitude."""
    middle, half = 0.5 * (values.max() + values.min()), 0.5 * np.ptp(values)
    return np.asarray(np.round(np.clip(values, middle - share * half, middle + share * half) / STEP_M) * STEP_M)


@pytest.mark.parametrize(("r", "beta", "rate", "size", "noise"), QUIET)
def test_turning_points_of_a_quiet_sensor_are_no_end_of_its_range(
    r: float, beta: float, rate: float, size: float, noise: float
) -> None:
    """Up to a quarter of such logs was flagged, and the analysis refused for want of a whole cycle."""
    recording = seen(motion(r, beta), noise=noise, size=size, rate=rate, seconds=30.0)
    assert held(recording.mass_displacement) == held(recording.base_displacement) == 0
    assert held(cut(recording.mass_displacement, 0.8)) > 1000


def test_one_excursion_beyond_the_range_is_held_whatever_the_other_turning_points() -> None:
    x = np.array(seen(motion(0.5, 0.4), noise=0.05e-6, rate=1000.0, seconds=30.0).mass_displacement)
    x[10_000:20_000] *= 1.4
    end = np.round(1.1 * np.abs(x[:10_000]).max() / STEP_M) * STEP_M
    flagged = examine(np.minimum(x, end), "mass").quality & np.uint8(Quality.HELD)
    assert np.count_nonzero(flagged[10_000:20_000]) == np.count_nonzero(x > end)
    assert not flagged[:10_000].any()


@pytest.mark.parametrize(("measuring_range", "spikes"), [(0.010, 3), (0.050, 0), (0.050, 20), (0.200, 3)])
def test_spikes_do_not_make_the_range_look_smaller(measuring_range: float, spikes: int) -> None:
    """A handful of values between two levels made 50 mm look like 25 mm."""
    step = 1.02 * measuring_range / 65520
    values = np.array(seen(motion(0.5, 0.4), step=step, noise=step).mass_displacement)
    generator = np.random.default_rng(spikes)
    values[generator.integers(0, len(values), spikes)] += generator.normal(0.0, 1e-3, spikes)
    found, betrayed = step_and_range(values)
    assert found == pytest.approx(step, rel=1e-12)
    assert betrayed == measuring_range
