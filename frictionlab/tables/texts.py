"""Rows as lines of text, JSON Lines and CSV, and back; one value as it stands in a file: number, text, list, object.

A text that a spreadsheet would take for a formula (it begins with ``= + - @``, a tab or a return) gets an apostrophe
before it, which is taken off again when it is read.
"""

import csv
import io
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any

from frictionlab.errors import DOUBTED, UsageError
from frictionlab.schema import GRAVE, OF_LAWS, OUTCOME, Column, Table, Type, column_of, table_of

Row = Mapping[str, object]
"""A result from the schema's keys to values; ``None`` is not known."""
SENTENCES = " | "  # between the sentences of a list in one cell
NOT_KNOWN = frozenset({"", "nan", "na", "n/a", "null", "none"})
LINES_AT_ONCE = 1000
FIRST_BYTES = 1 << 20  # of a file, in which its mark must be found
MOST_DEPTH = 60  # of a value in JSON; results have 3
MOST_DIGITS = 15  # of a whole number; beyond, two of them are one float
_DIGITS = re.compile(r"(?<![\w.])(?<!\w-)\d[\d.]*(?:e[+-]?\d+)?")  # a number, not part of a name
_TO = re.compile(r"( \w{1,3})? to ")  # of a range, also of one that names its unit twice
_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*", re.ASCII)
_FORMULA = re.compile(r"'*[=+\-@\t\r\uff1d\uff0b\uff0d\uff20]")  # full-width forms as well
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ufffe\uffff]")  # escape sequences of terminals begin so
_EXPECTED = {
    Type.NUMBER: "a number, or nothing (null, an empty cell)",
    Type.WHOLE: "a number, or nothing (null, an empty cell)",
    Type.YES_NO: "true or false",
    Type.TEXT: "text",
    Type.SENTENCES: "a list of sentences",
    Type.OBJECT: "an object as JSON",
}


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
    """A value as one cell holds it: lists of texts joined, objects as JSON."""
    value = plain(value)
    if isinstance(value, list) and all(isinstance(item, str) for item in value):
        value = SENTENCES.join(map(str, value))
    if isinstance(value, str):
        return encodable(value)
    if value is None or isinstance(value, (bool, int, float)):
        return value
    return json.dumps(value, allow_nan=False)


def harmless(words: str) -> str:
    """A text that no spreadsheet takes for a formula: ``=SUM(A1)`` and ``'-1`` get an apostrophe before them."""
    return f"'{words}" if _FORMULA.match(words) else words


def unquoted(words: str) -> str:
    """What `harmless` was given."""
    return words[1:] if words.startswith("'") and _FORMULA.match(words) else words


def encodable(words: str) -> str:
    """The text with control characters, and halves of surrogate pairs of file names, written as they are escaped."""
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
    """The value of a cell of CSV, or `CellError`; without a column (one of the user's own) its form says what it is."""
    if column is not None and column.type.is_number and words.strip().lower() in NOT_KNOWN:
        return None
    if column is None or column.type.is_number or column.type is Type.YES_NO:
        said = words if column is None else words.strip().lower()
        if said in ("true", "false"):
            return checked(said == "true", column)
        if _NUMBER.fullmatch(words) and math.isfinite(float(words)):
            digits = words.strip().lstrip("+-")
            is_whole = digits.isdigit() and len(digits) <= MOST_DIGITS
            return checked(int(words) if is_whole else float(words), column)
    return checked(unquoted(words) or None, column)


def checked(value: object, column: Column | None) -> object:
    """A value as its column has it, or `CellError`: finite numbers, texts that can be encoded; a user's own is kept."""
    value = value if isinstance(value, int) else plain(value)
    if isinstance(value, int) and abs(value) > 10**308:
        raise CellError(f"{column.name if column else 'cell'}: expected a number; got one of over 308 digits")
    if column is None:
        return _clean(value)
    if value is None:
        return [] if column.type is Type.SENTENCES else None
    match column.type:
        case Type.NUMBER | Type.WHOLE if isinstance(value, (int, float)) and not isinstance(value, bool):
            return value
        case Type.YES_NO if value in (0, 1):
            return bool(value)
        case Type.TEXT if not isinstance(value, (dict, list)):
            return encodable(str(value))
        case Type.SENTENCES if isinstance(value, (str, list)):
            sentences = value.split(SENTENCES) if isinstance(value, str) else value
            return [encodable(str(item)) for item in sentences]
        case Type.OBJECT if not isinstance(value, str):
            return _clean(value)
        case Type.OBJECT if isinstance(value, str):
            try:
                return _clean(json.loads(value))
            except (ValueError, RecursionError):
                pass
    said = repr(value)
    short = said if len(said) <= 40 else f"{said[:40]}... ({len(said)} characters)"
    raise CellError(f"{column.name}: expected {_EXPECTED[column.type]}; got {short}")


def _clean(value: object, depth: int = 0) -> object:
    if depth > MOST_DEPTH:
        raise RecursionError
    if isinstance(value, str):
        return encodable(value)
    if isinstance(value, list):
        return [_clean(item, depth + 1) for item in value]
    if isinstance(value, dict):
        return {encodable(str(key)): _clean(item, depth + 1) for key, item in value.items()}
    return value


def json_line(row: Row) -> str:
    """One JSON object on one line; NaN and infinity become ``null``, as does whatever is not known.

    Examples
    --------
    >>> json_line({"r": 0.5, "mu": float("nan"), "warnings": ()})
    '{"r": 0.5, "mu": null, "warnings": []}'
    """
    return json.dumps({key: plain(value) for key, value in row.items()}, allow_nan=False)


def in_pieces(lines: Iterator[str]) -> Iterator[bytes]:
    """The lines in pieces of some hundred kilobytes, so that a table of any length passes through little memory."""
    while piece := "".join(islice(lines, LINES_AT_ONCE)):
        yield piece.encode()


def csv_lines(rows: Iterable[Row], names: Sequence[str]) -> Iterator[str]:
    """The head, then one line per row."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    heads = [harmless(name) for name in names]
    for cells in chain([heads], ([cell_of(row.get(name)) for name in names] for row in rows)):
        writer.writerow(cells)
        yield buffer.getvalue()
        buffer.seek(0)
        buffer.truncate()


def read_json_lines(path: Path, table: Table | None) -> Iterator[dict[str, object]]:
    """The rows of a ``.jsonl`` file; a `UsageError` names the line that is none or does not fit its columns."""
    for number, line in enumerate(_text_of(path).split("\n"), 1):
        if not line.strip():
            continue
        try:
            row = json.loads(line)
        except (ValueError, RecursionError) as error:
            said = "nested too deep" if isinstance(error, RecursionError) else error
            raise UsageError(f"{path}, line {number}: expected a JSON object; {said}") from error
        if not isinstance(row, dict):
            raise UsageError(f"{path}, line {number}: expected a JSON object; got {line[:60]!r}")
        cells = ((key, value, column_of(key, table)) for key, value in row.items())
        yield fitting(cells, checked, f"{path}, line {number}")


def read_csv(path: Path, table: Table | None) -> Iterator[dict[str, object]]:
    """The rows of a ``.csv`` file; a `UsageError` names the line that is none or does not fit its columns."""
    reader = csv.reader(io.StringIO(_text_of(path), newline=""))
    try:
        names = [unquoted(name) for name in next(reader, [])]
        twice = sorted({name for name in names if name and names.count(name) > 1})
        if twice:
            raise UsageError(f"{path}, line 1: expected each column once; got {twice[0][:60]!r} more than once")
        kind = table or table_of(names)
        columns = [column_of(name, kind) for name in names]
        for cells in filter(None, reader):
            where = f"{path}, line {reader.line_num}"
            if len(cells) != len(names):
                raise UsageError(f"{where}: expected {len(names)} cells as in the head; got {len(cells)}")
            read = (cell for cell in zip(names, cells, columns, strict=True) if cell[0])
            yield fitting(read, value_of, where)
    except csv.Error as error:
        raise UsageError(f"{path}, line {reader.line_num}: expected comma-separated cells; {error}") from error


def fitting(
    cells: Iterable[tuple[str, Any, Column | None]], value: Callable[[Any, Column | None], object], where: str
) -> dict[str, object]:
    """A row of cells that fit their columns, each the value of (name, cell, column)."""
    try:
        return {encodable(name): value(cell, column) for name, cell, column in cells}
    except (CellError, RecursionError) as error:
        said = f"nested too deep, {MOST_DEPTH} levels at most" if isinstance(error, RecursionError) else error
        raise UsageError(f"{where}: {said}: correct it, or make the file again") from error


def _text_of(path: Path) -> str:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return file.read()
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: expected a result as UTF-8 text; byte {error.start} is not") from error


def names_in(path: Path) -> tuple[str, ...]:
    """The names in the head of a ``.csv`` file, or the keys of the first row of a ``.jsonl`` file that did not fail."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        lines = file.read(FIRST_BYTES).split("\n")
    if path.suffix.lower() == ".csv":
        return tuple(unquoted(name) for name in next(csv.reader(lines[:1]), []))
    found: tuple[str, ...] = ()
    for line in filter(str.strip, lines):
        found = tuple(json.loads(line))
        if found != OUTCOME:
            break
    return found


def few_of(names: Sequence[str]) -> str:
    """Return three names at most in one text, and that there are more."""
    return f"{', '.join(names[:3])}{', ...' * (len(names) > 3)}"


def kinds_of(warnings: Iterable[tuple[str, str]]) -> list[tuple[str, tuple[str, ...]]]:
    """Group warnings (source, sentence) by cause: doubts of a unit first, of which others follow, then grave ones.

    Of these what is wrong with the data stands before what it makes of laws.

    Sentences that differ in their numbers alone, or in the source's name, are one, with the least and the largest of
    each number; of ranges the ends that are farthest. Where one source has several, as of gaps, its first stands for
    them.

    Examples
    --------
    >>> kinds_of([("a", "lag: 3 s"), ("b", "no unit"), ("c", "lag: 4.5e-3 s")])
    [('lag: 4.5e-3 ... 3 s', ('a', 'c')), ('no unit', ('b',))]
    >>> kinds_of([("a", "verdict: misfit"), ("b", "verdict: misfit"), ("b", "mass: repeats the base")])[0]
    ('mass: repeats the base', ('b',))
    >>> kinds_of([("r/N2_1.h5", "no row for N2_1.csv"), ("r/N3_1.h5", "no row for N3_1.csv")])
    [('no row for N2_1.csv', ('r/N2_1.h5', 'r/N3_1.h5'))]
    >>> kinds_of([("a", "from 2 N to 5 N"), ("b", "from 1 N to 4 N")])
    [('from 1 N to 5 N', ('a', 'b'))]
    >>> kinds_of([("a", "from 2 s to 3 s"), ("a", "from 7 s to 8 s")])
    [('from 2 s to 3 s (and 1 more such)', ('a',))]
    >>> kinds_of([("a", "lag: 2 s"), ("a", "lag: 9 s"), ("b", "lag: 4 s")])
    [('lag: 2 ... 4 s (and 1 more such)', ('a', 'b'))]
    """
    found: dict[str, list[tuple[str, str]]] = {}
    for source, sentence in warnings:
        shape = re.sub(rf"(?<!\w){re.escape(Path(source).stem)}(?!\w)", "", sentence)
        found.setdefault(_DIGITS.sub("0", shape), []).append((source, sentence))
    kinds = []
    for alike in found.values():
        first, more = dict(reversed(alike)), len(set(alike)) - len({source for source, _ in alike})
        sources = tuple(dict.fromkeys(source for source, _ in alike))
        said = _in_one(list(dict.fromkeys(first[source] for source in sources)))
        kinds.append((f"{said} (and {more} more such)" if more else said, sources))
    of_laws = {said: bool(OF_LAWS.match(said)) for said, _ in kinds}
    return sorted(kinds, key=lambda k: (DOUBTED not in k[0], not GRAVE.search(k[0]), of_laws[k[0]], -len(k[1])))


def _in_one(sentences: Sequence[str]) -> str:
    """One sentence for some that differ in their numbers alone: ``3 ... 5`` where these differ."""
    words, each = _DIGITS.split(sentences[0]), zip(*map(_DIGITS.findall, sentences), strict=True)
    said = [words[0]]
    for before, after, numbers in zip(words, words[1:], each, strict=False):
        low, high = (pick(numbers, key=_size) for pick in (min, max))
        sign = "-" if before.endswith((" -", "(-")) else ""
        whole = low if _size(low) == _size(high) else f"{low} ... {sign}{high}"
        said += [low if _TO.fullmatch(after) else high if _TO.fullmatch(before) else whole, after]
    return "".join(said)


def _size(number: str) -> float:
    return float(number) if _NUMBER.fullmatch(number) else 0.0
