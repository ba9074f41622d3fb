"""One phase of a structure: the linear motion while every contact holds or slips as it does, in modal coordinates.

In a phase the force of contact c on its mass is ``n_c = kappa_c s_c + o_c`` (its dashpot apart), s_c its displacement
``row_c q - follow_c f``; kappa is infinite where a rigid contact holds. Between events

    M q'' + C q' + (K + sum kappa_c row_c row_c^T) q = push (f, f') + sum kappa_c follow_c row_c f - sum row_c o_c

is linear. Held rigid contacts take their directions out of it; what is left is solved in modes, of a complex pair one:
``q = Re sum shape_j w_j``, ``w_j' = rate_j w_j + force``.
"""

from math import inf
from typing import Any

import numpy as np
from numba import from_dtype, types
from numpy.typing import NDArray

from frictionlab.arrays import ComplexArray, FloatArray
from frictionlab.simulator.compiled import address_of, caller, inlined, inner

SLOTS = 97  # phases remembered: odd, so that fields of one do not meet in one line of the processor's cache
DONE, CHATTER, PULLS, TIRED, STEEP = range(5)  # how a run ended
CRITICAL = 2e-10  # over the squared frequency: two rates nearer than this are parted by it (zeta moved by 1e-10)
ROUNDING = 1e-13  # a contact that moves by a smaller share of the masses' motion is held by others
SIDE = (
    6  # column of a recorded piece from which on slip directions stand; before: begin, length, a sampled base's cubic
)
NEAR = 0.02  # a harmonic nearer to a rate than this is taken by its divided difference

MASSES, CONTACTS, SLIDERS, HARMONICS = 6, 6, 200, 64  # what a structure may have
MODES = 2 * MASSES
INNER = 2 * CONTACTS  # states that the contacts' laws may have
_N, _C, _D, _S, _H, _P = MASSES, CONTACTS, MODES, SLIDERS, HARMONICS, SLOTS

LAW = np.dtype(
    [
        ("formula", "i8", (_C,)),  # addresses; 0: friction is the same at all speeds
        ("own", "f8", (_C, 8)),  # parameters of each formula
        ("beta", "f8", (_C,)),
        ("gradient", "f8", (_C,)),
        ("narrow", "f8", (_C,)),  # speed below which friction changes; 0: it does not
        ("states", "i8", (_C,)),  # states of its own; -1: an elastic contact, which has no formula
        ("at", "i8", (_C,)),  # the component at which they stand, after displacements and velocities
        ("scale", "f8", (2 * _N + INNER,)),  # errors are relative to it and to the component's own size
        ("force", "f8"),  # and to this, of what a held contact bears
        ("tolerance", "f8"),  # 0: phases are exact
        ("first", "f8"),  # length of the first step
    ]
)
"""The contacts' laws in numbers, and what counts as small of each component, where they are integrated."""

SYSTEM = np.dtype(
    [
        ("run", "i8"),  # addresses: of `flow.run`,
        ("advance", "i8"),  # of what carries it through a phase, in closed form or by steps,
        ("look", "i8"),  # of what says its motion at a time within a recorded piece,
        ("account", "i8"),  # of `account.account`,
        ("make", "i8"),  # of `make_phase`,
        ("make_modes", "i8"),  # and of `make_modes`
        ("masses", "i8"),
        ("contacts", "i8"),
        ("sliders", "i8"),
        ("harmonics", "i8"),  # of the base; 0: it is sampled
        ("r", "f8"),
        ("inertia", "f8", (_N, _N)),  # r^2 M
        ("mobility", "f8", (_N, _N)),  # its inverse
        ("damping", "f8", (_N, _N)),  # r C, dashpots of contacts in it
        ("frame", "f8", (_N, _N)),  # r C without them
        ("stiffness", "f8", (_N, _N)),
        ("push", "f8", (_N, 2)),  # forces per f and f'
        ("row", "f8", (_C, _N)),
        ("follow", "f8", (_C,)),  # 1 against the base
        ("dashpot", "f8", (_C,)),  # 2 zeta_c r
        ("limit", "f8", (_C,)),  # friction force where s = 0
        ("brake", "f8", (_C,)),  # friction force at the highest speeds, whatever holds at the moment
        ("gradient", "f8", (_C,)),
        ("up", "f8", (_C,)),  # static over kinetic friction
        ("down", "f8", (_C,)),
        ("first", "i8", (_C + 1,)),  # the sliders of contact c are first[c] to first[c + 1]; none: rigid; then come
        # the laws' own states, which are integrated
        ("spring", "f8", (_S,)),
        ("strength", "f8", (_S,)),  # friction force of each slider
        ("mirror", "i1", (_S,)),  # what a mirror image makes of its anchor, or of a law's own state: -1; 1 of an age
        ("lines", "c16", (_H,)),  # the base is Re sum lines_k e^(i k tau)
        ("cubic", "f8", (4,)),  # of a sampled base, the piece's polynomial in local time
        ("moves", "f8"),  # 1; 0 in coordinates relative to the base
        ("alone", "i8"),  # 1: friction nowhere weakens, motions only draw nearer to each other
        ("mirrored", "i8"),  # 1: it is its own mirror image half a cycle later
        ("law", LAW),
    ]
)
"""The numbers of a structure of n masses, c contacts, s elastic sliders, under h harmonics of the base."""

PHASES = np.dtype(
    [
        ("count", "i8"),  # slots in use
        ("next", "i8"),  # slot to write
        ("kappa", "f8", (_P, _C)),  # which phase it is
        ("modes", "i8", (_P,)),  # modes
        ("rate", "c16", (_P, _D)),
        ("outward", "c16", (_P, _N, _D)),
        ("entry", "c16", (_P, _D, 2 * _N)),  # modes of q, from 0 on, and v, from MASSES on
        ("excite", "c16", (_P, _D, _N)),  # modes of a force
        ("fore", "c16", (_P, _D, _H)),  # half the response to e^(i k tau), or half the force where `near`
        ("back", "c16", (_P, _D, _H)),  # half the response to e^(-i k tau)
        ("near", "i8", (_P, _D, _H)),  # 1 next to resonance
        ("close", "i8", (_P,)),  # 1: a harmonic is, or two rates are next to each other
        ("along", "f8", (_P, _N)),  # what held contacts carry along with the base
        ("carried", "f8", (_P, _N, _C)),  # masses by displacements of held contacts
        ("stiffness", "f8", (_P, _N, _N)),
        ("grip", "f8", (_P, _C, _N)),  # held contacts' forces by the forces on the masses
        ("bind", "f8", (_P, _C)),  # and by f''
        ("by_f", "f8", (_P, _N)),  # force per f
        ("seen_w", "c16", (_P, _C, _D)),  # what ends it, a held rigid contact's force or a displacement, over w
        ("seen_dw", "c16", (_P, _C, _D)),  # and over w'
        ("seen_f", "f8", (_P, _C, 3)),  # and over f, f', f''
    ]
)
"""The phases met, one in each slot."""


@inner
def drive_size(system: Any) -> float:
    """Return the size of the base's harmonics: what rounding is of, where a motion is much smaller."""
    total = 0.0
    for m in range(system.harmonics):
        total += (m + 1.0) * abs(system.lines[m])
    return total


@inner
def dot(one: FloatArray, other: FloatArray, count: int) -> float:
    """Return the sum of the products of the first entries of two arrays."""
    total = 0.0
    for k in range(count):
        total += one[k] * other[k]
    return total


@inner
def factorise(matrix: Any, size: int, rows: NDArray[np.int64], least: float) -> bool:
    """Make of a matrix, in place, its lower and upper triangular factors, rows exchanged as is written.

    False where a pivot is no larger than `least`, or no number. A handful of equations most of the time: LAPACK's call
    alone would take ten times as long.
    """
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        rows[k] = best
        if not least < abs(matrix[best, k]) < inf:
            return False
        for j in range(size if best != k else 0):
            matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for i in range(k + 1, size):
            matrix[i, k] /= matrix[k, k]
            for j in range(k + 1, size if matrix[i, k] != 0.0 else 0):
                matrix[i, j] -= matrix[i, k] * matrix[k, j]
    return True


@inner
def substitute(factors: Any, size: int, rows: NDArray[np.int64], right: Any) -> None:
    """Solve linear equations in place of their right side, by what `factorise` made of their matrix."""
    for k in range(size):
        right[k], right[rows[k]] = right[rows[k]], right[k]
    for i in range(1, size):
        for j in range(i):
            right[i] -= factors[i, j] * right[j]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            right[i] -= factors[i, j] * right[j]
        right[i] /= factors[i, i]


@inner
def slot_of(system: Any, phases: Any, kappa: FloatArray) -> int:
    """Return the slot of a phase, which is made if it was not met before; -STEEP: a direction has no stiffness left."""
    contacts = system.contacts
    for i in range(phases.count):
        c = 0
        while c < contacts and phases.kappa[i, c] == kappa[c]:
            c += 1
        if c == contacts:
            return i
    i = phases.next
    phases.count, phases.next = max(phases.count, i + 1), (i + 1) % SLOTS
    for c in range(contacts):
        phases.kappa[i, c] = kappa[c]
    if call_make(system.make, (system, phases, i)) == 0:
        phases.count, phases.next = 0, 0
        return -STEEP
    return i


def make_phase(system: Any, phases: Any, i: int) -> int:
    """Write a phase in its slot; return 0 if a direction has no stiffness. Called by its address: see `flow.run`."""
    made = True
    if system.masses > 1:
        made = call_make(system.make_modes, (system, phases, i)) != 0
    elif not _constrain_one(system, phases, i):
        made = _modes_of_one(system, phases, i)
    if made:
        _complete(system, phases, i)
    return 1 if made else 0


@inner
def _constrain_one(system: Any, phases: Any, i: int) -> bool:
    """Write stiffness of a single mass, and what a held contact carries along and is held by; return if one holds."""
    stiffness, by_f, held = system.stiffness[0, 0], system.push[0, 0], False
    phases.along[i, 0], phases.modes[i] = 0.0, 0
    for c in range(system.contacts):
        phases.carried[i, 0, c] = phases.grip[i, c, 0] = phases.bind[i, c] = 0.0
        kappa = phases.kappa[i, c]
        if kappa != inf:
            stiffness += kappa
            by_f += kappa * system.follow[c]
    for c in range(system.contacts):
        if phases.kappa[i, c] == inf:
            held = True
            phases.carried[i, 0, c], phases.along[i, 0] = 1.0, system.follow[c]
            phases.grip[i, c, 0], phases.bind[i, c] = 1.0, system.inertia[0, 0] * system.follow[c]
    phases.stiffness[i, 0, 0], phases.by_f[i, 0] = stiffness, by_f
    return held


def make_modes(system: Any, phases: Any, i: int) -> int:
    """Write the modes of a phase of several masses in a slot; return 0 if a direction has no stiffness.

    Rigid contacts may not hold on wall and base at once, for the base moves: then the phase has -1 modes.
    """
    n, c = int(system["masses"]), int(system["contacts"])
    kappa, row, follow = phases["kappa"][i, :c], system["row"][:c, :n], system["follow"][:c]
    held = np.isinf(kappa)
    rows, free, carried, grip, bind = row[held], np.eye(n), np.zeros((n, c)), np.zeros((c, n)), np.zeros(c)
    if len(rows) and np.linalg.matrix_rank(rows) < len(rows):
        phases["modes"][i] = -1
        return 1
    if len(rows):
        free = np.linalg.svd(rows)[2][len(rows) :].T
        carried[:, held] = np.linalg.pinv(rows)
        mobile = rows @ system["mobility"][:n, :n]
        compliance = np.linalg.inv(mobile @ rows.T)
        grip[held], bind[held] = compliance @ mobile, compliance @ follow[held]
    springs = np.where(held, 0.0, kappa)
    stiffness = system["stiffness"][:n, :n] + row.T @ (springs[:, None] * row)
    by_f = system["push"][:n, 0] + row.T @ (springs * follow)
    phases["stiffness"][i, :n, :n], phases["by_f"][i, :n] = stiffness, by_f
    phases["grip"][i, :c, :n], phases["bind"][i, :c] = grip, bind
    phases["carried"][i, :n, :c], phases["along"][i, :n] = carried, carried @ follow
    inertia, damping = (free.T @ system[name][:n, :n] @ free for name in ("inertia", "damping"))
    stiff = free.T @ stiffness @ free
    p = len(stiff)
    if p and np.linalg.eigvalsh(0.5 * (stiff + stiff.T))[0] <= 0.0:
        return 0
    rates, vectors = _eigen(inertia, damping, stiff)
    if p and np.linalg.cond(vectors) > 1e7:  # a mode is critically damped
        rates, vectors = _eigen(inertia, damping * (1.0 + CRITICAL), stiff)
    lasting = np.abs(rates.imag) > 1e-12 * np.abs(rates)
    kept = ~lasting | (rates.imag > 0.0)  # of a complex pair one
    inverse, d = np.linalg.inv(vectors)[kept], int(np.count_nonzero(kept))
    phases["modes"][i], phases["rate"][i, :d] = d, np.where(lasting, rates, rates.real)[kept]
    phases["outward"][i, :n, :d] = free @ (vectors[:p] * np.where(lasting, 2.0, 1.0))[:, kept]
    phases["entry"][i, :d, :n] = inverse[:, :p] @ free.T
    phases["entry"][i, :d, MASSES : MASSES + n] = inverse[:, p:] @ free.T
    phases["excite"][i, :d, :n] = inverse[:, p:] @ np.linalg.solve(inertia, free.T)
    return 1


def _eigen(inertia: FloatArray, damping: FloatArray, stiffness: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return rates (2 p,) and shapes (2 p, 2 p), displacements above velocities, of free motions."""
    p = len(inertia)
    below = -np.linalg.solve(inertia, np.hstack((stiffness, damping)))
    rates, vectors = np.linalg.eig(np.vstack((np.eye(p, 2 * p, p), below)).astype(np.complex128))
    return rates, vectors


MAKE = types.int64(from_dtype(SYSTEM), from_dtype(PHASES), types.int64)
call_make = caller(MAKE)


@inner
def _modes_of_one(system: Any, phases: Any, i: int) -> bool:
    """The modes of a single mass, by formula: a complex pair, or two real rates."""
    mass = system.inertia[0, 0]
    half, square = 0.5 * system.damping[0, 0] / mass, phases.stiffness[i, 0, 0] / mass
    if square <= 0.0:
        return False
    inside = half * half - square
    if abs(inside) < CRITICAL * square:
        inside = -CRITICAL * square
    if inside < 0.0:
        rate = complex(-half, np.sqrt(-inside))
        other = rate.conjugate()
        phases.modes[i], phases.rate[i, 0], phases.outward[i, 0, 0] = 1, rate, 2.0
        phases.entry[i, 0, 0], phases.entry[i, 0, MASSES] = -other / (rate - other), 1.0 / (rate - other)
        phases.excite[i, 0, 0] = 1.0 / ((rate - other) * mass)
        return True
    fast = -half - np.sqrt(inside)
    slow = square / fast
    phases.modes[i] = 2
    for j, own, other in ((0, slow, fast), (1, fast, slow)):
        phases.rate[i, j], phases.outward[i, 0, j] = own, 1.0
        phases.entry[i, j, 0], phases.entry[i, j, MASSES] = -other / (own - other), 1.0 / (own - other)
        phases.excite[i, j, 0] = 1.0 / ((own - other) * mass)
    return True


@inner
def _contact_rows(system: Any, phases: Any, i: int) -> None:
    """Write over the modes and the base what each contact's events are seen by: displacement, or force if it is held.

    What is no more than rounding in a displacement is none: other contacts hold it.
    """
    for c in range(system.contacts):
        for order in range(3):
            phases.seen_f[i, c, order] = 0.0
        if phases.kappa[i, c] == inf:
            _held_rows(system, phases, i, c)
            continue
        total, size = -system.follow[c], system.follow[c]
        for a in range(system.masses):
            total += system.row[c, a] * phases.along[i, a]
            size += abs(phases.along[i, a])
        phases.seen_f[i, c, 0] = total if abs(total) > ROUNDING * size else 0.0
        for j in range(phases.modes[i]):
            wave, size = 0.0j, 0.0
            for a in range(system.masses):
                wave += system.row[c, a] * phases.outward[i, a, j]
                size += abs(phases.outward[i, a, j])
            phases.seen_w[i, c, j] = wave if abs(wave) > ROUNDING * size else 0.0j
            phases.seen_dw[i, c, j] = 0.0j


@inner
def _held_rows(system: Any, phases: Any, i: int, c: int) -> None:
    """Write the force of a held rigid contact over the modes and the base."""
    n, seen = system.masses, phases.seen_f[i, c]
    seen[2] = -phases.bind[i, c]
    for a in range(n):
        grip = phases.grip[i, c, a]
        seen[0] += grip * (phases.by_f[i, a] - dot(phases.stiffness[i, a], phases.along[i], n))
        seen[1] += grip * (system.push[a, 1] - dot(system.damping[a], phases.along[i], n))
    for j in range(phases.modes[i]):
        by_w, by_dw = 0.0j, 0.0j
        for a in range(n):
            for b in range(n):
                by_w -= phases.grip[i, c, a] * phases.stiffness[i, a, b] * phases.outward[i, b, j]
                by_dw -= phases.grip[i, c, a] * system.damping[a, b] * phases.outward[i, b, j]
        phases.seen_w[i, c, j], phases.seen_dw[i, c, j] = by_w, by_dw


@inner
def mode_force(system: Any, phases: Any, i: int, j: int, f: complex, df: complex, ddf: complex) -> complex:
    """Return what the base, with these values of f, f', f'', drives a mode by."""
    n, total = system.masses, 0.0j
    for a in range(n):
        force = phases.by_f[i, a] * f + system.push[a, 1] * df
        for b in range(n):
            along = phases.along[i, b]
            if along != 0.0:
                force -= along * (
                    system.inertia[a, b] * ddf + system.damping[a, b] * df + phases.stiffness[i, a, b] * f
                )
        total += phases.excite[i, j, a] * force
    return total


@inlined
def _complete(system: Any, phases: Any, i: int) -> None:
    """Write what follows from the modes of a phase: its contacts', and each mode's response to each harmonic."""
    _contact_rows(system, phases, i)
    phases.close[i] = 0
    for j in range(phases.modes[i]):
        rate = phases.rate[i, j]
        if 0.0 < abs(rate.imag) < NEAR * abs(rate):
            phases.close[i] = 1
        for k in range(j):
            if abs(phases.rate[i, k] - rate) < NEAR * abs(rate):
                phases.close[i] = 1
        for m in range(system.harmonics):
            turn = complex(0.0, m + 1.0)
            fore = 0.5 * mode_force(system, phases, i, j, 1.0 + 0.0j, turn, turn * turn)
            back = 0.5 * mode_force(system, phases, i, j, 1.0 + 0.0j, -turn, turn * turn)
            near = abs(turn - rate) < NEAR
            phases.near[i, j, m] = 1 if near else 0
            phases.close[i] = 1 if near else phases.close[i]
            phases.fore[i, j, m] = fore if near else fore / (turn - rate)
            phases.back[i, j, m] = back / (-turn - rate)


MAKER = address_of(make_phase, MAKE)
