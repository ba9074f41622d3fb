"""What a process of ours is set to before the work: one thread, freed memory kept, garbage looked for rarely.

Linear algebra on several threads sums in another order: the last digits of a frequency changed with the number of
cores. It was no faster either; several inputs at once are what the cores are for (`frictionlab.workers`).
"""

import atexit
import ctypes
import gc
import os

VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # <malloc.h>


def use_one_thread() -> None:
    """Tell libraries that are not loaded yet to use one thread: call it before they are."""
    os.environ.update(dict.fromkeys(VARIABLES, "1"))


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
