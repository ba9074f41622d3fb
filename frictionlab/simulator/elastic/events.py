"""What ends a phase and what follows: sliders that give way and hold again; and the loop that strings phases."""

from math import inf, sqrt

from frictionlab.simulator.elastic.layout import ElasticRoom, Sliders
from frictionlab.simulator.elastic.phases import phase_end
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.events import write_phase
from frictionlab.simulator.kernel.layout import Force, Leg, Oscillator, Rig, State
from frictionlab.simulator.kernel.motion import free_motion, local_force, stiffened

STILL_HELD = 1e-13  # rad: sliders held for less are no stop
FAR = 1e150  # where no slider is left that could give way


def static_ratio(rig: Rig, side: float) -> float:
    """Return static over kinetic friction force for a slip to a side."""
    return rig.contact.static_up if side > 0.0 else rig.contact.static_down


def contact_force(sliders: Sliders) -> float:
    """Return the force of all sliders."""
    total = 0.0
    for i in range(len(sliders.force)):
        total += sliders.force[i]
    return total


def contact_stiffness(rig: Rig, sliders: Sliders) -> float:
    """Return what the sliders add to the stiffness: the springs of those held, the gradient of those that slip."""
    total = 0.0
    for i in range(len(sliders.force)):
        if sliders.side[i] == 0.0:
            total += sliders.stiffness[i]
        else:
            total += sliders.side[i] * sliders.strength[i] * rig.contact.gradient
    return total


def curvature(force: Force) -> float:
    """Return F'' at the time about which the force's coefficients are written."""
    total = 0.0
    for i in range(len(force.p)):
        total -= (i + 1.0) * (i + 1.0) * force.p[i]
    return total


def onward(v: float, a: float, rate: float, force: Force) -> float:
    """Return the direction in which the mass moves on: the sign of the first of v, a, F', F'' that is not 0."""
    if v != 0.0:
        return 1.0 if v > 0.0 else -1.0
    if a != 0.0:
        return 1.0 if a > 0.0 else -1.0
    if rate != 0.0:
        return 1.0 if rate > 0.0 else -1.0
    return 1.0 if curvature(force) > 0.0 else -1.0


def nearest(rig: Rig, sliders: Sliders, z: float, way: float) -> tuple[float, int, float]:
    """Return how far in the direction `way` the first held slider gives way, which, and along which limit.

    Where friction varies along the path more steeply than a slider is stiff, it gives way along the limit that sinks.
    """
    steep, load = rig.contact.gradient, 1.0 + rig.contact.gradient * z
    ahead = static_ratio(rig, way)
    left, which, side = FAR, -1, way
    for i in range(len(sliders.force)):
        if sliders.side[i] != 0.0:
            continue
        gain = sliders.stiffness[i] - way * ahead * sliders.strength[i] * steep
        if gain > 0.0:
            room = (ahead * sliders.strength[i] * load - way * sliders.force[i]) / gain
            if room < left:
                left, which, side = room, i, way
        loss = -way * static_ratio(rig, -way) * sliders.strength[i] * steep - sliders.stiffness[i]
        if loss > 0.0:
            room = (static_ratio(rig, -way) * sliders.strength[i] * load + way * sliders.force[i]) / loss
            if room < left:
                left, which, side = room, i, -way
    return left, which, side


def give_way(rig: Rig, sliders: Sliders, i: int, side: float, z: float, v: float, room: ElasticRoom) -> None:
    """Let slider i slip along a limit: its force falls from the static to the kinetic one.

    A motion that starts a little differently slips a little earlier or later: the force's fall then jumps in v.
    """
    jacobian, tally, columns = room.jacobian, room.tally, int(room.tally[layout.COLUMNS])
    steep, ratio = rig.contact.gradient, static_ratio(rig, side)
    fall = side * (ratio - 1.0) * sliders.strength[i] * (1.0 + steep * z) / (rig.plain.r * rig.plain.r)
    closing = (side * sliders.stiffness[i] - ratio * sliders.strength[i] * steep) * v
    for c in range(columns):
        own = (2 + i) * columns + c
        if fall != 0.0 and closing != 0.0:
            excess = side * jacobian[own] - ratio * sliders.strength[i] * steep * jacobian[c]
            jacobian[columns + c] += fall * excess / closing
        jacobian[own] = side * sliders.strength[i] * steep * jacobian[c]
    if tally[layout.HELD_FOR] > STILL_HELD:
        tally[layout.STOPS_MADE] += 1.0
    tally[layout.HELD_FOR] = 0.0
    sliders.force[i] = side * sliders.strength[i] * (1.0 + steep * z)
    sliders.side[i] = side
    sliders.slips[i] += 1.0
    sliders.falls[i] += 1.0 if side < 0.0 else 0.0


def hold_all(sliders: Sliders) -> None:
    """Hold every slider where it is: the mass has come to rest."""
    for i in range(len(sliders.side)):
        sliders.side[i] = 0.0


def yield_along(rig: Rig, sliders: Sliders, z: float, way: float) -> None:
    """Move the sliders' forces along a way that ends at z: springs stretch, limits rise or sink."""
    load = 1.0 + rig.contact.gradient * z
    for i in range(len(sliders.force)):
        if sliders.side[i] == 0.0:
            sliders.force[i] += sliders.stiffness[i] * way
        else:
            sliders.force[i] = sliders.side[i] * sliders.strength[i] * load


def propagate_elastic(rig: Rig, sliders: Sliders, slide: Oscillator, span: float, room: ElasticRoom) -> None:
    """Multiply the jacobian from the left by the derivative of a phase's end with respect to its start."""
    jacobian, columns = room.jacobian, int(room.tally[layout.COLUMNS])
    if columns == 0:
        return
    g, h, lost = free_motion(span, slide)
    slower, stiff = g - 2.0 * slide.zeta / slide.r * h, h / (slide.r * slide.r)
    for c in range(columns):
        pull = jacobian[c]
        for i in range(len(sliders.force)):
            pull += jacobian[(2 + i) * columns + c]
        pull *= slide.share
        dv = jacobian[columns + c]
        way = h * dv - lost * pull
        jacobian[c] += way
        jacobian[columns + c] = slower * dv - stiff * pull
        for i in range(len(sliders.force)):
            own = (2 + i) * columns + c
            if sliders.side[i] == 0.0:
                jacobian[own] += sliders.stiffness[i] * way
            else:
                jacobian[own] = sliders.side[i] * sliders.strength[i] * rig.contact.gradient * jacobian[c]


def book(
    sliders: Sliders,
    time: tuple[float, float],
    start: State,
    spring: tuple[float, float],
    room: ElasticRoom,
) -> None:
    """Write one phase into the record, if it has room, and into the tally.

    `time` is when it began and how long it took, `spring` its stiffness and the sliders' force at its start.
    """
    tally = room.tally
    slipping = 0.0
    for i in range(len(sliders.side)):
        slipping += abs(sliders.side[i])
    if slipping == 0.0:
        tally[layout.STUCK_TIME] += time[1]
        tally[layout.HELD_FOR] += time[1]
    write_phase(room.phases, tally, slipping, time, start, spring)


def phases_allowed(rig: Rig, sliders: Sliders, force: Force, span: float) -> float:
    """Return more phases than a motion over a span has: some hundred for each period of the held contact."""
    stiffest = 1.0
    for i in range(len(sliders.force)):
        stiffest += sliders.stiffness[i]
    busy = span * (len(force.p) + sqrt(stiffest) / rig.plain.r)
    return 1000.0 + (200.0 + 20.0 * len(sliders.force)) * busy


def run_on(
    rig: Rig, sliders: Sliders, force: Force, tau: float, end: float, z: float, v: float, room: ElasticRoom
) -> tuple[float, float, int]:
    """Carry the motion from tau to end, phase by phase; return z, v there and how it ended.

    A phase is a time in which the mass moves one way and the same sliders slip. The decision comes before the search:
    where the mass moves on, and whether a slider is at its limit already.
    """
    r, thick, tally = rig.plain.r, 2.0 * rig.plain.zeta * rig.plain.r, room.tally
    budget = phases_allowed(rig, sliders, force, end - tau)
    while tau < end:
        budget -= 1.0
        if budget < 0.0:
            return z, v, layout.CHATTER
        if room.meter[0] < 0.0:
            return z, v, layout.TIRED
        push, rate = local_force(tau, force)
        pull = contact_force(sliders)
        a = (push - z - pull - thick * v) / (r * r)
        if v == 0.0 and abs(a) * r * r <= 2e-16 * (abs(push) + abs(z) + abs(pull)):
            a = 0.0  # but for rounding
        way = onward(v, a, rate, force)
        left, which, side = nearest(rig, sliders, z, way)
        if left <= 0.0:
            give_way(rig, sliders, which, side, z, v, room)
            continue
        added = contact_stiffness(rig, sliders)
        slide, start, rest = stiffened(rig.plain, 1.0 + added), State(z, v, a), end - tau
        looks = tally[layout.EVALUATIONS]
        span, made, v, what = phase_end(slide, force, start, way, rate, left, rest, tally)
        room.meter[0] -= len(force.p) * (tally[layout.EVALUATIONS] - looks + 1.0) + len(sliders.force)
        z += made
        book(sliders, (tau, span), start, (1.0 + added, pull), room)
        tally[layout.CONTACT] += (pull + 0.5 * added * made) * made
        tally[layout.HIGH], tally[layout.LOW] = max(tally[layout.HIGH], start.z, z), min(tally[layout.LOW], start.z, z)
        propagate_elastic(rig, sliders, slide, span, room)
        yield_along(rig, sliders, z, made)
        tau = tau + span if span < rest else end
        if 1.0 + rig.contact.gradient * z < 0.0:
            return z, v, layout.PULLED
        if what == layout.REACHED:
            give_way(rig, sliders, which, side, z, v, room)
        elif what == layout.TURNED:
            hold_all(sliders)
    return z, v, layout.DONE


def begin(rig: Rig, sliders: Sliders, room: ElasticRoom) -> None:
    """Take the state from the room's start; no column of the jacobian is asked for yet."""
    tally, start = room.tally, room.start
    for i in range(layout.TALLY):
        tally[i] = 0.0
    tally[layout.HIGH], tally[layout.LOW] = -inf, inf
    for i in range(len(sliders.force)):
        sliders.force[i], sliders.side[i], sliders.slips[i] = start[2 + 2 * i], start[3 + 2 * i], abs(start[3 + 2 * i])
        sliders.falls[i] = 1.0 if start[3 + 2 * i] < 0.0 else 0.0
        along = start[3 + 2 * i] * sliders.stiffness[i] - sliders.strength[i] * rig.contact.gradient
        if along * start[1] <= 0.0:
            sliders.side[i] = 0.0  # moving away from its limit, as a trial of Newton's may, it holds


def begin_jacobian(rig: Rig, sliders: Sliders, room: ElasticRoom) -> None:
    """Begin the jacobian, whose columns are what is unknown at the section."""
    jacobian, start, kinds = room.jacobian, room.start, room.kinds
    columns = 2
    for i in range(len(sliders.force)):
        columns += 1 if kinds[i] == layout.FREE else 0
    room.tally[layout.COLUMNS] = columns
    for i in range((2 + len(sliders.force)) * columns):
        jacobian[i] = 0.0
    jacobian[0], jacobian[columns + 1] = 1.0, 1.0
    free = 2
    for i in range(len(sliders.force)):
        own = (2 + i) * columns
        if kinds[i] == layout.FREE:
            jacobian[own + free] = 1.0
            free += 1
        elif kinds[i] == layout.OUTER:
            jacobian[own] = sliders.stiffness[i]
        else:
            jacobian[own] = start[3 + 2 * i] * sliders.strength[i] * rig.contact.gradient


def carry_elastic(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom, asked: int) -> int:
    """Carry the room's start over a leg into its image (mirrored if the leg's sign is -1); return how it ended.

    With the map's derivative if DERIVED is asked for; PLAIN: without.
    """
    begin(rig, sliders, room)
    if asked == layout.DERIVED:
        begin_jacobian(rig, sliders, room)
    start, image = room.start, room.image
    z, v, code = start[0], start[1], layout.DONE
    for _ in range(int(leg.turns)):
        z, v, code = run_on(rig, sliders, force, leg.tau, leg.tau + leg.span, z, v, room)
        if code != layout.DONE:
            break
    image[0], image[1] = leg.sign * z, leg.sign * v
    for i in range(len(sliders.force)):
        image[2 + 2 * i], image[3 + 2 * i] = leg.sign * sliders.force[i], leg.sign * sliders.side[i]
    for i in range((2 + len(sliders.force)) * int(room.tally[layout.COLUMNS])):
        room.jacobian[i] *= leg.sign
    return code
