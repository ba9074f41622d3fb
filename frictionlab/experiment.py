"""The facts of one test: from the scene, from the log's file name, from the sheet of a campaign."""

import csv
import io
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from frictionlab.errors import SceneError
from frictionlab.files import check_regular, stem_of
from frictionlab.scene import Experiment, Scene

Fact = str | float
_SOURCES = ("name_pattern", "sheet", "taps")
WEIGHTS = {"normal_force_g": 9.80665e-3, "normal_force_kg": 9.80665}
"""Keys of names and sheets that give the normal force as a weight, and what makes newtons of them."""
_NUMERIC = ("normal_force_n", *WEIGHTS, "base_amplitude_m", "nominal_frequency_ratio", "duration_s")
_KNOWN = (*(name for name in Experiment.model_fields if name not in _SOURCES), *WEIGHTS)
_NUMBER = re.compile(r"\d+(?:[.,]\d+)?")
_SHEET_LIMIT = 1 << 24


@dataclass(frozen=True)
class Facts:
    """What is known of a test, and sentences on what is missing or contradicts."""

    values: Mapping[str, Fact]
    warnings: tuple[str, ...] = ()


def facts_of(scene: Scene, log: Path) -> Facts:
    """Collect the facts of the test that a log records.

    The sheet wins over the file name, and the file name over the scene; where two disagree a warning says so.

    Parameters
    ----------
    scene
        Its ``[experiment]`` holds facts, a ``name_pattern`` and a ``sheet``.
    log
        The log; only its name is used.

    Raises
    ------
    SceneError
        If the pattern or the sheet cannot be used.

    Examples
    --------
    >>> scene = Scene(experiment=Experiment(name_pattern="{material}_N{normal_force_n}_r{nominal_frequency_ratio}"))
    >>> dict(facts_of(scene, Path("steel_N1.25_r0.3.csv")).values)
    {'material': 'steel', 'normal_force_n': 1.25, 'nominal_frequency_ratio': 0.3}
    """
    said = scene.experiment.model_dump(exclude=set(_SOURCES), exclude_none=True)
    found: dict[str, Fact] = {key: value for key, value in said.items() if isinstance(value, (str, int, float))}
    origin = dict.fromkeys(found, "the scene")
    warnings: list[str] = []
    if scene.experiment.name_pattern is not None:
        _add(found, origin, warnings, _from_name(scene.experiment.name_pattern, log, warnings), "the file name")
    if scene.experiment.sheet is not None:
        _add(found, origin, warnings, _from_sheet(scene, log, warnings), "the sheet")
    if scene.experiment.name_pattern is not None or scene.experiment.sheet is not None:
        warnings += [f"{key} of this test is not known" for key in ("material", "normal_force_n") if key not in found]
    return Facts(found, tuple(warnings))


def _add(
    found: dict[str, Fact], origin: dict[str, str], warnings: list[str], more: Mapping[str, Fact], source: str
) -> None:
    for key, value in more.items():
        if key in found and found[key] != value:
            warnings.append(f"{key}: {source} says {value}, {origin[key]} says {found[key]}: {value} is taken")
        found[key] = value
        origin[key] = source


def _from_name(pattern: str, log: Path, warnings: list[str]) -> dict[str, Fact]:
    texts = _matched(_parts_of(pattern), stem_of(log))
    if texts is None:
        warnings.append(f"the file name does not follow name_pattern {pattern!r}: its facts are not known")
        return {}
    found = {key: _number(text) if key in _NUMERIC else text for key, text in texts.items()}
    none = [key for key, value in found.items() if value == 0.0]
    warnings += [f"{key}: the file name says 0: expected a number above 0: it is not known" for key in none]
    return _in_newtons({key: value for key, value in found.items() if key not in none})


def _in_newtons(facts: Mapping[str, Fact]) -> dict[str, Fact]:
    """Facts with the normal force in newtons, where it was given as a weight."""
    return {
        "normal_force_n" if key in WEIGHTS else key: float(value) * WEIGHTS[key] if key in WEIGHTS else value
        for key, value in facts.items()
    }


def _parts_of(pattern: str) -> list[str]:
    """A pattern as texts and keys in turn: text, key, text, ..., text."""
    parts = re.split(r"\{([^{}]*)\}", pattern)
    keys = parts[1::2]
    unknown = [key for key in keys if key not in _KNOWN]
    beside = [f"{{{a}}}{{{b}}}" for a, text, b in zip(keys, parts[2::2], keys[1:], strict=False) if not text]
    if unknown or beside or not keys or len(set(keys)) < len(keys):
        wrong = f"unknown {unknown}" if unknown else "none" if not keys else "one twice"
        wrong = f"{beside[0]}, with nothing between them" if beside and not unknown else wrong
        raise SceneError(f"experiment.name_pattern: expected keys in braces, of {', '.join(_KNOWN)}; got {wrong}")
    return parts


def _matched(parts: Sequence[str], name: str) -> dict[str, str] | None:
    """What stands in a name for each key of a pattern, each text as short as can be; None where it does not fit.

    Each part is tried at each place once: a name of any length is done in a moment.
    """

    @cache
    def rest(part: int, at: int) -> tuple[str, ...] | None:
        if part == len(parts):
            return () if at == len(name) else None
        if part % 2 == 0:
            return rest(part + 1, at + len(parts[part])) if name.startswith(parts[part], at) else None
        is_number = parts[part] in _NUMERIC
        ends = range(len(name), at, -1) if is_number else range(at + 1, len(name) + 1)
        for end in ends:
            if is_number and not _NUMBER.fullmatch(name, at, end):
                continue
            found = rest(part + 1, end)
            if found is not None:
                return (name[at:end], *found)
        return None

    found = rest(0, 0)
    return None if found is None else dict(zip(parts[1::2], found, strict=True))


def _number(text: str) -> float:
    return float(text.replace(",", "."))


def _from_sheet(scene: Scene, log: Path, warnings: list[str]) -> dict[str, Fact]:
    name = scene.experiment.sheet or ""
    rows = {number: row for number, row in _sheet(scene.folder, name).items() if _names(row["log"], log)}
    if not rows:
        warnings.append(f"sheet {name}: no row for {log.name}: its facts are not known")
        return {}
    if len(rows) > 1:
        raise SceneError(f"experiment.sheet: {name}: {len(rows)} rows for {log.name}: expected one")
    ((number, row),) = rows.items()
    where = f"{name}: row {number}"
    return _in_newtons({k: _sheet_fact(k, text, where) for k, text in row.items() if k not in ("log", "") and text})


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
        size = path.stat().st_size
        text = path.read_text(encoding="utf-8-sig") if size <= _SHEET_LIMIT else None
    except OSError as error:
        raise SceneError(f"experiment.sheet: {name}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise SceneError(f"experiment.sheet: {name}: expected UTF-8 text; byte {error.start} is not") from error
    if text is None:
        raise SceneError(f"experiment.sheet: {name}: larger than {_SHEET_LIMIT} bytes")
    return text


def _sheet(folder: Path, name: str) -> dict[int, dict[str, str]]:
    """The rows of a sheet by their number, the head being row 1."""
    text = _sheet_text(folder, name)
    title = text.partition("\n")[0]
    separator = max(",;\t", key=title.count)
    reader = csv.reader(io.StringIO(text), delimiter=separator)
    try:
        rows = [[cell.strip() for cell in row] for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise SceneError(f"experiment.sheet: {name}: line {reader.line_num}: {error}") from error
    return _rows(rows, name)


def _rows(rows: list[list[str]], name: str) -> dict[int, dict[str, str]]:
    keys = rows[0] if rows else []
    if "log" not in keys or len(set(keys)) < len(keys):
        raise SceneError(f"experiment.sheet: {name}: expected a `log` column and each column once; got {keys}")
    table = {}
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(keys):
            raise SceneError(f"experiment.sheet: {name}: row {number}: expected {len(keys)} cells; got {len(row)}")
        facts = dict(zip(keys, row, strict=True))
        if Path(facts["log"]).is_absolute() or ".." in Path(facts["log"]).parts:
            raise SceneError(f"experiment.sheet: {name}: row {number}: {facts['log']!r} leaves the sheet's folder")
        table[number] = facts
    return table


def _names(entry: str, log: Path) -> bool:
    """Whether a sheet's entry names this log: by its name, or by its name without suffix."""
    name = Path(entry).name
    return name in (log.name, stem_of(log))


def _sheet_fact(key: str, text: str, where: str) -> Fact:
    """One cell of a sheet; numbers are positive and finite, as the scene's own."""
    if key not in _NUMERIC:
        return text
    try:
        number = _number(text)
    except ValueError as error:
        raise SceneError(f"experiment.sheet: {where}: {key}: expected a number; got {text!r}") from error
    if not (math.isfinite(number) and number > 0.0):
        raise SceneError(f"experiment.sheet: {where}: {key}: expected a number above 0; got {text!r}")
    return number
