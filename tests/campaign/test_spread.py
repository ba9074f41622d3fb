"""How sure shared unknowns are: noise as the cycles show it, scatter counted once, what tests show by themselves."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from frictionlab.campaign.mixed import Mixed, Piece
from frictionlab.campaign.scores import Shown, Stated
from frictionlab.campaign.spread import Spread, spread_of
from tests.campaign.test_joint import FREE, SHARED, UNKNOWN, made_up

FloatArray = NDArray[np.float64]
NONE = np.zeros((2, 2))


def shown(each: FloatArray, *, least: FloatArray = NONE, base: FloatArray = NONE, excess: float = 1.0) -> Shown:
    return Shown(each, len(each), least, base, excess)


def test_noise_that_the_cycles_show_is_that_of_their_mean() -> None:
    """Cycles alike from one to the next by nothing: their scatter over their number, in any direction."""
    each = np.random.default_rng(3).standard_normal((4000, 2)) @ np.array([[2.0, 0.5], [0.0, 1.0]])
    into = np.array([[1.0, 0.3, 0.0], [0.0, -1.0, 2.0]])
    mean = into.T @ np.cov(each.T) @ into / 4000.0
    assert shown(each).carried(into) == pytest.approx(mean, rel=0.2)
    assert shown(each, excess=3.0).carried(into) == pytest.approx(3.0 * shown(each).carried(into), rel=1e-12)
    base = np.eye(2)
    assert shown(each, base=base).carried(into) - shown(each).carried(into) == pytest.approx(into.T @ into, abs=1e-12)


def test_cycles_that_hardly_scatter_are_no_surer_than_their_sensor() -> None:
    each, into = 1e-9 * np.random.default_rng(3).standard_normal((50, 2)), np.eye(2)
    assert np.diag(shown(each, least=0.25 * np.eye(2)).carried(into)) == pytest.approx([0.25, 0.25])


def test_neighbours_count_by_the_direction_that_an_unknown_is_moved_in() -> None:
    """One part of the cycles wanders, the other is unlike from cycle to cycle."""
    draws = np.random.default_rng(5).standard_normal((301, 2))
    each = np.stack([draws[1:, 0] + draws[:-1, 0], draws[1:, 1] - draws[:-1, 1]], axis=1)
    one, two = np.diag(shown(each).carried(np.eye(2))) * 300.0
    assert one == pytest.approx(4.0, rel=0.3)  # of the sum of all: twice each draw
    assert two < 0.5  # all but the ends fall out


def spread(pieces: list[Piece], *, uneven: float = 0.0, true: float = 1.0) -> tuple[FloatArray, Spread]:
    """The shared unknowns and how sure they are said to be; `true`: variance of the noise over the weights'."""
    far = uneven * np.eye(UNKNOWN)[:, [3]]
    own = [replace(p, place=replace(p.place, uneven=far * p.place.scale[3, 2])) for p in pieces] if uneven else pieces
    found = Mixed(own, FREE).solve()
    return found.point, spread_of(found, own, [Stated(true * piece.information) for piece in own], robust=True)


def scores(*, scatter: float = 0.0, uneven: float = 0.0, said: float | None = None, seeds: int = 300) -> FloatArray:
    """Rms (S,) of errors over those stated."""
    off = []
    for seed in range(seeds):
        pieces, truth = made_up(12, scatter=scatter, uneven=uneven, seed=seed)
        point, stated = spread(pieces, uneven=uneven if said is None else said)
        off.append((point - truth) / np.sqrt(np.diag(stated.total)))
    return np.asarray(np.sqrt(np.mean(np.square(off), axis=0)))


def test_a_parameter_that_differs_from_test_to_test_is_in_the_errors_of_all_unknowns() -> None:
    assert scores(uneven=0.3) == pytest.approx(np.ones(SHARED), abs=0.2)
    assert scores(scatter=0.2, uneven=0.3) == pytest.approx(np.ones(SHARED), abs=0.2)


def test_tests_that_show_more_than_is_stated_raise_it_and_chance_seldom_does() -> None:
    unsaid = scores(uneven=0.3, said=0.0)
    assert 1.0 < unsaid[2] < 1.6  # at most one in five would be without
    noise = np.array([np.diag(spread(made_up(12, seed=seed)[0])[1].noise) for seed in range(60)])
    assert float(np.mean(noise[:, 2] > 2.0 * np.median(noise[:, 2]))) < 0.2


def test_scatter_that_the_noise_of_the_cycles_explains_is_not_counted_twice() -> None:
    """The weights take the noise for half as large as the cycles show: what is left looked like scatter."""
    pieces, _ = made_up(12, noise=0.05, seed=4)
    half = [Piece(2.0 * p.information, 2.0 * p.score, p.place, p.level) for p in pieces]
    _, once = spread(half, true=2.0)
    assert Mixed(half, FREE).solve().scatter > 0.0
    twice = np.diag(once.noise)[0] + np.diag(spread(half, true=1.0)[1].scatter)[0]
    assert np.diag(once.total)[0] < twice
