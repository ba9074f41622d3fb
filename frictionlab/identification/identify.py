"""Which values of a law a measured cycle asks for, how sure each is, and what the cycle does not tell."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError
from frictionlab.identification.causes import pressed, shares
from frictionlab.identification.coordinates import (
    Coordinate,
    nuisances,
    of_parameter,
    of_sensors,
    point_of,
    second_harmonic,
)
from frictionlab.identification.engines import STATES, prepare
from frictionlab.identification.family import Family
from frictionlab.identification.fit import RIVAL, Fit, fit, fits_from, misfit_is_noise, released, suspected, unfitted
from frictionlab.identification.fit_errors import Errors, errors_as_known, errors_of, errors_strained
from frictionlab.identification.forward import Forward
from frictionlab.identification.loop import loop_friction_ratio
from frictionlab.identification.observed import EXPLAINED, Observed, observe_cycle
from frictionlab.identification.valleys import start_at, starts_of
from frictionlab.simulator.laws import Parameter, law_of
from frictionlab.simulator.meter import Meter
from frictionlab.uncertainty import Sources

FloatArray = NDArray[np.float64]
RICHER = ("place", "speed")  # what a law that leaves a misfit is held against
TOLD = 0.5  # a parameter is told if its variance has fallen below this share of its prior's ...
SURE = 2.0  # ... and it lies so many errors from where its term does nothing
LEVEL = 0.95  # of a limit
VAGUE = 0.1  # relative standard error from which a friction ratio is called vague
CORRECTED = 9.0  # by which correcting sensors and rig must lower the sum of squares: three errors of one of them


@dataclass(frozen=True)
class ParameterEstimate:
    """One parameter of a law as one test tells it.

    ``se``: standard error with the rig as it is known; ``u``: with what is not known of sensors and rig as well; both
    None for a value that was given. ``told``: whether this test tells it at all; ``lower``, ``upper``: 95 % limits,
    None where there is no limit.
    """

    value: float
    se: float | None = None
    u: float | None = None
    told: bool = False
    lower: float | None = None
    upper: float | None = None


@dataclass(frozen=True)
class Identified:
    """A law fitted to one measured cycle.

    ``parameters``: by name, the law's own in order; ``nuisances``: name -> (value, standard uncertainty, prior's);
    ``shares``: source -> standard uncertainty that it adds to the friction ratio; ``warnings``: sentences; ``moved``:
    the fit that moves sensors and rig, where the values are of the one that holds them as they are known.
    """

    family: Family
    fit: Fit
    errors: Errors
    parameters: dict[str, ParameterEstimate]
    nuisances: dict[str, tuple[float, float, float]]
    shares: dict[str, float]
    warnings: tuple[str, ...] = ()
    moved: Fit | None = None


def coordinates_of(family: Family, measurement: Measurement, sources: Sources) -> tuple[Coordinate, ...]:
    """The unknowns of a fit: the law's free parameters, then the nuisances."""
    turn, second = 2.0 * math.pi * measurement.drive_frequency_hz, second_harmonic(family, measurement)
    own = (of_parameter(family.law.parameter(name)) for name in family.free)
    gain, shown = of_sensors(sources, amplitude=measurement.response_amplitude, unit=measurement.base_amplitude_m)
    return (*own, *nuisances(family, sources, turn=turn, second=second, gain=gain), *shown)


def forward_of(
    family: Family, measurement: Measurement, sources: Sources, observed: Observed, meter: Meter | None = None
) -> Forward:
    """What turns the unknowns of one test into the cycle that would be measured."""
    return Forward(family, coordinates_of(family, measurement, sources), observed.harmonics, meter, observed.kept)


def identify(
    measurement: Measurement,
    family: Family,
    sources: Sources,
    meter: Meter | None = None,
    near: Mapping[str, float] | None = None,
    starts: Sequence[FloatArray] | None = None,
) -> Identified:
    """Return the best values of a law for a measured cycle, each with its errors.

    Sensors and rig are fitted beside the law, each held by what is known of it. Where the law alone leaves no more than
    noise, and no correction of sensors and rig lowers that much, the cycle gives no reason to correct them: the values
    of the law alone are given, and their errors hold how far the other fit is from them. ``near``: values that a fit
    begins at too; ``starts``: what `starts_of` gives, if it has been asked.

    Raises
    ------
    AnalysisError
        The mass stands still, the loop takes in no energy, or no value tried has a steady state.
    OverspentError
        Nothing is left on the meter.
    """
    prepare(family, STATES)
    observed = observe_cycle(measurement)
    forward = forward_of(family, measurement, sources, observed, meter)
    starts = starts_of(measurement, forward, observed) if starts is None else starts
    plain = replace(forward, coordinates=tuple(c for c in forward.coordinates if c.law))
    known = len(plain.coordinates)
    begun = starts_of(measurement, plain, observed) if any(start[known:].any() for start in starts) else starts
    close = [] if near is None else [start_at(forward, near)]
    held = fits_from(plain, observed, [start[:known] for start in (*begun, *close)])
    as_noise = misfit_is_noise(held[0])
    if as_noise:  # the rig is nearly as it is known: the valleys that matter can be told without it
        rig = point_of(forward.coordinates[known:], {})
        starts = [np.concatenate([found.point, rig]) for found in (held[0], *_near(held))]
    else:
        starts = [*starts, *close]
    fits = fits_from(forward, observed, starts)
    as_it_is = as_noise and _gained(held[0], fits[0]) < CORRECTED
    found = released(held[0], forward) if as_it_is else fits[0]
    if as_it_is:
        errors = errors_as_known(found, held[0], fits[0])
    elif suspected(found):
        errors = errors_strained(found, held[0])
    else:
        errors = errors_of(found)
    richer, energy = _otherwise(measurement, sources, found)
    told = with_errors(family, found, rivals=_rivals(fits), richer=richer, energy=energy, errors=errors)
    return replace(told, moved=fits[0] if as_it_is else None)


def _gained(held: Fit, moved: Fit) -> float:
    """By how much the sum of squares falls, priors counted, when sensors and rig are moved beside the law."""
    return held.chi_square + held.strain - moved.chi_square - moved.strain


def _otherwise(measurement: Measurement, sources: Sources, found: Fit) -> tuple[float | None, float | None]:
    """What a richer law or the energy of the loop says of the friction ratio where a law misses: one of them, or none.

    Where the richer law misses as well, whichever stands farther off.
    """
    other, energy = _under_a_richer_law(measurement, sources, found), _by_energy(measurement, found)
    if other is None:
        return None, energy
    richer, own = other.values["beta"], found.values["beta"]
    misses = other.nrmse > EXPLAINED * other.observed.floor
    if energy is not None and misses and abs(energy - own) > abs(richer - own):
        return None, energy
    return richer, None


def _under_a_richer_law(measurement: Measurement, sources: Sources, found: Fit) -> Fit | None:
    """The fit of the same cycle with place and speed in the law as well, where the law may be a wrong one.

    It may be where it leaves a misfit, or leaves none only with sensors and rig unlike what is known of them: friction
    that it does not know of moves the friction ratio that it finds, and the two tell by how much. None elsewhere, and
    where the richer law does not explain the cycle better.
    """
    law, more = found.forward.family.law, [term for term in RICHER if not found.forward.family.law.has(term)]
    explained = found.nrmse <= EXPLAINED * found.observed.floor and not pressed(found)
    if explained or law.kind != "rigid" or not more:
        return None
    family = found.forward.family.under(law_of("+".join((law.name, *more))))
    forward = forward_of(family, measurement, sources, found.observed)
    try:
        other = fit(forward, found.observed, [start_at(forward, found.values)])
    except AnalysisError:
        return None  # no steady state near under that law: it tells nothing
    return other if other.nrmse < 0.7 * found.nrmse else None


def _by_energy(measurement: Measurement, found: Fit) -> float | None:
    """The friction ratio by the energy of the loop alone, where a law that takes in energy by friction misses.

    At an edge of the law (the mass would stick) a fit looks certain however wrong it is: energy over path has no edge.
    """
    law = found.forward.family.law
    if found.nrmse <= EXPLAINED * found.observed.floor or law.kind != "rigid" or law.has("speed"):
        return None
    return loop_friction_ratio(measurement, found.forward.family.wall) if "beta" in found.values else None


def as_known(measurement: Measurement, family: Family, sources: Sources) -> Identified:
    """Return the law with the values that are held: what is not held is found, sensors and rig are as they are known.

    Raises
    ------
    AnalysisError
        There is no steady state with these values.
    """
    if family.free:
        return identify(measurement, family, sources)
    observed = observe_cycle(measurement)
    return with_errors(family, unfitted(Forward(family, (), observed.harmonics, kept=observed.kept), observed))


def _rivals(fits: list[Fit]) -> tuple[float, ...]:
    """Friction ratios of other valleys that fit nearly as well."""
    return tuple(other.values["beta"] for other in _near(fits))


def _near(fits: list[Fit]) -> list[Fit]:
    """Fits of other valleys that leave little more than the best, the first of them all."""
    best = fits[0]
    return [
        other
        for other in fits[1:]
        if (other.chi_square - best.chi_square) / best.excess < RIVAL
        and abs(other.values["beta"] / best.values["beta"] - 1.0) > 0.01
    ]


def with_errors(
    family: Family,
    found: Fit,
    *,
    rivals: tuple[float, ...] = (),
    richer: float | None = None,
    energy: float | None = None,
    errors: Errors | None = None,
) -> Identified:
    """Return a fit with the errors, limits and caveats of its values; its errors are found unless they are given.

    ``rivals``: friction ratios that fit nearly as well; ``richer``: what a richer law would say, where this one misses;
    ``energy``: what the energy of the loop says then, where no richer law is better.
    """
    errors = errors_of(found) if errors is None else errors
    parameters, known = {}, {}
    for i, c in enumerate(found.coordinates):
        value, slope = c.value(float(found.point[i])), c.slope(float(found.point[i]))
        spread = slope * math.sqrt(errors.combined[i, i])
        if c.law:
            parameters[c.name] = _estimate(family, c, found, errors, i)
        else:
            known[c.name] = (value, spread, c.width)
    values = found.forward.family.problem(found.law_values).parameters
    own = {p.name: parameters.get(p.name, ParameterEstimate(values[p.name])) for p in family.law.parameters}
    other = energy if richer is None else richer
    own["beta"] = _with_law(_widened(own["beta"], rivals), other)
    by_law = {} if other is None else {"the law itself": abs(other - own["beta"].value)}
    said = (*_by_loop(own["beta"], energy), *_caveats(own, rivals, richer), *pressed(found), *_bounded(own))
    return Identified(family, found, errors, own, known, shares(found, errors) | by_law, said)


def _estimate(family: Family, c: Coordinate, found: Fit, errors: Errors, i: int) -> ParameterEstimate:
    point, slope = float(found.point[i]), c.slope(float(found.point[i]))
    spread = math.sqrt(errors.combined[i, i])
    told = is_told(c, family.law.parameter(c.name), point, spread) and bool(found.jacobian[:, i].any())
    lower, upper = _limits(c, point, spread, told=told)
    return ParameterEstimate(c.value(point), slope * float(errors.statistical[i]), slope * spread, told, lower, upper)


def is_told(c: Coordinate, parameter: Parameter, point: float, spread: float) -> bool:
    """Whether tests tell a parameter: known better than before, off its upper bound, away from where it does nothing.

    ``point``, ``spread``: its coordinate and the error of that.
    """
    neutral, from_neutral = parameter.neutral, math.inf
    if neutral is not None and math.isfinite(neutral) and not c.is_log:
        from_neutral = abs(point - c.at(neutral)) / spread
    return spread**2 < TOLD and from_neutral > SURE and point < c.high - 1e-3


def _limits(c: Coordinate, point: float, spread: float, *, told: bool) -> tuple[float | None, float | None]:
    """95 % limits of a coordinate's value, its bound counted; a side that the test says nothing of has none."""
    mass = float(ndtr((point - c.low) / spread)) if c.low > -10.0 else 1.0  # posterior above the bound
    one = point + spread * float(ndtri(1.0 - (1.0 - LEVEL) * mass))
    two = [point + spread * float(ndtri(1.0 - q * mass)) for q in (0.5 + 0.5 * LEVEL, 0.5 - 0.5 * LEVEL)]
    if told or c.low <= -10.0:
        lower, upper = two
        if not told and c.is_log:  # toward where the term does nothing there is no limit
            return c.value(point - spread * float(ndtri(LEVEL))), None
        return c.value(max(lower, c.low)), c.value(upper)
    return None, c.value(one)


def _widened(estimate: ParameterEstimate, rivals: tuple[float, ...]) -> ParameterEstimate:
    """The friction ratio with an error that spans its rivals."""
    if not rivals or estimate.se is None or estimate.u is None:
        return estimate
    span = max(abs(rival - estimate.value) for rival in rivals)
    return ParameterEstimate(
        estimate.value,
        max(estimate.se, span),
        max(estimate.u, span),
        estimate.told,
        min(estimate.lower or estimate.value, *rivals),
        max(estimate.upper or estimate.value, *rivals),
    )


def _with_law(estimate: ParameterEstimate, richer: float | None) -> ParameterEstimate:
    """The friction ratio with an error that holds what a richer law would say, in quadrature."""
    if richer is None or estimate.se is None or estimate.u is None:
        return estimate
    gap, reach = abs(richer - estimate.value), float(ndtri(0.5 + 0.5 * LEVEL))
    u = math.hypot(estimate.u, gap)
    return replace(
        estimate,
        se=math.hypot(estimate.se, gap),
        u=u,
        lower=max(0.0, estimate.value - reach * u),
        upper=estimate.value + reach * u,
    )


def _by_loop(beta: ParameterEstimate, energy: float | None) -> tuple[str, ...]:
    """Say what the energy says where a law misses."""
    if energy is None or abs(energy / beta.value - 1.0) < 0.01:
        return ()
    said = f"{beta.value:.4g} under this law, {energy:.4g} by the energy of the loop over its path"
    return (f"friction_ratio: {said}; its error holds the difference",)


def _caveats(
    own: dict[str, ParameterEstimate], rivals: tuple[float, ...], richer: float | None = None
) -> tuple[str, ...]:
    beta, said = own["beta"], []
    if richer is not None:
        said.append(
            f"friction_ratio: {beta.value:.4g} under this law, {richer:.4g} if friction may vary with place and speed;"
            " its error holds the difference"
        )
    if rivals:
        told = " and ".join(f"{rival:.4g}" for rival in rivals)
        said.append(f"friction_ratio: not unique: {told} fits nearly as well as {beta.value:.4g}; its error spans them")
    if beta.u is not None and beta.u > VAGUE * beta.value:
        said.append(
            f"friction_ratio: known only to {100 * beta.u / beta.value:.2g} %: this test hardly tells it, or the law"
            " does not explain the test; see misfit and --budget"
        )
    return tuple(said)


def _bounded(own: dict[str, ParameterEstimate]) -> tuple[str, ...]:
    return tuple(
        f"{name}: this test does not tell it; {limits_in_words(e.lower, e.upper)} (95 %)"
        for name, e in own.items()
        if name != "beta" and e.se is not None and not e.told
    )


def limits_in_words(lower: float | None, upper: float | None) -> str:
    """Limits of a parameter as words; a side without one is not named.

    Examples
    --------
    >>> limits_in_words(None, 0.0312), limits_in_words(20.0, None), limits_in_words(-0.1, 0.1)
    ('at most 0.0312', 'at least 20', 'from -0.1 to 0.1')
    """
    if lower is None or upper is None:
        return "no limit" if lower is upper else f"at most {upper:.3g}" if lower is None else f"at least {lower:.3g}"
    return f"from {lower:.3g} to {upper:.3g}"
