"""Parquet tables, by pyarrow."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.logs.binary.sheet import Sheet, check_size


def is_parquet(first: bytes, _path: Path) -> bool:
    """Whether a file is a Parquet table."""
    return first.startswith(b"PAR1")


def read_parquet(path: Path) -> Sheet:
    """Read the columns of numbers and of moments.

    Raises
    ------
    LogError
        Damaged, or without such columns.
    """
    import pyarrow as pa  # noqa: PLC0415 - 0.1 s that other logs need not wait for
    import pyarrow.parquet as pq  # noqa: PLC0415

    file = pq.ParquetFile(path)
    check_size(file.metadata.num_rows * file.metadata.num_columns, path.stat().st_size)
    table = file.read()
    columns = {name: _numbers(table.column(name), pa) for name in table.column_names}
    chosen = {name: found for name, found in columns.items() if found is not None}
    if not chosen:
        raise LogError(f"no columns of numbers; got {', '.join(table.column_names) or 'none'}")
    moments = frozenset(i for i, name in enumerate(chosen) if pa.types.is_timestamp(table.schema.field(name).type))
    return Sheet("Parquet", tuple(chosen), tuple(chosen.values()), moments=moments)


def _numbers(column: Any, pa: Any) -> NDArray[np.float64] | None:
    """A column as doubles, moments as seconds since 1970; ``None`` for words and the like."""
    kind = column.type
    if pa.types.is_timestamp(kind):
        nanoseconds = column.cast(pa.timestamp("ns")).cast(pa.int64())
        return np.asarray(nanoseconds.to_numpy(zero_copy_only=False), dtype=np.float64) / 1e9
    if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind):
        return np.asarray(column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False), dtype=np.float64)
    return None
