"""Decimals become the double that Python's ``float`` gives, bit for bit, and nothing else is taken for a number."""

from dataclasses import dataclass
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.logs.columns import LogColumn
from frictionlab.logs.dialect import Dialect
from frictionlab.logs.layouts import LogLayout
from frictionlab.logs.lines import Body, Reader


@dataclass(frozen=True)
class Shape:
    """Separator, decimal mark, fields of a line, those to read, decimals of the last; the first one read is a time."""

    separator: str
    decimal: str
    fields: int
    wanted: tuple[int, ...]
    last_decimals: int = 0
    roles: tuple[str, ...] = ("time", "mass", "base")

    @property
    def reader(self) -> Reader:
        layout = LogLayout("", Dialect(self.separator, self.decimal, self.fields, "n" * self.fields, 0, ()), (), (), 0)
        columns = {r: LogColumn(i, "", "", "") for r, i in zip(self.roles, self.wanted, strict=False)}
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
    np.testing.assert_array_equal(np.array(fast.values), np.array(slow.values))
    assert (fast.counts, fast.quarantined, fast.others) == (slow.counts, slow.quarantined, slow.others)
    assert sum(fast.counts.values()) == block.count(b"\n")
    return fast


def hard_decimals(count: int) -> list[str]:
    """Decimals that are hard to round: ties between doubles and their neighbours, 17 to 19 digits, all magnitudes."""
    rng = np.random.default_rng(11)
    quarter = count // 4
    exponents = rng.integers(-300, 300, quarter)
    anywhere = [
        f"{m:.17f}e{e}" for m, e in zip(rng.uniform(-10, 10, quarter).tolist(), exponents.tolist(), strict=True)
    ]
    printed = [f"{x:.18e}" for x in (rng.uniform(-1, 1, quarter) * 10.0 ** rng.integers(-30, 30, quarter)).tolist()]
    wide = rng.integers(1 << 52, 1 << 53, quarter)
    ties = [f"{2 * m + 1}e0" for m in wide.tolist()]  # halfway between two doubles
    near = [f"{2 * m + 1}{'.0' if m % 2 else ''}{m % 10}e-{m % 23}" for m in wide.tolist()]
    return anywhere + printed + ties + near


def test_hard_decimals_are_bit_exact() -> None:
    texts = hard_decimals(100_000)
    body = read(("\n".join(texts) + "\n").encode(), Shape(",", ".", 1, (0,), roles=("mass",)))
    expected = np.array([float(text) for text in texts])
    np.testing.assert_array_equal(body.values[0].view(np.int64), expected.view(np.int64))


@settings(max_examples=30, deadline=None)
@given(st.sampled_from(SHAPES), st.lists(st.lists(CELLS, min_size=1, max_size=5), min_size=1, max_size=20))
def test_a_block_is_read_as_its_lines_are_judged(shape: Shape, rows: list[list[str]]) -> None:
    lines = [shape.separator.join(cell.replace(".", shape.decimal) for cell in row) for row in rows]
    assert_same_both_ways(("\n".join(lines) + "\n").encode(), shape)


@pytest.mark.parametrize("sign", ["\x1c", "\x1f", "\x85", "\xa0", "\u2003"])
def test_only_blanks_and_tabs_part_what_blanks_part(sign: str) -> None:
    """Python parts words at many more signs; a line is one and the same, however its numbers are written."""
    body = read(f"1 {sign} 2\n1e+100 {sign} 2\n".encode(), SHAPES[3])
    assert body.values[0].tolist() == [1.0, 1e100]


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
    assert body.values[1].tolist() == [float(whole)]
    (line,) = body.quarantined
    assert (line[0], line[2]) == (2, f"last number cut: expected {decimals} decimals")


@pytest.mark.parametrize(
    "text", ["1_0", "0x10", "1d5x", "1e", "1e+", "--1", "+-1", "1.2.3", "1 2", "1e5.0", "True", "٣"]
)
def test_what_is_no_number_is_not_read(text: str) -> None:
    assert read(f"1,{text},2\n".encode(), SHAPES[0]).counts["quarantined"] == 1
