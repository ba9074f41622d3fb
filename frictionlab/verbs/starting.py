"""Where work begins: a look at a folder of logs, and the scene that they need."""

import contextlib
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from frictionlab.errors import FrictionlabError, UsageError
from frictionlab.experiment import headings_of, logs_in_sheet, matched
from frictionlab.files import make_folder, stem_of, write_whole
from frictionlab.scene import SCENE_NAME, Scene
from frictionlab.scene.text import template, value_text
from frictionlab.verbs.inputs import FilePath, is_log_name, not_read_in, sheets_in

if TYPE_CHECKING:
    from frictionlab.analysis.free_vibration import FreeVibration
    from frictionlab.uncertainty import Average

MOST_READ = 12  # logs that are read; the names of all are
SHEETS = 1 << 16  # bytes; a larger file is no list of tests
MOVES = 0.05  # a base that moves more than this share of the mass drives it
OF_CONTACT = ("contact_force", "torque")  # channels of a tribometer, whose logs have no base
LATEST = 0.7  # share of a record after which nothing is said to have settled
TOKEN = re.compile(r"([A-Za-z]*?\xa0?)(\d+(?:[.,]\d+)?)(\xa0?[A-Za-z]*)")
HELD = re.compile(r"(?<=\d) (?=(?:n|g|kg|s)\b)|(?<=\b[nr]) (?=\d)", re.IGNORECASE)  # blanks inside "1 N", "r 0.5"
PREFIXES = {"n": "normal_force_n", "fn": "normal_force_n", "r": "nominal_frequency_ratio", "run": "repeat"}
SUFFIXES = {"n": "normal_force_n", "g": "normal_force_g", "kg": "normal_force_kg", "s": "duration_s"}
NO_MATERIALS = ("run", "test", "log", "data", "record", "recording", "measurement", "messung", "versuch", "file", "exp")
LISTS = "it names the logs: as a sheet of facts save it as CSV with columns log, material, normal_force_n (or ..._g)"
OVER_FREQUENCY = "a table over frequency, no log: `frictionlab compare-numeric` reads it"
TEN_KEYS = Path(__file__).with_name("init.toml.jinja")
ASKED = ("natural_frequency_hz", "mass_kg", "stiffness_n_per_m", "damping_ratio", "material", "normal_force_n")


@dataclass(frozen=True)
class Found:
    """What stands in a folder of logs."""

    tests: tuple[Path, ...] = ()  # logs of tests
    taps: tuple[Path, ...] = ()  # logs of free decays of the mass
    unread: Mapping[Path, str] = field(default_factory=dict)  # logs that cannot be read as they are, with the reason
    sheet: str | None = None  # name of a CSV that lists the tests: it has a `log` column
    sheet_says: tuple[str, ...] = ()  # which facts of them
    remarks: tuple[str, ...] = ()  # its headings that say none
    name_pattern: str | None = None  # what the names of the logs say, as in [experiment]
    odd: tuple[str, ...] = ()  # tests whose names do not say it
    is_tribometer: bool = False  # no test has a base, all measure a force of the contact: [rig] kind = "prescribed"
    settled_s: Mapping[Path, float] = field(default_factory=dict)  # when the motion of each test looked at had settled
    frame: "Mapping[str, Average]" = field(default_factory=dict)  # natural frequency and damping ratio, from the taps
    doubts: tuple[str, ...] = ()  # of taps that contradict each other

    @property
    def lacks(self) -> tuple[str, ...]:
        """What nobody can find in logs: what is to be asked for, as keys of a scene."""
        rig = () if "natural_frequency_hz" in self.frame else ("rig.natural_frequency_hz",)
        rig = () if self.is_tribometer else (*rig, "rig.mass_kg")
        facts = " ".join((self.name_pattern or "", *self.sheet_says))
        asked = ("material", "normal_force_n") if self.tests or not self.taps else ()
        open_keys = [key for key in asked if key.rstrip("_n") not in facts]
        return (*rig, *(f"experiment.{key}" for key in open_keys))


def look(folder: FilePath) -> Found:
    """Look at a folder of logs: which are tests, which are taps, what their names say, when they settle.

    A folder that is not there, or has no logs, is an empty one.
    """
    from frictionlab.analysis.free_vibration import averages, taps_apart
    from frictionlab.verbs.one_test import analyze, free_vibration, frequency_table_given, ingest

    place = Path(folder)
    files = sorted(p for p in place.iterdir() if p.is_file() and is_log_name(p)) if place.is_dir() else []
    sheets = sheets_in([place])
    sheet = next((p.name for p in sheets if logs_in_sheet(place, p.name, files)[0]), None)
    says, others = headings_of(place, sheet) if sheet else ([], [])
    logs = [p for p in files if p not in sheets and not p.name.startswith(".")]
    tests: list[Path] = []
    taps: list[Path] = []
    decays: list[FreeVibration] = []
    of_log: list[str] = []
    unread = not_read_in([place]) | {p: "a sheet none of whose logs is here" for p in sheets if p.name != sheet}
    settled: dict[Path, float] = {}
    has_base: set[bool] = set()
    for number, log in enumerate(logs):
        reason = ""
        try:
            if number >= MOST_READ and not stem_of(log).lower().startswith("tap") and not _names_some(log, logs):
                tests.append(log)
                continue
            recording = ingest(log)
            measured = recording.measured()
            is_driven = not any(name in measured for name in OF_CONTACT) or any("base" in name for name in measured)
            if not is_driven or np.ptp(recording.base_displacement) > MOVES * np.ptp(recording.mass_displacement):
                tests.append(log)
                has_base.add(is_driven)
                length = recording.duration_s
                with contextlib.suppress(FrictionlabError):  # it is a test all the same: the batch says what is wrong
                    at = analyze(recording, transient_s=min(1.0, 0.1 * length), cycles="all").settled_s
                    settled |= {log: at} if at is not None and at < LATEST * length else {}
                continue
        except FrictionlabError as error:
            reason = str(error)
        try:
            if reason and frequency_table_given(log, Scene()) is not None:
                unread[log] = OVER_FREQUENCY
                continue
            decays += free_vibration(log)
            of_log += [log.name] * (len(decays) - len(of_log))
            taps.append(log)
        except FrictionlabError as error:
            unread[log] = (reason or str(error)).removeprefix(f"{log}: ").removeprefix(f"{log.name}: ")
    unread |= {path: LISTS for path in unread if path.is_file() and _names_some(path, tests)}
    pattern, odd = pattern_of([stem_of(log) for log in tests])
    return Found(
        tests=tuple(tests),
        taps=tuple(taps),
        unread=unread,
        sheet=sheet,
        sheet_says=tuple(says),
        remarks=tuple(others),
        name_pattern=pattern,
        odd=odd,
        is_tribometer=has_base == {False},
        settled_s=settled,
        frame=averages(decays),
        doubts=tuple(f"{of_log[number]}: {sentence}" for number, sentence in taps_apart(decays)),
    )


def _names_some(path: Path, logs: Sequence[Path]) -> bool:
    """Whether a small text or workbook names several of these logs."""
    from frictionlab.logs.text import read_text

    if path.stat().st_size > SHEETS:
        return False
    with contextlib.suppress(FrictionlabError):
        text = "\n".join(read_text(path).lines)
        return sum(stem_of(log) in text for log in logs if len(stem_of(log)) > 2) > 1
    return False


def pattern_of(names: Sequence[str]) -> tuple[str | None, tuple[str, ...]]:
    """The ``name_pattern`` that the names of logs follow, and the odd names that do not; None where most do not.

    Examples
    --------
    >>> pattern_of(["steel_N1.25_r0.3", "rubber_N1.25_r1.2"]), pattern_of(["steel_250g", "steel_500g", "steel_x"])
    (('{material}_N{normal_force_n}_r{nominal_frequency_ratio}', ()), ('{material}_{normal_force_g}g', ('steel_x',)))
    >>> pattern_of(["oak 1 N r 0.5", "oak 2 N r 0.7"]), pattern_of(["test1", "some other"])
    (('{material} {normal_force_n} N r {nominal_frequency_ratio}', ()), (None, ()))
    >>> pattern_of(["run_1", "run_2"]), pattern_of(["oak 3N long"]), pattern_of(["oak dry 3N", "oak wet 3N"])
    ((None, ()), ('{material} {normal_force_n}N long', ()), (None, ()))
    """
    for sign in ("_", "-", " "):
        rows = {name: HELD.sub("\xa0", name).split(sign) for name in names}
        kinds = {name: tuple(bool(re.search(r"\d", word)) for word in row) for name, row in rows.items()}
        usual, count = Counter(kinds.values()).most_common(1)[0] if rows else ((), 0)
        if len(usual) < 2 or 2 * count <= len(rows):
            continue
        columns = [*zip(*(row for n, row in rows.items() if kinds[n] == usual), strict=True)]
        parts = [*map(_part, columns)]
        words = [i for i, part in enumerate(parts) if part == "{material}"]
        if all(len(set(columns[i])) == 1 for i in words):  # of words that are the same in all names the first counts
            parts = [columns[i][0] if i in words[1:] else part for i, part in enumerate(parts)]
        keys = Counter(key for part in parts for key in re.findall(r"\{(\w+)\}", part))
        if "material" in keys and max(keys.values()) == 1:
            return sign.join(parts), tuple(name for name in names if matched(sign.join(parts), name) is None)
    return None, ()


def _part(words: Sequence[str]) -> str:
    """What stands at one place of all names: a key with its signs, or the same text in all."""
    matches = [TOKEN.fullmatch(word) for word in words]
    if all(matches):
        before, after = ({m[i].lower() for m in matches if m} for i in (1, 3))
        first = matches[0]
        if len(before) == len(after) == 1 and first is not None:
            key = PREFIXES.get(min(before).strip()) if min(before) else SUFFIXES.get(min(after).strip())
            if key is not None:
                return f"{first[1]}{{{key}}}{first[3]}".replace("\xa0", " ")
        return "{repeat}" if len(set(words)) > 1 else words[0]
    if all(word.isalpha() and word.lower() not in NO_MATERIALS for word in words):
        return "{material}"
    return "{note}" if len(set(words)) > 1 else words[0]


def init(
    folder: FilePath = ".",
    *,
    force: bool = False,
    everything: bool = False,
    found: Found | None = None,
    **facts: object,
) -> Path:
    """Write the scene that a folder of logs needs, ``frictionlab.toml``, into it and return its path.

    Parameters
    ----------
    folder : str or Path
        Made if it is not there.
    force : bool
        Replace a file of that name.
    everything : bool
        Write every key there is, each with its sentence and default, in place of the ten that most need.
    found : Found, optional
        What `look` has found in it; by default it looks.
    **facts
        What else is known: ``mass_kg=3.08``, ``stiffness_n_per_m``, ``natural_frequency_hz``, ``material``,
        ``normal_force_n``.

    Raises
    ------
    UsageError
        There is a scene already, and ``force`` is not set.
    OutputError
        It cannot be written.
    """
    from jinja2 import Template

    from frictionlab.analysis.free_vibration import scene_snippet

    path = Path(folder) / SCENE_NAME
    if path.exists() and not force:
        raise UsageError(f"{path}: exists: fill it in, or give --force to replace it")
    make_folder(path.parent)
    if everything:
        text = template()
    else:
        found = look(folder) if found is None else found
        of_taps = scene_snippet(found.frame).splitlines()[1:] if found.frame else []
        known = dict.fromkeys(ASKED) | facts
        page = Template(TEN_KEYS.read_text(encoding="utf-8"), trim_blocks=True, keep_trailing_newline=True)
        text = page.render(found=found, facts=known, of_taps=of_taps, toml=value_text)
    write_whole(path, text.encode())
    return path
