"""Where rigid steady states were missed once, at fresh random points, each held to a long direct run of another method.

    python -m tests.benchmarks.holes [POINTS] [SEED] [HOLE ...]

An answer is wrong if the direct run (`direct`) from it does not come back, has another energy, period or multiplier, or
if the direct run from rest goes elsewhere. Named: no orbit is told, and why is said.
"""

import sys
import time
from collections import Counter
from collections.abc import Callable
from math import pi

import numpy as np

from frictionlab.simulator import Base, Problem, SteadyState, steady_state
from frictionlab.simulator.sweep import warm_up
from tests.benchmarks import direct

Rng = np.random.Generator
BACK = 1e-8  # of the orbit's size
ROUNDING = 1e-15  # of the size: what both methods leave of an energy near 0
THERE = 1e-5
FORGOTTEN = 1e-7  # what is left of a start
WAIT, LONGEST = 1000, 20_000  # cycles of the run from rest
REST = 1500
NEARLY = 0.15  # how well a creep is known by its leading term
MULTIPLIER = 1e-4  # of itself, or of 1 if that is more: what differences leave of it
Verdict = tuple[str, str]


def power(rng: Rng, low: float, high: float) -> float:
    return float(10.0 ** rng.uniform(low, high))


def _series(rng: Rng, share: float = 0.4) -> Base:
    """A base with harmonics 2 and 3."""
    c, s = share * rng.uniform(-1, 1, 2), share * rng.uniform(-1, 1, 3)
    return Base((1.0, *map(float, c)), tuple(map(float, s)))


def _beside(rng: Rng, low: float, high: float) -> float:
    """One, less or more 10^low to 10^high."""
    return 1.0 + float(rng.choice([-1.0, 1.0])) * power(rng, low, high)


def _harmonic_beside(rng: Rng, high: float, mu: tuple[float, float] = (1.0, 1.0)) -> Problem:
    """A harmonic at least 1e-13 from resonance, friction too weak to stop its motion, or nearly."""
    base, n = _series(rng), int(rng.integers(1, 4))
    drive = float(np.hypot(base.cosine[n - 1], base.sine[n - 1]))
    r = _beside(rng, -13, high) / n
    friction = 0.25 * pi * drive * float(rng.uniform(0.02, 1.3)) + 1e-3
    return Problem(r, friction, float(rng.uniform(*mu)) if mu[1] > 1.0 else 1.0, base=base)


def _near(rng: Rng) -> Problem:
    """A harmonic 1e-8 to 1e-1 from resonance."""
    problem = _harmonic_beside(rng, -8)
    return problem._but(r=_beside(rng, -8, -1) / round(1.0 / problem.r))


def _displaced(rng: Rng, *, below: bool) -> Problem:
    """Even harmonics, friction between half the force's range and its maximum, or just below that half."""
    base = _series(rng, 0.5)
    f = base.at(np.linspace(0.0, 2 * pi, 20001))
    half, top, r = 0.5 * float(np.ptp(f)), float(np.abs(f).max()), power(rng, -1, 0.5)
    more = -half * power(rng, -6, -0.5) if below else float(rng.uniform(0, 1)) * (top - half)
    return Problem(r, half + more, base=base)


def _uneven(rng: Rng, most: float) -> dict[str, float]:
    return {f"static_ratio_{way}": float(rng.uniform(1.0, most)) for way in ("up", "down")}


def _all_terms(rng: Rng) -> Problem:
    """All rigid terms together, harmonics and either wall."""
    p = _uneven(rng, 1.5)
    p |= {"gradient": float(rng.uniform(-0.15, 0.15)), "contact_damping_ratio": float(rng.uniform(0, 0.1))}
    moves = rng.random() < 0.5
    r, beta = power(rng, -0.8, 0.4), float(rng.uniform(0.05, 0.9))
    frame, law = float(rng.uniform(0.0, 0.03)), "coulomb+place+speed+breakaway"
    base, size, wall = _series(rng, 0.15), r * r if moves else 1.0, "base" if moves else "fixed"
    return Problem(r, beta * size, wall=wall, base=base, law=law, parameters=p, frame_damping_ratio=frame)  # type: ignore[arg-type]


HOLES: dict[str, Callable[[Rng], Problem]] = {
    # at resonance, friction just above what the drive overcomes; beside it on either side of that
    "vanishing stops": lambda g: Problem(1.0, 0.25 * pi * (1.0 + power(g, -14, -1))),
    "vanishing stops beside": lambda g: Problem(_beside(g, -14, -3), 0.25 * pi * _beside(g, -14, -2)),
    "static friction": lambda g: Problem(power(g, -0.8, 0.2), power(g, -1.5, -0.2), float(g.uniform(1.05, 4.0))),
    "uneven static friction": lambda g: Problem(
        power(g, -0.8, 0.2), power(g, -1.2, -0.1), law="coulomb+breakaway", parameters=_uneven(g, 2.0)
    ),
    "static friction, harmonics": lambda g: Problem(
        power(g, -0.8, 0.2), power(g, -1.5, -0.2), float(g.uniform(1.05, 3.0)), base=_series(g, 0.2)
    ),
    "harmonics beside resonance": lambda g: _harmonic_beside(g, -8),
    "harmonics near resonance": _near,
    "static friction beside resonance": lambda g: _harmonic_beside(g, -2, (1.01, 2.0)),
    "cosine, static friction, beside": lambda g: Problem(
        _beside(g, -13, -2), 0.25 * pi * float(g.uniform(0.02, 1.2)), float(g.uniform(1.01, 2.0))
    ),
    "displaced rest": lambda g: _displaced(g, below=False),
    "displaced rest below": lambda g: _displaced(g, below=True),
    "place beside resonance": lambda g: Problem(
        *(_beside(g, -12, -2), float(g.uniform(0.1, 1.0))),
        law="coulomb+place",
        parameters={"gradient": float(g.choice([-1.0, 1.0])) * power(g, -6, -0.8)},
    ),
    "all terms": _all_terms,
}


def start_of(state: SteadyState) -> tuple[float, float]:
    """The orbit at tau = 0, relative to the wall."""
    assert state.orbit is not None
    z, v = (float(value) for value in state.orbit.at(0.0))
    if state.problem.wall == "base":
        z, v = z - float(state.problem.base.at(0.0)), v - float(state.problem.base.rate_at(0.0))
    return z, v


def _faults_of_orbit(problem: Problem, state: SteadyState) -> list[str]:
    """What the direct run from the orbit, over its period, says against it."""
    period, (z, v) = state.period_cycles or 1, start_of(state)
    run = direct.run(problem, period, z, v)
    size = float(np.hypot(z, problem.r * v) + run.path.max())
    away = np.hypot(run.z - z, problem.r * (run.v - v)) / size
    faults = []
    if away[-1] > BACK * max(1.0, abs(state.floquet_multiplier or 0.0)):
        faults.append(f"not back by {away[-1]:.0e}")
    if any(away[part - 1] < BACK for part in range(1, period) if period % part == 0):
        faults.append("period not the shortest")
    if not problem.frame_damping_ratio:
        energy = state.energy_per_cycle or 0.0
        off = abs(float(run.taken.mean()) - energy)
        if off > BACK * energy + ROUNDING * size:
            faults.append(f"energy off by {off:.0e}")
    if abs(float(run.stops.mean()) - (state.stops_per_cycle or 0.0)) > 1e-9:
        faults.append(f"stops {state.stops_per_cycle} for {run.stops.mean()}")
    return faults


def _faults_of_multiplier(problem: Problem, state: SteadyState) -> list[str]:
    """Hold the multiplier to differences of the direct map over a period."""
    period, (z, v) = state.period_cycles or 1, start_of(state)
    around, found = direct.run(problem, period, z, v), []
    size = float(np.hypot(z, problem.r * v) + around.path.max())
    for step in (1e-6 * size, 3e-5 * size, 3e-8 * size):
        ends = []
        for dz, dv in ((step, 0.0), (-step, 0.0), (0.0, step / problem.r), (0.0, -step / problem.r)):
            run = direct.run(problem, period, z + dz, v + dv)
            ends.append((run.z[-1], problem.r * run.v[-1]))
        slopes = np.array([np.subtract(ends[0], ends[1]), np.subtract(ends[2], ends[3])]).T / (2.0 * step)
        slopes = slopes[:1, :1] if v == 0.0 else slopes  # in a stop only the place is free
        found.append(float(np.abs(np.linalg.eigvals(slopes)).max()))
    told = abs(state.floquet_multiplier or 0.0)
    off = min(abs(told - size) for size in found)
    return [f"multiplier {told:.6g}, by differences {found}"] if off > MULTIPLIER * max(1.0, told) else []


def _faults_from_rest(problem: Problem, state: SteadyState) -> list[str]:
    """Where the direct run from rest goes, if other motions may exist and that does not take too long to tell."""
    if problem.mu == 1.0 and not problem.parameter("gradient"):
        return []  # two motions never part: what repeats is the only orbit
    period = state.period_cycles or 1
    rate = abs(state.floquet_multiplier or 0.0) ** (1.0 / period)
    wait = WAIT if rate <= 0.0 else max(WAIT, int(3.0 * np.log(FORGOTTEN) / min(np.log(rate), -1e-12)))
    if wait > LONGEST:
        return ["(not waited for)"]
    run, around = direct.run(problem, wait), direct.run(problem, period, *start_of(state))
    size = float(np.hypot(around.z, problem.r * around.v).max() + around.path.max())
    away = np.hypot(around.z - run.z[-1], problem.r * (around.v - run.v[-1])).min() / size
    return [f"rest goes elsewhere by {away:.0e}"] if away > THERE else []


def _against_rest(problem: Problem, state: SteadyState) -> str:
    """What a run from rest says against a mass that comes to rest.

    At a distance d from the place the crest of the force still pulls by d: with ``F = crest - a t^2 / 2`` the slide
    begins at -T, T^2 = 2 d / a, its velocity is a cubic that returns to 0 at 2 T, and its way is ``9 d^2 / (2 a r^2)``.
    So the distance falls like 1 / N, for ever: a way that is this multiple of d^2 is on its way to that place.
    """
    run, place = direct.run(problem, REST), start_of(state)[0]
    late, early = float(run.path[-1]), float(run.path[REST // 2 - 1])
    left = abs(float(run.z[-1]) - place)
    if late < 1e-6 * problem.beta * 1e-6 or (late < 0.6 * early and left < 1e-9 + 4.0 * REST * late):
        return "" if left < 1e-9 + 4.0 * REST * late else f"stuck at {place}, but rests at {run.z[-1]}"
    creep = _creep(problem, above=float(run.z[-1]) < place) * float(run.z[-1] - place) ** 2
    if abs(late / creep - 1.0) < NEARLY:
        return ""
    return f"stuck at {place}, but {late:.1e} per cycle at {run.z[-1]}, where {creep:.1e} is on the way there"


def _creep(problem: Problem, *, above: bool) -> float:
    """The way of a slide over the square of the distance to rest, from the highest crest or the lowest of the force."""
    tau, k = np.linspace(0.0, 2.0 * pi, 200_001), np.arange(1, problem.base.harmonics + 1)[:, np.newaxis]
    cosine, sine = (np.array(part)[:, np.newaxis] for part in problem.force)
    force = (cosine * np.cos(k * tau) + sine * np.sin(k * tau)).sum(axis=0)
    top = int(np.argmax(force if above else -force))
    bend = -(k * k * (cosine * np.cos(k * tau[top]) + sine * np.sin(k * tau[top]))).sum()
    return 4.5 / (abs(float(bend)) * problem.r**2)


def judge(problem: Problem, state: SteadyState) -> Verdict:
    """What became of a point: "solved", "named", "wrong", ..., and why."""
    if state.outcome == "periodic":
        faults = _faults_of_orbit(problem, state) + _faults_from_rest(problem, state)
        faults += _faults_of_multiplier(problem, state)
        wrong = [fault for fault in faults if not fault.startswith("(")]
        told = "solved" if not faults else "solved, rest not waited for"
        if any("good to about" in said for said in state.warnings):
            told = "solved, warned"
        return ("wrong", "; ".join(wrong)) if wrong else (told, "")
    if state.outcome == "stuck":
        return ("stuck", "") if (why := _against_rest(problem, state)) == "" else ("wrong", why)
    if state.outcome == "unbounded":
        run = direct.run(problem, 400)
        return ("unbounded", "") if run.path[-1] > 1.5 * run.path[199] else ("wrong", "unbounded, but does not grow")
    said = state.warnings[0] if state.warnings else ""
    return ("named", said) if "none was found" not in said and said else ("not found", said)


def main(count: int, seed: int, names: tuple[str, ...]) -> None:
    """Draw, solve, judge, print; the law's compiled kernel is loaded, or made, before anything is timed."""
    warm_up("coulomb")
    for number, (name, hole) in enumerate(HOLES.items()):
        if names and name not in names:
            continue
        rng, counts, longest = np.random.default_rng((seed, number)), Counter[str](), 0.0
        for _ in range(count):
            problem = hole(rng)
            begun = time.process_time()
            state = steady_state(problem)
            longest = max(longest, time.process_time() - begun)
            verdict, why = judge(problem, state)
            counts[verdict] += 1
            if verdict in ("wrong", "not found", "named"):
                exactly = f"r = {problem.r!r}, {problem.parameters}, {problem.base}"
                sys.stderr.write(f"{name}: {verdict}: {why}: {problem.law.name}, {exactly}\n")
        told = ", ".join(f"{key} {value}" for key, value in sorted(counts.items()))
        sys.stdout.write(f"{name:34s} {count} points: {told}; longest {1e3 * longest:.0f} ms\n")
        sys.stdout.flush()


if __name__ == "__main__":
    count, seed = (int(sys.argv[i]) if len(sys.argv) > i else usual for i, usual in ((1, 200), (2, 2211)))
    main(count, seed, tuple(sys.argv[3:]))
