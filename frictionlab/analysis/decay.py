"""Free decay of a mass on a spring with viscous and Coulomb damping: the exact motion, and its fit to samples.

    x'' + 2 zeta omega x' + omega^2 (x - rest) = -omega^2 f sgn(x'),        f = F / k

Between two turning points the friction is constant and the motion a damped cosine about ``rest -+ f`` that lasts
``pi / (omega sqrt(1 - zeta^2))``. The distances a_j of the turning points from rest follow
``a_(j+1) = q a_j - f (1 + q)`` with ``q = exp(-pi zeta / sqrt(1 - zeta^2))`` [Feeny and Liang 1996, "A decrement method
for the simultaneous estimation of Coulomb and viscous friction"], and the mass stays where ``a_j <= f``.

A spring that hardens or softens, ``x + cubic x^3`` for x, and a pendulum, ``sin x``, have no closed form: amplitude a
and time are integrated over the phase theta of ``x = c + a cos(theta)``, ``x' = -omega a sin(theta)`` about the centre
``c = -+f``. Turning points are then whole multiples of pi, friction never jumps within a step, and 16 steps of
Runge and Kutta's method a half-cycle leave 1e-6 of the swing.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import least_squares

from frictionlab.analysis.signals import student, variance_inflation
from frictionlab.arrays import FloatArray

ONE_SIDED = 1.645  # 95 % of a normal distribution lie below its mean and so many standard deviations

_NAMES = ("start", "swing", "rest", "omega", "zeta", "friction", "cubic")
ALONE = np.ones(1)  # the shape of a single mass
_STEPS = 16  # of a half-cycle


@dataclass(frozen=True)
class Decay:
    """One free decay from a turning point on.

    ``start``: when the mass turns [s]; ``swing``: how far from rest it turns [m], negative below; ``rest`` [m];
    ``omega``: undamped natural frequency [rad/s]; ``zeta``: viscous damping ratio; ``friction``: F/k [m];
    ``cubic``: of the spring's force over k, x + cubic x^3 [1/m^2]; ``pendulum``: the force is sin(x), x in rad;
    ``order``: what is seen is the displacement (0), the velocity over ``line`` [rad/s] (1) or the acceleration over
    minus its square (2), and ``rest`` then the sensor's offset.
    """

    start: float
    swing: float
    rest: float
    omega: float
    zeta: float
    friction: float
    cubic: float = 0.0
    pendulum: bool = False
    order: int = 0
    line: float = 1.0

    @property
    def half_period(self) -> float:
        """From one turning point to the next [s]."""
        return math.pi / (self.omega * math.sqrt(1.0 - self.zeta**2))

    def turning(self, number: NDArray[np.int64]) -> FloatArray:
        """Distance from rest [m] at turning points by their numbers (0: the first), as if friction never held it."""
        log_q = -math.pi * self.zeta / math.sqrt(1.0 - self.zeta**2)
        lost = np.expm1(number * log_q) / math.expm1(log_q) if log_q else number.astype(np.float64)
        return np.asarray(abs(self.swing) * np.exp(number * log_q) - self.friction * (1.0 + math.exp(log_q)) * lost)

    def at(self, time: FloatArray) -> FloatArray:
        """What is seen [m] at these times [s]; before ``start`` the motion that would have led there.

        Examples
        --------
        >>> decay = Decay(0.0, 5.0, 1.0, math.pi, 0.0, 0.1)
        >>> decay.at(np.array([0.0, 1.0, 2.0])).round(9).tolist()
        [6.0, -3.8, 5.6]
        """
        if self.cubic or self.pendulum:
            return self._integrated(time)
        number = np.floor((time - self.start) / self.half_period).astype(np.int64)
        reached = np.arange(max(int(number.max(initial=0)) + 1, 1))
        stopped = np.flatnonzero(self.turning(reached) <= max(self.friction, 0.0))
        last = int(stopped[0]) if len(stopped) else len(reached)
        number = np.minimum(number, last)
        moves, side = number < last, math.copysign(1.0, self.swing) * np.where(number % 2, -1.0, 1.0)
        since = np.where(moves, time - self.start - number * self.half_period, 0.0)
        root = math.sqrt(1.0 - self.zeta**2)
        rate = self.omega * (1j * root - self.zeta)  # of a damped cosine as the real part of an exponential
        about = side * (self.turning(number) - self.friction) * (1.0 - 1j * self.zeta / root) * np.exp(rate * since)
        if self.order:
            about = (1.0, -1.0)[self.order - 1] * about * (rate / self.line) ** self.order * moves
            return np.asarray(self.rest + about.real)
        return np.asarray(self.rest + side * self.friction + about.real)

    def _force(self, x: float) -> float:
        """Restoring force over k at a distance from rest."""
        return math.sin(x) if self.pendulum else x + self.cubic * x * x * x

    def _integrated(self, time: FloatArray) -> FloatArray:
        """As `at`, of a spring that is not linear: between nodes of the integration a cubic by places and speeds."""
        u, until, step = self.swing, float(time[-1]), math.pi / _STEPS
        nodes = [(self.start, u, 0.0)]
        for _ in range(20_000):  # half-cycles
            t, side = nodes[-1][0], math.copysign(1.0, u)
            a = abs(u) - self.friction
            if t > until or abs(self._force(u)) <= self.friction or a <= 0.0:
                break
            for k in range(_STEPS):
                theta = k * step
                a1, t1 = self._rates(theta, a, side)
                a2, t2 = self._rates(theta + 0.5 * step, a + 0.5 * step * a1, side)
                a3, t3 = self._rates(theta + 0.5 * step, a + 0.5 * step * a2, side)
                a4, t4 = self._rates(theta + step, a + step * a3, side)
                a += step * (a1 + 2.0 * (a2 + a3) + a4) / 6.0
                t += step * (t1 + 2.0 * (t2 + t3) + t4) / 6.0
                theta += step
                place = side * (self.friction + a * math.cos(theta))
                nodes.append((t, place, -side * self.omega * a * math.sin(theta)))
            u = side * (self.friction - a)
            nodes[-1] = (t, u, 0.0)
        nodes.append((max(until, nodes[-1][0]) + self.half_period, u, 0.0))
        at, place, speed = np.array(nodes).T
        early = 2.0 * self.start - time  # before the release a linear spring's motion, mirrored in time
        motion, when = CubicHermiteSpline(at, place, speed), np.maximum(time, early)
        way, rate = motion(when), motion(when, 1)
        if self.order < 2:
            return np.asarray(self.rest + (rate / self.line if self.order else way))
        pull = np.sin(way) if self.pendulum else way + self.cubic * way**3
        pull = pull + self.friction * np.sign(rate) + 2.0 * self.zeta / self.omega * rate
        return np.asarray(self.rest + (self.omega / self.line) ** 2 * np.where(rate == 0.0, 0.0, pull))

    def _rates(self, theta: float, a: float, side: float) -> tuple[float, float]:
        """Derivatives of amplitude and time by the phase."""
        cosine, sine = math.cos(theta), math.sin(theta)
        x = side * (self.friction + a * cosine)
        beyond = side * (self._force(x) - x)
        pace = self.omega * (1.0 + beyond * cosine / max(a, 1e-300) - 2.0 * self.zeta * sine * cosine)
        pace = max(pace, 0.05 * self.omega)
        return self.omega * (beyond * sine - 2.0 * self.zeta * a * sine * sine) / pace, 1.0 / pace


@dataclass(frozen=True)
class DecayFit:
    """A decay fitted to samples.

    ``se``: standard errors, as a `Decay` of them, 0 for what is at zero; ``at_zero``: names of what would have come out
    negative and is held at 0; ``limits``: for those the one-sided 95 % limit, from the fit without bounds;
    ``residual``: (n,) m, measured minus fitted; ``doubt``: how many standard errors below 0 the worst of them was.
    """

    decay: Decay
    se: Decay
    at_zero: tuple[str, ...]
    limits: dict[str, float]
    residual: FloatArray
    doubt: float

    @property
    def misfit(self) -> float:
        """Rms of what the fit leaves over the first swing."""
        return float(np.sqrt(np.mean(self.residual**2))) / abs(self.decay.swing)


def first_guess(
    time: FloatArray, height: FloatArray, *, pendulum: bool = False, order: int = 0, line: float = 1.0
) -> Decay:
    """Starting values from turning points (n,) [s], [m] or rad, n >= 4: each swing against the one before it."""
    swing = 0.5 * np.abs(np.diff(height))  # of which each is q times the one before, less friction (1 + q)
    (q, lost), *_ = np.linalg.lstsq(np.column_stack([swing[:-1], np.ones(len(swing) - 1)]), swing[1:], rcond=None)
    if lost > 0.0:
        q, lost = float(swing[1:] @ swing[:-1] / (swing[:-1] @ swing[:-1])), 0.0
    q = min(max(float(q), 0.1), 1.0)
    zeta, friction = -math.log(q) / math.hypot(math.pi, math.log(q)), -float(lost) / (1.0 + q)
    first = 2.0 * float(swing[0]) / (1.0 + q) + friction
    half_period = float(time[-1] - time[0]) / (len(time) - 1)  # of all: 1 % off is half a cycle after fifty
    slower = float(np.mean(swing**2)) / 16.0 if pendulum else 0.0  # by its swing, the first term of the series
    omega = math.pi / half_period / math.sqrt(1.0 - zeta**2) * (1.0 + slower)
    side = 1.0 if height[0] > height[1] else -1.0
    rest = float(height[0] - side * first) if order != 1 else 0.0
    return Decay(float(time[0]), side * first, rest, omega, zeta, friction, 0.0, pendulum, order, line)


def fit_decay(time: FloatArray, displacement: FloatArray, guess: Decay) -> DecayFit:
    """Least squares of the exact motion to samples (n,) [s], [m] from the first turning point to the last one wanted.

    A cubic spring is tried always, for friction takes its place in the envelope of a fit without it, and kept where it
    is significant. What comes out negative of damping and friction is held at 0 and the rest fitted again.
    """
    free, free_error, residual = _solve(time, displacement, guess, ("cubic",))
    if not guess.pendulum:
        bent = _solve(time, displacement, replace(free, cubic=1e-4 / free.swing**2), ())
        if abs(bent[0].cubic) > 4.0 * bent[1].cubic:  # standard errors
            free, free_error, residual = bent
    fitted, error = free, free_error
    straight = () if free.cubic else ("cubic",)
    negative = tuple(name for name in ("zeta", "friction") if getattr(free, name) < 0.0)
    at_zero: tuple[str, ...] = ()
    for at_zero in (*((name,) for name in negative), ("zeta", "friction")) if negative else ():
        nothing: dict[str, Any] = dict.fromkeys(at_zero, 0.0)
        fitted, error, residual = _solve(time, displacement, replace(free, **nothing), (*at_zero, *straight))
        if fitted.zeta >= 0.0 and fitted.friction >= 0.0:
            break
    limits = {name: max(getattr(free, name), 0.0) + ONE_SIDED * getattr(free_error, name) for name in at_zero}
    doubt = max((-getattr(free, name) / getattr(free_error, name) for name in at_zero), default=0.0)
    return DecayFit(fitted, error, at_zero, limits, residual, doubt)


def _solve(
    time: FloatArray, displacement: FloatArray, guess: Decay, fixed: Sequence[str]
) -> tuple[Decay, Decay, FloatArray]:
    """Fit all that is not fixed: the decay, its standard errors, and what it leaves (n,)."""
    names, size = [name for name in _NAMES if name not in fixed], abs(guess.swing)
    units = {"start": 1.0 / guess.omega, "swing": size, "rest": size, "omega": guess.omega, "zeta": 1.0}
    units |= {"friction": size, "cubic": 1.0 / size**2}
    unit, origin = (np.array([of[name] for name in names]) for of in (units, vars(guess)))

    def trial(p: FloatArray) -> Decay:
        values = dict(zip(names, (origin + p * unit).tolist(), strict=True))
        if "zeta" in values:
            values["zeta"] = min(max(values["zeta"], -0.9), 0.9)
        return replace(guess, **values)

    def left(p: FloatArray) -> FloatArray:
        return (displacement - trial(p).at(time)) / size

    found = least_squares(left, np.zeros(len(names)), method="lm")
    fitted = trial(found.x)
    error = decay_errors(-np.asarray(found.jac), found.fun, time, fitted) * unit
    se = Decay(**(dict.fromkeys(_NAMES, 0.0) | dict(zip(names, error.tolist(), strict=True))))
    return fitted, se, found.fun * size


def decay_errors(
    jacobian: FloatArray, residual: FloatArray, time: FloatArray, decay: Decay, shape: FloatArray = ALONE
) -> FloatArray:
    """Standard error of each parameter: the largest by noise, by alike half-cycles, and by friction that wanders.

    What half-cycles add to a parameter resembles that of their neighbours where damping is of another kind, and then
    widens the error as much as it moves the result. ``jacobian`` (n, p), ``residual`` (n,), ``time`` (n,) s, ascending;
    ``shape`` (m,): how far each of m masses, whose samples take turns, moves in the decay.
    """
    # number of each sample's half-cycle; a few samples at either end belong to the half-cycle beside them
    number = np.unique(np.floor((time - decay.start) / decay.half_period), return_inverse=True)[1]
    few = np.bincount(number) < 0.5 * np.median(np.bincount(number))
    number = np.clip(number, int(few[0]), len(few) - 1 - int(few[-1])) - int(few[0])
    inverse, count = np.linalg.inv(jacobian.T @ jacobian), jacobian.shape[1]
    white = np.diag(inverse) * float(residual @ residual) / max(1, len(residual) - count)
    each = np.stack([np.bincount(number, column * residual) for column in jacobian.T], axis=1) @ inverse
    freedom = max(1, len(each) - count)
    grown = np.sum(each**2, axis=0) * variance_inflation(each) * student(float(freedom)) * len(each) / freedom
    angle = math.pi / decay.half_period * (time - decay.start)
    fade = np.exp(-decay.zeta * decay.omega * np.mod(time - decay.start, decay.half_period))
    kept = math.exp(-decay.zeta * decay.omega * decay.half_period)
    masses = np.tile(shape, len(residual) // len(shape))
    along = np.repeat(residual.reshape(-1, len(shape)) @ shape / float(shape @ shape), len(shape)) * masses
    for push in (np.cos(angle), np.sin(angle)):  # what one at a turning point adds: amplitude, phase
        white = white + _wandering(jacobian, along, number, push * fade * masses, kept, len(shape))
    return np.asarray(np.sqrt(np.maximum(white, grown)))


def _wandering(
    jacobian: FloatArray,
    residual: FloatArray,
    half_cycle: NDArray[np.intp],
    shape: FloatArray,
    kept: float,
    masses: int,
) -> FloatArray:
    """Variance of each parameter from what changes at random at each turning point and stays in all later cycles.

    The steps of that walk are the residual's amplitude of each half-cycle minus what is left (``kept``) of the one
    before; what noise alone would give them is taken off.
    """
    count = int(half_cycle[-1]) + 1
    power = np.bincount(half_cycle, shape * shape, count)
    amplitude = np.bincount(half_cycle, shape * residual, count) / power
    inside = residual - amplitude[half_cycle] * shape
    noise = float(inside @ inside) / max(1, len(residual) // masses - count) / power
    step = amplitude[1:] - kept * amplitude[:-1]
    freedom = max(1, len(step) - 3)
    scatter = max(0.0, float(step @ step - np.sum(noise[1:] + kept * kept * noise[:-1])) / freedom)
    felt = np.stack([np.bincount(half_cycle, shape * column, count) for column in jacobian.T])
    for k in range(count - 2, -1, -1):
        felt[:, k] = felt[:, k] + kept * felt[:, k + 1]
    influence = np.linalg.solve(jacobian.T @ jacobian, felt[:, 1:])
    return np.asarray(student(float(freedom)) * scatter * np.sum(influence * influence, axis=1))
