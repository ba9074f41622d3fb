"""Which law each material's contact obeys: its loops in newtons over millimetres and speed, and the laws tried."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.campaign import Campaign, LawEvidence, Loop
from frictionlab.figures.style import MEASURED, PAGE, PALETTE, PREDICTED, headline, new_figure

STEP = 5.0  # log evidence beyond which the scale is logarithmic
SHOWN = 8  # laws of a ladder
TICKS = {0.0: "0", 10.0: "10", 1e3: "10³", 1e5: "10⁵", 1e7: "10⁷", 1e9: "10⁹"}


def law_of_material(campaign: Campaign, material: str) -> Figure:
    """Loops of a few tests as recovered from the motion, the law over them; the evidence of each law tried."""
    loops = [loop for loop in campaign.loops if loop.material == material]
    laws = [law for law in campaign.laws if law.material == material]
    figure = new_figure(PAGE, 3.0)
    panels = figure.subplots(1, 3 if laws else 2)
    unit = "N" if campaign.scene.rig.stiffness is not None else "k Y"
    for over_speed, ax in zip((False, True), panels[:2], strict=True):
        for i, loop in enumerate(loops):
            _draw(ax, loop, PALETTE[i % len(PALETTE)], over_speed=over_speed)
        ax.set_xlabel("speed [mm/s]" if over_speed else "displacement [mm]")
        ax.set_ylabel(f"friction force [{unit}]")
    panels[0].legend(fontsize=6, loc="center", frameon=True, framealpha=0.9)
    if laws:
        _ladder(panels[2], laws)
    law = None if campaign.joint is None else campaign.joint.law(material)
    headline(figure, f"{material}: {'no law' if law is None else law.name}")
    return figure


def _draw(ax: Axes, loop: Loop, colour: str, *, over_speed: bool) -> None:
    seen, law = (loop.speed, loop.law_speed) if over_speed else (loop.place, loop.law_place)
    name = f"{loop.normal_force_n:g} N, r = {loop.r:.2g}"
    ax.plot(_closed(1e3 * seen), _closed(loop.force), color=colour, lw=2.0, alpha=0.5, label=name)
    ax.plot(_closed(1e3 * law), _closed(loop.law_force), color="black", lw=0.7)


def _ladder(ax: Axes, laws: list[LawEvidence]) -> None:
    """Log evidence of each law below the best; filled: fitted, open: screened; the required one large."""
    best = sorted(laws, key=lambda law: -law.log_evidence)
    shown = [law for n, law in enumerate(best) if n < SHOWN or law.required or law.law == "coulomb"]
    for place, law in enumerate(reversed(shown)):
        colour = PREDICTED if law.required else MEASURED
        below = best[0].log_evidence - law.log_evidence
        size, inside = 6 if law.required else 4, "none" if law.screened else colour
        ax.plot(below, place, "o", ms=size, mec=colour, mfc=inside, clip_on=False, zorder=3)
    ax.set_xscale("symlog", linthresh=STEP)
    most = max(best[0].log_evidence - law.log_evidence for law in shown)
    ticks = [tick for tick in TICKS if tick <= 10.0 * most]
    ax.set_xticks(ticks, [TICKS[tick] for tick in ticks])
    ax.minorticks_off()
    ax.set_xlim(-0.8, max(3.0 * most, STEP))
    names = [law.law.removeprefix("coulomb") or "coulomb" for law in reversed(shown)]
    ax.set_yticks(range(len(shown)), names, fontsize=6)
    ax.set_xlabel("log evidence below the best")


def _closed(values: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    return np.append(values, values[:1])
