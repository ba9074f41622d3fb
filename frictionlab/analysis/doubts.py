"""What must be said about a measurement: each sentence names the quantity it is about, and times where it can."""

import math
from collections.abc import Iterator

import numpy as np

from frictionlab.analysis import mistakes, steadiness
from frictionlab.analysis.cycles import first_harmonic
from frictionlab.analysis.hum import LEAST
from frictionlab.analysis.layout import Layout
from frictionlab.analysis.mistakes import is_clipped
from frictionlab.analysis.response import Response
from frictionlab.analysis.spectrum import Smoother
from frictionlab.estimate import Estimate

FEW_CYCLES = 5
COARSE = 0.02  # sensor step over the amplitude of the response: what stands still longer than that may be moving
QUIET = 0.01  # rounding that noise does not average away, over the step: a sensor that shows the same in every cycle
FEW_STEPS = 2.5  # a motion over fewer steps is not told from its sensor's
FEW_SAMPLES = 40  # a cycle; below it the stops and the loop's area lose their accuracy
DISTORTED = 0.05
USUAL_RATIOS = (0.02, 5.0)
RESONANCE, GROWS = 0.05, 1.05  # |r - 1|, and last over first quarter of the amplitudes
WHOLE, SAME_SIZE = 0.2, 0.02  # of a sample; of the amplitude: a jump of the clock, not of the motion
GROWTH, LONG_S = 0.005, 300.0  # relative; longer tests have a trend of their own
UNEVEN = 2 * math.pi * 0.002  # rms wander of the drive's phase, rad
SAME_COUNT, MIRRORED = 0.05, 0.01  # of a stop; asymmetry of a motion whose halves are alike
OFTEN = 0.4  # of the cycles: a pause that may be a stop
MANY = 6  # times named in one sentence


def warnings(
    layout: Layout,
    response: Response,
    settled: float | None,
    transient: float,
    *,
    loop: Estimate,
    r: float | None,
    wall_moves: bool,
    prescribed: bool = False,
) -> list[str]:
    """Say what a reader of the numbers must know.

    Parameters
    ----------
    settled, transient : float
        When the motion had settled (None: it had not), and where the transient was cut; s from the recording's start.
    loop : Estimate
        Energy per cycle (k Y^2) with its standard error.
    r : float or None
        Frequency ratio, where known.
    wall_moves : bool
        The wall goes with the base.
    prescribed : bool
        The motion of the mass is given, and stands in the base's place.
    """
    of_channels = _of_the_channels(layout, response, loop, None if wall_moves else r, wall_moves=wall_moves)
    return [
        *(() if prescribed else of_channels),
        *_of_the_ratio(r),
        *_of_the_drive(layout),
        *_of_the_lines(layout),
        *_of_the_record(layout),
        *(() if prescribed else _of_the_sensors(layout, response)),
        *_of_settling(layout, response, settled, transient),
        *_of_growth(response, settled, r),
        *(() if response.is_stuck else _of_the_motion(layout, response)),
    ]


def _of_the_channels(
    layout: Layout, response: Response, loop: Estimate, r: float | None, *, wall_moves: bool
) -> Iterator[str]:
    mass, base = layout.mass.mean(axis=0), layout.base.mean(axis=0)
    noise = math.hypot(layout.of_mass.noise, layout.of_base.noise) / math.sqrt(len(layout))
    noise = math.hypot(noise, layout.of_mass.shared, layout.of_base.shared)
    if response.is_stuck:
        found = [mistakes.only_noise(layout.of_mass.noise, layout.of_base.noise, step=layout.of_base.step)]
    else:
        found = [mistakes.copied(mass, base, noise=noise)]
        if found == [None]:
            found += [mistakes.turned(mass, base, energy=loop.value or 0.0, error=loop.se or 0.0)]
        if found == [None, None] and not wall_moves and not _is_blurred(response):
            stuck = response.stuck_fraction
            found += [mistakes.relative(mass, base, noise=noise, samples=layout.samples, stuck=stuck, r=r)]
    yield from (sentence for sentence in found if sentence is not None)


def _is_blurred(response: Response) -> bool:
    """Whether no stop can be told: how long the mass stands is not known then, and 0 is no finding."""
    return response.shortest_stop >= 1.0


def _of_the_ratio(r: float | None) -> Iterator[str]:
    if r is not None and not USUAL_RATIOS[0] <= r <= USUAL_RATIOS[1]:
        yield (
            f"frequency_ratio: {r:.3g} lies outside {USUAL_RATIOS[0]:g} to {USUAL_RATIOS[1]:g}, where a rig of this"
            " kind is driven: check natural_frequency_hz in [rig] (--natural-frequency) and the unit of time"
            " (--time-unit)"
        )


def _of_the_drive(layout: Layout) -> Iterator[str]:
    drive = layout.drive
    distortion = float(np.linalg.norm(drive.harmonics[1:]))
    if distortion > DISTORTED:
        yield f"base_distortion: the base motion's harmonics 2-9 are {100 * distortion:.2g} % of its fundamental"
    if drive.drifts and drive.wander > UNEVEN and layout.foreign.period == 1:
        share = drive.wander / (2 * math.pi)
        yield (
            f"drive_frequency_hz: the drive is not even; its phase wanders by {share:.2g} of a cycle (rms) about a"
            " constant frequency, and the cycles follow it"
        )
    if drive.growth:
        yield (
            f"base_amplitude_m: the base's amplitude drifts by {100 * drive.growth:+.2g} % from the first cycle to the"
            " last: the motor's stroke or the sensor's gain changes: all numbers over Y hold that in their errors"
        )
    if drive.frequency_se is None:
        yield "drive_frequency_hz_se: fewer than 3 cycles, so the frequency has no standard error"


def _of_the_lines(layout: Layout) -> Iterator[str]:
    drive, foreign = layout.drive, layout.foreign
    for role, found in (("response_amplitude", foreign.mass), ("base_amplitude_m", foreign.base)):
        for line in found[:MANY]:
            share = 100.0 * line.amplitude / drive.amplitude
            if line.removed and line.amplitude > LEAST * drive.amplitude:
                yield (
                    f"{role}: a line at {line.frequency:.5g} Hz, {share:.2g} % of the base's amplitude, {line.origin}:"
                    " it is taken out: look for its source (earthing, cables, a bearing)"
                )
    for line in foreign.on_harmonics[:MANY]:
        k = round(line.frequency / drive.frequency)
        yield (
            f"response_amplitude: harmonic {k} of the drive, at {line.frequency:.5g} Hz, is"
            f" {100.0 * line.amplitude / drive.amplitude:.2g} % of the base's amplitude and stands out of those beside"
            f" it: {line.cause}; so near a harmonic it cannot be told from the motion: amplitude (its error holds it)"
            " and stops_per_cycle may be wrong by it: drive a little faster or slower"
        )
    if foreign.masked > LEAST * drive.amplitude and not foreign.on_harmonics:
        yield (
            f"response_amplitude: a harmonic of the drive lies on the frequency of the mains: hum of up to"
            f" {100.0 * foreign.masked / drive.amplitude:.2g} % of the base's amplitude could not be told from it, and"
            " is in the uncertainty: drive a little faster or slower"
        )
    if foreign.period > 1:
        yield (
            f"cycles: the motion repeats every {foreign.period} cycles of the drive, not every one: energy, amplitude"
            f' and stops are means over whole periods of {foreign.period} cycles, also with cycles = "last" (--cycles)'
        )
        return
    low = [line for line in (*foreign.mass, *foreign.base) if not line.removed]
    if low:
        line = low[0]
        beat = abs(line.frequency - max(round(line.frequency / drive.frequency), 1) * drive.frequency)
        yield (
            f"response_amplitude: beats: a second motion at {line.frequency:.5g} Hz of"
            f" {100.0 * line.amplitude / drive.amplitude:.2g} % of the base's amplitude comes and goes every"
            f" {1.0 / beat:.3g} s: one cycle is not all of it: take many beats (--cycles all)"
        )


def _of_the_record(layout: Layout) -> Iterator[str]:
    if len(layout) < FEW_CYCLES:
        yield (
            f"cycles: only {len(layout)} full cycles after the transient, where {FEW_CYCLES} would tell their scatter:"
            " record longer or cut a shorter transient"
        )
    if layout.samples < FEW_SAMPLES:
        yield (
            f"sampling_rate_hz: {layout.samples:.3g} samples a cycle; energy and stops ask for {FEW_SAMPLES}: sample"
            " faster"
        )


def _of_the_sensors(layout: Layout, response: Response) -> Iterator[str]:
    few_stops = not response.is_stuck and response.stops_per_cycle < 2.5 and strokes(response.how) <= 2
    signals = [("base_amplitude_m", layout.base, layout.of_base.noise, layout.of_base.step, False)]
    if not response.is_stuck:
        signals.append(("response_amplitude", layout.mass, layout.of_mass.noise, layout.of_mass.step, not few_stops))
    for name, rows, noise, step, slows in signals:
        rough = max(noise / math.sqrt(len(rows)), 0.125 * step)
        if is_clipped(rows.mean(axis=0), noise=rough, stops_on_its_way=slows):
            yield (
                f"{name}: the displacement arrives at its extreme at full speed and stands there, as no mass can: the"
                " sensor clips; amplitude, energy and stops are wrong: enlarge its range"
            )
    yield from _of_the_step(layout, response)


def _of_the_step(layout: Layout, response: Response) -> Iterator[str]:
    size = float(np.median(response.amplitude))
    if response.is_stuck and layout.of_mass.rounding > QUIET * layout.of_mass.step:
        size = 0.5 * float(np.ptp(layout.mass.mean(axis=0)))  # a few levels, shown alike in every cycle, are no noise
    if layout.of_mass.step > COARSE * size > QUIET * layout.of_mass.step:
        step = layout.of_mass.step / size
        few = ", so that it cannot be told whether it moves" if FEW_STEPS * step > 2.0 else ""
        yield (
            f"stops_per_cycle: the sensor's step is {100 * step:.2g} % of the mass's amplitude{few}:"
            " stops, stuck fraction and regime are those of the sensor's steps, and the energy's error is larger than"
            " stated"
        )
    elif not response.is_stuck and _is_blurred(response):
        yield (
            "stops_per_cycle: the sensor's noise and step hide the mass's speed, so that no stop can be told, nor"
            " whether the column is the mass's own displacement or that relative to the base: use a sensor of a"
            " smaller range"
        )


def strokes(how: Smoother) -> int:
    """How often in a mean cycle the mass is fast (above a third of its greatest speed): 2 unless it slows on its way.

    A mass that slows or stops on its way up has steep flanks everywhere, and no corner of them tells a clipping sensor.
    """
    k = np.arange(len(how.mean))
    speed = np.abs(np.fft.irfft(1j * k * how.mean, 1024))
    fast = speed > speed.max() / 3.0
    return int(np.count_nonzero(fast & ~np.roll(fast, 1)))


def _of_settling(layout: Layout, response: Response, settled: float | None, transient: float) -> Iterator[str]:
    if response.is_stuck or len(layout) < FEW_CYCLES:
        return
    if settled is None:
        yield (
            "transient_s: the motion had not settled by the end of the recording; the numbers are of a passing state:"
            " record longer"
        )
    elif settled > transient + 1.0 / layout.drive.frequency:
        yield (
            f"transient_s: the motion settled only {settled:.3g} s after the start; the cut is at {transient:g} s:"
            f" --transient {settled:.3g} cuts there"
        )


def _of_growth(response: Response, settled: float | None, r: float | None) -> Iterator[str]:
    """At resonance friction below pi/4 of k Y bounds nothing [Den Hartog 1931]."""
    part = max(1, len(response.amplitude) // 4)
    first, last = (float(some.mean()) for some in (response.amplitude[:part], response.amplitude[-part:]))
    if settled is None and r is not None and abs(r - 1.0) < RESONANCE and last > GROWS * first:
        yield (
            f"response_amplitude: it still grows ({first:.3g} to {last:.3g} Y) at the frequency ratio {r:.4g}: at"
            " resonance a friction force below pi/4 kY does not bound the motion: these are no numbers of a steady"
            " state: raise the normal force or leave resonance"
        )


def _of_the_motion(layout: Layout, response: Response) -> Iterator[str]:
    power = float(np.einsum("ij,ij->", layout.mass, layout.mass)) / layout.mass.size  # about a mean of 0
    share = float(np.var(layout.mass.mean(axis=0))) / power
    if share < 0.5 and len(layout) >= FEW_CYCLES:
        yield (
            f"drive_frequency_hz: the mass does not answer at the drive's frequency: only {100 * share:.2g} % of its"
            " power repeats with the drive"
        )
    beat = steadiness.beating(response.amplitude, noise=response.amplitude_noise)
    if beat is not None:
        yield (
            f"response_amplitude: the response beats with a period of {beat[0] / layout.drive.frequency:.3g} s"
            f" ({100 * beat[1]:.2g} % of the amplitude)"
        )
    growth = steadiness.growth(response.amplitude, least=GROWTH)
    if growth and len(layout) / layout.drive.frequency < LONG_S:
        yield (
            f"response_amplitude: drifts by {100 * growth:+.2g} % from the first cycle to the last: the contact wears,"
            " or the gain of the mass's sensor changes: one cycle is not the mean: compare --cycles last and all"
        )
    yield from _of_the_clocks(layout, response)
    yield from _of_jumps(layout, response)
    yield from _of_stops(layout, response)
    counts, period = response.stops, layout.foreign.period
    if any(counts[j::period].max() != counts[j::period].min() for j in range(min(period, len(counts)))):
        yield (
            f"stops_per_cycle: not the same in all cycles: {counts.min():g} to {counts.max():g}; stops shorter than"
            f" {100 * response.shortest_stop:.2g} % of a cycle cannot be told from a slow passage here"
        )


def _of_stops(layout: Layout, response: Response) -> Iterator[str]:
    """What may be one and what may be none; one of a motion whose halves mirror each other has a twin."""
    often, length = response.doubtful
    if often >= OFTEN and not _is_blurred(response):
        yield (
            f"stops_per_cycle: {often:.2g} times a cycle the mass nearly stands, for about {100.0 * length:.2g} %:"
            " too short to tell a stop from a slow passage here (surely told from"
            f" {100.0 * response.shortest_stop:.2g} % on), and not counted: a faster or quieter sensor would tell"
        )
    move = response.unclear
    if move is not None:
        yield (
            f"stops_per_cycle: within a stop of {100.0 * move.length:.2g} % of a cycle the mass moves by"
            f" {move.way:.1g} Y: two stops parted by a slip, or one with a creep or a slow passage; the sensor does not"
            " tell which, and the count may be off by it"
        )
    count = round(response.stops_per_cycle)
    is_odd = count % 2 == 1 and abs(response.stops_per_cycle - count) < SAME_COUNT
    if is_odd and response.asymmetry < MIRRORED and layout.foreign.period == 1:
        yield (
            f"stops_per_cycle: {count}, where the halves of the cycle mirror each other (to"
            f" {100.0 * response.asymmetry:.2g} %) and stops come in pairs: one of them was too short to be seen, or is"
            " a slow passage"
        )


def _of_the_clocks(layout: Layout, response: Response) -> Iterator[str]:
    """A sample lost in one channel moves all that follows against the other."""
    stride, points = max(1, layout.mass.shape[1] // 64), layout.mass.shape[1]
    rows = layout.mass[:, ::stride]
    turn = 2.0 * math.pi * stride * np.arange(rows.shape[1]) / points
    late = np.unwrap(-np.angle(first_harmonic(rows, turn))) * layout.samples / (2.0 * math.pi)
    noise = math.hypot(layout.of_mass.noise / max(float(np.median(response.amplitude)), 1e-300), layout.of_base.noise)
    rough = noise * math.sqrt(2.0 / rows.shape[1]) * layout.samples / (2.0 * math.pi)
    found = steadiness.jumps(late, noise=rough, least=0.5).tolist() if layout.foreign.period == 1 else []
    for j in found:
        by = float(np.median(late[j : j + 5]) - np.median(late[max(0, j - 5) : j]))
        size = np.ptp(response.amplitude[max(0, j - 5) : j + 5]) / float(np.median(response.amplitude))
        if abs(by - round(by)) < WHOLE and size < SAME_SIZE:
            channel = "mass" if by < 0.0 else "base"
            yield (
                f"energy_per_cycle: from {layout.time[j]:.4g} s on the mass comes {abs(by):.2g} samples"
                f" {'earlier' if by < 0.0 else 'later'} than before: as if samples had been lost in the {channel}'s"
                " channel; the energies before and after differ: cut the log there, or give the channels their own"
                " times"
            )


def _of_jumps(layout: Layout, response: Response) -> Iterator[str]:
    size = float(np.median(response.amplitude))
    for name, series in (("amplitude", response.amplitude), ("mean position", response.position)):
        found = steadiness.jumps(series / size, noise=response.amplitude_noise / size)
        if len(found):
            times = ", ".join(f"{layout.time[j]:.4g} s" for j in found[:MANY])
            more = f" and {len(found) - MANY} more" if len(found) > MANY else ""
            yield f"response_amplitude: the {name} of the response jumps at {times}{more}"
