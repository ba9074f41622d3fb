"""Text to doubles at the speed of memory: one pass over the bytes of a block, compiled.

A line is either regular (the expected number of fields, each wanted one a plain decimal number) and becomes a row, or
it is handed back for `frictionlab.logs.body` to look at. What is parsed here is the double nearest to the decimal, as
Python's ``float`` gives it: by an exact product or quotient where mantissa and power of ten are exact doubles (Clinger
1990), else by a 128-bit product (Lemire, Number parsing at a gigabyte per second, Softw. Pract. Exper. 51, 2021); the
rare number that needs more is handed back as well.
"""

from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.logs.lines import Bytes

_LOW, _HIGH = -342, 308
_LF, _CR, _TAB, _BLANK, _QUOTE, _VT, _FF = 10, 13, 9, 32, 34, 11, 12
_ONE = np.uint64(1)
_TENS = np.array([float(f"1e{k}") for k in range(23)])


def _top_bits(k: int) -> int:
    """Give the top 128 bits of 5**k as in Lemire's paper: cut for k >= 0, the next above for k < 0."""
    if k >= 0:
        power: int = 5**k
        spare = 128 - power.bit_length()
        return power << spare if spare >= 0 else power >> -spare
    power = 5**-k
    z = (power - 1).bit_length()
    word = (1 << (z + 127 if k >= -27 else 2 * z + 128)) // power + 1
    return word >> max(0, word.bit_length() - 128)


_FIVES = np.array([divmod(_top_bits(k), 1 << 64) for k in range(_LOW, _HIGH + 1)], np.uint64)

_compiled = nb.njit(nogil=True, cache=True, error_model="numpy")
_inlined = nb.njit(nogil=True, cache=True, error_model="numpy", inline="always")


def count_lines(block: Bytes) -> int:
    """How many line ends there are."""
    return int(_count(np.frombuffer(memoryview(block).toreadonly(), np.uint8)))


def parse_lines(
    block: Bytes,
    separator: str,
    decimal: str,
    target: NDArray[np.int64],
    last_decimals: int,
    into: tuple[NDArray[np.float64], int, int],
) -> tuple[int, NDArray[np.int64]]:
    """Parse the regular lines of a block.

    Parameters
    ----------
    block
        Whole lines, each ending in LF.
    separator, decimal
        One ASCII character each; the separator " " stands for any run of blanks and tabs.
    target
        (fields,) the row of the result that a field belongs to, or -1 for a field that is not wanted.
    last_decimals
        Decimals that the last field of a line must have at least, if it is wanted.
    into
        (wanted, m) float64 to write to, the first place to write, and the number of lines, for which there is room.

    Returns
    -------
    places, odd
        How many places are filled; (odd lines, 3) int64: start, end, line from 0 of each line that is not regular.
    """
    values, first, lines = into
    if first < 0 or first + lines > values.shape[1] or block[-1:] != b"\n" or target.max() >= len(values):
        raise LogError("no room for the numbers of a block: this is a fault of frictionlab, please report it")
    odd = np.empty((lines, 3), np.int64)
    text = np.frombuffer(memoryview(block).toreadonly(), np.uint8)
    rows, odds = _parse(text, ord(separator), ord(decimal), target, last_decimals, values, first, odd)
    return rows, odd[:odds]


@_compiled
def _count(text: Any) -> int:
    lines = 0
    for c in text:
        lines += c == _LF
    return lines


@_compiled
def _product(a: Any, b: Any) -> tuple[Any, Any]:
    """Multiply two 64-bit words: high and low word of the product."""
    mask, half = np.uint64(0xFFFFFFFF), np.uint64(32)
    a_low, a_high, b_low, b_high = a & mask, a >> half, b & mask, b >> half
    low = a_low * b_low
    middle = a_high * b_low + (low >> half)
    other = a_low * b_high + (middle & mask)
    return a_high * b_high + (middle >> half) + (other >> half), (other << half) | (low & mask)


@_compiled
def _leading_zeros(word: Any) -> int:
    zeros = 0
    for step in (32, 16, 8, 4, 2, 1):
        if word >> np.uint64(64 - step) == np.uint64(0):
            word <<= np.uint64(step)
            zeros += step
    return zeros


@_compiled
def _rounded(high: Any, low: Any, power: int, shift: int) -> Any:
    """Round the product to 53 bits, ties to even, and put mantissa and exponent together."""
    one = np.uint64(1)
    upper = high >> np.uint64(63)
    cut = upper + np.uint64(9)
    mantissa = high >> cut
    exponent = ((217706 * power) >> 16) + 63 + int(upper) - shift + 1023
    if low <= one and -4 <= power <= 23 and mantissa & np.uint64(3) == one and mantissa << cut == high:
        mantissa &= ~one
    mantissa = (mantissa + (mantissa & one)) >> one
    if mantissa >= np.uint64(1 << 53):
        mantissa = np.uint64(1 << 52)
        exponent += 1
    bits = np.empty(1, np.uint64)
    bits[0] = (np.uint64(exponent) << np.uint64(52)) | (mantissa & np.uint64((1 << 52) - 1))
    return bits.view(np.float64)[0]


@_compiled
def _nearest(mantissa: Any, power: Any) -> tuple[Any, Any]:
    """Find the double nearest to mantissa * 10**power; not if that takes subnormals, overflow or more than 128 bits."""
    if mantissa == np.uint64(0):
        return True, 0.0
    if mantissa <= np.uint64(1 << 53) and -22 <= power <= 22:
        exact = float(np.int64(mantissa))
        return True, exact / _TENS[-power] if power < 0 else exact * _TENS[power]
    if power < -290 or power > 288:
        return False, 0.0
    shift = _leading_zeros(mantissa)
    scaled = mantissa << np.uint64(shift)
    high, low = _product(scaled, _FIVES[power - _LOW, 0])
    if high & np.uint64(0x1FF) == np.uint64(0x1FF):
        more, _ = _product(scaled, _FIVES[power - _LOW, 1])
        low += more
        high += np.uint64(low < more)
    if low == np.uint64(0xFFFFFFFFFFFFFFFF) and not -27 <= power <= 55:
        return False, 0.0
    return True, _rounded(high, low, power, shift)


@_inlined
def _after_blanks(text: Any, i: Any, sep: int) -> Any:
    while text[i] == _BLANK or (sep == _BLANK and text[i] == _TAB):
        i += _ONE
    return i


@_inlined
def _after_field(text: Any, i: Any, sep: int) -> Any:
    """Skip a field that is not wanted; quote, NUL and line end stop as a separator does, and among blanks any space."""
    c = text[i]
    while c not in (sep, _LF, _CR, _QUOTE, 0) and not (sep == _BLANK and c in (_TAB, _VT, _FF)):
        i += _ONE
        c = text[i]
    return i


@_inlined
def _digits(text: Any, i: Any, mantissa: Any) -> tuple[Any, Any]:
    digit = np.uint64(text[i]) - np.uint64(48)
    while digit <= np.uint64(9):
        mantissa = mantissa * np.uint64(10) + digit
        i += _ONE
        digit = np.uint64(text[i]) - np.uint64(48)
    return mantissa, i


@_inlined
def _exponent(text: Any, i: Any) -> tuple[Any, Any, Any]:
    negative = text[i] == 45
    if negative or text[i] == 43:
        i += _ONE
    size, exponent = 0, np.int64(0)
    while 48 <= text[i] <= 57 and size < 5:
        exponent = exponent * 10 + (np.int64(text[i]) - 48)
        i += _ONE
        size += 1
    return 0 < size < 5, -exponent if negative else exponent, i


@_inlined
def _number(text: Any, i: Any, mark: int) -> tuple[Any, Any, Any, Any]:
    """Read a decimal number: whether it is one, its double, its decimals, and where it ends."""
    negative = text[i] == 45
    if negative or text[i] == 43:
        i += _ONE
    start = i
    mantissa, i = _digits(text, i, np.uint64(0))
    digits, decimals = np.int64(i - start), np.int64(0)
    if text[i] == mark:
        i += _ONE
        start = i
        mantissa, i = _digits(text, i, mantissa)
        decimals = np.int64(i - start)
        digits += decimals
    power: Any = -decimals
    good: Any = 0 < digits < 20
    if text[i] == 101 or text[i] == 69:
        well, exponent, i = _exponent(text, i + _ONE)
        power += exponent
        good = good and well
    if mantissa <= np.uint64(1 << 53) and -22 <= power <= 0:
        value = np.float64(np.int64(mantissa)) / _TENS[-power]
    else:
        close, value = _nearest(mantissa, power)
        good = good and close
    return good, -value if negative else value, decimals, i


@_inlined
def _line(
    text: Any, i: Any, sep: int, mark: int, target: Any, last_decimals: int, values: Any, row: int
) -> tuple[Any, Any]:
    """Read one line into a row: whether it is regular, and where reading ended (never past its LF)."""
    last = len(target) - 1
    regular = False
    for field in range(len(target)):
        i = _after_blanks(text, i, sep)
        if target[field] >= 0:
            good, value, decimals, i = _number(text, i, mark)
            if not good or (field == last and decimals < last_decimals):
                break
            values[target[field], row] = value
        else:
            i = _after_field(text, i, sep)
        end = _after_blanks(text, i, sep)
        if field == last:
            i = end + _ONE if text[end] == _CR else end
            regular = text[i] == _LF
        elif text[end] == sep and sep != _BLANK:
            i = end + _ONE
        elif end == i or sep != _BLANK:
            break
        else:
            i = end
    return regular, i


@_compiled
def _parse(
    text: Any, sep: int, mark: int, target: Any, last_decimals: int, values: Any, first: int, odd: Any
) -> tuple[int, int]:
    rows, lines, odds, i, size = 0, 0, 0, np.uint64(0), np.uint64(len(text))
    while i < size:
        start = i
        regular, i = _line(text, i, sep, mark, target, last_decimals, values, first + rows)
        if regular:
            rows += 1
        else:
            while text[i] != _LF:
                i += _ONE
            odd[odds, 0], odd[odds, 1], odd[odds, 2] = start, i, lines
            odds += 1
        i += _ONE
        lines += 1
    return rows, odds
