"""Types of arrays that all of the package names, the runs of a mask, and a cycle moved along its phase."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.intp]


def runs(mask: NDArray[np.bool_]) -> tuple[IntArray, IntArray]:
    """First and one-past-last index of each run of True."""
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


def shifted(cycle: FloatArray, phase: float = 0.0, order: int = 0, times: int = 1) -> FloatArray:
    """Return a cycle (p,), or its derivative by the phase of an order, so much later in it (rad), at times p points.

    By its harmonics: phases are equally spaced.

    Examples
    --------
    >>> round(float(shifted(np.cos(np.arange(8) * np.pi / 4.0), order=1)[2]), 6)
    -1.0
    """
    lines = np.fft.rfft(cycle)
    turns = 1j * np.arange(len(lines))
    return np.asarray(times * np.fft.irfft(lines * turns**order * np.exp(turns * phase), times * len(cycle)))
