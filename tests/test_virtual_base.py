"""The virtual base: sweeps, random motion, recorded motion, a motor that starts up and hunts; and what then is true."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import frictionlab as fl
from frictionlab.errors import SceneError
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.simulator import Problem
from frictionlab.synthetic import cycle_friction_ratios, driven, log_of, synthesize, virtual_tests
from frictionlab.synthetic.virtual_motion import base_motion, random_motion, wander

Tables = dict[str, object]
FN = math.sqrt(1200.0 / 3.0) / (2 * math.pi)
CONFIGS = Path(__file__).parents[1] / "configs"


def scene_of(base: Tables, test: Tables | None = None, folder: Path = Path(), **synthetic: object) -> Scene:
    group = {"material": "steel", "normal_forces_n": [1.25], "friction_coefficient": 0.5, "base": "b", **(test or {})}
    rig = {"mass_kg": 3.0, "stiffness_n_per_m": 1200.0, "damping_ratio": 0.01}
    tables = {"duration_s": 12.0, "tests": [group], "bases": [{"name": "b", **base}], **synthetic}
    return scene_from_tables({"rig": rig, "synthetic": tables}, folder=folder)


def samples(text: str) -> np.ndarray:
    return np.array([[float(x) for x in line.split(",")] for line in text.splitlines()[3:]])


SWEEP: Tables = {"motion": "sweep", "sweep_hz": [1.0, 4.0]}
RANDOM: Tables = {"motion": "random", "band_hz": [0.5, 4.0], "ramp_s": 1.0}
MOTOR: Tables = {"ramp_s": 2.0, "amplitude_wander": 0.05, "frequency_wander": 0.01}
SINE: Tables = {"frequency_ratios": [0.5]}


@pytest.mark.parametrize(
    ("base", "test"),
    [
        (SWEEP | {"ramp_s": 1.0}, {}),
        (RANDOM, {"law": "coulomb+place+speed", "parameters": {"gradient": 0.05, "contact_damping_ratio": 0.03}}),
        (MOTOR, SINE),
        (MOTOR, SINE | {"law": "coulomb+stribeck", "parameters": {"static_ratio": 1.3, "stribeck_speed": 0.3}}),
    ],
)
def test_the_mass_is_what_the_simulator_makes_of_the_logs_base(base: Tables, test: Tables, tmp_path: Path) -> None:
    """Round trip through the log's text (1 nm): its base column drives, its mass column comes out."""
    scene = scene_of(base, test, noise_m=0.0, step_m=0.0)
    (virtual,) = synthesize(scene, tmp_path)
    log = samples((tmp_path / virtual.log).read_text())
    problem = virtual.problem().in_frame_time()
    largest = float(np.abs(log[:, 2] - log[0, 2]).max())
    shifted = problem.with_parameters({"beta": problem.beta * 1.8 / largest})
    answer = fl.respond(tmp_path / virtual.log, _rescaled(shifted, 1.8 / largest), natural_frequency_hz=FN)
    assert 1e3 * answer.recording.mass_displacement == pytest.approx(log[:, 1], abs=2e-5)
    (truth,) = map(json.loads, (tmp_path / "truth.jsonl").read_text().splitlines())
    assert truth["total_energy_j"] == pytest.approx(answer.response.energy * 1200.0 * (1e-3 * largest) ** 2, rel=1e-4)
    assert truth["base_largest_m"] == pytest.approx(1e-3 * float(np.abs(log[:, 2]).max()), rel=1e-3)
    assert truth["total_stops"] == answer.response.stops


def _rescaled(problem: Problem, share: float) -> Problem:
    """What the law says of lengths and speeds, over a Y that is 1 / share as large."""
    own = {"gradient": 1 / share, "stribeck_speed": share}
    return problem.with_parameters({n: v * own[n] for n, v in problem.parameters.items() if n in own})


def test_a_sweep_goes_from_its_first_frequency_to_its_last() -> None:
    for scale, middle in (("linear", 2.5), ("log", 2.0)):
        scene = scene_of(SWEEP | {"sweep_scale": scale}, noise_m=0.0, step_m=0.0)
        base = samples(log_of(virtual_tests(scene)[0], scene)[0])[:, 2]
        up = np.flatnonzero((base[:-1] < 0.0) & (base[1:] >= 0.0)) / 250.0
        rate = np.interp([0.5, 6.0, 11.5], 0.5 * (up[1:] + up[:-1]), 1.0 / np.diff(up))
        assert rate[1] == pytest.approx(middle, rel=0.02)
        assert rate[0] < 1.3
        assert rate[2] > 3.7


def test_random_motion_has_the_power_it_is_given_and_none_beyond() -> None:
    table = [[0.5, 0.0], [1.0, 2e-6], [3.0, 1e-6]]
    scene = scene_of({"motion": "random", "spectrum": table})
    base = base_motion(virtual_tests(scene)[0], scene, np.arange(100_000) / 250.0)
    assert np.std(base) == pytest.approx(math.sqrt(0.5 * 0.5 * 2e-6 + 2.0 * 1.5e-6), rel=0.05)
    power = np.abs(np.fft.rfft(base * np.hanning(len(base)))) ** 2
    f = np.fft.rfftfreq(len(base), 1 / 250.0)
    assert power[(f < 0.45) | (f > 3.1)].sum() < 1e-5 * power.sum()
    assert power[(f > 1.0) & (f < 2.0)].sum() / power[(f > 2.0) & (f < 3.0)].sum() == pytest.approx(
        1.75 / 1.25, rel=0.15
    )


def test_a_wandering_amplitude_forgets_itself_after_its_correlation_time() -> None:
    steps = np.array([wander(4000, 0.1, 0.02, 3.0, np.random.default_rng(seed)) for seed in range(20)])
    assert np.sqrt(np.mean(steps**2)) == pytest.approx(0.02, rel=0.05)
    for lag, left in ((30, math.exp(-1.0)), (60, math.exp(-4.0))):
        assert np.mean(steps[:, :-lag] * steps[:, lag:]) / np.mean(steps**2) == pytest.approx(left, abs=0.05)
    white = random_motion(50_000, 0.01, lambda f: np.where(f > 0.0, 0.02, 0.0), np.random.default_rng(3))
    assert np.std(white) == pytest.approx(1.0, rel=0.02)


def test_a_recorded_base_moves_again_and_a_short_one_is_refused(tmp_path: Path) -> None:
    t = np.arange(2001) / 100.0
    y = 5.0 + 2.0 * np.sin(2 * np.pi * 0.7 * t) ** 3
    rows = [f"{a:.6f},{b:.6f}" for a, b in zip(t, y, strict=True)]
    (tmp_path / "seen.csv").write_text("\n".join(["time [s],q", *rows]) + "\n")
    base: Tables = {"motion": "file", "file": "seen.csv", "column": "q", "unit": "mm", "factor": 0.5}
    scene = scene_of(base, folder=tmp_path, noise_m=0.0, step_m=0.0)
    log = samples(log_of(virtual_tests(scene)[0], scene)[0])
    assert log[:, 2] == pytest.approx(np.sin(2 * np.pi * 0.7 * log[:, 0]) ** 3, abs=2e-5)
    long = scene_of(base, {"duration_s": 30.0}, folder=tmp_path)
    with pytest.raises(SceneError, match=r"b: .*seen.csv lasts 20 s; expected at least the 29.996 s of steel_N1.25_b"):
        log_of(virtual_tests(long)[0], long)[0]
    lost = scene_of(base | {"file": "nothing.csv"}, folder=tmp_path)
    with pytest.raises(SceneError, match=r"synthetic.bases: b: .*nothing.csv"):
        log_of(virtual_tests(lost)[0], lost)[0]


def test_wandering_friction_is_told_period_by_period(tmp_path: Path) -> None:
    changing = {"friction_wander": 0.1, "friction_wander_s": 4.0}
    for base, test in ((MOTOR, SINE), ({}, SINE)):
        scene = scene_of(base, test | changing, duration_s=40.0)
        list(synthesize(scene, tmp_path))
        (truth,) = map(json.loads, (tmp_path / "truth.jsonl").read_text().splitlines())
        ratios = np.array(truth["friction_ratio_of_cycles"])
        assert ratios == pytest.approx(cycle_friction_ratios(virtual_tests(scene)[0], scene), rel=1e-7)
        assert 0.03 < np.std(ratios) / truth["friction_ratio"] < 0.2
        assert len(ratios) == math.ceil(40.0 * 0.5 * FN)


def test_a_motor_that_has_started_up_reaches_the_plain_sines_orbit() -> None:
    scene = scene_of({"ramp_s": 1.0}, SINE | {"frequency_ratios": [0.4]}, duration_s=40.0, noise_m=0.0, step_m=0.0)
    run = driven(virtual_tests(scene)[0], scene)
    plain = scene_of({}, {"frequency_ratios": [0.4]}, duration_s=40.0, noise_m=0.0, step_m=0.0)
    steady = samples(log_of(virtual_tests(plain)[0], plain)[0])[:, 1]
    assert 1.8 * run.displacement[:: run.every][-500:] == pytest.approx(steady[-500:], abs=1e-6)


@pytest.mark.parametrize(
    ("base", "test", "match"),
    [
        ({"motion": "sweep"}, {}, "motion = 'sweep' needs sweep_hz"),
        ({"motion": "random"}, {}, "needs band_hz or spectrum, one of them; got none"),
        ({"band_hz": [1.0, 2.0]}, SINE, "band_hz belongs to motion = 'random'; got motion = 'sine'"),
        ({"motion": "random", "band_hz": [2.0, 1.0]}, {}, "the lowest frequency first"),
        ({"motion": "random", "spectrum": [[1.0, 1.0], [1.0, 2.0]]}, {}, "frequencies that increase"),
        ({"motion": "random", "spectrum": [[1.0, 0.0], [2.0, 0.0]]}, {}, "a density above 0"),
        (SWEEP, SINE, "has its own frequencies: leave them out"),
        ({}, {}, "expected at least one: a sine moves at them"),
        (SWEEP, {"base": "c"}, r"expected a name in \[\[synthetic.bases\]\] \(b\); got 'c'"),
    ],
)
def test_what_makes_no_sense_is_refused(base: Tables, test: Tables, match: str) -> None:
    with pytest.raises(SceneError, match=match):
        scene_of(base, test)


def test_what_only_a_plain_sine_has_is_refused() -> None:
    scene = scene_of(SWEEP, start="steady")
    with pytest.raises(SceneError, match="start = 'steady' needs a plain sine; got base 'b'"):
        log_of(virtual_tests(scene)[0], scene)[0]


def test_the_scene_beside_this_works(tmp_path: Path) -> None:
    scene = fl.read_scene(CONFIGS / "base_motions.toml").changed(synthetic={"duration_s": 5.0})
    names = [test.log for test in synthesize(scene, tmp_path)]
    assert names == [
        *("steel_N1.25_r0.4_motor.csv", "steel_N1.25_sweep.csv", "rubber_N1.25_random.csv", "steel_N1.25_recorded.csv")
    ]
    truths = [json.loads(line) for line in (tmp_path / "truth.jsonl").read_text().splitlines()]
    assert [truth["base"]["motion"] for truth in truths] == ["sine", "sweep", "random", "file"]
    assert truths[0]["energy_per_cycle"] > 0.0
    assert "energy_per_cycle" not in truths[1]
