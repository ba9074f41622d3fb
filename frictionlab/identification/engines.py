"""The simulator made ready for a fit: compiled where that is worth it, machine code at hand before a clock begins."""

from functools import cache

from frictionlab.identification.family import Family
from frictionlab.simulator import Problem, steady_state
from frictionlab.simulator.engine import choose
from frictionlab.simulator.laws import Law

STATES, WAITED = 150, 20.0  # simulated for one fit, and how much longer each takes where rest's motion is waited for
ELASTIC_PHASES = 200.0  # of one steady state of an elastic contact of usual stiffness, times r
WARMED: dict[str, tuple[str, dict[str, float]]] = {  # a cheap problem of each kind
    "rigid": ("coulomb", {}),
    "elastic": ("coulomb+compliance", {"stiffness_ratio": 3.0}),
    "numeric": ("coulomb+stribeck", {"static_ratio": 1.4, "stribeck_speed": 0.2}),
}


def prepare(family: Family, states: int) -> None:
    """Load the compiled simulator if so many steady states are worth it; it changes nothing but their time."""
    waits = WAITED if family.law.has("breakaway") else 1.0
    choose(states * waits * (10.0 + 4.0 / family.r))
    if family.law.kind == "elastic":
        from frictionlab.simulator.elastic import engine as elastic_engine  # noqa: PLC0415 - 20 ms, for such laws alone

        elastic_engine.choose(states * ELASTIC_PHASES / family.r)
    elif family.law.kind != "rigid" and states >= STATES:
        from frictionlab.simulator.numeric import machine  # noqa: PLC0415 - as above

        machine.compiled()  # in plain Python a state of these takes a quarter of a second


@cache
def _warmed(kind: str) -> None:
    law, values = WARMED[kind]
    steady_state(Problem(0.5, 0.4, law=law, parameters=values))


def warm(law: Law) -> None:
    """Have one cheap steady state of a law's kind solved: machine code is made or loaded at the first call."""
    _warmed("elastic" if law.kind == "elastic" else "rigid" if law.kind == "rigid" else "numeric")
