"""The facts of one test: from the scene, from the log's file name, from the sheet of a campaign."""

import csv
import io
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from frictionlab.errors import SceneError
from frictionlab.files import check_regular, stem_of
from frictionlab.scene import Experiment, Scene
from frictionlab.units import NORMAL_FORCE, TIME, UNIT, quantity_of, split_unit, to_si

Fact = str | float
_SOURCES = ("name_pattern", "sheet", "taps", "broken_off")
WEIGHTS = {"normal_force_g": 9.80665e-3, "normal_force_kg": 9.80665}
"""Keys of names and sheets that give the normal force as a weight, and what makes newtons of them."""
_FACTS = {key: field.annotation for key, field in Experiment.model_fields.items() if key not in _SOURCES}
_KNOWN = (*_FACTS, *WEIGHTS)
_NUMERIC = (*(key for key, kind in _FACTS.items() if "float" in str(kind)), *WEIGHTS)
_NUMBER = r"\d+(?:[.,]\d+)?"
_LOGS = ("log", "base_log")  # columns of a sheet that name files
_HEADINGS = {  # of a sheet, besides the keys themselves, in English and German
    "log": re.compile(r"(log|mess)?[ _-]?(file|datei)[ _-]?(name)?|(mass|masse)[ _-]?(log|file|datei)", re.IGNORECASE),
    "base_log": re.compile(r"(base|basis)[ _-]?(log|file|datei)", re.IGNORECASE),
    "material": re.compile(r"material|werkstoff|material(paarung|s| pair(ing)?)", re.IGNORECASE),
    "nominal_frequency_ratio": re.compile(r"(frequency[ _-]ratio|frequenzverh(ä|ae)ltnis|(?-i:r))", re.IGNORECASE),
    "normal_force_n": NORMAL_FORCE,
    "base_amplitude_m": re.compile(r"(base|basis|fu(ß|ss)punkt)[ _-]?amplitude", re.IGNORECASE),
    "duration_s": re.compile(r"duration|dauer|messdauer", re.IGNORECASE),
}
_QUANTITIES = {"normal_force_n": "force", "base_amplitude_m": "displacement", "duration_s": "time"}
_SHEET_LIMIT = 1 << 24
_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")


@dataclass(frozen=True)
class Facts:
    """What is known of a test, and sentences on what is missing or contradicts."""

    values: Mapping[str, Fact]
    warnings: tuple[str, ...] = ()


def facts_of(scene: Scene, log: Path) -> Facts:
    """Collect the facts of the test that a log records; only the log's name is used.

    The sheet wins over the file name, and the file name over the scene's ``[experiment]``; where two disagree a warning
    says so. `SceneError`: the pattern or the sheet cannot be used.

    Examples
    --------
    >>> scene = Scene(experiment=Experiment(name_pattern="{material}_N{normal_force_n}_r{nominal_frequency_ratio}"))
    >>> dict(facts_of(scene, Path("steel_N1.25_r0.3.csv")).values)
    {'material': 'steel', 'normal_force_n': 1.25, 'nominal_frequency_ratio': 0.3}
    """
    experiment, found, warnings = scene.experiment, dict[str, tuple[Fact, str]](), list[str]()
    said = experiment.model_dump(include=set(_FACTS), exclude_none=True)
    sources: list[tuple[str, Mapping[str, Fact]]] = [("the scene", said)]
    if experiment.name_pattern is not None:
        sources.append(("the file name", _from_name(experiment.name_pattern, log, warnings)))
    if experiment.sheet is not None:
        sources.append(("the sheet", _from_sheet(scene.folder, experiment.sheet, log, warnings)))
    for source, facts in sources:
        for name, given in facts.items():
            key, value = ("normal_force_n", float(given) * WEIGHTS[name]) if name in WEIGHTS else (name, given)
            before, origin = found.get(key, (value, source))
            if before != value:
                warnings.append(f"{key}: {source} says {value}, {origin} says {before}: {value} is taken")
            found[key] = value, source
    if len(sources) > 1 and not any("its facts are not known" in said for said in warnings):
        lacking = [key for key in ("material", "normal_force_n") if key not in found]
        other = [key for key in found if key not in (*_LOGS, *_KNOWN)]  # of a sheet: what may be meant for it
        warnings += [f"{key} of this test is not known{f'; {as_remarks(other)}' * bool(other)}" for key in lacking]
    return Facts({key: value for key, (value, _) in found.items()}, tuple(warnings))


def _from_name(pattern: str, log: Path, warnings: list[str]) -> dict[str, Fact]:
    texts = matched(pattern, stem_of(log))
    if texts is None:
        warnings.append(f"the file name does not follow name_pattern {pattern!r}: its facts are not known")
        return {}
    found = {key: _fact(key, text) for key, text in texts.items()}
    none = [key for key, value in found.items() if value is None]
    warnings += [f"{key}: the file name says {texts[key]}: expected a number above 0: it is not known" for key in none]
    return {key: value for key, value in found.items() if value is not None}


def matched(pattern: str, name: str) -> dict[str, str] | None:
    """What stands in a name for each key of a pattern, each text as short as can be; None where it does not fit.

    A text and the numbers behind it are taken at the first place where they fit (an atomic group): the next text takes
    what a later place would leave, and a name of any length is done in a moment. SceneError: no such pattern.
    """
    first, *more = re.split(r"\{([^{}]*)\}", pattern)
    keys, texts = more[::2], more[1::2]
    unknown = [key for key in keys if key not in _KNOWN]
    beside = [f"{{{a}}}{{{b}}}" for a, text, b in zip(keys, texts, keys[1:], strict=False) if not text]
    if unknown or beside or not keys or len(set(keys)) < len(keys):
        wrong = f"unknown {unknown}" if unknown else "none" if not keys else "one twice"
        wrong = f"{beside[0]}, with nothing between them" if beside and not unknown else wrong
        raise SceneError(f"experiment.name_pattern: expected keys in braces, of {', '.join(_KNOWN)}; got {wrong}")
    expression = f"(?>{re.escape(first)}"
    for key, text in zip(keys, texts, strict=True):
        group = f"(?P<{key}>{_NUMBER})" if key in _NUMERIC else f")(?>(?P<{key}>.+?)"
        expression += group + re.escape(text)
    found = re.fullmatch(rf"{expression}\Z)", name, re.DOTALL)
    return None if found is None else found.groupdict()


def base_log_of(facts: Mapping[str, Fact], log: Path) -> Path | None:
    """The log of the base's own sensor, which the sheet names beside a log (``base_log``); None where it names none."""
    if not (name := str(facts.get("base_log", ""))):
        return None
    there = (path for path in sorted(log.parent.iterdir()) if name in (path.name, stem_of(path)))
    return next(there, log.with_name(name))


def without_base_logs(scene: Scene, logs: Iterable[Path]) -> list[Path]:
    """These logs but those that the sheet names as a base's own: they are no tests of their own."""
    meanings, rows = _sheet_rows(scene.folder, scene.experiment.sheet) if scene.experiment.sheet else ({}, [])
    named = {facts[heading] for *_, facts in rows for heading, (key, _) in meanings.items() if key == "base_log"}
    return [log for log in logs if named.isdisjoint((log.name, stem_of(log)))]


def rows_without_log(scene: Scene, places: Iterable[Path]) -> list[str]:
    """Logs that the scene's sheet names, and that are neither among these files and folders nor beside them."""
    folders = {place if place.is_dir() else place.parent for place in places}
    files = [path for folder in folders if folder.is_dir() for path in folder.iterdir()]
    return logs_in_sheet(scene.folder, scene.experiment.sheet, files)[1] if scene.experiment.sheet else []


def logs_in_sheet(folder: Path, sheet: str, files: Iterable[Path]) -> tuple[list[str], list[str]]:
    """Logs that a sheet names, with or without their suffix: those among these files, and those that are not."""
    there = {name for path in files for name in (path.name, stem_of(path))}
    named = [entry for _, entry, _ in _sheet_rows(folder, sheet)[1]]
    return [entry for entry in named if entry in there], [entry for entry in named if entry not in there]


def headings_of(folder: Path, sheet: str) -> tuple[list[str], list[str]]:
    """The facts that a sheet's headings say, as keys, and the headings that are none: remarks."""
    meanings = _sheet_rows(folder, sheet)[0]
    keys = [key for key, _ in meanings.values() if key in _KNOWN]
    return keys, [heading for heading, (key, _) in meanings.items() if heading and key not in (*_LOGS, *_KNOWN)]


def as_remarks(headings: Iterable[str]) -> str:
    """Say that headings of a sheet are none of a fact, and what those of facts are."""
    wanted = f"facts are in columns {', '.join(_KNOWN)}, or by name and unit, such as normal force [N]"
    return f"the sheet's {', '.join(headings)} is taken as a remark: {wanted}"


def _from_sheet(folder: Path, name: str, log: Path, warnings: list[str]) -> dict[str, Fact]:
    """The facts in a log's row of a sheet; the row is found by the log's name, with or without its suffix."""
    meanings, rows = _sheet_rows(folder, name)
    own = {number: facts for number, entry, facts in rows if entry in (log.name, stem_of(log))}
    where = f"experiment.sheet: {name}"
    if not own:
        warnings.append(f"sheet {name}: no row for {log.name}: its facts are not known")
        return {}
    if len(own) > 1:
        raise SceneError(f"{where}: {len(own)} rows for {log.name}: expected one")
    ((number, facts),) = own.items()
    given = {meanings[heading]: (heading, text) for heading, text in facts.items() if heading and text}
    found = {key: _fact(key, text, unit) for (key, unit), (_, text) in given.items()}
    for (key, _), (heading, text) in given.items():
        if found[key] is None:
            raise SceneError(f"{where}: row {number}: {heading}: expected a number above 0; got {text!r}")
    return {key: value for key, value in found.items() if value is not None}


def _sheet_rows(folder: Path, name: str) -> tuple[dict[str, tuple[str, str]], list[tuple[int, str, dict[str, str]]]]:
    """What a sheet's headings mean; number, log and facts of each of its rows, by heading."""
    where = f"experiment.sheet: {name}"
    try:
        every = [*enumerate(_cells(_sheet_text(folder, name)), start=1)]
    except csv.Error as error:
        raise SceneError(f"{where}: {error}") from error
    (_, head), *rows = [(number, row) for number, row in every if any(row)] or [(1, [])]
    meanings = _meanings(head)
    keys = [key for key, _ in meanings.values()]
    if "log" not in keys or len(set(keys)) < len(head):
        raise SceneError(f"{where}: expected a `log` column and each column once; got {head}")
    for heading, (key, unit) in meanings.items():
        if unit and quantity_of(unit) != _QUANTITIES[key]:
            raise SceneError(f"{where}: column {heading!r}: expected a unit like {UNIT[_QUANTITIES[key]]}; got {unit}")
    found = list[tuple[int, str, dict[str, str]]]()
    for number, row in rows:
        if len(row) != len(head):
            raise SceneError(f"{where}: row {number}: expected {len(head)} cells; got {len(row)}")
        facts = dict(zip(head, row, strict=True))
        for heading in (heading for heading, (key, _) in meanings.items() if key in _LOGS):
            entry = Path(facts[heading])
            if entry.is_absolute() or ".." in entry.parts:
                raise SceneError(f"{where}: row {number}: {str(entry)!r} leaves the sheet's folder")
            facts[heading] = entry.name
        found.append((number, facts.pop(head[keys.index("log")]), facts))
    return meanings, found


def _meanings(head: Sequence[str]) -> dict[str, tuple[str, str]]:
    """The key and the unit of each heading of a sheet; a heading that says no fact stands for itself.

    A number that has a unit is one only where that is said; a key as a heading wins over one in words.
    """
    found = dict[str, tuple[str, str]]()
    for heading in head:
        name, unit = split_unit(heading)
        key = next((key for key, words in _HEADINGS.items() if words.fullmatch(name)), heading)
        unit = "" if unit in ("-", "1") else unit
        if heading in _KNOWN or (key in head and key != heading) or (key in _QUANTITIES) != bool(unit):
            key, unit = heading, ""
        elif key == "normal_force_n" and f"normal_force_{unit}" in WEIGHTS:
            key, unit = f"normal_force_{unit}", ""
        found[heading] = key, unit
    return found


def _cells(text: str) -> Iterator[list[str]]:
    """The cells of each row of a sheet, parted by the sign that its head has most of."""
    rows = csv.reader(io.StringIO(text), delimiter=max(",;\t", key=text.partition("\n")[0].count))
    return ([cell.strip() for cell in row] for row in rows)


def is_sheet(path: Path) -> bool:
    """Whether a file is a sheet of facts: a small CSV whose head has a `log` column, or files, facts and no time."""
    if path.suffix.lower() not in (".csv", ".txt", ".tsv") or path.stat().st_size > 1 << 20:
        return False
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        head = next(_cells(file.readline()), [])
    keys = {key for key, _ in _meanings(head).values()}
    is_log = any(split_unit(key)[1] in TIME for key in keys.difference(_KNOWN))
    return "log" in head or ("log" in keys and not keys.isdisjoint(_KNOWN) and not is_log)


def _sheet_text(folder: Path, name: str) -> str:
    """What stands in a sheet: a file of bounded size beside its scene."""
    try:
        path = Path(os.path.realpath(folder / name))
    except ValueError as error:
        raise SceneError(f"experiment.sheet: {name!r}: cannot be the name of a file ({error})") from error
    if not path.is_relative_to(os.path.realpath(folder)):
        raise SceneError(f"experiment.sheet: {name!r} lies outside the scene's folder: put it beside the scene")
    try:
        check_regular(path)
        if path.stat().st_size > _SHEET_LIMIT:
            raise SceneError(f"experiment.sheet: {name}: larger than {_SHEET_LIMIT} bytes")
        raw = path.read_bytes()
    except OSError as error:
        raise SceneError(f"experiment.sheet: {name}: cannot be read ({error.strerror})") from error
    if raw.startswith(_WORKBOOKS):
        raise SceneError(f"experiment.sheet: {name}: expected text; got a workbook: save its sheet as CSV (UTF-8)")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")  # as Excel saves it in Western Europe


def _fact(key: str, text: str, unit: str = "") -> Fact | None:
    """A fact as a name or a cell has it, in SI units; None where a number above 0 is expected, and it is none."""
    if key not in _NUMERIC:
        return text.strip()
    try:
        number = float(text.replace(",", "."))
    except ValueError:
        return None
    number = float(to_si(np.array(number), unit)) if unit else number
    return number if 0.0 < number < math.inf else None
