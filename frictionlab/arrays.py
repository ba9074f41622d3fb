"""Types of arrays that all of the package names, and the runs of a mask."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.intp]


def runs(mask: NDArray[np.bool_]) -> tuple[IntArray, IntArray]:
    """First and one-past-last index of each run of True."""
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
