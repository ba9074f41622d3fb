"""Whether a file that nobody vouches for can be read at all: another process reads it first and may die of it.

The readers of HDF5 and of MATLAB 5 are C code that a damaged file may send into a loop, a crash or all of the memory.
This module is that process too: run as a program, it reads all of a file, with a limit of time and memory, and its
exit says whether that ends. What Python can say of damage in a value the next reader will find and say.
"""

import os
import signal
import struct
import subprocess
import sys
import zlib
from contextlib import suppress
from functools import partial
from pathlib import Path

import h5py

_LONGEST_S = 20.0  # by the clock: a disk may be slow
_LONGEST_CPU_S = 1  # of computing, where the system counts it: a small file takes 2 ms
_BYTES_PER_S = 10_000_000
_MEMORY = 1 << 30  # bytes, beside what the file has
_FULLY = 1 << 26  # bytes of packed numbers that are read; of more, only where they lie
_NO_MEMORY, _DAMAGED = 3, 4
"""Exit status of a process that met the limit of its memory, or Python's own word that the file's tree is damaged."""
_MATRIX, _COMPRESSED = 14, 15
_TYPES = frozenset({*range(1, 8), 9, *range(12, 19)})
"""Types of elements of MATLAB 5 files (MAT-File Format, table 1-1)."""


def fault_of(path: Path) -> str:
    """What reading this file does to a process; empty where it does nothing to it. 0.3 s."""
    command, quiet = [sys.executable, "-P", __file__, str(path)], subprocess.DEVNULL
    longest = _LONGEST_S + path.stat().st_size / _BYTES_PER_S
    try:
        done = subprocess.run(  # noqa: S603 - this interpreter, this file
            command, stdin=quiet, stdout=quiet, stderr=quiet, check=False, timeout=longest
        )
    except subprocess.TimeoutExpired:
        return "reading it does not end"
    return {
        0: "",
        _NO_MEMORY: "reading it takes far more memory than it holds",
        _DAMAGED: "its parts are not where it says",
        -getattr(signal, "SIGXCPU", signal.SIGTERM): "reading it does not end",
    }.get(done.returncode, "reading it ends the process")


def main(path: str) -> int:
    """Read all of a file; the exit status."""
    file = Path(path)
    with file.open("rb") as raw:
        is_hdf5 = b"\x89HDF\r\n\x1a\n" in raw.read(1024)
    _set_limits(file.stat().st_size)
    try:
        if is_hdf5:
            with h5py.File(path, "r", locking=False) as tree:
                _read_node("/", tree)
                tree.visititems(_read_node)
        elif _has_unknown_type(file.read_bytes()):
            return _DAMAGED
        else:
            from scipy.io import loadmat, whosmat  # noqa: PLC0415 - 0.2 s that HDF5 need not wait for

            whosmat(path)
            loadmat(path, squeeze_me=True, struct_as_record=True)
    except Exception as error:  # noqa: BLE001 - whatever it is, it is over
        return _NO_MEMORY if _is_of_memory(error) else _DAMAGED * is_hdf5
    return 0


def _set_limits(size: int) -> None:
    """Let this process have no more time and memory than the file can need, where the system knows such limits."""
    try:
        import resource  # noqa: PLC0415 - not on Windows
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    used = resource.getrusage(resource.RUSAGE_SELF)
    seconds = int(used.ru_utime + used.ru_stime + _LONGEST_CPU_S + size / _BYTES_PER_S) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.getrlimit(resource.RLIMIT_CPU)[1]))
    with suppress(OSError):  # only Linux says it there
        taken = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        most = taken + _MEMORY + 4 * size
        resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))


def _is_of_memory(error: Exception) -> bool:
    """Whether memory is given out, also where the library itself calls it so."""
    return isinstance(error, MemoryError) or "alloc" in str(error)


def _has_unknown_type(content: bytes) -> bool:
    """Whether an element of a MATLAB 5 file has a type that is none: SciPy looks it up behind the end of its table."""
    if 0 in content[:4]:  # version 4 has no such types
        return False
    order = ">" if content[126:128] == b"MI" else "<"
    parts = [content[128:]]
    while parts:
        part, at = parts.pop(), 0
        while at + 8 <= len(part):
            kind, size = struct.unpack_from(order + "2I", part, at)
            if kind >> 16:  # type, size and content in eight bytes
                kind, at = kind & 0xFFFF, at + 8
            else:
                inside, at = part[at + 8 : at + 8 + size], at + 8 + size
                if kind == _COMPRESSED:
                    with suppress(zlib.error):  # SciPy's own reader says so
                        parts.append(zlib.decompress(inside))
                    continue
                parts += [inside] if kind == _MATRIX else []
                at += -size % 8
            if kind not in _TYPES:
                return True
    return False


def _read_node(_name: str, node: h5py.Group | h5py.Dataset) -> None:
    """Read one node of a tree; a value that cannot be read is no damage of the tree."""
    steps = [partial(node.attrs.__getitem__, key) for key in list(node.attrs)]
    if isinstance(node, h5py.Dataset) and not node.is_virtual and not node.external:
        steps.append(partial(_read_values, node))
    for step in steps:
        try:
            step()
        except Exception as error:
            if _is_of_memory(error):
                raise


def _read_values(dataset: h5py.Dataset) -> None:
    if dataset.dtype.kind in "iufb" and (dataset.chunks is None or dataset.nbytes > _FULLY):
        dataset.id.get_num_chunks()
    elif dataset.nbytes <= _MEMORY // 4:
        dataset[()]


if __name__ == "__main__":
    os._exit(main(sys.argv[1]))
