"""Rows in HDF5 files: ``/rows`` holds one array per column, ``/cycles/N`` the series behind row N."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from frictionlab.errors import RecordingError
from frictionlab.schema import MOTIONS, STEADY_STATES, Column, Table, Type, column_of
from frictionlab.tables.cells import CellError, checked, flat
from frictionlab.tables.row import Row

ROWS, SERIES = "rows", "cycles"
WITHOUT_ROWS = (STEADY_STATES, MOTIONS)
"""Tables whose HDF5 files hold no rows but a map over its axes, or a motion."""


def tree_of(
    rows: Iterable[Row], names: Sequence[str], table: Table | None, series: Mapping[str, object]
) -> dict[str, object]:
    """The file of these rows; ``series``: what stands behind them, by the number of the row."""
    told = list(rows)
    columns = {name: _array(name, [row.get(name) for row in told], table) for name in names}
    return {ROWS: columns, SERIES: dict(series)}


def _array(name: str, values: Sequence[object], table: Table | None) -> object:
    """A column as HDF5 holds it: texts (empty: not known), or floats (NaN: not known)."""
    column, cells = column_of(name, table), [flat(value) for value in values]
    if _is_text(column, cells):
        return ["" if cell is None else str(cell) for cell in cells]
    import numpy as np

    return np.array([float("nan") if cell is None else float(cell) for cell in cells])


def _is_text(column: Column | None, cells: Sequence[object]) -> bool:
    if column is not None:
        return column.type in (Type.TEXT, Type.SENTENCES, Type.OBJECT)
    return any(isinstance(cell, str) for cell in cells) or all(cell is None for cell in cells)


def rows_of(tree: Mapping[str, Any], path: Path, table: Table) -> Iterator[dict[str, object]]:
    """The rows of a file's tree.

    Raises
    ------
    RecordingError
        There are no rows, the columns differ in length, or a cell is not what its column says.
    """
    if ROWS not in tree:
        raise RecordingError(f"{path}: expected a table with rows; got a {table.kind}: open it with `frictionlab show`")
    columns = tree[ROWS]
    if not isinstance(columns, Mapping) or not all(map(_is_column, columns.values())):
        raise RecordingError(f"{path}: damaged {table.format}: expected a group of columns under {ROWS!r}")
    lengths = {len(values) for values in columns.values()}
    if len(lengths) > 1:
        raise RecordingError(f"{path}: damaged {table.format}: columns of {min(lengths)} and of {max(lengths)} rows")
    for number, line in enumerate(zip(*columns.values(), strict=True), 1):
        try:
            yield {name: _value(cell, column_of(name, table)) for name, cell in zip(columns, line, strict=True)}
        except CellError as error:
            raise RecordingError(f"{path}, row {number}: {error}: make it again") from error


def _is_column(values: object) -> bool:
    return isinstance(values, list) or (hasattr(values, "__len__") and getattr(values, "ndim", 0) == 1)


def _value(cell: Any, column: Column | None) -> object:
    value = cell.item() if hasattr(cell, "item") else cell
    if column is not None and column.type is Type.WHOLE and isinstance(value, float) and value.is_integer():
        value = int(value)
    return checked(None if value == "" else value, column)
