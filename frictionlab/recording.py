"""What one test left behind: channels over time, such as the displacement of mass and base, in SI units.

A recording is validated once and never edited: damage stays in it as quality flags, and where it came from (files,
dialect, lines that could not be read) travels with it. One sample stands for one data line of the log.
"""

import enum
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.arrays import sampling_interval, step_range
from frictionlab.errors import RecordingError
from frictionlab.schema import in_html
from frictionlab.units import UNIT

if TYPE_CHECKING:
    import pandas as pd

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
class Source:
    """Where a recording comes from, and what happened on the way.

    ``files``: the logs read, none for a recording made in memory; ``dialect``: what was found in them, such as layout,
    encoding, separator, columns, units; ``options``: what the user had said, word for word; ``quarantined``: the first
    lines set aside (all are counted in ``files``); ``warnings``: sentences that its user should know; ``evidence``: why
    the dialect was read so.
    """

    files: tuple[SourceFile, ...] = ()
    dialect: Mapping[str, Fact] = field(default_factory=dict)
    options: Mapping[str, Fact] = field(default_factory=dict)
    quarantined: tuple[QuarantinedLine, ...] = ()
    warnings: tuple[str, ...] = ()
    evidence: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "dialect", MappingProxyType(dict(self.dialect)))
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))

    @property
    def lines(self) -> LineCount:
        """The lines of all files together."""
        kinds = [kind.name for kind in fields(LineCount)]
        return LineCount(**{kind: sum(getattr(file.lines, kind) for file in self.files) for kind in kinds})


DISPLACEMENTS = ("mass_displacement", "base_displacement")
_NAME = re.compile(
    r"(?:mass|mass_(?:[2-9]|[1-9]\d)|base)_(displacement|velocity|acceleration)"
    r"|(?:contact|normal)_(force)|(torque|angle|angular_velocity|temperature)"
)


def quantity_named(name: str) -> str:
    """What a channel of this name measures, as `frictionlab.units` calls it; "" if no channel is called so.

    Examples
    --------
    >>> [quantity_named(name) for name in ("mass_2_displacement", "normal_force", "angular_velocity", "quality")]
    ['displacement', 'force', 'angular velocity', '']
    """
    match = _NAME.fullmatch(name)
    return "" if match is None else str(match[match.lastindex or 0]).replace("_", " ")


@dataclass(frozen=True)
class Channel:
    """A channel of a recording.

    ``name``: place and quantity, ``mass_displacement``, ``mass_2_displacement``, ``mass_velocity``,
    ``base_acceleration``, ``contact_force``, ``normal_force``, ``torque``, ``angle``, ``angular_velocity``,
    ``temperature``; ``values`` (n,) float64 in ``unit``, that of the quantity in `frictionlab.units.UNIT` ("m" for a
    contact's force over the stiffness), finite except at samples flagged ``NOT_BRIDGED``, which hold nan; ``sensor``:
    what measured it, such as the column of the log.

    Raises
    ------
    RecordingError
        If no channel is called so.

    Examples
    --------
    >>> import numpy as np
    >>> channel = Channel("mass_velocity", np.zeros(3))
    >>> channel.quantity, channel.unit
    ('velocity', 'm/s')
    """

    name: str
    values: NDArray[np.float64]
    sensor: str = ""
    unit: str = ""

    def __post_init__(self) -> None:
        if not self.quantity:
            raise RecordingError(f"{self.name}: no channel is called so: expected such as mass_velocity, normal_force")
        object.__setattr__(self, "values", _column(self.values, self.name))
        object.__setattr__(self, "unit", self.unit or UNIT[self.quantity])

    @property
    def quantity(self) -> str:
        """What is measured."""
        return quantity_named(self.name)


@dataclass(frozen=True, eq=False, init=False)
class Recording:
    """Channels over time: the displacements of mass and base, and whatever else was measured.

    Every channel is an attribute under its name: ``recording.contact_force``. One that was not measured is absent, and
    asking for it is an error that says what there is.

    Parameters
    ----------
    time
        (n,) float64, s; increasing, strictly so except at samples flagged ``DUPLICATED``. Steps need not be equal.
    mass_displacement, base_displacement
        (n,) float64, m; finite except at samples flagged ``NOT_BRIDGED``, which hold nan. None: not measured.
    quality
        (n,) uint8, bits of `Quality`; left out, every sample is sound.
    source
        Where it comes from.
    experiment
        Facts about the test, such as ``material`` and ``normal_force_n``.
    channels
        All that was measured; the two displacements may be given as above.

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
    >>> recording.normal_force
    Traceback (most recent call last):
    frictionlab.errors.RecordingError: normal_force: not measured here: expected it among the channels; got ...
    """

    time: NDArray[np.float64]
    quality: NDArray[np.uint8]
    source: Source
    experiment: Mapping[str, Fact]
    channels: tuple[Channel, ...]

    def __init__(
        self,
        time: ArrayLike,
        mass_displacement: ArrayLike | None = None,
        base_displacement: ArrayLike | None = None,
        quality: ArrayLike = (),
        source: Source = Source(),
        experiment: Mapping[str, Fact] = MappingProxyType({}),
        channels: Iterable[Channel] = (),
    ) -> None:
        every = tuple(channels)
        named = {channel.name: channel for channel in every}
        given = zip(DISPLACEMENTS, (mass_displacement, base_displacement), strict=True)
        known = named | {name: Channel(name, _column(values, name)) for name, values in given if values is not None}
        if len(named) < len(every) or not known:
            raise RecordingError(f"recording: expected channels of different names; got {every or 'none'}")
        try:
            flags = np.asarray(quality, dtype=np.uint8)
        except (OverflowError, ValueError, TypeError) as error:
            raise RecordingError(f"quality: expected whole numbers from 0 to 255; got {quality!r}") from error
        stamps = _column(time, "time")
        vars(self).update(
            time=stamps,
            quality=_read_only(flags if flags.size else np.zeros(len(stamps), np.uint8)),
            source=source,
            experiment=MappingProxyType(dict(experiment)),
            channels=tuple(known[name] for name in dict.fromkeys((*DISPLACEMENTS, *named)) if name in known),
        )
        measured = self.measured()
        lengths = {"time": len(self.time), **{k: len(v) for k, v in measured.items()}, "quality": len(self.quality)}
        if len(set(lengths.values())) != 1 or lengths["time"] < 2:
            raise RecordingError(f"recording: expected arrays of one length, at least 2 samples; got {lengths}")
        _check_time(self.time, self.quality)
        for name, values in measured.items():
            _check_finite(values, self.quality, name)

    def to_pandas(self) -> "pd.DataFrame":
        """Return the channels and the quality of each sample as a frame, its index the time in seconds."""
        import pandas as pd  # noqa: PLC0415 - a recording that nobody turns into a frame does not wait for pandas

        index = pd.Index(self.time, name="time")
        return pd.DataFrame({**self.measured(), "quality": self.quality}, index=index)

    def __getattr__(self, name: str) -> NDArray[np.float64]:
        """A channel by its name, or the sentence that it was not measured."""
        if name.startswith("__") or not quantity_named(name):
            raise AttributeError(f"a recording has no attribute {name!r}")
        measured = self.measured()
        if name not in measured:
            known = ", ".join(measured)
            raise RecordingError(f"{name}: not measured here: expected it among the channels; got {known}")
        return measured[name]

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        names = ", ".join(file.name for file in self.source.files) or "no file"
        flagged = int(np.count_nonzero(self.quality))
        size = f"{len(self)} samples, {self.duration_s:.4g} s at {self.sampling_rate_hz:.5g} Hz"
        return f"<Recording {names}: {size}{f', {flagged} flagged' if flagged else ''}>"

    def _repr_html_(self) -> str:
        return in_html(self)

    def measured(self) -> dict[str, NDArray[np.float64]]:
        """The channels by their names: displacements of mass and base first, each (n,) in SI units."""
        return {channel.name: channel.values for channel in self.channels}

    def changed(self, **changes: Any) -> "Recording":
        """A copy with other fields, or other channels by their names: values (n,), a `Channel`, or None (without)."""
        own = {name: changes.pop(name) for name in vars(self) if name in changes}
        known = {channel.name: channel for channel in self.channels} | changes
        channels = (v if isinstance(v, Channel) else Channel(name, v) for name, v in known.items() if v is not None)
        return replace(self, **{"channels": channels} | own)

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
        keep = (self.quality & np.uint8(Quality.HELD)) == 0
        for values in self.measured().values():
            keep &= np.isfinite(values)
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
            quality=self.quality[index] & np.uint8(0xFF & ~Quality.NOT_BRIDGED),
            channels=tuple(Channel(c.name, c.values[index], c.sensor, c.unit) for c in self.channels),
        )


@dataclass(frozen=True, eq=False)
class FrequencyTable:
    """A steady motion over frequency, one row a drive; arrays (n,), NaN where a row or the whole table lacks it.

    ``drive``: r, or Hz where not `is_ratio`; ``amplitude``: half the swing of the mass in Y, or in m where `in_metres`;
    ``phase``: rad, by which the mass's fundamental is behind the base; ``base_amplitude``: Y in m; ``_u``: standard
    uncertainties; ``said``: what the reader must know of how it was read.
    """

    source: str
    is_ratio: bool
    in_metres: bool
    drive: NDArray[np.float64]
    drive_u: NDArray[np.float64]
    amplitude: NDArray[np.float64]
    amplitude_u: NDArray[np.float64]
    phase: NDArray[np.float64]
    phase_u: NDArray[np.float64]
    base_amplitude: NDArray[np.float64]
    said: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.drive)


def _column(values: ArrayLike, name: str) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise RecordingError(f"{name}: expected one dimension; got shape {array.shape}")
    return _read_only(array)


def _read_only(array: NDArray[T]) -> NDArray[T]:
    """The array, copied where its owner could still write to it."""
    if array.flags.writeable:
        array = array.copy()
        array.flags.writeable = False
    return array


_LARGEST = 1e12
"""In SI units, no measurement: what is beyond has overflown its unit, and would overflow the analysis."""
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
        if np.dot(values, values) < _LARGEST**2:  # one pass, no temporary
            return
    far = np.isfinite(values) & (np.abs(values) >= _LARGEST)
    if far.any():
        unit = {"m": "metres", "N": "newtons"}.get(UNIT[quantity_named(name)], UNIT[quantity_named(name)])
        raise RecordingError(f"{name}: expected {unit}; got {values[np.argmax(far)]:g}: damaged, or in another unit")
    loose = ~np.isfinite(values) & ((quality & np.uint8(Quality.NOT_BRIDGED)) == 0)
    if loose.any():
        raise RecordingError(f"{name}: expected finite values; got {values[np.argmax(loose)]} unflagged")
