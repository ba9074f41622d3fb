"""Do one job on many cases: in this process, in several, or on a cluster."""

import time
from collections.abc import Callable, Iterator, Sequence, Sized
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from frictionlab import __version__
from frictionlab.errors import ClusterError, UsageError
from frictionlab.process import keep_freed_memory
from frictionlab.workers.crew import Crew, crew_of
from frictionlab.workers.ledger import Batch, Ledger
from frictionlab.workers.local import cores
from frictionlab.workers.pace import Pace

C = TypeVar("C")
R = TypeVar("R")
S = TypeVar("S", bound=Sized)
WORTH_S = 5.0  # work that lasts longer than this is worth starting processes for: they need one or two seconds
START_S = 2.0  # what the first case may owe to imports
MOST_PER_CORE = 32  # processes, of some 100 MB each
HOLD = 8  # batches per worker that may be out or wait for an earlier one: this bounds the memory


@dataclass(frozen=True)
class Lost:
    """What stands in place of a result when the case killed every worker that tried it.

    Attributes
    ----------
    reason
        A sentence.
    """

    reason: str


def run_batches(
    job: Callable[[Sequence[C]], S],
    cases: Sequence[C],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    seconds_per_batch: float = 1.0,
) -> Iterator[Batch[S]]:
    """Do a job on slices of the cases and yield what came of them, in the order of the cases.

    The results are the same, bit for bit and in the same order, whatever does the work and however it is grouped, as
    long as the job gives each case a result that does not depend on its neighbours (and all machines are of a kind).
    A worker that dies costs its batch, which is done again; a case over which workers die again and again is found by
    halving its batch and yielded as lost, and the others finish. An error raised by the job is raised here, when its
    turn comes. Memory holds at most eight batches of results per worker.

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
    _check(workers, scheduler)
    pace = Pace(len(cases), seconds_per_batch=seconds_per_batch)
    done = 0
    if scheduler is None and workers in (None, 1):
        for batch in _run_here(job, cases, pace):
            done = batch.stop
            yield batch
            if workers is None and pace.left(done) > WORTH_S and cores() > 1:
                break
    if done < len(cases):
        with crew_of(workers=min(workers or cores(), len(cases) - done), scheduler=scheduler) as crew:
            yield from _run_there(crew, job, cases, Ledger(done, pace), pace)


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
    job = Each(function)
    for batch in run_batches(job, cases, workers=workers, scheduler=scheduler, seconds_per_batch=seconds_per_batch):
        if batch.results is None:
            yield Lost(batch.lost)
        else:
            yield from batch.results


@dataclass(frozen=True)
class Each(Generic[C, R]):
    """A job that calls a function on each case."""

    function: Callable[[C], R]

    def __call__(self, cases: Sequence[C]) -> list[R]:
        """The results of a slice of the cases."""
        return [self.function(case) for case in cases]


def _check(workers: int | None, scheduler: str | None) -> None:
    if workers is not None and scheduler is not None:
        raise UsageError("workers and scheduler: expected one of the two; got both: the scheduler has its own workers")
    if workers is not None and not 1 <= workers <= MOST_PER_CORE * cores():
        raise UsageError(
            f"workers: expected at least 1; got {workers}"
            if workers < 1
            else f"workers: expected at most {MOST_PER_CORE * cores()}, {MOST_PER_CORE} for each core; got {workers}"
        )


def _run_here(job: Callable[[Sequence[C]], S], cases: Sequence[C], pace: Pace) -> Iterator[Batch[S]]:
    start = 0
    while start < len(cases):
        stop = start + pace.size(start, workers=1)
        results, seconds = work(job, cases[start:stop], __version__)
        pace.learn(stop - start, seconds=seconds if start else seconds - START_S)
        yield Batch(start, stop, results)
        start = stop


def _run_there(crew: Crew, job: Any, cases: Sequence[Any], ledger: Ledger[S], pace: Pace) -> Iterator[Batch[S]]:
    while not ledger.finished:
        while crew.has_room and (ledger.urgent or ledger.held < HOLD * crew.workers):
            task = ledger.take(workers=crew.workers)
            if task is None:
                break
            crew.give(task, work_there, job, cases[task.start : task.stop], __version__)
        crew.collect(ledger, pace)
        yield from ledger.in_order()


def work(job: Callable[[Sequence[C]], S], cases: Sequence[C], version: str) -> tuple[S, float]:
    """Do one batch where the worker is; return the results and the seconds they took."""
    if version != __version__:
        raise ClusterError(
            f"a worker holds frictionlab {__version__}: expected {version}, as here; do: install the same version there"
        )
    start = time.perf_counter()
    results = job(cases)
    if len(results) != len(cases):
        raise UsageError(f"job: expected one result per case, {len(cases)}; got {len(results)}")
    return results, time.perf_counter() - start


def work_there(job: Callable[[Sequence[C]], S], cases: Sequence[C], version: str) -> tuple[S, float]:
    """Do one batch in a process that is there for the work."""
    keep_freed_memory()
    return work(job, cases, version)
