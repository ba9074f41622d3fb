"""What is reported of a motion: works, range, stops; one row per steady state, many rows per call."""

from math import cos, hypot, inf, nan, pi, sin

from frictionlab.simulator.kernel.events import again, carry, jerk_bound, safe_step
from frictionlab.simulator.kernel.layout import (
    AMPLITUDE,
    BOTTOM,
    CARRIED,
    CLOSED_FORM,
    CLOSURE,
    COSTLY,
    CROSS,
    ENERGY,
    FIRST,
    HIGH,
    LAST,
    LOADED,
    LOW,
    MISS,
    MULTIPLIER,
    NOT_FOUND,
    OUTCOME,
    OVERFULL,
    PATH,
    PERIOD,
    PERIODIC,
    PHASE,
    PHASES,
    ROW,
    SIGN,
    SPAN,
    START,
    START_V,
    START_Z,
    STOPS,
    STOPS_MADE,
    STUCK,
    STUCK_SHARE,
    STUCK_TIME,
    SYMMETRIC,
    TOP,
    TURN,
    TURNS,
    UNAWAITED,
    UNBOUNDED,
    UPCOMING,
    VISCOUS,
    WORK,
    Buffer,
    Force,
    Leg,
    Oscillator,
    Rig,
    Room,
    State,
)
from frictionlab.simulator.kernel.motion import local_force, push_at, slide_at
from frictionlab.simulator.kernel.orbits import find_orbit, settled, verdict
from frictionlab.simulator.kernel.outlook import even_handed
from frictionlab.simulator.kernel.shooting import spectral_radius, symmetric_force

__all__ = [
    "account",
    "base_speed",
    "begin_search",
    "end_search",
    "evaluate",
    "fill_row",
    "frame_work",
    "mirrored",
    "most_looks",
    "panels_work",
    "set_force",
    "slide_range",
    "slide_work",
    "steady",
    "steady_from",
    "tell",
]

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


def slide_work(rig: Rig, force: Force, start: State, side: float, span: float, tally: Buffer) -> None:
    """Add the work of F and of both dashpots over a slide, by Gauss-Legendre panels short enough to be exact.

    A dashpot stronger than the spring lets the motion's first, fast part die out long before the slide is over.
    """
    slide = rig.rising if side > 0.0 else rig.falling
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
                tally[WORK] += half * WEIGHTS[i] * push * v
                tally[VISCOUS] += half * WEIGHTS[i] * thick * v * v
                if rig.contact.frame != 0.0:
                    tally[CROSS] += half * WEIGHTS[i] * v * base_speed(t, rig, force)


def slide_range(slide: Oscillator, force: Force, room: Room, start: State, side: float, span: float) -> None:
    """Widen the tally's range by the displacement z + f over a phase, with the wall's motion f about its start.

    The velocity v + f' is marched like in `slide_end`; every point visited counts, so its zeros are met to rounding.
    """
    tally, p, q = room.tally, room.wall.p, room.wall.q
    third = 0.0
    for i in range(len(p)):
        third += (i + 1.0) ** 3 * hypot(p[i], q[i])
    reach, t = min(slide.r, 1.0), 0.0
    while True:
        t = min(t, span)
        z, v, a = slide_at(t, slide, force, start) if side != 0.0 else (0.0, 0.0, 0.0)
        jerk = third + (jerk_bound(slide, v, a) if side != 0.0 else 0.0)
        for i in range(len(p)):
            k = i + 1.0
            c, s = cos(k * t), sin(k * t)
            z += p[i] * c + q[i] * s
            v += k * (q[i] * c - p[i] * s)
            a -= k * k * (p[i] * c + q[i] * s)
        tally[TOP] = max(tally[TOP], start.z + z)
        tally[BOTTOM] = min(tally[BOTTOM], start.z + z)
        if t >= span:
            return
        step = safe_step(abs(v), a if v >= 0.0 else -a, jerk) if v != 0.0 else 0.0
        t += max(1e-8 * reach, min(step, reach))


def account(rig: Rig, force: Force, room: Room) -> None:
    """Go through the recorded phases and add up what the event loop does not need: works, and range with the wall."""
    tally, phases = room.tally, room.phases
    moving = len(room.wall.cosine) > 0
    tally[TOP], tally[BOTTOM] = (-inf, inf) if moving else (tally[HIGH], tally[LOW])
    for at in range(0, PHASE * int(tally[PHASES]), PHASE):
        side, tau, span = phases[at], phases[at + 1], phases[at + 2]
        start = State(phases[at + 3], phases[at + 4], phases[at + 5])
        local_force(tau, force)
        if side != 0.0:
            slide_work(rig, force, start, side, span, tally)
        if moving:
            local_force(tau, room.wall)
            slide_range(rig.rising if side > 0.0 else rig.falling, force, room, start, side, span)


def mirrored(rig: Rig, force: Force, z: float, v: float, room: Room) -> float:
    """Tell (1.0 or 0.0) whether an orbit of one cycle is its own mirror image after half a cycle."""
    iz, iv, _ = carry(rig, force, Leg(0.0, pi, 1.0, -1.0), z, v, room)
    size = hypot(z, rig.plain.r * v) + room.tally[PATH]
    return 1.0 if hypot(iz - z, rig.plain.r * (iv - v)) <= 1e-9 * size else 0.0


def fill_row(rig: Rig, force: Force, leg: Leg, room: Room, row: Buffer) -> None:
    """Write the numbers of an orbit from the tally of one leg."""
    tally = room.tally
    cycles = leg.span * leg.turns / TURN
    row[MULTIPLIER] = spectral_radius(room.jacobian) ** (1.0 if leg.sign > 0.0 else 2.0)
    row[ENERGY] = (rig.contact.beta * tally[LOADED] + tally[VISCOUS]) / cycles
    row[CLOSURE] = abs(tally[WORK] / cycles - row[ENERGY])
    if rig.contact.frame != 0.0 and len(room.wall.cosine) == 0:
        row[ENERGY] += frame_work(rig, force, tally[CROSS], cycles)
    high, low = tally[TOP], tally[BOTTOM]
    row[AMPLITUDE] = max(high, -low) if leg.sign < 0.0 else 0.5 * max(0.0, high - low)
    wrapped = 1.0 if tally[FIRST] == 0.0 and tally[LAST] != 0.0 else 0.0
    row[STOPS] = (tally[STOPS_MADE] + wrapped) / cycles
    row[STUCK_SHARE] = tally[STUCK_TIME] / (cycles * TURN)
    row[PERIOD] = leg.turns


def tell(rig: Rig, force: Force, found: tuple[int, Leg, float, float, float, bool], room: Room, row: Buffer) -> None:
    """Fill `row` with what is known of an orbit that was found."""
    outcome, leg, z, v, miss, exact = found
    for i in range(ROW):
        row[i] = nan
    row[UNAWAITED] = 1.0 if outcome == UPCOMING else 0.0
    outcome = PERIODIC if outcome == UPCOMING else outcome
    row[OUTCOME], row[MISS], row[CLOSED_FORM] = outcome, miss, 1.0 if exact else 0.0
    row[START], row[SPAN], row[TURNS], row[SIGN] = leg.tau, leg.span, leg.turns, leg.sign
    row[START_Z], row[START_V] = z, v
    if outcome == UNBOUNDED or outcome >= NOT_FOUND:
        return
    row[SYMMETRIC] = 1.0 if leg.sign < 0.0 or (outcome == STUCK and z == 0.0) else 0.0
    if outcome == PERIODIC and leg.turns == 1.0 and leg.sign == 1.0 and symmetric_force(force) and even_handed(rig):
        row[SYMMETRIC] = mirrored(rig, force, z, v, room)
    again(rig, force, leg, z, v, room)
    if PHASE * int(room.tally[PHASES]) > len(room.phases):
        row[OUTCOME] = OVERFULL
        return
    account(rig, force, room)
    fill_row(rig, force, leg, room, row)
    if row[CLOSURE] > 1e-3 * row[ENERGY] + 1e-10 * rig.plain.rate * row[AMPLITUDE]:  # repeats to rounding, yet no orbit
        row[OUTCOME] = NOT_FOUND
        for i in range(ENERGY, CLOSURE + 1):
            row[i] = nan


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
    room.tally[CARRIED + 1] = 0.0  # what another rig has carried is nothing to this one
    outcome, leg, z, v, miss, exact = find_orbit(rig, force, closed, room)
    costly, left = end_search(most, given, room.meter)
    tell(rig, force, (COSTLY if costly else outcome, leg, z, v, miss, exact), room, row)
    room.meter[0] = left


def steady_from(rig: Rig, force: Force, z: float, v: float, room: Room, row: Buffer) -> None:
    """As `steady`, of the orbit that the motion from z and v at tau = 0 settles on."""
    most = most_looks(rig, force)
    given = begin_search(most, room.meter)
    room.tally[CARRIED + 1] = 0.0
    found, _ = settled(rig, force, z, v, room)
    leg, oz, ov, miss, _ = found
    outcome = verdict(rig, found, room)
    costly, left = end_search(most, given, room.meter)
    tell(rig, force, (COSTLY if costly else outcome, leg, oz, ov, miss, False), room, row)
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
    """Fill `states` with z and v at times `within` the phases given one by one, each by its six numbers."""
    for i in range(len(within)):
        at = PHASE * i
        start = State(phases[at + 3], phases[at + 4], phases[at + 5])
        states[2 * i], states[2 * i + 1] = start.z, 0.0
        if phases[at] != 0.0:
            local_force(phases[at + 1], force)
            slide = rig.rising if phases[at] > 0.0 else rig.falling
            way, states[2 * i + 1], _ = slide_at(within[i], slide, force, start)
            states[2 * i] += way
