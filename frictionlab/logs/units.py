"""The one conversion to SI; how units are spelled stands in `frictionlab.units`.

A value is divided by how many of its units make one SI unit, which is exact for that number: ``float(text) / 1000`` is
the double nearest to the quotient, where a multiplication by 0.001 would be off by one unit in the last place.
"""

import numpy as np
from numpy.typing import NDArray

from frictionlab.units import ACCELERATION, LENGTH, TIME, VOLTS, known_unit, split_unit

__all__ = ["ACCELERATION", "LENGTH", "TIME", "VOLTS", "known_unit", "split_unit", "to_si"]


def to_si(values: NDArray[np.float64], unit: str) -> NDArray[np.float64]:
    """Convert to metres, seconds or m/s^2, in place where numpy can; the only unit conversion of the package."""
    per_si = LENGTH.get(unit) or TIME.get(unit) or ACCELERATION[unit]
    if per_si >= 1.0:
        return np.divide(values, per_si, out=values) if per_si != 1.0 else values
    return np.multiply(values, {"in": 0.0254, "min": 60.0, "h": 3600.0, "g": 9.80665}[unit], out=values)
