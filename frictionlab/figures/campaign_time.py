"""Over time: example responses (thesis Figs 4.4 and 4.13) and the energy of long tests with trends (4.14, 4.15)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from frictionlab.campaign import Campaign, Drift, Response
from frictionlab.campaign.trials import levels, nearest
from frictionlab.figures.style import BASE, MEASURED, PAGE, PALETTE, new_figure

FloatArray = NDArray[np.float64]
NORMAL = 1.96


def responses(campaign: Campaign) -> Figure:
    """Steady and unsteady examples: the last cycles of short tests."""
    shown = [r for r in campaign.responses if not r.trial.is_long]
    rows = (len(shown) + 1) // 2
    figure = new_figure(PAGE, 0.4 + 1.7 * rows)
    axes = figure.subplots(rows, 2 if len(shown) > 1 else 1, squeeze=False).ravel()
    for ax, response in zip(axes, shown, strict=False):
        _trace(ax, response)
    for ax in axes[len(shown) :]:
        ax.remove()
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure


def long_responses(campaign: Campaign) -> Figure:
    """Each long test: all of it as an envelope on the left, its last cycles on the right."""
    whole = [r for r in campaign.responses if r.is_envelope]
    ends = {r.trial.source: r for r in campaign.responses if r.trial.is_long and not r.is_envelope}
    figure = new_figure(PAGE, 0.4 + 1.35 * len(whole))
    axes = figure.subplots(len(whole), 2, squeeze=False, width_ratios=(3, 2))
    for (left, right), response in zip(axes, whole, strict=True):
        minutes = response.time / 60
        left.fill_between(minutes, _side(response.mass, 0), _side(response.mass, 1), color=MEASURED, linewidth=0.3)
        left.set_title(_title(response))
        left.set_ylabel("x / Y")
        left.margins(x=0)
        _trace(right, ends[response.trial.source])
        right.set_title("last cycles")
    axes[-1][0].set_xlabel("time [min]")
    return figure


def _side(pairs: FloatArray, which: int) -> FloatArray:
    """Lowest (0) or highest (1) of each pair, at both of its times."""
    return np.repeat(pairs[which::2], 2)


def _trace(ax: Axes, response: Response) -> None:
    ax.plot(response.time, response.mass, color=MEASURED, linewidth=1.1, label="mass x / Y")
    ax.plot(response.time, response.base, color=BASE, linewidth=0.8, linestyle="--", label="base y / Y")
    ax.set_title(_title(response))
    ax.set_xlabel("time [s]")
    ax.margins(x=0)


def _title(response: Response) -> str:
    trial = response.trial
    return f"{response.label}: {trial.material}, {trial.normal_force_n:g} N, r = {trial.r:.3g}"


def drift(campaign: Campaign, level: float) -> Figure:
    """Energy of one cycle every ten seconds at one frequency ratio; line: trend, band: its 95 % confidence."""
    figure = new_figure(PAGE, 3.0)
    ax = figure.subplots()
    for i, material in enumerate(campaign.materials):
        for test in drifts_at(campaign, level):
            if test.trial.material == material:
                _trend(ax, test, PALETTE[i % len(PALETTE)])
    ax.set_xlabel("time [min]")
    ax.set_ylabel("energy per cycle / kY²")
    ax.set_ylim(bottom=0)
    ax.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return figure


def drift_levels(campaign: Campaign) -> tuple[float, ...]:
    """The frequency ratios of the long tests whose points are at hand."""
    return levels([d.trial.r for d in campaign.drifts if d.trend is not None])


def drifts_at(campaign: Campaign, level: float) -> Sequence[Drift]:
    """The long tests at one frequency ratio."""
    every = drift_levels(campaign)
    return [d for d in campaign.drifts if d.trend is not None and nearest(d.trial.r, every) == level]


def _trend(ax: Axes, test: Drift, colour: str) -> None:
    if test.trend is None:
        return
    trend, time = test.trend, test.trend.time
    about = time - time.mean()
    line = trend.level + trend.slope * about
    reach = 0.5 * (trend.high - trend.low)
    level_error = trend.slope_se * float(np.sqrt(np.mean(about**2)))
    band = reach / max(trend.slope_se, 1e-300) * np.hypot(level_error, trend.slope_se * about)
    percent = 100 * (test.relative_per_hour or 0.0)
    label = f"{test.trial.material}, {test.trial.normal_force_n:g} N: {percent:+.1f} %/h, {test.verdict}"
    ax.plot(time / 60, trend.value, ".", color=colour, markersize=2.5, alpha=0.6)
    ax.plot(time / 60, line, ":", color=colour, linewidth=1.4, label=label)
    ax.fill_between(time / 60, line - band, line + band, color=colour, alpha=0.25, linewidth=0)
