"""One numeric engine for the contact laws without exact slides: Stribeck, logarithm, Dahl, Bouc-Wen, LuGre, rate-state.

    Problem --steady--> SteadyState (its orbit: a NumericMotion)
    Problem --run-----> NumericMotion (a motion from initial conditions)

The mathematics stands in the README of this folder.
"""

from frictionlab.simulator.numeric.motion import NumericMotion
from frictionlab.simulator.numeric.solve import RTOL, run, steady, steady_from

__all__ = ["RTOL", "NumericMotion", "run", "steady", "steady_from"]
