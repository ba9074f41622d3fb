"""A campaign as one HTML page, and a page for each of its tests: self-contained, for screen, phone and paper.

First what was tested, the answer for each material and what is doubtful; then figures, tables, tests and details.
Whatever stood in a log or a file name is escaped by the templates; the page's own policy allows no script but its own
and nothing from outside.
"""

import base64
import hashlib
import math
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np

from frictionlab import __version__, schema
from frictionlab.campaign import Campaign
from frictionlab.campaign.ranking import CRITERIA
from frictionlab.campaign.trials import short_name
from frictionlab.figures.materials import across, at_lag
from frictionlab.figures.plates import Plate, first_of
from frictionlab.files import write_whole
from frictionlab.inference.material_law import MaterialLaw, physical_name
from frictionlab.report.charts import HERE, TEMPLATES, Dot, chart
from frictionlab.report.page_of_test import sheet_name
from frictionlab.scene.physical import to_physical
from frictionlab.scene.text import to_toml
from frictionlab.schema import GRAVE, with_error
from frictionlab.simulator.laws import law_of
from frictionlab.tables import Row
from frictionlab.tables.texts import kinds_of

PACKAGES = ("numpy", "scipy", "pandas", "matplotlib", "h5py", "numba", "pydantic")
MOST_DOUBTS = 6  # on the first screen; all warnings stand further down
TABLES = {
    "Friction": ("friction.csv", schema.FRICTION),
    "Contact laws": ("laws.csv", schema.MATERIAL_LAWS),
    "Long tests": ("drift.csv", schema.DRIFTS),
}
UNKNOWN = "\N{EN DASH}"
LONG = 24  # letters of a cell that the screen may cut: the whole text stands in its title


class Cell(NamedTuple):
    """One cell: ``text`` as it is read, ``value`` by which it is sorted (None: text), ``title`` and ``link``."""

    text: str
    value: float | None = None
    title: str = ""
    link: str = ""
    is_number: bool = False


class Listing(NamedTuple):
    """A table of a page: heads, whose titles are sentences, and rows of cells; ``failed``: numbers of failed rows."""

    heads: Sequence[Cell]
    rows: Sequence[Sequence[Cell]]
    failed: frozenset[int] = frozenset()


def with_se(value: object, error: object = None, times: float = 1.0) -> str:
    """A number with its error, held together in one line; a dash if it is not known."""
    known = isinstance(value, (int, float)) and math.isfinite(value)
    return with_error(value, error, times).replace(" ", "\N{NO-BREAK SPACE}") if known else UNKNOWN


def listing(table: schema.Table, listed: Sequence[Row], without: Sequence[str] = ()) -> Listing:
    """What is shown of a table; a number stands with its combined uncertainty, else its standard error, in one cell.

    Columns that no row knows are left out.
    """
    names = [name for name in table.shown if name not in without]
    known = [name for name in names if any(row.get(name) not in (None, "") for row in listed)]
    columns = [column for name in known if (column := table.column(name)) is not None]
    heads = [
        Cell("energy [mJ]" if column.unit == "J" else column.head, None, column.sentence, "", column.type.is_number)
        for column in columns
    ]
    return Listing(heads, [[_cell(row, column) for column in columns] for row in listed])


def _cell(row: Row, column: schema.Column) -> Cell:
    name = column.name
    value = row.get(name)
    if column.type.is_number:
        known = float(value) if isinstance(value, (int, float)) and math.isfinite(value) else None
        said = with_se(value, row.get(f"{name}_u") or row.get(f"{name}_se"), 1e3 if column.unit == "J" else 1.0)
        return Cell(said, known, is_number=True)
    if isinstance(value, bool):
        return Cell("yes" if value else "no")
    text = str(value or UNKNOWN)
    return Cell(short_name(text) if name == "source" else text, title=text if len(text) > LONG else "")


def grouped(warnings: Iterable[tuple[str, Sequence[str]]]) -> list[str]:
    """Sentences for a page from groups of sources (sentence, the tests it was given for), most tests first."""
    ordered = sorted(warnings, key=lambda pair: -len(pair[1]))
    more = [f" and {len(sources) - 3} more" if len(sources) > 3 else "" for _, sources in ordered]
    return [f"{said} ({', '.join(names[:3])}{rest})" for (said, names), rest in zip(ordered, more, strict=True)]


def write_report(campaign: Campaign, plates: Sequence[Plate], folder: Path) -> Path:
    """Write ``report.html`` into a campaign's folder, whose ``figures`` hold the plates already."""
    images = {plate.name: (folder / "figures" / f"{plate.name}.svg").read_bytes() for plate in plates}
    path = folder / "report.html"
    write_whole(path, page(campaign, plates, images).encode())
    return path


def page(campaign: Campaign, plates: Sequence[Plate], images: Mapping[str, bytes]) -> str:
    """The page's text; ``images``: the SVG of each plate by its name. Same campaign, same text."""
    script = (HERE / "page.js").read_text(encoding="utf-8")
    first = first_of(plates)
    tables = campaign.tables
    packages = {"frictionlab": __version__, "Python": platform.python_version(), **{p: version(p) for p in PACKAGES}}
    return TEMPLATES.get_template("page.html").render(
        title=f"Friction of {', '.join(campaign.materials) or 'no material'}",
        script=script,
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        campaign=campaign,
        tables=tables,
        with_se=with_se,
        short_name=short_name,
        doubts=_doubts(campaign),
        values={law.material: list(_values(law)) for law in campaign.material_laws},
        first=[plate for plate in plates if plate is first],
        plates=[plate for plate in plates if plate is not first],
        images={name: base64.b64encode(svg).decode() for name, svg in images.items()},
        overview=_overview(campaign),
        at_lag=at_lag(campaign),
        rankings=list(_rankings(campaign, tables["ranking.csv"])),
        grids=[(title, listing(kind, tables[name])) for title, (name, kind) in TABLES.items() if tables[name]],
        tests=_tests(campaign),
        warnings=_warnings(campaign),
        assumed=to_toml(campaign.scene).partition("[synthetic]")[0].strip(),
        versions=", ".join(f"{name} {number}" for name, number in packages.items()),
    )


def _values(law: MaterialLaw) -> Iterator[str]:
    """Yield what the tests determine of a law but its friction: values more than two errors from zero, in words."""
    errors = dict(zip(law.values, np.sqrt(np.diag(law.covariance)).tolist(), strict=True))
    for p in law_of(law.law).own:
        name, unit = physical_name(p), to_physical(p, 1.0, 1.0, amplitude=1.0, turn=1.0)[1]
        if p.name != "beta" and 0.0 < 2.0 * errors[name] < abs(law.values[name]):
            known = with_error(law.values[name], errors[name])
            yield f"{p.name.removesuffix('_ratio').replace('_', ' ')}: {known} {unit}".rstrip()


def _doubts(campaign: Campaign) -> list[str]:
    """What to know before believing the numbers: failures, strained rig or law, the warnings of most tests."""
    failed = len(campaign.failures)
    said = [f"{failed} of {len(campaign.trials)} tests failed; see Failures."] if failed else []
    said += [note for note in campaign.notes if GRAVE.search(note)]
    said += grouped(kinds_of((f"{f.material} at {f.normal_force_n:.4g} N", f.note) for f in campaign.fits if f.note))
    said += _warnings(campaign)
    rest = len(said) - MOST_DOUBTS
    return said[:MOST_DOUBTS] + ([f"{rest} more kinds of warnings; see Warnings."] if rest > 0 else [])


def _warnings(campaign: Campaign) -> list[str]:
    """The warnings with their tests; those that differ in their numbers alone are one."""
    return grouped(kinds_of((short_name(t.source), text) for t in campaign.trials for text in t.warnings))


def _overview(campaign: Campaign) -> str:
    """The energy of every test (its measured coefficient, where motions are given); a point opens its test's page."""
    (name, of), verdicts = across(campaign), campaign.verdicts
    found = {t.source: verdicts[t.source].energy if t.source in verdicts else t.energy for t in campaign.trials}
    number, said = "energy per cycle [kY²]", "r {r:.4g}, E {} kY²"
    if campaign.is_given:
        found, number, said = {t.source: t.coefficient for t in campaign.trials}, "friction coefficient", "{}"
    points = [
        Dot(
            getattr(trial, of),
            found[trial.source].value or 0.0,
            f"{short_name(trial.source)}: {said.format(found[trial.source], r=trial.r)}",
            f"tests/{sheet_name(place, trial)}",
            campaign.materials.index(trial.material) if trial.material in campaign.materials else 0,
        )
        for place, trial in enumerate(campaign.trials, 1)
        if not trial.failed
    ]
    return chart([], name, number, dots=points, groups=campaign.materials)


def _rankings(campaign: Campaign, rows: Sequence[Row]) -> Iterator[tuple[str, str, Listing]]:
    """Title, evidence and table of each criterion; nothing where there is one material to rank."""
    if len(campaign.materials) < 2:
        return
    for criterion in CRITERIA:
        own = [row for row in rows if row["criterion"] == criterion]
        if any(row["rank"] is not None for row in own):
            table = listing(schema.RANKING, own, ["criterion"])
            yield f"By {criterion}: {own[0]['unit']}", str(own[0]["evidence"]), table


def _tests(campaign: Campaign) -> Listing:
    """All tests, failed ones too, one line each: name, status, what was measured, remark."""
    rows = campaign.tables["measurements.csv"]
    doubled = schema.ENERGY if any(row.get(f"{schema.ENERGY}_j") for row in rows) else f"{schema.ENERGY}_j"
    known = listing(schema.TESTS, rows, ["source", doubled])
    cells = []
    for place, (trial, row, own) in enumerate(zip(campaign.trials, rows, known.rows, strict=True), 1):
        remark = str(row.get("reason") or row.get("left_out_of_fit") or "")
        left_out = row.get("left_out_code")
        status = "failed" if trial.failed else "long" if left_out == "long" else "left out" if left_out else "used"
        name = Cell(short_name(trial.source), title=trial.source, link=f"tests/{sheet_name(place, trial)}")
        cells.append([name, Cell(status), *own, Cell(remark or UNKNOWN, title=remark)])
    failed = frozenset(place for place, trial in enumerate(campaign.trials) if trial.failed)
    return Listing([Cell("test"), Cell("status"), *known.heads, Cell("remark")], cells, failed)
