"""Is the law that made a recording the one that the ladder finds, and do its errors hold?

Run: ``python -m tests.benchmarks.law_recovery [DRAWS [CONTACT ...]]``, a contact as ``coulomb+speed@0.35``; without any
all are drawn. Several runs may go beside each other, each with contacts of its own: what is done is kept by the build
and the number of draws, and the table of all that is there goes to results/law_recovery.txt each time. Every draw is
two tests of 60 s at 250 Hz through the optoNCDT's noise (0.8 um) and step, friction scattering by 0.3 % from cycle to
cycle. In the first, sensors and rig are as declared: its errors are held against `se`. In the second they are off by
what the scene declares (lag 1 ms, gains 0.1 %, curvature of both sensors 0.05 %, crosstalk 0.05 %, natural frequency
0.2 %, frame damping 0.005 +- 0.001): its errors are held against `u`.
"""

import hashlib
import json
import math
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

import frictionlab
from frictionlab.inference import compare
from frictionlab.inference.comparison import Comparison
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.elastic import engine as elastic
from frictionlab.simulator.engine import compiled
from frictionlab.simulator.laws import law_of
from tests.benchmarks.uncertainty_coverage import TABLES, off_as_declared
from tests.inference.contacts import recorded, scene

RESULT = Path(__file__).parent / "results" / "law_recovery.txt"
WORDS = "as declared", "off by that"
SLIDES = 0.5  # frequency ratio of POINTS from which a motion has no stops, and a static ratio no effect
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


def contacts() -> dict[str, Problem]:
    """The contacts by name."""
    return {
        f"{law}@{r:g}": Problem(r, beta, law=law, parameters=parameters)
        for law, parameters in TRUTHS.items()
        for r, beta in POINTS
    }


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
    begin = time.process_time()
    found = compare(recording, known, law="auto")
    return found, time.process_time() - begin


def lines_of(truth: Problem, both: tuple[Tally, Tally], draws: int) -> list[str]:
    """The table's lines of one truth."""
    law, found = truth.law.name, []
    for words, tally in zip(WORDS, both, strict=True):
        gain = f"{np.median(tally.gains):11.1f}" if tally.gains else f"{'-':>11s}"
        counts = (tally.right, tally.richer, tally.other, tally.explained)
        shares = "".join(f"{100 * count / draws:10.4g}" for count in counts)
        seconds = f"{np.median(tally.seconds):7.2f}{max(tally.seconds):7.2f}"
        head = f"{truth.r:5g}{truth.beta:6g}  {law:20s}{words:12s}{shares}{gain}{seconds}"
        wrong = {name: n for name, n in tally.laws.items() if name != law}
        found += [head + ("  found: " + ", ".join(f"{name} {n}" for name, n in wrong.items()) if wrong else "")]
    names = dict.fromkeys((*both[0].scores, *both[1].scores))
    found += [_covered(name, [tally.scores.get(name, [math.nan]) for tally in both]) for name in names]
    return found


def _covered(name: str, told: list[list[float]]) -> str:
    """How often the truth lay within one and 1.96 stated errors: `se` as declared, `u` in rigs that are off."""
    inside = [100 * float(np.mean(np.abs(scores) < limit)) for scores in told for limit in (1.0, 1.96)]
    rms = [math.sqrt(float(np.mean(np.square(scores)))) for scores in told]
    return (
        f"{'':13s}{name:32s}{''.join(f'{share:10.3g}' for share in inside)}   rms {rms[0]:.2f} by se, {rms[1]:.2f} by u"
    )


def table(done: Mapping[str, tuple[Tally, Tally]], draws: int) -> list[str]:
    """The table of what is done, and all parameters of all contacts as one line."""
    lines = [
        f"{draws} draws a contact; shares in %, median gain of log evidence over coulomb, CPU seconds: median, most"
    ]
    lines.append(f"{'r':>5s}{'beta':>6s}  {'truth':32s}{'right':>10s}{'richer':>10s}{'other':>10s}{'explained':>10s}")
    lines.append(f"{'':13s}{'parameter':32s}{'se 68':>10s}{'se 95':>10s}{'u 68':>10s}{'u 95':>10s}")
    known = contacts()
    for name in (name for name in known if name in done):
        lines += lines_of(known[name], done[name], draws)
    told = [[s for both in done.values() for scores in both[i].scores.values() for s in scores] for i in (0, 1)]
    tested = [both for name, both in done.items() if "breakaway" not in name or known[name].r < SLIDES]
    for words, i in zip(WORDS, (0, 1), strict=True):
        right, richer = (sum(getattr(both[i], field) for both in tested) for field in ("right", "richer"))
        lines.append(
            f"{words}: right law in {right} of {draws * len(tested)} draws whose term has an effect, richer {richer}"
        )
    return [*lines, _covered("all parameters", told)]


def kept(draws: int) -> Path:
    """Where the counts of each contact are kept: by the build, for another one's are another table's."""
    build = hashlib.sha256()
    for path in sorted(Path(frictionlab.__file__).parent.rglob("*.py")):
        build.update(path.read_bytes())
    folder = Path(tempfile.gettempdir()) / f"law_recovery_{draws}_{build.hexdigest()[:12]}"
    folder.mkdir(exist_ok=True)
    return folder


def put_together(folder: Path, draws: int) -> None:
    """Write the table of all contacts done so far."""
    done = {}
    for path in folder.glob("*.json"):
        first, second = (Tally(**tally) for tally in json.loads(path.read_text()))
        done[path.stem] = (first, second)
    RESULT.write_text("\n".join(table(done, draws)) + "\n")


def main(draws: int, names: list[str]) -> None:
    """Draw the contacts named, or all; write the table after each."""
    compiled()
    elastic.compiled()
    known, folder = contacts(), kept(draws)
    for name in names or known:
        both = study(known[name], draws)
        (folder / f"{name}.json").write_text(json.dumps([asdict(tally) for tally in both]))
        put_together(folder, draws)
        sys.stdout.write("\n".join(lines_of(known[name], both, draws)) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 24, sys.argv[2:])
