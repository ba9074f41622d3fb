"""The thesis's own method, kept by name: event-driven RK45 and brentq, cycle after cycle from rest (section 3.3).

Its flowchart (Fig. 3.1): where |x - cos tau| > mu beta the mass slides and RK45 runs until the velocity is zero; else
it sticks and brentq finds when (3.2) lets it go. One hundred cycles count as steady, the last one is evaluated. Both
energies are integrated along, so that the numbers are as good as the integration; the README tells how good that is.
"""

from dataclasses import dataclass, field
from math import cos, hypot, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator.problem import Problem

__all__ = ["ThesisRun", "thesis_run"]

TURN = 2.0 * pi
MARGIN = 1e-9  # the thesis's epsilon (rad): a slide starts so long after its release, lest the event end it at once
MOST_EVENTS = 5000  # per cycle
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ThesisRun:
    """The last cycle of a run of the thesis's method, and whether it had settled.

    Parameters
    ----------
    problem : Problem
        What moves.
    cycles : int
        Cycles run from rest.
    time : ndarray of shape (n,)
        The integrator's own times in the last cycle, rad from its start.
    displacement, velocity : ndarray of shape (n,)
        State relative to the wall at these times, over Y.
    energy_input, energy_dissipated : float
        Work of the force, and of friction and dashpot, in the last cycle, over k Y^2.
    stops : int
        Sticks begun in the last cycle.
    stuck_time : float
        Time stuck in the last cycle, rad.
    drift : float
        Distance (z, r z') of the end of the last cycle from its start.
    """

    problem: Problem
    cycles: int
    time: Floats
    displacement: Floats
    velocity: Floats
    energy_input: float
    energy_dissipated: float
    stops: int
    stuck_time: float
    drift: float

    @property
    def loop_area(self) -> float:
        """Energy by the hysteresis loop (2.18) over the integrator's own points: what the thesis plots."""
        force = _force(self.problem, self.time)
        return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(self.displacement)))


@dataclass
class _RestRun:
    """A run in progress: state, and what the present cycle has collected."""

    problem: Problem
    rtol: float
    atol: float
    tau: float = 0.0
    state: Floats = field(default_factory=lambda: np.zeros(4))  # z, v, energy put in, energy dissipated
    slid: bool = False
    stops: int = 0
    stuck_time: float = 0.0
    times: list[Floats] = field(default_factory=list)
    states: list[Floats] = field(default_factory=list)


def thesis_run(problem: Problem, *, cycles: int = 100, rtol: float = 1e-3, atol: float = 1e-6) -> ThesisRun:
    """Run the thesis's method: RK45 with events from rest, and return its last cycle.

    Parameters
    ----------
    problem : Problem
        What moves.
    cycles : int
        N_cyc of the thesis; its friction runs have 100, its viscous ones 50.
    rtol, atol : float
        Tolerances of RK45; the defaults are those of `scipy.integrate.solve_ivp`, and so of the thesis.

    Raises
    ------
    SimulationError
        If the number of cycles is not positive, or the events of a cycle do not end.
    UsageError
        The thesis did not simulate such a contact.

    Examples
    --------
    >>> run = thesis_run(Problem(r=0.5, beta=0.4), cycles=20)
    >>> round(run.energy_input, 2), run.stops
    (2.13, 2)
    """
    if cycles < 1:
        raise SimulationError(f"thesis run: cycles; expected >= 1; got {cycles}")
    _check_law(problem)
    run = _RestRun(problem, rtol, atol)
    start = run.state.copy()
    for _ in range(cycles):
        start = run.state.copy()
        run.tau, run.stops, run.stuck_time, run.times, run.states = 0.0, 0, 0.0, [], []
        _one_cycle(run)
    work = run.state - start
    states = np.concatenate(run.states, axis=1)
    return ThesisRun(
        problem=problem,
        cycles=cycles,
        time=np.concatenate(run.times),
        displacement=states[0],
        velocity=states[1],
        energy_input=float(work[2]),
        energy_dissipated=float(work[3]),
        stops=run.stops,
        stuck_time=run.stuck_time,
        drift=hypot(float(work[0]), problem.r * float(work[1])),
    )


def _check_law(problem: Problem) -> None:
    """Refuse what the thesis did not simulate."""
    up, down = problem.static_ratios
    if problem.law.kind != "rigid" or problem.law.has("place") or up != down or problem.frame_damping_ratio:
        frame = ", frame_damping_ratio" if problem.frame_damping_ratio else ""
        raise UsageError(
            f"thesis run: law {problem.law.name}{frame}; expected Coulomb friction with one static ratio and a dashpot "
            "beside it; got more; do: use another solver"
        )


def _one_cycle(run: _RestRun) -> None:
    """Carry the run over one cycle of the drive, phase by phase."""
    hold = run.problem.mu * run.problem.beta
    for _ in range(MOST_EVENTS):
        if run.tau >= TURN:
            return
        pull = float(_force(run.problem, np.array([run.tau]))[0]) - run.state[0]
        if run.state[1] == 0.0 and abs(pull) <= hold:
            _stick(run, hold)
        else:
            _slide(run, float(np.sign(run.state[1] or pull)), pull)
    raise SimulationError(
        f"thesis run: events without end: r = {run.problem.r!r}, beta = {run.problem.beta!r}, "
        f"tau = {run.tau!r}; "
        f"expected fewer than {MOST_EVENTS} phases per cycle; got more; "
        "do: tighten rtol and atol, or use solver 'exact'"
    )


def _slide(run: _RestRun, side: float, pull: float) -> None:
    """Integrate a slide until the velocity is zero or the cycle ends; from rest it starts epsilon later, moving."""
    from scipy.integrate import solve_ivp  # noqa: PLC0415 - 0.6 s that the exact solver does not need

    p = run.problem
    if run.state[1] == 0.0 and run.tau + MARGIN < TURN:
        run.state[1] = (pull - p.beta * side) / p.r**2 * MARGIN
        run.tau += MARGIN
    harmonics = list(enumerate(zip(*p.force, strict=True), 1))

    def derivative(tau: float, y: Floats) -> tuple[float, float, float, float]:
        force = 0.0
        for k, (a, b) in harmonics:
            force += a * cos(k * tau) + (b * sin(k * tau) if b else 0.0)
        acceleration = (force - y[0] - p.beta * side - 2.0 * p.zeta * p.r * y[1]) / p.r**2
        return y[1], acceleration, force * y[1], p.beta * side * y[1] + 2.0 * p.zeta * p.r * y[1] ** 2

    def at_rest(_tau: float, y: Floats) -> float:
        return float(y[1])

    rest: Any = at_rest
    rest.terminal, rest.direction = True, -side
    integrate: Any = solve_ivp
    answer = integrate(derivative, (run.tau, TURN), run.state, method="RK45", rtol=run.rtol, atol=run.atol, events=rest)
    run.times.append(answer.t)
    run.states.append(answer.y)
    run.tau, run.state, run.slid = float(answer.t[-1]), answer.y[:, -1].copy(), True
    if answer.status == 1:
        run.state[1] = 0.0


def _stick(run: _RestRun, hold: float) -> None:
    """Hold the mass until the force overcomes static friction (3.2): a scan for the bracket, then brentq."""
    from scipy.optimize import brentq  # noqa: PLC0415 - heavy, needed by this method alone

    position = float(run.state[0])

    def excess(tau: float) -> float:
        return float(abs(_force(run.problem, np.array([tau]))[0] - position)) - hold

    grid = np.linspace(run.tau, TURN, 400 * run.problem.base.harmonics)
    over = np.flatnonzero(np.abs(_force(run.problem, grid) - position) > hold)
    end = TURN
    if over.size:
        low = float(grid[max(0, over[0] - 1)])
        end = float(brentq(excess, low, float(grid[over[0]]))) + MARGIN if excess(low) < 0.0 else low + MARGIN
    end = min(end, TURN)
    run.stops += run.slid
    run.stuck_time += end - run.tau
    run.times.append(np.array([run.tau, end]))
    run.states.append(np.column_stack((run.state, run.state)))
    run.tau, run.slid = end, False


def _force(problem: Problem, tau: Floats) -> Floats:
    """Return the force F at times tau."""
    cosine, sine = problem.force
    total = np.zeros_like(tau)
    for k, (a, b) in enumerate(zip(cosine, sine, strict=True), 1):
        total += a * np.cos(k * tau) + (b * np.sin(k * tau) if b else 0.0)
    return total
