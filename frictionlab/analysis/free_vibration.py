"""Free vibration: natural frequency, viscous damping ratio and friction of the frame, from each tap of a record.

Where the frame has several masses, one free decay gives its modes (`modes`): frequencies, damping ratios, shapes. Every
mass moves by ``sum_k e^(-zeta_k omega_k t) (a_k cos + b_k sin)(omega_dk t)`` with frequencies and damping of the frame.
For given ones the amplitudes are linear and follow by least squares (variable projection [Golub and Pereyra 1973]), so
that only two numbers a mode are searched for. Friction of the frame is no part of it.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.signal import find_peaks

from frictionlab.analysis.decay import ONE_SIDED, Decay, DecayFit, decay_errors, first_guess, fit_decay
from frictionlab.analysis.signals import evenly, white_noise
from frictionlab.analysis.spectrum import amplitude_spectrum, strongest_tone, without_hum
from frictionlab.arrays import FloatArray, sampling_interval
from frictionlab.errors import AnalysisError
from frictionlab.uncertainty import Average, Estimate, average, with_digits

APART, SURE = {"natural_frequency_hz": 0.01, "damping_ratio": 0.5}, 5.0  # of the median, and standard errors
KEPT = {"natural_frequency_hz": 1e-4, "damping_ratio": 0.02}  # relative: what a clock, and a frame mounted again, do


@dataclass(frozen=True)
class FreeVibration:
    """One free decay; what each number is says its column in `frictionlab.schema`.

    The part fitted begins at the second turning point after the release. ``_se``: standard errors, ``None`` for what
    came out negative and is held at 0, whose one-sided 95 % limit is its ``_upper``; ``misfit``: rms of what the fit
    leaves over the first swing; where a ``cubic_share`` shows (else 0, ``_se`` ``None``), frequency, damping and
    friction are of small swings. What was fitted: ``time`` (n,) s, ``measured`` and ``fitted`` displacement of the mass
    (n,) m. Of an angle ``unit`` is rad, and all that is said in metres is in radians.
    """

    start_s: float
    natural_frequency_hz: float
    natural_frequency_hz_se: float
    damped_frequency_hz: float
    damping_ratio: float
    damping_ratio_se: float | None
    damping_ratio_upper: float | None
    friction_m: float
    friction_m_se: float | None
    friction_m_upper: float | None
    friction_over_swing: float
    amplitude_m: float
    half_cycles: int
    misfit: float
    cubic_share: float
    cubic_share_se: float | None
    warnings: tuple[str, ...]
    time: FloatArray
    measured: FloatArray
    fitted: FloatArray
    unit: str = "m"

    def __repr__(self) -> str:
        frequency = Estimate(self.natural_frequency_hz, self.natural_frequency_hz_se)
        damping = Estimate(self.damping_ratio, self.damping_ratio_se)
        friction = f"F/k {Estimate(self.friction_m, self.friction_m_se).scaled(1e6)} u{self.unit}"
        said = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"<FreeVibration at {self.start_s:.3g} s: {frequency} Hz, damping ratio {damping}, {friction}{said}>"


def free_vibrations(
    time: FloatArray,
    displacement: FloatArray,
    base: FloatArray | None = None,
    *,
    pendulum: bool = False,
    order: int = 0,
) -> tuple[FreeVibration, ...]:
    """Fit the exact decay under viscous and Coulomb damping to each tap of a record, hum taken out.

    Parameters
    ----------
    time, displacement : (n,) arrays
        s, increasing; the mass, m (a pendulum: rad). May begin before the release and go on after the motion died.
    base : (n,) array, optional
        The base, m: what moves there is no free vibration.
    pendulum : bool
        The restoring force is the sine of an angle.
    order : int
        1 where the motions are velocities, m/s, 2 where they are accelerations, m/s^2: they are fitted as such.

    Raises
    ------
    AnalysisError
        No decay of six half-cycles; a motion that is driven or grows; or none of the decays follows the two dampings.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.004)
    >>> decay = 5e-3 * np.exp(-0.01 * 2 * np.pi * 3.0 * t) * np.cos(2 * np.pi * 3.0 * np.sqrt(1 - 1e-4) * t)
    >>> tap = free_vibrations(t, decay)[0]
    >>> print(f"{tap.natural_frequency_hz:.3f} {tap.damping_ratio:.4f} {tap.friction_m < 1e-9}")
    3.000 0.0100 True
    """
    time, (displacement, *others) = _without_hum(time, [displacement] if base is None else [displacement, base])
    base, line = others[0] if others else None, 1.0
    if order:
        line = 2.0 * math.pi * strongest_tone(amplitude_spectrum(displacement, sampling_interval(time))).frequency
        sign = -1.0 if order == 2 else 1.0
        displacement, base = sign * displacement / line**order, None if base is None else base / line**order
    way, noise = displacement, 0.0
    if order == 1:  # the mass turns where its velocity is zero; noise that is integrated walks
        way = line * CubicSpline(time, displacement - np.median(displacement)).antiderivative()(time)
        noise = white_noise(displacement) * math.sqrt(math.pi * line * sampling_interval(time))
    found, refused = list[FreeVibration](), list[str]()
    for tap in find_taps(time, way, noise):
        when, height = tap
        if not _fades(tap):
            refused.append(f"from {when[0]:.4g} to {when[-1]:.4g} s the swing does not fade: driven, or touched")
            continue
        inside, share = (time >= when[0]) & (time <= when[-1]), 0.0
        if base is not None and np.count_nonzero(inside) > 1:
            share = math.sqrt(2.0) * float(np.std(base[inside])) / float(_swings(tap)[0])
        if share > 0.05:
            refused.append(f"a driven motion: the base moves by {share:.0%} of the mass's swing: expected one at rest")
            continue
        guess = first_guess(when, height, pendulum=pendulum, order=order, line=line)
        t, seen = _thinned(time[inside], displacement[inside], guess.half_period, guess.rest)
        fit, faded = fit_decay(t, seen, guess), 1.0 - float(_swings(tap)[-1] / _swings(tap)[0])
        if fit.misfit > (0.1 if faded >= FADED else 0.01):
            left = f"viscous and friction damping leave {fit.misfit:.1%} of the first swing, of which {faded:.0%} fade"
            refused.append(
                f"{left}: expected a mass that swings freely: displace it, let go, and record until it rests"
            )
            continue
        decay, se = fit.decay, fit.se
        found.append(
            FreeVibration(
                start_s=decay.start,
                natural_frequency_hz=decay.omega / (2.0 * math.pi),
                natural_frequency_hz_se=se.omega / (2.0 * math.pi),
                damped_frequency_hz=0.5 / decay.half_period,
                damping_ratio=decay.zeta,
                damping_ratio_se=None if "zeta" in fit.at_zero else se.zeta,
                damping_ratio_upper=fit.limits.get("zeta"),
                friction_m=decay.friction,
                friction_m_se=None if "friction" in fit.at_zero else se.friction,
                friction_m_upper=fit.limits.get("friction"),
                friction_over_swing=decay.friction / abs(decay.swing),
                amplitude_m=abs(decay.swing),
                half_cycles=len(when) - 1,
                misfit=fit.misfit,
                cubic_share=decay.cubic * decay.swing**2,
                cubic_share_se=se.cubic * decay.swing**2 if decay.cubic else None,
                warnings=tuple(_warnings(fit, share, faded)),
                time=t,
                measured=seen,
                fitted=seen - fit.residual,
            )
        )
    if not found:
        raise AnalysisError(f"free vibration: {refused[0]}")
    found[0] = replace(found[0], warnings=(*(f"another tap is left out: {why}" for why in refused), *found[0].warnings))
    return tuple(found)


def _without_hum(time: FloatArray, signals: Iterable[FloatArray]) -> tuple[FloatArray, list[FloatArray]]:
    """Signals (n,) on an even clock where stamps stray, hum taken out, and their stamps; holes stay holes."""
    step = sampling_interval(time)
    even, strays = evenly(time, step, {str(k): signal for k, signal in enumerate(signals)})
    cleaned = [without_hum(signal, step) for signal in even.values()]
    if not strays:
        return time, cleaned
    there = np.unique(np.rint((time - time[0]) / step).astype(np.intp))
    there = there[there < len(cleaned[0])]
    return time[0] + step * there, [signal[there] for signal in cleaned]


def _thinned(time: FloatArray, x: FloatArray, half_period: float, rest: float) -> tuple[FloatArray, FloatArray]:
    """Means of so many neighbours that enough are left; what averaging takes from a sinusoid is given back."""
    step = (time[-1] - time[0]) / (len(time) - 1)
    size = int(half_period / step / 40)  # so many samples a fit needs
    if size < 2:
        return time, x
    count = len(time) // size
    t, mean = (values[: count * size].reshape(count, size).mean(axis=1) for values in (time, x))
    angle = 0.5 * math.pi * step / half_period
    kept = math.sin(size * angle) / (size * math.sin(angle))
    return t, rest + (mean - rest) / kept


def _warnings(fit: DecayFit, base_share: float, faded: float) -> list[str]:
    said = []
    if faded < FADED:
        said.append(f"only {faded:.0%} of the swing fades in this record, and under a drive it may too: record longer")
    if base_share > 0.005:
        said.append(
            f"the base moves by {base_share:.1%} of the mass's swing, and its motion is in all numbers: hold it"
        )
    if fit.decay.cubic:
        share, error = (100.0 * d.cubic * fit.decay.swing**2 for d in (fit.decay, fit.se))
        force = f"its force at the first swing is {share:+.2g} ± {error:.1g} % off"
        said.append(f"the spring is not linear: {force}; natural frequency, damping, friction are of small swings")
    if fit.doubt > 3.0:  # standard errors
        names = " and ".join("viscous damping" if name == "zeta" else name for name in fit.at_zero)
        said.append(f"{names}, negative by {fit.doubt:.2g} standard errors, is held at 0: damping is of another kind")
    if fit.misfit > 0.02:
        left = f"viscous and Coulomb damping leave {fit.misfit:.1%} of the first swing"
        said.append(f"{left}: stiffness or damping of another kind, or a second mode")
    return said


def averages(taps: Sequence[FreeVibration]) -> dict[str, Average]:
    """Average over taps of natural frequency, damping ratio and friction, each with its error; nothing of none.

    What is held at 0 counts as 0 with the error that its 95 % limit stands for.
    """

    def error(tap: FreeVibration, name: str) -> float:
        se = getattr(tap, f"{name}_se")
        return float((getattr(tap, f"{name}_upper") or 0.0) / ONE_SIDED if se is None else se)

    names = ("natural_frequency_hz", "damping_ratio", "friction_m")
    each = {name: ([getattr(tap, name) for tap in taps], [error(tap, name) for tap in taps]) for name in names if taps}
    return {name: average(*both) for name, both in each.items()}


def taps_apart(taps: Sequence[FreeVibration]) -> Iterator[tuple[int, str]]:
    """Taps, by their places, that are far from the others, in words: their average is of no frame."""
    for name, share in APART.items():
        middle = float(np.median([getattr(tap, name) for tap in taps])) if taps else 0.0
        for number, tap in enumerate(taps):
            off = getattr(tap, name) - middle
            if abs(off) > max(share * middle, SURE * (getattr(tap, f"{name}_se") or math.inf)):
                far = f"{name}: the tap at {tap.start_s:.4g} s is {float(f'{100.0 * off / middle:.2g}'):+g} %"
                yield number, f"{far} from the median of all {len(taps)} taps: of another frame? average it by itself"


def scene_snippet(means: Mapping[str, Average], unit: str = "m") -> str:
    """The lines of a scene that say what was found, to paste; ``unit``: of the friction, m or rad.

    An uncertainty is at least `KEPT` of its number, as its line says.

    Examples
    --------
    >>> found = {"natural_frequency_hz": Average(3.1261, 2e-4, None), "damping_ratio": Average(0.0055, 1e-5, None)}
    >>> print(scene_snippet(found | {"friction_m": Average(5e-06, 1e-07, None)}))
    [rig]
    natural_frequency_hz = 3.1261
    natural_frequency_hz_u = 0.00031  # 0.01 % at least: it changes from day to day
    damping_ratio = 0.0055
    damping_ratio_u = 0.00011  # 2 % at least: it changes from day to day
    # friction of the frame itself, F/k: 5e-06 m, standard error 1e-07 m
    """
    lines = ["[rig]"]
    for name, kept in KEPT.items():
        mean, u = means[name].mean, max(means[name].se, kept * means[name].mean)
        if mean > 0.0:
            why = f"  # {100.0 * kept:g} % at least: it changes from day to day" * (u > means[name].se)
            lines += [f"{name} = {with_digits(mean, u)}", f"{name}_u = {u:.2g}{why}"]
    friction = means["friction_m"]
    lines.append(
        f"# friction of the frame itself, F/k: {friction.mean:.4g} {unit}, standard error {friction.se:.2g} {unit}"
    )
    return "\n".join(lines)


# Where a mass swings freely ------------------------------------------------------------------------------------------

FADED = 0.3  # share of its first swing that a decay has lost, from which no drive is asked after
LEAST_SWINGS = 6  # half-cycles


def find_taps(time: FloatArray, displacement: FloatArray, noise: float = 0.0) -> tuple[FloatArray, ...]:
    """Find the taps of a record (n,) [s], [m], most of them decays, by their turning points: times and heights (2, k).

    The first turning point of a tap, and the last before a new one if it did not rest, are left out: a hand was there.
    ``noise`` [m]: rms of what is no motion, where it is more than the record's white noise.
    """
    turnings = _turning_points(time, displacement, noise)
    swings, wait = _swings(turnings), np.diff(turnings[0])
    begins, rested, smallest = [0], set[int](), math.inf  # of runs in which no swing rises and the mass never rests
    for number, swing in enumerate(swings.tolist()):
        rests = number > begins[-1] and wait[number] > 1.5 * wait[number - 1]  # it had come to rest
        if swing > 1.1 * smallest or rests:
            begins.append(number)
            rested |= {number + 1} if rests else set()
            smallest = math.inf
        smallest = min(smallest, swing)
    long = []
    for begin, end in zip(begins, [*(b + 1 for b in begins[1:]), len(swings) + 1], strict=True):
        if end - begin > LEAST_SWINGS:
            first = begin + int(np.argmax(swings[begin : end - 1])) + 1
            run = turnings[:, first : end - (end < turnings.shape[1] and end not in rested)]
            long += [run] if run.shape[1] > LEAST_SWINGS else []
    share = sum(run.shape[1] for run in long if _fades(run)) / max(1, len(swings))
    if share >= 0.5:
        return tuple(long)
    quarter = max(1, len(swings) // 4)
    if len(swings) <= 2 * LEAST_SWINGS and not long:
        why = f"expected at least {LEAST_SWINGS} half-cycles above the noise; got {max(0, len(swings) - 1)}: pull more"
    elif float(np.median(swings[-quarter:])) > 1.3 * float(np.median(swings[:quarter])):
        why = "the motion grows as under a drive or negative damping, no free decay"
    else:
        part = f"{share:.0%} of {len(swings)} half-cycles belong to a decay"
        why = f"this is a driven motion, not a free decay ({part}): hold the base at rest"
    raise AnalysisError(f"free vibration: {why}: displace the mass, let go, and record until it rests")


def _fades(run: FloatArray) -> bool:
    """Whether turning points (2, k) are of a decay.

    A short record sees little of it: 1 % a half-cycle (a damping ratio of 0.003) parts it from a drive.
    """
    swings = _swings(run)
    return bool(swings[-1] <= max(1.0 - FADED, 0.99 ** run.shape[1]) * swings[0])


def _swings(turnings: FloatArray) -> FloatArray:
    """Half the way from each turning point (2, k) to the next (k - 1,) m; the sensor's zero does not matter."""
    return np.asarray(0.5 * np.abs(np.diff(turnings[1])))


def _turning_points(time: FloatArray, x: FloatArray, noise: float) -> FloatArray:
    """Extremes, refined by parabolas, between which the record moves by ten times its noise: times, heights (2, k)."""
    noise = max(noise, white_noise(x) if len(x) >= 16 else 0.0)
    least = max(10.0 * noise, 1e-9 * float(np.ptp(x)))
    bends = np.flatnonzero(np.diff(np.sign(np.diff(x)))) + 1
    at, rising, top, bottom = list[int](), 0, 0, 0
    for here in [0, *bends.tolist(), len(x) - 1]:
        top, bottom = here if x[here] > x[top] else top, here if x[here] < x[bottom] else bottom
        if rising >= 0 and x[top] - x[here] > least:
            at.append(top)
            rising, bottom = -1, here
        elif rising <= 0 and x[here] - x[bottom] > least:
            at.append(bottom)
            rising, top = 1, here
    when, height = time[at], x[at]
    for k, here in enumerate(at[1:], 1):
        beside = [here - at[k - 1], *(after - here for after in at[k + 1 : k + 2])]
        reach = min(max(1, min(beside) // 8), here, len(x) - 1 - here)
        if reach >= 1:
            part = slice(here - reach, here + reach + 1)
            u = time[part] - time[here]
            c, b, a = np.polynomial.polynomial.polyfit(u, x[part], 2)
            offset = float(np.clip(-b / (2.0 * a), u[0], u[-1])) if a else 0.0
            when[k], height[k] = time[here] + offset, c + offset * (b + a * offset)
    return np.array([when, height])


# Several masses ------------------------------------------------------------------------------------------------------

DAMPING = 0.01  # ratio from which the fit starts


@dataclass(frozen=True)
class Mode:
    """One mode of a frame.

    ``natural_frequency_hz``, ``damping_ratio`` and their standard errors; ``shape``: displacement of each mass over the
    largest of them, from mass 1 up, negative where it moves against it.
    """

    natural_frequency_hz: float
    natural_frequency_hz_se: float
    damping_ratio: float
    damping_ratio_se: float
    shape: tuple[float, ...]


def modes(time: FloatArray, displacements: FloatArray) -> tuple[Mode, ...]:
    """Fit as many modes as there are masses to a free decay, hum taken out.

    Parameters
    ----------
    time : (n,) array
        s, increasing.
    displacements : (m, n) array
        Of each mass, m, from mass 1 up; may begin before the release.

    Raises
    ------
    AnalysisError
        Fewer modes show than there are masses, or the motion is none of that kind.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.005)
    >>> slow, fast = np.exp(-0.1 * t) * np.cos(12.0 * t), np.exp(-0.3 * t) * np.cos(31.0 * t)
    >>> found = modes(t, 1e-3 * np.array([0.6 * slow + fast, slow - 0.6 * fast]))
    >>> [(round(m.natural_frequency_hz, 3), [round(s, 3) for s in m.shape]) for m in found]
    [(1.91, [0.6, 1.0]), (4.934, [1.0, -0.6])]
    """
    time, cleaned = _without_hum(time, displacements)
    step, signals = sampling_interval(time), np.array(cleaned)
    about = signals - np.median(signals[:, -max(1, len(time) // 10) :], axis=1)[:, None]
    size = np.abs(about).max(axis=0)
    first = int(np.argmax(size))
    if not size[first] > 0.0:
        raise AnalysisError("free vibration: no mass moves: expected a free decay; got columns that stand still")
    last = int(np.flatnonzero(size > 0.02 * size[first])[-1]) + 1
    # the highest peaks, one for each mass, of all spectra together
    spectra = [amplitude_spectrum(row, step) for row in about[:, first:last]]
    power = np.sqrt(np.sum([s.amplitude**2 for s in spectra], axis=0))
    apart = max(1, round(2.0 * spectra[0].resolution / float(spectra[0].frequency[1])))
    peaks, _ = find_peaks(power, distance=apart, prominence=0.01 * float(power.max()))
    if len(peaks) < len(signals):
        raise AnalysisError(
            f"free vibration: expected {len(signals)} modes, one for each mass; got {len(peaks)} clear in the spectrum:"
            " displace it elsewhere"
        )
    guess = sorted(spectra[0].frequency[peaks[np.argsort(-power[peaks])][: len(signals)]].tolist())
    thin = max(1, int(1.0 / (max(guess) * 12 * step)))  # samples of its period
    t, x = time[first:last:thin] - time[first], about[:, first:last:thin]

    def columns(p: FloatArray) -> FloatArray:
        omega, zeta = 2.0 * math.pi * p[0::2], np.clip(p[1::2], -0.5, 0.9)
        angle = np.outer(omega * np.sqrt(1.0 - zeta**2), t)
        fade = np.exp(-np.outer(zeta * omega, t))
        return np.concatenate([fade * np.cos(angle), fade * np.sin(angle), np.ones((1, len(t)))]).T

    def left(p: FloatArray) -> FloatArray:
        basis = columns(p)
        share, *_ = np.linalg.lstsq(basis, x.T, rcond=None)
        return np.asarray((basis @ share - x.T).ravel() / size[first])

    start = np.array([value for f in guess for value in (f, DAMPING)])
    found = least_squares(left, start, x_scale=np.array([value for f in guess for value in (0.01 * f, DAMPING)]))
    share, *_ = np.linalg.lstsq(columns(found.x), x.T, rcond=None)
    misfit = float(np.std(found.fun)) * float(size[first]) / float(np.std(x))
    if misfit > 0.1:
        what = f"{len(x)} damped modes leave {100.0 * misfit:.2g} % of the motion"
        raise AnalysisError(f"free vibration: {what}: expected a free decay: displace, let go, touch nothing")
    each = share[: len(guess)] - 1j * share[len(guess) : -1]  # complex amplitudes (mode, mass)
    largest = np.take_along_axis(each, np.abs(each).argmax(axis=1)[:, None], axis=1)
    shapes = (each / largest).real
    rules = [  # that of a free decay, by the half-cycles of each mode
        decay_errors(
            *(np.asarray(found.jac), np.asarray(found.fun), np.repeat(t, len(x))),
            Decay(0.0, 1.0, 0.0, 2.0 * math.pi * f, zeta, 0.0),
            shape,
        )
        for (f, zeta), shape in zip(found.x.reshape(-1, 2).tolist(), shapes, strict=True)
    ]
    numbers = np.stack([found.x, np.max(rules, axis=0)], axis=1).reshape(-1, 4)
    return tuple(
        Mode(f, f_se, zeta, zeta_se, tuple(shape))
        for (f, f_se, zeta, zeta_se), shape in zip(numbers.tolist(), shapes.tolist(), strict=True)
    )
