"""The integrated flow, for contact laws without exact slides: Stribeck, logarithm, Dahl, Bouc-Wen, LuGre, rate-state.

    Problem --steady--> SteadyState (its orbit: a NumericMotion)
    Problem --run-----> NumericMotion (a motion from initial conditions)

`radau.py` is what is compiled, `flow.py` carries a state and its slopes, and is the motion as the steps that made it,
`steady.py` looks for what repeats. Imported when such a law is asked for.
"""

from frictionlab.simulator.numeric.flow import NumericMotion, warm_up
from frictionlab.simulator.numeric.steady import RTOL, run, steady, steady_from

__all__ = ["RTOL", "NumericMotion", "run", "steady", "steady_from", "warm_up"]
