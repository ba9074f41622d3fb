"""Measured over predicted: a cycle and its loop; what the contact does, the law over it, and the ladder of laws."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.errors import UsageError
from frictionlab.figures import style
from frictionlab.inference.comparison import Comparison, ContactForce, OverFrequency
from frictionlab.simulator.laws import law_of

STILL = 1e-9  # of omega Y: a contact that is slower stands
ROW = 0.115  # inches: a law of the ladder
WIDTHS = (2.0, 1.0, 1.0)  # of what is left, misfit, and evidence
NEAR, FAR = (-100.0, -10.0, 0.0, 10.0), (-1000.0, -10.0, 0.0, 10.0)  # ticks of evidence
FLATTENED = 3.0  # times the largest point: a peak of the curve above which a linear axis flattens the points
ABOVE = 60.0  # evidence shown at least: space for numbers beside the law required


def comparison_figure(comparison: Comparison) -> Figure:
    """Time response and loop, measured over predicted, with the numbers above; of a table over frequency its numbers.

    The area of the loop (base over mass) is the energy per cycle, eq. (2.18).
    """
    if comparison.over_frequency is not None:
        return _frequency_figure(comparison, comparison.over_frequency)
    if not len(comparison.tau) and comparison.contact is not None:  # the motion is given: only the force is judged
        return contact_figure(comparison.contact)
    if not len(comparison.tau):
        raise UsageError("plot: there is no steady cycle to draw; do: plot its whole record (comparison.record)")
    turns, base = np.append(comparison.tau / style.TURN, 1.0), style.closed(comparison.base)
    lines = {"measured": style.closed(comparison.measured)}
    if comparison.predicted is not None:
        lines["predicted"] = style.closed(comparison.predicted - comparison.predicted.mean())
    nrmse, foretold = comparison.response_nrmse, comparison.predicted_energy_per_cycle
    fit = "no prediction" if nrmse is None else f"nrmse {100 * nrmse:.2g} %"
    versus = "" if foretold is None else f", predicted {foretold:.4g}"
    title = f"{_name(comparison.source)}: {comparison.model}{comparison.judged}"
    with style.drawing(3.1, title, comparison.warnings) as figure:
        response, loop = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
        both = {"base": base, **lines}
        style.over_time(response, turns, both, xlabel="drive cycle, ωt / 2π", ylabel="displacement, x / Y")
        response.set_title(f"r = {comparison.frequency_ratio:.5g}   β = {comparison.friction}   {fit}")
        for label, values in lines.items():
            loop.plot(values, base, **style.LINES[label])
        loop.set(xlabel="displacement of the mass, x / Y", ylabel="displacement of the base, y / Y")
        loop.locator_params(nbins=6)  # -0.75 beside -0.50 would touch
        loop.set_title(f"energy {comparison.energy_per_cycle:.4g}{versus} kY²")
    return figure


def _name(source: str) -> str:
    return source.replace("\\", "/").rsplit("/", 1)[-1]


def _frequency_figure(comparison: Comparison, drawn: OverFrequency) -> Figure:
    """Amplitude (Y) and phase (degrees behind the base), whichever was measured, over the frequency ratio."""
    seen, phase = drawn.table, np.unwrap(np.nan_to_num(drawn.curve_phase)) + 0.0 * drawn.curve_phase
    kinds = {
        "amplitude, X / Y": (seen.amplitude, seen.amplitude_u, drawn.curve_amplitude),
        "phase behind the base [deg]": tuple(np.rad2deg(values) for values in (seen.phase, seen.phase_u, phase)),
    }
    measured = {label: values for label, values in kinds.items() if np.isfinite(values[0]).any()}
    left = f"   what is left: {100 * comparison.response_nrmse:.2g} %" if comparison.response_nrmse else ""
    title = f"{comparison.source}: {comparison.law}   beta {comparison.friction}{left}{comparison.judged}"
    with style.drawing(3.1, title, comparison.warnings) as figure:
        axes = figure.subplots(1, len(measured), squeeze=False)[0]
        for ax, (label, (values, u, curve)) in zip(axes, measured.items(), strict=True):
            there = np.isfinite(values)
            error = 1.96 * u[there] if np.isfinite(u[there]).all() else None
            points = (drawn.r[there], values[there])
            ax.errorbar(*points, yerr=error, fmt="o", ms=4, color=style.MEASURED, label="measured")
            ax.plot(drawn.curve_r, curve, color=style.PREDICTED, lw=1.0, label=comparison.law)
            ax.set(xlabel="frequency ratio r", ylabel=label)
            if values is seen.amplitude and np.nanmax(curve) > FLATTENED * np.max(values[there]):
                ax.set_yscale("log")
                style.plain_numbers(ax.yaxis)
            ax.legend()
    return figure


def contact_figure(contact: ContactForce, title: str | None = None) -> Figure:
    """Force over displacement and speed, the residual, and the ladder where one was climbed; warnings below."""
    ladder = max(2.5, 0.7 + ROW * len(contact.laws))
    with style.drawing(2.9 + ladder, f"{_name(title or contact.source)}: {contact.said}", contact.warnings) as figure:
        [above], [below] = figure.subfigures(2, 1, squeeze=False, height_ratios=(2.9, ladder))
        label = "load cell" if contact.is_measured else "recovered from the motion"
        looks = {"label": label, **style.LINES["measured"]}, {"label": contact.law, "color": style.PREDICTED, "lw": 1.0}
        if contact.is_one_way:
            ax, newtons = above.subplots(), contact.unit_n or 1.0
            for at, look in zip((contact.seen, contact.predicted), looks, strict=True):
                if at is not None:
                    force = style.unfolded(at.force, contact.seen.velocity)
                    ax.plot(contact.tau / style.TURN, newtons * force, **look)
            ax.set(xlabel=style.ONE_WAY, ylabel="force of the contact [N]")
        else:
            for ax, over_speed in zip(above.subplots(1, 2), (False, True), strict=True):
                draw_force(contact, ax, *looks, over_speed=over_speed)
        above.axes[0].legend(loc="upper right" if contact.is_one_way else "center", fontsize=style.SMALL)
        if contact.laws:
            left, misfit, evidence = below.subplots(1, 3, width_ratios=WIDTHS)
            _draw_ladder(contact, misfit, evidence)
        else:
            left = below.subplots()
        _draw_residual(contact, left)
    return figure


def draw_force(
    contact: ContactForce, ax: Axes, measured: Mapping[str, Any], law: Mapping[str, Any], *, over_speed: bool
) -> None:
    """Force of the contact over displacement or speed: as recovered, no law assumed, and as the law has it.

    In mm and mm/s; in newtons where the stiffness of the frame is known, else over k Y. The mappings say how both look.
    """
    size, newtons = 1e3 * contact.unit_m * (contact.turn if over_speed else 1.0), contact.unit_n or 1.0
    jumps = over_speed and law_of(contact.law).kind in ("rigid", "smooth")  # others yield in a stop
    for at, look in ((contact.seen, measured), (contact.predicted, law)):
        if at is not None:
            x, y = style.closed(at.velocity if over_speed else at.displacement), style.closed(at.force)
            if jumps and look is law:  # two points at rest wherever the speed turns or stops: friction jumps there
                places = np.flatnonzero(np.diff(np.where(np.abs(x) < STILL, 0.0, np.sign(x)))) + 1
                before_after, twice = np.stack([y[places - 1], y[places]], axis=1), np.repeat(places, 2)
                x, y = np.insert(x, twice, 0.0), np.insert(y, twice, before_after.ravel())
            ax.plot(size * x, newtons * y, **look)
    ax.set_xlabel("speed of the mass [mm/s]" if over_speed else "displacement of the mass [mm]")
    ax.set_ylabel("force of the contact, n / kY" if contact.unit_n is None else "force of the contact [N]")


def _draw_residual(contact: ContactForce, ax: Axes) -> None:
    """What the law misses over the cycle, stops shaded; the dotted lines are the standard error of the mean cycle."""
    turns, unit, above = contact.tau / style.TURN, 1e6 * contact.unit_m, ax.get_xaxis_transform()
    if contact.is_measured:
        unit = contact.unit_n or 1.0
    for edge in (-contact.floor, contact.floor):
        label = "standard error of the mean cycle" if edge > 0.0 else None
        ax.axhline(unit * edge, color=style.GREY, lw=0.8, ls=":", label=label)
    if contact.residual is not None:
        left = style.unfolded(contact.residual, contact.seen.velocity) if contact.is_one_way else contact.residual
        ax.plot(turns, unit * left, color=style.MEASURED, lw=1.0)
    if contact.predicted is not None and not contact.is_one_way:
        stops = np.abs(contact.predicted.velocity) < STILL
        ax.fill_between(turns, 0, 1, where=stops, transform=above, color=style.GREY, alpha=0.2, lw=0)
    ax.set(
        xlabel=style.ONE_WAY if contact.is_one_way else "drive cycle, ωt / 2π (stops shaded)",
        ylabel=f"measured - predicted [{'N' if contact.is_measured else 'µm'}]",
        xlim=(0, 1),
    )
    ax.margins(y=0.2)
    ax.legend(loc="lower right", fontsize=style.SMALL)


def _draw_ladder(contact: ContactForce, misfit: Axes, evidence: Axes) -> None:
    """Misfit, and log evidence less that of the law required, of each law tried, by its number of parameters."""
    tried = sorted(contact.laws.items(), key=lambda law: (law[1][0], -law[1][1]))
    best = contact.laws[contact.law][2] if contact.law in contact.laws else 0.0
    counts, names = [count for _, (count, _, _) in tried], [name for name, _ in tried]
    left = [100.0 * nrmse for _, (_, nrmse, _) in tried]
    draw_rungs(misfit, names, left, contact.law, "{:.2g}")
    misfit.set_yticks(range(len(names)), [f"{n}  {short(name)}" for n, name in zip(counts, names, strict=True)])
    low, high = min(left), max(left)
    misfit.set(
        xlabel="nrmse [%]", ylabel="parameters, law", xscale="log", xlim=(low / 1.4, 1.8 * high * (high / low) ** 0.6)
    )
    style.plain_numbers(misfit.xaxis)
    draw_evidence(evidence, names, [log - best for _, (_, _, log) in tried], contact.law)
    evidence.set_yticks(range(len(names)), [""] * len(names))
    for end in np.cumsum([len(list(group)) for _, group in groupby(counts)])[:-1]:
        for ax in (misfit, evidence):
            ax.axhline(end - 0.5, color=style.GREY, lw=0.5)


def draw_evidence(ax: Axes, names: Sequence[str], evidence: Sequence[float], required: str | None) -> None:
    """Evidence of laws, one below the other, less that of the law required, which is red."""
    draw_rungs(ax, names, evidence, required, "{:+z.0f}")
    ax.set_xscale("symlog", linthresh=10.0)
    least, most = min(-20.0, 3.0 * min(evidence)), max(evidence)
    ticks = [*(FAR if least < FAR[0] / 3.0 else NEAR), *((100.0,) if most > ABOVE else ())]
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.set(xlabel="log evidence less\nthe required law's", xlim=(least, max(ABOVE, 20.0 * most)))


def draw_rungs(ax: Axes, names: Sequence[str], values: Sequence[float], required: str | None, form: str) -> None:
    """A point for each law, one below the other, with its number beside it."""
    colors = [style.PREDICTED if name == required else style.MEASURED for name in names]
    ax.scatter(values, range(len(values)), c=colors, s=14, zorder=3, clip_on=False)
    for place, (value, color) in enumerate(zip(values, colors, strict=True)):
        beside: dict[str, Any] = {"xytext": (4, 0), "textcoords": "offset points", "va": "center"}
        ax.annotate(form.format(value), (value, place), fontsize=style.SMALL, color=color, **beside)
    ax.set_ylim(len(values) - 0.4, -0.6)
    ax.set_yticks(range(len(names)), [short(name) for name in names])
    ax.tick_params(labelsize=style.SMALL)


def short(law: str) -> str:
    """A law's name without the term that all of them begin with: ``+ place + speed``."""
    return law.removeprefix("coulomb").replace("+", " + ").strip() or law
