"""Measured over predicted: a cycle and its loop; what the contact does, the law over it, and the ladder of laws."""

from itertools import groupby, pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.figures import style
from frictionlab.inference import Comparison, ContactForce
from frictionlab.inference.comparison import OverFrequency

STILL = 1e-9  # of omega Y: a contact that is slower stands
SHORTEST = 0.1  # of a cycle: a slide that has room for its name
WIDE = 4.0  # largest misfit over the smallest from which the scale is logarithmic
ROW = 0.115  # inches: a law of the ladder
LETTERS = 6  # points: size of the words inside a panel
ROOM = 0.35  # of a panel's width: for the numbers beside its points
WIDTHS = (2.0, 1.0, 1.0)  # of what is left, misfit, and evidence
NEAR, FAR = (-100.0, -10.0, 0.0, 10.0), (-1000.0, -10.0, 0.0, 10.0)  # ticks of evidence
ABOVE = 60.0  # evidence shown at least: room for numbers beside the law required


def comparison_figure(comparison: Comparison) -> Figure:
    """Time response and loop, measured over predicted, with the numbers above; of a table over frequency its numbers.

    The area of the loop (base over mass) is the energy per cycle, eq. (2.18).
    """
    if comparison.over_frequency is not None:
        return _frequency_figure(comparison, comparison.over_frequency)
    turns, base = np.append(comparison.tau / style.TURN, 1.0), style.closed(comparison.base)
    lines = [
        (style.closed(comparison.measured), {"color": style.MEASURED, "lw": 2.2, "alpha": 0.55, "label": "measured"})
    ]
    if comparison.predicted is not None:
        centred = style.closed(comparison.predicted - comparison.predicted.mean())
        lines.append((centred, {"color": style.PREDICTED, "lw": 1.0, "label": "predicted"}))
    with style.look():
        figure = style.new_figure(style.PAGE, 3.1)
        response, loop = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
        response.plot(turns, base, color=style.BASE, lw=0.9, ls=":", label="base")
        for values, how in lines:
            response.plot(turns, values, **how)
            loop.plot(values, base, **how)
        response.set(xlabel="drive cycle, ωt / 2π", ylabel="displacement, x / Y", xlim=(0, 1))
        response.legend(loc="upper center", ncols=3)
        response.margins(y=0.18)
        loop.set(xlabel="displacement of the mass, x / Y", ylabel="displacement of the base, y / Y")
        response.set_title(_response_title(comparison))
        foretold = comparison.predicted_energy_per_cycle
        versus = "" if foretold is None else f", predicted {foretold:.4g}"
        loop.set_title(f"energy {comparison.energy_per_cycle:.4g}{versus} kY²")
        name = comparison.source.replace("\\", "/").rsplit("/", 1)[-1]
        style.headline(figure, f"{name}: {comparison.model}{_verdict(comparison)}")
        style.caution(figure, comparison.warnings)
        return figure


def draw_over_frequency(drawn: OverFrequency, ax: Axes, *, phase: bool) -> Axes:
    """Amplitude (Y) or phase (degrees behind the base) over the frequency ratio, measured over predicted."""
    measured, u, curve = drawn.amplitude, drawn.amplitude_u, drawn.curve_amplitude
    if phase:
        turned = np.unwrap(np.nan_to_num(drawn.curve_phase)) + 0.0 * drawn.curve_phase
        measured, u, curve = (np.rad2deg(values) for values in (drawn.phase, drawn.phase_u, turned))
    there = np.isfinite(measured)
    error = 1.96 * u[there] if np.isfinite(u[there]).all() else None
    ax.errorbar(drawn.r[there], measured[there], yerr=error, fmt="o", ms=4, color=style.MEASURED, label="measured")
    ax.plot(drawn.curve_r, curve, color=style.PREDICTED, lw=1.0, label=drawn.law)
    ax.set(xlabel="frequency ratio r", ylabel="phase behind the base [deg]" if phase else "amplitude, X / Y")
    ax.legend()
    return ax


def _frequency_figure(comparison: Comparison, drawn: OverFrequency) -> Figure:
    """Amplitude and phase, whichever was measured."""
    kinds = [phase for phase, values in ((False, drawn.amplitude), (True, drawn.phase)) if np.isfinite(values).any()]
    with style.look():
        figure = style.new_figure(style.PAGE, 3.1)
        for ax, phase in zip(np.atleast_1d(figure.subplots(1, len(kinds))), kinds, strict=True):
            draw_over_frequency(drawn, ax, phase=phase)
        left = f"   what is left: {100 * comparison.response_nrmse:.2g} %" if comparison.response_nrmse else ""
        style.headline(figure, f"{drawn.source}: {drawn.law}   beta {comparison.friction}{left}{_verdict(comparison)}")
        style.caution(figure, comparison.warnings)
        return figure


def _response_title(comparison: Comparison) -> str:
    error = comparison.friction.error
    beta = f"β = {comparison.friction_ratio:.4g}" + (f" ± {error:.1g}" if error else "")
    nrmse = comparison.response_nrmse
    fit = "no prediction" if nrmse is None else f"nrmse {100 * nrmse:.2g} %"
    return f"r = {comparison.frequency_ratio:.5g}   {beta}   {fit}"


def _verdict(comparison: Comparison) -> str:
    if comparison.verdict is None:
        return ""
    verdicts = {"explained": "explained", "strained": "explained only by a strained rig or sensor"}
    said = verdicts.get(comparison.verdict, "not explained")
    return f": {said}, what is left is {comparison.misfit:.2g} times the measurement's error"


def draw_force(contact: ContactForce, ax: Axes, *, over_speed: bool) -> Axes:
    """Force of the contact over displacement or speed: as recovered, no law assumed, and as the law has it.

    In mm and mm/s; in newtons where the stiffness of the frame is known, else over k Y.
    """
    unit = 1e3 * contact.unit_m * (contact.turn if over_speed else 1.0)
    newtons = 1.0 if contact.unit_n is None else contact.unit_n
    way = contact.velocity if over_speed else contact.displacement
    recovered = (unit * style.closed(way), newtons * style.closed(contact.force))
    ax.plot(*recovered, color=style.MEASURED, lw=2.0, alpha=0.55, label="recovered from the motion")
    law_way, speed = contact.law_velocity if over_speed else contact.law_displacement, contact.law_velocity
    if law_way is not None and speed is not None and contact.law_force is not None:
        way, force = _with_jumps(law_way, contact.law_force, np.abs(speed) < STILL)
        ax.plot(unit * way, newtons * force, color=style.PREDICTED, lw=1.0, label=contact.law)
    ax.set_xlabel("speed of the mass [mm/s]" if over_speed else "displacement of the mass [mm]")
    ax.set_ylabel("force of the contact, n / kY" if contact.unit_n is None else "force of the contact [N]")
    return ax


def _with_jumps(way: FloatArray, force: FloatArray, still: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """A law's force over its way, closed; where a stop begins or ends, the force changes before the way does."""
    ways, forces = [way[0]], [force[0]]
    for i, j in pairwise([*range(len(way)), 0]):
        if still[i] != still[j]:
            ways.append(way[i] if still[i] else way[j])
            forces.append(force[j] if still[i] else force[i])
        ways.append(way[j])
        forces.append(force[j])
    return np.array(ways), np.array(forces)


def draw_residual(contact: ContactForce, ax: Axes) -> Axes:
    """What the law misses over the cycle, stops shaded; the dotted lines are the standard error of the mean cycle."""
    turns, unit = contact.tau / style.TURN, 1e6 * contact.unit_m
    for edge in (-contact.floor, contact.floor):
        label = "standard error of the mean cycle" if edge > 0.0 else None
        ax.axhline(unit * edge, color=style.GREY, lw=0.8, ls=":", label=label)
    if contact.residual is not None:
        ax.plot(turns, unit * contact.residual, color=style.MEASURED, lw=1.0)
    if contact.law_velocity is not None:
        _draw_ways(turns, contact.law_velocity, ax)
    ax.set(xlabel="drive cycle, ωt / 2π (stops shaded)", ylabel="measured - predicted [µm]", xlim=(0, 1))
    ax.margins(y=0.2)
    ax.legend(loc="lower right", fontsize=LETTERS)
    return ax


def _draw_ways(turns: FloatArray, velocity: FloatArray, ax: Axes) -> None:
    """Shade the stops, and say of each slide which way it goes."""
    above = ax.get_xaxis_transform()
    way = np.where(np.abs(velocity) < STILL, 0, np.sign(velocity)).astype(int)
    ax.fill_between(turns, 0, 1, where=way == 0, transform=above, color=style.GREY, alpha=0.2, lw=0)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(way)) + 1, [len(way)]])
    for first, after in pairwise(starts.tolist()):
        if way[first] != 0 and after - first > SHORTEST * len(way):
            middle = 0.5 * (turns[first] + turns[after - 1])
            words = "slides up" if way[first] > 0 else "slides down"
            ax.text(middle, 0.97, words, transform=above, ha="center", va="top", fontsize=LETTERS)


def draw_ladder(contact: ContactForce, misfit: Axes, evidence: Axes) -> None:
    """Misfit and evidence of each law tried, by its number of parameters; the one required is red.

    Evidence is the logarithm of the Bayes factor against the law required.
    """
    told = sorted(contact.laws.items(), key=lambda law: (law[1][0], -law[1][1]))
    best = contact.laws[contact.law][2] if contact.law in contact.laws else 0.0
    counts = [count for _, (count, _, _) in told]
    colors = [style.PREDICTED if name == contact.law else style.MEASURED for name, _ in told]
    _draw_rungs(misfit, [100.0 * nrmse for _, (_, nrmse, _) in told], colors, "{:.2g}")
    _draw_rungs(evidence, [log - best for _, (_, _, log) in told], colors, "{:+.0f}")
    misfit.set(xlabel="nrmse [%]", ylabel="parameters, law")
    misfit.set_yticks(range(len(told)), [f"{n}  {_short(name)}" for n, (name, _) in zip(counts, told, strict=True)])
    for label, color in zip(misfit.get_yticklabels(), colors, strict=True):
        label.set(fontsize=LETTERS, color=color if color == style.PREDICTED else "black")
    _scale_misfit(misfit, [100.0 * nrmse for _, (_, nrmse, _) in told])
    evidence.set(xlabel="log evidence less\nthe required law's")
    evidence.set_xscale("symlog", linthresh=10.0)
    least, most = min(evidence.get_xlim()[0], -20.0), max((log - best for _, (_, _, log) in told), default=0.0)
    ticks = [*(FAR if least < FAR[0] / 3.0 else NEAR), *((100.0,) if most > ABOVE else ())]
    evidence.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    evidence.set_xlim(least, max(ABOVE, 20.0 * most))
    evidence.set_yticks(range(len(told)), [""] * len(told))
    for ax in (misfit, evidence):
        ax.tick_params(axis="x", labelsize=LETTERS)
        ends = np.cumsum([len(list(group)) for _, group in groupby(counts)])
        for end in ends[:-1]:
            ax.axhline(end - 0.5, color=style.GREY, lw=0.5)


def _scale_misfit(ax: Axes, values: list[float]) -> None:
    """Space for the numbers beside the points, and no more ticks than can be read."""
    low, high = min(values), max(values)
    if low <= 0.0 or high < WIDE * low:
        ax.xaxis.set_major_locator(MaxNLocator(3))
        ax.set_xlim(low - 0.15 * (high - low), high + 0.6 * (high - low) or None)
        return
    ax.set(xscale="log", xlim=(low / (high / low) ** 0.15, high * (high / low) ** 0.6))
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 20.0 * low else (1.0,), numticks=20))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())


def _draw_rungs(ax: Axes, values: list[float], colors: list[str], form: str) -> None:
    """A point for each law, one below the other, with its number beside it."""
    ax.scatter(values, range(len(values)), c=colors, s=14, zorder=3, clip_on=False)
    for place, (value, color) in enumerate(zip(values, colors, strict=True)):
        ax.annotate(
            form.format(value), (value, place), (4, 0), textcoords="offset points",
            va="center", fontsize=LETTERS, color=color,
        )  # fmt: skip
    ax.set_ylim(len(values) - 0.4, -0.6)
    ax.margins(x=ROOM)


def _short(law: str) -> str:
    """A law's name without the term that all of them begin with.

    Examples
    --------
    >>> _short("coulomb"), _short("coulomb+place+speed")
    ('coulomb', '+ place + speed')
    """
    return law.removeprefix("coulomb").replace("+", " + ").strip() or law


def contact_figure(contact: ContactForce, title: str | None = None) -> Figure:
    """Force over displacement and speed, the residual, and the ladder where one was climbed; warnings below."""
    with style.look():
        ladder = max(2.5, 0.7 + ROW * len(contact.laws))
        figure = style.new_figure(style.PAGE, 2.9 + ladder)
        [above], [below] = figure.subfigures(2, 1, squeeze=False, height_ratios=(2.9, ladder))
        over_way, over_speed = above.subplots(1, 2)
        draw_force(contact, over_way, over_speed=False).legend(loc="center", fontsize=LETTERS)
        draw_force(contact, over_speed, over_speed=True)
        left = below.subplots(1, 3 if contact.laws else 1, width_ratios=WIDTHS if contact.laws else None, squeeze=False)
        draw_residual(contact, left[0, 0])
        if contact.laws:
            draw_ladder(contact, left[0, 1], left[0, 2])
        name = (title or contact.source).replace("\\", "/").rsplit("/", 1)[-1]
        style.headline(figure, f"{name}: {contact.said}")
        style.caution(figure, contact.warnings)
        return figure
