"""Files of measurements: tables with a row each, and ``.h5`` with the series behind the rows."""

from collections.abc import Iterator, Mapping
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np

from frictionlab.analysis.steadiness import Trend
from frictionlab.campaign.laws import is_comparison
from frictionlab.errors import RecordingError, UsageError
from frictionlab.hdf5 import is_recording, read_tree
from frictionlab.schema import MEASUREMENTS
from frictionlab.tables import SUFFIXES, Row, read_rows
from frictionlab.tables.frames import rows_of

IS_RECORDING = (
    "a recording; campaign evaluates measurements: `frictionlab analyze RECORDING... -o measurements.jsonl`, then"
    " `frictionlab campaign measurements.jsonl -o FOLDER`"
)


def read_measurements(path: Path) -> list[Row]:
    """Read the rows of one file of measurements; of an ``.h5`` file also each long test's ``trend``.

    Raises
    ------
    UsageError
        It is a recording, the file is not there, is of another kind, is empty, or a line of it is damaged.
    RecordingError
        An ``.h5`` file that holds no measurements, a recording for example.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f"{path}: expected measurements as {', '.join(SUFFIXES)}; got {path.suffix or 'no suffix'}")
    if not path.is_file():
        raise UsageError(f"{path}: there is no such file: expected what `frictionlab analyze -o` wrote")
    if is_recording(path):
        raise UsageError(f"{path}: {IS_RECORDING}")
    found = _rows_of_tree(path) if path.suffix.lower() == ".h5" else read_rows(path)
    rows = [_at_home(row) for row in found]
    if not rows:
        raise UsageError(f"{path}: expected at least one measurement; got none")
    strange = [n for n, row in enumerate(rows, 1) if "source" not in row]
    if strange:
        raise UsageError(
            f"{path}: row {strange[0]}: expected a measurement with a source; got none: is it another table?"
        )
    if any(is_comparison(row) for row in rows):
        return [{"law": None, **row} for row in rows]  # a failed comparison is one too
    return rows


def _at_home(row: Row) -> Row:
    """The row with its source as this system writes paths: a table may have been made under Windows."""
    source = row.get("source")
    if not (isinstance(source, str) and "\\" in source) or Path(source).exists():
        return row
    return {**row, "source": PureWindowsPath(source).as_posix()}


def _rows_of_tree(path: Path) -> Iterator[Row]:
    tree = read_tree(path, kind=MEASUREMENTS.format)
    series = tree.get("cycles", {})
    for n, row in enumerate(rows_of(tree, path, MEASUREMENTS)):
        try:
            trend = series.get(str(n), {}).get("trend")
            yield row if trend is None else {**row, "trend": _trend(trend)}
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise RecordingError(f"{path}: damaged series behind row {n + 1} ({error}): make it again") from error


def _trend(tree: Mapping[str, Any]) -> Trend:
    time, value = (np.asarray(tree[key], dtype=np.float64) for key in ("time", "value"))
    slope, error, low, high, level = (float(tree[key]) for key in ("slope", "slope_se", "low", "high", "level"))
    return Trend(time, value, slope, error, low, high, level)
