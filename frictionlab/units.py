"""Units as logs and scenes write them, and the house's one spelling of each; `frictionlab.logs.units` converts."""

import re

LENGTH = {"m": 1.0, "mm": 1e3, "um": 1e6, "nm": 1e9, "cm": 1e2, "in": 1 / 0.0254}
"""How many make a metre."""
TIME = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9, "min": 1 / 60.0, "h": 1 / 3600.0}
"""How many make a second."""

ACCELERATION = {"m/s^2": 1.0, "mm/s^2": 1e3, "cm/s^2": 1e2, "gal": 1e2, "g": 1 / 9.80665, "mg": 1e3 / 9.80665}
"""How many make a metre per second squared."""

_SPELLINGS = {
    "m/s²": "m/s^2", "m/s2": "m/s^2", "m/s**2": "m/s^2", "ms^-2": "m/s^2", "mm/s²": "mm/s^2", "mm/s2": "mm/s^2",
    "cm/s²": "cm/s^2", "cm/s2": "cm/s^2", "g_n": "g", "gn": "g",
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "sek": "s", "msec": "ms", "millisecond": "ms",
    "milliseconds": "ms", "µs": "us", "usec": "us", "µsec": "us", "microseconds": "us", "nsec": "ns", "hour": "h",
    "hours": "h", "minutes": "min", "µm": "um", "micron": "um", "microns": "um", "micrometer": "um",
    "micrometers": "um", "meter": "m", "meters": "m", "metre": "m", "metres": "m", "millimeter": "mm",
    "millimeters": "mm", "millimetre": "mm", "millimetres": "mm", "inch": "in", "inches": "in",
}  # fmt: skip
VOLTS = {"v": 1.0, "volt": 1.0, "volts": 1.0, "mv": 1e-3, "uv": 1e-6, "µv": 1e-6}
"""What each is in volts."""

_OTHER = {
    "v", "mv", "volt", "volts", "a", "ma", "n", "kn", "mn", "rpm", "hz", "khz", "kg", "m/s",
    "mm/s", "°c", "degc", "c", "k", "%", "deg", "°", "rad", "pa", "kpa", "mpa", "bar", "w", "kw", "-", "db", "1", "n.m",
    "n·m", "j", "ω", "ohm", "µv", "uv", "µm/m", "um/m", "v/v", "mv/v",
}  # fmt: skip
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\]]*)\]|\((?P<b>[^)]*)\)|\{(?P<c>[^}]*)\}|<(?P<d>[^>]*)>)\s*$")
_TAIL = re.compile(r"^(?P<name>.*?[^\s/_])\s*(?:\s/\s|/|_| |,\s*)(?P<unit>[^\s/_]+)$")


def known_unit(text: str) -> str:
    """Give the house's spelling of a unit, or "" if it is not one.

    Examples
    --------
    >>> [known_unit(text) for text in ("mm", "(µm)", "[s]", " MSEC ", "volts", "steel")]
    ['mm', 'um', 's', 'ms', 'volts', '']
    """
    plain = text.strip().strip("[](){}<>").strip().replace("\u03bc", "\u00b5")
    for spelling in (plain, plain.lower()):
        found = _SPELLINGS.get(spelling, spelling)
        if found in LENGTH or found in TIME or found in ACCELERATION:
            return found
    return plain.lower() if plain.lower() in _OTHER else ""


def split_unit(text: str) -> tuple[str, str]:
    """Split a column's title into name and unit ("" if it has none).

    Examples
    --------
    >>> [split_unit(t) for t in ("time [s]", "Distance1 (mm)", "x_mm", "Weg / µm", "mass", "laser 2", "t,s")]
    [('time', 's'), ('Distance1', 'mm'), ('x', 'mm'), ('Weg', 'um'), ('mass', ''), ('laser 2', ''), ('t', 's')]
    """
    title = text.strip()
    if match := _BRACKETS.match(title):
        inside = match["a"] or match["b"] or match["c"] or match["d"] or ""
        return match["name"].strip(), known_unit(inside)
    if (match := _TAIL.match(title)) and (unit := known_unit(match["unit"])) in {*LENGTH, *TIME}:
        return match["name"].strip(), unit
    return title, ""
