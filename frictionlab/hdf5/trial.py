"""Files that nobody vouches for are read by another process first, which may die of it.

The readers of HDF5 and of MATLAB 5 are C code that a damaged file may send into a loop, a crash or all of the memory.
This module is that process too: run as a program, it reads all of a file, with a limit of time and memory, and its
exit says whether that ends. An HDF5 file is then opened here, and what Python can say of damage in a value the next
reader will find and say; what is in a MATLAB file comes from there.
"""

import math
import os
import pickle
import signal
import subprocess
import sys
import warnings
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import h5py

_LONGEST_S = 20.0  # by the clock: a disk may be slow
_LONGEST_CPU_S = 1  # of computing, where the system counts it: a small file takes 2 ms
_BYTES_PER_S = 10_000_000
_MEMORY = 1 << 30  # bytes, beside what the file has
_FULLY = 1 << 26  # bytes of packed numbers that are read; of more, only where they lie
_NO_MEMORY, _DAMAGED = 3, 4
"""Exit status of a process that met the limit of its memory, or Python's own word that the file's tree is damaged."""
_MATLAB_READ = ("double", "single", "logical", "struct", "cell", "int", "uint")
"""Beginnings of the kinds of MATLAB's variables, as scipy calls them, that are read: others hold no vector."""


def tried(path: Path) -> tuple[str, bytes]:
    """What reading this file does to a process, "" for nothing, and what of a MATLAB file it hands over. 0.3 s."""
    command, quiet = [sys.executable, "-P", __file__, str(path)], subprocess.DEVNULL
    longest = _LONGEST_S + path.stat().st_size / _BYTES_PER_S
    try:
        done = subprocess.run(  # noqa: S603 - this interpreter, this file
            command, stdin=quiet, stdout=subprocess.PIPE, stderr=quiet, check=False, timeout=longest
        )
    except subprocess.TimeoutExpired:
        return "reading it does not end", b""
    faults = {
        0: "",
        _NO_MEMORY: "reading it takes far more memory than it holds",
        _DAMAGED: "its parts are not where it says",
        -getattr(signal, "SIGXCPU", signal.SIGTERM): "reading it does not end",
    }
    return faults.get(done.returncode, "reading it ends the process"), done.stdout


def main(path: str, output: int = 1) -> int:
    """Read all of a file, that of MATLAB into the file descriptor ``output``; the exit status."""
    file = Path(path)
    with file.open("rb") as raw:
        is_hdf5 = b"\x89HDF\r\n\x1a\n" in raw.read(1024)
    _set_limits(file.stat().st_size)
    try:
        if is_hdf5:
            with h5py.File(path, "r", locking=False) as tree:
                _read_node("/", tree)
                tree.visititems(_read_node)
        else:
            with os.fdopen(output, "wb", closefd=False) as pipe:
                pickle.dump(_matlab(path), pipe)
    except Exception as error:  # noqa: BLE001 - whatever it is, it is over
        return _NO_MEMORY if _is_of_memory(error) else _DAMAGED
    return 0


def _matlab(path: str) -> tuple[dict[str, Any] | None, str]:
    """The variables that may hold vectors, by name, and all with their kinds in words; or None and what is wrong."""
    from scipy.io import loadmat, whosmat  # noqa: PLC0415 - 0.2 s that HDF5 need not wait for

    warnings.simplefilter("ignore")  # duplicate names, objects it passes over
    try:
        listed = whosmat(path)
        wanted = [name for name, _, kind in listed if kind.startswith(_MATLAB_READ)]
        if 8 * sum(math.prod(shape) for _, shape, _ in listed) <= _MEMORY + 4 * Path(path).stat().st_size:
            found = loadmat(path, simplify_cells=True, variable_names=wanted)
            content = {name: value for name, value in found.items() if not name.startswith("__")}
            return content, ", ".join(f"{name} ({kind})" for name, _, kind in listed)
    except Exception as error:
        if not _is_of_memory(error):
            return None, f"{type(error).__name__}: {error}"
        raise
    raise MemoryError


def _set_limits(size: int) -> None:
    """Let this process have no more time and memory than the file can need, where the system knows such limits."""
    try:
        import resource
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
