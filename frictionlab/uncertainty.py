"""A number with its errors, and what is not known of sensors, clock and rig does to it (GUM, JCGM 100).

A result holds its numbers as estimates; the flat names of the contract (a column's, with ``_se`` and ``_u``) are read
off them by `Flat` and `FlatKnown`, so that a number and its errors cannot part. `average` makes one number of several
that scatter by more than their errors. What sensors, clock and rig do::

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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from frictionlab.arrays import FloatArray, shifted
from frictionlab.scene import Infer, Scene
from frictionlab.schema import AMPLITUDE, BASE, ENERGY, with_error

Part = Literal["value", "se", "u", "low", "high"]
Shares = Mapping[str, float]
STATISTICAL = "noise and scatter"
LINES = "hum and other lines"
FILTER = "filter of the mass sensor"
KEYS = (ENERGY, AMPLITUDE, BASE)
LAG, FREQUENCY, STIFF = "sensors.lag_s_u", "rig.natural_frequency_hz_u", "rig.stiffness_n_per_m_u"
LEVEL, NORMAL = 0.95, 1.959964  # of an interval, and of how many standard errors to either side it is
ROUNDING = 1e-12  # below it a share is the rounding of differences
CUBIC_GAIN = 0.75  # of a cosine's cube, in its fundamental
NATURAL_FREQUENCY = 0.002  # relative: two publications of one frame say 3.115 and 3.130 Hz
DAMPING = 0.1  # relative: of a damping ratio that is given without its uncertainty
UNKNOWN_DAMPING = 0.005  # of a frame whose damping ratio nobody has measured
STIFFNESS = 0.005  # relative
NORMAL_FORCE = 0.01  # relative


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number with its errors; ``None`` is not known, and so is NaN.

    ``se``: standard error, what its own scatter and the sensors' noise do to it (GUM, type A); ``u``: combined standard
    uncertainty, with what sensors, clock and rig do to it (type A and B).

    Examples
    --------
    >>> energy = Estimate(2.1260, 0.0031)
    >>> print(energy, energy.known, energy.scaled(1000.0).se)
    2.126 ± 0.003 True 3.1
    >>> Estimate(math.nan).known, str(Estimate())
    (False, 'not known')
    """

    value: float | None = None
    se: float | None = None
    u: float | None = None

    def __post_init__(self) -> None:
        for part in ("value", "se", "u"):
            number = getattr(self, part)
            if number is not None and not math.isfinite(number):
                object.__setattr__(self, part, None)

    @property
    def known(self) -> bool:
        """Whether there is a number."""
        return self.value is not None

    @property
    def error(self) -> float | None:
        """The widest error that is known: the combined uncertainty, else the standard error."""
        return self.se if self.u is None else self.u

    @property
    def low(self) -> float | None:
        """Lower end of the 95 % interval."""
        return None if self.value is None or self.error is None else self.value - NORMAL * self.error

    @property
    def high(self) -> float | None:
        """Upper end of it."""
        return None if self.value is None or self.error is None else self.value + NORMAL * self.error

    @property
    def relative_se(self) -> float | None:
        """Standard error over the number; None where one of them is not known, or the number is 0."""
        return abs(self.se / self.value) if self.value and self.se is not None else None

    def scaled(self, factor: float | None) -> "Estimate":
        """The number times an exact one; not known where that is not."""
        if factor is None or self.value is None:
            return Estimate()
        se, u = (None if error is None else error * abs(factor) for error in (self.se, self.u))
        return Estimate(self.value * factor, se, u)

    def over(self, divisor: float | None) -> "Estimate":
        """The number over an exact one; not known where that is not, or is 0."""
        found = self.scaled(1.0 / divisor if divisor else None)
        return found if self.value is None or not divisor else replace(found, value=self.value / divisor)

    def with_u(self, u: float | None) -> "Estimate":
        """The same number with its combined standard uncertainty."""
        return replace(self, u=u)

    def widened(self, share: float) -> "Estimate":
        """The same number, a share of itself added to its uncertainty, where one is known."""
        if self.value is None or self.error is None:
            return self
        return self.with_u(math.hypot(self.error, share * self.value))

    def __str__(self) -> str:
        return with_error(self.value, self.error) if self.known else "not known"


def with_digits(value: float, u: float) -> str:
    """A number as it is declared: two digits of its standard uncertainty are left, or four of itself where u is 0."""
    digits = max(1, 2 + math.ceil(math.log10(abs(value) / u))) if value and u else 4
    return f"{value:.{digits}g}"


NOT_KNOWN = Estimate()


class Flat:
    """A flat name of one part (``value``, ``se`` or ``u``) of an estimate that a result holds, by its field's name.

    ``None`` where it is not known.
    """

    def __init__(self, estimate: str, part: Part = "value") -> None:
        self._estimate, self._part = estimate, part

    def __get__(self, result: object, kind: type) -> float | None:
        """Return the part of a result's estimate; AttributeError of its class, which has none."""
        number: float | None = getattr(getattr(result, self._estimate), self._part)
        return number


class FlatKnown(Flat):
    """As `Flat`, of a number that every such result has, to reckon with: NaN where it is not known after all."""

    def __get__(self, result: object, kind: type) -> float:
        """Return the part of a result's estimate."""
        number = super().__get__(result, kind)
        return math.nan if number is None else number


class FrictionNames:
    """Flat names of the estimates ``friction`` (the friction ratio), ``force`` (N) and ``coefficient`` of a result.

    That of the friction ratio itself is the result's own: some have it always.
    """

    friction_ratio_se, friction_ratio_u = Flat("friction", "se"), Flat("friction", "u")
    friction_force_n, friction_coefficient = Flat("force"), Flat("coefficient")
    friction_force_n_se, friction_force_n_u = Flat("force", "se"), Flat("force", "u")
    friction_coefficient_se, friction_coefficient_u = Flat("coefficient", "se"), Flat("coefficient", "u")


@dataclass(frozen=True)
class Average:
    """Mean of several estimates, its standard error, and their scatter beyond their own errors (None for one alone)."""

    mean: float
    se: float
    spread: float | None


def average(values: Sequence[float], errors: Sequence[float]) -> Average:
    """Mean weighted by the errors and by the scatter beyond them [DerSimonian and Laird 1986].

    The standard error is the larger of what the errors and what the values themselves say.

    Examples
    --------
    >>> average([1.0, 2.0, 3.0], [0.1, 0.1, 0.1]).mean
    2.0
    >>> average([3.0], [0.1])
    Average(mean=3.0, se=0.1, spread=None)
    """
    value, error = np.asarray(values, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if len(value) == 1:
        return Average(float(value[0]), float(error[0]), None)
    error = np.maximum(error, 1e-12 * float(np.abs(value).max(initial=1e-300)))
    weight = 1.0 / error**2
    share = weight / weight.sum()
    excess = float(np.sum(weight * (value - np.sum(share * value)) ** 2)) - (len(value) - 1)
    spread = math.sqrt(max(excess, 0.0) / float(np.sum(weight * (1.0 - share))))
    weight = 1.0 / (error**2 + spread**2)
    mean = float(np.sum(weight * value) / np.sum(weight))
    seen = math.sqrt(float(np.sum(weight * (value - mean) ** 2)) / (len(value) - 1) / float(weight.sum()))
    return Average(mean, max(1.0 / math.sqrt(float(weight.sum())), seen), spread)


@dataclass(frozen=True)
class Sources:
    """Standard uncertainties of one test, each of one cause.

    ``mass_gain``, ``base_gain``, ``natural_frequency``, ``stiffness``, ``normal_force``: relative; ``lag``: s between
    the two channels; ``linearity``: share of a sensor's measuring range; ``measuring_range``: that range in m, None
    where it is not known; ``damping_ratio``: of the frame; ``crosstalk``: share of one channel in the other.
    ``assumed``: scene keys of those that nobody has declared; ``infer``: what is known before of the law's parameters.
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
    infer: Infer = field(default_factory=Infer)

    @property
    def gain(self) -> float:
        """Relative uncertainty of the mass sensor's gain over the base's."""
        return math.hypot(self.mass_gain, self.base_gain)

    @property
    def lag_is_assumed(self) -> bool:
        """Whether neither the scene nor, of two logs, their recording says how well the lag is known.

        With `lag` the one owner of that fact: unknowns, laws of a material and what is printed as assumed follow it.
        """
        return LAG in self.assumed


def sources_of(
    scene: Scene, sampling_rate_hz: float, *, normal_force_n: float | None = None, lag_s_u: float | None = None
) -> Sources:
    """Return what is known of one test, by ``[sensors]`` and the ``_u`` keys of ``[rig]`` and ``[experiment]``.

    ``sampling_rate_hz``: two channels that are not said to be sampled together may be apart by half an interval either
    way; ``normal_force_n``: of this test; ``lag_s_u``: standard uncertainty of the alignment of two logs, as their
    recording has it; a scene's own wins.
    """
    sensors, rig, force = scene.sensors, scene.rig, scene.experiment
    assumed: list[str] = []

    def known(key: str, declared: float | None, default: float, over: float | None = 1.0) -> float:
        """What is declared, over a value; the default where it is not, or the value is not known."""
        if declared is not None and over:
            return declared / over
        assumed.append(key)
        return default

    damping = UNKNOWN_DAMPING if rig.damping_ratio is None else DAMPING * rig.damping_ratio
    lag = lag_s_u if sensors.lag_s_u is None else sensors.lag_s_u
    pressed = normal_force_n or force.normal_force_n
    return Sources(
        mass_gain=sensors.gain_error,
        base_gain=sensors.gain_error,
        linearity=sensors.linearity,
        measuring_range=scene.log.measuring_range_m,
        lag=known(LAG, lag, lag_of_samples(sampling_rate_hz)),
        crosstalk=sensors.crosstalk,
        natural_frequency=known(FREQUENCY, rig.natural_frequency_hz_u, NATURAL_FREQUENCY, rig.natural_frequency),
        damping_ratio=known("rig.damping_ratio_u", rig.damping_ratio_u, damping),
        stiffness=known(STIFF, rig.stiffness_n_per_m_u, STIFFNESS, rig.stiffness),
        normal_force=known("experiment.normal_force_n_u", force.normal_force_n_u, NORMAL_FORCE, pressed),
        assumed=tuple(assumed),
        infer=scene.infer,
    )


def lag_of_samples(sampling_rate_hz: float) -> float:
    """Standard uncertainty (s) of a lag of up to half a sampling interval either way."""
    return 0.5 / sampling_rate_hz / math.sqrt(3.0)


def combined(shares: Shares) -> float:
    """Combined standard uncertainty: the shares in quadrature."""
    return math.sqrt(math.fsum(share**2 for share in shares.values()))  # from Python 3.12 on `sum` rounds otherwise


def cycle_budget(
    mass: FloatArray, base: FloatArray, sources: Sources, *, turn: float, unit: float
) -> dict[str, Shares]:
    """Return what each source adds to the numbers of a mean cycle, in the numbers' own units.

    ``mass``, ``base`` (p,): x/Y and y/Y on equally spaced phases; ``turn``: drive's angular frequency, rad/s; ``unit``:
    Y in m. Returns of the energy (k Y^2), the amplitude (Y) and the base's amplitude (m), by their columns: source ->
    standard uncertainty.
    """
    way = 2.0 * math.pi / len(base)
    once = way * np.arange(len(base))
    turns = np.array([np.cos(once), np.sin(once)]) * (2.0 / len(base))
    first, mass_rate, base_rate = turns @ base, shifted(mass, order=1), shifted(base, order=1)
    size = float(np.hypot(*first))  # of the base's fundamental; `line` weighs the base to it
    line, top, bottom = first @ turns / size, int(np.argmax(mass)), int(np.argmin(mass))
    loop, amplitude = way * float(np.dot(base, mass_rate)) / size**2, 0.5 * float(np.ptp(mass)) / size

    def by_mass(change: FloatArray) -> FloatArray:
        """What a change of the mass's channel (p,) does to energy, amplitude and unit."""
        return np.array([-way * (change @ base_rate) / size**2, 0.5 * (change[top] - change[bottom]) / size, 0.0])

    def by_base(change: FloatArray) -> FloatArray:
        """The same of the base's channel, whose amplitude is the unit of all: the area changes by ``db . D m``."""
        rise = float(line @ change)
        growth, area = rise / size, way * (change @ mass_rate) / size**2
        return np.array([area - 2.0 * loop * growth, -amplitude * growth, unit * rise])

    bent = [
        _bent(np.array([by(change) for change in bends(channel)]), _filled(channel, sources, unit))
        for by, channel in ((by_mass, mass), (by_base, base))
    ]
    causes = {
        "gain of the mass sensor": sources.mass_gain * by_mass(mass),
        "gain of the base sensor": sources.base_gain * by_base(base),
        "linearity of the sensors": sources.linearity * np.hypot(*bent),
        "lag between the channels": turn * sources.lag * by_mass(mass_rate) * (1.0, 0.0, 0.0),
        "crosstalk": sources.crosstalk * np.hypot(by_mass(base), by_base(mass)),
    }
    return {
        key: {cause: size for cause, sizes in causes.items() if (size := abs(float(sizes[i]))) > ROUNDING}
        for i, key in enumerate(KEYS)
    }


def bent_gain(filled: float) -> float:
    """Standard uncertainty of a cosine's gain over the linearity, by the share of the range that it fills.

    Examples
    --------
    >>> bent_gain(1.0), round(bent_gain(0.0), 2)
    (1.5, 2.68)
    """
    return float(_bent(np.array([[1.0], [0.0], [CUBIC_GAIN]]), filled)[0])


def unit_uncertainty(sources: Sources) -> float:
    """Relative standard uncertainty of Y by the gain and the linearity of the base's sensor, its swing not known.

    The swing is taken as small in a range that is known, at the worst.
    """
    return math.hypot(sources.base_gain, sources.linearity * bent_gain(0.0 if sources.measuring_range else 1.0))


def unit_share(unit: str, sources: Sources) -> float:
    """Relative standard uncertainty of what makes a parameter of a law physical: of its unit, over that of one."""
    of_base = unit_uncertainty(sources)
    forces = {"N": of_base, "N/m": 0.0, "N s/m": sources.natural_frequency}
    return math.hypot(sources.stiffness, forces[unit]) if unit in forces else of_base if unit else 0.0


def bends(channel: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what bends a channel (p,) of the swing A: A u, A u^2 and A u^3, u from -1 to 1 along it."""
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
