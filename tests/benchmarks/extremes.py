"""Contact laws at the edges of what can be asked: solved, refused by name, or too long; and how long each took.

    python -m tests.benchmarks.extremes [LAW ...]

Each line is one law with one number at an extreme, at r from 1e-3 to 100 and friction ratios from 1e-12 to 1e6. The
points run one by one in a process beside this one, which is ended after `LONGEST` seconds of processor time.
"""

import itertools
import multiprocessing
import resource
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np

from frictionlab.errors import SimulationError
from frictionlab.simulator import Problem, steady_state
from frictionlab.simulator.sweep import warm_up

RATIOS = (1e-3, 0.03, 0.3, 0.5, 1.0, 1.7, 100.0)
FRICTION = (1e-12, 1e-3, 0.4, 1e6)
LONGEST = 10.0  # s of processor time for one point
LOOSE = 1e-6  # of the energy: a closure error above it is counted
PLACE, SPEED, HOLD = "gradient", "contact_damping_ratio", "static_ratio_up"
BREAKAWAY = {HOLD: 1.2, "static_ratio_down": 1.2}
Numbers = Mapping[str, float]
LAWS: dict[str, tuple[Numbers, tuple[Numbers, ...]]] = {  # usual numbers, and the extremes that replace some of them
    "coulomb": ({}, ({}, {"frame_damping_ratio": 10.0})),
    "coulomb+speed": ({SPEED: 0.05}, ({SPEED: 1e-12}, {SPEED: 100.0})),
    "coulomb+place": ({PLACE: 0.05}, tuple({PLACE: q} for q in (-3.0, -2.0, -0.9, 1e-9, 0.9, 3.0))),
    "coulomb+breakaway": (
        BREAKAWAY,
        ({HOLD: 10.0, "static_ratio_down": 10.0}, {HOLD: 10.0, "static_ratio_down": 1.0}, {HOLD: 1.0 + 1e-9}),
    ),
    "coulomb+place+speed+breakaway": (
        BREAKAWAY | {PLACE: 0.05, SPEED: 0.05},
        ({}, {PLACE: -2.0, HOLD: 10.0}, {PLACE: 0.9, SPEED: 1e-9, "frame_damping_ratio": 10.0}),
    ),
    "coulomb+compliance": (
        {"stiffness_ratio": 100.0},
        (*({"stiffness_ratio": k} for k in (1e-3, 1.0, 1e3, 1e6, 1e9)), {"frame_damping_ratio": 10.0}),
    ),
    "coulomb+compliance+place+breakaway": (
        BREAKAWAY | {PLACE: 0.05, "stiffness_ratio": 100.0},
        (
            {},
            {PLACE: -2.0},
            {PLACE: 0.9, "stiffness_ratio": 1e6},
            {HOLD: 10.0, "static_ratio_down": 10.0},
            {HOLD: 10.0, "static_ratio_down": 10.0, "stiffness_ratio": 1e9},
        ),
    ),
    "coulomb+iwan": (
        {"stiffness_ratio": 50.0, "sliders": 12.0, "chi": -0.5},
        ({"sliders": 100.0}, {"stiffness_ratio": 1e6}, {"chi": -0.999, "stiffness_ratio": 1e-3}),
    ),
    "coulomb+stribeck": (
        {"static_ratio": 1.2, "stribeck_speed": 0.1, "stribeck_exponent": 2.0},
        ({"stribeck_speed": 1e-6}, {"static_ratio": 10.0}, {"static_ratio": 10.0, "stribeck_speed": 1e-6}),
    ),
    "coulomb+logarithm": (
        {"rate_strength": 0.05, "rate_speed": 0.1},
        ({"rate_strength": 1.0, "rate_speed": 1e-6}, {"rate_strength": -0.05}),
    ),
    "coulomb+dahl": ({"stiffness_ratio": 100.0}, tuple({"stiffness_ratio": k} for k in (1e-3, 1e6, 1e9))),
    "coulomb+bouc-wen": (
        {"stiffness_ratio": 100.0, "exponent": 2.0},
        ({"exponent": 1000.0}, {"stiffness_ratio": 1e9, "exponent": 1.0}, {"stiffness_ratio": 1e-3, "exponent": 5.0}),
    ),
    "coulomb+lugre": (
        {"stiffness_ratio": 100.0, "bristle_damping": 0.1, "static_ratio": 1.2, "stribeck_speed": 0.1},
        ({"stiffness_ratio": 1e6}, {"stribeck_speed": 1e-6}, {"static_ratio": 10.0}, {"bristle_damping": 1e3}),
    ),
    "coulomb+rate-state": (
        {
            "direct_effect": 0.05,
            "evolution_effect": 0.02,
            "slip_distance": 0.02,
            "reference_speed": 0.1,
            "stiffness_ratio": 50.0,
        },
        (
            {"evolution_effect": 0.2},
            {"slip_distance": 1e-6},
            {"slip_distance": 1e-6, "evolution_effect": 0.2},
            {"stiffness_ratio": 1e6},
            {"direct_effect": 1e-6, "evolution_effect": 0.0},
        ),
    ),
}


@dataclass(frozen=True)
class Answer:
    """What became of a point: outcome, seconds of processor time, closure error over the energy."""

    outcome: str
    seconds: float
    off: float = 0.0


def problems(law: str, extreme: Numbers) -> Iterator[Problem]:
    """The points of a line."""
    usual, _ = LAWS[law]
    for r, beta in itertools.product(RATIOS, FRICTION):
        yield Problem(r, beta, law=law, parameters={**usual, **extreme})


def answer(problem: Problem) -> Answer:
    """Solve one point."""
    begun = time.process_time()
    try:
        state = steady_state(problem)
    except SimulationError:
        return Answer("refused", time.process_time() - begun)
    spent = time.process_time() - begun
    if state.outcome == "not found" and state.warnings:
        return Answer("refused", spent)
    energy, amplitude = state.energy_per_cycle or 0.0, state.response_amplitude or 0.0
    off = max(0.0, (state.closure_error or 0.0) - 1e-14 * problem.force_size * amplitude) / max(energy, 1e-300)
    return Answer(state.outcome, spent, off if state.outcome == "periodic" else 0.0)


def work(law: str, given: Connection) -> None:
    """Answer what is asked, one by one, until there is nothing more."""
    warm_up(law)
    answer(next(problems(law, {})))
    given.send(None)
    while (problem := given.recv()) is not None:
        soft = int(time.process_time() + LONGEST) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.RLIM_INFINITY))
        given.send(answer(problem))


class Beside:
    """A process that solves points, begun anew after one that took too long."""

    def __init__(self, law: str) -> None:
        self.law = law
        self.begin()

    def begin(self) -> None:
        """Begin the process."""
        self.pipe, other = multiprocessing.Pipe()
        self.process = multiprocessing.Process(target=work, args=(self.law, other), daemon=True)
        self.process.start()
        other.close()
        self.pipe.recv()

    def ask(self, problem: Problem) -> Answer:
        """Return the answer, or that there was none in time."""
        self.pipe.send(problem)
        try:
            told: Answer = self.pipe.recv()
        except EOFError:
            self.begin()
            return Answer("too long", LONGEST)
        return told


def line(law: str, extreme: Numbers, answers: list[Answer]) -> str:
    """One line of the table."""
    counts = Counter(told.outcome for told in answers)
    seconds = np.array([told.seconds for told in answers])
    loose = sum(told.off > LOOSE for told in answers)
    name = ", ".join(f"{key} {value:g}" for key, value in extreme.items()) or "as usual"
    told = ", ".join(f"{outcome} {count}" for outcome, count in sorted(counts.items()))
    return f"| {law} | {name} | {told} | {loose} | {1e3 * np.median(seconds):.1f} | {1e3 * seconds.max():.0f} |"


def main(laws: tuple[str, ...]) -> None:
    """Print the table."""
    head = f"| law | extreme | outcomes | closure above {LOOSE:g} | median, ms | longest, ms |"
    sys.stdout.write(f"{head}\n|---|---|---|---|---|---|\n")
    for law in laws:
        beside = Beside(law)
        for extreme in LAWS[law][1]:
            answers = []
            for problem in problems(law, extreme):
                answers.append(beside.ask(problem))
                if answers[-1].seconds > 1.0 or answers[-1].off > LOOSE:
                    sys.stderr.write(f"{problem!r}: {answers[-1]}\n")
            sys.stdout.write(line(law, extreme, answers) + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(tuple(sys.argv[1:]) or tuple(LAWS))
