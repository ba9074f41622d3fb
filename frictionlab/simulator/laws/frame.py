"""The frame's own dashpot, between mass and base: it goes with every law, and a free decay measures it."""

from math import inf

from frictionlab.simulator.laws.law import Parameter

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
