"""What every log that is no text is read into: named columns of doubles of one length, of whatever container."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions

FREE_BYTES = 1 << 28
MOST_EXPANSION = 200
"""Numbers may take this many times the file's size, and always `FREE_BYTES`."""
_RATES = ("fs", "sampling_rate", "samplerate", "sample_rate", "srate", "f_s")
_STEPS = ("dt", "ts", "tsample", "sampling_interval")


@dataclass(frozen=True)
class Sheet:
    """Columns of a binary log.

    Parameters
    ----------
    layout
        What kind of file it is.
    titles, units
        One for each column; a unit may be "".
    values
        (n,) float64 each, as in the file; nan for no value; moments as seconds since 1970 UTC.
    moments
        Columns that hold moments.
    facts
        ``interval_s``, ``start_s`` where the file states them.
    """

    layout: str
    titles: tuple[str, ...]
    values: tuple[NDArray[np.float64], ...]
    units: tuple[str, ...] = ()
    moments: frozenset[int] = frozenset()
    facts: Mapping[str, float | str] = field(default_factory=dict)


def check_size(numbers: int, packed: int) -> None:
    """Refuse a file of so many bytes that asks for far more memory, by its count of doubles, than a log of it could.

    Raises
    ------
    LogError
        With the limit.
    """
    most = max(FREE_BYTES, MOST_EXPANSION * packed)
    if 8 * numbers > most:
        raise LogError(
            f"a file of {packed} bytes that asks for {8 * numbers / 1e9:.3g} GB of numbers: accepted are "
            f"{most / 1e9:.3g} GB: expected a log"
        )


def sheet_of(layout: str, content: Any, options: LogOptions, others: str = "") -> Sheet:
    """Make a sheet of what a container holds: named arrays, also in structures, lists of records, several tests.

    Parameters
    ----------
    layout
        What kind of file it is.
    content
        Mappings, lists, arrays and numbers, as deep as the file has them.
    options
        ``variable``: the part that holds the log; ``test``: which of several tests.
    others
        What the file says that it holds, for the message where that is no log.

    Raises
    ------
    LogError
        It holds no arrays, or several tests and none was chosen: what is there is named.

    Examples
    --------
    >>> content = {"run": {"t": np.arange(9), "x": np.ones((9, 1))}, "fs": 250.0}
    >>> sheet = sheet_of("MATLAB", content, LogOptions())
    >>> sheet.titles, sheet.facts
    (('t', 'x'), {'interval_s': 0.004})
    """
    if options.variable is not None:
        content = _part(content, options.variable)
    found = _tests(content)
    if options.test is not None and not 1 <= int(options.test) <= len(found):
        raise LogError(f"--test {options.test}: expected one of 1 to {len(found)}, as many as the file holds")
    if options.test is None and len(found) > 1:
        raise LogError(f"holds {len(found)} tests: which one? give --test 1 to --test {len(found)}")
    chosen = found[int(options.test or 1) - 1]
    columns: dict[str, NDArray[np.float64]] = {}
    facts: dict[str, float | str] = {}
    for name, value in _leaves("", chosen):
        if value.size == 1:
            facts |= _rate(name, float(value.ravel()[0]))
        else:
            columns |= _columns_of(name, value)
    if not columns:
        raise LogError(
            f"no arrays of numbers found: expected vectors such as t, x, y; got {others or _names(chosen)}: save the "
            "columns of tables and other objects as plain vectors (x = T.x; save log.mat t x y)"
        )
    usual = usual_length([*columns.values()])
    wanted = {name: column for name, column in columns.items() if len(column) == usual}
    short = tuple(name.rpartition(".")[2] for name in wanted)
    titles = short if len(set(short)) == len(short) else tuple(wanted)
    said = chosen.get("units", {}) if isinstance(chosen, Mapping) else {}
    units = tuple(str(said.get(title, "")) for title in titles) if isinstance(said, Mapping) else ()
    return Sheet(layout, titles, tuple(wanted.values()), units, facts=facts)


def _part(content: Any, variable: str) -> Any:
    """A variable by its name, or by its path: ``data.run``."""
    for name in variable.split("."):
        if not isinstance(content, Mapping) or name not in content:
            raise LogError(f"--variable {variable!r}: expected one of {_names(content)}; got no such one")
        content = content[name]
    return content if isinstance(content, (Mapping, list)) or _cells(content) else {variable: content}


def _names(content: Any) -> str:
    return ", ".join(map(str, content)) if isinstance(content, Mapping) and content else "none"


def _tests(content: Any) -> list[Any]:
    """The tests in a container: a list of them, mappings of the same keys, or cells of the same number; else one."""
    while isinstance(content, Mapping) and len(content) == 1:
        (inner,) = content.values()
        if not isinstance(inner, Mapping) and not (isinstance(inner, list) and _cells(inner)):
            break
        content = inner
    if isinstance(content, list) and content and all(isinstance(each, Mapping) for each in content):
        if not any(np.ndim(value) for each in content for value in each.values()):
            return [{key: [each.get(key) for each in content] for key in content[0]}]  # records: a row each
        return content
    if not isinstance(content, Mapping):
        return [{"column": content}]
    if {"columns", "data"} <= set(content) and np.ndim(content["data"]) == 2:
        return [dict(zip(map(str, content["columns"]), np.asarray(content["data"], dtype=object).T, strict=False))]
    groups = [each for each in content.values() if isinstance(each, Mapping)]
    if len(groups) > 1 and len({tuple(each) for each in groups}) == 1:
        return groups
    cells = {name: each for name, each in content.items() if _cells(each)}
    counts = {len(each) for each in cells.values()}
    if len(counts) == 1 and (count := counts.pop()) > 1:
        shared = {name: each for name, each in content.items() if name not in cells}
        return [shared | {name: each[i] for name, each in cells.items()} for i in range(count)]
    return [content]


def _cells(value: Any) -> bool:
    """Whether this is a row of arrays of their own lengths, as MATLAB's cells are, or of structures."""
    if not isinstance(value, (list, np.ndarray)) or not len(np.atleast_1d(np.asarray(value, dtype=object))):
        return False
    if isinstance(value, np.ndarray) and value.dtype != object:
        return False
    if all(isinstance(each, Mapping) for each in value):
        return True
    return len({np.size(each) for each in value}) > 1 and all(np.ndim(each) == 1 for each in value)


def _leaves(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """The arrays of numbers below a part of a container, each with its path; no value is nan."""
    if isinstance(value, Mapping):
        for key, inner in value.items() if depth < 3 else ():
            yield from _leaves(f"{name}.{key}" if name else str(key), inner, depth + 1)
        return
    try:
        array = np.asarray(value)
        if array.dtype.names is not None:
            yield from _leaves(name, {field: array[field] for field in array.dtype.names}, depth)
            return
        if array.dtype == object:
            array = np.array([np.nan if each is None else each for each in array.ravel()]).reshape(array.shape)
    except ValueError:  # rows of several lengths
        return
    if array.dtype.kind in "fiu" and array.size:
        yield name, array.astype(np.float64)


def _columns_of(name: str, array: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    flat = array.squeeze()
    if flat.ndim == 1 and len(flat) > 1:
        return {name: flat}
    if flat.ndim == 2:
        tall = flat if flat.shape[0] >= flat.shape[1] else flat.T
        return {f"{name}{i + 1}": np.ascontiguousarray(tall[:, i]) for i in range(min(tall.shape[1], 64))}
    return {}


def _rate(name: str, value: float) -> dict[str, float | str]:
    """The sampling interval, where a number is called one, or a rate."""
    plain = name.rpartition(".")[2].lower()
    if not 0.0 < value < np.inf or plain not in (*_RATES, *_STEPS):
        return {}
    return {"interval_s": 1.0 / value if plain in _RATES else value}


def usual_length(columns: Sequence[Any]) -> int:
    """The length that most columns have; of several, the largest."""
    lengths = [len(column) for column in columns]
    return max(set(lengths), key=lambda n: (lengths.count(n), n))
