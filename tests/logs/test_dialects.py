"""Every dialect gives back the numbers that were written, bit for bit, and says what it found."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.errors import LogError
from frictionlab.logs import LogOptions, read_log, read_mass_log
from frictionlab.logs.columns import LogColumn
from frictionlab.logs.dialect import LogLayout
from frictionlab.logs.table import Body, Reader
from tests.logs.samples import CLEAN, Truth, assert_is, comma, ni, table, truth, write

DATA = truth()


@pytest.mark.parametrize("name", CLEAN)
def test_a_clean_log_gives_back_its_numbers(name: str, tmp_path: Path) -> None:
    make, encoding, layout = CLEAN[name]
    recording = read_log(write(tmp_path / "log.csv", make(DATA), encoding))
    assert_is(recording, DATA)
    assert recording.source.dialect["layout"] == layout
    assert recording.source.lines.data == len(DATA.rows)
    assert not recording.source.quarantined


def test_ni_channels_with_clocks_of_their_own_are_put_on_one(tmp_path: Path) -> None:
    text = ni(DATA)
    rows = text.split("\r\n")
    late = [
        *rows[:4],
        *(",".join([*r.split(",")[:2], f"{float(r.split(',')[2]) + 0.001:.6f}", r.split(",")[3]]) for r in rows[4:-1]),
    ]
    recording = read_log(write(tmp_path / "log.csv", "\r\n".join(late) + "\r\n"))
    assert recording.source.dialect["base_resampled"] == "cubic"
    assert read_log(tmp_path / "log.csv", LogOptions(sampling_rate_hz=500.0)).duration_s == 499 / 500.0
    inside = slice(5, -5)
    expected = np.interp(recording.time, DATA.time + 0.001, DATA.base)
    np.testing.assert_allclose(recording.base_displacement[inside], expected[inside], atol=2e-6)


@pytest.mark.parametrize(
    ("header", "of_time", "of_length"),
    [
        ("time [s],mass [m],base [m]", 1.0, 1.0),
        ("time (ms),mass (µm),base (µm)", 1e3, 1e6),
        ("t_us,mass_um,base_um", 1e6, 1e6),
        ("time / s,mass / mm,base / mm", 1.0, 1e3),
        ("time {s},mass {cm},base {cm}", 1.0, 1e2),
        ("time [min],mass [in],base [in]", 1 / 60, 1 / 0.0254),
    ],
)
def test_units_are_found_in_every_spelling(header: str, of_time: float, of_length: float, tmp_path: Path) -> None:
    rows = Truth(tuple((f"{float(t) * of_time:.12g}", x, y) for t, x, y in DATA.rows))
    recording = read_log(write(tmp_path / "log.csv", table(rows, header, ",")))
    np.testing.assert_allclose(recording.time, DATA.time, atol=1e-12)
    np.testing.assert_allclose(recording.mass_displacement, DATA.columns[1] / of_length, rtol=4e-16)


def test_seconds_that_are_labelled_milliseconds_are_doubted(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", table(DATA, "t_ms,mass [mm],base [mm]", ","))
    (said,) = [said for said in read_log(path).source.warnings if said.startswith("time")]
    assert "says ms: 250000 samples a second" in said
    assert said.endswith("with --time-unit s")


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("-", "\u2212"),
        lambda text: "".join(f'"{line.replace(";", chr(34) + ";" + chr(34))}"\n' for line in text.splitlines()),
        lambda text: text.replace("\n", "\r\r\n"),
        lambda text: "sep=;\n" + text,
        lambda text: text.replace("\n", "  \n"),
        lambda text: text + "\x1a",
        lambda text: text.replace(";", " ; "),
        lambda text: "\n".join(f"{i};{line};OK" for i, line in enumerate(text.splitlines())) + "\n",
    ],
    ids=["minus sign", "quotes", "CR CR LF", "sep line", "blanks at the end", "ctrl-z", "padding", "more columns"],
)
def test_small_oddities_cost_nothing(change: Callable[[str], str], tmp_path: Path) -> None:
    text = change(table(DATA, "time [s];mass [mm];base [mm]", ";", mark=comma))
    recording = read_log(write(tmp_path / "log.csv", text))
    assert_is(recording, DATA)
    assert recording.source.lines.quarantined == 0


def test_bare_names_say_which_unit_by_the_sensors_step_or_ask_for_it(tmp_path: Path) -> None:
    recording = read_log(write(tmp_path / "log.csv", table(DATA, "t,x,y", ",")))
    assert_is(recording, DATA)
    assert any("no unit is said; the sensor's step says mm" in w for w in recording.source.warnings)
    with pytest.raises(LogError, match=r"the unit of column 2 \('x \[fathom\]'\) is not known: .* give --unit"):
        read_log(write(tmp_path / "log.csv", table(DATA, "t,x [fathom],y [mil]", ",")))  # whatever the step says
    smooth = Truth(tuple((t, f"{float(x):.3f}", f"{float(y):.3f}") for t, x, y in DATA.rows))
    log = write(tmp_path / "log.csv", table(smooth, "t,x,y", ","))
    with pytest.raises(LogError, match=r"log\.csv: the unit of column 2 \('x'\) is not said: .* give --unit"):
        read_log(log)
    recording = read_log(log, LogOptions(unit="um"))
    np.testing.assert_array_equal(recording.mass_displacement, [float(x) / 1e6 for _, x, _ in smooth.rows])
    with pytest.raises(LogError, match=r"which column is the mass, .* give --mass 2 --base 3, .* and --unit"):
        read_log(write(tmp_path / "bare.csv", table(smooth, "", ",").lstrip()))  # all that is missing, at once


@pytest.mark.parametrize("name", ["COF", "mu", "friction coefficient [-]", "Reibzahl"])
def test_a_coefficient_of_friction_is_no_displacement(name: str, tmp_path: Path) -> None:
    for motion in ("stroke", "x"):
        log = write(tmp_path / f"{motion}.csv", table(DATA, f"time [s],{motion} [mm],{name}", ","))
        with pytest.raises(LogError, match=r"is a coefficient of friction by its name: .* export the friction force"):
            read_log(log)


def test_overrides_by_name_and_by_number(tmp_path: Path) -> None:
    log = write(tmp_path / "log.csv", table(DATA, "clock [s],laser 1 [mm],laser 2 [mm]", ","))
    with pytest.raises(LogError, match=r"which column is the mass, which the base\? 2 \('laser 1 \[mm\]'\), 3"):
        read_log(log)
    for mass, base in (("laser 1", "laser 2"), ("2", "3"), ("laser 1 [mm]", 3), ("LASER 1", "laser 2 [mm]")):
        assert_is(read_log(log, LogOptions(mass=mass, base=base)), DATA)
    swapped = read_log(log, LogOptions(mass="laser 2"))
    np.testing.assert_array_equal(swapped.mass_displacement, DATA.base)
    with pytest.raises(LogError, match=r"--mass 'laser 3': no such column; the log has 1 \('clock \[s\]'\)"):
        read_log(log, LogOptions(mass="laser 3"))
    with pytest.raises(LogError, match="one column cannot play two roles"):
        read_log(log, LogOptions(mass="2", base="2"))


def test_a_sampling_rate_counts_the_time(tmp_path: Path) -> None:
    rows = "\n".join(f"{x},{y}" for _, x, y in DATA.rows)
    log = write(tmp_path / "log.csv", f"mass [mm],base [mm]\n{rows}\n")
    with pytest.raises(LogError, match=r"no time column found: give --time, or --sampling-rate$"):
        read_log(log)
    with pytest.raises(LogError, match="sampling-rate; a table over frequency is for compare-numeric"):
        read_mass_log(write(tmp_path / "sweep.csv", "frequency [Hz],amplitude [mm]\n0.5,2\n0.8,3\n"))
    assert_is(read_log(log, LogOptions(sampling_rate_hz=250.0)), DATA)
    log = write(tmp_path / "log.csv", table(DATA, "time [s],mass [mm],base [mm]", ","))
    recording = read_log(log, LogOptions(sampling_rate_hz=500.0))
    assert recording.sampling_rate_hz == pytest.approx(500.0)
    assert "'time [s]') has steps of 0.004 s: 500 Hz as given is taken" in recording.source.warnings[0]
    log = write(tmp_path / "log.csv", f"Sampling rate [Hz];500\nmass [mm];base [mm]\n{rows.replace(',', ';')}\n")
    for rate in (500.0, 250.0):
        said = read_log(log, LogOptions(sampling_rate_hz=rate)).source.warnings
        assert said == (("the log states a sampling interval of 0.002 s: 250 Hz as given is taken",) * (rate == 250.0))


def test_two_readings_that_fit_are_shown_both_unless_a_header_tells(tmp_path: Path) -> None:
    log = write(tmp_path / "log.csv", "\n".join(f"{i},{(7 * i) % 1000:03d}" for i in range(100)) + "\n")
    with pytest.raises(LogError, match=r"more than one way: separator .* decimal mark .*; or separator"):
        read_log(log)
    write(log, table(DATA, "time [s],mass [mm],base [mm]", ",", mark=comma))
    with pytest.raises(LogError, match="names 3 columns, the lines below have 6 fields"):
        read_log(log)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("\n\n\n", "empty"),
        ("hello\nworld\n", "no lines of numbers"),
        ("time [s],mass [mm],base [mm]\n", "no lines of numbers"),
        ("time [s],mass [mm]\n" + "".join(f"{i / 100},{i}\n" for i in range(9)), "no column for base"),
        ("start_deg, rate\n90, 1000\n" + 9 * "1.5\n-1.5\n", r"what else it is \(--angle 1 --units angle=deg\)"),
        ("time [s],mass [mm],base [mm]\n0.1,1,2\n", "1 lines of data: expected at least 2"),
        ("[log]\nsampling_rate_hz = 250.0\n", r"a scene \(give it to --scene\), not a log"),
        ("source,status,reason,warnings\na.h5,ok,,\n", "a table of results, not a log"),
        ("# Logs\n1 2 3\n", "a text to read, not a log"),
        ("\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + "\0" * 600, "an Excel 97 file .* save it as .xlsx"),
        ("RIFF\0\0\0\0WAVEfmt " + "\0" * 600, "a sound file"),
        ("SQLite format 3\0" + "\0" * 600, "a database"),
        ("BZh91AY" + "\0" * 600, "packed: unpack it first"),
    ],
)
def test_what_is_no_log_is_refused_by_what_it_is(text: str, words: str, tmp_path: Path) -> None:
    name = {"#": "README.md", "[": "scene.toml"}.get(text[:1], "log.csv")
    with pytest.raises(LogError, match=words):
        read_log(write(tmp_path / name, text, "latin-1"))


@dataclass(frozen=True)
class Shape:
    """Separator, decimal mark, fields of a line, those to read, decimals of the last; the first one read is a time."""

    separator: str
    decimal: str
    fields: int
    wanted: tuple[int, ...]
    last_decimals: int = 0

    @property
    def reader(self) -> Reader:
        layout = LogLayout(self.separator, self.decimal, "n" * self.fields)
        columns = {r: LogColumn(i, "", "", "") for r, i in zip(("time", "mass", "base"), self.wanted, strict=False)}
        return Reader(layout, columns, last_decimals=self.last_decimals)


SHAPES = [
    Shape(",", ".", 3, (0, 1, 2)),
    Shape(";", ",", 3, (2, 0)),
    Shape("\t", ",", 4, (0, 3), last_decimals=2),
    Shape(" ", ".", 3, (0, 2)),
]
CELLS = st.one_of(
    st.floats().map(repr),
    st.decimals(allow_nan=False, allow_infinity=False).map(str),
    st.integers().map(str),
    st.text(alphabet="0123456789+-.,eE \tx\"'\r\0\v\f\x1c\xa0", max_size=12),
)


def read(block: bytes, shape: Shape) -> Body:
    reader = shape.reader
    reader.read(block)
    return reader.finish()


def judged(block: bytes, shape: Shape) -> Body:
    """The slow and obvious twin: every line is judged on its own."""
    with patch.object(Reader, "_regular", lambda *_: None):
        return read(block, shape)


def assert_same_both_ways(block: bytes, shape: Shape) -> Body:
    fast, slow = read(block, shape), judged(block, shape)
    np.testing.assert_equal(fast.values, slow.values)
    assert (fast.counts, fast.quarantined, fast.others) == (slow.counts, slow.quarantined, slow.others)
    assert sum(fast.counts.values()) == block.count(b"\n")
    return fast


@settings(max_examples=100, deadline=None)
@given(st.sampled_from(SHAPES), st.lists(st.lists(CELLS, min_size=1, max_size=5), min_size=1, max_size=20))
def test_a_block_is_read_as_its_lines_are_judged(shape: Shape, rows: list[list[str]]) -> None:
    lines = [shape.separator.join(cell.replace(".", shape.decimal) for cell in row) for row in rows]
    assert_same_both_ways(("\n".join(lines) + "\n").encode(), shape)


@pytest.mark.parametrize("sign", ["\x1c", "\x1f", "\x85", "\xa0", "\u2003"])
def test_only_blanks_and_tabs_part_what_blanks_part(sign: str) -> None:
    """Python parts words at many more signs; a line is one and the same, however its numbers are written."""
    body = read(f"1 {sign} 2\n1e+100 {sign} 2\n".encode(), SHAPES[3])
    assert body.values["time"].tolist() == [1.0, 1e100]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: repr(shape.separator))
def test_any_byte_may_stand_inside_a_field(shape: Shape) -> None:
    """Also in one that is not read: the second, of all shapes but the first."""
    fields = [[b"1", b"a" + bytes([code]) + b"b", b"1", b"1.00"][: shape.fields] for code in range(256)]
    block = b"".join(shape.separator.encode().join(cells) + b"\n" for cells in fields)
    assert_same_both_ways(block, shape)


@pytest.mark.parametrize("odd", [0, 1, 31, 32, 33, 500, 999])
def test_an_odd_line_anywhere_in_a_block_costs_its_neighbours_nothing(odd: int) -> None:
    lines = [f"{i},{i / 7:.6f},{i % 5}" for i in range(1000)]
    lines[odd] = "9" * 200_000  # longer than all others: parts of a block are cut by their lines, not by their bytes
    body = assert_same_both_ways(("\n".join(lines) + "\n").encode(), SHAPES[0])
    assert [line for line, *_ in body.quarantined] == [odd + 1]


@pytest.mark.parametrize("decimals", [1, 18, 19, 25])
@pytest.mark.parametrize("end", ["\n", "\r\n", "  \n"])
def test_a_last_number_is_whole_only_with_all_its_decimals(decimals: int, end: str) -> None:
    digits = "1234567890" * 3
    whole, cut = f"0.{digits[:decimals]}", f"0.{digits[: decimals - 1]}"
    shape = Shape(",", ".", 2, (0, 1), decimals)
    body = read(f"1,{whole}{end}2,{cut}{end}".encode(), shape)
    assert body.values["mass"].tolist() == [float(whole)]
    (line,) = body.quarantined
    assert (line[0], line[2]) == (2, f"last number cut: expected {decimals} decimals")


@pytest.mark.parametrize(
    "text", ["1_0", "0x10", "1d5x", "1e", "1e+", "--1", "+-1", "1.2.3", "1 2", "1e5.0", "True", "٣"]
)
def test_what_is_no_number_is_not_read(text: str) -> None:
    assert read(f"1,{text},2\n".encode(), SHAPES[0]).counts["quarantined"] == 1
