"""What must be said about a measurement: each sentence names the quantity it is about, and times where it can.

Mistakes of a channel are among them: inverted, swapped, a copy, relative to the base, only noise, or clipped.
"""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from frictionlab.analysis import steadiness
from frictionlab.analysis.channels import other_masses
from frictionlab.analysis.cycles import first_harmonic
from frictionlab.analysis.layout import HARMONICS, VELOCITY, Layout
from frictionlab.analysis.signals import Stretch
from frictionlab.analysis.spectrum import LEAST, Line, mains_of
from frictionlab.analysis.stops import TURN
from frictionlab.arrays import FloatArray, shifted
from frictionlab.errors import DOUBTED, NO_FREQUENCY
from frictionlab.schema import ENERGY

if TYPE_CHECKING:
    from frictionlab.analysis.measurement import Measurement

FEW_CYCLES = 5
ASIDE = 0.06  # of the frequency ratio asked for, of 1 where it is less: names are rounded
QUIET = 0.01  # rounding that noise does not average away, over the step: a sensor that shows the same in every cycle
COARSE, FINE_STEP = 0.02, 0.005  # of the amplitude: a sensor's step that is said, and one that no noise hides
FEW_SAMPLES = 40  # a cycle; below it the stops and the loop's area lose their accuracy
REACHED = 1.3  # times the friction force that energy gives; a dashpot's is 1.2
MANY = 6  # times named in one sentence


def warnings(
    m: "Measurement", parts: Sequence[Stretch], cut: float, known: tuple[float | None, float, bool, bool], asked: object
) -> list[str]:
    """Say what a reader of the numbers must know.

    ``parts``: driven ones; ``cut``: what the mass's filter cuts away, by `channels.cut_away`; ``known``: that filter's
    cut-off [Hz], the frame's damping ratio, whether the wall goes with the base, whether the frame is of one mass;
    ``asked``: frequency ratio by name.
    """
    layout, r, (stepped, jumps) = m.layout, m.frequency_ratio, steadiness.steps(parts)
    cutoff, zeta, wall_moves, is_one = known
    prescribed = m.energy.value is None  # the motion of the mass is given, and stands in the base's place
    said = [*(stepped or jumps), *_of_the_drive(layout, r, is_even=not stepped, prescribed=prescribed)]
    said += _of_lines(layout, "motion" if prescribed else "base")
    if not prescribed:
        said = [*_of_the_channels(layout, m, wall_moves=wall_moves), *said]
    if is_one and m.cycle.others:
        off = 100.0 * float(np.std(m.cycle.others[0].mass - m.cycle.mass)) / max(float(np.std(m.cycle.mass)), 1e-12)
        both = "if both see one mass, give both columns (ingest --mass 2+3, or mass in [log]); else [[rig.masses]]"
        said.append(f"mass: mass_2_displacement, {off:.3g} % off it (rms), is left out: {both}")
    said += _of_the_sampling(layout, m, prescribed=prescribed)
    if not m.is_stuck:
        said += (*_of_changes(layout, m, is_even=not (stepped or jumps)), *_of_stops(m))
    stretched = float(np.mean(shifted(m.cycle.mass_smooth - m.cycle.base, order=1) ** 2))
    taken = 4.0 * math.pi * zeta * (r or 0.0) * stretched  # by the frame's dashpot, k Y^2
    said += _of_the_load_cell(m, taken)
    if isinstance(asked, float) and r is not None and abs(r - asked) > ASIDE * max(1.0, asked):
        said.append(f"frequency_ratio: {r:.3g} is driven, {asked:g} by its name, sheet or scene: is it another test?")
    said += [f"frequency_ratio: {NO_FREQUENCY}"] * (r is None and not prescribed)
    if cutoff is not None and cut >= 0.002 * m.size:
        said.append(
            f"response_amplitude: the mass's filter ({cutoff:.4g} Hz; mass_filter_hz in [sensors]) may cut away"
            f" {cut:.1g} Y, and make stops_per_cycle and regime wrong: record with a higher cut-off"
        )
    return said


def _of_the_drive(layout: Layout, r: float | None, *, is_even: bool, prescribed: bool) -> Iterator[str]:
    drive, distortion = layout.drive, layout.drive.distortion
    if r is not None and not 0.02 <= r <= 5.0:
        yield f"frequency_ratio: {r:.3g} lies outside 0.02 to 5: check --natural-frequency and time_unit in [log]"
    if drive.amplitude > LARGEST_BASE_M and not prescribed:
        yield f"base_amplitude_m: {drive.amplitude:.3g} m: {DOUBTED} (--unit)"
    if distortion > 0.05 and not prescribed:
        said = f"harmonics 2-{HARMONICS} of the base are {100 * distortion:.2g} % of its fundamental"
        yield f"base_distortion: {said}: the prediction of a recording takes them in, that of a row of numbers cannot"
    if drive.drifts and drive.wander > 0.002 * TURN and is_even:
        yield f"drive_frequency_hz: the drive is not even; its phase wanders by {drive.wander / TURN:.2g} of a cycle"
    if drive.growth and is_even:
        yield f"base_amplitude_m: the base's amplitude drifts by {100 * drive.growth:+.2g} %: check its sensor's gain"


def _of_lines(layout: Layout, driver: str) -> Iterator[str]:
    """Of lines that are no harmonics of the drive, and of hum that may stand on one."""
    foreign, hz = layout.foreign, layout.drive.frequency

    def share(amplitude: float, size: str = "amplitude") -> str:
        return f"{100.0 * amplitude / layout.drive.amplitude:.2g} % of the {driver}'s {size}"

    def of(line: Line, size: str = "amplitude") -> str:
        return f"at {line.frequency:.5g} Hz, {share(line.amplitude, size)}"

    faint = LEAST * layout.drive.amplitude
    for name, column in ("mass", "response_amplitude"), ("base", "base_amplitude_m"), (VELOCITY, "stops_per_cycle"):
        size = "speed" if name == VELOCITY else "amplitude"
        for line in foreign.lines.get(name, ())[:MANY]:
            if line.removed and line.amplitude > faint:
                origin = mains_of(line) or "no harmonic of the drive"
                yield f"{column}: a line {of(line, size)}, {origin}, is taken out: look for its source"
    for line in foreign.on_harmonics[:MANY]:
        yield (
            f"response_amplitude: harmonic {round(line.frequency / hz)} of the drive, {of(line)}, stands out, perhaps"
            f" {mains_of(line) or 'a contact that rings'}: stops_per_cycle may be wrong by it: drive a little faster"
        )
    if foreign.masked > faint and not foreign.on_harmonics:
        yield f"response_amplitude: hum, up to {share(foreign.masked)}, may hide in a harmonic: drive a little faster"
    low, order = layout.second_motion
    if low is None:
        return
    every, rate = 1.0 / abs(low.frequency - max(round(low.frequency / hz), 1) * hz), layout.samples * hz
    if order:
        yield (
            f"sampling_rate_hz: the line {of(low)}, is harmonic {order:.0f} of the drive, folded down by"
            f" {rate:.4g} samples a second: record faster, or filter before sampling"
        )
    else:
        yield f"response_amplitude: beats: a second motion {of(low)}, comes and goes every {every:.3g} s (--cycles all)"


def _of_the_sampling(layout: Layout, m: "Measurement", *, prescribed: bool) -> Iterator[str]:
    """Of few cycles and samples, and of a sensor that clips, is coarse, or too noisy to show a stop."""
    if len(layout) < FEW_CYCLES:
        yield f"cycles: only {len(layout)} full cycles after the transient, {FEW_CYCLES} show a scatter: record longer"
    if layout.samples < FEW_SAMPLES:
        yield f"sampling_rate_hz: {layout.samples:.3g} samples a cycle; energy and stops ask for {FEW_SAMPLES}"
    if prescribed:
        return
    of_mass, signals = layout.of_mass, [("base_amplitude_m", layout.base, layout.of_base, False)]
    if not m.is_stuck:
        # a mass that slows or stops on its way up has steep flanks everywhere, and no corner shows a clipping sensor
        speed = np.abs(m.how.cycle(1024)[1])
        fast = speed > speed.max() / 3.0
        slows = m.stops_per_cycle >= 2.5 or int(np.count_nonzero(fast & ~np.roll(fast, 1))) > 2
        signals.append(("response_amplitude", layout.mass, of_mass, slows))
    for name, rows, sensor, slows in signals:
        rough = max(sensor.noise / math.sqrt(len(rows)), 0.125 * sensor.step)
        if is_clipped(rows.mean(axis=0), noise=rough, stops_on_its_way=slows):
            yield f"{name}: the sensor clips, and amplitude, energy and stops are wrong: enlarge its range"
    size = m.size
    if m.is_stuck and of_mass.rounding > QUIET * of_mass.step:
        size = 0.5 * float(np.ptp(layout.mass.mean(axis=0)))  # a few levels, shown alike in every cycle, are no noise
    step = of_mass.step / max(size, 1e-300)
    if (FINE_STEP if of_mass.is_stepped else COARSE) < step < COARSE / QUIET:
        few = ", too coarse to say whether it moves" if 2.5 * step > 2.0 else ""  # fewer steps across
        coarse = ", the energy's error is larger than stated" if step > COARSE else ": use a finer sensor"
        yield (
            f"stops_per_cycle: the sensor's step is {100 * step:.2g} % of the mass's amplitude{few}: stops and regime"
            f" are of its steps{coarse}"
        )
    elif not m.is_stuck and m.is_blurred:
        yield (
            "stops_per_cycle: the sensor's noise hides the speed: no stop can be seen, nor whether the column is"
            " relative to the base: use a sensor of a smaller range"
        )


def _of_changes(layout: Layout, m: "Measurement", *, is_even: bool) -> Iterator[str]:
    """Of a mass that has not settled, does not follow the drive, drifts, or whose channel loses samples."""
    at = m.settles_later_s if is_even else None
    growth, by_energy = (is_even * steadiness.growth(s, least=0.005) for s in (m.series.amplitude, m.series.energy))
    drift = steadiness.drift(layout.mass.mean(axis=1)) or steadiness.drift(layout.base.mean(axis=1))
    if at == math.inf and drift and not (growth or by_energy):
        cause = "a sensor that warms up, or a frame that gives way; amplitude and energy leave it out"
        yield f"transient_s: the mean position of mass or base drifts evenly, by {drift:+.2g} Y: {cause}"
    elif at == math.inf:
        yield f"transient_s: the motion had not settled; measured is from {m.transient_s:.3g} s on: record longer"
    elif at is not None:
        yield f"transient_s: the motion settled only at {at:.4g} s, not {m.transient_s:g}: --transient {at:.4g}"
    power = float(np.einsum("ij,ij->", layout.mass, layout.mass)) / layout.mass.size  # about a mean of 0
    share, size = float(np.var(layout.mass.mean(axis=0))) / power, m.size
    if share < 0.5 and len(layout) >= FEW_CYCLES:
        yield f"drive_frequency_hz: only {100 * share:.2g} % of the mass's power repeats with it: check the column"
    if layout.duration >= steadiness.LONG_S and (growth or by_energy):
        name, change = ("response_amplitude", growth) if abs(growth) > abs(by_energy) else (ENERGY, by_energy)
        yield f"{name}: drifts by {100 * change:+.2g} %: friction changes, and means are of all cycles measured"
    elif growth:
        yield f"response_amplitude: drifts by {100 * growth:+.2g} %: wear, or a sensor: compare --cycles last and all"
    # a sample lost in one channel moves all that follows against the other
    stride, points = max(1, layout.mass.shape[1] // 64), layout.mass.shape[1]
    rows, a_sample = layout.mass[:, ::stride], TURN / layout.samples
    angle = TURN * stride * np.arange(rows.shape[1]) / points
    behind = np.unwrap(-np.angle(first_harmonic(rows, angle))) / a_sample
    noise = math.hypot(layout.of_mass.noise / max(size, 1e-300), layout.of_base.noise)
    rough = noise * math.sqrt(2.0 / rows.shape[1]) / a_sample
    for j in steadiness.jumps(behind, noise=rough, least=0.5).tolist():
        by = float(np.median(behind[j : j + 5]) - np.median(behind[max(0, j - 5) : j]))
        change = np.ptp(m.series.amplitude[max(0, j - 5) : j + 5]) / size
        if abs(by - round(by)) < 0.2 and change < 0.02:  # of the clock, not of the motion
            when, where = ("earlier", "mass") if by < 0.0 else ("later", "base")
            yield (
                f"{ENERGY}: from {layout.time[j]:.4g} s on the mass comes {abs(by):.2g} samples {when} (lost in the"
                f" {where}'s channel?): cut the log there, or give the channels their own times"
            )


def _of_stops(m: "Measurement") -> Iterator[str]:
    """Which may be none or two; one of a motion whose halves mirror each other has a twin."""
    often, length = m.doubtful
    seen = f"stops are seen from {100.0 * m.shortest_stop:.2g} % of a cycle on"
    if often >= 0.4 and not m.is_blurred:
        nearly = f"{often:.2g} times a cycle the mass nearly stands, for about {100.0 * length:.2g} %"
        yield f"stops_per_cycle: {nearly}: not counted, for {seen}: take a quieter sensor"
    if m.unclear is not None:
        way, length = m.unclear
        yield (
            f"stops_per_cycle: within a stop of {100.0 * length:.2g} % of a cycle the mass moves by {way:.1g} Y: two"
            " stops parted by a slip, or one with a creep or a slow passage"
        )
    count = round(m.stops_per_cycle)
    if count % 2 == 1 and abs(m.stops_per_cycle - count) < 0.05 and (m.asymmetry or 0.0) < 0.01:
        yield f"stops_per_cycle: {count}, of halves that mirror each other, where stops come in pairs: one was not seen"
    each = m.series.stops
    if np.ptp(each) > 0.0:
        yield f"stops_per_cycle: from {each.min():g} to {each.max():g} in a cycle; {seen}"


def _of_the_load_cell(m: "Measurement", taken: float) -> Iterator[str]:
    """Say where force and its energy, and the loops of force and motion, disagree; ``taken``: by the frame, k Y^2."""
    by_force, loop, mean = m.force_energy_j, m.energy, m.measured_force.value
    reached = 0.0 if m.cycle.force is None else float(np.percentile(np.abs(m.cycle.force), 80.0))
    if mean and reached > REACHED * mean:
        yield (
            f"measured_friction_force_n: energy over the way gives {mean:.3g} N, yet the force reaches {reached:.3g} N,"
            " as where the contact yields before it slides (compare-numeric --law auto finds its friction) or a mass"
            " moves with the cell (force_inertia_kg in [sensors])"
        )
    if not (m.energy_per_cycle_j and loop.value and by_force.value):
        return
    scale = m.energy_per_cycle_j / loop.value  # k Y^2 in J
    by_motion = (loop.value - taken) * scale
    apart = by_force.value - by_motion
    u = math.hypot(by_force.error or 0.0, (loop.error or 0.0) * scale)
    if abs(apart) > max(3.0 * u, 0.02 * abs(by_motion)):
        share = 100.0 * apart / by_motion
        yield (
            f"force_{ENERGY}: the load cell gives {by_force.value:.3g} J, {float(f'{share:.2g}'):+g} % off"
            " the loop's: check its gain and place, and stiffness_n_per_m and damping_ratio in [rig]"
        )


# Channels that are not what they are called --------------------------------------------------------------------------

LARGEST_BASE_M = 0.5  # of a base that moves a frame with a contact
SMALL = 5e-3  # times the amplitude without friction: so little is a unit of another channel, or a contact that holds
OFF, FITS, CLEARER = 0.1, 0.3, 2.0  # what friction leaves of the force where the mass never stops, one over the other


def _of_the_channels(layout: Layout, m: "Measurement", *, wall_moves: bool) -> Iterator[str]:
    mass, base = layout.mass.mean(axis=0), layout.base.mean(axis=0)
    of_mass, of_base = layout.of_mass, layout.of_base
    if m.is_stuck:
        if np.ptp(layout.mass) < 1e-9:
            yield "mass: its channel shows one number, not even noise: is its sensor dead, or its beam broken?"
        if of_mass.noise >= 10.0 * max(of_base.noise, of_base.step):
            yield f"mass: its channel holds nothing but noise of {of_mass.noise:.3g} Y rms: check its column (--mass)"
        return
    both = of_mass.beside(of_base)
    noise = math.hypot(both.noise / math.sqrt(len(layout)), both.shared)
    apart = math.sqrt(max(float(np.var(mass - base)) - noise * noise, 0.0)) / float(np.std(base))
    r, energy = None if wall_moves or other_masses(layout.more) else m.frequency_ratio, m.energy_per_cycle
    free = math.inf if r is None else 1.0 / max(abs(1.0 - r * r), 0.02)  # amplitude of one mass without friction
    if apart < 0.005:  # no frame with a contact follows its base so closely
        yield f"mass: its channel repeats the base's (to {100.0 * apart:.2g} %): choose its column (--mass, [log] mass)"
    elif energy <= -max(5.0 * (m.energy.se or 0.0), m.energy.u or 0.0, 0.01):  # unless by a lag that is not known
        size = [np.abs(np.fft.rfft(cycle)[1 : HARMONICS + 1]) for cycle in (mass, base)]
        of_m, of_b = (float(np.linalg.norm(lines[1:]) / max(float(lines[0]), 1e-300)) for lines in size)
        cause = "a sensor counts the other way (--units mass=-mm), or mass and base are swapped (--mass and --base)"
        if of_b > 0.02 and of_m < 0.3 * of_b:  # friction makes harmonics, a motor fewer
            shares = f"harmonics of the base {100.0 * of_b:.2g} %, of the mass {100.0 * of_m:.2g} %"
            cause = f"mass and base look swapped ({shares}): exchange --mass and --base ([log]), or turn one's sign"
        yield f"{ENERGY}: {energy:.3g} kY^2: a contact takes energy, this one would give it: {cause}"
    elif m.size > 5.0 * free:
        without = f"{free:.3g} Y without friction at r = {r:.3g}"
        yield f"response_amplitude: {m.size:.3g} Y, but {without}: {DOUBTED} (--unit), or the natural frequency"
    elif r is not None and m.size < SMALL * free and _left(mass, base, r) > CLEARER * _left(1e3 * mass, base, r):
        fits = "a thousand times as much fits the equation of motion"
        yield f"response_amplitude: {m.size:.3g} Y, and {fits}: {DOUBTED} (--units mass=mm,base=mm, as each is)"
    elif r is not None and not m.is_blurred:
        yield from _relative(mass, base, m.stuck_fraction, r)


def _relative(mass: FloatArray, base: FloatArray, stuck: float, r: float) -> Iterator[str]:
    """Say that a mean cycle of the mass (p,), which stands for the fraction ``stuck``, looks like x - y or y - x."""
    own, width = _left(mass, base, r), max(1, len(mass) // 128)
    for word, other in (("+", base + mass), ("-", base - mass)):
        speeds = [np.abs(each[width:] - each[:-width]) for each in (other, mass)]
        stands, creeps = (float(np.mean(speed < 0.05 * speed.max())) for speed in speeds)
        others, stands = _left(other, base, r), stands if np.std(other) > 0.05 * np.std(base) else 0.0
        why = ""
        # a cosine stands for 0.03; crosstalk of the base leaves a mass that fits far better than what it would be
        if own > FITS and others < 1.2 * own and stands > max(0.08, 4.0 * stuck, 2.0 * creeps):
            why = f"mass {word} base stands for {100.0 * stands:.2g} % of a cycle, the column for {100.0 * stuck:.2g} %"
        elif others < FITS and own > max(OFF, CLEARER * others) and stuck == 0.0:
            why = f"mass {word} base fits the equation of motion"
        if why:
            yield (
                f"response_amplitude: the column looks like the displacement relative to the base ({why}): give the"
                f" mass's own displacement, mass {word} base"
            )
            return


def _left(mass: FloatArray, base: FloatArray, r: float) -> float:
    """What friction along the motion, also one that grows with place, leaves of the force f - x - r^2 x'', 0 to 1."""
    x, f = (np.fft.rfft(cycle)[1:6] for cycle in (mass, base))
    k = np.arange(1, 6)
    speed = np.fft.irfft(np.concatenate([[0.0], 1j * k * x]), 512)
    place = np.fft.irfft(np.concatenate([[0.0], x]), 512)
    kinds = np.sign(speed) * np.array([np.ones(512), place / max(float(np.abs(place).max()), 1e-300)])
    against = np.fft.rfft(kinds)[:, 1:6]
    both = np.concatenate([against.real, against.imag], axis=1)
    near = r * (1.0 + np.linspace(-0.015, 0.015, 7)[:, None])  # as far as the natural frequency may be from the known
    force = f - (1.0 - (near * k) ** 2) * x
    parts = np.concatenate([force.real, force.imag], axis=1)
    share = np.linalg.solve(both @ both.T, both @ parts.T)
    left = np.linalg.norm(parts - share.T @ both, axis=1) / np.linalg.norm(parts, axis=1)
    return float(np.where(share[0] > 0.0, left, 1.0).min())


# A sensor that clips -------------------------------------------------------------------------------------------------

LEVELS = (0.01, 0.04, 0.16)  # depths below an extreme, as shares of the whole stroke
SCALES = {1.0: 2.5, 1 / 4: 2.3, 1 / 16: 2.35}  # of the levels, and the sharpness no motion has
FINE = {1 / 4: 2.6, 1 / 16: 2.6}  # near enough to the extreme that stops on the way there do not count
"""2 for any motion whose speed passes through zero (2.2 at most for 1,900 motions of the simulator), 4 for a corner."""
POINTS = 20.0  # of a cycle over the root of the scale; below it the levels lie within a point of the extreme


def is_clipped(cycle: FloatArray, *, noise: float, stops_on_its_way: bool = False) -> bool:
    """Whether a mean cycle (p,), equally spaced in phase, is cut off at one of its extremes.

    Near a true extreme, a stop included, the depth grows with the square of the time, so that from 4 to 16 % of the
    stroke takes twice as long as from 1 to 4 %; a signal cut off arrives with its full speed: up to four times. Both
    flanks must have the corner. Little cut off shows only close to the extreme: the same is asked at a quarter and a
    sixteenth of these depths, where the points are enough. What is cut off is flat, so that it stays above the first
    level longer than it takes to the second: a triangle does not. ``noise``: rms left in one point;
    ``stops_on_its_way``: the mass slows between its extremes, so that its flanks are steep everywhere.
    """
    stroke = float(np.ptp(cycle))
    if not stroke > 0.0:
        return False
    asked = [
        (scale, sharpest)
        for scale, sharpest in (FINE if stops_on_its_way else SCALES).items()
        if 8.0 * noise <= scale * LEVELS[0] * stroke and cycle.size * scale**0.5 >= POINTS
    ]
    for side in (cycle / stroke, -cycle / stroke):
        depths = [side.max() - np.roll(flank, -int(np.argmax(flank))) for flank in (side, side[::-1])]
        for scale, sharpest in asked:
            first, second, third = np.transpose([_passed(depth, scale) for depth in depths])
            sharp = (third - second > sharpest * (second - first)).all()
            if sharp and float((2.0 * first - second).sum()) > 2.0:  # points: a sharp peak may lie between two of them
                return True
    return False


def _passed(depth: FloatArray, scale: float) -> tuple[float, float, float]:
    """When (points) a depth passes the three levels, the last time on its first way down; 0 for what rings back."""
    passed = []
    for level in (scale * level for level in LEVELS):  # last, on the first way down to the next
        below = int(np.argmax(depth > 1.5 * level))
        above = below - 1 - int(np.argmax(depth[:below][::-1] <= level))
        passed.append(float(above + (level - depth[above]) / (depth[above + 1] - depth[above])))
    first, second, third = passed
    flank = depth[int(first) : int(third) + 1]
    if np.any(np.maximum.accumulate(flank) - flank > 0.5 * scale * LEVELS[0]):  # it rings beside its extreme
        return 0.0, 0.0, 0.0
    return first, second, third
