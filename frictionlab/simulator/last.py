"""The last cycle of any motion as if it were steady: its numbers by quadrature, whatever solver carried it there."""

from math import hypot, pi

import numpy as np

from frictionlab.simulator.motion import Motion, bisected, energies_of
from frictionlab.simulator.state import Regime, SteadyState

SETTLED = 1e-6  # a cycle repeats if its end misses its start by less than this share of its size
DENSE = 4000  # points a cycle is looked at for its turns


def last_of(motion: Motion, solver: str) -> SteadyState:
    """Return the state of a motion of one cycle, the last of a run: "not settled" where it does not yet repeat."""
    problem = motion.problem
    x, v = (values.tolist() for values in motion.at([motion.start, motion.end]))
    times = np.linspace(motion.start, motion.end, DENSE)
    speed = motion.at(times)[1]
    turns = np.flatnonzero(speed[:-1] * speed[1:] < 0.0)
    ends = bisected(lambda tau: motion.at(tau)[1], times[turns], times[turns + 1])
    size = float(np.ptp(motion.at(np.concatenate((times, ends)))[0]))
    drift = hypot(x[1] - x[0], problem.r * (v[1] - v[0]))
    energies, gap = energies_of(motion)
    stops = motion.stops
    begun = int(np.count_nonzero(stops[:, 0] > motion.start + 1e-12))
    stuck = float(np.sum(stops[:, 1] - stops[:, 0])) / (2.0 * pi)
    settled = drift <= SETTLED * (hypot(x[0], v[0]) + size)
    regime: Regime = "stuck" if stuck >= 1.0 else "stick-slip" if begun else "continuous"
    return SteadyState(
        problem=problem,
        solver=solver,
        outcome="stuck" if regime == "stuck" else "periodic" if settled else "not settled",
        energies=energies,
        response_amplitude=0.5 * size,
        stops_per_cycle=float(begun),
        stuck_fraction=stuck,
        regime=regime,
        period_cycles=1 if settled else None,
        closure_error=gap,
        residual=drift,
        orbit=motion,
    )
