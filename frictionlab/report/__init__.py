"""A campaign as one HTML page: self-contained, no network, fit for screen, phone and paper.

Whatever stood in a log or a file name is escaped here, once, by `cell`, `words` or `html.escape`; the page's own policy
allows no script but its own and nothing from outside.
"""

import base64
import hashlib
import platform
import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from importlib.metadata import version
from pathlib import Path
from string import Template

from frictionlab import __version__
from frictionlab.campaign import CRITERIA, Campaign
from frictionlab.figures.campaign import Plate
from frictionlab.files import write_whole
from frictionlab.report import tables
from frictionlab.report.tables import listing, paragraph, running
from frictionlab.scene.words import value_text

HERE = Path(__file__).parent
SCALE = 1.7  # pixels on the screen per point in print
PACKAGES = ("numpy", "scipy", "pandas", "matplotlib", "h5py", "numba", "pydantic")


def write_report(campaign: Campaign, plates: Sequence[Plate], folder: Path) -> Path:
    """Write ``report.html`` into a campaign's folder, whose ``figures`` hold the plates already.

    Raises
    ------
    OutputError
        The page cannot be written.
    """
    images = {plate.name: (folder / "figures" / f"{plate.name}.svg").read_bytes() for plate in plates}
    path = folder / "report.html"
    write_whole(path, page(campaign, plates, images).encode())
    return path


def page(campaign: Campaign, plates: Sequence[Plate], images: Mapping[str, bytes]) -> str:
    """The page's text; ``images``: the SVG of each plate by its name. Same campaign, same text."""
    script = (HERE / "page.js").read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    parts = dict(_sections(campaign, plates, images))
    return Template((HERE / "page.html").read_text(encoding="utf-8")).substitute(
        version=escape(__version__),
        title=escape(_title(campaign)),
        style=(HERE / "page.css").read_text(encoding="utf-8"),
        script=script,
        script_hash=f"sha256-{digest}",
        summary=_summary(campaign),
        contents=" ".join(f'<a href="#{_anchor(name)}">{escape(name)}</a>' for name in parts),
        sections="\n".join(_section(name, body) for name, body in parts.items()),
    )


def _title(campaign: Campaign) -> str:
    return f"Friction campaign: {', '.join(campaign.materials) or 'no material measured'}"


def _anchor(name: str) -> str:
    return name.lower().replace(" ", "-")


def _section(name: str, body: str) -> str:
    return f'<section id="{_anchor(name)}">\n<h2>{escape(name)}</h2>\n{body}\n</section>'


def _sections(campaign: Campaign, plates: Sequence[Plate], images: Mapping[str, bytes]) -> Iterator[tuple[str, str]]:
    yield "Ranking", tables.ranking(campaign)
    yield "Friction", tables.friction(campaign)
    yield "Contact laws", tables.laws(campaign)
    yield "Figures", "\n".join(_figure(n, plate, images[plate.name]) for n, plate in enumerate(plates, 1))
    yield "Long tests", tables.drift(campaign)
    yield "Tests", tables.tests(campaign)
    yield "Left out of the fits", tables.left_out(campaign)
    yield "Failures", tables.failures(campaign)
    yield "Warnings", tables.warnings(campaign)
    yield "Scene and versions", _origin(campaign)


def _summary(campaign: Campaign) -> str:
    long = sum(t.is_long and not t.failed for t in campaign.trials)
    count = (
        f"{len(campaign.trials)} tests: {len(campaign.trials) - len(campaign.failures) - long} short, {long} long,"
        f" {len(campaign.failures)} failed; {len(campaign.materials)} materials. Predictions: {campaign.model.words}."
    )
    return paragraph(count) + listing([*(_in_words(campaign, c) for c in CRITERIA), *campaign.notes])


def _in_words(campaign: Campaign, criterion: str) -> str:
    ranks = [r for r in campaign.ranking if r.criterion == criterion]
    known = [r for r in ranks if r.rank is not None]
    if not known:
        return f"Best by {criterion}: not known ({ranks[0].evidence if ranks else 'no test'})."
    order = ", ".join(f"({r.rank}) {r.material}" for r in known)
    ties = sorted({tuple(sorted((r.material, other))) for r in known for other in r.tied_with})
    tied = f" Not told apart: {'; '.join(' and '.join(pair) for pair in ties)}." if ties else ""
    return f"By {criterion}: {order}.{tied}"


def _figure(number: int, plate: Plate, svg: bytes) -> str:
    width = re.search(rb'width="([0-9.]+)pt"', svg)
    pixels = round(SCALE * float(width[1])) if width else 880
    source = f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
    return (
        f'<figure id="figure-{number}">\n<div class="scroll">'
        f'<img src="{source}" width="{pixels}" alt="{escape(plate.title)}"></div>\n'
        f"<figcaption><b>Figure {number}. {escape(plate.title)}.</b> {running(plate.caption)}"
        f' <span class="soft">(figures/{escape(plate.name)}.svg, .pdf, .png)</span></figcaption>\n</figure>'
    )


def _origin(campaign: Campaign) -> str:
    lines = []
    for table, keys in campaign.scene.model_dump(exclude={"synthetic"}).items():
        lines += [
            f"[{table}]",
            *(f"{key} = {value_text(value)}" for key, value in keys.items() if value is not None),
            "",
        ]
    versions = [f"frictionlab {__version__}", f"Python {platform.python_version()}"]
    versions += [f"{name} {version(name)}" for name in PACKAGES]
    return f"<pre>{escape(chr(10).join(lines).strip())}</pre>\n{paragraph(', '.join(versions))}"
