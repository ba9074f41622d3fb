"""Slow, obvious versions of the kernels, written from the equations."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def irregularity_index(rows: FloatArray) -> float:
    """Eq. (4.1), sum by sum."""
    cycles, points = rows.shape
    total = 0.0
    for j in range(cycles - 1):
        change = sum(abs(rows[j + 1, i] - rows[j, i]) for i in range(points))
        total += change / sum(abs(rows[j, i]) for i in range(points))
    return float(total / (cycles - 1))


def shoelace(mass: FloatArray, base: FloatArray) -> float:
    """Area of the polygon through the points, positive when base leads mass."""
    area = 0.0
    for i in range(len(mass)):
        j = (i + 1) % len(mass)
        area += 0.5 * (base[i] + base[j]) * (mass[j] - mass[i])
    return area


def dft_amplitude(signal: FloatArray, step: float, frequency: float) -> float:
    """Amplitude of one line of a Hann-windowed signal, by the sum itself."""
    n = len(signal)
    window = np.array([0.5 - 0.5 * np.cos(2 * np.pi * (i + 0.5) / n) for i in range(n)])
    about = signal - signal.mean()
    line = sum(
        w * x * np.exp(-2j * np.pi * frequency * step * i) for i, (w, x) in enumerate(zip(window, about, strict=True))
    )
    return float(2 * abs(line) / window.sum())


def half_range(x: FloatArray) -> float:
    return float((x.max() - x.min()) / 2)
