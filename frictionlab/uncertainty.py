"""What is not known of sensors, clock and rig, and what that does to each number (GUM, JCGM 100).

    scene --sources_of--> Sources (standard uncertainties of one test, each of one cause)
    Sources + mean cycle --cycle_budget--> shares of energy, amplitude and the base's amplitude, to first order

Type A, the numbers' own scatter, is the standard error `_se`; with these, type B, it makes the combined `_u`.

A cycle is seen a little wrong, as each source would show it, and the numbers are taken again: what a gain, a lag or
crosstalk does to the unit Y, by which everything is divided, counts so by itself.

A sensor that bends has a cubic's error, ``linearity`` times its range R at the ends: ``L R s^3`` with s from -1 to 1.
A cycle of half swing A fills ``f = 2 A / R`` of the range, about a place s0 that nobody has noted: with u from -1 to 1
along it the error is ``L A (6 s0^2 u + 6 s0 f u^2 + 2 f^2 u^3)``, a gain, a bend and a cubic. s0 is taken as uniform
between -(1 - f) and 1 - f. A range that is not known is taken as filled, which makes it ``2 L A u^3``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.scene import Scene

Shares = Mapping[str, float]
STATISTICAL = "noise and scatter"
LINES = "hum and other lines"
FILTER = "filter of the mass sensor"
KEYS = ("energy_per_cycle", "response_amplitude", "base_amplitude_m")
ROUNDING = 1e-12  # below it a share is the rounding of differences
CUBIC_GAIN = 0.75  # of a cosine's cube, in its fundamental
NATURAL_FREQUENCY = 0.002  # relative: two publications of one frame say 3.115 and 3.130 Hz
DAMPING = 0.1  # relative: of a damping ratio that is given without its uncertainty
UNKNOWN_DAMPING = 0.005  # of a frame whose damping ratio nobody has measured
STIFFNESS = 0.005  # relative
NORMAL_FORCE = 0.01  # relative


@dataclass(frozen=True)
class Sources:
    """Standard uncertainties of one test, each of one cause.

    ``mass_gain``, ``base_gain``, ``natural_frequency``, ``stiffness``, ``normal_force``: relative; ``lag``: s between
    the two channels; ``linearity``: share of a sensor's measuring range; ``measuring_range``: that range in m, None
    where it is not known; ``damping_ratio``: of the frame; ``crosstalk``: share of one channel in the other.
    ``assumed``: scene keys of those that nobody has declared.
    """

    mass_gain: float
    base_gain: float
    linearity: float
    measuring_range: float | None
    lag: float
    crosstalk: float
    natural_frequency: float
    damping_ratio: float
    stiffness: float
    normal_force: float
    assumed: tuple[str, ...] = ()

    @property
    def gain(self) -> float:
        """Relative uncertainty of the mass sensor's gain over the base's."""
        return math.hypot(self.mass_gain, self.base_gain)


def sources_of(
    scene: Scene, sampling_rate_hz: float, *, normal_force_n: float | None = None, lag_s_u: float | None = None
) -> Sources:
    """Return what is known of one test.

    Parameters
    ----------
    scene : Scene
        ``[sensors]``, and the ``_u`` keys of ``[rig]`` and ``[experiment]``.
    sampling_rate_hz : float
        Two channels that are not said to be sampled together may be apart by half a sampling interval either way.
    normal_force_n : float, optional
        Of this test.
    lag_s_u : float, optional
        Standard uncertainty of the alignment of two logs, as their recording has it; a scene's own wins.
    """
    sensors, rig = scene.sensors, scene.rig
    lag = lag_s_u if sensors.lag_s_u is None else sensors.lag_s_u
    frequency = _relative(rig.natural_frequency_hz_u, rig.natural_frequency)
    damping = UNKNOWN_DAMPING if rig.damping_ratio is None else DAMPING * rig.damping_ratio
    stiffness = _relative(rig.stiffness_n_per_m_u, rig.stiffness)
    normal = _relative(scene.experiment.normal_force_n_u, normal_force_n or scene.experiment.normal_force_n)
    declared = {
        "sensors.lag_s_u": lag,
        "rig.natural_frequency_hz_u": frequency,
        "rig.damping_ratio_u": rig.damping_ratio_u,
        "rig.stiffness_n_per_m_u": stiffness,
        "experiment.normal_force_n_u": normal,
    }
    return Sources(
        mass_gain=sensors.gain_error,
        base_gain=sensors.gain_error,
        linearity=sensors.linearity,
        measuring_range=scene.log.measuring_range_m,
        lag=0.5 / sampling_rate_hz / math.sqrt(3.0) if lag is None else lag,
        crosstalk=sensors.crosstalk,
        natural_frequency=NATURAL_FREQUENCY if frequency is None else frequency,
        damping_ratio=damping if rig.damping_ratio_u is None else rig.damping_ratio_u,
        stiffness=STIFFNESS if stiffness is None else stiffness,
        normal_force=NORMAL_FORCE if normal is None else normal,
        assumed=tuple(name for name, value in declared.items() if value is None),
    )


def _relative(uncertainty: float | None, value: float | None) -> float | None:
    return None if uncertainty is None or not value else uncertainty / value


def combined(shares: Shares) -> float:
    """Combined standard uncertainty: the shares in quadrature.

    Examples
    --------
    >>> combined({"noise and scatter": 3.0, "lag": 4.0})
    5.0
    """
    return math.sqrt(math.fsum(share**2 for share in shares.values()))  # from Python 3.12 on `sum` rounds otherwise


def cycle_budget(
    mass: FloatArray, base: FloatArray, sources: Sources, *, turn: float, unit: float
) -> dict[str, Shares]:
    """Return what each source adds to the numbers of a mean cycle, in the numbers' own units.

    Parameters
    ----------
    mass, base : ndarray of shape (p,)
        Mean cycle of x/Y and y/Y on equally spaced phases.
    sources : Sources
    turn : float
        Drive's angular frequency, rad/s.
    unit : float
        Y in m: the base's amplitude.

    Returns
    -------
    dict
        Of ``energy_per_cycle`` (k Y^2), ``response_amplitude`` (Y) and ``base_amplitude_m`` (m): source -> standard
        uncertainty.
    """
    channels = _Seen.of(mass, base)
    of_mass = channels.by_mass(np.array([mass, channels.mass_rate, base, *_bends(mass)])) * (1.0, 1.0, unit)
    of_base = channels.by_base(np.array([base, mass, *_bends(base)])) * (1.0, 1.0, unit)
    bent_mass = _bent(of_mass[3:], _filled(mass, sources, unit))
    bent_base = _bent(of_base[2:], _filled(base, sources, unit))
    causes = {
        "gain of the mass sensor": sources.mass_gain * of_mass[0],
        "gain of the base sensor": sources.base_gain * of_base[0],
        "linearity of the sensors": sources.linearity * np.hypot(bent_mass, bent_base),
        "lag between the channels": turn * sources.lag * of_mass[1] * (1.0, 0.0, 0.0),
        "crosstalk": sources.crosstalk * np.hypot(of_mass[2], of_base[1]),
    }
    told = {key: {cause: abs(float(sizes[i])) for cause, sizes in causes.items()} for i, key in enumerate(KEYS)}
    return {key: {cause: size for cause, size in shares.items() if size > ROUNDING} for key, shares in told.items()}


@dataclass(frozen=True)
class _Seen:
    """A mean cycle, and what small changes of it do to energy, amplitude and unit, all over the base's fundamental.

    ``mass``, ``mass_rate``, ``base_rate``, ``line`` (p,): x/Y, the derivatives, and the fundamental's weights: their
    sum over the base is ``unit``. ``loop``, ``amplitude``: over it. With D the derivative, the area ``b . D m`` changes
    by ``db . D m - dm . D b``.
    """

    mass: FloatArray
    mass_rate: FloatArray
    base_rate: FloatArray
    line: FloatArray
    unit: float
    loop: float
    amplitude: float

    @classmethod
    def of(cls, mass: FloatArray, base: FloatArray) -> "_Seen":
        """Of two mean cycles (p,)."""
        way = 2.0 * math.pi / len(base)
        once = way * np.arange(len(base))
        turns = np.array([np.cos(once), np.sin(once)]) * (2.0 / len(base))
        first, rate = np.einsum("ij,j->i", turns, base), _derivative(mass)
        unit = float(np.hypot(*first))
        loop, amplitude = way * float(np.dot(base, rate)) / unit**2, 0.5 * float(np.ptp(mass)) / unit
        return cls(mass, rate, _derivative(base), first @ turns / unit, unit, loop, amplitude)

    def by_mass(self, changes: FloatArray) -> FloatArray:
        """Changes (m, 3) of the numbers where the mass's channel changes (m, p)."""
        area = -np.einsum("ij,j->i", changes, self.base_rate) * 2.0 * math.pi / len(self.mass)
        size = 0.5 * (changes[:, int(np.argmax(self.mass))] - changes[:, int(np.argmin(self.mass))])
        return np.array([area / self.unit**2, size / self.unit, np.zeros_like(area)]).T

    def by_base(self, changes: FloatArray) -> FloatArray:
        """Changes (m, 3) of the numbers where the base's channel changes (m, p)."""
        area = np.einsum("ij,j->i", changes, self.mass_rate) * 2.0 * math.pi / len(self.mass)
        growth = np.einsum("ij,j->i", changes, self.line) / self.unit
        loop = area / self.unit**2 - 2.0 * self.loop * growth
        return np.array([loop, -self.amplitude * growth, self.unit * growth]).T


def bent_gain(filled: float) -> float:
    """Standard uncertainty of a cosine's gain over the linearity, by the share of the range that it fills.

    Examples
    --------
    >>> bent_gain(1.0), round(bent_gain(0.0), 2)
    (1.5, 2.68)
    """
    return float(_bent(np.array([[1.0], [0.0], [CUBIC_GAIN]]), filled)[0])


def bent_unknown(sources: Sources) -> float:
    """Relative standard uncertainty of a cosine's size by the linearity of its sensor, its swing not known.

    Where the range is known, the swing is taken as small: a sensor's gain is then most uncertain.
    """
    return sources.linearity * bent_gain(0.0 if sources.measuring_range else 1.0)


def unit_uncertainty(sources: Sources) -> float:
    """Relative standard uncertainty of Y by the gain and the linearity of the base's sensor, its swing not known."""
    return math.hypot(sources.base_gain, bent_unknown(sources))


def _bends(channel: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Swing of a channel A u, A u^2 and A u^3, u from -1 to 1 along it."""
    half = 0.5 * float(np.ptp(channel))
    u = (channel - channel.min()) / half - 1.0 if half > 0.0 else np.zeros_like(channel)
    return half * u, half * u**2, half * u**3


def _bent(slopes: FloatArray, filled: float) -> FloatArray:
    """Rms (m,) of what a cubic of unit linearity does, by its slopes (3, m) on gain, bend and cubic (see above)."""
    free, f = 1.0 - filled, filled
    gain, bend, cubic = slopes
    square = 7.2 * free**4 * gain**2 + 8.0 * f**2 * free**2 * gain * cubic
    return np.asarray(np.sqrt(square + 12.0 * f**2 * free**2 * bend**2 + 4.0 * f**4 * cubic**2))


def _filled(channel: FloatArray, sources: Sources, unit: float) -> float:
    """Share of its range that a sensor's motion fills; all of it where the range is not known."""
    reach = sources.measuring_range
    return min(1.0, float(np.ptp(channel)) * unit / reach) if reach else 1.0


def _derivative(cycle: FloatArray) -> FloatArray:
    """Derivative by tau of a cycle on equally spaced phases, by its harmonics."""
    lines = np.fft.rfft(cycle)
    return np.asarray(np.fft.irfft(1j * np.arange(len(lines)) * lines, len(cycle)))
