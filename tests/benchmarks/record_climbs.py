"""Plain Coulomb friction under whole records: how often does `--law auto --fit whole` climb all the same?

    python -m tests.benchmarks.record_climbs [draws] [r ...] > tests/benchmarks/results/record_climbs.txt

The rig of `record_truth` without place and speed, 15 s from rest; at most 5 % may climb. The ladder begins at plain
Coulomb friction, as a cycle that requires nothing more leaves it; it tries rigid laws alone (a compliant contact costs
ten times as much).
"""

import sys
import time

import numpy as np

import frictionlab as fl
from frictionlab.identification import record_ladder
from frictionlab.identification.family import family_of
from frictionlab.identification.identify import identify
from frictionlab.identification.ladder import CHEAP
from frictionlab.identification.track import track_of
from frictionlab.identification.whole import climb_whole, question_of
from tests.benchmarks import record_truth

SCENE = record_truth.SCENE.changed(analysis={"transient_s": 6.0})


def law_of(r: float, seed: int) -> tuple[str, float, float]:
    """The law that one record climbs to, the largest gain of a richer one, and CPU seconds."""
    rng = np.random.default_rng([seed, int(100 * r), 1])
    truth = record_truth.truth_of(rng) | {"gradient": 0.0, "contact_damping_ratio": 0.0}
    recording = record_truth.record_of(r, truth, rng, seconds=15.0)
    measurement = fl.analyze(recording, SCENE)
    family, sources = family_of(measurement, SCENE, "coulomb"), measurement.sources
    track, _ = track_of(recording, SCENE, measurement, record_truth.FN)
    found = identify(measurement, family, sources)
    begin = time.process_time()
    top, ladder = climb_whole(question_of(track, measurement, found, sources))
    gains = [rung.gain for rung in ladder.rungs[1:]]
    return top.family.law.name, max(gains), time.process_time() - begin


def main() -> None:
    """Print a line a draw, and how many climbed."""
    vars(record_ladder)["EXACT"] = CHEAP
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else 24
    climbed = done = 0
    for r in [float(a) for a in sys.argv[2:]] or record_truth.RATIOS:
        for seed in range(draws):
            law, gain, seconds = law_of(r, seed)
            done, climbed = done + 1, climbed + (law != "coulomb")
            sys.stdout.write(f"{r:5g} {seed:3d}  {law:34} largest gain {gain:7.2f}  {seconds:5.1f} CPU s\n")
            sys.stdout.flush()
    sys.stdout.write(f"climbed: {climbed} of {done}\n")


if __name__ == "__main__":
    main()
