"""Records in parts, on stray stamps, with short windows: numbers and errors as of a whole even record."""

import math

import numpy as np
import pytest

from frictionlab.analysis import steadiness
from frictionlab.analysis.measurement import Measurement, measure
from frictionlab.analysis.signals import Stretch
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError
from frictionlab.recording import Channel, Quality, Recording
from frictionlab.scene import Scene, scene_from_tables

TURN, T = 2 * math.pi, np.arange(0.0, 60.0, 0.004)
X, Y = 1e-3 * np.sin(TURN * T), 2e-3 * np.cos(TURN * T)
NOISE = np.random.default_rng(1).standard_normal((2, len(T)))


def scene(transient: float | None = 0.0, **tables: object) -> Scene:
    analysis = {} if transient is None else {"transient_s": transient}
    return scene_from_tables({"rig": {"natural_frequency_hz": 4.0}, "analysis": analysis, **tables})


def seen(
    mass: FloatArray | None, base: FloatArray | None = Y, *, lost: tuple[float, ...] = (), **more: FloatArray
) -> Recording:
    """A recording without the samples between each two of the times ``lost``."""
    keep, quality = np.ones(len(T), dtype=bool), np.zeros(len(T), np.uint8)
    for a, b in zip(lost[::2], lost[1::2], strict=True):
        keep &= (a >= T) | (b - 1e-9 <= T)
        quality[np.argmax(b - 1e-9 <= T)] = Quality.NOT_BRIDGED | Quality.GAP_BEFORE
    x, y = (None if v is None else v[keep] for v in (mass, base))
    channels = tuple(Channel(name, values[keep]) for name, values in more.items())
    return Recording(T[keep], x, y, quality[keep], channels=channels)


@pytest.fixture(scope="module")
def starting() -> tuple[FloatArray, Measurement]:
    x = X * (1 + 3 * np.exp(-T / 6)) + 1e-6 * NOISE[0]
    return x, measure(seen(x), scene(None))


def test_the_transient_is_found_in_all_parts(starting: tuple[FloatArray, Measurement]) -> None:
    """By the three seconds before the gap alone nothing was cut: an energy of 2.0 +- 1.7 for 1.577."""
    x, whole = starting
    m = measure(seen(x, lost=(3.0, 3.5)), scene(None))
    assert (m.transient_s, m.settled_s) == pytest.approx((whole.transient_s, whole.settled_s), abs=0.01)
    assert m.energy_per_cycle == pytest.approx(whole.energy_per_cycle, abs=1e-3)
    assert 30.0 < m.transient_s == m.settled_s  # half was cut once, and the start of the motion measured with the rest
    assert not any(w.startswith("transient_s") for w in m.warnings)


def test_the_transient_counts_from_the_recordings_start() -> None:
    """It was counted from the part's: of the displacement by an acceleration from 10 s on."""
    decay = 3e-3 * np.exp(-T / 4)
    x, rate = X + decay * np.sin(TURN * T), -0.25
    a = -(TURN**2) * X + decay * ((rate**2 - TURN**2) * np.sin(TURN * T) + 2 * rate * TURN * np.cos(TURN * T))
    plain, integrated = (measure(r, scene(None)) for r in (seen(x), seen(None, mass_acceleration=a)))
    assert integrated.settled_s == pytest.approx(plain.settled_s, abs=1.0)
    late = X * (1 + 3 * np.exp(-np.maximum(T - 15.0, 0.0) / 6))
    quality = np.where(T < 15.0, Quality.NOT_BRIDGED | Quality.NO_VALUE, 0).astype(np.uint8)
    m = measure(Recording(T, np.where(T < 15.0, np.nan, late), Y, quality), scene(None))
    assert (m.transient_s, m.settled_s) == pytest.approx((37.5, None), abs=0.02)  # half of what is sound


@pytest.mark.parametrize(("samples", "stray"), [(10, 0.35), (16, 0.2)])
def test_stray_stamps_take_nothing_from_a_motion(samples: int, stray: float) -> None:
    """Straight lines between them took 0.9 % of Y and 1.8 % of the energy at 16 samples, 9 to 27 of the stated u."""
    t = (np.arange(60 * samples) + np.random.default_rng(2).uniform(-stray, stray, 60 * samples)) / samples
    m = measure(Recording(t, 1e-3 * np.sin(TURN * t), 2e-3 * np.cos(TURN * t)), scene())
    assert abs(m.base_amplitude_m - 2e-3) < (m.base_amplitude_m_u or 0.0) < 1e-5
    assert abs(m.energy_per_cycle - math.pi / 2) < m.energy_per_cycle_u  # type: ignore[operator]
    assert any("interpolated by a cubic" in w for w in m.warnings)


def sticking() -> tuple[FloatArray, FloatArray]:
    """Displacement and velocity of a mass that stands for 0.3 of each cycle, in two stops."""
    inside = (T % 1.0) % 0.5
    v = 5e-3 * np.where(inside < 0.15, 0.0, np.sin(np.pi * (inside - 0.15) / 0.35)) * np.where(T % 1.0 < 0.5, 1, -1)
    x = np.cumsum(v) * 0.004
    return x - x.mean() + 1e-7 * NOISE[0], v


def test_hum_of_a_velocity_hides_no_stop() -> None:
    """It was taken out of the displacements alone: no stop was counted, unwarned."""
    x, v = sticking()
    hummed = v + 1e-4 * np.sin(TURN * 50.03 * T) + 1e-6 * NOISE[1]
    m = measure(seen(x, 2e-3 * np.cos(TURN * (T - 0.3)), mass_velocity=hummed), scene())
    assert (m.stops_per_cycle, m.stuck_fraction) == pytest.approx((2.0, 0.29), abs=0.02)
    assert any("0.8 % of the base's speed, mains hum, is taken out" in w for w in m.warnings)


def test_noise_of_a_velocity_is_that_of_its_samples() -> None:
    """At 24 samples a cycle that of interpolated rows was 20 times too small: 1.5 stops of 2."""
    some = slice(None, None, 10)  # 25 a cycle
    x, v = sticking()
    speed = Channel("mass_velocity", v[some] + 5e-5 * NOISE[1, some])
    m = measure(Recording(T[some], x[some], 2e-3 * np.cos(TURN * (T[some] - 0.3)), channels=(speed,)), scene())
    assert m.stops_per_cycle == pytest.approx(2.0, abs=0.05)


def test_a_force_that_is_filtered_as_the_motion_is_asked_about_by_its_key() -> None:
    force = 0.8 * np.sign(np.cos(TURN * T))
    for sensors, count in (({"filter_hz": 30.0}, 1), ({}, 0)):
        m = measure(seen(X, contact_force=force), scene(sensors=sensors))
        said = [w for w in m.warnings if w.startswith("contact_force: it is taken as unfiltered, for filter_hz")]
        assert len(said) == count


def test_one_cycle_of_a_force_has_no_error_that_is_none() -> None:
    """0 was stated, and an uncertainty of 0.14 %, where repetitions scatter by 1.8 %."""
    some = T < 1.9
    force = Channel("contact_force", (0.8 * np.sign(np.cos(TURN * T)) + 0.2 * NOISE[0])[some])
    m = measure(Recording(T[some], X[some], Y[some], channels=(force,)), scene())
    assert m.cycles < 3
    assert m.force_energy_j.known
    assert (m.force_energy_j.se, m.force_energy_j.u, m.measured_friction_coefficient_u) == (None, None, None)


def test_the_drift_of_a_whole_test_is_no_error_of_a_short_window() -> None:
    """1000 cycles that drift by 10 % and scatter by 1e-4: 0.030 was stated."""
    values = 1.0 + 0.1 * np.linspace(0, 1, 1000) + 1e-4 * np.random.default_rng(0).standard_normal(1000)
    for some, least, most in (
        (slice(999, 1000), 9e-5, 2e-4),
        (slice(990, 1000), 3e-4, 7e-4),
        (slice(0, 1000), 0.028, 0.1),
    ):
        assert least < (steadiness.mean_over(values, some).se or 0.0) < most


def test_a_part_that_is_too_short_is_left_out_and_said() -> None:
    """Six samples between two gaps, or half a revolution, refused the whole test."""
    m = measure(seen(None, mass_velocity=TURN * 1e-3 * np.cos(TURN * T), lost=(3.0, 3.5, 3.52, 4.0)), scene())
    assert m.energy_per_cycle == pytest.approx(math.pi / 2, rel=3e-3)
    assert any(
        "part: from 3.5 s to 3.52 s is left out: analysis: expected at least 32 samples" in w for w in m.warnings
    )
    turning = scene(rig={"kind": "prescribed", "radius_m": 0.05})
    force = 5.0 + 0.1 * NOISE[0]
    m = measure(seen(None, None, angle=TURN * T, contact_force=force, lost=(1.0, 1.5)), turning)
    assert m.measured_friction_force_n == pytest.approx(5.0, rel=0.01)
    assert any("part: from 0 s to 1 s is left out: analysis: it turns one way" in w for w in m.warnings)


def test_a_frequency_ratio_that_is_not_known_is_not_taken_for_one() -> None:
    """The filter's share of the amplitude's uncertainty was that at r = 1, where a third harmonic is answered least."""
    sensors, shares = {"filter_hz": 3.0, "filter_order": 4}, []
    for rig in ({"natural_frequency_hz": 4.0}, {"natural_frequency_hz": 3.0}, {}):
        m = measure(seen(X, Y), scene(rig=rig, sensors=sensors))
        shares.append(m.budget["response_amplitude"]["filter of the mass sensor"])
    assert shares[2] >= max(shares[:2])


@pytest.mark.parametrize("seconds", [299.9, 300.9, 302.5])
def test_a_drift_is_a_sentence_or_a_trend(seconds: float) -> None:
    """Between two lengths that were compared with 300 s it was neither."""
    t = np.arange(0.0, seconds, 0.02)
    x = 1e-3 * (1.0 + 0.1 * t / seconds) * np.sin(TURN * t)
    m = measure(Recording(t, x, 2e-3 * np.cos(TURN * t)), scene())
    assert any(w.startswith("response_amplitude: drifts") for w in m.warnings) != m.energy_trend.known


def test_a_start_is_cut_where_the_drive_is_as_large_as_beside_it() -> None:
    """Of an amplitude that grows by 10 % in a minute, 25 s were cut for a start of 2 s."""
    t = np.arange(0.0, 60.0, 0.01)
    noise = 1e-6 * np.random.default_rng(1).normal(size=len(t))
    base = 2e-3 * (t > 2.0) * (1.0 + 0.1 * t / 60.0) * np.cos(TURN * t) + noise
    grows, rests = (Stretch(at, 0.01, {"mass": of, "base": of}) for at, of in ((0.0, base), (70.0, base[:190])))
    (kept,), said = steadiness.driven([grows, rests])
    assert kept.time == pytest.approx(2.0, abs=0.5)
    assert said == ["drive: the base does not follow it from 70 s on: that part is left out"]


@pytest.mark.parametrize("on", [((48.0, 60.0),), ((24.0, 36.0),), ((0.0, 20.0), (35.0, 60.0))])
def test_a_drive_is_found_wherever_it_stands_in_a_record(on: tuple[tuple[float, float], ...]) -> None:
    """One in the last fifth gave an energy of 4 +- 9 for 1.571, one with a pause 2.0 +- 1.3."""
    runs = np.any([(a <= T) & (b > T) for a, b in on], axis=0)
    m = measure(seen(*(runs * way + 1e-6 * noise for way, noise in zip((X, Y), NOISE, strict=True))), scene(None))
    assert m.energy_per_cycle == pytest.approx(math.pi / 2, rel=1e-3)
    assert (m.energy.u or 1.0) < 0.005
    assert m.cycles >= sum(b - a for a, b in on) - 2 * len(on)
    assert all(w.startswith("drive: it has its size") for w in m.warnings)


def ticks(*levels: float) -> FloatArray:
    """Levels of as many equal parts of the record, one after the other."""
    return np.repeat(levels, len(T) // len(levels))


def test_a_test_in_steps_is_told_by_its_causes_and_times() -> None:
    """Wear, or a sensor, was said to be the cause where frequency, amplitude or normal force were stepped."""
    turn, even = 0.004 * TURN * np.cumsum(ticks(0.6, 1.0, 1.4)), np.ones(len(T))
    far, mean = 0.02 + 1j * ticks(39.80, 39.81), "response_amplitude: the mean position of the response"
    for angle, x, y, n, said in (
        (turn, even, even, even, "drive_frequency_hz: the drive's frequency goes from 0.6 to 1 at 19.65 s, to 1.4 at"),
        (TURN * T, even, ticks(2, 2.6), even, "base_amplitude_m: the base's amplitude goes from 2 to 2.6 at 29.8"),
        (TURN * T, even, even, ticks(1.9, 3.1), "normal_force_n: the normal force goes from 1.9 to 3.1 at 29.79"),
        (TURN * T, ticks(1, 1, 0), even, even, "response_amplitude: the amplitude of the response goes from 1 to 0"),
        (TURN * T, ticks(1, 3) * 1j, even, even, f"{mean} goes from"),
        (TURN * T, far, even, even, f"{mean} goes from 39.8 to 39.81"),
    ):
        log = seen(1e-3 * (x.real * np.sin(angle) + x.imag), 1e-3 * y * np.cos(angle), normal_force=n)
        told = measure(log, scene(None)).warnings
        assert [w for w in told if w.startswith(said)]
        assert not [w for w in told if "wear, or a sensor" in w or "wanders" in w or "settled" in w]
    assert not any(steadiness.steps([Stretch(0.0, 0.004, {"mass": 8e-7 * np.round(0.5 * NOISE[0]), "base": Y})]))
    noisy = (Y + 1e-4 * np.random.default_rng(seed).normal(size=len(T)) for seed in (33, 52, 126, 162, 188))
    assert not any(steadiness.steps([Stretch(0.0, 0.004, {"mass": X, "base": base}) for base in noisy]))


def test_a_name_that_contradicts_the_drive_is_said() -> None:
    """A mis-named log, the commonest slip of a campaign, went by without a word."""
    for nominal, said in ((0.25, 0), (0.3, 0), (0.7, 1)):
        m = measure(seen(X).changed(experiment={"nominal_frequency_ratio": nominal}), scene())
        assert len([w for w in m.warnings if "frequency_ratio: 0.25 is driven, 0.7 by its name" in w]) == said


def test_a_part_at_another_frequency_is_another_test() -> None:
    """Its cycles were among those of the first."""
    turn = np.where(T < 30.0, 1.0, 1.5) * TURN * T
    m = measure(seen(1e-3 * np.sin(turn), 2e-3 * np.cos(turn), lost=(29.5, 36.0)), scene(None))
    assert m.drive_frequency_hz == pytest.approx(1.0, rel=1e-4)
    assert m.cycles == 28
    assert "drive: from 36 s on it is at 1.5 Hz, not at 1 Hz: that part is left out: measure it by itself" in m.warnings


def test_a_part_at_rest_is_none_of_a_contact_that_turns() -> None:
    """Where the turning part is refused, the resting one was measured: an energy of 0; refused, it was for others."""
    turning = scene(rig={"kind": "prescribed", "radius_m": 0.05})
    force, still = 0.1 * NOISE[0], 1e-4 * NOISE[1]
    for speed, refused in ((0.4, "expected 2 revolutions; got 1.2"), (2.0, "")):
        turns = np.where(T < 57.0, 0.0, speed * TURN)
        parts = seen(None, None, angular_velocity=turns + still, contact_force=5.0 * (turns > 0) + force, lost=(56, 57))
        if refused:
            with pytest.raises(AnalysisError, match=refused):
                measure(parts, turning)
        else:
            assert measure(parts, turning).measured_friction_force_n == pytest.approx(5.0, rel=0.01)
    with pytest.raises(AnalysisError, match="no drive: the contact stands still, starts or stops"):
        measure(seen(None, None, angular_velocity=still, contact_force=force), turning)
