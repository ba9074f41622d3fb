"""The tests that a laboratory could run: frequency ratio x normal force x amplitude x length, inside its bounds."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from frictionlab.errors import ParameterError, SceneError, UsageError
from frictionlab.inference.observations import law_and_held
from frictionlab.scene import Scene
from frictionlab.simulator.laws import Law, Parameter, law_of
from frictionlab.uncertainty import Sources, sources_of

ASSUMED_COEFFICIENT = (0.4, 0.2)  # dry contacts lie about here; said where it is assumed
FRICTION = ("beta", "friction_coefficient")
FIRST_VALUES = {"contact_damping_ratio": 0.03, "gradient": 0.03, "static_ratio_up": 1.1, "static_ratio_down": 1.1}


@dataclass(frozen=True)
class Candidate:
    """One possible test: ``normal_force_n`` N; ``base_amplitude_m`` m; ``duration_s`` s, its transient included."""

    frequency_ratio: float
    normal_force_n: float
    base_amplitude_m: float
    duration_s: float


@dataclass(frozen=True)
class Laboratory:
    """What all candidates share: the rig, the law, what is known before, and how well it is measured.

    ``expected``: the law's parameters other than beta, dimensionless at the middle of the candidates' amplitudes and
    frequency ratios; ``coefficient``: the friction coefficient and its standard error.
    """

    scene: Scene
    law: Law
    held: Mapping[str, float]
    natural_frequency_hz: float
    stiffness_n_per_m: float
    coefficient: tuple[float, float]
    expected: Mapping[str, float]
    sources: Sources
    notes: tuple[str, ...]

    @property
    def free(self) -> tuple[str, ...]:
        """The law's parameters that are to be found, beta first."""
        return tuple(p.name for p in self.law.own if p.name not in self.held and not p.whole)

    def under(self, law: str) -> "Laboratory":
        """The same laboratory with another law in mind; nothing of it is held but the frame's damping.

        Raises
        ------
        UsageError
            The law cannot be.
        """
        other = law_of(law)
        held = {name: value for name, value in self.held.items() if name == "frame_damping_ratio"}
        return replace(self, law=other, held=held, expected=_expected(self.scene, other, held))


def laboratory(scene: Scene, law: str | None = None, measured: Sequence[Mapping[str, object]] = ()) -> Laboratory:
    """Return what a scene says of its laboratory, and what comparisons at hand say of the contact.

    Raises
    ------
    SceneError
        The rig's natural frequency or stiffness is not known, or ``[plan.expected]`` names what the law lacks.
    UsageError
        The law cannot be.
    """
    frequency, stiffness = scene.rig.natural_frequency, scene.rig.stiffness
    if frequency is None or stiffness is None:
        raise SceneError(
            "rig: a plan needs natural frequency and stiffness: give two of natural_frequency_hz, mass_kg and"
            " stiffness_n_per_m"
        )
    chosen, held = law_and_held(scene, law)
    given = scene.plan.friction_coefficient
    value, error = (given[0], given[1]) if given is not None else ASSUMED_COEFFICIENT
    notes = () if given is not None else (f"plan.friction_coefficient: not given: {value:g} +- {error:g} is assumed",)
    sources = sources_of(scene, scene.plan.sampling_rate_hz)
    told, expected = _means(measured), _expected(scene, chosen, held)
    if "friction_coefficient" in told:
        value, notes = told["friction_coefficient"], ()
    expected |= {name: told[name] for name in expected if name in told and name not in held}
    lab = Laboratory(scene, chosen, held, frequency, stiffness, (value, error), expected, sources, notes)
    _check_expected(lab)
    return lab


def _check_expected(lab: Laboratory) -> None:
    """Refuse expected values that the law lacks, or that lie outside their domain."""
    names = [p.name for p in lab.law.own if p.name != "beta"]
    for name, value in lab.scene.plan.expected.items():
        if name == "beta":
            raise SceneError("plan.expected.beta: it follows from friction_coefficient and each test's normal force")
        if name in names:
            try:
                lab.law.parameter(name).checked(value)
            except ParameterError as error:
                raise SceneError(f"plan.expected.{name}: {error}") from error


def _expected(scene: Scene, law: Law, held: Mapping[str, float]) -> dict[str, float]:
    """The law's parameters other than beta as they are expected: held ones, the scene's, else a first value of each."""
    said = {**scene.model.parameters, **scene.plan.expected, **held}
    return {p.name: said.get(p.name, _first_value(p)) for p in law.own if p.name != "beta"}


def _first_value(p: Parameter) -> float:
    if p.default is not None:
        return p.default
    low, high = p.usual
    middle = math.sqrt(low * high) if p.scale == "log" else 0.5 * (low + high)
    return FIRST_VALUES.get(p.name, middle)


@dataclass(frozen=True)
class Measured:
    """What comparisons tell of a number: ``u``: combined standard uncertainty; ``se``: its statistical part."""

    value: float
    u: float
    se: float


def _means(measured: Sequence[Mapping[str, object]]) -> dict[str, float]:
    """What comparisons at hand say of the contact: means weighed by their uncertainties."""
    return {name: known.value for name, known in told_together(measured).items()}


def told_together(measured: Sequence[Mapping[str, object]], repeatability: float = 0.0) -> dict[str, Measured]:
    """What several comparisons tell together: means weighed by their uncertainties.

    Statistical errors are each test's own, and so is friction that differs from test to test by `repeatability`. What
    is not known of sensors and rig is the same in all tests: more of them do not average it out.

    Examples
    --------
    >>> rows = [{"parameters": {"gradient": {"value": 0.02, "u": 0.005, "se": 0.003, "told": True}}}] * 4
    >>> known = told_together(rows)["gradient"]
    >>> round(known.value, 4), round(known.se, 4), round(known.u, 4)
    (0.02, 0.0015, 0.0043)
    """
    every: dict[str, list[Measured]] = {}
    for row in measured:
        for name, known in told_values(row).items():
            every.setdefault(name, []).append(known)
    return {name: _weighed(known, repeatability if name in FRICTION else 0.0) for name, known in every.items()}


def _weighed(known: Sequence[Measured], repeatability: float) -> Measured:
    values, u, se = np.array([(k.value, k.u, k.se) for k in known]).T
    own = np.hypot(se, repeatability * values)
    shared = np.sqrt(np.maximum(u**2 - se**2, 0.0))
    weights = (own**2 + shared**2) ** -1.0
    weights = weights / weights.sum()
    statistical = float(np.sqrt((weights**2 * own**2).sum()))
    return Measured(float(weights @ values), math.hypot(statistical, float(weights @ shared)), statistical)


def told_values(row: Mapping[str, object]) -> dict[str, Measured]:
    """What a row of `compare-numeric` tells: name -> number; the friction coefficient under its name."""
    parameters, found = row.get("parameters"), {}
    for name, told in (parameters if isinstance(parameters, Mapping) else {}).items():
        if isinstance(told, Mapping) and told.get("told"):
            value, error = told.get("value"), told.get("u") or told.get("se")
            own = told.get("se") or error
            if isinstance(value, int | float) and isinstance(error, int | float) and isinstance(own, int | float):
                found[str(name)] = Measured(float(value), float(error), min(float(own), float(error)))
    coefficient, beta = row.get("friction_coefficient"), found.get("beta")
    if isinstance(coefficient, int | float) and beta is not None and beta.value > 0.0:
        share = float(coefficient) / beta.value
        found["friction_coefficient"] = Measured(float(coefficient), share * beta.u, share * beta.se)
    return {name: known for name, known in found.items() if known.u > 0.0}


def candidates(lab: Laboratory) -> tuple[Candidate, ...]:
    """Return all tests of a plan's ranges that are outside the band to avoid.

    Raises
    ------
    SceneError
        A range is empty, the band forbids all, or no test outlasts its transient.
    """
    plan, transient = lab.scene.plan, lab.scene.analysis.planned_transient_s
    forces = plan.normal_forces_n or ([f] if (f := lab.scene.experiment.normal_force_n) is not None else [])
    ranges = {
        "frequency_ratios": plan.frequency_ratios,
        "normal_forces_n": forces,
        "base_amplitudes_m": plan.base_amplitudes_m,
    }
    for name, values in ranges.items():
        if not values:
            raise SceneError(f"plan.{name}: expected at least one value; got none: list what the rig can set")
    durations = plan.durations_s or [plan.duration_s]
    if max(durations) <= transient:
        key = "durations_s" if plan.durations_s else "duration_s"
        raise SceneError(
            f"plan.{key}: {max(durations):g} s are over before the transient (analysis.transient_s ="
            f" {transient:g} s): lengthen the test, or shorten the transient"
        )
    points = product(_outside(lab), forces, plan.base_amplitudes_m, [t for t in durations if t > transient])
    return tuple(Candidate(*point) for point in points)


def _outside(lab: Laboratory) -> list[float]:
    """Frequency ratios outside the band to avoid."""
    plan = lab.scene.plan
    low, high = plan.avoid_frequency_ratios or (math.inf, -math.inf)
    ratios = [r for r in plan.frequency_ratios if not low <= r <= high]
    if not ratios:
        raise SceneError(
            f"plan.avoid_frequency_ratios: {low:g} to {high:g} forbids all of frequency_ratios; give others or a"
            " narrower band"
        )
    return ratios


def check_free(lab: Laboratory, aim: Sequence[str]) -> None:
    """Refuse a law of which nothing is to be found, and an aim that is not among its unknowns."""
    if not lab.free:
        raise UsageError(f"law {lab.law.name}: the scene holds all of its parameters: there is nothing to find out")
    for name in aim:
        if name not in lab.free:
            raise UsageError(f"law {lab.law.name} has no parameter {name!r} to find: expected {', '.join(lab.free)}")
