"""Read files as somebody who may die of it: run by `frictionlab.hdf5.trial` as a program of its own.

It hears a path and a size a line and answers what is wrong with the file, an empty text where nothing is. Where the
HDF5 library loops or crashes, it dies, and its silence is the answer. It imports nothing of the package: it shall start
fast.
"""

import faulthandler
import json
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py

TOO_LONG = 1
"""Exit status after the time was up."""
_LONGEST_S = 20.0  # by the clock: a disk may be slow
_LONGEST_CPU_S = 0.5  # of computing, where the system counts it: a small file takes 2 ms
_BYTES_PER_S = 10_000_000
_ROOM = 1 << 30  # bytes of memory, beside what the file has
_ASKED_FOR = (
    *("units", "format", "format_version", "identity", "MATLAB_class", "MATLAB_empty"),
    *("files", "sha256", "size_bytes"),
)
"""Attributes that are read by their name, which may kill where going through all of them ends in a sentence."""
_FULLY = 1 << 26  # bytes of packed numbers that are read; of more, only where they lie


def main() -> None:
    """Answer until nobody asks any more."""
    with Path(os.devnull).open("w", encoding="ascii") as silent:
        for line in sys.stdin:
            path, size = json.loads(line)
            faulthandler.dump_traceback_later(_LONGEST_S + size / _BYTES_PER_S, exit=True, file=silent)
            _count_down(_LONGEST_CPU_S + size / _BYTES_PER_S)
            fault = _fault_of(path, size)
            _count_down(0.0)
            faulthandler.cancel_dump_traceback_later()
            sys.stdout.write(json.dumps(fault) + "\n")
            sys.stdout.flush()


def _fault_of(path: str, size: int) -> str:
    """What is wrong with a file beyond what an exception tells, which whoever opens it next will see too."""
    _bound(size)
    try:
        _try(lambda: _read(path))
    except MemoryError:
        return "reading it takes far more memory than it holds"
    return ""


def _count_down(seconds: float) -> None:
    """End this process after so much computing, where the system counts it; 0: not at all."""
    if hasattr(signal, "setitimer"):  # not on Windows
        signal.signal(signal.SIGPROF, signal.SIG_DFL)  # whatever the master ignores
        signal.setitimer(signal.ITIMER_PROF, seconds)


def _bound(size: int) -> None:
    """Let this process have no more memory than the file can need, where the system knows such a limit."""
    try:
        import resource  # noqa: PLC0415 - not on Windows
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with suppress(OSError):  # only Linux tells it there
        used = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + _ROOM + 4 * size, resource.getrlimit(resource.RLIMIT_AS)[1]))


def _try(step: Callable[[], object]) -> None:
    """Do it; what Python can say of it the next reader will find and say, but for memory that is given out."""
    try:
        step()
    except MemoryError:
        raise
    except Exception as error:
        if "alloc" in str(error):  # as the library itself calls memory that it did not get
            raise MemoryError from error


def _read(path: str) -> None:
    with h5py.File(path, "r", locking=False) as file:
        _walk(file, set())


def _walk(node: Any, seen: set[int]) -> None:
    """Read a node and what is in it, name by name: `h5py.Group.visit` ends at the first damage."""
    _try(lambda: _read_node(node))
    names: list[str] = []
    if isinstance(node, h5py.Group):
        _try(lambda: names.extend(node))
    for name in names:
        _try(lambda at=name: _enter(node, at, seen))  # type: ignore[misc] # mypy takes no default for an argument


def _enter(group: Any, name: str, seen: set[int]) -> None:
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        return
    node = group[name]
    at = h5py.h5o.get_info(node.id).addr
    if at not in seen:
        seen.add(at)
        _walk(node, seen)


def _read_node(node: Any) -> None:
    keys = list(_ASKED_FOR)
    _try(lambda: keys.extend(node.attrs))
    for key in keys:
        _try(lambda at=key: node.attrs.get(at))  # type: ignore[misc] # as above
    if not isinstance(node, h5py.Dataset) or node.is_virtual or node.external:
        return
    is_plain = node.dtype.kind in "iufb"
    if is_plain and (node.chunks is None or node.nbytes > _FULLY):
        _try(node.id.get_num_chunks)
    elif node.nbytes <= _ROOM // 4:
        _try(lambda: node[()])


if __name__ == "__main__":
    main()
