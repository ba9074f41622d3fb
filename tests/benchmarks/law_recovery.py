"""Is the law that made a recording the one that the ladder finds, and do its errors hold?

Run: ``python -m tests.benchmarks.law_recovery [DRAWS]``; the result goes to results/law_recovery.txt. Every draw is two
tests of 60 s at 250 Hz through the optoNCDT's noise (0.8 um) and step, friction scattering by 0.3 % from cycle to
cycle. In the first, sensors and rig are as declared: its errors are held against `se`. In the second they are off by
what the scene declares (lag 1 ms, gains 0.1 %, curvature of both sensors 0.05 %, crosstalk 0.05 %, natural frequency
0.2 %, frame damping 0.005 +- 0.001): its errors are held against `u`.
"""

import math
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from frictionlab.identification import compare
from frictionlab.identification.comparison import Comparison
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.elastic import engine as elastic
from frictionlab.simulator.engine import compiled
from frictionlab.simulator.laws import law_of
from tests.benchmarks.uncertainty_coverage import TABLES, off_as_declared
from tests.identification.contacts import recorded, scene

RESULT = Path(__file__).parent / "results" / "law_recovery.txt"
POINTS = ((0.35, 0.4), (0.7, 0.3), (1.3, 0.3))
TRUTHS: dict[str, Mapping[str, float]] = {
    "coulomb": {},
    "coulomb+place": {"gradient": 0.05},
    "coulomb+speed": {"contact_damping_ratio": 0.02},
    "coulomb+breakaway": {"static_ratio_up": 1.2, "static_ratio_down": 1.2},
    "coulomb+compliance": {"stiffness_ratio": 40.0},
}


@dataclass
class Tally:
    """What came of the draws of one truth: counts, scores (error over stated error `by`) and seconds."""

    by: str
    right: int = 0
    richer: int = 0
    other: int = 0
    explained: int = 0
    gains: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    scores: dict[str, list[float]] = field(default_factory=dict)
    laws: dict[str, int] = field(default_factory=dict)

    def add(self, found: Comparison, seconds: float, truth: Problem) -> None:
        """Count one draw."""
        self.seconds.append(seconds)
        self.laws[found.law] = self.laws.get(found.law, 0) + 1
        self.explained += found.verdict == "explained"
        right, terms = truth.law, {t.name for t in law_of(found.law).terms}
        self.right += found.law == right.name
        self.richer += terms > {t.name for t in right.terms}
        self.other += not terms >= {t.name for t in right.terms}
        evidence = {str(rung["law"]): float(str(rung["log_evidence"])) for rung in found.laws or ()}
        if right.name in evidence:
            self.gains.append(evidence[right.name] - evidence["coulomb"])
        if found.law != right.name:
            return
        for name, told in found.parameters.items():
            error, value = told[self.by], told["value"]
            if error and value is not None:
                gap = float(value) - {"beta": truth.beta, **truth.parameters}[name]
                self.scores.setdefault(name, []).append(gap / float(error))


def study(truth: Problem, draws: int) -> tuple[Tally, Tally]:
    """Identify so many recordings of one contact: in a rig as it is declared, and in one that is off by that."""
    exact, off = Tally("se"), Tally("u")
    for seed in range(draws):
        recording = recorded(truth, np.random.default_rng([20261122, seed]))
        exact.add(*_found(recording, scene()), truth)
        generator = np.random.default_rng([14, round(1000 * truth.r), seed])
        off.add(*_found(off_as_declared(truth, generator, seconds=60.0, hum=False)[1], scene(**TABLES)), truth)
    return exact, off


def _found(recording: Recording, known: Scene) -> tuple[Comparison, float]:
    begin = time.perf_counter()
    found = compare(recording, known, law="auto")
    return found, time.perf_counter() - begin


def lines_of(r: float, beta: float, law: str, both: tuple[Tally, Tally], draws: int) -> list[str]:
    """The table's lines of one truth."""
    found = []
    for words, tally in zip(("as declared", "off by that"), both, strict=True):
        gain = f"{np.median(tally.gains):11.1f}" if tally.gains else f"{'-':>11s}"
        counts = (tally.right, tally.richer, tally.other, tally.explained)
        shares = "".join(f"{100 * count / draws:8.0f}" for count in counts)
        head = f"{r:5g}{beta:6g}  {law:20s}{words:12s}{shares}{gain}{np.median(tally.seconds):8.2f}"
        wrong = {name: n for name, n in tally.laws.items() if name != law}
        found += [head + ("  found: " + ", ".join(f"{name} {n}" for name, n in wrong.items()) if wrong else "")]
    for name in both[0].scores | both[1].scores:
        told = [np.array(tally.scores.get(name, [math.nan])) for tally in both]
        inside = [100 * float(np.mean(np.abs(scores) < limit)) for scores in told for limit in (1.0, 1.96)]
        rms = [math.sqrt(float(np.mean(scores**2))) for scores in told]
        shown = "".join(f"{share:8.0f}" for share in inside)
        found.append(f"{'':13s}{name:32s}{shown}   rms {rms[0]:.2f} by se, {rms[1]:.2f} by u")
    return found


def main(draws: int) -> None:
    """Write the table."""
    compiled()
    elastic.compiled()
    lines = [f"{draws} draws a contact; shares in %, median gain of log evidence over coulomb, median seconds"]
    lines.append(f"{'r':>5s}{'beta':>6s}  {'truth':32s}{'right':>8s}{'richer':>8s}{'other':>8s}{'explained':>8s}")
    lines.append(f"{'':13s}{'parameter':32s}{'se 68':>8s}{'se 95':>8s}{'u 68':>8s}{'u 95':>8s}")
    for law, parameters in TRUTHS.items():
        for r, beta in POINTS:
            both = study(Problem(r, beta, law=law, parameters=parameters), draws)
            lines += lines_of(r, beta, law, both, draws)
            sys.stdout.write("\n".join(lines_of(r, beta, law, both, draws)) + "\n")
            sys.stdout.flush()
    RESULT.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 24)
