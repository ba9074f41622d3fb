"""Elastic steady states at random points of every sum of terms, each held to a direct run of another method.

    python -m tests.benchmarks.holes_elastic [POINTS] [SEED] [HOLE ...]

The direct run (`direct_elastic`) begins at rest with relaxed sliders and is followed until the orbit's multiplier says
that the start is forgotten; then it must be on the orbit, with its energy and stops, and the multiplier must be that of
the direct map by differences.
"""

import sys
from collections.abc import Callable

import numpy as np

from frictionlab.simulator import Base, Problem, SteadyState
from tests.benchmarks import direct_elastic as direct
from tests.benchmarks.holes import MULTIPLIER, Rng, Verdict, main, off_multiplier, power, start_of

FORGOTTEN = 1e-11  # what is left of a start
THERE = 1e-7  # of the orbit's size
FEW, MOST = 40, 3000  # cycles followed
STEP = 1e-6  # of the size, for differences

TERMS = {
    "place": lambda rng: {"gradient": float(rng.uniform(-0.15, 0.15))},
    "speed": lambda rng: {"contact_damping_ratio": power(rng, -3, -0.5)},
    "breakaway": lambda rng: {
        "static_ratio_up": float(rng.uniform(1.0, 1.6)),
        "static_ratio_down": float(rng.uniform(1.0, 1.6)),
    },
}


def _contact(rng: Rng, kind: str, *terms: str, uneven: bool = False) -> Problem:
    """A contact with these terms, any stiffness in use; uneven: harmonics, either wall, a damped frame."""
    p = {"stiffness_ratio": power(rng, 0.0, 3.0)}
    p |= {"sliders": float(rng.integers(2, 9)), "chi": float(rng.uniform(-0.8, 0.0))} if kind == "iwan" else {}
    for term in terms:
        p |= TERMS[term](rng)
    r, beta = power(rng, -0.7, 0.4), power(rng, -1.5, 0.0)
    law = "+".join(("coulomb", kind, *terms))
    if not uneven:
        return Problem(r, beta, law=law, parameters=p)
    moves = bool(rng.random() < 0.5)
    base = Base((1.0, *map(float, rng.uniform(-0.3, 0.3, 4))), tuple(map(float, rng.uniform(-0.3, 0.3, 5))))
    beta, frame = beta * (r * r if moves else 1.0), power(rng, -3, -1)
    return Problem(
        r, beta, wall="base" if moves else "fixed", base=base, law=law, parameters=p, frame_damping_ratio=frame
    )


def one_slider(rng: Rng) -> Problem:
    """One slider alone."""
    return _contact(rng, "compliance")


def one_slider_breakaway(rng: Rng) -> Problem:
    """With static friction by direction."""
    return _contact(rng, "compliance", "breakaway")


def one_slider_all_terms(rng: Rng) -> Problem:
    """All terms, five harmonics, either wall, a damped frame."""
    return _contact(rng, "compliance", "place", "speed", "breakaway", uneven=True)


def one_slider_hardly_slips(rng: Rng) -> Problem:
    """Friction just below what holds the contact for ever."""
    problem = _contact(rng, "compliance")
    kappa, r = problem.parameter("stiffness_ratio"), problem.r
    return problem.with_parameters({"beta": kappa / abs(1.0 + kappa - r * r) * (1.0 - power(rng, -6, -1))})


def one_slider_beside_resonance(rng: Rng) -> Problem:
    """Beside the resonance of the slipping mass, friction strong enough to bound it."""
    r = 1.0 + float(rng.choice([-1.0, 1.0])) * power(rng, -12, -2)
    p = {"stiffness_ratio": power(rng, 0.0, 3.0)}
    return Problem(r, float(rng.uniform(0.8, 1.0)), law="coulomb+compliance", parameters=p)


def sliders(rng: Rng) -> Problem:
    """Several sliders alone."""
    return _contact(rng, "iwan")


def sliders_breakaway(rng: Rng) -> Problem:
    """Several with static friction by direction."""
    return _contact(rng, "iwan", "breakaway")


def sliders_place(rng: Rng) -> Problem:
    """Several on a path that varies."""
    return _contact(rng, "iwan", "place")


def sliders_all_terms(rng: Rng) -> Problem:
    """Several, all terms, five harmonics, either wall, a damped frame."""
    return _contact(rng, "iwan", "place", "speed", "breakaway", uneven=True)


HOLES: tuple[Callable[[Rng], Problem], ...] = (
    one_slider,
    one_slider_breakaway,
    one_slider_all_terms,
    one_slider_hardly_slips,
    one_slider_beside_resonance,
    sliders,
    sliders_breakaway,
    sliders_place,
    sliders_all_terms,
)


def judge(problem: Problem, state: SteadyState) -> Verdict:
    """What became of a point, and why."""
    if state.outcome not in ("periodic", "stuck"):
        said = state.warnings[0] if state.warnings else ""
        return ("named", said) if said and "none was found" not in said else (state.outcome, said)
    period = state.period_cycles or 1
    rate = abs(state.floquet_multiplier or 0.0) ** (1.0 / period)
    wait = FEW if rate <= 0.0 else max(FEW, int(np.log(FORGOTTEN) / min(np.log(rate), -1e-12)))
    if wait > MOST or rate >= 1.0:
        return f"{state.outcome}, not waited for", ""
    run = direct.run(problem, period * (wait // period + 2))
    while len(run.path) < MOST and _again(run, period) > FORGOTTEN:  # far from the orbit it may take longer
        run = direct.run(problem, 3 * len(run.path))
    faults = [*_faults(problem, state, run), *([] if state.outcome == "stuck" else _multiplier(problem, state, run))]
    return ("wrong", "; ".join(faults)) if faults else (state.outcome, "")


def _faults(problem: Problem, state: SteadyState, run: direct.Run) -> list[str]:
    """What the last period of a run from rest says against a state.

    Sliders that never slip hold what the motion from rest has left in them. Without a gradient that only shifts the
    orbit, by any constant that the sliders can hold: then the place is not compared.
    """
    period, (z, v) = state.period_cycles or 1, start_of(state)
    late = run.state[-period:]
    size = float(np.abs(late[:, :2]).max() + run.path[-period:].max())
    held = _held(problem, run.slip[-period:])
    apart = late[:, 0] - z if problem.parameter("gradient") or not held.any() else np.zeros(period)
    away = float(np.hypot(apart, problem.r * (late[:, 1] - v)).min()) / size
    faults = [f"rest goes elsewhere by {away:.0e}"] if away > THERE else []
    faults += [f"the run does not repeat by {_again(run, period):.0e}"] if _again(run, period) > THERE else []
    energy = state.energy_per_cycle or 0.0
    off = abs(float(run.put_in[-period:].mean()) - energy)
    if not problem.frame_damping_ratio and off > THERE * energy + 1e-13 * size:
        faults.append(f"energy off by {off / energy if energy else off:.0e}")
    if abs(float(run.stops[-period:].mean()) - (state.stops_per_cycle or 0.0)) > 1e-9 and state.outcome != "stuck":
        faults.append(f"stops {state.stops_per_cycle} for {run.stops[-period:].mean()}")
    return faults


def _again(run: direct.Run, period: int) -> float:
    """By how much the last state differs from the one a period before, over its size."""
    return float(np.abs(run.state[-1] - run.state[-1 - period]).max() / np.abs(run.state[-1]).max())


def _held(problem: Problem, slip: np.ndarray) -> np.ndarray:
    """Which sliders never slip in a period."""
    return np.asarray(slip.sum(axis=0) == 0.0) & np.ones(len(direct.sliders_of(problem)[0]), dtype=bool)


def _multiplier(problem: Problem, state: SteadyState, run: direct.Run) -> list[str]:
    """Hold the multiplier to differences of the direct map over a period.

    A state is free in z, v and the forces of the sliders that hold at its start but slip later on; those that never
    slip go with z, and those that slip already have the force of their limit.
    """
    period, here = state.period_cycles or 1, run.state[-1]
    kappa, beta = direct.sliders_of(problem)
    count, q = len(kappa), problem.parameter("gradient")
    held, slips = _held(problem, run.slip[-period:]), here[2 + count :]
    along = np.zeros(len(here))
    along[0] = 1.0
    along[2 : 2 + count] = np.where(held, kappa, slips * beta * q)
    free = [0, 1, *(2 + i for i in range(count) if not held[i] and slips[i] == 0.0)]
    directions = [along, *np.eye(len(here))[free[1:]]]
    size, found = float(np.abs(here).max() + run.path[-1]), []
    for step in (STEP * size, 30.0 * STEP * size, STEP * size / 30.0):
        ends = [[direct.run(problem, period, here + s * step * d).state[-1][free] for s in (1, -1)] for d in directions]
        slopes = np.array([(ahead - behind) / (2.0 * step) for ahead, behind in ends]).T
        found.append(float(np.abs(np.linalg.eigvals(slopes)).max()))
    return off_multiplier(state, found)


if __name__ == "__main__":
    assert MULTIPLIER > STEP
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 100,
        int(sys.argv[2]) if len(sys.argv) > 2 else 2211,
        tuple(sys.argv[3:]),
        HOLES,
        judge,
        "coulomb+compliance",
    )
