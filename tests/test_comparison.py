"""Friction identified on recordings whose friction is known, for each kind of physics a scene can switch on."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal, cast
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import frictionlab as fl
from frictionlab import compare
from frictionlab.analysis.measurement import measure
from frictionlab.arrays import FloatArray, sampling_interval
from frictionlab.errors import AnalysisError, RecordingError, UsageError
from frictionlab.inference import ladder
from frictionlab.inference.fit import fit_from, followed
from frictionlab.inference.observations import observe
from frictionlab.inference.posterior import model_of
from frictionlab.inference.starts import point_at
from frictionlab.recording import Channel, LineCount, Quality, Recording, Source, SourceFile
from frictionlab.scene import Scene
from frictionlab.simulator import Base, Problem, steady_state
from frictionlab.verbs.inputs import failure
from tests.benchmarks.adversary import NAMES, NEUTRAL, _base, drawn, integrate, judge_decay
from tests.desk import present
from tests.inference.contacts import BASE_M, NATURAL_HZ, from_rest, recorded, scene

SOLVERS = ("exact", "thesis")


def seen(problem: Problem) -> Recording:
    """A steady orbit seen by two sensors."""
    return recorded(problem, np.random.default_rng(20261121), scatter=0.0, seconds=40.0, rate=500.0)


PHYSICS: dict[str, tuple[Problem, dict[str, Mapping[str, object]], str]] = {
    "damping": (Problem(0.4, 0.3, frame_damping_ratio=0.05), {"rig": {"damping_ratio": 0.05}}, "frame damping 0.05"),
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


def test_what_a_start_that_has_not_died_out_leaves_is_not_laid_to_the_law() -> None:
    """A contact that slides on takes nothing off its start: `--law auto` was asked for, of pure Coulomb friction."""
    turn, zeta = 2.0 * math.pi * NATURAL_HZ, 0.005

    def with_start(t: FloatArray, mass: FloatArray, base: FloatArray) -> tuple[FloatArray, FloatArray]:
        return mass + BASE_M * np.exp(-zeta * turn * t) * np.cos(turn * t), base

    contact = Problem(0.5, 0.1, frame_damping_ratio=zeta)
    log = recorded(contact, np.random.default_rng(3), scatter=0.0, sensors=with_start)
    said = " ".join(compare(log, scene(rig={"damping_ratio": zeta}, analysis={"transient_s": 10.0})).warnings)
    asked = re.search(r"start of the recording may still be in it.*: --transient ([0-9]+)", said)
    assert 40.0 < float(present(asked)[1]) < 120.0
    assert "--law auto" in said  # which it may be too


def test_a_start_that_is_still_in_the_cycles_is_not_taken_for_play() -> None:
    """Not settled, it asked for 20 um of play in a rig without, and on a ladder for friction that varies with place."""
    contact = Problem(0.4, 0.337, base=Base((1.0, 0.0, 0.08), (0.0, 0.0, -0.06)))
    log = recorded(contact, np.random.default_rng(3), scatter=0.0, seconds=40.0, sensors=from_rest(contact))
    rig, model = {"natural_frequency_hz_u": 0.001, "damping_ratio_u": 2e-4}, {"base_harmonics": 5}
    known = scene(rig=rig, model=model, analysis={"transient_s": 10.0})
    with patch.multiple(ladder, EXACT=("place",), SMOOTH=(), INNER=(), DEAR=()):
        found, climbed = compare(log, known), compare(log, known, law="auto")
    assert (found.verdict, climbed.law, climbed.verdict) == ("misfit", "coulomb", "misfit")
    assert not any(said.startswith("rig: ") for said in (*found.warnings, *climbed.warnings))
    assert any("start of the recording may still be in it" in said for said in found.warnings)


def test_a_frame_whose_damping_is_not_known_is_found_to_be_damped() -> None:
    problem, _, _ = PHYSICS["damping"]
    comparison = compare(seen(problem), scene(rig={"damping_ratio": None}))
    assert comparison.friction_ratio == pytest.approx(problem.beta, rel=0.01)
    assert comparison.nuisances["frame_damping_ratio"]["value"] == pytest.approx(0.05, rel=0.05)
    (said,) = (w for w in comparison.warnings if "moved the frame's damping by 0.05" in w)
    assert "(rig.damping_ratio = 0.0498 would fit: damping_ratio = 0.04985 and damping_ratio_u = " in said


def test_newtons_and_coefficient_follow_from_stiffness_and_normal_force() -> None:
    recording = seen(Problem(0.5, 0.4))
    known: dict[str, Mapping[str, object]] = {
        "rig": {"stiffness_n_per_m": 1000.0},
        "experiment": {"normal_force_n": 1.2},
    }
    comparison = compare(recording, scene(**known))
    assert comparison.friction_force_n == pytest.approx(0.4 * 1000.0 * BASE_M, rel=0.005)
    assert comparison.friction_coefficient == pytest.approx(0.6, rel=0.005)
    assert not any("no dry contact" in said for said in comparison.warnings)
    for force, wrong in ((0.002, "360"), (2000.0, "0.00036")):
        doubt = f"friction_coefficient: {wrong}: no dry contact has it: is the normal force {force:g} N?"
        doubted = compare(recording, scene(**{**known, "experiment": {"normal_force_n": force}})).warnings
        assert any(said.startswith(doubt) for said in doubted)
    unknown = compare(recording, scene())
    assert unknown.friction_force_n is None
    assert unknown.friction_coefficient is None


@pytest.mark.parametrize(
    ("copies", "said"), [(True, "mass: its channel repeats the base's"), (False, "one number, not")]
)
def test_a_comparison_that_fails_keeps_what_its_measurement_says(*, copies: bool, said: str) -> None:
    recording = seen(Problem(0.5, 0.4))
    base = recording.base_displacement
    broken = recording.changed(mass_displacement=base if copies else np.full(len(base), 0.2))
    with pytest.raises(AnalysisError, match="no friction ratio") as caught:
        compare(broken, scene())
    row = failure(Path("a.csv"), caught.value)
    assert [w for w in cast("list[str]", row["warnings"]) if said in w]


def test_a_given_friction_ratio_is_used_as_it_is() -> None:
    recording = seen(Problem(0.5, 0.4))
    comparison, thesis = (compare(recording, scene(model={"solver": s}), friction_ratio=0.2) for s in SOLVERS)
    assert comparison.model == "Coulomb friction, fixed wall, cosine base"
    assert comparison.friction_ratio == 0.2
    assert comparison.friction_ratio_se is None
    same = steady_state(Problem(present(comparison.frequency_ratio), 0.2))
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


@example(1.0, 1216, 0.0, 4)  # two places side by side
@given(st.floats(1e-5, 1.0), st.integers(10, 2000), st.floats(-1e3, 1e3), st.integers(0, 8))
def test_the_interval_is_that_of_the_clock_whatever_is_missing(step: float, n: int, start: float, lost: int) -> None:
    keep = np.sort(np.random.default_rng(n).permutation(np.arange(1, n - 1))[: n - 2 - min(lost, n // 4)])
    time = start + np.concatenate([[0], keep, [n - 1]]) * step
    assert sampling_interval(time) == pytest.approx(step, rel=1e-9 + 1e-12 * abs(start) / step)


@pytest.mark.parametrize("rate", [250.0, 300.0, 400.0, 600.0])
def test_stamps_of_whole_milliseconds_lose_no_sample_unseen(rate: float) -> None:
    """At 600 Hz the usual step is 2 ms, and a missing sample was one late stamp: an energy was 20 errors off."""
    time = np.delete(np.round(np.arange(20_000) / rate, 3), np.arange(100, 20_000, 500))
    assert 1.0 / sampling_interval(time) == pytest.approx(rate, rel=1e-7)


LAWS: Mapping[str, tuple[dict[str, float], dict[str, float]]] = {
    "coulomb": ({}, {}),
    "coulomb+place": ({"gradient": 0.06}, {"gradient": 0.06}),
    "coulomb+speed": ({"contact_damping": 0.05}, {"contact_damping_ratio": 0.05}),
    "coulomb+breakaway": ({"static_up": 1.2, "static_down": 1.1}, {"static_ratio_up": 1.2, "static_ratio_down": 1.1}),
    "coulomb+compliance": ({"contact_stiffness": 20.0}, {"stiffness_ratio": 20.0}),
}


@pytest.mark.parametrize("law", LAWS)
def test_amplitudes_are_those_of_the_exact_simulator(law: str) -> None:
    own, named = LAWS[law]
    r = 0.45
    p = np.array([{**NEUTRAL, "beta": 0.4, "frame_damping": 0.01, **own}[name] for name in NAMES])
    times = np.linspace(0.0, 30 * 2.0 * math.pi / r, 30 * 2000 + 1)
    x = integrate(times, p, np.array([[1.0, 0.0]]), r, 0.01)[-2000:]
    problem = Problem(r, 0.4, law=law, parameters=named, frame_damping_ratio=0.01)
    amplitude = present(steady_state(problem).response_amplitude)
    assert 0.5 * np.ptp(x) == pytest.approx(amplitude, rel=3e-6)  # the highest of 2000 samples a cycle


DRAWN = [  # seed, number and kind of a draw, the law asked for, stated errors, relative error that are allowed
    ((2026, 2), "coulomb+place", 3.0, 0.01),  # a cubic of 4.5 % at r = 0.13, met by place: 0.5 % off, 13 stated errors
    # a third harmonic of 0.08 % at r = 0.31 was left out: friction 2.7 % low, 5.9 stated errors, explained
    ((261128, 147), "coulomb+speed", 3.0, 1.0),
    ((261129, 142), "coulomb+speed", 2.0, 0.003),  # a cubic between 51 samples a cycle took of harmonics: 3.3 errors
    # break-away of 1.07 and 1.28 moves the mean by 0.016 Y: a cubic of -2.9 % was seen as -0.7 %, 4 errors
    ((261128, 380), "coulomb+breakaway", 2.0, 0.005),
    ((271103, 120), "coulomb+compliance", 2.0, 0.003),  # the sixth of its valleys is the one it rings in: 3.3 errors
    ((261128, 172), "auto", 3.0, 1.0),  # friction falls with speed and nothing stops: 3.3 errors
    ((271102, 54), "auto", 3.0, 0.02),  # friction falls with speed, taken for place: 3.4 errors
    ((261128, 385), "coulomb+compliance", 3.0, 1.0),  # play of 15 um, its force blurred: 6.2 stated errors
    ((77, 169), "auto", 2.0, 0.003),  # friction falls with speed at r = 0.16, taken for break-away: 2.7 stated errors
    # three harmonics hold no frequency that is 9 % off: it bent the law, 32 % off, 4.4 stated errors
    ((3003, 2, "frequency"), "auto", 3.0, 1.0),
    ((281127, 262), "auto", 1.5, 1.0),  # a contact that yields at r = 0.12 was not tried: 3.6 stated errors
    ((271127, 169), "coulomb+compliance", 1.0, 0.002),  # it rings 66 times a cycle: the next valley, 4.3 errors
    ((927003, 70), "coulomb", 1.0, 0.002),  # a gain 0.2 % off at r = 0.16: begun at a lag that is none, 3.6 errors
    ((9512, 21), "coulomb+speed", 1.5, 0.06),  # 12.5 um of play pulled the frequency: 2.4 % off, an error of 0.55 %
]


@pytest.mark.parametrize(("number", "law", "errors", "share"), DRAWN)
def test_what_misled_the_identification_once_is_in_its_error(
    number: tuple[int, int], law: str, errors: float, share: float
) -> None:
    draw = drawn(*number)
    found, beta = fl.compare(draw.recording(), draw.scene(), law=law), draw.values["beta"]
    assert found.friction_ratio == pytest.approx(beta, abs=errors * present(found.friction_ratio_u))
    assert found.friction_ratio == pytest.approx(beta, rel=share)
    others = any("does not distinguish" in said for said in found.warnings)  # laws as likely, of another friction ratio
    assert present(found.friction_ratio_u) < 0.04 * beta or share == 1.0 or others
    assert number != (77, 169) or found.law == "coulomb+stribeck"


@pytest.mark.parametrize("fit", ["cycle", "whole"])
def test_play_that_friction_cannot_be_told_from_is_said(fit: Literal["cycle", "whole"]) -> None:
    """7 um of play at r = 0.12: the ratio is off by the play over Y, 70 stated errors, and nothing shows it."""
    found = fl.compare((draw := drawn(2026, 10)).recording(), draw.scene(), law="coulomb+place+speed", fit=fit)
    assert found.friction_ratio - draw.values["beta"] == pytest.approx(draw.values["play"], rel=0.05)
    assert any("10 um of play to either side would look like friction" in s for s in found.warnings)


def test_a_normal_force_that_follows_the_base_is_named_with_its_value() -> None:
    """12 % of it at r = 0.73: friction that varies with place left 25 times the noise, and no cause was named."""
    found = fl.compare((draw := drawn(261127, 20, "load by base")).recording(), draw.scene(), law="coulomb+place")
    said = [w for w in found.warnings if "normal force that follows the base's acceleration" in w]
    asked = [float(w.split("asks for ")[1].split()[0]) for w in said]
    assert asked == pytest.approx([100.0 * draw.values["load_by_base"]], rel=0.1)


def test_a_normal_force_that_is_measured_counts_as_it_is_at_each_moment() -> None:
    """Its mean alone counted, with a misfit or a wrong ratio and no word; under a mass that stands it was a fault."""
    made = (draw := drawn(261127, 20, "load by base")).recording()
    tau = 2.0 * math.pi * NATURAL_HZ * made.time
    acceleration = np.array([_base(t, draw.base, draw.r)[2] for t in tau.tolist()]) / draw.r**2
    pressed = Channel("normal_force", 4.0 * (1.0 + draw.values["load_by_base"] * acceleration))
    found = fl.compare(made.changed(normal_force=pressed), draw.scene(), law="coulomb+place")
    assert found.verdict == "explained"
    assert "momentary normal force" in found.model
    assert found.friction_ratio == pytest.approx(draw.values["beta"], abs=2.0 * present(found.friction_ratio_u))
    assert present(found.friction_ratio_u) < 0.01 * draw.values["beta"]
    whole = fl.compare(made.changed(normal_force=pressed), draw.scene(), law="coulomb", fit="whole")
    assert any("normal force varies by up to 12 % within the cycle" in said for said in whole.warnings)
    assert present(whole.friction_ratio_u) > 0.12 * present(whole.friction_ratio)
    still = made.changed(mass_displacement=np.zeros(len(tau)), normal_force=pressed)
    with pytest.raises(AnalysisError, match="the mass stands still"):
        fl.compare(still, draw.scene())


def test_a_descent_that_ended_at_its_steps_is_followed_to_the_minimum() -> None:
    """A curved valley takes more steps than a descent is allowed; errors stated before its end are no errors."""
    draw = drawn(77, 169)
    observation = observe(measure(draw.recording(), draw.scene()), draw.scene(), "coulomb+place+breakaway")
    model, start = model_of([observation]), {"beta": 0.5, "static_ratio_up": 1.2, "static_ratio_down": 1.2}
    ended = fit_from(replace(model, most=4), [point_at(model, start)], tempers=False)
    whole = fit_from(model, [ended.point], tempers=False)
    assert followed(ended).cost == pytest.approx(whole.cost, rel=1e-6)
    assert whole.cost < 0.9 * ended.cost


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(31, id="a period guessed 1 per cent off led 150 half-cycles astray: no damping, 0.5 um for 2"),
        pytest.param(111, id="20 um of hum in a long rest stood above the motion and was not taken out"),
        pytest.param(126, id="hum at 66 samples a second shows at 16 Hz"),
    ],
)
def test_a_free_decay_with_hum_is_what_it_is_without(number: int) -> None:
    _, worst, off, _ = judge_decay(502, number)
    assert worst != "refused"
    assert abs(off) < 3.0


def test_a_law_that_explains_a_record_too_is_named_though_it_is_not_required() -> None:
    """Said was that no law tried explains it: break-away, by which it was made, leaves a fifth of Coulomb's misfit."""
    found = fl.compare((draw := drawn(9512, 31)).recording(), draw.scene(), law="auto")
    assert found.verdict == "misfit"
    (said,) = (w for w in found.warnings if w.startswith("verdict: "))
    assert "coulomb+breakaway would, but the evidence does not require so much" in said
