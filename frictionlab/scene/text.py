"""Every key of a scene with its sentence and default, from the tables' source; scenes as TOML text."""

import ast
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from itertools import pairwise
from textwrap import dedent, wrap
from types import NoneType
from typing import Any

from pydantic import BaseModel

from frictionlab.scene.faults import HIDDEN, tables_in
from frictionlab.scene.keys import Scene

HEAD = """\
# A scene for frictionlab: what rig, material, sensors and model a job is about.
#
# Each key stands here with its sentence and its default, and is switched off by the # before it: take the # away and
# give the value. All keys are optional. A file of this name, frictionlab.toml, is used by every command that finds it
# in the working folder or beside its first input and is given no --scene.
"""
WIDTH = 118


@dataclass(frozen=True)
class Key:
    """A key of a table, its sentence, and its value where it is left out (None: not known, or to be found)."""

    name: str
    words: str
    default: object
    needed: bool = False


@dataclass(frozen=True)
class TableOfKeys:
    """A table: its head as in a file (``[rig]``), its sentence, its keys."""

    head: str
    words: str
    keys: tuple[Key, ...]


def tables_of_keys(root: type[BaseModel] = Scene, path: tuple[str, ...] = ()) -> Iterator[TableOfKeys]:
    """All tables of a scene in order, those inside others after them.

    Examples
    --------
    >>> [table.head for table in tables_of_keys()][:4]
    ['[rig]', '[[rig.masses]]', '[[rig.contacts]]', '[experiment]']
    """
    for name, field in root.model_fields.items():
        for table in () if name in HIDDEN else tables_in(field.annotation):
            where = (*path, name)
            many = not isinstance(field.get_default(), table)
            head = f"[[{'.'.join(where)}]]" if many else f"[{'.'.join(where)}]"
            yield TableOfKeys(head, _words_of_table(table), tuple(_keys(table)))
            if issubclass(table, BaseModel):
                yield from tables_of_keys(table, where)


def _words_of_table(table: type) -> str:
    if is_dataclass(table):
        return "What a log is, where that is not to be found in it."
    first = (inspect.getdoc(table) or "").partition("\n")[0]
    words = first.partition(": ")[2]
    return words[:1].upper() + words[1:] if words else first


def _keys(table: type) -> Iterator[Key]:
    if issubclass(table, BaseModel):
        words = _sentences(table)
        for name, field in table.model_fields.items():
            if name not in HIDDEN and not list(tables_in(field.annotation)):
                default = None if field.is_required() else field.get_default()
                yield Key(name, words.get(name, ""), default, field.is_required())
    elif is_dataclass(table):
        for f in fields(table):
            yield Key(f.name, f.metadata["words"], None if f.default is MISSING else f.default)


def _sentences(table: type) -> dict[str, str]:
    """The sentences that stand below the keys of a table in its source."""
    (made,) = ast.parse(dedent(inspect.getsource(table))).body
    body: list[Any] = getattr(made, "body", [])
    found = {}
    for statement, below in pairwise(body):
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            value = below.value if isinstance(below, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                found[statement.target.id] = value.value.strip()
    return found


def value_text(value: object) -> str:
    r"""A value as TOML writes it.

    Examples
    --------
    >>> [value_text(v) for v in (True, 20.0, 3, "a \"b\"", [1.5, 2.0], {"gradient": 0.02})]
    ['true', '20.0', '3', '"a \\"b\\""', '[1.5, 2.0]', '{ gradient = 0.02 }']
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float, NoneType)):
        return "" if value is None else repr(value)
    if isinstance(value, dict):
        inner = ", ".join(f"{_key_text(key)} = {value_text(v)}" for key, v in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(value_text(v) for v in value)}]"
    return _quoted(str(value))


def _quoted(text: str) -> str:
    """A basic string: quotes, backslashes and all that cannot be printed are escaped."""
    plain = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08X}" for c in plain) + '"'


def _key_text(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else _quoted(key)


def template() -> str:
    """A commented scene to fill in: every key with its sentence and default."""
    return HEAD + "".join(f"\n{_empty_table(table)}" for table in tables_of_keys())


def _empty_table(table: TableOfKeys) -> str:
    off = "# " if table.head.startswith("[[") else ""
    lines = [*_comment(table.words), f"{off}{table.head}"]
    for key in table.keys:
        lines += [*_comment(key.words), f"# {key.name} = {value_text(key.default)}".rstrip()]
    return "\n".join(lines) + "\n"


def _comment(words: str) -> Iterator[str]:
    return (f"# {line}" for line in wrap(words, WIDTH, break_long_words=False))


def to_toml(scene: Scene) -> str:
    """A scene as TOML with all its defaults; read back it is the same scene. What is not known is a comment.

    Examples
    --------
    >>> print(to_toml(Scene()).partition("[analysis]")[2].partition("padding")[0].strip())
    # transient_s is not given
    cycles = "all"
    """
    tables = scene.model_dump()
    return "\n".join(text for table in tables_of_keys() for text in _table_texts(table, tables))


def _table_texts(table: TableOfKeys, tables: Mapping[str, Any]) -> Iterator[str]:
    """The text of a table, or of each table of an array."""
    found: Any = tables
    for part in table.head.strip("[]").split("."):
        found = found[part]
    for values in found if isinstance(found, list) else [found]:
        yield "\n".join([table.head, *(_line(key, values[key.name]) for key in table.keys)]) + "\n"


def _line(key: Key, value: object) -> str:
    return f"# {key.name} is not given" if value is None else f"{key.name} = {value_text(value)}"
