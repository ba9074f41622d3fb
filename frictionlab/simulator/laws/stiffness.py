"""The tangential stiffness of the contact: one parameter that every yielding contact has."""

from math import inf

from frictionlab.simulator.laws.law import Parameter

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
