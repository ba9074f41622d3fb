"""Tables for people: every digit whole at any width, units in heads, and what is left out is said."""

import contextlib
import csv
import io
import os
import re
from pathlib import Path
from unittest import mock

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.cli.screen import cell, print_table
from frictionlab.cli.show import show
from frictionlab.schema import COMPARISONS, FRICTION, MEASUREMENTS, TABLES, Table
from frictionlab.tables import Row, write_rows
from tests.desk import invoke

LONG = "build/recordings/a long folder/aramid_N1.25_r0.3.h5"
MEASURED: Row = {
    "source": LONG, "status": "ok", "frequency_ratio": 0.312345, "energy_per_cycle": 0.7233431, "regime": "stick-slip",
    "energy_per_cycle_se": 7.74368e-06, "response_amplitude": 1.32878e-05, "irregularity_index": 0.000115912,
    "stops_per_cycle": 2.0,
}  # fmt: skip
COMPARED: Row = {
    **MEASURED, "friction_ratio": 0.204082, "friction_ratio_se": 7.74368e-06, "predicted_energy_per_cycle": 0.723332,
    "response_nrmse": 0.000115912, "friction_force_n": 0.437509, "friction_coefficient": 0.350007,
    "predicted_stops_per_cycle": 2.0,
}  # fmt: skip


class Terminal(io.StringIO):
    """What a terminal of so many columns gets."""

    def isatty(self) -> bool:
        return True


def printed(width: int, rows: list[Row], columns: Table | list[str]) -> str:
    """What stands on a terminal of this width, without its bold letters; of width 0, what goes into a pipe."""
    stream = Terminal() if width else io.StringIO()
    with mock.patch.dict(os.environ, {"COLUMNS": str(width), "NO_COLOR": "1"}), contextlib.redirect_stdout(stream):
        print_table(rows, columns)
    return re.sub("\x1b\\[[0-9;]*m", "", stream.getvalue())


def numbers_of(rows: list[Row], names: tuple[str, ...]) -> set[str]:
    return {cell(row[name]) for row in rows for name in names if isinstance(row.get(name), float)}


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.lists(st.floats(allow_nan=False) | st.text("abc /", max_size=40), min_size=4, max_size=4), min_size=1),
    st.integers(30, 120),
)
def test_any_table_is_whole_at_any_width(body: list[list[object]], width: int) -> None:
    heads = tuple(f"head {i} [kY²]" for i in range(4))
    rows: list[Row] = [dict(zip(heads, line, strict=True)) for line in body]
    text = printed(width, rows, list(heads))
    assert not [number for number in numbers_of(rows, heads) if number not in text]


def test_what_is_too_wide_stands_in_blocks_and_a_pipe_gets_lines() -> None:
    lines = printed(80, [COMPARED] * 9, COMPARISONS).splitlines()
    assert [line.split()[0] for line in lines if line][::10] == ["source"] * (lines.count("") + 1)
    head, first, *_ = printed(0, [COMPARED] * 9, COMPARISONS).splitlines()
    assert "friction [N]  coefficient" in head
    assert head.endswith("stops  predicted stops  regime")
    assert LONG in first
    assert "coefficient" not in printed(0, [{**COMPARED, "friction_coefficient": None}], COMPARISONS)


def shown(path: Path) -> list[list[str]]:
    done = invoke("show", path)
    assert done.exit_code == 0, done.output
    return [line.split() for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    ("table", "suffix"), [*((table, ".csv") for table in TABLES), *((FRICTION, s) for s in (".jsonl", ".xlsx", ".h5"))]
)
def test_show_has_a_value_for_every_column_it_prints(tmp_path: Path, table: Table, suffix: str) -> None:
    """`friction.csv` was shown as dashes: its kind was guessed from one key."""
    row = {c.name: 0.5 if c.type.is_number else "word" if c.type.value == "text" else None for c in table.columns}
    path = tmp_path / f"table{suffix}"
    write_rows([row], path, table)
    told = shown(path)[1]
    assert sum(word in ("0.5", "word") for word in told) >= len(table.shown) - 2


def test_show_tells_rows_of_a_users_own_table_and_failures(tmp_path: Path) -> None:
    path = tmp_path / "mine.csv"
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([["log", "dose"], ["a.csv", "0.5"]])
    assert shown(path) == [["log", "dose"], ["a.csv", "0.5"]]
    write_rows([{"source": "a", "status": "failed", "reason": "empty"}], tmp_path / "f.jsonl", MEASUREMENTS)
    assert ["a:", "failed:", "empty"] in shown(tmp_path / "f.jsonl")
    (tmp_path / "no.csv").write_text("a,b\n1,2,3\n")
    assert "`frictionlab ingest --dry-run " in invoke("show", tmp_path / "no.csv").stderr


def test_show_says_what_is_in_a_log_of_any_encoding_and_cuts_a_long_table_that_is_none(tmp_path: Path) -> None:
    rows = "".join(f"{i / 100},{i % 7},{i % 5}\n" for i in range(500))
    (tmp_path / "log.csv").write_bytes(f"time [s],mass [µm],base [µm]\n{rows}".encode("latin-1"))
    lines = shown(tmp_path / "log.csv")
    assert lines[:2] == [["a", "log"], ["test", "layout", "samples", "rate", "[Hz]", "length", "[s]"]]
    (tmp_path / "mine.csv").write_text("dose,colour\n" + "1,a\n" * 500)
    assert len(shown(tmp_path / "mine.csv")) == 102


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_show_waits_for_no_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    done = invoke("show", tmp_path / "pipe.csv")
    assert done.exit_code == 2
    assert "expected a file; got a folder or a device" in done.stderr


def test_show_does_not_roll_thousands_of_rows_over_a_terminal(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    write_rows([{"source": f"{n}.h5", "energy_per_cycle": 1.0} for n in range(1000)], path, MEASUREMENTS)
    stream = Terminal()
    with mock.patch.dict(os.environ, {"COLUMNS": "80", "NO_COLOR": "1"}), contextlib.redirect_stdout(stream):
        show(path)
    assert len(stream.getvalue().splitlines()) < 110
    assert "the first 100 of 1000 rows; a pipe has all" in stream.getvalue()
    assert len(shown(path)) == 1001
