"""One thread per process, so that a number does not depend on how many cores a machine has.

Linear algebra on several threads sums in another order: the last digits of a frequency changed with the number of
cores. It was no faster either; several inputs at once are what the cores are for (`frictionlab.workers`).
"""

import os

VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def use_one_thread() -> None:
    """Tell libraries that are not loaded yet to use one thread: call it before they are."""
    os.environ.update(dict.fromkeys(VARIABLES, "1"))
