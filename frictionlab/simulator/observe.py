"""What two displacement sensors, one on the mass and one on the base, would show of a steady state."""

from dataclasses import dataclass

from frictionlab.simulator.state import Regime, SteadyState

__all__ = ["Observation", "observe"]


@dataclass(frozen=True)
class Observation:
    """The numbers of a measurement, of a motion that is simulated; None where the state has none.

    Parameters
    ----------
    energy_per_cycle : float or None
        Area of the loop of base over mass displacement, over k Y^2, eq. (2.18): the integral of f dx.
    response_amplitude : float or None
        (max - min) / 2 of the mass's displacement over Y.
    stops_per_cycle : float or None
        Stops relative to the wall, per cycle.
    regime : str or None
        "continuous", "stick-slip" or "stuck".
    """

    energy_per_cycle: float | None
    response_amplitude: float | None
    stops_per_cycle: float | None
    regime: Regime | None


def observe(state: SteadyState) -> Observation:
    """Return what sensors would show of a steady state.

    Examples
    --------
    >>> from frictionlab.simulator import Problem, steady_state
    >>> state = steady_state(Problem(0.5, 0.2, wall="base"))
    >>> round(observe(state).energy_per_cycle / state.contact_energy_per_cycle, 12)
    4.0
    """
    return Observation(state.energy_per_cycle, state.response_amplitude, state.stops_per_cycle, state.regime)
