"""What the tests of each material say of its law's parameters, in newtons, metres and seconds too."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from frictionlab.campaign.cycles import LENGTHS
from frictionlab.campaign.joined import Told
from frictionlab.campaign.joining import Material
from frictionlab.estimate import Estimate, Flat
from frictionlab.scene import Scene

STIFF = ("stiffness_ratio",)  # told over the frame's stiffness
DAMPED = ("contact_damping_ratio",)  # told over twice the root of stiffness and mass


@dataclass(frozen=True)
class LawParameter:
    """One parameter of one material's law, by all its tests.

    ``value``: dimensionless, of a test at the mean Y and omega; ``physical``: in ``unit``, None where the scene does
    not say what it takes; ``is_told``: whether the tests tell it at all.
    """

    material: str
    law: str
    parameter: str
    number: Estimate
    physical: Estimate
    unit: str
    is_told: bool

    value = Flat("number")
    value_se = Flat("number", "se")
    value_u = Flat("number", "u")
    physical_value = Flat("physical")
    physical_value_se = Flat("physical", "se")
    physical_value_u = Flat("physical", "u")


def parameters_of(joined: Mapping[str, Material], scene: Scene) -> tuple[LawParameter, ...]:
    """Return the parameters of each material's law but its friction ratios, which are in ``friction.csv``."""
    return tuple(
        LawParameter(name, material.law.name, told.name, told.value, *_physical(told, material, scene), told.told)
        for name, material in sorted(joined.items())
        for told in material.joined.parameters()
    )


def _physical(told: Told, material: Material, scene: Scene) -> tuple[Estimate, str]:
    """The parameter in newtons, metres and seconds, with its unit."""
    shared, rig = material.joined.best.shared, scene.rig
    parameter = shared.law.parameter(told.name)
    if told.name in STIFF:
        return told.value.scaled(rig.stiffness), "N/m"
    if told.name in DAMPED:
        return told.value.scaled(_critical(scene)), "N s/m"
    if told.name in LENGTHS:
        power = LENGTHS[told.name]
        return told.value.scaled(shared.amplitude**power), "m" if power == 1 else "1/m"
    if parameter.speeds == 1:
        return told.value.scaled(shared.amplitude * shared.turn), "m/s"
    return told.value, ""


def _critical(scene: Scene) -> float | None:
    """Twice the root of stiffness and mass, by stiffness and natural frequency, N s/m."""
    stiffness, frequency = scene.rig.stiffness, scene.rig.natural_frequency
    return None if stiffness is None or not frequency else 2.0 * stiffness / (2.0 * math.pi * frequency)
