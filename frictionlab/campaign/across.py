"""What the errors of two materials have in common: by the covariance of the fit to all tests, not by bookkeeping.

A number whose error is a vector over common sources has the covariance with another that their dot product is. So the
error of a difference is the length of the difference of two vectors, and what a rig does to both falls out.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from frictionlab.campaign.joining import Material
from frictionlab.identification.fit import Fit
from frictionlab.identification.forward import BENDS

FloatArray = NDArray[np.float64]
SENSORS = ("gain", "lag", *BENDS.values(), "base_in_mass", "mass_in_base")  # what makes a measured energy wrong


def of_frictions(materials: Mapping[str, Material]) -> dict[tuple[str, float], FloatArray]:
    """Relative errors of the friction ratios of all groups, as vectors."""
    sizes = [len(m.joined.apart) for m in materials.values()]
    first = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    covariance = np.zeros((first[-1], first[-1]))
    for i, (one, a) in enumerate(materials.items()):
        for j, (two, b) in enumerate(materials.items()):
            block = a.joined.covariance if i == j else _between(a, b, one, two)
            covariance[first[i] : first[i + 1], first[j] : first[j + 1]] = block
    root, found = _root(covariance), {}
    for i, material in enumerate(materials.values()):
        shared = material.joined.best.shared
        for k, group in enumerate(shared.groups):
            found[group] = shared.coordinates[k].width * root[first[i] + k]
    return found


def _between(a: Material, b: Material, one: str, two: str) -> FloatArray:
    """What two materials' unknowns have in common (P, Q): the rig."""
    rig = a.joined.rig
    if rig is None:
        return np.zeros((len(a.joined.apart), len(b.joined.apart)))
    at, there = (rig.columns[n][m.joined.moved.shared.is_law] for n, m in ((one, a), (two, b)))
    return np.asarray(rig.spread.total[np.ix_(at, there)] + np.outer(a.joined.apart, b.joined.apart))


def of_energies(materials: Mapping[str, Material]) -> dict[str, FloatArray]:
    """Errors that the sensors make in the measured energy of each test, k Y^2, as vectors, by source.

    The sensors are as far off as the fit to all tests has found them, and as that leaves them unknown.
    """
    joints = [material.joined.moved for material in materials.values()]
    names = tuple(name for name in SENSORS if any(name in joint.shared.names for joint in joints))
    moment = np.zeros((len(names), len(names)))
    for joint in joints:
        own = [k for k, c in enumerate(joint.shared.coordinates) if c.name in names]
        at = [names.index(joint.shared.coordinates[k].name) for k in own]
        point = joint.solution.point[own]
        moment[np.ix_(at, at)] = joint.spread.total[np.ix_(own, own)] + np.outer(point, point)
    root = _root(moment)
    return {
        cycle.source: _energy_slopes(found, names) @ root
        for joint in joints
        for cycle, found in zip(joint.cycles, joint.fits, strict=True)
    }


def _energy_slopes(found: Fit, names: tuple[str, ...]) -> FloatArray:
    """Change of a measured energy (n,) by the sensors' unknowns: pi times that of the response's first sine part."""
    slopes = np.zeros(len(names))
    own = [(i, names.index(c.name)) for i, c in enumerate(found.coordinates) if c.name in names]
    if own:
        moved = found.forward.jacobian(found.point, found.observed.cosine_sine, [i for i, _ in own])
        slopes[[k for _, k in own]] = math.pi * moved[found.observed.harmonics]
    return slopes


def _root(covariance: FloatArray) -> FloatArray:
    """Matrix (n, n) whose rows have this covariance as their dot products."""
    value, vector = np.linalg.eigh(covariance)
    return np.asarray(vector * np.sqrt(np.maximum(value, 0.0)))
