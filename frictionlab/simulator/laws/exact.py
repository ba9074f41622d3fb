"""The terms whose phases are exact, and the parameters that laws share; their forces stand in the solvers.

Friction that varies along the path: R. J. Anderson and A. A. Ferri, Behavior of a single-degree-of-freedom system with
a generalized friction law (1990). Sliders side by side: W. D. Iwan; D. J. Segalman's distribution.
"""

from math import inf

from frictionlab.simulator.laws.law import Parameter, Term

YIELDING = frozenset({"compliance", "iwan", "dahl", "bouc-wen", "lugre", "rate-state"})

STIFFNESS = Parameter(
    name="stiffness_ratio",
    symbol="κ",
    words="tangential contact stiffness over the frame's stiffness k",
    low=0.0,
    high=inf,
    open_low=True,
    usual=(10.0, 1000.0),
    scale="log",
    neutral=inf,
)

FRAME_DAMPING = Parameter(
    name="frame_damping_ratio",
    symbol="ζ_f",
    words="damping ratio of the frame itself, between mass and base",
    low=0.0,
    high=inf,
    usual=(0.0, 0.02),
    default=0.0,
    neutral=0.0,
)

COULOMB = Term(
    name="coulomb",
    words="Coulomb friction",
    equation="n = s beta in sliding, |n| <= beta in a stop; s = sgn v (thesis eqs 2.3, 2.9)",
    parameters=(
        Parameter(
            name="beta",
            symbol="β",
            words="friction ratio, friction force over k Y",
            low=0.0,
            high=inf,
            usual=(0.02, 1.5),
            scale="log",
            neutral=0.0,
            lengths=1,
        ),
    ),
)

PLACE = Term(
    name="place",
    words="friction varying along the path",
    equation=(
        "n = s beta (1 + q z), |n| <= beta (1 + q z) in a stop; z relative to the wall, 0 where the spring is relaxed"
    ),
    parameters=(
        Parameter(
            name="gradient",
            symbol="q",
            words="relative change of the friction force over a way of Y",
            low=-inf,
            high=inf,
            usual=(-0.1, 0.1),
            neutral=0.0,
            lengths=-1,
        ),
    ),
)

SPEED = Term(
    name="speed",
    words="contact dashpot",
    equation="n = s beta + 2 zeta_c r v, v = dz/dtau; the dashpot stands between mass and wall",
    parameters=(
        Parameter(
            name="contact_damping_ratio",
            symbol="ζ_c",
            words="damping ratio of a dashpot between mass and wall",
            low=0.0,
            high=inf,
            usual=(0.0, 0.1),
            neutral=0.0,
        ),
    ),
)


def _ratio(direction: str, symbol: str) -> Parameter:
    return Parameter(
        name=f"static_ratio_{direction}",
        symbol=symbol,
        words=f"static over kinetic friction force, for a start {direction} in z",
        low=1.0,
        high=inf,
        usual=(1.0, 1.5),
        neutral=1.0,
    )


BREAKAWAY = Term(
    name="breakaway",
    words="break-away force",
    equation="-mu_down beta <= n <= mu_up beta in a stop (thesis eq. 2.4 with one mu for both directions)",
    parameters=(_ratio("up", "μ_up"), _ratio("down", "μ_down")),
    excludes=frozenset({"stribeck", "dahl", "bouc-wen", "lugre", "rate-state"}),
)

COMPLIANCE = Term(
    name="compliance",
    words="elastic contact (Jenkins)",
    equation="n' = kappa v while |n| < beta, n = s beta in slip",
    parameters=(STIFFNESS,),
    kind="elastic",
    excludes=YIELDING - {"compliance"} | {"stribeck", "logarithm"},
)

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
