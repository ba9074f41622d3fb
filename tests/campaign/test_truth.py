"""The virtual rig's truth about changing friction, held against measurements without noise."""

import json
from pathlib import Path

import pytest

from frictionlab.analysis.measurement import measure
from frictionlab.logs import read_log
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.simulator import Problem, steady_state
from frictionlab.synthetic import synthesize, virtual_tests


def scene_of(**behaviour: float) -> Scene:
    test = {"material": "steel", "normal_forces_n": [1.25], "frequency_ratios": [0.4], "friction_coefficient": 0.6}
    return scene_from_tables(
        {
            "rig": {"mass_kg": 3.0799, "stiffness_n_per_m": 1191.0},
            "analysis": {"transient_s": 5.0},
            "synthetic": {"duration_s": 25.0, "noise_m": 0.0, "step_m": 1e-9, "tests": [{**test, **behaviour}]},
        }
    )


def truth_of(scene: Scene, folder: Path) -> dict[str, float]:
    list(synthesize(scene, folder))
    (line,) = (folder / "truth.jsonl").read_text().splitlines()
    found: dict[str, float] = json.loads(line)
    return found


def test_the_true_irregularity_is_what_a_sensor_without_noise_measures(tmp_path: Path) -> None:
    scene = scene_of(friction_scatter=0.08)
    known = truth_of(scene, tmp_path)
    recording = read_log(tmp_path / str(known["log"]), None)
    assert measure(recording, scene).irregularity_index == pytest.approx(known["irregularity_index"], rel=0.01)


def test_the_true_slope_is_that_of_the_steady_energy(tmp_path: Path) -> None:
    scene = scene_of(friction_drift_per_hour=0.5)
    known = truth_of(scene, tmp_path)
    beta = virtual_tests(scene)[0].friction_ratio
    before, after = (steady_state(Problem(0.4, beta * (1 + 0.5 * t / 3600))).energy_per_cycle for t in (5.0, 25.0))
    assert before is not None
    assert after is not None
    assert known["energy_slope_per_hour"] == pytest.approx((after - before) / 20 * 3600, rel=1e-9)


def test_plain_coulomb_says_nothing_more_and_a_jump_has_no_slope(tmp_path: Path) -> None:
    assert "irregularity_index" not in truth_of(scene_of(), tmp_path)
    assert truth_of(scene_of(jump_s=10.0, jump_factor=0.5), tmp_path)["energy_slope_per_hour"] is None
