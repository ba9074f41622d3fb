"""One rig under all materials: its gain, lag, natural frequency and damping are the same in the tests of all of them.

What a material's tests say of the rig is a quadratic form, with the material's own unknowns integrated out (Schur's
complement). Each material is fitted on with what the others say of the rig, until all stand at the same one: block
elimination of one fit to all tests. How sure the unknowns are, and what those of two materials have in common, is told
by the whole precision at the end.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.campaign.joint import MANY, Joint, fit_again
from frictionlab.campaign.mixed import Mixed, Others, Piece, Solution
from frictionlab.campaign.spread import Spread, spread_of
from frictionlab.identification.causes import CAUSES
from frictionlab.identification.coordinates import PRESSED, Coordinate, doubts, strains

FloatArray = NDArray[np.float64]
FOUND = "Sensors and rig as the tests find them, beside what is known of them: {}."
SWEEPS = 8
SAME = 0.03  # errors of the rig's unknowns within which two materials stand at the same rig
BOUND = 1e-9


@dataclass(frozen=True)
class Rig:
    """The rig that all materials share.

    ``gained``: by how much the cost of all tests falls when it is moved from where it is known to be; ``unknowns``: how
    many it has; ``columns``: where each material's shared unknowns stand among all, by its name; ``spread``: how sure
    all of them are.
    """

    gained: float
    unknowns: int
    columns: Mapping[str, NDArray[np.intp]]
    spread: Spread

    def of(self, name: str) -> Spread:
        """How sure one material's unknowns are."""
        return self.spread.part(self.columns[name])


def on_one_rig(held: Mapping[str, Joint], moved: Mapping[str, Joint]) -> tuple[dict[str, Joint], Rig | None]:
    """Let materials share their rig.

    Parameters
    ----------
    held, moved : mapping of str to Joint
        Each material fitted for itself, with sensors and rig as they are known, and beside them.

    Returns
    -------
    The fits that move the rig, all to the same place; and that rig, None where there is nothing to share.
    """
    found = dict(moved)
    names = tuple(dict.fromkeys(c.name for joint in moved.values() for c in joint.shared.coordinates if not c.law))
    if len(found) < 2 or not names:
        return found, None
    told = {name: _told(joint, names) for name, joint in found.items()}
    for _ in range(SWEEPS):
        for name, joint in found.items():
            others = [form for other, form in told.items() if other != name]
            found[name] = fit_again(joint, _said(others, joint, names))
            told[name] = _told(found[name], names)
        if _agree(list(found.values()), names):
            break
    rig = _rig(held, found, names)
    return {name: replace(joint, on_one_rig=rig.of(name)) for name, joint in found.items()}, rig


def _columns(joint: Joint, names: Sequence[str]) -> NDArray[np.intp]:
    """Where the nuisances of a fit stand among all of the rig's, in the fit's order."""
    return np.array([names.index(c.name) for c in joint.shared.coordinates if not c.law], dtype=np.intp)


def _told(joint: Joint, names: Sequence[str]) -> Others:
    """What the tests of a material say of the rig (N,), whatever its own unknowns are."""
    law, solution = joint.shared.is_law, joint.solution
    told = Mixed(joint.pieces, np.array([c.low for c in joint.shared.coordinates])).told(solution.scatter)
    precision, score = told.precision + np.diag(np.where(law, solution.hold, 0.0)), told.score
    low = np.array([c.low for c in joint.shared.coordinates])
    free = law & (solution.point > low + BOUND)  # what stands at its bound stays there
    score = score - precision[:, law & ~free] @ solution.point[law & ~free]
    taken = np.linalg.solve(precision[np.ix_(free, free)], precision[np.ix_(free, ~law)])
    at = _columns(joint, names)
    whole, summed = np.zeros((len(names), len(names))), np.zeros(len(names))
    whole[np.ix_(at, at)] = precision[np.ix_(~law, ~law)] - precision[np.ix_(~law, free)] @ taken
    summed[at] = score[~law] - taken.T @ score[free]
    return Others(whole, summed)


def _said(forms: Sequence[Others], joint: Joint, names: Sequence[str]) -> Others:
    """What other materials say of the shared unknowns of a fit."""
    at, mine = _columns(joint, names), np.flatnonzero(~joint.shared.is_law)
    size = len(joint.shared.coordinates)
    precision, score = np.zeros((size, size)), np.zeros(size)
    precision[np.ix_(mine, mine)] = np.sum([form.precision for form in forms], axis=0)[np.ix_(at, at)]
    score[mine] = np.sum([form.score for form in forms], axis=0)[at]
    return Others(precision, score)


def _agree(joints: Sequence[Joint], names: Sequence[str]) -> bool:
    """Whether all materials stand at the same rig."""
    low, high, error = np.full(len(names), np.inf), np.full(len(names), -np.inf), np.full(len(names), np.inf)
    for joint in joints:
        at, rig = _columns(joint, names), ~joint.shared.is_law
        low[at] = np.minimum(low[at], joint.solution.point[rig])
        high[at] = np.maximum(high[at], joint.solution.point[rig])
        error[at] = np.minimum(error[at], np.sqrt(np.diag(np.linalg.inv(joint.solution.precision)))[rig])
    return bool((high - low < SAME * error).all())


def _rig(held: Mapping[str, Joint], moved: Mapping[str, Joint], names: Sequence[str]) -> Rig:
    """All materials together at the end."""
    own = [int(joint.shared.is_law.sum()) for joint in moved.values()]
    first = np.concatenate([[0], np.cumsum(own)])
    columns: dict[str, NDArray[np.intp]] = {}
    point, (hold, doubt) = np.zeros(first[-1] + len(names)), np.ones((2, first[-1] + len(names)))
    precision, strain, doubled = np.zeros((len(point), len(point))), np.zeros(len(names)), 0.0
    for k, (name, joint) in enumerate(moved.items()):
        law, at = joint.shared.is_law, np.zeros(len(joint.shared.coordinates), dtype=np.intp)
        at[law], at[~law] = np.arange(first[k], first[k + 1]), first[-1] + _columns(joint, names)
        columns[name] = at
        point[at], hold[at] = joint.solution.point, joint.solution.hold
        doubt[at] = doubts(joint.shared.coordinates, joint.solution.point)
        precision[np.ix_(at, at)] += Mixed(joint.pieces, point[at]).told(joint.solution.scatter).precision
        strain[at[~law] - first[-1]] = strains(joint.shared.coordinates, joint.solution.point)[~law] ** 2
        doubled += float((strains(joint.shared.coordinates, joint.solution.point)[~law] ** 2).sum())
    gained = sum(held[name].cost(joint) - joint.cost(joint) for name, joint in moved.items())
    gained += doubled - float(strain.sum())
    solution = Solution(point, precision + np.diag(hold), 0.0, (), np.zeros(0), 0.0, 0.0, hold)
    return Rig(gained, len(names), columns, _spread(moved, columns, solution, doubt))


def _spread(
    moved: Mapping[str, Joint], columns: Mapping[str, NDArray[np.intp]], solution: Solution, doubt: FloatArray
) -> Spread:
    """How sure all unknowns are, by the tests of all materials."""
    pieces: list[Piece] = []
    for name, joint in moved.items():
        for piece in joint.pieces:
            scale = np.zeros((len(piece.score), len(solution.point)))
            scale[:, columns[name]] = piece.place.scale
            pieces.append(replace(piece, place=replace(piece.place, scale=scale)))
    return spread_of(
        solution,
        pieces,
        [noise for joint in moved.values() for noise in joint.meat],
        doubt,
        robust=any(joint.freedom >= MANY for joint in moved.values()),
        scatters=[joint.solution.scatter for joint in moved.values() for _ in joint.fits],
    )


def found_of(joint: Joint) -> tuple[str, ...]:
    """Say where the tests find sensors and rig, and which of them are far from what is known."""
    parts, far = [], []
    for k, c in enumerate(joint.shared.coordinates):
        if c.law or c.name not in CAUSES:
            continue
        off, error = float(joint.solution.point[k]), float(np.sqrt(joint.spread.total[k, k]))
        before = f"{'known to' if math.isinf(c.tail) else 'assumed within'} {_size(c, c.assumed)}"
        parts.append(f"{CAUSES[c.name]} {_size(c, off, sign='+')} ± {_size(c, error)}, {before}")
        if abs(off) > PRESSED * c.assumed:
            against = (
                "its standard uncertainty: check it" if math.isinf(c.tail) else "what is assumed: measure, declare it"
            )
            far.append(f"{CAUSES[c.name]} is off by {abs(off) / c.assumed:.2g} times {against}.")
    return (FOUND.format("; ".join(parts)), *far) if parts else ()


def _size(c: Coordinate, deviations: float, *, sign: str = "") -> str:
    """So many deviations of what is known in units that people read."""
    count, unit = c.unit
    factor, name = (count, unit) if unit else (100.0, " %")
    return f"{factor * c.width * deviations + 0.0:{sign}.2g}{name}"  # no -0
