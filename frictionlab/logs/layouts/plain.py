"""Text in columns, and the layouts that are it with a sign of their own.

- plain: a header of names with or without units, comments, whatever separator and decimal mark
- units row: a row of units below the names (oscilloscopes, servo drives, many loggers)
- PicoScope: ``Time,Channel A`` / ``(ms),(V)`` / a blank line; over-range is the infinity sign
- catman ASCII (HBM): TAB, decimal comma, dozens of header lines; names and units stand among other rows
- sensorTOOL (Micro-Epsilon optoNCDT): one file per sensor, six lines of preamble, padded names; of the two time columns
  the epoch time is taken: it is a number, and it is what two sensors' files have in common
"""

import re
from dataclasses import replace

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.columns import columns_of, roles_named
from frictionlab.logs.dialect import Dialect, find_dialect, split
from frictionlab.logs.layouts.layout import Header, Layout, find_header, repeats
from frictionlab.logs.layouts.preamble import as_time, start_in_name, stated_facts
from frictionlab.logs.lines import Head

_BRACKETED = re.compile(r'\s*"?\([^()]*\)"?(\s*[,;\t]\s*"?\([^()]*\)"?)+\s*')
_MANY = 8


def optoncdt(head: Head, options: LogOptions) -> Layout | None:
    """A column of epoch time beside a column of distance."""
    if not any("epoch time" in line.lower() and "distance" in line.lower() for line in head.lines[:200]):
        return None
    dialect = find_dialect(head.lines, options, head.path.name)
    layout = layout_of("optoNCDT sensorTOOL", head, dialect, find_header(head.lines, dialect))
    epoch = [c.index for c in layout.columns if c.name.lower().startswith("epoch")]
    if len(epoch) != 1 or dialect.kinds[epoch[0]] != "n":
        return layout
    evidence = ["columns of epoch time and distance"]
    start = start_in_name(head.path)
    if start is not None:
        evidence.append(f"the file's name says it began at {as_time(start)}")
    return replace(layout, prefer={"time": epoch[0]}, evidence=(*evidence, *layout.evidence))


def picoscope(head: Head, options: LogOptions) -> Layout | None:
    """Units in brackets on line 2, then a blank line."""
    if len(head.lines) < 4 or not _BRACKETED.fullmatch(head.lines[1]) or head.lines[2].strip():
        return None
    if not head.lines[0].lower().lstrip('"').startswith("time"):
        return None
    dialect = find_dialect(head.lines, options, head.path.name)
    layout = layout_of("PicoScope", head, dialect, find_header(head.lines, dialect))
    return replace(layout, evidence=("line 1 names channels, line 2 holds units in brackets, line 3 is blank",))


def catman(head: Head, options: LogOptions) -> Layout | None:
    """The word catman in the first lines, or many rows of words as wide as the data above tabbed numbers."""
    dialect = find_dialect(head.lines, options, head.path.name)
    above = head.lines[: dialect.first]
    named = any("catman" in line.lower() for line in above)
    wide = sum(line.count("\t") == dialect.fields - 1 for line in above)
    if not named and not (dialect.separator == "\t" and dialect.fields > 1 and wide >= _MANY):
        return None
    layout = layout_of("catman ASCII", head, dialect, find_header(head.lines, dialect, deep=True))
    said = "the header names catman" if named else f"{wide} header rows as wide as the data"
    return replace(layout, evidence=(said, *layout.evidence))


def units_row(head: Head, options: LogOptions) -> Layout | None:
    """A row as wide as the data that holds nothing but units."""
    dialect = find_dialect(head.lines, options, head.path.name)
    header = find_header(head.lines, dialect)
    return layout_of("units-row", head, dialect, header) if header.units else None


def plain(head: Head, options: LogOptions) -> Layout | None:
    """Read any log that has lines of numbers; the last resort, so it raises where nothing is found."""
    dialect = find_dialect(head.lines, options, head.path.name)
    header = find_header(head.lines, dialect)
    if not header.titles and (options.mass is None or options.base is None):
        _check_names(head, dialect)
    return layout_of("plain", head, dialect, header)


def _check_names(head: Head, dialect: Dialect) -> None:
    """Refuse names that do not fit the numbers below them: most often decimal commas separated by commas."""
    above = [(i, line) for i, line in enumerate(head.lines[: dialect.first]) if line.strip()]
    names = split(above[-1][1], dialect.separator) if above else []
    if roles_named(names) > 1 and len(names) != dialect.fields:
        raise LogError(
            f"{head.path.name}: line {above[-1][0] + 1} names {len(names)} columns, the lines below have "
            f"{dialect.fields} fields: are these decimal commas separated by commas? Export with another separator, or "
            "give --time, --mass and --base by number"
        )


def layout_of(name: str, head: Head, dialect: Dialect, header: Header) -> Layout:
    """Put dialect and header together; other layouts start from this and say what they know better."""
    units = "with a units row" if header.units else "without units row"
    named = f"line {header.lines[0] + 1} names the columns, {units}" if header.titles else "no line names the columns"
    return Layout(
        name=name,
        dialect=dialect,
        columns=columns_of(header.titles, header.units, dialect.fields),
        header=header.lines,
        body=header.body,
        facts=stated_facts(head.lines[: header.body], dialect.decimal),
        is_header=repeats(head.lines, header.lines),
        evidence=(named,),
    )
