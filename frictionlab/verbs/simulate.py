"""Problem -> steady state."""

from frictionlab.simulator import Problem, Solver, SteadyState, last_cycle, steady_state


def simulate(problem: Problem, *, cycles: int | None = None, solver: Solver = "auto") -> SteadyState:
    """Solve one steady state of the friction oscillator, or run so many cycles from rest.

    Parameters
    ----------
    problem : Problem
        Frequency ratio, contact law and base motion, dimensionless.
    cycles : int, optional
        The last of so many cycles from rest, instead of the steady state that is solved for.
    solver : str
        ``auto``: the closed form where it is valid, else the exact orbit.

    Raises
    ------
    SimulationError
        The problem is outside the solver's domain.

    Examples
    --------
    >>> print(f"{simulate(Problem(r=0.5, beta=0.4)).energy_per_cycle:.10f}")
    2.1260422664
    """
    if cycles is None:
        return steady_state(problem, solver=solver)
    return last_cycle(problem, cycles=cycles, solver=solver)
