"""The force of a contact whose motion is given, as on a tribometer: no oscillator, only the law.

A contact without a state follows place and speed. One that yields goes from turn to turn (each slider holds until it
slips, and slips until the next turn); one with a state of its own is carried round the cycle until it repeats.
"""

from itertools import pairwise
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray, shifted
from frictionlab.errors import SimulationError
from frictionlab.simulator.laws import TERMS, formula_of
from frictionlab.simulator.problem import Problem

ROUNDS = 3  # of a cycle, after which sliders repeat


def force_under(problem: Problem, place: FloatArray, pressed: FloatArray | None = None) -> FloatArray:
    """Return the force of the contact on the mass over one cycle of a given motion, against it, over k Y (p,).

    ``place`` (p,): displacement relative to the wall over Y, on equally spaced phases of the drive; ``pressed`` (p,):
    normal force there over its mean, that friction is in proportion to; None: constant.

    Raises
    ------
    SimulationError
        Friction turns negative within the motion, or the contact's state cannot be carried on.

    Examples
    --------
    >>> force = force_under(Problem(0.5, 0.3), np.cos(np.arange(8) * np.pi / 4.0))
    >>> force[1:4].tolist(), force[5:].tolist()
    ([-0.3, -0.3, -0.3], [0.3, 0.3, 0.3])
    """
    friction = problem.beta * (1.0 + problem.parameter("gradient") * place)
    if float(friction.min()) < 0.0:
        raise SimulationError("friction turns negative within the motion; expected at least 0; do: a smaller gradient")
    speed, pressed = shifted(place, order=1), np.ones_like(place) if pressed is None else pressed
    dashpot = 2.0 * problem.zeta * problem.r * speed
    if problem.law.kind == "elastic" and problem.beta > 0.0:
        return np.asarray(dashpot + _of_sliders(problem, place, pressed))
    if problem.law.kind == "inner" and problem.beta > 0.0:
        from frictionlab.simulator.numeric.along import force_along  # noqa: PLC0415 - compiled, for such laws alone

        return np.asarray(dashpot + pressed * force_along(problem, place))
    term = formula_of(problem) or TERMS["coulomb"]
    contact: Any = term.contact
    own = tuple(problem.parameters[parameter.name] for parameter in term.parameters)
    side = np.where(speed < 0.0, -1.0, 1.0)
    if term is TERMS["coulomb"]:  # its formula has no branches
        return np.asarray(dashpot + pressed * contact(own, side, friction, place, speed, 0.0, 0.0)[0])
    each = zip(side.tolist(), friction.tolist(), place.tolist(), speed.tolist(), strict=True)
    return np.asarray(dashpot + pressed * np.array([contact(own, *at, 0.0, 0.0)[0] for at in each]))


def _of_sliders(problem: Problem, place: FloatArray, pressed: FloatArray) -> FloatArray:
    """Force (p,) of elastic sliders side by side, from the largest displacement round and round."""
    from frictionlab.simulator.exact.solve import sliders_of  # noqa: PLC0415 - compiled, for such laws alone

    springs, strengths = (np.array(column)[:, None] for column in sliders_of(problem.parameters))
    first, q = int(np.argmax(place)), problem.parameter("gradient")
    z = np.concatenate([place[first:], place[: first + 1]])
    least = np.concatenate([pressed[first:], pressed[: first + 1]]) * (1.0 + q * z)
    ends = [0, *(np.flatnonzero(np.diff(np.sign(np.diff(z)))) + 1).tolist(), len(z) - 1]
    held, force = np.zeros_like(springs), np.zeros((len(springs), len(z)))
    for _ in range(ROUNDS):
        for begin, end in pairwise(ends):
            way = z[begin : end + 1]
            side = 1.0 if way[-1] >= way[0] else -1.0
            yields = side * (held + springs * (way - way[0]))
            force[:, begin : end + 1] = side * np.minimum(yields, strengths * least[begin : end + 1])
            held = force[:, end : end + 1]
    return np.asarray(np.roll(force.sum(axis=0)[:-1], first))
