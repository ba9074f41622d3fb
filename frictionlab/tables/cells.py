"""One value as it stands in a file, and back: numbers, texts, lists of sentences, objects, and what is not known.

A text that a spreadsheet would take for a formula (it begins with ``= + - @``, a tab or a return) gets an apostrophe
before it, which is taken off again when it is read.
"""

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path

from frictionlab.schema import Column, Type

Row = Mapping[str, object]
"""A result from the schema's keys to values; ``None`` is not known."""
SENTENCES = " | "  # between the sentences of a list in one cell
NOT_KNOWN = frozenset({"", "nan", "na", "n/a", "null", "none"})
MOST_DIGITS = 15  # of a whole number; beyond, not even a float tells two of them apart
_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*", re.ASCII)
_FORMULA = re.compile(r"'*[=+\-@\t\r\uff1d\uff0b\uff0d\uff20]")  # full-width forms as well
_QUOTED_FORMULA = re.compile(r"'+[=+\-@\t\r\uff1d\uff0b\uff0d\uff20]")
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ufffe\uffff]")  # escape sequences of terminals begin so


class CellError(ValueError):
    """A cell does not hold what its column says; the reader of the file adds where it stands."""


def plain(value: object) -> object:
    """The JSON twin of a value: numpy scalars and arrays, paths, tuples and mappings included; NaN becomes None."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    return str(value) if isinstance(value, Path) else value


def flat(value: object) -> bool | int | float | str | None:
    """A value as one cell holds it: lists of texts joined, objects as JSON.

    Examples
    --------
    >>> flat(["short", "noisy"]), flat({"beta": 0.4}), flat(math.nan)
    ('short | noisy', '{"beta": 0.4}', None)
    """
    value = plain(value)
    if isinstance(value, list) and all(isinstance(item, str) for item in value):
        value = SENTENCES.join(map(str, value))
    if isinstance(value, str):
        return encodable(value)
    if value is None or isinstance(value, (bool, int, float)):
        return value
    return json.dumps(value, allow_nan=False)


def harmless(words: str) -> str:
    r"""A text that no spreadsheet takes for a formula.

    Examples
    --------
    >>> harmless("=SUM(A1)"), harmless("steel"), harmless("'-1")
    ("'=SUM(A1)", 'steel', "''-1")
    """
    return f"'{words}" if _FORMULA.match(words) else words


def unquoted(words: str) -> str:
    """What `harmless` was given."""
    return words[1:] if _QUOTED_FORMULA.match(words) else words


def encodable(words: str) -> str:
    r"""The text with control characters, and halves of surrogate pairs of file names, written as they are escaped.

    Examples
    --------
    >>> print(encodable("steel\x1b[31m"), encodable("a\udcff"))
    steel\x1b[31m a\udcff
    """
    if words.isprintable():
        return words
    shown = _CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode(), words)
    return shown.encode("utf-8", "backslashreplace").decode()


def cell_of(value: object) -> str:
    """A value as a cell of CSV."""
    if type(value) is float:  # most are: the shortest way
        return repr(value) if math.isfinite(value) else ""
    single = flat(value)
    if single is None:
        return ""
    if isinstance(single, bool):
        return str(single).lower()
    return harmless(single) if isinstance(single, str) else repr(single)


def value_of(words: str, column: Column | None) -> object:
    """The value of a cell of CSV; without a column (one of the user's own) its form says what it is.

    Raises
    ------
    CellError
        The column expects something else.

    Examples
    --------
    >>> [value_of(words, None) for words in ("", "3", "0.5", "true", "steel", "'-1")]
    [None, 3, 0.5, True, 'steel', '-1']
    """
    if column is None:
        return _guess(words)
    if column.type.is_number:
        return _number(words, column)
    if column.type is Type.YES_NO and words.strip().lower() in ("true", "false"):
        return words.strip().lower() == "true"
    return checked(unquoted(words) or None, column)


def _guess(words: str) -> object:
    if words in ("true", "false"):
        return words == "true"
    if _NUMBER.fullmatch(words) and math.isfinite(float(words)):
        return _shortest(words)
    return unquoted(words) or None


def _shortest(words: str) -> int | float:
    digits = words.strip().lstrip("+-")
    return int(words) if digits.isdigit() and len(digits) <= MOST_DIGITS else float(words)


def _number(words: str, column: Column) -> int | float | None:
    if words.strip().lower() in NOT_KNOWN:
        return None
    if not _NUMBER.fullmatch(words) or not math.isfinite(float(words)):
        raise CellError(f"{column.name}: expected a number or an empty cell; got {_short(words)}")
    return _shortest(words)


def checked(value: object, column: Column | None) -> object:
    """A value from JSON, Excel, Parquet or HDF5 as its column has it: finite numbers, texts that can be encoded.

    Raises
    ------
    CellError
        The column expects something else.
    """
    value = plain(value) if not isinstance(value, int) else value
    if value is None:
        return [] if column is not None and column.type is Type.SENTENCES else None
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 10**308:
        raise CellError(
            f"{column.name if column else 'cell'}: expected a number; got one of {len(f'{value:x}')} hexadecimal digits"
        )
    if column is None:
        return _clean(value)
    return _READERS[column.type](value, column)


def _clean(value: object) -> object:
    if isinstance(value, str):
        return encodable(value)
    if isinstance(value, list):
        return [_clean(item) for item in value]
    if isinstance(value, dict):
        return {encodable(str(key)): _clean(item) for key, item in value.items()}
    return value


def _as_number(value: object, column: Column) -> object:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise CellError(f"{column.name}: expected a number or null; got {_short(value)}")
    return value


def _as_yes_no(value: object, column: Column) -> object:
    if value in (0, 1):
        return bool(value)
    raise CellError(f"{column.name}: expected true or false; got {_short(value)}")


def _as_text(value: object, column: Column) -> object:
    if isinstance(value, (dict, list)):
        raise CellError(f"{column.name}: expected text; got {_short(value)}")
    return encodable(str(value))


def _as_sentences(value: object, column: Column) -> object:
    if isinstance(value, str):
        return [encodable(item) for item in value.split(SENTENCES)] if value else []
    if isinstance(value, list):
        return [encodable(str(item)) for item in value]
    raise CellError(f"{column.name}: expected a list of sentences; got {_short(value)}")


def _as_object(value: object, column: Column) -> object:
    if not isinstance(value, str):
        return _clean(value)
    try:
        return _clean(json.loads(value))
    except (ValueError, RecursionError) as error:
        raise CellError(f"{column.name}: expected an object as JSON; got {_short(value)}") from error


_READERS = {
    Type.NUMBER: _as_number,
    Type.WHOLE: _as_number,
    Type.YES_NO: _as_yes_no,
    Type.TEXT: _as_text,
    Type.SENTENCES: _as_sentences,
    Type.OBJECT: _as_object,
}


def _short(value: object) -> str:
    said = repr(value)
    return said if len(said) <= 40 else f"{said[:40]}... ({len(said)} characters)"
