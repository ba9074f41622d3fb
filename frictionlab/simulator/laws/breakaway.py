"""A static friction force above the kinetic one, apart in the two directions (thesis eq. 2.4 has one for both)."""

from math import inf

from frictionlab.simulator.laws.law import Parameter, Term


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
