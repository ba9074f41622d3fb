"""What is reported of a motion: works, range, stops; one row per steady state, many rows per call."""

from math import cos, hypot, inf, nan, pi, sin

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.events import again, jerk_bound, least_step
from frictionlab.simulator.kernel.layout import TURN, Buffer, Force, Leg, Oscillator, Rig, Room, State
from frictionlab.simulator.kernel.motion import local_force, motion_at, push_at, stiffened
from frictionlab.simulator.kernel.orbits import find_orbit, settled, verdict
from frictionlab.simulator.kernel.outlook import is_symmetric
from frictionlab.simulator.kernel.shooting import spectral_radius

LOOKS = 1e7  # at a slide, in a search: about a second
FORGOTTEN = 40.0  # time constants after which nothing is left of a decaying motion
CYCLES = 12  # of the drive that a search may always carry

# Gauss-Legendre rules of 6, 10 and 16 nodes on [-1, 1], one after the other: nodes on one side of the middle, and their
# weights, from mpmath at 50 digits.
NODES = (
    *(0.2386191860831969, 0.6612093864662645, 0.9324695142031521),
    *(0.14887433898163122, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845, 0.9739065285171717),
    *(0.09501250983763744, 0.2816035507792589, 0.45801677765722737, 0.6178762444026438),
    *(0.755404408355003, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499),
)
WEIGHTS = (
    *(0.467913934572691, 0.3607615730481386, 0.17132449237917036),
    *(0.29552422471475287, 0.26926671930999635, 0.21908636251598204, 0.1494513491505806, 0.06667134430868814),
    *(0.1894506104550685, 0.1826034150449236, 0.16915651939500254, 0.14959598881657674),
    *(0.12462897125553388, 0.09515851168249279, 0.062253523938647894, 0.027152459411754096),
)
RULES = (0, 3, 8, 16)  # where each begins
SHORT, MIDDLING = 0.05, 0.3  # of a panel's largest size: up to there 6 and 10 nodes err by 2e-17 of v^2 at most


def base_speed(t: float, rig: Rig, force: Force) -> float:
    """Return f' at t, where F = f + 2 zeta_f r f' (a wall that stands): each harmonic led by the frame's dashpot."""
    speed = 0.0
    for m in range(len(force.p)):
        k = m + 1.0
        lead = 2.0 * rig.contact.frame * rig.plain.r * k
        p, q = force.p[m] - lead * force.q[m], force.q[m] + lead * force.p[m]
        speed += k * (q * cos(k * t) - p * sin(k * t)) / (1.0 + lead * lead)
    return speed


def frame_work(rig: Rig, force: Force, cross: float, cycles: float) -> float:
    """Return what the frame's dashpot takes beyond 2 zeta_f r integral z'^2, per cycle, where the wall stands.

    It sees the base move: ``(x' - f')^2`` instead of ``x'^2``; `cross` is the integral of x' f' over the cycles.
    """
    thick, base = 2.0 * rig.contact.frame * rig.plain.r, 0.0
    for m in range(len(force.cosine)):
        k = m + 1.0
        size2 = force.cosine[m] * force.cosine[m] + force.sine[m] * force.sine[m]
        base += 0.5 * TURN * k * k * size2 / (1.0 + (thick * k) * (thick * k))
    return thick * (base - 2.0 * cross / cycles)


def slide_work(rig: Rig, slide: Oscillator, force: Force, start: State, span: float, tally: Buffer) -> None:
    """Add the work of F and of both dashpots over a slide, by Gauss-Legendre panels short enough to be exact.

    A dashpot stronger than the spring lets the motion's first, fast part die out long before the slide is over.
    """
    size = 7.0 * min(slide.r / max(1.0, 2.0 * slide.zeta), 1.0 / len(force.p))
    fast = FORGOTTEN / (slide.zeta / slide.r + slide.omega) if slide.zeta > 1.0 else span
    if span < 2.0 * fast:
        panels_work(rig, slide, force, start, (0.0, span, size), tally)
    else:
        slow = 3.5 * min(slide.r * (slide.zeta + slide.r * slide.omega), 2.0 / len(force.p))
        panels_work(rig, slide, force, start, (0.0, fast, size), tally)
        panels_work(rig, slide, force, start, (fast, span, slow), tally)


def panels_work(
    rig: Rig, slide: Oscillator, force: Force, start: State, task: tuple[float, float, float], tally: Buffer
) -> None:
    """Add the works between two times of a slide, by panels of a size at most."""
    begin, end, size = task
    thick = 2.0 * rig.plain.zeta * rig.plain.r
    panels = int((end - begin) / size) + 1
    half = 0.5 * (end - begin) / panels
    rule = 0 if 2.0 * half <= SHORT * size else 1 if 2.0 * half <= MIDDLING * size else 2
    for panel in range(panels):
        middle = begin + (2 * panel + 1) * half
        for i in range(RULES[rule], RULES[rule + 1]):
            for way in (-1.0, 1.0):
                t = middle + way * half * NODES[i]
                v, push = push_at(t, slide, force, start)
                tally[layout.WORK] += half * WEIGHTS[i] * push * v
                tally[layout.VISCOUS] += half * WEIGHTS[i] * thick * v * v
                if rig.contact.frame != 0.0:
                    tally[layout.CROSS] += half * WEIGHTS[i] * v * base_speed(t, rig, force)


def slide_range(slide: Oscillator, force: Force, room: Room, start: State, span: float) -> None:
    """Widen the tally's range by the displacement z + f over a phase, with the wall's motion f about its start.

    The velocity v + f' is marched like in `slide_end`; every point visited counts, so its zeros are met to rounding. A
    mass that stands is one whose `slide` has the share 0.
    """
    tally, p, q = room.tally, room.wall.p, room.wall.q
    third = 0.0
    for i in range(len(p)):
        third += (i + 1.0) ** 3 * hypot(p[i], q[i])
    reach, t = min(slide.r, 1.0), 0.0
    while True:
        t = min(t, span)
        z, v, a, jerk = 0.0, 0.0, 0.0, third
        if slide.share != 0.0:
            z, v, a, _ = motion_at(t, slide, force, start)
            jerk += jerk_bound(slide, v, a)
        for i in range(len(p)):
            k = i + 1.0
            c, s = cos(k * t), sin(k * t)
            z += p[i] * c + q[i] * s
            v += k * (q[i] * c - p[i] * s)
            a -= k * k * (p[i] * c + q[i] * s)
        tally[layout.TOP] = max(tally[layout.TOP], start.z + z)
        tally[layout.BOTTOM] = min(tally[layout.BOTTOM], start.z + z)
        if t >= span:
            return
        step = least_step(abs(v), a if v >= 0.0 else -a, jerk, reach) if v != 0.0 else 0.0
        t += max(1e-8 * reach, step)


def account(rig: Rig, force: Force, room: Room) -> None:
    """Go through the recorded phases and add up what the event loop does not need: works, and range with the wall."""
    tally, phases = room.tally, room.phases
    moving = len(room.wall.cosine) > 0
    tally[layout.TOP], tally[layout.BOTTOM] = (-inf, inf) if moving else (tally[layout.HIGH], tally[layout.LOW])
    for at in range(0, layout.PHASE * int(tally[layout.PHASES]), layout.PHASE):
        start = State(phases[at + 3], phases[at + 4], phases[at + 5])
        slide = slide_of(rig, phases[at + 6])
        local_force(phases[at + 1], force)
        if slide.share != 0.0:
            slide_work(rig, slide, force, start, phases[at + 2], tally)
        if moving:
            local_force(phases[at + 1], room.wall)
            slide_range(slide, force, room, start, phases[at + 2])


def slide_of(rig: Rig, stiffness: float) -> Oscillator:
    """Return the oscillator of a recorded phase; of one in which the mass stands one of share 0."""
    plain = rig.plain
    if stiffness == inf:
        return Oscillator(plain.r, plain.zeta, plain.omega, plain.rate, plain.rate2, 0.0)
    return stiffened(plain, stiffness)


def state_at(rig: Rig, force: Force, phases: Buffer, at: int, within: float) -> tuple[float, float, float]:
    """Return z, v and the contact's force but for its dashpot, at a time within the phase recorded at `at`."""
    start, stiffness = State(phases[at + 3], phases[at + 4], phases[at + 5]), phases[at + 6]
    if stiffness == inf:
        push, _ = local_force(phases[at + 1] + within, force)
        return start.z, 0.0, push - start.z
    local_force(phases[at + 1], force)
    way, v, _, _ = motion_at(within, stiffened(rig.plain, stiffness), force, start)
    return start.z + way, v, phases[at + 7] + (stiffness - 1.0) * way


def mirrored(rig: Rig, force: Force, room: Room) -> float:
    """Tell (1.0 or 0.0) whether a cycle just recorded is its own mirror image after half of it."""
    tally, phases = room.tally, room.phases
    half, here = phases[1] + pi, 0
    for at in range(0, layout.PHASE * int(tally[layout.PHASES]), layout.PHASE):
        here = at if phases[at + 1] <= half else here
    z, v, _ = state_at(rig, force, phases, here, half - phases[here + 1])
    size = hypot(phases[3], rig.plain.r * phases[4]) + max(0.0, tally[layout.HIGH] - tally[layout.LOW])
    return 1.0 if hypot(z + phases[3], rig.plain.r * (v + phases[4])) <= 1e-9 * size else 0.0


def fill_row(rig: Rig, force: Force, leg: Leg, room: Room, multiplier: float, row: Buffer) -> None:
    """Write the numbers of an orbit from the tally of one leg, and its multiplier over that."""
    tally = room.tally
    cycles = leg.span * leg.turns / TURN
    row[layout.MULTIPLIER] = multiplier ** (1.0 if leg.sign > 0.0 else 2.0)
    row[layout.ENERGY] = (tally[layout.CONTACT] + tally[layout.VISCOUS]) / cycles
    row[layout.CLOSURE] = abs(tally[layout.WORK] / cycles - row[layout.ENERGY])
    if rig.contact.frame != 0.0 and len(room.wall.cosine) == 0:
        row[layout.ENERGY] += frame_work(rig, force, tally[layout.CROSS], cycles)
    high, low = tally[layout.TOP], tally[layout.BOTTOM]
    row[layout.AMPLITUDE] = max(high, -low) if leg.sign < 0.0 else 0.5 * max(0.0, high - low)
    wrapped = 1.0 if tally[layout.FIRST] == 0.0 and tally[layout.LAST] != 0.0 else 0.0
    row[layout.STOPS] = (tally[layout.STOPS_MADE] + wrapped) / cycles
    row[layout.STUCK_SHARE] = tally[layout.STUCK_TIME] / (cycles * TURN)
    row[layout.PERIOD] = leg.turns


def begin_row(outcome: int, leg: Leg, z: float, v: float, miss: float, row: Buffer) -> bool:
    """Begin `row` with where an orbit was found; tell whether there is more to say of it."""
    for i in range(layout.ROW):
        row[i] = nan
    row[layout.OUTCOME], row[layout.MISS], row[layout.CLOSED_FORM] = outcome, miss, 0.0
    row[layout.START], row[layout.SPAN], row[layout.TURNS], row[layout.SIGN] = leg.tau, leg.span, leg.turns, leg.sign
    row[layout.START_Z], row[layout.START_V] = z, v
    return outcome != layout.UNBOUNDED and outcome < layout.NOT_FOUND


def fits(room: Room, row: Buffer) -> bool:
    """Tell whether the record holds all phases; else the outcome is OVERFULL."""
    full = layout.PHASE * int(room.tally[layout.PHASES]) > len(room.phases)
    row[layout.OUTCOME] = layout.OVERFULL if full else row[layout.OUTCOME]
    return not full


def strike_if_open(rig: Rig, row: Buffer) -> None:
    """Take back an orbit that repeats to rounding, yet is none: its energies do not balance."""
    if row[layout.CLOSURE] > 1e-3 * row[layout.ENERGY] + 1e-10 * rig.plain.rate * row[layout.AMPLITUDE]:
        row[layout.OUTCOME] = layout.NOT_FOUND
        for i in range(layout.ENERGY, layout.CLOSURE + 1):
            row[i] = nan


def tell(rig: Rig, force: Force, found: tuple[int, Leg, float, float, float, bool], room: Room, row: Buffer) -> None:
    """Fill `row` with what is known of an orbit that was found."""
    outcome, leg, z, v, miss, exact = found
    upcoming = outcome == layout.UPCOMING
    outcome = layout.PERIODIC if upcoming else outcome
    more = begin_row(outcome, leg, z, v, miss, row)
    row[layout.UNAWAITED], row[layout.CLOSED_FORM] = 1.0 if upcoming else 0.0, 1.0 if exact else 0.0
    if not more:
        return
    again(rig, force, leg, z, v, room)
    if not fits(room, row):
        return
    account(rig, force, room)
    fill_row(rig, force, leg, room, spectral_radius(room.jacobian), row)
    row[layout.SYMMETRIC] = 1.0 if leg.sign < 0.0 or (outcome == layout.STUCK and z == 0.0) else 0.0
    if outcome == layout.PERIODIC and leg.turns == 1.0 and leg.sign == 1.0 and is_symmetric(rig, force):
        row[layout.SYMMETRIC] = mirrored(rig, force, room)
    strike_if_open(rig, row)


def most_looks(rig: Rig, force: Force) -> float:
    """Return how many looks at a slide a search may take, each counted as often as the force has harmonics.

    About a second. A mass driven much more slowly than it vibrates needs some dozen in each natural period: so many
    cycles are allowed always.
    """
    return len(force.p) * (LOOKS + CYCLES * 12.0 / rig.plain.r)


def begin_search(most: float, meter: Buffer) -> float:
    """Set a meter to what a search may cost, if that is less than it shows; return what it showed."""
    given = meter[0]
    meter[0] = min(given, most)
    return given


def end_search(most: float, given: float, meter: Buffer) -> tuple[bool, float]:
    """Tell whether the meter ran out, and what it is to show when all is told; what follows is not metered."""
    left = meter[0]
    meter[0] = inf
    return left < 0.0, given - (min(given, most) - left)


def steady(rig: Rig, force: Force, closed: int, room: Room, row: Buffer) -> None:
    """Fill `row` with the steady state's numbers; its phases are left in the record, from a leg's start to its end.

    The search may take `most_looks`, or what the room's meter has left if that is less: else it is COSTLY.
    """
    most = most_looks(rig, force)
    given = begin_search(most, room.meter)
    room.tally[layout.CARRIED + 1] = 0.0  # what another rig has carried is nothing to this one
    outcome, leg, z, v, miss, exact = find_orbit(rig, force, closed, room)
    costly, left = end_search(most, given, room.meter)
    tell(rig, force, (layout.COSTLY if costly else outcome, leg, z, v, miss, exact), room, row)
    room.meter[0] = left


def steady_from(rig: Rig, force: Force, z: float, v: float, room: Room, row: Buffer) -> None:
    """As `steady`, of the orbit that the motion from z and v at tau = 0 settles on."""
    most = most_looks(rig, force)
    given = begin_search(most, room.meter)
    room.tally[layout.CARRIED + 1] = 0.0
    found, _ = settled(rig, force, z, v, room)
    leg, oz, ov, miss, _ = found
    outcome = verdict(rig, found, room)
    costly, left = end_search(most, given, room.meter)
    tell(rig, force, (layout.COSTLY if costly else outcome, leg, oz, ov, miss, False), room, row)
    room.meter[0] = left


def set_force(r: float, frame: float, cosine: Buffer, sine: Buffer, force: Force, wall: Force) -> None:
    """Write the force's coefficients: f + 2 zeta_f r f' of the base's motion f, or -r^2 f'' if the wall moves too."""
    for i in range(len(cosine)):
        k = i + 1.0
        if len(wall.cosine) > 0:
            scale = (r * k) ** 2
            force.cosine[i], force.sine[i] = scale * cosine[i], scale * sine[i]
        else:
            lead = 2.0 * frame * r * k
            force.cosine[i], force.sine[i] = cosine[i] + lead * sine[i], sine[i] - lead * cosine[i]


def evaluate(rig: Rig, force: Force, phases: Buffer, within: Buffer, states: Buffer) -> None:
    """Fill `states` with z, v and the contact's force at times `within` the phases given one by one."""
    for i in range(len(within)):
        states[3 * i], states[3 * i + 1], states[3 * i + 2] = state_at(rig, force, phases, layout.PHASE * i, within[i])
