"""What a fit does not know: parameters of the law, sensors and rig, each with its level and its prior.

A *rig* unknown has one value in all tests (a lag may scatter between them, within what is known of it); a *material*
unknown has one value in all tests of a material, and a scatter; a *test* unknown has a value of its own in each. Every
unknown is counted in standard deviations of its prior, from the prior's mean: that number is its coordinate.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from scipy.special import stdtrit

from frictionlab.scene import Infer
from frictionlab.simulator.laws import Law, Parameter
from frictionlab.uncertainty import LAG, NORMAL, Sources, bent_gain

Level = Literal["rig", "material", "test"]

WIDE = 2.0 * NORMAL  # standard deviations from end to end of a 95 % interval
WITHIN = 0.5 + 0.5 * 0.682689  # probability below one standard deviation of a normal distribution
LARGEST = 700.0  # of a logarithm: beyond it no double is left, and no parameter's domain
STRONGEST = 12.0  # standard deviations: no coordinate goes farther from its prior
SMALLEST = 1e-6  # of the cycle: a nonlinearity or crosstalk below this is not fitted
UNDECLARED_LAG = 3.0  # half sampling intervals (standard uncertainty): prior of a lag that nobody has declared
DIFFERS = 0.1  # of what is known of a lag: scale of the prior of its scatter from test to test
STRAINED = 3.0  # standard uncertainties from what is known of sensors and rig beyond which the scene is doubted
FAR = math.sqrt(2.0) * float(stdtrit(1.0, WITHIN))  # of Cauchy's distribution: holds 68 %, in standard deviations
SCATTER = 0.02  # scale of the prior (half-Cauchy) of the relative scatter from test to test of all other parameters


@dataclass(frozen=True)
class Unknown:
    """One unknown; its value is ``mean + sd * c`` at a coordinate c, or e to that on a logarithmic scale.

    ``level``: rig, material or test; ``mean``, ``sd``: of the prior; ``scale``: linear or log; ``low``, ``high``:
    bounds of the coordinate; ``unit``: how many of the unit that people read the value 1 is, and its name; ``folded``:
    whether the prior is the upper half of the normal distribution (what can only be positive); ``assumed``: the
    key that nobody has declared (of a lag, a frame's damping): the prior is then Cauchy's, ``1 / (1 + c^2 / 2)``;
    ``known_to``: what is declared or assumed of it, in `sd`; ``law``: whether it is a parameter of the law, and not of
    sensors or rig; ``key``: the scene's key that declares it; ``scatter``: scale of the prior (half-Cauchy) of its
    scatter from test to test, in coordinates, but relative for a linear parameter that is not of the test's level;
    ``first``: value at which a new term is tried.
    """

    name: str
    words: str
    level: Level = "rig"
    mean: float = 0.0
    sd: float = 1.0
    scale: Literal["linear", "log"] = "linear"
    low: float = -STRONGEST
    high: float = math.inf
    unit: tuple[float, str] = (1.0, "")
    folded: bool = False
    assumed: str = ""
    known_to: float = 1.0
    law: bool = False
    key: str = ""
    scatter: float = 0.0
    first: float | None = None

    def value(self, c: float) -> float:
        """Return the value at a coordinate."""
        raw = self.mean + self.sd * c
        return math.exp(min(raw, LARGEST)) if self.scale == "log" else raw

    def at(self, value: float) -> float:
        """Return the coordinate of a value."""
        raw = math.log(value) if self.scale == "log" else value
        return (raw - self.mean) / self.sd

    def slope(self, c: float) -> float:
        """Return the change of the value with the coordinate."""
        return self.sd * (self.value(c) if self.scale == "log" else 1.0)

    def strain(self, c: float) -> float:
        """Return the residual of the prior: half its square is what the log prior has lost since c = 0."""
        return math.copysign(math.sqrt(2.0 * math.log1p(0.5 * c * c)), c) if self.assumed else c

    def strain_slope(self, c: float) -> float:
        """Return the change of the strain with the coordinate."""
        strain = self.strain(c)
        return c / (strain * (1.0 + 0.5 * c * c)) if self.assumed and abs(strain) >= 1e-6 else 1.0

    def hold(self, c: float) -> float:
        """Return the weight of the normal prior about 0 that pulls as strongly at c."""
        return 1.0 / (1.0 + 0.5 * c * c) if self.assumed else 1.0

    def doubt(self, c: float) -> float:
        """Return the standard deviation that an error of the prior has in the normal equations at c.

        1 for a normal prior. Cauchy's distribution holds 68 % within 2.6 of its scale, and pulls by `hold` times that.
        """
        return max(math.sqrt(self.hold(c)), self.hold(c) * FAR) if self.assumed else 1.0

    def scatter_scale(self, c: float) -> float:
        """Return the scale of the prior of its scatter, in coordinates."""
        if self.scatter <= 0.0 or self.level != "material" or self.scale == "log":
            return self.scatter
        return self.scatter * abs(self.value(c)) / self.sd


def of_parameter(parameter: Parameter) -> Unknown:
    """Return the unknown of a law's parameter: its prior is its usual range (95 %).

    A parameter that can only grow from where its term does nothing (a dashpot, a static ratio) has half a normal prior.
    """
    low, high = parameter.usual
    level: Level = "test" if parameter.reseated else "material"
    scatter = parameter.reseated or SCATTER
    made = Unknown(parameter.name, parameter.words, level, law=True, scatter=scatter, first=parameter.first)
    if parameter.scale == "log":
        mean, sd = 0.5 * math.log(low * high), math.log(high / low) / WIDE
        largest = high if parameter.neutral == math.inf else parameter.high
        end = min((math.log(largest) - mean) / sd, STRONGEST)
        return replace(made, mean=mean, sd=sd, scale="log", high=end, scatter=SCATTER / sd)
    if parameter.neutral is not None and parameter.neutral == parameter.low == low:
        return replace(made, mean=low, sd=2.0 * (high - low) / WIDE, low=0.0, folded=True)
    mean, sd = 0.5 * (low + high), (high - low) / WIDE
    least = (parameter.low - mean) / sd if math.isfinite(parameter.low) else -STRONGEST
    return replace(made, mean=mean, sd=sd, low=max(-STRONGEST, least))


def of_law(law: Law, held: Mapping[str, float], declared: Infer) -> tuple[Unknown, ...]:
    """Return the unknowns of a law's own parameters: those that the scene does not hold, without counts.

    ``declared``: the scene's ``[infer]``, whose levels and priors stand in place of the usual ones.
    """
    return tuple(_declared(of_parameter(p), declared) for p in law.own if p.name not in held and not p.whole)


def _declared(usual: Unknown, declared: Infer) -> Unknown:
    """The unknown as the scene declares it; its bounds, as values, and its scatter's prior stay where it does not."""
    if declared.levels.get(usual.name, usual.level) != usual.level:
        scatter = SCATTER / usual.sd if usual.scale == "log" else SCATTER
        usual = replace(usual, level=declared.levels[usual.name], scatter=scatter)
    if usual.name not in declared.priors:
        return usual
    mean, sd = declared.priors[usual.name]
    mean, sd = (math.log(mean), sd / mean) if usual.scale == "log" else (mean, sd)
    low, high = ((usual.mean + usual.sd * end - mean) / sd for end in (usual.low, usual.high))
    absolute = usual.scale == "log" or usual.level == "test"
    scatter = usual.scatter * (usual.sd / sd if absolute else 1.0)
    return replace(usual, mean=mean, sd=sd, low=low, high=high, folded=False, scatter=scatter)


def of_rig(
    sources: Sources, held: Mapping[str, float], *, amplitude: float, unit: float, distorted: bool
) -> tuple[Unknown, ...]:
    """Return what is not known of sensors and rig, by what the scene declares of them.

    ``held``: parameters that the scene holds: the frame's damping ratio is known about its value there; ``amplitude``:
    half the swing of the mass, over Y; ``unit``: Y [m], half the swing of the base; ``distorted``: whether the base's
    sensor shows harmonics: its nonlinearity may be what makes them.
    """

    def bends(swing: float) -> tuple[float, float]:  # share of the range that a half swing (m) fills, the cubic's gain
        share = min(1.0, swing * 2.0 / sources.measuring_range) if sources.measuring_range else 1.0
        return share, sources.linearity * math.sqrt(7.2) * (1.0 - share) ** 2

    def cubic_error(share: float) -> tuple[float, float]:  # both bends of it (`frictionlab.uncertainty`)
        return sources.linearity * math.sqrt(12.0) * share * (1.0 - share), sources.linearity * 2.0 * share**2

    (in_mass, of_gain), (in_base, _) = bends(amplitude * unit), bends(unit)
    gain = math.hypot(sources.gain, of_gain, sources.linearity * bent_gain(in_base))
    mass, base = cubic_error(in_mass), cubic_error(in_base) if distorted else (0.0, 0.0)
    damping, frame = sources.damping_ratio, held.get("frame_damping_ratio")
    found = [
        Unknown("natural_frequency", "natural frequency", sd=sources.natural_frequency, key="rig.natural_frequency_hz"),
        Unknown("gain", "gain of a sensor", sd=gain, key="sensors.gain_error"),
        lag("lag_s", "lag between the channels", sources.lag, "sensors.lag_s", LAG if sources.lag_is_assumed else ""),
        damping_of("frame_damping_ratio", "frame's damping", frame or 0.0, damping, "rig.damping_ratio"),
    ]
    if frame is None:  # which nobody has declared: up from zero, by a prior with tails
        found[-1] = replace(found[-1], assumed="rig.damping_ratio")
    for name, words, sd in (
        ("parabola", "parabola by which the mass's sensor bends the cycle", mass[0]),
        ("cubic", "cubic by which the mass's sensor bends the cycle", mass[1]),
        ("base_parabola", "parabola by which the base's sensor bends the cycle", base[0]),
        ("base_cubic", "cubic by which the base's sensor bends the cycle", base[1]),
    ):
        found.append(Unknown(name, words, sd=sd, key="sensors.linearity"))
    for one, other in (("base", "mass"), ("mass", "base")):
        words = f"share of the {one}'s channel in the {other}'s"
        found.append(Unknown(f"{one}_in_{other}", words, sd=sources.crosstalk, key="sensors.crosstalk"))
    return tuple(u for u in found if u.sd > SMALLEST)


def damping_of(name: str, words: str, value: float, u: float, key: str) -> Unknown:
    """Return the unknown of a storey's damping ratio that is known about a value to u: it cannot fall below zero."""
    low = max(-STRONGEST, -value / u) if u > 0.0 else 0.0
    return Unknown(name, words, mean=value, sd=u, low=low, folded=value == 0.0, key=key)


def lag(name: str, words: str, u: float, key: str, assumed: str) -> Unknown:
    """Return the unknown of a lag between two channels that is known to u [s].

    ``assumed``: the key that nobody has declared; the prior is then wider, with tails.
    """
    wider = UNDECLARED_LAG if assumed else 1.0
    known = 1.0 / wider
    return Unknown(
        name, words, sd=wider * u, assumed=assumed, known_to=known, unit=(1e3, "ms"), key=key, scatter=DIFFERS * known
    )
