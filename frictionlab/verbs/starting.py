"""Where work begins: a look at a folder of logs, and the scene that they need."""

import contextlib
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from frictionlab.errors import FrictionlabError, UsageError
from frictionlab.experiment import headings_of, logs_in_sheet, matched, without_base_logs
from frictionlab.files import make_folder, stem_of, write_whole
from frictionlab.scene import SCENE_NAME, Scene, scene_from_tables
from frictionlab.scene.text import template, value_text
from frictionlab.tables import write_rows
from frictionlab.verbs.inputs import FilePath, is_log_name, not_read_in, sheets_in

if TYPE_CHECKING:
    from frictionlab.analysis.free_vibration import FreeVibration
    from frictionlab.uncertainty import Average

MOST_READ = 12  # logs that are read; the names of all are
SHEETS = 1 << 16  # bytes; a larger file is no list of tests
LATEST = 0.7  # share of a record after which nothing is said to have settled
MOVES = 0.05  # a base that moves more than this share of the mass drives it
OF_CONTACT = ("contact_force", "torque")  # channels of a tribometer, whose logs have no base
TOKEN = re.compile(r"([A-Za-z]*?\xa0?)(\d+(?:[.,]\d+)?)(\xa0?[A-Za-z]*)")
HELD = re.compile(r"(?<=\d) (?=(?:n|g|kg|s)\b)|(?<=\b[nr]) (?=\d)", re.IGNORECASE)  # blanks inside "1 N", "r 0.5"
PREFIXES = {"n": "normal_force_n", "fn": "normal_force_n", "r": "nominal_frequency_ratio", "run": "repeat"}
SUFFIXES = {"n": "normal_force_n", "g": "normal_force_g", "kg": "normal_force_kg", "s": "duration_s"}
NO_MATERIALS = (
    "run", "test", "log", "protocol", "data", "record", "recording", "measurement", "messung", "versuch", "file", "exp",
    "mass", "masse", "base", "basis",
)  # fmt: skip
SENSORS = [re.compile(rf"(?<![^\W_])({words})(?![^\W_])", re.IGNORECASE) for words in ("mass|masse|x", "base|basis|y")]
"""Words in names of logs that say whose sensor wrote them, the mass's or the base's."""
PAIRS = "pairs.csv"  # the sheet that `init` writes where each sensor has a log of its own
LISTS = "it names the logs: as a sheet of facts save it as CSV with columns log, material, normal_force_n (or ..._g)"
OVER_FREQUENCY = "a table over frequency, no log: `frictionlab compare-numeric` reads it"
TEN_KEYS = Path(__file__).with_name("init.toml.jinja")
ASKED = ("natural_frequency_hz", "mass_kg", "stiffness_n_per_m", "damping_ratio", "material", "normal_force_n")


Pairs = tuple[tuple[Path, Path], ...]


@dataclass(frozen=True)
class Found:
    """What stands in a folder of logs."""

    tests: tuple[Path, ...] = ()  # logs of tests
    taps: tuple[Path, ...] = ()  # logs of free decays of the mass
    unread: Mapping[Path, str] = field(default_factory=dict)  # logs that cannot be read as they are, with the reason
    sheet: str | None = None  # name of a CSV that lists the tests: it has a `log` column
    pairs: Pairs = ()  # logs of mass and base, where each sensor has its own and no sheet lists them
    sheet_says: tuple[str, ...] = ()  # which facts of them
    remarks: tuple[str, ...] = ()  # its headings that say none
    name_pattern: str | None = None  # what the names of the logs say, as in [experiment]
    odd: tuple[str, ...] = ()  # tests whose names do not say it
    is_tribometer: bool = False  # no test has a base, all measure a force of the contact: [rig] kind = "prescribed"
    frame: "Mapping[str, Average]" = field(default_factory=dict)  # natural frequency and damping ratio, from the taps
    doubts: tuple[str, ...] = ()  # of taps that contradict each other, or of rigs of two kinds
    settled_s: float | None = None  # when the last of the tests that were read had settled

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
    """Look at a folder of logs: which are tests, which are taps, what their names say.

    A folder that is not there, or has no logs, is an empty one.
    """
    from frictionlab.analysis.free_vibration import averages, taps_apart

    place = Path(folder)
    files = sorted(p for p in place.iterdir() if p.is_file() and is_log_name(p)) if place.is_dir() else []
    sheets = sheets_in([place])
    sheet = next((p.name for p in sheets if logs_in_sheet(place, p.name, files)[0]), None)
    says, remarks = headings_of(place, sheet) if sheet else ([], [])
    known = scene_from_tables({"experiment": {"sheet": sheet} if sheet else {}}, folder=place)
    logs = without_base_logs(known, [p for p in files if p not in sheets and not p.name.startswith(".")])
    unread = not_read_in([place]) | {p: "a sheet none of whose logs is here" for p in sheets if p.name != sheet}
    seen = {
        log: _seen(log, known)
        if number < MOST_READ or stem_of(log).lower().startswith("tap") or _names_some(log, logs)
        else _Seen(is_test=True)
        for number, log in enumerate(logs)
    }
    unread |= {log: one.reason for log, one in seen.items() if one.reason}
    tests = [log for log, one in seen.items() if one.is_test]
    unread |= {path: LISTS for path in unread if path.is_file() and _names_some(path, tests)}
    pairs = () if sheet else pairs_of([log for log in logs if log in unread])
    if pairs:  # so are those that were not read
        pairs = pairs_of([log for log, one in seen.items() if log in unread or (one.is_test and one.is_driven is None)])
        paired = {log for pair in pairs for log in pair}
        tests = [log for log in tests if log not in paired] + [mass for mass, _ in pairs]
        unread = {log: reason for log, reason in unread.items() if log not in paired}
    pattern, odd = pattern_of([stem_of(log) for log in tests])
    decays = [(log.name, tap) for log, one in seen.items() for tap in one.decays]
    doubts = [f"{decays[k][0]}: {sentence}" for k, sentence in taps_apart([tap for _, tap in decays])]
    given = [log.name for log, one in seen.items() if one.is_driven is False]
    if given and any(one.is_driven for one in seen.values()):
        doubts.append(
            f"{', '.join(given)}: a force and no base, as of a tribometer: put them into a folder of their own"
        )
    return Found(
        tests=tuple(tests),
        taps=tuple(log for log, one in seen.items() if one.decays),
        unread=unread,
        sheet=PAIRS if pairs else sheet,
        pairs=pairs,
        sheet_says=tuple(says),
        remarks=tuple(remarks),
        name_pattern=pattern,
        odd=odd,
        is_tribometer={one.is_driven for one in seen.values()} - {None} == {False},
        frame=averages([tap for _, tap in decays]),
        doubts=tuple(doubts),
        settled_s=max((one.settled_s for one in seen.values() if one.settled_s is not None), default=None),
    )


@dataclass(frozen=True)
class _Seen:
    """What a log is: a test, which a base drives or not (None: it was not read); free decays; or not read, and why."""

    is_test: bool = False
    is_driven: bool | None = None
    decays: "tuple[FreeVibration, ...]" = ()
    reason: str = ""
    settled_s: float | None = None


def _seen(log: Path, scene: Scene) -> _Seen:
    from frictionlab.verbs.one_test import analyze, free_vibration, frequency_table_given, ingest

    reason = ""
    try:
        recording = ingest(log, scene)
        measured = recording.measured()
        is_driven = not any(name in measured for name in OF_CONTACT) or any("base" in name for name in measured)
        if not is_driven or np.ptp(recording.base_displacement) > MOVES * np.ptp(recording.mass_displacement):
            at = None
            with contextlib.suppress(FrictionlabError):  # it is a test all the same: the batch says what is wrong
                at = analyze(recording, transient_s=min(1.0, 0.1 * recording.duration_s), cycles="all").settled_s
            is_late = at is None or at > LATEST * recording.duration_s
            return _Seen(is_test=True, is_driven=is_driven, settled_s=None if is_late else at)
    except FrictionlabError as error:
        reason = str(error)
    try:
        if reason and frequency_table_given(log, Scene()) is not None:
            return _Seen(reason=OVER_FREQUENCY)
        return _Seen(decays=free_vibration(log))
    except FrictionlabError as error:
        return _Seen(reason=(reason or str(error)).removeprefix(f"{log}: ").removeprefix(f"{log.name}: "))


def pairs_of(logs: Sequence[Path]) -> Pairs:
    """Which of these logs are of mass and base of one test: by words of their names, else by their absolute stamps.

    Of two that ran at the same time and whose names do not say it, the first by name is listed as the mass's.
    """
    from frictionlab.logs import read_mass_log

    named: dict[str, dict[int, Path]] = {}
    for log in logs:
        for role, words in enumerate(SENSORS):
            rest, count = words.subn("", stem_of(log))
            named.setdefault(rest, {}).update({role: log} if count else {})
    found = [(some[0], some[1]) for some in named.values() if len(some) > 1]
    spans: list[tuple[float, Path, float]] = []
    for log in (log for log in logs if not any(log in pair for pair in found)):
        with contextlib.suppress(FrictionlabError):
            recording = read_mass_log(log)
            start = recording.source.dialect.get("start_time")
            if start and not recording.base_displacement.any():  # of a single sensor
                spans.append((datetime.fromisoformat(str(start)).timestamp(), log, recording.duration_s))
    for (begin, one, length), (later, other, _) in pairwise(sorted(spans)):
        if later < begin + 0.5 * length and not any(one in pair for pair in found):
            found.append((min(one, other), max(one, other)))
    return tuple(found)


def _names_some(path: Path, logs: Sequence[Path]) -> bool:
    """Whether a small text or workbook names several of these logs."""
    from frictionlab.logs.text import read_text

    if path.stat().st_size > SHEETS:
        return False
    with contextlib.suppress(FrictionlabError, OSError):
        text = "\n".join(read_text(path).lines)
        return sum(stem_of(log) in text for log in logs if len(stem_of(log)) > 2) > 1
    return False


def pattern_of(names: Sequence[str]) -> tuple[str | None, tuple[str, ...]]:
    """The ``name_pattern`` that the names of logs follow, and the odd names that do not; None where most do not.

    Examples
    --------
    >>> pattern_of(["steel_N1.25_r0.3", "rubber_N1.25_r1.2"]), pattern_of(["steel_250g", "steel_500g", "steel_x"])
    (('{material}_N{normal_force_n}_r{nominal_frequency_ratio}', ()), ('{material}_{normal_force_g}g', ('steel_x',)))
    >>> pattern_of(["oak 1 N r 0.5", "oak 2 N r 0.7"]), pattern_of(["ep_mass", "two_mass"])
    (('{material} {normal_force_n} N r {nominal_frequency_ratio}', ()), (None, ()))
    >>> pattern_of(["test1", "other"]), pattern_of(["oak 3N a", "oak 3N b"]), pattern_of(["oak dry 3N", "oak wet 3N"])
    ((None, ()), ('{material} {normal_force_n}N {note}', ()), (None, ()))
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
        if "material" in keys and max(keys.values()) == 1 and (len(keys) > 1 or not {*NO_MATERIALS} & {*parts}):
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
    if all(word.isalpha() and len(word) > 1 and word.lower() not in NO_MATERIALS for word in words):
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
        if found.pairs:
            open_facts: dict[str, object] = {} if found.name_pattern else {"material": None, "normal_force_n": None}
            pairs = [{"log": mass.name, "base_log": base.name} | open_facts for mass, base in found.pairs]
            write_rows(pairs, path.with_name(PAIRS), force=force)
        of_taps = scene_snippet(found.frame).splitlines()[1:] if found.frame else []
        known = dict.fromkeys(ASKED) | facts
        page = Template(TEN_KEYS.read_text(encoding="utf-8"), trim_blocks=True, keep_trailing_newline=True)
        text = page.render(found=found, facts=known, of_taps=of_taps, toml=value_text)
    write_whole(path, text.encode())
    return path
