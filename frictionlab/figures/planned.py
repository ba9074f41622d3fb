"""Tests to be made: what each possible one says, and what a law predicts of them; what accuracy costs."""

import math
from collections.abc import Callable, Sequence
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from frictionlab.figures.style import BASE, BLUE, GREY, PAGE, PREDICTED, VERMILION, caution, headline, look, new_figure
from frictionlab.planning import Plan, PlannedTest

if TYPE_CHECKING:
    from frictionlab.inference.predictive import PredictedTest, Prediction
    from frictionlab.tradeoff.setting import Setting

MOST = 4  # parameters drawn
MARK = 40.0  # points squared
DECIDES = 5.0  # logarithm of a Bayes factor from which a law is required
Number = Callable[[PlannedTest], float | None]
CURVES = {"response_amplitude_m": "amplitude [mm]", "energy_per_cycle_j": "energy per cycle [mJ]"}
SHADE = 0.25
FEW = 20  # points of a curve that are marked
FLOOR = 1e-16  # an error of zero is drawn here
PLACES = ((5, 4), (5, -8), (5, 12))  # of a label beside its point, in turn: neighbours often lie on one spot


def draw_parameter(plan: Plan, name: str, ax: Axes) -> Axes:
    """Expected uncertainty of one parameter by each candidate alone; of several at one place the best is shown.

    Friction is told in per cent of it. Hollow: a test that moves but does not tell the parameter; a cross: a test in
    which the mass stands still, or may.
    """
    share = name == "beta"

    def error(test: PlannedTest) -> float | None:
        value = test.expected_u[name]
        return None if value is None else 100.0 * value / test.values[name] if share else value

    best = _best(plan, error)
    title = "uncertainty of the friction, %" if share else f"uncertainty of {name}"
    return _draw_map(plan, best, {place: error(t) for place, t in best.items()}, ax, title=title, told=name)


def draw_evidence(plan: Plan, ax: Axes, *, holds: bool) -> Axes:
    """Logarithm of the Bayes factor to expect from each candidate alone, if the plan's law holds or the other does."""

    def evidence(test: PlannedTest) -> float | None:
        return test.log_bayes if holds else test.log_bayes_against

    best = _best(plan, lambda test: None if (value := evidence(test)) is None else -value)
    law = plan.law if holds else plan.against
    title = f"log Bayes factor if {law} holds"
    return _draw_map(plan, best, {place: evidence(t) for place, t in best.items()}, ax, title=title, told=None)


def _best(plan: Plan, cost: Number) -> dict[tuple[float, float], PlannedTest]:
    """The best test at each frequency ratio and normal force."""
    found: dict[tuple[float, float], PlannedTest] = {}
    for test in (*plan.tests, *plan.others):
        place = (test.frequency_ratio, test.normal_force_n)
        if place not in found or _or_inf(cost(test)) < _or_inf(cost(found[place])):
            found[place] = test
    return found


def _or_inf(value: float | None) -> float:
    return math.inf if value is None else value


def _draw_map(
    plan: Plan,
    best: dict[tuple[float, float], PlannedTest],
    numbers: dict[tuple[float, float], float | None],
    ax: Axes,
    *,
    title: str,
    told: str | None,
) -> Axes:
    still = [place for place, number in numbers.items() if number is None]
    known = {place: number for place, number in numbers.items() if number is not None}
    clear = [p for p, number in known.items() if (number >= DECIDES if told is None else best[p].told[told])]
    vague = [place for place in known if place not in set(clear)]
    if clear:
        _draw_clear(clear, [known[place] for place in clear], ax, evidence=told is None)
    ax.scatter(*_columns(vague), s=MARK, marker="s", facecolors="none", edgecolors="0.6", linewidths=0.6, zorder=2)
    ax.scatter(*_columns(still), s=0.3 * MARK, marker="x", color="0.7", linewidths=0.8, zorder=2)
    _ring(plan, ax)
    ax.set(xlabel="frequency ratio r", ylabel="normal force, N", title=title)
    ax.margins(0.08)
    return ax


def _draw_clear(places: Sequence[tuple[float, float]], numbers: Sequence[float], ax: Axes, *, evidence: bool) -> None:
    """Coloured marks with their scale; dark: the test tells much."""
    colours = "viridis_r" if evidence else "viridis"
    marks = ax.scatter(*_columns(places), s=MARK, marker="s", c=list(numbers), norm=LogNorm(), cmap=colours, zorder=2)
    figure = ax.figure
    figure.colorbar(marks, ax=ax, pad=0.02)


def _columns(places: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [r for r, _ in places], [force for _, force in places]


def _ring(plan: Plan, ax: Axes) -> None:
    """Rings about the tests chosen, with their ranks; those of one place share a ring."""
    ranks: dict[tuple[float, float], list[str]] = {}
    for test in plan.tests:
        ranks.setdefault((test.frequency_ratio, test.normal_force_n), []).append(str(test.rank))
    ax.scatter(*_columns(list(ranks)), s=2.6 * MARK, facecolors="none", edgecolors=PREDICTED, linewidths=1.3, zorder=3)
    for place, numbers in ranks.items():
        text = ",".join(numbers[:3]) + ("…" if len(numbers) > 3 else "")
        ax.annotate(text, place, textcoords="offset points", xytext=(5, 6), fontsize=7, color=PREDICTED, weight="bold")


def plan_figure(plan: Plan) -> Figure:
    """One panel a parameter, or one for each way of two laws; rings with numbers: the tests chosen."""
    names = [] if plan.against is not None else list(plan.tests[0].expected)[:MOST]
    panels = len(names) or 2
    with look():
        figure = new_figure(PAGE, 2.7 * ((panels + 1) // 2))
        axes = figure.subplots((panels + 1) // 2, min(2, panels), squeeze=False).ravel()
        for name, ax in zip(names, axes, strict=False):
            draw_parameter(plan, name, ax)
        for holds, ax in zip((True, False), axes, strict=False):
            if plan.against is not None:
                draw_evidence(plan, ax, holds=holds)
        for ax in axes[panels:]:
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
        axes = figure.subplots(1, 2, width_ratios=(1.6, 1.0) if len(tests) == 1 else (1.0, 1.0))
        if len(tests) == 1:
            draw_predicted_motion(first, axes[0])
            draw_predicted_loop(first, axes[1])
        else:
            for ax, name in zip(axes, CURVES, strict=True):
                draw_predicted_curve(prediction, name, ax)
        at = f"{first.normal_force_n:.4g} N, base {1e3 * first.base_amplitude_m:.4g} mm"
        headline(figure, f"{first.material}, {first.law}: {at}; shaded: 95 of 100 such tests")
        caution(figure, list(dict.fromkeys(said for test in tests for said in test.warnings)))
    return figure


def draw_predicted_motion(test: "PredictedTest", ax: Axes) -> Axes:
    """Displacement of the mass with its band, and of the base, in mm."""
    ax.plot(test.time, 1e3 * test.base, color=BASE, linewidth=0.8, label="base")
    ax.plot(test.time, 1e3 * test.displacement, color=PREDICTED, label="mass")
    ax.fill_between(
        test.time, 1e3 * test.displacement_low, 1e3 * test.displacement_high,
        color=PREDICTED, alpha=SHADE, linewidth=0.0,
    )  # fmt: skip
    ax.set(xlabel="time [s]", ylabel="displacement [mm]")
    ax.margins(y=0.18)
    ax.legend(loc="upper right", ncols=2)
    return ax


def draw_predicted_loop(test: "PredictedTest", ax: Axes) -> Axes:
    """Base over mass: the area is the energy per cycle (2.18)."""
    ax.plot(1e3 * test.displacement, 1e3 * test.base, color=PREDICTED)
    ax.fill_betweenx(
        1e3 * test.base, 1e3 * test.displacement_low, 1e3 * test.displacement_high,
        color=PREDICTED, alpha=SHADE, linewidth=0.0,
    )  # fmt: skip
    ax.set(xlabel="mass [mm]", ylabel="base [mm]")
    return ax


def draw_predicted_curve(prediction: "Prediction", name: str, ax: Axes) -> Axes:
    """One number over the frequency ratio, with its band."""
    rows = np.array([(test.frequency_ratio, *test.numbers[name]) for test in prediction.tests], dtype=np.float64)
    r, value, low, high = rows[np.argsort(rows[:, 0])].T
    ax.plot(r, 1e3 * value, color=PREDICTED, marker="." if len(r) <= FEW else None)
    ax.fill_between(r, 1e3 * low, 1e3 * high, color=PREDICTED, alpha=SHADE, linewidth=0.0)
    ax.set(xlabel="frequency ratio $r$", ylabel=CURVES[name])
    ax.set_ylim(bottom=0.0)
    return ax


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
    from frictionlab.tradeoff.setting import pareto_front  # noqa: PLC0415 - the room it draws is heavy

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
