"""A contact that yields before it slips: one elastic slider (Jenkins; also elasto-plastic, Masing, Maxwell slip)."""

from frictionlab.simulator.laws.law import Term
from frictionlab.simulator.laws.stiffness import STIFFNESS, YIELDING

COMPLIANCE = Term(
    name="compliance",
    words="elastic contact (Jenkins)",
    equation="n' = kappa v while |n| < beta, n = s beta in slip",
    parameters=(STIFFNESS,),
    kind="elastic",
    excludes=YIELDING - {"compliance"} | {"stribeck", "logarithm"},
)
