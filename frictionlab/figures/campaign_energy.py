"""Energy per cycle over frequency: measured with its error, and Coulomb's prediction (thesis Figs 4.8 to 4.11)."""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.campaign import Campaign, FrictionFit, Verdict
from frictionlab.figures.campaign_maps import resonance_band
from frictionlab.figures.style import GREY, PAGE, PALETTE, new_figure, shades

MARKERS = "os^Dv<>p"
HIGH = 6  # rows of a legend beside a low panel


def energy(campaign: Campaign, material: str) -> Figure:
    """Energy per cycle of one material for each normal force; open markers are tests the fit left out."""
    figure = new_figure(PAGE, 3.8)
    ax = figure.subplots()
    fits = _by_force(campaign, material)
    for i, (fit, colour) in enumerate(zip(fits, shades(len(fits)), strict=True)):
        marker = MARKERS[i % len(MARKERS)]
        beta = "no fit" if fit.friction_ratio is None else f"β = {fit.friction_ratio:.3f}"
        _points(ax, fit, colour, marker, f"{fit.normal_force_n:g} N, {beta}")
        _prediction(ax, campaign, fit, colour)
    _finish(ax, campaign, fits)
    ax.set_title(f"{material}: points measured, lines Coulomb's law with one friction ratio β per force")
    figure.legend(title="normal force", loc="outside right upper")
    return figure


def _by_force(campaign: Campaign, material: str) -> list[FrictionFit]:
    return sorted((f for f in campaign.fits if f.material == material), key=lambda fit: fit.normal_force_n)


def comparison(campaign: Campaign) -> Figure:
    """The materials beside each other at each normal force that at least two of them have in common."""
    forces = common_forces(campaign)
    rows = (len(forces) + 1) // 2
    figure = new_figure(PAGE, 0.4 + 2.3 * rows)
    axes = figure.subplots(rows, 2 if len(forces) > 1 else 1, sharex=True, sharey=True, squeeze=False).ravel()
    for ax, force in zip(axes, forces, strict=False):
        for i, material in enumerate(campaign.materials):
            fits = [f for f in campaign.fits if f.material == material and f.normal_force_n == force]
            for fit in fits:
                _points(ax, fit, PALETTE[i % len(PALETTE)], MARKERS[i % len(MARKERS)], fill(material, 30), joined=True)
        _finish(ax, campaign, [f for f in campaign.fits if f.normal_force_n == force])
        ax.set_title(f"{force:g} N")
        ax.legend()
    for above, ax in zip(axes[-4:-2], axes[-2:], strict=False):
        if ax in axes[len(forces) :]:
            above.tick_params(labelbottom=True)
            ax.remove()
    return figure


def common_forces(campaign: Campaign) -> tuple[float, ...]:
    """Normal forces under which at least two materials were measured."""
    forces = [f.normal_force_n for f in campaign.fits]
    return tuple(sorted({force for force in forces if forces.count(force) > 1}))


def residuals(campaign: Campaign) -> Figure:
    """Measured over predicted energy - 1 of each test; crosses are tests the fit left out."""
    figure = new_figure(PAGE, 0.5 + 1.5 * len(campaign.materials))
    axes = figure.subplots(len(campaign.materials), 1, sharex=True, squeeze=False)[:, 0]
    for ax, material in zip(axes, campaign.materials, strict=True):
        ax.axhline(0, color=GREY, linewidth=0.8)
        reach = _reach(campaign, material)
        fits = _by_force(campaign, material)
        for i, (fit, colour) in enumerate(zip(fits, shades(len(fits)), strict=True)):
            _residuals_of(ax, fit, colour, MARKERS[i % len(MARKERS)], reach)
        ax.set_title(material)
        ax.set_ylabel("residual [%]")
        ax.set_ylim(-reach, reach)
        ax.set_xlim(0, _end(campaign))
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), ncols=_columns(campaign, material))
    axes[-1].set_xlabel("frequency ratio r")
    return figure


def _columns(campaign: Campaign, material: str) -> int:
    return 1 + (len(_by_force(campaign, material)) - 1) // HIGH


def _end(campaign: Campaign) -> float:
    """The right end of frequency ratios: the same in all panels, from 0, for a few tests lie close together."""
    return 1.03 * max((t.r for t in campaign.trials if not t.failed), default=1.0)


def _reach(campaign: Campaign, material: str) -> float:
    """Half the height of a panel of residuals (%): all tests that a fit used are inside."""
    used = [v for f in campaign.fits if f.material == material for v in f.used]
    return 1.3 * max([100 * abs(v.residual or 0.0) + _confidence(v) for v in used], default=1.0) + 0.5


def _confidence(verdict: Verdict) -> float:
    """Half the 95 % confidence of a residual (%), by the scatter of the test's own cycles."""
    mean, se = verdict.trial.mean[0], verdict.trial.mean_se[0]
    return 196.0 * (1.0 + (verdict.residual or 0.0)) * se / mean if mean > 0.0 else 0.0


def _residuals_of(ax: Axes, fit: FrictionFit, colour: str, marker: str, reach: float) -> None:
    short = [v for v in fit.verdicts if not v.trial.is_long and v.residual is not None]
    for used, sign, label in ((True, marker, f"{fit.normal_force_n:g} N"), (False, "x", None)):
        chosen = [v for v in short if (v.excluded is None) == used]
        values = np.clip([100 * (v.residual or 0.0) for v in chosen], -0.97 * reach, 0.97 * reach)
        bars = [_confidence(v) for v in chosen] if used else None
        ratios = [v.trial.r for v in chosen]
        ax.errorbar(ratios, values, yerr=bars, fmt=sign, color=colour, markersize=3, label=label, elinewidth=0.6)


def _points(ax: Axes, fit: FrictionFit, colour: str, marker: str, label: str, *, joined: bool = False) -> None:
    short = sorted((v for v in fit.verdicts if not v.trial.is_long), key=lambda v: v.trial.r)
    used = [v for v in short if v.excluded is None]
    left = [v for v in short if v.excluded is not None]
    _bars(ax, used, colour, marker, filled=True, label=label)
    _bars(ax, left, colour, marker, filled=False, label=None if used else label)
    if joined:
        _join(ax, short, colour)


def _bars(ax: Axes, verdicts: Sequence[Verdict], colour: str, marker: str, *, filled: bool, label: str | None) -> None:
    if not verdicts:
        return
    ax.errorbar(
        [v.trial.r for v in verdicts],
        [v.trial.mean[0] for v in verdicts],
        yerr=[1.96 * v.trial.mean_se[0] for v in verdicts],
        fmt=marker,
        color=colour,
        markersize=3.2,
        markerfacecolor=colour if filled else "white",
        elinewidth=0.8,
        capsize=1.5,
        label=label,
    )


def _join(ax: Axes, short: Sequence[Verdict], colour: str) -> None:
    """Join the points by a line, but never across the band at resonance that was left out."""
    band = resonance_band([v.trial.r for v in short])
    cut = band[0] if band else np.inf
    for part in ([v for v in short if v.trial.r <= cut], [v for v in short if v.trial.r > cut]):
        ax.plot([v.trial.r for v in part], [v.trial.mean[0] for v in part], color=colour, linewidth=0.8)


def _prediction(ax: Axes, campaign: Campaign, fit: FrictionFit, colour: str) -> None:
    for curve in campaign.curves:
        if (curve.material, curve.normal_force_n) == (fit.material, fit.normal_force_n):
            ax.plot(curve.r, curve.energy, color=colour, linewidth=0.9)


def _finish(ax: Axes, campaign: Campaign, fits: Sequence[FrictionFit]) -> None:
    """Axes that show all that was measured; a prediction near resonance may leave them at the top."""
    energies = [v.trial.mean[0] for f in fits for v in f.verdicts if not v.trial.is_long]
    ax.set_ylim(0, 1.12 * max(energies, default=1.0) or 1.0)
    ax.set_xlim(0, _end(campaign))
    ax.set_xlabel("frequency ratio r")
    ax.set_ylabel("energy per cycle / kY²")
