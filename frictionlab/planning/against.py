"""Two laws told apart: the evidence to expect if the one holds and the other is fitted to what it shows, both ways.

What a test would show under one law is fitted with the other by the inference itself, sensors and rig beside it, so
that what a lag or a detuned frame explains does not count. The cycle fitted is free of noise: noise adds as much to
both laws.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import FrictionlabError, UsageError
from frictionlab.inference.fit import log_evidence
from frictionlab.inference.posterior import infer
from frictionlab.planning.candidates import Laboratory
from frictionlab.planning.virtual_test import Reference, VirtualTest, values_in, virtual_test
from frictionlab.simulator.laws import law_of

if TYPE_CHECKING:
    from frictionlab.planning.choose import Limits

NEAR = 12  # candidates of a choice between two laws to which both are fitted, at least
MOST_STEPS = 12  # of a fit: the evidence need not be known better


def evidence_over(lab: Laboratory, reference: Reference, test: VirtualTest, other: str) -> float | None:
    """Return the logarithm of the Bayes factor to expect for the laboratory's law over another, of one test.

    None where the test says nothing, the two laws are one, or the other has no steady state near.
    """
    law = law_of(other)
    if test.observation is None or test.posterior is None or law.name == lab.law.name:
        return None
    values = values_in(lab, reference, test.candidate)
    near = {p.name: values[p.name] for p in law.own if p.name in values}
    try:
        rival = infer([test.observation.under(law, {})], near=near, most=MOST_STEPS)
    except (FrictionlabError, ArithmeticError, np.linalg.LinAlgError):
        return None
    return log_evidence(test.posterior.fit) - log_evidence(rival.fit)


@dataclass(frozen=True)
class Between:
    """Two laws to be told apart, over all candidates.

    ``evidence``, ``back`` (n,): logarithm of the Bayes factor to expect if the laboratory's law holds, and if the other
    does; NaN where it was not judged.
    """

    lab: Laboratory
    other: Laboratory
    reference: Reference
    tests: Sequence[VirtualTest]
    others: Sequence[VirtualTest]
    limits: "Limits"
    evidence: FloatArray
    back: FloatArray

    @classmethod
    def of(
        cls, lab: Laboratory, reference: Reference, tests: Sequence[VirtualTest], against: str, limits: "Limits"
    ) -> "Between":
        """Return two laws ready to be told apart, fitted to the candidates whose cycles differ most.

        Raises
        ------
        UsageError
            The other law cannot be, is the same, or nothing tells it.
        """
        other = lab.under(against)
        if other.law.name == lab.law.name:
            raise UsageError(f"against: law {against} is the one that is planned for: name another one")
        others = [virtual_test(other, reference, test.candidate) for test in tests]
        apart = np.array([_apart(one, two) for one, two in zip(tests, others, strict=True)])
        if not np.isfinite(apart).any():
            raise UsageError(
                f"against: no candidate has a steady motion under both {lab.law.name} and {other.law.name}: change"
                " normal_forces_n, base_amplitudes_m or frequency_ratios of [plan]"
            )
        apart = np.where(limits.allowed, apart, -math.inf)
        if not np.isfinite(apart).any():
            raise UsageError(
                f"against: the candidates that plan.largest_response_m allows tell nothing of {against}: allow a larger"
                " response, or change the ranges of [plan]"
            )
        none = np.full(len(tests), np.nan)
        found = cls(lab, other, reference, tests, others, limits, none, none)
        rate = apart / limits.time.more([])
        some = [int(i) for i in np.argsort(-rate)[: max(NEAR, 2 * limits.tests)] if np.isfinite(rate[i])]
        near = np.zeros(len(tests), dtype=bool)
        near[some] = True
        return replace(found.judged(np.array(some)), limits=replace(limits, allowed=limits.allowed & near))

    def judged(self, some: NDArray[np.intp]) -> "Between":
        """Return the same with the evidence of some more tests, each law fitted to what the other shows."""
        evidence, back = self.evidence.copy(), self.back.copy()
        for i in some:
            if np.isnan(evidence[i]):
                one = evidence_over(self.lab, self.reference, self.tests[i], self.other.law.name)
                two = evidence_over(self.other, self.reference, self.others[i], self.lab.law.name)
                evidence[i], back[i] = (0.0 if value is None else value for value in (one, two))
        return replace(self, evidence=evidence, back=back)

    def gain(self, order: Sequence[int]) -> FloatArray:
        """What each candidate (n,) adds to tests chosen: growth of the evidence in proportion, both ways alike."""
        total = np.zeros(len(self.tests))
        for way in (np.nan_to_num(self.evidence), np.nan_to_num(self.back)):
            so_far = float(way[np.asarray(order, dtype=np.intp)].sum())
            total += np.log1p(np.maximum(so_far + way, 0.0)) - math.log1p(max(so_far, 0.0))
        return np.where(np.isnan(self.evidence), -math.inf, total)

    def row(self, i: int, order: Sequence[int] | None) -> dict[str, float | None]:
        """Return the evidence of a test for the columns of a plan."""
        one, two = (None if math.isnan(way[i]) else float(way[i]) for way in (self.evidence, self.back))
        after = None
        if order is not None:
            after = min(float(np.nan_to_num(way)[list(order)].sum()) for way in (self.evidence, self.back))
        return {"log_bayes": one, "log_bayes_against": two, "log_bayes_after": after}


def _apart(one: VirtualTest, two: VirtualTest) -> float:
    """Distance of the cycles of two laws in the noise's own units, what the second's unknowns explain taken out."""
    if one.observation is None or two.observation is None or two.posterior is None:
        return -math.inf
    gap = one.observation.white(one.observation.data - two.observation.data[: len(one.observation.data)])
    slopes = two.posterior.fit.place.slopes[0]
    if len(slopes) != len(gap):
        return 0.5 * float(gap @ gap)
    step = np.linalg.solve(slopes.T @ slopes + np.eye(slopes.shape[1]), slopes.T @ gap)
    left = gap - slopes @ step
    return 0.5 * float(left @ left + step @ step)
