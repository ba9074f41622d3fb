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
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

from frictionlab import __version__
from frictionlab.errors import ClusterError, UsageError
from frictionlab.workers import Ledger, Portion, S, timed, use_one_thread

AHEAD = 2  # batches per worker: one in work, one waiting, so that no worker waits for this process
LOOK_S = 1.0  # how often to look whether anybody is still there
ANSWER_S = 10.0  # a scheduler that takes longer to answer is not there
EMPTY_S = 60.0  # a cluster without workers for that long is given up
COUNT_S = 2.0  # how often workers are counted: they come and go
VERSION_THERE = "__import__('frictionlab').__version__"  # a builtin function is all that each Python can unpack
DEATHS = 2  # Dask itself tries a task on several workers (four) before it says that it kills them


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
        self._broken = False

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
        died = isinstance(error, BrokenExecutor)
        self._broken = self._broken or died
        return int(died)

    def mend(self) -> None:
        """Start a new pool in place of a broken one, of which nothing is out any more."""
        if self._broken:
            self.stop()
            self._start()

    def stop(self) -> None:
        """End the processes at once and wait until they are gone."""
        self._lifeline.close()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._cut.close()


def _settle(lifeline: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    use_one_thread()
    threading.Thread(target=_leave_with, args=(lifeline,), daemon=True).start()


def _leave_with(lifeline: Connection) -> None:
    """Wait for the other end to be closed, by `Crew.stop` or by the kernel when its process has died."""
    with contextlib.suppress(EOFError, OSError):
        lifeline.recv()
    os._exit(1)


class Cluster:
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

    def mend(self) -> None:
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


def run_there(site: "Crew | Cluster", job: Any, cases: Sequence[Any], ledger: Ledger[S]) -> Iterator[Portion[S]]:
    """Hand the batches out to the workers of a site, and on in order."""
    held: dict[Future[Any], Portion[S]] = {}  # in the order in which they were given
    with contextlib.ExitStack() as stack:
        stack.callback(site.stop)
        while not ledger.finished:
            workers = site.workers()
            while len(held) < AHEAD * workers and ledger.may_take(workers=workers):
                batch = ledger.take(workers=workers)
                held[site.submit(partial(timed, is_worker=True), job, cases[batch.start : batch.stop])] = batch
            if held:
                wait(held, timeout=LOOK_S, return_when=FIRST_COMPLETED)
            else:  # a cluster that has no workers yet
                time.sleep(LOOK_S)
            if any(isinstance(one.exception(), BrokenExecutor) for one in held if one.done() and not one.cancelled()):
                wait(held)  # a broken pool ends all that was in work
            for future in [one for one in held if one.done()]:
                batch = held.pop(future)
                try:
                    ledger.book(batch, *future.result())
                except Exception as error:  # noqa: BLE001 - raised by the ledger when the turn of this batch comes
                    if deaths := site.deaths(error):
                        ledger.book_death(batch, deaths)
                    else:
                        ledger.book(batch, error)
            site.mend()
            yield from ledger.in_order()
