"""Steady states of numeric laws at random over their usual ranges: what is found, how well energy closes, how long.

    python -m tests.benchmarks.numeric_random [COUNT] [SEED]

r from 0.05 to 3 and beta from 0.05 to 0.95 (both on a log scale), each law's parameters over their usual ranges; three
in ten have place, speed, the frame's dashpot, a wall that moves with the base, harmonics of some per cent.
"""

import sys
import time
from collections import Counter, defaultdict

import numpy as np

from frictionlab.errors import SimulationError
from frictionlab.simulator import Base, Problem
from frictionlab.simulator.laws import Law, law_of
from frictionlab.simulator.numeric import machine, steady

NUMERIC = ("stribeck", "logarithm", "dahl", "bouc-wen", "lugre", "rate-state")
SLOW = 0.5  # seconds


def drawn(law: Law, rng: np.random.Generator) -> dict[str, float]:
    """Parameters of a law, over their usual ranges."""
    found = {}
    for parameter in law.own[1:]:
        low, high = parameter.usual
        on_log = parameter.scale == "log"
        found[parameter.name] = float(np.exp(rng.uniform(*np.log((low, high)))) if on_log else rng.uniform(low, high))
    return found


def random_problem(rng: np.random.Generator) -> Problem:
    """One problem."""
    name = "coulomb+" + str(rng.choice(NUMERIC)) + "+place" * (rng.random() < 0.3) + "+speed" * (rng.random() < 0.3)
    law = law_of(name)
    moves = rng.random() < 0.3
    harmonics = 0.03 * rng.normal(size=4) * (rng.random() < 0.3)
    base = Base((1.0, *map(float, harmonics[:2])), (0.0, *map(float, harmonics[2:])))
    r, beta = np.exp(rng.uniform(np.log((0.05, 0.05)), np.log((3.0, 0.95))))
    frame = float(rng.uniform(0.0, 0.02) * (rng.random() < 0.3))
    return Problem(
        float(r),
        float(beta),
        wall="base" if moves else "fixed",
        base=base,
        law=law,
        parameters=drawn(law, rng),
        frame_damping_ratio=frame,
    )


def main(count: int, seed: int) -> None:
    """Draw, solve, print what is slow or not found, then the table."""
    machine.compiled()
    rng = np.random.default_rng(seed)
    outcomes: dict[str, Counter[str]] = defaultdict(Counter)
    times, closures = defaultdict(list), defaultdict(list)
    for _ in range(count):
        problem = random_problem(rng)
        name, begun = problem.law.terms[1].name, time.process_time()
        try:
            state = steady(problem)
            outcome = str(state.outcome)
            if outcome == "periodic" and state.energy_per_cycle and state.closure_error is not None:
                closures[name].append(state.closure_error / state.energy_per_cycle)
        except SimulationError as error:
            outcome = "friction turns negative" if "negative" in str(error) else "steps too short or too many"
        times[name].append(time.process_time() - begun)
        outcomes[name][outcome] += 1
        if outcome not in ("periodic", "stuck") or times[name][-1] > SLOW:
            print(f"# {times[name][-1]:.2f} s, {outcome}: r {problem.r:.4g}, {problem.wall}, {problem.law.name}")
    for name in NUMERIC:
        ms = 1e3 * np.array(times[name])
        print(
            f"{name:10s} median {np.median(ms):6.1f} ms, 9 of 10 below {np.quantile(ms, 0.9):6.1f} ms; closure: median "
            f"{np.median(closures[name]):.0e}, worst {max(closures[name]):.0e}; {dict(outcomes[name])}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300, int(sys.argv[2]) if len(sys.argv) > 2 else 1)
