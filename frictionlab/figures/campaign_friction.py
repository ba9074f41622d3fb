"""Friction over normal force, and the rankings, each with its 95 % confidence."""

from collections.abc import Sequence
from textwrap import fill

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from frictionlab.campaign import CRITERIA, Campaign, FrictionFit, Rank
from frictionlab.figures.style import PAGE, PALETTE, new_figure

NORMAL = 1.96
NAME = 24  # letters of a name in a line


def has_several_forces(campaign: Campaign) -> bool:
    """Whether a coefficient of some material is known under two normal forces."""
    known = [f.material for f in campaign.fits if f.friction_coefficient is not None]
    return len(known) > len(set(known))


def friction(campaign: Campaign) -> Figure:
    """Friction coefficient of each material over normal force; beside it, how far each point is from the mean."""
    figure = new_figure(PAGE, 3.2)
    panels = figure.subplots(1, 2 if has_several_forces(campaign) else 1, squeeze=False)[0]
    for i, test in enumerate(campaign.amontons):
        fits = [f for f in campaign.fits if f.material == test.material and f.friction_coefficient is not None]
        colour = PALETTE[i % len(PALETTE)]
        _coefficients(panels[0], fits, colour, 1.0, 0.0, test.material)
        if test.coefficient is not None and test.coefficient_se is not None:
            reach = NORMAL * test.coefficient_se
            panels[0].axhline(test.coefficient, color=colour, linewidth=0.6, linestyle="--")
            for ax in panels[1:]:
                _coefficients(ax, fits, colour, 100 / test.coefficient, -100.0, None, shift=0.02 * i)
                ax.axhspan(*(100 * side * reach / test.coefficient for side in (-1, 1)), color=colour, alpha=0.15, lw=0)
    most = max((f.normal_force_n for f in campaign.fits), default=1.0)
    for ax, label in zip(panels, ("friction coefficient", "deviation from the material's mean [%]"), strict=False):
        ax.set(xlabel="normal force [N]", ylabel=label, xlim=(0.0, 1.1 * most))
    panels[0].set_ylim(bottom=0)
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def _coefficients(
    ax: Axes,
    fits: Sequence[FrictionFit],
    colour: str,
    scale: float,
    offset: float,
    label: str | None,
    shift: float = 0.0,
) -> None:
    """Coefficients times a scale plus an offset, 95 % confidence; shifted sideways so that bars stay apart."""
    value = [f.friction_coefficient or 0.0 for f in fits]
    ends = [f.coefficient_interval for f in fits]
    low = [scale * (c - (end[0] if end[0] is not None else c)) for c, end in zip(value, ends, strict=True)]
    high = [scale * ((end[1] if end[1] is not None else c) - c) for c, end in zip(value, ends, strict=True)]
    force = [f.normal_force_n + shift for f in fits]
    places = [scale * c + offset for c in value]
    ax.errorbar(force, places, yerr=[low, high], fmt="o", color=colour, markersize=3.5, capsize=2, label=label)


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
    names = [fill(f"{'–' if r.rank is None else r.rank}  {r.material}", NAME) for r in ranks]
    ax.set_yticks(range(len(ranks)), names)
    ax.set_ylim(len(ranks) - 0.5, -0.5)
    if any(r.value is not None for r in ranks):
        ax.margins(x=0.12)
        ax.set_xlim(left=-0.03 * ax.get_xlim()[1])
        ax.xaxis.set_major_locator(MaxNLocator(4))
    else:
        ax.set_xticks([])
    ax.set_xlabel(fill(ranks[0].unit, 26) if ranks else "")
