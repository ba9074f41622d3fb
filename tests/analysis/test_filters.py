"""Sensors with low-pass filters that the scene declares: what they cut away is said, counted, and not asked for."""

import numpy as np
import pytest
from numpy.typing import NDArray

from frictionlab import compare
from frictionlab.analysis.channels import SensorChannel, cut_away, in_band, kept, low_pass
from frictionlab.analysis.measurement import measure
from frictionlab.errors import AnalysisError
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem, steady_state
from tests.benchmarks.recording_coverage import Sensors
from tests.desk import present
from tests.inference.contacts import recorded, scene

FloatArray = NDArray[np.float64]
SHARE = "filter of the mass sensor"


def through(r: float, mass: tuple[float, int], base: tuple[float, int]) -> tuple[Recording, Scene]:
    """A contact of friction ratio 0.4 through exact sensors with filters (cut-off, order), and its scene."""
    keys = ("mass_filter_hz", "mass_filter_order", "base_filter_hz", "base_filter_order")
    filters = dict(zip(keys, (*mass, *base), strict=True))
    sensors = Sensors(np.zeros(7), filters)
    recording = recorded(Problem(r, 0.4), np.random.default_rng(3), seconds=30.0, sensors=sensors)
    return recording, scene(sensors={"lag_s_u": 1e-4, **filters})


def test_what_is_kept_is_all_up_to_where_a_filter_leaves_three_tenths() -> None:
    channel = SensorChannel(cutoff=10.0, order=4)
    edge = 10.0 * (1.0 / 0.09 - 1.0) ** 0.125
    found = kept(np.array([0.0, 0.999 * edge, 40.0]), channel)
    np.testing.assert_allclose(found, [1.0, 1.0, abs(low_pass(np.array([40.0]), 10.0, 4)[0]) / 0.3])
    np.testing.assert_array_equal(kept(np.array([1.0, 1e3]), SensorChannel()), [1.0, 1.0])


def test_a_cycle_in_a_band_has_its_harmonics_by_their_shares() -> None:
    tau = 2 * np.pi * np.arange(256) / 256
    share = np.ones(128)
    share[4] = 0.25
    cycle = np.cos(tau) + 0.3 * np.sin(5 * tau)
    np.testing.assert_allclose(in_band(cycle, share), np.cos(tau) + 0.075 * np.sin(5 * tau), atol=1e-15)
    assert in_band(cycle, np.ones(128)) is cycle


def test_the_third_harmonic_of_a_mass_that_slides_is_what_its_friction_makes() -> None:
    """Far above resonance little friction hardly bends the cycle: its third harmonic is that of the force's."""
    state = steady_state(Problem(1.6, 0.05))
    x = present(state.orbit).at(2 * np.pi * np.arange(512) / 512)[0]
    found = abs(np.fft.rfft(x)[3]) * 2.0 / 512
    energy = present(state.energy_per_cycle)
    friction = energy / (4.0 * 0.5 * float(np.ptp(x)))
    channel, cosine = SensorChannel(cutoff=5.0, order=8), np.cos(2 * np.pi * np.arange(512) / 512)
    assert cut_away(cosine, 5.0, channel, friction=friction, r=1.6) == pytest.approx(found, rel=0.01)


@pytest.mark.parametrize(
    ("r", "cutoff", "order"),
    [(0.15, 3.2, 4), (0.3, 3.6, 8), (0.5, 2.8, 8)],
)
def test_a_law_is_compared_in_the_band_that_a_filter_leaves(r: float, cutoff: float, order: int) -> None:
    """It was compared with all its harmonics: a misfit of 4 to 52 standard errors, the amplitude 3 to 24 u off."""
    recording, what = through(r, (cutoff, order), (20.0, 1))
    found, measured = compare(recording, what), measure(recording, what)
    shown = steady_state(Problem(r, 0.4))
    assert found.verdict == "explained"
    assert found.friction_ratio == pytest.approx(0.4, abs=3.0 * (found.friction_ratio_u or 0.0))
    assert (found.friction_ratio_u or 1.0) < 0.006
    assert measured.response_amplitude == pytest.approx(
        shown.response_amplitude, abs=2.0 * (measured.response_amplitude_u or 0.0)
    )
    assert any("mass_filter_hz" in said and "stops_per_cycle" in said for said in measured.warnings)


@pytest.mark.parametrize("r", [0.1, 0.8])
def test_a_wide_filter_costs_nothing_and_is_not_warned_of(r: float) -> None:
    recording, what = through(r, (40.0, 2), (40.0, 2))
    m = measure(recording, what)
    assert m.budget["response_amplitude"][SHARE] < 0.3 * (m.response_amplitude_u or 0.0)
    assert not any("filter" in said for said in m.warnings)
    bare = measure(recording, scene())
    assert SHARE not in bare.budget["response_amplitude"]
    np.testing.assert_array_equal(bare.cycle.kept, 1.0)


@pytest.mark.parametrize("role", ["mass", "base"])
def test_a_filter_that_leaves_too_little_of_the_drive_is_refused(role: str) -> None:
    """Base and mass came out as a tenth of what they are: an amplitude of 25 for 2."""
    recording, what = through(1.2, *((2.2, 8), (60.0, 1))[:: 1 if role == "mass" else -1])
    with pytest.raises(AnalysisError, match=rf"the {role}'s low-pass filter of 2\.2 Hz and order 8 .* \[sensors\]"):
        measure(recording, what)
