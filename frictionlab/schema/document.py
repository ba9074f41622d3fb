"""The list of all columns as Markdown, in this folder's README: made from the schema, checked by a test."""

from pathlib import Path

from frictionlab.schema import TABLES, Column, Table

README = Path(__file__).with_name("README.md")
BEGIN, END = "<!-- columns: made from the schema -->", "<!-- end of columns -->"


def columns_as_markdown() -> str:
    """One section per table, one line per column."""
    return "\n".join(["", *(line for table in TABLES for line in _section(table))])


def _section(table: Table) -> list[str]:
    heads = ["| column | type | unit | what it is |", "|---|---|---|---|"]
    series = ["", "Behind the rows, in HDF5:", "", *heads, *map(_line, table.series)] if table.series else []
    return [f"## {table.kind}", "", table.sentence, "", *heads, *_lines(table), *series, ""]


def _lines(table: Table) -> list[str]:
    return [_line(column, is_mark=number < table.lead) for number, column in enumerate(table.columns)]


def _line(column: Column, *, is_mark: bool = False) -> str:
    name = f"**`{column.name}`**" if is_mark else f"`{column.name}`"
    return f"| {name} | {column.type.value} | {column.unit} | {column.sentence} |"


def write() -> None:
    """Put the list into the README, between its two marks."""
    before, _, rest = README.read_text(encoding="utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    README.write_text(f"{before}{BEGIN}\n{columns_as_markdown()}{END}{after}", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    write()
