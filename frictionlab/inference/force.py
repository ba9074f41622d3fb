"""The measured force of a contact as an observation: what a law makes of the measured motion, without an oscillator.

The data are means of the force over short parts of the cycle. While the contact stands, or turns faster than sensors
show, a rigid law does not say its force: parts in which the measured speed is not clear of its noise, and those within
two and a half samples of them, have no weight. They are the same under every law, so that laws can be compared; what
stands of a turn in the parts beside them shows a contact that yields. A load cell has no zero, so the mean of the parts
is taken off.

A motion with a force is one observation (`MotionAndForce`): the two share law, frame and sensors. The force gives
newtons, the motion a ratio to k Y; what is not known of that product and of the load cell's gain stands between them.
"""

import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from frictionlab.analysis.measurement import Measurement
from frictionlab.analysis.signals import white_noise
from frictionlab.arrays import FloatArray, shifted
from frictionlab.errors import AnalysisError
from frictionlab.inference.observation import NO_MOTION, SENSORS, Observation, Reached, Values
from frictionlab.inference.observations import (
    FEWEST_CYCLES,
    CycleObservation,
    Motion,
    OfCycles,
    law_and_held,
    observe,
    of_mean,
    of_test,
)
from frictionlab.inference.posterior import Posterior
from frictionlab.inference.starts import elastic_friction_ratios, strokes_of
from frictionlab.inference.unknowns import STRAINED, Unknown, lag
from frictionlab.scene import Scene
from frictionlab.simulator.laws import Law
from frictionlab.simulator.prescribed import force_under
from frictionlab.uncertainty import Estimate, lag_of_samples, unit_uncertainty

PARTS = 128  # of a cycle, at most
FEWEST_PARTS = 8  # that must be clear of stops and turns
CLEAR = 3.0  # errors of the speed, from which a contact slides ...
SLOW = 0.01  # ... and the share of its largest
AROUND = 2.5  # samples beside a stop or turn that have no weight: the force is interpolated between them
POINTS = 512  # of a cycle at which the law's force is taken, at least
GAIN, UNIT, LAG = "force_gain", "force_unit", "force_lag_s"
TIME_OF_FORCE = "time of the force's channel"  # that nobody has declared
STRANGE = 6.0  # times as far from the median as the usual cycle is no cycle of the same friction
LEAST = 0.1  # of the white noise that single cycles show, below which no variance is taken
FREE_UNIT = 1.0  # relative: of k Y where the stiffness is not known
FRICTIONS = tuple(np.geomspace(0.4, 2.5, 13).tolist())  # over the measured one, that a fit tries
STIFFNESSES = tuple(np.geomspace(2.0, 1000.0, 37).tolist())  # of a contact that yields: few parts show its end


@dataclass(frozen=True, kw_only=True)
class ForceObservation(OfCycles):
    """The mean cycle of the measured force, under a law: unknowns -> means over parts of the cycle.

    ``place`` (p,): of the contact over Y, in the measured mean cycle, without noise; ``parts`` (N,): which of ``count``
    equal parts of the cycle are fitted; ``strangers``: cycles left out, for their force is not that of the others;
    ``unit_n``: force that all are over [N], known to ``unit_u``, relative;
    ``normal_force_u``: relative, of the normal force; ``rate``: of sampling, Hz; ``force`` (p,): as measured, over
    `unit_n`; ``pressed`` (p,): the normal force over its mean, where it varies; ``energy``: of the loop of force over
    displacement, over unit_n Y; ``one_way``: the contact slides one way at one speed, which shows Coulomb friction.
    """

    place: FloatArray
    parts: NDArray[np.intp]
    count: int
    unit_n: float
    unit_u: float
    normal_force_u: float
    rate: float
    force: FloatArray
    pressed: FloatArray | None
    strangers: int
    energy: Estimate
    one_way: bool
    kind: ClassVar = "force"
    by_sensors: ClassVar = (GAIN, UNIT)

    @property
    def frame(self) -> dict[str, float]:
        """What the law's numbers are over: that of a frame would be a spring with the force's unit at Y; r is 1."""
        stiffness, frequency = self.unit_n / self.unit, self.turn / (2.0 * math.pi)
        return {"stiffness": stiffness, "frequency": frequency, "amplitude": self.unit, "turn": self.turn}

    def factor(self, unknown: Unknown, reference: Observation, *, amontons: bool = True) -> float:
        """Return by how much a value is larger here than in a reference test: over normal forces friction is not."""
        over_normal = unknown.name == "beta" and self.normal_force is not None
        return 1.0 if over_normal else super().factor(unknown, reference, amontons=amontons)

    @property
    def sums(self) -> tuple[Estimate, ...]:
        """The measured number that a test is predicted by, as of `summed`."""
        return (self.energy,)

    def summed(self, shown: FloatArray, late: float = 0.0) -> FloatArray:  # noqa: ARG002 - it hides in no loop
        """Return the energy (over unit_n Y) that a force (N,) takes in the parts of the cycle that are fitted."""
        way = shifted(self.place, order=1) * (2.0 * math.pi / self.count)
        return np.array([shown @ means_of_parts(way, self.count, self.parts)])

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of the load cell: its gain, its lag, and the unit of the forces."""
        of_force = (
            Unknown(GAIN, "gain of the load cell", sd=self.sources.mass_gain, key="sensors.gain_error"),
            Unknown(UNIT, "stiffness times base amplitude", sd=self.unit_u, low=-0.9, key="rig.stiffness_n_per_m"),
            lag(LAG, "lag of the force behind the motion", lag_of_samples(self.rate), TIME_OF_FORCE, TIME_OF_FORCE),
        )
        return tuple(u for u in of_force if u.sd > 0.0)

    @property
    def said(self) -> tuple[str, ...]:
        """Sentences on what was left out."""
        many = f"force: {self.strangers} of {len(self.each) + self.strangers} cycles are left out: theirs is unlike"
        why = "as where a test begins or ends: --transient and --cycles choose others"
        return (f"{many} that of the others, {why}",) if self.strangers else ()

    def tried(self, near: Values) -> list[dict[str, float]]:
        """Return values at which a fit is tried: stiffnesses of a contact that yields, else friction ratios."""
        known = {"beta": self.guess or 1.0} | dict(near)
        if "stiffness_ratio" in {u.name for u in self.law_unknowns}:
            strokes, free = strokes_of(self.place), "beta" not in self.held
            energy = 2.0 * (self.guess or 1.0) * float(strokes.sum())
            return [
                known | {"stiffness_ratio": stiffness} | ({"beta": beta} if free else {})
                for stiffness in STIFFNESSES
                for beta in elastic_friction_ratios(strokes, energy, stiffness)[:1]
            ]
        return [] if "beta" in self.held else [known | {"beta": known["beta"] * times} for times in FRICTIONS]

    def motion(self, values: Values, near: Any = None) -> FloatArray | None:  # noqa: ARG002 - nothing is looked for
        """Return the law's force (p,) under the measured motion; None where it has none."""
        gain, late = 1.0 + values.get("gain", 0.0), self.turn * values.get(LAG, 0.0)
        times = -(-POINTS // len(self.place))
        pressed = None if self.pressed is None else shifted(self.pressed, times=times)
        try:
            return force_under(self.problem(values), shifted(self.place, -late, times=times) / gain, pressed)[::times]
        except NO_MOTION:
            return None

    def seen(self, motion: FloatArray, values: Values) -> FloatArray:
        """Return a force (p,) as the load cell shows its parts (N,)."""
        times = (1.0 + values.get(GAIN, 0.0)) * (1.0 + values.get(UNIT, 0.0))
        return times * of_parts(motion, self.count, self.parts)

    def in_newtons(self, found: Posterior) -> dict[str, Any]:
        """Return friction force (N) and coefficient by a measured force, and what adds to their uncertainty.

        As `verdict.friction_of`.
        """
        beta, values = found.parameters()["beta"], found.values()
        value = beta.value * self.unit_n * (1.0 + values.get(UNIT, 0.0))
        along = np.zeros(len(found.unknowns))  # change of the force with the coordinates
        for name, size in (("beta", beta.value), (UNIT, 1.0 + values.get(UNIT, 0.0))):
            k = found.fit.find(name)
            if k is not None and size:
                along[k] = value * found.slope(k) / size
        u = math.sqrt(float(along @ found.covariance @ along))
        known = Estimate(value, None if beta.se is None else beta.se / beta.value * value, u) if u else Estimate(value)
        shares = found.shares_along(along, u**2)
        budget = {"friction_force_n": {source: share for source, share in shares.items() if share}}
        of_normal = self.normal_force_u
        coefficient = known.over(self.normal_force)
        if coefficient.u is not None and coefficient.value is not None and self.normal_force:
            own = {source: share / self.normal_force for source, share in budget["friction_force_n"].items()}
            budget["friction_coefficient"] = {**own, "normal force": coefficient.value * of_normal}
            coefficient = coefficient.with_u(math.hypot(coefficient.u, coefficient.value * of_normal))
        same = self.unit_n == self.normal_force and "friction_coefficient" in budget  # as the friction ratio
        budget |= {"friction_ratio": budget["friction_coefficient"]} if same else {}
        return {"force": known, "coefficient": coefficient, "friction": coefficient if same else beta, "budget": budget}


def of_parts(force: FloatArray, count: int, parts: NDArray[np.intp]) -> FloatArray:
    """Return the means (..., N) of cycles (..., p) over some of so many equal parts, about their own mean."""
    means = means_of_parts(force, count, parts)
    return np.asarray(means - means.mean(axis=-1, keepdims=True))


def means_of_parts(force: FloatArray, count: int, parts: NDArray[np.intp]) -> FloatArray:
    """Return the means (..., N) of cycles (..., p) over some of so many equal parts."""
    edges = np.ceil(np.arange(count) * (force.shape[-1] / count)).astype(np.intp)
    sizes = np.diff(edges, append=force.shape[-1])
    return np.asarray((np.add.reduceat(force, edges, axis=-1) / sizes)[..., parts])


def sliding_parts(measurement: Measurement, place: FloatArray, count: int) -> NDArray[np.intp]:
    """Return which of so many parts of the cycle are clear of stops and turns."""
    speed, samples = shifted(place, order=1), measurement.sampling_rate_hz / measurement.drive_frequency_hz
    noise = measurement.mass_noise_m / measurement.base_amplitude_m
    variance = 2.0 * noise**2 / (samples * max(1, int(measurement.series.used.sum())))  # of a cosine part
    lines = np.abs(np.fft.rfft(place))
    highest = int(np.flatnonzero(lines > 1e-12 * lines.max())[-1])
    error = math.sqrt(variance * highest**3 / 3.0)
    slow = np.abs(speed) < max(CLEAR * error, SLOW * float(np.abs(speed).max()))
    slow |= np.sign(speed) != np.sign(np.roll(speed, 1))
    around = math.ceil(AROUND * len(place) / samples)
    near = np.convolve(np.concatenate([slow[-around:], slow, slow[:around]]), np.ones(2 * around + 1), mode="valid") > 0
    edges = np.ceil(np.arange(count) * (len(place) / count)).astype(np.intp)
    return np.flatnonzero(np.add.reduceat(near.astype(int), edges) == 0)


def observe_force(
    measurement: Measurement, scene: Scene, law: str | Law | None = None, motion: CycleObservation | None = None
) -> ForceObservation:
    """Return the measured force of a contact as a fit sees it; ``motion``: of the frame that it stands in.

    Where the frame has a natural frequency, numbers are those of its motion: forces over k Y. On a tribometer they are
    over the normal force, so that the friction ratio is the coefficient, or over the measured friction force where that
    is not known; speeds are over omega Y, and r is 1.
    """
    cell, measured = measurement.cycle.cell, measurement.measured_force.value
    if cell is None or measured is None or measurement.cycle.force is None:
        raise AnalysisError(
            "force: not measured, or the contact stands: expected a channel of the contact's force beside the motion:"
            " name its column with --force"
        )
    chosen, held = law_and_held(scene, law)
    sources = measurement.sources
    if motion is None and scene.rig.kind != "prescribed":
        motion = observe(measurement, scene, chosen)
    normal, pressed = cell.normal_force, measurement.cycle.pressed
    if normal is not None and pressed is not None and motion is not None:  # of a frame all is over the mean
        normal, pressed = normal * float(pressed.mean()), pressed / pressed.mean()
    unit, unit_u = (measured if normal is None else normal), 0.0
    if motion is not None and scene.rig.stiffness is not None:
        unit = scene.rig.stiffness * measurement.base_amplitude_m
        unit_u = math.hypot(sources.stiffness, unit_uncertainty(sources))
    elif motion is not None:
        unit, unit_u = measured / motion.loop_friction_ratio, FREE_UNIT
    place = measurement.cycle.mass_smooth if motion is None else motion.slid
    samples = measurement.sampling_rate_hz / measurement.drive_frequency_hz
    count = max(4 * FEWEST_PARTS, min(PARTS, int(samples), len(place)))
    parts = sliding_parts(measurement, place, count)
    if len(parts) < FEWEST_PARTS:
        raise AnalysisError(
            f"force: the contact slides in {len(parts)} of {count} parts of its cycle; expected at least"
            f" {FEWEST_PARTS}: sample faster, or measure a larger motion"
        )
    each = cell.each
    if pressed is not None:  # what cycles differ by in their normal force they do in friction
        each = each - measured * np.sign(shifted(place, order=1)) * (pressed - pressed.mean(axis=0))
    slid = of_parts(each, count, parts)  # at its turns a force is any, for a sample more or less
    away = np.sqrt(np.mean((slid - np.median(slid, axis=0)) ** 2, axis=1))
    usual = np.flatnonzero(away <= STRANGE * max(float(np.median(away)), 1e-300))
    strangers = len(each) - len(usual)
    whole = measurement.cycle.force if not strangers else each[usual].mean(axis=0) + measurement.cycle.force.mean()
    known = of_test(measurement) | _of_mean_force(measurement, whole / unit, each[usual] / unit, count, parts)
    known["normal_force"] = normal
    return ForceObservation(
        law=chosen,
        held=held,
        wall=scene.model.wall,
        r=1.0 if motion is None else motion.r,
        swing=0.5 * float(np.ptp(place)),
        guess=measured / unit,
        place=place,
        parts=parts,
        count=count,
        unit_n=unit,
        unit_u=unit_u,
        normal_force_u=sources.mass_gain if cell.normal_is_measured else sources.normal_force,
        force=whole / unit,
        pressed=None if pressed is None else pressed.mean(axis=0),
        strangers=strangers,
        energy=measurement.force_energy_j.over(unit * measurement.base_amplitude_m),
        one_way=measurement.slides_one_way,
        **known,
    )


def _of_mean_force(
    measurement: Measurement, whole: FloatArray, each: FloatArray, count: int, parts: NDArray[np.intp]
) -> dict[str, Any]:
    """What an observation takes from parts of the mean cycle (p,) of the force, as single cycles (n, p) scatter.

    Between two samples a force that begins to slip is off a straight line by a quarter of its bend.
    """
    mean, single = of_parts(whole, count, parts), of_parts(each, count, parts)
    used, power = max(1, int(measurement.series.used.sum())), float(np.mean(mean**2))
    about = single - single.mean(axis=0) if len(single) > 1 else single
    noise = max(white_noise(about.ravel()) ** 2, 1e-12 * power)
    step = max(1, round(len(whole) * measurement.drive_frequency_hz / measurement.sampling_rate_hz))
    bend = 0.25 * np.abs(whole - 0.5 * (np.roll(whole, step) + np.roll(whole, -step)))
    least, of_all = noise if len(single) < FEWEST_CYCLES else LEAST * noise, means_of_parts(bend, count, parts) ** 2
    known, variance = of_mean(mean, single, least, used, power=power, white=noise, of_all=np.diag(of_all))
    return known | {"floor": math.sqrt(variance / len(mean) / power)}


@dataclass(frozen=True, kw_only=True)
class MotionAndForce(CycleObservation):
    """The mean cycle of a test's motion (``alone``), and of the force at its contact: harmonics, then parts of that."""

    alone: CycleObservation
    force: ForceObservation
    by_sensors: ClassVar = (*SENSORS, "mass_in_base", GAIN, UNIT, LAG)

    @cached_property
    def both(self) -> tuple[tuple[OfCycles, slice], ...]:
        """Motion and force, each under the law and with what it misses, and which of the data are theirs."""
        n, each = len(self.alone.data), (self.alone, self.force)
        motion, force = (o.under(self.law, self.held).missing(self.missed) for o in each)
        return (motion, slice(n)), (force, slice(n, None))

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors and rig, and of the load cell."""
        return (*super().rig_unknowns, *self.force.rig_unknowns)

    def seen(self, motion: Motion, values: Values) -> FloatArray:
        """Return harmonics as the sensors show them, then the force (N,); NaN where it has none."""
        force = self.both[1][0].predict(values)
        shown = np.full(len(self.force.data), math.nan) if force is None else force
        return np.concatenate([super().seen(motion, values), shown])

    def covariance(self, at: Reached) -> FloatArray:
        """Return the covariance (n, n) in the coordinates: that which the motion leaves and that which the force does.

        Each by its own cycles; what the other says holds the coordinates too.
        """
        total = np.zeros_like(at.hold)
        for (observation, some), (_, rest) in zip(self.both, self.both[::-1], strict=True):
            others = at.hold + at.slopes[rest].T @ at.slopes[rest]
            reached = replace(
                at, residual=at.residual[some], slopes=at.slopes[some], gain=at.gain[:, some], hold=others
            )
            total = total + observation.covariance(reached)
        return total

    def left_out(self, residual: FloatArray, slopes: FloatArray, gain: FloatArray) -> tuple[FloatArray, float | None]:
        """Return the score of each part of the cycles by the fit to the others, and the nrmse of their motion."""
        (scores, nrmse), (more, _) = (o.left_out(residual[n], slopes[n], gain[:, n]) for o, n in self.both)
        return scores + more if len(more) == len(scores) else scores, nrmse

    def nrmse(self, residual: FloatArray) -> float:
        """Return the rms of a whitened residual over that of what was measured, of the motion."""
        motion, own = self.both[0]
        return motion.nrmse(residual[own])

    def in_newtons(self, found: Posterior) -> dict[str, Any]:
        """Return friction force (N) and coefficient of a posterior by the force, and what adds to their uncertainty."""
        return self.force.in_newtons(found)

    def disagreement(self, found: Posterior) -> tuple[str, ...]:
        """Say where force and motion give different friction, by more than three of what is not known between them."""
        said, (force, own) = list(self.force.said), self.both[1]
        places = [k for name in (GAIN, UNIT) if (k := found.fit.find(name)) is not None]
        if math.hypot(*found.fit.point[places]) > STRAINED:
            more = float(f"{100 * ((force.guess or math.nan) / self.loop_friction_ratio - 1.0):.2g}")
            said.append(
                f"friction_force_n: force and motion give different friction: the force is {more:+g} % off the"
                " motion's; check the gain of the load cell, the stiffness and the base's sensor"
            )
        nrmse = force.nrmse(found.fit.residuals[0][own])
        if (misfit := nrmse / force.floor) > STRAINED:
            said.append(
                f"force: the law leaves {100 * nrmse:.2g} % of the measured force, {misfit:.2g} times its error: what"
                " it misses is counted in the errors"
            )
        return tuple(said)


def with_force(observation: CycleObservation, measurement: Measurement, scene: Scene) -> CycleObservation:
    """Return the motion of a test together with its measured force; as it is where none was measured."""
    if measurement.cycle.cell is None or not observation.single or measurement.measured_force.value is None:
        return observation
    force = observe_force(measurement, scene, motion=observation).under(observation.law, observation.held)
    both = observation, force
    known: dict[str, Any] = {f.name: getattr(observation, f.name) for f in fields(CycleObservation)}
    known |= {
        "data": np.concatenate([o.data for o in both]),
        "variances": np.concatenate([o.variances * np.ones(len(o.data)) for o in both]),
        "directions": block_diag(*(np.eye(len(o.data)) if o.directions is None else o.directions for o in both)),
        "powers": np.concatenate([np.full(len(o.data), o.power) for o in both]),
    }
    return MotionAndForce(**known, alone=observation, force=force)
