"""Parameters other than friction that differ from test to test: told, and held by the error of the one value."""

from collections.abc import Sequence

import numpy as np
import pytest

from frictionlab.analysis.measure import measure
from frictionlab.campaign import cycle_of
from frictionlab.campaign.joined import Joined, join, joined_again
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.laws import law_of
from tests.identification.contacts import recorded, scene

RATIOS = (0.35, 0.5, 0.65, 0.8, 1.3, 1.6)
GROUP = ("greased", 1.0)


def known() -> Scene:
    return scene(sensors={"gain_error": 1e-5, "lag_s_u": 1e-6, "linearity": 0.0}, rig={"natural_frequency_hz_u": 1e-5})


def together(dampings: Sequence[float]) -> Joined:
    """Tests of one contact whose dashpot is given for each."""
    generator, cycles = np.random.default_rng(11), []
    for r, damping in zip(RATIOS, dampings, strict=False):
        problem = Problem(r, 0.36, law="coulomb+speed", parameters={"contact_damping_ratio": damping})
        measured = measure(recorded(problem, generator, seconds=25.0), known())
        cycles.append(cycle_of(f"{r}", GROUP, measured, known()))
    return joined_again(join(cycles, law_of("coulomb+speed"), {}, {GROUP: 0.36}))


@pytest.mark.parametrize("count", [3, 6])
def test_a_dashpot_that_differs_from_test_to_test_is_told_and_in_the_error(count: int) -> None:
    dampings = np.array([0.040, 0.062, 0.045, 0.058, 0.041, 0.054])[:count]
    (told,) = together(dampings.tolist()).parameters()
    assert told.differs
    assert told.scatter == pytest.approx(dampings.std(ddof=1), rel=0.35)
    assert told.value.se is not None
    assert told.value.se > 0.6 * dampings.std(ddof=1) / np.sqrt(count)
    assert told.value.value == pytest.approx(dampings.mean(), abs=2.0 * told.value.se)


def test_a_dashpot_that_is_the_same_in_all_tests_does_not_differ() -> None:
    (told,) = together([0.05] * 6).parameters()
    assert told.p is not None
    assert told.p > 0.05
    assert not told.differs
    assert told.value.u is not None
    assert told.value.u < 4e-5  # 0.0002 when the covariance that weighs the cycles was taken for their noise
    assert told.value.value == pytest.approx(0.05, abs=3.0 * told.value.u)
