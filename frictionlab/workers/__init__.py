"""The same work on one core, on all of this machine, or on a cluster: same rows, same order, nothing lost.

cases --batches--> workers (this process | processes here | Dask) --in order--> results

What a process of ours is set to stands here too: one thread, freed memory kept, garbage looked for rarely. Linear
algebra on several threads sums in another order: the last digits of a frequency changed with the number of cores. It
was no faster either; several inputs at once are what the cores are for.
"""

import atexit
import ctypes
import gc
import os
import time
from collections.abc import Callable, Iterator, Sequence, Sized
from dataclasses import dataclass, field
from functools import partial
from typing import Generic, TypeVar

from frictionlab.errors import UsageError

C = TypeVar("C")
R = TypeVar("R")
S = TypeVar("S", bound=Sized)
WORTH_S = 5.0  # work that lasts longer than this is worth starting processes for: they need one or two seconds
START_S = 2.0  # what the first case may owe to imports
MOST_PER_CORE = 32  # processes, of some 100 MB each
HOLD = 8  # batches per worker that may be out or wait for an earlier one: this bounds the memory
GIVEN_UP = 3  # a single case over which so many workers died is reported and left
GROWTH = 8  # a batch is at most so many times the largest that was measured: the first ones carry imports
SHORTEST_S = 0.02  # below that a batch is not worth its way: 0.4 ms to a process here, 3 ms through Dask

THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # <malloc.h>


def use_one_thread() -> None:
    """Tell libraries that are not loaded yet to use one thread: call it before they are."""
    os.environ.update(dict.fromkeys(THREADS, "1"))


def keep_freed_memory() -> None:
    """Let the C library keep up to 64 MB that is freed, where it is GNU's.

    A measurement makes and drops arrays of some 100 kB by the hundred. Given back to the system and fetched again each
    time, they made 400 recordings take 7.3 s instead of 5.0 on two workers, and 15.4 instead of 5.2 on those of Dask,
    which asks for memory to be given back at once.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # another C library
        return
    mallopt(_MMAP_THRESHOLD, 1 << 24)
    mallopt(_TRIM_THRESHOLD, 1 << 26)


def collect_rarely() -> None:
    """Leave the objects of loaded libraries alone: looking for garbage among them takes 0.3 s of a command of 2 s."""
    gc.set_threshold(100_000, 50, 50)
    atexit.register(gc.freeze)


def cores() -> int:
    """Cores that this process may use; a batch system or ``taskset`` may grant fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True)
class Lost:
    """What stands in place of a result when the case killed every worker that tried it; ``reason``: a sentence."""

    reason: str


@dataclass(frozen=True)
class Portion(Generic[S]):
    """The cases from ``start`` up to, not including, ``stop``, and what came of them.

    Attributes
    ----------
    deaths
        How many workers died over them. A single case under doubt is tried with nothing else in work.
    results
        What the job returned, one result per case; None if it is still to be done, or was lost.
    lost
        Why there are no results, as a sentence; empty if there are. A lost batch holds a single case.
    """

    start: int
    stop: int
    deaths: int = 0
    results: S | None = None
    lost: str = ""

    def __len__(self) -> int:
        return self.stop - self.start


def run_batches(
    job: Callable[[Sequence[C]], S],
    cases: Sequence[C],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    seconds_per_batch: float = 1.0,
) -> Iterator[Portion[S]]:
    """Do a job on slices of the cases and yield what came of them, in the order of the cases.

    The results are the same, bit for bit and in the same order, whatever does the work and however it is grouped, as
    long as the job gives each case a result that does not depend on its neighbours (and all machines are of a kind).
    A worker that dies costs the batches in work, which are done again; a case over which workers die again and again is
    found by halving them and yielded as lost, and the others finish. An error raised by the job is raised here, when
    its turn comes. Memory holds at most eight batches of results per worker.

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
        Address of a Dask scheduler whose workers do it instead, like ``tcp://host:8786``.
    seconds_per_batch
        How long a batch shall take a worker [s]; its size follows from what the last ones took.

    Raises
    ------
    UsageError
        Both workers and scheduler are given, or fewer than one worker, or Dask is not installed.
    ClusterError
        The scheduler does not answer, has no workers, went away, or its workers hold another version.

    Examples
    --------
    >>> def squares(numbers):
    ...     return [n * n for n in numbers]
    >>> [batch.results for batch in run_batches(squares, range(4), workers=1, seconds_per_batch=0)]
    [[0], [1], [4], [9]]
    """
    if workers is not None and scheduler is not None:
        raise UsageError("workers and scheduler: expected one of the two; got both: the scheduler has its own workers")
    most = MOST_PER_CORE * cores()
    if workers is not None and not 1 <= workers <= most:
        raise UsageError(f"workers: expected 1 to {most}, {MOST_PER_CORE} for each core; got {workers}")
    ledger: Ledger[S] = Ledger(len(cases), seconds_per_batch)
    if scheduler is None and workers in (None, 1):
        while not ledger.finished:
            batch = ledger.take(workers=1)
            results, seconds = timed(job, cases[batch.start : batch.stop])
            ledger.book(batch, results, seconds if batch.start else seconds - START_S)
            yield from ledger.in_order()
            if workers is None and ledger.seconds_left > WORTH_S and cores() > 1:
                break
    if ledger.finished:
        return
    from frictionlab.workers.sites import Cluster, Crew, run_there  # noqa: PLC0415  # what one process does not need

    site = Crew(min(workers or cores(), len(cases))) if scheduler is None else Cluster(scheduler)
    yield from run_there(site, job, cases, ledger)


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
        if batch.results is None:
            yield Lost(batch.lost)
        else:
            yield from batch.results


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


@dataclass
class Ledger(Generic[S]):
    """What is out, what came back, and what comes next in order: kept by the process that hands the work out.

    Batches are as long as ``seconds_per_batch`` allows by what the last ones took; their size never changes results.

    Examples
    --------
    >>> ledger = Ledger(1_000_000, 0.25)
    >>> first = ledger.take(workers=2)
    >>> ledger.book(first, ["result"], 1e-5)
    >>> second = ledger.take(workers=2)
    >>> (first.stop, second.stop, round(ledger.seconds_left, 1))
    (1, 9, 10.0)
    """

    total: int
    seconds_per_batch: float
    _cost: float = float("inf")  # s per case
    _largest: int = 0  # cases of the largest batch that was timed
    _fresh: int = 0
    _next: int = 0
    _out: dict[int, Portion[S]] = field(default_factory=dict)
    _due: list[Portion[S]] = field(default_factory=list)  # again, the first of them last
    _back: dict[int, Portion[S] | BaseException] = field(default_factory=dict)

    @property
    def finished(self) -> bool:
        """Whether every case has been handed on."""
        return self._next >= self.total

    @property
    def seconds_left(self) -> float:
        """Work that is left for one worker [s]; infinite before anything is known."""
        return (self.total - self._next) * self._cost

    def may_take(self, *, workers: int) -> bool:
        """Whether a batch may be handed out now."""
        if any(batch.deaths for batch in self._out.values()) or (self._due and self._due[-1].deaths and self._out):
            return False
        fresh = self._fresh < self.total and len(self._out) + len(self._back) < HOLD * workers
        return bool(self._due) or fresh

    def take(self, *, workers: int) -> Portion[S]:
        """The next batch: what is due again goes first, for all later ones wait for it; near the end smaller ones."""
        if self._due:
            batch = self._due.pop()
        else:
            left, size = self.total - self._fresh, 1
            if self._largest:
                share = max(left / (2 * workers), SHORTEST_S / self._cost)
                wanted = min(self.seconds_per_batch / self._cost, share, GROWTH * self._largest)
                size = min(max(int(wanted), 1), left)
            batch = Portion(self._fresh, self._fresh + size)
            self._fresh = batch.stop
        self._out[batch.start] = batch
        return batch

    def book(self, batch: Portion[S], outcome: S | BaseException, seconds: float = 0.0) -> None:
        """Note what came back; an error is raised when its turn comes, as it would be without workers."""
        del self._out[batch.start]
        if isinstance(outcome, BaseException):
            self._back[batch.start] = outcome
            return
        self._cost = max(seconds, 1e-9) / len(batch)
        self._largest = max(self._largest, len(batch))
        self._back[batch.start] = Portion(batch.start, batch.stop, batch.deaths, outcome)

    def book_death(self, batch: Portion[S], deaths: int) -> None:
        """Note that so many workers died while this batch was out: it is due again, halved, alone, or given up."""
        del self._out[batch.start]
        start, stop, total = batch.start, batch.stop, batch.deaths + deaths
        if len(batch) > 1:
            again = [Portion[S](start, (start + stop) // 2), Portion[S]((start + stop) // 2, stop)]
        elif total < GIVEN_UP:
            again = [Portion(start, stop, total)]
        else:
            reason = f"its worker died each time, {total} times: out of memory, or a crash in a library"
            self._back[start] = Portion(start, stop, total, lost=reason)
            return
        self._due = sorted([*self._due, *again], key=lambda one: -one.start)

    def in_order(self) -> Iterator[Portion[S]]:
        """Hand on the batches whose turn has come."""
        while self._next in self._back:
            batch = self._back.pop(self._next)
            if isinstance(batch, BaseException):
                raise batch
            self._next = batch.stop
            yield batch
