"""What the tests of each material say of its law's parameters, in newtons, metres and seconds too."""

from collections.abc import Mapping
from dataclasses import dataclass

from frictionlab.campaign.joined import Told
from frictionlab.campaign.joining import Material
from frictionlab.estimate import Estimate, Flat
from frictionlab.scene import Scene
from frictionlab.scene.physical import to_physical


@dataclass(frozen=True)
class LawParameter:
    """One parameter of one material's law, by all its tests.

    ``value``: dimensionless, of a test at the mean Y and omega; ``physical``: in ``unit``, None where the scene does
    not say what it takes; ``is_told``: whether the tests tell it at all; ``scatter``: of the value from test to test
    beyond each test's own error, ``tests_p``: how often one value in all tests would look at least this uneven (None:
    too few tests tell).
    """

    material: str
    law: str
    parameter: str
    number: Estimate
    physical: Estimate
    unit: str
    is_told: bool
    scatter: float | None = None
    tests_p: float | None = None

    value = Flat("number")
    value_se = Flat("number", "se")
    value_u = Flat("number", "u")
    physical_value = Flat("physical")
    physical_value_se = Flat("physical", "se")
    physical_value_u = Flat("physical", "u")


def parameters_of(joined: Mapping[str, Material], scene: Scene) -> tuple[LawParameter, ...]:
    """Return the parameters of each material's law but its friction ratios, which are in ``friction.csv``."""
    return tuple(
        LawParameter(
            name,
            material.law.name,
            told.name,
            told.value,
            *_physical(told, material, scene),
            told.told,
            told.scatter,
            told.p,
        )
        for name, material in sorted(joined.items())
        for told in material.joined.parameters()
    )


def _physical(told: Told, material: Material, scene: Scene) -> tuple[Estimate, str]:
    """The parameter in newtons, metres and seconds, with its unit."""
    shared = material.joined.best.shared
    parameter = shared.law.parameter(told.name)
    factor, unit = to_physical(parameter, scene, amplitude=shared.amplitude, turn=shared.turn)
    return told.value.scaled(factor), unit
