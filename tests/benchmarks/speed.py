"""How long the package's public functions take, of this build or of another one, with their errors where known.

    python -m tests.benchmarks.speed [TASK ...]
    OTHER_BUILD/.venv/bin/python tests/benchmarks/speed.py    # the same tasks by another build, to compare

Processor time of one core, the shortest of several runs, after loading or compiling (printed apart). Start-up of a
command and logs are by the clock, in processes of their own; before each log as much memory as any of them needs is
touched, for a virtual machine that fetches it back from its host takes longer than the work.
"""

import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

import frictionlab as fl
from frictionlab.simulator import steady_state, sweep
from frictionlab.simulator.record import BaseRecord, respond
from frictionlab.simulator.sweep import warm_up

ROOT = Path(__file__).parents[2]
LOG, SCENE = ROOT / "sample_data" / "steel_N1.25_r0.3.csv", ROOT / "configs" / "sample_data.toml"
NATURAL_HZ, BASE_M = 3.13, 1.8e-3
HEADER, ROWS = "time [s],mass [mm],base [mm]\n", 2_700_000
TOUCH = "import numpy; numpy.empty(800_000_000, numpy.uint8)[::4096] = 1"
RATIOS, BETAS = [round(0.02 + 0.01 * i, 2) for i in range(249)], [round(0.1 * i, 1) for i in range(1, 10)]
CONTACT = {"stiffness_ratio": 50.0}
STRIBECK = {"static_ratio": 1.4, "stribeck_speed": 0.2}
SLIDERS = {"stiffness_ratio": 12.0, "sliders": 8, "chi": -0.4}
RATE_STATE = CONTACT | {"direct_effect": 0.06, "evolution_effect": 0.03, "slip_distance": 0.02, "reference_speed": 0.1}
STATES = {
    "coulomb": fl.Problem(0.5, 0.4),
    "coulomb+compliance": fl.Problem(0.5, 0.4, law="coulomb+compliance", parameters=CONTACT),
    "coulomb+iwan, 8 sliders": fl.Problem(0.5, 0.4, law="coulomb+iwan", parameters=SLIDERS),
    "coulomb+stribeck": fl.Problem(0.3, 0.6, law="coulomb+stribeck", parameters=STRIBECK),
    "coulomb+dahl": fl.Problem(0.3, 0.6, law="coulomb+dahl", parameters=CONTACT),
    "coulomb+lugre": fl.Problem(
        0.3, 0.6, law="coulomb+lugre", parameters=CONTACT | STRIBECK | {"bristle_damping": 0.1}
    ),
    "coulomb+rate-state": fl.Problem(0.3, 0.6, law="coulomb+rate-state", parameters=RATE_STATE),
}


def seconds(work: Callable[[], object], repeats: int = 5, clock: Callable[[], float] = time.process_time) -> float:
    """Shortest of some runs, after one that loads or compiles."""
    times = []
    work()
    for _ in range(repeats):
        begun = clock()
        work()
        times.append(clock() - begun)
    return min(times)


def tell(what: str, taken: float, note: str = "") -> None:
    """Print one line."""
    sys.stdout.write(f"{what:46s} {1e3 * taken:10.3f} ms  {note}\n")
    sys.stdout.flush()


def start_up() -> None:
    """Commands by the clock, of a process of their own."""
    for words in (["--version"], ["analyze", "--help"], ["compare-numeric", str(LOG), "--scene", str(SCENE)]):
        command = [sys.executable, "-m", "frictionlab", *words]
        run = partial(subprocess.run, command, cwd=ROOT, check=True, capture_output=True)
        tell(f"frictionlab {words[0]}", seconds(run, 3, time.perf_counter))


def states() -> None:
    """Steady states one by one, by default settings."""
    for name, problem in STATES.items():
        count = 100 if problem.r == 0.5 else 3

        def many(problem: fl.Problem = problem, count: int = count) -> None:
            for _ in range(count):
                steady_state(problem)

        tell(f"steady state, {name}", seconds(many) / count)


def maps() -> None:
    """The thesis's map, and the largest error of 100 of its energies against orbits solved by shooting alone."""
    energies, worst, rng = sweep(RATIOS, BETAS).datasets()["energy_per_cycle"], 0.0, np.random.default_rng(1)
    for i, j in zip(rng.integers(0, len(RATIOS), 100), rng.integers(0, len(BETAS), 100), strict=True):
        exact = steady_state(fl.Problem(RATIOS[i], BETAS[j]), solver="exact").energy_per_cycle
        worst = max(worst, abs(float(energies[i, j].squeeze()) / exact - 1.0)) if exact else worst
    taken = seconds(lambda: sweep(RATIOS, BETAS))
    tell(f"map of {len(RATIOS) * len(BETAS)} rigid steady states", taken, f"relative error {worst:.0e}")


def records() -> None:
    """A base sampled 24,000 times: twelve tones between 0.2 and 2 Hz at 1 kHz."""
    tones = np.random.default_rng(7).uniform([0.3, 0.2, 0.0], [1.0, 2.0, 2 * math.pi], (12, 3))
    t = np.arange(24_000) / 1000.0
    base = BaseRecord(2 * math.pi * t, np.sin(np.outer(t, 2 * math.pi * tones[:, 1]) + tones[:, 2]) @ tones[:, 0])
    for law, parameters in (("coulomb", {}), ("coulomb+compliance", CONTACT), ("coulomb+stribeck", STRIBECK)):
        problem = fl.Problem(1.0, 0.12, law=law, parameters=parameters)
        tell(f"response to 24,000 samples, {law}", seconds(partial(respond, problem, base), 3))


def logs() -> None:
    """Two logs of 2.7 million rows (84 MB), one plain and one with decimal commas, TABs and cp1252, beside pandas."""
    with tempfile.TemporaryDirectory() as folder:
        plain, german, rng = Path(folder) / "plain.csv", Path(folder) / "german.txt", np.random.default_rng(1)
        with plain.open("w", encoding="utf-8") as one, german.open("w", encoding="cp1252", newline="\r\n") as two:
            one.write(HEADER)
            two.write("# Auflösung 1 µm\n" + HEADER.replace(",", "\t"))
            for begin in range(0, ROWS, 100_000):  # in parts: a process that begins inherits the peak of this one
                t = np.arange(begin, begin + 100_000) * 0.001
                cells = t, 3.0 * np.sin(6.0 * t) + rng.normal(0, 1e-3, len(t)), 2.0 * np.cos(6.0 * t)
                text = "".join(f"{i:.6f},{j:.6f},{k:.6f}\n" for i, j, k in zip(*cells, strict=True))
                one.write(text)
                two.write(text.replace(",", "\t").replace(".", ","))
        for log, options in ((plain, ""), (german, "sep='\t', decimal=',', encoding='cp1252', comment='#'")):
            jobs = {
                "pandas.read_csv": ("-c", f"import pandas; pandas.read_csv({str(log)!r}, {options})"),
                "read_log": ("-c", f"from frictionlab.logs import read_log; from pathlib import *; read_log({log!r})"),
                "ingest": ("-m", "frictionlab", "ingest", str(log), "-o", f"{log}.h5", "--force", "--quiet"),
            }
            taken = {name: [_process(words) for _ in range(3)] for name, words in jobs.items()}
            best = {name: min(clock for clock, _ in runs) for name, runs in taken.items()}
            for name, runs in taken.items():
                peak = statistics.median(peak for _, peak in runs)
                note = f"{best[name] / best['pandas.read_csv']:.2f} x pandas; {peak:.0f} MB"
                tell(f"{name} of {log.name}", best[name], note)


def _process(words: Sequence[str]) -> tuple[float, float]:
    """Seconds on the clock and peak memory [MB] of a fresh process."""
    subprocess.run([sys.executable, "-c", TOUCH], check=True)
    begun = time.perf_counter()
    with subprocess.Popen([sys.executable, *words], stdout=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{words[:4]} ended with {process.returncode}")
    return time.perf_counter() - begun, used.ru_maxrss / 1024


TASKS = {task.__name__: task for task in (start_up, states, maps, records, logs)}


def main() -> None:
    """Time the tasks named, or all."""
    begun = time.perf_counter()
    for law in ("coulomb", "coulomb+compliance", "coulomb+stribeck"):
        warm_up(law)
    tell("loading, or compiling once", time.perf_counter() - begun, f"frictionlab {fl.__version__} of {fl.__path__[0]}")
    for name in sys.argv[1:] or TASKS:
        TASKS[name]()


if __name__ == "__main__":
    main()
