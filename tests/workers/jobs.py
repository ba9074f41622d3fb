"""Jobs for the tests: workers import them by name, so they stand in a module of their own."""

import math
import os
import resource
import signal
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def wave(case: int) -> float:
    """A number whose last bits tell whether anything was computed otherwise."""
    return math.sin(case) / (case + 0.1)


def waves(cases: Sequence[int]) -> NDArray[np.float64]:
    """As an array with one row per case."""
    return np.array([(wave(case), float(case)) for case in cases])


def slow_wave(case: int) -> float:
    time.sleep(0.002)
    return wave(case)


def wave_unless_shot(case: int, shot: int, mark: Path) -> float:
    """Shoot the worker once, at this case: as `kill -9` from outside would, but at a known moment."""
    if case == shot and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return slow_wave(case)


def wave_or_death(case: int, deadly: int) -> float:
    """Die over this case however often it is tried."""
    if case == deadly:
        os.kill(os.getpid(), signal.SIGKILL)
    return wave(case)


def wave_or_error(case: int, wrong: int) -> float:
    if case == wrong:
        raise ArithmeticError(f"case {case}")
    return wave(case)


def one_too_few(cases: Sequence[int]) -> list[float]:
    return [wave(case) for case in cases[1:]]


def who(_: int) -> int:
    time.sleep(0.05)
    return os.getpid()


def threads(_: int) -> str:
    return os.environ.get("OMP_NUM_THREADS", "")


def pages_fetched(_: int) -> float:
    """Pages that this process fetches from the system for twenty arrays of 1 MB made and dropped, ten times."""
    for _ in range(3):
        _twenty_arrays()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(10):
        _twenty_arrays()
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)


def _twenty_arrays() -> None:
    arrays = [np.ones(125_000) for _ in range(20)]
    arrays.clear()


def note_and_wait(case: int, folder: Path) -> int:
    """Leave the worker's number in a file, then work for a long time."""
    (folder / f"{os.getpid()}").touch()
    time.sleep(0.01 if case < 4 else 600)
    return case
