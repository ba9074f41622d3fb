"""Maps of steady states, solved by many workers and written when the last point is in."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError, UsageError
from frictionlab.files import check_replaceable, make_folder
from frictionlab.hdf5.trees import is_map, write_map
from frictionlab.schema import STEADY_STATES
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.notes import WORDS
from frictionlab.simulator.row import OUTCOME, ROW
from frictionlab.simulator.sweep import FAILED, Grid, StateMap, sweep_points, warm_up
from frictionlab.tables import is_table, write_rows
from frictionlab.workers import Lost, run_batches

BATCH_S = 1.0  # seconds of work in a batch
MOST_POINTS = 5_000_000  # of a map, which memory holds until it is written: some 200 bytes each
BLOCK = 20_000  # points made into rows at a time

__all__ = ["FAILED", "Grid", "Step", "make_map"]


def solve(numbers: Sequence[int], grid: Grid) -> FloatArray:
    """The steady states of these points, where a worker is: one row each, as in `StateMap`."""
    return _solve(grid.points(numbers), grid)


def _solve(points: FloatArray, grid: Grid) -> FloatArray:
    try:
        return sweep_points(points, grid)
    except SimulationError:  # one of them cannot be solved: alone, it costs only itself
        if len(points) == 1:
            return np.full((1, ROW), np.nan)
        return np.concatenate([_solve(point, grid) for point in points[:, np.newaxis]])


@dataclass(frozen=True)
class Step:
    """Some points of a map that are solved now: those of the numbers from ``start`` to ``done``.

    ``found``: the map, of which the points up to here are known; ``reason``: why a point could not be solved, if its
    workers died over it.
    """

    found: StateMap
    start: int
    done: int
    reason: str = ""

    def rows(self) -> Iterator[dict[str, object]]:
        """The contract's keys of each of its points."""
        return self.found.rows_among(range(self.start, self.done))

    def failures(self) -> list[str]:
        """A sentence for each point that could not be solved."""
        lost = np.flatnonzero(np.isnan(self.found.numbers[self.start : self.done, OUTCOME])) + self.start
        why = self.reason or "`frictionlab simulate` says why"
        return [f"{self.found.place(number)} could not be solved: {why}" for number in lost.tolist()]


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
        The scheduler does not answer, goes away, or has workers with another version.

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
    found, done = StateMap(grid, np.full((len(grid), ROW), np.nan)), 0
    job = partial(solve, grid=grid)
    for batch in run_batches(job, range(len(grid)), workers=workers, scheduler=scheduler, seconds_per_batch=BATCH_S):
        if isinstance(batch, Lost):
            step = Step(found, done, done + 1, batch.reason)
        else:
            step = Step(found, done, done + len(batch))
            found.numbers[done : step.done] = batch
        done = step.done
        yield step
    if path.suffix == ".h5":
        about = {"wall": grid.wall, "law": grid.law}
        words = {parameter.name: parameter.words for parameter in law_of(grid.law).parameters}
        flags = {"warnings": {note.name.lower(): (note.value, said) for note, said in WORDS.items() if note.name}}
        write_map(found.datasets(), path, axes=grid.axes(), attributes=about, words=words, flags=flags, force=force)
        return
    blocks = (range(start, min(start + BLOCK, done)) for start in range(0, done, BLOCK))
    write_rows((row for block in blocks for row in found.rows_among(block)), path, STEADY_STATES, force=force)
