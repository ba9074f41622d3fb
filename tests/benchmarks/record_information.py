"""How well could the natural frequency be known from a whole record, and how well does the fit know it?

    python -m tests.benchmarks.record_information [tests] > tests/benchmarks/results/record_information.txt

Standard deviations by Fisher's information (Cramer and Rao), with what is known of the rig before, on the records of
`record_truth`: if the base were known exactly; if nothing were known of it but its noisy record (the most that any fit
can tell); if all frequencies of the record weighed alike; and what the fit states. A base's noise comes into the mass
through the linearised motion, mode by mode up to 12 Hz.
"""

import math
import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import frictionlab as fl
from frictionlab.identification.family import family_of
from frictionlab.identification.identify import Identified, identify
from frictionlab.identification.track import RecordForward, Track, track_of
from frictionlab.identification.whole import identify_whole, question_of
from tests.benchmarks import record_truth as rig

FloatArray = NDArray[np.float64]
HIGHEST_HZ, SMALL = 12.0, 1e-4


def modes_of(forward: RecordForward, point: FloatArray, here: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What a cosine or sine in the base (Y) does to the mass (n, m), and the share of noise that smoothing leaves."""
    track, columns, left = forward.track, [], []
    length = float(track.time[-1])
    for k in range(1, int(HIGHEST_HZ * length) + 1):
        bend = (2.0 * math.sin(math.pi * k / len(track.time))) ** 8
        for wave in (np.cos, np.sin):
            base = track.base + SMALL * wave(2.0 * math.pi * k * track.time / length)
            there = replace(forward, track=replace(track, base=base)).predict(point)
            columns.append(np.zeros(len(here)) if there is None else (there - here) / SMALL)
            left.append(1.0 / (1.0 + track.penalty * bend))
    return np.array(columns).T * track.base_noise * math.sqrt(2.0 / len(track.time)), np.array(left)


def bounds(found: Identified, track: Track) -> Iterator[float]:
    """Standard deviations of the natural frequency: base known, base as noisy as it is, all frequencies alike."""
    forward = RecordForward(found.family, found.fit.coordinates, track)
    forward.prepare(2000)
    here = forward.predict(found.fit.point)
    if here is None:
        return
    slopes = forward.jacobian(found.fit.point, here) / track.noise
    names = [c.name for c in forward.coordinates]
    i = names.index("natural_frequency")
    width, held = forward.coordinates[i].width, np.eye(len(names))
    plain = slopes.T @ slopes + held
    modes, left = modes_of(forward, found.fit.point, here)
    shaken = modes / track.noise
    mixed = shaken.T @ slopes
    inner = np.linalg.solve(np.eye(shaken.shape[1]) + shaken.T @ shaken, mixed)
    posterior = np.linalg.inv(plain)
    moved = posterior @ (mixed * left[:, None]).T
    yield width * math.sqrt(posterior[i, i])
    yield width * math.sqrt(np.linalg.inv(plain - mixed.T @ inner)[i, i])
    yield width * math.sqrt(posterior[i, i] + float((moved @ moved.T)[i, i]))


def line_of(r: float, seed: int, seconds: float) -> str:
    """One record as a line."""
    rng = np.random.default_rng([seed, int(100 * r)])
    recording = rig.record_of(r, rig.truth_of(rng), rng, seconds=seconds)
    measurement = fl.analyze(recording, rig.SCENE)
    cycle = identify(measurement, family_of(measurement, rig.SCENE, rig.LAW), measurement.sources)
    track, _ = track_of(recording, rig.SCENE, measurement, rig.FN)
    found = identify_whole(question_of(track, measurement, cycle, measurement.sources))
    told = " ".join(f"{bound:12.1e}" for bound in bounds(found, track))
    return f"{r:5g} {seconds:8g} {seed:4d} {told} {found.nuisances['natural_frequency'][1]:12.1e}\n"


def main() -> None:
    """Print a line a record."""
    tests = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    head = ("r", "seconds", "seed", "base known", "the bound", "all alike", "fit states")
    sys.stdout.write("{:>5} {:>8} {:>4} {:>12} {:>12} {:>12} {:>12}\n".format(*head))
    for r in rig.RATIOS:
        for seed in range(tests):
            sys.stdout.write(line_of(r, seed, rig.SECONDS))
            sys.stdout.flush()


if __name__ == "__main__":
    main()
