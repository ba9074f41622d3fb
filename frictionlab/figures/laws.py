"""The contact laws side by side: force over displacement and over speed, and the thesis's question of section 4.3.1.

    python -m frictionlab.figures.laws FOLDER

At r = 0.1 Coulomb friction makes several stops a cycle; the thesis asks whether rate-and-state friction makes two.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.motion import force_over_displacement, force_over_speed
from frictionlab.figures.style import BASE, PAGE, PALETTE, look, new_figure, save
from frictionlab.simulator import Problem, SteadyState, steady_state
from frictionlab.simulator.numeric import steady

TURN = 2.0 * np.pi
CONTACT = {"stiffness_ratio": 50.0}
RATE_STATE = CONTACT | {
    "direct_effect": 0.06,
    "evolution_effect": 0.03,
    "slip_distance": 0.02,
    "reference_speed": 0.1,
}
LAWS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "coulomb": {},
        "coulomb+stribeck": {"static_ratio": 1.4, "stribeck_speed": 0.2},
        "coulomb+logarithm": {"rate_strength": 0.08, "rate_speed": 0.02},
        "coulomb+dahl": CONTACT,
        "coulomb+bouc-wen": CONTACT | {"exponent": 3.0},
        "coulomb+lugre": CONTACT | {"bristle_damping": 0.1, "static_ratio": 1.4, "stribeck_speed": 0.2},
        "coulomb+rate-state": RATE_STATE,
    }
)
LOOPS = (0.5, 0.4)  # r and beta at which the laws are drawn
SLOW = (0.1, 0.4)  # r and beta of the thesis's section 4.3.1


@dataclass(frozen=True)
class LawFigures:
    """What the figures draw.

    Parameters
    ----------
    loops : mapping of str to SteadyState
        Law -> steady state at LOOPS.
    slow : tuple of SteadyState
        Coulomb and rate-and-state friction at SLOW.
    """

    loops: Mapping[str, SteadyState]
    slow: tuple[SteadyState, SteadyState]


def compute() -> LawFigures:
    """Solve everything the figures draw."""
    return LawFigures(
        loops={law: solved(law, *LOOPS) for law in LAWS},
        slow=(solved("coulomb", *SLOW), solved("coulomb+rate-state", *SLOW)),
    )


def solved(law: str, r: float, beta: float) -> SteadyState:
    """The steady state under one of the laws, with the parameters drawn here."""
    problem = Problem(r, beta, law=law, parameters=LAWS[law])
    return steady_state(problem) if problem.law.is_exact else steady(problem)


def stops_of(state: SteadyState, ax: Axes, color: str = PALETTE[0]) -> Axes:
    """Draw displacement over phase, the stops thick, and the base's motion behind."""
    phase = np.linspace(0.0, TURN, 2000)
    motion = state.orbit
    if motion is None:
        return ax
    ax.plot(phase / TURN, motion.problem.base.at(phase), color=BASE, linewidth=0.8)
    ax.plot(phase / TURN, motion.at(phase)[0], color=color)
    for begin, end in motion.stops:
        held = np.linspace(begin, end, 50)
        ax.plot(held / TURN, motion.at(held)[0], color="black", linewidth=2.5)
    count = state.stops_per_cycle or 0.0
    ax.set(xlabel="time / cycle", ylabel="displacement x / Y", title=f"{state.problem.law.name}: {count:g} stops")
    return ax


def draw_loops(figures: LawFigures) -> Figure:
    """One column a law: force over displacement above, over speed below."""
    with look():
        figure = new_figure(PAGE, 2.4 * 2)
        axes = figure.subplots(2, len(figures.loops), sharey=True)
        for column, (state, color) in enumerate(zip(figures.loops.values(), PALETTE, strict=False)):
            force_over_displacement(state, axes[0, column], color).set_title(state.problem.law.name.split("+")[-1])
            force_over_speed(state, axes[1, column], color)
        for ax in axes[:, 1:].ravel():
            ax.set_ylabel("")
        return figure


def draw_slow(figures: LawFigures) -> Figure:
    """The question of section 4.3.1: stops at r = 0.1 under Coulomb and under rate-and-state friction."""
    with look():
        figure = new_figure(PAGE, 2.6)
        for ax, state, color in zip(figure.subplots(1, 2, sharey=True), figures.slow, PALETTE, strict=False):
            stops_of(state, ax, color)
        return figure


def main(folder: Path) -> None:
    """Draw all figures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    figures = compute()
    save(draw_loops(figures), folder / "laws_force.png", force=True)
    save(draw_slow(figures), folder / "laws_slow.png", force=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
