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

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.compiled import entry, inner

SLOTS = 97  # phases remembered: odd, so that fields of one do not meet in one line of the processor's cache
DONE, CHATTER, PULLS, TIRED, STEEP, MISSING = range(6)  # how a run ended; MISSING: a phase is to be made
CRITICAL = 2e-10  # over the squared frequency: two rates nearer than this are parted by it (zeta moved by 1e-10)
ROUNDING = 1e-13  # a contact that moves by a smaller share of the masses' motion is held by others
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
        ("wait", "i8"),  # and of `answer.wait`; 0: it is not compiled yet
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
        ("missing", "i8"),  # 1 and the slot of a phase of several masses that is to be made
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
def dot(one: FloatArray, other: FloatArray, count: int) -> float:
    """Return the sum of the products of the first entries of two arrays."""
    total = 0.0
    for k in range(count):
        total += one[k] * other[k]
    return total


@inner
def slot_of(system: Any, phases: Any, kappa: FloatArray) -> int:
    """Return the slot of a phase. One that was not met before is made, of one mass; -MISSING: `make_phase` must do so.

    -STEEP: a direction has no stiffness left.
    """
    contacts, held = system.contacts, False
    if phases.missing:
        return -MISSING
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
        held = held or kappa[c] == inf
    if system.masses > 1:
        phases.missing = 1 + i
        return -MISSING
    _constrain_one(system, phases, i)
    phases.modes[i] = 0
    if not held and not _modes_of_one(system, phases, i):
        phases.count, phases.next = 0, 0
        return -STEEP
    _complete(system, phases, i)
    return i


@inner
def _constrain_one(system: Any, phases: Any, i: int) -> None:
    """Write stiffness of a single mass, and what a held contact carries along and is held by."""
    stiffness, by_f = system.stiffness[0, 0], system.push[0, 0]
    phases.along[i, 0] = 0.0
    for c in range(system.contacts):
        phases.carried[i, 0, c] = phases.grip[i, c, 0] = phases.bind[i, c] = 0.0
        kappa = phases.kappa[i, c]
        if kappa != inf:
            stiffness += kappa
            by_f += kappa * system.follow[c]
    for c in range(system.contacts):
        if phases.kappa[i, c] == inf:
            phases.carried[i, 0, c], phases.along[i, 0] = 1.0, system.follow[c]
            phases.grip[i, c, 0], phases.bind[i, c] = 1.0, system.inertia[0, 0] * system.follow[c]
    phases.stiffness[i, 0, 0], phases.by_f[i, 0] = stiffness, by_f


def make_phase(systems: Any, works: Any) -> None:
    """Make the phase that a run has missed, of several masses; refuse one without stiffness, or critically damped."""
    system, phases = systems[0], works[0]["phases"]
    n, c = int(system["masses"]), int(system["contacts"])
    i = int(phases["missing"]) - 1
    phases["missing"] = 0
    kappa, row, follow = phases["kappa"][i, :c], system["row"][:c, :n], system["follow"][:c]
    held = np.isinf(kappa)
    rows, free, carried, grip, bind = row[held], np.eye(n), np.zeros((n, c)), np.zeros((c, n)), np.zeros(c)
    if len(rows) and np.linalg.matrix_rank(rows) < len(rows):  # on wall and base at once: the base moves
        phases["modes"][i] = -1
        return
    if len(rows):
        free = np.linalg.svd(rows)[2][len(rows) :].T
        carried[:, held] = np.linalg.pinv(rows)
        mobile = rows @ system["mobility"][:n, :n]
        compliance = np.linalg.inv(mobile @ rows.T)
        grip[held], bind[held] = compliance @ mobile, compliance @ follow[held]
    springs = np.where(held, 0.0, kappa)
    stiffness = system["stiffness"][:n, :n] + row.T @ (springs[:, None] * row)
    phases["stiffness"][i, :n, :n], phases["by_f"][i, :n] = (
        stiffness,
        system["push"][:n, 0] + row.T @ (springs * follow),
    )
    phases["grip"][i, :c, :n], phases["bind"][i, :c] = grip, bind
    phases["carried"][i, :n, :c], phases["along"][i, :n] = carried, carried @ follow
    _write_modes(system, phases, i, free, stiffness)
    complete(systems, works, i)


def _write_modes(system: Any, phases: Any, i: int, free: FloatArray, stiffness: FloatArray) -> None:
    """Write rates, shapes and what enters the modes in the free directions (n, p); of a complex pair one mode."""
    n, p = free.shape
    inertia, damping = (free.T @ system[name][:n, :n] @ free for name in ("inertia", "damping"))
    stiff = free.T @ stiffness @ free
    if p and np.linalg.eigvalsh(0.5 * (stiff + stiff.T))[0] <= 0.0:
        phases["count"], phases["next"] = 0, 0
        raise SimulationError(
            "structure: gradient; expected so small that every mass keeps a stiffness; got friction that changes"
            " along the path faster than the springs' force; do: take a smaller gradient"
        )
    matrix = np.block([[np.zeros((p, p)), np.eye(p)], [-np.linalg.solve(inertia, np.hstack((stiff, damping)))]])
    rates, vectors = np.linalg.eig(matrix.astype(np.complex128))
    if p and np.linalg.cond(vectors) > 1e7:
        raise SimulationError(
            "structure: a mode is critically damped, and two of its rates are one; do: change a damping_ratio by"
            " one in a million"
        )
    lasting = np.abs(rates.imag) > 1e-12 * np.abs(rates)
    kept = ~lasting | (rates.imag > 0.0)
    inverse, d = np.linalg.inv(vectors)[kept], int(np.count_nonzero(kept))
    phases["modes"][i] = d
    phases["rate"][i, :d] = np.where(lasting, rates, rates.real)[kept]
    phases["outward"][i, :n, :d] = free @ (vectors[:p] * np.where(lasting, 2.0, 1.0))[:, kept]
    phases["entry"][i, :d, :n], phases["entry"][i, :d, MASSES : MASSES + n] = (
        inverse[:, :p] @ free.T,
        inverse[:, p:] @ free.T,
    )
    phases["excite"][i, :d, :n] = inverse[:, p:] @ np.linalg.solve(inertia, free.T)


@entry
def complete(systems: Any, works: Any, i: int) -> None:
    """Write what follows from the modes of a phase."""
    _complete(systems[0], works[0].phases, i)


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


@inner
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
