"""A motion of exact phases, typed as what it is."""

from frictionlab.simulator import Problem, Trajectory, simulate


def phases_of(
    problem: Problem, *, cycles: int, x0: float = 0.0, v0: float = 0.0, keep: int | None = None
) -> Trajectory:
    """As `simulate`, of a rigid contact."""
    run = simulate(problem, cycles=cycles, x0=x0, v0=v0, keep=keep)
    assert isinstance(run, Trajectory)
    return run
