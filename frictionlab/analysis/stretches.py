"""From a recording to even stretches: clock, lags, filters, displacements of whatever channels there are.

A contact that slides one way, such as a pin on a turning disc or a belt, is folded, so that it has cycles like others:
the way of one revolution (of a straight motion: a tenth of the record) is laid half to and half fro, as a sine, and the
friction force turns with it: where it turns, nothing is slid. Energy per cycle, friction force and coefficient are
integrals over the way, and stay what they are, the middle of each half counting most; what a cell shows beside friction
(an offset) turns too, so it cannot be separated from friction one way.
"""

import math
from collections.abc import Iterable, Mapping
from itertools import pairwise, product

import numpy as np

from frictionlab.analysis import channels, signals, spectrum, steadiness
from frictionlab.arrays import FloatArray, clock_breaks
from frictionlab.errors import AnalysisError
from frictionlab.recording import Fact, Recording
from frictionlab.scene import Scene

MOST_GAPS = 5  # named one by one
SHORTEST_PART = 32  # samples
REVOLUTION = 2.0 * math.pi
PARTS = 10  # of a straight motion
WINDOWS, NEAR, SLOW = 400, 8, 0.2  # of a record; as fast as so many a contact has its speed; of that: it stands
BACK = 0.02  # of the way: noise, no way back
ONE_SIGN = 0.5  # a force's mean over its rms: it may rest for three quarters of a record
STANDS = "analysis: no drive: the contact stands still, starts or stops: expected a motion"
ROTATIONS = {"angle": 0, "angular_velocity": 1}
KNOWN = {**ROTATIONS, "mass_displacement": 0, "mass_velocity": 1}  # by how often they are integrated for the way


def even_stretches(recording: Recording, scene: Scene) -> tuple[list[signals.Stretch], list[str]]:
    """The recording's sound parts, evenly sampled, lags and filters taken back, and what had to be said about them.

    A part that holds no measurement is left out where another holds one, and said. `AnalysisError`: No part holds one:
    no motion is measured; stamps jump; a contact that turns does so at several speeds, or less than two revolutions.
    """
    step, found = 1.0 / recording.sampling_rate_hz, list[tuple[signals.Stretch, list[str], float]]()
    refused = list[tuple[float, float, AnalysisError]]()
    recording, warnings = _taken_as(recording, scene)
    for part in recording.stretches():
        breaks = clock_breaks(part.time, step).tolist()
        warnings += _some(
            f"time: the clock passes {float(part.time[i] - part.time[i - 1]) / step:.4g} sampling intervals at"
            f" {part.time[i]:.6g} s, as if it was set; no cycle is cut across it"
            for i in breaks
        )
        pieces, rests = [slice(a, b) for a, b in pairwise([0, *breaks, len(part)])], list[tuple[float, float]]()
        if scene.rig.kind == "prescribed":
            pieces, rests = _turning(part, pieces)
        refused += [(*ends, AnalysisError(STANDS)) for ends in rests]
        for some in pieces:
            try:
                found.append(_even(part, some, step, scene))
            except AnalysisError as error:
                refused.append((float(part.time[some][0]), float(part.time[some][-1]), error))
    if refused and not found:
        raise max(refused, key=lambda part: (str(part[2]) != STANDS, part[1] - part[0]))[2]
    one_way = bool(found) and max((stretch for stretch, *_ in found), key=lambda part: len(part.base)).one_way
    parts, strays = list[signals.Stretch](), max((off for *_, off in found), default=0.0)
    for stretch, said, _ in found:
        if stretch.one_way is one_way:
            warnings += [words for words in said if words not in warnings]
            parts.append(stretch)
        else:
            end, why = stretch.time + (len(stretch.base) - 1) * step, "it does not move as the longest part does"
            refused.append((stretch.time, end, AnalysisError(why)))
    warnings += _some(f"part: from {a:.4g} s to {b:.4g} s is left out: {why}" for a, b, why in refused)
    if strays > 0.0:
        stray = f"time: stamps stray by up to {strays:.2g} sampling intervals from an even clock"
        warnings.append(f"{stray}: values are interpolated by a cubic, which takes less than 0.1 % of a motion")
    warnings += _some(f"gap: no samples from {a:.4g} s to {b:.4g} s; no cycle spans it" for a, b in recording.gaps)
    force = recording.experiment.get("normal_force_n")
    if force is not None and not is_force(force):
        warnings.append(f"normal_force_n: expected a number above 0; got {force!r} in the recording: it is not used")
    return parts, warnings


def _even(part: Recording, some: slice, step: float, scene: Scene) -> tuple[signals.Stretch, list[str], float]:
    """One sound part of a recording: evenly sampled, what is to be said of it, how far its stamps stray (steps)."""
    time, (of_mass, of_base), one_way, of, times = part.time[some], channels_of(scene), False, 0, 0
    if len(time) < SHORTEST_PART:
        raise AnalysisError(f"analysis: expected at least {SHORTEST_PART} samples; got {len(time)}: record longer")
    seen, off = signals.evenly(time, step, {name: values[some] for name, values in part.measured().items()})
    if scene.rig.kind == "prescribed":  # the mass's motion stands in the base's place
        mass, seen, said, edge, one_way = given_motion(seen, step, scene.rig.radius_m)
        mass = base = channels.restored(mass, step, of_mass)
    else:
        mass, said, edge, of = channels.displacement(seen, "mass", step)
        base, of_the_base, other, times = channels.displacement(seen, "base", step)
        said, edge = said + of_the_base, max(edge, other)
        mass, base = channels.restored(mass, step, of_mass), channels.restored(base, step, of_base)
    seconds = {place: signals.Second(math.inf, k) for place, k in (("mass", of), ("base", times)) if k}
    of_the_mass = ("mass_velocity", *channels.other_masses(seen))
    known = {"mass": mass, "base": base}
    known |= {name: seen[name] for name in (*channels.FORCES, "normal_force") if name in seen}
    known |= {name: channels.restored(seen[name], step, of_mass) for name in of_the_mass if name in seen}
    for place, times in product(("mass", "base"), (2, 1)):  # an acceleration first
        first, second = f"{place}_displacement", f"{place}_{channels.RATES[times]}"
        if scene.rig.kind == "prescribed" or place in seconds or not seen.keys() >= {first, second}:
            continue
        rate = channels.restored(seen[second], step, of_mass if place == "mass" else of_base)
        try:
            both, penalty = channels.by_two_sensors(known[place], rate, step, scene.sensors.gain_error, times)
            known[place + signals.BY_TWO], seconds[place] = both, signals.Second(penalty, times)
            said.append(f"{first}: taken together with {second}, each by its noise")
        except AnalysisError as error:
            said.append(f"{second}: not used, {first} alone is: {error}")
    whole = signals.Stretch(float(time[0]), step, known, one_way, seconds)
    return whole.part(edge, len(mass) - edge), said, off


def _turning(part: Recording, pieces: list[slice]) -> tuple[list[slice], list[tuple[float, float]]]:
    """The samples in which a contact that turns one way has its speed; from when to when [s] it rests or starts.

    A motion that is not measured goes on where there is a force, ten turns in all.
    """
    measured, found = part.measured(), list[slice]()
    name = next((name for name in ROTATIONS if name in measured), None)
    signal = measured[name] if name else _one_way_force(measured)
    if signal is None:
        return pieces, []
    if name is None:
        signal = signal * (PARTS * REVOLUTION / float(signal.mean()) / float(np.ptp(part.time)))
    for some in pieces:
        time, shown = part.time[some], signal[some]
        way = np.unwrap(shown) if name == "angle" else np.cumsum(shown * np.diff(time, prepend=time[0]))
        found += [slice(some.start + a, some.start + b) for a, b in _at_speed(time, way)]
    ends = [0, *(edge for some in found for edge in (some.start, some.stop)), len(part)]
    rests = [(a, b - 1) for a, b in zip(ends[::2], ends[1::2], strict=True) if a < b]
    return found, [(float(part.time[a]), float(part.time[b])) for a, b in rests]


def _at_speed(time: FloatArray, way: FloatArray) -> list[tuple[int, int]]:
    """First and past-last samples of what goes one way at its speed, for two revolutions at least forward and back too.

    Of any other way (n,) rad all. Stamps (n,) s.
    """
    at = np.linspace(0, len(way) - 1, WINDOWS + 1).astype(np.intp)
    moved, took = np.diff(way[at]), np.diff(time[at])
    edges = [0, *at[np.flatnonzero(np.diff(np.sign(moved))) + 1].tolist(), len(way)]
    long = [(a, b) for a, b in pairwise(edges) if abs(way[b - 1] - way[a]) >= 2.0 * REVOLUTION]
    covered = sum(abs(way[b - 1] - way[a]) for a, b in long) > (1.0 - BACK) * np.abs(moved).sum()
    if len(way) > WINDOWS and covered and len({way[b - 1] > way[a] for a, b in long}) > 1:
        return [(a + i, a + j) for a, b in long for i, j in _at_speed(time[a:b], way[a:b])]
    moved *= np.sign(way[-1] - way[0])
    if len(way) <= WINDOWS or not moved.sum() > 0.0 or np.minimum(moved, 0.0).sum() < -BACK * moved.sum():
        return [(0, len(way))]
    speed = moved / took
    order = np.argsort(speed)
    usual = float(speed[order][np.searchsorted(np.cumsum(moved[order]), 0.5 * moved.sum())])  # at half of its way
    low, turn = SLOW * usual, REVOLUTION / usual / float(took.mean())  # within a revolution it sticks
    found = steadiness.full_runs(speed, low, NEAR, pause=turn, still=low)
    return [(int(at[a]), int(at[b]) if b < WINDOWS else len(way)) for a, b in found]


def _taken_as(recording: Recording, scene: Scene) -> tuple[Recording, list[str]]:
    """The recording as it is measured, and what is said of that, after what it says itself.

    A force over the stiffness, as `frictionlab simulate` writes it without one, is in newtons, else left out; of a
    motion that is given, a column that stands still is left out.
    """
    warnings, stiffness = list(recording.source.warnings), scene.rig.stiffness
    simulated = next((c for c in recording.channels if c.name == "contact_force" and c.unit == "m"), None)
    if simulated is not None:
        recording = recording.changed(contact_force=None if stiffness is None else stiffness * simulated.values)
        if stiffness is None:
            warnings.append("contact_force: is over the stiffness, and left out: give [rig] stiffness_n_per_m")
    stroke = recording.measured().get("mass_displacement")
    if scene.rig.kind == "prescribed" and stroke is not None and not np.any(np.ptp(stroke)):
        recording = recording.changed(mass_displacement=None)
    by_log, by_sensors = recording.source.dialect.get("lag_s"), scene.sensors.lag_s
    if isinstance(by_log, float) and by_log and by_sensors:
        more = (
            f"moves it by {1e3 * by_sensors:.3g} ms more: {1e3 * (by_log + by_sensors):.3g} ms in all: declare it once"
        )
        warnings.append(f"lag: [log] lag_s has moved the base by {1e3 * by_log:.3g} ms, [sensors] lag_s {more}")
    measured = next((c.name for c in recording.channels if c.name in channels.FORCES), None)
    if measured is not None and channels_of(scene)[0].cutoff is not None:
        warnings.append(f"{measured}: it is taken as unfiltered, for filter_hz in [sensors] is of the motion")
    return recording, warnings


def _some(sentences: Iterable[str]) -> list[str]:
    """The first few sentences, and how many more there are."""
    every = list(sentences)
    more = [f"{said.partition(':')[0]}: {len(every) - MOST_GAPS} more such places" for said in every[MOST_GAPS:]]
    return [*every[:MOST_GAPS], *more[:1]]


def channels_of(scene: Scene) -> tuple[channels.SensorChannel, channels.SensorChannel]:
    """The ways of mass and base into the log, as the scene declares them."""
    s = scene.sensors
    mass = channels.SensorChannel(0.0, s.mass_filter_hz or s.filter_hz, s.mass_filter_order or s.filter_order)
    return mass, channels.SensorChannel(s.lag_s, s.base_filter_hz or s.filter_hz, s.base_filter_order or s.filter_order)


def is_force(value: Fact) -> bool:
    """Whether a fact is a normal force: a number above 0."""
    return isinstance(value, (int, float)) and math.isfinite(value) and value > 0.0


def given_motion(
    measured: Mapping[str, FloatArray], step: float, radius: float | None
) -> tuple[FloatArray, dict[str, FloatArray], list[str], int, bool]:
    """Return the prescribed motion (n,) of the contact in m (rad where no radius is known), and the channels with it.

    ``measured``: channels (n,) by their names, SI units, one sample every ``step`` s; ``radius`` m: makes a way of an
    angle and a force of a torque. Last: what is to be said, doubtful samples at either end, whether it slides one way.
    `AnalysisError`: No motion is measured and the force shows none; it turns at several speeds, or less than two
    revolutions.
    """
    fold = folded(measured, step)
    if fold is None:
        alone = {name: values for name, values in measured.items() if not name.startswith("base_")}
        seen, (motion, said, edge, _) = dict(measured), channels.displacement(alone, "mass", step)
    else:
        motion, seen, said, edge = fold[0], fold[1], [fold[2]], 0
    if channels.is_angular(measured) and radius is None:
        lengths = "radians" if ROTATIONS.keys() & seen else "parts of the record"
        forces = ", and newton metres for newtons" if "torque" in measured else ""
        said.append(f"base_amplitude_m: {lengths} stand for metres{forces}: [rig] radius_m makes metres of an angle")
    elif radius is not None and channels.is_angular(measured):
        motion = motion * radius
        seen |= {"contact_force": seen.pop("torque") / radius} if "torque" in seen else {}
    return motion, seen, said, edge, fold is not None


def folded(measured: Mapping[str, FloatArray], step: float) -> tuple[FloatArray, dict[str, FloatArray], str] | None:
    """Fold the motion of channels (n,) by their names, one sample every ``step`` s; None where it repeats to and fro.

    Returned are the motion (n,) in m or rad, the channels with it, and what is to be said of it. A record of forces
    alone is taken as an even motion, where the force has one sign. A way that goes to and fro without repeating, or at
    several speeds, is laid out evenly over the way: energy and friction of its tenths are what they are.
    `AnalysisError`: It turns at several speeds, or less than two revolutions.
    """
    laid = _way(measured, step)
    if laid is None:
        return None
    way, direction, turns, said = laid
    whole = REVOLUTION if turns else float(way[-1]) / PARTS
    if (count := float(way[-1]) / whole) < 2.0:
        raise AnalysisError(f"analysis: it turns one way: expected 2 revolutions; got {count:.2g}: record longer")
    rising = np.maximum.accumulate(way)
    lengths = np.diff(np.searchsorted(rising, whole * np.arange(math.floor(count + 1e-9) + 1))) * step
    uneven = float(np.ptp(lengths)) > 0.1 * float(lengths.mean()) + 2.0 * step
    if uneven and turns:
        speeds = f"{1 / lengths.max():.3g} to {1 / lengths.min():.3g} cycles a second"
        raise AnalysisError(f"analysis: it turns one way, at {speeds}: expected one speed: record each by itself")
    with_motion = {n: measured[n] * direction for n in channels.FORCES if n in measured}
    seen = {n: values for n, values in measured.items() if n != "mass_velocity"} | with_motion
    if uneven:
        way, before = np.linspace(0.0, way[-1], len(way)), rising + 1e-12 * way[-1] * np.arange(len(way))
        seen = {n: np.interp(way, before, values) for n, values in seen.items()}
        said += ", laid evenly over its way, for the speed changes"
    phase = REVOLUTION * way / whole
    seen |= {n: np.where(np.sin(phase) < 0.0, -seen[n], seen[n]) for n in with_motion}
    said = f"contact: {said}; an offset of the force cannot be separated from friction"
    return -0.25 * whole * np.cos(phase), seen, said


def _one_way_force(measured: Mapping[str, FloatArray]) -> FloatArray | None:
    """The force or torque (n,) of one sign that is known of a contact, where its motion is not."""
    if measured.keys() & KNOWN.keys():
        return None
    forces = (measured[name] for name in channels.FORCES if name in measured)
    return next((f for f in forces if abs(float(f.mean())) >= ONE_SIGN * float(np.sqrt(np.mean(f**2)))), None)


def _way(measured: Mapping[str, FloatArray], step: float) -> tuple[FloatArray, FloatArray, bool, str] | None:
    """The way (n,) of a contact that slides one way, which way (n,) or (1,), whether it turns, words; None: to and fro.

    Where no motion is known, the way is even, against the force.
    """
    name = next((name for name in KNOWN if name in measured), None)
    if name is None:
        force = _one_way_force(measured)
        if force is None:
            return None
        said = f"no motion is measured: taken as an even one, in {PARTS} parts"
        return np.linspace(0.0, 1.0, len(force)), np.sign(force.mean(keepdims=True)), False, said
    signal = np.unwrap(measured[name]) if name == "angle" else measured[name]
    power = float(np.mean(signal**2) if KNOWN[name] else np.var(signal))
    if signals.white_noise(signal) ** 2 >= 0.5 * power:
        raise AnalysisError(STANDS)
    way = signal - signal[0] if KNOWN[name] == 0 else np.cumsum(signal) * step
    forward = np.where(way[-1:] < 0.0, -1.0, 1.0)
    way = way * forward
    points = np.linspace(0, len(way) - 1, WINDOWS).round().astype(np.intp)  # noise of single samples is no way back
    back = np.minimum(np.diff(way[points]), 0.0)
    if way[-1] > 0.0 and -float(back.sum()) <= BACK * float(way[-1]):
        turns = name in ROTATIONS
        said = "it turns one way: a cycle is a revolution" if turns else "it slides one way, in ten parts"
        return way, forward, turns, said
    tone = spectrum.strongest_tone(spectrum.amplitude_spectrum(way, step))
    lag = round(1.0 / tone.frequency / step)  # joints and strokes are alike by 0.91 a period later, earthquakes by 0.33
    alike = 1.0 if 2 * lag > len(way) else float(np.corrcoef(way[:-lag], way[lag:])[0, 1])
    if alike >= 0.6 and 0.5 * tone.amplitude**2 >= 0.2 * float(np.var(way)):  # of the power: it repeats
        return None
    moves = np.diff(channels.denoised(way, signals.white_noise(way)), prepend=0.0)
    return np.cumsum(np.abs(moves)), np.sign(moves), False, "it goes to and fro without repeating: its way in ten parts"
