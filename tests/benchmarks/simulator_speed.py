"""How much faster, at which error: the exact simulator against the thesis's method and against heyoka.

    python -m tests.benchmarks.simulator_speed

Ratios of times taken in one run on one machine; the error stands beside each time. Start-up (loading compiled code) is
apart. The thesis's method is timed on a sample of points of its own map, r = 0.02:2.5:0.01 x beta = 0.1:0.9:0.1.
"""

import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from math import cos, sin
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numba
import numpy as np

from frictionlab.maps import Grid, make_map
from frictionlab.simulator import Problem, engine, last_cycle, steady_state, sweep
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.sweep import Family, sweep_points
from tests.simulator import peer

RATIOS = [round(0.02 + 0.01 * i, 2) for i in range(249)]
BETAS = [round(0.1 * i, 1) for i in range(1, 10)]
LANES = 24  # points of the map on which the thesis's method is timed
REPEATS = 5


def seconds(work: Any, clock: Callable[[], float] = time.process_time) -> float:
    """Shortest of some runs; of the processor's time, because other work may share the cores."""
    times = []
    for _ in range(REPEATS):
        start = clock()
        work()
        times.append(clock() - start)
    return min(times)


def map_points() -> np.ndarray:
    """The points of the thesis's map."""
    return np.array([(r, beta, 1.0, 0.0) for r in RATIOS for beta in BETAS])


def on_two_cores(points: np.ndarray) -> None:
    """The map on two cores: the compiled kernel lets go of the interpreter's lock, so that threads do."""
    chunks = [points[i::16] for i in range(16)]
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda chunk: sweep_points(chunk, Family(), fast=True), chunks))


def written_map(folder: Path, shares: int = 1) -> int:
    """The map solved by one process and written, each step of r in so many shares; the number of points."""
    ratios = tuple(float(r) for r in np.linspace(RATIOS[0], RATIOS[-1], shares * (len(RATIOS) - 1) + 1))
    grid = Grid(ratios, tuple(BETAS))
    for _ in make_map(grid, folder / "map.h5", workers=1, force=True):
        pass
    return len(grid)


def map_error() -> float:
    """Largest relative error of the map's energies, against orbits solved by shooting alone."""
    energies = sweep(RATIOS, BETAS).column(layout.ENERGY)[:, :, 0, 0]
    worst = 0.0
    rng = np.random.default_rng(1)
    for i, j in zip(rng.integers(0, 249, 200), rng.integers(0, 9, 200), strict=True):
        exact = steady_state(Problem(RATIOS[i], BETAS[j]), solver="exact").energy_per_cycle
        worst = max(worst, abs(energies[i, j] / exact - 1.0)) if exact else worst
    return worst


def thesis_lanes() -> tuple[float, float]:
    """Mean seconds per point of the thesis's method at default tolerances, and its median relative error."""
    rng, times, errors = np.random.default_rng(2), [], []
    for _ in range(LANES):
        problem = Problem(float(rng.choice(RATIOS)), float(rng.choice(BETAS)))
        exact = steady_state(problem).energy_per_cycle
        start = time.process_time()
        state = last_cycle(problem, cycles=100, solver="thesis")
        times.append(time.process_time() - start)
        if exact and state.energy_per_cycle:
            errors.append(abs(state.energy_per_cycle / exact - 1.0))
    return float(np.mean(times)), float(np.median(errors))


def one_state() -> float:
    """Seconds of one steady state at r = 0.5, beta = 0.4, by the compiled kernel alone."""
    fast, problem = engine.compiled(), Problem(0.5, 0.4)
    rig, force = engine.set_up(fast, problem)
    room, row = engine.make_room(fast, problem, 64), fast.buffer((0.0,) * layout.ROW)
    return seconds(lambda: [fast.kernel.steady(rig, force, 0, room, row) for _ in range(100)]) / 100


def heyoka_cycles() -> tuple[float, float] | None:
    """Seconds and relative error of heyoka's 100 cycles at the same point; None where it is not installed."""
    if find_spec("heyoka") is None:
        return None
    sides = peer.integrators(0.5, 0.4)
    exact = steady_state(Problem(0.5, 0.4)).energy_per_cycle or 1.0
    taken = seconds(lambda: peer.run(0.5, 0.4, 100, sides))
    return taken, abs(peer.run(0.5, 0.4, 100, sides).energy / exact - 1.0)


def limit() -> tuple[float, float]:
    """Evaluations per point the map cannot do without, and the seconds of one sincos pair in compiled code."""

    def in_python(count: int) -> float:
        total = 0.0
        for i in range(count):
            total += sin(1e-3 * i) * cos(1e-3 * i)
        return total

    pairs: Any = numba.njit(in_python)
    pairs(1)
    pair = seconds(lambda: pairs(1_000_000)) / 1e6
    return 1.0 + 2.0 * float(np.nanmean(sweep(RATIOS, BETAS).column(layout.STOPS))), pair


def tell(line: str) -> None:
    """Print a line."""
    sys.stdout.write(line + "\n")


def main() -> None:
    """Measure and print."""
    start = time.perf_counter()
    engine.compiled()
    sweep([0.5], [0.4])
    tell(f"start-up (loading, or compiling once)       {time.perf_counter() - start:10.3f} s")
    points = map_points()
    one = seconds(lambda: sweep_points(points, Family(), fast=True))
    two = seconds(lambda: on_two_cores(points), time.perf_counter)
    with TemporaryDirectory() as name:
        written = seconds(lambda: written_map(Path(name)))
        many, finer = written_map(Path(name), 10), seconds(lambda: written_map(Path(name), 10))
    thesis, error = thesis_lanes()
    tell(f"map of {len(points)} steady states, one core      {one:10.4f} s   relative error {map_error():.0e}")
    tell(f"the same, two cores, by the clock           {two:10.4f} s")
    tell(f"the same, one core, written to a file       {written:10.4f} s")
    tell(f"map of {many} steady states, written         {finer:10.4f} s")
    tell(f"thesis's method, one point                  {thesis:10.4f} s   median error {error:.0e}")
    tell(f"thesis's map over this map, both on one core   {thesis * len(points) / one:10.0f} times")
    tell(f"thesis's map (one core) over this map (two)    {thesis * len(points) / two:10.0f} times")
    tell(f"thesis's map over this one, written            {thesis * len(points) / written:10.0f} times")
    tell(f"thesis's finer map over this one, written      {thesis * many / finer:10.0f} times")
    state, theirs = one_state(), heyoka_cycles()
    tell(f"one steady state, r = 0.5, beta = 0.4       {state * 1e6:10.1f} us")
    if theirs is not None:
        tell(f"heyoka, 100 cycles of it                    {theirs[0] * 1e6:10.1f} us  relative error {theirs[1]:.0e}")
        tell(f"heyoka's 100 cycles over one steady state   {theirs[0] / state:10.1f} times")
    needed, pair = limit()
    above = one / len(points) / (needed * pair)
    tell(f"limit: {needed:.1f} sincos pairs a point at {pair * 1e9:.0f} ns; the map takes {above:.0f} times that")


if __name__ == "__main__":
    main()
