"""Motions without a stop that one harmonic of the force drives close to resonance, by the phases of their turns.

There a disturbance lasts as many cycles as the motion is large, so that the map of a cycle leaves its fixed point
undecided by that factor. But the friction force of a motion without a stop is a square wave that knows only the phases
of its turns, and the response to it and to each harmonic is known in closed form, with the distance to resonance taken
without rounding. What is left to solve is that the velocity is 0 at each turn: equations that are all divided by that
small distance, and so lose nothing.
"""

from math import atan2, cos, exp, expm1, hypot, pi, sin

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.events import carry
from frictionlab.simulator.kernel.layout import TURN, Buffer, Force, Found, Leg, Oscillator, Rig, Room
from frictionlab.simulator.kernel.motion import gap
from frictionlab.simulator.kernel.outlook import damped_turn, den_hartog, forced
from frictionlab.simulator.kernel.shooting import symmetric_force

CLOSE = 0.01  # to resonance: 1 - k r, and the damping ratio
MOST_TURNS = 64  # in a cycle
LAST_STEP = 4e-16  # rad, of Newton's method, over the size of a turn's phase
STEPS = 30  # of Newton's method


def close_harmonic(rig: Rig, force: Force) -> int:
    """Return the number of the harmonic that drives the mass close to resonance; 0: none does, or friction stops it."""
    r, zeta, beta = rig.plain.r, rig.plain.zeta, rig.contact.beta
    for i in range(min(len(force.cosine), MOST_TURNS // 2)):
        away = abs(gap(r, i + 1.0))
        drive = 0.25 * pi * hypot(force.cosine[i], force.sine[i])
        if max(away, zeta) < CLOSE and 0.0 < beta < drive and away + zeta > 0.0:
            return i + 1
    return 0


def first_turns(rig: Rig, force: Force, n: int, turns: Buffer) -> bool:
    """Write the phases of the turns under the n-th harmonic alone, the first an upper one; False: it has a stop."""
    c, s, slow = force.cosine[n - 1], force.sine[n - 1], rig.plain
    size = hypot(c, s)
    own = Oscillator(n * slow.r, slow.zeta, slow.omega / n, slow.rate, slow.rate2, 1.0)
    beta = rig.contact.beta / size
    amplitude, phase = (
        den_hartog(own.r, beta) if own.zeta == 0.0 else damped_turn(Rig(rig.contact, own, own, own), beta)
    )
    for j in range(2 * n):
        turns[j] = (phase + atan2(s, c) + j * pi) / n
    return amplitude > 0.0


def impulse(slide: Oscillator, n: int, t: float) -> tuple[float, float]:
    """Return the periodic motion under one unit impulse a cycle, and its rate, at t in [0, 2 pi) after the impulse.

    It is the sum of all impulses ago, ``Im(exp(s t) / (1 - exp(2 pi s))) / (r^2 omega)`` with
    ``s = -zeta/r + i omega``; omega - n, on which the divisor hangs, is taken without rounding.
    """
    r, zeta, omega = slide.r, slide.zeta, slide.omega
    x = -TURN * zeta / r
    y = TURN * (gap(r, float(n)) - zeta * zeta / (1.0 + r * omega)) / r
    divisor = complex(2.0 * sin(0.5 * y) ** 2 - expm1(x) * cos(y), -exp(x) * sin(y)) * (r * r * omega)
    decay = exp(-zeta / r * t)
    turned = complex(decay * cos(omega * t), decay * sin(omega * t)) / divisor
    return turned.imag, (complex(-zeta / r, omega) * turned).imag


def rubbed(rig: Rig, n: int, turns: Buffer, tau: float) -> tuple[float, float]:
    """Return z and v of the periodic motion under the friction force that turns round at each of the phases.

    At tau the mass slides downwards: friction pushes it by beta.
    """
    r, zeta, beta = rig.plain.r, rig.plain.zeta, rig.contact.beta
    z, v = beta, 0.0
    for j in range(2 * n):
        jump = 2.0 * beta if j % 2 == 0 else -2.0 * beta  # of the force on the mass
        pushed, rate = impulse(rig.plain, n, (tau - turns[j]) % TURN)
        z -= jump * (r * r * rate + 2.0 * zeta * r * pushed)
        v += jump * pushed
    return z, v


def solve_linear(matrix: Buffer, size: int) -> bool:
    """Solve size linear equations in place, right side in the last column; False where they have no one solution."""
    width = size + 1
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i * width + k]) > abs(matrix[best * width + k]):
                best = i
        if matrix[best * width + k] == 0.0:
            return False
        for j in range(width):
            matrix[k * width + j], matrix[best * width + j] = matrix[best * width + j], matrix[k * width + j]
        for i in range(size):
            if i != k:
                share = matrix[i * width + k] / matrix[k * width + k]
                for j in range(k, width):
                    matrix[i * width + j] -= share * matrix[k * width + j]
    for k in range(size):
        matrix[k * width + size] /= matrix[k * width + k]
    return True


def solve_turns(rig: Rig, force: Force, n: int, turns: Buffer) -> bool:
    """Move the turns' phases to where the velocity is 0 at each, by Newton's method; tell whether that succeeded."""
    count, wide = 2 * n, 2 * n + 1
    matrix = [0.0] * (count * wide)
    for _ in range(STEPS):
        for i in range(count):
            _, v, a = forced(rig, force, turns[i])
            matrix[i * wide + i], matrix[i * wide + count] = a, -v
        for i in range(count):
            for j in range(count):
                jump = 2.0 * rig.contact.beta if j % 2 == 0 else -2.0 * rig.contact.beta
                pushed, rate = impulse(rig.plain, n, (turns[i] - turns[j]) % TURN)
                matrix[i * wide + count] -= jump * pushed
                if i != j:
                    matrix[i * wide + i] += jump * rate
                    matrix[i * wide + j] = -jump * rate
        if not solve_linear(matrix, count):
            return False
        largest, reach = 0.0, 0.0
        for i in range(count):
            step = matrix[i * wide + count]
            turns[i] += step
            largest, reach = max(largest, abs(step)), max(reach, abs(turns[i]))
        if not largest < 1.0:
            return False
        if largest <= LAST_STEP * max(1.0, reach):
            return True
    return largest <= 1e-13 * max(1.0, reach)


def resonant_orbit(rig: Rig, force: Force, room: Room) -> tuple[bool, Found]:
    """Tell whether one harmonic drives the mass close to resonance without a stop, and return the orbit.

    It starts midway between two turns; the event loop must come back to it by as many slides and without a stop.
    """
    leg, n = Leg(0.0, TURN, 1.0, 1.0), close_harmonic(rig, force)
    none = (leg, 0.0, 0.0, 0.0, layout.DONE)
    turns = [0.0] * (2 * n)
    if n == 0 or not first_turns(rig, force, n, turns) or not solve_turns(rig, force, n, turns):
        return False, none
    half = n % 2 == 1 and symmetric_force(force)
    tau = 0.5 * (turns[0] + turns[1])
    z, v, _ = forced(rig, force, tau)
    more, faster = rubbed(rig, n, turns, tau)
    z, v = z + more, v + faster
    leg = Leg(tau % TURN, pi, 1.0, -1.0) if half else Leg(tau % TURN, TURN, 1.0, 1.0)
    iz, iv, code = carry(rig, force, leg, z, v, room)
    miss, size = hypot(iz - z, rig.plain.r * (iv - v)), hypot(z, rig.plain.r * v) + room.tally[layout.PATH]
    calm = room.tally[layout.STUCK_TIME] == 0.0 and room.tally[layout.PHASES] == (n if half else 2 * n) + 1.0
    return code == layout.DONE and calm and miss <= 1e-12 * size, (leg, z, v, miss, code)
