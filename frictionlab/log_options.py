"""What a user may say about a log; each item overrides what would otherwise be found in the log itself.

The one home of these options: the scene's ``[log]`` table, the options of ``frictionlab ingest`` and the keywords of
`frictionlab.ingest` all follow from the fields of `LogOptions`. A new option is one field, and its use in the reader.
"""

import re
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, Field, model_validator

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
_CALIBRATION = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,2})?)\s*(\D.*?)\s*/\s*(m?V)\s*", re.ASCII)


def _checked(check: Callable[[Any], Any], expected: str, spelled: Callable[[Any], Any] = lambda said: said) -> Any:
    """Of a value that is given: what it must pass, in words too, and its one spelling."""

    def validate(said: Any) -> Any:
        if said is None:
            return None
        if not check(said):
            raise ValueError(f"expected {expected}; got {said!r}")
        return spelled(said)

    return AfterValidator(validate)


def _unit(quantity: str, *tables: Mapping[str, float]) -> Any:
    known = [unit for units in tables for unit in units]
    expected = f"a unit of {quantity}, one of {', '.join(known)}"
    return _checked(lambda said: known_unit(said) in known, expected, known_unit)


def _is_codec(said: str) -> bool:
    try:
        "".encode(said)
    except (LookupError, ValueError):
        return False
    return True


def _pairs(said: Mapping[str, str] | str) -> list[tuple[str, str]]:
    if isinstance(said, Mapping):
        return [(name, str(unit).strip()) for name, unit in said.items()]
    parts = [part.partition("=") for part in said.split(",") if part.strip()]
    return [(name.strip(), unit.strip()) for name, _, unit in parts]


def _are_units(said: Mapping[str, str] | str) -> bool:
    """Whether all names are options of columns, each with a unit, or so many of it for a volt."""
    for name, text in _pairs(said):
        match = _CALIBRATION.fullmatch(text)
        unit, per_volt = (match[2], match[1].strip("+-.0")) if match else (text.removeprefix("-"), "1")
        if name not in (*LASERS, *FURTHER, "force") or not quantity_of(known_unit(unit)) or not per_volt:
            return False
    return True


Word = str | None
Column = Annotated[
    str | int | None,
    _checked(lambda said: said if isinstance(said, str) else said >= 1, "a column by its name or by its number from 1"),
]
Separator = Annotated[
    Word,
    _checked(SEPARATORS.get, "one of comma, semicolon, tab, pipe, space, or the sign itself", SEPARATORS.__getitem__),
]
Decimal = Annotated[Word, _checked({".", ","}.__contains__, "a decimal mark, '.' or ','")]
Codec = Annotated[Word, _checked(_is_codec, "a codec such as utf-8, cp1252")]
_NAMED_UNITS = "the options that name columns, each with its unit, such as force=kN or mass=5 mm/V"
Units = Annotated[
    dict[str, str] | str | None,
    _checked(_are_units, _NAMED_UNITS, lambda said: ", ".join(f"{name}={unit}" for name, unit in _pairs(said))),
]
Ordinal = Annotated[
    str | int | None,
    _checked(lambda said: str(said).isascii() and str(said).isdecimal() and int(said) > 0, "a number from 1", int),
]
Number = Annotated[float | None, Field(allow_inf_nan=False)]
Positive = Annotated[float | None, Field(gt=0, allow_inf_nan=False)]


def _key(words: str, takes: str = "COLUMN", default: Any = None) -> Any:
    return Field(default, description=words, json_schema_extra={"takes": takes})


class LogOptions(BaseModel, frozen=True, extra="forbid", strict=True, defer_build=True):
    """``[log]``: what a log is, where that is not to be found in it.

    ``None`` means: find it in the log. What each option is stands in its words, as ``--help`` shows them. Spellings
    become the one known: ``µm`` is ``um``, ``pipe`` is ``|``. Impossible values are a `ValueError` that names all.

    Examples
    --------
    >>> LogOptions(unit="µm", separator="pipe", mass="Laser 2", units="force=kN, torque=0.5 Nm/V").given()
    {'separator': '|', 'mass': 'Laser 2', 'unit': 'um', 'units': 'force=kN, torque=0.5 Nm/V'}
    """

    separator: Separator = _key("What parts the columns: comma, semicolon, tab, pipe, space, or the sign.", "NAME")
    decimal: Decimal = _key("Decimal mark: . or ,", "MARK")
    encoding: Codec = _key("Encoding of the text, such as utf-8, cp1252, utf-16.", "NAME")
    time: Column = _key("Column of the time, by name or by number from 1.")
    mass: Column = _key("Column of the mass, by name or by number from 1; two lasers of it: 2+3.")
    base: Column = _key("Column of the base, by name or by number from 1; two lasers of it: 2+3.")
    relative: Column = _key("Column of mass minus base, in place of the mass's.")
    contact_force: Column = _key("Column of the contact's friction force.")
    normal_force: Column = _key("Column of the force that presses the contact together.")
    mass_velocity: Column = _key("Column of the mass's velocity.")
    base_velocity: Column = _key("Column of the base's velocity.")
    mass_acceleration: Column = _key("Column of the mass's acceleration.")
    base_acceleration: Column = _key("Column of the base's acceleration.")
    torque: Column = _key("Column of the friction torque.")
    angle: Column = _key("Column of the angle.")
    unit: Annotated[Word, _unit("displacement", LENGTH, ACCELERATION)] = _key(
        "Unit of the displacements: m mm um nm cm in mil.", "UNIT"
    )
    units: Units = _key(
        "Units of columns, of a volt too: contact_force=kN,mass=5 mm/V; mass=-mm turns a sign.", "NAME=UNIT,..."
    )
    time_unit: Annotated[Word, _unit("time", TIME)] = _key("Unit of the time column: s ms us ns min h.", "UNIT")
    variable: Annotated[Word, _checked(bool, "the name of a variable")] = _key(
        "MATLAB, JSON, NumPy: the variable that holds the log.", "NAME"
    )
    test: Ordinal = _key("A file of several tests: which one, by its number from 1.", "N")
    sampling_rate_hz: Positive = _key("Samples per second: the time is counted instead of read.", "HZ")
    measuring_range_m: Positive = _key(
        "Measuring range of the laser, where its step in the data does not show it.", "M"
    )
    lag_s: Number = _key("Two logs: the base's clock minus the mass's.", "S")
    lag_s_u: Annotated[Number, Field(ge=0)] = _key("Two logs: standard uncertainty of that lag.", "S")
    clock_drift: Annotated[Number, Field(ge=-0.5, le=0.5)] = _key(
        "Two logs: by how much the base's clock gains; 0 leaves its stamps.", "SHARE"
    )
    bridge_s: Annotated[float, Field(ge=0, allow_inf_nan=False)] = _key(
        "Holes up to this long are bridged, longer ones cut the recording.", "S", 0.02
    )
    most_damage: Annotated[float, Field(ge=0, le=1)] = _key(
        "Share of unreadable lines up to which a log is accepted.", "SHARE", 0.1
    )

    @model_validator(mode="after")
    def _marks_differ(self) -> Self:
        if self.decimal == self.separator == ",":
            raise ValueError("decimal: expected another mark than the separator; got a comma for both")
        return self

    def given(self) -> dict[str, str | float]:
        """Return the options that were said, for the recording's provenance."""
        return self.model_dump(exclude_defaults=True)

    def but(self, **changes: object) -> "LogOptions":
        """The same options but for these."""
        return self.model_copy(update=changes)

    def unit_of(self, role: str) -> tuple[str, float | None, float]:
        """The unit said of a channel; how many of it a volt is, where it stands for one; -1 for one said as ``-mm``."""
        pairs = dict(_pairs(self.units or ""))
        general = {"contact_force": pairs.get("force")} | dict.fromkeys(LASERS, self.unit)
        said = pairs.get(role) or general.get(role) or ""
        match = _CALIBRATION.fullmatch(said)
        if match is None:
            return known_unit(said.removeprefix("-")), None, -1.0 if said.startswith("-") else 1.0
        return known_unit(match[2]), float(match[1]) * (1e3 if match[3] == "mV" else 1.0), 1.0
