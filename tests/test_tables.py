"""Rows come back from files as they went in, and what is not known never becomes a number."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab.errors import UsageError
from frictionlab.tables import json_line, read_rows, write_rows

ROW = {
    "source": "a b,c.h5",
    "status": "ok",
    "reason": None,
    "warnings": ["short: 3 cycles", 'a "quoted" one'],
    "material": "316",
    "cycles": 3,
    "energy_per_cycle": 2.12604226639334,
    "symmetric": True,
}


@pytest.mark.parametrize("suffix", [".csv", ".jsonl"])
def test_rows_come_back(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"rows{suffix}"
    write_rows([ROW, ROW], path)
    assert read_rows(path) == [ROW, ROW]


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_in_a_csv_keeps_its_bits(tmp_path_factory: pytest.TempPathFactory, number: float) -> None:
    path = tmp_path_factory.mktemp("csv") / "rows.csv"
    write_rows([{"energy_per_cycle": number}], path)
    back = read_rows(path)[0]["energy_per_cycle"]
    assert back == number


def test_not_known_is_null_and_never_nan() -> None:
    row = {"a": math.nan, "b": [np.float64("inf")], "c": np.int64(3), "d": Path("x"), "e": {"f": (1.5, math.nan)}}
    assert json.loads(json_line(row)) == {"a": None, "b": [None], "c": 3, "d": "x", "e": {"f": [1.5, None]}}


def test_a_missing_key_is_an_empty_cell(tmp_path: Path) -> None:
    write_rows([{"source": "a"}, {"source": "b", "r": 0.5}], tmp_path / "rows.csv")
    assert read_rows(tmp_path / "rows.csv") == [{"source": "a", "r": None}, {"source": "b", "r": 0.5}]


@pytest.mark.parametrize(
    ("name", "match"),
    [("rows.xlsx", r"ending in \.csv or \.jsonl; got '\.xlsx'"), ("no/rows.csv", "there is no folder")],
)
def test_an_impossible_output_is_refused(tmp_path: Path, name: str, match: str) -> None:
    with pytest.raises(UsageError, match=match):
        write_rows([ROW], tmp_path / name)


@pytest.mark.parametrize(
    ("name", "text"), [("a.csv", "time,mass\n0,1\n"), ("a.jsonl", "[1]\n"), ("b.jsonl", "notes\n")]
)
def test_a_file_of_another_kind_is_replaced_only_by_force(tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(UsageError, match="is no table of frictionlab: choose another output, or give --force"):
        write_rows([ROW], path)
    assert path.read_text() == text
    write_rows([ROW], path, force=True)
    write_rows([ROW, ROW], path)
    assert read_rows(path) == [ROW, ROW]


@pytest.mark.parametrize(
    ("text", "match"), [("{\n", "line 1: expected a JSON object"), ("\n[1]\n", r"line 2: .* got '\[1\]'")]
)
def test_a_damaged_result_is_refused_with_its_line(tmp_path: Path, text: str, match: str) -> None:
    path = tmp_path / "rows.jsonl"
    path.write_text(text)
    with pytest.raises(UsageError, match=match):
        read_rows(path)


def test_a_missing_result_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"nowhere\.jsonl: cannot be read"):
        read_rows(tmp_path / "nowhere.jsonl")
