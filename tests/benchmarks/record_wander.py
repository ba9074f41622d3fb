"""Friction that wanders over a long test, followed period by period: how often the truth lies within the stated error.

    python -m tests.benchmarks.record_wander [minutes] [r ...] > tests/benchmarks/results/record_wander.txt

A virtual test whose friction ratio wanders slowly by 3 % (rms, correlation 60 s); 68 and 95 % are due. The level is as
sure as the friction ratio itself: changes about their mean are held against the truth's, and the level apart.
"""

import math
import resource
import sys
import time

import numpy as np

import frictionlab as fl
from frictionlab.recording import Recording
from frictionlab.scene import Analysis, Rig, Scene
from frictionlab.simulator import Problem
from frictionlab.synthetic.virtual_motion import drive, ramp, wander

FN, Y, RATE, NOISE, BETA = 3.0, 2e-3, 250.0, 1e-6, 0.35
SIZE, CORRELATION_S, SETTLED = 0.03, 60.0, 10  # relative rms; s; periods left out at the start
SCENE = Scene(rig=Rig(natural_frequency_hz=FN, damping_ratio=0.01), analysis=Analysis(transient_s=10.0, cycles="all"))
RATIOS = (0.4, 0.7, 0.95, 1.4)


def test_of(r: float, minutes: float) -> tuple[Recording, np.ndarray, float]:
    """What two lasers see, friction of each period, and the period (s)."""
    rng = np.random.default_rng(int(100 * r))
    t = np.arange(int(60 * minutes * RATE)) / RATE
    period = 1.0 / (r * FN)
    betas = BETA * (1.0 + wander(int(t[-1] / period) + 1, period, SIZE, CORRELATION_S, rng))
    base, tau = ramp(t / 2.0) * np.sin(2 * math.pi * r * FN * t), 2 * math.pi * FN * t
    motion = drive(lambda b: Problem(1.0, b, frame_damping_ratio=0.01), betas, 2 * math.pi * FN * period, tau, base)
    noise = NOISE * rng.standard_normal((2, len(t)))
    return Recording(t, Y * motion.displacement + noise[0], Y * base + noise[1]), betas, period


def main() -> None:
    """Print the table."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 30.0
    ratios = [float(a) for a in sys.argv[2:]] or list(RATIOS)
    line = "{:>5} {:>8} {:>8} {:>10} {:>10} {:>7} {:>8} {:>8} {:>8} {:>8}\n"
    head = ("r", "minutes", "periods", "rms error", "stated", "in 1 u", "in 1.96", "level/u", "CPU s", "GB")
    sys.stdout.write(line.format(*head))
    for r in ratios:
        recording, betas, _ = test_of(r, minutes)
        begin = time.process_time()
        seen = fl.compare(recording, SCENE, law="coulomb", fit="whole")
        seconds = time.process_time() - begin
        if seen.record is None or seen.friction_ratio_u is None:
            continue
        count = min(len(betas), len(seen.record.cycle_friction))
        off = (seen.record.cycle_friction[:count] - betas[:count])[SETTLED:]
        error = seen.record.cycle_friction_se[SETTLED:count]
        z = np.abs(off - off.mean()) / error
        inside = [f"{100 * np.mean(z < k):.0f} %" for k in (1.0, 1.96)]
        rms, stated = f"{np.std(off):.1e}", f"{math.sqrt(float(np.mean(error**2))):.1e}"
        gigabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        told = (f"{off.mean() / seen.friction_ratio_u:.2f}", f"{seconds:.1f}", f"{gigabytes:.2f}")
        sys.stdout.write(line.format(r, minutes, count, rms, stated, *inside, *told))
        sys.stdout.flush()


if __name__ == "__main__":
    main()
