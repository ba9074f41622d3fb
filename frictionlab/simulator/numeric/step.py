"""One step of Radau IIA: Newton's method on its stages, the size of its error, its polynomial, its slopes.

The polynomial through the start and the seven stages of a step is the motion (degree 7, error like h^8), and its
highest coefficient says how well: a step is taken if that coefficient, times the largest value of the node polynomial,
is below the tolerance. So the motion is as good everywhere as the tolerance says; the end of a step is much better
(order 13), and the stops, which are ends of steps, with it.
"""

from math import isfinite

from frictionlab.simulator.numeric.contact import drive, rates
from frictionlab.simulator.numeric.layout import STAGES, STEPS, WIDTH, Buffer, Rig, Room

PEAK = 7e-5  # largest value of the node polynomial on the step
MOST = 12  # of Newton's steps; two to four are usual
ROUNDING = 1e-14  # a correction so small is none
GUESS = 0.04  # by what a second correction with the same matrix is taken to be smaller than the first
FAILED = 1e300  # the size of a correction that does not exist
LOST = 1e-10  # corrections that stay, but are no larger than this, are rounding in a stiff law


def at_node(room: Room, theta: float, component: int) -> float:
    """Value of the last step's polynomial at a share theta of the step."""
    nodes, weights, values = room.nodes, room.weights, room.values
    above, below = 0.0, 0.0
    for i in range(STAGES + 1):
        gap = theta - nodes[i]
        if gap == 0.0:
            return values[i * WIDTH + component]
        part = weights[i] / gap
        above += part * values[i * WIDTH + component]
        below += part
    return above / below


def predict(room: Room, size: int, offset: float, ratio: float) -> None:
    """Write a first guess of the stages: the last polynomial, at shares offset + ratio * node of its step."""
    trial, nodes = room.trial, room.nodes
    for i in range(1, STAGES + 1):
        for k in range(size):
            trial[i * WIDTH + k] = at_node(room, offset + ratio * nodes[i], k)


def factorise(matrix: Buffer, pivot: Buffer, size: int) -> bool:
    """Factorise in place with row exchanges; False if the matrix is singular or not finite."""
    for k in range(size):
        best, row = 0.0, k
        for i in range(k, size):
            if abs(matrix[i * size + k]) > best:
                best, row = abs(matrix[i * size + k]), i
        if not (best > 0.0 and isfinite(best)):
            return False
        pivot[k] = row
        if row != k:
            for j in range(size):
                matrix[k * size + j], matrix[row * size + j] = matrix[row * size + j], matrix[k * size + j]
        for i in range(k + 1, size):
            share = matrix[i * size + k]
            if share != 0.0:
                share /= matrix[k * size + k]
                matrix[i * size + k] = share
                for j in range(k + 1, size):
                    matrix[i * size + j] -= share * matrix[k * size + j]
    return True


def solve_step(matrix: Buffer, pivot: Buffer, right: Buffer, size: int) -> None:
    """Solve with the factorised matrix, in place."""
    for k in range(size):
        row = int(pivot[k])
        if row != k:
            right[k], right[row] = right[row], right[k]
    for i in range(1, size):
        total = right[i]
        for j in range(i):
            total -= matrix[i * size + j] * right[j]
        right[i] = total
    for back in range(size):
        i = size - 1 - back
        total = right[i]
        for j in range(i + 1, size):
            total -= matrix[i * size + j] * right[j]
        right[i] = total / matrix[i * size + i]


def add_springs(room: Room, h: float, size: int) -> None:
    """Add to the matrix of the stages what follows from z by way of v."""
    matrix, slopes, a, less = room.matrix, room.jacobian, room.stages, size - 1
    whole = STAGES * less
    for k in range(less):
        for i in range(STAGES):
            for j in range(STAGES):
                share = -h * h * a[i * STAGES + j] * slopes[(j * WIDTH + k + 1) * WIDTH]
                if share != 0.0:
                    for m in range(STAGES):
                        matrix[(i * less + k) * whole + m * less] += share * a[j * STAGES + m]


def fill_matrix(room: Room, h: float, size: int) -> None:
    """Write 1 - h A x J of the stages, J the slopes of their rates, with z' = v put in: one component less."""
    matrix, slopes, a, less = room.matrix, room.jacobian, room.stages, size - 1
    whole = STAGES * less
    for i in range(STAGES):
        for j in range(STAGES):
            share = -h * a[i * STAGES + j]
            for k in range(less):
                row, first = (i * less + k) * whole + j * less, (j * WIDTH + k + 1) * WIDTH + 1
                for m in range(less):
                    matrix[row + m] = share * slopes[first + m]
    add_springs(room, h, size)
    for i in range(whole):
        matrix[i * whole + i] += 1.0


def solve_stages(room: Room, h: float, size: int) -> None:
    """Solve the linear equations of all stages in place of their right-hand side, z by what v makes of it."""
    right, reduced, slopes, a, less = room.right, room.reduced, room.jacobian, room.stages, size - 1
    for i in range(STAGES):
        for k in range(less):
            total = 0.0
            for j in range(STAGES):
                total += a[i * STAGES + j] * slopes[(j * WIDTH + k + 1) * WIDTH] * right[j * size]
            reduced[i * less + k] = right[i * size + k + 1] + h * total
    solve_step(room.matrix, room.pivot, reduced, STAGES * less)
    for i in range(STAGES):
        total = 0.0
        for j in range(STAGES):
            total += a[i * STAGES + j] * reduced[j * less]
        right[i * size] += h * total
        for k in range(less):
            right[i * size + k + 1] = reduced[i * less + k]


def fill_right(room: Room, h: float, size: int) -> None:
    """Write by how much the stages miss their equations."""
    trial, rate, right, a = room.trial, room.rate, room.right, room.stages
    for i in range(STAGES):
        for k in range(size):
            total = 0.0
            for j in range(STAGES):
                total += a[i * STAGES + j] * rate[j * WIDTH + k]
            right[i * size + k] = (trial[k] - trial[(i + 1) * WIDTH + k]) + h * total


def improve(rig: Rig, room: Room, side: float, h: float, size: int, fresh: bool) -> float:  # noqa: FBT001 - numba
    """One correction of the stages by Newton's method; its size over the scale, or FAILED if there is none."""
    trial, right, worst = room.trial, room.right, 0.0
    for j in range(STAGES):
        rates(rig, room, side, room.pull[j], trial, (j + 1) * WIDTH, j)
    if fresh:
        fill_matrix(room, h, size)
        if not factorise(room.matrix, room.pivot, STAGES * (size - 1)):
            return FAILED
    fill_right(room, h, size)
    solve_stages(room, h, size)
    for i in range(STAGES):
        for k in range(size):
            change = right[i * size + k]
            trial[(i + 1) * WIDTH + k] += change
            off = abs(change) / (room.scale[k] + abs(trial[k]))
            worst = max(worst, off) if isfinite(off) else FAILED
    return worst


def step(rig: Rig, room: Room, side: float, t: float, h: float) -> bool:
    """Solve one step from `state` at t over h, from the guess in `trial`; False if Newton's method fails."""
    size = rig.size
    room.tally[STEPS] += 1.0
    for k in range(WIDTH):
        room.trial[k] = room.state[k]
    for j in range(STAGES):
        room.pull[j] = drive(room, t + room.nodes[j + 1] * h)[0]
    before, fresh = FAILED, True
    for _ in range(MOST):
        now = improve(rig, room, side, h, size, fresh)
        if now >= FAILED:
            return False
        ratio = now / before if before < FAILED else GUESS
        if now <= ROUNDING or (ratio < 1.0 and now * ratio <= ROUNDING) or (ratio > 0.3 and now <= LOST):
            return True
        if ratio > 2.0:
            return False
        fresh = ratio > 0.05
        before = now
    return False


def error_of(room: Room, size: int) -> float:
    """Size of the trial step's error over the scale."""
    trial, weights, worst = room.trial, room.weights, 0.0
    for k in range(size):
        top, largest = 0.0, 0.0
        for i in range(STAGES + 1):
            top += weights[i] * (trial[i * WIDTH + k] - trial[k])
            largest = max(largest, abs(trial[i * WIDTH + k]))
        worst = max(worst, abs(top) * PEAK / (room.scale[k] + largest))
    return worst


def coarseness(rig: Rig, room: Room) -> float:
    """Whether nodes lie too far apart in speed to see what a law does at low speed: above 1 they do.

    A Stribeck curve that falls within nu may stand between two nodes unseen, and the polynomial looks perfect. So near
    v = 0 two nodes are at most nu apart. The power is that of the error, so that the step shrinks in proportion.
    """
    narrow, trial, widest = rig.narrow, room.trial, 0.0
    if narrow <= 0.0:
        return 0.0
    for i in range(STAGES):
        one, other = abs(trial[i * WIDTH + 1]), abs(trial[(i + 1) * WIDTH + 1])
        if min(one, other) < 5.0 * narrow:
            widest = max(widest, abs(trial[i * WIDTH + 1] - trial[(i + 1) * WIDTH + 1]))
    ratio = min(widest / narrow, 10.0)
    return ratio * ratio * ratio * ratio * ratio * ratio * ratio


def carry_slopes(room: Room, h: float, size: int) -> None:
    """Carry the slopes of the state over its start through the step just solved, with the factors of its solution."""
    whole, right, slopes = STAGES * size, room.right, room.slopes
    fill_matrix(room, h, size)
    factorise(room.matrix, room.pivot, STAGES * (size - 1))
    for column in range(size):
        for i in range(STAGES):
            for k in range(size):
                right[i * size + k] = slopes[k * WIDTH + column]
        solve_stages(room, h, size)
        for k in range(size):
            slopes[k * WIDTH + column] = right[whole - size + k]
