"""Decimals become the double that Python's ``float`` gives, bit for bit, and nothing else is taken for a number."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.logs.body import Reader, Shape
from frictionlab.logs.kernel import parse_lines

ONE = np.array([0], np.int64)


def hard_decimals(count: int) -> list[str]:
    """Decimals that are hard to round: ties between doubles and their neighbours, 17 to 19 digits, all magnitudes."""
    rng = np.random.default_rng(11)
    quarter = count // 4
    exponents = rng.integers(-300, 300, quarter)
    anywhere = [f"{m!r}e{e}" for m, e in zip(rng.uniform(-10, 10, quarter).tolist(), exponents.tolist(), strict=True)]
    printed = [f"{x:.18e}" for x in (rng.uniform(-1, 1, quarter) * 10.0 ** rng.integers(-30, 30, quarter)).tolist()]
    wide = rng.integers(1 << 52, 1 << 53, quarter)
    ties = [f"{2 * m + 1}e0" for m in wide.tolist()]  # halfway between two doubles
    near = [f"{2 * m + 1}{'.0' if m % 2 else ''}{m % 10}e-{m % 23}" for m in wide.tolist()]
    return anywhere + printed + ties + near


def test_a_million_hard_decimals_are_bit_exact() -> None:
    texts = hard_decimals(1_000_000)
    values = np.empty((1, 1_000_000))
    rows, odd = parse_lines(("\n".join(texts) + "\n").encode(), ",", ".", ONE, 0, (values, 0, 1_000_000))
    assert rows + len(odd) == 1_000_000
    left = set(odd[:, 2].tolist())
    assert len(left) < 50_000  # near the ends of the doubles' range Python's own float is asked
    expected = np.array([float(text) for i, text in enumerate(texts) if i not in left])
    np.testing.assert_array_equal(values[0, :rows].view(np.int64), expected.view(np.int64))


SHAPES = [
    Shape(",", ".", 3, (0, 1, 2), has_time=True),
    Shape(";", ",", 3, (2, 0), has_time=True),
    Shape("\t", ",", 4, (0, 3), has_time=True, last_decimals=2),
    Shape(" ", ".", 3, (0, 2), has_time=True),
]
CELLS = st.one_of(
    st.floats().map(repr),
    st.decimals(allow_nan=False, allow_infinity=False).map(str),
    st.integers().map(str),
    st.text(alphabet="0123456789+-.,eE \tx\"'\r\0\v\f\x1c\xa0", max_size=12),
)


@settings(max_examples=100, deadline=None)
@given(st.sampled_from(SHAPES), st.lists(st.lists(CELLS, min_size=1, max_size=5), min_size=1, max_size=20))
def test_the_compiled_reader_and_the_plain_one_agree_on_every_line(shape: Shape, rows: list[list[str]]) -> None:
    lines = [shape.separator.join(cell.replace(".", shape.decimal) for cell in row) for row in rows]
    block = ("\n".join(lines) + "\n").encode()
    bodies = []
    for compiled in (True, False):
        reader = Reader(shape, 1, compiled=compiled)
        reader.read(block)
        bodies.append(reader.finish())
    compiled_body, plain_body = bodies
    np.testing.assert_array_equal(np.array(compiled_body.values), np.array(plain_body.values))
    assert compiled_body.counts == plain_body.counts
    assert sum(compiled_body.counts.values()) == block.count(b"\n")
    assert compiled_body.quarantined == plain_body.quarantined
    assert compiled_body.lines == plain_body.lines


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("sign", ["\x1c", "\x1f", "\x85", "\xa0", "\u2003"])
def test_only_blanks_and_tabs_part_what_blanks_part(sign: str, *, compiled: bool) -> None:
    """Python parts words at many more signs; a line is one and the same, however its numbers are written."""
    reader = Reader(SHAPES[3], 1, compiled=compiled)
    reader.read(f"1 {sign} 2\n1e+100 {sign} 2\n".encode())
    assert reader.finish().values[0].tolist() == [1.0, 1e100]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: repr(shape.separator))
def test_both_readers_agree_on_any_byte_inside_a_field(shape: Shape) -> None:
    """Also in one that is not read: the second, of all shapes but the first."""
    bodies = []
    for compiled in (True, False):
        reader = Reader(shape, 1, compiled=compiled)
        for code in range(256):
            cells = [b"1", b"a" + bytes([code]) + b"b", b"1", b"1.00"][: shape.fields]
            reader.read(shape.separator.encode().join(cells) + b"\n")
        bodies.append(reader.finish())
    assert bodies[0].quarantined == bodies[1].quarantined
    assert bodies[0].counts == bodies[1].counts


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_any_double_is_read_back(value: float) -> None:
    for text in (repr(value), f"{value:.17e}", f"{value:.25e}"):
        reader = Reader(SHAPES[0], 1, compiled=True)
        reader.read(f"1,{text},{text}\n".encode())
        assert reader.finish().values[1].tolist() == [float(text)]


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("decimals", [1, 18, 19, 25])
def test_a_last_number_is_whole_only_with_all_its_decimals(decimals: int, *, compiled: bool) -> None:
    digits = "1234567890" * 3
    whole, cut = f"0.{digits[:decimals]}", f"0.{digits[: decimals - 1]}"
    reader = Reader(Shape(",", ".", 2, (0, 1), has_time=True, last_decimals=decimals), 1, compiled=compiled)
    reader.read(f"1,{whole}\n2,{cut}\n".encode())
    body = reader.finish()
    assert body.values[1].tolist() == [float(whole)]
    assert body.quarantined == [(2, f"2,{cut}", f"last number cut: expected {decimals} decimals")]


@pytest.mark.parametrize(
    "text", ["1_0", "0x10", "1d5x", "1e", "1e+", "--1", "+-1", "1.2.3", "1 2", "1e5.0", "True", "٣"]
)
def test_what_is_no_number_is_not_read(text: str) -> None:
    for compiled in (True, False):
        reader = Reader(SHAPES[0], 1, compiled=compiled)
        reader.read(f"1,{text},2\n".encode())
        assert reader.finish().counts["quarantined"] == 1
