"""One fit to the cycles of many tests: Gauss-Newton on quadratic forms, linearised anew where a test has moved.

Each round every test is a quadratic form about where it was last simulated; `mixed` finds the shared unknowns and the
scatter from test to test; tests whose unknowns moved by more than a part of an error are simulated again. As in a
single comparison (`identification`), sensors and rig are fitted beside the law, and held as known where the law alone
leaves no more than noise; what a law cannot explain in a test counts as noise of that test.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from frictionlab.campaign.cycles import Cycle
from frictionlab.campaign.mixed import Mixed, Others, Piece, Solution
from frictionlab.campaign.scores import Noise, Stated, noise_by_cycles
from frictionlab.campaign.shared import FRICTION, Place, Shared, shared_by
from frictionlab.campaign.spread import Spread, spread_of
from frictionlab.errors import AnalysisError
from frictionlab.identification.coordinates import STRONGEST, Coordinate, doubts, holds, strains
from frictionlab.identification.engines import STATES, prepare
from frictionlab.identification.fit import Fit, excess_of, half_lines
from frictionlab.identification.fit_errors import noise_of
from frictionlab.identification.forward import Forward
from frictionlab.simulator.laws import Law

FloatArray = NDArray[np.float64]
ROUNDS = 25
MOVED = 1e-4  # squared errors that a test has moved by, from which it is simulated again ...
EXACT = 1e-10  # ... of few tests, which are held against single comparisons
FEW = 3
MANY = 4  # tests beyond one a group, from which they show by themselves how sure they are
BENT = 0.01  # squared errors that a test has moved by, from which its slopes are found anew
DAMPINGS = 8  # tried, each ten times the one before
GENTLE = 1e-3  # the first of them, over the curvature
WEIGHINGS = 3  # of what a law cannot explain in a test


@dataclass(frozen=True)
class Joint:
    """Tests fitted together under one law.

    ``cycles``, ``fits``: the tests, and each at its own unknowns; ``places``: where these stand among the shared;
    ``lost``: tests that have no steady state there; ``on_one_rig``: how sure the shared unknowns are by the tests of
    all materials, which share a rig.
    """

    shared: Shared
    cycles: tuple[Cycle, ...]
    places: tuple[Place, ...]
    fits: tuple[Fit, ...]
    solution: Solution
    lost: tuple[str, ...] = ()
    on_one_rig: Spread | None = None

    @property
    def values(self) -> dict[str, float]:
        """Values of the law's parameters but the friction ratios, of the test that stands for all."""
        told = zip(self.shared.coordinates, self.solution.point, strict=True)
        return {c.name: c.value(float(p)) for c, p in told if c.law and c.name != FRICTION}

    @property
    def start(self) -> dict[str, float]:
        """Values at which another fit may begin: the law's but the friction ratios, and the nuisances."""
        told = zip(self.shared.coordinates, self.solution.point, strict=True)
        return {c.name: c.value(float(p)) for c, p in told if c.name != FRICTION}

    @property
    def apart(self) -> dict[str, float]:
        """How far each test's friction ratio stands from its group's, in deviations of its prior, by source."""
        told = zip(self.cycles, self.solution.beyond, strict=True)
        return {cycle.source: float(far) for cycle, far in told}

    @property
    def frictions(self) -> dict[tuple[str, float], float]:
        """Friction ratio of each group, of the test that stands for all."""
        told = zip(self.shared.groups, self.shared.coordinates, self.solution.point, strict=False)
        return {group: c.value(float(p)) for group, c, p in told if c.name == FRICTION}

    @property
    def chi_square(self) -> float:
        """What all tests leave."""
        return math.fsum(found.chi_square for found in self.fits)

    def cost(self, weights: "Joint") -> float:
        """What was made least, each test weighed as in another fit: costs weighed apart cannot be compared."""
        excess = {c.source: f.excess for c, f in zip(weights.cycles, weights.fits, strict=True)}
        told = zip(self.cycles, self.fits, strict=True)
        return math.fsum(f.chi_square / excess.get(c.source, f.excess) for c, f in told) + 2.0 * self.strain

    @property
    def strain(self) -> float:
        """Half the sum of squares that all priors add."""
        point = self.solution.point
        shared = float((strains(self.shared.coordinates, point) ** 2 - self.solution.hold * point**2).sum())
        return self.solution.strain + 0.5 * shared

    @property
    def pieces(self) -> list[Piece]:
        """The tests as quadratic forms."""
        return [_piece(found, place) for found, place in zip(self.fits, self.places, strict=True)]

    @property
    def freedom(self) -> int:
        """Tests that tell how far tests are from each other."""
        return max(0, len(self.fits) - len(self.shared.groups))

    @cached_property
    def meat(self) -> tuple[Noise, ...]:
        """What noise, the scatter of its cycles and what the law misses do to each test's score.

        Few tests are as cautious as a single comparison. Many show by themselves how sure each of them is: what one
        states too little is in the scatter, and in `spread`'s floor.
        """
        if self.freedom >= MANY:
            return tuple(noise_by_cycles(one) for one in self.fits)
        found: list[Noise] = []
        for one, cycle in zip(self.fits, self.cycles, strict=True):
            plain = replace(one, observed=cycle.fresh().observed)  # what is reckoned on the way is not kept
            found.append(Stated(plain.precision @ noise_of(plain) @ plain.precision))
        return tuple(found)

    @cached_property
    def spread(self) -> Spread:
        """How sure the shared unknowns are; many tests show it where they are less sure than stated."""
        if self.on_one_rig is not None:
            return self.on_one_rig
        doubt = doubts(self.shared.coordinates, self.solution.point)
        return spread_of(self.solution, self.pieces, self.meat, doubt, robust=self.freedom >= MANY)

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence (Laplace) of fits whose excess is 1; shared unknowns count once."""
        total = sum(c.log_peak for c in self.shared.coordinates) - self.solution.volume - self.strain
        for found in self.fits:
            total += float(np.log(np.diag(found.observed.whitener)).sum()) - 0.5 * found.chi_square
            total -= 0.5 * len(found.residual) * math.log(2.0 * math.pi)
        return total + half_lines(self.shared.coordinates, self.solution.point, self.solution.precision, self.slope)

    @property
    def slope(self) -> FloatArray:
        """Slope (S,) of minus the cost over the shared unknowns; zero but where one is held at its bound."""
        of_tests = sum(
            place.scale.T @ (found.jacobian.T @ found.residual / found.excess)
            for found, place in zip(self.fits, self.places, strict=True)
        )
        return np.asarray(of_tests - self.solution.hold * self.solution.point)


def _piece(found: Fit, place: Place) -> Piece:
    return piece_of(found.jacobian, found.residual, found.point, place, found.excess)


def piece_of(jacobian: FloatArray, residual: FloatArray, point: FloatArray, place: Place, excess: float = 1.0) -> Piece:
    """What a test says by its whitened slopes and residual at a point."""
    information = jacobian.T @ jacobian / excess
    slope = jacobian.T @ residual / excess
    level = -0.5 * float(residual @ residual) / excess - float(slope @ point) - 0.5 * float(point @ information @ point)
    return Piece(information, slope + information @ point, place, level)


def fit_together(
    cycles: Sequence[Cycle],
    law: Law,
    start: Mapping[str, float],
    frictions: Mapping[tuple[str, float], float],
    *,
    rig: bool = True,
    tempered: bool = True,
    scatter: float | None = None,
    apart: Mapping[str, float] | None = None,
    uneven: Mapping[str, float] | None = None,
) -> Joint:
    """Fit one law to the cycles of many tests.

    Parameters
    ----------
    cycles : sequence of Cycle
    law : Law
    start : mapping of str to float
        Where the law's parameters and the nuisances begin; what is not given begins where it is known to be.
    frictions : mapping
        Friction ratio of each group to begin with.
    rig : bool
        Whether sensors and rig are fitted beside the law, or are as they are known.
    tempered : bool
        Whether what the law cannot explain in a test counts as its noise.
    scatter : float, optional
        From test to test, in deviations of the friction ratio's prior; it is found unless it is given.
    apart : mapping, optional
        How far each test's friction ratio stands from its group's to begin with, in the same deviations, by source.
    uneven : mapping, optional
        By how much other parameters of the law scatter from test to test, in deviations of their priors.

    Raises
    ------
    AnalysisError
        No test has a steady state where the fit begins.
    """
    shared = shared_by(cycles, law, rig=rig, uneven=uneven)
    prepare(cycles[0].family.under(law), STATES * len(cycles))
    point = _start(shared, start, frictions)
    return _State.at(shared, cycles, point, apart or {}).best(scatter, tempered=tempered)


def fit_again(joint: Joint, others: Others) -> Joint:
    """Fit the same tests on from where they are, with what other tests say of the shared unknowns."""
    state = _State(joint.shared, joint.cycles, joint.places, joint.fits, joint.solution.point, joint.lost, others)
    return state.best(None, tempered=True)


def cost_at(
    cycles: Sequence[Cycle],
    law: Law,
    start: Mapping[str, float],
    frictions: Mapping[tuple[str, float], float],
    apart: Mapping[str, float],
) -> float:
    """Misfit of all tests, and what the priors add, where a fit would begin; infinite without steady states."""
    shared = shared_by(cycles, law)
    point, total = _start(shared, start, frictions), 0.0
    for cycle in cycles:
        place, forward = shared.place(cycle), cycle.forward(law)
        residual = cycle.residual(forward, _own(cycle, place, forward, point, apart))
        total += math.inf if residual is None else float(residual @ residual)
    return total + float((strains(shared.coordinates, point) ** 2).sum())


def _start(shared: Shared, start: Mapping[str, float], frictions: Mapping[tuple[str, float], float]) -> FloatArray:
    point = np.array([max(0.0, c.low) for c in shared.coordinates])
    for i, c in enumerate(shared.coordinates):
        if c.name == FRICTION:
            point[i] = c.at(frictions[shared.groups[i]])
        elif c.name in start:
            point[i] = np.clip(c.at(start[c.name]), c.low, c.high)
    return point


def _own(cycle: Cycle, place: Place, forward: Forward, point: FloatArray, apart: Mapping[str, float]) -> FloatArray:
    """A test's own unknowns where a fit begins."""
    own = place.scale @ point + place.offset
    if place.friction is not None:
        own[place.friction] += apart.get(cycle.source, 0.0)
    return _inside(forward.coordinates, own)


@dataclass(frozen=True)
class _State:
    """Where a fit stands: the shared unknowns, and each test simulated at its own."""

    shared: Shared
    cycles: tuple[Cycle, ...]
    places: tuple[Place, ...]
    fits: tuple[Fit, ...]
    point: FloatArray
    lost: tuple[str, ...]
    others: Others | None = None

    @classmethod
    def at(cls, shared: Shared, cycles: Sequence[Cycle], point: FloatArray, apart: Mapping[str, float]) -> "_State":
        """Simulate each test where the shared unknowns stand; those without a steady state there are lost."""
        kept, lost = [], []
        for cycle in cycles:
            place, forward = shared.place(cycle), cycle.forward(shared.law, rig=shared.rig)
            found = cycle.at(forward, _own(cycle, place, forward, point, apart))
            if found is None:
                lost.append(cycle.source)
            else:
                kept.append((cycle, place, found))
        if not kept:
            raise AnalysisError(f"law {shared.law.name}: no test has a steady state at the values tried")
        cycles_, places, fits = zip(*kept, strict=True)
        return cls(shared, cycles_, places, fits, point, tuple(lost))

    def best(self, scatter: float | None, *, tempered: bool) -> Joint:
        """Go on until no test moves."""
        state, damping = self, 0.0
        for _ in range(ROUNDS):
            state = state.weighed() if tempered else state
            state, damping, moved = state.towards(scatter, damping)
            if not moved:
                break
        return state.joint(scatter)

    def weighed(self) -> "_State":
        """Count what the law cannot explain in a test as its noise."""
        return replace(self, fits=tuple(_weighed(found) for found in self.fits))

    def solved(self, scatter: float | None, damping: float = 0.0) -> Solution:
        """The best unknowns by the quadratic forms, each test held back by a damping [Marquardt 1963]."""
        low = np.array([c.low for c in self.shared.coordinates])
        pieces = [_piece(found, place) for found, place in zip(self.fits, self.places, strict=True)]
        damped = [_damped(p, f.point, damping) for p, f in zip(pieces, self.fits, strict=True)]
        return Mixed(damped, low, holds(self.shared.coordinates, self.point), self.others).solve(scatter)

    def towards(self, scatter: float | None, damping: float) -> tuple["_State", float, bool]:
        """Go to where the quadratic forms are best, held back as far as that must be to be better in truth.

        Returns the state there, the damping to go on with, and whether any test moved.
        """
        tau = self.solved(scatter).scatter if scatter is None else scatter
        before = _cost(self, tau)
        for _ in range(DAMPINGS):
            there = self.solved(tau, damping)
            moves = EXACT if len(self.fits) <= FEW else MOVED
            tried = [_tried(*test, moves) for test in zip(self.cycles, self.fits, there.own, strict=True)]
            if all(one is not None for one in tried):
                moved = replace(self, point=there.point, fits=tuple(one for one in tried if one is not None))
                if _cost(moved, tau) <= before + 1e-9 * (1.0 + abs(before)):
                    pairs = list(zip(moved.fits, self.fits, strict=True))
                    bent = [_is_bent(one, two, moves) for one, two in pairs]
                    any_moved = any(one is not two for one, two in pairs)
                    return _sloped(moved, bent), 0.1 * damping if damping > GENTLE else 0.0, any_moved
            damping = max(10.0 * damping, GENTLE)
        return self, damping, False

    def joint(self, scatter: float | None) -> Joint:
        """The result."""
        solution = self.solved(scatter)
        return Joint(self.shared, self.cycles, self.places, self.fits, solution, self.lost)


def _sloped(state: _State, again: Sequence[bool]) -> _State:
    """Find the slopes of the tests that have moved."""
    tests = zip(state.cycles, state.fits, again, strict=True)
    return replace(state, fits=tuple(cycle.sloped(found) if moved else found for cycle, found, moved in tests))


def _cost(state: _State, scatter: float) -> float:
    """Misfit of all tests, and what priors and scatter add."""
    total = float((strains(state.shared.coordinates, state.point) ** 2).sum())
    total += 0.0 if state.others is None else state.others.cost(state.point)
    for found, place in zip(state.fits, state.places, strict=True):
        total += found.chi_square / found.excess + place.strain(found.point, state.point)
        if place.friction is not None and scatter > 0.0:
            far = found.point - place.scale @ state.point - place.offset
            total += float(far[place.friction] / scatter) ** 2
    return total


def _damped(piece: Piece, point: FloatArray, damping: float) -> Piece:
    if damping == 0.0:
        return piece
    held = damping * np.diag(piece.information)
    return replace(piece, information=piece.information + np.diag(held), score=piece.score + held * point)


def _tried(cycle: Cycle, found: Fit, own: FloatArray, moves: float) -> Fit | None:
    """A test at other values, its slopes as they were; the same where it hardly moves, None without a steady state."""
    point = _inside(found.coordinates, own)
    way = found.jacobian @ (point - found.point)
    if float(way @ way) / found.excess < moves:
        return found
    residual = cycle.residual(found.forward, point)
    return None if residual is None else replace(found, point=point, residual=residual)


def _is_bent(here: Fit, before: Fit, moves: float) -> bool:
    """Whether a test has gone so far that its slopes are to be found anew; those of few tests always are."""
    if here is before:
        return False
    way = before.jacobian @ (here.point - before.point)
    return moves == EXACT or float(way @ way) / here.excess > BENT


def _inside(coordinates: Sequence[Coordinate], own: FloatArray) -> FloatArray:
    low, high = (np.array(side) for side in zip(*((c.low, min(c.high, STRONGEST)) for c in coordinates), strict=True))
    return np.asarray(np.clip(own, low, high))


def _weighed(found: Fit) -> Fit:
    """The fit with its excess: chi-square per degree of freedom at the test's own best values, at least 1."""
    excess = 1.0
    for _ in range(WEIGHINGS):
        best = _own_best(replace(found, excess=excess))
        worse = excess_of(best)
        if worse < 1.1 * excess:
            break
        excess = worse
    return replace(found, excess=excess)


def _own_best(found: Fit) -> Fit:
    """Where this test alone would go, by its quadratic form."""
    step = np.linalg.solve(found.precision, found.jacobian.T @ found.residual / found.excess - found.hold * found.point)
    return replace(found, point=found.point + step, residual=found.residual - found.jacobian @ step)
