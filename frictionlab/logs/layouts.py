"""The layouts of logs that are known by name, and any log that has lines of numbers.

A layout of its own is a function ``(text, options) -> LogLayout | None`` in `LAYOUTS` that says whether a log is of its
kind and, if so, where its header of names and units is, what its columns are, and what the lines above state: interval
and start. `columns_of_text` reads what is left.

- sensorTOOL (Micro-Epsilon optoNCDT): one file per sensor, six lines of preamble, padded names; of the two time columns
  the epoch time is taken: it is a number, and it is what two sensors' files have in common
- LabVIEW (.lvm): separator and decimal mark are stated in the file header; a segment header may come again further
  down; a last column of comments may be there or not on each line; ``X_Columns`` says whether time is written once
  (One), for each channel (Multi), or not at all (No; it is then counted by ``Delta_X``)
- NI: rows that begin with a label, a time column per channel
- PicoScope: ``Time,Channel A`` / ``(ms),(V)`` / a blank line; over-range is the infinity sign
- catman ASCII (HBM): TAB, decimal comma, dozens of header lines; names and units stand among other rows
- units row: a row of units below the names (oscilloscopes, servo drives, many loggers)
- plain: a header of names with or without units, comments, whatever separator and decimal mark
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.columns import LogColumn, columns_of, roles_named
from frictionlab.logs.dialect import LogLayout, find_dialect, is_comment, kind_of, moment, number, plain, split
from frictionlab.logs.text import Text
from frictionlab.units import TIME, known_unit

_CLOCK = re.compile(r"[\[({]?(?:[dmy]+[-/.][dmy]+[-/.][dmy]+\W)?hh?:mm:ss\W?\w*[])}]?", re.IGNORECASE)
_BRACKETED = re.compile(r'\s*"?\([^()]*\)"?(\s*[,;\t]\s*"?\([^()]*\)"?)+\s*')
_INTERVAL = re.compile(r"(samp\w*[ _-]*)?(time[ _-]*)?(interval|period)|delta_x|dt|abtastintervall", re.IGNORECASE)
_RATE = re.compile(r"samp\w*[ _-]*(rate|frequency)|abtastrate|messrate", re.IGNORECASE)
_UNIT = re.compile(r"^(.*?)\s*[\[(]?\s*(s|sec|ms|us|µs|ns|hz|khz|1/s)?\s*[\])]?\s*[:=]?$", re.IGNORECASE)
_HERTZ = {"hz": 1.0, "khz": 1e3, "1/s": 1.0, "": 1.0}
_DAMAGED_ABOVE = 5  # lines of data between the header and the first sound one
_MANY = 8  # header rows as wide as the data
_BELIEVABLE_S = (1e-9, 1e5)  # between samples; a damaged preamble states anything


def find_layout(text: Text, options: LogOptions) -> LogLayout:
    """Give the first layout that recognises a log."""
    found = (recognise(text, options) for recognise in LAYOUTS)
    return next(filter(None, found), None) or columns_of_text(text, options)


def columns_of_text(text: Text, options: LogOptions) -> LogLayout:
    """Read any log that has lines of numbers; the last resort, so it raises where nothing is found."""
    dialect = find_dialect(text.lines, options)
    name, why = _maker(text, dialect)
    titles, units, header, body = _header(text.lines, dialect, deep=name == "catman ASCII")
    name = name or ("units-row" if units else "plain")
    if name == "plain" and not titles and (options.mass is None or options.base is None):
        # names that do not fit the numbers below them: most often decimal commas separated by commas
        above = [(i, line) for i, line in enumerate(text.lines[: dialect.first]) if line.strip()]
        names = split(above[-1][1], dialect.separator) if above else []
        if roles_named(names) > 1 and len(names) != dialect.fields:
            raise LogError(
                f"line {above[-1][0] + 1} names {len(names)} columns, the lines below have"
                f" {dialect.fields} fields: are these decimal commas separated by commas? Export it otherwise, or give"
                " --time, --mass and --base by number"
            )
    if titles:
        why = (*why, f"line {header[0] + 1} names the columns, {'with a' if units else 'without'} units row")
    again = {text.lines[i].strip() for i in header}
    return replace(
        dialect,
        name=name,
        columns=columns_of(titles, units, dialect.kinds),
        header=header,
        body=body,
        facts=_stated_facts(text.lines[:body], dialect.decimal),
        is_header=lambda line: line in again,
        evidence=(*dialect.evidence, *why, *(() if titles else ("no line names the columns",))),
    )


def _maker(text: Text, dialect: LogLayout) -> tuple[str, tuple[str, ...]]:
    """Whose program wrote a log, and by what that is seen; "" where it may be any."""
    lines = text.lines
    if any("epoch time" in line.lower() and "distance" in line.lower() for line in lines[:200]):
        return "optoNCDT sensorTOOL", ("columns of epoch time and distance",)
    units_below = len(lines) > 3 and _BRACKETED.fullmatch(lines[1]) and not lines[2].strip()
    if units_below and lines[0].lower().lstrip('"').startswith("time"):
        return "PicoScope", ("line 1 names channels, line 2 holds units in brackets, line 3 is blank",)
    above = lines[: dialect.first]
    if any("catman" in line.lower() for line in above):
        return "catman ASCII", ("the header names catman",)
    wide = sum(line.count("\t") == dialect.fields - 1 for line in above)
    if dialect.separator == "\t" and dialect.fields > 1 and wide >= _MANY:
        return "catman ASCII", (f"{wide} header rows as wide as the data",)
    return "", ()


def _header(
    lines: Sequence[str], dialect: LogLayout, *, deep: bool
) -> tuple[Sequence[str], Sequence[str], tuple[int, ...], int]:
    """Look upward from the first data line for names and units: both, their lines, and the first line below them."""
    rows = _rows_above(lines, dialect, deep=deep)
    units = next(((i, cells) for i, cells in rows if _is_units_row(cells)), None)
    names = [(i, cells) for i, cells in rows if units is None or i != units[0]]
    best = max(names, key=lambda row: (roles_named(row[1]), row[0]), default=None) if deep else next(iter(names), None)
    if best is not None and units is not None and not deep and units[0] < best[0] - 2:
        units = None
    return (
        best[1] if best else (),
        [known_unit(cell) for cell in units[1]] if units else (),
        tuple(sorted({row[0] for row in (best, units) if row is not None})),
        max((i for i, _ in rows), default=dialect.first - 1) + 1,
    )


def _rows_above(lines: Sequence[str], dialect: LogLayout, *, deep: bool) -> list[tuple[int, list[str]]]:
    """Rows of words as wide as the data, nearest first; a few damaged data lines may stand below them."""
    rows: list[tuple[int, list[str]]] = []
    damaged = 0
    fewest = len(dialect.kinds.rstrip("e"))  # its last columns may always be empty
    for i in range(dialect.first - 1, -1, -1):
        line = lines[i]
        text = line.lstrip().lstrip("#%!").lstrip("/").strip() if is_comment(line) else line
        cells = [plain(c) for c in split(text, dialect.separator)]
        if is_comment(line) and len(cells) != dialect.fields and len(text.split()) == dialect.fields:
            cells = text.split()
        while len(cells) > dialect.fields and not cells[-1]:
            cells.pop()
        if not any(cells):
            continue
        units = _is_units_row(cells)
        kinds = [kind_of(c, dialect.decimal) for c in cells]
        is_words = kinds.count("t") >= max(1, kinds.count("n") + kinds.count("m"))
        if fewest <= len(cells) <= dialect.fields and (units or is_words):
            if damaged and not units and not roles_named(cells):
                break
            rows.append((i, cells))
            if not (deep or units):
                break
        elif not deep:
            damaged += 1
            if damaged > _DAMAGED_ABOVE:
                break
    return rows


def _is_units_row(cells: Sequence[str]) -> bool:
    named = [c for c in cells if c]
    units = [known_unit(c) for c in named if not _CLOCK.fullmatch(c)]
    return bool(units) and all(units) and roles_named(cells) < 2


def _stated_facts(lines: Sequence[str], decimal: str) -> dict[str, float]:
    """The interval where a line of the form "key <separator> value" states it: ``Sampling time interval(ms),0.5``."""
    for line in lines:
        key = re.split(r"[;\t:=]|,(?!\d)|(?<=\D),", line.lstrip("#%! "), maxsplit=1) if len(line) <= 500 else []
        cells = [plain(cell) for cell in key]
        if len(cells) < 2:
            continue
        interval = _interval(cells[0], re.split(r"[;\t]|, ?(?=\D)", cells[1])[0], decimal)
        if interval is not None:
            return {"interval_s": interval}
    return {}


def _interval(key: str, value: str, decimal: str) -> float | None:
    match = _UNIT.match(key)
    name, unit = (match[1].strip(), (match[2] or "").lower()) if match else (key, "")
    amount, _, behind = value.strip().partition(" ")
    found = number(amount, decimal) if decimal == "." else number(amount, decimal) or number(amount, ".")
    if found is None or not 0.0 < found < float("inf"):
        return None
    unit = unit or behind.strip("[]() ").lower()
    interval = 0.0
    if _RATE.fullmatch(name) and unit in _HERTZ:
        interval = 1.0 / (found * _HERTZ[unit])
    elif _INTERVAL.fullmatch(name) and (known_unit(unit) in TIME or not unit):
        interval = found / TIME[known_unit(unit) or "s"]
    return interval if _BELIEVABLE_S[0] < interval < _BELIEVABLE_S[1] else None


_END = "***End_of_Header***"
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}
_KEYS = frozenset(
    "LabVIEW Measurement|Writer_Version|Reader_Version|Separator|Decimal_Separator|Multi_Headings|X_Columns|Time_Pref|"
    "Operator|Description|Date|Time|Project|Channels|Samples|Y_Unit_Label|X_Unit_Label|X_Dimension|Y_Dimension|X0|"
    "Delta_X|Test_Name|Test_Numbers|Test_Series|UUT_M/N|UUT_S/N|UUT_Name|Model_Number|Serial_Number|Notes|X_Value|"
    f"{_END}".split("|")
)


def labview(text: Text, options: LogOptions) -> LogLayout | None:
    """Begins with ``LabVIEW Measurement`` or holds the end-of-header mark."""
    if not any(line.startswith((_END, "LabVIEW Measurement")) for line in text.lines[:100]):
        return None
    names = next((i for i, line in enumerate(text.lines) if _key(line) == "X_Value"), None)
    if names is None:
        return None
    said = {_key(line): line for line in text.lines[:names]}
    separator = _SEPARATORS.get(said.get("Separator", "").removeprefix("Separator").strip("\t ,;").lower(), "\t")
    mark = said.get("Decimal_Separator", "").removeprefix("Decimal_Separator").strip("\t ")
    mark = options.decimal or (mark if mark in (".", ",") else "")
    options = options.but(separator=options.separator or separator, decimal=mark or None)
    found = find_dialect(text.lines[names + 1 :], options)
    dialect = replace(found, first=found.first + names + 1)

    def cells_of(key: str) -> list[str]:
        return [plain(cell) for cell in said.get(key, "").split(dialect.separator)[1:]]

    titles = [plain(c) for c in text.lines[names].split(dialect.separator)]
    units = dict(enumerate(map(known_unit, cells_of("Y_Unit_Label")), 1))  # each above its channel
    columns = [
        replace(c, unit="s" if c.title == "X_Value" else c.unit or units.get(c.index, ""))
        for c in columns_of(titles, (), dialect.kinds)
    ]
    times = [c.index for c in columns if c.title == "X_Value"]
    facts = _first_interval(cells_of("Delta_X"), dialect.decimal)
    date, time = cells_of("Date")[:1], cells_of("Time")[:1]
    if date and time and (start := moment(f"{date[0]} {time[0]}")) is not None:
        facts["start_s"] = start
    why = f"the LabVIEW header states separator and decimal mark; line {names + 1} names the channels"
    return replace(
        dialect,
        name="LabVIEW lvm",
        columns=_with_stamps(columns, times if len(times) > 1 else ()),
        header=(names,),
        body=names + 1,
        facts=facts,
        is_header=lambda line: _key(line) in _KEYS,
        spare=1 if titles[-1:] == ["Comment"] and len(titles) > dialect.fields else 0,
        evidence=(*dialect.evidence, why),
    )


def _key(line: str) -> str:
    return line.replace(";", "\t").replace(",", "\t").partition("\t")[0].strip()


def _with_stamps(columns: Sequence[LogColumn], times: Sequence[int]) -> tuple[LogColumn, ...]:
    """Give each channel the time column to its left."""
    left = {c.index: [t for t in times if t < c.index] for c in columns if c.index not in times}
    return tuple(replace(c, stamps=max(left[c.index])) if left.get(c.index) else c for c in columns)


def _first_interval(cells: Sequence[str], decimal: str) -> dict[str, float]:
    numbers = (number(cell, decimal) or 0.0 for cell in cells)
    found = next((step for step in numbers if _BELIEVABLE_S[0] < step < _BELIEVABLE_S[1]), None)
    return {} if found is None else {"interval_s": found}


_LABELS = ("timestamp", "interval", "channel name", "unit")


def ni(text: Text, options: LogOptions) -> LogLayout | None:
    """Rows labelled ``Channel name`` and ``Interval``; a column under a label, or without a name, is time."""
    first = [plain(line.split(",")[0].split(";")[0].split("\t")[0]).lower() for line in text.lines[:60]]
    if "channel name" not in first or "interval" not in first:
        return None
    dialect = find_dialect(text.lines, options)
    lines = {label: i for i, label in enumerate(first) if label in _LABELS and i < dialect.first}
    if "channel name" not in lines or "interval" not in lines:
        return None
    rows = {label: [plain(c) for c in split(text.lines[i], dialect.separator)] for label, i in lines.items()}
    names, units = rows["channel name"], rows.get("unit", [])
    if len(names) == dialect.fields + 1:  # a label column that the data lacks
        names, units = names[1:], units[1:]
    is_time = {i for i in range(dialect.fields) if i >= len(names) or names[i].lower() in ("channel name", "")}
    columns = [
        replace(c, title="time", name="time", unit="s") if c.index in is_time else c
        for c in columns_of(names, [known_unit(unit) for unit in units], dialect.kinds)
    ]
    facts = _first_interval(rows["interval"][1:], dialect.decimal)
    starts = [m for c in rows.get("timestamp", [])[1:] if (m := moment(c)) is not None]
    return replace(
        dialect,
        name="NI",
        columns=_with_stamps(columns, [c.index for c in columns if c.name == "time"]),
        header=tuple(sorted(lines[label] for label in ("channel name", "unit") if label in lines)),
        body=max(lines.values()) + 1,
        facts=facts | {"start_s": starts[0]} if starts else facts,
        is_header=lambda line: plain(line.partition(dialect.separator)[0]).lower() in _LABELS,
        evidence=(*dialect.evidence, f"rows labelled {', '.join(rows)}"),
    )


LAYOUTS: tuple[Callable[[Text, LogOptions], LogLayout | None], ...] = (labview, ni)
"""Before `columns_of_text`, which reads what is left."""
