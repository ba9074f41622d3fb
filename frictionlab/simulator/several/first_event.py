"""The first event in a linear phase: no zero of an event function is stepped over."""

from collections.abc import Callable
from math import cos, inf, sin, sqrt
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray

Complexes = NDArray[np.complex128]
Function = TypeVar("Function", bound=Callable[..., Any])
WINDOW = 1.5  # over the fastest rate: the third derivative is bounded over so long at a time


def compiled(function: Function) -> Function:
    """Compile a function; its machine code is kept beside it, or in NUMBA_CACHE_DIR."""
    fast: Any = njit(cache=True, error_model="numpy")(function)
    return cast("Function", fast)


@compiled
def modes_at(t: float, rates: Complexes, drive: tuple[Any, ...], out: Complexes) -> None:
    """Write each mode w(t): ``w' = rate w + constant + sum_k line_k e^(i k t)``, w(0) the start.

    ``drive``: start (d,), constant (d,), lines (d, h), their frequencies (h,). A harmonic gives the divided difference
    ``(e^(rate t) - e^(i k t)) / (rate - i k)``, so that resonance is no special case.
    """
    start, constant, lines, turns = drive
    for j in range(len(rates)):
        grown = np.exp(rates[j] * t)
        total = grown * start[j] + constant[j] * quotient(rates[j], 0.0j, t)
        for k in range(len(turns)):
            total += lines[j, k] * quotient(rates[j], 1j * turns[k], t)
        out[j] = total


@compiled
def quotient(a: complex, b: complex, t: float) -> complex:
    """Return (e^(a t) - e^(b t)) / (a - b), also where the two meet."""
    x = 0.5 * (a - b) * t
    middle = complex(np.exp(0.5 * (a + b) * t))
    if abs(x) < 0.03:  # sinh(x) / x
        square = x * x
        series = 1.0 + square / 6.0 * (1.0 + square / 20.0 * (1.0 + square / 42.0 * (1.0 + square / 72.0)))
        return t * middle * series
    return complex((np.exp(a * t) - np.exp(b * t)) / (a - b))


@compiled
def modes_over(times: FloatArray, rates: Complexes, drive: tuple[Any, ...]) -> Complexes:
    """Return the modes (k, d) at times (k,)."""
    w = np.empty((len(times), len(rates)), np.complex128)
    for i in range(len(times)):
        modes_at(times[i], rates, drive, w[i])
    return w


@compiled
def held_over(span: float, rates: Complexes) -> Complexes:
    """Return what a constant push of 1 makes of each mode (d,) in a span."""
    found = np.empty(len(rates), np.complex128)
    for j in range(len(rates)):
        found[j] = quotient(rates[j], 0.0j, span)
    return found


@compiled
def taylor(t: float, rates: Complexes, drive: tuple[Any, ...], row: Complexes, waves: Complexes, w: Complexes) -> Any:
    """Return an event function and its first three derivatives at t, w being the modes there; without its constant."""
    _, constant, lines, turns = drive
    g, slope, bend, twist = 0.0, 0.0, 0.0, 0.0
    for j in range(len(rates)):
        push, change, curve = constant[j], 0.0j, 0.0j
        for k in range(len(turns)):
            wave = lines[j, k] * complex(cos(turns[k] * t), sin(turns[k] * t))
            push += wave
            change += 1j * turns[k] * wave
            curve -= turns[k] * turns[k] * wave
        first = rates[j] * w[j] + push
        g += (row[j] * w[j]).real
        slope += (row[j] * first).real
        second = rates[j] * first + change
        bend += (row[j] * second).real
        twist += (row[j] * (rates[j] * second + curve)).real
    for k in range(len(turns)):
        wave = waves[k] * complex(cos(turns[k] * t), sin(turns[k] * t))
        g += wave.real
        slope -= turns[k] * wave.imag
        bend -= turns[k] * turns[k] * wave.real
        twist += turns[k] ** 3 * wave.imag
    return g, slope, bend, twist


@compiled
def third(
    span: float, rates: Complexes, drive: tuple[Any, ...], row: Complexes, waves: Complexes, w: Complexes
) -> float:
    """Bound the third derivative of an event function over a span that begins with modes w."""
    _, constant, lines, turns = drive
    bound = 0.0
    for j in range(len(rates)):
        rate, push = abs(rates[j]), abs(constant[j])
        change, bend = 0.0, 0.0
        for k in range(len(turns)):
            size, turn = abs(lines[j, k]), abs(turns[k])
            push += size
            change += turn * size
            bend += turn * turn * size
        largest = (abs(w[j]) + span * push) * np.exp(max(0.0, rates[j].real) * span)
        bound += abs(row[j]) * (rate * (rate * (rate * largest + push) + change) + bend)
    for k in range(len(turns)):
        bound += abs(turns[k]) ** 3 * abs(waves[k])
    return bound


@compiled
def safe_step(value: float, slope: float, bend: float, bound: float, reach: float) -> float:
    """Return h up to which ``value + slope h + bend h^2 / 2 - bound h^3 / 6`` stays positive, at most reach.

    Within H the cubic is no less than the parabola that has the third part of bound H against its bend.
    """
    if value <= 0.0 and slope <= 0.0:
        return min(reach, 2.9 * bend / bound) if bend > 0.0 else 0.0
    within, step = reach, 0.0
    for _ in range(6):
        curve = bound * within / 3.0 - bend
        inside = slope * slope + 2.0 * curve * value
        least = within
        if inside >= 0.0 and not (curve <= 0.0 <= slope):
            root = sqrt(inside)
            if slope > 0.0:
                least = (slope + root) / curve if curve > 0.0 else within
            else:
                least = 2.0 * value / (root - slope) if root > slope else within
        step = max(step, min(within, least))
        if 2.0 * step >= within:
            break
        within = sqrt(within * step)
    return step


@compiled
def step_before(
    taylor: tuple[float, float, float, float], lead: int, bound: float, fastest: float, reach: float
) -> float:
    """Return a step in which an event function stays positive; none: it is zero now.

    `taylor`: value, slope, and the next two derivatives, of which the first `lead` are zero, for it has just begun.
    """
    g, slope, bend, twist = taylor
    if lead == 0:
        return safe_step(g, slope, bend, bound, reach) if g > 0.0 else 0.0
    if lead == 1:
        return safe_step(0.0, slope, bend, bound, reach)
    if abs(bend) * fastest < 1e-9 * bound:
        return min(reach, max(0.0, 2.0 * twist / (bound * fastest)))
    return safe_step(0.0, 0.0, bend, bound, reach)


@compiled
def first_event(
    rates: Complexes,
    drive: tuple[Any, ...],
    rows: Complexes,
    waves: Complexes,
    offsets: FloatArray,
    lead: NDArray[np.int64],
    span: float,
) -> tuple[float, int]:
    """Return the time of the first zero of the event functions within a span, and whose it is; none: span and -1.

    Each is ``Re(row w(t)) + Re(waves e^(i k t)) + offset``, positive until its event. It stays positive over a step h
    while ``g + g' h + g'' h^2 / 2 - M h^3 / 6 > 0``, M a bound of its third derivative: a march by such steps
    converges to the zero, and never passes it.

    Parameters
    ----------
    rates : ndarray of shape (d,)
    drive : tuple
        As `modes_at` has it.
    rows : ndarray of shape (e, d)
    waves : ndarray of shape (e, h)
    offsets : ndarray of shape (e,)
    lead : ndarray of shape (e,)
        Of each function how many of value and slope are zero at 0, for it has just begun.
    span : float
    """
    w, bounds = np.empty(len(rates), np.complex128), np.empty(len(rows))
    fastest = 1e-3
    for rate in rates:
        fastest = max(fastest, abs(rate))
    for turn in drive[3]:
        fastest = max(fastest, abs(turn))
    t, end, begun = 0.0, 0.0, 0
    modes_at(t, rates, drive, w)
    while t < span:
        if t >= end:
            end = min(span, t + WINDOW / fastest)
            for e in range(len(rows)):
                bounds[e] = third(end - t, rates, drive, rows[e], waves[e], w)
        least, which = inf, -1
        for e in range(len(rows)):
            g, slope, bend, twist = taylor(t, rates, drive, rows[e], waves[e], w)
            fresh = 0 if begun else lead[e]
            step = step_before((g + offsets[e], slope, bend, twist), fresh, bounds[e], fastest, end - t)
            if step < least:
                least, which = step, e
        if which < 0:
            return span, -1
        if least < end - t and least <= 2e-15 * (1.0 + t):
            return t, which
        begun, t = 1, end if least >= end - t else t + least
        modes_at(t, rates, drive, w)
    return span, -1
