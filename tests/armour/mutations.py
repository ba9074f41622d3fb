"""What can happen to a file's bytes, to the text in it, and to the tree of an HDF5 file."""

import contextlib
import csv
import io
import json
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import h5py
import numpy as np

HEAD = 3000  # bytes in which half of the damage is done: an HDF5 file says there what it holds
JUNK = (
    "", " ", "\0", "\0" * 30, "nan", "inf", "-inf", "1e308", "1e999", "-1e400", "1e-320", "9" * 400, "-1", "0", "-0",
    "∞", "---", "+FFFFFFF", "203.50", "203,50", "1.2.3", "1,2,3", "1,5", "1_000", "0x1F", "0x10", "٣", "１２", "e", "-",
    "+", ".", ",", ";", ";;;;", "\t\t", '"', '""', "'", "#", "{", "[[[[", "[1, 2", '["a"]', '{"a": {"b": 1}}',
    "[" * 3000, '{"a":' * 3000, "=1+1", "=cmd|' /C calc'!A0", "..", "../../a.h5", "C:\\logs\\a.h5", "/dev/zero", "abc",
    "é", "\u202e", "\ud800", "\ufeff", "\x1b[31m", "\x1a", "\x85", "\u2028", "\r", "\n", "\r\n", "a\nb", "None", "null",
    "true", "ok", "failed", "steel", "2020-01-01", "***End_of_Header***", "X_Value", "x" * 9000, "x" * 50_000,
)  # fmt: skip

Bytes = Callable[[bytes, np.random.Generator], bytes]


def flipped(raw: bytes, rng: np.random.Generator) -> bytes:
    data = bytearray(raw)
    reach = len(data) if rng.random() < 0.5 else min(len(data), HEAD)
    for _ in range(int(rng.choice([1, 2, 5, 20]))):
        data[int(rng.integers(reach))] = int(rng.choice([0, 1, 0x7F, 0x80, 0xFF, int(rng.integers(256))]))
    return bytes(data)


def cut(raw: bytes, rng: np.random.Generator) -> bytes:
    return raw[: int(rng.integers(len(raw)))]


def moved(raw: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes are copied over others: addresses and lengths that are true elsewhere."""
    data, size = bytearray(raw), int(rng.choice([4, 8, 16, 64]))
    reach = max(len(data) - size, 1)
    source, to = int(rng.integers(reach)), int(rng.integers(min(reach, HEAD) if rng.random() < 0.5 else reach))
    data[to : to + size] = data[source : source + size]
    return bytes(data)


def junk(rng: np.random.Generator) -> bytes:
    return JUNK[int(rng.integers(len(JUNK)))].encode("utf-8", "surrogatepass")


def drop(raw: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(raw)))
    return raw[:at] + raw[at + int(rng.integers(1, 80)) :]


def put_in(raw: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(raw)))
    return raw[:at] + (rng.bytes(int(rng.integers(1, 40))) if rng.random() < 0.3 else junk(rng)) + raw[at:]


def lines(raw: bytes, rng: np.random.Generator) -> bytes:
    """A line is there twice, joined to the next, gone, elsewhere, or a copy of the first."""
    every = raw.split(b"\n")
    i, to = (int(place) for place in rng.integers(len(every), size=2))
    line = every.pop(i)
    kept: tuple[list[bytes], ...] = (
        [line, line],
        [line + b"".join(every[i : i + 1])],
        [],
        [],
        [every[0] if every else line, line],
    )
    how = int(rng.integers(len(kept)))
    every[i : i + (how == 1)] = kept[how]
    if how == 3:
        every.insert(to, line)
    return b"\n".join(every)


def value(raw: bytes, rng: np.random.Generator) -> bytes:
    """One value of a line is another: behind a separator, an equals sign or a colon."""
    every, mark = raw.split(b"\n"), (b",", b";", b"\t", b"=", b":")[int(rng.integers(5))]
    at = int(rng.integers(len(every)))
    cells = every[at].split(mark)
    cells[int(rng.integers(len(cells)))] = junk(rng)
    every[at] = mark.join(cells)
    return b"\n".join(every)


def swap(raw: bytes, rng: np.random.Generator) -> bytes:
    marks = [b",", b";", b"\t", b".", b" ", b"\n", b"\r\n"]
    a, b = rng.choice(len(marks), 2, replace=False)
    return raw.replace(marks[int(a)], marks[int(b)])


def wide(raw: bytes, rng: np.random.Generator) -> bytes:
    codec = ("utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "utf-32")[int(rng.integers(5))]
    return raw.decode("latin-1").encode(codec)


BINARY: tuple[Bytes, ...] = (flipped, flipped, flipped, moved, moved, cut)
TEXT: tuple[Bytes, ...] = (
    flipped, cut, drop, put_in, put_in, put_in, value, value, value, swap, wide, lines, lines, lines, lines, lines,
)  # fmt: skip


Hurt = Callable[[h5py.File, str], object]


NOT_THERE = (KeyError, OSError, TypeError, ValueError, AttributeError, StopIteration)
"""A node may be gone, or of another kind, by the change before."""


def hurt(raw: bytes, rng: np.random.Generator) -> bytes:
    """A file that is sound HDF5 and holds what no file of its kind holds."""
    file_ = io.BytesIO(raw)
    with h5py.File(file_, "r+") as file:
        for _ in range(int(rng.integers(1, 3))):
            names: list[str] = []
            file.visit(names.append)
            name = names[int(rng.integers(len(names)))]
            kinds = HURTS[int(rng.integers(len(HURTS)))]
            with contextlib.suppress(*NOT_THERE):
                kinds[int(rng.integers(len(kinds)))](file, name)
    return file_.getvalue()


def put(file: h5py.File, name: str, thing: object) -> None:
    """Something else in place of what stands there."""
    del file[name]
    file[name] = thing


def new_array(file: h5py.File, name: str, data: object = None, **how: Any) -> None:
    """Another array in place of what stands there."""
    del file[name]
    file.create_dataset(name, data=data, **how)


def set_attribute(file: h5py.File, name: str, value: object) -> None:
    """Another value of the first attribute: of the node, or of the root for a node without one."""
    node = file[name] if len(file[name].attrs) else file
    node.attrs[next(iter(node.attrs))] = file.ref if value is None else value


def virtual(file: h5py.File, name: str) -> None:
    """The numbers are elsewhere."""
    shape = file[name].shape or (1,)
    layout = h5py.VirtualLayout(shape, "f8")
    layout[...] = h5py.VirtualSource("/etc/passwd", "x", shape)
    del file[name]
    file.create_virtual_dataset(name, layout)


def store(file: h5py.File, name: str, **how: Any) -> None:
    """The same numbers stored in another way."""
    new_array(file, name, file[name][()], chunks=True, **how)


def add(file: h5py.File, name: str, member: str) -> None:
    """One more array, in the group or beside the array."""
    node = file[name] if isinstance(file[name], h5py.Group) else file
    node.create_dataset(member, data=np.arange(5.0))


TEXTS = h5py.string_dtype()
ATTRIBUTES: tuple[object, ...] = (
    None, np.zeros(3, [("a", "f8"), ("b", "S3")]), np.array([[1, 2], [3, 4]], "u1"), np.array(["a", "b"], TEXTS),
    b"\xff\xfe", 10**15, math.nan, np.zeros(5), np.zeros((2, 2)), "x" * 60000, np.array([b"a"]), h5py.Empty("f8"), -1,
)  # fmt: skip
ARRAYS: tuple[object, ...] = (
    np.zeros(300, "f4"), np.zeros(300, "c16"), np.zeros(300, "i8"), np.zeros(300, ">f8"), np.zeros((300, 2)),
    np.float64(1.0), np.zeros(300, [("a", "f8")]), np.full(300, np.nan), np.full(300, 1e308), np.zeros(0),
    np.array([b"x"] * 300), np.zeros(300, bool), np.arange(300)[::-1] * 1.0, np.full(300, np.inf), h5py.Empty("f8"),
    np.zeros((1,) * 32), np.zeros(800, "f2"), np.zeros(800, "S5"), np.zeros(800, "u8") + np.uint64(2**64 - 1),
)  # fmt: skip
HURTS: tuple[tuple[Hurt, ...], ...] = (
    tuple(partial(set_attribute, value=value) for value in ATTRIBUTES),
    (lambda file, name: file[name].attrs.pop(next(iter(file[name].attrs))),),
    *2 * (tuple(partial(new_array, data=data) for data in ARRAYS),),
    (  # an array that claims more than any memory holds, of which nothing is stored
        *(partial(new_array, shape=(1 << n,), dtype="f8", chunks=(1024,)) for n in (33, 40)),
        partial(new_array, shape=(1 << 20, 1 << 20), dtype="f8", chunks=(1024, 1024)),
        partial(new_array, shape=(1 << 62,), dtype="u1", chunks=(1024,)),
    ),
    (
        partial(put, thing=h5py.ExternalLink("/etc/passwd", "/x")),
        partial(put, thing=h5py.SoftLink("/nowhere")),
        lambda file, name: put(file, name, h5py.SoftLink(f"/{name}")),
        partial(put, thing=h5py.SoftLink("/")),
        partial(put, thing=np.dtype("f8")),  # a type with a name
        lambda file, name: file.move(name, "source/moved"),
    ),
    (  # a group that is inside itself
        lambda file, name: file[name].__setitem__("again", file["/"]),
        lambda file, name: file[name].__setitem__("again", file[name]),
    ),
    tuple(partial(new_array, data=texts, dtype=TEXTS) for texts in ([b"\xff"] * 3, ["\x1b[31m"], ["x" * 100000], [])),
    (lambda file, name: file.pop(name),),
    (lambda file, name: (file.pop(name), file.create_group(name)),),
    (
        virtual,
        partial(new_array, shape=(300,), dtype="f8", external=[("/etc/passwd", 0, 2400)]),
        partial(store, compression="gzip", shuffle=True),
        partial(store, compression="lzf"),
        partial(store, fletcher32=True),
        partial(store, scaleoffset=3),
        partial(new_array, data=np.zeros(800, "u1"), dtype=h5py.enum_dtype({"GOOD": 0, "BAD": 1}, "u1")),
    ),
    tuple(
        partial(add, member=member) for member in ("x" * 5000, "\u202e", "..", "é\u0301", "a b\n", "#refs#", "\x1b[31m")
    ),
)
"""Kinds of harm, each with its ways."""


RAW = (
    "nan", "inf", "-inf", "1e308", "-1e308", "5e-324", "0", "-0.0", "-1", "9223372036854775808", "9" * 400, "true",
    '""', '"\\u0000"', '"é\\u0301"', '"../../x"', '"\\u001b[31m"', '"CON"', '"' + "x" * 5000 + '"', "[]", "[[]]",
    "[1, 2.5, -3]", "[nan, 1]", "[" * 50 + "]" * 50, "{}", "{ a = 1 }", "1979-05-27", "07:32:00",
    "1979-05-27T07:32:00Z", '"auto"', '"{material}_{material}"', '"{"', '"coulomb+place+speed"', "0x7fffffff", "1e-300",
)  # fmt: skip
STRANGE_KEYS = ("x", "", "ü", "a b", "mass_kg ", "Rig", "__class__", "folder", "origin")


def keys(raw: bytes, rng: np.random.Generator) -> bytes:
    """A scene, a key a line, some of whose keys have values that no scene has; keys are added, lost, put elsewhere."""
    every = raw.decode().split("\n")
    for _ in range(int(rng.integers(1, 4))):
        said = [i for i, line in enumerate(every) if " = " in line]
        at, chance, other = said[int(rng.integers(len(said)))], rng.random(), RAW[int(rng.integers(len(RAW)))]
        if chance < 0.2:
            line = every.pop(at)
            if chance < 0.1:
                every.insert(int(rng.integers(len(every))), line)
        elif chance < 0.3:
            strange = STRANGE_KEYS[int(rng.integers(len(STRANGE_KEYS)))]
            every.insert(at, f"{json.dumps(strange, ensure_ascii=False)} = {other}")
        else:
            every[at] = f"{every[at].partition(' = ')[0]} = {other}"
    return "\n".join(every).encode()


def cells(raw: bytes, rng: np.random.Generator) -> bytes:
    """A table with other cells, columns that moved, are there twice or are gone, written down in another way."""
    rows = list(csv.reader(io.StringIO(raw.decode())))
    for _ in range(int(rng.integers(1, 4))):
        row = rows[int(rng.integers(len(rows)))]
        at = int(rng.integers(len(row)))
        row[at] = junk(rng).decode("utf-8", "replace")
        if rng.random() < 0.1:
            _move_column(rows, rng)
    return _written(rows, rng)


def _move_column(rows: list[list[str]], rng: np.random.Generator) -> None:
    a, b = (int(n) for n in rng.integers(min(map(len, rows)), size=2))
    lose, twice = rng.random() < 0.3, rng.random() < 0.3
    for row in rows:
        row[a], row[b] = row[b], row[a]
        if lose and len(row) > 1:
            del row[a]
        elif twice:
            row.insert(a, row[b])


def _written(rows: Sequence[Sequence[str]], rng: np.random.Generator) -> bytes:
    """As another program writes it: separator, quotes, line ends, encoding."""
    told, odd = io.StringIO(), rng.random() < 0.3
    style: dict[str, Any] = {"delimiter": ";\t|"[int(rng.integers(3))]} if odd else {}
    if rng.random() < 0.3:
        style["quoting"] = csv.QUOTE_ALL
    csv.writer(told, lineterminator="\r\n" if rng.random() < 0.3 else "\n", **style).writerows(rows)
    encodings = ("utf-8-sig", "utf-16", "utf-16-le", "cp1252", "utf-32") if rng.random() < 0.3 else ("utf-8",)
    return told.getvalue().encode(encodings[int(rng.integers(len(encodings)))], "replace")


def entries(raw: bytes, rng: np.random.Generator) -> bytes:
    """Rows in JSON with other values, of other types, keys that are gone or there twice."""
    rows = [json.loads(line) for line in raw.decode().splitlines()]
    values: list[object] = [None, True, -1, 0, 1e308, 10**400, "", "nan", "x" * 50_000, [], [[]], [1, "a", None], {}]
    values += [{"a": {"b": [1]}}, {"value": None}, float("nan"), float("-inf"), "\0", "\ud800", ["\u202e"], 5e-324]
    for _ in range(int(rng.integers(1, 5))):
        row = rows[int(rng.integers(len(rows)))]
        name = [*row, "x"][int(rng.integers(len(row) + 1))]
        if rng.random() < 0.15:
            row.pop(name, None)
        else:
            row[name] = values[int(rng.integers(len(values)))]
    return "".join(json.dumps(row) + "\n" for row in rows).encode("utf-8", "surrogatepass")
