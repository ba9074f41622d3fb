"""All figures of a campaign by name, each with the caption that its report prints."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

from frictionlab.campaign import Campaign
from frictionlab.errors import UsageError
from frictionlab.figures import grids, materials
from frictionlab.figures.style import look, save

FIRST = ("friction", "law_", "energy_")
SUFFIXES = (".svg", ".pdf", ".png")
MOST = 16
"""Materials in the figures: 150 of them had taken 217 s, 1.3 GB, and a report of 23 MB."""
SAFE = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-"


@dataclass(frozen=True)
class Plate:
    """One figure of a campaign: file ``name`` without suffix, ``title`` and ``caption`` in words, how to draw it."""

    name: str
    title: str
    caption: str
    draw: Callable[[], Figure]

    def files(self, folder: Path) -> tuple[Path, ...]:
        """Where its files stand in a folder."""
        return tuple(folder / f"{self.name}{suffix}" for suffix in SUFFIXES)

    def drawn(self) -> Figure:
        """The figure, in the look of all figures."""
        with look(), rc_context({"text.parse_math": False}):  # a material may well be called "$5"
            return self.draw()

    def save(self, folder: Path, *, force: bool = False) -> tuple[Path, ...]:
        """Draw it and write it as vector (SVG, PDF) and PNG.

        Raises
        ------
        OutputError
            A file cannot be written.
        """
        figure = self.drawn()
        return tuple(save(figure, path, force=force) for path in self.files(folder))


def plates(campaign: Campaign) -> tuple[Plate, ...]:
    """The figures that a campaign has the data for, in the report's order."""
    if not campaign.fits:
        return ()
    drawn = _of_best(campaign)
    known = len(campaign.materials)
    some = "" if drawn is campaign else f" The {MOST} best of {known} materials; all are in the tables."
    return tuple(replace(plate, caption=plate.caption + some) for plate in _apart(_found(drawn)))


def first_of(drawn: Sequence[Plate]) -> Plate | None:
    """The figure that says most: coefficients where forces are known, else a law, else energies."""
    return next((plate for plate in drawn if plate.name.startswith(FIRST)), None)


def campaign_figure(campaign: Campaign) -> Figure:
    """The one figure of a campaign that says most.

    Raises
    ------
    UsageError
        No test of it could be evaluated.
    """
    first = first_of(plates(campaign))
    if first is None:
        raise UsageError("plot: no test of the campaign could be evaluated: there is nothing to draw")
    return first.drawn()


def _apart(found: Iterable[Plate]) -> Iterator[Plate]:
    """The figures under names that no two share: letters beyond ASCII are all one in a file's name."""
    taken: Counter[str] = Counter()
    for plate in found:
        taken[plate.name.casefold()] += 1
        count = taken[plate.name.casefold()]
        yield plate if count == 1 else replace(plate, name=f"{plate.name}~{count}")


def _of_best(campaign: Campaign) -> Campaign:
    """The campaign of the materials that rank best by any criterion, no more than figures and report can hold."""
    if len(campaign.materials) <= MOST:
        return campaign
    best = dict.fromkeys(campaign.materials, math.inf)
    for rank in campaign.ranking:
        best[rank.material] = min(best.get(rank.material, math.inf), rank.rank or math.inf)
    chosen = set(sorted(best, key=lambda material: (best[material], material))[:MOST])
    return replace(
        campaign,
        fits=tuple(fit for fit in campaign.fits if fit.material in chosen),
        amontons=tuple(test for test in campaign.amontons if test.material in chosen),
        ranking=tuple(rank for rank in campaign.ranking if rank.material in chosen),
        drifts=tuple(drift for drift in campaign.drifts if drift.trial.material in chosen),
        curves=tuple(curve for curve in campaign.curves if curve.material in chosen),
        responses=tuple(response for response in campaign.responses if response.trial.material in chosen),
    )


TEXTS = {
    "ranking": "Ranking | Best material on top, number: its rank; equal ranks are ties. Bars: 95 % confidence.",
    "friction": "Friction coefficient over normal force | Points: one coefficient per normal force, fitted over all"
    " frequency ratios, 95 % confidence. Dashed lines: each material's mean, where all its points would lie by"
    " Amontons' law.",
    "law_{}": "The contact of {} | friction force over displacement and speed, of a slow, a middling and a fast test;"
    " broad: recovered from the motion, no law assumed; black: the law.",
    "irregularity": "Irregularity index of the short tests | Equation (4.1), on one scale for all materials. Between"
    " dotted lines nothing was measured, near resonance.",
    "stops": "Stops per cycle | Measured on the left; on the right as Coulomb's law predicts it for the fitted friction"
    " ratio. Blank: not measured, or no steady state.",
    "energy_{}": "Energy per cycle of {} | Points: measured, mean over the settled cycles, 95 % confidence; open ones"
    " are left out of the fit. Lines: Coulomb's law with one friction ratio β per normal force.",
    "comparison": "Materials compared | Energy per cycle at the normal forces that materials have in common; lines join"
    " the points.",
    "residuals": "What Coulomb's law leaves unexplained | Measured over predicted energy per cycle, less one. Crosses:"
    " tests left out of the fit; those at an edge lie beyond it.",
    "responses": "Example responses | The last cycles of the steadiest tests and of the least steady ones; grey: the"
    " base.",
    "long_responses": "Responses of the long tests | Left: the whole test, lowest to highest displacement. Right: its"
    " last cycles; grey: the base.",
    "drift_r{:.3g}": "Energy per cycle over time, r = {:.3g} | One cycle every ten seconds. Dotted: trend; band: its"
    " 95 % confidence, correlation between neighbours included.",
}
"""Name of a figure (of one of several: a pattern) -> its title and its caption."""


def _found(campaign: Campaign) -> Iterator[Plate]:
    """The figures that a campaign has the data for, in the report's order."""

    def plate(name: str, draw: Callable[..., Figure], *over: str | float, before: str = "", after: str = "") -> Plate:
        title, _, caption = TEXTS[name].partition(" | ")
        file = name.format(*(safe(thing) if isinstance(thing, str) else thing for thing in over))
        return Plate(file, title.format(*over), f"{before}{caption}{after}", partial(draw, campaign, *over))

    short = [t for t in campaign.trials if not t.failed and not t.is_long]
    has_maps = grids.varies(campaign)
    if len(campaign.materials) > 1:
        yield plate("ranking", materials.ranking)
    if any(f.friction_coefficient is not None for f in campaign.fits):
        beside = " Right: the distance from it; bands: the mean's own confidence."
        yield plate("friction", materials.friction, after=beside if materials.has_several_forces(campaign) else "")
    with_loops = {loop.material for loop in campaign.loops}
    for material in (m for m in campaign.materials if m in with_loops):
        tried = any(law.material == material for law in campaign.laws)
        ladder = " Right: log evidence of each law tried below the best, all tests; orange: required." if tried else ""
        before = "Left, middle: " if tried else "The "
        yield plate("law_{}", materials.law_of_material, material, before=before, after=ladder)
    if has_maps and any(t.irregularity is not None for t in short):
        yield plate("irregularity", grids.irregularity)
    if has_maps:
        yield plate("stops", grids.stops)
    for material in campaign.materials:
        yield plate("energy_{}", materials.energy, material)
    if materials.common_forces(campaign):
        yield plate("comparison", materials.comparison)
    yield plate("residuals", materials.residuals)
    if any(not r.trial.is_long for r in campaign.responses):
        yield plate("responses", materials.responses)
    if any(r.is_envelope for r in campaign.responses):
        yield plate("long_responses", materials.long_responses)
    for level in materials.drift_levels(campaign):
        yield plate("drift_r{:.3g}", materials.drift, level)


def safe(word: str) -> str:
    """A word of a log as part of a file name.

    Examples
    --------
    >>> safe("../Stahl S355 <b>")
    '.._Stahl_S355__b_'
    """
    return "".join(letter if letter in SAFE else "_" for letter in word)
