"""Units as logs and scenes write them: one table of quantities, one spelling of each unit, the one conversion to SI.

A value is divided by how many of its units make one SI unit, which is exact for that number: ``float(text) / 1000`` is
the double nearest to the quotient, where a multiplication by 0.001 would be off by one unit in the last place.
"""

import math
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LENGTH = {"m": 1.0, "mm": 1e3, "um": 1e6, "nm": 1e9, "cm": 1e2, "in": 1 / 0.0254, "mil": 1 / 2.54e-5}
"""How many make a metre."""
TIME = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9, "min": 1 / 60.0, "h": 1 / 3600.0}
"""How many make a second."""
ACCELERATION = {"m/s^2": 1.0, "mm/s^2": 1e3, "cm/s^2": 1e2, "gal": 1e2, "g": 1 / 9.80665, "mg": 1e3 / 9.80665}
"""How many make a metre per second squared."""
VOLTS = {"V": 1.0, "mV": 1e3, "uV": 1e6}
"""How many make a volt."""
_LBF, _KGF = 1 / 4.4482216152605, 1 / 9.80665

QUANTITIES: dict[str, dict[str, float]] = {
    "displacement": LENGTH,
    "time": TIME,
    "acceleration": ACCELERATION,
    "velocity": {"m/s": 1.0, "mm/s": 1e3, "um/s": 1e6, "cm/s": 1e2, "in/s": 1 / 0.0254},
    "force": {"N": 1.0, "mN": 1e3, "uN": 1e6, "nN": 1e9, "cN": 1e2, "daN": 0.1, "kN": 1e-3, "MN": 1e-6}
    | {"lbf": _LBF, "kip": 1e-3 * _LBF, "kgf": _KGF, "gf": 1e3 * _KGF},
    "torque": {"Nm": 1.0, "mNm": 1e3, "Nmm": 1e3, "Ncm": 1e2, "kNm": 1e-3, "lbf ft": 1 / 1.3558179483314004},
    "angle": {"rad": 1.0, "mrad": 1e3, "deg": 180.0 / math.pi, "rev": 0.5 / math.pi},
    "angular velocity": {"rad/s": 1.0, "deg/s": 180.0 / math.pi, "rpm": 30.0 / math.pi},
    "temperature": {"degC": 1.0},
    "voltage": VOLTS,
}
"""Quantity -> unit -> how many of it make the quantity's first unit, which recordings use."""
UNIT = {quantity: next(iter(units)) for quantity, units in QUANTITIES.items()}
"""Quantity -> the unit of recordings."""
NORMAL_FORCE = re.compile(r"fn|fz|n|.*(normal|load|clamp|preload|anpress).*", re.IGNORECASE)
"""Names of a normal force, as a log's column or a sheet's heading, whose unit is that of a force."""
_QUANTITY = {unit: quantity for quantity, units in QUANTITIES.items() for unit in units}

_SPELLINGS = {
    "m/s²": "m/s^2", "m/s2": "m/s^2", "m/s**2": "m/s^2", "ms^-2": "m/s^2", "m/s/s": "m/s^2", "mm/s²": "mm/s^2",
    "mm/s2": "mm/s^2", "cm/s²": "cm/s^2", "cm/s2": "cm/s^2", "g_n": "g", "gn": "g",
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "sek": "s", "msec": "ms", "millisecond": "ms",
    "milliseconds": "ms", "usec": "us", "microseconds": "us", "nsec": "ns", "hour": "h", "hours": "h",
    "minutes": "min", "micron": "um", "microns": "um", "micrometer": "um", "micrometers": "um", "meter": "m",
    "meters": "m", "metre": "m", "metres": "m", "millimeter": "mm", "millimeters": "mm", "millimetre": "mm",
    "millimetres": "mm", "inch": "in", "inches": "in", "mils": "mil", "thou": "mil",
    "newton": "N", "newtons": "N", "lb": "lbf", "lbs": "lbf", "kips": "kip", "kp": "kgf", "volt": "V", "volts": "V",
    "n.m": "Nm", "n·m": "Nm", "n*m": "Nm", "n-m": "Nm", "n m": "Nm", "n.mm": "Nmm", "ft lbf": "lbf ft",
    "lbf.ft": "lbf ft", "ft-lb": "lbf ft", "°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad",
    "grad": "deg", "radians": "rad", "°/s": "deg/s", "1/min": "rpm", "u/min": "rpm",
    "min^-1": "rpm", "°c": "degC", "degc": "degC", "c": "degC",
}  # fmt: skip
_OTHER = {
    "a", "ma", "hz", "khz", "kg", "k", "%", "pa", "kpa", "mpa", "bar", "w", "kw", "-", "db", "1", "j", "ω", "ohm",
    "um/m", "v/v", "mv/v",
}  # fmt: skip
_LOWER = {
    **{unit.lower(): unit for unit in reversed(_QUANTITY) if unit != "MN"},
    **{unit.lower(): spelled for unit, spelled in _SPELLINGS.items()},
}
_EITHER = "NM"  # in capitals: nanometres or newton metres, of no quantity until a column's name says it
_ACCELERATION = re.compile(r"acc", re.IGNORECASE)
_TORQUE = re.compile(r"torque|moment", re.IGNORECASE)
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\]]*)\]|\((?P<b>[^)]*)\)|\{(?P<c>[^}]*)\}|<(?P<d>[^>]*)>)\s*$")
_TAIL = re.compile(r"^(?P<name>.*?[^\s/_])\s*(?P<mark>\s/\s|/|_| |,\s*)(?P<unit>[^\s/_]+(?:/s(?:\^?2|²)?)?)$")


def known_unit(text: str) -> str:
    """Give the one spelling of a unit, or "" if it is not one.

    Examples
    --------
    >>> [known_unit(text) for text in ("mm", "(µm)", "[s]", " MSEC ", "volts", "steel", "kips", "µN", "M/S2", "mm/sec")]
    ['mm', 'um', 's', 'ms', 'V', '', 'kip', 'uN', 'm/s^2', 'mm/s']
    """
    plain = text.strip().strip("[](){}<>").strip().replace("\u03bc", "\u00b5").replace("\u00b5", "u")
    plain = re.sub(r"/sec(?=$|\W)", "/s", plain, flags=re.IGNORECASE)
    if plain in _QUANTITY or plain == _EITHER:
        return plain
    found = _SPELLINGS.get(plain) or _LOWER.get(plain.lower(), "")
    return found or (plain.lower() if plain.lower() in _OTHER else "")


def quantity_of(unit: str) -> str:
    """What a unit, as `known_unit` spells it, is one of; "" if it is none of this table.

    Examples
    --------
    >>> [quantity_of(unit) for unit in ("mm", "kip", "rpm", "bar", "")]
    ['displacement', 'force', 'angular velocity', '', '']
    """
    return _QUANTITY.get(unit, "")


def split_unit(text: str) -> tuple[str, str]:
    """Split a column's title into name and unit ("" if it has none).

    Examples
    --------
    >>> [split_unit(t) for t in ("time [s]", "Distance1 (mm)", "x_mm", "Weg / µm", "mass", "laser 2", "t,s")]
    [('time', 's'), ('Distance1', 'mm'), ('x', 'mm'), ('Weg', 'um'), ('mass', ''), ('laser 2', ''), ('t', 's')]
    >>> [split_unit(text) for text in ("TORQUE [NM]", "friction force / kN", "normal_N", "channel N")]
    [('TORQUE', 'Nm'), ('friction force', 'kN'), ('normal', 'N'), ('channel N', '')]
    >>> [split_unit(text)[1] for text in ("acc_m/s2", "v_mm/s", "angle_deg", "acc_g", "mass_g", "frequency_Hz")]
    ['m/s^2', 'mm/s', 'deg', 'g', '', 'hz']
    """
    title = text.strip()
    if match := _BRACKETS.match(title):
        name, unit = match["name"].strip(), known_unit(match["a"] or match["b"] or match["c"] or match["d"] or "")
        return name, "Nm" if unit in ("nm", _EITHER) and _TORQUE.search(name) else unit
    if match := _TAIL.match(title):
        unit, mark = known_unit(match["unit"]), match["mark"].strip()
        # a word of one letter behind a space may be a number's name, and "mass_g" is no acceleration
        is_mass = unit in ("g", "mg") and not _ACCELERATION.search(match["name"])
        marked = unit in _QUANTITY or unit in ("hz", "khz")
        marked = marked and (mark in ("/", ",") or (bool(mark) and quantity_of(unit) != "voltage" and not is_mass))
        if unit in {*LENGTH, *TIME} or marked:
            return match["name"].strip(), unit
    return title, ""


def to_si(values: "NDArray[np.float64]", unit: str) -> "NDArray[np.float64]":
    """Convert to the unit of recordings, in place; the only conversion of units in the package.

    Examples
    --------
    >>> import numpy as np
    >>> to_si(np.array([1500.0]), "mm").tolist(), to_si(np.array([180.0]), "deg").tolist() == [math.pi]
    ([1.5], True)
    """
    per_si = QUANTITIES[_QUANTITY[unit]][unit]
    if per_si == 1.0:
        return values
    exact = {"in": 0.0254, "mil": 2.54e-5, "min": 60.0, "h": 3600.0, "g": 9.80665}
    exact |= {"kip": 4448.2216152605, "kN": 1e3, "daN": 10.0}
    if unit in exact:
        values *= exact[unit]
    else:
        values /= per_si
    return values
