"""Files of a campaign: tables of measurements, and the recordings behind them, of which examples are shown."""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np

from frictionlab.analysis.steadiness import Trend
from frictionlab.arrays import FloatArray
from frictionlab.campaign.laws import is_comparison
from frictionlab.campaign.trials import Trial
from frictionlab.errors import FrictionlabError, RecordingError, UsageError
from frictionlab.hdf5 import is_recording, read_recording, read_tree
from frictionlab.recording import Recording
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


CYCLES = 8  # shown of a short test, its last ones
BINS = 800  # an envelope has so many pairs of lowest and highest


@dataclass(frozen=True)
class MeasuredResponse:
    """A piece of one test's time response.

    ``label``: what it is an example of; ``time`` (n,) s; ``mass``, ``base`` (n,): x/Y and y/Y about their means.
    An envelope (``is_envelope``) of a long test holds lowest and highest values in turn, two of each time.
    """

    trial: Trial
    label: str
    time: FloatArray
    mass: FloatArray
    base: FloatArray
    is_envelope: bool = False


def recording_of(trial: Trial, folders: Sequence[Path]) -> Recording | None:
    """The recording that a trial was measured from, looked for at its source and in the folders; None if not there."""
    path = recording_path(trial, folders)
    try:
        return None if path is None else read_recording(path)
    except (FrictionlabError, OSError):
        return None


def recording_path(trial: Trial, folders: Sequence[Path]) -> Path | None:
    """The file of that recording; None if there is none.

    None counts that lies elsewhere than in these folders and the working folder: a table may come from others.
    """
    roots = _roots(folders)
    for path in _places(trial, folders):
        if _is_inside(path, roots) and _is_file(path) and _is_inside(Path(os.path.realpath(path)), roots):
            return path
    return None


def elsewhere(trials: Sequence[Trial], folders: Sequence[Path]) -> list[str]:
    """Sources that name recordings outside these folders and the working folder, where no twin beside stands in."""
    roots = _roots(folders)
    named = [t for t in trials if not t.failed and t.source.endswith(".h5") and not _is_inside(Path(t.source), roots)]
    return [t.source for t in named if not any(_is_inside(p, roots) and _is_file(p) for p in _places(t, folders))]


def _places(trial: Trial, folders: Sequence[Path]) -> list[Path]:
    source = Path(trial.source)
    places = (source, *(folder / source for folder in folders), *(folder / source.name for folder in folders))
    return [path for path in places if path.suffix == ".h5"]


def _roots(folders: Sequence[Path]) -> list[str]:
    return [kind(folder) for folder in (Path.cwd(), *folders) for kind in (os.path.abspath, os.path.realpath)]


def _is_inside(path: Path, roots: Sequence[str]) -> bool:
    """Whether a path leads into one of these folders; told from its name, without looking at the disk."""
    return any(Path(os.path.abspath(path)).is_relative_to(root) for root in roots)  # noqa: PTH100 - leaves out ".."


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long, a folder that may not be entered
        return False


def examples(trials: Sequence[Trial]) -> tuple[tuple[str, Trial], ...]:
    """Which short tests to show: two steady ones (continuous, stick-slip) and the two least steady, with labels."""
    short = [t for t in trials if not t.failed and not t.is_long and t.excess_irregularity is not None]
    rising = sorted(short, key=lambda t: (t.excess_irregularity or 0.0, t.source))
    steady = [next((t for t in rising if t.regime == regime), None) for regime in ("continuous", "stick-slip")]
    chosen = [("steady", t) for t in steady if t is not None]
    taken = {t.source for _, t in chosen}
    unsteady = [("unsteady", t) for t in reversed(rising) if t.source not in taken and t.regime != "stuck"]
    return (*chosen, *unsteady[:2])


def last_cycles(trial: Trial, recording: Recording, label: str) -> MeasuredResponse:
    """The last cycles of a test."""
    span = CYCLES / trial.drive_frequency_hz if math.isfinite(trial.drive_frequency_hz) else math.inf
    inside = recording.time >= recording.time[-1] - span
    scale = trial.base_amplitude_m
    steady = recording.time - recording.time[0] >= trial.transient_s
    steady = steady if steady.any() else inside  # the recording is another test's than the row
    mass, base = (
        (signal[inside] - np.nanmean(signal[steady])) / scale
        for signal in (recording.mass_displacement, recording.base_displacement)
    )
    return MeasuredResponse(trial, label, recording.time[inside], mass, base)


def envelope(trial: Trial, recording: Recording) -> MeasuredResponse:
    """The whole of a long test as lowest and highest displacement per bin: what a plot of all samples would show."""
    bins = min(BINS, max(len(recording) // 4, 1))
    edges = np.linspace(0, len(recording), bins + 1).astype(int)[:-1]
    mass, base = (
        np.column_stack([np.fmin.reduceat(about, edges), np.fmax.reduceat(about, edges)]).ravel()
        for about in (
            (signal - np.nanmean(signal)) / trial.base_amplitude_m
            for signal in (recording.mass_displacement, recording.base_displacement)
        )
    )
    return MeasuredResponse(trial, "long", np.repeat(recording.time[edges], 2), mass, base, is_envelope=True)
