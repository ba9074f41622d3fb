"""The steady state of a system as a row of numbers: what needs no search, where searches start, and what is reported.

Den Hartog's continuous motion (2.10-2.14) answers where it is valid: one undamped mass with one rigid contact under a
pure cosine.
"""

from math import atan2, floor, hypot, inf, nan, pi, sqrt, tan
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.simulator import row as places
from frictionlab.simulator.compiled import compiled, entry, inlined, inner
from frictionlab.simulator.exact import orbit
from frictionlab.simulator.exact.account import call_account
from frictionlab.simulator.exact.flow import TURN_OF, Carrier, call_run, freeze, is_integrated, is_rigid, set_contact
from frictionlab.simulator.exact.motion import base_at_time, contact_force
from frictionlab.simulator.exact.orbit import TURN
from frictionlab.simulator.exact.phase import DONE, TIRED, drive_size, slot_of

LOOKS = 1e7  # evaluations in a search, for each harmonic: some seconds
CYCLES = 150.0  # natural periods that a search may always follow, ten evaluations each


@compiled
def gap(r: float, k: float) -> float:
    """Return ``1 - k r`` without rounding in the product (Dekker), so that neighbours of r = 1/k stay apart."""
    big = 134217729.0 * r
    high = big - (big - r)
    product = k * r
    return (1.0 - product) - ((k * high - product) + k * (r - high))


@compiled
def den_hartog(r: float, beta: float) -> tuple[float, float]:
    """Return the amplitude X and the phase phi of eqs (2.11)-(2.14); X is 0 where no continuous motion exists.

    tan(pi / 2r) is taken from the distance of 1/r to the nearest odd integer, so that r = 1 +- 1e-15 is no harder.
    """
    odd = 2.0 * floor(0.5 / r) + 1.0
    away = gap(r, odd) / r  # 1/r - odd, in [-1, 1)
    detuning = gap(r, 1.0) * (1.0 + r)  # 1 / V
    if away == 0.0 or detuning == 0.0:
        return 0.0, 0.0
    ratio = -beta / (tan(0.5 * pi * away) * r) * detuning  # beta U / V
    if abs(ratio) >= 1.0:
        return 0.0, 0.0
    share = sqrt((1.0 - ratio) * (1.0 + ratio))
    return share / abs(detuning), atan2(-ratio, share if detuning > 0.0 else -share)


@inner
def is_plain(system: Any) -> bool:
    """Return whether it is one undamped mass with one rigid contact on a wall, the same everywhere: eq. (2.9)."""
    if system.masses != 1 or system.contacts != 1 or not is_rigid(system, 0):
        return False
    return system.damping[0, 0] == 0.0 and system.gradient[0] == 0.0


@inner
def grows(system: Any) -> bool:
    """Return whether a harmonic drives the mass exactly at resonance harder than friction can brake it."""
    if system.masses != 1 or system.damping[0, 0] != 0.0:
        return False
    force = 0.0
    for c in range(system.contacts):
        if system.gradient[c] != 0.0:  # the period of a free motion depends on its size
            return False
        force += system.brake[c]
    for m in range(system.harmonics):
        k = m + 1.0
        if gap(system.r, k) == 0.0 and force < 0.25 * pi * abs(system.push[0, 0] * system.lines[m]):
            return True
    return False


@inlined
def closed_form(flow: Any, leg: Any, y: FloatArray) -> bool:
    """Write Den Hartog's motion as an orbit; return whether it is one: a straight way between two turns, no stop."""
    system, work = flow.system, flow.work
    if not is_plain(system) or system.harmonics != 1 or system.limit[0] == 0.0:
        return False
    drive = system.push[0, 0] * system.lines[0]
    amplitude, phase = den_hartog(system.r, system.limit[0] / abs(drive))
    amplitude *= abs(drive)
    if amplitude * system.inertia[0, 0] <= system.limit[0] * (1.0 - 1e-9) or amplitude == 0.0:
        return False
    begun, image = np.array((amplitude, 0.0)), np.empty(2)
    leg.tau, leg.span, leg.turns, leg.sign = (phase - np.angle(drive)) % TURN, 0.5 * pi, 1, 1.0
    if orbit.carry(flow, leg, begun, image, False) != DONE:
        return False
    orbit.copy(image, begun)
    leg.tau, leg.span, leg.sign, leg.stalls = (leg.tau + 0.5 * pi) % TURN, pi, -1.0, orbit.FULL
    code = orbit.carry(flow, leg, begun, image, True)
    straight = work.signature == 1 + TURN_OF and abs(work.path - 2.0 * amplitude) <= 1e-9 * amplitude
    miss = orbit.distance(system, begun, image)
    if code == DONE and straight and 1e-14 * amplitude < miss <= 1e-9 * amplitude:
        miss, code = orbit.shoot(flow, leg, begun)
    if code != DONE or not straight or miss > 1e-9 * amplitude:
        return False
    orbit.copy(begun, y)
    return True


@inner
def may_rest(system: Any) -> bool:
    """Return whether friction may hold one mass for ever; False is certain, where to is for Python to say.

    The force that holds it swings by its amplitude, or by twice its root mean square at least.
    """
    if system.masses != 1 or system.contacts != 1 or not is_rigid(system, 0):
        return False
    square, up, down = 0.0, system.up[0] * system.limit[0], system.down[0] * system.limit[0]
    for m in range(system.harmonics):
        square += abs(system.lines[m] * complex(system.push[0, 0], (m + 1.0) * system.push[0, 1])) ** 2
    swing = sqrt((4.0 if system.harmonics == 1 else 2.0) * square)
    more, less = system.stiffness[0, 0] + up * system.gradient[0], system.stiffness[0, 0] - down * system.gradient[0]
    return min(more, less) > 0.0 and swing * min(more, less) <= up * less + down * more


@inlined
def find(flow: Any, leg: Any, y: FloatArray, row: FloatArray, rests: bool) -> int:
    """Find the orbit that Newton's method comes to from a start, and write its own; return an outcome.

    RESTING: friction may hold the mass (asked if it `rests`); UNREACHED: other starts are to be tried; AWAITED: orbits
    may coexist, and the motion is to be followed.
    """
    system, work, image, alone = flow.system, flow.work, np.empty(len(y)), bool(flow.system.alone)
    if grows(system):
        return places.UNBOUNDED
    if not is_integrated(system):
        if system.masses == 1 and abs(system.limit[0] * system.gradient[0]) >= system.stiffness[0, 0]:
            return places.RUNAWAY
        if rests and may_rest(system):
            return places.RESTING
        if alone and closed_form(flow, leg, y):
            return places.PERIODIC
        rubs, breaks = False, False
        for c in range(system.contacts):
            rubs = rubs or system.limit[c] > 0.0
            breaks = breaks or system.up[c] != 1.0 or system.down[c] != 1.0
        if breaks or not rubs:
            return places.AWAITED if rubs else places.UNREACHED
    orbit.whole(leg, 1, 2 if system.mirrored else 1)
    leg.stalls = orbit.SOME
    for _ in range(2):
        orbit.carry(flow, leg, y, image, False)
        orbit.copy(image, y)
    miss, code = orbit.shoot(flow, leg, y)
    row[places.MISS] = miss
    if code != DONE:
        return orbit.VERDICT[code] if alone or code == TIRED else places.AWAITED
    if miss > orbit.floor_of(system, orbit.size_of(system, work, y)):
        return places.UNREACHED
    return places.PERIODIC if alone or orbit.is_stable(system, work) else places.AWAITED


@inlined
def is_symmetric(flow: Any, leg: Any, y: FloatArray, image: FloatArray) -> bool:
    """Return whether an orbit is its own mirror image half a cycle later; the run last carried is that of the orbit."""
    system, work = flow.system, flow.work
    if leg.sign < 0.0 or leg.turns != 1 or not system.mirrored:
        return leg.sign < 0.0
    n, extent, miss = system.masses, orbit.size_of(system, work, y), 0.0
    leg.span, leg.sign = pi, -1.0
    code = orbit.carry(flow, leg, y, image, False)
    for a in range(n):
        miss = hypot(miss, hypot(y[a] - image[a], system.r * (y[n + a] - image[n + a])))
    leg.span, leg.sign = TURN, 1.0
    orbit.carry(flow, leg, y, image, True)
    return code == DONE and miss <= (1e2 * orbit.ALMOST if is_integrated(system) else 1e-9) * extent


@inner
def fill_energies(system: Any, leg: Any, held: bool, size: float, numbers: Any, row: FloatArray) -> None:
    """Fill what an account says of an orbit of a size into a row; one whose energies do not close is none."""
    cycles, taken = leg.span * leg.turns / TURN, 0.0
    for c in range(system.contacts):
        taken += numbers.contact[c]
    row[places.ENERGY] = numbers.loop / cycles
    row[places.CONTACT_ENERGY], row[places.FRAME_ENERGY] = taken / cycles, numbers.frame / cycles
    row[places.CLOSURE] = abs(numbers.gap) / cycles
    alone = system.masses == system.contacts == 1 and system.damping[0, 0] == system.dashpot[0]
    if alone and (system.moves or system.harmonics == 1):  # then the loop is what the contact takes
        row[places.ENERGY] = taken / cycles / (1.0 if system.moves else system.inertia[0, 0])
        row[places.FRAME_ENERGY] = 0.0
    high, low = numbers.high[0], numbers.low[0]
    row[places.AMPLITUDE] = max(high, -low) if leg.sign < 0.0 else 0.5 * (high - low)
    if held and system.sliders == 0 and system.masses == 1:  # it stands, or moves with the base: to the letter
        row[places.ENERGY] = row[places.CONTACT_ENERGY] = row[places.CLOSURE] = 0.0
        row[places.AMPLITUDE] = 0.0 if system.moves else row[places.AMPLITUDE]
    row[places.STOPS] = 0.0 if held or system.contacts == 0 else numbers.stops[0] / cycles
    row[places.STUCK_SHARE] = 1.0 if held else numbers.stuck[0] / (cycles * TURN)
    row[places.OUTCOME] = places.STUCK if held else places.PERIODIC
    force = abs(system.push[0, 0]) * drive_size(system)
    least = 1e-3 * (taken + numbers.frame) / cycles + 1e-10 * force * size
    if not held and row[places.CLOSURE] > least:
        for k in range(places.ENERGY, places.MISS + 1):
            row[k] = nan
        row[places.OUTCOME] = places.NOT_FOUND


@inner
def begin_row(flow: Any, row: FloatArray) -> float:
    """Empty a row; return the evaluations that a search may take, which are written as those left."""
    system, work = flow.system, flow.work
    if system.masses == 1:
        work.phases.count, work.phases.next = 0, 0
    work.left = min(work.left, system.harmonics * (LOOKS + CYCLES * 10.0 / system.r))
    for k in range(len(row)):
        row[k] = nan
    row[places.SOLVER], row[places.MISS] = places.EXACT, 0.0
    return work.left


@inner
def end_row(flow: Any, leg: Any, y: FloatArray, found: int, given: float, sums: Any, row: FloatArray) -> None:
    """Fill the row of what was found with so many evaluations given; an orbit is that of the run last carried."""
    system, work, image = flow.system, flow.work, np.empty(len(y))
    outcome = places.COSTLY if work.left < 0.0 and found < places.OVERFULL else found
    work.spent, work.left = given - work.left, inf
    row[places.OUTCOME] = float(outcome)
    if outcome not in (places.PERIODIC, places.STUCK):
        row[places.MISS] = row[places.MISS] if outcome == places.COSTLY and row[places.MISS] < inf else nan
        return
    if outcome == places.STUCK:
        orbit.carry(flow, leg, y, image, True)
    row[places.SYMMETRIC] = 1.0 if is_symmetric(flow, leg, y, image) else 0.0
    orbit.write_image(system, work, leg, image)
    row[places.MISS] = orbit.distance(system, y, image) if outcome != places.STUCK else 0.0
    row[places.MULTIPLIER] = orbit.multiplier(system, work) ** (2.0 if leg.sign < 0.0 else 1.0)
    row[places.PERIOD] = float(leg.turns)
    if is_integrated(system):  # what it does its motion says
        row[places.SOLVER] = places.INTEGRATED
        return
    if work.count > len(flow.pieces):
        row[places.OUTCOME] = places.OVERFULL
        return
    held = (work.path == 0.0 or outcome == places.STUCK) and system.contacts > 0
    call_account(system.account, (system, work, flow.pieces, work.count, sums))
    fill_energies(system, leg, held, orbit.size_of(system, work, y), sums, row)
    straight = leg.sign < 0.0 and work.signature == 1 + TURN_OF and is_plain(system) and system.limit[0] > 0.0
    if straight and system.harmonics == 1 and row[places.OUTCOME] == places.PERIODIC:  # it is Den Hartog's
        row[places.SOLVER] = places.CLOSED_FORM


@entry
def solve(
    systems: Any, works: Any, pieces: FloatArray, legs: Any, ys: FloatArray, sums: Any, rows: FloatArray, left: float
) -> None:
    """Fill the rows (k, ROW) of steady states of systems, each by itself, as far as Newton's method comes at once.

    Starts are read from `ys` (k, size), and starts of the orbits are written there; leg, pieces and sums (NUMBERS) are
    the last one's. What a row says already is taken for it: RESTING, that the mass does not come to rest; PERIODIC or
    STUCK, that the start is of an orbit, that of the leg. `left`: evaluations that each may take, if those are fewer
    than its share.
    """
    for k in range(len(rows)):
        flow, works[0].left, found = Carrier(systems[k], works[0], pieces), left, rows[k, places.OUTCOME]
        given = begin_row(flow, rows[k])
        if found == places.PERIODIC:
            orbit.carry(flow, legs[0], ys[k], np.empty(ys.shape[1]), True)
        else:
            orbit.whole(legs[0], 1, 1)
        if found not in (places.PERIODIC, places.STUCK):
            found = find(flow, legs[0], ys[k], rows[k], found != places.RESTING)
        end_row(flow, legs[0], ys[k], int(found), given, sums[0], rows[k])


@entry
def follow(
    systems: Any, works: Any, pieces: FloatArray, legs: Any, ys: FloatArray, sums: Any, rows: FloatArray, left: float
) -> None:
    """As `solve`, of the orbits that motions from starts settle on."""
    for k in range(len(rows)):
        flow, works[0].left = Carrier(systems[k], works[0], pieces), left
        given = begin_row(flow, rows[k])
        rows[k, places.MISS], found = orbit.settle_from(flow, legs[0], ys[k], 2 if flow.system.mirrored else 1)
        end_row(flow, legs[0], ys[k], found, given, sums[0], rows[k])


@entry
def shoot_on(systems: Any, works: Any, pieces: FloatArray, legs: Any, y: FloatArray) -> tuple[float, float, int, bool]:
    """Move a state to the orbit of a leg nearby; return its miss, that which is none, how it ended, if it is stable."""
    flow = Carrier(systems[0], works[0], pieces)
    miss, code = orbit.shoot(flow, legs[0], y)
    floor = orbit.floor_of(flow.system, orbit.size_of(flow.system, flow.work, y))
    return miss, floor, code, orbit.is_stable(flow.system, flow.work)


@entry
def carry_on(
    systems: Any, works: Any, pieces: FloatArray, legs: Any, y: FloatArray, image: FloatArray, derived: bool
) -> int:
    """Carry a state over a leg; return how that ended. Its pieces are recorded."""
    return orbit.carry(Carrier(systems[0], works[0], pieces), legs[0], y, image, derived)


@entry
def travel(
    systems: Any, works: Any, pieces: FloatArray, time: FloatArray, cubics: FloatArray, found: FloatArray, left: float
) -> tuple[int, int]:
    """Carry the state at hand along sampled times (n,); return the piece that it did not come through, and why.

    `cubics` (n - 1, 4): what drives the masses, in the time from each sample on; `found` (n, 2 n + c): displacements,
    velocities and contacts' forces at the samples; `left`: evaluations, or steps, between samples.
    """
    system, work, n = systems[0], works[0], systems[0].masses
    for i in range(len(time)):
        since = max(i - 1, 0)
        orbit.copy(cubics[since], system.cubic)
        work.tau, work.left = time[since], left
        code = call_run(system.run, (system, work, pieces, time[i] - time[since], False, i == 0))
        if code != DONE:
            return since, code
        base_at_time(system, work)
        freeze(system, work)
        for c in range(system.contacts if is_integrated(system) else 0):
            set_contact(system, work, c)
        for a in range(n):
            found[i, a], found[i, n + a] = work.q[a], work.v[a]
            work.now_q[a], work.now_v[a] = work.q[a], work.v[a]
        slot = slot_of(system, work.phases, work.kappa)
        for c in range(system.contacts):
            found[i, 2 * n + c] = contact_force(system, work, slot, c)
    return len(time) - 1, DONE
