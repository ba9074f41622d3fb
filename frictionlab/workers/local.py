"""Workers on this machine: one process each, each with a pool of its own, so that a death breaks nobody else's."""

import contextlib
import os
import signal
import threading
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from multiprocessing import get_context
from multiprocessing.connection import Connection

from frictionlab.process import use_one_thread


def cores() -> int:
    """Cores that this process may use; a batch system or ``taskset`` may grant fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class OneWorker(ProcessPoolExecutor):
    """A pool of one process, which leaves when `stop` is called or this process is gone, whatever it is doing.

    The process is spawned, not forked: it inherits no threads, locks or open files of this one. It ignores Ctrl-C,
    which a terminal sends to all; this process hears it and stops its workers.
    """

    def __init__(self) -> None:
        context = get_context("spawn")
        self._cut, self._lifeline = context.Pipe(duplex=False)
        super().__init__(1, mp_context=context, initializer=_settle, initargs=(self._cut,))

    def stop(self) -> None:
        """End the process at once and wait until it is gone."""
        self._lifeline.close()
        self.shutdown(wait=True, cancel_futures=True)
        self._cut.close()


def _settle(lifeline: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    use_one_thread()
    threading.Thread(target=_leave_with, args=(lifeline,), daemon=True).start()


def _leave_with(lifeline: Connection) -> None:
    """Wait for the other end to be closed, by `OneWorker.stop` or by the kernel when its process has died."""
    with contextlib.suppress(EOFError, OSError):
        lifeline.recv()
    os._exit(1)


class Process:
    """One process of this machine, replaced when it dies."""

    def __init__(self) -> None:
        self.executor = OneWorker()

    def workers(self) -> int:
        """One."""
        return 1

    def deaths(self, error: BaseException) -> int:
        """One, if the process has died."""
        return int(isinstance(error, BrokenExecutor))

    def mend(self) -> None:
        """Start a new process in place of the dead one."""
        self.executor.stop()
        self.executor = OneWorker()

    def check(self) -> None:
        """There is always somebody: a dead process is replaced."""

    def stop(self) -> None:
        """End the process."""
        self.executor.stop()
