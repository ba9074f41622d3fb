"""Friction identified on recordings whose friction is known, for each kind of physics a scene can switch on."""

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab import compare
from frictionlab.errors import AnalysisError, RecordingError, UsageError
from frictionlab.recording import LineCount, Quality, Recording, Source, SourceFile
from frictionlab.sampling import sampling_interval
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


T = np.arange(100, dtype=np.float64) * np.float64(0.01)
X = np.sin(T)
FIFTH = np.arange(100) == 5


def test_arrays_cannot_be_changed() -> None:
    own = X.copy()
    recording = Recording(T, own, own, experiment={"material": "steel"})
    own[5] = np.nan
    np.testing.assert_array_equal(recording.mass_displacement, X)
    assert recording == recording and {recording: 1}  # noqa: PT018, PLR0124 - by identity: arrays have no single answer
    with pytest.raises(ValueError, match="read-only"):
        recording.time[0] = 1.0
    with pytest.raises(TypeError, match="does not support item assignment"):
        recording.experiment["material"] = "rubber"  # type: ignore[index] # that it is refused is the test


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ((T, X[:-1], X), "expected arrays of one length"),
        ((T[:1], X[:1], X[:1]), "at least 2 samples"),
        ((T[::-1], X, X), "expected increasing stamps"),
        ((np.where(FIFTH, T[4], T), X, X), "expected increasing stamps; got 0.04 then 0.04 at sample 5"),
        ((np.where(FIFTH, np.nan, T), X, X), "expected finite stamps"),
        ((np.append(T[:-1], np.inf), X, X), "expected finite stamps"),
        ((np.append(T[:-2], [np.inf, np.inf]), X, X), "expected finite stamps"),
        ((T, np.where(FIFTH, np.nan, X), X), "mass_displacement: expected finite values; got nan unflagged"),
        ((T, X, np.where(FIFTH, np.inf, X)), "base_displacement: expected finite values; got inf unflagged"),
        ((T, np.where(FIFTH, 1e12, X), X), "mass_displacement: expected metres; got 1e"),
        ((T, np.where(FIFTH, -1e300, X), X), "mass_displacement: .*another unit"),
        ((np.append(T[:-1], 1e300), X, X), "time: expected seconds; got 1e"),
        ((T, X.reshape(10, 10), X), "expected one dimension"),
        ((T, X, X, [300] * 100), "quality: expected whole numbers from 0 to 255"),
    ],
)
def test_what_breaks_the_rules_is_refused(arrays: tuple[np.ndarray, ...], words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        Recording(*arrays)  # type: ignore[arg-type] # three arrays and the quality


def test_lines_must_add_up() -> None:
    with pytest.raises(RecordingError, match="do not add up: expected 3 in all"):
        LineCount(read=3, data=1, header=1)
    files = (SourceFile("a", lines=LineCount(read=2, data=2)), SourceFile("b", lines=LineCount(read=1, header=1)))
    assert Source(files).lines == LineCount(read=3, data=2, header=1)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 99), st.sampled_from(list(Quality))), max_size=12))
def test_stretches_hold_what_is_sound_and_never_cross_a_hole(damage: list[tuple[int, Quality]]) -> None:
    """Compared with the slow and obvious way: walk from sample to sample."""
    quality, x, t = np.zeros(100, np.uint8), X.copy(), T.copy()
    for i, flag in damage:
        quality[i] |= flag.value
        if flag is Quality.NOT_BRIDGED and i % 2:
            x[i] = np.nan
        if flag is Quality.DUPLICATED and i:
            t[i] = t[i - 1]
    repeated = np.flatnonzero(np.diff(t) < 0)
    if len(repeated):
        return
    expected: list[list[int]] = [[]]
    for i in range(100):
        if quality[i] & Quality.NOT_BRIDGED or quality[i] & Quality.HELD or np.isnan(x[i]):
            expected.append([])
        if quality[i] & Quality.HELD or np.isnan(x[i]) or quality[i] & Quality.DUPLICATED:
            continue
        expected[-1].append(i)
    parts = Recording(t, x, X, quality).stretches()
    assert [part.mass_displacement.tolist() for part in parts] == [x[p].tolist() for p in expected if len(p) > 1]
    for part in parts:
        assert np.diff(part.time).min() > 0
        assert part.stretches() == (part,) or len(part.stretches()) == 1


@given(st.floats(1e-5, 1.0), st.integers(10, 2000), st.floats(-1e3, 1e3), st.integers(0, 8))
def test_the_interval_is_that_of_the_clock_whatever_is_missing(step: float, n: int, start: float, lost: int) -> None:
    keep = np.sort(np.random.default_rng(n).permutation(np.arange(1, n - 1))[: n - 2 - min(lost, n // 4)])
    time = start + np.concatenate([[0], keep, [n - 1]]) * step
    assert sampling_interval(time) == pytest.approx(step, rel=1e-9 + 1e-12 * abs(start) / step)
