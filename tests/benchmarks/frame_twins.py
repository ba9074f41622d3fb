"""Does `--law auto` find the law of other recordings of the frame whose two real ones are in ../shared/data?

Run: ``python -m tests.benchmarks.frame_twins [DRAWS] [FIRST]``; the result goes to results/frame_twins.txt. Each draw
is a twin of that rig: ten seconds at 250 Hz, its measured base (n: how many of its harmonics move the mass, the rest is
the sensor's; 0: the base has none and its sensor shows none), a lag of up to 10 ms either way that no scene declares, a
frame 0.3 % off its published frequency, friction that wanders by 1 % (standard deviation); the contact is drawn from
more than the range of the loads. Errors are those of single parameters over their stated uncertainty. FIRST: the first
seed; seeds below 1000 were looked at while the errors were made.
"""

import math
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measure import measure
from frictionlab.errors import SimulationError
from frictionlab.inference import compare
from frictionlab.inference.comparison import Comparison
from frictionlab.logs import read_log
from frictionlab.recording import Recording
from frictionlab.scene import read_scene
from frictionlab.simulator import Base, Problem, steady_state
from frictionlab.simulator.elastic import engine as elastic
from frictionlab.simulator.engine import compiled
from frictionlab.simulator.laws import law_of
from tests.analysis.seen import through_laser

FloatArray = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
RESULT = Path(__file__).parent / "results" / "frame_twins.txt"
RATIOS = (0.25, 0.32, 0.5, 0.8, 1.2, 1.6)
LAWS = ("coulomb", "coulomb+speed", "coulomb+place", "coulomb+place+speed", "coulomb+place+speed+breakaway")
NATURAL_HZ = 3.13
MOST_LAG_S, DETUNED, WANDER, TOGETHER = 10e-3, 0.003, 0.01, 0.8
RATE_HZ, SECONDS, TRANSIENT_S, BASE_M = 250.0, 10.0, 2.0, 1.818e-3


@dataclass(frozen=True)
class Twin:
    """One drawn contact: what moves, what is told of it, how many of the base's harmonics move the frame, the lag.

    ``beta``: mean friction ratio of the cycles that are measured, which the wander moves from the drawn one's.
    """

    problem: Problem
    recording: Recording
    real: int
    lag_s: float
    beta: float


def values_of(law: str, generator: np.random.Generator) -> tuple[float, dict[str, float]]:
    """Friction ratio and parameters of a drawn contact: both signs of a gradient, break-away per direction."""
    beta = float(generator.uniform(0.15, 0.7))
    parameters: dict[str, float] = {}
    if "place" in law:
        parameters["gradient"] = float(generator.uniform(0.02, 0.1) * generator.choice([-1.0, 1.0]))
    if "speed" in law:
        parameters["contact_damping_ratio"] = float(generator.uniform(0.01, 0.05))
    if "breakaway" in law:
        parameters |= {f"static_ratio_{side}": float(generator.uniform(1.0, 1.3)) for side in ("up", "down")}
    return beta, parameters


def cut(base: Base, harmonics: int) -> Base:
    """The first harmonics of a base motion."""
    return Base(base.cosine[:harmonics], base.sine[:harmonics])


def twin_of(r: float, law: str, base: Base, seed: int) -> Twin | None:
    """A recording of a drawn contact; None where that contact has no motion of one cycle to measure."""
    generator = np.random.default_rng([14, seed, round(100 * r)])
    beta, parameters = values_of(law, generator)
    real = (1, 2, base.harmonics, 0)[seed % 4]
    base = base if real else cut(base, 1)
    lag = float(generator.uniform(-MOST_LAG_S, MOST_LAG_S))
    tuned = 1.0 + DETUNED * float(generator.standard_normal())
    frame = 0.0055 * float(generator.normal(1.0, 0.1))
    moved = cut(base, real or 1)
    problem = Problem(r / tuned, beta, law=law, parameters=parameters, base=moved, frame_damping_ratio=frame)
    try:
        states = [steady_state(p) for p in (problem, problem.with_parameters({"beta": beta * 1.001}))]
    except SimulationError:
        return None
    here, there = (state.orbit for state in states)
    if here is None or there is None or states[0].period_cycles != 1 or (states[0].response_amplitude or 0.0) < 0.1:
        return None
    t = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    turn = 2.0 * math.pi * r * NATURAL_HZ
    early = turn * (t + lag) + 0.7
    change = WANDER * wander(int(early[-1] / (2.0 * math.pi)) + 2, generator)
    of_sample = np.interp(early / (2.0 * math.pi), np.arange(len(change)), change)
    phase = np.mod(early, 2.0 * math.pi)
    x = here.at(phase)[0]
    x = x + (there.at(phase)[0] - x) / 1e-3 * of_sample
    mean = beta * (1.0 + float(of_sample[t > TRANSIENT_S].mean()))
    shown = BASE_M * base.at(turn * t + 0.7)
    recording = Recording(t, through_laser(BASE_M * x, generator), through_laser(shown, generator))
    return Twin(problem, recording, real, lag, mean)


def wander(cycles: int, generator: np.random.Generator) -> FloatArray:
    """Relative change of friction from cycle to cycle, of unit rms: neighbours hang together."""
    found, fresh = np.zeros(cycles), generator.standard_normal(cycles)
    found[0] = fresh[0]
    for i in range(1, cycles):
        found[i] = TOGETHER * found[i - 1] + math.sqrt(1.0 - TOGETHER**2) * fresh[i]
    return found


def judged(found: Comparison, twin: Twin) -> str:
    """Whether the law is right: "right", "richer", "poorer" or "other"."""
    truth, terms = ({t.name for t in law_of(law).terms} for law in (twin.problem.law, found.law))
    if terms == truth:
        return "right"
    return "richer" if terms > truth else "poorer" if terms < truth else "other"


def scores(found: Comparison, twin: Twin) -> dict[str, float]:
    """Error over stated uncertainty of each parameter that is told."""
    truth = {**twin.problem.parameters, "beta": twin.beta}
    return {
        name: (float(told["value"]) - truth[name]) / float(told["u"])
        for name, told in found.parameters.items()
        if told["told"] and told["u"] and name in truth
    }


def line_of(found: Comparison, twin: Twin, seconds: float) -> str:
    """One draw as a line."""
    rung = next(rung for rung in found.laws or () if rung["law"] == found.law)
    missed = " ".join(f"{name}{z:+.1f}" for name, z in scores(found, twin).items())
    return (
        f"{twin.problem.law.name:31s}{found.law:31s}{judged(found, twin):8s}"
        f"{twin.real:3d}{1e3 * twin.lag_s:+6.1f} {found.verdict or '-':10s}"
        f"{100 * (found.response_nrmse or math.nan):7.2f}{100 * (found.response_floor or math.nan):7.2f}"
        f"{100 * float(str(rung['held_out_nrmse'])):7.2f}{seconds:6.2f}  {missed}"
    )


def coverage(every: list[dict[str, float]]) -> list[str]:
    """How many of the errors of each parameter lie within 1 and 1.96 of the stated ones, as lines."""
    names = sorted({name for one in every for name in one})
    told = {name: np.array([one[name] for one in every if name in one]) for name in names}
    return [
        f"{name:24s}{len(z):4d} told, {100 * np.mean(np.abs(z) < 1.0):3.0f} % within u,"
        f" {100 * np.mean(np.abs(z) < 1.96):3.0f} % within 1.96 u, worst {np.abs(z).max():.1f}"
        for name, z in {**told, "all": np.concatenate(list(told.values()))}.items()
    ]


def main(draws: int, first: int = 1000) -> None:
    """Write the table."""
    compiled()
    elastic.compiled()
    scene = read_scene(ROOT / "configs" / "frame.toml")
    cycle = measure(read_log(DATA / "frame_250g.csv"), scene).cycle
    base = Base(tuple(cycle.base_cosine.tolist()), tuple(cycle.base_sine.tolist()))
    heads = "".join(f"{head:>7s}" for head in ("nrmse", "floor", "out"))
    lines = [f"{'r':5s}{'truth':31s}{'found':31s}{'is':8s}{'n':>3s}{'lag':>6s} {'verdict':10s}{heads}{'s':>6s}  errors"]
    counts: Counter[str] = Counter()
    every = []
    for r in RATIOS:
        for i, law in enumerate(LAWS):
            for seed in range(first, first + draws):
                twin = twin_of(r, law, base, 100_000 * i + seed)
                if twin is None:
                    continue
                begin = time.process_time()
                found = compare(twin.recording, scene, law="auto")
                counts[judged(found, twin)] += 1
                every.append(scores(found, twin))
                lines.append(f"{r:<5g}" + line_of(found, twin, time.process_time() - begin))
                sys.stdout.write(lines[-1] + "\n")
                sys.stdout.flush()
    lines.append(", ".join(f"{kind} {count}" for kind, count in counts.items()))
    lines += coverage(every)
    RESULT.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(*(int(text) for text in (sys.argv[1:] or ["4"])[:2]))
