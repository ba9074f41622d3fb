"""A campaign's materials: friction over force, rankings, laws, energy over frequency, responses and drift over time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from frictionlab.arrays import FloatArray
from frictionlab.campaign import (
    CRITERIA,
    Campaign,
    Drift,
    FrictionFit,
    LawEvidence,
    MeasuredResponse,
    Rank,
    Trial,
    Verdict,
)
from frictionlab.campaign.trials import levels, nearest
from frictionlab.figures import style
from frictionlab.figures.grids import resonance_band

NAME = 24  # letters of a name in a line
STEP = 5.0  # log evidence beyond which the scale is logarithmic
SHOWN = 8  # laws of a ladder
TICKS = {0.0: "0", 10.0: "10", 1e3: "10³", 1e5: "10⁵", 1e7: "10⁷", 1e9: "10⁹"}
MARKERS = "os^Dv<>p"
HIGH = 6  # rows of a legend beside a low panel
NORMAL = 1.96


def has_several_forces(campaign: Campaign) -> bool:
    """Whether a coefficient of some material is known under two normal forces."""
    known = [f.material for f in campaign.fits if f.friction_coefficient is not None]
    return len(known) > len(set(known))


def friction(campaign: Campaign) -> Figure:
    """Friction coefficient of each material over normal force; beside it, how far each point is from the mean."""
    figure = style.new_figure(style.PAGE, 3.2)
    panels = figure.subplots(1, 2 if has_several_forces(campaign) else 1, squeeze=False)[0]
    for i, test in enumerate(campaign.amontons):
        fits = [f for f in campaign.fits if f.material == test.material and f.friction_coefficient is not None]
        colour = style.PALETTE[i % len(style.PALETTE)]
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
    figure = style.new_figure(style.PAGE, 1.0 + 0.3 * len(campaign.materials))
    for ax, criterion in zip(figure.subplots(1, len(CRITERIA), squeeze=False)[0], CRITERIA, strict=True):
        _rank_panel(ax, [r for r in campaign.ranking if r.criterion == criterion], campaign)
        ax.set_title(criterion)
    return figure


def _rank_panel(ax: Axes, ranks: Sequence[Rank], campaign: Campaign) -> None:
    for place, rank in enumerate(ranks):
        colour = style.PALETTE[campaign.materials.index(rank.material) % len(style.PALETTE)]
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


def law_of_material(campaign: Campaign, material: str) -> Figure:
    """Loops of a few tests as recovered from the motion, the law over them; the evidence of each law tried."""
    loops = [loop for loop in campaign.loops if loop.material == material]
    laws = [law for law in campaign.laws if law.material == material]
    figure = style.new_figure(style.PAGE, 3.0)
    panels = figure.subplots(1, 3 if laws else 2)
    unit = "N" if campaign.scene.rig.stiffness is not None else "k Y"
    for over_speed, ax in zip((False, True), panels[:2], strict=True):
        for i, loop in enumerate(loops):
            seen, predicted = (loop.speed, loop.law_speed) if over_speed else (loop.place, loop.law_place)
            how = {
                "color": style.PALETTE[i % len(style.PALETTE)],
                "label": f"{loop.normal_force_n:.4g} N, r = {loop.r:.2g}",
            }
            ax.plot(style.closed(1e3 * seen), style.closed(loop.force), lw=2.0, alpha=0.5, **how)
            ax.plot(style.closed(1e3 * predicted), style.closed(loop.law_force), color="black", lw=0.7)
        ax.set_xlabel("speed [mm/s]" if over_speed else "displacement [mm]")
        ax.set_ylabel(f"friction force [{unit}]")
    panels[0].legend(fontsize=6, loc="center", frameon=True, framealpha=0.9)
    if laws:
        _ladder(panels[2], laws)
    law = None if campaign.joint is None else campaign.joint.law(material)
    style.headline(figure, f"{material}: {'no law' if law is None else law.name}")
    return figure


def _ladder(ax: Axes, laws: list[LawEvidence]) -> None:
    """Log evidence of each law below the best; the required one large."""
    best = sorted(laws, key=lambda law: -law.log_evidence)
    shown = [law for n, law in enumerate(best) if n < SHOWN or law.required or law.law == "coulomb"]
    for place, law in enumerate(reversed(shown)):
        colour = style.PREDICTED if law.required else style.MEASURED
        below = best[0].log_evidence - law.log_evidence
        ax.plot(below, place, "o", ms=6 if law.required else 4, color=colour, clip_on=False, zorder=3)
    ax.set_xscale("symlog", linthresh=STEP)
    most = max(best[0].log_evidence - law.log_evidence for law in shown)
    ticks = [tick for tick in TICKS if tick <= 10.0 * most]
    ax.set_xticks(ticks, [TICKS[tick] for tick in ticks])
    ax.minorticks_off()
    ax.set_xlim(-0.8, max(3.0 * most, STEP))
    names = [law.law.removeprefix("coulomb") or "coulomb" for law in reversed(shown)]
    ax.set_yticks(range(len(shown)), names, fontsize=6)
    ax.set_xlabel("log evidence below the best")


def energy(campaign: Campaign, material: str) -> Figure:
    """Energy per cycle of one material for each normal force; open markers are tests the fit left out."""
    figure = style.new_figure(style.PAGE, 3.8)
    ax = figure.subplots()
    fits = _by_force(campaign, material)
    for i, (fit, colour) in enumerate(zip(fits, style.shades(len(fits)), strict=True)):
        marker = MARKERS[i % len(MARKERS)]
        beta = "no fit" if fit.friction_ratio is None else f"β = {fit.friction_ratio:.3f}"
        _points(ax, fit, colour, marker, f"{fit.normal_force_n:.4g} N, {beta}", across=_across(campaign))
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
    figure = style.new_figure(style.PAGE, 0.4 + 2.3 * rows)
    axes = figure.subplots(rows, 2 if len(forces) > 1 else 1, sharex=True, sharey=True, squeeze=False).ravel()
    for ax, force in zip(axes, forces, strict=False):
        for i, material in enumerate(campaign.materials):
            fits = [f for f in campaign.fits if f.material == material and f.normal_force_n == force]
            for fit in fits:
                colour, marker = style.PALETTE[i % len(style.PALETTE)], MARKERS[i % len(MARKERS)]
                _points(ax, fit, colour, marker, fill(material, 30), across=_across(campaign), joined=True)
        _finish(ax, campaign, [f for f in campaign.fits if f.normal_force_n == force])
        ax.set_title(f"{force:.4g} N")
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
    figure = style.new_figure(style.PAGE, 0.5 + 1.5 * len(campaign.materials))
    axes = figure.subplots(len(campaign.materials), 1, sharex=True, squeeze=False)[:, 0]
    for ax, material in zip(axes, campaign.materials, strict=True):
        ax.axhline(0, color=style.GREY, linewidth=0.8)
        fits = _by_force(campaign, material)
        used = [100 * abs(v.residual or 0.0) + _confidence(v) for fit in fits for v in fit.used]
        reach = 1.3 * max(used, default=1.0) + 0.5  # half the height (%): all tests that a fit used are inside
        for i, (fit, colour) in enumerate(zip(fits, style.shades(len(fits)), strict=True)):
            _residuals_of(ax, fit, colour, MARKERS[i % len(MARKERS)], reach, _across(campaign))
        ax.set_title(material)
        ax.set_ylabel("residual [%]")
        ax.set_ylim(-reach, reach)
        ax.set_xlim(0, _across(campaign).end)
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), ncols=1 + (len(fits) - 1) // HIGH)
    axes[-1].set_xlabel(_across(campaign).label)
    return figure


@dataclass(frozen=True)
class _Across:
    """What tests are drawn over, from 0 to ``end``: frequency ratio, or normal force where all have one ratio."""

    label: str
    end: float
    at: Callable[[Trial], float]


def _across(campaign: Campaign) -> _Across:
    """The same for all panels of a figure."""
    tests = [t for t in campaign.trials if not t.failed]
    if len(levels([t.r for t in tests])) < 2 < 1 + len({t.normal_force_n for t in tests}):
        most = max(t.normal_force_n or 0.0 for t in tests)
        return _Across("normal force [N]", 1.1 * most, lambda trial: trial.normal_force_n or 0.0)
    return _Across("frequency ratio r", 1.03 * max((t.r for t in tests), default=1.0), lambda trial: trial.r)


def _confidence(verdict: Verdict) -> float:
    """Half the 95 % confidence of a residual (%), by the scatter of the test's own cycles."""
    mean, se = verdict.trial.mean[0], verdict.trial.mean_se[0]
    return 196.0 * (1.0 + (verdict.residual or 0.0)) * se / mean if mean > 0.0 else 0.0


def _residuals_of(ax: Axes, fit: FrictionFit, colour: str, marker: str, reach: float, across: _Across) -> None:
    short = [v for v in fit.verdicts if not v.trial.is_long and v.residual is not None]
    for used, sign, label in ((True, marker, f"{fit.normal_force_n:.4g} N"), (False, "x", None)):
        chosen = [v for v in short if (v.excluded is None) == used]
        values = np.clip([100 * (v.residual or 0.0) for v in chosen], -0.97 * reach, 0.97 * reach)
        bars = [_confidence(v) for v in chosen] if used else None
        places = [across.at(v.trial) for v in chosen]
        ax.errorbar(places, values, yerr=bars, fmt=sign, color=colour, markersize=3, label=label, elinewidth=0.6)


def _points(
    ax: Axes, fit: FrictionFit, colour: str, marker: str, label: str, *, across: _Across, joined: bool = False
) -> None:
    """Measured energies with their 95 % confidence; open: left out of the fit."""
    short = sorted((v for v in fit.verdicts if not v.trial.is_long), key=lambda v: v.trial.r)
    used = [v for v in short if v.excluded is None]
    left = [v for v in short if v.excluded is not None]
    for verdicts, fill_colour, name in ((used, colour, label), (left, "white", None if used else label)):
        if verdicts:
            ax.errorbar(
                [across.at(v.trial) for v in verdicts],
                [v.trial.mean[0] for v in verdicts],
                yerr=[NORMAL * v.trial.mean_se[0] for v in verdicts],
                fmt=marker,
                color=colour,
                markersize=3.2,
                markerfacecolor=fill_colour,
                elinewidth=0.8,
                capsize=1.5,
                label=name,
            )
    if joined:
        _join(ax, short, colour)


def _join(ax: Axes, short: Sequence[Verdict], colour: str) -> None:
    """Join the points by a line, but never across the band at resonance that was left out."""
    band = resonance_band([v.trial.r for v in short])
    cut = band[0] if band else np.inf
    for part in ([v for v in short if v.trial.r <= cut], [v for v in short if v.trial.r > cut]):
        ax.plot([v.trial.r for v in part], [v.trial.mean[0] for v in part], color=colour, linewidth=0.8)


def _prediction(ax: Axes, campaign: Campaign, fit: FrictionFit, colour: str) -> None:
    across = _across(campaign)
    if across.label != "frequency ratio r":
        known = [v for v in fit.used if v.predicted is not None]
        foretold = [v.predicted.energy for v in known if v.predicted is not None]
        ax.plot([across.at(v.trial) for v in known], foretold, "_", color=colour, markersize=14)
        return
    for curve in campaign.curves:
        if (curve.material, curve.normal_force_n) == (fit.material, fit.normal_force_n):
            ax.plot(curve.r, curve.energy, color=colour, linewidth=0.9)


def _finish(ax: Axes, campaign: Campaign, fits: Sequence[FrictionFit]) -> None:
    """Axes that show all that was measured; a prediction near resonance may leave them at the top."""
    energies = [v.trial.mean[0] for f in fits for v in f.verdicts if not v.trial.is_long]
    ax.set_ylim(0, 1.12 * max(energies, default=1.0) or 1.0)
    ax.set_xlim(0, _across(campaign).end)
    ax.set_xlabel(_across(campaign).label)
    ax.set_ylabel("energy per cycle / kY²")


def responses(campaign: Campaign) -> Figure:
    """Steady and unsteady examples: the last cycles of short tests."""
    shown = [r for r in campaign.responses if not r.trial.is_long]
    rows = (len(shown) + 1) // 2
    figure = style.new_figure(style.PAGE, 0.4 + 1.7 * rows)
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
    figure = style.new_figure(style.PAGE, 0.4 + 1.35 * len(whole))
    axes = figure.subplots(len(whole), 2, squeeze=False, width_ratios=(3, 2))
    for (left, right), response in zip(axes, whole, strict=True):
        minutes = response.time / 60
        left.fill_between(
            minutes, _side(response.mass, 0), _side(response.mass, 1), color=style.MEASURED, linewidth=0.3
        )
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


def _trace(ax: Axes, response: MeasuredResponse) -> None:
    ax.plot(response.time, response.mass, color=style.MEASURED, linewidth=1.1, label="mass x / Y")
    ax.plot(response.time, response.base, color=style.BASE, linewidth=0.8, linestyle="--", label="base y / Y")
    ax.set_title(_title(response))
    ax.set_xlabel("time [s]")
    ax.margins(x=0)


def _title(response: MeasuredResponse) -> str:
    trial = response.trial
    return f"{response.label}: {trial.material}, {trial.normal_force_n:.4g} N, r = {trial.r:.3g}"


def drift(campaign: Campaign, level: float) -> Figure:
    """Energy of one cycle every ten seconds at one frequency ratio; line: trend, band: its 95 % confidence."""
    figure = style.new_figure(style.PAGE, 3.0)
    ax = figure.subplots()
    for i, material in enumerate(campaign.materials):
        for test in drifts_at(campaign, level):
            if test.trial.material == material:
                _trend(ax, test, style.PALETTE[i % len(style.PALETTE)])
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
    label = f"{test.trial.material}, {test.trial.normal_force_n:.4g} N: {percent:+.1f} %/h, {test.verdict}"
    ax.plot(time / 60, trend.value, ".", color=colour, markersize=2.5, alpha=0.6)
    ax.plot(time / 60, line, ":", color=colour, linewidth=1.4, label=label)
    ax.fill_between(time / 60, line - band, line + band, color=colour, alpha=0.25, linewidth=0)
