"""The simulator's knobs: solver and tolerance, cycles waited, physics switched on."""

from collections.abc import Callable
from functools import partial

from frictionlab.simulator import Base, Problem, Solver, SteadyState, last_cycle, steady_state, thesis_run
from frictionlab.tradeoff.setting import Setting, Trial, run_trials

# Energy per cycle (r, beta) from 50-digit orbits: tests/extremes/reference/make_orbits.py, rounded to 25 digits.
CONTINUOUS, CONTINUOUS_ENERGY = Problem(0.7, 0.5), 3.488507872497761966686743
STICK_SLIP, STICK_SLIP_ENERGY = Problem(0.5, 0.4), 2.126042266393348841691811
SLOW, SLOW_ENERGY = Problem(0.95, 0.1), 4.070974217426422039358113
DIGITS = "50-digit orbit (tests/extremes/reference)"
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10)
WAITED = (10, 30, 100, 300, 1000, 3000)


def off(truth: float) -> Callable[[object], float]:
    """What judges a steady state, or an energy, by how far its energy is off, relative."""

    def error(result: object) -> float:
        energy = result.energy_per_cycle if isinstance(result, SteadyState) else result
        return abs(float(energy or 0.0) / truth - 1.0) if isinstance(energy, (int, float)) else float("inf")

    return error


def _solved(problem: Problem, truth: float, solver: Solver, *, default: bool = False) -> Trial:
    return Trial(solver, partial(steady_state, problem, solver=solver), off(truth), default)


def _integrated(problem: Problem, truth: float, rtol: float) -> Trial:
    def run() -> float:
        return thesis_run(problem, rtol=rtol, atol=1e-3 * rtol).energy_input

    return Trial(f"thesis, rtol {rtol:.0e}", run, off(truth))


def solver_of_continuous_motion() -> tuple[Setting, ...]:
    """Closed form, exact orbit and the thesis's RK45 where the motion is continuous (r = 0.7, beta = 0.5)."""
    problem, truth = CONTINUOUS, CONTINUOUS_ENERGY
    trials = [_solved(problem, truth, "auto", default=True)]
    trials += [_solved(problem, truth, solver) for solver in ("closed-form", "exact")]
    trials.append(_integrated(problem, truth, 1e-3))
    return run_trials("solver, continuous motion", "energy_per_cycle", DIGITS, trials)


def solver_of_stick_slip() -> tuple[Setting, ...]:
    """The exact orbit and the thesis's RK45 over 100 cycles at its tolerances (r = 0.5, beta = 0.4)."""
    problem, truth = STICK_SLIP, STICK_SLIP_ENERGY
    trials = [_solved(problem, truth, "auto", default=True), _solved(problem, truth, "exact")]
    trials += [_integrated(problem, truth, rtol) for rtol in TOLERANCES]
    return run_trials("solver, stick-slip", "energy_per_cycle", DIGITS, trials)


def cycles_waited() -> tuple[Setting, ...]:
    """Cycles run from rest before the last is read, against the orbit solved for (r = 0.95, beta = 0.1)."""
    trials = [Trial(f"{n} cycles waited", partial(last_cycle, SLOW, cycles=n), off(SLOW_ENERGY)) for n in WAITED]
    trials.append(
        Trial("orbit solved for", partial(steady_state, SLOW, solver="exact"), off(SLOW_ENERGY), default=True)
    )
    return run_trials("cycles waited", "energy_per_cycle", DIGITS, trials)


def physics() -> tuple[Setting, ...]:
    """What each piece of physics costs, and what leaving it out does to a rig that has all of them (r = 0.5)."""
    base = Base((1.0, 0.02, 0.03, 0.0, 0.01), (0.0, 0.01, 0.02, 0.01, 0.0))
    full = Problem(0.5, 0.4, mu=1.2, zeta=0.02, base=base)
    truth = steady_state(full, solver="exact").energy_per_cycle or float("nan")
    settings = {
        "Coulomb friction": Problem(0.5, 0.4),
        "+ damping": Problem(0.5, 0.4, zeta=0.02),
        "+ static ratio": Problem(0.5, 0.4, mu=1.2),
        "+ 5 harmonics": Problem(0.5, 0.4, base=base),
        "+ all three": full,
    }
    trials = [
        Trial(name, partial(steady_state, problem), off(truth), default=name == "Coulomb friction")
        for name, problem in settings.items()
    ]
    return run_trials("physics switched on", "energy_per_cycle", "a rig that has all three, exact orbit", trials)
