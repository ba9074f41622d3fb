"""Random problems of each rigid law: how many are solved, how well energies close, how long a steady state takes.

    python -m tests.benchmarks.rigid_laws [POINTS]

Times are of one run on one core, over that of plain Coulomb friction in the same run.
"""

import sys
import time
from collections import Counter

import numpy as np

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.state import OUTCOMES
from frictionlab.simulator.sweep import Family, sweep_points, warm_up

RANGES = {
    "gradient": (-0.15, 0.15),
    "static_ratio_up": (1.0, 1.5),
    "static_ratio_down": (1.0, 1.5),
    "contact_damping_ratio": (0.0, 0.1),
    "frame_damping_ratio": (0.0, 0.03),
}
LAWS = {
    "coulomb": (),
    "coulomb+frame": ("frame_damping_ratio",),
    "coulomb+speed": ("contact_damping_ratio",),
    "coulomb+place": ("gradient",),
    "coulomb+place+speed": ("gradient", "contact_damping_ratio"),
    "coulomb+breakaway": ("static_ratio_up", "static_ratio_down"),
    "coulomb+place+speed+breakaway": tuple(RANGES),
}


def points_of(names: tuple[str, ...], count: int) -> np.ndarray:
    """Random points: r from 0.1 to 3, evenly in its logarithm, beta from 0.05 to 0.95, and the law's parameters."""
    rng = np.random.default_rng(13)
    first = (np.exp(rng.uniform(np.log(0.1), np.log(3.0), count)), rng.uniform(0.05, 0.95, count))
    more = [rng.uniform(*RANGES[name], count) for name in names]
    return np.column_stack((*first, np.ones(count), np.zeros(count), *more))


def main(count: int) -> None:
    """Solve, count, print."""
    warm_up("coulomb")
    sweep_points(points_of((), 10), Family(), fast=True)
    plain = 0.0
    for law, names in LAWS.items():
        family, points = Family(law.replace("+frame", ""), names), points_of(names, count)
        begin = time.process_time()
        rows = sweep_points(points, family, fast=True)
        taken = time.process_time() - begin
        plain = plain or taken
        found = rows[:, layout.OUTCOME] == layout.PERIODIC
        off = rows[found, layout.CLOSURE] / rows[found, layout.ENERGY]
        told = Counter(OUTCOMES[int(code)] for code in rows[:, layout.OUTCOME])
        named = int(np.isin(rows[:, layout.OUTCOME], (layout.RUNAWAY, layout.PULLING)).sum())
        loose = int((off > 1e-11).sum())
        sys.stdout.write(
            f"{law:32s} {taken / count * 1e6:7.1f} us ({taken / plain:4.1f})  closure: worst {off.max():.0e}, "
            f"over 1e-11: {loose}  {dict(told)}, {named} declined by name\n"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
