"""Friction over normal force, and the rankings, each with its 95 % confidence."""

from collections.abc import Sequence
from textwrap import fill

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from frictionlab.campaign import CRITERIA, Campaign, Rank
from frictionlab.figures.style import COLUMN, PAGE, PALETTE, new_figure

NORMAL = 1.96


def friction(campaign: Campaign) -> Figure:
    """Friction coefficient of each material over normal force; bands are the mean that Amontons' law would have."""
    figure = new_figure(1.4 * COLUMN, 3.2)
    ax = figure.subplots()
    for i, test in enumerate(campaign.amontons):
        fits = [f for f in campaign.fits if f.material == test.material and f.friction_coefficient is not None]
        colour = PALETTE[i % len(PALETTE)]
        value = [f.friction_coefficient or 0.0 for f in fits]
        low = [c - (f.coefficient_interval[0] or c) for c, f in zip(value, fits, strict=True)]
        high = [(f.coefficient_interval[1] or c) - c for c, f in zip(value, fits, strict=True)]
        force = [f.normal_force_n for f in fits]
        ax.errorbar(force, value, yerr=[low, high], fmt="o", color=colour, capsize=2, label=test.material)
        if test.coefficient is not None and test.coefficient_se is not None:
            reach = NORMAL * test.coefficient_se
            ax.axhspan(test.coefficient - reach, test.coefficient + reach, color=colour, alpha=0.2, linewidth=0)
            ax.axhline(test.coefficient, color=colour, linewidth=0.6, linestyle="--")
    ax.set_xlabel("normal force [N]")
    ax.set_ylabel("friction coefficient")
    ax.set_ylim(bottom=0)
    ax.legend()
    return figure


def ranking(campaign: Campaign) -> Figure:
    """The three criteria beside each other, best material on top."""
    figure = new_figure(PAGE, 1.0 + 0.3 * len(campaign.materials))
    for ax, criterion in zip(figure.subplots(1, len(CRITERIA), squeeze=False)[0], CRITERIA, strict=True):
        _rank_panel(ax, [r for r in campaign.ranking if r.criterion == criterion], campaign)
        ax.set_title(criterion)
    return figure


def _rank_panel(ax: Axes, ranks: Sequence[Rank], campaign: Campaign) -> None:
    for place, rank in enumerate(ranks):
        colour = PALETTE[campaign.materials.index(rank.material) % len(PALETTE)]
        if rank.value is None:
            ax.text(0.5, place, "not known", ha="center", va="center", transform=ax.get_yaxis_transform())
        else:
            ax.errorbar(rank.value, place, xerr=NORMAL * (rank.value_se or 0.0), fmt="o", color=colour, capsize=2)
    names = [f"{'–' if r.rank is None else r.rank}  {r.material}" for r in ranks]
    ax.set_yticks(range(len(ranks)), names)
    ax.set_ylim(len(ranks) - 0.5, -0.5)
    if any(r.value is not None for r in ranks):
        ax.set_xlim(left=0)
        ax.xaxis.set_major_locator(MaxNLocator(4))
    else:
        ax.set_xticks([])
    ax.set_xlabel(fill(ranks[0].unit, 26) if ranks else "")
