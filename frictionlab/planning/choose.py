"""Which tests to run: one after the other, the one that takes most from what is still not known."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SceneError, UsageError
from frictionlab.identification.coordinates import Coordinate
from frictionlab.planning.candidates import Candidate, Laboratory, candidates, laboratory
from frictionlab.planning.information import Prospect, prospect, shared_coordinates
from frictionlab.scene import Scene
from frictionlab.schema import PLANS
from frictionlab.simulator.engine import choose

FloatArray = NDArray[np.float64]
SLIDES = 300.0  # simulated for one candidate, roughly


@dataclass(frozen=True)
class PlannedTest:
    """One test of a plan, or a candidate that was not chosen (``rank`` None).

    ``expected``: law parameter -> standard error of this test alone, sensors and rig as they are known; ``expected_u``:
    the same with what is not known of them; ``cumulative`` and ``cumulative_u``: both after this and all better ones;
    ``log_bayes``: logarithm of the Bayes factor to expect, from this test alone, for the law over plain Coulomb
    friction. The friction coefficient is told as ``beta`` of this test.
    """

    rank: int | None
    frequency_ratio: float
    normal_force_n: float
    base_amplitude_m: float
    duration_s: float
    regime: str | None
    response_m: float | None
    expected: Mapping[str, float | None]
    expected_u: Mapping[str, float | None]
    cumulative: Mapping[str, float | None] | None
    cumulative_u: Mapping[str, float | None] | None
    log_bayes: float | None

    def row(self) -> dict[str, object]:
        """The contract's keys: a line of JSON or of a table."""
        return PLANS.row(self)


@dataclass(frozen=True)
class Plan:
    """A plan: ``tests``, best first; ``others``: candidates that were not chosen; ``notes``: what was assumed."""

    law: str
    tests: tuple[PlannedTest, ...]
    others: tuple[PlannedTest, ...]
    notes: tuple[str, ...]


def plan_tests(
    scene: Scene, *, law: str | None = None, tests: int = 10, measured: Sequence[Mapping[str, object]] = ()
) -> Plan:
    """Return the tests that tell most about a law's parameters, best first.

    Each next test is the one that, with all before it, leaves the least product of the parameters' uncertainties
    (D-optimality), nuisances counted. A test may be chosen again where nothing else tells more.

    Parameters
    ----------
    scene : Scene
        ``[plan]``: candidates, sensors, what is known of the friction coefficient; ``[rig]``; ``[model]``: the law and
        its expected parameters.
    law : str, optional
        In place of the scene's.
    tests : int
        How many.
    measured : sequence of mappings, optional
        Comparisons at hand (rows of `compare-numeric`): what they told is known before the first test.

    Raises
    ------
    SceneError
        A range is empty, or the bounds forbid all candidates.
    UsageError
        The law cannot be, or no candidate tells anything about it.
    """
    if tests < 1:
        raise UsageError(f"tests: expected at least 1; got {tests}")
    lab = laboratory(scene, law)
    possible = candidates(lab)
    choose(SLIDES * len(possible))
    reference = possible[len(possible) // 2]
    shared = shared_coordinates(lab, reference)
    if not any(c.law for c in shared):
        raise UsageError(f"law {lab.law.name}: the scene holds all of its parameters: there is nothing to find out")
    prospects = _allowed(lab, [prospect(lab, candidate, shared, reference) for candidate in possible])
    known = np.eye(len(shared)) + _told_before(measured, shared)
    order = _greedy([p.information for p in prospects], known, _law_rows(shared), tests)
    return _plan(lab, prospects, order, known, shared)


def _law_rows(shared: tuple[Coordinate, ...]) -> NDArray[np.bool_]:
    return np.array([c.law for c in shared])


def _allowed(lab: Laboratory, prospects: list[Prospect]) -> list[Prospect]:
    """The candidates whose motion the rig allows, and which tell anything."""
    largest = lab.scene.plan.largest_response_m
    inside = [p for p in prospects if largest is None or (p.response_m or 0.0) <= largest]
    if not inside:
        least = min((p.response_m for p in prospects if p.response_m is not None), default=math.nan)
        raise SceneError(
            f"plan.largest_response_m: {largest:g} m forbids all candidates; the least response expected is"
            f" {least:.3g} m"
        )
    if not any(p.tells for p in inside):
        raise UsageError(
            f"law {lab.law.name}: no candidate tells anything: the mass stands still or has no steady state in all of"
            " them; change normal_forces_n, base_amplitudes_m or frequency_ratios of [plan]"
        )
    return inside


def _greedy(informations: list[FloatArray], known: FloatArray, law: NDArray[np.bool_], count: int) -> list[int]:
    """Indices of the tests chosen, in order."""
    order: list[int] = []
    total = known.copy()
    stack = np.stack(informations)
    for _ in range(count):
        left = np.linalg.inv(total + stack)[:, law][:, :, law]
        size = np.linalg.slogdet(left)[1]
        best = int(np.argmin(size + 1e-9 * np.array([order.count(i) for i in range(len(size))])))
        order.append(best)
        total = total + stack[best]
    return order


def _plan(
    lab: Laboratory, prospects: list[Prospect], order: list[int], known: FloatArray, shared: tuple[Coordinate, ...]
) -> Plan:
    total, chosen = known, []
    for rank, i in enumerate(order, 1):
        total = total + prospects[i].information
        chosen.append(_test(prospects[i], known, shared, rank=rank, total=total))
    others = [_test(p, known, shared) for i, p in enumerate(prospects) if i not in order]
    return Plan(lab.law.name, tuple(chosen), tuple(others), lab.notes)


def _test(
    found: Prospect,
    known: FloatArray,
    shared: tuple[Coordinate, ...],
    *,
    rank: int | None = None,
    total: FloatArray | None = None,
) -> PlannedTest:
    candidate, told = found.candidate, found.tells
    alone = known + found.information
    return PlannedTest(
        rank=rank,
        frequency_ratio=candidate.frequency_ratio,
        normal_force_n=candidate.normal_force_n,
        base_amplitude_m=candidate.base_amplitude_m,
        duration_s=candidate.duration_s,
        regime=found.regime,
        response_m=found.response_m,
        expected=_errors(candidate, shared, _held(alone, shared), told=told),
        expected_u=_errors(candidate, shared, _free(alone, shared), told=told),
        cumulative=None if total is None else _errors(candidate, shared, _held(total, shared), told=True),
        cumulative_u=None if total is None else _errors(candidate, shared, _free(total, shared), told=True),
        log_bayes=_log_bayes(candidate, alone, shared) if told else None,
    )


def _held(precision: FloatArray, shared: tuple[Coordinate, ...]) -> FloatArray:
    """Spread of the law's coordinates with the rig and the sensors as they are known."""
    rows = np.flatnonzero(_law_rows(shared))
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(precision[np.ix_(rows, rows)]))))


def _free(precision: FloatArray, shared: tuple[Coordinate, ...]) -> FloatArray:
    """Spread of the law's coordinates with what is not known of the rig and the sensors."""
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(precision)))[_law_rows(shared)])


def _errors(
    candidate: Candidate, shared: tuple[Coordinate, ...], spread: FloatArray, *, told: bool
) -> dict[str, float | None]:
    """Standard errors of the law's parameters, in their own units at this test."""
    law = [c for c in shared if c.law]
    values = candidate.values
    slopes = [c.width * (values[c.name] if c.is_log else 1.0) for c in law]
    return {c.name: float(s * w) if told else None for c, s, w in zip(law, spread, slopes, strict=True)}


def _log_bayes(candidate: Candidate, precision: FloatArray, shared: tuple[Coordinate, ...]) -> float | None:
    """Expected evidence of the law's terms over Coulomb friction: half of chi-square less what their priors cost."""
    more = [i for i, c in enumerate(shared) if c.law and i > 0]
    if not more:
        return None
    covariance = np.linalg.inv(precision)[np.ix_(more, more)]
    away = np.array([_from_neutral(shared[i], candidate) for i in more])
    gain = 0.5 * float(away @ np.linalg.solve(covariance, away))
    return gain + 0.5 * float(np.linalg.slogdet(covariance)[1])


def _from_neutral(c: Coordinate, candidate: Candidate) -> float:
    """Coordinate of the expected value, counted from where its term does nothing."""
    return c.at(candidate.values[c.name]) - (c.low if c.folded else 0.0 if not c.is_log else -3.0)


def _told_before(measured: Sequence[Mapping[str, object]], shared: tuple[Coordinate, ...]) -> FloatArray:
    """Information of comparisons at hand, by the uncertainties that they state; nuisances are left out."""
    known = np.zeros((len(shared), len(shared)))
    for row in measured:
        parameters = row.get("parameters")
        if not isinstance(parameters, Mapping):
            continue
        for i, c in enumerate(shared):
            told = parameters.get(c.name)
            error = told.get("u") if c.law and isinstance(told, Mapping) and told.get("told") else None
            value = told.get("value") if isinstance(told, Mapping) else None
            if isinstance(error, float) and isinstance(value, float) and error > 0.0 and value != 0.0:
                scale = c.width * (abs(value) if c.is_log else 1.0)
                known[i, i] += (scale / error) ** 2
    return known
