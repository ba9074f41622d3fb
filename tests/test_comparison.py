"""Friction identified on recordings whose friction is known, for each kind of physics a scene can switch on."""

from collections.abc import Mapping

import numpy as np
import pytest

from frictionlab import compare
from frictionlab.errors import AnalysisError, UsageError
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem, steady_state
from tests.inference.contacts import BASE_M, recorded, scene

SOLVERS = ("exact", "thesis")


def seen(problem: Problem) -> Recording:
    """A steady orbit seen by two sensors."""
    return recorded(problem, np.random.default_rng(20261121), scatter=0.0, seconds=40.0, rate=500.0)


PHYSICS: dict[str, tuple[Problem, dict[str, Mapping[str, object]], str]] = {
    "damping": (
        Problem(0.4, 0.3, frame_damping_ratio=0.05),
        {"rig": {"damping_ratio": 0.05}},
        "frame damping 0.05",
    ),
    "static friction": (Problem(0.4, 0.3, mu=1.4), {"model": {"static_ratio": 1.4}}, "static ratio 1.4"),
    "moving wall": (Problem(0.7, 0.3, wall="base"), {"model": {"wall": "base"}}, "base wall"),
}


@pytest.mark.parametrize("name", PHYSICS)
def test_each_physics_that_a_scene_names_is_simulated_and_said(name: str) -> None:
    problem, tables, words = PHYSICS[name]
    comparison = compare(seen(problem), scene(**tables))
    assert words in comparison.model
    assert comparison.friction_ratio == pytest.approx(problem.beta, rel=0.01)
    assert comparison.response_nrmse == pytest.approx(0, abs=0.01)
    assert comparison.energy_difference == pytest.approx(0, abs=0.01)


def test_a_frame_whose_damping_is_not_known_is_found_to_be_damped() -> None:
    problem, _, _ = PHYSICS["damping"]
    comparison = compare(seen(problem), scene(rig={"damping_ratio": None}))
    assert comparison.friction_ratio == pytest.approx(problem.beta, rel=0.01)
    assert comparison.nuisances["frame_damping_ratio"]["value"] == pytest.approx(0.05, rel=0.05)
    (said,) = (w for w in comparison.warnings if "moved the frame's damping by 0.05" in w)
    assert "(rig.damping_ratio = 0.0499 would fit: damping_ratio = 0.04985 and damping_ratio_u = " in said


def test_newtons_and_coefficient_follow_from_stiffness_and_normal_force() -> None:
    recording = seen(Problem(0.5, 0.4))
    known: dict[str, Mapping[str, object]] = {
        "rig": {"stiffness_n_per_m": 1000.0},
        "experiment": {"normal_force_n": 1.2},
    }
    comparison = compare(recording, scene(**known))
    assert comparison.friction_force_n == pytest.approx(0.4 * 1000.0 * BASE_M, rel=0.005)
    assert comparison.friction_coefficient == pytest.approx(0.6, rel=0.005)
    unknown = compare(recording, scene())
    assert unknown.friction_force_n is None
    assert unknown.friction_coefficient is None


def test_a_given_friction_ratio_is_used_as_it_is() -> None:
    recording = seen(Problem(0.5, 0.4))
    comparison, thesis = (compare(recording, scene(model={"solver": s}), friction_ratio=0.2) for s in SOLVERS)
    assert comparison.model == "Coulomb friction, fixed wall, cosine base"
    assert comparison.friction_ratio == 0.2
    assert comparison.friction_ratio_se is None
    assert comparison.frequency_ratio is not None
    same = steady_state(Problem(comparison.frequency_ratio, 0.2))
    assert comparison.predicted_energy_per_cycle == same.energy_per_cycle
    assert (comparison.solver, thesis.solver) == SOLVERS
    assert thesis.predicted_energy_per_cycle == pytest.approx(same.energy_per_cycle, rel=1e-2)
    stuck = compare(recording, scene(), friction_ratio=1.5)
    assert (stuck.predicted_regime, stuck.predicted_energy_per_cycle) == ("stuck", 0)
    with pytest.raises(UsageError, match=r"friction ratio: expected a number of at least 0; got -0\.1"):
        compare(recording, scene(), friction_ratio=-0.1)
    with pytest.raises(AnalysisError, match=r"give rig\.natural_frequency_hz"):
        compare(recording, Scene())
