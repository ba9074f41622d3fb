"""All figures of a campaign by name, each with the caption that its report prints."""

import inspect
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from frictionlab.campaign import Campaign
from frictionlab.errors import UsageError
from frictionlab.figures import grids, materials
from frictionlab.figures.style import save

FIRST = ("friction", "law_", "energy_")
OF_GIVEN = ("friction", "law_")  # figures of tests whose motion is given: the others need a frame that answers
SUFFIXES = (".svg", ".pdf", ".png")
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

    def save(self, folder: Path, *, force: bool = False) -> tuple[Path, ...]:
        """Draw it and write it as vector (SVG, PDF) and PNG."""
        figure = self.draw()
        return tuple(save(figure, path, force=force) for path in self.files(folder))


def first_of(drawn: Sequence[Plate]) -> Plate | None:
    """The figure that says most: coefficients where forces are known, else a law, else energies."""
    return next((plate for plate in drawn if plate.name.startswith(FIRST)), None)


def campaign_figure(campaign: Campaign) -> Figure:
    """The one figure of a campaign that says most; `UsageError` where no test could be evaluated."""
    first = first_of(plates(campaign))
    if first is None:
        raise UsageError("plot: no test of the campaign could be evaluated: there is nothing to draw")
    return first.draw()


WHOLE: tuple[str, ...] = ("",)
"""A figure of the whole campaign, not one for each of something."""


KINDS: Mapping[str, tuple[Callable[..., Figure], Callable[[Campaign], Sequence[str | float]]]] = {
    "friction": (materials.friction, lambda c: WHOLE if any(f.friction_coefficient for f in c.fits) else ()),
    "law_": (
        materials.law_of_material,
        lambda c: [m for m in c.materials if any(test.material == m for test, _ in c.loops)],
    ),
    "irregularity": (grids.irregularity, lambda c: WHOLE if grids.varies(c, lambda t: t.irregularity) else ()),
    "stops": (grids.stops, lambda c: WHOLE if grids.varies(c, lambda t: t.stops) else ()),
    "energy_": (materials.energy, lambda c: [m for m in c.materials if materials.count(c, m) > 1]),
    "drift_r": (materials.drift, materials.drift_levels),
}
"""Begin of a figure's name -> what draws it, and what a campaign has one of it for; in the report's order.

The first line of what draws it is the figure's title, the rest its caption.
"""
LAST: Mapping[str, tuple[str, Callable[[Campaign], bool]]] = {
    "friction": ("Right:", materials.has_several_forces),
    "law_": ("Right:", lambda c: bool(c.laws)),
}
"""Figures whose caption ends, from this word on, with what is there for some campaigns only."""


def plates(campaign: Campaign) -> tuple[Plate, ...]:
    """The figures that a campaign has the data for, in the report's order, under names that no two share."""
    taken, found = Counter[str](), list[Plate]()
    for kind, (draw, each) in KINDS.items() if campaign.fits else ():
        if campaign.is_given and kind not in OF_GIVEN:
            continue
        title, _, words = (inspect.getdoc(draw) or "").partition(".")
        caption = " ".join(words.split())
        last, is_there = LAST.get(kind, ("", bool))
        caption = caption if not last or is_there(campaign) else caption.partition(f" {last}")[0]
        for thing in each(campaign):
            own = () if thing == "" else (thing,)
            word = thing if isinstance(thing, str) else f"{thing:.3g}"
            of = f": {'' if isinstance(thing, str) else 'r = '}{word}" if own else ""
            name = kind + "".join(letter if letter in SAFE else "_" for letter in word)
            taken[name.casefold()] += 1  # letters beyond ASCII are all one in a file's name
            again = f"~{taken[name.casefold()]}" * (taken[name.casefold()] > 1)
            found.append(Plate(f"{name}{again}", f"{title}{of}", caption, partial(draw, campaign, *own)))
    return tuple(found)
