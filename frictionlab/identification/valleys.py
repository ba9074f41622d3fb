"""Where a fit begins: the valleys of the misfit, and which of them are worth following.

A law without stiffness has its valleys over the friction ratio. A contact that holds and rings has one for each whole
ring more or less, over its stiffness; the friction ratio of each follows from the energy, because what the elastic
contact takes in of a *measured* motion is known without simulating anything.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError
from frictionlab.identification.coordinates import point_of, strains
from frictionlab.identification.fit import cost
from frictionlab.identification.forward import Forward
from frictionlab.identification.loop import (
    elastic_friction_ratios,
    energy_of,
    loop_friction_ratio,
    slid_of,
    strokes_of,
)
from frictionlab.identification.observed import EXPLAINED, Observed, parts

FloatArray = NDArray[np.float64]
SEARCH = np.geomspace(0.05, 3.0, 49)  # friction ratios tried, over the loop's
LAGS = np.linspace(-3.0, 3.0, 13)  # widths of its prior at which a lag that nobody has declared is tried
ROOTS = (1.0, 31.0)  # of the stiffness: a contact rings by it; beyond, it is rigid
ROOT_STEP = 0.6  # at most between roots tried ...
RING_STEP = 0.5  # ... and times r: rings of a stop that lasts half a cycle are 2 r apart
REFINED, FOLLOWED = 10, 3  # valleys over the stiffness whose bottom is looked for, and which are fitted
NARROWED = 8  # times that a valley's bottom is closed in
NEARLY = 30.0  # chi-square over points up to which a valley's bottom may have a deeper pit
PITS = 48  # trials over a valley's bottom
BEYOND = 1e300  # cost of what has no steady state, to a search that wants numbers
COARSE_STEP = 4.0  # between roots tried of a law that costs much a state and does not ring for long
FROM_ENERGY = {"beta", "stiffness_ratio"}  # what a search over the stiffness finds itself
FIRST_GUESSES = {"contact_damping_ratio": 0.02, "stiffness_ratio": 100.0}  # values at which a new term is tried first


def starts_of(
    measurement: Measurement, forward: Forward, observed: Observed, known: Mapping[str, float] | None = None
) -> list[FloatArray]:
    """Starting points worth following, best first; values of the law that are known about stand where they are."""
    known, free = {} if known is None else known, forward.family.free
    if "stiffness_ratio" in free:
        return _Stiffness(measurement, forward, observed, known).starts()
    return _over_friction(measurement, forward, observed)[:2] if "beta" in free else [start_at(forward, known)]


def start_at(forward: Forward, values: Mapping[str, float]) -> FloatArray:
    """Starting point: these values, a first guess for what else the law has, nuisances as they are known."""
    return point_of(forward.coordinates, FIRST_GUESSES | dict(values))


def _over_friction(measurement: Measurement, forward: Forward, observed: Observed) -> list[FloatArray]:
    """Starting points at the bottoms of the misfit over the friction ratio, best first."""
    tried = loop_friction_ratio(measurement, forward.family.wall) * SEARCH
    starts = [start_at(forward, {"beta": float(beta)}) for beta in tried]
    found = [_over_lag(forward, observed, start) for start in starts]
    starts, costs = [start for start, _ in found], np.array([least for _, least in found])
    if not np.isfinite(costs).any():
        raise AnalysisError(
            f"no friction ratio between {tried[0]:.3g} and {tried[-1]:.3g} has a steady state at"
            f" r = {forward.family.r:g}: near resonance the motion may have no bound; check the natural frequency"
            " (rig.natural_frequency_hz, --natural-frequency)"
        )
    return [starts[i] for i in _bottoms(costs)]


def _over_lag(forward: Forward, observed: Observed, start: FloatArray) -> tuple[FloatArray, float]:
    """A starting point moved along a lag that nobody has declared to where it costs least, and that cost.

    A lag of several samples hides the valley over the friction ratio; it only turns the harmonics, so that nothing more
    is simulated.
    """
    open_lag = [k for k, c in enumerate(forward.coordinates) if c.name == "lag" and math.isfinite(c.tail)]
    predicted = forward.predict(start) if open_lag else None
    if predicted is None:
        return start, cost(forward, observed, start, 1.0)
    (k,), order = open_lag, np.arange(1, forward.count + 1)
    cosine, sine = np.split(predicted, 2)
    trials = np.tile(start, (len(LAGS), 1))
    trials[:, k] = LAGS
    turned = (cosine - 1j * sine) * np.exp(1j * np.outer(forward.coordinates[k].width * LAGS, order))
    gaps = (observed.cosine_sine - parts(turned)) @ observed.whitener.T
    costs = (gaps**2).sum(axis=1) + [float((strains(forward.coordinates, trial) ** 2).sum()) for trial in trials]
    best = int(np.argmin(costs))
    return trials[best], float(costs[best])


def _bottoms(costs: FloatArray) -> list[int]:
    """Places whose neighbours cost more, best first."""
    padded = np.concatenate([[math.inf], costs, [math.inf]])
    lower = (padded[1:-1] <= padded[:-2]) & (padded[1:-1] < padded[2:]) & np.isfinite(costs)
    return sorted((int(i) for i in np.flatnonzero(lower)), key=lambda i: costs[i])


class _Stiffness:
    """The misfit over the root of the stiffness, the friction ratio following from the energy."""

    def __init__(
        self, measurement: Measurement, forward: Forward, observed: Observed, known: Mapping[str, float]
    ) -> None:
        self.forward, self.observed, self.known = forward, observed, known
        wall, self.energy, self.strokes = forward.family.wall, None, np.ones(1)
        if "beta" in forward.family.free:
            slid = slid_of(measurement, wall)
            damping = known.get("contact_damping_ratio", 0.0) * forward.family.r
            self.energy = energy_of(measurement, wall) - _drained(slid, damping)
            self.strokes = strokes_of(slid)

    def starts(self) -> list[FloatArray]:
        """The deepest valleys of each branch, best first."""
        exact = self.forward.family.law.kind == "elastic"
        step = min(ROOT_STEP, RING_STEP * self.forward.family.r) if exact else COARSE_STEP
        roots = np.linspace(*ROOTS, 1 + math.ceil((ROOTS[1] - ROOTS[0]) / step))
        bottoms = [bottom for branch in (0, 1) for bottom in self._of_branch(branch, roots, closed_in=exact)]
        deepest = sorted(bottoms)[:FOLLOWED]
        if exact and deepest and self._nearly(*deepest[0]):
            deepest = sorted(self._searched(*bottom, step) for bottom in deepest)
        starts = [self._start(root, branch) for _, root, branch in deepest]
        return [start for start in starts if start is not None] or [start_at(self.forward, self.known)]

    def _nearly(self, found: float, root: float, branch: int) -> bool:
        """Whether a valley's bottom misses the cycle by so little that a pit in it may explain it."""
        start = self._start(root, branch)
        predicted = None if start is None else self.forward.predict(start)
        if predicted is None or found > NEARLY * len(self.observed.cosine_sine):
            return False
        return self.observed.nrmse(self.observed.cosine_sine - predicted) > EXPLAINED * self.observed.floor

    def _searched(self, found: float, root: float, branch: int, step: float) -> tuple[float, float, int]:
        """The deepest pit of a valley's bottom: a few crests that just slip, or just not, make it rough."""
        roots = root + step * np.linspace(-1.5, 1.5, PITS)
        return min((found, root, branch), *((self._cost(at, branch), float(at), branch) for at in roots))

    def _of_branch(self, branch: int, roots: FloatArray, *, closed_in: bool) -> list[tuple[float, float, int]]:
        """Cost, root and branch of the deepest valleys' bottoms."""
        costs = np.array([self._cost(root, branch) for root in roots])
        bottoms = [(float(costs[i]), float(roots[i])) for i in _bottoms(costs)[:REFINED]]
        if closed_in:
            step = float(roots[1] - roots[0])
            bottoms = [min(bottom, self._closed_in(bottom[1], step, branch)) for bottom in bottoms]
        return [(found, root, branch) for found, root in bottoms]

    def _closed_in(self, root: float, step: float, branch: int) -> tuple[float, float]:
        """Cost and root of the bottom of a valley within a step on either side of a trial."""
        found = minimize_scalar(
            lambda at: min(self._cost(at, branch), BEYOND),
            bounds=(max(root - step, 0.5 * ROOTS[0]), root + step),
            method="bounded",
            options={"maxiter": NARROWED, "xatol": 1e-3 * step},
        )
        return float(found.fun), float(found.x)

    def _cost(self, root: float, branch: int) -> float:
        start = self._start(root, branch)
        return math.inf if start is None else cost(self.forward, self.observed, start, 1.0)

    def _start(self, root: float, branch: int) -> FloatArray | None:
        """The starting point of a stiffness; None where no friction ratio gives the energy with it."""
        values = {**self.known, "stiffness_ratio": float(root) ** 2}
        if self.energy is None:
            return start_at(self.forward, values) if branch == 0 else None
        ratios = elastic_friction_ratios(self.strokes, self.energy, float(root) ** 2)
        return start_at(self.forward, values | {"beta": ratios[branch]}) if branch < len(ratios) else None


def _drained(slid: FloatArray, damping: float) -> float:
    """Energy per cycle (k Y^2) that a dashpot of a damping ratio times r takes in of a motion (p,)."""
    lines = np.fft.rfft(slid)[1:] * (2.0 / len(slid))
    order = np.arange(1, len(lines) + 1)
    return 2.0 * damping * math.pi * float(np.sum((order * np.abs(lines)) ** 2))
