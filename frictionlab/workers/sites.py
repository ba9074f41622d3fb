"""Where batches are done beside this process: processes of this machine, or the workers of a Dask cluster.

Both are spoken to through the interface of `concurrent.futures`.
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
from frictionlab.workers import GIVEN_UP, HOLD, Pace, Portion, S, timed, use_one_thread

LOOK_S = 1.0  # how often to look whether anybody is still there
ANSWER_S = 10.0  # a scheduler that takes longer to answer is not there
EMPTY_S = 60.0  # a cluster without workers for that long is given up
COUNT_S = 2.0  # how often workers are counted: they come and go
VERSION_THERE = "__import__('frictionlab').__version__"  # a builtin function is all that each Python can unpack
DEATHS = 2  # Dask itself tries a task on several workers (four) before it says that it kills them


class Site:
    """Workers that batches are handed out to; what came of them is handed on in order."""

    def workers(self) -> int:
        """How many batches are worked on at a time."""
        raise NotImplementedError

    def submit(self, function: Callable[..., Any], *arguments: object) -> "Future[Any]":
        """Let a worker call the function."""
        raise NotImplementedError

    def deaths(self, error: BaseException) -> int:
        """How many deaths of workers this error stands for; 0 where it is the job's own."""
        raise NotImplementedError

    def look(self) -> None:
        """Raise an error if nobody is there any more to answer."""

    def mend(self) -> None:
        """Bring back workers that have died, while nothing is in work."""

    def stop(self) -> None:
        """Drop what is still in work."""

    def run(self, job: Callable[[Sequence[Any]], S], cases: Sequence[Any], pace: Pace) -> Iterator[Portion[S]]:
        """Do the job on batches of the cases.

        Of batches that were out when a worker died nobody knows which was the cause: they are done again one by one.
        """

        def give(batch: range) -> "Future[tuple[S, float]]":
            return self.submit(partial(timed, is_worker=True), job, cases[batch.start : batch.stop])

        out: deque[tuple[range, Future[tuple[S, float]] | None]] = deque()  # in order; None: to be done again
        with contextlib.ExitStack() as stack:
            stack.callback(self.stop)
            while out or pace.taken < pace.total:
                workers = self.workers()
                while len(out) < HOLD * workers and pace.taken < pace.total and all(future for _, future in out):
                    batch = pace.take(workers=workers)
                    out.append((batch, give(batch)))
                if not out:  # a cluster that has no workers yet
                    time.sleep(LOOK_S)
                    self.look()
                    continue
                batch, future = out.popleft()
                results, seconds, deaths = (None, 0.0, 1) if future is None else self._outcome(future)
                if results is not None:
                    pace.note(batch, seconds)
                    yield Portion(batch.start, batch.stop, results)
                    continue
                if future is not None:  # just now a worker has died
                    self._wait(one for _, one in out if one)
                    out = deque((b, None if not f or f.cancelled() or f.exception() else f) for b, f in out)
                    self.mend()
                yield from self._again(batch, deaths, give)

    def _again(
        self, batch: range, deaths: int, give: "Callable[[range], Future[tuple[S, float]]]"
    ) -> Iterator[Portion[S]]:
        """Do a batch over which workers may have died with nothing else in work; if it is the cause, case by case."""
        is_single = len(batch) == 1
        if is_single and deaths >= GIVEN_UP:
            reason = f"its worker died each time, {deaths} times: out of memory, or a crash in a library"
            yield Portion(batch.start, batch.stop, None, reason)
            return
        results, _, more = self._outcome(give(batch))
        if results is not None:
            yield Portion(batch.start, batch.stop, results)
            return
        self.mend()
        for case in batch:
            yield from self._again(range(case, case + 1), more + deaths * is_single, give)

    def _wait(self, futures: "Iterable[Future[Any]]") -> None:
        every = list(futures)
        while wait(every, timeout=LOOK_S).not_done:
            self.look()

    def _outcome(self, future: "Future[tuple[S, float]]") -> tuple[S | None, float, int]:
        """Results, seconds, and how many workers died over them, in which case there are none."""
        self._wait([future])
        try:
            return *future.result(), 0
        except Exception as error:
            if deaths := self.deaths(error):
                return None, 0.0, deaths
            raise


class Crew(Site):
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

    def deaths(self, error: BaseException) -> int:
        """One, if a process has died (with it all in work is lost); 0 where the error is the job's own."""
        return int(isinstance(error, BrokenExecutor))

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


class Cluster(Site):
    """The workers that a Dask scheduler has, however many come and go.

    Parameters
    ----------
    address
        Where the scheduler listens, like ``tcp://host:8786``.

    Raises
    ------
    UsageError
        Dask is not installed, or this is no address.
    ClusterError
        The scheduler does not answer.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self._client = _connect(address)
        self._counted = self._seen = time.monotonic()
        self._workers = self._count()
        # a call that a worker of another version cannot unpack would end it, and then the next one
        found = self._client.run(eval, VERSION_THERE, on_error="return")
        wrong = {where: what for where, what in found.items() if what != __version__}
        if wrong:
            self.stop()
            where, what = next(iter(wrong.items()))
            raise ClusterError(
                f"{self.address}: {len(wrong)} of {len(found)} workers lack this version: expected frictionlab "
                f"{__version__}, as here; got {'none' if isinstance(what, Exception) else what} at {where}; "
                "do: install the same version there"
            )

    def workers(self) -> int:
        """Threads of all workers just now."""
        if time.monotonic() - self._counted > COUNT_S:
            self._workers = self._count()
        return self._workers

    def _count(self) -> int:
        try:
            count: int = sum(self._client.nthreads().values())
        except (OSError, TimeoutError) as error:
            raise self._lost() from error
        self._counted = time.monotonic()
        if count:
            self._seen = self._counted
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

    def deaths(self, error: BaseException) -> int:
        """How many deaths of workers this error stands for; `ClusterError` if the scheduler dropped the call."""
        if isinstance(error, CancelledError):
            raise self._lost()
        killed = _part_of_dask("distributed.scheduler", self.address).KilledWorker
        return DEATHS if isinstance(error, killed) else 0

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

    def stop(self) -> None:
        """Drop what is still in work; the cluster stays."""
        self._client.close(timeout=ANSWER_S)


def _connect(address: str) -> Any:
    client = _part_of_dask("distributed", address).Client
    try:
        with ThreadPoolExecutor(1) as aside:  # a thread, for a notebook's own loop runs in this one
            aside.submit(asyncio.run, _ring(address)).result()
        return client(address, timeout=ANSWER_S, set_as_default=False, name="frictionlab")
    except (OSError, ValueError) as error:
        reason = next(iter(str(error).splitlines()), "it accepts the connection and does not answer")
        raise ClusterError(
            f"{address}: no Dask scheduler answered within {ANSWER_S:.0f} s ({reason}): expected an address like "
            "tcp://host:8786; do: start one with `dask scheduler`, or give the address it prints"
        ) from error


async def _ring(address: str) -> None:
    """Call the scheduler and hang up: a `Client` would wait for ever where something else listens."""
    access = _part_of_dask("distributed", address).Security().get_connection_args("client")
    call = _part_of_dask("distributed.comm", address).connect(address, timeout=ANSWER_S, **access)
    comm = await asyncio.wait_for(call, 1.5 * ANSWER_S)
    await comm.close()


def _part_of_dask(name: str, address: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise UsageError(
            f"--scheduler {address}: expected the package dask.distributed; got: {error}; "
            "do: pip install 'frictionlab[cluster]'"
        ) from error
