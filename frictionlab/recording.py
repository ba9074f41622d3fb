"""What one test left behind: the displacement of mass and base over time, in SI units, validated once.

A recording is never edited: damage stays in it as quality flags, and where it came from (files, dialect, lines that
could not be read) travels with it. One sample stands for one data line of the log.
"""

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.errors import RecordingError
from frictionlab.sampling import sampling_interval, step_range

T = TypeVar("T", bound=np.generic)
Fact = str | float
"""One fact about an experiment: a word or a number."""


class Quality(enum.IntFlag):
    """What was wrong at a sample; 0 is a sound sample. The names are the file's CF ``flag_meanings``."""

    ERROR_CODE = 1
    """The sensor reported an error instead of a distance."""
    OUT_OF_RANGE = 2
    """The value lies outside the sensor's measuring range."""
    HELD = 4
    """The value stands still at an end of the range: the sensor held its last value, this is not a stop."""
    INTERPOLATED = 8
    """The value is a straight line between its sound neighbours, not a measurement."""
    DUPLICATED = 16
    """The time stamp repeats the one before."""
    GAP_BEFORE = 32
    """Samples are missing between the one before and this one."""
    NO_VALUE = 64
    """The log has no number here (dashes, nan, infinity, overflow)."""
    NOT_BRIDGED = 128
    """No cycle may be cut across the start of this sample: a gap too long to bridge, or a clock that restarted."""


@dataclass(frozen=True)
class LineCount:
    """What became of each line of a log; the kinds add up to ``read``."""

    read: int = 0
    preamble: int = 0
    header: int = 0
    data: int = 0
    blank: int = 0
    comment: int = 0
    quarantined: int = 0

    def __post_init__(self) -> None:
        kinds = {f.name: int(getattr(self, f.name)) for f in fields(self) if f.name != "read"}
        if min(kinds.values()) < 0 or sum(kinds.values()) != self.read:
            raise RecordingError(f"lines do not add up: expected {self.read} in all; got {kinds}")

    def __add__(self, other: "LineCount") -> "LineCount":
        return LineCount(**{f.name: getattr(self, f.name) + getattr(other, f.name) for f in fields(self)})


@dataclass(frozen=True)
class SourceFile:
    """One file a recording was read from: its name, SHA-256 (hex), size in bytes and lines."""

    name: str
    sha256: str = ""
    size_bytes: int = 0
    lines: LineCount = LineCount()


@dataclass(frozen=True)
class QuarantinedLine:
    """A line that is not data and not explained otherwise: file name, number from 1, text as read, why."""

    file: str
    number: int
    text: str
    reason: str


@dataclass(frozen=True)
class Replaced:
    """Values as they stood in the log where the recording holds another one: sample index, mass [m], base [m]."""

    index: NDArray[np.int64]
    mass: NDArray[np.float64]
    base: NDArray[np.float64]


@dataclass(frozen=True)
class Source:
    """Where a recording comes from, and what happened on the way.

    Parameters
    ----------
    files
        The logs read; empty for a recording made in memory.
    dialect
        What was found in the logs: layout, encoding, separator, decimal mark, columns, units, sampling rate.
    options
        What the user had said, word for word.
    quarantined
        The first lines set aside, with their text (the count of all of them is in ``files``).
    warnings
        Sentences about this recording that its user should know.
    evidence
        Sentences on why the dialect was read so.
    replaced
        What stood in the log where a value was bridged or taken out.
    """

    files: tuple[SourceFile, ...] = ()
    dialect: Mapping[str, Fact] = field(default_factory=dict)
    options: Mapping[str, Fact] = field(default_factory=dict)
    quarantined: tuple[QuarantinedLine, ...] = ()
    warnings: tuple[str, ...] = ()
    evidence: tuple[str, ...] = ()
    replaced: Replaced | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "dialect", MappingProxyType(dict(self.dialect)))
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))

    @property
    def lines(self) -> LineCount:
        """The lines of all files together."""
        return sum((f.lines for f in self.files), LineCount())


@dataclass(frozen=True)
class Recording:
    """Displacement of mass and base over time.

    Parameters
    ----------
    time
        (n,) float64, s; increasing, strictly so except at samples flagged ``DUPLICATED``. Steps need not be equal.
    mass_displacement, base_displacement
        (n,) float64, m; finite except at samples flagged ``NOT_BRIDGED``, which hold nan.
    quality
        (n,) uint8, bits of `Quality`; left out, every sample is sound.
    source
        Where it comes from.
    experiment
        Facts about the test, such as ``material`` and ``normal_force_n``.

    Raises
    ------
    RecordingError
        If the arrays differ in length, are shorter than 2, or break the rules above.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(0.0, 2.0, 0.01)
    >>> recording = Recording(t, 1e-3 * np.sin(t), 2e-3 * np.cos(t), experiment={"material": "steel"})
    >>> len(recording), round(recording.sampling_rate_hz), recording.experiment["material"]
    (200, 100, 'steel')
    """

    time: NDArray[np.float64]
    mass_displacement: NDArray[np.float64]
    base_displacement: NDArray[np.float64]
    quality: NDArray[np.uint8] = field(default_factory=lambda: np.zeros(0, np.uint8))
    source: Source = field(default_factory=Source)
    experiment: Mapping[str, Fact] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("time", "mass_displacement", "base_displacement"):
            object.__setattr__(self, name, _column(getattr(self, name), name))
        quality = np.asarray(self.quality, dtype=np.uint8)
        if quality.size == 0:
            quality = np.zeros(len(self.time), np.uint8)
        object.__setattr__(self, "quality", _read_only(quality))
        object.__setattr__(self, "experiment", MappingProxyType(dict(self.experiment)))
        _check_lengths(self)
        _check_time(self.time, self.quality)
        for name in ("mass_displacement", "base_displacement"):
            _check_finite(getattr(self, name), self.quality, name)

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        names = ", ".join(file.name for file in self.source.files) or "no file"
        flagged = int((self.quality != 0).sum())
        said = f", {flagged} flagged" if flagged else ""
        return (
            f"<Recording {names}: {len(self)} samples, {self.duration_s:.4g} s at {self.sampling_rate_hz:.5g} Hz{said}>"
        )

    @property
    def duration_s(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def sampling_rate_hz(self) -> float:
        """Samples per second, by a straight line through all stamps; missing samples are counted, not stretched."""
        return 1.0 / sampling_interval(self.time)

    def flag_counts(self) -> dict[str, int]:
        """Samples with each of the flags of `Quality`, by its name in lower case."""
        flagged = self.quality[self.quality != 0]
        return {str(flag.name).lower(): int(np.count_nonzero(flagged & flag)) for flag in Quality}

    def stretches(self) -> "tuple[Recording, ...]":
        """Cut the recording into its sound parts, in time order; cycles may be cut inside each, never across two.

        In each part time is strictly increasing and every value finite: repeated stamps are left out, and so are held
        values and whatever was too long to bridge. A sound recording is its own single part (nothing is copied).
        Single samples missing inside a part are steps in its ``time``, at most as long as ingest's bridge.
        """
        bad = Quality.HELD | Quality.DUPLICATED | Quality.NOT_BRIDGED
        if not np.any(self.quality & np.uint8(bad)):
            return (self,)
        keep = np.isfinite(self.mass_displacement) & np.isfinite(self.base_displacement)
        keep &= (self.quality & np.uint8(Quality.HELD)) == 0
        breaks = ((self.quality & np.uint8(Quality.NOT_BRIDGED)) != 0) | ~keep
        keep &= (self.quality & np.uint8(Quality.DUPLICATED)) == 0
        edges = np.concatenate([[0], np.flatnonzero(breaks), [len(self)]])
        long = np.flatnonzero(np.diff(edges) > 1)
        parts = (self._take(*pair, keep) for pair in zip(edges[long].tolist(), edges[long + 1].tolist(), strict=True))
        return tuple(part for part in parts if part is not None)

    @property
    def gaps(self) -> tuple[tuple[float, float], ...]:
        """(start, end) in s of each hole between two stretches: last sound stamp before it, first one after it."""
        parts = self.stretches()
        return tuple((float(a.time[-1]), float(b.time[0])) for a, b in pairwise(parts))

    def _take(self, start: int, stop: int, keep: NDArray[np.bool_]) -> "Recording | None":
        """The samples to keep from one break to the next; none is copied where all that follow the first are kept."""
        first = start + int(np.argmax(keep[start:stop]))
        index: slice | NDArray[np.intp] = slice(first, stop)
        if not keep[first:stop].all():
            index = start + np.flatnonzero(keep[start:stop])
        time = self.time[index]
        if len(time) < 2:
            return None
        return replace(
            self,
            time=time,
            mass_displacement=self.mass_displacement[index],
            base_displacement=self.base_displacement[index],
            quality=self.quality[index] & np.uint8(0xFF & ~Quality.NOT_BRIDGED),
        )


def _column(values: ArrayLike, name: str) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise RecordingError(f"{name}: expected one dimension; got shape {array.shape}")
    return _read_only(array)


def _read_only(array: NDArray[T]) -> NDArray[T]:
    view = array.view()
    view.flags.writeable = False
    return view


def _check_lengths(recording: Recording) -> None:
    names = ("time", "mass_displacement", "base_displacement", "quality")
    lengths = {name: len(getattr(recording, name)) for name in names}
    if len(set(lengths.values())) != 1 or lengths["time"] < 2:
        raise RecordingError(f"recording: expected four arrays of one length, at least 2 samples; got {lengths}")


_FARTHEST_M = 1e12
"""No displacement: what is beyond has overflown its unit, and would overflow the analysis."""
LATEST_S = 1e15


def _check_time(time: NDArray[np.float64], quality: NDArray[np.uint8]) -> None:
    if step_range(time)[0] > 0.0 and max(-time[0], time[-1]) < LATEST_S:
        return
    if not np.isfinite(time).all():
        raise RecordingError("time: expected finite stamps; got nan or infinity")
    if np.abs(time).max() >= LATEST_S:
        raise RecordingError(f"time: expected seconds; got {np.abs(time).max():g}: damaged, or in another unit")
    steps = np.diff(time)
    wrong = (steps < 0.0) | ((steps == 0.0) & ((quality[1:] & np.uint8(Quality.DUPLICATED)) == 0))
    if wrong.any():
        i = int(np.argmax(wrong))
        raise RecordingError(f"time: expected increasing stamps; got {time[i]} then {time[i + 1]} at sample {i + 1}")


def _check_finite(values: NDArray[np.float64], quality: NDArray[np.uint8], name: str) -> None:
    with np.errstate(over="ignore", invalid="ignore"):
        if np.dot(values, values) < _FARTHEST_M**2:  # one pass, no temporary
            return
    far = np.isfinite(values) & (np.abs(values) >= _FARTHEST_M)
    if far.any():
        raise RecordingError(f"{name}: expected metres; got {values[np.argmax(far)]:g}: damaged, or in another unit")
    loose = ~np.isfinite(values) & ((quality & np.uint8(Quality.NOT_BRIDGED)) == 0)
    if loose.any():
        raise RecordingError(f"{name}: expected finite values; got {values[np.argmax(loose)]} unflagged")
