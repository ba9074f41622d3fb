"""Maps of steady states, solved by many workers and written when the last point is in."""

import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab import simulator
from frictionlab.arrays import FloatArray
from frictionlab.errors import ClusterError, SimulationError, UsageError
from frictionlab.files import check_replaceable, make_folder
from frictionlab.hdf5.trees import is_map, write_map
from frictionlab.schema import STEADY_STATES
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.notes import WORDS, Note
from frictionlab.simulator.row import ROW
from frictionlab.simulator.state import PLACES
from frictionlab.simulator.sweep import FAILED, Grid, named, sweep_points, table, warm_up
from frictionlab.tables import Row, is_table, write_rows
from frictionlab.workers import Lost, run_batches

KINDS = {"solver": "S11", "outcome": "S10", "regime": "S10"} | dict.fromkeys(PLACES, "float64") | {"warnings": "uint32"}
BATCH_S = 1.0  # seconds of work in a batch
MOST_POINTS = 5_000_000  # of a map, which memory holds until it is written: some 200 bytes each
BLOCK = 20_000  # points made into rows at a time

__all__ = ["FAILED", "KINDS", "Grid", "Step", "Tally", "make_map", "rows"]


@cache
def digest() -> str:
    """A digest of all of the simulator's source, 16 hexadecimal digits: which build it is; 4 ms, once a process.

    Two builds of one version number may give other last digits.
    """
    content, home = hashlib.sha256(), Path(simulator.__file__).parent
    for path in sorted(home.rglob("*.py")):
        content.update(path.relative_to(home).as_posix().encode())
        content.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return content.hexdigest()[:16]


def solve(numbers: Sequence[int], grid: Grid, build: str) -> NDArray[np.void]:
    """The steady states of these points, where a worker is: one record with the keys of `KINDS` each.

    A worker with another ``build`` of the simulator than the one that asks refuses.
    """
    if build != digest():
        got = f"a worker has another build of the simulator ({digest()})"
        raise ClusterError(f"{got}: expected {build}, as here: install the same files there")
    return _records(_solve(grid.points(numbers), grid))


def _solve(points: FloatArray, grid: Grid) -> FloatArray:
    try:
        return sweep_points(points, grid.family)
    except SimulationError:  # one of them cannot be solved: alone, it costs only itself
        if len(points) == 1:
            return np.full((1, ROW), np.nan)
        return np.concatenate([_solve(point, grid) for point in points[:, np.newaxis]])


@dataclass(frozen=True)
class Step:
    """Some points of a map that are solved now.

    ``start``: number of the first; ``records``: their steady states, one record with the keys of `KINDS` each;
    ``reason``: why a point could not be solved, if its workers died over it.
    """

    start: int
    records: NDArray[np.void]
    reason: str = ""

    @property
    def done(self) -> int:
        """Points of the map that are done."""
        return self.start + len(self.records)


def make_map(
    grid: Grid, path: Path, *, workers: int | None = None, scheduler: str | None = None, force: bool = False
) -> Iterator[Step]:
    """Solve all points of a grid, yield them in order as they are done, and write them to a file after the last.

    The file (``.h5``, ``.csv`` or ``.jsonl``) has the same bytes whatever solved its points; ``workers``,
    ``scheduler``: see `frictionlab.workers.run_batches`; ``force``: replace whatever file stands there.

    Raises
    ------
    UsageError
        There are too many points.
    OutputError
        The file cannot be written.
    ClusterError
        The scheduler does not answer, goes away, or has workers with another build of the simulator.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "map.csv"
    >>> [step.done for step in make_map(Grid((0.5,), (0.4,)), path, workers=1)]
    [1]
    """
    if len(grid) > MOST_POINTS:
        what = f"expected at most {MOST_POINTS} points; got {len(grid)}"
        raise UsageError(f"{path}: {what}: give fewer values, or several maps")
    make_folder(path.parent)
    check_replaceable(
        path, replace=force or (is_map if path.suffix == ".h5" else partial(is_table, table=STEADY_STATES))
    )
    if scheduler is None:
        warm_up(grid.law)  # compiled here once: processes find the machine code
    every, done, job = np.empty(len(grid), list(KINDS.items())), 0, partial(solve, grid=grid, build=digest())
    for batch in run_batches(job, range(len(grid)), workers=workers, scheduler=scheduler, seconds_per_batch=BATCH_S):
        if isinstance(batch, Lost):
            step = Step(done, _records(np.full((1, ROW), np.nan)), batch.reason)
        else:
            step = Step(done, batch)
        every[done : step.done], done = step.records, step.done
        yield step
    if path.suffix == ".h5":
        about = {"wall": grid.wall, "law": grid.law, "simulator": digest()}
        words = {parameter.name: parameter.words for parameter in law_of(grid.law).parameters}
        flags = {"warnings": {note.name.lower(): (note.value, said) for note, said in WORDS.items() if note.name}}
        write_map(every, path, axes=grid.axes(), kinds=KINDS, attributes=about, words=words, flags=flags, force=force)
        return
    blocks = (Step(start, every[start : start + BLOCK]) for start in range(0, len(every), BLOCK))
    write_rows((row for block in blocks for row in rows(grid, block)), path, STEADY_STATES, force=force)


def rows(grid: Grid, step: Step) -> Iterator[Row]:
    """The contract's keys of each point of a step."""
    names = step.records.dtype.names or ()
    columns = {key: step.records[key].astype(str) if KINDS[key][0] == "S" else step.records[key] for key in names}
    return table(grid.points(range(step.start, step.done)), grid.family, columns)


@dataclass
class Tally:
    """What is to be said of a map beside its numbers, gathered step by step.

    ``outcomes``: how many points have which; ``notes``: kind of note -> at how many points it stands, and the first.
    """

    grid: Grid
    outcomes: Counter[str] = field(default_factory=Counter)
    notes: dict[Note, tuple[int, str]] = field(default_factory=dict)

    def add(self, step: Step) -> list[str]:
        """Take the points of a step; return a sentence for each that could not be solved."""
        records, start = step.records, step.start
        self.outcomes.update(records["outcome"].astype(str).tolist())
        for note in Note if np.any(records["warnings"]) else ():
            here = np.flatnonzero(records["warnings"] & note.value)
            if here.size and note != Note.FAILED:  # said point by point
                count, first = self.notes.get(note, (0, self._place(start + int(here[0]))))
                self.notes[note] = count + here.size, first
        lost = np.flatnonzero(records["outcome"] == FAILED.encode()) + start
        why = step.reason or "`frictionlab simulate` says why"
        return [f"{self._place(number)} could not be solved: {why}" for number in lost.tolist()]

    def sentences(self) -> Iterator[str]:
        """A sentence for each kind of note: at how many points it stands, what it says, and which is the first."""
        for note, (count, first) in sorted(self.notes.items()):
            yield f"at {count} of {self.outcomes.total()} points {WORDS[note]} (the first: {first})"

    def _place(self, number: int) -> str:
        """The coordinates of a point in words."""
        point = self.grid.points(range(number, number + 1))[0]
        return ", ".join(f"{name} = {value:g}" for name, value in zip(self.grid.axes(), point, strict=True))


def _records(numbers: FloatArray) -> NDArray[np.void]:
    records = np.empty(len(numbers), dtype=list(KINDS.items()))
    for key, values in named(numbers).items():
        records[key] = values
    return records
