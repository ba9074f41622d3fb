"""What a user may say about a log; each item overrides what would otherwise be found in the log itself.

The one home of these options: the scene's ``[log]`` table, the options of ``frictionlab ingest`` and the keywords of
`frictionlab.ingest` all follow from the fields of `LogOptions`. A new option is one field with its words and its check,
and its use in the reader.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from frictionlab.errors import UsageError
from frictionlab.units import ACCELERATION, LENGTH, TIME, known_unit, quantity_of

SEPARATORS = {
    ",": ",", "comma": ",", ";": ";", "semicolon": ";", "\t": "\t", "tab": "\t", "\\t": "\t", "|": "|", "pipe": "|",
    " ": " ", "space": " ", "whitespace": " ",
}  # fmt: skip
LASERS = ("mass", "base", "relative")
"""Options that name the column of a displacement."""
FURTHER = (
    *("contact_force", "normal_force", "torque", "angle", "mass_velocity", "base_velocity"),
    *("mass_acceleration", "base_acceleration"),
)
"""Options that name the column of a further channel: each is called as the channel is in a recording."""
_CALIBRATION = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.+?)\s*/\s*(m?V)\s*")

Check = Callable[[Any], bool]


def _option(words: str, metavar: str, check: Check, expected: str, default: Any = None) -> Any:
    return field(default=default, metadata={"words": words, "metavar": metavar, "check": check, "expected": expected})


def _is_codec(said: Any) -> bool:
    try:
        "".encode(str(said))
    except (LookupError, ValueError):
        return False
    return True


def _column(words: str) -> Any:
    def check(said: Any) -> bool:
        return bool(said) and (isinstance(said, str) or said >= 1)

    return _option(words, "COLUMN", check, "a column by its name or by its number from 1")


def _unit(words: str, quantity: str, *tables: Mapping[str, float]) -> Any:
    known = [unit for units in tables for unit in units]
    expected = f"a unit of {quantity}, one of {', '.join(known)}"
    return _option(words, "UNIT", lambda said: known_unit(said) in known, expected)


def _number(words: str, metavar: str, check: Check, expected: str, default: Any = None) -> Any:
    return _option(words, metavar, lambda said: math.isfinite(said) and check(said), expected, default)


@dataclass(frozen=True)
class LogOptions:
    """Overrides; ``None`` means: find it in the log. What each is stands in its words, as ``--help`` shows them.

    Spellings become the one known: ``µm`` is ``um``, ``pipe`` is ``|``. `faults_of` gives what is impossible.

    Raises
    ------
    UsageError
        If options have impossible values: all of them are named, one a line.

    Examples
    --------
    >>> LogOptions(unit="µm", separator="pipe", mass="Laser 2", units="force=kN, torque=0.5 Nm/V").given()
    {'separator': '|', 'mass': 'Laser 2', 'unit': 'um', 'units': 'force=kN, torque=0.5 Nm/V'}
    """

    separator: str | None = _option(
        *("What parts the columns: comma, semicolon, tab, pipe, space, or the sign.", "NAME"),
        *(SEPARATORS.__contains__, "one of comma, semicolon, tab, pipe, space, or the sign itself"),
    )
    decimal: str | None = _option("Decimal mark: . or ,", "MARK", {".", ","}.__contains__, "a decimal mark, '.' or ','")
    encoding: str | None = _option(
        "Encoding of the text, such as utf-8, cp1252, utf-16.", "NAME", _is_codec, "a codec such as utf-8, cp1252"
    )
    time: str | int | None = _column("Column of the time, by name or by number from 1.")
    mass: str | int | None = _column("Column of the mass, by name or by number from 1.")
    base: str | int | None = _column("Column of the base, by name or by number from 1.")
    relative: str | int | None = _column("Column of mass minus base, in place of the mass's.")
    contact_force: str | int | None = _column("Column of the contact's friction force.")
    normal_force: str | int | None = _column("Column of the force that presses the contact together.")
    mass_velocity: str | int | None = _column("Column of the mass's velocity.")
    base_velocity: str | int | None = _column("Column of the base's velocity.")
    mass_acceleration: str | int | None = _column("Column of the mass's acceleration.")
    base_acceleration: str | int | None = _column("Column of the base's acceleration.")
    torque: str | int | None = _column("Column of the friction torque.")
    angle: str | int | None = _column("Column of the angle.")
    unit: str | None = _unit("Unit of the displacements: m mm um nm cm in.", "displacement", LENGTH, ACCELERATION)
    units: Mapping[str, str] | str | None = _option(
        *("Units of columns, also of a volt: contact_force=kN,torque=0.5 Nm/V,mass=5 mm/V.", "NAME=UNIT,..."),
        *(lambda said: not _wrong_units(said), "the options that name columns, each with its unit, such as force=kN"),
    )
    time_unit: str | None = _unit("Unit of the time column: s ms us ns min h.", "time", TIME)
    variable: str | None = _option(
        "MATLAB, JSON, NumPy: the variable that holds the log.", "NAME", bool, "the name of a variable"
    )
    test: str | int | None = _option(
        *("A file of several tests: which one, by its number from 1.", "N"),
        *(lambda said: str(said).isascii() and str(said).isdecimal() and int(said) > 0, "a number from 1"),
    )
    sampling_rate_hz: float | None = _number(
        "Samples per second: the time is counted instead of read.", "HZ", lambda said: said > 0.0, "a positive number"
    )
    measuring_range_m: float | None = _number(
        *("Measuring range of the laser, where its step in the data does not show it.", "M"),
        *(lambda said: said > 0.0, "a positive number"),
    )
    lag_s: float | None = _number("Two logs: the base's clock minus the mass's.", "S", math.isfinite, "a finite number")
    lag_s_u: float | None = _number(
        *("Two logs: standard uncertainty of that lag.", "S"),
        *(lambda said: said >= 0.0, "a number of seconds of at least 0"),
    )
    clock_drift: float | None = _number(
        *("Two logs: by how much the base's clock gains; 0 leaves its stamps.", "SHARE"),
        *(lambda said: abs(said) < 0.5, "a share such as 5e-05"),
    )
    bridge_s: float = _number(
        *("Holes up to this long are bridged, longer ones cut the recording.", "S"),
        *(lambda said: said >= 0.0, "a number of seconds of at least 0"),
        default=0.02,
    )
    most_damage: float = _number(
        *("Share of unreadable lines up to which a log is accepted.", "SHARE"),
        *(lambda said: 0.0 <= said <= 1.0, "a share from 0 to 1"),
        default=0.1,
    )

    def __post_init__(self) -> None:
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        faults = [f"{name}: {text}" for name, text in faults_of(values)]
        if faults:
            raise UsageError("\n".join(faults))
        spelled: dict[str, Callable[[Any], Any]] = {
            "separator": SEPARATORS.__getitem__,
            "unit": known_unit,
            "time_unit": known_unit,
            "test": int,
            "units": lambda said: ", ".join(f"{name}={unit}" for name, unit in _pairs(said)),
        }
        for name, one_spelling in spelled.items():
            if values[name] is not None:
                object.__setattr__(self, name, one_spelling(values[name]))

    def given(self) -> dict[str, str | float]:
        """Return the options that were said, for the recording's provenance."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {f.name: values[f.name] for f in fields(self) if values[f.name] != f.default}

    def unit_of(self, role: str) -> tuple[str, float | None]:
        """The unit said of a channel; where it stands for a volt, also how many of it a volt is."""
        general = {"contact_force": dict(_pairs(self.units or "")).get("force")} | dict.fromkeys(LASERS, self.unit)
        said = dict(_pairs(self.units or "")).get(role) or general.get(role) or ""
        match = _CALIBRATION.fullmatch(said)
        if match is None:
            return known_unit(said), None
        return known_unit(match[2]), float(match[1]) * (1e3 if match[3] == "mV" else 1.0)


def _pairs(said: Mapping[str, str] | str) -> list[tuple[str, str]]:
    if isinstance(said, Mapping):
        return [(name, str(unit).strip()) for name, unit in said.items()]
    parts = [part.partition("=") for part in said.split(",") if part.strip()]
    return [(name.strip(), unit.strip()) for name, _, unit in parts]


def _wrong_units(said: Mapping[str, str] | str) -> list[str]:
    """Names that are no options of columns, or whose unit is none."""
    wrong = []
    for name, text in _pairs(said):
        match = _CALIBRATION.fullmatch(text)
        unit, per_volt = (match[2], match[1].strip("+-.0")) if match else (text, "1")
        if name not in (*LASERS, *FURTHER, "force") or not quantity_of(known_unit(unit)) or not per_volt:
            wrong.append(name)
    return wrong


def faults_of(values: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What is impossible among these values of options: name and sentence of each fault."""
    for f in fields(LogOptions):
        value = values.get(f.name)
        if value is not None and not f.metadata["check"](value):
            yield f.name, f"expected {f.metadata['expected']}; got {value!r}"
    if values.get("decimal") == "," and SEPARATORS.get(values.get("separator") or "") == ",":
        yield "decimal", "expected another mark than the separator; got a comma for both"
