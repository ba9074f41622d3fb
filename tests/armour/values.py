"""What can happen to the values in a sound text file: keys of a scene, cells of a table, the way it is written down."""

import copy
import csv
import io
import json
import tomllib
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from tests.armour.mutations import junk

RAW = (
    "nan", "inf", "-inf", "1e308", "-1e308", "5e-324", "0", "-0.0", "-1", "9223372036854775808", "9" * 400, "true",
    '""', '"\\u0000"', '"é\\u0301"', '"../../x"', '"\\u001b[31m"', '"CON"', '"' + "x" * 5000 + '"', "[]", "[[]]",
    "[1, 2.5, -3]", "[nan, 1]", "[" * 50 + "]" * 50, "{}", "{ a = 1 }", "1979-05-27", "07:32:00",
    "1979-05-27T07:32:00Z", '"auto"', '"{material}_{material}"', '"{"', '"coulomb+place+speed"', "0x7fffffff", "1e-300",
)  # fmt: skip
STRANGE_KEYS = ("x", "", "ü", "a b", "mass_kg ", "Rig", "__class__", "folder", "origin")
Tree = dict[str, Any]


class _Raw(str):
    """A value as it is to stand in the file."""

    __slots__ = ()


def keys(raw: bytes, rng: np.random.Generator) -> bytes:
    """A scene some of whose keys have values that no scene has; keys are added, lost and put elsewhere."""
    scene = copy.deepcopy(tomllib.loads(raw.decode()))
    for _ in range(int(rng.integers(1, 4))):
        tables = list(_tables(scene))
        table = tables[int(rng.integers(len(tables)))]
        names = [*table, STRANGE_KEYS[int(rng.integers(len(STRANGE_KEYS)))]]
        name = names[int(rng.integers(len(names)))]
        if rng.random() < 0.1:
            table.pop(name, None)
        elif rng.random() < 0.1:
            table[name] = copy.deepcopy(tables[int(rng.integers(len(tables)))])
        else:
            table[name] = _Raw(RAW[int(rng.integers(len(RAW)))])
    return "\n".join(f"{_key(name)} = {_told(value)}" for name, value in scene.items()).encode()


def _tables(tree: Tree) -> Iterator[Tree]:
    yield tree
    for value in tree.values():
        for inner in value if isinstance(value, list) else [value]:
            if isinstance(inner, dict):
                yield from _tables(inner)


def _key(name: str) -> str:
    return json.dumps(name, ensure_ascii=False)


def _told(value: object) -> str:
    """A value in TOML, tables inline."""
    if isinstance(value, _Raw):
        return str(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(name)} = {_told(inner)}" for name, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_told, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


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
