"""How the mass answers, cycle by cycle: noise taken off, energy, amplitude, position, stops and regime.

Energy per cycle is the area of the hysteresis loop, eq. (2.18). A load cell at the contact gives energy, friction force
and coefficient without a model. The energy is the loop of force over displacement, ``E = integral F dx`` once round;
what a mass between sensor and contact adds, ``m x''``, closes to nothing in it. The friction force is that energy over
the way, ``E / integral |dx|``, a mean over the way of sliding, and the coefficient is ``E / integral N |dx|``.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis import channels, steadiness, stops
from frictionlab.analysis.cycles import BLOCK, INTERPOLATED, SHARP, Smoother, chunks, smoothed, smoother, some_cycles
from frictionlab.analysis.layout import JUMPS, VELOCITY, Layout, slow_wander
from frictionlab.analysis.stops import Move, Thresholds
from frictionlab.arrays import ComplexArray, FloatArray, shifted
from frictionlab.uncertainty import NOT_KNOWN, Estimate, Sources, unit_uncertainty

CLEAR = 3.0  # errors of a mass that moves with a load cell, from which it is said
SLIDES = 0.1  # of its largest speed: slower, a contact may stand or turn
FEWEST_POINTS = 32  # of a cycle where the contact slides, from which a mass between it and the cell is looked for
BLUNT = 0.003  # of the acceleration, by which that of a smoothed motion may be off
HEAVY = 0.01  # of the friction force: what a mass adds less is not said
VARIES, FEWEST_PRESSED = 16.0, 4  # variances of a harmonic of the normal force, and cycles, from which it varies
FINE = 512  # points a cycle, at least, on which stops and extremes are looked for


@dataclass(frozen=True)
class CycleSeries:
    """One value per full steady cycle, arrays (n,): ``time`` of its start [s]; ``used``: by the energy rule.

    ``energy`` (k Y^2), ``amplitude`` (Y), ``position``: mean of x/Y in the cycle about the whole mean,
    ``stops``: stops that begin in the cycle, ``stuck``: fraction of the cycle standing.
    """

    time: FloatArray
    used: NDArray[np.bool_]
    energy: FloatArray
    amplitude: FloatArray
    position: FloatArray
    stops: FloatArray
    stuck: FloatArray


@dataclass(frozen=True, kw_only=True)
class Response:
    """How the mass answers: what is known of each cycle (n,), and of all.

    ``series``: of each cycle; ``found``: each stop; ``energy_noise``, ``amplitude_noise``: standard error of one
    cycle's value from sensor noise alone; ``energy_shared``: standard error that all cycles have in common;
    ``stops_per_cycle``, ``stuck_fraction``, ``regime``: over all cycles; ``asymmetry``: rms of the even part of the
    mean cycle over its rms; ``irregularity_index``, ``irregularity_floor``, ``base_irregularity_index``: eq. (4.1), and
    what noise alone would give; None where the mass does not move, or of one cycle; ``how``: the smoother of all
    cycles; ``shortest_stop``: shortest stop that differs from a slow passage, in cycles (1: none can); ``doubtful``:
    pauses of a cycle that are too short to be sure, and their mean length in cycles; ``unclear``: a move within a stop
    that may part it or not.
    """

    series: CycleSeries
    found: FloatArray
    energy_noise: float
    energy_shared: float
    amplitude_noise: float
    stops_per_cycle: float
    stuck_fraction: float
    regime: str
    asymmetry: float | None
    irregularity_index: float | None
    irregularity_floor: float | None
    base_irregularity_index: float | None
    shortest_stop: float
    doubtful: tuple[float, float]
    unclear: Move | None
    how: Smoother

    @property
    def size(self) -> float:
        """Usual amplitude of a cycle, Y."""
        return float(np.median(self.series.amplitude))

    @property
    def is_blurred(self) -> bool:
        """Whether no stop can be seen: how long the mass stands is not known then, and 0 is no finding."""
        return self.shortest_stop >= 1.0

    @property
    def is_stuck(self) -> bool:
        """Whether the mass does not move by more than its sensor's noise."""
        return self.regime == "stuck"


def response(layout: Layout, used: slice, *, wall_moves: bool = False) -> Response:
    """Measure the mass's answer from steady cycles; a wall that goes with the base: stops are relative to the base.

    ``used``: those that the energy rule takes.
    """
    of_mass, of_base, n = layout.of_mass, layout.of_base, len(layout)
    points, rounding = max(FINE, layout.mass.shape[1]), 1e-14 * (1.0 + abs(layout.offset) / layout.drive.amplitude)
    how = smoother(layout.mass, of_mass, layout.samples)
    slid, sliding, sensor = layout.mass, how, of_mass
    if wall_moves:
        slid, sensor = layout.mass - layout.base, of_mass.beside(of_base)
        sliding = smoother(slid, sensor, layout.samples)
    x, v = smoothed(slid, sliding, points)
    thresholds = Thresholds.of(sliding.v_noise, sliding.resolution)
    if layout.of_velocity is not None and not wall_moves:
        rows = layout.more[VELOCITY] / (2.0 * math.pi * layout.drive.frequency * layout.drive.amplitude)
        of_speed = smoother(rows, layout.of_velocity, layout.samples)
        v = smoothed(rows, of_speed, points)[0]
        thresholds = Thresholds.of(math.hypot(of_speed.x_noise, of_speed.x_tail), of_speed.resolution)
    found, doubts = stops.stops_of(stops.pauses(v, thresholds.still), thresholds, points)
    whole, slide = half_range(x), half_range(levelled(x, found, sliding.resolution))
    rough, unclear = math.hypot(sensor.noise / math.sqrt(n), sensor.shared), None
    if n >= 5:  # whose mean shows a slip within a stop
        found, unclear = stops.parted(found, slid.mean(axis=0), noise=rough, dwell=thresholds.dwell, cycles=n)
    is_blurred = float(np.median(slide)) < 0.5 * float(np.median(whole))
    if is_blurred:  # a threshold above the mass's own speed makes one stop of all
        found, slide, unclear = np.zeros((2, 0)), whole, None
    is_stuck = float(np.median(slide)) < 4.0 * sensor.noise + rounding
    count, stuck = (np.zeros(n), np.ones(n)) if is_stuck else stops.per_cycle(found, n)
    if wall_moves:  # the mass itself stands nowhere
        slide = whole = half_range(smoothed(layout.mass, how, points)[0])
    means, areas, power, number = layout.base.mean(axis=1), np.empty(n), np.abs(how.mean[1:]) ** 2, np.arange(n)
    for some in chunks(n, layout.mass.shape[1], BLOCK):  # without the slow wander: a sensor that drifts adds no energy
        wander = slow_wander(means, layout.mass.shape[1], layout.blocks, some)
        areas[some] = loop_area(layout.mass[some], layout.base[some] - wander)
    energy_noise, energy_shared = _energy_noises(layout, how, found, float(np.mean(areas)))
    index = None if is_stuck else steadiness.irregularity_index(layout.mass, layout.blocks)
    left = of_mass.left(layout.samples, np.arange(1.0, max(2.0, 0.5 * layout.samples)))
    between = INTERPOLATED if layout.samples >= SHARP else 1.0
    floor = steadiness.irregularity_floor(layout.mass, of_mass.noise * math.sqrt(between * float(left.mean())))
    is_used = (number >= used.start) & (number < used.stop)
    return Response(
        series=CycleSeries(layout.time, is_used, areas, slide, layout.mass.mean(axis=1), count, stuck),
        found=found,
        energy_noise=energy_noise,
        energy_shared=energy_shared,
        amplitude_noise=_amplitude_noise(
            layout, how if wall_moves else sliding, float(np.mean(slide)), float(np.mean(whole))
        ),
        stops_per_cycle=float(count.mean()),
        stuck_fraction=float(stuck.mean()),
        regime="stuck" if is_stuck else "stick-slip" if count.mean() >= 0.5 else "continuous",
        asymmetry=None if is_stuck else math.sqrt(float(power[1::2].sum() / max(power.sum(), 1e-300))),
        irregularity_index=index,
        irregularity_floor=None if index is None else floor,
        base_irregularity_index=steadiness.irregularity_index(layout.base, layout.blocks),
        how=how,
        shortest_stop=1.0 if is_blurred else 2.0 * thresholds.dwell / stops.TURN,
        doubtful=(len(doubts) / n, float(np.mean(doubts)) / stops.TURN if len(doubts) else 0.0),
        unclear=None if is_stuck else unclear,
    )


def _amplitude_noise(layout: Layout, how: Smoother, amplitude: float, whole: float) -> float:
    """Standard error of one cycle's amplitude, by the mean one, and that with stops not levelled."""
    return math.hypot(
        how.x_noise / (1.0 if layout.of_mass.second else math.sqrt(2.0)),  # what two sensors leave is slow: odd
        how.x_tail,
        layout.of_mass.rounding / math.sqrt(2.0),
        layout.left,
        max(0.0, whole - amplitude - how.x_tail),  # a stop that begins as a slow passage
        amplitude * layout.drive.amplitude_se / layout.drive.amplitude,  # of the unit
    )


def _energy_noises(layout: Layout, how: Smoother, found: FloatArray, mean: float) -> tuple[float, float]:
    """Standard errors of energy (k Y^2): of one cycle by white noise, and of all in common; ``mean`` of all."""
    mass, base, base_cycle = layout.of_mass, layout.of_base, layout.base.mean(axis=0)
    white, shared = (
        loop_area_noise(how.cycle(len(base_cycle))[0], base_cycle, *noises, layout.samples)
        for noises in ((mass.slow(layout.samples), base.slow(layout.samples)), (mass.shared, base.shared))
    )
    way = np.diff(np.sin(found), axis=0)  # of the base (Y) during each stop: there one error stays
    stays = mass.rounding * math.sqrt(float(np.sum(way * way)) / len(layout))
    return white, math.hypot(shared, stays, mean * layout.drive.growth * steadiness.OF_A_RAMP)


def levelled(x: FloatArray, found: FloatArray, margin: float) -> FloatArray:
    """Replace each stop, and the smoothing's overshoot within ``margin`` (rad) of a long one, by its mean."""
    scale, flat = x.shape[1] / stops.TURN, x.ravel().copy()
    wrapped = np.maximum(found - stops.TURN * len(x), 0.0)  # of a stop that goes on at the record's beginning
    for begin, end in zip(*(np.concatenate([found, wrapped], axis=1) * scale).tolist(), strict=True):
        first, last = math.ceil(begin), min(math.floor(end), x.size)
        if last - first >= 2:
            reach = math.ceil(margin * scale) if last - first > 2.0 * margin * scale else 0
            flat[max(first - reach, 0) : last + reach] = x.ravel()[first:last].mean()
    return flat.reshape(x.shape)


def half_range(x: FloatArray) -> FloatArray:
    """(max - min) / 2 of each row; an extreme that is not flat is refined by a parabola through three points."""
    summits, row = [], np.arange(len(x))
    for side in (x, -x):
        top = np.argmax(side, axis=1)
        left, middle, right, beyond = (side[row, (top + step) % x.shape[1]] for step in (-1, 0, 1, 2))
        curvature = left - 2.0 * middle + right
        is_peak = (curvature < 0.0) & ~((right == middle) & (beyond == middle))
        safe = np.where(is_peak, curvature, -1.0)
        summits.append(np.where(is_peak, middle - 0.125 * (left - right) ** 2 / safe, middle))
    return np.asarray(0.5 * (summits[0] + summits[1]))


# The mean cycle and its single cycles ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class OtherMass:
    """A further mass in the same cycles: its mean cycle ``mass`` (p,) and single cycles ``each`` (n, K), as `Cycle`."""

    mass: FloatArray
    each: NDArray[np.complex128]


@dataclass(frozen=True)
class LoadCell:
    """The measured force in single steady cycles ``each`` (n, p) N, as `Cycle.force`, and what pressed the contact.

    ``normal_force``: mean over the way, N; None: not known; ``normal_is_measured``: by a channel of its own.
    """

    each: FloatArray
    normal_force: float | None
    normal_is_measured: bool


@dataclass(frozen=True)
class Cycle:
    """The mean of the cycles used, on points equally spaced in phase from tau = 0 (the base's fundamental at its top).

    ``tau`` (p,) rad; ``mass`` (p,) x/Y about its mean, ``base`` (p,) y/Y about its mean: as measured;
    ``mass_smooth``, ``mass_velocity`` (p,): without the noise, and its derivative by tau;
    ``base_cosine``, ``base_sine`` (9,): Fourier series of y/Y, harmonics 1 to 9 (the first is 1 and 0);
    ``kept`` (p // 2,): how much of the mass's harmonics 1 to p // 2 its filter leaves once it is taken back;
    ``each`` (n, K): complex amplitudes of harmonics 1 to K of x/Y in single steady cycles, up to 400 of them evenly
    chosen: how far one cycle may be from another;
    ``force`` (p,) N (a torque: N m): at the contact, about its mean unless it slides one way, known inertia taken off;
    None: not measured;
    ``cell``: the same of single cycles;
    ``pressed`` (n, p): the normal force in single cycles over its mean on the way, where it varies within them;
    ``others``: the masses from the second on, of a frame of several.
    """

    tau: FloatArray
    mass: FloatArray
    base: FloatArray
    mass_smooth: FloatArray
    mass_velocity: FloatArray
    base_cosine: FloatArray
    base_sine: FloatArray
    each: NDArray[np.complex128]
    kept: FloatArray
    force: FloatArray | None = None
    cell: LoadCell | None = None
    pressed: FloatArray | None = None
    others: tuple[OtherMass, ...] = ()


def mean_cycle(layout: Layout, answer: Response, used: slice, of_mass: channels.SensorChannel) -> Cycle:
    """Mean of the cycles used, turned so that it starts at tau = 0, the slow wander of both channels taken off."""
    points, how = layout.mass.shape[1], answer.how
    if used.stop - used.start < len(layout):
        how = smoother(layout.mass[used], layout.of_mass, layout.samples)

    def turned(cycle: FloatArray) -> FloatArray:
        return np.asarray(np.roll(cycle, -(points // 4), axis=-1))

    def mean_of(rows: FloatArray, wander: FloatArray | float) -> FloatArray:
        mean = turned(rows[used].mean(axis=0) - wander)
        return np.asarray(mean - mean.mean())

    def single(rows: FloatArray) -> ComplexArray:
        """Harmonics (n, K) of some single cycles, counted from the top of the base's motion."""
        each = np.fft.rfft(rows[some_cycles(len(rows))], axis=1)[:, 1:129] * (2.0 / points)
        return np.asarray(each * 1j ** np.arange(1, each.shape[1] + 1))

    def wander_of(means: FloatArray) -> FloatArray:
        return np.asarray(slow_wander(means, points, layout.blocks)[0])

    smooth, velocity = map(turned, how.cycle(points))
    normal = layout.more.get("normal_force")
    others = [layout.more[name] / layout.drive.amplitude for name in channels.other_masses(layout.more)]
    return Cycle(
        tau=2.0 * math.pi * np.arange(points) / points,
        mass=mean_of(layout.mass, wander_of(answer.series.position)),
        base=mean_of(layout.base, layout.base_wander),
        mass_smooth=smooth - smooth.mean(),
        mass_velocity=velocity,
        base_cosine=layout.drive.harmonics.real.copy(),
        base_sine=-layout.drive.harmonics.imag,
        each=single(layout.mass),
        others=tuple(OtherMass(mean_of(rows, wander_of(rows.mean(axis=1))), single(rows)) for rows in others),
        pressed=None if normal is None else varying(turned(normal[some_cycles(len(normal))]), np.abs(velocity)),
        kept=channels.kept(layout.drive.frequency * np.arange(1, points // 2 + 1), of_mass),
    )


def varying(normal: FloatArray, speed: FloatArray) -> FloatArray | None:
    """Return a normal force in single cycles (n, p) over its mean on the way, of the harmonics that are no noise.

    None: it is not seen to vary within the cycle.
    """
    lines = np.fft.rfft(normal, axis=1)
    error = lines.var(axis=0) / max(len(lines) - 1, 1)
    lines[:, np.abs(lines.mean(axis=0)) ** 2 <= VARIES * np.maximum(error, np.median(error))] = 0.0
    if len(lines) < FEWEST_PRESSED or not (lines[:, 1:].any() and speed.any()):
        return None
    within = np.fft.irfft(lines, normal.shape[1])
    within = within - within.mean(axis=1, keepdims=True) + normal.mean()
    return np.asarray(within / np.average(within.mean(axis=0), weights=speed))


# Energy --------------------------------------------------------------------------------------------------------------


def loop_area(mass: FloatArray, base: FloatArray) -> FloatArray:
    """Area of closed loops, the integral of base d(mass) once round; positive when energy is dissipated.

    The polygon through all points and the two through every second one are combined (Richardson), which removes the
    second-order error of a polygon in a smooth curve: 3e-6 at 64 points a cycle where the polygon alone is 1.6e-3 off.

    ``mass``, ``base`` (n, points), 5 at least: one cycle a row, equally spaced in phase. Returns (n,), in the product
    of the units given; dimensionless (k Y^2) for x/Y and y/Y.
    """
    fine, coarse = (  # sums of base_i (mass_{i+stride} - mass_{i-stride}) / 2 round the loop
        0.5 * np.einsum("ij,ij->i", base, np.roll(mass, -stride, axis=1) - np.roll(mass, stride, axis=1))
        for stride in (1, 2)
    )
    return np.asarray((4.0 * fine - 0.5 * coarse) / 3.0)


def loop_area_noise(mass: FloatArray, base: FloatArray, mass_noise: float, base_noise: float, samples: float) -> float:
    """Standard error of the area of a mean cycle's loop from white noise, rms of one of the ``samples`` of a cycle."""
    d_mass, d_base = ((np.roll(c, -1) - np.roll(c, 1)) * (len(c) / (4.0 * math.pi)) for c in (mass, base))
    variance = mass_noise**2 * float(np.mean(d_base**2)) + base_noise**2 * float(np.mean(d_mass**2))
    variance += 0.9 * (mass_noise * base_noise * samples / (2.0 * math.pi)) ** 2  # noise times noise, 5-point slope
    return 2.0 * math.pi * math.sqrt(variance / samples)


def heavier(cell: LoadCell, mean: FloatArray, place: FloatArray) -> Estimate:
    """What in a force, the mean cycle (p,) and single ones, follows the acceleration of a place where that slides.

    Friction has the sign of the speed, inertia that of the acceleration; beside a mean, friction may depend on speed
    and place. The error is the cycles' scatter, and how much it matters whether friction may do so.
    """
    speed, acceleration = shifted(place, order=1), shifted(place, order=2)
    slides = np.abs(speed) > SLIDES * float(np.abs(speed).max())
    speed, acceleration = speed[slides], acceleration[slides]
    sign, along = np.sign(speed), np.sign(speed) * place[slides]
    found = list[FloatArray]()
    for more in ([], [speed], [along], [speed, along, sign * speed**2]):
        found.append(np.linalg.pinv(np.stack([np.ones_like(sign), sign, *more, acceleration], axis=1))[-1])
    values, rows = [float(weights @ mean[slides]) for weights in found], cell.each[:, slides] @ found[0]
    scatter = steadiness.mean_over(rows, slice(0, len(rows))).se
    if scatter is None or len(sign) < FEWEST_POINTS:
        return NOT_KNOWN
    return Estimate(values[0], math.hypot(scatter, float(np.ptp(values))))


@dataclass(frozen=True, kw_only=True)
class ByForce:
    """Means by a load cell.

    ``force_energy`` (k Y^2) and ``force_energy_j`` of a cycle, friction force ``measured_force`` (N),
    ``measured_coefficient``.
    """

    force_energy: Estimate = NOT_KNOWN
    force_energy_j: Estimate = NOT_KNOWN
    measured_force: Estimate = NOT_KNOWN
    measured_coefficient: Estimate = NOT_KNOWN


def by_load_cell(
    layout: Layout,
    answer: Response,
    used: slice,
    sources: Sources,
    joules: float | None,
    *,
    normal_force_n: float | None,
    inertia_kg: float,
    wall_moves: bool,
    has_metres: bool,
    one_way: bool,
) -> tuple[ByForce, FloatArray | None, LoadCell | None, list[str]]:
    """Measure friction by the channel of force or torque, if there is one.

    Returns means, the mean cycle (p,) from tau = 0 on, of a force also its single cycles, and what is to be said.
    ``joules``: k Y^2; ``normal_force_n``: of this test, where no channel has it; ``inertia_kg``: mass between sensor
    and contact; ``one_way``: the contact slides one way, so that the mean of the force is no offset.
    """
    name = next((name for name in channels.FORCES if name in layout.more), None)
    if name is None or answer.is_stuck:
        return ByForce(), None, None, []
    unit, points, is_torque = layout.drive.amplitude, layout.mass.shape[1], name == "torque"
    slid = layout.mass - layout.base if wall_moves else layout.mass
    how = smoother(slid, layout.of_mass.beside(layout.of_base), layout.samples) if wall_moves else answer.how
    mean = how.cycle(points)[0]
    speed = np.abs(shifted(mean, order=1))
    way = 2.0 * math.pi * float(speed.mean()) * unit * answer.series.amplitude / max(answer.size, 1e-300)
    each, rows = loop_area(slid * unit, layout.more[name]), layout.more[name + JUMPS]
    said = list[str]()
    if float(each[used].mean()) < 0.0:
        each, rows = -each, -rows
        said.append(f"{name}: it counts the other way, for friction against motion is negative: its sign is turned")
    if change := steadiness.growth(each[used] / way[used], least=0.005):
        said.append(f"{name}: friction drifts by {100 * change:+.2g} %, and means are of all cycles measured")
    normal, u_normal = np.full(len(rows), normal_force_n or math.nan), sources.normal_force
    if is_measured := "normal_force" in layout.more:
        normal = np.abs(layout.more["normal_force"] @ speed) / max(float(speed.sum()), 1e-300)
        u_normal = sources.mass_gain

    def over(size: FloatArray) -> Estimate:
        """Sum over sum: a cycle in which little moves counts little; its error by what each cycle is off."""
        usual = float(size[used].mean())
        if not usual > 0.0:
            return NOT_KNOWN
        ratio = float(each[used].mean()) / usual
        return steadiness.mean_over(ratio + (each - ratio * size) / usual, used)

    inertia = inertia_kg * (2.0 * math.pi * layout.drive.frequency) ** 2 * unit * shifted(mean, order=2)

    def at_contact(cycles: FloatArray) -> FloatArray:
        """Cycles (..., p) about their means from tau = 0 on, the inertia taken off."""
        return np.asarray(np.roll(cycles - cycles.mean(axis=-1, keepdims=True) - inertia, -(points // 4), axis=-1))

    gain, pressed = sources.mass_gain, float(normal[used].mean())
    energy = steadiness.mean_over(each, used).widened(math.sqrt(2.0) * gain) if has_metres or is_torque else NOT_KNOWN
    force, coefficient = over(way).widened(gain), over(way * normal).widened(math.hypot(gain, u_normal))
    of_unit = math.hypot(sources.stiffness, 2.0 * unit_uncertainty(sources))
    by_force = ByForce(
        force_energy=energy.over(joules).widened(of_unit),
        force_energy_j=energy,
        measured_force=force,
        measured_coefficient=NOT_KNOWN if is_torque else coefficient,
    )
    mean_force = at_contact(rows[used].mean(axis=0)) + (float(rows[used].mean()) if one_way else 0.0)
    single = at_contact(rows[some_cycles(len(rows))])
    cell = LoadCell(single, pressed if math.isfinite(pressed) and not is_torque else None, is_measured)
    if has_metres and not (is_torque or one_way):
        place, per_kg = np.roll(mean, -(points // 4)), unit * (2.0 * math.pi * layout.drive.frequency) ** 2
        more = heavier(cell, mean_force, place).over(per_kg)
        whole = Estimate(inertia_kg + (more.value or 0.0), more.se).widened(math.hypot(math.sqrt(2.0) * gain, BLUNT))
        least = HEAVY * abs(force.value or 0.0) / (per_kg * float(np.ptp(shifted(place, order=2))))
        if (more.value or 0.0) > max(CLEAR * (whole.u or math.inf), least):
            words = f"shows a mass that moves with the cell: force_inertia_kg = {whole} in [sensors] would take it off"
            said.append(f"{name}: it {words}")
    return by_force, mean_force, cell, said
