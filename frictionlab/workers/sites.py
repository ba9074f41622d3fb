"""Where batches are done beside this process: processes of this machine, or the workers of a Dask cluster.

Both give futures of `concurrent.futures`; one ledger, `hand_out`, holds what is in work.
"""

import asyncio
import contextlib
import importlib
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

from frictionlab import __version__
from frictionlab.errors import ClusterError, UsageError
from frictionlab.workers import HOLD, Lost, Pace, S, timed, use_one_thread

LOOK_S = 1.0  # how often to look whether anybody is still there
ANSWER_S = 10.0  # a scheduler that takes longer to answer is not there
EMPTY_S = 60.0  # a cluster without workers for that long is given up
VERSION_THERE = "__import__('frictionlab').__version__"  # a builtin function is all that each Python can unpack
LOST = (
    "its worker died each time, 3 times: out of memory, a crash in a library, or a script that starts workers outside"
    " `if __name__ == '__main__':`"
)


def hand_out(
    site: "Crew | Cluster", job: Callable[[Sequence[Any]], S], cases: Sequence[Any], pace: Pace
) -> Iterator[S | Lost]:
    """Do the job on batches of the cases and yield what came of them, in order.

    Of batches that were out when a worker died nobody knows which was the cause: each is done again with nothing else
    in work, and where that fails case by case.
    """

    def give(batch: range) -> "Future[tuple[S, float]]":
        return site.submit(partial(timed, is_worker=True), job, cases[batch.start : batch.stop])

    def alone(batch: range) -> Iterator[S | Lost]:
        done = _outcome(site, give(batch))
        if done is not None:
            yield done[0]
            return
        site.mend()
        for case in batch:
            done = _outcome(site, give(range(case, case + 1)))
            if done is None:
                site.mend()
            yield Lost(LOST) if done is None else done[0]

    out: deque[tuple[range, Future[tuple[S, float]] | None]] = deque()  # in order; None: to be done again
    try:
        while out or pace.taken < pace.total:
            workers = site.workers()
            while len(out) < HOLD * workers and pace.taken < pace.total and all(future for _, future in out):
                batch = pace.take(workers=workers)
                out.append((batch, give(batch)))
            if not out:  # a cluster that has no workers yet
                time.sleep(LOOK_S)
                site.look()
                continue
            batch, future = out.popleft()
            done = None if future is None else _outcome(site, future)
            if done is not None:
                pace.note(batch, done[1])
                yield done[0]
                continue
            if future is not None:  # just now a worker has died
                _finish(site, (one for _, one in out if one))
                out = deque((b, None if not f or f.cancelled() or f.exception() else f) for b, f in out)
                site.mend()
            yield from alone(batch)
    finally:
        site.stop()


def _finish(site: "Crew | Cluster", futures: "Iterable[Future[Any]]") -> None:
    every = list(futures)
    while wait(every, timeout=LOOK_S).not_done:
        site.look()


def _outcome(site: "Crew | Cluster", future: "Future[tuple[S, float]]") -> tuple[S, float] | None:
    """Results and seconds; None where a worker died over them."""
    _finish(site, [future])
    try:
        return future.result()
    except Exception as error:
        if site.is_death(error):
            return None
        raise


class Crew:
    """Processes of this machine, one pool of them.

    They are spawned, not forked: they inherit no threads, locks or open files. They ignore Ctrl-C, which a terminal
    sends to all, and leave when `stop` is called or when this process is gone, whatever they are doing.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._start()

    def _start(self) -> None:
        context = get_context("spawn")
        self._cut, self._lifeline = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(self._size, mp_context=context, initializer=_settle, initargs=(self._cut,))

    def workers(self) -> int:
        """How many batches it works on at a time."""
        return self._size

    def submit(self, function: Callable[..., Any], *arguments: object) -> "Future[Any]":
        """Let a process call the function; if one has died meanwhile, the future says so."""
        try:
            return self._pool.submit(function, *arguments)
        except BrokenExecutor as error:
            failed: Future[Any] = Future()
            failed.set_exception(error)
            return failed

    def is_death(self, error: BaseException) -> bool:
        """Whether a process has died (with it all in work is lost), or the error is the job's own."""
        return isinstance(error, BrokenExecutor)

    def look(self) -> None:
        """Nothing to look for: a pool notices when a process dies."""

    def mend(self) -> None:
        """Start a new pool in place of a broken one, of which nothing is out any more."""
        self.stop()
        self._start()

    def stop(self) -> None:
        """End the processes at once and wait until they are gone."""
        self._lifeline.close()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._cut.close()


def _settle(lifeline: Connection) -> None:
    """Set a new process up: it leaves when the other end of its lifeline is closed, by `Crew.stop` or by the kernel."""

    def leave() -> None:
        with contextlib.suppress(EOFError, OSError):
            lifeline.recv()
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    use_one_thread()
    threading.Thread(target=leave, daemon=True).start()


class Cluster:
    """The workers that a Dask scheduler (its address like ``tcp://host:8786``) has, however many come and go.

    Raises
    ------
    UsageError
        Dask is not installed.
    ClusterError
        The scheduler does not answer, or a worker has another version.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        try:
            self._dask = importlib.import_module("distributed")
        except ImportError as error:
            raise UsageError(
                f"--scheduler {address}: expected the package dask.distributed; got: {error}; "
                "do: pip install 'frictionlab[cluster]'"
            ) from error
        try:
            with ThreadPoolExecutor(1) as aside:  # a thread, for a notebook's own loop runs in this one
                aside.submit(asyncio.run, self._ring()).result()
            self._client = self._dask.Client(address, timeout=ANSWER_S, set_as_default=False, name="frictionlab")
        except (OSError, ValueError) as error:
            reason = next(iter(str(error).splitlines()), "it accepts the connection and does not answer")
            raise ClusterError(
                f"{address}: no Dask scheduler answered within {ANSWER_S:.0f} s ({reason}): expected an address like "
                "tcp://host:8786; do: start one with `dask scheduler`, or give the address it prints"
            ) from error
        self._seen = time.monotonic()
        self.workers()
        # a call that a worker of another version cannot unpack would end it, and then the next one
        found = self._client.run(eval, VERSION_THERE, on_error="return")  # noqa: S307 - of a constant
        wrong = {where: what for where, what in found.items() if what != __version__}
        if wrong:
            self.stop()
            where, what = next(iter(wrong.items()))
            raise ClusterError(
                f"{address}: {len(wrong)} of {len(found)} workers lack this version: expected frictionlab "
                f"{__version__}, as here; got {'none' if isinstance(what, Exception) else what} at {where}; "
                "do: install the same version there"
            )

    async def _ring(self) -> None:
        """Call the scheduler and hang up: a `Client` would wait for ever where something else listens."""
        access = self._dask.Security().get_connection_args("client")
        call = self._dask.comm.connect(self.address, timeout=ANSWER_S, **access)
        comm = await asyncio.wait_for(call, 1.5 * ANSWER_S)
        await comm.close()

    def workers(self) -> int:
        """Threads of all workers just now: they come and go."""
        try:
            count: int = sum(self._client.nthreads().values())
        except (OSError, TimeoutError) as error:
            raise self._lost() from error
        self._seen = time.monotonic() if count else self._seen
        return count

    def submit(self, function: Callable[..., Any], *arguments: object) -> "Future[Any]":
        """Let some worker call the function; the future also ends when Dask gives the call up.

        Dask's own executor leaves a future waiting for ever if the worker that holds its result dies before the result
        is fetched and doing it again fails (distributed 2026.8).
        """
        there = self._client.submit(function, *arguments, pure=False)
        return asyncio.run_coroutine_threadsafe(self._fetch(there), self._client.loop.asyncio_loop)

    async def _fetch(self, there: Any) -> Any:
        return await self._client.gather(there, asynchronous=True)

    def is_death(self, error: BaseException) -> bool:
        """Whether workers died over a call; `ClusterError` if the scheduler dropped it."""
        if isinstance(error, CancelledError):
            raise self._lost()
        return isinstance(error, self._dask.KilledWorker)

    def look(self) -> None:
        """Raise `ClusterError` if the scheduler is gone, or has been without workers for a minute."""
        if self._client.status != "running":
            raise self._lost()
        if not self.workers() and time.monotonic() - self._seen > EMPTY_S:
            raise ClusterError(
                f"{self.address}: the scheduler has had no workers for {EMPTY_S:.0f} s: expected at least one; "
                f"do: start some, like `dask worker {self.address}`, or look into the logs of those that have left"
            )

    def _lost(self) -> ClusterError:
        return ClusterError(
            f"{self.address}: the scheduler went away during the work; what came back before is kept; "
            "do: start it and its workers again, and continue"
        )

    def mend(self) -> None:
        """Nothing to mend: each worker's nanny starts a new one."""

    def stop(self) -> None:
        """Drop what is still in work; the cluster stays."""
        self._client.close(timeout=ANSWER_S)
