"""Measurement + simulator -> identified friction, prediction, difference.

`compare` puts one measured cycle over its prediction; `identification` finds the friction ratio and says how sure it
is; `ladder` climbs the models, from plain Coulomb friction on, and says what each step of physics buys.
"""

from frictionlab.comparison.compare import Comparison, compare, model_words, predict
from frictionlab.comparison.identification import Identified, identify, loop_friction_ratio, problem_family

__all__ = [
    "Comparison",
    "Identified",
    "compare",
    "identify",
    "loop_friction_ratio",
    "model_words",
    "predict",
    "problem_family",
]
