"""The unknowns of a fit: a law's parameters and the nuisances beside them, each with its prior, in units of it.

Every coordinate is normal with mean 0 and deviation 1 before anything is measured; one that has a bound at its neutral
value (a damping ratio, a static ratio) starts there and has half of that. A lag that nobody has declared has tails, and
three times the width of half a sample, which is a habit of instruments and no measurement: with a normal curve three
milliseconds cost so much that a law was climbed in their stead, and held as firmly as half a sample it was found too
small. The damping of a frame that nobody has measured has tails too.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from frictionlab.analysis.measurement import Measurement
from frictionlab.identification.family import HIGHER, Family
from frictionlab.simulator.laws import Parameter
from frictionlab.uncertainty import Sources, bent_gain, bent_unknown

FloatArray = NDArray[np.float64]
WIDE = 2.0 * 1.959964  # deviations from end to end of a 95 % interval
SECOND = 0.6  # of a measured second harmonic, each part: the base has it, or its sensor shows what is not there
SHARE = 0.5  # of the higher harmonics that the sensor of the base shows: the base has them, or it has not
WITHIN = 0.5 + 0.5 * 0.682689  # probability below one deviation of a normal curve
SMALLEST = 1e-6  # of the cycle: what a sensor bends or mixes less than this is not fitted
STRONGEST = 12.0  # deviations: farther from its prior no coordinate may go
UNDECLARED = "sensors.lag_s_u"  # the scene's key without which the lag's prior has tails
UNDECLARED_LAG = 3.0  # widths of half a sample: that of the prior of a lag that nobody has declared
PRESSED = 3.0  # deviations from what is declared of sensors and rig beyond which it, or the law, is wrong, ...
SUSPECT = (2.0, 4.0)  # ... and over which that grows sure of what is not declared, whose prior has tails
TAIL = 1.0  # exponent of the prior of a lag, and of a frame's damping, that nobody has declared: Cauchy's curve


@dataclass(frozen=True)
class Coordinate:
    """One unknown: its value is ``middle + width * c``, or e to that on a logarithmic scale.

    ``low``, ``high``: bounds of c; ``law``: whether it belongs to the law (else it is a nuisance); ``words``: what it
    is; ``folded``: whether its prior is the upper half of the normal curve; ``tail``: the exponent a of a prior that
    falls by ``(1 + c^2 / 2 a)^-a`` (Pearson's type VII), infinite for a normal one; ``assumed``: what budgets assume of
    it, in widths; ``unit``: that in which people read it, and how many of them the value 1 is.
    """

    name: str
    words: str
    middle: float = 0.0
    width: float = 1.0
    is_log: bool = False
    low: float = -STRONGEST
    high: float = math.inf
    law: bool = False
    folded: bool = False
    tail: float = math.inf
    assumed: float = 1.0
    unit: tuple[float, str] = (1.0, "")

    def value(self, c: float) -> float:
        """Return the value at a coordinate."""
        raw = self.middle + self.width * c
        return math.exp(raw) if self.is_log else raw

    def at(self, value: float) -> float:
        """Return the coordinate of a value."""
        raw = math.log(value) if self.is_log else value
        return (raw - self.middle) / self.width

    def slope(self, c: float) -> float:
        """Return the change of the value by the coordinate."""
        return self.width * (self.value(c) if self.is_log else 1.0)

    def strain(self, c: float) -> float:
        """Return the residual of the prior: half its square is what the logarithm of the prior has lost since c = 0.

        Examples
        --------
        >>> normal, tailed = Coordinate("a", ""), Coordinate("b", "", tail=1.0)
        >>> normal.strain(7.0), round(tailed.strain(7.0), 2), round(tailed.strain(1e-3), 6)
        (7.0, 2.55, 0.001)
        """
        if math.isinf(self.tail):
            return c
        return math.copysign(math.sqrt(2.0 * self.tail * math.log1p(0.5 * c * c / self.tail)), c)

    def strain_slope(self, c: float) -> float:
        """Return the change of the strain by the coordinate: 1 for a normal prior, less where tails fall slowly."""
        strain = self.strain(c)
        if math.isinf(self.tail) or abs(strain) < 1e-6:
            return 1.0
        return c / (strain * (1.0 + 0.5 * c * c / self.tail))

    def hold(self, c: float) -> float:
        """Return the weight of the normal prior about 0 that pulls as strongly at c: 1 but where a prior has tails."""
        return 1.0 / (1.0 + 0.5 * c * c / self.tail)

    def doubt(self, c: float) -> float:
        """Return how far what was known before may have pulled a value at c, over the pull of a normal prior.

        A prior with tails pulls by its weight at c times how far off the truth may be, which its curve puts farther
        out than a normal one with as much weight would: Cauchy's holds 68 % within 2.6, not 1.
        """
        if math.isinf(self.tail):
            return 1.0
        far = math.sqrt(2.0 * self.tail / (2.0 * self.tail - 1.0)) * float(stdtrit(2.0 * self.tail - 1.0, WITHIN))
        return max(math.sqrt(self.hold(c)), self.hold(c) * far)

    def suspicion(self, c: float) -> float:
        """Return how sure it is (0 to 1) that a fit which moves a nuisance to c does so for something else's sake.

        Examples
        --------
        >>> [Coordinate("a", "").suspicion(c) for c in (2.9, 3.1)]
        [0.0, 1.0]
        >>> [Coordinate("b", "", tail=1.0).suspicion(c) for c in (1.0, -3.0, 8.0)]
        [0.0, 0.5, 1.0]
        """
        if math.isinf(self.tail):
            return 1.0 if abs(c) > PRESSED else 0.0
        low, high = SUSPECT
        return min(1.0, max(0.0, (abs(c) - low) / (high - low)))

    @property
    def log_peak(self) -> float:
        """Logarithm of the prior's density at c = 0 over that of a normal one."""
        if math.isinf(self.tail):
            return 0.0
        return math.lgamma(self.tail) - math.lgamma(self.tail - 0.5) - 0.5 * math.log(self.tail)


def of_parameter(parameter: Parameter) -> Coordinate:
    """The coordinate of a law's parameter, by its usual range."""
    low, high = parameter.usual
    named = Coordinate(parameter.name, parameter.words, law=True)
    if parameter.scale == "log":
        middle, width = 0.5 * math.log(low * high), math.log(high / low) / WIDE
        end = (math.log(high) - middle) / width if parameter.neutral == math.inf else math.inf  # stiffer tells nothing
        return replace(named, middle=middle, width=width, is_log=True, high=end)
    if parameter.neutral is not None and parameter.neutral == parameter.low == low:
        return replace(named, middle=low, width=2.0 * (high - low) / WIDE, low=0.0, folded=True)
    middle, width = 0.5 * (low + high), (high - low) / WIDE
    least = (parameter.low - middle) / width if math.isfinite(parameter.low) else -STRONGEST
    return replace(named, middle=middle, width=width, low=max(-STRONGEST, least))


def nuisances(
    family: Family, sources: Sources, *, turn: float, second: float = 0.0, gain: float | None = None
) -> tuple[Coordinate, ...]:
    """What else may be off in one test, by what is known of its sensors and its rig.

    Parameters
    ----------
    family, sources
        The test, and what is known of it.
    turn : float
        Drive's angular frequency, rad/s.
    second : float
        Size over Y of a second harmonic seen in the base: it may be the sensor's or the base's.
    gain : float, optional
        Relative, of the mass's sensor over the base's; by default with what both sensors' linearity does to a cosine.
    """
    if gain is None:
        gain = math.hypot(sources.gain, bent_unknown(sources) * math.sqrt(2.0))
    words = "second harmonic of the base, {} part over Y"
    found = [
        _nuisance("natural_frequency", "natural frequency, relative", sources.natural_frequency),
        _nuisance("gain", "gain of the mass sensor over that of the base's", gain),
        _lag(sources, turn),
        _frame(family, sources),
        *(_nuisance(f"second_{part}", words.format(part), SECOND * second) for part in ("cosine", "sine")),
        _share(family),
    ]
    return tuple(c for c in found if c.width > 0.0)


def of_sensors(sources: Sources, *, amplitude: float, unit: float) -> tuple[float, tuple[Coordinate, ...]]:
    """Relative uncertainty of the gain, and what else two sensors may do to a motion: they bend it, and they mix.

    A bend of the mass's sensor is a cubic over its range (`frictionlab.uncertainty.budget`): a gain, a parabola and a
    cubic of the motion. A bend of the base's is a gain here, for all is over its size.

    Parameters
    ----------
    sources : Sources
    amplitude : float
        Half the swing of the mass, over Y.
    unit : float
        Y [m].
    """
    reach = sources.measuring_range
    in_mass, in_base = (min(1.0, size * 2.0 * unit / reach) if reach else 1.0 for size in (amplitude, 1.0))
    free = 1.0 - in_mass
    straight = sources.linearity * math.sqrt(7.2) * free**2
    gain = math.hypot(sources.gain, straight, sources.linearity * bent_gain(in_base))
    parabola, cubic = math.sqrt(12.0) * in_mass * free, 2.0 * in_mass**2
    found = (
        _nuisance("parabola", "parabola by which the mass's sensor bends the cycle", sources.linearity * parabola),
        _nuisance("cubic", "cubic by which the mass's sensor bends the cycle", sources.linearity * cubic),
        _nuisance("base_in_mass", "share of the base's channel in the mass's", sources.crosstalk),
        _nuisance("mass_in_base", "share of the mass's channel in the base's", sources.crosstalk),
    )
    return gain, tuple(c for c in found if c.width > SMALLEST)


def second_harmonic(family: Family, measurement: Measurement) -> float:
    """Size over Y of the second harmonic that the base sensor shows; 0 where it is noise, or simulated anyway."""
    if family.base.harmonics > 1:
        return 0.0
    cycle = measurement.cycle
    size = math.hypot(float(cycle.base_cosine[1]), float(cycle.base_sine[1]))
    noise = measurement.base_amplitude_m_se / measurement.base_amplitude_m
    return 0.0 if size < 3.0 * noise or size < 1e-4 else size


def _nuisance(name: str, words: str, width: float) -> Coordinate:
    return Coordinate(name, words, width=width)


def _lag(sources: Sources, turn: float) -> Coordinate:
    """The lag between the channels: its prior has tails where nobody has declared it."""
    tail = TAIL if UNDECLARED in sources.assumed else math.inf
    wider = 1.0 if math.isinf(tail) else UNDECLARED_LAG
    plain = _nuisance("lag", "lag between the channels, rad of the drive", wider * turn * sources.lag)
    return replace(plain, tail=tail, assumed=1.0 / wider, unit=(1e3 / turn, " ms"))


def _frame(family: Family, sources: Sources) -> Coordinate:
    """The frame's damping ratio: about what the scene says, or up from zero where it says nothing."""
    middle, width = family.held.get("frame_damping_ratio", 0.0), sources.damping_ratio
    low = max(-STRONGEST, -middle / width) if width > 0.0 else 0.0
    tail = math.inf if "frame_damping_ratio" in family.held else TAIL
    known = Coordinate("frame_damping_ratio", "frame's damping ratio", middle=middle, width=width, low=low, tail=tail)
    return replace(known, folded=middle == 0.0)


def _share(family: Family) -> Coordinate:
    """How much of the harmonics that the base's sensor shows is the base's: from none to all, and no more.

    Left free, 6.8 times what the sensor shows passed for a contact's dashpot, and Coulomb friction explained the cycle.
    """
    words = "share of the base's higher harmonics that is no sensor's"
    width = SHARE if family.higher else 0.0
    return Coordinate(HIGHER, words, width=width, low=0.0, high=1.0 / SHARE, folded=True)


def values_of(coordinates: tuple[Coordinate, ...], point: FloatArray) -> dict[str, float]:
    """Return the values at a point, by name."""
    return {c.name: c.value(float(p)) for c, p in zip(coordinates, point, strict=True)}


def point_of(coordinates: tuple[Coordinate, ...], values: Mapping[str, float]) -> FloatArray:
    """Return the point of some values; what is not given is at its prior's middle."""
    return np.array([c.at(values[c.name]) if c.name in values else max(0.0, c.low) for c in coordinates])


def strains(coordinates: tuple[Coordinate, ...], point: FloatArray) -> FloatArray:
    """Return the residuals (n,) of the priors at a point: a normal one's is the coordinate itself."""
    return np.array([c.strain(float(p)) for c, p in zip(coordinates, point, strict=True)])


def holds(coordinates: tuple[Coordinate, ...], point: FloatArray) -> FloatArray:
    """Return how firmly the priors hold the coordinates (n,) at a point."""
    return np.array([c.hold(float(p)) for c, p in zip(coordinates, point, strict=True)])


def doubts(coordinates: tuple[Coordinate, ...], point: FloatArray) -> FloatArray:
    """Return how far what was known before may have pulled the values at a point (n,): `Coordinate.doubt`."""
    return np.array([c.doubt(float(p)) for c, p in zip(coordinates, point, strict=True)])


def strain_slopes(coordinates: tuple[Coordinate, ...], point: FloatArray) -> FloatArray:
    """Return how these residuals (n,) change by the coordinates."""
    return np.array([c.strain_slope(float(p)) for c, p in zip(coordinates, point, strict=True)])


def suspicion(coordinates: tuple[Coordinate, ...], point: FloatArray) -> float:
    """Return how sure it is (0 to 1) that a fit moves sensors and rig for something else: by the worst of them."""
    told = zip(coordinates, point.tolist(), strict=True)
    return max((c.suspicion(far) for c, far in told if not c.law), default=0.0)


def pulled(posterior: FloatArray, doubt: FloatArray) -> FloatArray:
    """Return what errors of what was known before leave in the values, that of the k-th prior in column k: ``P D``.

    With a posterior covariance P (..., n, n), an error c of the prior leaves ``P c`` in the values, and c reaches D
    times as far as a normal prior with its weight would (`Coordinate.doubt`). All priors together add ``P D^2 P``.
    """
    return posterior * doubt
