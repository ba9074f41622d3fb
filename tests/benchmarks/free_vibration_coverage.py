"""How often the truth lies within two standard errors of a fitted free decay: prints the committed table.

`python -m tests.benchmarks.free_vibration_coverage > results/free_vibration_coverage.txt` takes twenty minutes.
"""

import sys

import numpy as np

from frictionlab.analysis.decay import first_guess, fit_decay
from tests.analysis.test_decay import OMEGA, decayed

TRIALS = 200


def line(zeta: float, friction: float, scatter: float) -> str:
    """One row: coverage of f_n, zeta and F/k, and the scatter of the last two over their median standard error."""
    off = []
    for seed in range(TRIALS):
        t, x, at, height = decayed(zeta, friction, np.random.default_rng(seed), scatter=scatter)
        fit = fit_decay(t, x, first_guess(at, height))
        limits = [fit.limits.get(name, 0.0) / 1.645 for name in ("omega", "zeta", "friction")]
        errors = np.maximum([fit.se.omega, fit.se.zeta, fit.se.friction], limits)
        wrong = [fit.decay.omega - OMEGA, fit.decay.zeta - zeta, fit.decay.friction - friction]
        off.append(np.array(wrong) / errors)
    covered = np.mean(np.abs(off) < 2.0, axis=0)
    cells = [f"{zeta:g}", f"{friction * 1e6:g}", f"{scatter:.0%}", *(f"{c:.3f}" for c in covered)]
    return "| " + " | ".join([*cells, *(f"{s:.2f}" for s in np.std(off, axis=0)[1:])]) + " |"


HEAD = """Share of decays from 5 mm (0.8 um noise, 0.78 um step, 250 Hz) whose truth lies within 2 se

| zeta | F/k [um] | scatter of F | f_n | zeta | F/k | sd over se, zeta | F/k |
|---|---|---|---|---|---|---|---|
"""


def main() -> None:
    """Print the table."""
    sys.stdout.write(HEAD)
    for zeta in (0.0, 0.002, 0.0055, 0.02):
        for friction, scatter in ((0.0, 0.0), (5e-6, 0.0), (5e-6, 0.2), (50e-6, 0.0), (50e-6, 0.2)):
            if zeta or friction:
                sys.stdout.write(line(zeta, friction, scatter) + "\n")


if __name__ == "__main__":
    main()
