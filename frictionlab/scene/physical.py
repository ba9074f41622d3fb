"""Between a scene and the simulator: parameters of laws in physical units, and the frame as a structure.

Everything there is dimensionless by the first storey: displacement over Y, force over k_1 Y, eq. (2.8).
"""

import math

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import ParameterError, SceneError
from frictionlab.scene.keys import Scene
from frictionlab.scene.rig import RigContact
from frictionlab.simulator.laws import Parameter, law_of
from frictionlab.simulator.problem import COSINE, Base
from frictionlab.simulator.structure import Contact, Structure

UNITS = {(1, 1): "m/s", (1, 0): "m", (-1, 0): "1/m"}  # by powers of Y and omega


def to_physical(
    parameter: Parameter, stiffness: float | None, frequency: float | None, *, amplitude: float, turn: float
) -> tuple[float | None, str]:
    """Return the factor from a dimensionless parameter to the physical one, and its unit.

    Of a frame of this stiffness [N/m] and natural frequency [Hz], at Y [m] and omega [rad/s]; None where one that it
    needs is not known.

    Examples
    --------
    >>> to_physical(law_of("coulomb+place").parameter("gradient"), None, None, amplitude=0.5, turn=1.0)
    (2.0, '1/m')
    """
    critical = None if stiffness is None or not frequency else stiffness / (math.pi * frequency)  # 2 sqrt(k m), N s/m
    forces = {
        "beta": (None if stiffness is None else stiffness * amplitude, "N"),
        "stiffness_ratio": (stiffness, "N/m"),
        "bristle_damping": (None if stiffness is None else stiffness / turn, "N s/m"),  # over k / omega
        "contact_damping_ratio": (critical, "N s/m"),
    }
    if parameter.name in forces:
        return forces[parameter.name]
    unit = UNITS.get((parameter.lengths, parameter.rates))
    return (1.0, "") if unit is None else (amplitude**parameter.lengths * turn**parameter.rates, unit)


def structure_of(
    scene: Scene,
    r: float,
    base_amplitude_m: float,
    *,
    beta: float | None = None,
    coefficient: float | None = None,
    normal_force_n: float | None = None,
    first: Contact | None = None,
    storeys: FloatArray | None = None,
    base: Base = COSINE,
) -> Structure:
    """Return the scene's frame at a frequency ratio, its base's amplitude Y in metres; friction over k_1 Y, eq. (2.8).

    Without ``[[rig.contacts]]`` mass 1 rubs as ``[model]`` says. In place of the scene's: ``beta``, ``coefficient`` or
    all of the ``first`` contact, ``storeys`` (3, n) as of `storeys_of`, and the ``normal_force_n`` of the contacts that
    do not say their own. SceneError: a contact whose friction is not known, or that cannot be simulated.
    """
    load = normal_force_n or scene.experiment.normal_force_n
    found = [] if first is None else [first]
    contacts = [*contacts_of(scene)]
    if beta is not None or coefficient is not None:
        said = {"beta": beta, "friction_n": None, "coefficient": coefficient}
        contacts[0] = contacts[0].model_copy(update=said)
    for number, contact in enumerate(contacts[len(found) :], len(found)):
        ratio = _friction_ratio(scene, contact, number, base_amplitude_m, load)
        try:
            law = law_of(contact.law)
            found.append(
                Contact(contact.mass, contact.against, law, law.complete({"beta": ratio, **contact.parameters}))
            )
        except ParameterError as error:
            raise SceneError(f"rig.contacts.{number}: {error}") from error
    mass, stiffness, damping = storeys_of(scene) if storeys is None else storeys
    return Structure.of_storeys(r, mass, stiffness, damping, found, base)


def contacts_of(scene: Scene) -> list[RigContact]:
    """Return the contacts of a scene: without ``[[rig.contacts]]`` mass 1 rubs as ``[model]`` says."""
    model = scene.model
    return scene.rig.contacts or [
        RigContact(
            against="base" if model.wall == "base" else "wall",
            law="coulomb" if model.law == "auto" else model.law,
            parameters={name: value for name, value in model.parameters.items() if name != "beta"},
        )
    ]


def storeys_of(scene: Scene) -> FloatArray:
    """Return masses, stiffnesses and damping ratios (3, n) of a scene's storeys, from the base up."""
    storeys = [(m.mass_kg, m.stiffness_n_per_m, m.damping_ratio or 0.0) for m in scene.rig.masses]
    return np.array(storeys or [(1.0, 1.0, scene.frame_damping_ratio)]).T


def _friction_ratio(scene: Scene, contact: RigContact, number: int, amplitude: float, load: float | None) -> float:
    """Friction of a contact over k_1 Y, from what is known of it."""
    if contact.beta is not None:
        return contact.beta
    force, load, stiffness = contact.friction_n, contact.normal_force_n or load, scene.rig.stiffness
    if contact.coefficient is not None and load is not None:
        force = contact.coefficient * load
    if force is None or stiffness is None or not 0.0 < stiffness * amplitude < math.inf:
        raise SceneError(
            f"rig.contacts.{number}: expected its friction: beta, or friction_n, or coefficient with normal_force_n (or"
            " --coefficient and --normal-force), the last two with a stiffness in [rig]; got neither"
        )
    return force / (stiffness * amplitude)
