"""Load cells, vibrometers, accelerometers: the truth of an exact motion found again, each within its uncertainty."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from frictionlab.analysis.channels import low_pass
from frictionlab.analysis.measurement import Measurement, measure
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError
from frictionlab.figures import plot
from frictionlab.inference.compare import compare_measurement
from frictionlab.inference.explain import explain, explain_comparison
from frictionlab.logs import read_log
from frictionlab.recording import Channel, Recording
from frictionlab.scene import Scene, scene_from_tables
from tests.analysis.seen import BASE_M, NATURAL_HZ, steady, through_laser
from tests.desk import invoke, present, published

STIFFNESS, NORMAL_N = 1191.0, 2.45
RIG = {"natural_frequency_hz": NATURAL_HZ, "stiffness_n_per_m": STIFFNESS}


def scene(**sensors: float) -> Scene:
    tables = {"rig": RIG, "experiment": {"normal_force_n": NORMAL_N, "material": "brass"}, "sensors": sensors}
    return scene_from_tables(tables)


def channels_of(
    r: float, beta: float, *, seed: int = 1, gain: float = 1.0, inertia: float = 0.0
) -> dict[str, FloatArray]:
    """Channels of 40 s of a steady motion: displacements through lasers, force through a load cell of 5 mN noise."""
    state, orbit, _, _ = steady(r, beta)
    rng, t = np.random.default_rng(seed), np.arange(0.0, 40.0, 0.002)
    omega = 2 * math.pi * r * NATURAL_HZ
    tau = np.mod(omega * t + 0.7, 2 * math.pi * (state.period_cycles or 1))
    x, v = orbit.at(tau)
    slips, pull = np.abs(v) > 1e-6, np.cos(tau) - x
    acceleration = np.where(slips, (pull - beta * np.sign(v)) / r**2, 0.0)
    force = np.where(slips, beta * np.sign(v), pull) * STIFFNESS * BASE_M
    force = force + inertia * omega**2 * BASE_M * acceleration
    return {
        "time": t,
        "mass_displacement": through_laser(BASE_M * x, rng),
        "base_displacement": through_laser(BASE_M * np.cos(tau), rng),
        "contact_force": gain * force + 0.005 * rng.standard_normal(len(t)),
        "mass_velocity": BASE_M * omega * v + 2e-6 * rng.standard_normal(len(t)),
        "mass_acceleration": BASE_M * omega**2 * acceleration + 1e-3 * rng.standard_normal(len(t)),
    }


def recording(seen: dict[str, FloatArray], *names: str) -> Recording:
    """Of these channels, displacements as fields."""
    x, y = (seen[name] if name in names else None for name in ("mass_displacement", "base_displacement"))
    more = tuple(Channel(name, seen[name]) for name in names if not name.endswith("_displacement"))
    return Recording(seen["time"], x, y, channels=more)


def mass_said(m: Measurement) -> list[float]:
    """The mass that a warning says would fit, and its uncertainty."""
    found = re.search(r"force_inertia_kg = (\S+) ± (\S+) in", " ".join(m.warnings))
    return [float(word) for word in found.groups()] if found else []


def tribometer(time: FloatArray, /, **seen: FloatArray | float) -> Measurement:
    """Of channels of a motion that is given; `radius_m` [m] where it turns; no base is there that could be late."""
    rig = {"kind": "prescribed"} | ({"radius_m": seen.pop("radius_m")} if "radius_m" in seen else {})
    channels = {name: np.asarray(values, float) for name, values in seen.items()}
    tables = {"rig": rig, "sensors": {"lag_s": 0.05}}
    m = measure(recording({"time": time, **channels}, *seen), scene_from_tables(tables))
    np.testing.assert_allclose(m.cycle.base, m.cycle.mass, atol=1e-9)
    return m


@pytest.mark.parametrize(("r", "beta", "sign"), [(0.3, 0.4, 1.0), (0.5, 0.4, -1.0), (0.7, 0.3, 1.0)])
def test_a_load_cell_gives_energy_and_coefficient_of_the_truth(r: float, beta: float, sign: float) -> None:
    _, _, energy, _ = steady(r, beta)
    seen = channels_of(r, beta)
    seen["contact_force"] *= sign
    m = measure(recording(seen, "mass_displacement", "base_displacement", "contact_force"), scene())
    scale = STIFFNESS * m.base_amplitude_m**2
    assert m.force_energy_per_cycle == pytest.approx(energy, rel=2e-3)
    assert m.force_energy_per_cycle_j == pytest.approx(energy * scale, rel=2e-3)
    assert m.measured_friction_force_n == pytest.approx(beta * STIFFNESS * BASE_M, rel=2e-3)
    wide = measure(recording(seen, "mass_displacement", "base_displacement", "contact_force"), scene(gain_error=0.02))
    share = math.hypot(math.sqrt(2.0) * 0.02, 2.0 * 0.02, 0.005)  # cell and mass; Y twice; the stiffness
    assert wide.force_energy_per_cycle_u == pytest.approx(share * present(wide.force_energy_per_cycle), rel=0.01)
    truth = beta * STIFFNESS * BASE_M / NORMAL_N
    assert abs((m.measured_friction_coefficient or 0.0) - truth) < 2 * (m.measured_friction_coefficient_u or 0.0)
    assert any("counts the other way" in w for w in m.warnings) == (sign < 0)
    assert not [w for w in m.warnings if "the load cell gives" in w]


def test_the_uncertainty_of_the_measured_coefficient_covers() -> None:
    """Gains of load cell and lasers of 0.5 %, normal force of 1 %, drawn: shares within 1 and 1.96 of u.

    And the mass that moves with the cell: it was asked for without a value.
    """
    rng, off, off_mass = np.random.default_rng(3), [], []
    for seed in range(40):
        gain, normal = 1 + 0.005 * rng.standard_normal(), 1 + 0.01 * rng.standard_normal()
        kg = 0.05 + 0.006 * seed
        seen = channels_of(0.5, 0.4, seed=seed, gain=gain * normal, inertia=kg / normal)
        declared = scene(gain_error=0.005, force_inertia_kg=0.5 * kg * (seed % 2))
        m = measure(recording(seen, "mass_displacement", "base_displacement", "contact_force"), declared)
        found, of_found = mass_said(m)
        off_mass.append((found - kg) / of_found)
        assert of_found < 0.01 * kg
        truth = 0.4 * STIFFNESS * BASE_M / NORMAL_N
        off.append(((m.measured_friction_coefficient or 0.0) - truth) / (m.measured_friction_coefficient_u or 1.0))
        assert 0.005 < (m.measured_friction_force_n_u or 0.0) / (m.measured_friction_force_n or 1.0) < 0.006
        for energy, u in (
            (m.force_energy_per_cycle_j, m.force_energy_per_cycle_j_u),
            (m.force_energy_per_cycle, m.force_energy_per_cycle_u),
        ):
            assert 0.006 < (u or 0.0) / (energy or 1.0) < 0.014
    assert 0.55 < float(np.mean(np.abs(off) < 1.0)) < 0.82
    assert min(float(np.mean(np.abs(scores) < 1.96)) for scores in (off, off_mass)) > 0.88


def test_a_load_cell_that_is_off_against_the_loop_is_said() -> None:
    seen = channels_of(0.5, 0.4, gain=1.1)
    m = measure(recording(seen, "mass_displacement", "base_displacement", "contact_force"), scene())
    (said,) = [w for w in m.warnings if w.startswith("force_energy_per_cycle: the load cell gives")]
    assert "+10 %" in said


def test_inertia_between_cell_and_contact_changes_the_force_and_not_its_energy() -> None:
    plain, heavy = channels_of(0.7, 0.3), channels_of(0.7, 0.3, inertia=0.2)
    names = "mass_displacement", "base_displacement", "contact_force"
    right = measure(recording(plain, *names), scene())
    blind, knowing = (measure(recording(heavy, *names), scene(force_inertia_kg=kg)) for kg in (0.0, 0.2))
    assert blind.force_energy_per_cycle == pytest.approx(right.force_energy_per_cycle, rel=2e-3)
    force = present(right.cycle.force)
    assert float(np.std(present(blind.cycle.force) - force)) > 0.1 * float(np.std(force))
    assert float(np.std(present(knowing.cycle.force) - force)) < 0.05 * float(np.std(force))
    value, u = mass_said(blind)
    assert abs(value - 0.2) < 2.0 * u < 0.004
    assert not mass_said(knowing) + mass_said(right)


@pytest.mark.parametrize(
    ("channel", "r", "beta", "share"),
    [("mass_velocity", 0.5, 0.2, 3e-3), ("mass_acceleration", 0.7, 0.3, 3e-3), ("mass_acceleration", 0.33, 0.45, 5e-3)],
)
def test_a_velocity_or_an_acceleration_serves_for_a_displacement(
    channel: str, r: float, beta: float, share: float
) -> None:
    """Near a third of resonance the third harmonic of an acceleration is its strongest line.

    What is slower than a fifth of that harmonic was taken off: energy was 1.7 % low.
    """
    _, _, energy, amplitude = steady(r, beta)
    m = measure(recording(channels_of(r, beta), *{channel, "mass_acceleration"}, "base_displacement"), scene())
    assert m.energy_per_cycle == pytest.approx(energy, rel=3e-3)
    assert m.response_amplitude == pytest.approx(amplitude, rel=share)
    assert abs(m.response_amplitude - amplitude) < 2 * present(m.response_amplitude_u)
    (said,) = [w for w in m.warnings if w.startswith("mass_displacement: integrated") and "offset are gone" in w]
    assert ("; mass acceleration is not used" in said) == (channel == "mass_velocity")  # which is better


def test_jumps_that_sampling_folds_onto_the_drive_make_no_dashpot() -> None:
    """Harmonic 501 of a jump stood in the first: a dashpot 25 standard errors from none, in a fit that explained."""
    seen = {name: values[1::2] for name, values in channels_of(1.5 / NATURAL_HZ, 0.4).items()}  # 166.67 a cycle
    known = scene(lag_s_u=1e-5).changed(rig={"natural_frequency_hz_u": 3e-4, "damping_ratio": 0.0})
    m = measure(recording(seen, "mass_acceleration", "base_displacement"), known)
    assert m.layout.folded_into(3) == pytest.approx([0.0045, 0.0011, 0.0005], rel=0.1)
    found = explain_comparison(compare_measurement(m, known, law="coulomb+speed"))
    dashpot = found.comparison.parameters["contact_damping_ratio"]
    assert 0.0 <= dashpot["value"] < 2.0 * dashpot["se"] < 2e-3
    assert any("folded down" in line for line in found.short(11))


@pytest.mark.parametrize("channel", ["mass_velocity", "mass_acceleration"])
def test_noise_of_an_integrated_sensor_makes_no_motion_larger(channel: str) -> None:
    """Extremes were those of single noisy cycles: at 5 % of noise 2.5 u high by a velocity, 1.8 by an acceleration."""
    off, _, _, amplitude = [], *steady(0.5, 0.4)[1:]
    for seed in range(8):
        seen = channels_of(0.5, 0.4, seed=seed)
        seen[channel] += 0.05 * seen[channel].std() * np.random.default_rng([77, seed]).standard_normal(20000)
        m = measure(recording(seen, channel, "base_displacement"), scene(linearity=0.0, lag_s_u=1e-9, gain_error=1e-6))
        off.append((present(m.response_amplitude) - amplitude) / present(m.response_amplitude_u))
    assert abs(np.mean(off)) < 0.8
    assert np.mean(np.abs(off) < 1.96) > 0.8


def two_sensors(seed: int, noisier: float, second: str, *, gain: float = 1.0) -> list[Measurement]:
    """By a laser of 10 um, a second sensor so many times noisier at the drive, and both."""
    rng, t, omega = np.random.default_rng(seed), np.arange(0.0, 20.0, 0.002), math.pi * NATURAL_HZ
    tau = np.mod(omega * t + rng.uniform(0.0, 6.0), 2 * math.pi)
    x, v = steady(0.5, 0.4)[1].at(tau)
    a = np.where(np.abs(v) > 1e-6, 4.0 * (np.cos(tau) - x - 0.4 * np.sign(v)), 0.0) * BASE_M * omega**2
    laser, base, other = 1e-5 * rng.standard_normal((3, len(t)))
    seen = {"time": t, "mass_displacement": 0.03 + BASE_M * x + laser}
    seen["base_displacement"] = BASE_M * np.cos(tau) + 0.01 * base
    shown = {
        "mass_velocity": v * BASE_M * omega + noisier * omega * other,
        "mass_acceleration": a + noisier * omega**2 * other,
    }
    seen[second] = gain * shown[second]
    given = scene_from_tables({"rig": RIG, "sensors": {"gain_error": 1e-6, "linearity": 0.0, "lag_s_u": 1e-6}})
    pairs = (["mass_displacement"], [second], ["mass_displacement", second])
    return [measure(recording(seen, "base_displacement", *pair), given) for pair in pairs]


@pytest.mark.parametrize("second", ["mass_velocity", "mass_acceleration"])
@pytest.mark.parametrize("noisier", [0.1, 1.0, 10.0])
def test_two_sensors_of_one_place_are_no_worse_than_the_better_one(noisier: float, second: str) -> None:
    """Of 200 draws (r = 0.5 and 0.7): scatter of energy 0.90 to 1.00 of the better one's, of amplitude 0.37 to 0.49."""
    _, _, energy, size = steady(0.5, 0.4)
    draws = [two_sensors(seed, noisier, second) for seed in range(10)]
    for name, truth in (("energy", energy), ("amplitude", size)):
        found = [[getattr(m, name) for m in draw] for draw in draws]
        off = np.array([[number.value - truth for number in row] for row in found])
        scatter, u = off.std(axis=0), np.array([row[2].u for row in found])
        assert scatter[2] <= 1.02 * min(scatter[:2])
        assert np.mean(np.abs(off[:, 2]) < 1.96 * u) >= 0.8
    one, _, both = draws[0]
    assert both.layout.offset == pytest.approx(one.layout.offset, abs=1e-6)
    assert both.stops_per_cycle == 2.0


@pytest.mark.parametrize(("gain", "shows"), [(1.02, r"1\.0\d+ times its motion"), (-1.0, "180 degrees")])
def test_two_sensors_that_disagree_are_not_combined(gain: float, shows: str) -> None:
    one, _, both = two_sensors(1, 1.0, "mass_acceleration", gain=gain)
    assert both.row() | {"warnings": ()} == one.row() | {"warnings": ()}
    said = [w for w in both.warnings if "mass_acceleration: not used, mass_displacement alone is: at the drive" in w]
    assert re.search(shows, said[0])


def test_a_vibrometer_sees_stops_that_a_laser_does_not() -> None:
    seen = channels_of(0.3, 0.25)
    state, _, _, _ = steady(0.3, 0.25)
    both = measure(recording(seen, "mass_displacement", "base_displacement", "mass_velocity"), scene())
    alone = measure(recording(seen, "mass_displacement", "base_displacement"), scene())
    assert both.stops_per_cycle == state.stops_per_cycle
    assert both.shortest_stop <= alone.shortest_stop
    assert both.stuck_fraction == pytest.approx(state.stuck_fraction, abs=0.01)


def test_a_filter_that_is_declared_is_taken_back_from_a_velocity_too() -> None:
    """The mass was taken back and its velocity was not: stops 33 ms late against the mass that stands in them."""
    exact, names = channels_of(0.3, 0.25), ("mass_displacement", "base_displacement", "mass_velocity")
    gain = low_pass(np.fft.rfftfreq(len(exact["time"]), 0.002).astype(np.float64), 15.0, 1)
    seen = exact | {name: np.fft.irfft(np.fft.rfft(exact[name]) * gain, len(exact["time"])) for name in names}
    tests = [measure(recording(c, *names), scene(**s)) for c, s in ((exact, {}), (seen, {"filter_hz": 15.0}))]
    early, late = (m.layout.seconds(m.found.mean(axis=0) / (2 * math.pi)) for m in tests)
    np.testing.assert_allclose(late, early, atol=6e-3)


@pytest.mark.parametrize("place", ["mass_displacement", "angle"])
def test_a_tribometer_needs_neither_spring_nor_base(place: str) -> None:
    """Coefficient of a reciprocating test whose normal force wobbles; torque over an angle has energy alone."""
    rng, t = np.random.default_rng(5), np.arange(0.0, 60.0, 0.002)
    x = 5e-3 * np.sin(2 * math.pi * 0.8 * t) + 1e-6 * rng.standard_normal(len(t))
    normal = 20.0 * (1 + 0.05 * np.cos(2 * math.pi * 0.3 * t))
    force = 0.17 * normal * np.sign(np.cos(2 * math.pi * 0.8 * t)) + 0.05 * rng.standard_normal(len(t))
    by = "contact_force" if place == "mass_displacement" else "torque"
    x[-1] = x[0]  # it ends where it began
    m = tribometer(t, **{place: x, "normal_force": normal, by: force})
    assert m.drive_frequency_hz == pytest.approx(0.8, rel=1e-5)
    assert m.force_energy_per_cycle_j == pytest.approx(4 * 5e-3 * 0.17 * 20.0, rel=2e-3)
    assert (m.row()["energy_per_cycle"], m.row()["frequency_ratio"]) == (None, None)
    if place == "mass_displacement":
        assert m.measured_friction_coefficient == pytest.approx(0.17, rel=2e-3)
    assert ["radians stand for" in w for w in m.warnings] == [True] * (place == "angle")


def test_friction_that_drifts_on_a_tribometer_is_said() -> None:
    rng, t = np.random.default_rng(4), np.arange(0.0, 120.0, 0.005)
    x, way = 5e-3 * np.sin(2 * math.pi * 0.5 * t), np.sign(np.cos(2 * math.pi * 0.5 * t))
    worn, same = ((3.0 * (1 + a * t / 120.0) * way + 0.05 * rng.standard_normal(len(t))) for a in (0.5, 0.0))
    said, none = (tribometer(t, mass_displacement=x, contact_force=f).warnings for f in (worn, same))
    assert any(re.search(r"contact_force: friction drifts by \+(39|40) %", w) for w in said)
    assert not any("drifts" in w for w in none)


def test_an_earthquake_is_no_motion_that_repeats() -> None:
    """Published records of a damper were "2 cycles" of their strongest line: 962 N, without an error."""
    rng, t = np.random.default_rng(2), np.arange(0.0, 30.0, 0.002)
    lines = 2 * math.pi * rng.uniform(0.2, 3.0, 40)
    place = np.cos(np.outer(t, lines) + rng.uniform(0.0, 6.0, 40)) @ (2e-3 * lines**-2.0)
    place *= np.exp(-((t / 10.0 - 1.5) ** 2))
    m = tribometer(t, mass_displacement=place, contact_force=3.0 * np.sign(np.gradient(place)))
    assert m.measured_friction_force_n == pytest.approx(3.0, rel=0.01)
    assert any("it goes to and fro without repeating" in w for w in m.warnings)


@pytest.mark.parametrize(("start", "stop"), [(3.0, 40.0), (25.0, 40.0), (3.0, 30.0)])
def test_a_force_without_a_motion_is_measured_while_it_is_there(start: float, stop: float) -> None:
    """Its rest counted: 2.3 +- 1.6 N for 3, after 10 s of 40; a lone sample behind a break ended the program."""
    rng, t = np.random.default_rng(1), np.append(np.arange(0.0, 40.0, 0.01), 45.0)
    force = np.where((t >= start) & (t < stop), 3.0 + 0.06 * np.sin(5 * t), 0.0) + 0.05 * rng.standard_normal(len(t))
    m = tribometer(t, contact_force=force, normal_force=np.full(len(t), 10.0))
    assert m.measured_friction_force_n == pytest.approx(3.0, rel=4e-3)
    assert any("is left out: analysis: no drive: the contact stands still" in w for w in m.warnings)


@pytest.mark.parametrize("place", ["angle", "angular_velocity", "mass_velocity", None])
def test_a_contact_that_turns_has_coefficient_and_energy_of_a_revolution(place: str | None) -> None:
    rng, t, radius = np.random.default_rng(6), np.arange(0.0, 30.0, 0.004), 0.02
    force, omega = 3.0 + 0.2 * rng.standard_normal(len(t)), 2 * math.pi * 2.0
    moved = {"angle": np.mod(omega * t, 2 * math.pi), "angular_velocity": np.full(len(t), omega)}
    moved["mass_velocity"] = radius * moved["angular_velocity"]
    seen = {"contact_force": -force, "normal_force": np.full(len(t), 10.0)} | ({place: moved[place]} if place else {})
    m = tribometer(t, **seen, **({"radius_m": radius} if place and place.startswith("ang") else {}))
    assert (u := m.measured_friction_coefficient_u or math.inf) < 0.002
    assert m.measured_friction_coefficient == pytest.approx(0.3, abs=3.0 * u)
    assert m.measured_friction_force_n == pytest.approx(3.0, rel=3e-3)
    assert any("an offset of the force cannot be separated from friction" in w for w in m.warnings)
    (over_way,) = plot(m).axes  # neither a motion to and fro nor a force over speed: none was measured
    force = np.asarray(over_way.lines[0].get_ydata(), float)
    np.testing.assert_allclose(force[np.isfinite(force)], 3.0, rtol=0.2)
    assert over_way.get_title(loc="left").startswith(f"friction force {m.measured_force} N")
    if place is None:
        assert m.force_energy_per_cycle_j is None
    elif place == "mass_velocity":
        assert m.force_energy_per_cycle_j == pytest.approx(3.0 * radius * omega * 30.0 / 10, rel=3e-3)
    else:
        assert m.drive_frequency_hz == pytest.approx(2.0, rel=1e-3)
        assert m.force_energy_per_cycle_j == pytest.approx(3.0 * 2 * math.pi * radius, rel=3e-3)


def test_a_force_that_changes_over_the_revolution_is_drawn_as_it_is() -> None:
    t, omega, radius = np.arange(0.0, 30.0, 0.004), 2 * math.pi * 0.5, 0.02
    seen = {"time": t, "angle": np.mod(omega * t, 2 * math.pi), "normal_force": np.full(len(t), 20.0)}
    noise = 1e-6 * np.random.default_rng(1).standard_normal(len(t))
    seen["torque"] = 8.0 * radius * (1.0 + 0.1 * np.sin(omega * t)) + noise
    given = scene_from_tables({"rig": {"kind": "prescribed", "radius_m": radius}})
    m = measure(recording(seen, "angle", "torque", "normal_force"), given)
    found = explain(m, given).comparison
    assert any("No other law was tried: the contact slides one way" in said for said in found.warnings)
    assert not any("--law auto" in said for said in found.warnings)
    for ax, size in ((plot(m).axes[0], 1.0), (plot(found).axes[0], 1.0), (plot(found).axes[1], 0.0)):
        line = next(line for line in ax.lines if np.size(line.get_xdata()) > 2)
        way, force = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
        truth = 8.0 * (size + 0.1 * np.sin(2 * math.pi * way))
        np.testing.assert_allclose(force[np.isfinite(force)], truth[np.isfinite(force)], atol=0.02)


def test_a_stroke_whose_column_of_displacement_stands_still_counts_by_its_force() -> None:
    t = np.arange(0.0, 4.0, 0.01)
    stands, normal = np.full(len(t), 0.004), np.full(len(t), 2.0)
    m = tribometer(t, mass_displacement=stands, contact_force=1.5 + 0.01 * np.sin(t**2), normal_force=normal)
    assert m.measured_friction_coefficient == pytest.approx(0.75, rel=0.01)
    assert m.force_energy_per_cycle_j is None


def test_a_contact_that_turns_at_several_speeds_is_several_tests() -> None:
    t = np.arange(0.0, 30.0, 0.004)
    with pytest.raises(AnalysisError, match=r"0\.95\d* to 1\.9\d* cycles a second: expected one speed"):
        tribometer(t, torque=np.full(len(t), 0.1), angular_velocity=np.where(t < 15.0, 6.0, 12.0))


@pytest.mark.parametrize("place", ["angle", "angular_velocity"])
@pytest.mark.parametrize(("ramp", "then"), [(0.02, 1.0), (2.0, 1.0), (2.0, -1.0)])
def test_a_contact_that_turns_is_measured_while_it_has_its_speed(place: str, ramp: float, then: float) -> None:
    """It was refused as one of several speeds, and as no drive where it turns back."""
    t, rng = np.arange(0.0, 50.0, 0.004), np.random.default_rng(3)
    turns = 2 * math.pi * 2.0 * np.clip(np.minimum(t - 8.0, 42.0 - t) / ramp, 0.0, 1.0)
    turns *= np.where(t > 22.0, then, 1.0) * (1.0 - ((t > 20.0) & (t < 24.0)))  # and pauses
    moved = {"angle": np.mod(np.cumsum(turns) * 0.004, 2 * math.pi), "angular_velocity": turns}[place]
    force = 3.0 * np.sign(turns) + 0.05 * rng.standard_normal(len(t))
    noise = 1e-3 * rng.standard_normal(len(t))
    m = tribometer(t, contact_force=force, normal_force=np.full(len(t), 10.0), radius_m=0.02, **{place: moved + noise})
    assert m.drive_frequency_hz == pytest.approx(2.0, rel=1e-4)
    assert m.measured_friction_coefficient == pytest.approx(0.3, rel=2e-3)
    assert m.cycles >= 60 - 4 * ramp - 4  # less than a cycle and a window at either end of a part
    assert len([w for w in m.warnings if "is left out: analysis: no drive: the contact stands still, starts" in w]) == 3


def test_a_base_that_stands_still_says_nothing_of_a_motion_that_is_given() -> None:
    """The slowest line of its drift was taken for the drive, and the acceleration integrated from there."""
    t, rng = np.arange(0.0, 60.0, 0.004), np.random.default_rng(0)
    turn = 2 * math.pi * 0.8
    a = -(turn**2) * 5e-3 * np.sin(turn * t) + 1e-2 * rng.standard_normal(len(t))
    still = np.cumsum(1e-7 * rng.standard_normal(len(t)))
    m = tribometer(t, mass_acceleration=a, contact_force=3.0 * np.sign(np.cos(turn * t)), base_displacement=still)
    assert m.base_amplitude_m == pytest.approx(5e-3, rel=2e-3)


def test_what_was_not_measured_is_said_by_name() -> None:
    seen = channels_of(0.5, 0.4)
    with pytest.raises(AnalysisError, match="the base's motion was not measured: expected its displacement, velocity"):
        measure(recording(seen, "mass_displacement", "contact_force"), scene())


def test_what_comes_before_and_after_the_motion_is_no_part_of_it() -> None:
    """Noise before a clock was set made the whole record one way; ends at rest made amplitudes 3 % wrong."""
    t = np.concatenate([np.arange(0.0, 4.0, 0.01), np.arange(4.018, 64.0, 0.01)])
    swing = np.clip(0.5 * np.minimum(t - 6.0, 60.0 - t), 0.0, 1.0)
    place = 1e-3 * swing * np.sin(2 * np.pi * t) + 2e-8 * np.random.default_rng(3).standard_normal(len(t)).cumsum()
    m = tribometer(t, mass_displacement=place, contact_force=2.0 * swing * np.cos(2 * np.pi * t))
    assert (m.slides_one_way, m.cycles) == (False, 50)
    assert m.base_amplitude_m == pytest.approx(1e-3, rel=1e-3)
    rest = "from 0 s to 3.99 s is left out: it does not move as the long"
    for said in (rest, "until 58.", "drive: it has its size from 7."):
        assert any(said in w for w in m.warnings)


def test_a_force_that_exceeds_what_its_energy_gives_is_said() -> None:
    """A contact that yields over half of its stroke: energy over the way is no friction force."""
    t = np.arange(0.0, 30.0, 0.01)
    place, force, pull = 1e-3 * np.sin(2 * np.pi * 0.5 * t), np.zeros(len(t)), 0.0
    for k, moved in enumerate(np.diff(place, prepend=0.0)):
        force[k] = pull = min(max(pull + 4e3 * moved, -2.0), 2.0)
    m = tribometer(t, mass_displacement=place, contact_force=force)
    assert m.measured_friction_force_n == pytest.approx(1.0, rel=0.01)
    assert [w for w in m.warnings if "gives 0.991 N, yet the force reaches 1.99 N, as where the contact yields" in w]


def test_a_published_tribometer_record() -> None:
    """FrictionModels.jl, test_data_2: uN, 0.25 Hz; energy over way by hand: 0.228; it yields and reaches 0.48."""
    log = published("jchristopherson+FrictionModels.jl/examples/test_data_2.txt")
    m = measure(read_log(log), scene_from_tables({"rig": {"kind": "prescribed"}}))
    assert m.drive_frequency_hz == pytest.approx(0.25, rel=1e-3)
    assert m.measured_friction_coefficient == pytest.approx(0.228, rel=0.05)
    assert m.cycles == 50
    assert [w for w in m.warnings if "gives 1.11 N, yet the force reaches 2.3" in w]


def test_a_damper_of_a_building_has_joules_and_options_of_units_add_up(tmp_path: Path) -> None:
    t = np.arange(0.0, 30.0, 0.002)
    motion = 25.0 * np.sin(np.pi * t) + 0.05 * np.sin(2 * np.pi * 37.3 * t)
    (tmp_path / "rig.toml").write_text('[rig]\nkind = "prescribed"\n')
    words = ("--mass", "2", "--contact-force", "3", "--units", "mass=mm", "--units", "contact_force=kN")
    for name, force in (("damper", 2.0), ("small", 2e-6)):
        table = np.column_stack([t, motion, force * np.sign(np.cos(np.pi * t))])
        np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header="t [s],x,force", comments="")
        invoke("ingest", tmp_path / f"{name}.csv", *words, "--scene", tmp_path / "rig.toml", status=0)
    shown = invoke("analyze", *tmp_path.glob("*.h5"), "--scene", tmp_path / "rig.toml")
    assert [word in shown.stdout for word in ("E force [J]", "200.", "[mJ]")] == [True, True, False]  # of both
    assert "0.2 % of the motion's amplitude, no harmonic of the drive, is taken out" in shown.stderr
