"""The thesis's own method, kept by name: event-driven RK45 and brentq, cycle after cycle from rest (section 3.3).

Its flowchart (Fig. 3.1): where |x - cos tau| > mu beta the mass slides and RK45 runs until the velocity is zero; else
it sticks and brentq finds when (3.2) lets it go. One hundred cycles count as steady, the last one is evaluated. Both
energies are integrated along, so that the numbers are as good as the integration; the README says how good that is.
"""

from math import cos, hypot, pi, sin
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator.problem import Base, Problem
from frictionlab.simulator.state import SETTLED, SteadyState

TURN = 2.0 * pi
MARGIN = 1e-9  # the thesis's epsilon (rad): a slide starts so long after its release, lest the event end it at once
MOST_EVENTS = 5000  # per cycle


def thesis_run(problem: Problem, *, cycles: int = 100, rtol: float = 1e-3, atol: float = 1e-6) -> SteadyState:
    """Run the thesis's method, RK45 with events from rest, and return its last cycle; "not settled" if it was not.

    Parameters
    ----------
    problem : Problem
        What moves.
    cycles : int
        N_cyc of the thesis; its friction runs have 100, its viscous ones 50.
    rtol, atol : float
        Tolerances of RK45; the defaults are those of `scipy.integrate.solve_ivp`, and so of the thesis.

    Returns
    -------
    SteadyState
        Its energy is the one put in (2.16); `closure_error` is what friction and dashpot take less.

    Raises
    ------
    SimulationError
        If the number of cycles is not positive, or the events of a cycle do not end.
    UsageError
        The thesis did not simulate such a contact.

    Examples
    --------
    >>> state = thesis_run(Problem(r=0.5, beta=0.4), cycles=20)
    >>> round(state.energy_per_cycle, 2), state.stops_per_cycle
    (2.13, 2.0)
    """
    if cycles < 1:
        raise SimulationError(f"thesis run: cycles; expected >= 1; got {cycles}")
    up, down = problem.static_ratios
    if problem.law.kind != "rigid" or problem.law.has("place") or up != down or problem.frame_damping_ratio:
        frame = ", frame_damping_ratio" if problem.frame_damping_ratio else ""
        raise UsageError(
            f"thesis run: law {problem.law.name}{frame}; expected Coulomb friction with one static ratio and a dashpot "
            "beside it; got more; do: use another solver"
        )
    last, slid = np.zeros((4, 1)), False
    for _ in range(cycles):
        last, stops, stuck, slid = _one_cycle(problem, last[:, -1], slid=slid, rtol=rtol, atol=atol)
    z, v, put_in, taken = (last[:, -1] - last[:, 0]).tolist()
    drift, amplitude = hypot(z, problem.r * v), 0.5 * float(np.ptp(last[0]))
    moved, settled = amplitude > 0.0, drift <= SETTLED * (1.0 + amplitude)
    loop: float | None = put_in  # of a wall that moves with one harmonic r^2 times its area is put in
    if problem.wall == "base":
        loop = put_in / problem.r**2 if problem.base.harmonics == 1 else None
    return SteadyState(
        problem=problem,
        solver="thesis",
        outcome=("periodic" if settled else "not settled") if moved else "stuck",
        energy_per_cycle=loop,
        contact_energy_per_cycle=put_in,
        frame_energy_per_cycle=0.0,
        response_amplitude=amplitude,
        stops_per_cycle=float(stops),
        stuck_fraction=stuck / TURN,
        regime=("stick-slip" if stops else "continuous") if moved else "stuck",
        period_cycles=1 if settled else None,
        closure_error=abs(put_in - taken),
        residual=drift,
    )


def _one_cycle(
    problem: Problem, start: FloatArray, *, slid: bool, rtol: float, atol: float
) -> tuple[FloatArray, int, float, bool]:
    """Carry the state over one cycle of the drive, phase by phase.

    Returns the states (4, n) at the integrator's times (displacement and velocity relative to the wall, work of the
    force, and of friction and dashpot), sticks begun, time stuck, and whether it slides at the end.
    """
    hold, force, states = problem.mu * problem.beta, Base(*problem.force), [start[:, None]]
    tau, state, stops, stuck = 0.0, start, 0, 0.0
    while tau < TURN:
        pull = float(force.at(tau)) - state[0]
        if state[1] == 0.0 and abs(pull) <= hold:
            end = _release(force, float(state[0]), tau, hold)
            stops, stuck, slid, tau = stops + slid, stuck + end - tau, False, end
        else:
            slid = True
            times, found = _slide(problem, tau, state, pull, rtol, atol)
            states.append(found)
            tau, state = float(times[-1]), found[:, -1]
        if stops + len(states) > MOST_EVENTS:
            raise SimulationError(
                f"thesis run: events without end: r = {problem.r!r}, beta = {problem.beta!r}, tau = {tau!r}; expected "
                f"fewer than {MOST_EVENTS} phases per cycle; got more; do: tighten rtol and atol, or use solver 'exact'"
            )
    return np.concatenate(states, axis=1), stops, stuck, slid


def _slide(
    p: Problem, tau: float, state: FloatArray, pull: float, rtol: float, atol: float
) -> tuple[FloatArray, FloatArray]:
    """Integrate a slide until the velocity is zero or the cycle ends; from rest it starts epsilon later, moving."""
    from scipy.integrate import solve_ivp  # noqa: PLC0415 - 0.6 s that the exact solver does not need

    side, state = float(np.sign(state[1] or pull)), state.copy()
    if state[1] == 0.0 and tau + MARGIN < TURN:
        state[1] = (pull - p.beta * side) / p.r**2 * MARGIN
        tau += MARGIN
    harmonics = list(enumerate(zip(*p.force, strict=True), 1))

    def derivative(tau: float, y: FloatArray) -> tuple[float, float, float, float]:
        force = 0.0
        for k, (a, b) in harmonics:
            force += a * cos(k * tau) + (b * sin(k * tau) if b else 0.0)
        n = p.beta * side + 2.0 * p.zeta * p.r * y[1]
        return y[1], (force - y[0] - n) / p.r**2, force * y[1], n * y[1]

    rest: Any = lambda _tau, y: float(y[1])  # noqa: E731
    rest.terminal, rest.direction = True, -side
    integrate: Any = solve_ivp
    answer = integrate(derivative, (tau, TURN), state, method="RK45", events=rest, rtol=rtol, atol=atol)
    if answer.status == 1:
        answer.y[1, -1] = 0.0
    return answer.t, answer.y


def _release(force: Base, position: float, tau: float, hold: float) -> float:
    """When the force overcomes static friction (3.2), or the cycle ends: a scan for the bracket, then brentq."""
    from scipy.optimize import brentq  # noqa: PLC0415 - heavy, needed by this method alone

    def excess(tau: FloatArray | float) -> Any:
        return np.abs(force.at(tau) - position) - hold

    grid = np.linspace(tau, TURN, 400 * force.harmonics)
    over = np.flatnonzero(excess(grid) > 0.0)
    if not over.size:
        return TURN
    low = float(grid[max(0, over[0] - 1)])
    go = float(brentq(excess, low, float(grid[over[0]]))) if excess(low) < 0.0 else low
    return min(go + MARGIN, TURN)
