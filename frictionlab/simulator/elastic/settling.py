"""The orbit that the motion from a state settles on, where several may exist."""

from math import exp, hypot, inf, log, sqrt

from frictionlab.simulator.elastic.events import carry_elastic
from frictionlab.simulator.elastic.layout import ElasticRoom, OrbitGuess, Sliders
from frictionlab.simulator.elastic.shooting import (
    away,
    distance,
    elastic_multiplier,
    follow,
    has_slipped_out,
    keep,
    reduced,
    shoot_elastic,
    shoot_on,
    span_of,
    spread,
)
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import TURN, Buffer, Force, Leg, Rig

LONGEST_ORBIT = 128  # cycles of the longest orbit looked for
KEPT = 2 * LONGEST_ORBIT + 1  # cycles of a motion that are remembered
NEARER = 0.1  # an orbit of more cycles is tried if the motion comes so much nearer to itself after them
TRIALS, EAGER = 0.1, 40.0  # of the cycles followed: what trials may have; cycles granted at once
NEAR = 0.01  # of its size: how near a motion must come to itself
LIKELY_ORBIT = 2  # cycles of an orbit that Newton may find from afar
NEAR_STEPS = 8.0  # Newton steps to one of several
CYCLES_WAITED = 1024.0  # for an orbit where several may exist
PHASES_WAITED = 1e5  # the same, where a cycle has many
PARTED = 1.02  # growth of the distance in a cycle from which motions move apart
CYCLES_COMPARED = 200.0
UNDECIDED = 0.9  # growth from which the two are compared for longer: a stable orbit's neighbours come nearer
CYCLES_UNDECIDED = 2000.0
PARTED_SLOWLY = 1.01  # over that many cycles; what parts by a power of time, not exponentially, grows by less
FIRST_LOOK = 2.0  # cycles after which Newton looks for an orbit wherever the motion is
LONGEST_WAIT = 256.0  # cycles from rest until no slider that never slips in the orbit can slip any more
STRAIGHT = 0.5  # of what the map brings a motion nearer to an orbit, that it may depart from its derivative by
CURVED, STRAIGHTEST = 0.05, 0.01  # of the distance: that it may at most; that it always may, however near


def is_stable(rig: Rig, sliders: Sliders, room: ElasticRoom, miss: float, code: int) -> bool:
    """Tell whether a search has come to an orbit, and a stable one."""
    return code == layout.DONE and spread(rig, room, miss) and abs(elastic_multiplier(sliders, room)) <= 1.0 + 1e-9


def settle(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return the orbit of up to LONGEST_ORBIT cycles that the motion from the room's start settles on, if it is stable.

    The motion is waited for until an orbit draws it that Newton finds from where it nearly repeats. Where it takes too
    long, a stable orbit that Newton comes to from there is. The start is at tau = 0.
    """
    leg, passed, tick, spent, wait = Leg(0.0, TURN, 1.0, 1.0), 0.0, 0.0, 0.0, FIRST_LOOK
    past, near, now = [0.0] * (3 * KEPT), [NEAR] * (LONGEST_ORBIT + 1), room.start.copy()
    while tick < CYCLES_WAITED and passed < PHASES_WAITED:
        code = follow(rig, sliders, force, leg, 1.0, room)
        if code != layout.DONE:
            return leg, inf, code
        tick, passed = tick + 1.0, passed + room.tally[layout.PHASES]
        at = 3 * (int(tick) % KEPT)
        past[at], past[at + 1], past[at + 2] = room.start[0], room.start[1], signature(sliders)
        turns, share = nearest_return(rig, past, near, tick, room)
        if tick >= wait:
            turns, share, wait = 1, near[1], 2.0 * wait
        if turns > 0 and spent + turns <= TRIALS * (tick + EAGER):
            trial = Leg(0.0, TURN, float(turns), 1.0)
            keep(room.start, now)
            miss, settles = settles_nearby(rig, sliders, force, now, trial, tick, room)
            if settles:
                return fewest(rig, sliders, force, trial, miss, room)
            keep(now, room.start)
            near[turns], spent = min(near[turns], 0.1 * share), spent + turns
    keep(room.start, now)
    growth, parts = growth_of_distance(rig, sliders, force, now, room)
    if parts:
        return leg, growth, layout.WANDERS
    return any_stable(rig, sliders, force, now, room)


def signature(sliders: Sliders) -> float:
    """Return a number that is the same for two cycles in which each slider slips as often, to either side."""
    total = 0.0
    for i in range(len(sliders.force)):
        total += (i + 1.0) * (sliders.slips[i] + 1024.0 * sliders.falls[i])
    return total


def has_gone_alike(past: list[float], tick: float, cycles: int) -> bool:
    """Tell whether sliders have slipped in each of the last cycles as they did so many cycles before."""
    i = 0
    while i < cycles and past[3 * (int(tick - i) % KEPT) + 2] == past[3 * (int(tick - i - cycles) % KEPT) + 2]:
        i += 1
    return i == cycles


def nearest_return(rig: Rig, past: list[float], near: list[float], tick: float, room: ElasticRoom) -> tuple[int, float]:
    """Return after how many cycles a motion comes nearest to where it was, and how near, as a share of its size.

    Of two about as near the shorter; none as near as asked for: 0. `past` holds z, v and the signature of its last
    cycles.
    """
    extent, best, least = span_of(rig, room), 0, inf
    z, v = room.start[0], rig.plain.r * room.start[1]
    for k in range(1, int(min(LONGEST_ORBIT, 0.5 * tick)) + 1):
        old = 3 * (int(tick - k) % KEPT)
        gone = hypot(z - past[old], v - rig.plain.r * past[old + 1]) / extent
        if gone <= near[k] and gone < NEARER * least and has_gone_alike(past, tick, k):
            best, least = k, gone
    return best, least


def growth_of_distance(rig: Rig, sliders: Sliders, force: Force, now: Buffer, room: ElasticRoom) -> tuple[float, bool]:
    """Return by what factor two motions close by move apart in a cycle, in the geometric mean, and whether they do.

    Both are carried; after each cycle the second is drawn close again, along the line between them. Where they hardly
    move apart over CYCLES_COMPARED, it is for CYCLES_UNDECIDED.
    """
    compared, least = CYCLES_COMPARED, PARTED
    leg, size, grown, cycles = Leg(0.0, TURN, 1.0, 1.0), len(now), 0.0, 0.0
    first, second = [0.0] * size, [0.0] * size
    keep(now, first)
    keep(now, second)
    tiny = 1e-8 * (abs(now[0]) + rig.plain.rate)
    second[0] += tiny
    while cycles < compared:
        if cycles == CYCLES_COMPARED - 1.0 and UNDECIDED < exp(grown / cycles) <= PARTED:
            compared, least = CYCLES_UNDECIDED, PARTED_SLOWLY
        keep(second, room.start)
        code = carry_elastic(rig, sliders, force, leg, room, layout.PLAIN)
        keep(room.image, second)
        keep(first, room.start)
        if carry_elastic(rig, sliders, force, leg, room, layout.PLAIN) != layout.DONE or code != layout.DONE:
            break
        keep(room.image, first)
        gone = away(rig, sliders, second, first)
        if gone == 0.0:
            return 0.0, False
        share = tiny / gone
        grown -= log(share)
        cycles += 1.0
        for i in range(size):
            second[i] = first[i] + share * (second[i] - first[i])
        for i in range(len(sliders.force)):
            second[3 + 2 * i] = first[3 + 2 * i]
    growth = exp(grown / max(cycles, 1.0))
    return growth, growth > least


def fewest(
    rig: Rig, sliders: Sliders, force: Force, leg: Leg, miss: float, room: ElasticRoom
) -> tuple[Leg, float, int]:
    """Return the leg of fewest cycles after which the orbit at the room's start already repeats; carried last."""
    for turns in range(1, int(leg.turns)):
        if int(leg.turns) % turns == 0:
            part = Leg(leg.tau, leg.span, float(turns), leg.sign)
            code = carry_elastic(rig, sliders, force, part, room, layout.DERIVED)
            less = distance(rig, sliders, room)
            if code == layout.DONE and less <= 1e-9 * span_of(rig, room):
                return part, less, layout.DONE
    if leg.turns > 1.0:
        carry_elastic(rig, sliders, force, leg, room, layout.DERIVED)
    return leg, miss, layout.DONE


def any_stable(rig: Rig, sliders: Sliders, force: Force, now: Buffer, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return a stable orbit of few cycles to which Newton comes from a state, however far it lies."""
    leg = Leg(0.0, TURN, 1.0, 1.0)
    for turns in range(1, LIKELY_ORBIT + 1):
        keep(now, room.start)
        follow(rig, sliders, force, leg, 1.0, room)  # what slips at the section is read from a cycle
        trial = Leg(0.0, TURN, float(turns), 1.0)
        miss, code = shoot_elastic(rig, sliders, force, trial, room, 4.0 * NEAR_STEPS, layout.PATIENT)
        if is_stable(rig, sliders, room, miss, code):
            return trial, miss, code
    return leg, inf, layout.DONE


def candidate_of(sliders: Sliders, room: ElasticRoom) -> OrbitGuess:
    """Return the orbit just carried over whole cycles with its derivative, as one that a motion may settle on."""
    count, size = len(sliders.force), int(room.tally[layout.COLUMNS])
    state = [0.0] * (2 + 2 * count)
    rows, jacobian = [0] * size, [0.0] * (size * size)
    for i in range(len(state)):
        state[i] = room.start[i]
    for i in range(size):
        rows[i] = reduced(sliders, room, i)
        for j in range(size):
            jacobian[i * size + j] = room.jacobian[rows[i] * size + j]
    contraction, tally = 1.0 - abs(elastic_multiplier(sliders, room)), room.tally
    return OrbitGuess(state, passed_in(sliders), rows, jacobian, contraction, tally[layout.HIGH], tally[layout.LOW])


def put_beside(rig: Rig, sliders: Sliders, orbit: OrbitGuess, now: Buffer) -> list[float]:
    """Return the state of an orbit with what a motion's sliders hold that never slip in it.

    Without a gradient it is on an orbit again, shifted in z.
    """
    residue, spring, beside = 0.0, 1.0, [0.0] * len(now)
    for i in range(len(now)):
        beside[i] = orbit.state[i]
    for i in range(len(sliders.force)):
        if orbit.passed[2 * i] == 0.0:
            change = now[2 + 2 * i] - orbit.state[2 + 2 * i] - sliders.stiffness[i] * (now[0] - orbit.state[0])
            residue, spring = residue + change, spring + sliders.stiffness[i]
    beside[0] -= residue / spring
    for i in range(len(sliders.force)):
        at = 2 + 2 * i
        if orbit.passed[2 * i] == 0.0:
            beside[at] = now[at] + sliders.stiffness[i] * (beside[0] - now[0])
        elif beside[at + 1] != 0.0:
            beside[at] = beside[at + 1] * sliders.strength[i] * (1.0 + rig.contact.gradient * beside[0])
    return beside


def is_for_good(rig: Rig, sliders: Sliders, orbit: OrbitGuess, beside: Buffer, later: Buffer, cycle: float) -> bool:
    """Tell whether what a motion's sliders hold that never slip in an orbit will not change any more.

    `beside` is the orbit that holds the same. After LONGEST_WAIT it may: only without break-away is it waited for so.
    """
    patience = LONGEST_WAIT if max(rig.contact.static_up, rig.contact.static_down) == 1.0 else CYCLES_WAITED
    return cycle >= patience or has_slipped_out(rig, sliders, orbit, beside, later)


def settles_nearby(
    rig: Rig, sliders: Sliders, force: Force, now: Buffer, leg: Leg, cycle: float, room: ElasticRoom
) -> tuple[float, bool]:
    """Return the miss of the orbit that Newton finds from `now`, the room's start, and whether that settles on it."""
    code = carry_elastic(rig, sliders, force, leg, room, layout.DERIVED)
    passed = passed_in(sliders)
    later = room.image.copy()
    miss, code = shoot_on(rig, sliders, force, leg, room, NEAR_STEPS, layout.HASTY if leg.turns == 1.0 else 0.0, code)
    if not is_stable(rig, sliders, room, miss, code):
        return miss, False
    orbit = candidate_of(sliders, room)
    drawn = slips_alike(passed, orbit) and draws(rig, sliders, orbit, now, later)
    return miss, drawn and is_for_good(rig, sliders, orbit, orbit.state, later, cycle)


def passed_in(sliders: Sliders) -> list[float]:
    """Return how often each slider has slipped in the leg just carried, and how often downwards."""
    passed = [0.0] * (2 * len(sliders.force))
    for i in range(len(sliders.force)):
        passed[2 * i], passed[2 * i + 1] = sliders.slips[i], sliders.falls[i]
    return passed


def slips_alike(passed: list[float], orbit: OrbitGuess) -> bool:
    """Tell whether each slider slips as often, to either side, in a leg of a motion as in an orbit."""
    other = 0.0
    for i in range(len(passed)):
        other += abs(passed[i] - orbit.passed[i])
    return other == 0.0


def draws(rig: Rig, sliders: Sliders, orbit: OrbitGuess, now: Buffer, later: Buffer) -> bool:
    """Tell whether an orbit draws a motion near that is `later` a cycle after `now`.

    It does if the map is nearly linear between the two: what it brings the motion nearer by is more than twice what it
    departs from its derivative. The nearer the motion, the less a smooth map does that; where it does, it has a kink.
    """
    size, far, bent, extent = len(orbit.rows), 0.0, 0.0, 0.0
    begun, ended = put_beside(rig, sliders, orbit, now), put_beside(rig, sliders, orbit, later)
    for i in range(len(sliders.force)):
        side = orbit.state[3 + 2 * i]
        if orbit.passed[2 * i] != 0.0 and (now[3 + 2 * i] != side or later[3 + 2 * i] != side):
            return False
    for row in range(size):
        i = orbit.rows[row]
        own = i if i < 2 else 2 * i - 2
        weight = 1.0 if i == 0 else rig.plain.r**2 if i == 1 else 1.0 / max(sliders.stiffness[i - 2], 1e-300)
        off = later[own] - ended[own]
        for column in range(size):
            j = orbit.rows[column]
            other = j if j < 2 else 2 * j - 2
            off -= orbit.jacobian[row * size + column] * (now[other] - begun[other])
        far += weight * (now[own] - begun[own]) ** 2
        bent += weight * off * off
        extent += weight * orbit.state[own] ** 2
    bend = max(STRAIGHTEST, min(CURVED, sqrt(far / max(extent, 1e-300))))
    return sqrt(bent) <= min(STRAIGHT * orbit.contraction, bend) * sqrt(far) + 1e-12 * sqrt(extent)
