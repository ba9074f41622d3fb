"""A campaign as one HTML page: self-contained, no network, fit for screen, phone and paper.

First what was tested, the answer for each material and what is doubtful; then figures, tables, tests and details.
Whatever stood in a log or a file name is escaped by the templates; the page's own policy allows no script but its own
and nothing from outside.
"""

import base64
import hashlib
import math
import platform
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from frictionlab import __version__
from frictionlab.campaign import CRITERIA, Campaign
from frictionlab.campaign.output import measurement_rows, rows_of
from frictionlab.campaign.trials import levels, short_name
from frictionlab.figures.plates import Plate, first_of
from frictionlab.files import write_whole
from frictionlab.report.charts import HERE, TEMPLATES, Dot, scatter
from frictionlab.report.page_of_test import sheet_name
from frictionlab.scene.text import value_text
from frictionlab.schema import DRIFTS, FRICTION, LAW_PARAMETERS, MATERIAL_LAWS, RANKING, TESTS, Table
from frictionlab.tables import Row
from frictionlab.tables.texts import GRAVE, kinds_of, with_error

SCALE = 1.7  # pixels on the screen per point in print
PACKAGES = ("numpy", "scipy", "pandas", "matplotlib", "h5py", "numba", "pydantic")
MOST_DOUBTS = 6  # on the first screen; all warnings stand further down
COLUMNS: Mapping[str, Sequence[str]] = {
    "friction": (
        "material", "normal_force_n", "tests", "tests_used", "friction_ratio", "friction_force_n",
        "friction_coefficient", "scatter", "law", "note",
    ),
    "laws": ("material", "law", "tests", "required", "gain", "response_nrmse"),
    "parameters": ("material", "law", "parameter", "value", "scatter", "physical_value", "unit", "is_told"),
    "drift": (
        "source", "material", "normal_force_n", "frequency_ratio", "duration_s", "slope_per_hour",
        "relative_slope_per_hour", "friction_slope_per_hour", "verdict", "note",
    ),
    "ranking": ("rank", "material", "value", "unit", "tied_with"),
    "tests": (
        "material", "normal_force_n", "frequency_ratio", "energy_per_cycle", "energy_per_cycle_j",
        "response_amplitude", "stops_per_cycle", "regime", "test_friction_ratio", "energy_residual", "test_misfit",
    ),
}  # fmt: skip
LEFT_OUT = "left out"
UNKNOWN = "\N{EN DASH}"


@dataclass(frozen=True)
class Cell:
    """One cell: ``text`` as it is read, ``value`` by which it is sorted (None: text), ``title`` and ``link``."""

    text: str
    value: float | None = None
    title: str = ""
    link: str = ""
    is_number: bool = False


@dataclass(frozen=True)
class Listing:
    """A table of a page: heads, whose titles are sentences, and rows of cells; ``failed``: numbers of failed rows."""

    heads: Sequence[Cell]
    rows: Sequence[Sequence[Cell]]
    failed: frozenset[int] = frozenset()


def number(value: object, error: object = None) -> Cell:
    """A cell with a number and, where it is known, its error."""
    known = float(value) if isinstance(value, (int, float)) and math.isfinite(value) else None
    return Cell(UNKNOWN if known is None else _told(known, error), known, is_number=True)


def _told(value: object, error: object) -> str:
    """A number with its error, held together in one line."""
    return with_error(value, error, sign="±").replace(" ", "\N{NO-BREAK SPACE}")


def words(value: object, title: str = "") -> Cell:
    """A cell with text."""
    return Cell(UNKNOWN if value in (None, "") else str(value), title=title)


def grid(table: Table, rows: Iterable[Row], names: Sequence[str]) -> Listing:
    """Some columns of a table; a number stands with its combined uncertainty, else its standard error, in one cell.

    Columns that no row knows are left out.
    """
    listed = list(rows)
    shown = [name for name in names if any(row.get(name) not in (None, "") for row in listed)]
    columns = [column for name in shown if (column := table.column(name)) is not None]
    heads = [Cell(column.head, title=column.sentence, is_number=column.type.is_number) for column in columns]
    cells = [[_cell(row, column.name, is_number=column.type.is_number) for column in columns] for row in listed]
    return Listing(heads, cells)


def _cell(row: Row, name: str, *, is_number: bool) -> Cell:
    value = row.get(name)
    if is_number:
        return number(value, row.get(f"{name}_u") or row.get(f"{name}_se"))
    if isinstance(value, bool):
        return words("yes" if value else "no")
    return words(value, title=str(value) if value and len(str(value)) > 24 else "")


def grouped(warnings: Iterable[tuple[str, Sequence[str]]]) -> list[str]:
    """Sentences for a page from groups of sources (sentence, the tests it was given for), most tests first."""
    ordered = sorted(warnings, key=lambda pair: -len(pair[1]))
    more = [f" and {len(sources) - 3} more" if len(sources) > 3 else "" for _, sources in ordered]
    return [f"{said} ({', '.join(names[:3])}{rest})" for (said, names), rest in zip(ordered, more, strict=True)]


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
    first = first_of(plates)
    ordered = [plate for plate in plates if plate is first] + [plate for plate in plates if plate is not first]
    drawn = [_image(place, plate, images[plate.name]) for place, plate in enumerate(ordered, 1)]
    tables = rows_of(campaign)
    return TEMPLATES.get_template("page.html").render(
        title=f"Friction of {', '.join(campaign.materials) or 'no material'}",
        script=script,
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        lead=_lead(campaign),
        answers=[_answer(campaign, material, tables) for material in campaign.materials],
        first=drawn[:1] if first else [],
        doubts=_doubts(campaign),
        overview=_overview(campaign),
        images=drawn[1:] if first else drawn,
        rankings=list(_rankings(campaign, tables["ranking.csv"])),
        grids=list(_grids(tables)),
        amontons=[test.verdict for test in campaign.amontons],
        tests=_tests(campaign),
        materials=campaign.materials,
        failures=[(short_name(trial.source), trial.reason) for trial in campaign.failures],
        warnings=_warnings(campaign),
        notes=campaign.notes,
        assumed=_assumed(campaign),
        versions=", ".join(
            [f"frictionlab {__version__}", f"Python {platform.python_version()}"]
            + [f"{name} {version(name)}" for name in PACKAGES]
        ),
    )


def _lead(campaign: Campaign) -> str:
    """What was tested, in one sentence."""
    measured = [trial for trial in campaign.trials if not trial.failed]
    long = sum(trial.is_long for trial in measured)
    forces = sorted({trial.normal_force_n for trial in measured if trial.normal_force_n})
    ratios = sorted(trial.r for trial in measured)
    parts = [f"{len(measured)} of {len(campaign.trials)} tests measured"]
    if forces:
        parts.append(f"normal force {_range(forces)} N")
    if ratios:
        parts.append(f"frequency ratio {_range(ratios)}")
    if long:
        parts.append(f"{long} long tests")
    return "; ".join(parts) + "."


def _range(values: Sequence[float]) -> str:
    low, high = values[0], values[-1]
    return f"{low:.3g}" if f"{low:.3g}" == f"{high:.3g}" else f"{low:.3g} to {high:.3g}"


def _answer(campaign: Campaign, material: str, tables: Mapping[str, Sequence[Row]]) -> Mapping[str, object]:
    """What a campaign says of one material: a headline (coefficient, else the friction ratios) and sentences."""
    test = next((test for test in campaign.amontons if test.material == material), None)
    rows = [row for row in tables["friction.csv"] if row["material"] == material]
    ratios = [number(row["friction_ratio"], row.get("friction_ratio_u")).text for row in rows]
    headline = f"friction ratio {', '.join(ratios)}" if ratios else "friction not known"
    if test is not None and test.coefficient is not None:
        headline = f"coefficient of friction {_told(test.coefficient, test.coefficient_se)}"
    return {"material": material, "headline": headline, "sentences": list(_sentences(campaign, material, tables))}


def _sentences(campaign: Campaign, material: str, tables: Mapping[str, Sequence[Row]]) -> Iterator[str]:
    required = [row for row in tables["laws.csv"] if row["material"] == material and row.get("required")]
    law = str(required[0]["law"]) if required else campaign.model.words
    yield f"Contact law: {law}." if required else f"Predicted with: {law}."
    parameters = [row for row in tables["parameters.csv"] if row["material"] == material and row.get("is_told")]
    for row in parameters:
        physical = row.get("physical_value") is not None
        value = number(row["physical_value"], row.get("physical_value_u")) if physical else number(row["value"])
        unit = f" {row['unit']}" if physical and row.get("unit") else ""
        yield f"{str(row['parameter']).replace('_', ' ')}: {value.text}{unit}."
    for test in campaign.amontons:
        if test.material == material and test.p is not None:
            said = "the same under all" if test.holds else "not the same under the"
            yield f"The coefficient is {said} {test.forces} normal forces (Amontons' law, p = {test.p:.2g})."


def _doubts(campaign: Campaign) -> list[str]:
    """What to know before believing the numbers: failures, strained rig or law, the warnings of most tests."""
    failed = len(campaign.failures)
    said = [f"{failed} of {len(campaign.trials)} tests failed; see Failures."] if failed else []
    said += [note for note in campaign.notes if GRAVE.search(note)]
    said += grouped(kinds_of((fit.material, fit.note) for fit in campaign.fits if fit.note))
    said += _warnings(campaign)
    rest = len(said) - MOST_DOUBTS
    return said[:MOST_DOUBTS] + ([f"{rest} more kinds of warnings; see Warnings."] if rest > 0 else [])


def _warnings(campaign: Campaign) -> list[str]:
    """The warnings with their tests; those that differ in their numbers alone are one."""
    return grouped(kinds_of((short_name(t.source), text) for t in campaign.trials for text in t.warnings))


def _overview(campaign: Campaign) -> str:
    """The energy of every test over its frequency ratio, or over the normal force where the ratio is one.

    A point names its test and opens its page.
    """
    measured = [trial for trial in campaign.trials if not trial.failed]
    over_force = len(levels([trial.r for trial in measured])) < 2 and all(trial.normal_force_n for trial in measured)
    points = [
        Dot(
            (trial.normal_force_n or 0.0) if over_force else trial.r,
            trial.mean[0],
            f"{short_name(trial.source)}: r {trial.r:.4g}, E {_told(trial.mean[0], trial.mean_se[0])} kY²",
            f"tests/{sheet_name(place, trial)}",
            campaign.materials.index(trial.material) if trial.material in campaign.materials else 0,
        )
        for place, trial in enumerate(campaign.trials, 1)
        if not trial.failed
    ]
    axis = "normal force [N]" if over_force else "frequency ratio r"
    return scatter(points, axis, "energy per cycle [kY²]", campaign.materials)


def _image(place: int, plate: Plate, svg: bytes) -> Mapping[str, object]:
    """A figure in the page."""
    width = re.search(rb'width="([0-9.]+)pt"', svg)
    source = f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
    return {
        "number": place,
        "plate": plate,
        "source": source,
        "width": round(SCALE * float(width[1])) if width else 880,
    }


def _rankings(campaign: Campaign, rows: Sequence[Row]) -> Iterator[tuple[str, str, Listing]]:
    """Title, evidence and table of each criterion; nothing where there is one material to rank."""
    if len(campaign.materials) < 2:
        return
    for criterion in CRITERIA:
        own = [row for row in rows if row["criterion"] == criterion]
        if any(row["rank"] is not None for row in own):
            yield f"By {criterion}", str(own[0]["evidence"]), grid(RANKING, own, COLUMNS["ranking"])


def _grids(tables: Mapping[str, Sequence[Row]]) -> Iterator[tuple[str, Listing]]:
    """Title and table of what the campaign's tables hold; an empty table is left out."""
    for title, name, table in (
        ("Friction", "friction", FRICTION),
        ("Contact laws", "laws", MATERIAL_LAWS),
        ("Parameters of the laws", "parameters", LAW_PARAMETERS),
        ("Long tests", "drift", DRIFTS),
    ):
        rows = tables[f"{name}.csv"]
        if rows:
            yield title, grid(table, rows, COLUMNS[name])


def _tests(campaign: Campaign) -> Listing:
    """All tests, failed ones too, one line each: name, status, what was measured, remark."""
    rows = list(measurement_rows(campaign))
    known = grid(TESTS, rows, COLUMNS["tests"])
    cells = []
    for place, (trial, row, own) in enumerate(zip(campaign.trials, rows, known.rows, strict=True), 1):
        remark = str(row.get("reason") or row.get("left_out_of_fit") or "")
        name = Cell(short_name(trial.source), title=trial.source, link=f"tests/{sheet_name(place, trial)}")
        cells.append([name, words(_status(row)), *own, words(remark, title=remark)])
    failed = frozenset(place for place, trial in enumerate(campaign.trials) if trial.failed)
    return Listing([Cell("test"), Cell("status"), *known.heads, Cell("remark")], cells, failed)


def _status(row: Row) -> str:
    """One word for what a test is to the campaign."""
    if row.get("status") == "failed":
        return "failed"
    if row.get("left_out_code"):
        return "long" if row["left_out_code"] == "long" else LEFT_OUT
    return "used"


def _assumed(campaign: Campaign) -> str:
    """The scene, as TOML."""
    lines = []
    for table, keys in campaign.scene.model_dump(exclude={"synthetic"}).items():
        given = [f"{key} = {value_text(value)}" for key, value in keys.items() if value is not None]
        lines += [f"[{table}]", *given, ""]
    return "\n".join(lines).strip()
