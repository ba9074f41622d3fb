"""The integrated flow, compiled: steps of Radau IIA, the corners at which phases end, and stops.

    z' = v,   r^2 v' = F - z - 2 zeta_f r v - 2 zeta_c r v - n,   w' and age' as the law says (`laws.law.Contact`)

Within a phase the right-hand side is smooth. The polynomial through the start and the seven stages of a step is the
motion (degree 7, error like h^8), and its highest coefficient says how well: a step is taken if that coefficient, times
the largest value of the node polynomial, is below the tolerance. So the motion is as good everywhere as the tolerance
says; the end of a step is much better (order 13), and the stops, which are ends of steps, with it.

A phase ends where v (n, if the contact has an age) comes back to zero. That the polynomial of a step does not cross
zero is proven by its Bernstein coefficients, all of one sign; if they are not, the interval is halved until they are or
a crossing is closed in. Then the step is made again so that it ends there, by Newton's method on its length.

E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, sections IV.5 and IV.8.
"""

from math import comb, cos, isfinite, sin
from typing import Any, NamedTuple

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.simulator.compiled import announce, compiled, inner

STAGES, COUNT, WIDTH = 7, 8, 4  # stages and nodes of a step; z, v and up to two inner states
PEAK = 7e-5  # largest value of the node polynomial on the step
MOST = 12  # of Newton's steps; two to four are usual
ROUNDING = 1e-14  # a correction so small is none
GUESS = 0.04  # by what a second correction with the same matrix is taken to be smaller than the first
FAILED = 1e300  # the size of a correction that does not exist
LOST = 1e-10  # corrections that stay, but are no larger than this, are rounding in a stiff law
SHORTEST = 1e-13  # share of a step: two crossings closer than this are one
SHORT, TWITCHES = 1e-12, 3  # rad: a phase so short is a second look at the same corner; so many, and none is looked for
TINY = 1e-14  # of the component that ends a phase: zero
LOOSE = 1e-12  # and what is taken for it after all looks
LOOKS = 10  # for the end of a phase
SHORTEST_TRY = 1e-10  # rad: a step so short crosses zero where its polynomial does
REST = 0.5  # longest recorded piece of a stop, rad over the number of harmonics
SAFETY, SHRINK, GROW = 0.85, 0.2, 4.0  # of a step's length

FINE, TOO_MANY, STALLED, NEGATIVE = range(4)  # how a motion ended


def tableau() -> tuple[FloatArray, ...]:
    """Nodes of a step, matrix of its stages, weights (barycentric; they give the highest coefficient), Bernstein's.

    The stages stand at the zeros of ``P_7 - P_6``; the last maps values at the nodes to Bernstein coefficients.
    """
    legendre: Any = np.polynomial.legendre
    series = np.append(np.zeros(STAGES - 1), (-1.0, 1.0))
    zeros = legendre.legroots(series)
    for _ in range(2):
        zeros -= legendre.legval(zeros, series) / legendre.legval(zeros, legendre.legder(series))
    c = np.append(0.5 * (1.0 + np.sort(zeros)[:-1]), 1.0)
    k, nodes = np.arange(COUNT), np.asarray(np.append(0.0, c), dtype=np.float64)
    apart: Any = nodes[:, None] - nodes + np.eye(COUNT)
    points, shares = legendre.leggauss(4)
    stages = np.empty((STAGES, STAGES))
    for j in range(STAGES):
        others = np.delete(c, j)
        base = np.prod((0.5 * np.outer(c, 1.0 + points)[..., None] - others) / (c[j] - others), axis=-1)
        stages[:, j] = 0.5 * c * (base @ shares)
    powers: Any = np.array([comb(STAGES, i) for i in k]) * nodes[:, None] ** k * (1.0 - nodes[:, None]) ** (STAGES - k)
    weights: Any = 1.0 / np.prod(apart, axis=1)
    return nodes, stages, weights, np.linalg.inv(powers)


NODES, MATRIX, WEIGHTS, BERNSTEIN = tableau()
announce(__name__)


class Oscillator(NamedTuple):
    """The numbers of a problem; its law's formula, compiled, goes beside it."""

    own: FloatArray  # parameters of the law's formula
    r: float
    beta: float
    gradient: float
    dashpot: float  # 2 zeta_c r
    lead: float  # 2 zeta_f r
    up: float  # what a stop holds over what a slide begins with, for a start up and for one down
    down: float
    narrow: float  # speed below which friction changes; 0: it does not
    size: int  # components of the state
    tolerance: float
    scale: FloatArray  # (4,): errors are relative to it and to the state's own size


class Forcing(NamedTuple):
    """The force F: a Fourier series, or without sine parts the coefficients of a polynomial."""

    cosine: FloatArray
    sine: FloatArray
    bounds: FloatArray  # (2,): of |F'| and |F''|


class Work(NamedTuple):
    """The state, and where a run writes."""

    state: FloatArray  # (4,)
    tangent: FloatArray  # (4, 4): its slopes over the state that the run began with
    clock: Any  # `CLOCK`
    values: FloatArray  # (4, 8): the last step at its nodes
    trial: FloatArray  # (4, 8): the step that is tried
    pull: FloatArray  # (7,): F at its stages
    rate: FloatArray  # (4, 7)
    slopes: FloatArray  # (3, 4, 7): of the rates of v, w and age over the state
    inverse: FloatArray  # (7 m, 7 m): of the stages' equations, z put in: m components are left
    right: FloatArray  # (4, 7)
    reduced: FloatArray  # (2, 7 m)
    curve: FloatArray  # (2, 8): Bernstein coefficients of a component, and of a part of it
    log: FloatArray  # (steps, 3 + 32): start, length, side (0: at rest), values


CLOCK = np.dtype([("tried", np.int64), ("most", np.int64), ("rows", np.int64), ("next", float), ("last", float)])
"""Steps tried, and allowed; steps recorded; length of the next step, and of the last one (0: none to go on from)."""


@inner
def drive_at(drive: Forcing, t: float) -> tuple[float, float]:
    """Return F and its rate at a time."""
    cosine, sine = drive.cosine, drive.sine
    value, rate = 0.0, 0.0
    if len(sine) == 0:
        for i in range(len(cosine)):
            rate = rate * t + value
            value = value * t + cosine[len(cosine) - 1 - i]
        return value, rate
    for i in range(len(cosine)):
        k = i + 1.0
        c, s = cos(k * t), sin(k * t)
        value += cosine[i] * c + sine[i] * s
        rate += k * (sine[i] * c - cosine[i] * s)
    return value, rate


@inner
def contact_at(law: Any, rig: Oscillator, side: float, z: float, v: float, w: float, age: float) -> Any:
    """Return what the contact does (`Contact`), its dashpot apart."""
    return law(rig.own, side, rig.beta * (1.0 + rig.gradient * z), z, v, w, age)


@compiled
def contacts(law: Any, rig: Oscillator, sides: FloatArray, states: FloatArray, found: FloatArray) -> None:
    """Write the contact's force, its dashpot's in it, and its slip (2, m) at many states; at rest (side 0) neither."""
    for i in range(len(sides)):
        if sides[i] != 0.0:
            c = contact_at(law, rig, sides[i], states[i, 0], states[i, 1], states[i, 2], states[i, 3])
            found[0, i], found[1, i] = c[0] + rig.dashpot * states[i, 1], c[5]


@inner
def rates(law: Any, rig: Oscillator, work: Work, side: float) -> None:
    """Write the rates of the trial's states at the stages, and their slopes."""
    x, rate, slopes, pull, own = work.trial, work.rate, work.slopes, work.pull, rig.own
    mass, rise, damping = 1.0 / (rig.r * rig.r), rig.beta * rig.gradient, rig.lead + rig.dashpot
    for i in range(STAGES):
        z, v = x[0, i + 1], x[1, i + 1]
        c = law(own, side, rig.beta + rise * z, z, v, x[2, i + 1], x[3, i + 1])
        rate[0, i], rate[1, i] = v, (pull[i] - z - damping * v - c[0]) * mass
        slopes[0, 0, i], slopes[0, 1, i] = -(1.0 + c[1] * rise + c[2]) * mass, -(damping + c[3]) * mass
        slopes[0, 2, i], slopes[0, 3, i] = -c[4] * mass, 0.0
        if rig.size > 2:
            rate[2, i], slopes[1, 0, i] = c[6], c[7] * rise
            slopes[1, 1, i], slopes[1, 2, i], slopes[1, 3, i] = c[8], c[9], c[10]
        if rig.size > 3:
            rate[3, i], slopes[2, 0, i] = c[11], c[12] * rise
            slopes[2, 1, i], slopes[2, 2, i], slopes[2, 3, i] = c[13], c[14], c[15]


@inner
def invert(a: FloatArray) -> bool:
    """Invert a matrix in place, by Gauss-Jordan with row exchanges; False if it is singular or not finite."""
    n = len(a)
    rows = np.empty(n, np.int64)
    for k in range(n):
        row = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[row, k]):
                row = i
        rows[k], pivot = row, a[row, k]
        if not (pivot != 0.0 and isfinite(pivot)):
            return False
        a[row, k], a[k, k] = a[k, k], 1.0
        for j in range(n):
            if j != k:
                a[k, j], a[row, j] = a[row, j], a[k, j]
            a[k, j] /= pivot
        for i in range(n):
            if i != k:
                share, a[i, k] = a[i, k], 0.0
                for j in range(n):
                    a[i, j] -= share * a[k, j]
    for k in range(n - 1, -1, -1):
        for i in range(n):
            a[i, k], a[i, rows[k]] = a[i, rows[k]], a[i, k]
    return True


@inner
def factorise(work: Work, h: float, size: int) -> bool:
    """Invert 1 - h A x J of the stages, J the slopes of their rates, with z' = v put in; False if that fails."""
    a, slopes, less = work.inverse, work.slopes, size - 1
    for k in range(less):
        for i in range(STAGES):
            for m in range(less):
                for j in range(STAGES):
                    a[k * STAGES + i, m * STAGES + j] = -h * MATRIX[i, j] * slopes[k, m + 1, j]
            for j in range(STAGES):
                spring = h * h * MATRIX[i, j] * slopes[k, 0, j]
                if spring != 0.0:
                    for m in range(STAGES):
                        a[k * STAGES + i, m] -= spring * MATRIX[j, m]
    for i in range(less * STAGES):
        a[i, i] += 1.0
    return invert(a)


@inner
def solve_stages(work: Work, h: float, size: int) -> None:
    """Solve the linear equations of all stages in place of their right-hand side, z by what v makes of it."""
    right, given, found, slopes = work.right, work.reduced[0], work.reduced[1], work.slopes
    for k in range(size - 1):
        for i in range(STAGES):
            total = 0.0
            for j in range(STAGES):
                total += MATRIX[i, j] * slopes[k, 0, j] * right[0, j]
            given[k * STAGES + i] = right[k + 1, i] + h * total
    for i in range(len(given)):
        total = 0.0
        for j in range(len(given)):
            total += work.inverse[i, j] * given[j]
        found[i] = total
    for i in range(STAGES):
        total = 0.0
        for j in range(STAGES):
            total += MATRIX[i, j] * found[j]
        right[0, i] += h * total
        for k in range(size - 1):
            right[k + 1, i] = found[k * STAGES + i]


@inner
def correct(law: Any, rig: Oscillator, work: Work, side: float, h: float, fresh: int) -> float:
    """Correct the stages once by Newton's method; return its size over the scale, or FAILED if there is none."""
    trial, right, worst = work.trial, work.right, 0.0
    rates(law, rig, work, side)
    if fresh and not factorise(work, h, rig.size):
        return FAILED
    for k in range(rig.size):
        for i in range(STAGES):
            total = 0.0
            for j in range(STAGES):
                total += MATRIX[i, j] * work.rate[k, j]
            right[k, i] = (trial[k, 0] - trial[k, i + 1]) + h * total
    solve_stages(work, h, rig.size)
    for k in range(rig.size):
        for i in range(STAGES):
            trial[k, i + 1] += right[k, i]
            off = abs(right[k, i]) / (rig.scale[k] + abs(trial[k, 0]))
            worst = max(worst, off) if isfinite(off) else FAILED
    return worst


@inner
def step(law: Any, rig: Oscillator, drive: Forcing, work: Work, side: float, t: float, h: float) -> bool:
    """Solve one step from the state at t over h, from the guess in `trial`; False if Newton's method fails."""
    work.clock.tried += 1
    work.trial[:, 0] = work.state
    for i in range(STAGES):
        work.pull[i] = drive_at(drive, t + NODES[i + 1] * h)[0]
    before, fresh = FAILED, 1
    for _ in range(MOST):
        now = correct(law, rig, work, side, h, fresh)
        if now >= FAILED:
            return False
        ratio = now / before if before < FAILED else GUESS
        if now <= ROUNDING or (ratio < 1.0 and now * ratio <= ROUNDING) or (ratio > 0.3 and now <= LOST):
            return True
        if ratio > 2.0:
            return False
        fresh = 1 if ratio > 0.05 else 0
        before = now
    return False


@inner
def carry_tangent(work: Work, h: float, size: int) -> None:
    """Carry the slopes of the state over its start through the step just solved."""
    right, tangent = work.right, work.tangent
    factorise(work, h, size)
    for column in range(size):
        right.T[:] = tangent[:, column]
        solve_stages(work, h, size)
        tangent[:size, column] = right[:size, STAGES - 1]


@inner
def predict(work: Work, size: int, offset: float, ratio: float) -> None:
    """Write a first guess of the stages: the last step's polynomial, at shares offset + ratio * node of that step."""
    for i in range(1, COUNT):
        theta, below = offset + ratio * NODES[i], 0.0
        for k in range(size):
            work.trial[k, i] = 0.0
        for j in range(COUNT):
            gap = theta - NODES[j]
            if gap == 0.0:
                below = 1.0
                for k in range(size):
                    work.trial[k, i] = work.values[k, j]
                break
            below += WEIGHTS[j] / gap
            for k in range(size):
                work.trial[k, i] += WEIGHTS[j] / gap * work.values[k, j]
        for k in range(size):
            work.trial[k, i] /= below


@inner
def error_of(rig: Oscillator, work: Work) -> float:
    """Return the size of the trial step's error over the tolerance; more than 1 if it is too long.

    A Stribeck curve that falls within nu may stand between two nodes unseen, and the polynomial looks perfect. So near
    v = 0 two nodes are at most nu apart; by how much they are more enters the error by a power, so that the step
    shrinks in proportion.
    """
    trial, worst, widest = work.trial, 0.0, 0.0
    for k in range(rig.size):
        top, largest = 0.0, 0.0
        for i in range(COUNT):
            top += WEIGHTS[i] * (trial[k, i] - trial[k, 0])
            largest = max(largest, abs(trial[k, i]))
        worst = max(worst, abs(top) * PEAK / (rig.scale[k] + largest))
    if rig.narrow > 0.0:
        for i in range(STAGES):
            if min(abs(trial[1, i]), abs(trial[1, i + 1])) < 5.0 * rig.narrow:
                widest = max(widest, min(abs(trial[1, i] - trial[1, i + 1]) / rig.narrow, 10.0))
    return max(worst / rig.tolerance, widest**7)


@inner
def least_between(curve: FloatArray, part: FloatArray, begin: float, end: float) -> float:
    """Return a lower bound of a polynomial in Bernstein form between two shares of a step, by De Casteljau."""
    part[:] = curve
    for level in range(1, COUNT):
        for i in range(COUNT - 1, level - 1, -1):
            part[i] = part[i - 1] + end * (part[i] - part[i - 1])
    for level in range(1, COUNT):
        for i in range(COUNT - level):
            part[i] += begin / end * (part[i + 1] - part[i])
    return float(np.min(part))


@inner
def first_crossing(rig: Oscillator, work: Work, side: float, k: int) -> float:
    """Return the share of the trial step at which component k first falls below zero; 2 if it is proven not to."""
    trial, curve, part = work.trial, work.curve[0], work.curve[1]
    tiny = -TINY * rig.scale[k]
    for i in range(COUNT):
        curve[i] = side * np.sum(BERNSTEIN[i] * trial[k])
    curve[0], curve[STAGES] = side * trial[k, 0], side * trial[k, STAGES]
    begin, width = 0.0, 1.0
    while begin + width > SHORTEST:
        if least_between(curve, part, begin, begin + width) >= tiny:
            begin += width
            if begin >= 1.0:
                return 2.0
            width = min(2.0 * width, 1.0 - begin)
        elif width < SHORTEST:
            return begin + width
        else:
            width *= 0.5
    return begin + width


@inner
def land(
    law: Any, rig: Oscillator, drive: Forcing, work: Work, side: float, k: int, t: float, h: float, theta: float
) -> float:
    """Make the trial step again so that it ends where component k falls through zero; -1 if it does not.

    The polynomial of a long step may cross zero where the motion does not (just after a release it moves like t^2):
    then the step must be shorter. The length is Newton's, kept between what is too short and what is too long.
    """
    work.values[:] = work.trial
    length, short, long, left = theta * h, 0.0, h, FAILED
    for _ in range(LOOKS):
        predict(work, rig.size, 0.0, length / h)
        if not step(law, rig, drive, work, side, t, length):
            return -1.0
        left, rise = side * work.trial[k, STAGES], side * work.rate[k, STAGES - 1]
        if abs(left) <= TINY * rig.scale[k] and (rise < 0.0 or h < SHORTEST_TRY):
            return length
        if left < 0.0:
            long = length
        elif rise >= 0.0 and h > SHORTEST_TRY:
            return -1.0
        else:
            short = length
        length = length - left / rise if rise < 0.0 else short
        if not short < length < long:
            length = 0.5 * (short + long)
    return length if abs(left) <= LOOSE * rig.scale[k] or h < SHORTEST_TRY else -1.0


@inner
def record(work: Work, t: float, h: float, side: float) -> None:
    """Append the step in `values` to the log, as far as there is space; count it in any case."""
    log, row = work.log, work.clock.rows
    work.clock.rows += 1
    if row < len(log):
        log[row, 0], log[row, 1], log[row, 2] = t, h, side
        log[row, 3:] = work.values.reshape(WIDTH * COUNT)


@inner
def advance(
    law: Any, rig: Oscillator, drive: Forcing, work: Work, side: float, t: float, end: float, tangent: int, watched: int
) -> tuple[float, bool]:
    """Take one step from t, up to `end` at most: the time reached, and whether component `watched` ends the phase.

    -1: nothing is watched. A time beyond `end`: the steps allowed are used up.
    """
    clock = work.clock
    while clock.tried < clock.most:
        h = min(clock.next, end - t)
        if 0.0 < h < 3.0 * clock.last:
            predict(work, rig.size, 1.0, h / clock.last)
        else:
            work.trial.T[:] = work.state
            work.trial[0] += h * work.state[1] * NODES
        if not step(law, rig, drive, work, side, t, h):
            clock.next, clock.last = 0.25 * h, 0.0
            continue
        error = error_of(rig, work)
        change = SAFETY * max(error, 1e-12) ** (-1.0 / 7.0)
        if error > 1.0:
            clock.next = h * max(SHRINK, change)
            continue
        theta = first_crossing(rig, work, side, watched) if watched >= 0 else 2.0
        grown = h * min(GROW, max(SHRINK, change))
        clock.next = grown if h >= clock.next else max(grown, clock.next)
        landed = h
        if theta <= 1.0:
            landed = land(law, rig, drive, work, side, watched, t, h, theta)
            if landed < 0.0 or error_of(rig, work) > 1.0:
                clock.next, clock.last = 0.25 * h if landed < 0.0 else 0.5 * landed, 0.0
                continue
        if tangent:
            carry_tangent(work, landed, rig.size)
        work.values[:], work.state[: rig.size] = work.trial, work.trial[: rig.size, STAGES]
        if len(work.log) > 0:
            record(work, t, landed, side)
        clock.last = landed
        return (end if theta > 1.0 and h == end - t else t + landed), theta <= 1.0
    return end + 1.0, False


@inner
def release(law: Any, rig: Oscillator, drive: Forcing, z: float, t: float, end: float) -> tuple[float, float]:
    """Return when and to which side a mass at rest at z breaks away: the first time after t, and before `end`."""
    up = rig.up * contact_at(law, rig, 1.0, z, 0.0, 0.0, 0.0)[0]
    down, bound = -rig.down * contact_at(law, rig, -1.0, z, 0.0, 0.0, 0.0)[0], drive.bounds[1]
    tiny = 1e-15 * (drive.bounds[0] + abs(z) + max(up, down))
    while t < end:
        pull, rate = drive_at(drive, t)
        wait = end - t
        for side, hold in ((1.0, up), (-1.0, down)):
            left, fall = hold - side * (pull - z), side * rate
            if left < -tiny or (left <= tiny and fall > 0.0):
                return t, side
            root = (fall * fall + 2.0 * bound * max(left, 0.0)) ** 0.5
            safe = 2.0 * max(left, 0.0) / (root + fall) if fall > 0.0 else (root - fall) / bound
            wait = min(wait, max(safe, 1e-15 * (1.0 + t)))
        t += wait
    return end, 0.0


@inner
def acceleration(law: Any, rig: Oscillator, side: float, pull: float, z: float) -> Any:
    """Return the acceleration of a mass at rest under the force `pull`, about to slide."""
    return (pull - z - contact_at(law, rig, side, z, 0.0, 0.0, 0.0)[0]) / (rig.r * rig.r)


@inner
def rest(
    law: Any, rig: Oscillator, drive: Forcing, work: Work, t: float, end: float, before: float
) -> tuple[float, float]:
    """Let a mass at rest stay until it is released or the end comes; return when it goes, and to which side.

    `before` is the acceleration with which it came to rest (0: it began there); it says how slopes are carried on.
    """
    tangent, z = work.tangent, work.state[0]
    go, side = release(law, rig, drive, z, t, end)
    if go > t and len(work.log) > 0:
        work.values.T[:] = work.state
        count = int((go - t) * max(1, len(drive.cosine)) / REST) + 1
        for i in range(count):
            record(work, t + (go - t) * i / count, (go - t) / count, 0.0)
    pull, rate = drive_at(drive, go)
    after = acceleration(law, rig, side, pull, z) if side != 0.0 else 0.0
    for j in range(2):
        if go > t or side == 0.0:
            tangent[1, j] = 0.0
            if side != 0.0 and rate != 0.0:
                c = contact_at(law, rig, side, z, 0.0, 0.0, 0.0)
                hold = (rig.up if side > 0.0 else rig.down) * (c[1] * rig.beta * rig.gradient + c[2])
                tangent[1, j] = -after * (1.0 + hold) / rate * tangent[0, j]
        elif before != 0.0:
            tangent[1, j] *= after / before
    return go, side


@inner
def choose_side(law: Any, rig: Oscillator, drive: Forcing, x: FloatArray, ending: int, t: float) -> float:
    """Return the sign of the component that ends a phase, or of its rate where it is zero."""
    if x[ending] != 0.0:
        return 1.0 if x[ending] > 0.0 else -1.0
    c = contact_at(law, rig, 1.0, x[0], x[1], x[2], x[3])
    rate = drive_at(drive, t)[0] - x[0] - (rig.lead + rig.dashpot) * x[1] - c[0]
    if ending == 2 and c[6] != 0.0:
        rate = c[6]
    return 1.0 if rate >= 0.0 else -1.0


@compiled
def carry(law: Any, rig: Oscillator, drive: Forcing, work: Work, t: float, span: float, tangent: int) -> int:
    """Carry the state, and if asked for its slopes, from t over a span of time; return how it ended."""
    state, clock, end, ending = work.state, work.clock, t + span, 2 if rig.size == WIDTH else 1
    smooth, side, before, quick = rig.size == 2, 0.0, 0.0, 0
    clock.last = 0.0
    while t < end:
        if side == 0.0 and smooth and state[1] == 0.0:
            t, side = rest(law, rig, drive, work, t, end, before)
            continue
        if side == 0.0:
            side = choose_side(law, rig, drive, state, ending, t)
        begun = t
        t, ended = advance(law, rig, drive, work, side, t, end, tangent, ending if quick < TWITCHES else -1)
        if t > end:
            return TOO_MANY
        if clock.next < SHORTEST * SHORTEST:
            return STALLED
        friction = rig.beta * (1.0 + rig.gradient * state[0])
        if smooth:
            friction = side * contact_at(law, rig, side, state[0], state[1], 0.0, 0.0)[0]
        if friction < 0.0:
            return NEGATIVE
        if ended:
            before = acceleration(law, rig, side, drive_at(drive, t)[0], state[0]) if smooth else 0.0
            state[ending], side, clock.last = 0.0, 0.0, 0.0
            quick = quick + 1 if t - begun < SHORT and not smooth else 0
        elif quick >= TWITCHES:
            quick, side = 0, 0.0
    return FINE


@compiled
def travel(
    law: Any,
    rig: Oscillator,
    drive: Forcing,
    work: Work,
    lengths: FloatArray,
    pull: FloatArray,
    first: int,
    longest: float,
    most: int,
) -> tuple[int, int, FloatArray]:
    """Carry the state along pieces of a sampled drive, of these lengths (n,) and forces (n, 4), from the first one on.

    `longest`, `most`: what is carried at once (rad), and the steps that may be recorded in it. Returns how it ended,
    the piece to go on with when the log has no more space, and how many steps are recorded when each piece is over.
    """
    clock, ends = work.clock, np.zeros(len(lengths))
    for i in range(first, len(lengths)):
        if clock.rows + most > len(work.log):
            return FINE, i, ends
        h = lengths[i]
        drive.cosine[:] = pull[i]
        drive.bounds[1] = 2.0 * abs(pull[i, 2]) + 6.0 * abs(pull[i, 3]) * h + 1e-300
        drive.bounds[0] = abs(pull[i, 1]) + h * drive.bounds[1]
        count = int(h / longest) + 1
        for part in range(count):
            clock.tried, begun = 0, clock.rows
            code = carry(law, rig, drive, work, h * part / count, h / count, 0)
            if code == FINE and clock.rows > min(begun + most, len(work.log)):
                code = TOO_MANY
            if code != FINE:
                return code, i, ends
        ends[i] = clock.rows
    return FINE, len(lengths), ends
