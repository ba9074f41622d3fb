import math
import re
import tracemalloc

import numpy as np
import pytest

from frictionlab.analysis.measurement import measure
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError
from frictionlab.recording import Quality, Recording
from frictionlab.scene import Analysis, Model, Rig, Scene
from tests.analysis.seen import BASE_M, NATURAL_HZ, NOISE_M, PHASE_S, STEP_M, motion, scene, seen, steady
from tests.desk import present

# (r, beta) from multi-stop to far above resonance; every stop lasts at least 2 % of a cycle
POINTS = [
    (0.1, 0.2), (0.1, 0.75), (0.13, 0.6), (0.3, 0.6), (0.42, 0.4), (0.5, 0.2), (0.7, 0.4), (1.2, 0.3), (1.4, 0.75),
    (2.5, 0.3),
]  # fmt: skip


@pytest.mark.parametrize(("r", "beta"), POINTS)
def test_truth_is_found_through_the_laser(r: float, beta: float) -> None:
    state, _, energy, amplitude = steady(r, beta)
    m = measure(seen(motion(r, beta), seed=17), scene())
    assert m.frequency_ratio == pytest.approx(r, abs=1e-6)  # ten times better than asked for
    assert m.energy_per_cycle == pytest.approx(energy, rel=1e-3)
    assert m.response_amplitude == pytest.approx(amplitude, rel=3e-3)
    assert m.stops_per_cycle == pytest.approx(state.stops_per_cycle, abs=0.05)
    assert m.regime == state.regime
    assert m.stuck_fraction == pytest.approx(state.stuck_fraction, abs=0.05)
    assert abs(m.energy_per_cycle - energy) < 4 * m.energy_per_cycle_se
    assert m.warnings == ()


def test_stated_errors_cover_the_truth() -> None:
    """A smaller version of tests/benchmarks/recording_coverage.py: 150 realisations of a short test."""
    of, what = motion(0.5, 0.4), scene("all", 0.0)
    inside = np.zeros((150, 2))
    for j in range(150):
        m = measure(seen(of, seed=j, seconds=20.0, rate=250.0, phase=0.0), what)
        inside[j, 0] = abs(m.drive_frequency_hz - of.hz) / (m.drive_frequency_hz_se or math.nan)
        inside[j, 1] = abs(m.energy_per_cycle - of.energy) / m.energy_per_cycle_se
    # binomial scatter of 150 draws is 3.8 points at 68 % and 1.8 at 95 %: three of them either way
    assert np.abs((inside < 1).mean(axis=0) - 0.6827).max() < 0.115
    assert np.abs((inside < 1.96).mean(axis=0) - 0.95).max() < 0.055


def test_no_cycle_crosses_a_gap() -> None:
    whole = seen(motion(0.5, 0.4), seed=4)
    keep = (whole.time < 41.3) | (whole.time > 43.9)
    quality = np.zeros(keep.sum(), np.uint8)
    quality[np.argmax(whole.time[keep] > 43.0)] = Quality.NOT_BRIDGED
    holed = Recording(whole.time[keep], whole.mass_displacement[keep], whole.base_displacement[keep], quality)
    m = measure(holed, scene())
    assert m.energy_per_cycle == pytest.approx(measure(whole, scene()).energy_per_cycle, rel=1e-3)
    starts = m.series.time
    assert not np.any((starts > 41.3 - 1 / m.drive_frequency_hz) & (starts < 43.9))
    assert any("gap: no samples from 41.3 s to 43.9 s" in warning for warning in m.warnings)


def test_a_drive_that_drifts_is_followed_and_said() -> None:
    of = motion(0.3, 0.6)

    def faster(t: FloatArray, *_: FloatArray) -> tuple[FloatArray, FloatArray]:
        later = t + 2e-4 * (t - 100.0) ** 2 / (2 * math.pi * of.hz)  # the motor speeds up by 1.4 %
        return BASE_M * of.mass(later), BASE_M * of.base(later)

    m = measure(seen(of, seed=5, seconds=200.0, rate=250.0, sensors=faster), scene())
    assert m.energy_per_cycle == pytest.approx(of.energy, rel=1e-3)
    assert any(warning.startswith("drive_frequency_hz: the drive is not even") for warning in m.warnings)


def test_harmonics_of_the_base() -> None:
    t = np.arange(0.0, 60.0, 1 / 500)
    tau = 2 * math.pi * 1.03 * t + 0.4
    base = 1e-3 * (np.cos(tau) + 0.06 * np.cos(2 * tau + 1.0) - 0.02 * np.sin(5 * tau))
    m = measure(Recording(t, 1e-3 * np.sin(tau), base), scene())
    assert m.base_amplitude_m == pytest.approx(1e-3, rel=1e-5)
    assert m.base_distortion == pytest.approx(math.hypot(0.06, 0.02), rel=1e-3)
    assert m.cycle.base_cosine[:2] == pytest.approx([1.0, 0.06 * math.cos(1.0)], abs=1e-5)
    assert m.cycle.base_sine[1:5] == pytest.approx([-0.06 * math.sin(1.0), 0, 0, -0.02], abs=1e-5)
    rebuilt = sum(
        c * np.cos(k * m.cycle.tau) + s * np.sin(k * m.cycle.tau)
        for k, (c, s) in enumerate(zip(m.cycle.base_cosine, m.cycle.base_sine, strict=True), 1)
    )
    np.testing.assert_allclose(m.cycle.base, rebuilt, atol=1e-5)
    assert any(re.match("base_distortion: .* the prediction of a recording takes them in", said) for said in m.warnings)


def test_a_transient_cut_too_short_is_said() -> None:
    t = np.arange(0.0, 90.0, 1 / 250)
    tau = 2 * math.pi * t
    mass = 1e-3 * (np.sin(tau) + 2 * np.exp(-t / 8) * np.cos(3.1 * t))
    m = measure(Recording(t, mass, 1e-3 * np.cos(tau)), scene(transient=5.0))
    assert present(m.settled_s) > 15
    assert any(warning.startswith("transient_s: the motion settled only") for warning in m.warnings)
    assert not any(
        "transient_s" in w for w in measure(Recording(t, mass, 1e-3 * np.cos(tau)), scene(transient=60.0)).warnings
    )


def test_what_has_no_measurement_is_refused() -> None:
    t = np.arange(0.0, 30.0, 0.01)
    noise = np.random.default_rng(7).standard_normal(len(t))
    with pytest.raises(AnalysisError, match=r"shorter than its transient: expected more than 40 s; got 29\.99 s"):
        measure(Recording(t, np.sin(t), np.cos(6 * t)), scene(transient=40.0))
    with pytest.raises(AnalysisError, match="no drive: the base stands still"):
        measure(Recording(t, np.sin(t), np.ones(len(t))), scene(transient=5.0))
    with pytest.raises(AnalysisError, match="the base stands still but for the sensor's noise of"):
        measure(Recording(t, np.sin(t), noise), scene(transient=5.0))
    with pytest.raises(AnalysisError, match=r"in 1\.5 s; expected two cycles .*: shorten transient_s.*--fit whole"):
        measure(Recording(t, np.sin(t), np.cos(1.2 * t)), scene(transient=28.5))


def test_what_is_not_known_is_none_and_says_what_to_do() -> None:
    recording, bare = seen(motion(0.5, 0.4), seed=8, seconds=20.0), Scene(analysis=Analysis(transient_s=2.0))
    m = measure(recording, bare)
    assert (m.natural_frequency_hz, m.frequency_ratio, m.energy_per_cycle_j) == (None, None, None)
    assert any("--natural-frequency" in warning for warning in m.warnings)
    rig = Rig(natural_frequency_hz=NATURAL_HZ, stiffness_n_per_m=1191.0, stiffness_n_per_m_u=59.55)  # 5 %
    joules = measure(recording, bare.model_copy(update={"rig": rig}))
    assert joules.energy_per_cycle_j == pytest.approx(joules.energy_per_cycle * 1191.0 * BASE_M**2, rel=1e-3)
    share = math.hypot(present(joules.energy_per_cycle_u) / joules.energy_per_cycle, 0.05)
    assert joules.energy_per_cycle_j_u == pytest.approx(share * present(joules.energy_per_cycle_j), rel=1e-3)


def test_noise_and_its_floor_are_measured() -> None:
    m = measure(seen(motion(0.5, 0.4), seed=9), scene())
    assert m.mass_noise_m == pytest.approx(math.hypot(NOISE_M, STEP_M / math.sqrt(12)), rel=0.03)
    assert m.irregularity_index == pytest.approx(present(m.irregularity_floor), rel=0.03)


def test_index_known_by_construction_through_the_whole_chain() -> None:
    """Cycles of sizes s_j, each a sine from one rise of the base to the next: mean |s_j+1 - s_j| / s_j."""
    t = np.arange(0.0, 60.0, 1 / 500)
    turns = 0.7 * t + 0.4  # the first whole cycle is number 1
    sizes = 1e-3 * (1.0 + 0.2 * np.random.default_rng(10).uniform(-1, 1, 60))
    mass = sizes[turns.astype(int)] * np.sin(2 * math.pi * turns)
    m = measure(Recording(t, mass, 1e-3 * np.sin(2 * math.pi * turns)), scene(transient=0.0))
    whole = sizes[1 : m.cycles + 1]
    assert m.irregularity_index == pytest.approx(np.mean(np.abs(np.diff(whole)) / whole[:-1]), rel=2e-3)
    assert m.base_irregularity_index == pytest.approx(0.0, abs=1e-4)


def test_the_trend_of_a_long_test_is_the_frictions_and_not_the_sensors() -> None:
    """A motion that passes slowly from one orbit to another takes its loop's area along: eq. (2.18) is linear in x."""
    first, second = motion(0.5, 0.4), motion(0.5, 0.42)
    change = second.energy - first.energy
    for drift in (0.0, 1e-7):

        def passing(t: FloatArray, x: FloatArray, y: FloatArray, drift: float = drift) -> tuple[FloatArray, FloatArray]:
            share = t / 1200.0
            mass = (1 - share) * x + share * BASE_M * second.mass(t + PHASE_S)
            return mass + 4 * drift * t, y - 3 * drift * t

        m = measure(seen(first, seed=11, seconds=1200.0, rate=100.0, sensors=passing), scene("last"))
        trend = present(m.trend)
        assert len(trend.time) == pytest.approx(118, abs=1)  # one cycle every ten seconds
        assert m.energy_trend_per_hour == pytest.approx(change * 3, rel=0.03)
        assert trend.low < change / 1200.0 < trend.high


def test_stops_are_relative_to_a_wall_that_moves() -> None:
    of, what = motion(0.7, 0.44, wall="base"), scene().model_copy(update={"model": Model(wall="base")})
    m = measure(seen(of, seed=12, seconds=60.0), what)
    assert m.stops_per_cycle == of.stops == 2.0
    assert m.stuck_fraction == pytest.approx(of.stuck, abs=0.05)
    assert m.energy_per_cycle == pytest.approx(of.energy, rel=1e-3)


def test_a_long_recording_is_measured_in_five_more_columns_of_it() -> None:
    """With hum to be taken out: 15 and more, so that a log of 2 GB took 9 to 17 GB."""
    of, n, turn = motion(0.5, 0.4), 1_500_000, 2554
    place = np.arange(n) % turn
    time = np.arange(n) / (turn * of.hz)
    cycle = np.arange(turn) / (turn * of.hz)
    mass = BASE_M * (of.mass(cycle)[place] + 0.01 * np.sin(2 * np.pi * 50.03 * time))
    recording = Recording(time, mass, BASE_M * of.base(cycle)[place])
    tracemalloc.start()
    m = measure(recording, scene())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert any("mains hum" in said for said in m.warnings)
    assert m.response_amplitude == pytest.approx(of.amplitude, rel=1e-4)
    assert peak < 8 * 8 * n


@pytest.mark.parametrize(("r", "beta"), [(1.2, 0.5), (0.5, 0.4)])
@pytest.mark.parametrize("samples", [11, 20])
def test_few_samples_of_a_cycle_take_nothing_from_its_harmonics(r: float, beta: float, samples: int) -> None:
    """A cubic between 11 samples takes a third of the third harmonic."""
    rate = 1.003 * samples * r * NATURAL_HZ
    m = measure(seen(motion(r, beta), seconds=60.0, rate=rate), scene())
    _, orbit, energy, amplitude = steady(r, beta)
    assert m.energy_per_cycle == pytest.approx(energy, rel=1e-3)
    assert abs(m.response_amplitude - amplitude) < 1.5 * (m.response_amplitude_u or 0.0)
    tau = 2 * math.pi * np.arange(512) / 512
    truth = np.fft.rfft(orbit.at(tau)[0])[3] / 256
    third = np.fft.rfft(m.cycle.mass)[3] / (len(m.cycle.mass) / 2)
    assert abs(third - truth) < 0.02 * abs(truth) + 3e-4
