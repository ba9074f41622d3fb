"""The terms whose phases are exact, and the stiffness that laws share; their forces stand in the exact flow.

Friction that varies along the path: R. J. Anderson and A. A. Ferri, Behavior of a single-degree-of-freedom system with
a generalized friction law (1990). Sliders side by side: W. D. Iwan; D. J. Segalman's distribution.
"""

from math import inf

from frictionlab.arrays import FloatArray
from frictionlab.simulator.laws.law import STILL, Contact, Parameter, Term, positive

STIFFNESS = positive(
    "stiffness_ratio",
    "κ",
    "tangential contact stiffness over the frame's stiffness k",
    usual=(10.0, 1000.0),
    neutral=inf,
    first=100.0,
    physical="contact_stiffness_n_per_m",
    shown=(1e-3, "N/mm", "stiffness of the contact"),
    determined_by="a smaller amplitude of the base, in which the contact bends more than it slides",
)


def coulomb(_own: FloatArray, side: float, friction: float, _z: float, _v: float, _w: float, _age: float) -> Contact:
    """Plain friction, where the integrated flow is asked for it."""
    return (side * friction, side, 0.0, 0.0, 0.0, side, *STILL)


COULOMB = Term(
    "coulomb",
    "Coulomb friction",
    "n = s beta in sliding, |n| <= beta in a stop; s = sgn v (thesis eqs 2.3, 2.9)",
    (
        Parameter(
            "beta",
            "β",
            "friction ratio, friction force over k Y",
            usual=(0.02, 1.5),
            scale="log",
            neutral=0.0,
            lengths=1,
            physical="friction_coefficient",
        ),
    ),
    contact=coulomb,
)

PLACE = Term(
    "place",
    "friction varying along the path",
    "n = s beta (1 + q z), |n| <= beta (1 + q z) in a stop; z relative to the wall, 0 where the spring is relaxed",
    (
        Parameter(
            "gradient",
            "q",
            "relative change of the friction force over a way of Y",
            low=-inf,
            usual=(-0.1, 0.1),
            neutral=0.0,
            lengths=-1,
            expected=0.03,
            reseated=1.0,
            shown=(0.1, "%/mm", "change of friction along the path"),
            determined_by="a larger amplitude of the base, or several loads in one campaign",
        ),
    ),
    weakens=lambda p: p["gradient"] != 0.0,
    is_even=lambda p: p["gradient"] == 0.0,
)

SPEED = Term(
    "speed",
    "contact dashpot",
    "n = s beta + 2 zeta_c r v, v = dz/dtau; the dashpot stands between mass and wall",
    (
        Parameter(
            "contact_damping_ratio",
            "ζ_c",
            "damping ratio of a dashpot between mass and wall",
            usual=(0.0, 0.1),
            neutral=0.0,
            first=0.02,
            expected=0.03,
            physical="contact_damping_n_s_per_m",
            shown=(1.0, "N s/m", "dashpot in the contact"),
            determined_by="rig.damping_ratio and sensors.lag_s measured, or a test nearer to resonance",
        ),
    ),
)

BREAKAWAY = Term(
    "breakaway",
    "break-away force",
    "-mu_down beta <= n <= mu_up beta in a stop (thesis eq. 2.4 with one mu for both directions)",
    tuple(
        Parameter(
            f"static_ratio_{way}",
            f"μ_{way}",
            f"static over kinetic friction force, for a start {way} in z",
            low=1.0,
            usual=(1.0, 1.5),
            neutral=1.0,
            expected=1.1,
            determined_by="a slower test, in which the mass stops for longer",
        )
        for way in ("up", "down")
    ),
    weakens=lambda p: (p["static_ratio_up"] > 1.0) | (p["static_ratio_down"] > 1.0),
    is_even=lambda p: p["static_ratio_up"] == p["static_ratio_down"],
    limit_of="stribeck",
)

COMPLIANCE = Term(
    "compliance",
    "elastic contact (Jenkins)",
    "n' = kappa v while |n| < beta, n = s beta in slip",
    (STIFFNESS,),
    kind="elastic",
)

IWAN = Term(
    "iwan",
    "sliders in parallel (Iwan)",
    "n = sum n_i, each a Jenkins slider; their slip lengths phi are distributed as phi^chi up to phi_max"
    " (Segalman's four-parameter model without its final jump)",
    (
        STIFFNESS,
        Parameter(
            "sliders", "N", "number of sliders", low=1.0, high=200.0, usual=(10.0, 100.0), default=20.0, whole=True
        ),
        Parameter(
            "chi",
            "χ",
            "exponent of the distribution of slip lengths; 0 is an even distribution",
            low=-1.0,
            high=0.0,
            open_low=True,
            usual=(-0.9, 0.0),
            default=0.0,
        ),
    ),
    kind="elastic",
    effort=0,
)
