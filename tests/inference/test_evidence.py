"""Laplace's evidence is the integral of likelihood times prior, summed over points drawn about the best values."""

from collections.abc import Mapping

import numpy as np
import pytest

from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement
from frictionlab.inference.fit import Fit, fit_from, log_evidence
from frictionlab.inference.observations import observe
from frictionlab.inference.posterior import model_of
from frictionlab.inference.starts import starting_points
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from tests.inference.contacts import recorded, scene
from tests.inference.oracle import weighed

DRAWS = 1500


def fitted(measurement: Measurement, known: Scene, law: str) -> Fit:
    """The fit of a law by the noise alone."""
    model = model_of([observe(measurement, known, law)])
    starts, local = starting_points(model)
    return fit_from(model, starts, local, tempers=False)


@pytest.mark.parametrize(
    ("law", "undeclared", "lag_s"),
    [
        ("coulomb+speed", {}, 0.004),  # a lag far out in its tails
        ("coulomb+place", {"damping_ratio": None}, 0.0),  # a frame's damping at its bound, with half a tail
    ],
)
def test_laplaces_evidence_is_the_integral(law: str, undeclared: Mapping[str, object], lag_s: float) -> None:
    parameters = {"contact_damping_ratio": 0.03} if law == "coulomb+speed" else {"gradient": 0.05}
    known = scene(rig=undeclared)
    seen = recorded(Problem(0.4, 0.35, law=law, parameters=parameters), np.random.default_rng(12), lag_s=lag_s)
    measurement = measure(seen, known)
    found = fitted(measurement, known, law)
    whole = weighed(found, DRAWS, np.random.default_rng(1))
    assert whole.worth > 200
    assert log_evidence(found) == pytest.approx(whole.log_evidence, abs=0.2)


def test_two_parameters_at_their_bounds_are_integrated_together() -> None:
    """The contact's dashpot and an undeclared one of the frame do nearly the same. Bound by bound it is 2.5 off."""
    known = scene(rig={"damping_ratio": None}, sensors={"lag_s_u": 2e-4})
    truth = Problem(0.4, 0.35, law="coulomb+place", parameters={"gradient": 0.05})
    measurement = measure(recorded(truth, np.random.default_rng(13)), known)
    found = fitted(measurement, known, "coulomb+place+speed")
    whole = weighed(found, 3 * DRAWS, np.random.default_rng(1))
    assert log_evidence(found) == pytest.approx(whole.log_evidence, abs=0.3)
