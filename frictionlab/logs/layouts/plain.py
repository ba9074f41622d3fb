"""Plain text in columns: a header of names with or without units, comments, whatever separator and decimal mark."""

from frictionlab.errors import LogError
from frictionlab.logs.columns import columns_of, roles_named
from frictionlab.logs.dialect import Dialect, find_dialect, split
from frictionlab.logs.layouts.header import Header, find_header, repeats
from frictionlab.logs.layouts.layout import Layout
from frictionlab.logs.layouts.preamble import stated_facts
from frictionlab.logs.lines import Head
from frictionlab.logs.options import LogOptions


def recognise(head: Head, options: LogOptions) -> Layout | None:
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
