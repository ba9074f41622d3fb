"""What repeats: the orbit by Newton's method on the Poincare map, or the one that the motion from a start settles on.

The section is at a phase of the drive. Its map is of whole cycles, or of half a cycle whose end is mirrored where the
problem is its own mirror image. Where friction is the same at rest, in slip and at all places, two motions never move
apart in ``sum dq^2 + (r dv)^2 + spring d(force)^2``: there is one orbit. Else orbits may coexist, last many cycles or
not exist at all, and the motion from a start is followed until it is about to repeat: its cycles pass the same events
as those one period before, and the orbit that Newton's method finds there draws it.
"""

from math import exp, inf, log, pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.simulator import row as places
from frictionlab.simulator.compiled import inlined, inner
from frictionlab.simulator.exact.flow import call_run, is_integrated
from frictionlab.simulator.exact.phase import DONE, drive_size, factorise, substitute

TURN = 2.0 * pi
STEPS, FEW_STEPS = 60, 8  # of Newton's method, firmly and in full steps alone
LEAST = 0.01  # share of a step that is tried at least
FULL, SOME, MANY = 0, 6, 60  # times that the map is applied where no share of a step helps; FULL: none but whole steps
ROUNDED = -1.0
CONVERGED, ALMOST = 1e-13, 1e-8  # of an orbit's size: what steps leave of a miss, and what is taken where no less comes
SQUARINGS = 40  # of the map's derivative: its largest multiplier to 2^-40
LONGEST = 512  # cycles of the longest orbit looked for
LONGEST_ELASTIC = 128
ENOUGH = 384  # for a motion that does not pass the same events in each, beside those in which friction stops it
FOR_GOOD = 1e-7  # of its size: a motion so near to an orbit slips where that does, and nowhere else
NEAR = 0.01  # of its size: how near a motion must come to where it was before an orbit is tried
EAGER = 64  # maps after each of which that is looked for; later after every eighth

VERDICT = (places.PERIODIC, places.CHATTERED, places.PULLING, places.COSTLY, places.RUNAWAY)  # of how a run ended

LEG = np.dtype([("tau", "f8"), ("span", "f8"), ("turns", "i8"), ("sign", "f8"), ("stalls", "i8")])
"""The map whose fixed point is an orbit: turns times a span from tau on, the end times sign; `shoot` reads stalls."""


@inner
def copy(values: FloatArray, to: FloatArray) -> None:
    """Write values into another array."""
    for k in range(len(to)):
        to[k] = values[k]


@inner
def write_image(system: Any, work: Any, leg: Any, image: FloatArray) -> None:
    """Write the image that the run last carried has come to."""
    n = system.masses
    for a in range(n):
        image[a], image[n + a] = leg.sign * work.q[a], leg.sign * work.v[a]
    for i in range(system.sliders):
        image[2 * n + i] = work.anchor[i] if leg.sign > 0.0 else system.mirror[i] * work.anchor[i]


@inner
def carry(flow: Any, leg: Any, y: FloatArray, image: FloatArray, tangent: bool) -> int:
    """Write the image of a state under the map of a leg; return how the run ended."""
    system, work = flow.system, flow.work
    n = system.masses
    code, size = DONE, 2 * n + system.sliders
    for a in range(n):
        work.q[a], work.v[a] = y[a], y[n + a]
    for i in range(system.sliders):
        work.anchor[i] = y[2 * n + i]
    for turn in range(leg.turns):
        work.tau = leg.tau
        code = call_run(system.run, (system, work, flow.pieces, leg.span, tangent, turn == 0))
        if code != DONE:
            return code
    write_image(system, work, leg, image)
    for a in range(size if tangent and leg.sign < 0.0 else 0):
        for b in range(size):
            work.jacobian[a, b] *= -1.0 if a < 2 * n else system.mirror[a - 2 * n]
    return code


@inner
def distance(system: Any, y: FloatArray, other: FloatArray) -> float:
    """Return the distance of two states, in the norm that friction never lets grow (of one mass)."""
    n, total = system.masses, 0.0
    for a in range(n):
        total += (y[a] - other[a]) ** 2 + (system.r * (y[n + a] - other[n + a])) ** 2
    for c in range(system.contacts):
        for i in range(system.first[c], system.first[c + 1]):
            apart = other[2 * n + i] - y[2 * n + i]
            for a in range(n):
                apart += system.row[c, a] * (y[a] - other[a])
            total += system.spring[i] * apart * apart
    for k in range(2 * n, 2 * n + system.sliders - system.first[system.contacts]):  # states of laws
        apart = other[system.first[system.contacts] + k] - y[system.first[system.contacts] + k]
        total += (system.law.scale[0] / system.law.scale[k] * apart) ** 2
    return sqrt(total)


@inner
def floor_of(system: Any, extent: float) -> float:
    """Return the miss that is none in an orbit of a size: what rounding leaves, or steps."""
    return ALMOST * extent if is_integrated(system) else 1e-12 * extent + 1e-14 * drive_size(system)


@inner
def size_of(system: Any, work: Any, y: FloatArray) -> float:
    """Return the size of the motion last carried from a state, against which its miss is judged."""
    n, total = system.masses, 0.0
    for a in range(n):
        total += y[a] ** 2 + (system.r * y[n + a]) ** 2 + (work.high[a] - work.low[a]) ** 2
    return sqrt(total)


@inner
def unknowns(system: Any, work: Any, sign: float) -> NDArray[np.int64]:
    """Return which entries of a state a map changes: anchors of sliders that have not slipped in the run stay.

    Under a mirrored map (sign -1) they are unknowns too: mirrored they must be themselves.
    """
    count = 2 * system.masses
    which = np.empty(count + system.sliders, np.int64)
    for a in range(count):
        which[a] = a
    for i in range(system.sliders):
        if sign < 0.0 or work.slipped[i]:
            which[count] = 2 * system.masses + i
            count += 1
    return which[:count]


@inlined
def newton_target(system: Any, work: Any, leg: Any, y: FloatArray, image: FloatArray, target: FloatArray) -> bool:
    """Write where Newton's method expects the fixed point; False if it cannot say."""
    which = unknowns(system, work, leg.sign)
    size = len(which)
    matrix, step, rows = np.empty((size, size)), np.empty(size), np.empty(size, np.int64)
    for i in range(size):
        for j in range(size):
            matrix[i, j] = (1.0 if i == j else 0.0) - work.jacobian[which[i], which[j]]
        step[i] = image[which[i]] - y[which[i]]
    if not factorise(matrix, size, rows, 0.0):
        return False
    substitute(matrix, size, rows, step)
    copy(y, target)
    for i in range(size):
        target[which[i]] += step[i]
        if not abs(target[which[i]]) < 1e150:
            return False
    return True


@inner
def shoot(flow: Any, leg: Any, y: FloatArray) -> tuple[float, int]:
    """Move a state to the fixed point of a leg's map nearby; return its miss and how the last run ended.

    Each of Newton's steps must halve the miss. Where the map itself may be applied, some times (`stalls`), they are
    shortened until the miss shrinks; where none helps, it is, once, then twice, and so on. The run last carried is that
    from the state.
    """
    system, work = flow.system, flow.work
    image, turns, stalls = np.empty(len(y)), 1, leg.stalls
    code = carry(flow, leg, y, image, True)
    miss = distance(system, y, image)
    least = LEAST if stalls > FULL else 1.0
    for _ in range(STEPS if stalls > FULL else FEW_STEPS):
        if code != DONE or miss <= (CONVERGED if is_integrated(system) else 2e-16) * size_of(system, work, y):
            break
        less = stepped(flow, leg, y, image, miss, least)
        if ROUNDED < less < miss:
            miss = less
            continue
        if less == ROUNDED:  # only rounding is left
            break
        if stalls == FULL:
            return miss, carry(flow, leg, y, image, True)
        stalls -= 1
        for _ in range(turns):
            copy(image, y)
            code = carry(flow, leg, y, image, True)
            if code != DONE:
                return miss, code
        miss, turns = distance(system, y, image), min(2 * turns, 64)
    return miss, code


@inlined
def stepped(flow: Any, leg: Any, y: FloatArray, image: FloatArray, miss: float, least: float) -> float:
    """Move a state and its image by the longest share of Newton's step that helps; return the miss then.

    ROUNDED: what is left is rounding, and the run last carried is that from the state; infinite: no share helps.
    """
    system, work, size = flow.system, flow.work, len(y)
    target, trial, ahead = np.empty(size), np.empty(size), np.empty(size)
    extent = size_of(system, work, y)
    if not newton_target(system, work, leg, y, image, target):
        return inf
    if distance(system, y, target) <= 4e-15 * extent:
        return ROUNDED
    share = 1.0
    while share >= least:
        for k in range(size):
            trial[k] = y[k] + share * (target[k] - y[k])
        less = distance(system, trial, ahead) if carry(flow, leg, trial, ahead, True) == DONE else inf
        if less < (1.0 - 0.5 * share) * miss:
            copy(trial, y)
            copy(ahead, image)
            return less
        share *= 0.25
        if miss <= (1.0 if is_integrated(system) else 0.1) * floor_of(system, extent):
            carry(flow, leg, y, image, True)
            return ROUNDED
    return inf


@inner
def multiplier(system: Any, work: Any) -> float:
    """Return the Floquet multiplier of largest modulus of the leg last carried: signed if real, else its modulus.

    Anchors of sliders that never slip, and speeds of what holds, are left out: they have none.
    """
    which = unknowns(system, work, 1.0)
    size = len(which)
    if size == 2:
        half = 0.5 * (work.jacobian[0, 0] + work.jacobian[1, 1])
        det = work.jacobian[0, 0] * work.jacobian[1, 1] - work.jacobian[0, 1] * work.jacobian[1, 0]
        inside = half * half - det
        if inside < 4e-16 * half * half:  # also of a pair that only rounding parts
            return sqrt(max(det, 0.0))
        return half + sqrt(inside) if half >= 0.0 else half - sqrt(inside)
    first, power = np.empty((size, size)), np.empty((size, size))
    for i in range(size):
        for j in range(size):
            first[i, j] = power[i, j] = work.jacobian[which[i], which[j]]
    grown, weight = 0.0, 1.0
    for _ in range(SQUARINGS):  # the 2^m-th root is what remains of the norm
        norm = 0.0
        for value in power.ravel():
            norm = max(norm, abs(value))
        if norm == 0.0:
            return 0.0
        grown += weight * log(norm)
        weight *= 0.5
        power = squared(power, 1.0 / norm)
    radius, own, mapped = exp(grown), 0.0, 0.0  # what is left of the map is `radius` times this power, or minus that
    for i in range(size):
        own += power[i, i]
        for j in range(size):
            mapped += first[i, j] * power[j, i]
    return -radius if own != 0.0 and abs(mapped + radius * own) <= 1e-6 * radius * abs(own) else radius


@inner
def is_stable(system: Any, work: Any) -> bool:
    """Return whether the orbit last carried draws motions nearby, as far as its derivative says it."""
    return abs(multiplier(system, work)) <= 1.0 + 1e-9 and (system.sliders <= 1 or is_integrated(system))


@inner
def squared(matrix: FloatArray, share: float) -> FloatArray:
    """Return the square of a share of a matrix: without a library that takes seconds to compile in."""
    size, out = len(matrix), np.zeros((len(matrix), len(matrix)))
    for i in range(size):
        for k in range(size):
            if matrix[i, k] != 0.0:
                for j in range(size):
                    out[i, j] += (share * matrix[i, k]) * (share * matrix[k, j])
    return out


@inlined
def finish(flow: Any, leg: Any, y: FloatArray) -> tuple[float, bool]:
    """Find the orbit beside a state; return its miss, and whether the motion from the state settles on it, as y then.

    Newton's method in full steps, each of which must halve the miss. The motion settles there if the orbit is stable,
    both pass the same events over a period, and the map is nearly linear between them: what it brings the motion nearer
    by is more than twice what it departs from its derivative.
    """
    system, work, size = flow.system, flow.work, len(y)
    later, target, ahead, orbit = np.empty(size), np.empty(size), np.empty(size), y.copy()
    if carry(flow, leg, y, later, False) != DONE:
        return inf, False
    passed, extent = work.signature, size_of(system, work, y)
    leg.stalls = FULL
    miss, code = shoot(flow, leg, orbit)
    floor, radius = floor_of(system, extent), abs(multiplier(system, work))
    if code != DONE or miss > floor:
        return miss, False
    for k in range(size):
        bent = later[k] - orbit[k]
        for j in range(size):
            bent -= work.jacobian[k, j] * (y[j] - orbit[j])
        target[k], ahead[k] = bent, 0.0
    straight = distance(system, target, ahead) <= 0.5 * max(0.0, 1.0 - radius) * distance(system, y, orbit) + floor
    settles = straight and work.signature == passed and radius <= 1.0 + 1e-9
    for c in range(system.contacts):
        for i in range(system.first[c], system.first[c + 1]):
            if system.gradient[c] != 0.0 and not work.slipped[i]:  # it holds what rest leaves in it, for good
                settles = settles and distance(system, y, orbit) <= FOR_GOOD * extent
    for k in range(size):
        y[k] = orbit[k] if settles else y[k]
    return miss, settles


@inner
def whole(leg: Any, maps: int, each: int) -> None:
    """Make a leg that of so many maps; of two to a cycle, one is half of it mirrored, and three take three cycles."""
    leg.tau, leg.span, leg.turns, leg.sign = 0.0, TURN, maps, 1.0
    if each == 2 and maps == 1:
        leg.span, leg.sign = pi, -1.0
    elif each == 2:
        leg.turns = maps if maps % 2 == 1 else maps // 2


@inlined
def shortest(flow: Any, leg: Any, y: FloatArray, miss: float) -> float:
    """Shorten a leg to the fewest cycles after which the orbit already repeats; return its miss."""
    system, work = flow.system, flow.work
    image, turns = np.empty(len(y)), leg.turns
    for part in range(1, turns):
        if turns % part == 0:
            leg.turns = part
            code = carry(flow, leg, y, image, True)
            less = distance(system, y, image)
            if code == DONE and less <= 1e3 * floor_of(system, size_of(system, work, y)):
                leg.stalls = FULL
                return shoot(flow, leg, y)[0]
    leg.turns = turns
    carry(flow, leg, y, image, True)
    return miss


@inlined
def settle_from(flow: Any, leg: Any, y: FloatArray, each: int) -> tuple[float, int]:
    """Find the orbit that the motion from a state at tau = 0 settles on; return its miss and an outcome.

    Trials may cost half of the cycles followed, and each period is tried again only when the motion has come ten times
    nearer.
    """
    system, work, size = flow.system, flow.work, len(y)
    most = (LONGEST_ELASTIC if system.sliders else LONGEST) * each
    keep = 2 * most + 1
    past, passed = np.zeros((keep, size)), np.zeros(keep, np.int64)
    tried, spent, still = np.full(most + 1, NEAR), 0.0, 0
    brake = 1e-3 * drive_size(system)  # at least
    for c in range(system.contacts):
        brake += system.brake[c]
    for at in range(1, places.PATIENCE * each + 1):
        whole(leg, 1, each)
        code = carry(flow, leg, y, past[at % keep], False)
        if code != DONE:
            return inf, VERDICT[code]
        still = still + 1 if work.path == 0.0 else 0
        copy(past[at % keep], y)
        if still == each and system.sliders == 0 and system.masses == 1:
            for k in range(size):
                y[k] = -y[k] if each == 2 and at % 2 == 1 else y[k]
            whole(leg, 1, 1)
            return 0.0, places.STUCK
        passed[at % keep], extent = work.signature, size_of(system, work, y)
        if at >= (ENOUGH + extent / brake) * each and passed[at % keep] != passed[(at - 1) % keep]:
            break
        if at <= EAGER or at % 8 == 0:
            maps, away = nearest(system, past, passed, at, tried, each, extent)
            whole(leg, max(maps, 1), each)
            if maps > 0 and (away <= 1e-9 * extent or spent + leg.turns <= 16.0 + 0.5 * at / each):
                miss, settles = finish(flow, leg, y)
                if settles:
                    return shortest(flow, leg, y, miss), places.PERIODIC
                spent, tried[maps] = spent + 2.0 * leg.turns, 0.1 * away / extent
    return inf, places.NOT_FOUND


@inner
def nearest(
    system: Any, past: FloatArray, passed: NDArray[np.int64], at: int, tried: FloatArray, each: int, extent: float
) -> tuple[int, float]:
    """Return the number of maps after which a motion has come nearest to where it was, and how near; none: 0, inf.

    Of two about as near the shorter; only where it passes the same events as one period before.
    """
    keep, best, least = len(past), 0, inf
    for maps in range(1, min(len(tried) - 1, at // 2) + 1):
        if each == 2 and at % 2 == 1 and maps > 1:  # the mirror image of the motion, not the motion
            continue
        now, old = at % keep, (at - maps) % keep
        if passed[now] != passed[old]:
            continue
        away = distance(system, past[now], past[old])
        if not away <= min(0.1 * least, tried[maps] * extent):
            continue
        i = 0
        while i < maps and passed[(at - i) % keep] == passed[(at - i - maps) % keep]:
            i += 1
        if i == maps:
            best, least = maps, away
    return best, least
