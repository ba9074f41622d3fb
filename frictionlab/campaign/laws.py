"""The law of each material: Amontons' law, evidence of the laws tried, physical parameters, loops of its contact."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import fdtrc

from frictionlab.arrays import FloatArray
from frictionlab.campaign.friction import FrictionFit
from frictionlab.campaign.joint_fit import JointFit
from frictionlab.estimate import Estimate
from frictionlab.inference.compare import contact_of
from frictionlab.inference.comparison import ContactForce
from frictionlab.inference.ladder import Ladder
from frictionlab.scene import Scene
from frictionlab.scene.physical import to_physical
from frictionlab.tables import Row

SIGNIFICANT = 0.05
SHOWN = 3  # loops of a material


@dataclass(frozen=True)
class AmontonsTest:
    """One material's coefficients over normal force.

    ``coefficient`` and its error: the mean over forces; ``chi_square`` about it with ``freedom`` degrees; ``p``: how
    often a constant coefficient would look at least this uneven; ``exponent``: of coefficient ~ force^exponent, with
    its standard error; ``verdict``: all of it in words. ``None`` is not known.
    """

    material: str
    forces: int
    coefficient: float | None = None
    coefficient_se: float | None = None
    chi_square: float | None = None
    freedom: int = 0
    p: float | None = None
    exponent: float | None = None
    exponent_se: float | None = None
    verdict: str = ""

    @property
    def holds(self) -> bool | None:
        """Whether the coefficient may be constant; None where nothing can be said."""
        return None if self.p is None else self.p >= SIGNIFICANT


@dataclass(frozen=True)
class LawEvidence:
    """One law for one material.

    ``tests``: that it was tried in; ``log_evidence``: of all of them; ``gain``: the same less plain Coulomb's;
    ``response_nrmse``: rms over the tests; ``required``: whether it is the law that the ladder of all tests ends at.
    """

    material: str
    law: str
    tests: int
    log_evidence: float
    gain: float | None
    response_nrmse: float | None
    required: bool


class Loop(NamedTuple):
    """One test's contact over a cycle, as measured and as the law has it."""

    material: str
    normal_force_n: float
    r: float
    contact: ContactForce


def amontons_of(
    material: str, fits: Sequence[FrictionFit], joints: Mapping[tuple[str, float], JointFit], stiffness: float | None
) -> AmontonsTest:
    """Test Amontons' law by the joint fit of a material's groups, the errors of its normal forces beside it."""
    joint = next((joints[g] for f in fits if (g := (material, f.normal_force_n)) in joints), None)
    known = [f for f in fits if f.friction_coefficient and joints.get((material, f.normal_force_n)) is joint]
    if not known or joint is None:
        return AmontonsTest(material, 0, verdict=f"{material}: no coefficient is known.")
    value = np.array([f.friction_coefficient for f in known], dtype=float)
    forces = [f.normal_force_n for f in known]
    relative = joint.relative_covariance(material, forces) + np.diag([f.normal_force_u**2 for f in known])
    mean, beyond = joint.coefficient(material, stiffness), 0.0  # what stiffness, base sensor, normal force add to beta
    for f in known:
        coefficient, ratio = ((e.u or 0.0) / (e.value or 1.0) for e in (f.coefficient, f.ratio))
        beyond = max(beyond, math.sqrt(max(0.0, coefficient**2 - ratio**2)))
    mean = mean.with_u(math.hypot(mean.u or 0.0, beyond * (mean.value or 0.0)))
    return amontons(material, np.array(forces), value, relative * np.outer(value, value), known[0].freedom, mean)


def amontons(
    material: str, forces: FloatArray, value: FloatArray, covariance: FloatArray, tests: int, mean: Estimate
) -> AmontonsTest:
    """Test whether coefficients (n,) with covariance (n, n) are constant over normal forces (n,), N; ``mean``: by all.

    Chi-square about their best mean; their errors come from few tests (``tests`` degrees of freedom), so p is that of
    Fisher's F.
    """
    freedom, weight = len(value) - 1, np.linalg.inv(covariance)
    if not freedom:
        words = f"measured under one normal force only, so Amontons' law is not tested; mean coefficient {mean}"
        return AmontonsTest(material, 1, mean.value, mean.error, verdict=f"{material}: {words}.")
    about = value - float(weight.sum(axis=0) @ value / weight.sum())
    square = float(about @ weight @ about)
    p = float(fdtrc(freedom, max(tests, 1), square / freedom))
    exponent, error = _exponent(forces, value, weight * np.outer(value, value))
    proof = f"chi-square {square:.3g} on {freedom} degrees of freedom, p"
    proof += f" = {p:.2g}" if p >= 1e-4 else " = less than 0.0001"
    words = (
        f"the friction coefficient may be the same under all {freedom + 1} normal forces, as Amontons' law says"
        f" ({proof})"
    )
    if p < SIGNIFICANT:
        trend = "it varies without a clear trend over normal force"
        if abs(exponent) > 2 * error:
            way = "falls" if exponent < 0 else "rises"
            trend = f"it {way} with normal force, by {abs(2**exponent - 1):.1%} at each doubling"
        words = f"the friction coefficient is not constant over normal force ({proof}): {trend}"
    verdict = f"{material}: {words}; mean coefficient {mean}."
    return AmontonsTest(material, len(value), mean.value, mean.error, square, freedom, p, exponent, error, verdict)


def _exponent(force: FloatArray, value: FloatArray, weight: FloatArray) -> tuple[float, float]:
    """Slope of ln(coefficient) over ln(force), by weights (n, n); its error includes the scatter about the line."""
    lines = np.stack([np.ones(len(force)), np.log(force)], axis=1)
    covariance = np.linalg.inv(lines.T @ weight @ lines)
    best = covariance @ lines.T @ weight @ np.log(value)
    left = np.log(value) - lines @ best
    stretch = math.sqrt(float(left @ weight @ left) / (len(force) - 2)) if len(force) > 2 else 1.0
    return float(best[1]), max(1.0, stretch) * math.sqrt(float(covariance[1, 1]))


def laws_together(ladders: Mapping[str, Ladder]) -> tuple[LawEvidence, ...]:
    """Return the laws tried on the tests of each material together, best first."""
    lines = []
    for material, ladder in ladders.items():
        fitted = [(rung, rung.fit) for rung in ladder.rungs if rung.fit is not None]
        plain = next((rung.log_evidence for rung, _ in fitted if rung.law.name == "coulomb"), None)
        for rung, fit in fitted:
            each = zip(fit.model.tests, fit.place.residual, strict=True)
            squares = [t.observation.nrmse(r) ** 2 for t, r in each]
            lines.append(
                LawEvidence(
                    material=material,
                    law=rung.law.name,
                    tests=len(squares),
                    log_evidence=rung.log_evidence,
                    gain=None if plain is None else rung.log_evidence - plain,
                    response_nrmse=math.sqrt(math.fsum(squares) / len(squares)),
                    required=rung.law.name == ladder.chosen.law.name,
                )
            )
    return tuple(sorted(lines, key=lambda line: (line.material, -line.log_evidence)))


def parameters_of(joint: JointFit, scene: Scene) -> tuple[Row, ...]:
    """Return the rows of ``parameters.csv``: each material's law but its friction, which is in ``friction.csv``.

    The value is the one that all tests share, dimensionless in a test at the mean Y and omega; what single tests
    scatter by is in ``scatter``; ``is_told``: whether the tests determine it.
    """
    posterior, found = joint.posterior, list[Row]()
    frame = scene.rig.stiffness, scene.rig.natural_frequency
    for material in joint.materials:
        tests = joint.tests(material)
        i = tests[0]
        law, estimates, observation = posterior.law(i), posterior.parameters(i), posterior.observations[i]
        for k in map(int, posterior.tests[i].index):
            u = posterior.unknowns[k]
            if not u.law or u.name == "beta":
                continue
            (shared, slope), own = posterior.shared(k, i), estimates[u.name]
            whole = slope * math.sqrt(posterior.covariance[k, k])
            value = Estimate(shared, min(own.se or whole, whole), whole)
            factor, unit = to_physical(law.parameter(u.name), *frame, amplitude=observation.unit, turn=observation.turn)
            scatter = abs(slope) * float(posterior.fit.model.scatter[k]) if len(tests) > 1 else None
            row: dict[str, object] = {"material": material, "law": law.name, "parameter": u.name, "unit": unit}
            for name, number in (("value", value), ("physical_value", value.scaled(factor))):
                row |= {name: number.value, f"{name}_se": number.se, f"{name}_u": number.u}
            found.append(row | {"is_told": abs(shared) > 2.0 * whole or own.told, "scatter": scatter})
    return tuple(found)


def loops_of(joint: JointFit, stiffness: float | None) -> tuple[Loop, ...]:
    """Return the loops of a few tests of each material that the law explains best, slow, middling and fast."""
    observations, found = joint.posterior.observations, list[Loop]()

    def over_floor(i: int) -> float:
        return observations[i].nrmse(joint.posterior.fit.residual(i)) / observations[i].floor

    for material in joint.materials:
        order = sorted(joint.tests(material), key=lambda i: observations[i].r)
        best = [min(map(int, part), key=over_floor) for part in np.array_split(np.array(order), SHOWN) if len(part)]
        for i in best:
            observation, values = observations[i], joint.posterior.values(i)
            state = observation.state(values)
            if state is not None and state.orbit is not None:
                contact = contact_of(observation, values, state, stiffness)
                found.append(Loop(material, observation.normal_force or math.nan, observation.r, contact))
    return tuple(found)
