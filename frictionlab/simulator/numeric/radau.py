"""The integrated flow, compiled: steps of Radau IIA through the phases of any masses and contacts.

    q' = v,   r^2 M v' = push (f, f') - r C v - K q - sum row_c n_c,   w' as the contacts' laws say (`laws.law.Contact`)

Within a phase the right-hand side is smooth: a contact at rest on a corner of its friction is held, and its force is
eliminated; one that slips keeps its direction; an elastic one is a spring. The polynomial through the start and the
seven stages of a step is the motion (degree 7, error like h^8), and its highest coefficient says how well: a step is
taken if that coefficient, times the largest value of the node polynomial, is below the tolerance. So the motion is as
good everywhere as the tolerance says; the end of a step is much better (order 13), and the events, which are ends of
steps, with it.

A phase ends where a function of the state falls to zero: the speed of a contact (its force, if it has an age), what a
held one can bear more, the way of a spring to its limit. That the polynomial of a step does not cross zero is proven by
its Bernstein coefficients, all of one sign; if they are not, the interval is halved until they are or a crossing is
closed in. Then the step is made again so that it ends there, by Newton's method on its length.

What happens at an event is decided by the exact flow: there friction is what it is at that moment.

E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, sections IV.5 and IV.8.
"""

from math import comb, inf, isfinite
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.simulator.compiled import address_of, announce, inlined, inner
from frictionlab.simulator.exact.account import LOOK, begin_look
from frictionlab.simulator.exact.flow import (
    ADVANCE,
    TURN_OF,
    UPWARDS,
    Carrier,
    begin_piece,
    call_formula,
    contact_at,
    freeze,
    is_rigid,
    move_cubic,
    sign_of,
    turn_corners,
    watches,
)
from frictionlab.simulator.exact.motion import COUNT, STAGES, base_at, base_at_time, place_of
from frictionlab.simulator.exact.phase import CHATTER, DONE, PULLS, SIDE, TIRED, dot, factorise, substitute

PEAK = 7e-5  # largest value of the node polynomial on the step
MOST = 12  # of Newton's steps; two to four are usual
ROUNDING = 1e-14  # a correction so small is none
GUESS = 0.04  # by what a second correction with the same matrix is taken to be smaller than the first
FAILED = 1e300  # the size of a correction that does not exist
LOST = 1e-10  # corrections that stay, but are no larger than this, are rounding in a stiff law
SHORTEST = 1e-13  # share of a step: two crossings closer than this are one
SHORT, TWITCHES = 1e-12, 3  # rad: a phase so short is a second look at the same corner; so many, and none is looked for
TINY = 1e-14  # of what ends a phase: zero
LOOSE = 1e-12  # and what is taken for it after all looks
LOOKS = 10  # for the end of a phase
SHORTEST_TRY = 1e-10  # rad: a step so short crosses zero where its polynomial does
SAFETY, SHRINK, GROW = 0.85, 0.2, 4.0  # of a step's length


def tableau() -> tuple[FloatArray, ...]:
    """Nodes of a step, matrix of its stages, weights (barycentric; they give the highest coefficient), Bernstein's.

    The stages stand at the zeros of ``P_7 - P_6``; the fourth maps values at the nodes to Bernstein coefficients, the
    last to the derivative at the end.
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
    bernstein: Any = np.linalg.inv(powers)
    return nodes, stages, weights, bernstein, STAGES * (bernstein[-1] - bernstein[-2])


NODES, MATRIX, WEIGHTS, BERNSTEIN, LAST = tableau()
announce(__name__)


@inner
def along(system: Any, x: FloatArray, first: int, i: int, c: int, f: float) -> Any:
    """Return a contact's displacement or speed from a column of states; f: that of the base."""
    total = -system.follow[c] * f
    for a in range(system.masses):
        total += system.row[c, a] * x[first + a, i]
    return total


@inner
def inner_slopes(system: Any, slopes: FloatArray, c: int, at: int, i: int, by_z: float, by_v: float) -> None:
    """Write the slopes of an inner state's rate over displacements and velocities."""
    n = system.masses
    for b in range(n):
        slopes[at - n, b, i] = by_z * system.row[c, b]
        slopes[at - n, n + b, i] = by_v * system.row[c, b]


@inner
def forces(flow: Carrier, slot: int, first: int, last: int) -> None:
    """Write net forces, and the rates of inner states, with their slopes, at some nodes of the trial step."""
    system, work, law, steps = flow.system, flow.work, flow.system.law, flow.work.steps
    x, bare, net, n = steps.trial, steps.bare, steps.net, system.masses
    for i in range(first, last):
        f, df = steps.driven[0, i], steps.driven[1, i]
        for a in range(n):
            total = work.phases.by_f[slot, a] * f + system.push[a, 1] * df + steps.constant[a]
            for b in range(n):
                stiff, thick = work.phases.stiffness[slot, a, b], system.damping[a, b]
                total -= stiff * x[b, i] + thick * x[n + b, i]
                bare[a, b, i], bare[a, n + b, i] = -stiff, -thick
            for k in range(2 * n, steps.components):
                bare[a, k, i] = 0.0
            net[a, i] = total
        for c in range(system.contacts):
            if law.states[c] >= 0 and work.kappa[c] != inf:
                rub(flow, c, i)


@inner
def rub(flow: Carrier, c: int, i: int) -> None:
    """Add what a contact does by its formula at a node."""
    system, law, steps = flow.system, flow.system.law, flow.work.steps
    x, bare, slopes, n = steps.trial, steps.bare, steps.slopes, system.masses
    states, at, rise = law.states[c], law.at[c], law.beta[c] * law.gradient[c]
    w, age = x[at, i] if states > 0 else 0.0, x[at + 1, i] if states > 1 else 0.0
    z, v = along(system, x, 0, i, c, steps.driven[0, i]), along(system, x, n, i, c, steps.driven[1, i])
    side = float(flow.work.side[c])
    d = call_formula(law.formula[c], (law.own[c], side, law.beta[c] + rise * z, z, v, w, age))
    for a in range(n):
        share = system.row[c, a]
        if share != 0.0:
            steps.net[a, i] -= share * d[0]
            for b in range(n):
                bare[a, b, i] -= share * (d[1] * rise + d[2]) * system.row[c, b]
                bare[a, n + b, i] -= share * d[3] * system.row[c, b]
            if states > 0:
                bare[a, at, i] -= share * d[4]
    if states > 0:
        steps.rate[at, i], slopes[at - n, at, i] = d[6], d[9]
        inner_slopes(system, slopes, c, at, i, d[7] * rise, d[8])
    if states > 1:
        steps.rate[at + 1, i], slopes[at - n, at + 1, i] = d[11], d[10]
        inner_slopes(system, slopes, c, at + 1, i, d[12] * rise, d[13])
        slopes[at + 1 - n, at, i], slopes[at + 1 - n, at + 1, i] = d[14], d[15]


@inner
def rates(n: int, steps: Any) -> None:
    """Write the rates of the masses' states at the stages, and their slopes, from the net forces."""
    for a in range(n):
        for i in range(1, COUNT):
            rate = steps.moved[a] * steps.driven[2, i]
            for b in range(n):
                rate += steps.mobile[a, b] * steps.net[b, i]
            steps.rate[a, i], steps.rate[n + a, i] = steps.trial[n + a, i], rate
        for k in range(steps.components):
            for i in range(1, COUNT):
                slope = 0.0
                for b in range(n):
                    slope += steps.mobile[a, b] * steps.bare[b, k, i]
                steps.slopes[a, k, i] = slope


@inner
def factorise_stages(steps: Any, h: float, n: int) -> bool:
    """Factorise 1 - h A x J of the stages, J the slopes of their rates, with q' = v put in; False if that fails."""
    a, slopes, less = steps.factors, steps.slopes, steps.components - n
    for k in range(less):
        for i in range(STAGES):
            for m in range(less):
                for j in range(STAGES):
                    a[k * STAGES + i, m * STAGES + j] = -h * MATRIX[i, j] * slopes[k, n + m, j + 1]
            for b in range(n):
                for j in range(STAGES):
                    spring = h * h * MATRIX[i, j] * slopes[k, b, j + 1]
                    if spring != 0.0:
                        for m in range(STAGES):
                            a[k * STAGES + i, b * STAGES + m] -= spring * MATRIX[j, m]
    for i in range(less * STAGES):
        a[i, i] += 1.0
    return bool(factorise(a, less * STAGES, steps.exchanged, 0.0))


@inner
def solve_stages(steps: Any, h: float, n: int) -> None:
    """Solve the linear equations of all stages in place of their right-hand side, q by what v makes of it."""
    right, found, slopes, less = steps.right, steps.reduced, steps.slopes, steps.components - n
    for k in range(less):
        for i in range(STAGES):
            found[k * STAGES + i] = right[n + k, i]
            for b in range(n):
                for j in range(STAGES):
                    found[k * STAGES + i] += h * MATRIX[i, j] * slopes[k, b, j + 1] * right[b, j]
    substitute(steps.factors, STAGES * less, steps.exchanged, found)
    for i in range(STAGES):
        for b in range(n):
            right[b, i] += h * dot(MATRIX[i], found[b * STAGES :], STAGES)
        for k in range(less):
            right[n + k, i] = found[k * STAGES + i]


@inlined
def correct(flow: Carrier, slot: int, h: float, fresh: int) -> float:
    """Correct the stages once by Newton's method; return its size over the scale, or FAILED if there is none."""
    steps, scale, n, worst = flow.work.steps, flow.system.law.scale, flow.system.masses, 0.0
    trial, right = steps.trial, steps.right
    forces(flow, slot, 1, COUNT)
    rates(n, steps)
    if fresh and not factorise_stages(steps, h, n):
        return FAILED
    for k in range(steps.components):
        for i in range(STAGES):
            right[k, i] = (trial[k, 0] - trial[k, i + 1]) + h * dot(MATRIX[i], steps.rate[k, 1:], STAGES)
    solve_stages(steps, h, n)
    for k in range(steps.components):
        for i in range(STAGES):
            trial[k, i + 1] += right[k, i]
            off = abs(right[k, i]) / (scale[k] + abs(trial[k, 0]))
            worst = max(worst, off) if isfinite(off) else FAILED
    return worst


@inner
def step(flow: Carrier, slot: int, h: float) -> bool:
    """Solve one step from the state at hand over h, from the guess in `trial`; False if Newton's method fails."""
    system, work, steps = flow.system, flow.work, flow.work.steps
    n = system.masses
    work.left -= 1.0
    for a in range(n):
        steps.trial[a, 0], steps.trial[n + a, 0] = work.q[a], work.v[a]
    first = system.first[system.contacts] - 2 * n  # of inner states, behind the anchors
    for k in range(2 * n, steps.components):
        steps.trial[k, 0] = work.anchor[first + k]
    for i in range(COUNT):
        base_at(system, work, NODES[i] * h)
        for order in range(3):
            steps.driven[order, i] = work.f[order]
    base_at(system, work, 0.0)  # an event may be at the begin
    before, fresh = FAILED, 1
    for _ in range(MOST):
        now = correct(flow, slot, h, fresh)
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
def hold(flow: Carrier, slot: int) -> None:
    """Write the forces of held rigid contacts at the nodes of the trial step."""
    system, work, steps, fresh = flow.system, flow.work, flow.work.steps, True
    for c in range(system.contacts):
        if work.kappa[c] != inf:
            continue
        if fresh:
            forces(flow, slot, 0, COUNT)
            fresh = False
        for i in range(COUNT):
            steps.held[c, i] = -work.phases.bind[slot, c] * steps.driven[2, i]
            for b in range(system.masses):
                steps.held[c, i] += work.phases.grip[slot, c, b] * steps.net[b, i]


@inner
def watch_nodes(flow: Carrier, c: int, which: int) -> Any:
    """Write an event's function at the nodes of the trial step, positive until then; return what is zero of it."""
    system, work, law, steps = flow.system, flow.work, flow.system.law, flow.work.steps
    n, sign, scale = system.masses, sign_of(work, c, which), law.scale[system.masses]
    threshold = 0.0 if which == TURN_OF else work.upper[c] if which == UPWARDS else work.lower[c]
    for i in range(COUNT):
        if which == TURN_OF and law.states[c] == 2:
            value, scale = steps.trial[law.at[c], i], law.scale[law.at[c]]
        elif which == TURN_OF:
            value = along(system, steps.trial, n, i, c, steps.driven[1, i])
        elif is_rigid(system, c):
            value, scale = steps.held[c, i], law.force
        else:
            value, scale = along(system, steps.trial, 0, i, c, steps.driven[0, i]), law.scale[0]
        steps.watch[i] = sign * (value - threshold)
    return scale


@inlined
def carry_tangent(flow: Carrier, h: float) -> None:
    """Carry the derivative of the state by its start, q, v, anchors and inner states, through the step just solved."""
    system, work, steps = flow.system, flow.work, flow.work.steps
    n, sliders, size = system.masses, system.first[system.contacts], steps.components
    right, jacobian = steps.right, work.jacobian
    factorise_stages(steps, h, n)
    for column in range(size + sliders):
        for a in range(n):
            push = 0.0
            for c in range(system.contacts if sliders > 0 else 0):
                for i in range(system.first[c], system.first[c + 1]):
                    if not work.slips[i] and jacobian[2 * n + i, column] != 0.0:
                        for b in range(n):
                            share = steps.mobile[a, b] * system.row[c, b] * system.spring[i]
                            push += share * jacobian[2 * n + i, column]
            for i in range(STAGES):
                right[a, i] = jacobian[a, column]
                right[n + a, i] = jacobian[n + a, column] + h * NODES[i + 1] * push
        for k in range(2 * n, size):
            for i in range(STAGES):
                right[k, i] = jacobian[sliders + k, column]
        solve_stages(steps, h, n)
        for k in range(size):
            jacobian[k if k < 2 * n else sliders + k, column] = right[k, STAGES - 1]


@inner
def between(values: FloatArray, theta: float) -> float:
    """Return the polynomial through values at the nodes at a share of the step: barycentric."""
    total, below = 0.0, 0.0
    for j in range(COUNT):
        gap = theta - NODES[j]
        if gap == 0.0:
            return float(values[j])
        total += WEIGHTS[j] / gap * values[j]
        below += WEIGHTS[j] / gap
    return float(total / below)


@inner
def predict(steps: Any, offset: float, ratio: float) -> None:
    """Write a first guess of the stages: the last step's polynomial, at shares offset + ratio * node of that step."""
    for k in range(steps.components):
        for i in range(1, COUNT):
            steps.trial[k, i] = between(steps.values[k], offset + ratio * NODES[i])


@inner
def top_of(values: FloatArray, scale: float) -> Any:
    """Return the largest error of the polynomial through values at the nodes, over a scale and their size."""
    top, largest = 0.0, 0.0
    for i in range(COUNT):
        top += WEIGHTS[i] * (values[i] - values[0])
        largest = max(largest, abs(values[i]))
    return abs(top) * PEAK / (scale + largest)


@inner
def error_of(flow: Carrier, slot: int) -> Any:
    """Return the size of the trial step's error over the tolerance; more than 1 if it is too long.

    A Stribeck curve that falls within nu may stand between two nodes unseen, and the polynomial looks perfect. So near
    v = 0 two nodes are at most nu apart; by how much they are more enters the error by a power, so that the step
    shrinks in proportion.
    """
    system, work, law, steps = flow.system, flow.work, flow.system.law, flow.work.steps
    worst, widest = 0.0, 0.0
    hold(flow, slot)
    for k in range(steps.components):
        worst = max(worst, top_of(steps.trial[k], law.scale[k]))
    for c in range(system.contacts):
        if work.kappa[c] == inf:
            worst = max(worst, top_of(steps.held[c], law.force))
        elif law.narrow[c] > 0.0:
            one = along(system, steps.trial, system.masses, 1, c, steps.driven[1, 1])
            for i in range(2, COUNT):
                other = along(system, steps.trial, system.masses, i, c, steps.driven[1, i])
                if min(abs(one), abs(other)) < 5.0 * law.narrow[c]:
                    widest = max(widest, min(abs(one - other) / law.narrow[c], 10.0))
                one = other
    return max(worst / law.tolerance, widest**7)


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
def first_crossing(steps: Any, scale: float) -> float:
    """Return the share of the step at which the function watched first falls below zero; 2: it is proven not to."""
    given, curve, part, tiny = steps.watch, steps.curve[0], steps.curve[1], -TINY * scale
    for i in range(COUNT):
        curve[i] = np.sum(BERNSTEIN[i] * given)
    curve[0], curve[STAGES] = max(given[0], 0.0) if given[0] > -LOOSE * scale else given[0], given[STAGES]
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


@inlined
def land(flow: Carrier, slot: int, c: int, which: int, h: float, theta: float) -> float:
    """Make the trial step again so that it ends at an event; return its length, or -1 if there is none.

    The polynomial of a long step may cross zero where the motion does not (just after a release it moves like t^2):
    then the step must be shorter. The length is Newton's, kept between what is too short and what is too long.
    """
    work, steps = flow.work, flow.work.steps
    steps.values[:] = steps.trial
    length, short, long, left, scale = theta * h, 0.0, h, FAILED, 1.0
    for _ in range(LOOKS):
        predict(steps, 0.0, length / h)
        if not step(flow, slot, length):
            return -1.0
        hold(flow, slot)
        scale = watch_nodes(flow, c, which)
        left, rise = steps.watch[STAGES], np.sum(LAST * (steps.watch - steps.watch[STAGES])) / length
        work.fall = rise
        if abs(left) <= TINY * scale and (rise < 0.0 or h < SHORTEST_TRY):
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
    return length if abs(left) <= LOOSE * scale or h < SHORTEST_TRY else -1.0


@inner
def record(flow: Carrier, h: float) -> None:
    """Append the step just tried to the log, as far as there is space; count it in any case.

    Slip of a contact is its speed where the contact creeps, else its direction.
    """
    system, work, law, steps = flow.system, flow.work, flow.system.law, flow.work.steps
    log, contacts = flow.pieces, system.contacts
    row, first = begin_piece(system, work, log, h), SIDE + contacts
    if row < 0:
        return
    for k in range(steps.components):
        for i in range(COUNT):
            log[row, first + COUNT * k + i] = steps.trial[k, i]
    first += COUNT * steps.components
    for c in range(contacts):
        states, at = law.states[c], law.at[c]
        for i in range(COUNT):
            z = along(system, steps.trial, 0, i, c, steps.driven[0, i])
            v = along(system, steps.trial, system.masses, i, c, steps.driven[1, i])
            force, slip = steps.held[c, i], float(work.side[c])
            if states < 0:
                force = work.kappa[c] * z + work.offset[c] + system.dashpot[c] * v
            elif work.kappa[c] != inf:
                w = steps.trial[at, i] if states > 0 else 0.0
                d = contact_at(system, c, slip, z, v, w, steps.trial[at + 1, i] if states > 1 else 0.0)
                force, slip = d[0] + system.dashpot[c] * v, d[5]
            log[row, first + COUNT * c + i], log[row, first + COUNT * (contacts + c) + i] = force, slip


def look(system: Any, work: Any, pieces: FloatArray, k: int, t: float) -> int:
    """As `account.look`, of a recorded step: its polynomial."""
    n, contacts = system.masses, system.contacts
    at, theta = SIDE + contacts, min(t / pieces[k, 1], 1.0)
    if work.entered != k:
        begin_look(system, work, pieces, k)
    base_at(system, work, t)
    for a in range(n):
        work.now_q[a] = between(pieces[k, at + COUNT * a :], theta)
        work.now_v[a] = between(pieces[k, at + COUNT * (n + a) :], theta)
    at += COUNT * (2 * n + system.sliders - system.first[contacts])
    for c in range(contacts):
        work.force[c] = between(pieces[k, at + COUNT * c :], theta)
        if system.law.states[c] > 0:
            work.slip[c] = between(pieces[k, at + COUNT * (contacts + c) :], theta)
        else:
            work.slip[c] = place_of(system, work.now_v, c, work.f[1]) if pieces[k, SIDE + c] != 0.0 else 0.0
    return 0


@inlined
def first_event(flow: Carrier, corners: bool) -> tuple[float, int, int]:
    """Return the share of the trial step at which a phase ends, by which contact and how; (2, -1, 0): it does not.

    Without `corners` those of contacts with states of their own are not looked for.
    """
    work, share, contact, how = flow.work, 2.0, -1, 0
    for c in range(flow.system.contacts):
        for which in range(3):
            if not watches(work, c, which) or (flow.system.law.states[c] > 0 and not corners):
                continue
            scale = watch_nodes(flow, c, which)
            theta = first_crossing(flow.work.steps, scale)
            if which != TURN_OF and is_rigid(flow.system, c) and theta < share and theta < 10.0 * SHORTEST:
                theta = 0.0 if flow.work.steps.watch[0] <= LOOSE * scale else theta  # it cannot hold from the begin on
            if theta < share:
                share, contact, how = theta, c, which
    return share, contact, how


@inlined
def advance(flow: Carrier, slot: int, tangent: bool) -> bool:
    """Take one step, up to the end of the run or the phase at most; False: the steps allowed are used up.

    By which contact the phase ends and how is written as `flow.through_phase` does.
    """
    work, steps, t = flow.work, flow.work.steps, flow.work.tau
    while work.left > 0.0:
        h = min(steps.next, work.until - t)
        if 0.0 < h < 3.0 * steps.last:
            predict(steps, 1.0, h / steps.last)
        else:
            guess(flow, h)
        if not step(flow, slot, h):
            steps.next, steps.last = 0.25 * h, 0.0
            continue
        error = error_of(flow, slot)
        change = SAFETY * max(error, 1e-12) ** (-1.0 / 7.0)
        if error > 1.0:
            steps.next = h * max(SHRINK, change)
            continue
        theta, c, which = first_event(flow, work.quick < TWITCHES)
        grown = h * min(GROW, max(SHRINK, change))
        steps.next = grown if h >= steps.next else max(grown, steps.next)
        landed = h
        if theta <= 1.0:
            work.contact, work.how = c, which
        if theta == 0.0:
            watch_nodes(flow, c, which)
            work.fall = STAGES * (np.sum(BERNSTEIN[1] * steps.watch) - steps.watch[0]) / h
            steps.bare[:, :, STAGES] = steps.bare[:, :, 0]
            return True
        if theta <= 1.0:
            landed = land(flow, slot, c, which, h, theta)
            if landed < 0.0 or error_of(flow, slot) > 1.0:
                steps.next, steps.last, work.contact = 0.25 * h if landed < 0.0 else 0.5 * landed, 0.0, -1
                continue
        if tangent:
            carry_tangent(flow, landed)
        accept(flow, t, landed)
        steps.last = landed
        if theta > 1.0 and h == work.until - t:
            work.tau = work.until
        return True
    return False


@inner
def accept(flow: Carrier, t: float, h: float) -> None:
    """Make the end of the trial step the state at hand; count, measure and record the step."""
    work, system, steps = flow.work, flow.system, flow.work.steps
    n = system.masses
    steps.values[:] = steps.trial
    for a in range(n):
        work.q[a], work.v[a] = steps.trial[a, STAGES], steps.trial[n + a, STAGES]
        work.high[a], work.low[a] = max(work.high[a], work.q[a]), min(work.low[a], work.q[a])
    for c in range(system.contacts):
        if work.side[c] != 0:
            begun = along(system, steps.trial, 0, 0, c, steps.driven[0, 0])
            work.path += abs(along(system, steps.trial, 0, STAGES, c, steps.driven[0, STAGES]) - begun)
    for k in range(2 * n, steps.components):
        work.anchor[system.first[system.contacts] - 2 * n + k] = steps.trial[k, STAGES]
    record(flow, h)
    work.tau = t + h
    move_cubic(system.cubic, h)
    base_at_time(system, work)


@inner
def guess(flow: Carrier, h: float) -> None:
    """Write a first guess of the stages without a step before: the state, moving on as it does."""
    system, work, steps = flow.system, flow.work, flow.work.steps
    n, first = system.masses, system.first[system.contacts] - 2 * system.masses
    for i in range(1, COUNT):
        for a in range(n):
            steps.trial[a, i], steps.trial[n + a, i] = work.q[a] + h * NODES[i] * work.v[a], work.v[a]
        for k in range(2 * n, steps.components):
            steps.trial[k, i] = work.anchor[first + k]


@inner
def begin_phase(flow: Carrier, slot: int) -> None:
    """Write what net forces and the base make of accelerations, and the constant forces of springs."""
    system, work, steps, n = flow.system, flow.work, flow.work.steps, flow.system.masses
    steps.moved[:], steps.constant[:] = 0.0, 0.0
    steps.mobile[:n, :n] = system.mobility[:n, :n]
    for c in range(system.contacts):
        if work.kappa[c] == inf:
            for a in range(n):
                by_force = dot(system.mobility[a], system.row[c], n)
                steps.moved[a] += by_force * work.phases.bind[slot, c]
                for b in range(n):
                    steps.mobile[a, b] -= by_force * work.phases.grip[slot, c, b]
        elif system.law.states[c] < 0:
            for a in range(n):
                steps.constant[a] -= system.row[c, a] * work.offset[c]


def through_phase(system: Any, work: Any, pieces: FloatArray, slot: int, tangent: bool) -> int:
    """As `flow.through_phase`, step by step.

    Recorded is of each step, after what `begin_piece` does: at its nodes values, contacts' force, slip (8 each).
    """
    flow, steps, begun = Carrier(system, work, pieces), work.steps, work.tau
    begin_phase(flow, slot)
    steps.last, work.contact, work.seen[1], work.seen[2] = 0.0, -1, 0.0, 0.0
    while work.contact < 0 and work.tau < work.until:
        if not advance(flow, slot, tangent):
            return TIRED
        if steps.next < SHORTEST * SHORTEST:
            return CHATTER
        if not freeze(system, work):
            return PULLS
        if work.quick >= TWITCHES:
            work.quick = 0
            turn_corners(system, work)
    if work.contact >= 0:
        second_look = work.tau - begun < SHORT and system.law.states[work.contact] > 0
        work.quick = work.quick + 1 if second_look else 0
    return DONE


INTEGRATOR, LOOKER = address_of(through_phase, ADVANCE), address_of(look, LOOK)
