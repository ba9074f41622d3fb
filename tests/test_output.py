"""Tables for people, every digit whole at any width; the loop over inputs, whatever one of them raises."""

import contextlib
import csv
import io
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.cli import screen
from frictionlab.cli.show import show
from frictionlab.errors import LogError, UsageError
from frictionlab.inference.material_law import example_law
from frictionlab.schema import COMPARISONS, FRICTION, MEASUREMENTS, TABLES, Table
from frictionlab.tables import Row, write_rows
from frictionlab.units import split_unit
from frictionlab.verbs.inputs import row_of, rows_of
from tests.desk import BIN, SAMPLE, SCENE, invoke, log_of

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


def printed(width: int, rows: list[Row], columns: Table | list[str]) -> str:
    """What stands on a terminal of this width."""
    stream = io.StringIO()
    with mock.patch.dict(os.environ, {"COLUMNS": str(width)}), contextlib.redirect_stdout(stream):
        screen.print_table(rows, columns if isinstance(columns, Table) else {name: name for name in columns})
    return stream.getvalue()


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.lists(st.floats(allow_nan=False) | st.text("abc /", max_size=40), min_size=4, max_size=4), min_size=1),
    st.integers(30, 120),
)
def test_any_table_is_whole_at_any_width(body: list[list[object]], width: int) -> None:
    heads = tuple(f"head {i} [kY²]" for i in range(4))
    rows: list[Row] = [dict(zip(heads, line, strict=True)) for line in body]
    text = printed(width, rows, list(heads))
    numbers = {screen.cell(row[name]) for row in rows for name in heads if isinstance(row.get(name), float)}
    assert not [number for number in numbers if number not in text]


def test_what_is_too_wide_stands_in_blocks() -> None:
    lines = printed(80, [COMPARED] * 9, COMPARISONS).splitlines()
    assert [line.split()[0] for line in lines if line][::10] == ["source"] * (lines.count("") + 1)
    head, first, *_ = printed(1000, [COMPARED] * 9, COMPARISONS).splitlines()
    assert "friction [N]  coefficient" in head
    assert head.endswith("stops  predicted stops  regime")
    assert Path(LONG).stem in first
    assert "coefficient" not in printed(1000, [{**COMPARED, "friction_coefficient": None}], COMPARISONS)
    laws: list[Row] = [{"material": "steel", "law": law, "nrmse": "0.1", "evidence": "many letters"} for law in "ab"]
    again = printed(30, laws, ["material", "law", "nrmse", "evidence"]).splitlines()[4:]
    assert [line.split()[:2] for line in again] == [["material", "law"], ["steel", "a"], ["steel", "b"]]


def shown(path: Path) -> list[list[str]]:
    done = invoke("show", path, status=0)
    return [line.split() for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    ("table", "suffix"), [*((table, ".csv") for table in TABLES), *((FRICTION, s) for s in (".jsonl", ".h5"))]
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


def test_show_sends_a_log_to_ingest_and_cuts_a_long_table_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_bytes("time [s],mass [µm],base [µm]\n0.1,2,3\n".encode("latin-1"))
    (tmp_path / "log.txt").write_text("1 2 3\n")
    for name in ("log.csv", "log.txt"):
        assert f"says `frictionlab ingest --dry-run {tmp_path / name}`" in invoke("show", tmp_path / name).stderr
    (tmp_path / "mine.csv").write_text("dose,colour\n" + "1,a\n" * 500)
    assert len(shown(tmp_path / "mine.csv")) == 102


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_show_waits_for_no_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    assert "expected a file; got a folder or a device" in invoke("show", tmp_path / "pipe.csv", status=2).stderr


def test_show_does_not_roll_thousands_of_rows_over_a_terminal(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    write_rows([{"source": f"{n}.h5", "energy_per_cycle": 1.0} for n in range(1000)], path, MEASUREMENTS)
    stream = io.StringIO()
    with mock.patch.object(stream, "isatty", return_value=True), contextlib.redirect_stdout(stream):
        show(path)
    assert len(stream.getvalue().splitlines()) < 110
    assert "the first 100 of 1000 rows; a pipe has all" in stream.getvalue()
    assert len(shown(path)) == 1001


def job(error: Exception | None, bad: str, path: Path) -> Row:
    if error is not None and path.name == bad:
        raise error
    return {"source": str(path), "status": "ok", "warnings": ["short"]}


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (LogError("b: line 3 is damaged"), "line 3 is damaged"),
        (FileNotFoundError(2, "No such file or directory"), "No such file or directory"),
        (MemoryError(), "not enough memory"),
        (KeyError("µs"), "a fault of the program, not of the input: KeyError: 'µs': please report it"),
        (RecursionError(), "RecursionError"),
        (UnicodeEncodeError("utf-8", "\udcff", 0, 1, "surrogates"), "UnicodeEncodeError"),
        (ZeroDivisionError("division by zero"), "ZeroDivisionError: division by zero"),
    ],
)
def test_whatever_one_input_raises_the_others_go_on(error: Exception, reason: str) -> None:
    rows = list(rows_of([Path("a"), Path("b"), Path("c")], partial(job, error, "b")))
    assert [row["status"] for row in rows] == ["ok", "failed", "ok"]
    assert set(rows[1]) == {"source", "status", "reason"}
    assert reason in str(rows[1]["reason"])


def test_a_fault_of_the_program_says_where_it_is_and_one_of_the_command_line_concerns_all() -> None:
    row = row_of(lambda path: {"unit": split_unit(path)}, Path("a"), folder=None)  # type: ignore[arg-type]
    assert "AttributeError" in str(row["reason"])
    assert "(frictionlab/units.py, line " in str(row["reason"])
    with pytest.raises(UsageError, match="no such column"):
        list(rows_of([Path("a")], partial(job, UsageError("no such column"), "a")))


def test_warnings_are_printed_once_for_each_cause_and_grave_ones_first(capsys: pytest.CaptureFixture[str]) -> None:
    rows: list[Row] = [{"source": f"{n}.h5", "status": "ok", "warnings": [f"short: {n} s", "hum"]} for n in range(3)]
    rows[1]["warnings"] = ["short: 1 s", "not settled: at 3 s"]  # type: ignore[index]
    screen.print_warnings(rows, notes=["a note"])
    assert capsys.readouterr().err.splitlines() == [
        "warning (1): not settled: at 3 s",
        "warning (3 tests): short: 0 ... 2 s",
        "warning (2 tests): hum",
        "note: a note",
    ]
    screen.print_warnings([{"warnings": [f"cause {'x' * n}" for n in range(30)]}])
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 10
    assert lines[-1] == "... 21 more lines of warnings: -v shows them, --json has them"
    screen.print_warnings([{"warnings": [f"cause {'x' * n}" for n in range(30)]}], verbose=True)
    assert len(capsys.readouterr().err.splitlines()) == 30


def test_the_table_has_one_line_a_test_and_failures_among_them(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    good: Row = {
        "source": "logs/steel_250g.h5", "status": "ok", "frequency_ratio": 0.32, "energy_per_cycle": 1.2,
        "energy_per_cycle_u": 0.005, "energy_per_cycle_j": 4.4712e-3, "energy_per_cycle_j_u": 1.9e-5,
        "stops_per_cycle": 2.0, "regime": "stuck",
    }  # fmt: skip
    bad: Row = {"source": "logs/b\x1b[31m.csv", "status": "failed", "reason": "empty \x1b[2J" + " and long" * 20}
    screen.print_tests([good, bad], screen.MEASURED, "1 of 2 recordings")
    out = capsys.readouterr().out
    lines = out.splitlines()
    assert lines[0] == "1 of 2 recordings"
    assert lines[2].split() == ["steel_250g", "0.320", "4.471", "±", "0.019", "2", "stuck"]
    assert lines[3].startswith("b\\x1b[31m.csv  failed: empty \\x1b[2J and long")
    assert max(map(len, lines)) <= 80
    law = {"status": "ok", "law": "coulomb+place+speed+breakaway", "verdict": "strained", "friction_coefficient": 0.31}
    judged: Row = {**good, **law, "friction_coefficient_u": 0.03, "friction_force_n": 0.77, "friction_ratio": 0.2}
    screen.print_tests([judged], screen.COMPARED, "1 of 1 logs, law coulomb+place+speed+breakaway")
    assert capsys.readouterr().out.splitlines()[1].split()[-3:] == ["[N]", "mu", "verdict"]
    screen.print_tests([judged, {**judged, "law": "coulomb"}], screen.COMPARED, "2 of 2 logs")
    head, line, *_ = capsys.readouterr().out.splitlines()[1:]
    assert len(line) <= 80
    assert head.split()[-3:] == ["mu", "law", "verdict"]
    assert "coulomb+place+speed+breakaway" in line
    for size in range(30):  # the title of the first column is wider than these names
        screen.print_tests([{**judged, "source": "x.h5", "law": size * "c"}], screen.COMPARED, "1 of 1 logs")
        assert "verdict" in capsys.readouterr().out.splitlines()[1]
    screen.print_tests([bad], screen.MEASURED, "0 of 1")
    told = capsys.readouterr()
    assert (told.out, told.err.count("frictionlab: ")) == ("", 1)


SCREENS = """
analyze LOG | analyze LOG ON --wide --budget | compare-numeric LOG ON --law auto --wide | explain LOG ON --wide
ingest LOG ON -o new.h5 | ingest LOG ON --dry-run | init new | init logs | batch logs ON --campaign | show rig.toml
simulate --r 0.3 --beta 0.6 --all | simulate --base-motion LOG --natural-frequency 3.13 --beta 0.2 | laws lugre
sweep --r 0.5,0.7 --beta 0.1 -o map.csv | show map.csv | plan --scene rig.toml --tests 2 -o tests.csv | show law.toml
predict --law-file law.toml --r 0.3,0.5 | analyze none.h5 | free-vibration tap.csv | tradeoff --help-all
"""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what a person may have on a bench: logs, taps, a rig, results."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "logs").mkdir()
    for n in range(2):
        (folder / "logs" / f"steel_N1.25_r0.{3 + n}_a_long_name_that_says_all.csv").write_bytes(SAMPLE.read_bytes())
    t = np.arange(0.0, 12.0, 0.004)
    taps = sum(2e-3 * np.exp(-0.2 * s) * np.cos(19.6 * s) * (s >= 0) for s in (t - 1.0, t - 7.0))
    log_of(folder / "tap.csv", {"time [s]": t, "mass [m]": np.asarray(taps)})
    plan = "[plan]\nnormal_forces_n = [1.25, 2.5]\nfrequency_ratios = [0.3, 0.5]\n"
    (folder / "rig.toml").write_text(SCENE.read_text(encoding="utf-8") + plan, encoding="utf-8")
    (folder / "law.toml").write_text(example_law().text(), encoding="utf-8")
    return folder


@pytest.mark.parametrize("line", [line.strip() for line in re.split(r"[|\n]", SCREENS.strip())])
def test_no_line_is_wider_than_a_screen_but_for_a_path(line: str, bench: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(bench)
    known: dict[str, list[object]] = {"LOG": [SAMPLE], "ON": ["--scene", SCENE]}
    done = invoke(*(word for each in line.split() for word in known.get(each, [each])), env={"COLUMNS": "80"})
    wide = [line for line in done.output.splitlines() if len(line) > 80]
    assert not [line for line in wide if len(line.split()[-1]) < 60], done.output


Run = Callable[..., "subprocess.CompletedProcess[bytes]"]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    def command(*words: str | Path, **options: object) -> "subprocess.CompletedProcess[bytes]":
        line = [BIN / "frictionlab", *words]
        how = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
        return subprocess.run(line, check=False, cwd=tmp_path, timeout=100, **how)  # type: ignore[call-overload, no-any-return]

    return command


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("words", [("ingest", SAMPLE, "-o", "a.h5", "--json"), ("show", SCENE), ("--help",)])
def test_a_full_standard_output_is_one_line_and_the_file_is_written(
    run: Run, tmp_path: Path, words: tuple[str | Path, ...]
) -> None:
    with Path("/dev/full").open("wb") as full:
        done = run(*words, stdout=full)
    (said,) = done.stderr.decode().splitlines()
    assert done.returncode == 1
    assert said.startswith("frictionlab: standard output: No space left on device")
    assert (tmp_path / "a.h5").exists() == ("ingest" in words)


@pytest.mark.parametrize("closed", [">&-", "2>&-"])
def test_closed_streams_are_no_fault(closed: str) -> None:
    script = f'"$0" analyze "$1" --scene "$2" --json {closed}'
    line: list[str | Path] = ["bash", "-c", script, BIN / "frictionlab", SAMPLE, SCENE]
    done = subprocess.run(line, check=False, capture_output=True, timeout=100)
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False), done.stderr


def test_a_reader_that_has_left_is_no_fault_to_speak_of(run: Run) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = run("show", SCENE, stdout=writing)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")  # as the shell tells a program that such a pipe ended


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_messages_that_cannot_be_told_are_lost_and_nothing_else(run: Run) -> None:
    """Results and exit status are those of a standard error that takes all."""
    with Path("/dev/full").open("wb") as full:
        good = run("analyze", SAMPLE, "--scene", SCENE, "--natural-frequency", "0.1", "--json", stderr=full)
        bad = run("analyze", "none.csv", stderr=full)
        wrong = run("analyze", "--nothing", stderr=full)
    assert (good.returncode, bad.returncode, wrong.returncode) == (0, 1, 2)
    assert json.loads(good.stdout)["warnings"]


@pytest.mark.skipif(sys.platform != "linux", reason="file names are bytes on Linux alone")
def test_a_file_name_that_is_no_text_is_read_and_told(run: Run, tmp_path: Path) -> None:
    name = os.fsdecode(b"st\xfchl_N1.25_r0.3.csv")
    (tmp_path / name).write_bytes(SAMPLE.read_bytes())
    (tmp_path / os.fsdecode(b"b\xe4d.csv")).write_text("nothing")
    logs = sorted(tmp_path.glob("*.csv"))
    done = run("ingest", *logs, "--scene", SCENE, "-o", tmp_path / "out")
    assert done.returncode == 1
    assert b"b\\udce4d" in done.stdout
    assert b"st\\udcfchl_N1.25_r0.3" in done.stdout
    recording = tmp_path / "out" / os.fsdecode(b"st\xfchl_N1.25_r0.3.h5")
    assert recording.exists()
    for end in ("csv", "h5"):
        told = run("analyze", recording, "--scene", SCENE, "-o", tmp_path / f"rows.{end}", "--json")
        assert told.returncode == 0, told.stderr
        assert json.loads(told.stdout)["source"] == str(recording)
    assert "udcfchl" in (tmp_path / "rows.csv").read_text(encoding="utf-8")
