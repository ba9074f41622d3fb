"""One home for every column; rows come back from files as they went in, and nobody's file is lost."""

import ast
import json
import math
import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.errors import UsageError
from frictionlab.scene.text import template
from frictionlab.schema import ENERGY, FRICTION, MEASUREMENTS, TABLES, Table, Type, column_of, is_marked, table_of
from frictionlab.tables import SUFFIXES, check_output, is_table, json_line, read_rows, write_rows
from tests.documents import KEYS as KEYS_FILE

TEXT_FILES = (".csv", ".jsonl")
ROW = {
    "source": "a b,c.h5",
    "status": "ok",
    "reason": None,
    "warnings": ["short: 3 cycles", 'a "quoted" one'],
    "material": "316",
    "cycles": 3,
    "energy_per_cycle": 2.12604226639334,
}
LETTERS = st.text(
    st.characters(codec="utf-8", exclude_categories=["Cc"], exclude_characters="\ufffe\uffff"), max_size=12
)


@pytest.mark.parametrize("table", TABLES, ids=lambda t: t.kind)
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_column_of_every_table_comes_back(tmp_path: Path, table: Table, suffix: str) -> None:
    """A text column that nobody listed would become NaN, or a number: here each is written and read."""
    value = {
        Type.NUMBER: 0.25, Type.WHOLE: 3, Type.YES_NO: True, Type.TEXT: "316", Type.SENTENCES: ["a", "b"],
        Type.OBJECT: {"beta": 0.4},
    }  # fmt: skip
    row = {column.name: value[column.type] for column in table.columns}
    path = tmp_path / "made on the way" / f"rows{suffix}"
    name = table.names[0]
    write_rows([row, {name: row[name]}], path, table)
    assert is_table(path, table)
    assert is_table(path)
    first, empty = read_rows(path, table)
    assert first == row
    assert list(first) == list(table.names)
    assert {key: value for key, value in empty.items() if value not in (None, [])} == {name: row[name]}


def test_a_column_of_the_users_own_keeps_its_kind(tmp_path: Path) -> None:
    rows = [{"source": "a", "batch": "7b", "grade": 3, "dose": 0.5}, {"source": "b", "batch": "nan", "grade": 4}]
    for suffix in SUFFIXES:
        path = tmp_path / f"rows{suffix}"
        write_rows(rows, path, MEASUREMENTS)
        first, second = read_rows(path)
        assert (first["batch"], first["grade"], first["dose"]) == ("7b", 3, 0.5)
        assert (second["batch"], second["grade"], second.get("dose")) == ("nan", 4, None)


@settings(max_examples=30, deadline=None)
@given(LETTERS, st.floats(allow_nan=False, allow_infinity=False))
def test_a_text_and_the_bits_of_a_number_come_back(
    tmp_path_factory: pytest.TempPathFactory, words: str, number: float
) -> None:
    for suffix in TEXT_FILES:
        path = tmp_path_factory.mktemp("text") / f"rows{suffix}"
        write_rows([{"source": words, "energy_per_cycle": number}], path)
        (row,) = read_rows(path)
        assert (row["source"] or "", row["energy_per_cycle"]) == (words, number)


@pytest.mark.parametrize("words", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "'=1", "''-2", "＝1+1"])
def test_no_text_goes_out_as_a_formula(tmp_path: Path, words: str) -> None:
    path = tmp_path / "rows.csv"
    write_rows([{"source": words, "normal_force_n": -1.5, words: words}], path)
    assert read_rows(path) == [{"source": words, "normal_force_n": -1.5, words: words}]
    table = pd.read_csv(path)
    assert [str(cell)[0] for cell in (table.columns[2], table.iloc[0, 0], table.iloc[0, 2])] == ["'"] * 3
    assert table.iloc[0, 1] == -1.5


def test_not_known_is_null_and_never_nan() -> None:
    row = {"a": math.nan, "b": [np.float64("inf")], "c": np.int64(3), "d": Path("x"), "e": {"f": (1.5, math.nan)}}
    assert json.loads(json_line(row)) == {"a": None, "b": [None], "c": 3, "d": "x", "e": {"f": [1.5, None]}}


@pytest.mark.parametrize(
    ("name", "match"),
    [
        ("rows.txt", r"ending in \.csv, \.jsonl or \.h5 .*; got \.txt"),
        ("rows.xlsx", r"a spreadsheet program opens \.csv\); got \.xlsx"),
        ("rows", "got no suffix"),
        ("file/rows.csv", "file is no folder"),
        ("folder.csv", "is a folder"),
    ],
)
def test_an_impossible_output_is_refused_before_the_work(tmp_path: Path, name: str, match: str) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(UsageError, match=match):
        check_output(tmp_path / name, MEASUREMENTS)


FOREIGN = {
    "raw log with a source column": ("a.csv", "source,time,mass\nlaser,0,1\n"),
    "sheet": ("a.csv", "log,material,normal_force_n\na.csv,steel,1.25\n"),
    "notes": ("b.jsonl", "notes\n"),
    "our columns in another order": ("a.csv", ",".join(reversed(MEASUREMENTS.names)) + "\n"),
    "another table of ours": ("a.csv", ",".join(FRICTION.names) + "\n"),
    "no HDF5": ("a.h5", "notes\n"),
}


@pytest.mark.parametrize("kind", FOREIGN)
def test_a_file_of_another_kind_is_replaced_only_by_force(tmp_path: Path, kind: str) -> None:
    name, text = FOREIGN[kind]
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(UsageError, match="is no table of measurements of frictionlab: choose another output, or give"):
        write_rows([ROW], path, MEASUREMENTS)
    assert path.read_text() == text
    row = {**dict.fromkeys(MEASUREMENTS.names), **ROW}
    write_rows([{"source": "a", "status": "failed", "reason": "empty"}], path, MEASUREMENTS, force=True)
    write_rows([row, row], path, MEASUREMENTS)  # its own kind, also where all have failed
    assert len(read_rows(path)) == 2


HEAD = "source,frequency_ratio\n"


@pytest.mark.parametrize(
    ("name", "text", "match"),
    [
        ("a.jsonl", "{\n", "line 1: expected a JSON object"),
        ("a.jsonl", "\n[1]\n", r"line 2: .* got '\[1\]'"),
        ("a.jsonl", '{"normal_force_n": ' + "9" * 400 + "}", "line 1: normal_force_n: expected a number"),
        ("a.jsonl", '{"normal_force_n": ' + "9" * 5000 + "}", "line 1: expected a JSON object"),
        ("a.jsonl", '{"normal_force_n": "much"}', r"expected a number, or nothing \(null, an empty cell\); got 'much'"),
        ("a.jsonl", '{"material": {"a": 1}}', "material: expected text"),
        ("a.csv", f"{HEAD}a.h5,1.5,9\n", "line 2: expected 2 cells as in the head; got 3"),
        (
            "a.csv",
            f"{HEAD}a.h5,much\n",
            r"line 2: frequency_ratio: expected a number, or nothing \(null, an empty cell\)",
        ),
        ("a.csv", f"{HEAD}a.h5,inf\n", "frequency_ratio: expected a number"),
        ("a.csv", f"{HEAD}a.h5,{'9' * 400}\n", "line 2: frequency_ratio: expected a number"),
        ("a.csv", f"{HEAD}{'x' * 200_000},1\n", "line 2: expected comma-separated cells; field larger"),
        ("a.csv", "source,source\n1,2\n", "line 1: expected each column once; got 'source' more than once"),
        ("nowhere.jsonl", None, r"nowhere\.jsonl: cannot be read"),
    ],
)
def test_a_table_that_is_damaged_is_refused_by_its_line(
    tmp_path: Path, name: str, text: str | None, match: str
) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(UsageError, match=match):
        read_rows(tmp_path / name, MEASUREMENTS)


def test_what_a_spreadsheet_program_leaves_behind_is_read(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    path.write_bytes("\ufeff,source,frequency_ratio,warnings\r\n0,a.h5,NaN,\r\n\r\n1,b\x00.h5, 0.5,a | b\r\n".encode())
    first, second = read_rows(path, MEASUREMENTS)
    assert first == {"source": "a.h5", "frequency_ratio": None, "warnings": []}
    assert second == {"source": "b\\x00.h5", "frequency_ratio": 0.5, "warnings": ["a", "b"]}


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_no_escape_sequence_of_a_terminal_reaches_a_file(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"rows{suffix}"
    name = os.fsdecode(b"steel\xff.h5")  # half of a surrogate pair
    write_rows([{"source": "a\x1b[31m\x07.h5", "material": "st\x9beel", "regime": name}], path, MEASUREMENTS)
    (row,) = read_rows(path)
    assert (row["source"], row["material"]) == ("a\\x1b[31m\\x07.h5", "st\\x9beel")
    assert row["regime"] == "steel\\udcff.h5"
    assert suffix not in TEXT_FILES or b"\x1b" not in path.read_bytes()


EACH = pytest.mark.parametrize("table", TABLES, ids=lambda t: t.kind)


@EACH
def test_a_table_names_and_describes_each_column_once_and_shows_some(table: Table) -> None:
    for words in (table.names, [c.title for c in table.columns], [c.head for c in table.columns]):
        assert len(set(words)) == len(words)

    for column in (*table.columns, *table.series):
        assert column.sentence[0] in "`(" or column.sentence[0].isupper()
        assert column.sentence.endswith((".", ")", ".)", "..."))
        assert len(column.title) <= 20

    assert set(table.shown) <= set(table.names)
    assert 4 <= table.lead <= len(table.columns)


def test_a_name_means_the_same_everywhere_and_says_its_unit() -> None:
    types: dict[str, set[Type]] = {}
    for column in (column for table in TABLES for column in table.columns):
        types.setdefault(column.name, set()).add(column.type)
    assert not {name for name, found in types.items() if len(found) > 1}
    ends = {"Hz": "_hz", "s": "_s", "m": "_m", "N": "_n", "J": "_j"}
    strangers = {"seconds", "wall_s"}
    for column in (column for table in TABLES for column in table.columns):
        name = column.error_of or column.name.removesuffix("_upper")
        if column.unit in ends and column.name not in strangers:
            assert name.endswith(ends[column.unit]), column.name


@EACH
def test_a_table_is_known_by_all_of_its_first_columns(table: Table) -> None:
    assert is_marked(table.names, table)
    assert not is_marked(table.names[1:], table)
    assert not is_marked(("log", *table.names), table)
    assert table_of(table.names) is table
    assert table_of((*reversed(table.names), "my own")) is table
    assert table_of(("log", "material", "normal_force_n", "source")) is None
    assert column_of("my own") is None


def test_the_list_of_keys_is_in_step() -> None:
    assert KEYS_FILE.read_text(encoding="utf-8") == template(), "run: python -m tests.documents"


def test_a_column_is_renamed_in_the_schema_alone() -> None:
    """Elsewhere its name stands for attributes of results, which stay: repeated in a comparison, and of a contact."""
    package = Path(__file__).parents[1] / "frictionlab"
    attributes = {"inference/compare.py", "simulator/state.py"}
    naming = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        if ENERGY in node.value and not set(" \n") & set(node.value)
    }
    assert naming == {"schema/__init__.py", *attributes}
