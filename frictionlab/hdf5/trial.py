"""Whether a file without a seal can be read at all: another process reads it first and may die of it.

That process is started for the first such file (0.2 s) and asked about each (1 to 3 ms). It ends itself when a file
takes it too long, by a thread of the interpreter's own that no loop in C holds up, on every system alike, whether this
process still lives or not.
"""

import atexit
import json
import os
import signal
import subprocess
import sys
from functools import lru_cache
from pathlib import Path
from threading import Lock

from frictionlab.errors import RecordingError
from frictionlab.hdf5 import twin

_LOCK = Lock()


def check_survivable(path: Path) -> None:
    """Raise `RecordingError` if reading this file does not end, ends the process, or takes too much memory."""
    state = path.stat()
    fault = _fault(str(path.absolute()), state.st_size, (state.st_dev, state.st_ino, state.st_mtime_ns))
    if fault:
        raise RecordingError(f"damaged: {fault}")


@lru_cache(maxsize=256)
def _fault(path: str, size: int, _state: tuple[int, ...]) -> str:
    """What reading this file does to a process; empty where it does nothing to it."""
    with _LOCK:
        return _Twin.running().try_on(path, size)


class _Twin:
    """The process that reads first."""

    _one: "_Twin | None" = None

    def __init__(self) -> None:
        self._owner = os.getpid()
        command = [sys.executable, "-P", str(Path(twin.__file__))]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL)  # noqa: S603 - this interpreter, a file of this package
        atexit.register(self._stop)

    @classmethod
    def running(cls) -> "_Twin":
        """The one of this process, started if there is none: a forked child has its own."""
        if cls._one is None or cls._one._owner != os.getpid() or cls._one._process.poll() is not None:  # noqa: SLF001 - its own
            cls._one = cls()
        return cls._one

    def try_on(self, path: str, size: int) -> str:
        """What the file did to it."""
        process = self._process
        assert process.stdin is not None  # noqa: S101 - opened above
        assert process.stdout is not None  # noqa: S101
        try:
            process.stdin.write(json.dumps([path, size]).encode() + b"\n")
            process.stdin.flush()
            answer = process.stdout.readline()
        except OSError:  # it died before it could hear
            answer = b""
        if answer.endswith(b"\n"):
            return str(json.loads(answer))
        self._stop()
        late = process.returncode in (twin.TOO_LONG, -getattr(signal, "SIGPROF", signal.SIGTERM))
        return "reading it does not end" if late else "reading it ends the process"

    def _stop(self) -> None:
        """Let it leave; it does when nobody can ask any more."""
        atexit.unregister(self._stop)
        if self._owner != os.getpid():
            return
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                try:
                    stream.close()
                except OSError:  # what was to be told to the dead
                    continue
        self._process.wait()
