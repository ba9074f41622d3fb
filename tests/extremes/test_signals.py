"""Signals at the edges of what a laser writes: each is measured right, or its fault is said, or it is refused."""

import math
from dataclasses import fields

import numpy as np
import pytest

from frictionlab.analysis.measurement import Measurement, measure
from frictionlab.errors import AnalysisError
from frictionlab.recording import Recording
from frictionlab.scene import Analysis, Rig, Scene
from frictionlab.simulator import Problem, steady_state
from tests.desk import present

LAG, SIZE = 0.9, 0.6  # x = 0.6 Y cos(tau - 0.9): an ellipse
ENERGY = math.pi * SIZE * math.sin(LAG)  # its area, eq. (2.18)
SCENE = Scene(rig=Rig(natural_frequency_hz=3.0), analysis=Analysis(transient_s=5.0, cycles="all"))


def ellipse(time: np.ndarray, *, drive: float = 1.0, unit: float = 1e-3, offset: float = 0.0) -> Recording:
    """Mass and base on an ellipse; amplitude of the base `unit`, both about `offset` times that."""
    tau = 2 * math.pi * drive * (time - time[0])
    return Recording(time, unit * (SIZE * np.cos(tau - LAG) + offset), unit * (np.cos(tau) + offset))


def even(duration: float = 40.0, rate: float = 200.0) -> np.ndarray:
    return np.arange(round(duration * rate)) / rate


def noisy(recording: Recording, share: float, seed: int = 1) -> Recording:
    noise = share * 1e-3 * np.random.default_rng(seed).standard_normal((2, len(recording.time)))
    return Recording(recording.time, recording.mass_displacement + noise[0], recording.base_displacement + noise[1])


def assert_ellipse(found: Measurement, within: float) -> None:
    assert found.drive_frequency_hz == pytest.approx(1.0, rel=within)
    assert found.energy_per_cycle == pytest.approx(ENERGY, rel=within)
    assert found.response_amplitude == pytest.approx(SIZE, rel=within)
    assert (found.regime, found.stops_per_cycle) == ("continuous", 0.0)
    assert_finite(found)


def assert_finite(found: Measurement) -> None:
    numbers = [getattr(found, f.name) for f in fields(found)]
    assert all(math.isfinite(n) for n in numbers if isinstance(n, float))


@pytest.mark.parametrize(("unit", "offset"), [(1e-9, 0.0), (1e-6, -1e6), (1e-3, 1.0), (1.0, -1e6), (1e3, 0.0)])
def test_size_and_offset_of_the_signals_do_not_matter(unit: float, offset: float) -> None:
    found = measure(ellipse(even(), unit=unit, offset=offset), SCENE)
    assert_ellipse(found, 1e-7)
    assert found.base_amplitude_m == pytest.approx(unit, rel=1e-7)
    doubt = f"base_amplitude_m: {unit:.3g} m: the unit looks wrong (--unit)"
    assert found.warnings == ((doubt,) if unit > 0.5 else ())


@pytest.mark.parametrize(("start", "within"), [(1.7e9, 1e-9), (1.7e12, 3e-8)])
def test_stamps_of_an_epoch_do_not_matter(start: float, within: float) -> None:
    """Seconds, or milliseconds taken for seconds: what is left are the stamps' own roundings, 0.2 us and 0.2 ms."""
    time = start + even()
    tau = 2 * math.pi * even()
    found = measure(Recording(time, 6e-4 * np.cos(tau - LAG), 1e-3 * np.cos(tau)), SCENE)
    assert found.drive_frequency_hz == pytest.approx(1.0, rel=within)
    assert found.energy_per_cycle == pytest.approx(ENERGY, rel=1e-6)
    assert 0.0 <= present(found.settled_s) <= 40.0


@pytest.mark.parametrize(("samples", "share"), [(2.2, 0.0), (3.0, 0.01), (4.0, 0.0), (5.5, 0.01)])
def test_too_few_samples_a_cycle_are_refused(samples: float, share: float) -> None:
    with pytest.raises(AnalysisError, match="expected at least 6 samples a cycle"):
        measure(noisy(ellipse(even(60.0, samples)), share), SCENE)


@pytest.mark.parametrize("samples", [7.0, 10.0, 20.0, 40.0])
def test_few_samples_a_cycle_are_measured_and_said(samples: float) -> None:
    """Cubic interpolation through samples h apart errs by 3/128 h^4 times the fourth derivative at most."""
    within = 3 / 128 * (2 * math.pi / samples) ** 4
    found = measure(ellipse(even(60.0, samples)), SCENE)
    assert_ellipse(found, within)
    assert found.base_amplitude_m == pytest.approx(1e-3, rel=within)
    assert any("samples a cycle" in w for w in found.warnings) == (samples < 40)


@pytest.mark.parametrize("periods", [0.9, 1.0, 1.005, 1.5])
def test_one_cycle_or_less_is_refused(periods: float) -> None:
    scene = SCENE.model_copy(update={"analysis": Analysis(transient_s=0.0)})
    with pytest.raises(AnalysisError, match="expected at least one full cycle of the drive"):
        measure(ellipse(even(periods)), scene)


@pytest.mark.parametrize("periods", [2.0, 2.4, 3.0, 4.1])
def test_the_shortest_records_that_are_measured_are_measured_right_and_said(periods: float) -> None:
    scene = SCENE.model_copy(update={"analysis": Analysis(transient_s=0.0)})
    found = measure(ellipse(even(periods)), scene)
    assert_ellipse(found, 1e-6)
    assert any(w.startswith("cycles: only") for w in found.warnings)
    assert (found.drive_frequency_hz_se is None) == (found.cycles < 3)


@pytest.mark.parametrize(
    ("share", "level", "both"), [(0.0, 0.95, True), (0.005, 0.95, False), (0.0, 0.8, False), (0.005, 0.5, True)]
)
def test_a_clipped_sensor_is_said_not_taken_for_stops(share: float, level: float, *, both: bool) -> None:
    whole = noisy(ellipse(even()), share)
    low = -level if both else -2.0
    mass = np.clip(whole.mass_displacement, low * SIZE * 1e-3, level * SIZE * 1e-3)
    found = measure(Recording(whole.time, mass, whole.base_displacement), SCENE)
    assert any(w.startswith("response_amplitude: ") and "the sensor clips" in w for w in found.warnings)
    base = np.clip(whole.base_displacement, low * 1e-3, level * 1e-3)
    found = measure(Recording(whole.time, whole.mass_displacement, base), SCENE)
    assert any(w.startswith("base_amplitude_m: ") and "the sensor clips" in w for w in found.warnings)


@pytest.mark.parametrize(("r", "beta", "mu"), [(0.5, 0.4, 1.0), (0.3, 0.6, 1.0), (0.8, 0.9, 1.0), (1.5, 0.8, 1.2)])
def test_a_true_stop_is_not_taken_for_clipping(r: float, beta: float, mu: float) -> None:
    orbit = present(steady_state(Problem(r, beta, mu=mu)).orbit)
    tau = 2 * math.pi * even()
    found = measure(noisy(Recording(even(), 1e-3 * orbit.at(tau)[0], 1e-3 * np.cos(tau)), 0.002), SCENE)
    assert found.stops_per_cycle == pytest.approx(2.0, abs=0.1)
    assert not any("clips" in w for w in found.warnings)


@pytest.mark.parametrize("step", [0.05, 0.1, 0.5, 1.0, 1.19])
def test_stops_of_a_coarse_sensor_are_said_to_be_the_sensors(step: float) -> None:
    """The step is a share of Y: from a twelfth of the amplitude to a motion of one step."""
    whole = ellipse(even())
    mass = np.round(whole.mass_displacement / (step * 1e-3)) * step * 1e-3
    found = measure(Recording(whole.time, mass, whole.base_displacement), SCENE)
    (said,) = [w for w in found.warnings if w.startswith("stops_per_cycle: the sensor's step")]
    assert ("too coarse to say whether it moves" in said) == (step >= 0.5)
    assert_finite(found)


@pytest.mark.parametrize(("place", "share"), [(0.0, 0.0), (0.01, 0.001), (-1e3, 0.001)])
def test_a_mass_channel_that_stands_still_is_a_stuck_mass(place: float, share: float) -> None:
    whole = ellipse(even())
    still = Recording(whole.time, np.full(len(whole.time), place), whole.base_displacement)
    found = measure(noisy(still, share), SCENE)
    assert (found.regime, found.stuck_fraction, found.stops_per_cycle) == ("stuck", 1.0, 0.0)
    assert (found.irregularity_index, found.irregularity_floor, found.asymmetry) == (None, None, None)
    assert found.energy_per_cycle == pytest.approx(0.0, abs=1e-9 + share)
    assert_finite(found)


@pytest.mark.parametrize(("jitter", "within"), [(0.01, 1e-5), (0.5, 1e-4), (0.9, 3e-4)])
def test_uneven_stamps_are_put_on_an_even_clock(jitter: float, within: float) -> None:
    """Stamps that stray by a share of the step at random; the signal is what it was at each stamp."""
    shift = jitter / 200.0 * np.random.default_rng(3).uniform(-0.5, 0.5, 8000)
    found = measure(ellipse(even() + shift), SCENE)
    assert found.drive_frequency_hz == pytest.approx(1.0, rel=1e-7)
    assert found.energy_per_cycle == pytest.approx(ENERGY, rel=within)
    assert any(w.startswith("time: stamps stray") for w in found.warnings) == (jitter > 0.02)


def test_stamps_that_are_random_or_change_their_rate_are_measured_and_said() -> None:
    steps = np.where(np.arange(7999) < 4000, 1 / 200, 1 / 100)
    slowing = np.cumsum(np.concatenate([[0.0], np.linspace(0.8, 1.2, 7999) / 200]))
    for time in (np.sort(np.random.default_rng(3).uniform(0, 40, 8000)), np.cumsum(np.append(0.0, steps)), slowing):
        found = measure(ellipse(time), SCENE)
        assert found.energy_per_cycle == pytest.approx(ENERGY, rel=5e-4)
        assert found.response_amplitude == pytest.approx(SIZE, rel=1e-3)
        assert any("stamps stray" in w for w in found.warnings)


def test_half_an_hour_at_a_kilohertz() -> None:
    """1.8 million samples: the phase is kept to the end, and the error falls with the number of cycles."""
    found = measure(noisy(ellipse(even(1800.0, 1000.0), drive=0.94), 0.01), SCENE)
    assert found.cycles in (math.floor(1795 * 0.94), math.floor(1795 * 0.94) - 1)
    assert abs(found.drive_frequency_hz - 0.94) < 4 * present(found.drive_frequency_hz_se) < 2e-7
    assert abs(found.energy_per_cycle - ENERGY) < 4 * found.energy_per_cycle_se < 2e-3 * ENERGY
