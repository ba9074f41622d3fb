"""The friction oscillator, solved exactly: knows no files, no plots, no recordings.

    Problem --steady_state--> SteadyState (its orbit: one period, phase by phase)
    Problem --simulate-----> Trajectory  (a motion from initial conditions)

The mathematics stands in the README of this folder.
"""

from frictionlab.simulator.orbit import SteadyState, simulate, steady_state
from frictionlab.simulator.problem import COSINE, Base, Problem
from frictionlab.simulator.trajectory import Trajectory

__all__ = ["COSINE", "Base", "Problem", "SteadyState", "Trajectory", "simulate", "steady_state"]
