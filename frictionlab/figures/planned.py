"""Tests to be made: what each possible one says, and what a law predicts of them."""

from collections.abc import Callable, Collection, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from frictionlab.figures import style
from frictionlab.inference.ladder import REQUIRED
from frictionlab.planning.plan import Plan, PlannedTest
from frictionlab.schema import AMPLITUDE, ENERGY
from frictionlab.tables.texts import kinds_of

if TYPE_CHECKING:
    from frictionlab.inference.predictive import Prediction

MOST = 4  # parameters drawn
MARK = 40.0  # points squared
Value = Callable[[PlannedTest], float | None]
Place = tuple[float, float]  # frequency ratio and normal force
CURVES = {f"{AMPLITUDE}_m": "amplitude [mm]", f"{ENERGY}_j": "energy per cycle [mJ]"}
BAND: dict[str, Any] = {"color": style.PREDICTED, "alpha": 0.25, "linewidth": 0.0}  # of 95 of 100 tests
FEW = 20  # points of a curve that are marked


def plan_figure(plan: Plan) -> Figure:
    """One panel a parameter, or one for each way of two laws; rings with numbers: the tests chosen."""
    drawn = list(_panels(plan))
    laws = plan.law if plan.against is None else f"{plan.law} against {plan.against}"
    hollow = "not known by it" if plan.against is None else f"below {REQUIRED:g}, which does not decide"
    marks = f"rings: the plan; cross: the mass stands still, or may; hollow: {hollow}"
    title = f"{laws}: what each candidate says alone; {marks}"
    with style.drawing(2.7 * ((len(drawn) + 1) // 2), title) as figure:
        for (words, value, name), ax in zip(drawn, style.panels(figure, len(drawn)), strict=True):
            _draw_candidates(plan, ax, value, name)
            ax.set_title(words)
    return figure


def _panels(plan: Plan) -> Iterator[tuple[str, Value, str | None]]:
    """Title, number and parameter of each panel: an uncertainty (friction in %), of two laws the log Bayes factor."""
    if plan.against is not None:
        yield f"log Bayes factor if {plan.law} holds", lambda test: test.log_bayes, None
        yield f"log Bayes factor if {plan.against} holds", lambda test: test.log_bayes_against, None
        return
    for name in list(plan.tests[0].expected)[:MOST]:
        words = "uncertainty of the friction, %" if name == "beta" else f"uncertainty of {name}"
        yield words, partial(_uncertainty, name=name), name


def _uncertainty(test: PlannedTest, *, name: str) -> float | None:
    value = test.expected_u[name]
    return value if value is None or name != "beta" else 100.0 * value / test.values[name]


def _draw_candidates(plan: Plan, ax: Axes, value_of: Value, name: str | None) -> None:
    """What each candidate alone says, by frequency ratio and normal force; of several at one place the best.

    Hollow: a test that moves but leaves it unknown; a cross: the mass stands still, or may; rings: the tests chosen.
    """
    places: dict[Place, list[tuple[float, PlannedTest]]] = {}
    for test in (*plan.tests, *plan.others):
        value = value_of(test)
        known = places.setdefault((test.frequency_ratio, test.normal_force_n), [])
        known += [] if value is None else [(value, test)]
    best = min if name is not None else max
    moving = {place: best(known, key=lambda pair: pair[0]) for place, known in places.items() if known}
    clear = {p: value for p, (value, test) in moving.items() if (test.told[name] if name else value >= REQUIRED)}
    if clear:
        marks = ax.scatter(
            *_columns(clear), s=MARK, marker="s", c=list(clear.values()), norm=LogNorm(),
            cmap="viridis" if name else "viridis_r", zorder=2,
        )  # fmt: skip
        style.plain_numbers(ax.figure.colorbar(marks, ax=ax, pad=0.02).ax.yaxis)
    thin: dict[str, Any] = {"s": MARK, "marker": "s", "facecolors": "none", "edgecolors": "0.6", "linewidths": 0.6}
    ax.scatter(*_columns(moving.keys() - clear.keys()), zorder=2, **thin)
    still = places.keys() - moving.keys()
    ax.scatter(*_columns(still), s=0.3 * MARK, marker="x", color="0.7", linewidths=0.8, zorder=2)
    ranks: dict[Place, list[str]] = {}
    for test in plan.tests:
        ranks.setdefault((test.frequency_ratio, test.normal_force_n), []).append(str(test.rank))
    ax.scatter(*_columns(ranks), s=2.6 * MARK, facecolors="none", edgecolors=style.PREDICTED, linewidths=1.3, zorder=3)
    for place, numbers in ranks.items():
        text = ",".join(numbers[:3]) + ("…" if len(numbers) > 3 else "")
        ax.annotate(
            text, place, textcoords="offset points", xytext=(5, 6), fontsize=7, color=style.PREDICTED, weight="bold"
        )
    ax.set(xlabel="frequency ratio r", ylabel="normal force, N")
    ax.margins(0.08)


def _columns(places: Collection[Place]) -> tuple[list[float], list[float]]:
    return [r for r, _ in places], [force for _, force in places]


def prediction_figure(prediction: "Prediction") -> Figure:
    """One test: its displacement over time, and the loop; several: amplitude and energy over the frequency ratio."""
    tests, first = prediction.tests, prediction.tests[0]
    at = f"{first.normal_force_n:.4g} N, base {1e3 * first.base_amplitude_m:.4g} mm"
    title = f"{first.material}, {first.law}: {at}; shaded: 95 of 100 such tests"
    warned = [(str(k), text) for k, test in enumerate(tests) for text in test.warnings]
    said = [sentence for sentence, _ in kinds_of(warned)]
    with style.drawing(title=title, cautions=said) as figure:
        if len(tests) == 1:
            left, right = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
            base, mass = 1e3 * first.base, 1e3 * first.displacement
            band = (1e3 * first.displacement_low, 1e3 * first.displacement_high)
            left.fill_between(first.time, *band, **BAND)
            lines = {"base": base, "mass": mass}
            style.over_time(left, first.time, lines, (style.PREDICTED,), ylabel="displacement [mm]")
            right.plot(mass, base, color=style.PREDICTED)  # its area is the energy (2.18)
            right.fill_betweenx(base, *band, **BAND)
            right.set(xlabel="mass [mm]", ylabel="base [mm]")
        else:
            for ax, (name, label) in zip(style.panels(figure, 2), CURVES.items(), strict=True):
                rows = np.array([(test.frequency_ratio, *test.numbers[name]) for test in tests], dtype=np.float64)
                r, value, low, high = rows[np.argsort(rows[:, 0])].T
                ax.plot(r, 1e3 * value, color=style.PREDICTED, marker="." if len(r) <= FEW else None)
                ax.fill_between(r, 1e3 * low, 1e3 * high, **BAND)
                ax.set(xlabel="frequency ratio r", ylabel=label)
                ax.set_ylim(bottom=0.0)
    return figure
