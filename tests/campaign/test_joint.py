"""Many tests fitted together: one solution, the scatter from test to test, and one test alone as if it were alone."""

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from frictionlab.analysis.measure import measure
from frictionlab.campaign import Cycle, cycle_of
from frictionlab.campaign.joined import join
from frictionlab.campaign.mixed import Mixed, Piece
from frictionlab.campaign.required import climb_together
from frictionlab.campaign.scores import Stated
from frictionlab.campaign.shared import Place, Shared
from frictionlab.campaign.spread import spread_of
from frictionlab.hdf5 import write_recording
from frictionlab.identification import compare
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.laws import law_of
from frictionlab.verbs.evaluate import evaluate
from tests.campaign.recorded import steady_recording

FloatArray = NDArray[np.float64]
UNKNOWN, SHARED = 4, 3  # of a made-up test: friction, a gain, what is its own, another law's parameter


def made_up(
    count: int, *, scatter: float = 0.0, uneven: float = 0.0, noise: float = 0.05, seed: int = 1
) -> tuple[list[Piece], FloatArray]:
    """Tests that are linear in their unknowns, and the shared ones that made them."""
    generator = np.random.default_rng(seed)
    truth = generator.standard_normal(SHARED)
    pieces = []
    for _ in range(count):
        scale = np.zeros((UNKNOWN, SHARED))
        scale[0, 0] = scale[1, 1] = 1.0
        scale[3, 2] = 1.0 + 0.2 * generator.standard_normal()
        place = Place(scale, np.array([0.3, 0.0, 0.0, 0.1]), np.array([2]), 0)
        own = scale @ truth + place.offset + np.array([scatter * generator.standard_normal(), 0.0, 0.0, 0.0])
        own[2] += generator.standard_normal()
        own[3] += uneven * generator.standard_normal() if uneven else 0.0
        slopes = generator.standard_normal((12, UNKNOWN)) / noise
        data = slopes @ own + generator.standard_normal(12)
        level = -0.5 * float(data @ data)
        pieces.append(Piece(slopes.T @ slopes, slopes.T @ data, place, level))
    return pieces, truth


def dense(pieces: Sequence[Piece], tau: float) -> tuple[FloatArray, FloatArray]:
    """The same as one system of all unknowns: shared, then own and scatter of each test; the slow twin."""
    size = SHARED + 2 * len(pieces)
    precision, score = np.eye(size), np.zeros(size)
    for i, piece in enumerate(pieces):
        basis = np.zeros((UNKNOWN, size))
        basis[:, :SHARED] = piece.place.scale
        basis[2, SHARED + 2 * i] = 1.0
        basis[0, SHARED + 2 * i + 1] = tau
        precision += basis.T @ piece.information @ basis
        score += basis.T @ (piece.score - piece.information @ piece.place.offset)
    return precision, score


FREE = np.full(SHARED, -np.inf)


@pytest.mark.parametrize("tau", [0.0, 0.3])
def test_what_is_a_tests_own_can_be_integrated_out(tau: float) -> None:
    pieces, _ = made_up(5)
    found = Mixed(pieces, FREE).solve(tau)
    precision, score = dense(pieces, tau)
    best = np.linalg.solve(precision, score)
    assert found.point == pytest.approx(best[:SHARED], rel=1e-10)
    assert np.linalg.inv(found.precision) == pytest.approx(np.linalg.inv(precision)[:SHARED, :SHARED], rel=1e-8)
    assert found.beyond == pytest.approx(tau * best[SHARED + 1 :: 2], rel=1e-8)
    assert found.volume == pytest.approx(0.5 * np.linalg.slogdet(precision)[1], rel=1e-10)
    likelihood = 0.5 * score @ best - found.volume
    assert Mixed(pieces, FREE).log_likelihood(tau) == pytest.approx(likelihood, rel=1e-10)


def test_a_test_left_out_is_predicted_by_the_others_as_the_likelihoods_say() -> None:
    pieces, _ = made_up(4)
    all_of, rest = (Mixed(some, FREE).log_likelihood(0.2) for some in (pieces, pieces[1:]))
    constant = pieces[0].constant
    predicted = Mixed(pieces, FREE).left_out(0.2, [np.array([0])])[0]
    assert predicted == pytest.approx(all_of - rest + constant, rel=1e-9)


def test_the_scatter_from_test_to_test_is_found() -> None:
    found = [Mixed(made_up(60, scatter=0.2, seed=seed)[0], FREE).solve().scatter for seed in range(6)]
    assert np.mean(found) == pytest.approx(0.2, rel=0.1)
    assert Mixed(made_up(1)[0], FREE).solve().scatter == 0.0


def test_stated_errors_hold_what_the_tests_scatter_by() -> None:
    """Rms of error over stated error, of 200 campaigns of 12 tests."""
    off = []
    for seed in range(200):
        pieces, truth = made_up(12, scatter=0.2, seed=seed)
        found = Mixed(pieces, FREE).solve()
        spread = spread_of(found, pieces, [Stated(piece.information) for piece in pieces])
        error = np.sqrt(np.diag(spread.noise + spread.scatter + spread.own + spread.prior @ spread.prior.T))
        off.append((found.point - truth) / error)
    assert np.sqrt(np.mean(np.square(off), axis=0)) == pytest.approx(np.ones(SHARED), abs=0.15)


def test_an_unknown_is_held_at_its_bound() -> None:
    pieces, truth = made_up(5)
    low = np.array([-np.inf, truth[1] + 1.0, -np.inf])
    found = Mixed(pieces, low).solve(0.1)
    assert found.point[1] == low[1]
    precision, score = dense(pieces, 0.1)
    free = np.array([i for i in range(len(score)) if i != 1])
    best = np.linalg.solve(precision[np.ix_(free, free)], score[free] - precision[free, 1] * low[1])
    assert found.point[[0, 2]] == pytest.approx(best[:2], rel=1e-9)


@pytest.mark.parametrize("law", [None, "auto"])
def test_a_campaign_of_one_test_says_what_a_single_comparison_says(
    scene: Scene, tmp_path: Path, law: str | None
) -> None:
    recording = steady_recording()
    write_recording(recording, tmp_path / "a.h5")
    row = {**measure(recording, scene).row(), "source": "a.h5", "material": "steel", "normal_force_n": 1.5}
    (together,) = evaluate([row], scene, folders=[tmp_path], law=law).fits
    alone = compare(recording, scene, law=law)
    assert together.law == alone.law
    assert together.friction_ratio == pytest.approx(alone.friction_ratio, rel=1e-9)
    assert together.friction_ratio_se == pytest.approx(alone.friction_ratio_se, rel=1e-6)
    assert together.friction_ratio_u == pytest.approx(alone.friction_ratio_u, rel=1e-5)
    assert together.friction_force_n == pytest.approx(alone.friction_force_n, rel=1e-9)
    assert together.friction_force_n_se == pytest.approx(alone.friction_force_n_se, rel=1e-5)
    assert together.friction_force_n_u == pytest.approx(alone.friction_force_n_u, rel=1e-5)


def cycles(scene: Scene, law: str, *, gradient: float = 0.0) -> list[Cycle]:
    """Tests of one contact whose friction is 1 N and differs by 1 %; Y differs, and the gradient with it."""
    generator, found = np.random.default_rng(7), []
    for r, amplitude in ((0.35, 1.5e-3), (0.5, 1.8e-3), (0.7, 2.2e-3), (1.4, 1.8e-3)):
        beta = 0.36 * 1.8e-3 / amplitude * np.exp(0.01 * generator.standard_normal())
        parameters = {"gradient": gradient * amplitude} if gradient else {}
        recording = steady_recording(problem=Problem(r, beta, law=law, parameters=parameters), amplitude=amplitude)
        measured = measure(recording, scene)
        found.append(cycle_of(f"{r}", ("steel", 1.5), measured, scene))
    return found


@pytest.mark.parametrize(
    ("law", "name", "factor"),
    [
        ("coulomb", "beta", 1 / 2),
        ("coulomb+place", "gradient", 2),
        ("coulomb+stribeck", "stribeck_speed", 1 / 6),
        ("coulomb+lugre", "bristle_damping", 3),
        ("coulomb+compliance", "stiffness_ratio", 1),
    ],
)
def test_tests_of_other_amplitude_and_speed_share_what_has_the_same_size_in_metres_and_seconds(
    law: str, name: str, factor: float
) -> None:
    """A test at twice Y and three times omega; a damping over k / omega went with Y as well."""
    shared = Shared(law_of(law), (), (), amplitude=1e-3, turn=2.0)
    cycle = cast("Cycle", SimpleNamespace(amplitude=2e-3, turn=6.0))
    assert shared.factor(shared.law.parameter(name), cycle) == pytest.approx(factor, rel=1e-12)


def test_a_gradient_per_metre_is_what_tests_of_other_amplitudes_share(scene: Scene) -> None:
    tests = cycles(scene, "coulomb+place", gradient=25.0)
    start = {tests[0].group: 0.36}
    rungs, top = climb_together(tests, start)
    assert top.law.name == "coulomb+place"
    assert {rung.law.name for rung in rungs} >= {"coulomb", "coulomb+speed", "coulomb+breakaway"}
    joined = join(tests, top.law, {}, start)
    shared = joined.best.shared
    (gradient,) = joined.parameters()
    assert gradient.told
    assert gradient.value.value == pytest.approx(25.0 * shared.amplitude, abs=3.0 * (gradient.value.u or 0.0))
    assert gradient.value.u is not None
    assert gradient.value.u < 0.05 * 25.0 * shared.amplitude
    friction = joined.friction(0)
    assert friction.value == pytest.approx(0.36 * 1.8e-3 / shared.amplitude, abs=3.0 * (friction.se or 0.0))
    assert joined.scatter is not None
    assert 0.004 < joined.scatter < 0.03


def test_plain_friction_that_differs_from_test_to_test_is_no_richer_law(scene: Scene) -> None:
    tests = cycles(scene, "coulomb")
    _, top = climb_together(tests, {tests[0].group: 0.36})
    assert top.law.name == "coulomb"
    joined = join(tests, law_of("coulomb"), {}, {tests[0].group: 0.36})
    square, freedom, p = joined.evenness(tests[0].group)
    assert freedom == 3
    assert square > 100.0
    assert p is not None
    assert p < 1e-6
