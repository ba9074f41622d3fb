"""The same work on one core, on all of this machine, or on a cluster: same rows, same order, nothing lost.

cases --batches--> workers (this process | processes here | Dask) --in order--> results

What a process of ours is set to stands here too: one thread, freed memory kept. Linear algebra on several threads sums
in another order: the last digits of a frequency changed with the number of cores. It was no faster either; several
inputs at once are what the cores are for.
"""

import ctypes
import math
import os
import time
from collections.abc import Callable, Iterator, Sequence, Sized
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from frictionlab.errors import UsageError

C = TypeVar("C")
R = TypeVar("R")
S = TypeVar("S", bound=Sized)
WORTH_S = 5.0  # work that lasts longer than this is worth starting processes for: they need one or two seconds
START_S = 2.0  # what the first case may owe to imports
MOST_PER_CORE = 32  # processes, of some 100 MB each
HOLD = 4  # batches per worker that may be out or wait for an earlier one: this bounds the memory
GROWTH = 8  # a batch is at most so many times the largest that was measured: the first ones carry imports
SHORTEST_S = 0.02  # below that a batch is not worth its way: 0.4 ms to a process here, 3 ms through Dask

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # <malloc.h>


def use_one_thread() -> None:
    """Make libraries that are not loaded yet use one thread: call it before they are."""
    os.environ.update(dict.fromkeys(THREADS, "1"))


def keep_freed_memory() -> None:
    """Let the C library keep up to 64 MB that is freed, where it is GNU's.

    A measurement makes and drops arrays of some 100 kB by the hundred: given back and fetched again each time, they
    made 400 recordings take 7.3 s instead of 5.0 on two workers, and 15.4 instead of 5.2 on those of Dask.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # another C library
        return
    mallopt(_MMAP_THRESHOLD, 1 << 24)
    mallopt(_TRIM_THRESHOLD, 1 << 26)


def cores() -> int:
    """Cores that this process may use; a batch system or ``taskset`` may grant fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True)
class Lost:
    """What stands in place of a result when the case killed every worker that tried it; ``reason``: a sentence."""

    reason: str


@dataclass
class Pace:
    """How many cases the next batch holds: as many as take ``seconds`` by what the last ones took."""

    total: int
    seconds: float
    taken: int = 0
    cost: float = math.inf  # s per case
    largest: int = 0  # cases of the largest batch that was timed

    def take(self, *, workers: int) -> range:
        """The next batch: the first ones, which carry imports, grow by degrees; near the end all workers get some."""
        left, size = self.total - self.taken, 1
        if self.largest:
            share = max(left / (2 * workers), SHORTEST_S / self.cost)
            size = min(max(int(min(self.seconds / self.cost, share, GROWTH * self.largest)), 1), left)
        self.taken += size
        return range(self.taken - size, self.taken)

    def note(self, batch: range, seconds: float) -> None:
        """Learn from a batch that is done."""
        self.cost = max(seconds - (0.0 if batch.start else START_S), 1e-9) / len(batch)
        self.largest = max(self.largest, len(batch))


def run_batches(
    job: Callable[[Sequence[C]], S],
    cases: Sequence[C],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    seconds_per_batch: float = 1.0,
) -> Iterator[S | Lost]:
    """Do a job on slices of the cases and yield what it returned, in the order of the cases; `Lost`: of a single case.

    The results are the same, bit for bit and in the same order, whatever does the work and however it is grouped, as
    long as the job gives each case a result that does not depend on its neighbours (and all machines are of a kind).
    A worker that dies costs the batches in work, which are done again, each alone and where that fails case by case; a
    case over which workers die again and again is lost. An error raised by the job is raised here, when its turn comes.

    Parameters
    ----------
    job
        Takes a slice of ``cases`` and returns one result per case: a list, or an array along its first axis. Workers
        get it by pickle: a function of a module, or a `functools.partial` or frozen dataclass around one.
    cases
        What it is done on; a ``range`` costs nothing to send.
    workers
        Processes of this machine. 1: none but this one. By default this process starts, and hands over to one process
        per core when more than five seconds of work are left.
    scheduler
        Address of a Dask scheduler whose workers do it instead, like ``tcp://host:8786``; `ClusterError` where it does
        not answer, has no workers, goes away, or its workers hold another version.
    seconds_per_batch
        How long a batch shall take a worker [s]; its size follows from what the last ones took.

    Examples
    --------
    >>> list(run_batches(list, range(4), workers=1, seconds_per_batch=0))
    [[0], [1], [2], [3]]
    """
    if workers is not None and scheduler is not None:
        raise UsageError("workers and scheduler: expected one of the two; got both: the scheduler has its own workers")
    most = MOST_PER_CORE * cores()
    if workers is not None and not 1 <= workers <= most:
        raise UsageError(f"workers: expected 1 to {most}, {MOST_PER_CORE} for each core; got {workers}")
    pace = Pace(len(cases), seconds_per_batch)
    while scheduler is None and workers in (None, 1) and pace.taken < pace.total:
        batch = pace.take(workers=1)
        results, seconds = timed(job, cases[batch.start : batch.stop])
        pace.note(batch, seconds)
        yield results
        if workers is None and (pace.total - pace.taken) * pace.cost > WORTH_S and cores() > 1:
            break
    if pace.taken < pace.total:
        from frictionlab.workers.sites import Cluster, Crew, hand_out  # noqa: PLC0415  # what one process does not need

        site = Crew(min(workers or cores(), len(cases))) if scheduler is None else Cluster(scheduler)
        yield from hand_out(site, job, cases, pace)


def run_each(
    function: Callable[[C], R],
    cases: Sequence[C],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    seconds_per_batch: float = 1.0,
) -> Iterator[R | Lost]:
    """Call a function on each case and yield what it returns, in order; see `run_batches`.

    Examples
    --------
    >>> list(run_each(abs, [-1, 2, -3]))
    [1, 2, 3]
    """
    job = partial(_each, function)
    for batch in run_batches(job, cases, workers=workers, scheduler=scheduler, seconds_per_batch=seconds_per_batch):
        yield from [batch] if isinstance(batch, Lost) else batch


def _each(function: Callable[[C], R], cases: Sequence[C]) -> list[R]:
    return [function(case) for case in cases]


def timed(job: Callable[[Sequence[C]], S], cases: Sequence[C], *, is_worker: bool = False) -> tuple[S, float]:
    """Do one batch where the worker is; return the results and the seconds they took."""
    if is_worker:
        keep_freed_memory()
    start = time.perf_counter()
    results = job(cases)
    if len(results) != len(cases):
        raise UsageError(f"job: expected one result per case, {len(cases)}; got {len(results)}")
    return results, time.perf_counter() - start
