"""What a user may say about a log; each item overrides what would otherwise be found in the log itself."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

from frictionlab.errors import UsageError
from frictionlab.logs.units import LENGTH, TIME, known_unit

if TYPE_CHECKING:
    from frictionlab.scene import Log

SEPARATORS = {
    ",": ",", "comma": ",", ";": ";", "semicolon": ";", "\t": "\t", "tab": "\t", "\\t": "\t", "|": "|", "pipe": "|",
    " ": " ", "space": " ", "whitespace": " ",
}  # fmt: skip


@dataclass(frozen=True)
class LogOptions:
    """Overrides; ``None`` means: find it in the log.

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
    unit, time_unit
        Of the displacements (``m mm um nm cm in``) and of the time column (``s ms us ns min h``).
    sampling_rate_hz
        Samples per second; time is then counted instead of read.
    measuring_range_m
        The laser's measuring range [m], where it is not to be found from the step in the data.
    lag_s
        Two logs: the base's clock minus the mass's clock at one moment [s], added to the base's stamps with a minus.
    bridge_s
        Holes up to this long [s] are bridged by a straight line; longer ones cut the recording in stretches.
    most_damage
        The share of lines that cannot be read beyond which a log is refused. (Samples without a value are flagged, not
        refused, unless most of them are.)

    Raises
    ------
    UsageError
        If an option has an impossible value.
    """

    separator: str | None = None
    decimal: str | None = None
    encoding: str | None = None
    time: str | int | None = None
    mass: str | int | None = None
    base: str | int | None = None
    unit: str | None = None
    time_unit: str | None = None
    sampling_rate_hz: float | None = None
    measuring_range_m: float | None = None
    lag_s: float | None = None
    bridge_s: float = 0.02
    most_damage: float = 0.1

    def __post_init__(self) -> None:
        object.__setattr__(self, "separator", _separator(self.separator))
        if self.decimal not in (None, ".", ","):
            raise UsageError(f"decimal mark: expected . or ,; got {self.decimal!r}")
        if self.decimal == "," and self.separator == ",":
            raise UsageError("separator and decimal mark: expected two different ones; got a comma for both")
        _check_encoding(self.encoding)
        _check_unit(self.unit, LENGTH, "unit of displacement")
        _check_unit(self.time_unit, TIME, "unit of time")
        for name in ("sampling_rate_hz", "measuring_range_m"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < float("inf"):
                raise UsageError(f"{name}: expected a positive number; got {value}")

    def given(self) -> dict[str, str | float]:
        """Return the options that were said, for the recording's provenance."""
        defaults = LogOptions()
        names = [f.name for f in fields(self)]
        return {n: getattr(self, n) for n in names if getattr(self, n) != getattr(defaults, n)}


def options_of(log: "Log", said: Mapping[str, object] | None = None) -> LogOptions:
    """Combine the ``[log]`` table of a scene with what was said on the command line, which wins.

    Examples
    --------
    >>> from frictionlab.scene import Log
    >>> options_of(Log(unit="mm", mass="Laser 2"), {"unit": "um"}).unit
    'um'
    """
    names = {f.name for f in fields(LogOptions)}
    facts = {n: v for n, v in log.model_dump().items() if n in names and v is not None}
    facts |= {n: v for n, v in (said or {}).items() if v is not None}
    return replace(LogOptions(), **facts)


def _separator(said: str | None) -> str | None:
    if said is None:
        return None
    if said not in SEPARATORS:
        raise UsageError(f"separator: expected one of comma, semicolon, tab, pipe, space; got {said!r}")
    return SEPARATORS[said]


def _check_encoding(said: str | None) -> None:
    if said is None:
        return
    try:
        "".encode(said)
    except LookupError as error:
        raise UsageError(f"encoding: expected a codec such as utf-8, cp1252, utf-16; got {said!r}") from error


def _check_unit(said: str | None, quantity: Mapping[str, float], what: str) -> None:
    if said is not None and known_unit(said) not in quantity:
        raise UsageError(f"{what}: expected one of {', '.join(quantity)}; got {said!r}")
