"""A campaign's materials: friction over force, laws, energy over frequency, responses and drift over time."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.analysis.steadiness import Trend
from frictionlab.campaign import Campaign
from frictionlab.campaign.friction import Verdict
from frictionlab.campaign.ranking import Drift
from frictionlab.campaign.trials import levels, nearest
from frictionlab.figures import style
from frictionlab.figures.judged import draw_evidence, draw_force

SHOWN = 16  # laws of a ladder
ASIDE = 0.015  # of the largest force: between the points of two materials
NORMAL = 1.96
ENERGY, FORCE = "energy per cycle / kY²", "normal force [N]"
OF_LAW: Mapping[str, Any] = {"color": "black", "lw": 0.7}  # a line


def has_several_forces(campaign: Campaign) -> bool:
    """Whether a coefficient of some material is known under two normal forces."""
    known = [f.material for f in campaign.fits if f.friction_coefficient is not None]
    return len(known) > len(set(known))


def friction(campaign: Campaign) -> Figure:
    """Friction coefficient.

    Points: one coefficient per normal force, fitted over all frequency ratios, 95 % confidence; where no material has
    several forces, one per test, by its own cycles, and the mean's confidence shaded. Dashed: each material's mean by
    the fit of one coefficient, where all its points would lie by Amontons' law; sensors and rig, common to all points,
    are found anew for them, so all may lie on one side of it. Right: the distance from it, materials side by side;
    dotted: the mean's confidence.
    """
    with style.drawing(3.2) as figure:
        axes = style.panels(figure, 2 if has_several_forces(campaign) else 1)
        most, stiffness = max((f.normal_force_n for f in campaign.fits), default=1.0), campaign.scene.rig.stiffness
        of = across(campaign)[1]
        for i, (test, marker) in enumerate(zip(campaign.amontons, cycle(style.MARKERS), strict=False)):
            colour = style.PALETTE[i % len(style.PALETTE)]
            known = [f for f in campaign.fits if f.material == test.material and f.friction_coefficient is not None]
            points = [(f.normal_force_n, f.coefficient) for f in known]
            if len(axes) == 1:
                tests = [(f.normal_force_n, v) for f in known for v in f.used]
                forces = [(n, v, v.alone.scaled(stiffness).scaled(v.trial.base_amplitude_m)) for n, v in tests]
                if campaign.is_given:  # the ratio is the coefficient
                    forces = [(n, v, v.alone.scaled(n)) for n, v in tests]
                points = [(getattr(v.trial, of), force.over(n)) for n, v, force in forces]
            rows = [(place, c.value, c.low, c.high) for place, c in points]
            force, value, low, high = np.array(rows, dtype=np.float64).reshape(-1, 4).T
            how: dict[str, Any] = {"fmt": marker, "color": colour, "markersize": 3.5, "capsize": 2}
            axes[0].errorbar(force, value, yerr=[value - low, high - value], label=test.material, **how)
            if test.coefficient is not None and test.coefficient_se is not None:
                percent, reach = 100.0 / test.coefficient, NORMAL * test.coefficient_se
                axes[0].axhline(test.coefficient, color=colour, linewidth=0.6, linestyle="--")
                if len(axes) == 1:
                    axes[0].axhspan(test.coefficient - reach, test.coefficient + reach, color=colour, alpha=0.12, lw=0)
                for ax in axes[1:]:  # shifted sideways so that bars stay apart; dots of all lines take turns
                    aside = most * ASIDE * (i - 0.5 * (len(campaign.amontons) - 1))
                    dots = (2.0 * i, (1.0, 2.0 * len(campaign.amontons) - 1.0))
                    bars = [percent * (value - low), percent * (high - value)]
                    ax.errorbar(force + aside, percent * value - 100.0, yerr=bars, **how)
                    for end in (-percent * reach, percent * reach):
                        ax.axhline(end, color=colour, linewidth=0.8, linestyle=dots)
        for ax, label in zip(axes, ("friction coefficient", "deviation from the material's mean [%]"), strict=False):
            ax.set(xlabel=FORCE, ylabel=label, xlim=(0.0, 1.1 * most))
        if len(axes) == 1:
            _set_across(axes[0], campaign)
        axes[0].set_ylim(bottom=0)
        figure.legend(loc="outside lower center", ncols=4)
    return figure


def law_of_material(campaign: Campaign, material: str) -> Figure:
    """The contact.

    Friction force over displacement and speed, of the tests that the legend names; broad: measured, or recovered from
    the motion, no law assumed, its corners then rounded above 25 harmonics; thin: the law. Right: log evidence of the
    laws tried, by all tests, less that of the law required (orange).
    """
    loops = [loop for loop in campaign.loops if loop[0].material == material]
    loops.sort(key=lambda loop: (round(loop[0].r, 2), loop[0].normal_force or 0.0))
    tried: list[Any] = [law for law in campaign.laws if law["material"] == material and law["note"] is None]
    law = None if campaign.joint is None else campaign.joint.law(material)
    with style.drawing(title=f"{material}: {'no law' if law is None else law.name}") as figure:
        axes = style.panels(figure, 3 if tried else 2, across=3)
        for ax, over_speed in zip(axes[:2], (False, True), strict=True):
            for colour, (test, contact) in zip(style.PALETTE, loops, strict=False):
                speed = f"{1e3 * test.turn * test.unit:.3g} mm/s"
                name = f"{test.normal_force:.4g} N, {speed if campaign.is_given else f'r = {test.r:.2g}'}"
                seen = {"color": colour, "label": name, "lw": 2.0, "alpha": 0.5}
                draw_force(contact, ax, seen, OF_LAW, over_speed=over_speed)
        axes[0].legend(fontsize=style.SMALL, loc="center", frameon=True, framealpha=0.9)
        if tried:
            shown = [law for n, law in enumerate(tried) if n < SHOWN or law["required"] or law["law"] == "coulomb"]
            required = next((law for law in tried if law["required"]), tried[0])
            above = [law["log_evidence"] - required["log_evidence"] for law in shown]
            draw_evidence(axes[2], [law["law"] for law in shown], above, required["law"])
    return figure


def energy(campaign: Campaign, material: str) -> Figure:
    """Energy per cycle.

    Points: measured, mean over the cycles used, 95 % confidence; open ones are left out of the fit. Lines: the law,
    with one friction ratio β per normal force.
    """
    fits = sorted((f for f in campaign.fits if f.material == material), key=lambda fit: fit.normal_force_n)
    over_r = across(campaign)[0] != FORCE
    with style.drawing(3.8) as figure:
        ax = figure.subplots()
        for fit, colour, marker in zip(fits, style.shades(len(fits)), cycle(style.MARKERS), strict=False):
            ratio = "no fit" if fit.friction_ratio is None else f"β = {fit.friction_ratio:.3f}"
            label = f"{fit.normal_force_n:.4g} N, {ratio}"
            _draw_tests(ax, campaign, list(map(_energy, fit.verdicts)), colour, marker, label)
            if not over_r:
                known = [(fit.normal_force_n, v.predicted.energy_per_cycle or 0.0) for v in fit.used if v.predicted]
                ax.plot(*np.reshape(known, (-1, 2)).T, "_", color=colour, markersize=14)
            elif fit.setting in campaign.curves:
                ax.plot(*campaign.curves[fit.setting], color=colour, linewidth=0.9)
        energies = [v.energy.value or 0.0 for f in fits for v in f.verdicts if not v.trial.is_long]
        if not over_r:  # near resonance, over r, predictions have no bound
            energies += [v.predicted.energy_per_cycle or 0.0 for f in fits for v in f.used if v.predicted]
        _set_across(ax, campaign)
        ax.set(ylabel=ENERGY, ylim=(0, 1.12 * max(energies, default=1.0) or 1.0))
        ax.set_title(f"{material}{at_lag(campaign)}")
        figure.legend(title="normal force", loc="outside right upper")
    return figure


def count(campaign: Campaign, material: str) -> int:
    """How many short tests of a material are drawn."""
    fits = [fit for fit in campaign.fits if fit.material == material]
    return sum(not verdict.trial.is_long for fit in fits for verdict in fit.verdicts)


def across(campaign: Campaign) -> tuple[str, str]:
    """What tests are drawn over, and its attribute: r (speed, where motions are given), or force where all have one."""
    tests = [t for t in campaign.trials if not t.failed]
    name, of = ("largest speed [mm/s]", "speed_mm_per_s") if campaign.is_given else ("frequency ratio r", "r")
    several = len({t.normal_force_n for t in tests}) > 1
    return (FORCE, "normal_force_n") if several and len(levels([getattr(t, of) for t in tests])) < 2 else (name, of)


def _set_across(ax: Axes, campaign: Campaign) -> None:
    """What tests are drawn over, from 0 on."""
    name, of = across(campaign)
    most = max((getattr(t, of) for t in campaign.trials if not t.failed), default=1.0)
    ax.set(xlabel=name, xlim=(0, (1.1 if name == FORCE else 1.03) * most))


def at_lag(campaign: Campaign) -> str:
    """At which lag energies are shown, as the law's are: the one that the tests find, the declared one included."""
    lag = 0.0 if campaign.joint is None else campaign.joint.lag_s()
    return f", at the lag found ({1e3 * (campaign.scene.sensors.lag_s + lag):+.3g} ms)" if lag else ""


def _energy(verdict: Verdict) -> tuple[Verdict, float, float]:
    """A test's energy at the lag found, and half its 95 % confidence."""
    energy, seen = verdict.energy.value or 0.0, verdict.trial.mean[0]
    return verdict, energy, NORMAL * verdict.trial.mean_se[0] * (energy / seen if seen else 1.0)


def _draw_tests(
    ax: Axes, campaign: Campaign, rows: Sequence[tuple[Verdict, float, float]], colour: str, marker: str, label: str
) -> None:
    """Numbers of the short tests with their 95 % confidence; open: left out of the fit."""
    of = across(campaign)[1]
    for used, fill_colour in ((True, colour), (False, "white")):
        part = [row for row in rows if not row[0].trial.is_long and (row[0].excluded is None) is used]
        if part:
            trials, values, errors = zip(*((v.trial, value, error) for v, value, error in part), strict=True)
            places = [getattr(trial, of) for trial in trials]
            how: dict[str, Any] = {"markersize": 3.2, "markerfacecolor": fill_colour, "elinewidth": 0.7, "capsize": 1.5}
            ax.errorbar(places, values, yerr=errors, fmt=marker, color=colour, label=label, **how)
            label = ""


def drift(campaign: Campaign, level: float) -> Figure:
    """Energy per cycle over time.

    One cycle every ten seconds. Dotted: trend; band: its 95 % confidence, correlation between neighbours included.
    """
    every = drift_levels(campaign)
    tests = [d for d in campaign.drifts if nearest(d.trial.r, every) == level]
    with style.drawing() as figure:
        ax = figure.subplots()
        for test in sorted(tests, key=lambda test: test.trial.material or ""):
            index = campaign.materials.index(test.trial.material) if test.trial.material in campaign.materials else 0
            if test.trend is not None:
                _draw_trend(ax, test, test.trend, style.PALETTE[index % len(style.PALETTE)])
        ax.set(xlabel="time [min]", ylabel=ENERGY)
        ax.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return figure


def drift_levels(campaign: Campaign) -> tuple[float, ...]:
    """The frequency ratios of the long tests whose points are at hand."""
    return levels([d.trial.r for d in campaign.drifts if d.trend is not None])


def _draw_trend(ax: Axes, test: Drift, trend: Trend, colour: str) -> None:
    time, said = trend.time, test.verdict
    if len(trend.jumps):
        said = f"jumps at {', '.join(f'{at:.3g}' for at in trend.jumps / 60)} min"
    else:
        about = time - time.mean()
        line = trend.level + trend.slope * about
        level_error = trend.slope_se * float(np.sqrt(np.mean(about**2)))
        reach = 0.5 * (trend.high - trend.low) / max(trend.slope_se, 1e-300)
        band = reach * np.hypot(level_error, trend.slope_se * about)
        said = f"{100 * (test.relative_slope_per_hour or 0.0):+.1f} %/h, {said}"
        ax.plot(time / 60, line, ":", color=colour, linewidth=1.4)
        ax.fill_between(time / 60, line - band, line + band, color=colour, alpha=0.25, linewidth=0)
    label = f"{test.trial.material}, {test.trial.normal_force_n:.4g} N: {said}"
    ax.plot(time / 60, trend.value, ".", color=colour, markersize=2.5, alpha=0.6, label=label)
