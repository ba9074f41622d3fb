"""The steady state of a system as a row of numbers: what needs no search, where searches start, and what is reported.

Den Hartog's continuous motion (2.10-2.14) answers where it is valid: one undamped mass with one rigid contact under a
pure cosine.
"""

from math import atan2, floor, hypot, inf, isnan, nan, pi, sqrt, tan
from typing import Any

import numpy as np

from frictionlab.arrays import ComplexArray, FloatArray
from frictionlab.simulator import row as places
from frictionlab.simulator.compiled import compiled, entry, inner
from frictionlab.simulator.exact.account import account
from frictionlab.simulator.exact.flow import TURN_OF, is_rigid
from frictionlab.simulator.exact.motion import base_at_time, place_of
from frictionlab.simulator.exact.orbit import (
    FEW_STEPS,
    STEPS,
    TURN,
    Carrier,
    carry,
    distance,
    drive_size,
    find,
    multiplier,
    settle_from,
    shoot,
    size_of,
    whole,
)
from frictionlab.simulator.exact.phase import DONE, slot_of
from frictionlab.simulator.row import (
    COSTLY,
    LACKING,
    NOT_FOUND,
    OVERFULL,
    PERIODIC,
    RUNAWAY,
    STUCK,
    UNBOUNDED,
    UPCOMING,
)

LOOKS = 1e7  # evaluations in a search, for each harmonic: some seconds
CYCLES = 150.0  # natural periods that a search may always follow, ten evaluations each
RESTING = 64  # cycles in which a mass that can rest comes to rest, or nearly so
GROWS = 1.8  # while the cycles double: the motion grows without bound
AUTO, CLOSED_ONLY, NEVER_CLOSED = 0, 1, -1


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
    """Tell whether it is one undamped mass with one rigid contact on a wall, the same everywhere: eq. (2.9)."""
    if system.masses != 1 or system.contacts != 1 or not is_rigid(system, 0):
        return False
    return system.damping[0, 0] == 0.0 and system.gradient[0] == 0.0


@inner
def is_undamped_frame(system: Any) -> bool:
    """Tell whether all of the loop of one mass is its contact's: of r^2 times it, on a wall that follows a cosine."""
    if system.masses != 1 or system.contacts != 1 or system.damping[0, 0] != system.dashpot[0]:
        return False
    return system.follow[0] == 0.0 or system.harmonics == 1


@inner
def grows(system: Any) -> bool:
    """Tell whether a harmonic drives the mass exactly at resonance harder than friction can brake it."""
    if system.masses != 1 or system.damping[0, 0] != 0.0:
        return False
    force = 0.0
    for c in range(system.contacts):
        if system.gradient[c] != 0.0:  # the period of a free motion depends on its size
            return False
        force += system.limit[c]
    for m in range(system.harmonics):
        k = m + 1.0
        drive = system.push[0, 0]
        for c in range(system.contacts):  # relative to a wall that moves with the base the force is r^2 k^2
            drive = system.inertia[0, 0] * k * k if system.follow[c] != 0.0 else drive
        if gap(system.r, k) == 0.0 and force < 0.25 * pi * drive * abs(system.lines[m]):
            return True
    return False


@inner
def grows_on(flow: Any, leg: Any, y: FloatArray) -> bool:
    """Tell whether an undamped motion from rest has grown in proportion to the cycles: at resonance of a mode."""
    system, work = flow.systems[0], flow.works[0]
    for a in range(system.masses):
        if system.damping[a, a] != 0.0:
            return False
    image, before = np.empty(len(y)), 0.0
    for doubling in range(8):
        leg.turns = 1 << doubling
        if carry(flow, leg, y, image, False) != DONE:
            return False
        size = size_of(system, work, image)
        if doubling == 7:
            return size > GROWS * before
        before = size
    return False


@inner
def crests(system: Any, work: Any, slot: int) -> tuple[float, float]:
    """Return the largest and the least force that holds one mass at s = 0."""
    by_f = work.phases.held_f
    if system.harmonics == 1:
        size = abs(system.lines[0] * complex(by_f[slot, 0, 0] - by_f[slot, 0, 2], by_f[slot, 0, 1]))
        return size, -size
    high, low, count = -inf, inf, 64 * max(1, system.harmonics)
    for i in range(count):
        begin, end = TURN * i / count, TURN * (i + 1) / count
        for _ in range(54):
            middle = 0.5 * (begin + end)
            work.tau = middle
            base_at_time(system, work)
            value = by_f[slot, 0, 0] * work.f[0] + by_f[slot, 0, 1] * work.f[1] + by_f[slot, 0, 2] * work.f[2]
            slope = by_f[slot, 0, 0] * work.f[1] + by_f[slot, 0, 1] * work.f[2] + by_f[slot, 0, 2] * work.f[3]
            bend = by_f[slot, 0, 0] * work.f[2] + by_f[slot, 0, 1] * work.f[3] + by_f[slot, 0, 2] * work.f[4]
            high, low = max(high, value), min(low, value)
            if abs(slope) > abs(bend) * (end - begin):  # no crest here
                break
            begin, end = (middle, end) if slope * bend < 0.0 else (begin, middle)
    return high, low


@inner
def comes_to_rest(flow: Any, leg: Any, y: FloatArray, alone: bool) -> bool:
    """Tell whether the motion of one mass with a rigid contact ends at rest; its place is written into y.

    Under plain dry friction it does wherever a place holds the mass: the distance to a motion at rest never grows. It
    may need endlessly many ever smaller slides, and ends at the edge of the places then; elsewhere such slides tell.
    """
    system, work = flow.systems[0], flow.works[0]
    if system.masses != 1 or system.contacts != 1 or not is_rigid(system, 0):
        return False
    work.kappa[0] = inf
    slot = slot_of(system, work.phases, work.kappa)
    stiffness = system.stiffness[0, 0]
    up, down = system.up[0] * system.limit[0], system.down[0] * system.limit[0]
    up_share, down_share = stiffness + up * system.gradient[0], stiffness - down * system.gradient[0]
    if min(up_share, down_share) <= 0.0:
        return False
    high, low = crests(system, work, slot)
    least, largest = (high - up) / up_share, (low + down) / down_share
    if least > largest:
        return False
    if system.follow[0] == 0.0 and least <= y[0] <= largest and y[1] == 0.0:
        return True
    image, before, f = np.empty(len(y)), 0.0, 0.0
    leg.tau, leg.span, leg.turns, leg.sign = 0.0, TURN, 1, 1.0
    for cycle in range(RESTING):
        if carry(flow, leg, y, image, False) != DONE:
            return False
        y[0], y[1] = image[0], image[1]
        if work.path == 0.0:
            return True
        before = work.path if cycle == RESTING // 2 else before
    f = work.f[0] * system.follow[0]
    place, inside = y[0] - f, 4e-16 * (drive_size(system) + abs(least) + abs(largest))
    aim = 0.5 * (least + largest)
    if largest - least > 2.0 * inside:
        aim = min(max(place, least + inside), largest - inside)
    rests = alone or (work.path < 0.5 * before and abs(place - aim) < 4.0 * RESTING * work.path)
    if rests:
        y[0], y[1] = aim + f, system.follow[0] * work.f[1]
    return rests


@inner
def start_from(system: Any, work: Any, start: FloatArray, held: bool) -> bool:
    """Write the forced motion at tau = 0 as a start: contacts without friction, or elastic ones held; False: none."""
    n = system.masses
    push, matrix = np.zeros(n, np.complex128), np.empty((n, n), np.complex128)
    for c in range(system.contacts):
        work.kappa[c] = 0.0
        for i in range(system.first[c], system.first[c + 1]):
            work.kappa[c] += system.spring[i] if held else 0.0
    for k in range(len(start)):
        start[k] = 0.0
    for m in range(system.harmonics):
        dynamic_stiffness(system, work, m, matrix, push)
        if not solve_complex(matrix, push):
            return False
        for a in range(n):
            start[a] += push[a].real
            start[n + a] -= (m + 1.0) * push[a].imag
    return True


@inner
def dynamic_stiffness(system: Any, work: Any, m: int, matrix: ComplexArray, push: ComplexArray) -> None:
    """Write the equations of the forced motion under a harmonic, each contact a spring `kappa`."""
    n, k, line = system.masses, m + 1.0, system.lines[m]
    for a in range(n):
        push[a] = complex(system.push[a, 0], k * system.push[a, 1]) * line
        for b in range(n):
            stiff = system.stiffness[a, b] - k * k * system.inertia[a, b]
            for c in range(system.contacts):
                stiff += work.kappa[c] * system.row[c, a] * system.row[c, b]
            matrix[a, b] = complex(stiff, k * system.damping[a, b])
        for c in range(system.contacts):
            push[a] += work.kappa[c] * system.follow[c] * system.row[c, a] * line


@inner
def solve_complex(matrix: ComplexArray, push: ComplexArray) -> bool:
    """Solve linear equations in place by elimination; False where they are next to singular."""
    n = len(push)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if abs(matrix[best, k]) < 1e-13:
            return False
        for j in range(n):
            matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        push[k], push[best] = push[best], push[k]
        for i in range(n):
            share = matrix[i, k] / matrix[k, k]
            if i != k and share != 0.0:
                push[i] -= share * push[k]
                for j in range(k, n):
                    matrix[i, j] -= share * matrix[k, j]
    for k in range(n):
        push[k] /= matrix[k, k]
    return True


@inner
def fill_starts(system: Any, work: Any, starts: FloatArray) -> int:
    """Write where a search may begin: at rest, forced with elastic contacts held, forced without friction."""
    n, count = system.masses, 1
    work.tau = 0.0
    base_at_time(system, work)
    f = work.f[0]
    for k in range(2 * n + system.sliders):
        starts[0, k] = 0.0
    if system.sliders > 0 and start_from(system, work, starts[count], True):
        count += 1
    if start_from(system, work, starts[count], False):
        for c in range(system.contacts):
            for i in range(system.first[c], system.first[c + 1]):
                starts[count, 2 * n + i] = place_of(system, starts[count], c, f)
        count += 1
    for c in range(system.contacts):
        if n == 1:  # at rest on its wall
            starts[0, 0], starts[0, 1] = system.follow[c] * f, system.follow[c] * work.f[1]
        for i in range(system.first[c], system.first[c + 1]):
            starts[0, 2 * n + i] = place_of(system, starts[0], c, f)
    return count


@inner
def closed_form(flow: Any, leg: Any, y: FloatArray) -> bool:
    """Write Den Hartog's motion as an orbit; tell whether it is one: a straight way between two turns, no stop."""
    system, work = flow.systems[0], flow.works[0]
    if not is_plain(system) or system.harmonics != 1 or system.limit[0] == 0.0:
        return False
    drive = abs(system.lines[0]) * (system.inertia[0, 0] if system.follow[0] != 0.0 else 1.0)
    amplitude, phase = den_hartog(system.r, system.limit[0] / drive)
    amplitude *= drive
    if amplitude * system.inertia[0, 0] <= system.limit[0] * (1.0 - 1e-9) or amplitude == 0.0:
        return False
    image = np.empty(2)
    leg.tau, leg.span, leg.turns, leg.sign = (phase - np.angle(system.lines[0])) % TURN, 0.5 * pi, 1, 1.0
    work.tau = leg.tau
    base_at_time(system, work)
    y[0], y[1] = amplitude + system.follow[0] * work.f[0], system.follow[0] * work.f[1]
    if carry(flow, leg, y, image, False) != DONE:
        return False
    y[0], y[1] = image[0], image[1]
    leg.tau, leg.span, leg.sign = (leg.tau + 0.5 * pi) % TURN, pi, -1.0
    code = carry(flow, leg, y, image, False)
    straight = work.signature == 1 + TURN_OF and abs(work.path - 2.0 * amplitude) <= 1e-9 * amplitude
    return code == DONE and straight and distance(system, y, image) <= 1e-9 * amplitude


@inner
def is_mirrored(system: Any) -> bool:
    """Tell whether a system is its own mirror image half a cycle later: no even harmonic, contacts alike both ways."""
    for m in range(1, system.harmonics, 2):
        if system.lines[m] != 0.0:
            return False
    for c in range(system.contacts):
        if system.gradient[c] != 0.0 or system.up[c] != system.down[c]:
            return False
    return True


@inner
def is_alone(system: Any) -> bool:
    """Tell whether motions only draw nearer to each other: friction is neither larger at rest nor anywhere else."""
    for c in range(system.contacts):
        if system.limit[c] != 0.0 and (system.gradient[c] != 0.0 or max(system.up[c], system.down[c]) > 1.0):
            return False
    return True


@inner
def search(flow: Any, leg: Any, y: FloatArray, closed: int, numbers: FloatArray) -> tuple[int, float]:
    """Find the steady state that rest settles on; return an outcome and its miss."""
    system, work = flow.systems[0], flow.works[0]
    size = 2 * system.masses + system.sliders
    alone, mirror = is_alone(system), is_mirrored(system)
    if system.masses == 1:
        work.phases.count, work.phases.next = 0, 0
    leg.tau, leg.span, leg.turns, leg.sign = 0.0, TURN, 1, 1.0
    for c in range(system.contacts):
        if system.masses == 1 and abs(system.limit[c] * system.gradient[c]) >= system.stiffness[0, 0]:
            return RUNAWAY, 0.0
    if grows(system):
        return UNBOUNDED, 0.0
    starts = np.zeros((3, size))
    count = fill_starts(system, work, starts)
    for k in range(size):
        y[k] = starts[0, k]
    if comes_to_rest(flow, leg, y, alone):
        return STUCK, 0.0
    if (alone or closed == CLOSED_ONLY) and closed_form(flow, leg, y):
        numbers[places.SOLVER] = places.EXACT if closed == NEVER_CLOSED else places.CLOSED_FORM
        miss, _ = shoot(flow, leg, y, FEW_STEPS, 0)
        return PERIODIC, miss
    if closed == CLOSED_ONLY:
        return NOT_FOUND, inf
    if system.masses > 1 and grows_on(flow, leg, y):
        return UNBOUNDED, 0.0
    outcome, miss = find(flow, leg, starts[:count], y, mirror, alone)
    if alone or outcome not in (PERIODIC, NOT_FOUND):
        return outcome, miss
    return beside_rest(flow, leg, starts[count - 1], y, outcome, miss, numbers if closed == AUTO else numbers[:0])


@inner
def beside_rest(
    flow: Any, leg: Any, start: FloatArray, y: FloatArray, outcome: int, miss: float, numbers: FloatArray
) -> tuple[int, float]:
    """Look once more where orbits may coexist: whether the orbit is Den Hartog's; where none was, for a stable one.

    `numbers` without entries: the orbit's solver is not to be named.
    """
    system, work = flow.systems[0], flow.works[0]
    if outcome == PERIODIC:
        if is_plain(system) and system.harmonics == 1 and work.signature == 1 + TURN_OF and leg.sign < 0.0:
            numbers[places.SOLVER : places.SOLVER + 1] = places.CLOSED_FORM
        return outcome, miss
    work.left = inf
    if not closed_form(flow, leg, y):
        whole(leg, 1, 1)
        for k in range(len(y)):
            y[k] = start[k]
    miss, code = shoot(flow, leg, y, STEPS, 64)
    stable = code == DONE and miss <= 1e-9 * size_of(system, work, y) and abs(multiplier(system, work)) <= 1.0 + 1e-9
    return (UPCOMING if stable else NOT_FOUND), miss


@inner
def symmetric(flow: Any, leg: Any, y: FloatArray) -> bool:
    """Tell whether an orbit of one cycle is its own mirror image half a cycle later."""
    system, work = flow.systems[0], flow.works[0]
    if leg.sign < 0.0:
        return True
    if leg.turns != 1 or not is_mirrored(system):
        return False
    image = np.empty(len(y))
    extent = size_of(system, work, y)
    leg.span, leg.sign = pi, -1.0
    code = carry(flow, leg, y, image, False)
    leg.span, leg.sign = TURN, 1.0
    n, miss = system.masses, 0.0
    for a in range(n):
        miss = hypot(miss, hypot(y[a] - image[a], system.r * (y[n + a] - image[n + a])))
    return code == DONE and miss <= 1e-9 * extent


@inner
def report(flow: Any, leg: Any, y: FloatArray, outcome: int, numbers: Any, row: FloatArray) -> None:
    """Fill the row of an orbit that was found, and the numbers of its contacts and masses."""
    system, work, pieces = flow.systems[0], flow.works[0], flow.pieces
    left, work.left = work.left, inf
    whole_cycle = symmetric(flow, leg, y)
    image = np.empty(len(y))
    carry(flow, leg, y, image, True)
    cycles = leg.span * leg.turns / TURN
    row[places.SYMMETRIC] = 1.0 if whole_cycle else 0.0
    row[places.MISS] = distance(system, y, image) if outcome != STUCK else 0.0
    row[places.MULTIPLIER] = multiplier(system, work) ** (2.0 if leg.sign < 0.0 else 1.0)
    row[places.PERIOD], row[places.UNAWAITED] = float(leg.turns), 1.0 if outcome == UPCOMING else 0.0
    if work.count > len(pieces):
        row[places.OUTCOME] = OVERFULL
        work.left = left
        return
    slips = work.path > 0.0
    account(system, work, pieces, work.count, numbers)
    taken = 0.0
    for c in range(system.contacts):
        taken += numbers.contact[c]
    row[places.ENERGY] = numbers.loop / cycles
    row[places.CONTACT_ENERGY], row[places.FRAME_ENERGY] = taken / cycles, numbers.frame / cycles
    row[places.CLOSURE] = abs(numbers.gap) / cycles
    if is_undamped_frame(system):  # then the loop is what the contact takes, to the last digit
        row[places.ENERGY] = taken / cycles / (system.inertia[0, 0] if system.follow[0] != 0.0 else 1.0)
        row[places.FRAME_ENERGY] = 0.0
    high, low = numbers.high[0], numbers.low[0]
    row[places.AMPLITUDE] = max(high, -low) if leg.sign < 0.0 else 0.5 * (high - low)
    held = (not slips or outcome == STUCK) and system.contacts > 0
    if held and system.sliders == 0 and system.masses == 1:  # it stands, or moves with the base: to the letter
        row[places.ENERGY] = row[places.CONTACT_ENERGY] = row[places.CLOSURE] = 0.0
        row[places.AMPLITUDE] = row[places.AMPLITUDE] if system.follow[0] != 0.0 else 0.0
    row[places.STOPS] = 0.0 if held or system.contacts == 0 else numbers.stops[0] / cycles
    row[places.STUCK_SHARE] = 1.0 if held else numbers.stuck[0] / (cycles * TURN)
    row[places.OUTCOME] = STUCK if held else PERIODIC
    if (
        not held
        and row[places.CLOSURE]
        > 1e-3 * (taken + numbers.frame) / cycles + 1e-10 * drive_size(system) * (row[places.AMPLITUDE])
    ):
        for k in range(places.ENERGY, places.MISS):
            row[k] = nan
        row[places.OUTCOME] = NOT_FOUND
    work.left = left


@inner
def solve(flow: Any, leg: Any, y: FloatArray, closed: int, numbers: Any, row: FloatArray) -> None:
    """Fill the row of the steady state that the motion from rest settles on, or from `y` where that is given.

    `y[0]` not a number: from rest. The row's outcome says what was found.
    """
    system, work = flow.systems[0], flow.works[0]
    most = work.left
    own = system.harmonics * (LOOKS + CYCLES * 10.0 / system.r)
    work.left = min(most, own)
    given = work.left
    for k in range(len(row)):
        row[k] = nan
    row[places.SOLVER] = places.EXACT
    if isnan(y[0]):
        outcome, miss = search(flow, leg, y, closed, row)
    else:
        if system.masses == 1:
            work.phases.count, work.phases.next = 0, 0
        miss, outcome = settle_from(flow, leg, y, 2 if is_mirrored(system) else 1)
    if work.left < 0.0:
        outcome = COSTLY
    if work.phases.missing:
        outcome = LACKING
    work.spent = given - work.left
    work.left = most - work.spent
    row[places.OUTCOME], row[places.MISS] = float(outcome), miss
    if outcome in (PERIODIC, STUCK, UPCOMING):
        report(flow, leg, y, outcome, numbers, row)
        if work.phases.missing:
            row[places.OUTCOME] = LACKING


@entry
def solve_one(flow: Carrier, legs: Any, y: FloatArray, closed: int, numbers: Any, row: FloatArray) -> None:
    """`solve`, of records that stand in arrays of length 1."""
    solve(flow, legs[0], y, closed, numbers[0], row)


@entry
def solve_many(systems: Any, flow: Carrier, legs: Any, closed: int, numbers: Any, rows: FloatArray) -> None:
    """Fill the rows (k, ROW) of many systems of one mass, one after the other, each by itself."""
    for k in range(len(systems)):
        flow.systems[0] = systems[k]
        y = np.full(2 * systems[k].masses + systems[k].sliders, nan)
        flow.works[0].left = inf
        solve(flow, legs[0], y, closed, numbers[0], rows[k])


@entry
def carry_on(flow: Carrier, legs: Any, y: FloatArray, image: FloatArray, derived: bool) -> int:
    """Carry a state over a leg; return how that ended. Its pieces are recorded."""
    return carry(flow, legs[0], y, image, derived)
