"""What each possible test tells: expected errors over frequency ratio, and the tests that were chosen."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.style import MEASURED, PAGE, PREDICTED, headline, look, new_figure
from frictionlab.planning import Plan, PlannedTest

MOST = 4  # parameters drawn


def draw_parameter(plan: Plan, name: str, ax: Axes) -> Axes:
    """Expected uncertainty of one parameter by each candidate alone, over frequency ratio; chosen tests ringed."""
    everything = [*plan.tests, *plan.others]
    told = [t for t in everything if t.expected_u.get(name) is not None]
    forces = np.array([t.normal_force_n for t in told])
    sizes = 12.0 + 40.0 * (forces / forces.max() if len(forces) else forces)
    ax.scatter([t.frequency_ratio for t in told], [_error(t, name) for t in told], s=sizes, color=MEASURED, alpha=0.35)
    chosen = [t for t in plan.tests if t.expected_u.get(name) is not None]
    ax.scatter(
        [t.frequency_ratio for t in chosen],
        [_error(t, name) for t in chosen],
        s=90,
        facecolors="none",
        edgecolors=PREDICTED,
    )
    for t in chosen:
        ax.annotate(str(t.rank), (t.frequency_ratio, _error(t, name)), textcoords="offset points", xytext=(5, 5))
    ax.set(xlabel="frequency ratio r", ylabel=f"uncertainty of {name}", yscale="log")
    return ax


def _error(test: PlannedTest, name: str) -> float:
    return test.expected_u.get(name) or float("nan")


def plan_figure(plan: Plan) -> Figure:
    """One panel a parameter; larger marks are larger normal forces, rings with numbers the tests chosen."""
    names = list(plan.tests[0].expected)[:MOST]
    with look():
        figure = new_figure(PAGE, 2.6 * ((len(names) + 1) // 2))
        panels = figure.subplots((len(names) + 1) // 2, min(2, len(names)), squeeze=False).ravel()
        for name, ax in zip(names, panels, strict=False):
            draw_parameter(plan, name, ax)
        for ax in panels[len(names) :]:
            ax.set_axis_off()
        headline(
            figure, f"{plan.law}: what each candidate tells alone; larger marks: larger normal force; rings: the plan"
        )
        return figure
