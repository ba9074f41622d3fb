"""All figures of a campaign by name, each with the caption that its report prints."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

from frictionlab.campaign import Campaign
from frictionlab.figures import campaign_energy, campaign_friction, campaign_maps, campaign_time
from frictionlab.figures.style import look, save

SUFFIXES = (".svg", ".pdf", ".png")
SAFE = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-"


@dataclass(frozen=True)
class Plate:
    """One figure of a campaign: file ``name`` without suffix, ``title`` and ``caption`` in words, how to draw it."""

    name: str
    title: str
    caption: str
    draw: Callable[[], Figure]

    def save(self, folder: Path) -> tuple[Path, ...]:
        """Draw it and write it as vector (SVG, PDF) and PNG.

        Raises
        ------
        OutputError
            A file cannot be written.
        """
        with look(), rc_context({"text.parse_math": False}):  # a material may well be called "$5"
            figure = self.draw()
        return tuple(save(figure, folder / f"{self.name}{suffix}") for suffix in SUFFIXES)


def plates(campaign: Campaign) -> tuple[Plate, ...]:
    """The figures that a campaign has the data for, in the report's order."""
    if not campaign.fits:
        return ()
    return (*_friction(campaign), *_maps(campaign), *_energy(campaign), *_time(campaign))


def _friction(campaign: Campaign) -> list[Plate]:
    known = any(f.friction_coefficient is not None for f in campaign.fits)
    found = [
        Plate(
            "ranking",
            "Ranking",
            "Best material on top, number: its rank; equal ranks are ties. Bars: 95 % confidence.",
            partial(campaign_friction.ranking, campaign),
        )
    ]
    if known:
        found.append(
            Plate(
                "friction",
                "Friction coefficient over normal force",
                "Points: one coefficient per normal force, fitted over all frequency ratios, 95 % confidence. Dashed"
                " lines: each material's mean, where all its points would lie by Amontons' law. Right: the distance"
                " from it; bands: the mean's own confidence.",
                partial(campaign_friction.friction, campaign),
            )
        )
    return found


def _maps(campaign: Campaign) -> list[Plate]:
    found = []
    if any(t.irregularity is not None for t in campaign.trials if not t.failed and not t.is_long):
        found.append(
            Plate(
                "irregularity",
                "Irregularity index of the short tests",
                "Equation (4.1). One colour scale for all materials; it ends 0.1 below the largest index (at it, where"
                " that is below 0.2), so that the small ones can be told apart. Between the dotted lines nothing"
                " was measured, near resonance.",
                partial(campaign_maps.irregularity, campaign),
            )
        )
    found.append(
        Plate(
            "stops",
            "Stops per cycle",
            "Measured on the left; on the right as Coulomb's law predicts it for the fitted friction ratio. Blank:"
            " not measured, or no steady state.",
            partial(campaign_maps.stops, campaign),
        )
    )
    return found


def _energy(campaign: Campaign) -> list[Plate]:
    found = [
        Plate(
            f"energy_{safe(material)}",
            f"Energy per cycle of {material}",
            "Points: measured, mean over the settled cycles, 95 % confidence; open ones are left out of the fit."
            " Lines: Coulomb's law with one friction ratio β per normal force.",
            partial(campaign_energy.energy, campaign, material),
        )
        for material in campaign.materials
    ]
    if campaign_energy.common_forces(campaign):
        found.append(
            Plate(
                "comparison",
                "Materials compared",
                "Energy per cycle at the normal forces that materials have in common; lines join the points.",
                partial(campaign_energy.comparison, campaign),
            )
        )
    found.append(
        Plate(
            "residuals",
            "What Coulomb's law leaves unexplained",
            "Measured over predicted energy per cycle, less one. Crosses: tests left out of the fit; those at an edge"
            " lie beyond it.",
            partial(campaign_energy.residuals, campaign),
        )
    )
    return found


def _time(campaign: Campaign) -> list[Plate]:
    found = []
    if any(not r.trial.is_long for r in campaign.responses):
        found.append(
            Plate(
                "responses",
                "Example responses",
                "The last cycles of the steadiest tests and of the least steady ones; grey: the base.",
                partial(campaign_time.responses, campaign),
            )
        )
    if any(r.is_envelope for r in campaign.responses):
        found.append(
            Plate(
                "long_responses",
                "Responses of the long tests",
                "Left: the whole test, lowest to highest displacement. Right: its last cycles; grey: the base.",
                partial(campaign_time.long_responses, campaign),
            )
        )
    found += [
        Plate(
            f"drift_r{level:.3g}",
            f"Energy per cycle over time, r = {level:.3g}",
            "One cycle every ten seconds. Dotted: trend; band: its 95 % confidence, correlation between neighbours"
            " included.",
            partial(campaign_time.drift, campaign, level),
        )
        for level in campaign_time.drift_levels(campaign)
    ]
    return found


def safe(word: str) -> str:
    """A word of a log as part of a file name.

    Examples
    --------
    >>> safe("../Stahl S355 <b>")
    '.._Stahl_S355__b_'
    """
    return "".join(letter if letter in SAFE else "_" for letter in word)
