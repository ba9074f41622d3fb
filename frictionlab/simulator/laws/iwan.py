"""Several elastic sliders side by side that give way one after the other (Iwan; D. J. Segalman's distribution)."""

from frictionlab.simulator.laws.law import Parameter, Term
from frictionlab.simulator.laws.stiffness import STIFFNESS, YIELDING

IWAN = Term(
    name="iwan",
    words="sliders in parallel (Iwan)",
    equation=(
        "n = sum n_i, each a Jenkins slider; their slip lengths phi are distributed as phi^chi up to phi_max"
        " (Segalman's four-parameter model without its final jump)"
    ),
    parameters=(
        STIFFNESS,
        Parameter(
            name="sliders",
            symbol="N",
            words="number of sliders",
            low=1.0,
            high=200.0,
            usual=(10.0, 100.0),
            default=20.0,
            whole=True,
        ),
        Parameter(
            name="chi",
            symbol="χ",
            words="exponent of the distribution of slip lengths; 0 is an even distribution",
            low=-1.0,
            high=0.0,
            open_low=True,
            usual=(-0.9, 0.0),
            default=0.0,
        ),
    ),
    kind="elastic",
    excludes=YIELDING - {"iwan"} | {"stribeck", "logarithm"},
)
