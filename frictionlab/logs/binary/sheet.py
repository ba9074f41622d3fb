"""What every binary log is read into: named columns of doubles of one length."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError

FREE_BYTES = 1 << 28
MOST_EXPANSION = 200
"""Numbers may take this many times the file's size, and always `FREE_BYTES`."""


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


def most_bytes(packed: int) -> int:
    """So many bytes of numbers may come out of a file of this size."""
    return max(FREE_BYTES, MOST_EXPANSION * packed)


def check_size(numbers: int, packed: int) -> None:
    """Refuse a file that asks for far more memory than a log of its size could.

    Parameters
    ----------
    numbers
        How many doubles it would become.
    packed
        The file's size in bytes.

    Raises
    ------
    LogError
        With the limit.
    """
    most = most_bytes(packed)
    if 8 * numbers > most:
        raise LogError(
            f"a file of {packed} bytes that asks for {8 * numbers / 1e9:.3g} GB of numbers: accepted are "
            f"{most / 1e9:.3g} GB: expected a log"
        )


def sheet_of_arrays(layout: str, arrays: Mapping[str, NDArray[np.float64]], scalars: Mapping[str, float]) -> Sheet:
    """Make a sheet of named arrays, such as the variables of MATLAB: vectors, and matrices of a column each.

    Of vectors of several lengths those of the length that most have are taken; scalars called fs or dt say the rate.

    Examples
    --------
    >>> sheet = sheet_of_arrays("MATLAB", {"run.t": np.zeros((1, 9)), "run.x": np.ones((9, 1))}, {"fs": 250.0})
    >>> sheet.titles, sheet.facts
    (('t', 'x'), {'interval_s': 0.004})
    """
    columns: dict[str, NDArray[np.float64]] = {}
    for name, array in arrays.items():
        columns |= _columns_of(name, array)
    lengths = [len(column) for column in columns.values()]
    if not lengths:
        raise LogError(
            f"no arrays of numbers found: expected vectors such as t, x, y; got {', '.join(arrays) or 'none'}"
        )
    usual = max(set(lengths), key=lambda n: (lengths.count(n), n))
    chosen = {name: column for name, column in columns.items() if len(column) == usual}
    return Sheet(layout, _short(list(chosen)), tuple(chosen.values()), facts=_rate(scalars))


def _columns_of(name: str, array: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    flat = array.squeeze()
    if flat.ndim == 1 and len(flat) > 1:
        return {name: flat}
    if flat.ndim == 2:
        tall = flat if flat.shape[0] >= flat.shape[1] else flat.T
        return {f"{name}{i + 1}": np.ascontiguousarray(tall[:, i]) for i in range(min(tall.shape[1], 64))}
    return {}


def _short(names: Sequence[str]) -> tuple[str, ...]:
    """Names without the structure they stand in, where they stay different."""
    short = tuple(name.rpartition(".")[2] for name in names)
    return short if len(set(short)) == len(short) else tuple(names)


def _rate(scalars: Mapping[str, float]) -> dict[str, float | str]:
    for name, value in scalars.items():
        plain = name.rpartition(".")[2].lower()
        if plain in ("fs", "sampling_rate", "samplerate", "sample_rate", "srate", "f_s") and 0.0 < value < np.inf:
            return {"interval_s": 1.0 / value}
        if plain in ("dt", "ts", "tsample", "sampling_interval") and 0.0 < value < np.inf:
            return {"interval_s": value}
    return {}
