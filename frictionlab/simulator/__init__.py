"""The friction oscillator, solved exactly: knows no files, no plots, no recordings.

    Problem --steady_state--> SteadyState (its orbit: one period, phase by phase)
    Problem --simulate-----> Motion      (a motion from initial conditions)
    r, beta, mu, zeta --sweep--> StateMap (steady states over up to four axes)
    Structure (several masses, contacts anywhere): the same two verbs

The mathematics stands in the README of this folder.
"""

from frictionlab.simulator.motion import Motion
from frictionlab.simulator.problem import COSINE, Base, Problem
from frictionlab.simulator.solve import Attractor, coexisting, last_cycle, simulate, steady_state
from frictionlab.simulator.state import Solver, SteadyState
from frictionlab.simulator.structure import Contact, Structure
from frictionlab.simulator.sweep import StateMap, sweep
from frictionlab.simulator.thesis import thesis_run

__all__ = [
    "COSINE", "Attractor", "Base", "Contact", "Motion", "Problem", "Solver", "StateMap", "SteadyState", "Structure",
    "coexisting", "last_cycle", "simulate", "steady_state", "sweep", "thesis_run",
]  # fmt: skip
