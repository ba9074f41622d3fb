"""Means of correlated cycles, noise and step of a sensor, filters; whether a motion is steady, or drifts."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import toeplitz
from scipy.stats import multivariate_normal

from frictionlab import compare
from frictionlab.analysis import steadiness
from frictionlab.analysis.channels import SensorChannel, cut_away, displacement
from frictionlab.analysis.measurement import measure
from frictionlab.analysis.signals import (
    SHARES,
    WANDERS,
    Stretch,
    evenly,
    pair_squares,
    pair_variances,
    sensor_step,
    student,
    variance_inflation,
    white_noise,
)
from frictionlab.analysis.spectrum import DriveLine, amplitude_spectrum, foreign_lines
from frictionlab.analysis.steadiness import irregularity_floor, irregularity_index
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem, steady_state
from tests.benchmarks.recording_coverage import Sensors
from tests.desk import present
from tests.inference.contacts import recorded, scene


def autocorrelation(share: float, wander: float, n: int) -> FloatArray:
    """Of ``(1 - share) f[k] + share f[k+1]``, written out."""
    lag = np.arange(n)

    def of_friction(k: NDArray[np.int64]) -> FloatArray:
        return np.where(k == 0, 1.0, float(wander) ** np.abs(k))

    found = (share**2 + (1 - share) ** 2) * of_friction(lag)
    found = found + share * (1 - share) * (of_friction(lag + 1) + of_friction(lag - 1))
    return np.asarray(found / found[0])


def test_likelihood_and_mean_are_those_of_the_covariance_written_out() -> None:
    """Ratios of the likelihood of a series, its mean free (Gauss), against scipy's of all differences of neighbours."""
    n, series = 9, np.random.default_rng(3).standard_normal(9)
    differences = np.eye(n)[1:] - np.eye(n)[:-1]
    square, size = pair_squares(series[:, None])
    ours, wanted, spread = size[:, 0] - 0.5 * square[:, 0], [], []
    for share, wander in [(s, w) for w in WANDERS for s in SHARES]:
        covariance = toeplitz(autocorrelation(share, wander, n))
        wanted.append(multivariate_normal.logpdf(differences @ series, cov=differences @ covariance @ differences.T))
        spread.append(covariance.sum() / n**2)
    assert np.diff(ours) == pytest.approx(np.diff(wanted), abs=1e-8)
    assert pair_variances(n)[:, 0] == pytest.approx(spread, rel=1e-12)


@pytest.mark.parametrize(
    ("share", "wander", "n", "most"),
    [
        *((share, 0.0, 63, 1.1) for share in (0.0, 0.25, 0.5, -0.6)),
        (0.5, 0.6, 63, 1.1),
        (0.0, 0.97, 400, 1.35),  # 1.7 where no wander over more than 20 cycles was thought of
    ],
)
def test_the_error_of_a_mean_covers_wherever_friction_changes_in_a_cycle(
    share: float, wander: float, n: int, most: float
) -> None:
    """Rms of error over stated error of 600 means of n cycles; friction that changes in mid-cycle had 0.8."""
    root = np.linalg.cholesky(toeplitz(autocorrelation(share, wander, n)))
    series: FloatArray = np.asarray(root @ np.random.default_rng(7).standard_normal((n, 600)))
    score = series.mean(axis=0) / np.sqrt(
        series.var(axis=0, ddof=1) / n * variance_inflation(series) * student(n - 1.0)
    )
    assert 0.9 < math.sqrt(float(np.mean(score**2))) < most


def test_a_series_that_does_not_vary_is_not_inflated() -> None:
    assert variance_inflation(np.ones((6, 2))).tolist() == [1.0, 1.0]
    rounded: FloatArray = 0.7 + 1e-16 * np.arange(6.0)[:, None]
    assert variance_inflation(rounded).tolist() == [1.0]


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-7, 1.0), st.integers(0, 1000))
def test_noise_is_found_under_a_motion(noise: float, seed: int) -> None:
    t = np.arange(30_000) / 500
    signal = np.cos(2 * math.pi * 2 * t) + noise * np.random.default_rng(seed).standard_normal(len(t))
    assert white_noise(signal) == pytest.approx(math.hypot(noise, 1e-9), rel=0.03)


@pytest.mark.parametrize("seed", range(6))
def test_integrated_noise_is_no_second_motion(seed: int) -> None:
    """It falls with the square of the frequency: 12 of 60 such records were said to beat."""
    g, t = np.random.default_rng(seed), np.arange(0.0, 60.0, 0.004)
    drive = float(g.uniform(0.8, 4.0))
    omega = 2.0 * math.pi * drive
    seen = 1e-3 * omega**2 * (np.cos(omega * t) + 0.03 * g.standard_normal(len(t)))
    base, _, edge, _ = displacement({"base_acceleration": seen}, "base", 0.004)
    lines = foreign_lines(amplitude_spectrum(base[edge:-edge], 0.004), DriveLine(drive, 1e-3, 0.0))
    assert all(line.removed for line in lines)


def test_shocks_and_kinks_stay_out() -> None:
    generator = np.random.default_rng(2)
    signal = np.abs(np.sin(np.arange(20_000) / 100)) + 1e-4 * generator.standard_normal(20_000)
    signal[::2000] += 1.0
    assert white_noise(signal) == pytest.approx(1e-4, rel=0.15)


def test_the_sensors_step_is_read_off_its_levels() -> None:
    signal = np.cumsum(np.random.default_rng(3).normal(0, 1, 5000))
    assert sensor_step(np.round(signal / 0.778) * 0.778) == pytest.approx(0.778)
    assert sensor_step(signal) == 0.0
    # at rest for long: only the first 20,000 samples were looked at
    assert sensor_step(np.append(np.zeros(20_000), np.round(1e3 * np.sin(np.arange(20_000) * 0.01)))) == 1.0


def test_unflagged_jumps_are_refused_by_size() -> None:
    t = np.arange(2000) / 250
    t[1000:] += 1.7e9
    with pytest.raises(AnalysisError, match=r"jump from 3.996 to 1.7e\+09 s: 2000 samples would become"):
        evenly(t, 0.004, {"mass": t})


SHARE = "filter of the mass sensor"


def through(r: float, mass: tuple[float, int], base: tuple[float, int]) -> tuple[Recording, Scene]:
    """A contact of friction ratio 0.4 through exact sensors with filters (cut-off, order), and its scene."""
    keys = ("mass_filter_hz", "mass_filter_order", "base_filter_hz", "base_filter_order")
    filters = dict(zip(keys, (*mass, *base), strict=True))
    sensors = Sensors(np.zeros(7), filters)
    recording = recorded(Problem(r, 0.4), np.random.default_rng(3), seconds=30.0, sensors=sensors)
    return recording, scene(sensors={"lag_s_u": 1e-4, **filters})


def test_the_third_harmonic_of_a_mass_that_slides_is_what_its_friction_makes() -> None:
    """Far above resonance little friction hardly bends the cycle: its third harmonic is that of the force's."""
    state = steady_state(Problem(1.6, 0.05))
    x = present(state.orbit).at(2 * np.pi * np.arange(512) / 512)[0]
    found = abs(np.fft.rfft(x)[3]) * 2.0 / 512
    energy = present(state.energy_per_cycle)
    friction = energy / (4.0 * 0.5 * float(np.ptp(x)))
    channel, cosine = SensorChannel(cutoff=5.0, order=8), np.cos(2 * np.pi * np.arange(512) / 512)
    assert cut_away(cosine, 5.0, channel, friction=friction, r=1.6) == pytest.approx(found, rel=0.01)


@pytest.mark.parametrize(("r", "cutoff", "order"), [(0.15, 3.2, 4), (0.3, 3.6, 8), (0.5, 2.8, 8)])
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


@pytest.mark.parametrize(
    ("base", "where", "key"), [(1e4, "the mass's channel", "mass_filter_hz"), (12.0, "both channels", "filter_hz")]
)
def test_a_filter_that_nobody_declared_is_named_with_its_key(base: float, where: str, key: str) -> None:
    """Friction was 7 standard uncertainties off by the loop, and --law auto was advised, which found another law."""
    found = compare(through(0.5, (12.0, 1), (base, 1))[0], scene())
    named = [said for said in found.warnings if f"low-pass filter in {where}" in said]
    assert f"sensors.{key} = 12" in named[0]
    assert (found.verdict, any("--law auto" in said for said in found.warnings)) == ("strained", False)


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


@pytest.mark.parametrize(("decay", "low", "high"), [(0.3, 15.0, 30.0), (2.0, 2.0, 6.0), (None, 0.0, 0.0)])
def test_the_transient_ends_where_mass_and_base_repeat(decay: float | None, low: float, high: float) -> None:
    """A free vibration of the size of the motion has fallen to half a per cent after 5.3 / decay."""
    t = np.arange(0.0, 70.0, 0.004)
    rng = np.random.default_rng(1)
    base = 1e-3 * np.cos(2 * np.pi * t) + 1e-6 * rng.standard_normal(len(t))
    mass = 1e-3 * np.sin(2 * np.pi * t) + (0.0 if decay is None else 1e-3 * np.exp(-decay * t) * np.cos(19.7 * t))
    start, settled = steadiness.transient([Stretch(0.0, 0.004, {"mass": mass, "base": base})], 0.0)
    assert low <= start <= high
    assert settled == start


@pytest.mark.parametrize("per_hour", [-0.5, -0.05, 0.2, 0.5])
@pytest.mark.parametrize("seconds", [300.0, 900.0, 1800.0])
def test_a_drift_to_the_end_is_no_transient(seconds: float, per_hour: float) -> None:
    """Of 900 s half was cut, as not settled: friction that wears, its start-up over after 5.3 times 3 s."""
    t = np.arange(0.0, seconds, 0.01)
    wear, rng = per_hour * t / 3600.0, np.random.default_rng(7)
    mass = (1 - wear) * np.sin(2 * np.pi * t + wear * (1 - wear)) + np.exp(-t / 3.0) * np.cos(19.7 * t)
    mass, base = (1e-3 * x + 1e-6 * rng.standard_normal(len(t)) for x in (mass, np.cos(2 * np.pi * t)))
    start, settled = steadiness.transient([Stretch(0.0, 0.01, {"mass": mass, "base": base})], 0.0)
    assert 13.0 < start < 30.0
    assert settled == start


def test_a_free_vibration_that_repeats_with_the_drive_is_part_of_the_transient() -> None:
    """At r = 1/2 it looks alike in every cycle: from 13 s on it moved the mean cycle by 2.5 standard errors."""
    rng, size, time = np.random.default_rng(8), 0.013, 13.0
    for seconds in (40.0, 80.0):
        t = np.arange(0.0, seconds, 0.004)
        base, free = np.cos(3 * np.pi * t), size * np.exp(-t / time) * np.cos(6 * np.pi * t)
        mass, base = (1e-3 * x + 1e-6 * rng.standard_normal(len(t)) for x in (np.sin(3 * np.pi * t) + free, base))
        start, settled = steadiness.transient([Stretch(0.0, 0.004, {"mass": mass, "base": base})], 0.0)
        assert start == settled is not None  # also beyond the half of 40 s: 27 settled cycles are left
        assert 0.4e-3 < size * math.exp(-settled / time) < 2.5e-3


def test_of_a_motion_that_never_settles_half_is_left() -> None:
    t = np.arange(0.0, 40.0, 0.004)
    base = np.cos(2 * np.pi * t)
    length, settled = steadiness.transient([Stretch(0.0, 0.004, {"mass": base * (1 + 0.02 * t), "base": base})], 0.0)
    assert length == pytest.approx(20.0)
    assert settled is None
    slow = np.cos(2 * np.pi / 90.0 * np.arange(0.0, 900.0, 0.1))  # one that does, of cycles longer than a memory
    assert steadiness.transient([Stretch(0.0, 0.1, {"mass": slow, "base": slow})], 0.0) == (0.0, 0.0)


def test_a_trend_is_found_with_honest_confidence() -> None:
    generator, time = np.random.default_rng(3), np.arange(0.0, 1800.0, 10.0)
    hits, slope = 0, 1e-4
    for _ in range(400):
        trend = present(steadiness.linear_trend(time, 1 + slope * time + 0.05 * generator.standard_normal(len(time))))
        hits += trend.low < slope < trend.high
    assert 0.92 < hits / 400 < 0.98


def test_autocorrelated_residuals_widen_the_confidence() -> None:
    generator, time = np.random.default_rng(4), np.arange(0.0, 1800.0, 10.0)
    value = np.zeros(180)
    for j in range(1, 180):
        value[j] = 0.7 * value[j - 1] + generator.standard_normal()
    wide = present(steadiness.linear_trend(time, value))
    shuffled = present(steadiness.linear_trend(time, generator.permutation(value)))
    assert wide.slope_se > 1.7 * shuffled.slope_se
    assert steadiness.linear_trend(time[:5], value[:5]) is None
    wander = 1.0 + 1e-4 * time[:58] + 4e-3 * np.sin(time[:58] / 40.0) * np.exp(-(((time[:58] - 300.0) / 200.0) ** 2))
    slow = present(steadiness.linear_trend(time[:58], wander))
    assert 0.0 < slow.low < 1e-4 < slow.high, "one slow wander of a fifteenth of the drift"


WAVE = np.sin(2 * math.pi * np.arange(200) / 200)


def test_no_pair_is_made_across_a_gap_nor_of_nothing() -> None:
    rows = np.outer([1.0, 1.1, 5.0, 5.5], WAVE)
    assert irregularity_index(rows, (slice(0, 2), slice(2, 4))) == pytest.approx(0.1)
    assert irregularity_index(WAVE[None]) is None
    assert irregularity_index(np.zeros((4, 10))) is None
    assert irregularity_floor(np.zeros((4, 10)), 0.1) is None
