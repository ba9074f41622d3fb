"""Scenes as TOML text: one to fill in, and one that is read back as it was."""

from collections.abc import Iterator, Mapping
from textwrap import wrap
from typing import Any

from frictionlab.scene.tables import Scene
from frictionlab.scene.words import Key, TableOfKeys, tables_of_keys, value_text

HEAD = """\
# A scene for frictionlab: what rig, material, sensors and model a job is about.
#
# Each key stands here with its sentence and its default, and is switched off by the # before it: take the # away and
# give the value. All keys are optional. A file of this name, frictionlab.toml, is used by every command that finds it
# in the working folder or beside its first input and is given no --scene.
"""
WIDTH = 118


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
    transient_s = 20.0
    cycles = "last"
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
