"""Steady states of the numeric laws against 100 cycles by scipy's fastest solver of the same error, law by law.

    python -m tests.benchmarks.numeric_speed

One core, processor time. The orbit by `steady` at its default is timed compiled; scipy (DOP853, Radau, LSODA, the
right-hand side in Python, stops by events) starts on the orbit and is timed over one cycle, times 100, at the loosest
tolerance whose error in the energy of that cycle is no larger than ours, or than 1e-8 if that is more. Its 100 cycles
would still not be settled. Truth: `steady` at rtol 1e-12, which scipy's DOP853 at 1e-13 confirms.
"""

import time
import warnings
from collections.abc import Callable

import numpy as np

from frictionlab.simulator import Problem
from frictionlab.simulator.numeric import NumericMotion, machine, steady
from tests.simulator.numeric_oracle import LAWS, cycle

METHODS = ("DOP853", "Radau", "LSODA")
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
GOOD = 1e-8


def seconds_of(work: Callable[[], object], laps: int) -> float:
    """Shortest processor time of several runs."""
    times = []
    for _ in range(laps):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return min(times)


def by_scipy(problem: Problem, start: np.ndarray, truth: float, wanted: float) -> tuple[float, str, float]:
    """Seconds of a cycle, method and error of scipy's fastest run that is good enough."""
    runs = []
    for method in METHODS:
        for rtol in TOLERANCES:
            begun = time.process_time()
            error = abs(float(cycle(problem, start, method=method, rtol=rtol)[-1]) / truth - 1.0)
            spent = time.process_time() - begun
            if error <= wanted:
                runs.append((spent, f"{method} {rtol:.0e}", error))
                break
    return min(runs, default=(float("nan"), "none", float("nan")))


def compare(law: str, r: float, beta: float) -> str:
    """One line of the table."""
    problem = Problem(r, beta, law=law, parameters=LAWS[law])
    tight, found = steady(problem, rtol=1e-12), steady(problem)
    assert tight.energy_per_cycle is not None
    assert found.energy_per_cycle is not None
    assert isinstance(tight.orbit, NumericMotion)
    error = abs(found.energy_per_cycle / tight.energy_per_cycle - 1.0)
    ours, near = seconds_of(lambda: steady(problem), 5), seconds_of(lambda: steady(problem, near=found), 5)
    size = (3 if problem.law.kind == "inner" else 2) + (law == "coulomb+rate-state")
    start = tight.orbit.state(0.0)[:size] * np.array([1.0, 1.0, 1.0, beta])[:size]
    spent, method, off = by_scipy(problem, start, tight.energy_per_cycle, max(error, GOOD))
    return (
        f"{law:20s} r {r:.1f} {1e3 * ours:8.1f} {1e3 * near:8.1f} {error:8.0e}   {method:12s} {off:8.0e} "
        f"{100.0 * spent:8.1f} {100.0 * spent / ours:8.0f}"
    )


def main() -> None:
    """Print the table."""
    begun = time.process_time()
    machine.compiled()
    steady(Problem(0.5, 0.4))
    print(f"loading or compiling the kernel: {time.process_time() - begun:.1f} s")
    print("law                        steady  from a    error   scipy, 100 cycles             times")
    print("                           ms      neighbour                       error        s    as long")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        for law in LAWS:
            for r, beta in ((0.3, 0.6), (0.7, 0.5)):
                print(compare(law, r, beta), flush=True)


if __name__ == "__main__":
    main()
