"""What a single cell of a log says: a number, no value, a moment, or something else."""

import math
import re
from datetime import UTC, datetime

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_NO_VALUE = re.compile(
    r"|[-‒–—]+|[-+]?nan|n/?a|null|none|[-+]?inf(?:inity)?|[-+]?∞|x{3,}|[-+]?f{4,}|-?1\.#\w+|overflow|over|error|#+",
    re.IGNORECASE,
)
_MOMENT = re.compile(
    r"(?:(?:(?P<y>\d{4})[-/.](?P<m>\d{1,2})[-/.](?P<d>\d{1,2})|(?P<D>\d{1,2})\.(?P<N>\d{1,2})\.(?P<Y>\d{4}))"
    r"(?:[T _]|,\s*))?"
    r"(?P<H>\d{1,4}):(?P<M>\d{2})(?::(?P<S>\d{2}(?:[.,]\d*)?))?\s*Z?",
    re.ASCII,
)


def plain(cell: str) -> str:
    """Strip blanks and the quotes around a cell."""
    stripped = cell.strip()
    if len(stripped) >= 2 and stripped[0] == stripped[-1] and stripped[0] in "\"'":
        return stripped[1:-1].strip()
    return stripped


def number(cell: str, decimal: str) -> float | None:
    """Read a plain decimal number as Python's ``float`` does; ``None`` if the cell is none.

    Overflow gives infinity; digits beyond ASCII, underscores and thousands marks are refused.

    Examples
    --------
    >>> [number(cell, ",") for cell in ("1,5", "-2E3", " 7 ", "1.5", "1_0", "x")]
    [1.5, -2000.0, 7.0, None, None, None]
    """
    text = plain(cell).replace("\u2212", "-")
    if decimal != ".":
        if "." in text:
            return None
        text = text.replace(decimal, ".")
    if not _NUMBER.fullmatch(text):
        return None
    return float(text.replace("d", "e").replace("D", "e"))


def is_no_value(cell: str) -> bool:
    """Whether a cell says that there is no value: empty, dashes, nan, infinity, Keyence's +FFFFFFF and XXXXXXX."""
    return _NO_VALUE.fullmatch(plain(cell)) is not None


def moment(cell: str) -> float | None:
    """Read a clock time, with or without its date, as seconds (since 1970 UTC, or since midnight); else ``None``.

    Examples
    --------
    >>> moment("1970-01-01 00:00:02.500"), moment("00:01:00.25"), moment("12.5")
    (2.5, 60.25, None)
    """
    match = _MOMENT.fullmatch(plain(cell))
    if match is None:
        return None
    seconds = float((match["S"] or "0").replace(",", "."))
    if int(match["M"]) > 59 or not seconds < 61.0:
        return None
    clock = int(match["H"]) * 3600 + int(match["M"]) * 60 + seconds
    year, month, day_ = match["y"] or match["Y"], match["m"] or match["N"], match["d"] or match["D"]
    if year is None:
        return clock
    try:
        day = datetime(int(year), int(month), int(day_), tzinfo=UTC)
    except ValueError:
        return None
    return day.timestamp() + clock


def decimals(cell: str, decimal: str) -> int | None:
    """How many digits follow the decimal mark of a plain number; ``None`` if it has an exponent or is none."""
    text = plain(cell)
    if number(text, decimal) is None or math.isinf(number(text, decimal) or 0.0) or re.search("[eEdD]", text):
        return None
    return len(text.partition(decimal)[2])
