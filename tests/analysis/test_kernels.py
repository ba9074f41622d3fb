"""The kernels of one cycle against slow versions: cutting, energy, spectrum, stops."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.analysis import cycles, response, signals, stops
from frictionlab.analysis.cycles import smoothed, smoother
from frictionlab.analysis.measurement import measure, used_cycles
from frictionlab.analysis.response import half_range
from frictionlab.analysis.spectrum import amplitude_spectrum, strongest_tone
from frictionlab.errors import AnalysisError, UsageError
from tests.analysis.seen import motion, scene, seen, steady

TAU = 2 * math.pi * np.arange(64) / 64


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 4), min_size=1, max_size=4))
def test_area_of_fourier_series_in_closed_form(harmonics: list[tuple[float, float, float, float]]) -> None:
    """The loop integral of y dx is pi sum k (a_k d_k - b_k c_k)."""
    x, y, expected = np.zeros(256), np.zeros(256), 0.0
    tau = 2 * math.pi * np.arange(256) / 256
    for k, (a, b, c, d) in enumerate(harmonics, 1):
        y += a * np.cos(k * tau) + b * np.sin(k * tau)
        x += c * np.cos(k * tau) + d * np.sin(k * tau)
        expected += math.pi * k * (a * d - b * c)
    assert response.loop_area(x[None], y[None])[0] == pytest.approx(expected, abs=1e-4)


def test_noise_of_a_loop_is_as_stated() -> None:
    generator = np.random.default_rng(2)
    x, y, sx, sy = 0.5 * np.sin(TAU), np.cos(TAU), 0.02, 0.01
    areas = response.loop_area(
        x + sx * generator.standard_normal((4000, 64)), y + sy * generator.standard_normal((4000, 64))
    )
    assert areas.std() == pytest.approx(response.loop_area_noise(x, y, sx, sy, 64.0), rel=0.05)


def test_rules_choose_their_cycles() -> None:
    edges = np.arange(0.0, 11.0) * 2.0  # ten cycles of 2 s
    assert used_cycles(edges, "last") == slice(9, 10)
    assert used_cycles(edges, "all") == slice(0, 10)
    assert used_cycles(edges, "window:5") == slice(8, 10)
    assert used_cycles(edges, "window:6") == slice(7, 10)
    assert used_cycles(edges, "window:600") == slice(0, 10)
    with pytest.raises(UsageError, match=r"cycles: expected 'last', 'all' or 'window:SECONDS' .*; got 'first'"):
        used_cycles(edges, "first")
    with pytest.raises(AnalysisError, match="window of 1 s is shorter than one cycle"):
        used_cycles(edges, "window:1")


N, FREQUENCY = 20_000, 0.00734567


def base_of(turns: np.ndarray) -> np.ndarray:
    """A base with offset and harmonics whose fundamental has its tops at whole turns."""
    angle = 2 * math.pi * turns
    return 0.4 + np.cos(angle) + 0.05 * np.cos(2 * angle + 1) + 0.02 * np.sin(3 * angle)


def test_cycles_start_where_the_fundamental_rises_through_zero() -> None:
    cut = cycles.cut(base_of(FREQUENCY * np.arange(N) + 0.3), FREQUENCY * (1 + 2e-5), noise=1e-6)
    turns = FREQUENCY * cut.start + 0.3
    np.testing.assert_allclose(turns + 0.25, np.rint(turns + 0.25), atol=1e-6)
    np.testing.assert_allclose(cut.end - cut.start, 1 / FREQUENCY, rtol=1e-6)
    np.testing.assert_array_equal(cut.start[1:], cut.end[:-1])
    assert cut.frequency == pytest.approx(FREQUENCY, rel=1e-7)
    assert not cut.drifts


def test_the_cut_follows_a_drive_that_drifts() -> None:
    i = np.arange(N)
    turns = FREQUENCY * i + 1.5e-9 * (i - N / 2) ** 2  # 0.8 % change of speed over the test
    cut = cycles.cut(base_of(turns), FREQUENCY, noise=1e-6)
    at = np.interp(cut.start, i, turns)
    assert cut.drifts
    np.testing.assert_allclose(at + 0.25, np.rint(at + 0.25), atol=2e-4)
    constant = cycles.cut(base_of(FREQUENCY * i), FREQUENCY, noise=1e-6)
    assert cut.frequency_se > 100 * constant.frequency_se


def test_stamps_written_coarsely_are_even() -> None:
    even, stray = signals.evenly(np.round(np.arange(500) / 300.0, 3), 1 / 300.0, {"mass": np.ones(500)})
    assert (stray, len(even["mass"])) == (0.0, 500)


def line(
    frequency: float, amplitude: float = 1.0, phase: float = 0.3, n: int = 4000, step: float = 0.004
) -> np.ndarray:
    return np.asarray(amplitude * np.cos(2 * math.pi * frequency * step * np.arange(n) + phase))


def test_spectrum_against_the_sum_itself() -> None:
    signal = line(3.3, n=300) + 0.2 * line(7.1, n=300)
    spectrum = amplitude_spectrum(signal, 0.004, padding=3)
    window = 0.5 - 0.5 * np.cos(2 * np.pi * (np.arange(300) + 0.5) / 300)
    for k in (5, 12, 30):
        turns = np.exp(-2j * np.pi * spectrum.frequency[k] * 0.004 * np.arange(300))
        expected = 2 * abs(np.sum(window * (signal - signal.mean()) * turns)) / window.sum()
        assert spectrum.amplitude[k] == pytest.approx(expected, rel=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.floats(1.0, 100.0), st.floats(0.0, 6.28), st.floats(1e-6, 1e3))
def test_a_clean_line_is_found_wherever_it_lies(frequency: float, phase: float, amplitude: float) -> None:
    tone = strongest_tone(amplitude_spectrum(line(frequency, amplitude, phase), 0.004))
    assert tone.frequency == pytest.approx(frequency, abs=0.003 / 16)  # 3 thousandths of a bin
    assert tone.amplitude == pytest.approx(amplitude, rel=2e-3)


def test_error_at_default_padding_is_within_twice_the_cramer_rao_bound() -> None:
    generator = np.random.default_rng(11)
    n, step, frequency, noise = 70_000 // 10, 0.01, 0.94321, 0.01
    bound = math.sqrt(6 / (n * (n**2 - 1))) * noise / (math.pi * step)  # [Rife and Boorstyn 1974]
    found = [
        strongest_tone(
            amplitude_spectrum(line(frequency, phase=p, n=n, step=step) + noise * generator.standard_normal(n), step)
        )
        for p in generator.uniform(0, 6.28, 200)
    ]
    errors = np.array([tone.frequency - frequency for tone in found])
    assert math.sqrt(np.mean(errors**2)) < 2 * bound


def test_what_holds_no_line_is_refused() -> None:
    with pytest.raises(AnalysisError, match="stands still"):
        strongest_tone(amplitude_spectrum(np.ones(100), 0.01))
    with pytest.raises(AnalysisError, match="at least 8 samples; got 5"):
        amplitude_spectrum(np.arange(5.0), 0.01)
    turn = 0.8 * np.pi * np.arange(100) / 100 + 1.0  # less than a cycle: a frequency below 0 was found
    assert strongest_tone(amplitude_spectrum(np.cos(turn) + 0.3 * np.cos(2 * turn), 1.0)).frequency > 0.0


def test_a_long_record_is_padded_less(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frictionlab.analysis.spectrum.LONGEST", 9000)
    assert len(amplitude_spectrum(line(10.0), 0.004).amplitude) == 4001
    monkeypatch.setattr("frictionlab.analysis.spectrum.LONGEST", 1000)
    assert len(amplitude_spectrum(line(10.0), 0.004).amplitude) == 2001


POINTS = 512
HOW = stops.Thresholds(still=0.003, dwell=0.0075 * stops.TURN)


def found(v: np.ndarray) -> np.ndarray:
    return stops.stops_of(stops.pauses(v, HOW.still), HOW, v.shape[1])[0]


@pytest.mark.parametrize(
    ("r", "beta"),
    [
        *((0.1, 0.2), (0.13, 0.6), (0.3, 0.6), (0.5, 0.4), (0.58, 0.55), (2.5, 0.75)),
        *((0.5, 0.3), (0.75, 0.78), (1.2, 0.6)),  # turning points and slow passages are none
    ],
)
def test_stops_of_exact_orbits_are_found_with_their_lengths(r: float, beta: float) -> None:
    state, orbit, _, _ = steady(r, beta)
    tau = stops.TURN * np.arange(3 * POINTS) / POINTS + 1.0
    v = orbit.at(np.mod(tau, stops.TURN))[1].reshape(3, POINTS)
    count, stuck = stops.per_cycle(found(v), 3)
    np.testing.assert_array_equal(count, [state.stops_per_cycle] * 3)
    np.testing.assert_allclose(stuck, state.stuck_fraction or 0.0, atol=0.006 * max(2, state.stops_per_cycle or 0))


def test_a_stop_across_the_ends_is_one_stop() -> None:
    tau = stops.TURN * (np.arange(4 * POINTS) + 0.5) / POINTS
    v = np.where(np.cos(tau) > 0.9, 0.0, np.sin(tau)).reshape(4, POINTS)
    count, stuck = stops.per_cycle(found(v), 4)
    np.testing.assert_array_equal(count, 1)
    np.testing.assert_allclose(stuck, math.acos(0.9) / math.pi, atol=0.01)


def test_smoothing_takes_the_noise_and_leaves_the_motion() -> None:
    generator = np.random.default_rng(7)
    _, orbit, _, amplitude = steady(0.5, 0.5)
    clean = orbit.at(stops.TURN * np.arange(320) / 320)[0]
    rows = clean + 4.6e-4 * generator.standard_normal((100, 320))
    how = smoother(rows, signals.Sensor(4.6e-4, 0.0), 320.0)
    x, v = smoothed(rows, how, POINTS)
    exact, velocity = orbit.at(stops.TURN * np.arange(POINTS) / POINTS)
    assert np.abs(x - exact).max() < 4.6e-4
    assert np.sqrt(np.mean((v - velocity) ** 2)) < 0.02
    assert half_range(x)[0] == pytest.approx(amplitude, rel=3e-4)


def test_smoothing_keeps_what_each_cycle_has_of_its_own() -> None:
    generator = np.random.default_rng(9)
    turns = np.arange(60 * 256) / 256
    clean = ((1.0 + 0.1 * np.sin(stops.TURN * turns / 7.3)) * np.sin(stops.TURN * turns)).reshape(60, 256)
    rows = clean + 1e-3 * generator.standard_normal((60, 256))
    x, _ = smoothed(rows, smoother(rows, signals.Sensor(1e-3, 0.0), 256.0), POINTS)
    np.testing.assert_allclose(half_range(x), 0.5 * np.ptp(clean, axis=1), atol=1e-3)


@pytest.mark.parametrize(("r", "beta"), [(0.3, 0.3), (0.5, 0.4), (1.5, 0.4)])
def test_the_amplitude_has_no_bias_beyond_its_error(r: float, beta: float) -> None:
    """The mean of 40 tests of 20 s at 250 Hz; with the steep edges of stops taken for peaks it was 6e-4 too large."""
    of = motion(r, beta)
    found = [
        measure(seen(of, seed=j, seconds=20.0, rate=250.0, phase=-0.25 / of.hz), scene("all", 0.0)) for j in range(40)
    ]
    errors = np.array([m.response_amplitude - of.amplitude for m in found])
    assert abs(float(errors.mean())) < 1e-4
    assert float(np.sqrt(np.mean(errors**2))) < float(np.median([m.response_amplitude_se for m in found]))


def test_a_pause_shorter_than_a_stop_and_longer_than_none_is_doubtful() -> None:
    """Braked at a slope, standing, leaving with the square of time: stops of 0.2, 0.6 and 2 times the shortest."""
    how, points = stops.Thresholds(1e-3, dwell=0.05), 1 << 16
    tau = stops.TURN * np.arange(points) / points
    for share, counted, doubted in ((0.2, 0, 0), (0.6, 0, 1), (2.0, 1, 0)):
        left = 3.0 + share * how.dwell
        speed = np.where(tau < 3.0, 3.0 - tau, np.where(tau > left, 0.5 * (tau - left) ** 2, 0.0))
        found, lengths = stops.stops_of(stops.pauses(speed[None], how.still), how, points)
        assert (found.shape[1], len(lengths)) == (counted, doubted)
        assert lengths == pytest.approx([share * how.dwell] * doubted, rel=0.02)
