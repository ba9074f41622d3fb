"""The tests that a laboratory could run: frequency ratio x normal force x base amplitude, inside its bounds."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

from frictionlab.errors import SceneError
from frictionlab.identification.family import Family, law_and_held
from frictionlab.scene import Scene
from frictionlab.simulator.laws import Law
from frictionlab.uncertainty import Sources, sources_of

ASSUMED_COEFFICIENT = (0.4, 0.2)  # dry contacts lie about here; said where it is assumed
FIRST_VALUES = {"contact_damping_ratio": 0.03, "gradient": 0.03, "static_ratio_up": 1.1, "static_ratio_down": 1.1}


@dataclass(frozen=True)
class Candidate:
    """One possible test.

    ``frequency_ratio``; ``normal_force_n`` N; ``base_amplitude_m`` m; ``duration_s`` s; ``family``: what it may be;
    ``values``: the law's parameters as they are expected (beta by the friction coefficient).
    """

    frequency_ratio: float
    normal_force_n: float
    base_amplitude_m: float
    duration_s: float
    family: Family
    values: Mapping[str, float]

    def turn(self, natural_frequency_hz: float) -> float:
        """Drive's angular frequency, rad/s."""
        return 2.0 * math.pi * self.frequency_ratio * natural_frequency_hz


@dataclass(frozen=True)
class Laboratory:
    """What all candidates share: the rig, the law, what is known before, and how well it is measured."""

    scene: Scene
    law: Law
    natural_frequency_hz: float
    stiffness_n_per_m: float
    coefficient: tuple[float, float]
    sources: Sources
    notes: tuple[str, ...]


def laboratory(scene: Scene, law: str | None = None) -> Laboratory:
    """Return what a scene says of its laboratory.

    Raises
    ------
    SceneError
        The rig's natural frequency or stiffness is not known.
    UsageError
        The law cannot be.
    """
    frequency, stiffness = scene.rig.natural_frequency, scene.rig.stiffness
    if frequency is None or stiffness is None:
        raise SceneError(
            "rig: a plan needs natural frequency and stiffness: give two of natural_frequency_hz, mass_kg and"
            " stiffness_n_per_m"
        )
    chosen, _ = law_and_held(scene, law)
    given = scene.plan.friction_coefficient
    coefficient = (given[0], given[1]) if given is not None else ASSUMED_COEFFICIENT
    value, error = coefficient
    notes = () if given is not None else (f"plan.friction_coefficient: not given: {value:g} +- {error:g} is assumed",)
    sources = sources_of(scene, scene.plan.sampling_rate_hz)
    return Laboratory(scene, chosen, frequency, stiffness, coefficient, sources, notes)


def candidates(lab: Laboratory) -> tuple[Candidate, ...]:
    """Return all tests of a plan's ranges that are outside the band to avoid.

    Raises
    ------
    SceneError
        A range is empty, or the band forbids all.
    """
    plan = lab.scene.plan
    forces = plan.normal_forces_n or ([f] if (f := lab.scene.experiment.normal_force_n) is not None else [])
    ranges = {
        "frequency_ratios": plan.frequency_ratios,
        "normal_forces_n": forces,
        "base_amplitudes_m": plan.base_amplitudes_m,
    }
    for name, values in ranges.items():
        if not values:
            raise SceneError(f"plan.{name}: expected at least one value; got none: list what the rig can set")
    low, high = plan.avoid_frequency_ratios or (math.inf, -math.inf)
    ratios = [r for r in plan.frequency_ratios if not low <= r <= high]
    if not ratios:
        raise SceneError(
            f"plan.avoid_frequency_ratios: {low:g} to {high:g} forbids all of frequency_ratios; give others or a"
            " narrower band"
        )
    return tuple(_candidate(lab, *point) for point in product(ratios, forces, plan.base_amplitudes_m))


def _candidate(lab: Laboratory, r: float, force: float, amplitude: float) -> Candidate:
    beta = lab.coefficient[0] * force / (lab.stiffness_n_per_m * amplitude)
    held = {"frame_damping_ratio": lab.scene.frame_damping_ratio} if lab.scene.frame_damping_ratio else {}
    family = Family(r, lab.law, held, lab.scene.model.wall)
    return Candidate(r, force, amplitude, lab.scene.plan.duration_s, family, {**_expected(lab), "beta": beta})


def _expected(lab: Laboratory) -> dict[str, float]:
    """The law's parameters other than beta as they are expected: the scene's, else a first value of each."""
    said = lab.scene.model.parameters
    expected = {}
    for p in lab.law.own:
        if p.name == "beta":
            continue
        low, high = p.usual
        middle = math.sqrt(low * high) if p.scale == "log" else 0.5 * (low + high)
        usual = FIRST_VALUES.get(p.name, middle) if p.default is None else p.default
        expected[p.name] = said.get(p.name, usual)
    return expected
