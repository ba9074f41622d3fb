"""A table over frequency as an observation: amplitude and phase of the mass at several drives, under one law."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.signals import student
from frictionlab.arrays import FloatArray
from frictionlab.errors import NO_FREQUENCY, AnalysisError
from frictionlab.inference.comparison import OverFrequency, harmonics_of
from frictionlab.inference.observation import Observation, Reached, Values, carried, simulated, steady
from frictionlab.inference.observations import law_and_held, mean_cycle
from frictionlab.inference.unknowns import Unknown
from frictionlab.recording import FrequencyTable
from frictionlab.scene import Scene
from frictionlab.simulator import Problem, SteadyState
from frictionlab.simulator.problem import Meter
from frictionlab.uncertainty import sources_of

SEEN = ("natural_frequency", "gain", "lag_s", "frame_damping_ratio")  # what a table shows of the rig
POINTS = 128  # of a simulated cycle
STEP = 1e-4  # of a prior's standard deviation: finite differences
SEARCH = tuple(np.geomspace(0.02, 2.0, 14).tolist())  # friction ratios to begin from
LEAST = 1e-6  # of an amplitude, or rad: the error of a number whose error is not stated, before the scatter is known
CURVE = 200  # points of the predicted curve


@dataclass(frozen=True, kw_only=True)
class TableObservation(Observation):
    """A table under a law: unknowns -> amplitudes (Y), then phases (rad) that would be measured.

    Amplitudes are half the swing, phases those of the fundamental, as the exact steady state has them. ``table``: as it
    was read, its amplitudes in Y; ``ratios``, ``ratios_u`` (n,): r; ``lengths`` (n,): Y of each row over that of the
    reference, the row of the middle frequency, whose frequency ratio and Y are `r` and `unit` (NaN where it is not
    known); ``there`` (N,): which of all amplitudes, then phases (2 n,), were measured; ``sizes`` (N,): what errors are
    relative to, the amplitude itself, or one radian; ``is_stated``: whether every number has its error.
    """

    table: FrequencyTable
    ratios: FloatArray
    ratios_u: FloatArray
    lengths: FloatArray
    there: NDArray[np.intp]
    sizes: FloatArray
    is_stated: bool
    kind: ClassVar = "table"
    noise_words: ClassVar = "stated errors"
    steps: ClassVar = (STEP, -STEP)

    def tried(self, near: Values) -> list[dict[str, float]]:
        """Return values at which a fit is tried: friction ratios."""
        return [] if "beta" in self.held else [{**near, "beta": beta} for beta in SEARCH]

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors and rig."""
        seen = (u for u in super().rig_unknowns if u.name in SEEN)
        return tuple(u for u in seen if u.name != "lag_s" or math.isfinite(self.turn))

    def covariance(self, at: Reached) -> FloatArray:
        """Return the covariance (m, m) in the coordinates: few rows determine their scatter badly."""
        freedom = max(1.0, len(at.residual) - float(at.slopes.shape[1]))
        return np.asarray(at.gain @ at.gain.T * (student(freedom) if self.missed or not self.is_stated else 1.0))

    def left_out(self, residual: FloatArray, slopes: FloatArray, gain: FloatArray) -> tuple[FloatArray, float | None]:
        """Return the score of each row by the fit to all others, one linear step, and their nrmse."""
        leverage, left, rows = slopes @ gain, residual.copy(), self.there % len(self.ratios)
        places = [np.flatnonzero(rows == row) for row in np.unique(rows)]
        for own in places:
            left[own] = np.linalg.solve(np.eye(len(own)) - leverage[np.ix_(own, own)], residual[own])
        return np.array([float(left[own] @ left[own]) for own in places]), self.nrmse(left)

    def problem(self, values: Values, r: float | None = None, length: float = 1.0) -> Problem:
        """Return what is simulated at a frequency ratio, Y in that of the reference, whose ratio it is else.

        The law is the same in N, m and s in all rows.
        """
        r = self.r if r is None else r
        frame = {"stiffness": 1.0, "frequency": 1.0, "amplitude": 1.0, "turn": 1.0}
        here = frame | {"amplitude": length, "turn": r / self.r}
        times = {p.name: carried(p, frame, here) for p in self.law.own if not p.whole}
        return simulated(self.law, self.held, self.wall, values, r, times=times)

    def shown(self, values: Values, state: SteadyState | None, r: float) -> tuple[float, float]:
        """Return amplitude (Y) and phase (rad) of a state as the sensors would show them; NaN where there are none."""
        if state is None or state.orbit is None or state.response_amplitude is None:
            stuck = state is not None and state.outcome == "stuck"
            return 0.0 if stuck else math.nan, math.nan
        late = values.get("lag_s", 0.0) * r / self.r * self.turn if "lag_s" in values else 0.0
        gain = 1.0 + values.get("gain", 0.0)
        first = harmonics_of(mean_cycle(state, POINTS), 1)[0]
        return gain * state.response_amplitude, -float(np.angle(first)) - late

    def states(self, values: Values) -> Iterator[SteadyState | None]:
        """Yield the steady state of each row; None where there is none."""
        rows = zip(self.ratios.tolist(), self.lengths.tolist(), strict=True)
        return (steady(partial(self.problem, values, *row), self.work) for row in rows)

    def motion(self, values: Values, near: object = None) -> FloatArray | None:  # noqa: ARG002 - rows are cheap
        """Return what would be measured (N,), phases within half a turn of the measured; None without a motion."""
        rows = [self.shown(values, s, r) for s, r in zip(self.states(values), self.ratios.tolist(), strict=True)]
        made = np.array(rows).T.ravel()[self.there]
        if not np.isfinite(made).all():
            return None
        phases = self.there >= len(self.ratios)
        made[phases] -= 2.0 * np.pi * np.round((made[phases] - self.data[phases]) / (2.0 * np.pi))
        return np.asarray(made)

    def settled(self, values: Values) -> Self:
        """Return the table in which scatter about a law stands for errors not stated, and the errors of r count."""
        variances = noise_of(self.table, self.there, self.sizes, self.missed) ** 2
        if np.isfinite(self.ratios_u).any():
            off = 1e-4
            at, moved = self.predict(values), replace(self, ratios=self.ratios * (1.0 + off)).predict(values)
            if at is not None and moved is not None:
                relative = np.nan_to_num(np.tile(self.ratios_u / self.ratios, 2)[self.there])
                variances = variances + ((moved - at) / off * relative) ** 2
        floor = float(np.sqrt(np.mean(variances / self.powers)))
        return replace(self, missed=0.0, variances=variances, floor=floor)

    def curve(self, values: Values) -> OverFrequency:
        """Return the rows measured over the curve predicted, Y that of the reference."""
        low, high = float(self.ratios.min()), float(self.ratios.max())
        ratios = np.linspace(0.95 * low, 1.05 * high, CURVE)
        states = (steady(partial(self.problem, values, r), Meter(math.inf)) for r in ratios.tolist())
        shown = [self.shown(values, state, r) for state, r in zip(states, ratios.tolist(), strict=True)]
        return OverFrequency(self.ratios, self.table, ratios, *np.array(shown).T)


def noise_of(table: FrequencyTable, there: NDArray[np.intp], sizes: FloatArray, scatter: float) -> FloatArray:
    """Return standard uncertainties (N,) as stated; the root of a share of its size, squared, for one that is not."""
    stated = np.concatenate((table.amplitude_u, table.phase_u))[there]
    return np.maximum(np.where(np.isfinite(stated), stated, math.sqrt(scatter) * sizes), LEAST * sizes)


def observe_table(table: FrequencyTable, scene: Scene, law: str | None, facts: Mapping[str, Any]) -> TableObservation:
    """Return a table as a fit sees it."""
    natural, lag = scene.rig.natural_frequency, scene.sensors.lag_s
    if natural is None and not table.is_ratio:
        raise AnalysisError(f"frequency [Hz]: {NO_FREQUENCY}; or give a column r")
    if lag and natural is None:
        raise AnalysisError("sensors.lag_s: what it does to a phase needs rig.natural_frequency_hz: give it")
    times = 1.0 if table.is_ratio or natural is None else 1.0 / natural
    known, r = table.base_amplitude, table.drive * times
    middle = int(np.argsort(r)[len(r) // 2])
    if not np.isfinite(known).all():
        known = np.full(len(table), float(facts.get("base_amplitude_m", math.nan)))
    if table.in_metres and not np.isfinite(known).all():
        raise AnalysisError(
            "amplitude [mm]: expected the base's amplitude beside it; got none: give base_amplitude_m in [experiment],"
            " or a column base amplitude [mm]; amplitude [Y] needs none"
        )
    unit, over = float(known[middle]), known if table.in_metres else 1.0
    late = 2.0 * math.pi * lag * natural * r if lag and natural else 0.0
    table = replace(
        table, amplitude=table.amplitude / over, amplitude_u=table.amplitude_u / over, phase=table.phase + late
    )
    there = np.flatnonzero(np.isfinite(np.concatenate((table.amplitude, table.phase))))
    sizes = np.concatenate((np.abs(table.amplitude), np.ones(len(r))))[there]
    noise = noise_of(table, there, sizes, 0.0)
    chosen, held = law_and_held(scene, law)
    normal = facts.get("normal_force_n")
    return TableObservation(
        source=table.source,
        table=table,
        ratios=r,
        ratios_u=table.drive_u * times,
        lengths=known / unit if math.isfinite(unit) else np.ones(len(r)),
        there=there,
        sizes=sizes,
        is_stated=bool(np.isfinite(np.concatenate((table.amplitude_u, table.phase_u))[there]).all()),
        law=chosen,
        held=held,
        wall=scene.model.wall,
        material=facts.get("material"),
        normal_force=normal,
        r=float(r[middle]),
        unit=unit,
        turn=math.nan if natural is None else 2.0 * math.pi * natural * float(r[middle]),
        sources=sources_of(scene, math.inf, normal_force_n=None if normal is None else float(normal), lag_s_u=0.0),
        swing=float(np.nanmedian(table.amplitude)) if np.isfinite(table.amplitude).any() else 1.0,
        data=np.concatenate((table.amplitude, table.phase))[there],
        variances=noise**2,
        powers=sizes**2,
        floor=float(np.sqrt(np.mean((noise / sizes) ** 2))),
    )
