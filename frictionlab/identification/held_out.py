"""How well a fit predicts cycles that it has not seen: each part of them by the fit to the others."""

import math

import numpy as np
from numpy.typing import NDArray

from frictionlab.identification.coordinates import strains
from frictionlab.identification.fit import Fit

FloatArray = NDArray[np.float64]
FEW_CYCLES = 15  # below so many they are left out in two halves, else in five parts


def held_out(found: Fit) -> FloatArray:
    """Misfit (2, parts) of parts of the cycles, each predicted by the fit to the others; nan where there are too few.

    The first row is the nrmse; the second weighs each harmonic by its noise, as the fit does: what all cycles of a part
    have in common by chance, a friction a little higher than in the rest, would else hide what the law explains.
    Every second (or fifth) cycle is a part, so that a drift is in all of them. The fit to the others is one
    Gauss-Newton step from the fit to all: they differ by little.
    """
    observed = found.observed
    n = len(observed.each)
    count = 2 if n < FEW_CYCLES else 5
    if n < count:
        return np.full((2, count), math.nan)
    blocks = [np.arange(first, n, count) for first in range(count)]
    gain = np.linalg.solve(found.precision, found.jacobian.T / found.excess) @ observed.whitener
    slopes = np.linalg.solve(observed.whitener, found.jacobian)
    predicted = observed.cosine_sine - np.linalg.solve(observed.whitener, found.residual)
    known = np.array([not c.law for c in found.coordinates])
    strain = float((strains(found.coordinates, found.point)[known] ** 2).sum())  # a rig unlike itself is no prediction
    left = []
    for block in blocks:
        others = np.delete(observed.each, block, axis=0).mean(axis=0)
        there = predicted + slopes @ (gain @ (others - observed.cosine_sine))
        gap = observed.each[block].mean(axis=0) - there
        white = observed.whitener @ gap
        left.append((math.sqrt(0.5 * float(gap @ gap) / observed.power), float(white @ white) + strain))
    return np.array(left).T
