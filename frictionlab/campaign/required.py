"""Which contact law the tests of a material require together.

From plain Coulomb friction on, each term that a rigid contact may have is first *screened*: its slopes at the best fit
of the present law tell by how much the evidence of all tests would rise if they were straight lines, at the cost of a
few steady states a test. A law that this finds worth it is fitted to all tests. It is required if the joint evidence
rises by more than in a single ladder (`REQUIRED`), where shared unknowns pay once for all tests, and if tests left out
are predicted better by more than their error.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.campaign.cycles import Cycle
from frictionlab.campaign.joint import Joint, cost_at, fit_together, piece_of
from frictionlab.campaign.mixed import Mixed, Piece
from frictionlab.campaign.shared import FRICTION, Shared, shared_by
from frictionlab.errors import AnalysisError
from frictionlab.identification.coordinates import of_parameter, point_of
from frictionlab.identification.fit import half_priors
from frictionlab.identification.ladder import CHEAP, REQUIRED, laws_above, trial_values
from frictionlab.simulator.laws import Law, law_of

FloatArray = NDArray[np.float64]
WORTH = 1.0  # gain of log evidence by straight lines from which a law is fitted
MOST = 3  # laws fitted above one
ASTRAY = 100.0  # log evidence below that of a law which it holds: such a fit has lost its way and tells nothing
CLEAR = 10.0  # log likelihood of a test left out beyond which more says no more: none outweighs the rest
SURE = 2.0  # errors by which many tests left out must be predicted better: one or two alone never are
FOLDS = 5  # parts that tests are left out in


@dataclass(frozen=True)
class Rung:
    """One law for all tests of a material.

    ``log_evidence``: joint; ``left_out`` (n,): logarithm of the likelihood of each test as predicted by others;
    ``required``: over the simpler laws; ``joint``: the fit, None where the law was screened alone.
    """

    law: Law
    log_evidence: float
    left_out: FloatArray | None
    required: bool
    joint: Joint | None

    @property
    def nrmse(self) -> float | None:
        """Rms over the tests of what the law leaves of the cycle."""
        if self.joint is None:
            return None
        return math.sqrt(float(np.mean([found.nrmse**2 for found in self.joint.fits])))


def climb_together(cycles: Sequence[Cycle], frictions: Mapping[tuple[str, float], float]) -> tuple[list[Rung], Rung]:
    """Return all laws with exact slides that are worth a trial, and the one that the tests require together.

    Raises
    ------
    AnalysisError
        Not even Coulomb friction has a steady state near these friction ratios.
    """
    first = cycles[0].family.under_plain_coulomb().law
    rungs = [replace(rung_of(cycles, first, [{}], frictions, ()), required=True)]
    here, left = rungs[0], dict[str, Rung]()
    while True:
        singles, pairs = (_screened(here, count) for count in (1, 2))
        left |= {name: _unfitted(here, name, gain) for name, gain in {**singles, **pairs}.items()}
        rungs += _fitted(cycles, here, singles, rungs)
        good = _good(here, rungs, 1)
        if not good:
            rungs += _fitted(cycles, here, pairs, rungs)
            good = _good(here, rungs, 2)
        if not good:
            seen = {rung.law.name for rung in rungs} | {name for name, gain in singles.items() if gain > WORTH}
            return [*rungs, *(rung for name, rung in left.items() if name not in seen)], here
        here = max(good, key=lambda rung: rung.log_evidence)


def _good(here: Rung, rungs: Sequence[Rung], count: int) -> list[Rung]:
    """The laws with so many more terms that the tests require."""
    more = [rung for rung in rungs if rung.required and _above(rung.law, here.law)]
    return [rung for rung in more if len(rung.law.terms) == len(here.law.terms) + count]


def _fitted(cycles: Sequence[Cycle], here: Rung, screened: Mapping[str, float], rungs: Sequence[Rung]) -> list[Rung]:
    """The rungs of those laws that screening finds worth a trial, the best of them."""
    seen = {rung.law.name for rung in rungs}
    worth = sorted((gain, name) for name, gain in screened.items() if gain > WORTH and name not in seen)
    tried = (_tried(cycles, here, law_of(name), rungs) for _, name in worth[: -MOST - 1 : -1])
    return [rung for rung in tried if rung is not None]


def _above(law: Law, here: Law) -> bool:
    """Whether a law has all terms of another and more: it is screened anew from there."""
    return {t.name for t in law.terms} > {t.name for t in here.terms}


def _unfitted(here: Rung, name: str, gain: float) -> Rung:
    return Rung(law_of(name), here.log_evidence + gain, None, required=False, joint=None)


def _tried(cycles: Sequence[Cycle], here: Rung, law: Law, rungs: Sequence[Rung]) -> Rung | None:
    """The rung of a law fitted from the one below; None where it has no steady states."""
    if here.joint is None:
        return None
    known = here.joint.start
    new = [of_parameter(p) for p in law.own if p.name not in known and p.name != FRICTION]
    starts = [known | {c.name: law.parameter(c.name).neutral or 0.0 for c in new}]
    starts += [known | values for values in trial_values(new)]
    try:
        rung = rung_of(cycles, law, starts, here.joint.frictions, rungs, here.joint.apart)
    except (AnalysisError, np.linalg.LinAlgError):
        return None
    return rung if rung.log_evidence > here.log_evidence - ASTRAY else None


def rung_of(
    cycles: Sequence[Cycle],
    law: Law,
    starts: Sequence[Mapping[str, float]],
    frictions: Mapping[tuple[str, float], float],
    rungs: Sequence[Rung],
    apart: Mapping[str, float] | None = None,
) -> Rung:
    """Fit a law to all tests, from the best of some starts, and hold it against simpler ones.

    Raises
    ------
    AnalysisError
        No test has a steady state where the fit begins.
    """
    start = starts[0]
    if len(starts) > 1:
        start = min(starts, key=lambda values: cost_at(cycles, law, values, frictions, apart or {}))
    joint = fit_together(cycles, law, start, frictions, tempered=False, apart=apart)
    simpler = [rung for rung in rungs if _above(law, rung.law) and rung.joint is not None]
    left, evidence = _left_out(joint), joint.log_evidence
    best = max(simpler, key=lambda rung: rung.log_evidence, default=None)
    rung = Rung(law, evidence, left, required=False, joint=joint)
    required = best is not None and evidence - best.log_evidence > REQUIRED and predicts_better(rung, best)
    return replace(rung, required=required)


def predicts_better(rung: Rung, simpler: Rung) -> bool:
    """Whether tests left out are predicted better by more than their error; a single test leaves none out."""
    if rung.left_out is None or rung.joint is None or simpler.left_out is None or simpler.joint is None:
        return False
    if len(rung.left_out) < 2:
        return True
    before = dict(zip([c.source for c in simpler.joint.cycles], simpler.left_out, strict=True))
    told = zip(rung.joint.cycles, rung.left_out, strict=True)
    gain = np.array([here - before[c.source] for c, here in told if c.source in before])
    gain = np.clip(gain, -CLEAR, CLEAR)
    sure = min(SURE, 0.5 * math.sqrt(len(gain)))
    return len(gain) > 1 and float(gain.mean()) > sure * float(gain.std(ddof=1)) / math.sqrt(len(gain))


def _left_out(joint: Joint) -> FloatArray:
    count = len(joint.fits)
    low = np.array([c.low for c in joint.shared.coordinates])
    folds = [np.arange(first, count, min(FOLDS, count)) for first in range(min(FOLDS, count))]
    if count < 2:
        return np.zeros(count)
    return Mixed(joint.pieces, low, joint.solution.hold).left_out(joint.solution.scatter, folds)


def _screened(here: Rung, count: int) -> dict[str, float]:
    """By how much the log evidence would rise under laws with so many more terms, were their slopes straight lines."""
    joint = here.joint
    names = [t for t in CHEAP if not here.law.has(t)]
    if joint is None or not names or here.law.kind != "rigid":
        return {}
    full = law_of(laws_above(here.law, tuple(names), len(names))[0])
    richer = [_Richer.of(cycle, joint, i, full) for i, cycle in enumerate(joint.cycles)]
    shared = shared_by(joint.cycles, full)
    places = [shared.place(cycle) for cycle in joint.cycles]
    pieces = [piece_of(r.jacobian, r.residual, r.point, p) for r, p in zip(richer, places, strict=True)]
    known = dict(zip(joint.shared.names, joint.solution.hold.tolist(), strict=True))
    hold = np.array([known.get(c.name, 1.0) for c in shared.coordinates])
    before = _linear(pieces, shared, here.law, hold)
    laws = laws_above(here.law, tuple(names), count)
    return {name: _linear(pieces, shared, law_of(name), hold) - before for name in laws}


def _linear(pieces: Sequence[Piece], shared: Shared, law: Law, hold: FloatArray) -> float:
    """Logarithm of the likelihood of straight lines under a law that is a part of the shared one."""
    names = {p.name for p in law.own}
    keep = np.array([not c.law or c.name in names for c in shared.coordinates])
    low = np.array([c.low for c in shared.coordinates])[keep]
    fewer = [replace(p, place=replace(p.place, scale=p.place.scale[:, keep])) for p in pieces]
    mixed = Mixed(fewer, np.full(len(low), -np.inf), hold[keep])
    tau = mixed.likeliest_scatter()
    solution = mixed.solve(tau)
    total = mixed.log_likelihood(tau)
    kept = [c for c, is_kept in zip(shared.coordinates, keep, strict=True) if is_kept]
    covariance: FloatArray = np.asarray(np.linalg.inv(solution.precision), dtype=np.float64)
    return total + float(half_priors(kept, solution.point, covariance))


@dataclass(frozen=True)
class _Richer:
    """A test under a law with more terms, at values where these do nothing."""

    point: FloatArray
    residual: FloatArray
    jacobian: FloatArray

    @classmethod
    def of(cls, cycle: Cycle, joint: Joint, i: int, law: Law) -> "_Richer":
        """Add the slopes of the new terms to those that are known."""
        found, forward = joint.fits[i], cycle.forward(law)
        known = [c.name for c in found.coordinates]
        point = point_of(forward.coordinates, found.values)
        new = [k for k, c in enumerate(forward.coordinates) if c.name not in known]
        for k in new:
            neutral = law.parameter(forward.coordinates[k].name).neutral
            point[k] = forward.coordinates[k].at(neutral or 0.0)
        jacobian = np.zeros((len(found.residual), len(point)))
        for k, c in enumerate(forward.coordinates):
            if c.name in known:
                jacobian[:, k] = found.jacobian[:, known.index(c.name)]
        here = np.linalg.solve(found.observed.whitener, -found.residual) + found.observed.cosine_sine
        jacobian[:, new] = found.observed.whitener @ forward.jacobian(point, here, new)
        return cls(point, found.residual, jacobian)
