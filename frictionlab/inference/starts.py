"""Where a fit begins: the friction ratio read off the loop, and the minima of the misfit that are worth following.

``E = beta * path`` for any Coulomb steady state, which is ``beta = E / (4 X)`` for cycles with two turning points, eq.
(2.23). A contact of stiffness kappa yields by 2 beta / kappa at each turn before it slips, so a closed stroke of length
D takes in ``2 beta (D - 2 beta / kappa)`` (Masing); the strokes of a motion of many turns are those of the rainflow
count. A contact that holds and rings has a minimum for each whole ring more or less, over its stiffness; the friction
ratio of each follows from the energy, because what the contact takes in of a *measured* motion needs no simulation.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError
from frictionlab.inference.comparison import harmonics_of
from frictionlab.inference.fit import NO_BOUND, Model, cost, fit_from
from frictionlab.inference.observations import cycle_of

LARGEST = 4.0  # friction ratio at which a contact that hardly slips is still looked for
TRIED = 256  # friction ratios on either side of the one that takes in most
SEARCH = np.geomspace(0.05, 3.0, 49)  # friction ratios tried, over the loop's
HOPELESS, LEFT = 100.0, 0.01  # of the best, and of the worst friction ratio's sum of squares: more is not followed
OF_RECORD = 4  # starts, at most, of a whole record without a cycle
LAGS = np.linspace(-3.0, 3.0, 25)  # standard deviations of its prior at which an undeclared lag is tried
ROOTS = (1.0, 31.0)  # of the stiffness: a contact rings by it; beyond, it is rigid
RING_STEP, ROOT_STEP = 0.5, 0.6  # between roots tried: times r, at most
COARSE = 9  # roots tried of a law without rings
SEEN = 5.0  # times the harmonics of a cycle: a ringing that is faster moves no end of a stop by as much as they show
BEGUN, FOLLOWED = 8, 3  # minima over the stiffness from which steps are tried, and those that are fitted


def starting_points(model: Model, near: Mapping[str, float] | None = None) -> list[FloatArray]:
    """Return starting points worth following, best first.

    ``near``: values of the first test that a fit begins at too.
    """
    names, first = [u.name for u in model.unknowns], model.tests[0].observation
    close = [] if near is None else [point_at(model, near)]
    if tried := [point_at(model, values) for values in first.tried(near or {})]:
        if first.shows_rig:
            left = np.array([first.begun(model.values(0, point)).missed for point in tried])
            order = np.argsort(left)[: int(np.isfinite(left).sum())]
            return [tried[j] for j in order[: 1 if near else OF_RECORD]]
        return [*(tried[j] for j in minima(np.array([cost(model, point) for point in tried]))[:2]), *close]
    if first.guess is not None:
        return [at_medians(model, np.zeros(len(names)), [t.observation.guess for t in model.tests]), *close]
    if "stiffness_ratio" in names and len(model.tests) == 1:
        return [*_over_stiffness(model, near or {}), *close]
    if "beta" in names:
        return [*_over_friction(model, near or {})[:2], *close]
    return close or [point_at(model, {})]


def point_at(model: Model, values: Mapping[str, float]) -> FloatArray:
    """Return the point at some values of the first test; a new term begins where it does something."""
    point = np.zeros(len(model.unknowns))
    factors = dict(zip(model.tests[0].index.tolist(), model.tests[0].factors.tolist(), strict=True))
    for k, u in enumerate(model.unknowns):
        if (value := values.get(u.name, u.first)) is not None:
            point[k] = u.at(value / factors.get(k, 1.0))
    return np.clip(point, *model.bounds)


def at_medians(model: Model, point: FloatArray, each: Sequence[float | None]) -> FloatArray:
    """Return a point with the friction ratio of each material: the median of what its tests say, those that say one."""
    found = point.copy()
    for k, u in enumerate(model.unknowns):
        if u.name == "beta":
            own = [beta / t.factor(k) for t, beta in zip(model.tests, each, strict=True) if beta and k in t.index]
            found[k] = u.at(float(np.median(own)))
    return np.clip(found, *model.bounds)


def _over_friction(model: Model, near: Mapping[str, float]) -> list[FloatArray]:
    """Points at the minima over the friction ratio, with the lag that fits best there, best first.

    A lag only turns harmonics, so it is tried without simulating; it is one for all tests. A term that can do nothing
    does nothing in these motions, which are then quick, and something where the fit begins.
    """
    lag, guesses = _undeclared_lag(model), point_at(model, near)
    plain = guesses.copy()
    plain[[u.first is not None and u.scale == "linear" and u.name not in near for u in model.unknowns]] = 0.0
    observations = [cycle_of(test) for test in model.tests]
    ratios = [o.loop_friction_ratio for o in observations]
    costs = np.array(
        [[_costs_over_lag(model, i, plain, times * ratio, lag) for times in SEARCH] for i, ratio in enumerate(ratios)]
    )
    if not np.isfinite(costs).any():
        raise AnalysisError(
            f"no friction ratio between {SEARCH[0] * ratios[0]:.3g} and {SEARCH[-1] * ratios[0]:.3g} has a steady state"
            f" at r = {observations[0].r:g}{NO_BOUND}"
        )

    def at(places: Sequence[int], turn: int) -> FloatArray:  # of each test among the friction ratios tried; of the lag
        point = guesses.copy()
        if lag is not None:
            point[lag] = LAGS[turn]
        return at_medians(model, point, [SEARCH[j] * ratio for j, ratio in zip(places, ratios, strict=True)])

    if len(model.tests) == 1:
        left = costs[0].min(axis=1)
        least = minima(left)
        most = max(HOPELESS * left[least[0]], LEFT * left[np.isfinite(left)].max())
        return [at([j], int(np.argmin(costs[0, j]))) for j in least if left[j] <= most]
    best = int(np.argmin(np.minimum(costs, 1e300).min(axis=1).sum(axis=0)))  # lag, each test at its own friction ratio
    return [at(np.argmin(costs[:, :, best], axis=1).tolist(), best)]


def _undeclared_lag(model: Model) -> int | None:
    """Place of a lag that nobody has declared."""
    return next((k for k, u in enumerate(model.unknowns) if u.name == "lag_s" and u.assumed), None)


def _costs_over_lag(model: Model, i: int, point: FloatArray, beta: float, lag: int | None) -> FloatArray:
    """Sums of squares of test i at a friction ratio, over the lags tried; infinite where there is no steady state."""
    test = model.tests[i]
    observation = test.observation
    values = model.values(i, point[test.index]) | {"beta": beta}
    motion = observation.motion(values)
    if motion is None:
        return np.full(1 if lag is None else len(LAGS), math.inf)
    strain, shown = np.zeros(1), [values]
    if lag is not None:
        u = model.unknowns[lag]
        strain = np.array([u.strain(c) for c in LAGS.tolist()]) ** 2 / len(model.tests)
        shown = [values | {"lag_s": u.value(c)} for c in LAGS.tolist()]
    gap = observation.white(np.array([observation.data - observation.seen(motion, one) for one in shown]).T)
    return np.asarray((gap**2).sum(axis=0) + strain)


def minima(costs: FloatArray) -> list[int]:
    """Return places whose neighbours cost more, best first."""
    padded = np.concatenate([[math.inf], costs, [math.inf]])
    lower = (padded[1:-1] <= padded[:-2]) & (padded[1:-1] < padded[2:]) & np.isfinite(costs)
    return sorted((int(i) for i in np.flatnonzero(lower)), key=lambda i: costs[i])


def _over_stiffness(model: Model, known: Mapping[str, float]) -> list[FloatArray]:
    """Points at the deepest minima over the root of the stiffness, the friction ratio following from the energy."""
    observation = cycle_of(model.tests[0])
    free = "beta" in {u.name for u in model.unknowns}
    energy, lines = observation.loop_energy, harmonics_of(observation.slid)
    speed = float(np.sum((np.arange(1, len(lines) + 1) * np.abs(lines)) ** 2))
    energy -= 2.0 * known.get("contact_damping_ratio", 0.0) * observation.r * math.pi * speed  # to the dashpot
    strokes, roots = strokes_of(observation.slid), np.linspace(*ROOTS, COARSE)
    if observation.law.kind == "elastic":  # close together as far as the ringing shows among so many harmonics
        step = min(ROOT_STEP, RING_STEP * observation.r)
        roots = np.linspace(*ROOTS, 1 + math.ceil((ROOTS[1] - ROOTS[0]) / step))
        seen = int(np.searchsorted(roots, ROOTS[0] + SEEN * observation.count * observation.r))
        roots = np.concatenate([roots[:seen], roots[seen :: max(1, round(ROOT_STEP / step))]])
    found: list[tuple[float, FloatArray]] = []
    lag = _undeclared_lag(model)
    for branch in (0, 1):
        costs, points = np.full(len(roots), math.inf), {}
        for j, root in enumerate((roots**2).tolist()):
            ratios = elastic_friction_ratios(strokes, energy, root) if free else (observation.held["beta"],)
            if branch >= len(ratios):
                continue
            own = {"beta": ratios[branch]} if free else {}
            points[j] = point_at(model, {**known, "stiffness_ratio": root, **own})
            over = _costs_over_lag(model, 0, points[j], ratios[branch], lag)
            if lag is not None:
                points[j][lag] = LAGS[int(np.argmin(over))]
            costs[j] = over.min()
        found += [(float(costs[j]), points[j]) for j in minima(costs)]
    found.sort(key=lambda pair: pair[0])
    begun = [point for _, point in found[:BEGUN]] or [point_at(model, known)]
    stepped = [fit_from(replace(model, most=2), [point], tempers=False) for point in begun]  # narrow valleys show so
    return [fit.point for fit in sorted(stepped, key=lambda fit: fit.cost)[:FOLLOWED]]


def elastic_friction_ratios(strokes: FloatArray, energy: float, stiffness: float) -> tuple[float, ...]:
    """Return the friction ratios with which an elastic contact takes in an energy over given strokes, smallest first.

    There are none where the contact is too soft for the energy, else two: one slips most of the way, one hardly. Of the
    second only what is below `LARGEST` is given. ``strokes`` (k,): closed strokes of a cycle (`strokes_of`), in Y;
    ``energy``: k Y^2; ``stiffness``: of the contact over k.
    """
    if not energy > 0.0:
        return ()
    most = 0.25 * stiffness * float(strokes.max())  # takes in the most energy of the longest stroke
    least = 0.5 * energy / float(strokes.sum())
    if least >= most:
        return ()
    rising = np.linspace(least, min(most, energy / float(strokes.max())), TRIED)
    falling = np.linspace(rising[-1], min(2.0 * most, LARGEST), TRIED) if rising[-1] < LARGEST else rising[:0]
    found = []
    for beta in (rising, falling):
        slipped = np.maximum(strokes[:, None] - 2.0 * beta / stiffness, 0.0)
        over = 2.0 * beta * slipped.sum(axis=0) - energy
        places = np.flatnonzero(over[:-1] * over[1:] <= 0.0)
        if len(places):
            j = int(places[0])
            rise = float(over[j + 1] - over[j])
            found.append(float(beta[j] if rise == 0.0 else beta[j] - over[j] * (beta[j + 1] - beta[j]) / rise))
    return tuple(found)


def strokes_of(slid: FloatArray) -> FloatArray:
    """Return the closed strokes of a periodic motion, there and back, longest last (rainflow, ASTM E1049)."""
    first = int(np.argmax(slid))
    around = np.concatenate([slid[first:], slid[: first + 1]])
    around = around[np.diff(around, append=np.inf) != 0.0]  # a point of each level stretch is enough
    turns = np.flatnonzero(np.diff(np.sign(np.diff(around)))) + 1
    strokes: list[float] = []
    open_: list[float] = []
    for point in (around[0], *around[turns], around[-1]):
        open_.append(float(point))
        while len(open_) >= 4:  # the middle of three ways is closed if it is no longer than either beside it
            before, middle, after = np.abs(np.diff(open_[-4:]))
            if middle > min(before, after):
                break
            strokes.append(abs(open_[-3] - open_[-2]))
            del open_[-3:-1]
    return np.sort([*strokes, float(np.ptp(slid))])
