"""Elastic contacts over random points: how many are solved, how far energies close, how fast; and one speed table.

python -m tests.benchmarks.elastic_study [POINTS]    # 10000 a law unless given; writes results/elastic_study.md
"""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from frictionlab.simulator import Base, Problem, engine
from frictionlab.simulator.elastic import engine as elastic
from frictionlab.simulator.kernel import layout

OUTCOMES = ("periodic", "stuck", "unbounded", "not found", "endless", "overfull", "runs away", "pulls")
LAWS = ("compliance", "compliance+place", "compliance+breakaway", "compliance+speed", "iwan", "iwan+place+speed")


def draw(law: str, rng: np.random.Generator) -> Problem:
    """One random problem of a law: r 0.05 to 10, kappa 0.01 to 1e4, both walls, half of them with harmonics."""
    parameters: dict[str, float] = {"stiffness_ratio": float(10 ** rng.uniform(-2, 4))}
    if "iwan" in law:
        parameters |= {"sliders": float(rng.integers(1, 13)), "chi": float(rng.uniform(-0.9, 0.0))}
        parameters["stiffness_ratio"] = float(10 ** rng.uniform(-1, 2.5))
    if "place" in law:
        parameters["gradient"] = float(rng.uniform(-0.2, 0.2))
    if "breakaway" in law:
        parameters |= {"static_ratio_up": float(rng.uniform(1, 1.5)), "static_ratio_down": float(rng.uniform(1, 1.5))}
    if "speed" in law:
        parameters["contact_damping_ratio"] = float(10 ** rng.uniform(-3, 0.5))
    base = Base() if rng.random() < 0.5 else Base((1.0, rng.uniform(-0.2, 0.2)), (0.0, 0.0, rng.uniform(-0.1, 0.1)))
    wall: Any = "fixed" if rng.random() < 0.5 else "base"
    frame = 0.0 if rng.random() < 0.5 else float(10 ** rng.uniform(-3, -1))
    r, beta = float(10 ** rng.uniform(-1.3, 1.0)), float(rng.uniform(0.02, 1.2))
    more: dict[str, Any] = {"wall": wall, "base": base, "frame_damping_ratio": frame}
    return Problem(r, beta, law=f"coulomb+{law}", parameters=parameters, **more)


def solve(machine: engine.Engine, problem: Problem) -> tuple[Any, float]:
    """The kernel's row of a problem, and its time in s."""
    rig, sliders, force = elastic.set_up(machine, problem)
    room = elastic.make_elastic_room(machine, problem, 200_000)
    row = machine.buffer((0.0,) * layout.ROW)
    begun = time.perf_counter()
    machine.kernel.steady_elastic(rig, sliders, force, room, row)
    return row, time.perf_counter() - begun


def study(law: str, points: int) -> tuple[str, list[str]]:
    """One line of the table, and the problems that were not solved."""
    rng, machine = np.random.default_rng(13), elastic.compiled()
    rows, times, unsolved = [], [], []
    for _ in range(points):
        problem = draw(law, rng)
        row, seconds = solve(machine, problem)
        rows.append(list(row))
        times.append(seconds)
        if row[layout.OUTCOME] in (3.0, 4.0, 5.0):
            what = f"{law}: {OUTCOMES[int(row[layout.OUTCOME])]}"
            unsolved.append(f"{what}: {problem.r} {problem.parameters} {problem.wall} {problem.base}")
    table = np.array(rows)
    found = table[:, layout.OUTCOME] == 0.0
    off = table[found, layout.CLOSURE] / table[found, layout.ENERGY]
    sums = [(name, int(np.sum(table[:, layout.OUTCOME] == i))) for i, name in enumerate(OUTCOMES)]
    counts = ", ".join(f"{name} {number}" for name, number in sums if number)
    worst = f"{np.nanmax(off):.0e} | {int(np.sum(off > 1e-11))}"
    return f"| {law} | {counts} | {worst} | {1e6 * np.median(times):.0f} | {1e3 * np.max(times):.0f} |", unsolved


def agree() -> None:
    """Plain and compiled kernels give the same bits; compiles once per machine."""
    for seed, law in enumerate(LAWS * 4):
        problem = draw(law, np.random.default_rng(seed))
        fast, slow = (solve(machine, problem)[0] for machine in (elastic.compiled(), elastic.plain()))
        np.testing.assert_array_equal(np.array(fast), np.array(slow))


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    agree()
    lines = [
        f"# {count} random points a law: `python -m tests.benchmarks.elastic_study {count}`\n",
        "| law | outcomes | worst closure over energy | above 1e-11 | median, us | longest, ms |",
        "|---|---|---|---|---|---|",
    ]
    for name in LAWS:
        line, left = study(name, count)
        lines.append(line)
        sys.stdout.write("\n".join([line, *left]) + "\n")
        sys.stdout.flush()
        (Path(__file__).parent / "results" / "elastic_study.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
