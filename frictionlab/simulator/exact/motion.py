"""The motion in a phase from a moment on, at any time, with its derivatives and bounds of them.

Each mode is ``w = start e^(rate t) + steady + responses`` to the harmonics of the base or, under a sampled base, to its
cubic. Derivatives follow from ``w' = rate w + force``, without differences.
"""

from math import sqrt
from typing import Any

import numpy as np

from frictionlab.arrays import ComplexArray, FloatArray
from frictionlab.simulator.compiled import inner
from frictionlab.simulator.exact.phase import (
    CONTACTS,
    HARMONICS,
    INNER,
    MASSES,
    MODES,
    PHASES,
    SLIDERS,
    dot,
    mode_force,
)

ORDERS = 5  # values and four derivatives
LONG = 4.0  # rad: over longer spans the sine itself is taken, lest roundings of the half angle's add up over cycles

_N, _C, _D, _S, _H = MASSES, CONTACTS, MODES, SLIDERS, HARMONICS
_J = 2 * _N + _S

STAGES, COUNT = 7, 8  # stages and nodes of a step
SIZE, LESS = 2 * _N + INNER, _N + INNER

STEPS = np.dtype(
    [
        ("components", "i8"),  # that are carried: displacements, velocities, inner states
        ("next", "f8"),  # length of the next step
        ("last", "f8"),  # and of the last one; 0: none to go on from
        ("driven", "f8", (3, COUNT)),  # f, f' and f'' at the nodes of the step that is tried
        ("values", "f8", (SIZE, COUNT)),  # the last step at its nodes
        ("trial", "f8", (SIZE, COUNT)),  # the step that is tried
        ("rate", "f8", (SIZE, COUNT)),
        ("net", "f8", (_N, COUNT)),  # force on each mass but for that of held contacts
        ("bare", "f8", (_N, SIZE, COUNT)),  # its slopes over the state
        ("slopes", "f8", (LESS, SIZE, COUNT)),  # of the rates of v and of the inner states over the state
        ("mobile", "f8", (_N, _N)),  # accelerations by net forces, as held contacts leave them
        ("moved", "f8", (_N,)),  # and by f''
        ("constant", "f8", (_N,)),  # constant forces of springs
        ("factors", "f8", (STAGES * LESS, STAGES * LESS)),  # of the stages' equations, q put in
        ("right", "f8", (SIZE, STAGES)),
        ("reduced", "f8", (STAGES * LESS,)),
        ("exchanged", "i8", (STAGES * LESS,)),
        ("held", "f8", (_C, COUNT)),  # force of each held contact at the nodes
        ("watch", "f8", (COUNT,)),  # an event's function at the nodes
        ("curve", "f8", (2, COUNT)),  # its Bernstein coefficients, and those of a part
    ]
)
"""Where steps are tried that are integrated."""

WORK = np.dtype(
    [
        ("phases", PHASES),
        ("steps", STEPS),
        ("tau", "f8"),  # begin of the phase
        ("until", "f8"),  # end of the run
        ("count", "i8"),  # pieces met
        ("signature", "i8"),  # of the events passed, in their order
        ("contact", "i8"),  # by which the last phase ended, -1: by none
        ("how", "i8"),  # and how
        ("fall", "f8"),  # rate of that event's function then
        ("idle", "i8"),  # phases in a row that took no time
        ("quick", "i8"),  # and second looks at a corner of a law
        ("entered", "i8"),  # the recorded piece at hand; -1: none
        ("slot", "i8"),  # and its phase
        ("path", "f8"),  # way slipped, all contacts together
        ("left", "f8"),  # evaluations, or steps, that may still be made
        ("spent", "f8"),  # of them, by a search
        ("fastest", "f8"),  # rate of the present phase
        ("q", "f8", (_N,)),  # state at the begin of the phase
        ("v", "f8", (_N,)),
        ("high", "f8", (_N,)),  # of q, at the ends of pieces
        ("low", "f8", (_N,)),
        ("anchor", "f8", (_S,)),  # where an elastic slider's spring is relaxed
        ("side", "i8", (_C,)),  # direction of slip, 0 holds
        ("slips", "i8", (_S,)),  # 1 while it slips
        ("slipped", "i8", (_S,)),  # 1 if it has slipped in the run
        ("slipping", "i8", (_S,)),  # what slipped before an event
        ("resting", "i8", (_C,)),  # rigid contacts at rest at an event
        ("breaking", "i8"),  # that of them which gives way
        ("place", "f8", (_C,)),  # of contacts at the begin of the phase
        ("kappa", "f8", (_C,)),
        ("offset", "f8", (_C,)),
        ("upper", "f8", (_C,)),  # displacement at which the next slider gives way
        ("lower", "f8", (_C,)),
        ("lead", "i8", (_C, 3)),  # of each event function how many derivatives are zero at the begin
        ("bounds", "f8", (_C, 3)),  # of their third derivatives
        ("sure", "i8"),  # 1: the step to the nearest event ends there
        ("line", "c16", (_H,)),  # harmonics of the base about the begin
        ("grown", "c16", (_H,)),  # what they have grown by since
        ("crest", "f8", (3,)),  # bounds of the third to fifth derivative of the base
        ("at", "f8"),  # time after the begin for which the modes are written
        ("start", "c16", (_D,)),
        ("forced", "c16", (_D, 4)),  # of a sampled base, polynomial force on each mode
        ("rest", "f8", (_N,)),  # what held contacts fix
        ("lasting", "c16", (_D,)),  # (e^(rate t) - 1) / rate of each mode
        ("w", "c16", (ORDERS, _D)),  # what the modes have grown by since the begin, and their derivatives
        ("f", "f8", (ORDERS,)),  # the base and its derivatives
        ("rise", "f8"),  # of the base since the begin
        ("now_q", "f8", (_N,)),  # displacements and velocities at a time after the begin
        ("now_v", "f8", (_N,)),
        ("bound", "f8", (2, _D)),  # of the third and fourth derivative of each mode
        ("flow", "f8", (2 * _N, 2 * _N + _C)),  # derivative of a phase's end by its begin and its constant forces
        ("pushed", "f8", (_N, 2 * _N + _C)),  # constant forces on the masses by the same
        ("form", "f8", (_J + _C,)),  # a row or column of the derivative
        ("acceleration", "f8", (2, _N)),  # before and after an event
        ("seen", "f8", (4,)),  # what an event is seen by, and its derivatives
        ("force", "f8", (_C,)),  # of contacts: of held ones at an event, of all at a look
        ("slip", "f8", (_C,)),  # speed at which contacts slip, at a look
        ("net", "f8", (_N,)),  # of forces on the masses
        ("shift", "f8", (_J,)),  # by how much an event comes earlier, for each column of the derivative
        ("jacobian", "f8", (_J, _J)),  # rows q (n), v (n), anchors (s)
    ]
)
"""Where a run writes: the state it is in, the motion of its phase, the derivative of its end by its start."""


@inner
def modulus(z: complex) -> float:
    """Return the size of a complex number, faster than a library that minds overflow."""
    return sqrt(z.real * z.real + z.imag * z.imag)


@inner
def quotient(a: complex, b: complex, t: float) -> complex:
    """Return (e^(a t) - e^(b t)) / (a - b), also where the two meet."""
    x = 0.5 * (a - b) * t
    if abs(x) < 0.03:  # sinh(x) / x
        square = x * x
        series = 1.0 + square / 6.0 * (1.0 + square / 20.0 * (1.0 + square / 42.0 * (1.0 + square / 72.0)))
        return t * np.exp(0.5 * (a + b) * t) * series
    return (np.exp(a * t) - np.exp(b * t)) / (a - b)


@inner
def growth(x: complex) -> complex:
    """Return e^x - 1, to rounding also where it is small."""
    half, grown = np.sin(0.5 * x.imag), np.expm1(x.real) if x.real != 0.0 else 0.0
    less = 2.0 * half * half
    if abs(x.imag) > LONG:
        return complex(grown * (1.0 - less) - less, (grown + 1.0) * np.sin(x.imag))
    return complex(grown * (1.0 - less) - less, (grown + 1.0) * 2.0 * half * np.cos(0.5 * x.imag))


@inner
def base_at(system: Any, work: Any, t: float) -> None:
    """Write the base's displacement and its derivatives at a time after the begin, and its rise since."""
    f = work.f
    for order in range(ORDERS):
        f[order] = 0.0
    work.rise = 0.0
    if system.harmonics == 0:
        c = system.cubic
        work.rise = t * (c[1] + t * (c[2] + t * c[3]))
        f[0] = c[0] + work.rise
        f[1] = c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])
        f[2] = 2.0 * c[2] + t * 6.0 * c[3]
        f[3] = 6.0 * c[3]
        return
    turned, change = growth(complex(0.0, t)), 0.0j
    rise = place = speed = bend = third = fourth = 0.0
    for m in range(system.harmonics):
        k = m + 1.0
        change += turned + change * turned  # e^(i k t) - 1
        grown = work.line[m] * change
        wave = work.line[m] + grown
        work.grown[m] = grown
        rise += grown.real
        place += wave.real
        speed -= k * wave.imag
        bend -= k * k * wave.real
        third += k * k * k * wave.imag
        fourth += k * k * k * k * wave.real
    work.rise = rise
    f[0], f[1], f[2], f[3], f[4] = place, speed, bend, third, fourth


@inner
def place_of(system: Any, q: FloatArray, c: int, f: float) -> float:
    """Return the displacement of a contact, the base's being f; of velocities its speed, and so on."""
    return dot(system.row[c], q, system.masses) - system.follow[c] * f


@inner
def base_at_time(system: Any, work: Any) -> None:
    """Write the base's motion at the state's time."""
    turn, wave = complex(np.cos(work.tau), np.sin(work.tau)), 1.0 + 0.0j
    for m in range(system.harmonics):
        wave *= turn
        work.line[m] = system.lines[m] * wave
    base_at(system, work, 0.0)


@inner
def bound_base(system: Any, work: Any) -> None:
    """Bound the third to fifth derivative of the base; of a sampled one over its piece."""
    for order in range(3):
        work.crest[order] = 6.0 * abs(system.cubic[3]) if order == 0 and system.harmonics == 0 else 0.0
    for m in range(system.harmonics):
        k = m + 1.0
        third = k * k * k * abs(system.lines[m])
        work.crest[0] += third
        work.crest[1] += k * third
        work.crest[2] += k * k * third


@inner
def begin_motion(system: Any, work: Any, i: int) -> None:
    """Write the motion of the phase in slot i from the state at hand on; the base's is written.

    First where contacts are, and the constant forces on the masses: slip, anchors, and what held contacts fix.
    """
    n, contacts = system.masses, system.contacts
    for a in range(n):
        work.rest[a] = 0.0
    for c in range(contacts):
        work.place[c] = place_of(system, work.q, c, work.f[0])
        if work.kappa[c] == np.inf:
            for a in range(n):
                work.rest[a] += work.phases.carried[i, a, c] * work.place[c]
    for a in range(n):
        work.net[a] = -dot(work.phases.stiffness[i, a], work.rest, n)
        for c in range(contacts):
            if work.kappa[c] != np.inf:
                work.net[a] -= system.row[c, a] * work.offset[c]
    work.at, work.fastest = np.nan, max(float(system.harmonics), 1e-3)
    for j in range(work.phases.modes[i]):
        begin_mode(system, work, i, j)


@inner
def begin_mode(system: Any, work: Any, i: int, j: int) -> None:
    """Write where a mode starts, less what it tends to, and under a sampled base its polynomial force."""
    phases = work.phases
    rate, constant, start = phases.rate[i, j], 0.0j, 0.0j
    for a in range(system.masses):
        constant += phases.excite[i, j, a] * work.net[a]
        start += phases.entry[i, j, a] * work.q[a] + phases.entry[i, j, MASSES + a] * work.v[a]
    work.fastest = max(work.fastest, modulus(rate))
    if system.harmonics == 0:
        work.start[j], c = start, system.cubic
        values = (c[0], c[1], 2.0 * c[2], 6.0 * c[3], 0.0, 0.0)  # the base's derivatives; coefficients of t^k / k!
        for k in range(4):
            f, df, ddf = complex(values[k]), complex(values[k + 1]), complex(values[k + 2])
            work.forced[j, k] = mode_force(system, phases, i, j, f, df, ddf)
        work.forced[j, 0] += constant
        return
    start += constant / rate
    for m in range(system.harmonics):
        if phases.near[i, j, m] == 0:
            start -= phases.fore[i, j, m] * work.line[m]
        start -= phases.back[i, j, m] * work.line[m].conjugate()
    work.start[j] = start


@inner
def modes_at(system: Any, work: Any, i: int, t: float) -> None:
    """Write what each mode has grown by, its derivatives, the base's motion and the masses' at a time after the begin.

    Growth is not a difference of values: motions that are small beside the drive keep their digits.
    """
    if t == work.at:
        return
    phases, w = work.phases, work.w
    work.left -= 1.0
    work.at = t
    base_at(system, work, t)
    for j in range(phases.modes[i]):
        rate = phases.rate[i, j]
        change = growth(rate * t)
        work.lasting[j] = change / rate
        if system.harmonics == 0:
            _mode_under_cubic(work, rate, change, j, t)
            continue
        w0 = work.start[j] * change
        w1 = rate * (work.start[j] + w0)
        w2 = rate * w1
        w3 = rate * w2
        w4 = rate * w3
        for m in range(system.harmonics):
            k, line, grown = m + 1.0, work.line[m], work.grown[m]
            back, fore = phases.back[i, j, m] * (line + grown).conjugate(), 0.0j
            w0 += phases.back[i, j, m] * grown.conjugate()
            if phases.near[i, j, m] == 0:
                fore = phases.fore[i, j, m] * (line + grown)
                w0 += phases.fore[i, j, m] * grown
            apart, both = k * (fore - back), k * k * (fore + back)
            w1 += complex(-apart.imag, apart.real)
            w2 -= both
            w3 += k * k * complex(apart.imag, -apart.real)
            w4 += k * k * both
        w[0, j], w[1, j], w[2, j], w[3, j], w[4, j] = w0, w1, w2, w3, w4
        for m in range(system.harmonics if phases.close[i] else 0):
            if phases.near[i, j, m] == 1:
                line, fore = work.line[m], phases.fore[i, j, m]
                _add_near(w, j, fore * (line + work.grown[m]), fore * line, rate, m + 1.0, t)
    for a in range(system.masses):
        along = phases.along[i, a]
        place, speed = work.q[a] + along * work.rise, along * work.f[1]
        for j in range(phases.modes[i]):
            place += (phases.outward[i, a, j] * w[0, j]).real
            speed += (phases.outward[i, a, j] * w[1, j]).real
        work.now_q[a], work.now_v[a] = place, speed


@inner
def _add_near(w: ComplexArray, j: int, force: complex, line: complex, rate: complex, k: float, t: float) -> None:
    """Add the response from rest to a harmonic next to resonance: w' = rate w + force."""
    turn = complex(0.0, k)
    value, push = line * quotient(rate, turn, t), force  # from rest: it is what it has grown by
    w[0, j] += value
    for order in range(1, ORDERS):
        value = rate * value + push
        push = push * turn
        w[order, j] += value


@inner
def _mode_under_cubic(work: Any, rate: complex, change: complex, j: int, t: float) -> None:
    """Write a mode under a cubic force: ``e^x start + sum_k t^(k+1) phi_(k+1)(x) p_k``, x = rate t; change: e^x - 1."""
    w, p = work.w, work.forced
    x, value = rate * t, work.start[j] * change
    if abs(x) < 0.7:  # the series of phi_4, and phi_k = 1 / k! + x phi_(k+1)
        phi, term = complex(1.0 / 24.0), complex(1.0 / 24.0)
        for m in range(5, 20):
            term *= x * (1.0 / m)
            phi += term
            if modulus(term) < 1e-18:
                break
        power, inverse = t * t * t * t, 1.0 / 6.0
        for k in range(3, -1, -1):
            value += power * phi * p[j, k]
            phi, power, inverse = inverse + x * phi, power / t if t > 0.0 else 0.0, inverse * k
    else:
        phi, power, factorial = change / x, t, 1.0
        for k in range(4):
            value += power * phi * p[j, k]
            factorial *= k + 1.0
            phi = (phi - 1.0 / factorial) / x
            power *= t
    w[0, j] = value
    push = p[j, 0] + t * (p[j, 1] + t * (0.5 * p[j, 2] + t / 6.0 * p[j, 3]))
    d_push = p[j, 1] + t * (p[j, 2] + 0.5 * t * p[j, 3])
    dd_push = p[j, 2] + t * p[j, 3]
    w[1, j] = rate * (value + work.start[j]) + push
    w[2, j] = rate * w[1, j] + d_push
    w[3, j] = rate * w[2, j] + dd_push
    w[4, j] = rate * w[3, j] + p[j, 3]


@inner
def bound_modes(system: Any, work: Any, i: int, t: float, span: float) -> None:
    """Bound the third and fourth derivative of each mode over a span from t on, where `modes_at` was called."""
    phases = work.phases
    for j in range(phases.modes[i]):
        rate = phases.rate[i, j]
        size, growth = modulus(rate), np.exp(max(0.0, rate.real) * span)
        if system.harmonics == 0:
            fourth = (modulus(work.w[4, j]) + size * span * modulus(work.forced[j, 3])) * np.exp(size * span)
            work.bound[0, j] = modulus(work.w[3, j]) + span * fourth
            work.bound[1, j] = fourth
            continue
        free = modulus(work.start[j]) * np.exp(rate.real * t) * growth
        third, fourth = size**3 * free, size**4 * free
        for m in range(system.harmonics):
            k = m + 1.0
            near, line = phases.near[i, j, m], modulus(work.line[m])
            fore, back = line * modulus(phases.fore[i, j, m]), line * modulus(phases.back[i, j, m])
            both = back + (0.0 if near else fore)
            third += k**3 * both
            fourth += k**4 * both
            if near:
                most = max(size, k)
                reach = (t + span) * max(1.0, growth)
                third += fore * most**2 * (most * reach + 3.0)
                fourth += fore * most**3 * (most * reach + 4.0)
        work.bound[0, j], work.bound[1, j] = third, fourth


@inner
def contact_force(system: Any, work: Any, i: int, c: int) -> float:
    """Return the force of a contact on its mass, its dashpot in it, at the time for which `modes_at` was called."""
    if work.kappa[c] == np.inf:
        return held_force(system, work, i, c, work.now_q, work.now_v)
    place, speed = place_of(system, work.now_q, c, work.f[0]), place_of(system, work.now_v, c, work.f[1])
    return work.kappa[c] * place + work.offset[c] + system.dashpot[c] * speed


@inner
def held_force(system: Any, work: Any, i: int, c: int, q: FloatArray, v: FloatArray) -> float:
    """Return the force by which a rigid contact holds, in a state, the base's motion being in `f`."""
    grip, total = work.phases.grip, -work.phases.bind[i, c] * work.f[2]
    for a in range(system.masses):
        if grip[i, c, a] != 0.0:
            total += grip[i, c, a] * force_on(system, work, a, q, v)
    return total


@inner
def force_on(system: Any, work: Any, a: int, q: FloatArray, v: FloatArray) -> float:
    """Return the force on a mass, but for that of held contacts, in a state."""
    force = dot(system.push[a], work.f, 2)
    force -= dot(system.damping[a], v, system.masses) + dot(system.stiffness[a], q, system.masses)
    for c in range(system.contacts):
        if work.kappa[c] != np.inf:
            force -= system.row[c, a] * (work.kappa[c] * place_of(system, q, c, work.f[0]) + work.offset[c])
    return force


@inner
def flow_over(system: Any, work: Any, i: int) -> None:
    """Write the derivative of (q, v) at the time of `modes_at` by (q, v) and the contacts' constant forces before."""
    phases, flow, n = work.phases, work.flow, system.masses
    begin_flow(system, work, i)
    for j in range(phases.modes[i]):
        rate, lasting = phases.rate[i, j], work.lasting[j]
        grown = rate * lasting + 1.0
        for b in range(2 * n + system.contacts):
            by_start, by_force = 0.0j, 0.0j
            if b < 2 * n:
                by_start = phases.entry[i, j, b if b < n else MASSES + b - n]
            for a in range(n):
                by_force += phases.excite[i, j, a] * work.pushed[a, b]
            w, dw = grown * by_start + lasting * by_force, grown * (rate * by_start + by_force)
            for a in range(n):
                flow[a, b] += (phases.outward[i, a, j] * w).real
                flow[n + a, b] += (phases.outward[i, a, j] * dw).real


@inner
def begin_flow(system: Any, work: Any, i: int) -> None:
    """Write what held contacts carry along with displacements, and by what each column pushes the masses."""
    n, flow, pushed = system.masses, work.flow, work.pushed
    for a in range(n):
        for b in range(2 * n + system.contacts):
            flow[a, b] = flow[n + a, b] = pushed[a, b] = 0.0
        for c in range(system.contacts):
            if work.kappa[c] != np.inf:
                pushed[a, 2 * n + c] = -system.row[c, a]
                continue
            for b in range(n):
                flow[a, b] += work.phases.carried[i, a, c] * system.row[c, b]
    for a in range(n):
        for b in range(n):
            for e in range(n):
                pushed[a, b] -= work.phases.stiffness[i, a, e] * flow[e, b]
