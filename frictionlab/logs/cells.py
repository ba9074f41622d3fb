"""What a single cell of a log says: a number, no value, a moment, or something else."""

import math
import re
from datetime import UTC, datetime

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_NO_VALUE = re.compile(
    r"|[-‒–—]+|[-+]?nan|#?n/?a|#(?:div/0|num|value|ref)!|null|none|[-+]?inf(?:inity)?|[-+]?∞|x{3,}|[-+]?f{4,}|-?1\.#\w+|overflow|over|error|#+",
    re.IGNORECASE,
)
_DAY = (
    r"(?:(?P<y>\d{4})[-/.](?P<m>\d{1,2})[-/.](?P<d>\d{1,2})|(?P<D>\d{1,2})\.(?P<N>\d{1,2})\.(?P<Y>\d{4})"
    r"|(?P<a>\d{1,2})/(?P<b>\d{1,2})/(?P<c>\d{4}))"
)
_MOMENT = re.compile(
    rf"(?:{_DAY}(?:[T _]\s*|,\s*))?"
    r"(?P<H>\d{1,4}):(?P<M>\d{2})(?::(?P<S>\d{2}(?:[.,]\d*)?))?\s*(?:Z|(?P<half>[AaPp])\.?[Mm]\.?)?",
    re.ASCII,
)
_DATE = re.compile(_DAY, re.ASCII)
_THOUSANDS = {
    mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:(?:[{signs}]\d{{3}})+{re.escape(mark)}\d*|(?:[{signs}]\d{{3}}){{2,}})")
    for mark, signs in ((".", ",'’  "), (",", ".'’  "))
}
_EXPONENT = frozenset("eEdD")
_SIGNS = re.compile("[,.'’  ]")


def plain(cell: str) -> str:
    """Strip blanks and the quotes around a cell."""
    stripped = cell.strip()
    if len(stripped) >= 2 and stripped[0] == stripped[-1] and stripped[0] in "\"'":
        return stripped[1:-1].strip()
    return stripped


def number(cell: str, decimal: str) -> float | None:
    """Read a plain decimal number as Python's ``float`` does; ``None`` if the cell is none.

    Overflow gives infinity. Marks between thousands are passed over where nothing else can be meant: a decimal mark, or
    a second of them, follows. Digits beyond ASCII and underscores are refused.

    Examples
    --------
    >>> [number(cell, ",") for cell in ("1,5", "-2E3", " 7 ", "1.5", "1_0", "x")]
    [1.5, -2000.0, 7.0, None, None, None]
    >>> [number(cell, ".") for cell in ("1,234.5", "1,234", "1,234,567", "0,123.5")]
    [1234.5, None, 1234567.0, None]
    """
    text = plain(cell).replace("\u2212", "-")
    if _THOUSANDS[decimal].fullmatch(text):
        whole, mark, rest = text.partition(decimal)
        text = _SIGNS.sub("", whole) + mark + rest
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

    A date with slashes that begins with its day or month has its month first, as in the USA, unless that is none.

    Examples
    --------
    >>> moment("1970-01-01 00:00:02.500"), moment("00:01:00.25"), moment("12.5")
    (2.5, 60.25, None)
    >>> moment("1/2/1970 12:00:01 AM") == 86401.0, moment("2:16:47.5 PM") == (14 * 60 + 16) * 60 + 47.5
    (True, True)
    """
    match = _MOMENT.fullmatch(plain(cell))
    if match is None:
        return None
    seconds = float((match["S"] or "0").replace(",", "."))
    if int(match["M"]) > 59 or not seconds < 61.0:
        return None
    hour = int(match["H"])
    if match["half"]:
        if not 1 <= hour <= 12:
            return None
        hour = hour % 12 + 12 * (match["half"] in "pP")
    clock = hour * 3600 + int(match["M"]) * 60 + seconds
    return clock if match["y"] is match["Y"] is match["c"] is None else _with_date(match, clock)


def date(cell: str) -> float | None:
    """Read a date without a clock time as seconds since 1970 UTC; else ``None``.

    Examples
    --------
    >>> date("1970-01-02"), date("2.1.1970"), date("steel")
    (86400.0, 86400.0, None)
    """
    match = _DATE.fullmatch(plain(cell))
    return None if match is None else _with_date(match, 0.0)


def month_or_day(cell: str) -> bool:
    """Whether a date could have its day or its month first: 9/11/2024.

    Examples
    --------
    >>> [month_or_day(cell) for cell in ("9/11/2024 10:00:00", "9/14/2024", "9/11/2024 10:00:00 AM", "2024-09-11")]
    [True, False, False, False]
    """
    match = _MOMENT.fullmatch(plain(cell)) or _DATE.fullmatch(plain(cell))
    if match is None or match["a"] is None or match.groupdict().get("half"):
        return False
    return int(match["a"]) <= 12 and int(match["b"]) <= 12 and match["a"] != match["b"]


def _with_date(match: re.Match[str], clock: float) -> float | None:
    """Seconds since 1970 of a date found and a clock time [s] after its midnight; ``None`` for no such day."""
    first, second = match["a"], match["b"]
    if first is not None and int(first) > 12:
        first, second = second, first
    year = match["y"] or match["Y"] or match["c"]
    month, day_ = match["m"] or match["N"] or first, match["d"] or match["D"] or second
    try:
        return datetime(int(year), int(month), int(day_), tzinfo=UTC).timestamp() + clock
    except ValueError:
        return None


def decimals(cell: str, decimal: str) -> int | None:
    """How many digits follow the decimal mark of a plain number; ``None`` if it has an exponent or is none."""
    text = plain(cell)
    value = number(text, decimal)
    if value is None or math.isinf(value) or not _EXPONENT.isdisjoint(text):
        return None
    return len(text.partition(decimal)[2])
