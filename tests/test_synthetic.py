"""The virtual rig: its motion is the simulator's, its lasers add what they are said to add, its logs are safe."""

import math
from pathlib import Path

import numpy as np
import pytest

from frictionlab import compare
from frictionlab.analysis.measurement import measure
from frictionlab.errors import SceneError
from frictionlab.logs import LogOptions, read_log
from frictionlab.scene import Rig, Scene, read_scene, scene_from_tables
from frictionlab.simulator import simulate, steady_state
from frictionlab.synthetic import cycle_friction_ratios, log_of, motion, synthesize, virtual_tests
from tests.desk import ROOT, invoke, present, truths

Tables = dict[str, object]


def scene_of(test: Tables | None = None, **synthetic: object) -> Scene:
    """One virtual test on a frame."""
    plain: Tables = {"material": "steel", "normal_forces_n": [1.25], "friction_coefficient": 0.5}
    tables = {"duration_s": 20.0, "tests": [plain | {"frequency_ratios": [0.5]} | (test or {})]}
    return scene_from_tables({"rig": {"mass_kg": 3.0, "stiffness_n_per_m": 1200.0}, "synthetic": tables | synthetic})


def logged(scene: Scene) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Time, mass and base of the first virtual test's log [s, mm, mm], and what is beside them."""
    lines = log_of(virtual_tests(scene)[0], scene).splitlines()[3:]
    return np.array([[float(x) for x in line.split(",")] for line in lines])


def test_a_steady_start_is_the_steady_orbit() -> None:
    scene = scene_of(start="steady")
    (test,) = virtual_tests(scene)
    time = np.arange(2000) / 250.0
    orbit = present(steady_state(test.problem()).orbit)
    tau = np.mod(2 * math.pi * test.drive_frequency_hz * time, 2 * math.pi)
    moved = motion(test, time, scene)
    np.testing.assert_allclose(moved.mass[:, 0], orbit.at(tau)[0], atol=1e-12)
    np.testing.assert_array_equal(moved.force[:, 0], orbit.force(tau))


def test_from_rest_the_motion_comes_to_the_steady_orbit() -> None:
    rest, steady = (scene_of({"frequency_ratios": [0.4]}, duration_s=60.0, start=start) for start in ("rest", "steady"))
    (test,) = virtual_tests(rest)
    time = np.arange(0, 60, 0.004)
    difference = 1.8e-3 * np.abs(motion(test, time, rest).mass - motion(test, time, steady).mass)
    assert difference[:250].max() > 1e-4
    assert difference[-250:].max() < 1e-9


def test_the_lasers_add_their_noise_and_round_to_their_step() -> None:
    clean, seen = scene_of(noise_m=0.0, step_m=0.0), scene_of(noise_m=5e-6, step_m=1e-6)
    error = 1e-3 * (logged(seen) - logged(clean))[:, 1:]
    expected = math.hypot(5e-6, 1e-6 / math.sqrt(12))
    assert error.std(axis=0) == pytest.approx(expected, rel=0.05)
    steps = 1e3 * logged(seen)[:, 1:]
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


def test_the_same_scene_gives_the_same_log_another_seed_another_and_a_further_test_changes_none() -> None:
    (test,) = virtual_tests(scene_of())
    assert log_of(test, scene_of(seed=1)) == log_of(test, scene_of(seed=1))
    assert log_of(test, scene_of(seed=1)) != log_of(test, scene_of(seed=2))
    one, two = scene_of(), scene_of({"frequency_ratios": [0.5, 0.7]})
    assert log_of(virtual_tests(one)[0], one) == log_of(virtual_tests(two)[0], two)


@pytest.mark.parametrize(
    ("behaviour", "last_over_first"),
    [
        ({"friction_drift_per_hour": 18.0}, 1.1),
        ({"jump_s": 10.0, "jump_factor": 0.7}, 0.7),
        ({"friction_drift_per_hour": -720.0}, 0.0),
    ],
)
def test_friction_drifts_and_jumps_as_the_scene_says(behaviour: Tables, last_over_first: float) -> None:
    scene = scene_of(behaviour)
    (test,) = virtual_tests(scene)
    ratios = cycle_friction_ratios(test, scene)
    assert ratios[0] == test.friction_ratio
    assert ratios[-1] / ratios[0] == pytest.approx(last_over_first, abs=0.005)


def test_friction_scatters_from_cycle_to_cycle_by_the_given_share() -> None:
    scene = scene_of({"friction_scatter": 0.02}, duration_s=2000.0)
    (test,) = virtual_tests(scene)
    ratios = cycle_friction_ratios(test, scene)
    assert ratios.std() / test.friction_ratio == pytest.approx(0.02, rel=0.06)
    assert ratios.mean() == pytest.approx(test.friction_ratio, rel=0.002)


def test_a_scene_without_rig_or_tests_is_refused() -> None:
    with pytest.raises(SceneError, match=r"synthetic\.tests: expected at least one"):
        virtual_tests(scene_from_tables({"rig": {"mass_kg": 1.0, "stiffness_n_per_m": 1.0}}))
    with pytest.raises(SceneError, match="rig: a virtual rig needs natural frequency and stiffness"):
        virtual_tests(scene_of().model_copy(update={"rig": Rig()}))


PLACE: Tables = {"law": "coulomb+place", "parameters": {"gradient": 0.05}}


def test_each_material_has_its_own_law(tmp_path: Path) -> None:
    (test,) = virtual_tests(scene_of(PLACE))
    assert test.problem().parameters["gradient"] == 0.05
    list(synthesize(scene_of(PLACE), tmp_path))
    (known,) = truths(tmp_path)
    assert (known["law"], known["parameters"]) == ("coulomb+place", {"gradient": 0.05})
    state = steady_state(test.problem())
    assert known["energy_per_cycle"] == pytest.approx(state.energy_per_cycle, rel=1e-11)


def test_parameters_in_newtons_metres_and_seconds_are_over_the_rig_in_each_test() -> None:
    """k = 1191 N/m, natural frequency 3.13 Hz, Y = 1.8 mm: what a dashpot of 6 N s/m and a speed of 2 mm/s are."""
    physical = {"gradient": 28.0, "contact_damping_ratio": 6.0, "stribeck_speed": 2e-3}
    group: Tables = {"law": "coulomb+place+speed+stribeck", "frequency_ratios": [0.5, 1.2], "physical": physical}
    rest = {"parameters": {"static_ratio": 1.2, "stribeck_exponent": 1.0}}
    scene = scene_of(group | rest)
    stiffness, natural = scene.rig.stiffness, scene.rig.natural_frequency
    assert stiffness
    assert natural
    for test in virtual_tests(scene):
        turn = 2 * math.pi * test.frequency_ratio * natural
        assert test.parameters["gradient"] == pytest.approx(28.0 * test.base_amplitude_m)
        damping = 6.0 * 2 * math.pi * natural / (2.0 * stiffness)
        assert test.parameters["contact_damping_ratio"] == pytest.approx(damping)
        assert test.parameters["stribeck_speed"] == pytest.approx(2e-3 / (turn * test.base_amplitude_m))


def test_a_friction_ratio_held_for_fits_is_not_that_of_a_virtual_contact() -> None:
    """The truth said the friction coefficient's ratio, and the motion had the one held."""
    (test,) = virtual_tests(scene_of().changed(model={"parameters": {"beta": 0.123}}))
    assert test.problem().beta == test.friction_ratio != 0.123


@pytest.mark.parametrize(
    ("test", "fault"),
    [
        ({"law": "coulomb+glue"}, r"synthetic\.tests\.0\.law: .*'glue' is no term"),
        ({"law": "coulomb+place"}, r"synthetic\.tests\.0\.law: .*gradient"),
        ({"parameters": {"gradient": 0.1}}, r"synthetic\.tests\.0\.parameters: .*'gradient' is none"),
        ({"physical": {"gradient": 28.0}}, r"synthetic\.tests\.0\.physical: .*'gradient' is none"),
        ({"law": "coulomb+place", "physical": {"glue": 1.0}}, r"synthetic\.tests\.0\.physical: .*glue"),
        ({"parameters": {"beta": 0.3}}, r"synthetic\.tests\.0: parameters\.beta: .*friction_coefficient"),
        ({"physical": {"beta": 0.3}}, r"synthetic\.tests\.0: physical\.beta: .*friction_coefficient"),
        (PLACE | {"physical": {"gradient": 28.0}}, "gradient stands in parameters too, dimensionless: give one"),
        (
            {"law": "coulomb+compliance", "parameters": {"stiffness_ratio": 50.0}, "friction_scatter": 0.1},
            "remembers more than where the mass is",
        ),
    ],
)
def test_a_law_that_cannot_be_is_refused_with_its_place(test: Tables, fault: str) -> None:
    with pytest.raises(SceneError, match=fault):
        virtual_tests(scene_of(test))


def test_the_truth_is_what_sensors_show_also_where_the_wall_moves(tmp_path: Path) -> None:
    scene = scene_of({"normal_forces_n": [0.5]}).changed(model={"wall": "base"})
    list(synthesize(scene, tmp_path))
    (known,) = truths(tmp_path)
    (test,) = virtual_tests(scene)
    tau = np.linspace(0.0, 2 * math.pi, 100_001)
    orbit = present(steady_state(test.problem()).orbit)
    x, f = orbit.at(tau)[0], np.cos(tau)
    assert known["energy_per_cycle"] == pytest.approx(0.5 * np.sum((f[1:] + f[:-1]) * np.diff(x)), rel=1e-7)


def test_further_channels_are_those_of_the_motion_and_are_read_again(tmp_path: Path) -> None:
    """Force times way is the friction's work; velocity and acceleration integrate to the way."""
    rates = [f"{place}_{rate}" for place in ("mass", "base") for rate in ("velocity", "acceleration")]
    names = ["contact_force", "normal_force", *rates]
    still = {"channels": names, "channel_noise": 0.0, "noise_m": 0.0, "step_m": 0.0, "sampling_rate_hz": 2000.0}
    law: Tables = {"law": "coulomb+place", "parameters": {"gradient": 0.05}}
    (test,) = synthesize(scene_of(law, **still), tmp_path)
    log = read_log(tmp_path / test.log, LogOptions())
    assert set(log.measured()) == {"mass_displacement", "base_displacement", *names}
    whole = log.time < 30.0 / test.drive_frequency_hz
    work = np.trapezoid(log.contact_force[whole], log.mass_displacement[whole])
    taken = simulate(test.problem(), cycles=30).sums["contact"][0]
    assert work == pytest.approx(taken * 1200.0 * 1.8e-3**2, rel=2e-3)
    np.testing.assert_allclose(log.normal_force, 1.25)
    for place, tolerance in (("mass", 1e-2), ("base", 1e-5)):  # the mass's friction turns between two samples
        way, velocity, acceleration = (
            getattr(log, f"{place}_{kind}") for kind in ("displacement", "velocity", "acceleration")
        )
        for rate, of in ((velocity, way), (acceleration, velocity)):
            back = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(log.time))])
            assert np.abs(of - of[0] - back).max() < tolerance * np.abs(of).max()


def test_an_angle_over_a_radius_gives_the_coefficient_of_the_truth(tmp_path: Path) -> None:
    scene = scene_of(channels=["angle", "contact_force", "normal_force"], sampling_rate_hz=1000.0)
    with pytest.raises(SceneError, match=r"an angle needs \[rig\] radius_m"):
        log_of(virtual_tests(scene)[0], scene)
    turning = scene.model_copy(update={"rig": scene.rig.model_copy(update={"radius_m": 0.02})})
    (test,) = synthesize(turning, tmp_path)
    given = scene_from_tables({"rig": {"kind": "prescribed", "radius_m": 0.02}})
    m = measure(read_log(tmp_path / test.log, LogOptions()), given)
    assert abs(present(m.measured_friction_coefficient) - 0.5) < 2.0 * present(m.measured_friction_coefficient_u) < 0.01


def test_noise_of_a_further_channel_is_a_share_of_it() -> None:
    scenes = [scene_of(channels=["contact_force"], channel_noise=noise) for noise in (0.0, 0.02)]
    clean, noisy = (logged(scene)[:, 3] for scene in scenes)
    assert np.std(noisy - clean) == pytest.approx(0.02 * np.sqrt(np.mean(clean**2)), rel=0.05)


SCENE = read_scene(ROOT / "configs" / "sample_data.toml")
TRUTHS = truths(ROOT / "sample_data")


def test_the_folder_is_small_honest_and_of_all_regimes() -> None:
    assert sum(path.stat().st_size for path in (ROOT / "sample_data").iterdir()) < 6_000_000
    assert all(
        (ROOT / "sample_data" / row["log"]).read_text().startswith("# SYNTHETIC: simulated by") for row in TRUTHS
    )
    regimes = [
        (material, regime) for material in ("steel", "rubber", "aramid") for regime in ("continuous", "stick-slip")
    ]
    assert sorted((row["material"], row["regime"]) for row in TRUTHS) == sorted(regimes)


def test_one_make_target_makes_them(tmp_path: Path) -> None:
    assert "synthesize --scene configs/sample_data.toml -o sample_data" in (ROOT / "Makefile").read_text()
    invoke("synthesize", "--scene", ROOT / "configs" / "sample_data.toml", "-o", tmp_path, status=0)
    assert {made.name for made in tmp_path.iterdir()} == {*(row["log"] for row in TRUTHS), "truth.jsonl"}
    assert {path.name for path in (ROOT / "sample_data").glob("*.csv")} == {row["log"] for row in TRUTHS}
    for made in tmp_path.iterdir():
        assert made.read_bytes() == (ROOT / "sample_data" / made.name).read_bytes()


@pytest.mark.parametrize("known", TRUTHS, ids=lambda row: row["log"])
def test_what_was_put_in_comes_out(known: dict[str, float]) -> None:
    seen = compare(read_log(ROOT / "sample_data" / str(known["log"])), SCENE)
    assert seen.frequency_ratio == pytest.approx(known["frequency_ratio"], rel=1e-5)
    assert seen.energy_per_cycle == pytest.approx(known["energy_per_cycle"], rel=0.005)
    assert seen.response_amplitude == pytest.approx(known["response_amplitude"], rel=1e-3)
    assert seen.friction_ratio == pytest.approx(known["friction_ratio"], rel=0.02)
    assert seen.stops_per_cycle == pytest.approx(known["stops_per_cycle"], abs=0.05)
    assert seen.regime == str(known["regime"])
    assert seen.response_nrmse == pytest.approx(0, abs=0.01)
