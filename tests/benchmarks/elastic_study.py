"""Elastic contacts over random points: how many are solved, how far energies close, how long beside the rigid law.

    python -m tests.benchmarks.elastic_study [POINTS] [SEED] [LAW ...]

10000 points a law and seed 13 unless given; the table goes to results/elastic_study.md.
"""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from frictionlab.simulator import Base, Problem, engine
from frictionlab.simulator.elastic import engine as elastic
from frictionlab.simulator.kernel import layout

OUTCOMES = (
    *(
        "periodic",
        "stuck",
        "unbounded",
        "not found",
        "endless",
        "runs away",
        "pulls",
        "does not repeat",
        "given up",
        "full",
    ),
)
TERMS = ("", "+place", "+speed", "+breakaway", "+place+speed+breakaway")
LAWS = tuple(kind + terms for kind in ("compliance", "iwan") for terms in TERMS)
REFERENCE = Path(__file__).parent / "results" / "elastic_study.md"


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


def solve(machine: engine.Engine, problem: Problem, phases: int = 4000) -> tuple[Any, float]:
    """The kernel's row of a problem, and its processor time in s: the lesser of two."""
    spent = np.inf
    for _ in range(2):
        rig, sliders, force = elastic.set_up(machine, problem)
        room = elastic.make_elastic_room(machine, problem, phases)
        row = machine.buffer((0.0,) * layout.ROW)
        begun = time.process_time()
        machine.kernel.steady_elastic(rig, sliders, force, room, row)
        spent = min(spent, time.process_time() - begun)
    more = int(room.tally[layout.PHASES])
    return solve(machine, problem, more) if row[layout.OUTCOME] == layout.OVERFULL else (row, spent)


def rigid_time(machine: engine.Engine, problem: Problem) -> tuple[float, bool]:
    """Processor time in s of the same problem under the rigid contact, without the elastic term; whether it moves."""
    law = "+".join(term for term in problem.law.name.split("+") if term not in ("compliance", "iwan"))
    kept = {k: v for k, v in problem.parameters.items() if k not in ("stiffness_ratio", "sliders", "chi", "beta")}
    more: dict[str, Any] = {"frame_damping_ratio": kept.pop("frame_damping_ratio", 0.0)}
    more |= {"wall": problem.wall, "base": problem.base}
    rigid = Problem(problem.r, problem.beta, law=law, parameters=kept, **more)
    spent = np.inf
    for _ in range(2):
        rig, force = engine.set_up(machine, rigid)
        room, row = engine.make_room(machine, rigid, 4000), machine.buffer((0.0,) * layout.ROW)
        begun = time.process_time()
        machine.kernel.steady(rig, force, 0, room, row)
        spent = min(spent, time.process_time() - begun)
    return spent, bool(row[layout.OUTCOME] != layout.STUCK)


def ratios(spent: Any, rigid: Any) -> str:
    """Median, 95 % and sum over sum of times over the rigid law's."""
    median, most = np.quantile(spent / rigid, (0.5, 0.95))
    return f"{len(spent)} | {median:.1f} | {most:.1f} | {np.sum(spent) / np.sum(rigid):.1f}"


def study(law: str, points: int, seed: int) -> tuple[str, list[str]]:
    """One line of the table, and the problems that were not solved."""
    rng, machine = np.random.default_rng(seed), elastic.compiled()
    rows, times, beside, unsolved = [], [], [], []
    for _ in range(points):
        problem = draw(law, rng)
        row, seconds = solve(machine, problem)
        rows.append(list(row))
        times.append(seconds)
        beside.append(rigid_time(machine, problem) if row[layout.OUTCOME] == layout.PERIODIC else (np.nan, False))
        if row[layout.OUTCOME] in (3.0, 4.0, 8.0, 9.0):
            what = f"{law}: {OUTCOMES[int(row[layout.OUTCOME])]}"
            unsolved.append(f"{what}: {problem.r} {problem.parameters} {problem.wall} {problem.base}")
    table, spent, rigid = np.array(rows), np.array(times), np.array([seconds for seconds, _ in beside])
    found, moves = table[:, layout.OUTCOME] == 0.0, np.array([both for _, both in beside])
    off = table[found, layout.CLOSURE] / table[found, layout.ENERGY]
    sums = [(name, int(np.sum(table[:, layout.OUTCOME] == i))) for i, name in enumerate(OUTCOMES)]
    counts = ", ".join(f"{name} {number}" for name, number in sums if number)
    worst = f"{np.nanmax(off):.0e} | {int(np.sum(off > 1e-11))}"
    took = f"{1e6 * np.median(spent[found]):.0f} | {1e3 * np.max(spent):.0f}"
    compared = f"{ratios(spent[moves], rigid[moves])} | {ratios(spent[found], rigid[found])}"
    return f"| {law} | {counts} | {worst} | {took} | {compared} |", unsolved


def agree() -> None:
    """Plain and compiled kernels give the same bits; compiles once per machine."""
    for seed, law in enumerate(LAWS * 4):
        problem = draw(law, np.random.default_rng(seed))
        fast, slow = (solve(machine, problem)[0] for machine in (elastic.compiled(), elastic.plain()))
        np.testing.assert_array_equal(np.array(fast), np.array(slow))


def main(count: int, seed: int, laws: tuple[str, ...]) -> None:
    """Study the laws and write the table."""
    agree()
    rigid_time(elastic.compiled(), draw("compliance", np.random.default_rng(0)))  # compiles
    lines = [
        f"# {count} random points a law: `python -m tests.benchmarks.elastic_study {count} {seed}`\n",
        (
            "Processor time, the lesser of two; ratios to the same problem under the rigid law, periodic ones only. "
            "First where the rigid contact moves, too; then all: at rest it takes no search. `in all`: sum over sum.\n"
        ),
        (
            "| law | outcomes | worst closure over energy | above 1e-11 | median, us | longest, ms "
            "| rigid moves: points | median | 95 % below | in all | all: points | median | 95 % below | in all |"
        ),
        "|" + "---|" * 14,
    ]
    for name in laws:
        line, left = study(name, count, seed)
        lines.append(line)
        sys.stdout.write("\n".join([line, *left]) + "\n")
        sys.stdout.flush()
        REFERENCE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:] if word.isdigit()]
    points, start = (*given, *(10_000, 13)[len(given) :])
    main(points, start, tuple(sys.argv[1 + len(given) :]) or LAWS)
