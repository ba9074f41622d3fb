"""What a user may say about a log; each item overrides what would otherwise be found in the log itself.

The one home of these options: the scene's ``[log]`` table, the options of ``frictionlab ingest`` and the keywords of
`frictionlab.ingest` all follow from the fields of `LogOptions`. A new option is one field with its words, and its use
in the reader.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from frictionlab.errors import UsageError
from frictionlab.units import ACCELERATION, LENGTH, TIME, known_unit

SEPARATORS = {
    ",": ",", "comma": ",", ";": ";", "semicolon": ";", "\t": "\t", "tab": "\t", "\\t": "\t", "|": "|", "pipe": "|",
    " ": " ", "space": " ", "whitespace": " ",
}  # fmt: skip


def _option(words: str, metavar: str, default: Any = None) -> Any:
    return field(default=default, metadata={"words": words, "metavar": metavar})


@dataclass(frozen=True)
class LogOptions:
    """Overrides; ``None`` means: find it in the log. Spellings become the house's: ``µm`` is ``um``, ``pipe`` is ``|``.

    Parameters
    ----------
    separator
        ``,`` ``;`` ``|`` TAB or blanks, or their names ``comma semicolon pipe tab space``.
    decimal
        The decimal mark, ``.`` or ``,``.
    encoding
        A Python codec name.
    time, mass, base
        A column by its name (with or without its unit) or its number from 1.
    relative
        A column that holds mass minus base, in place of the mass's own.
    unit, time_unit
        Of the displacements (``m mm um nm cm in``) and of the time column (``s ms us ns min h``).
    sampling_rate_hz
        Samples per second; time is then counted instead of read.
    measuring_range_m
        The laser's measuring range [m], where it is not to be found from the step in the data.
    mass_metres_per_volt, base_metres_per_volt, mass_offset_m, base_offset_m
        What a volt of each sensor means [m/V], negative where it falls as the displacement grows, and where 0 V is [m].
    lag_s
        Two logs: the base's clock minus the mass's clock at one moment [s], added to the base's stamps with a minus.
    lag_s_u
        Two logs: the standard uncertainty of that lag [s].
    clock_drift
        Two logs: by how much the base's clock gains on the mass's (share), where it is known; 0 leaves its stamps.
    bridge_s
        Holes up to this long [s] are bridged by a straight line; longer ones cut the recording in stretches.
    most_damage
        The share of lines that cannot be read beyond which a log is refused. (Samples without a value are flagged, not
        refused, unless most of them are.)

    Raises
    ------
    UsageError
        If options have impossible values: all of them are named, one a line.

    Examples
    --------
    >>> LogOptions(unit="µm", separator="pipe", mass="Laser 2").given()
    {'separator': '|', 'mass': 'Laser 2', 'unit': 'um'}
    """

    separator: str | None = _option("What parts the columns: comma, semicolon, tab, pipe, space, or the sign.", "NAME")
    decimal: str | None = _option("Decimal mark: . or ,", "MARK")
    encoding: str | None = _option("Encoding of the text, such as utf-8, cp1252, utf-16.", "NAME")
    time: str | int | None = _option("Column of the time, by name or by number from 1.", "COLUMN")
    mass: str | int | None = _option("Column of the mass, by name or by number from 1.", "COLUMN")
    base: str | int | None = _option("Column of the base, by name or by number from 1.", "COLUMN")
    relative: str | int | None = _option("Column of mass minus base, in place of the mass's.", "COLUMN")
    unit: str | None = _option("Unit of the displacements: m mm um nm cm in.", "UNIT")
    time_unit: str | None = _option("Unit of the time column: s ms us ns min h.", "UNIT")
    sampling_rate_hz: float | None = _option("Samples per second: the time is counted instead of read.", "HZ")
    measuring_range_m: float | None = _option(
        "Measuring range of the laser, where its step in the data does not tell it.", "M"
    )
    mass_metres_per_volt: float | None = _option("Calibration of the mass's sensor, for a log in volts.", "M/V")
    base_metres_per_volt: float | None = _option("Calibration of the base's sensor, for a log in volts.", "M/V")
    mass_offset_m: float = _option("Displacement of the mass at 0 V.", "M", 0.0)
    base_offset_m: float = _option("Displacement of the base at 0 V.", "M", 0.0)
    lag_s: float | None = _option("Two logs: the base's clock minus the mass's.", "S")
    lag_s_u: float | None = _option("Two logs: standard uncertainty of that lag.", "S")
    clock_drift: float | None = _option("Two logs: by how much the base's clock gains; 0 leaves its stamps.", "SHARE")
    bridge_s: float = _option("Holes up to this long are bridged, longer ones cut the recording.", "S", 0.02)
    most_damage: float = _option("Share of unreadable lines up to which a log is accepted.", "SHARE", 0.1)

    def __post_init__(self) -> None:
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        faults = [f"{name}: {text}" for name, text in faults_of(values)]
        if faults:
            raise UsageError("\n".join(faults))
        for name, spelled in _SPELLED.items():
            if values[name] is not None:
                object.__setattr__(self, name, spelled(values[name]))

    def given(self) -> dict[str, str | float]:
        """Return the options that were said, for the recording's provenance."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {f.name: values[f.name] for f in fields(self) if values[f.name] != f.default}


_SPELLED: Mapping[str, Callable[[Any], Any]] = {
    "separator": SEPARATORS.__getitem__,
    "unit": known_unit,
    "time_unit": known_unit,
}


def faults_of(values: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What is impossible among these values of options: name and sentence of each fault."""
    for name, value in values.items():
        text = None if value is None or name not in _CHECKS else _CHECKS[name](value)
        if text is not None:
            yield name, f"expected {text}; got {value!r}"
    if values.get("decimal") == "," and SEPARATORS.get(values.get("separator") or "") == ",":
        yield "decimal", "expected another mark than the separator; got a comma for both"


def _separator(said: Any) -> str | None:
    return None if said in SEPARATORS else "one of comma, semicolon, tab, pipe, space, or the sign itself"


def _decimal(said: Any) -> str | None:
    return None if said in {".", ","} else "a decimal mark, '.' or ','"


def _encoding(said: Any) -> str | None:
    try:
        "".encode(str(said))
    except (LookupError, ValueError):
        return "a codec such as utf-8, cp1252, utf-16"
    return None


def _column(said: Any) -> str | None:
    return None if said and (isinstance(said, str) or said >= 1) else "a column by its name or by its number from 1"


def _unit(of: Mapping[str, float], quantity: str) -> Callable[[Any], str | None]:
    return lambda said: None if known_unit(said) in of else f"a unit of {quantity}, one of {', '.join(of)}"


def _positive(said: Any) -> str | None:
    return None if 0.0 < said < math.inf else "a positive number"


def _calibration(said: Any) -> str | None:
    return None if math.isfinite(said) and said else "metres per volt, not 0"


def _finite(said: Any) -> str | None:
    return None if math.isfinite(said) else "a finite number"


def _not_negative(said: Any) -> str | None:
    return None if 0.0 <= said < math.inf else "a number of seconds of at least 0"


def _share_of_a_clock(said: Any) -> str | None:
    return None if abs(said) < 0.5 else "a share such as 5e-05"


def _share(said: Any) -> str | None:
    return None if 0.0 <= said <= 1.0 else "a share from 0 to 1"


_CHECKS: Mapping[str, Callable[[Any], str | None]] = {
    "separator": _separator,
    "decimal": _decimal,
    "encoding": _encoding,
    "time": _column,
    "mass": _column,
    "base": _column,
    "unit": _unit({**LENGTH, **ACCELERATION}, "displacement"),
    "time_unit": _unit(TIME, "time"),
    "sampling_rate_hz": _positive,
    "measuring_range_m": _positive,
    "relative": _column,
    "mass_metres_per_volt": _calibration,
    "base_metres_per_volt": _calibration,
    "mass_offset_m": _finite,
    "base_offset_m": _finite,
    "lag_s": _finite,
    "lag_s_u": _not_negative,
    "clock_drift": _share_of_a_clock,
    "bridge_s": _not_negative,
    "most_damage": _share,
}
