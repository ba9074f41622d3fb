"""What two sensors would show of a simulated cycle: harmonics of x over Y, and how they change with the unknowns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SimulationError
from frictionlab.identification.coordinates import Coordinate, values_of
from frictionlab.identification.family import Family
from frictionlab.identification.observed import harmonics_of, parts
from frictionlab.simulator import Problem, SteadyState, steady_state
from frictionlab.simulator.meter import Meter

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LEAST_POINTS = 128  # of a simulated cycle: what folds back from beyond is below 1e-6 of it
STEP = 1e-4  # of a prior's width or of the value: finite differences of the simulated cycle
BENDS = {2: "parabola", 3: "cubic"}  # powers of its place by which a sensor bends a cycle


@dataclass(frozen=True)
class Forward:
    """Unknowns -> harmonics of the cycle that would be measured.

    ``count``: harmonics; `lines` are complex amplitudes of harmonics 1 to count, over Y. ``meter``: what steady states
    may still cost, where that is bounded: beyond it they raise OverspentError. ``kept`` (count,): how much of each
    harmonic the mass's filter leaves.
    """

    family: Family
    coordinates: tuple[Coordinate, ...]
    count: int
    meter: Meter | None = field(default=None, compare=False)
    kept: FloatArray | float = field(default=1.0, compare=False)

    def state(self, values: Mapping[str, float], near: SteadyState | None = None) -> SteadyState | None:
        """The steady state at some values; None where the simulator has none.

        ``near``: that of values close by, from which an integrated one is found sooner.
        """
        try:
            problem = self.problem(values)
            if near is not None:
                return _integrated(problem, near, self.meter)
            if self.is_integrated:
                return _remembered(problem, self.meter)
            return _elastic(problem, self.meter) if self.family.law.kind == "elastic" else steady_state(problem)
        except SimulationError:
            return None  # no motion to compare with: these values are no candidate

    def problem(self, values: Mapping[str, float]) -> Problem:
        """What is simulated at some values: law, rig and base motion."""
        return self.family.problem_at(values)

    @property
    def is_integrated(self) -> bool:
        """Whether a steady state costs milliseconds: one that is asked for again is remembered."""
        return not self.family.law.is_exact

    def lines(self, values: Mapping[str, float]) -> ComplexArray | None:
        """Harmonics of the steady motion itself, before the sensors; None where there is none."""
        return self.lines_of(self.state(values))

    def lines_of(self, state: SteadyState | None) -> ComplexArray | None:
        """Harmonics of a steady motion; None where there is none."""
        if state is None or (state.orbit is None and state.outcome != "stuck"):
            return None
        if state.orbit is None:
            return np.zeros(self.count, dtype=np.complex128)
        points, turns = max(LEAST_POINTS, 4 * self.count), state.period_cycles or 1
        tau = 2.0 * np.pi * np.arange(points * turns) / points
        cycle = state.orbit.at(tau)[0].reshape(turns, points).mean(axis=0)
        return harmonics_of(cycle, self.count)

    def seen(self, lines: ComplexArray, values: Mapping[str, float]) -> ComplexArray:
        """The same harmonics through the sensors: gain, a lag that shifts the cycle, crosstalk, a filter."""
        gain, lag = through(complex(lines[0]), values)
        shown = gain * np.exp(1j * np.arange(1, self.count + 1) * lag) * lines
        shown[0] += values.get("base_in_mass", 0.0)
        for power, name in BENDS.items():
            if values.get(name):
                shown = shown + values[name] * bend(shown, power)
        return np.asarray(self.kept * shown)

    def predict(self, point: FloatArray, near: SteadyState | None = None) -> FloatArray | None:
        """Cosine and sine parts (2 count,) at a point; None where there is no steady state."""
        values = values_of(self.coordinates, point)
        lines = self.lines_of(self.state(values, near))
        return None if lines is None else parts(self.seen(lines, values))

    def jacobian(self, point: FloatArray, here: FloatArray, some: Sequence[int] | None = None) -> FloatArray:
        """Derivatives (2 count, n) by the coordinates; a column is zero where neither neighbour has a steady state.

        ``some``: the coordinates asked for, by number; all of them unless it is given.
        """
        near = self.state(values_of(self.coordinates, point)) if self.is_integrated else None
        chosen = range(len(self.coordinates)) if some is None else some
        columns = [self._column(i, self.coordinates[i], point, here, near) for i in chosen]
        return np.stack(columns, axis=1)

    def _column(
        self, i: int, c: Coordinate, point: FloatArray, here: FloatArray, near: SteadyState | None
    ) -> FloatArray:
        if c.name == "gain":
            return np.asarray(here * c.width / (1.0 + c.value(float(point[i]))))
        cosine, sine = here[: self.count], here[self.count :]
        order = np.arange(1, self.count + 1)
        later = np.concatenate([order * sine, -order * cosine])
        if c.name == "lag":
            return c.width * later
        if c.name == "mass_in_base":
            return np.asarray(c.width * (float(sine[0]) * later - float(cosine[0]) * here))
        if c.name in BENDS.values():
            power = next(power for power, name in BENDS.items() if name == c.name)
            return c.width * parts(bend(cosine - 1j * sine, power))
        if c.name == "base_in_mass":
            return np.asarray(c.width * (np.arange(len(here)) == 0))
        for step in (STEP, -STEP, 0.1 * STEP):
            if point[i] + step < c.low:
                continue
            there = self.predict(_moved(point, i, step), near)
            if there is not None:
                return np.asarray((there - here) / step)
        return np.zeros_like(here)


def _integrated(problem: Problem, near: SteadyState | None, meter: Meter | None) -> SteadyState:
    """The steady state of an integrated law, sought from one close by if there is one."""
    from frictionlab.simulator import numeric  # noqa: PLC0415 - 10 ms, for such laws alone

    return numeric.steady(problem, near=near, meter=meter)


def _elastic(problem: Problem, meter: Meter | None) -> SteadyState:
    """The steady state of an elastic contact."""
    from frictionlab.simulator import elastic  # noqa: PLC0415 - 20 ms, for such laws alone

    return elastic.steady(problem, meter=meter)


@lru_cache(maxsize=2)
def _remembered(problem: Problem, meter: Meter | None) -> SteadyState:
    """The steady state of a problem: slopes are asked for where residuals have just been.

    Each meter has its own: what one search remembers costs another as much as ever.
    """
    return _integrated(problem, None, meter)


def bend(lines: ComplexArray, power: int) -> ComplexArray:
    """Harmonics (count,) of the swing of a cycle times a power of its place along it, from -1 to 1."""
    points = max(LEAST_POINTS, 4 * len(lines))
    half = np.zeros(points // 2 + 1, dtype=np.complex128)
    half[1 : len(lines) + 1] = 0.5 * points * lines
    return harmonics_of(bent(np.fft.irfft(half, points), power), len(lines))


def bent(cycle: FloatArray, power: int) -> FloatArray:
    """Swing of a cycle (p,) times a power of its place along it, from -1 to 1."""
    swing = 0.5 * float(np.ptp(cycle))
    return np.asarray(swing * ((cycle - cycle.min()) / swing - 1.0) ** power) if swing > 0.0 else np.zeros_like(cycle)


def through(first: complex, values: Mapping[str, float]) -> tuple[float, float]:
    """Gain, and lag in rad of the drive, by which a cycle is shown; ``first``: its first harmonic, over Y.

    What stands of the mass in the base's channel changes the amplitude that all is over, and the phase it is told from.
    """
    seen_base = 1.0 + values.get("mass_in_base", 0.0) * first
    late = values.get("lag", 0.0) - float(np.angle(seen_base))
    return (1.0 + values.get("gain", 0.0)) / abs(seen_base), late


def _moved(point: FloatArray, i: int, step: float) -> FloatArray:
    moved = point.copy()
    moved[i] += step
    return moved
