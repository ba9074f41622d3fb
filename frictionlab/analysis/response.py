"""How the mass answers, cycle by cycle: energy, amplitude, position, stops and regime."""

import math
from dataclasses import dataclass

import numpy as np

from frictionlab.analysis import energy, stops
from frictionlab.analysis.cycles import chunks
from frictionlab.analysis.layout import Layout
from frictionlab.analysis.signals import white_noise
from frictionlab.analysis.spectrum import Smoother, smoothed, smoother
from frictionlab.analysis.stops import Move, Stops
from frictionlab.arrays import FloatArray

FEW = 5  # cycles whose mean tells a slip within a stop
LEVELLED = 0.5  # of the range, which stops of one place each never take away
FINE = 512  # points a cycle, at least, on which stops and extremes are looked for
MANY_POINTS = 1 << 18  # of cycles whose loops are measured together, so that long recordings fit in memory


@dataclass(frozen=True)
class Response:
    """Per cycle (n,): ``energy`` (k Y^2), ``amplitude`` (Y), ``position`` (Y), ``stops``, ``stuck`` (fraction).

    ``found``: each stop; ``energy_noise``, ``amplitude_noise``: standard error of one cycle's value from sensor noise
    alone; ``energy_shared``: standard error that all cycles have in common; ``stops_per_cycle``, ``stuck_fraction``,
    ``regime``: over all cycles; ``asymmetry``: rms of the even part of the mean cycle over its rms; ``how``: the
    smoother of all cycles; ``shortest_stop``: shortest stop that can be told from a slow passage, in cycles (1: none
    can); ``doubtful``: pauses of a cycle that are too short to tell, and their mean length in cycles;
    ``smallest_slip``: way (Y) of the smallest slip within a stop of a tenth of a cycle that is seen; ``unclear``: a
    move within a stop that may part it or not.
    """

    energy: FloatArray
    amplitude: FloatArray
    position: FloatArray
    stops: FloatArray
    stuck: FloatArray
    found: Stops
    energy_noise: float
    energy_shared: float
    amplitude_noise: float
    stops_per_cycle: float
    stuck_fraction: float
    regime: str
    asymmetry: float
    shortest_stop: float
    doubtful: tuple[float, float]
    smallest_slip: float
    unclear: Move | None
    how: Smoother

    @property
    def size(self) -> float:
        """Usual amplitude of a cycle, Y."""
        return float(np.median(self.amplitude))

    @property
    def is_stuck(self) -> bool:
        """Whether the mass does not move by more than its sensor's noise."""
        return self.regime == "stuck"


def response(layout: Layout, *, wall_moves: bool = False) -> Response:
    """Measure the mass's answer from steady cycles.

    Parameters
    ----------
    layout : Layout
    wall_moves : bool
        The wall goes with the base: stops are those of the mass relative to the base.
    """
    how = smoother(layout.mass, noise=layout.of_mass.noise, samples=layout.samples, shared=layout.of_mass.shared)
    points = max(FINE, layout.mass.shape[1])
    slid, noise, shared, period = layout.mass, layout.of_mass.noise, layout.of_mass.shared, layout.foreign.period
    if wall_moves:
        slid, noise = layout.mass - layout.base, math.hypot(layout.of_mass.noise, layout.of_base.noise)
        shared = math.hypot(layout.of_mass.shared, layout.of_base.shared)
    sliding = how
    if wall_moves or period > 1:
        sliding = smoother(slid, noise=noise, samples=layout.samples, shared=shared, period=period)
    thresholds, speeds = stops.thresholds(sliding.v_noise, sliding.resolution), None
    if "mass_velocity" in layout.more and not wall_moves:
        rows = layout.more["mass_velocity"] / (2.0 * math.pi * layout.drive.frequency * layout.drive.amplitude)
        of_speed = smoother(rows, noise=white_noise(rows.ravel()), samples=layout.samples, period=period)
        speeds = rows, of_speed
        thresholds = stops.thresholds(math.hypot(of_speed.x_noise, of_speed.x_tail), of_speed.resolution / period)
    n = len(layout)
    slide, whole, found, doubts = _slides(slid, sliding, thresholds, points, speeds)
    rough = math.hypot(noise / math.sqrt(n), shared)
    found, unclear = _parted(found, slid, rough, thresholds.dwell) if period == 1 else (found, None)
    is_blurred = float(np.median(slide)) < LEVELLED * float(np.median(whole))
    if is_blurred:  # a threshold above the mass's own speed makes one stop of all
        found, slide, unclear = Stops(np.zeros(0), np.zeros(0)), whole, None
    count, stuck = stops.per_cycle(found, n)
    whole_periods = slice(n % period, n) if period <= n else slice(0, n)
    count_mean, stuck_mean = float(count[whole_periods].mean()), float(stuck[whole_periods].mean())
    size, areas, drive = how if wall_moves else sliding, _loop_areas(layout), layout.drive
    amplitude = slide
    if wall_moves:  # the mass itself stands nowhere
        amplitude = np.concatenate([half_range(part.x) for part in smoothed(layout.mass, how, points)])
    rounding = 1e-14 * (1.0 + abs(layout.offset) / layout.drive.amplitude)
    is_stuck = float(np.median(slide)) < 4.0 * noise + rounding
    power = np.abs(how.mean[1:]) ** 2
    return Response(
        energy=areas,
        amplitude=amplitude,
        position=layout.mass.mean(axis=1),
        stops=np.zeros(n) if is_stuck else count,
        stuck=np.ones(n) if is_stuck else stuck,
        found=found,
        energy_noise=_energy_noise(layout, how, layout.of_mass.noise, layout.of_base.noise),
        energy_shared=_energy_shared(layout, how, found, float(np.mean(areas)) * drive.growth / math.sqrt(12.0)),
        amplitude_noise=_amplitude_noise(layout, size, amplitude, whole if size is sliding else amplitude),
        stops_per_cycle=0.0 if is_stuck else count_mean,
        stuck_fraction=1.0 if is_stuck else stuck_mean,
        regime="stuck" if is_stuck else "stick-slip" if count_mean >= 0.5 / period else "continuous",
        asymmetry=math.sqrt(float(power[1::2].sum() / max(power.sum(), 1e-300))),
        how=how,
        shortest_stop=1.0 if is_blurred else 2.0 * thresholds.dwell / (2.0 * math.pi),
        doubtful=(len(doubts) / n, float(np.mean(doubts)) / stops.TURN if len(doubts) else 0.0),
        smallest_slip=stops.smallest(rough, layout.samples),
        unclear=None if is_stuck else unclear,
    )


def _parted(found: Stops, slid: FloatArray, rough: float, dwell: float) -> tuple[Stops, stops.Move | None]:
    """The stops, those parted that are two, and a move within one of which that is not clear; `rough`: of the mean."""
    if len(slid) < FEW:
        return found, None
    mean, n = slid.mean(axis=0), len(slid)
    parted = stops.parted(found, mean, noise=rough, dwell=dwell, cycles=n)
    return parted, stops.unclear(found, parted, mean, noise=rough, dwell=dwell, cycles=n)


def _amplitude_noise(layout: Layout, how: Smoother, amplitude: FloatArray, whole: FloatArray) -> float:
    """Return the standard error of one cycle's amplitude; ``whole`` (n,): amplitudes before stops were levelled."""
    mean, drive = float(np.mean(amplitude)), layout.drive
    return math.hypot(
        how.x_noise / math.sqrt(2.0),
        how.x_tail,
        layout.of_mass.rounding / math.sqrt(2.0),
        layout.left,
        max(0.0, float(np.mean(whole)) - mean - how.x_tail),  # a stop that begins as a slow passage
        mean * drive.amplitude_se / drive.amplitude,  # of the unit it is told in
    )


def _slides(
    slid: FloatArray,
    sliding: Smoother,
    thresholds: stops.Thresholds,
    points: int,
    speeds: tuple[FloatArray, Smoother] | None,
) -> tuple[FloatArray, FloatArray, Stops, FloatArray]:
    """Return each cycle's half range (n,) with its stops levelled, the same as it is, the stops, and doubtful ones.

    ``speeds``: cycles of the measured velocity over Y omega (n, p), where there is one, and their smoother.
    """
    n = len(slid)
    slide, whole, parts, firsts = np.empty(n), np.empty(n), [], []
    measured = None if speeds is None else smoothed(*speeds, points)
    for part in smoothed(slid, sliding, points):
        pauses = stops.pauses(part.v if measured is None else next(measured).x, thresholds.still)
        stands = stops.stops_of(pauses, thresholds, points)
        slide[part.cycles] = half_range(levelled(part.x, stands, sliding.resolution))
        whole[part.cycles] = half_range(part.x)
        parts.append(pauses)
        firsts.append(part.cycles.start)
    every = stops.joined(parts, firsts, n, points)
    return slide, whole, stops.stops_of(every, thresholds, points), stops.doubtful(every, thresholds, points)


def _energy_shared(layout: Layout, how: Smoother, found: Stops, growth: float) -> float:
    """Return the standard error of energy (k Y^2) that all cycles have in common; `growth`: that of the drive."""
    way = np.sin(found.end) - np.sin(found.begin)  # of the base (Y) during each stop: there one error stays
    return math.hypot(
        _energy_noise(layout, how, layout.of_mass.shared, layout.of_base.shared),
        layout.of_mass.rounding * math.sqrt(float(np.dot(way, way)) / len(layout)),
        growth,
    )


def _loop_areas(layout: Layout) -> FloatArray:
    some_cycles = chunks(layout.mass, MANY_POINTS)
    parts = [energy.loop_area(layout.mass[some], layout.levelled_base(some)) for some in some_cycles]
    each, period = np.concatenate(parts), layout.foreign.period
    if 1 < period <= len(layout):  # a cycle's loop does not close, a period's does
        spare = len(layout) % period
        open_ = each[spare:].reshape(-1, period)
        missing = energy.loop_area(*layout.in_periods()) - open_.sum(axis=1)
        each[spare:] = (open_ + missing[:, None] / period).ravel()
        each[:spare] = each[period : period + spare]
    return each


def _energy_noise(layout: Layout, how: Smoother, mass_noise: float, base_noise: float) -> float:
    base = layout.base.mean(axis=0)
    mass = np.fft.irfft(how.mean * len(base), len(base))
    return energy.loop_area_noise(mass, base, mass_noise, base_noise, layout.samples)


def levelled(x: FloatArray, found: Stops, margin: float) -> FloatArray:
    """Replace each stop by its mean: a mass that stands has one displacement, what differs from it is noise.

    The overshoot of the smoothing within ``margin`` (rad) of a long stop goes with it; the mass is slow there.
    """
    scale = x.shape[1] / (2.0 * math.pi)
    begin = np.ceil(found.begin * scale).astype(np.intp)
    end = np.minimum(np.floor(found.end * scale).astype(np.intp), x.size)
    some = end - begin >= 2
    begin, end = begin[some], end[some]
    flat = x.ravel().copy()
    total = np.concatenate([[0.0], np.cumsum(flat)])
    mean = (total[end] - total[begin]) / (end - begin)
    reach = np.where(end - begin > 2.0 * margin * scale, math.ceil(margin * scale), 0)
    begin, end = np.maximum(begin - reach, 0), np.minimum(end + reach, x.size)
    length = end - begin
    inside = np.arange(length.sum()) + np.repeat(begin - (np.cumsum(length) - length), length)
    flat[inside] = np.repeat(mean, length)
    return flat.reshape(x.shape)


def half_range(x: FloatArray) -> FloatArray:
    """(max - min) / 2 of each row; an extreme that is not flat is refined by a parabola through three points."""
    return 0.5 * (_summit(x) + _summit(-x))


def _summit(x: FloatArray) -> FloatArray:
    n, points = x.shape
    row = np.arange(n)
    top = np.argmax(x, axis=1)
    left, middle, right, beyond = (x[row, (top + step) % points] for step in (-1, 0, 1, 2))
    curvature = left - 2.0 * middle + right
    is_peak = (curvature < 0.0) & ~((right == middle) & (beyond == middle))
    safe = np.where(is_peak, curvature, -1.0)
    return np.asarray(np.where(is_peak, middle - 0.125 * (left - right) ** 2 / safe, middle))


def mean_cycle(layout: Layout, used: slice, how: Smoother) -> tuple[FloatArray, FloatArray]:
    """Mean of some cycles without noise, (p,), and its derivative by tau, (p,); ``how``: the smoother of all."""
    if used.stop - used.start < len(layout):
        rows, shared = layout.mass[used], layout.of_mass.shared
        how = smoother(rows, noise=layout.of_mass.noise, samples=layout.samples, shared=shared)
    points = layout.mass.shape[1]
    k = np.arange(len(how.mean))
    x = np.fft.irfft(how.mean * points, points)
    return x, np.fft.irfft(1j * k * how.mean * points, points)
