"""How much one cycle differs from the next: the irregularity index of eq. (4.1), and what noise alone would give."""

import math

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.cycles import chunks

FloatArray = NDArray[np.float64]


def irregularity_index(rows: FloatArray, blocks: tuple[slice, ...] = ()) -> float | None:
    """Irregularity index, eq. (4.1): mean over cycles of sum |x_{j+1,i} - x_{j,i}| / sum |x_{j,i}|.

    Parameters
    ----------
    rows : (N_cyc, N_p) array
        One cycle a row. The sensor's zero is arbitrary: give displacements about the mean of the whole signal.
    blocks : tuple of slices
        Rows that follow each other without a gap; by default all do.

    Returns
    -------
    float or None
        None for fewer than two cycles, or a signal that does not move.

    Examples
    --------
    >>> x = np.sin(2 * np.pi * np.arange(100) / 100)
    >>> round(irregularity_index(np.array([1.0 * x, 1.1 * x, 1.0 * x])), 6)  # (0.1 / 1 + 0.1 / 1.1) / 2
    0.095455
    """
    ratios = [_changes(rows[block]) for block in blocks or (slice(None),)]
    every = np.concatenate(ratios)
    return float(every.mean()) if len(every) and np.isfinite(every).all() else None


def _changes(rows: FloatArray) -> FloatArray:
    """Change from each cycle to the next over its size (N_cyc - 1,); infinite where a cycle stands still."""
    before, after = rows[:-1], rows[1:]
    size = _row_sums(before)
    change = np.concatenate([np.abs(after[some] - before[some]).sum(axis=1) for some in chunks(after)])
    return np.where(size > 0.0, change / np.where(size > 0.0, size, 1.0), np.inf)


def _row_sums(rows: FloatArray) -> FloatArray:
    return np.concatenate([np.abs(rows[some]).sum(axis=1) for some in chunks(rows)])


def irregularity_floor(rows: FloatArray, noise: float) -> float | None:
    """Index that white noise of this rms at each point would give a motion that repeats exactly.

    The difference of two noisy points is Gaussian with sqrt(2) the rms; its mean modulus is 2 noise / sqrt(pi).

    Parameters
    ----------
    rows : (N_cyc, N_p) array
        One cycle a row, about the mean of the whole signal.
    noise : float
        Rms of the noise at one point of a row (interpolation included).
    """
    size = float(np.mean(_row_sums(rows))) / rows.shape[1]
    return 2.0 * noise / math.sqrt(math.pi) / size if size > 0.0 else None
