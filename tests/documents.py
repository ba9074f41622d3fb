"""Files made from the program: ``python -m tests.documents`` writes them, a test compares."""

import csv
import io
from pathlib import Path

from frictionlab.scene.text import template
from frictionlab.schema import TABLES

ROOT = Path(__file__).parents[1]


def columns_csv() -> str:
    """Every column of every table: its table, name, unit, type and sentence; series stand behind rows, in HDF5."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(("table", "column", "unit", "type", "what it is"))
    for table in TABLES:
        writer.writerow((table.kind, "", "", "", table.sentence))
        for column in (*table.columns, *table.series):
            writer.writerow((table.kind, column.name, column.unit, column.type.value, column.sentence))
    return file.getvalue()


MADE = {ROOT / "frictionlab" / "schema" / "columns.csv": columns_csv, ROOT / "configs" / "all_keys.toml": template}

if __name__ == "__main__":
    for document, text in MADE.items():
        document.write_text(text(), encoding="utf-8", newline="\n")
