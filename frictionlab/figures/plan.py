"""What each possible test tells, over frequency ratio and normal force, and the tests that were chosen."""

import math
from collections.abc import Callable, Sequence

from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from frictionlab.figures.style import PAGE, PREDICTED, headline, look, new_figure
from frictionlab.planning import Plan, PlannedTest

MOST = 4  # parameters drawn
MARK = 40.0  # points squared
DECIDES = 5.0  # logarithm of a Bayes factor from which a law is required
Number = Callable[[PlannedTest], float | None]


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
