"""Lists in the documents that are made from the program: ``python -m tests.documents`` writes them, tests compare."""

from collections.abc import Iterator
from pathlib import Path

from frictionlab.scene.text import tables_of_keys, value_text
from frictionlab.schema import TABLES, Table
from frictionlab.schema.column_list import GROUPS, Column

ROOT = Path(__file__).parents[1]
BEGIN, END = "<!-- made from the program: python -m tests.documents -->", "<!-- end -->"


def column_list() -> str:
    """The columns of all tables with their sentences, then which stand in which table."""
    lines = ["|column|unit|what it is|", "|---|---|---|"]
    lines += [_line(column) for group in GROUPS for column in group]
    return "\n".join([*lines, "", *(line for table in TABLES for line in _table(table))])


def _line(column: Column) -> str:
    return f"|`{column.name}`|{column.unit or ('' if column.type.is_number else column.type.value)}|{column.sentence}|"


def _table(table: Table) -> Iterator[str]:
    mark, others = table.names[: table.lead], table.names[table.lead :]
    own = [c for c in (*table.columns, *table.series) if not c.error_of and not any(c in group for group in GROUPS)]
    yield f"**{table.kind}**: {table.sentence} **`{' '.join(mark)}`** `{' '.join(others)}`" + (
        f"; in HDF5 `{' '.join(c.name for c in table.series)}`" if table.series else ""
    )
    yield from (f"- here `{column.name}`: {column.sentence}" for column in own)
    yield ""


def key_list() -> str:
    """The keys of all tables of a scene with their defaults and sentences."""
    lines = ["|key|default|meaning|", "|---|---|---|"]
    for table in tables_of_keys():
        lines.append(f"|**`{table.head}`**||{_cell(table.words)}|")
        lines += [f"|`{key.name}`|{_default(key)}|{_cell(key.words)}|" for key in table.keys]
    return "\n".join([*lines, ""])


def _default(key: object) -> str:
    needed, default = getattr(key, "needed", False), getattr(key, "default", None)
    return "needed" if needed else "" if default is None else f"`{value_text(default)}`"


def _cell(words: str) -> str:
    return words.replace("|", "\\|")


LISTS = {ROOT / "frictionlab" / "schema" / "README.md": column_list, ROOT / "configs" / "README.md": key_list}


def written(path: Path) -> str:
    """A document with its list made anew."""
    before, _, rest = path.read_text(encoding="utf-8").partition(BEGIN)
    return f"{before}{BEGIN}\n\n{LISTS[path]()}\n{END}{rest.partition(END)[2]}"


if __name__ == "__main__":
    for document in LISTS:
        document.write_text(written(document), encoding="utf-8", newline="\n")
