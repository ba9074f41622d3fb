"""Laplace's evidence against the integral by points; errors of shared values against a linear twin that scatters."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.special import logsumexp, ndtr
from scipy.stats import cauchy, multivariate_normal, multivariate_t, norm

from frictionlab.analysis.measurement import Measurement, measure
from frictionlab.arrays import FloatArray
from frictionlab.inference.fit import Fit, fit_from, log_orthant, with_scatter
from frictionlab.inference.ladder import held_out
from frictionlab.inference.observation import Observation, Reached, Values
from frictionlab.inference.observations import observe
from frictionlab.inference.posterior import model_of, of_several
from frictionlab.inference.starts import starting_points
from frictionlab.inference.unknowns import Unknown
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.laws import law_of
from frictionlab.uncertainty import sources_of
from tests.inference.contacts import recorded, scene

DRAWS = 1500
DRAWN = 6  # degrees of freedom of the curve that points are drawn from: wider than any posterior about its peak
WIDER = 1.2  # its covariance over Laplace's


def likelihood(fit: Fit) -> Callable[[FloatArray], float]:
    """Logarithm of the likelihood of a point: normal misfit with the covariance of the measured mean cycle."""
    observation = fit.model.tests[0].observation
    constant = -float(np.log(observation.sd).sum()) - 0.5 * len(observation.data) * math.log(2.0 * math.pi)

    def value(point: FloatArray) -> float:
        looked = fit.model.look(0, point)
        return -1e300 if looked is None else constant - 0.5 * float(looked[0] @ looked[0])

    return value


def log_prior(c: Unknown, at: float) -> float:
    """Logarithm of a coordinate's prior density: normal, or Student's; twice that where only half of it is left."""
    if not c.low <= at <= c.high:
        return -math.inf
    if c.assumed:
        density = float(cauchy.logpdf(at, scale=math.sqrt(2.0)))
        return density + (math.log(2.0) if c.folded else 0.0)
    return float(norm.logpdf(at)) - math.log(float(ndtr(c.high) - ndtr(c.low)))


def weighed(fit: Fit, draws: int, generator: np.random.Generator) -> tuple[float, float]:
    """Log evidence by importance sampling from a curve with tails, and how many even points those drawn are worth."""
    curve = multivariate_t(fit.point, WIDER * np.linalg.inv(fit.precision), df=DRAWN, seed=generator)
    points, value = curve.rvs(draws), likelihood(fit)
    logs = np.full(draws, -math.inf)
    for i, point in enumerate(points):
        prior = sum(log_prior(c, float(p)) for c, p in zip(fit.model.unknowns, point, strict=True))
        if math.isfinite(prior):
            logs[i] = value(point) + prior - curve.logpdf(point)
    whole = float(logsumexp(logs))
    weights = np.exp(logs - whole)
    return whole - math.log(draws), 1.0 / float(weights @ weights)


def fitted(measurement: Measurement, known: Scene, law: str) -> Fit:
    """The fit of a law by the noise alone."""
    model = model_of([observe(measurement, known, law)])
    return fit_from(model, starting_points(model), tempers=False)


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
    whole, worth = weighed(found, DRAWS, np.random.default_rng(1))
    assert worth > 200
    assert found.log_evidence == pytest.approx(whole, abs=0.2)


def test_two_parameters_at_their_bounds_are_integrated_together() -> None:
    """The contact's dashpot and an undeclared one of the frame do nearly the same. Bound by bound it is 2.5 off."""
    known = scene(rig={"damping_ratio": None}, sensors={"lag_s_u": 2e-4})
    truth = Problem(0.4, 0.35, law="coulomb+place", parameters={"gradient": 0.05})
    measurement = measure(recorded(truth, np.random.default_rng(13)), known)
    found = fitted(measurement, known, "coulomb+place+speed")
    whole, _ = weighed(found, 3 * DRAWS, np.random.default_rng(1))
    assert found.log_evidence == pytest.approx(whole, abs=0.3)


@pytest.mark.parametrize(
    ("mean", "correlation"),
    [([10.8, -4.81], -0.9986), ([-4.81, 10.8], -0.9986), ([0.5, 0.5], -0.9), ([2.0, -3.0], 0.99), ([-1.0, -2.0], 0.3)],
)
def test_two_bounds_are_met_however_their_parameters_are_correlated(mean: list[float], correlation: float) -> None:
    """The dashpots of contact and frame take each other's place: what is left of both may lie far out in one's tail."""
    sd = np.array([0.1, 1.0])
    covariance = np.array([[1.0, correlation], [correlation, 1.0]]) * np.outer(sd, sd)
    expected = multivariate_normal.logcdf(np.array(mean) * sd, np.zeros(2), covariance, abseps=1e-14, releps=1e-10)
    assert float(log_orthant(np.array(mean) * sd, covariance)) == pytest.approx(expected, abs=0.02)


NOISE, SCATTER = 1e-3, 0.01  # of the friction ratio
MATERIAL = Unknown("beta", "friction ratio", "material", mean=0.3, sd=0.1, law=True, scatter=0.03)
RIG = Unknown("gain", "gain of a sensor", sd=0.1)


@dataclass(frozen=True, kw_only=True)
class Line(Observation):
    """A test whose data are linear in two unknowns, and whose noise is ``over`` times what it assumes."""

    design: FloatArray
    over: float
    steps: ClassVar = (1e-3,)

    @property
    def law_unknowns(self) -> tuple[Unknown, ...]:
        return (MATERIAL,)

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        return (RIG,)

    def motion(self, values: Values, near: Any = None) -> FloatArray:  # noqa: ARG002 - linear
        return np.asarray(self.design @ [values["beta"], values["gain"]])

    def covariance(self, at: Reached) -> FloatArray:
        return np.asarray(self.over**2 * at.gain @ at.gain.T)


def drawn(over: float, tests: int, seed: int, scatter: float = SCATTER) -> tuple[list[Line], float]:
    """The tests of one campaign and its rig's value; two frequencies hardly tell it from the material's."""
    rng = np.random.default_rng([seed, tests])
    lines, rig = list[Line](), RIG.sd * rng.standard_normal()
    for i in range(tests):
        design = np.column_stack([np.ones(8), 1.0 + (0.02 + 0.02 * (i % 2)) * np.arange(8)])
        own = 0.3 + scatter * rng.standard_normal()
        data = design @ [own, rig] + NOISE * rng.standard_normal(8)
        lines.append(Line(
            source=str(i), law=law_of("coulomb"), held={}, wall="fixed", material="steel", normal_force=1.0, r=0.5,
            unit=1.0, turn=1.0, sources=sources_of(Scene(), 100.0), swing=1.0, data=data, powers=1.0, floor=1.0,
            variances=(NOISE / over) ** 2, design=design, over=over,
        ))  # fmt: skip
    return lines, rig


def scores(*of: Any) -> FloatArray:
    """Errors over u of the material's value and the rig's, of a campaign as `drawn`."""
    lines, rig = drawn(*of)
    found = of_several(fit_from(model_of(lines), [np.zeros(2)]))
    off = found.fit.point - [u.at(v) for u, v in zip(found.unknowns, (0.3, rig), strict=True)]
    return np.asarray(off / np.sqrt(np.diag(found.covariance)))


def test_a_test_left_out_may_differ_from_the_others_as_they_do() -> None:
    missed, _ = held_out(with_scatter(fit_from(model_of(drawn(1.0, 5, 1)[0]), [np.zeros(2)])))
    assert missed.max() < 10.0  # 27 without their scatter, and no law is required


@pytest.mark.parametrize(("tests", "scatter"), [(2, 0.045), (3, 0.045), (5, SCATTER)])
def test_errors_of_few_tests_hold_the_truth_as_often_as_they_say(tests: int, scatter: float) -> None:
    """Two tests whose friction scatters by 15 %: 1.96 u held the truth in 77 %, for u was of one scatter."""
    found = np.abs([scores(1.0, tests, seed, scatter) for seed in range(100)])
    assert np.mean(found < 1.96, axis=0) == pytest.approx([0.95, 0.97], abs=0.05)


def test_what_scatter_explains_is_no_misfit_in_the_weights() -> None:
    """A share of misfit from before the scatter was known stayed: a dashpot was 6 % off, 4 u."""
    found = [of_several(fit_from(model_of(drawn(1.0, 4, seed)[0]), [np.zeros(2)])) for seed in range(40)]
    assert max(test.observation.missed for each in found for test in each.tests) < NOISE**2  # of the power 1


def test_noise_assumed_for_want_of_cycles_hides_no_misfit() -> None:
    """Chi-square was 160 where noise lets expect 24, of 192 numbers: no misfit was counted, and predictions missed."""
    few, silent = list[Line](), np.zeros(56)
    for line in drawn(1.0, 2, 0)[0]:
        off, design = (
            2.5 * math.sqrt(10.0) * NOISE * np.array([1.0, -1.0] * 4),
            np.vstack([line.design, np.zeros((56, 2))]),
        )
        variances = NOISE**2 * np.append(np.full(8, 10.0), silent + 1.0)
        data = np.append(design[:8] @ [0.3, 0.0] + off, silent)
        few.append(replace(line, data=data, design=design, variances=variances, unsure=NOISE**2))
    begun = fit_from(model_of(few), [np.zeros(2)], tempers=False)
    assert not begun.shares_missed().any()
    shares = [test.observation.missed for test in of_several(begun).tests]
    assert shares == pytest.approx([70.0 * NOISE**2] * 2, rel=0.2)  # of the power 1: with it chi-square is 2 (7.2 - 1)


def test_weights_that_assume_too_much_noise_do_not_make_the_rig_sure() -> None:
    """Errors were those of the best weights, which were not used: 52 % of them held within one u."""
    found = np.array([scores(0.2, 4, seed) for seed in range(60)])
    assert np.mean(np.abs(found[:, 1]) < 1.0) > 0.65
    assert np.sqrt(np.mean(found**2, axis=0)) == pytest.approx([0.85, 0.85], abs=0.2)
