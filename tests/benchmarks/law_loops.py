"""The contact laws side by side: force over displacement and over speed, and the thesis's question of section 4.3.1.

    python -m tests.benchmarks.law_loops FOLDER    # also drawn by make chapter3

At r = 0.1 Coulomb friction makes several stops a cycle; the thesis asks whether rate-and-state friction makes two.
"""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from frictionlab.figures.simulated import draw_contact_force
from frictionlab.figures.style import BASE, PAGE, PALETTE, look, new_figure, save
from frictionlab.simulator import Problem, SteadyState, steady_state

TURN = 2.0 * np.pi
ACROSS = 4  # laws in a row of the figure
CONTACT = {"stiffness_ratio": 50.0}
LAWS: Mapping[str, Mapping[str, float]] = {
    "coulomb": {},
    "coulomb+place": {"gradient": 0.3},
    "coulomb+speed": {"contact_damping_ratio": 0.15},
    "coulomb+breakaway": {"static_ratio_up": 1.6, "static_ratio_down": 1.3},
    "coulomb+compliance": {"stiffness_ratio": 8.0},
    "coulomb+iwan": {"stiffness_ratio": 12.0, "sliders": 20, "chi": -0.4},
    "coulomb+stribeck": {"static_ratio": 1.4, "stribeck_speed": 0.2},
    "coulomb+logarithm": {"rate_strength": 0.08, "rate_speed": 0.02},
    "coulomb+dahl": CONTACT,
    "coulomb+bouc-wen": CONTACT | {"exponent": 3.0},
    "coulomb+lugre": CONTACT | {"bristle_damping": 0.1, "static_ratio": 1.4, "stribeck_speed": 0.2},
    "coulomb+rate-state": CONTACT
    | {"direct_effect": 0.06, "evolution_effect": 0.03, "slip_distance": 0.02, "reference_speed": 0.1},
}
LOOPS = (0.5, 0.4)  # r and beta at which the laws are drawn
SLOW = (0.1, 0.4)  # r and beta of the thesis's section 4.3.1


def solved(law: str, r: float, beta: float) -> SteadyState:
    """The steady state under one of the laws, with the parameters drawn here."""
    return steady_state(Problem(r, beta, law=law, parameters=LAWS[law]))


def name_of(state: SteadyState) -> str:
    """The law's own term; of a lopsided motion in a problem that is not, that the mirror image is a motion as well."""
    name = state.problem.law.name.split("+")[-1]
    return f"{name}, or its mirror image" if state.symmetric is False and state.problem.has_mirror_image else name


def draw_loops(states: Sequence[SteadyState]) -> Figure:
    """A cell a law, ACROSS to a row: force over displacement above, over speed below; all to one scale."""
    rows = -(-len(states) // ACROSS)
    figure = new_figure(PAGE, 2.9 * rows)
    axes = figure.subplots(2 * rows, ACROSS, sharey=True, squeeze=False)
    for number, state in enumerate(states):
        row, column = 2 * (number // ACROSS), number % ACROSS
        color = PALETTE[number // ACROSS % len(PALETTE)]
        draw_contact_force(state, axes[row, column], color).set_title(name_of(state))
        draw_contact_force(state, axes[row + 1, column], color, over_speed=True)
    for number, ax in enumerate(axes.ravel()):
        if number // ACROSS // 2 * ACROSS + number % ACROSS >= len(states):
            ax.set_axis_off()
        ax.set(ylabel="force $n/kY$" if number % ACROSS == 0 else "")
        ax.set(xlabel=r"speed $\dot z/\omega Y$" if number // ACROSS % 2 else "displacement $z/Y$")
    figure.suptitle(f"force of the contact over displacement and over speed: r = {LOOPS[0]:g}, beta = {LOOPS[1]:g}")
    return figure


def draw_slow(states: Sequence[SteadyState]) -> Figure:
    """The question of section 4.3.1: displacement at r = 0.1 under two laws, stops thick, the base's motion behind."""
    figure, phase = new_figure(PAGE, 2.6), np.linspace(0.0, TURN, 2000)
    for ax, state, color in zip(figure.subplots(1, 2, sharey=True), states, PALETTE, strict=False):
        motion = state.orbit
        assert motion is not None
        ax.plot(phase / TURN, motion.problem.base.at(phase), color=BASE, linewidth=0.8, label="base $y/Y$")
        ax.plot(phase / TURN, motion.at(phase)[0], color=color, label="mass $x/Y$")
        for number, (begin, end) in enumerate(motion.stops):
            held = np.linspace(begin, end, 50)
            ax.plot(held / TURN, motion.at(held)[0], color="black", linewidth=2.5, label="" if number else "stop")
        ax.set(xlabel="time / cycle", title=f"{state.problem.law.name}: {state.stops_per_cycle:g} stops")
        ax.legend(loc="upper center", fontsize=7)
    figure.axes[0].set_ylabel("displacement over $Y$")
    other = states[1].problem
    values = (f"{each.symbol} = {other.parameter(each.name):g}" for each in other.law.own[1:])
    figure.suptitle(f"r = {SLOW[0]:g}, beta = {SLOW[1]:g}; {', '.join(values)}")
    return figure


def draw_all(folder: Path, laws: Sequence[str] = tuple(LAWS)) -> None:
    """Draw both figures into a folder."""
    with look():
        loops = draw_loops([solved(law, *LOOPS) for law in laws])
        slow = draw_slow([solved(law, *SLOW) for law in ("coulomb", "coulomb+rate-state")])
        for name, figure in {"laws_force": loops, "laws_slow": slow}.items():
            for suffix in (".pdf", ".png"):
                save(figure, folder / f"{name}{suffix}", force=True)


if __name__ == "__main__":
    draw_all(Path(sys.argv[1]))
