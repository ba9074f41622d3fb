"""The law of each material: Amontons' law, evidence of the laws tried, loops, and each test left out.

A test left out is predicted by the law of all others: amplitude, energy and cycle, and whether the 95 % bands held
them. Of a few tests the fit is made again without it; of many it is one linear step away. What the others say of it is
a normal distribution of its unknowns: their posterior, and the scatter from test to test. It is carried to amplitude
and energy by three points (Gauss and Hermite) along each direction that moves the cycle.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from scipy.special import chdtrc

from frictionlab.arrays import FloatArray
from frictionlab.campaign.friction import FrictionFit
from frictionlab.campaign.joint_fit import JointFit
from frictionlab.errors import AnalysisError
from frictionlab.inference.compare import HELD, contact_of
from frictionlab.inference.comparison import ContactForce
from frictionlab.inference.fit import NOT_SEEN, Model, Test, fit_from
from frictionlab.inference.force import ForceObservation
from frictionlab.inference.ladder import Ladder
from frictionlab.inference.observation import NO_MOTION
from frictionlab.inference.observations import CycleObservation, OfCycles
from frictionlab.inference.posterior import Posterior, of_several
from frictionlab.inference.unknowns import Unknown
from frictionlab.schema import AMPLITUDE, ENERGY, LEFT_OUT, MATERIAL_LAWS
from frictionlab.tables import Row
from frictionlab.uncertainty import NORMAL, Estimate

SIGNIFICANT = 0.05
SHOWN = 3  # loops of a material
FEW = 8  # tests up to which the fit is made again
MOVES = 0.1  # of the noise: a direction along which the cycle moves by less is not followed ...
MOST_DIRECTIONS = 6  # ... nor are more than these
HERMITE, OUTER = math.sqrt(3.0), 1.0 / 6.0  # the outer two of three points, in standard deviations, and their weights
SIGNS = (0.0, 0.6, -0.6)  # scatters at which a test's own unknowns begin
ALONE = "no other test of its material is at hand"
STILL = "by the law of the other tests there is no steady motion here"
OF_BOTH = (f"predicted_{ENERGY}", f"predicted_{AMPLITUDE}")
MEASURED = (f"measured_{ENERGY}", f"measured_{AMPLITUDE}")
BANDS = tuple(f"{name}{end}" for name in OF_BOTH for end in ("_low", "", "_high"))


@dataclass(frozen=True)
class AmontonsTest:
    """One material's coefficients over normal force.

    ``coefficient`` and its error: the mean over forces; ``chi_square`` about it; ``p``: how often a constant one would
    look at least this uneven; ``verdict``: all of it in words. ``None`` is not known.
    """

    material: str
    coefficient: float | None = None
    coefficient_se: float | None = None
    chi_square: float | None = None
    p: float | None = None
    verdict: str = ""

    @property
    def holds(self) -> bool | None:
        """Whether the coefficient may be constant; None where nothing can be said."""
        return None if self.p is None else self.p >= SIGNIFICANT


def amontons_of(
    material: str, fits: Sequence[FrictionFit], joints: Mapping[tuple[str, float], JointFit], stiffness: float | None
) -> AmontonsTest:
    """Test Amontons' law by the joint fit of a material's groups, the errors of its normal forces beside it."""
    joint = next((joints[g] for f in fits if (g := (material, f.normal_force_n)) in joints), None)
    known = [f for f in fits if f.friction_coefficient and joints.get((material, f.normal_force_n)) is joint]
    if not known or joint is None:
        return AmontonsTest(material, verdict=f"{material}: no coefficient is known.")
    value = np.array([f.friction_coefficient for f in known], dtype=float)
    forces = [f.normal_force_n for f in known]
    found = joint.by_force
    places = [found.fit.find("beta", joint.tests(material, force)[0]) or 0 for force in forces]
    slopes = [found.relative(k) for k in places]  # of the logarithms of friction ratios
    relative = found.covariance[np.ix_(places, places)] * np.outer(slopes, slopes)
    relative = relative + np.diag([f.normal_force_u**2 for f in known])
    mean, beyond = joint.coefficient(material, stiffness), 0.0  # what stiffness, base sensor, normal force add to beta
    for f in known:
        coefficient, ratio = ((e.u or 0.0) / (e.value or 1.0) for e in (f.coefficient, f.friction))
        beyond = max(beyond, math.sqrt(max(0.0, coefficient**2 - ratio**2)))
    mean = mean.with_u(math.hypot(mean.u or 0.0, beyond * (mean.value or 0.0)))
    return amontons(material, np.array(forces), value, relative * np.outer(value, value), mean)


def amontons(
    material: str, forces: FloatArray, value: FloatArray, covariance: FloatArray, mean: Estimate
) -> AmontonsTest:
    """Test by chi-square if coefficients (n,) with covariance (n, n) are constant over normal forces (n,), N.

    ``mean``: by all.
    """
    freedom, weight = len(value) - 1, np.linalg.inv(covariance)
    if not freedom:
        words = "measured under one normal force only, so Amontons' law is not tested."
        return AmontonsTest(material, mean.value, mean.error, verdict=f"{material}: {words}")
    about = value - float(weight.sum(axis=0) @ value / weight.sum())
    square = float(about @ weight @ about)
    p = float(chdtrc(freedom, square))
    proof = f"chi-square {square:.3g} on {freedom} degree{'s' * (freedom > 1)} of freedom, p"
    proof += f" = {p:.2g}" if p >= 1e-4 else " = less than 0.0001"
    words = (
        f"the friction coefficient may be the same under all {freedom + 1} normal forces, as Amontons' law says"
        f" ({proof})"
    )
    if p < SIGNIFICANT:
        each = ", ".join(f"{mu:.3g} at {force:g} N" for force, mu in zip(forces, value, strict=True))
        words = f"the friction coefficient is not constant over normal force ({proof}): it is {each}"
    verdict = f"{material}: {words}; mean coefficient {mean}."
    return AmontonsTest(material, mean.value, mean.error, square, p, verdict)


def laws_together(ladders: Mapping[str, Ladder]) -> tuple[Row, ...]:
    """Return the rows of ``laws.csv``: the laws tried on the tests of each material together, likeliest first.

    Last those that were not, or not to the end, with the reason in ``note``.
    """
    rows = list[dict[str, Any]]()
    for material, ladder in ladders.items():
        fitted = [(rung, len(rung.fit.model.tests)) for rung in ladder.rungs if rung.fit is not None]
        plain = next((rung.log_evidence for rung, _ in fitted if rung.law.name == "coulomb"), math.nan)
        for rung, tests in sorted(fitted, key=lambda one: -one[0].log_evidence):
            row = {"material": material, "law": rung.law.name, "tests": tests}
            row |= {"log_evidence": rung.log_evidence, "required": rung.law.name == ladder.chosen.law.name}
            gain = None if math.isnan(plain) else rung.log_evidence - plain
            rows.append({**row, "gain": gain, "response_nrmse": rung.nrmse, "note": None})
        empty = dict.fromkeys(MATERIAL_LAWS.names) | {"material": material}
        rows += [empty | {"law": rung.law.name, "note": rung.said} for rung in ladder.rungs if rung.fit is None]
    return tuple(sorted(rows, key=lambda row: str(row["material"])))


def loops_of(joint: JointFit, stiffness: float | None) -> list[tuple[OfCycles, ContactForce]]:
    """Return a few tests of each material that the law explains best, slow, middling and fast, and their contacts."""
    observations, found = joint.posterior.observations, list[tuple[OfCycles, ContactForce]]()
    for material in joint.materials:
        order = sorted(joint.tests(material), key=lambda i: (observations[i].r, observations[i].turn))
        best = [min(map(int, part), key=joint.misfit) for part in np.array_split(np.array(order), SHOWN) if len(part)]
        for i in best:
            observation, values = observations[i], joint.posterior.values(i)
            with suppress(AnalysisError):
                found.append((observation, contact_of(observation, values, stiffness=stiffness)))
    return found


def not_predicted(source: str, material: str | None, reason: str) -> dict[str, Any]:
    """Return the row of ``left_out.csv`` of a test that cannot be predicted."""
    return dict.fromkeys(LEFT_OUT.names) | {"source": source, "material": material, "reason": reason}


@dataclass(frozen=True)
class _Expected:
    """What the other tests say of test ``i`` of a model: its coordinates' ``mean`` (n,) and ``covariance`` (n, n)."""

    model: Model
    i: int
    mean: FloatArray
    covariance: FloatArray

    @property
    def observation(self) -> CycleObservation | ForceObservation:
        """The test."""
        return cast("CycleObservation | ForceObservation", self.model.tests[self.i].observation)

    def lines(self, own: FloatArray) -> FloatArray | None:
        """What the sensors show (N,) at the test's own coordinates; None where there is no motion."""
        return self.observation.predict(self.model.values(self.i, own))


def left_out(posterior: Posterior, lag_s: float = 0.0) -> dict[str, dict[str, Any]]:
    """Return by source the row of each test of a joint fit as the others predict it, or why they cannot.

    Bands hold 95 %; energies, measured and predicted, are without the lag that the test is found at (``lag_s``: that
    the scene declares), as `frictionlab predict` has them.
    """
    materials = [observation.material for observation in posterior.observations]
    found = dict[str, dict[str, Any]]()
    for i, (observation, material) in enumerate(zip(posterior.observations, materials, strict=True)):
        source, others = observation.source, materials.count(material) - 1
        found[source] = not_predicted(source, material, ALONE)
        if not others:
            continue
        own = posterior.nuisances(i).get("lag_s", {"value": 0.0, "u": 0.0})
        try:
            test = _predicted(_expected(posterior, i, others), own["value"], own["u"])
            found[source] = {**found[source], "reason": None, **test, "lag_s": lag_s + own["value"]}
        except NO_MOTION as error:
            found[source] = not_predicted(source, material, f"the other tests' law cannot be fitted: {error}")
    return found


def _expected(posterior: Posterior, i: int, others: int) -> _Expected:
    """What the others say of test i: by a fit of them in the same unknowns, or of many by one step."""
    model, index = posterior.fit.model, posterior.tests[i].index
    if len(model.tests) > FEW:
        return _Expected(model, i, *posterior.left_out(i))
    tests = tuple(replace(t, observation=t.observation.missing(0.0)) for j, t in enumerate(model.tests) if j != i)
    rest = of_several(fit_from(replace(model, tests=tests, scatter=0.0 * model.scatter), [posterior.fit.point]))
    rest = replace(rest, shifts=posterior.shifts)  # of what the law misses the others know no more
    scatter = rest.scatter[index]
    if others == 1:
        scatter = NOT_SEEN * np.array([model.unknowns[k].scatter_scale(float(rest.fit.point[k])) for k in index])
    covariance = rest.covariance[np.ix_(index, index)] + np.diag(scatter**2)
    return _Expected(model, i, rest.fit.point[index], covariance)


def _predicted(expected: _Expected, lag_s: float, lag_s_u: float) -> dict[str, object]:
    """The numbers of one test as the others predict it, its energies without a lag beyond the declared one.

    ``lag_s``: what the test itself shows of that, with its standard uncertainty; the others say nothing of it.
    """
    observation, lines = expected.observation, expected.lines(expected.mean)
    if lines is None:
        return {"reason": STILL}
    measured, error = (np.array([getattr(e, part) or 0.0 for e in observation.sums]) for part in ("value", "se"))
    offset = measured - observation.summed(observation.data)  # a mean of cycles is not the cycle of means
    if isinstance(observation, CycleObservation):
        by_lag = [observation.energy_by_lag(lag * observation.turn) for lag in (lag_s, lag_s + lag_s_u)]
        measured[0], error[0] = measured[0] - by_lag[0], math.hypot(error[0], by_lag[1] - by_lag[0])
    late = observation.turn * expected.model.values(expected.i, expected.mean).get("lag_s", 0.0)
    value = observation.summed(lines, late)
    middle, variance = _spread(expected, value, late)
    reach = NORMAL * np.sqrt(variance + error**2)
    low, high, value = offset + middle - reach, offset + middle + reach, offset + value
    ends = np.array([np.minimum(low, value), value, np.maximum(high, value)]).T.ravel().tolist()
    seen = {"": lines, "_own": _with_own(expected)}
    return {
        **dict(zip(BANDS, ends, strict=False)),  # where a motion was given, nothing is said of an amplitude
        **dict(zip(MEASURED, measured.tolist(), strict=False)),
        **{f"response_nrmse{of}": observation.nrmse(observation.white(observation.data - y)) for of, y in seen.items()},
        "band_holds": bool(np.all((low <= measured) & (measured <= high))),
    }


def _spread(expected: _Expected, here: FloatArray, late: float) -> tuple[FloatArray, FloatArray]:
    """Mean and variance of energy and amplitude over what the others say of the test.

    Independent deviations of the test's unknowns but its lag are followed, the most telling first.
    """
    model, i, observation = expected.model, expected.i, expected.observation
    told = np.array([model.unknowns[k].name != "lag_s" for k in model.tests[i].index])
    values, vectors = np.linalg.eigh(expected.covariance * np.outer(told, told))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    _, sizes, turned = np.linalg.svd(model.slopes(i, expected.mean) @ root, full_matrices=False)
    middle, variance = here.copy(), np.zeros_like(here)
    for row in turned[sizes > MOVES][:MOST_DIRECTIONS]:
        ends = [expected.lines(expected.mean + sign * HERMITE * (root @ row)) for sign in (1.0, -1.0)]
        both = np.array([observation.summed(end, late) - here for end in ends if end is not None])
        if not len(both):
            continue
        weights = OUTER * 2.0 / len(both)
        mean = weights * both.sum(axis=0)
        middle, variance = middle + mean, variance + weights * (both**2).sum(axis=0) - mean**2
    return middle, variance


def _with_own(expected: _Expected) -> FloatArray:
    """What its sensors show (N,) with the test's own unknowns fitted to it, each held by its scatter from test to test.

    By the measure that is reported, every harmonic alike: what the others' law misses is not of the cycles' noise.
    """
    model, test, observation = expected.model, expected.model.tests[expected.i], expected.observation
    sds, own = np.sqrt(np.diag(expected.covariance)).tolist(), list[Unknown]()
    for k, c, sd in zip(test.index.tolist(), expected.mean.tolist(), sds, strict=True):
        u = model.unknowns[k]
        times = max(sd, HELD) if u.level == "test" else HELD
        own.append(replace(u, mean=u.mean + u.sd * c, sd=times * u.sd, low=(u.low - c) / times, assumed=""))
    alike = replace(observation, variances=float(np.mean(observation.variances)), directions=None, missed=0.0)
    one = Model((Test(alike, np.arange(len(own)), test.factors),), tuple(own), np.zeros(len(own)))
    starts = [np.array([sign * (u.level == "test") for u in own]) for sign in SIGNS]
    return observation.data - alike.gap(fit_from(one, starts, tempers=False).residuals[0])
