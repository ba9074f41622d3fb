"""Files of measurements: ``.jsonl`` and ``.csv`` with a row each, and ``.h5`` with the series behind the rows."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from frictionlab.analysis.drift import Trend
from frictionlab.errors import UsageError
from frictionlab.hdf5 import read_tree
from frictionlab.tables import SENTENCES, Row, read_rows

KIND = "frictionlab measurements"
SUFFIXES = (".jsonl", ".csv", ".h5")


def read_measurements(path: Path) -> list[Row]:
    """Read the rows of one file of measurements; of an ``.h5`` file also each long test's ``trend``.

    Raises
    ------
    UsageError
        The file is not there, is of another kind, is empty, or a line of it is damaged.
    RecordingError
        An ``.h5`` file that holds no measurements, a recording for example.
    """
    if path.suffix not in SUFFIXES:
        raise UsageError(f"{path}: expected measurements as {', '.join(SUFFIXES)}; got {path.suffix or 'no suffix'}")
    if not path.is_file():
        raise UsageError(f"{path}: there is no such file: expected what `frictionlab analyze -o` wrote")
    rows: list[Row] = [*(_rows_of_tree(read_tree(path, kind=KIND)) if path.suffix == ".h5" else read_rows(path))]
    if not rows:
        raise UsageError(f"{path}: expected at least one measurement; got none")
    strange = [n for n, row in enumerate(rows, 1) if "source" not in row]
    if strange:
        raise UsageError(
            f"{path}: row {strange[0]}: expected a measurement with a source; got none: is it another table?"
        )
    return rows


def _rows_of_tree(tree: Mapping[str, Any]) -> Iterator[Row]:
    columns = tree.get("rows", {})
    names = list(columns)
    series = tree.get("cycles", {})
    for n, values in enumerate(zip(*(columns[name] for name in names), strict=True)):
        row = {name: _cell(name, value) for name, value in zip(names, values, strict=True)}
        trend = series.get(str(n), {}).get("trend")
        yield row if trend is None else {**row, "trend": _trend(trend)}


def _cell(name: str, value: Any) -> object:
    if name == "warnings":
        return tuple(value.split(SENTENCES)) if value else ()
    if isinstance(value, str):
        return value or None
    number = float(value)
    return number if math.isfinite(number) else None


def _trend(tree: Mapping[str, Any]) -> Trend:
    time, value = (np.asarray(tree[key], dtype=np.float64) for key in ("time", "value"))
    slope, error, low, high, level = (float(tree[key]) for key in ("slope", "slope_se", "low", "high", "level"))
    return Trend(time, value, slope, error, low, high, level)
