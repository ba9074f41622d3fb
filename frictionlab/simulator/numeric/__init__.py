"""The integrated flow, for contact laws without exact slides: Stribeck, logarithm, Dahl, Bouc-Wen, LuGre, rate-state.

`radau.py` is what is compiled, `flow.py` the flow as Python has it, and its motion as the steps that made it. What
repeats is looked for by the search of the exact flow. Imported when such a law is asked for.
"""

from frictionlab.simulator.numeric.flow import RTOL, Integrated, warm_up

__all__ = ["RTOL", "Integrated", "warm_up"]
