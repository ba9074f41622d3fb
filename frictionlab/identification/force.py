"""From the friction ratio to newtons and to a coefficient, each with its errors and its budget."""

import math
from typing import Any

from frictionlab.estimate import Estimate
from frictionlab.identification.identify import Identified, ParameterEstimate
from frictionlab.scene import Scene
from frictionlab.uncertainty import Sources, unit_uncertainty


def friction_of(
    found: Identified, scene: Scene, sources: Sources, *, amplitude: Estimate, normal_force: float | None
) -> dict[str, Any]:
    """Return friction ratio, force (N) and coefficient as estimates, and what adds to their uncertainty.

    By the names of a comparison's fields: ``friction``, ``force``, ``coefficient``, ``budget``. ``amplitude``: Y [m],
    that the friction ratio is told over; ``normal_force``: N, if it is known.
    """
    beta = found.parameters["beta"]
    friction = Estimate(beta.value, beta.se, beta.u)
    force = friction_force(friction, scene, sources, amplitude)
    coefficient = coefficient_of(force, normal_force, sources.normal_force)
    shares = force_budget(force, coefficient, beta, sources, amplitude)
    return {
        "friction": friction,
        "force": force,
        "coefficient": coefficient,
        "budget": {"friction_ratio": found.shares, **shares},
    }


def friction_force(beta: Estimate, scene: Scene, sources: Sources, base: Estimate) -> Estimate:
    """Friction force beta k Y (N): friction ratio and base amplitude count in both errors, stiffness and gain in u."""
    force = beta.scaled(scene.rig.stiffness).scaled(base.value)
    if force.value is None or base.relative_se is None or beta.se is None or beta.u is None or not beta.value:
        return Estimate(force.value)
    relative_u = math.hypot(beta.u / beta.value, _of_the_unit(base, sources), sources.stiffness)
    relative_se = math.hypot(beta.se / beta.value, base.relative_se)
    return Estimate(force.value, force.value * relative_se, force.value * relative_u)


def _of_the_unit(base: Estimate, sources: Sources) -> float:
    """Relative uncertainty of Y (m): as it was measured, else its noise and the gain and linearity of its sensor."""
    if base.u is not None and base.value:
        return base.u / base.value
    return math.hypot(base.relative_se or 0.0, unit_uncertainty(sources))


def force_budget(
    force: Estimate, coefficient: Estimate, beta: ParameterEstimate, sources: Sources, base: Estimate
) -> dict[str, dict[str, float]]:
    """What adds to the uncertainty of force and coefficient."""
    budget = {}
    for name, estimate, normal in (
        ("friction_force_n", force, 0.0),
        ("friction_coefficient", coefficient, sources.normal_force),
    ):
        if estimate.value is None or beta.u is None or not beta.value:
            continue
        relative = {
            "friction ratio": beta.u / beta.value,
            "stiffness": sources.stiffness,
            "base amplitude": _of_the_unit(base, sources),
            "normal force": normal,
        }
        budget[name] = {cause: estimate.value * share for cause, share in relative.items() if share}
    return budget


def coefficient_of(force: Estimate, normal: float | None, relative: float) -> Estimate:
    """Friction coefficient: force over a normal force that is known to a relative uncertainty."""
    plain = force.over(normal)
    if plain.u is None or plain.value is None:
        return plain
    return plain.with_u(math.hypot(plain.u, relative * plain.value))
