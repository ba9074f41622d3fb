"""LabVIEW measurement files (.lvm): a file header, segment headers, ``X_Value`` and channel names, numbers.

Separator and decimal mark are stated in the file header. A segment header may come again further down; its lines are
header lines. A last column of comments may be there or not on each line. ``X_Columns`` says whether time is written
once (One), for each channel (Multi), or not at all (No; it is then counted by ``Delta_X``).
"""

from collections.abc import Mapping
from dataclasses import replace

from frictionlab.log_options import LogOptions
from frictionlab.logs.cells import moment, number, plain
from frictionlab.logs.columns import LogColumn, columns_of
from frictionlab.logs.dialect import find_dialect
from frictionlab.logs.layouts.layout import Layout
from frictionlab.logs.layouts.preamble import believable
from frictionlab.logs.lines import Head
from frictionlab.units import known_unit

_END = "***End_of_Header***"
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}
_KEYS = frozenset(
    "LabVIEW Measurement|Writer_Version|Reader_Version|Separator|Decimal_Separator|Multi_Headings|X_Columns|Time_Pref|"
    "Operator|Description|Date|Time|Project|Channels|Samples|Y_Unit_Label|X_Unit_Label|X_Dimension|Y_Dimension|X0|"
    "Delta_X|Test_Name|Test_Numbers|Test_Series|UUT_M/N|UUT_S/N|UUT_Name|Model_Number|Serial_Number|Notes|X_Value|"
    f"{_END}".split("|")
)


def labview(head: Head, options: LogOptions) -> Layout | None:
    """Begins with ``LabVIEW Measurement`` or holds the end-of-header mark."""
    if not any(line.startswith((_END, "LabVIEW Measurement")) for line in head.lines[:100]):
        return None
    names = next((i for i, line in enumerate(head.lines) if _key(line) == "X_Value"), None)
    if names is None:
        return None
    said = {_key(line): line for line in head.lines[:names]}
    options = _as_stated(options, said)
    found = find_dialect(head.lines[names + 1 :], options, head.path.name)
    dialect = replace(found, first=found.first + names + 1)
    titles = [plain(c) for c in head.lines[names].split(dialect.separator)]
    units = [known_unit(c) for c in said.get("Y_Unit_Label", "").split(dialect.separator)[1:]]
    columns = _columns(titles, units, dialect.fields)
    return Layout(
        name="LabVIEW lvm",
        dialect=dialect,
        columns=columns,
        header=(names,),
        body=names + 1,
        facts=_facts(said, dialect.separator, dialect.decimal),
        time_of=_time_of(columns),
        is_header=lambda line: _key(line) in _KEYS,
        spare=1 if titles[-1:] == ["Comment"] and len(titles) > dialect.fields else 0,
        evidence=(f"the LabVIEW header states separator and decimal mark; line {names + 1} names the channels",),
    )


def _key(line: str) -> str:
    return line.replace(";", "\t").replace(",", "\t").partition("\t")[0].strip()


def _as_stated(options: LogOptions, said: Mapping[str, str]) -> LogOptions:
    separator = _SEPARATORS.get(said.get("Separator", "").removeprefix("Separator").strip("\t ,;").lower(), "\t")
    decimal = said.get("Decimal_Separator", "").removeprefix("Decimal_Separator").strip("\t ")
    stated = replace(options, separator=options.separator or separator)
    return replace(stated, decimal=options.decimal or (decimal if decimal in (".", ",") else None))


def _columns(titles: list[str], units: list[str], fields: int) -> tuple[LogColumn, ...]:
    """Channels have units in their order; each ``X_Value`` is time in seconds."""
    columns, left = [], list(units)
    for column in columns_of(titles, (), fields):
        if column.title == "X_Value":
            columns.append(replace(column, unit="s"))
        elif column.title == "Comment":
            columns.append(column)
        else:
            unit = left.pop(0) if left else ""
            columns.append(replace(column, unit=column.unit or unit))
    return tuple(columns)


def _time_of(columns: tuple[LogColumn, ...]) -> dict[int, int]:
    times = [c.index for c in columns if c.title == "X_Value"]
    if len(times) < 2:
        return {}
    return {c.index: max(t for t in times if t < c.index) for c in columns if c.index not in times}


def _facts(said: Mapping[str, str], separator: str, decimal: str) -> dict[str, float | str]:
    facts: dict[str, float | str] = {}
    cells = said.get("Delta_X", "").split(separator)[1:]
    steps = [n for c in cells if (n := number(c, decimal)) is not None and believable(n)]
    if steps:
        facts["interval_s"] = steps[0]
    date, time = (said.get(key, "").split(separator)[1:2] for key in ("Date", "Time"))
    if date and time and (start := moment(f"{plain(date[0])} {plain(time[0])}")) is not None:
        facts["start_s"] = start
    return facts
