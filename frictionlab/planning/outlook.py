"""What all candidates would show under one law, in one call: harmonics of their steady cycles, and how these change.

All tests share one set of coordinates: the friction coefficient (beta is proportional to it), the law's other
parameters at a middle amplitude and frequency, and the rig's nuisances (gain, lag, natural frequency, frame damping),
each in deviations of what is known before. So what several tests tell adds up. Candidates whose dimensionless problem
is the same (normal force and amplitude in proportion, or another length) share its states.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.identification.coordinates import Coordinate, nuisances, of_parameter
from frictionlab.identification.forward import STEP
from frictionlab.identification.observed import harmonics_of, parts
from frictionlab.planning.candidates import Candidate, Laboratory
from frictionlab.simulator.cycles import steady_cycles
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.sweep import Family as Problems

FloatArray = NDArray[np.float64]
Indices = Sequence[int] | NDArray[np.intp]
HARMONICS = 32  # unless said otherwise
POINTS = 4  # of a simulated cycle for each harmonic
DIGITS = 12  # to which problems must agree to share a state


@dataclass(frozen=True)
class Columns:
    """Candidates as columns (n,): r; N; m; s; ``drive_hz``; ``cycles`` that are used of each."""

    r: FloatArray
    force: FloatArray
    amplitude: FloatArray
    duration: FloatArray
    drive_hz: FloatArray
    cycles: FloatArray


def columns_of(lab: Laboratory, tests: Sequence[Candidate]) -> Columns:
    """Return candidates as columns."""
    rows = [(t.frequency_ratio, t.normal_force_n, t.base_amplitude_m, t.duration_s) for t in tests]
    r, force, amplitude, duration = np.array(rows, dtype=np.float64).T
    drive = r * lab.natural_frequency_hz
    cycles = np.floor(np.maximum(duration - lab.scene.analysis.planned_transient_s, 0.0) * drive)
    return Columns(r, force, amplitude, duration, drive, cycles)


@dataclass(frozen=True)
class Shown:
    """What candidates would show at some values: ``rows`` of the kernel; ``mean`` (n, 2 K): harmonics' parts over Y."""

    rows: FloatArray
    mean: FloatArray

    @property
    def moves(self) -> NDArray[np.bool_]:
        """Whether there is a steady motion."""
        moving = self.rows[:, layout.OUTCOME] == layout.PERIODIC
        return np.asarray(moving & np.isfinite(self.mean).all(axis=1))


@dataclass(frozen=True)
class Outlook:
    """Candidates under one law.

    ``coordinates``: shared by all, the law's first; ``scales`` (n, m): of each test's own value over the shared one;
    ``harmonics``: of each cycle.
    """

    lab: Laboratory
    columns: Columns
    coordinates: tuple[Coordinate, ...]
    scales: FloatArray
    harmonics: int = HARMONICS

    @property
    def law(self) -> NDArray[np.bool_]:
        """Which coordinates belong to the law."""
        return np.array([c.law for c in self.coordinates])

    @property
    def expected(self) -> FloatArray:
        """The point (m,) that is expected."""
        return np.array([self._expected(c) for c in self.coordinates])

    def _expected(self, c: Coordinate) -> float:
        return c.at(self.lab.expected[c.name]) if c.name in self.lab.expected else max(0.0, c.low)

    def under(self, lab: Laboratory) -> "Outlook":
        """The same candidates under another law."""
        return replace(_outlook(lab, self.columns), harmonics=self.harmonics)

    def only(self, chosen: Indices) -> "Outlook":
        """The same of some candidates."""
        some, columns = np.asarray(chosen, dtype=np.intp), self.columns
        parts_of = {name: getattr(columns, name)[some] for name in columns.__dataclass_fields__}
        return replace(self, columns=Columns(**parts_of), scales=self.scales[some])

    def values(self, points: FloatArray) -> dict[str, FloatArray]:
        """Each test's own values (n,) by name, at points (m,) or (n, m)."""
        raw = np.array([c.middle for c in self.coordinates]) + np.array([c.width for c in self.coordinates]) * points
        raw = np.broadcast_to(raw, self.scales.shape)
        logs = np.array([c.is_log for c in self.coordinates])
        own = np.where(logs, np.exp(np.where(logs, raw, 0.0)), raw) * self.scales
        return {c.name: own[:, i] for i, c in enumerate(self.coordinates)}

    def show(self, points: FloatArray) -> Shown:
        """What each test would show at points (m,) or (n, m)."""
        values = self.values(points)
        family, problems = self._problems(values)
        unique, back = np.unique(np.round(problems, DIGITS), axis=0, return_inverse=True)
        rows, cycles = steady_cycles(unique, family, POINTS * self.harmonics)
        lines = harmonics_of(cycles, self.harmonics)[back.ravel()]
        order, none = np.arange(1, self.harmonics + 1), np.zeros(len(problems))
        turned = np.exp(1j * np.outer(values.get("lag", none), order)) * (1.0 + values.get("gain", none))[:, None]
        return Shown(rows[back.ravel()], parts(lines * turned))

    def _problems(self, values: Mapping[str, FloatArray]) -> tuple[Problems, FloatArray]:
        """The problems (n, coordinates) of a map, at each test's own values."""
        lab, none = self.lab, np.zeros(len(self.scales))
        own = tuple(p.name for p in lab.law.own if p.name != "beta")
        frame = lab.held.get("frame_damping_ratio", 0.0)
        given = {
            "r": self.columns.r / (1.0 + values.get("natural_frequency", none)),
            "beta": none + lab.held.get("beta", 0.0),
            "mu": none + 1.0,
            "zeta": none,
            "frame_damping_ratio": none + frame,
            **{name: none + self.lab.expected[name] for name in own},
            **values,
        }
        family = Problems(lab.law.name, (*own, "frame_damping_ratio"), lab.scene.model.wall)
        return family, np.stack([given[name] for name in family.coordinates], axis=1)

    def slopes(self, points: FloatArray, here: Shown, known: Mapping[str, FloatArray] | None = None) -> FloatArray:
        """Derivatives (n, 2 K, m) by the coordinates; zero where neither neighbour has a steady state.

        ``known``: those (n, 2 K) that need not be found, by name.
        """
        points, known = np.broadcast_to(points, self.scales.shape), known or {}
        every = enumerate(self.coordinates)
        columns = [known[c.name] if c.name in known else self._slope(i, c, points, here) for i, c in every]
        return np.stack(columns, axis=2)

    def _slope(self, i: int, c: Coordinate, points: FloatArray, here: Shown) -> FloatArray:
        width = c.width * self.scales[:, i, None]
        if c.name == "gain":
            return np.asarray(here.mean * width / (1.0 + self.values(points)["gain"][:, None]))
        if c.name == "lag":
            return np.asarray(later(here.mean) * width)
        found = np.full(here.mean.shape, np.nan)
        for step in (STEP, -STEP, 0.1 * STEP):
            left = np.flatnonzero(here.moves & ~np.isfinite(found).all(axis=1) & (points[:, i] + step >= c.low))
            if len(left):
                moved = points[left].copy()
                moved[:, i] += step
                found[left] = (self.only(left).show(moved).mean - here.mean[left]) / step
        return np.asarray(np.nan_to_num(found))


def later(mean: FloatArray) -> FloatArray:
    """Change of harmonics' parts (..., 2 K) by a shift of the cycle to later phases, over rad of the drive."""
    order = np.arange(1, mean.shape[-1] // 2 + 1)
    cosine, sine = np.split(mean, 2, axis=-1)
    return np.concatenate([order * sine, -order * cosine], axis=-1)


def outlook_of(lab: Laboratory, tests: Sequence[Candidate]) -> Outlook:
    """Return candidates under the laboratory's law."""
    return _outlook(lab, columns_of(lab, tests))


def _outlook(lab: Laboratory, columns: Columns) -> Outlook:
    r, amplitude = (math.sqrt(float(v.min()) * float(v.max())) for v in (columns.r, columns.amplitude))
    value, error = lab.coefficient
    beta = Coordinate(
        "beta", "friction coefficient", middle=math.log(value), width=error / value, is_log=True, law=True
    )
    own = [beta if name == "beta" else of_parameter(lab.law.parameter(name)) for name in lab.free]
    turn = 2.0 * math.pi * r * lab.natural_frequency_hz
    coordinates = (*own, *nuisances(lab.family(r), lab.sources, turn=turn))
    scales = np.ones((len(columns.r), len(coordinates)))
    for i, c in enumerate(coordinates):
        if c.name == "beta":
            scales[:, i] = columns.force / (lab.stiffness_n_per_m * columns.amplitude)
        elif c.law:
            parameter = lab.law.parameter(c.name)
            scales[:, i] *= (columns.amplitude / amplitude) ** -parameter.lengths
            scales[:, i] *= (columns.r / r) ** -parameter.rates
        elif c.name == "lag":
            scales[:, i] *= columns.r / r
    return Outlook(lab, columns, coordinates, scales)
