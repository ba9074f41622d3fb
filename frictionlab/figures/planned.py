"""Tests to be made: what each possible one says, and what a law predicts of them; what accuracy costs."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from frictionlab.figures.style import BASE, BLUE, GREY, PAGE, PREDICTED, VERMILION, caution, headline, look, new_figure
from frictionlab.planning import Plan, PlannedTest

if TYPE_CHECKING:
    from frictionlab.inference.predictive import PredictedTest, Prediction
    from frictionlab.tradeoff import Setting

MOST = 4  # parameters drawn
MARK = 40.0  # points squared
DECIDES = 5.0  # logarithm of a Bayes factor from which a law is required
Cost = Callable[[PlannedTest], float | None]
Place = tuple[float, float]  # frequency ratio and normal force
CURVES = {"response_amplitude_m": "amplitude [mm]", "energy_per_cycle_j": "energy per cycle [mJ]"}
BAND: dict[str, Any] = {"color": PREDICTED, "alpha": 0.25, "linewidth": 0.0}  # of 95 of 100 tests
FEW = 20  # points of a curve that are marked
FLOOR = 1e-16  # an error of zero is drawn here
PLACES = ((5, 4), (5, -8), (5, 12))  # of a label beside its point, in turn: neighbours often lie on one spot


def _draw_candidates(plan: Plan, ax: Axes, title: str, cost_of: Cost, name: str | None) -> None:
    """What each candidate alone says, by frequency ratio and normal force; of several at one place the best.

    Of a parameter (``name``) its uncertainty, or the evidence for a law, which is better the larger it is. Hollow: a
    test that moves but does not tell it; a cross: a test in which the mass stands still, or may; rings: the tests
    chosen, with their ranks.
    """
    least: dict[Place, tuple[float, PlannedTest]] = {}
    for test in (*plan.tests, *plan.others):
        place, value = (test.frequency_ratio, test.normal_force_n), cost_of(test)
        cost = math.inf if value is None else value
        if place not in least or cost < least[place][0]:
            least[place] = (cost, test)
    still = [place for place, (cost, _) in least.items() if cost == math.inf]
    moving = {place: one for place, one in least.items() if place not in still}
    clear = [p for p, (cost, test) in moving.items() if (cost <= -DECIDES if name is None else test.told[name])]
    vague = [place for place in moving if place not in clear]
    if clear:
        marks = ax.scatter(
            *_columns(clear), s=MARK, marker="s", c=[abs(least[place][0]) for place in clear], norm=LogNorm(),
            cmap="viridis_r" if name is None else "viridis", zorder=2,
        )  # fmt: skip
        ax.figure.colorbar(marks, ax=ax, pad=0.02)
    ax.scatter(*_columns(vague), s=MARK, marker="s", facecolors="none", edgecolors="0.6", linewidths=0.6, zorder=2)
    ax.scatter(*_columns(still), s=0.3 * MARK, marker="x", color="0.7", linewidths=0.8, zorder=2)
    ranks: dict[Place, list[str]] = {}
    for test in plan.tests:
        ranks.setdefault((test.frequency_ratio, test.normal_force_n), []).append(str(test.rank))
    ax.scatter(*_columns(ranks), s=2.6 * MARK, facecolors="none", edgecolors=PREDICTED, linewidths=1.3, zorder=3)
    for place, numbers in ranks.items():
        text = ",".join(numbers[:3]) + ("…" if len(numbers) > 3 else "")
        ax.annotate(text, place, textcoords="offset points", xytext=(5, 6), fontsize=7, color=PREDICTED, weight="bold")
    ax.set(xlabel="frequency ratio r", ylabel="normal force, N", title=title)
    ax.margins(0.08)


def _columns(places: Iterable[Place]) -> tuple[list[float], list[float]]:
    return [r for r, _ in places], [force for _, force in places]


def _panels(plan: Plan) -> Iterator[tuple[str, Cost, str | None]]:
    """Title, what is to be small, and the parameter: a panel for each parameter, or for each of two laws.

    A parameter's is its expected uncertainty, that of friction in per cent; a law's the logarithm of the Bayes factor
    to expect if it holds, negative.
    """
    if plan.against is not None:
        yield f"log Bayes factor if {plan.law} holds", partial(_lack_of_evidence, holds=True), None
        yield f"log Bayes factor if {plan.against} holds", partial(_lack_of_evidence, holds=False), None
        return
    for name in list(plan.tests[0].expected)[:MOST]:
        title = "uncertainty of the friction, %" if name == "beta" else f"uncertainty of {name}"
        yield title, partial(_uncertainty, name=name), name


def _lack_of_evidence(test: PlannedTest, *, holds: bool) -> float | None:
    value = test.log_bayes if holds else test.log_bayes_against
    return None if value is None else -value


def _uncertainty(test: PlannedTest, *, name: str) -> float | None:
    value = test.expected_u[name]
    return value if value is None or name != "beta" else 100.0 * value / test.values[name]


def plan_figure(plan: Plan) -> Figure:
    """One panel a parameter, or one for each way of two laws; rings with numbers: the tests chosen."""
    panels = list(_panels(plan))
    rows = (len(panels) + 1) // 2
    with look():
        figure = new_figure(PAGE, 2.7 * rows)
        axes = figure.subplots(rows, min(2, len(panels)), squeeze=False).ravel()
        for (title, cost_of, name), ax in zip(panels, axes, strict=False):
            _draw_candidates(plan, ax, title, cost_of, name)
        for ax in axes[len(panels) :]:
            ax.set_axis_off()
        headline(figure, _title(plan))
        return figure


def _title(plan: Plan) -> str:
    laws = plan.law if plan.against is None else f"{plan.law} against {plan.against}"
    marks = "rings: the plan; cross: the mass stands still, or may"
    hollow = "; hollow: not told" if plan.against is None else f"; hollow: below {DECIDES:g}, which does not decide"
    return f"{laws}: what each candidate tells alone; {marks}{hollow}"


def prediction_figure(prediction: "Prediction") -> Figure:
    """One test: its displacement over time, and the loop; several: amplitude and energy over the frequency ratio."""
    tests, first = prediction.tests, prediction.tests[0]
    with look():
        figure = new_figure()
        left, right = figure.subplots(1, 2, width_ratios=(1.6, 1.0) if len(tests) == 1 else (1.0, 1.0))
        if len(tests) == 1:
            _draw_predicted(first, left, right)
        else:
            for ax, (name, label) in zip((left, right), CURVES.items(), strict=True):
                rows = np.array([(test.frequency_ratio, *test.numbers[name]) for test in tests], dtype=np.float64)
                r, value, low, high = rows[np.argsort(rows[:, 0])].T
                ax.plot(r, 1e3 * value, color=PREDICTED, marker="." if len(r) <= FEW else None)
                ax.fill_between(r, 1e3 * low, 1e3 * high, **BAND)
                ax.set(xlabel="frequency ratio $r$", ylabel=label)
                ax.set_ylim(bottom=0.0)
        at = f"{first.normal_force_n:.4g} N, base {1e3 * first.base_amplitude_m:.4g} mm"
        headline(figure, f"{first.material}, {first.law}: {at}; shaded: 95 of 100 such tests")
        caution(figure, list(dict.fromkeys(said for test in tests for said in test.warnings)))
    return figure


def _draw_predicted(test: "PredictedTest", motion: Axes, loop: Axes) -> None:
    """Displacement of the mass with its band, and of the base; base over mass, whose area is the energy (2.18)."""
    base, mass, low, high = (
        1e3 * values for values in (test.base, test.displacement, test.displacement_low, test.displacement_high)
    )
    motion.plot(test.time, base, color=BASE, linewidth=0.8, label="base")
    motion.plot(test.time, mass, color=PREDICTED, label="mass")
    motion.fill_between(test.time, low, high, **BAND)
    motion.set(xlabel="time [s]", ylabel="displacement [mm]")
    motion.margins(y=0.18)
    motion.legend(loc="upper right", ncols=2)
    loop.plot(mass, base, color=PREDICTED)
    loop.fill_betweenx(base, low, high, **BAND)
    loop.set(xlabel="mass [mm]", ylabel="base [mm]")


def family_figure(knobs: Sequence[Sequence["Setting"]]) -> Figure:
    """One panel for each knob of a family."""
    with look():
        columns = min(2, len(knobs))
        rows = math.ceil(len(knobs) / columns)
        figure = new_figure(PAGE, 2.6 * rows)
        panels = figure.subplots(rows, columns, squeeze=False).ravel().tolist()
        for settings, ax in zip(knobs, panels, strict=False):
            draw_knob(settings, ax)
        for ax in panels[len(knobs) :]:
            ax.set_axis_off()
    return figure


def draw_knob(settings: Sequence["Setting"], ax: Axes) -> Axes:
    """Settings as points, the Pareto front as a line through those that none beats, the default as a ring."""
    from frictionlab.tradeoff import pareto_front  # noqa: PLC0415 - the room it draws is heavy

    front = falling(pareto_front(settings))
    ax.plot([s.seconds for s in front], [_drawn(s) for s in front], color=BLUE, linewidth=0.8, zorder=1)
    for s, place in zip(settings, cycle(PLACES), strict=False):
        ax.plot(s.seconds, _drawn(s), "o", markersize=4.0, color=GREY if s.dominated else BLUE, zorder=2)
        if s.default:
            ax.plot(s.seconds, _drawn(s), "o", markersize=9.0, markerfacecolor="none", color=VERMILION, zorder=3)
        ax.annotate(s.setting, (s.seconds, _drawn(s)), place, textcoords="offset points", fontsize=5.5)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.margins(x=0.25, y=0.15)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"relative error of {settings[0].quantity}", fontsize=6.5)
    ax.set_title(f"{settings[0].knob} (ring: default)")
    return ax


def falling(front: Sequence["Setting"]) -> list["Setting"]:
    """Those of a front, from the fastest on, that err less than all faster ones."""
    return [s for i, s in enumerate(front) if all(s.error < faster.error for faster in front[:i])]


def _drawn(setting: "Setting") -> float:
    return max(setting.error, FLOOR)
