"""Make orbits.json: steady states of extreme oscillators to 50 digits, apart from the package: slow and obvious.

``r^2 x'' + 2 zeta r x' + x = cos(tau) - beta n(tau)`` (thesis eq. 2.9, with a dashpot). Between events the textbook
solution is evaluated with so many digits that what it loses near resonance does not matter; the end of a slide is found
by sampling finely and bisecting; the steady state by Newton's method with a difference quotient for a derivative.

Ten minutes of computing: ``python tests/extremes/reference/make_orbits.py``.
"""

import json
import math
import multiprocessing
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mpmath

HERE = Path(__file__).parent
SMALL_R = (1e-3, 0.01, 0.1, 0.3)
LARGE_R = (3.0, 10.0, 100.0, 1000.0)
Number = Any  # mpmath.mpf, or float with mpmath.fp
State = tuple[Number, Number]
SAMPLES = 24  # per radian of the faster of drive and free vibration


@dataclass(frozen=True)
class Case:
    """One oscillator; the numbers are doubles and are taken as exact."""

    r: float
    beta: float
    mu: float = 1.0
    zeta: float = 0.0


@dataclass(frozen=True)
class Phase:
    """One slide (side +1 or -1) or stick (0): when it begins, how long it lasts, where, and its motion."""

    side: int
    tau: Number
    span: Number
    x: Number
    motion: Callable[[Number], Any] | None


def slide(ctx: Any, case: Case, tau: Number, x: Number, v: Number, side: int) -> Callable[[Number], Any]:
    """Return the motion (x, v, a) as a function of the time since tau, sliding towards `side`."""
    r, beta, zeta = ctx.mpf(case.r), ctx.mpf(case.beta), ctx.mpf(case.zeta)
    if r == 1 and zeta == 0:
        return _resonant(ctx, beta, tau, x, v, side)
    below, damp = 1 - r * r, 2 * zeta * r
    size = below * below + damp * damp
    c, s = below / size, damp / size  # particular motion c cos + s sin
    x1 = x + beta * side - c * ctx.cos(tau) - s * ctx.sin(tau)
    v1 = v + c * ctx.sin(tau) - s * ctx.cos(tau)
    free = _free(ctx, r, zeta, x1, v1)

    def motion(t: Number) -> tuple[Number, Number, Number]:
        cos, sin = ctx.cos(tau + t), ctx.sin(tau + t)
        z, w, b = free(t)
        forced = c * cos + s * sin
        return z + forced - beta * side, w - c * sin + s * cos, b - forced

    return motion


def _free(ctx: Any, r: Number, zeta: Number, x: Number, v: Number) -> Callable[[Number], Any]:
    """Free vibration r^2 x'' + 2 zeta r x' + x = 0 from (x, v)."""
    if zeta < 1:
        w, d = ctx.sqrt(1 - zeta * zeta) / r, zeta / r
        p, q = x, (v + d * x) / w

        def under(t: Number) -> tuple[Number, Number, Number]:
            e, cos, sin = ctx.exp(-d * t), ctx.cos(w * t), ctx.sin(w * t)
            z = e * (p * cos + q * sin)
            dz = e * (w * (q * cos - p * sin)) - d * z
            return z, dz, -2 * d * dz - z / (r * r)

        return under
    if zeta == 1:

        def critical(t: Number) -> tuple[Number, Number, Number]:
            e, q = ctx.exp(-t / r), v + x / r
            z, dz = e * (x + q * t), e * (q - (x + q * t) / r)
            return z, dz, -2 * dz / r - z / (r * r)

        return critical
    root = ctx.sqrt(zeta * zeta - 1)
    fast, slow = -(zeta + root) / r, -(zeta - root) / r
    p = (v - slow * x) / (fast - slow)
    q = x - p

    def over(t: Number) -> tuple[Number, Number, Number]:
        e, f = p * ctx.exp(fast * t), q * ctx.exp(slow * t)
        return e + f, fast * e + slow * f, fast * fast * e + slow * slow * f

    return over


def _resonant(ctx: Any, beta: Number, tau: Number, x: Number, v: Number, side: int) -> Callable[[Number], Any]:
    """r = 1, zeta = 0: the particular motion is t sin(tau + t) / 2."""
    p, q = x + beta * side, v - ctx.sin(tau) / 2

    def motion(t: Number) -> tuple[Number, Number, Number]:
        cos, sin = ctx.cos(t), ctx.sin(t)
        fc, fs = ctx.cos(tau + t), ctx.sin(tau + t)
        return (
            p * cos + q * sin + t * fs / 2 - beta * side,
            q * cos - p * sin + fs / 2 + t * fc / 2,
            -q * sin - p * cos + fc - t * fs / 2,
        )

    return motion


def bisect(ctx: Any, f: Callable[[Number], Number], low: Number, high: Number) -> Number:
    """Find the sign change of f between low and high to all digits: secants, steps past them, and bisection in turn."""
    f_low, f_high = f(low), f(high)
    for i in range(16 * ctx.prec):
        if high - low <= 4 * ctx.eps * abs(high):
            break
        middle = (low + high) / 2
        if i % 3 < 2 and f_high != f_low:
            secant = high - f_high * (high - low) / (f_high - f_low)
            nearest = low if secant - low < high - secant else high
            aim = secant if i % 3 == 0 else secant + (secant - nearest) + 4 * ctx.eps * (high + low - 2 * nearest)
            middle = aim if low < aim < high else middle
        if not low < middle < high:
            break
        f_middle = f(middle)
        if f_middle == 0:
            return middle
        if (f_middle > 0) == (f_low > 0):
            low, f_low = middle, f_middle
        else:
            high, f_high = middle, f_middle
    return (low + high) / 2


def slide_end(ctx: Any, case: Case, motion: Callable[[Number], Any], side: int, rest: Number, *, moves: bool) -> Number:
    """Find the first time at which the velocity turns against `side`, or `rest`."""
    widest = ctx.mpf(min(case.r, 1.0)) / SAMPLES
    step, t = widest * ctx.mpf(10) ** -10, ctx.zero

    def speed(at: Number) -> Number:
        return side * motion(at)[1]

    def gain(at: Number) -> Number:
        return side * motion(at)[2]

    before = gain(t) if moves else ctx.zero  # at rest it is zero or towards the side but for rounding
    while t < rest:
        ahead = min(t + step, rest)
        if speed(ahead) <= 0:
            if t == 0 and not moves:
                raise ArithmeticError(f"{case}: a slide that ends before {mpmath.nstr(ahead, 5)} rad")
            return bisect(ctx, speed, t, ahead)
        after = gain(ahead)
        if before < 0 < after:
            lowest = bisect(ctx, gain, t, ahead)
            if speed(lowest) <= 0:
                return bisect(ctx, speed, t, lowest)
        t, before = ahead, after
        step = min(widest, step * 1.6)
    return rest


def release(ctx: Any, case: Case, tau: Number, x: Number, end: Number) -> tuple[Number, int]:
    """Find when and to which side a mass held at x breaks loose, |cos(tau) - x| = mu beta; (end, 0) if not before."""
    hold = ctx.mpf(case.mu) * ctx.mpf(case.beta)
    best, way = end, 0
    turn = 2 * ctx.pi
    for side in (1, -1):
        level = x + side * hold
        if abs(level) >= 1:
            continue
        at = ctx.acos(level)
        at = -at if side > 0 else at  # rising through it, or falling
        at += turn * ctx.ceil((tau - at) / turn - ctx.mpf(10) ** (-ctx.dps // 2))
        if at < best:
            best, way = max(at, tau), side
    return best, way


def carry(ctx: Any, case: Case, tau: Number, end: Number, state: State) -> tuple[State, list[Phase]]:
    """Carry a state from tau to end, event by event."""
    x, v = state
    hold = ctx.mpf(case.mu) * ctx.mpf(case.beta)
    touch = ctx.mpf(10) ** (-ctx.dps // 2)
    phases: list[Phase] = []
    while tau < end:
        if v != 0:
            side = 1 if v > 0 else -1
        else:
            pull = ctx.cos(tau) - x
            side = 0 if abs(pull) <= hold else (1 if pull > 0 else -1)
        if side == 0:
            until, side = release(ctx, case, tau, x, end)
            if until - tau > touch:
                phases.append(Phase(0, tau, until - tau, x, None))
            tau = until
            if side == 0:
                break
        motion = slide(ctx, case, tau, x, v, side)
        span = slide_end(ctx, case, motion, side, end - tau, moves=v != 0)
        phases.append(Phase(side, tau, span, x, motion))
        over = span < end - tau
        x, v, _ = motion(span)
        v = ctx.zero if over else v
        tau = tau + span if over else end
    return (x, v), phases


def image(ctx: Any, case: Case, state: State, *, half: bool) -> State:
    """Image of a state at tau = 0 after half a period, mirrored; or after a whole one."""
    (x, v), _ = carry(ctx, case, ctx.zero, ctx.pi if half else 2 * ctx.pi, state)
    return (-x, -v) if half else (x, v)


def lost_digits(case: Case) -> int:
    """Digits that the textbook solution loses near resonance."""
    return 0 if case.r == 1.0 else math.ceil(-2 * math.log10(min(1.0, abs(case.r - 1))))


def settle(case: Case, *, half: bool, turns: int = 16, digits: int = 34) -> State:
    """Come near the orbit from rest; for mu = 1 by averaging a state with its mirrored image."""
    with mpmath.workdps(digits + lost_digits(case)):
        ctx = mpmath.mp
        state: State = (ctx.zero, ctx.zero)
        for _ in range(turns):
            x, v = image(ctx, case, state, half=half)
            state = ((x + state[0]) / 2, (v + state[1]) / 2) if half and v != 0 else (x, v)
        return state


def fixed_point(ctx: Any, case: Case, start: State, *, half: bool) -> State:
    """Newton's method on image(state) - state; the derivative is a difference quotient."""
    state: State = (ctx.mpf(start[0]), ctx.mpf(start[1]))
    delta = ctx.mpf(10) ** (-ctx.dps // 2)
    for _ in range(40):
        at = image(ctx, case, state, half=half)
        miss = (at[0] - state[0], at[1] - state[1])
        size = abs(state[0]) + abs(state[1])
        if max(abs(miss[0]), abs(miss[1])) <= size * ctx.mpf(10) ** (12 - ctx.dps):
            return at
        rows = []
        for dx, dv in ((delta, 0), (0, delta)):
            near = image(ctx, case, (state[0] + dx, state[1] + dv), half=half)
            rows.append(((near[0] - at[0]) / delta, (near[1] - at[1]) / delta))
        a, c, b, d = rows[0][0] - 1, rows[0][1], rows[1][0], rows[1][1] - 1
        det = a * d - b * c
        state = (state[0] - (d * miss[0] - b * miss[1]) / det, state[1] - (a * miss[1] - c * miss[0]) / det)
        if all(row[1] == 0 for row in rows) and at[1] == 0:
            state = (state[0], ctx.zero)  # the image stands still whatever the start
    raise ArithmeticError(f"{case}: Newton's method did not converge: miss {miss}")


def energy(ctx: Any, case: Case, phases: list[Phase]) -> Number:
    """Energy dissipated: friction force times path (2.18), and the dashpot's 2 zeta r times the integral of v^2."""
    total = ctx.zero
    for phase in phases:
        if phase.motion is None:
            continue
        total += ctx.mpf(case.beta) * abs(phase.motion(phase.span)[0] - phase.x)
        if case.zeta:
            pieces = int(phase.span / ctx.mpf(min(case.r, 1.0))) + 1
            edges = [phase.span * i / pieces for i in range(pieces + 1)]
            motion = phase.motion
            total += 2 * ctx.mpf(case.zeta) * ctx.mpf(case.r) * ctx.quad(lambda t, m=motion: m(t)[1] ** 2, edges)
    return total


def stops(phases: list[Phase]) -> int:
    """Sticks in one period; one that goes on across its ends counts once."""
    held = [phase.side == 0 for phase in phases]
    return sum(now and not before for now, before in zip(held, held[-1:] + held[:-1], strict=True))


def steady(case: Case, *, digits: int = 50, guard: int = 20, guess: State | None = None) -> dict[str, Any]:
    """Return the steady state's numbers: text of so many digits; without a guess it is settled from rest."""
    half = case.mu == 1
    near = guess or settle(case, half=half)
    with mpmath.workdps(digits + guard + lost_digits(case)):
        ctx = mpmath.mp
        state = fixed_point(ctx, case, near, half=half)
        _, phases = carry(ctx, case, ctx.zero, 2 * ctx.pi, state)
        places = [phase.x for phase in phases]
        stuck = sum((phase.span for phase in phases if phase.side == 0), ctx.zero)
        return {
            "r": case.r.hex(),
            "beta": case.beta.hex(),
            "mu": case.mu.hex(),
            "zeta": case.zeta.hex(),
            "energy_per_cycle": mpmath.nstr(energy(ctx, case, phases), digits),
            "response_amplitude": mpmath.nstr((max(places) - min(places)) / 2, digits),
            "stuck_fraction": mpmath.nstr(stuck / (2 * ctx.pi), digits),
            "stops_per_cycle": stops(phases),
        }


def near(value: float) -> tuple[float, ...]:
    """A double, its neighbours at one unit in the last place, and at 1e-9."""
    return (
        value,
        math.nextafter(value, 0.0),
        math.nextafter(value, math.inf),
        value * (1 - 1e-9),
        value * (1 + 1e-9),
    )


def continuous_limit(r: float) -> mpmath.mpf:
    """Largest beta without stops: |cos(phi) - X| = beta at the turn, in Den Hartog's motion (2.11)-(2.14)."""
    with mpmath.workdps(70):
        ratio = mpmath.mpf(r)
        v = 1 / (1 - ratio * ratio)
        u = mpmath.tan(mpmath.pi / (2 * ratio)) / ratio
        reach = abs(v) - mpmath.sign(v)
        return reach / mpmath.sqrt(1 + (reach * u / v) ** 2)


def den_hartog(case: Case) -> State | None:
    """Start of the continuous motion at tau = 0, if there is one: the guess near resonance."""
    if case.zeta or case.mu > 1 or case.r == 1.0 or case.beta > continuous_limit(case.r):
        return None
    with mpmath.workdps(70):
        r, beta = mpmath.mpf(case.r), mpmath.mpf(case.beta)
        v = 1 / (1 - r * r)
        u = mpmath.tan(mpmath.pi / (2 * r)) / r
        ratio = beta * u / v
        share = mpmath.sqrt(1 - ratio * ratio)
        top, phi = share * abs(v), mpmath.atan2(-ratio, share * mpmath.sign(v))
        # from the upper turn at tau = phi, sliding down: the textbook solution back to tau = 0 modulo half a turn
        half = mpmath.pi * mpmath.ceil(phi / mpmath.pi) - phi
        c = v
        x1, v1 = top - beta - c * mpmath.cos(phi), c * mpmath.sin(phi)
        at = phi + half
        x = x1 * mpmath.cos(half / r) + r * v1 * mpmath.sin(half / r) + c * mpmath.cos(at) + beta
        w = v1 * mpmath.cos(half / r) - x1 / r * mpmath.sin(half / r) - c * mpmath.sin(at)
        sign = -1 if round(float(at / mpmath.pi)) % 2 else 1
        return sign * x, sign * w


def cases() -> list[Case]:
    """All the oscillators of orbits.json."""
    wide = [Case(r, beta) for r in (*SMALL_R, *LARGE_R) for beta in (0.1, 0.4, 0.9) if r > 0.02 or beta == 0.4]
    close = [Case(1 + sign * 10.0**-k, 0.4) for k in range(1, 16) for sign in (1, -1)]
    braked = [Case(1 + sign * 10.0**-k, 0.9) for k in (1, 3, 6, 9, 12) for sign in (1, -1)]
    resonant = [Case(1.0, beta) for beta in (0.7860, 0.8, 0.9, 0.99)]
    fractions = [Case(r, beta) for n in range(2, 6) for r in near(1 / n) for beta in (0.05, 0.4)]
    betas = [Case(r, beta) for r in (0.3, 0.7, 1.5) for beta in (1e-12, 1e-6, 1 - 1e-6)]
    betas += [Case(r, 1 - 1e-12) for r in (0.3, 1.5)]
    limits = [
        Case(r, float(continuous_limit(r)) * (1 + side * 1e-9)) for r in (0.6, 0.8, 0.9, 1.2, 2.0) for side in (-1, 1)
    ]
    static = [Case(*numbers) for numbers in ((0.7, 0.2, 4.0), (0.45, 0.1, 2.0), (0.3, 0.05, 10.0), (2.2, 0.08, 10.0))]
    damped = [Case(r, beta, 1.0, zeta) for r in (0.3, 1.0, 3.0) for beta in (0.4, 0.9) for zeta in (1e-9, 1.0, 10.0)]
    damped += [Case(1.0, 0.4, 1.0, 1e-3), Case(0.5, 0.1, 3.0, 0.02)]
    damped = [case for case in damped if not (case.r == 1.0 and case.zeta == 1e-9 and case.beta == 0.4)]
    trade = [Case(0.7, 0.5), Case(0.95, 0.1)]  # with (0.5, 0.4): the references of frictionlab.tradeoff
    return [*wide, *close, *braked, *resonant, *fractions, *betas, *limits, *static, *damped, *trade]


def solve(case: Case) -> dict[str, Any] | str:
    """The steady state, or why there is none: a case that fails is told, not left out in silence."""
    try:
        guess = den_hartog(case)
        turns = 40 if case.mu > 1 else 16
        return steady(case, guess=guess or settle(case, half=case.mu == 1, turns=turns))
    except ArithmeticError as error:
        return str(error)[:200]


def main() -> None:
    """Solve all cases on all processors, the quick ones first; those that fail are named on stderr."""
    todo = cases()
    order = sorted(range(len(todo)), key=lambda i: -min(todo[i].r, 1.0))
    rows: dict[int, dict[str, Any]] = {}
    with multiprocessing.Pool() as pool:
        for i, found in zip(order, pool.imap(solve, [todo[i] for i in order]), strict=True):
            if isinstance(found, str):
                sys.stderr.write(f"{found}\n")
                continue
            rows[i] = found
            lines = ",\n".join(json.dumps(rows[j]) for j in sorted(rows))
            (HERE / "orbits.json").write_text(f"[\n{lines}\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
