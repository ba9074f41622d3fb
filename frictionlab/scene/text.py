"""Scenes as TOML: read once, validated, frozen; found by their name; written with each key's sentence and default."""

import re
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from os import PathLike
from pathlib import Path
from textwrap import TextWrapper
from typing import Any, NamedTuple

from pydantic import BaseModel

from frictionlab.errors import SceneError
from frictionlab.files import check_regular
from frictionlab.scene.keys import Origin, Scene, tables_in

SCENE_NAME = "frictionlab.toml"
RESULTS = "_results"  # behind the name of a folder of logs: that of its results
WIDTH = 120
_HEAD = re.compile(r"\s*(\[\[?)([A-Za-z_][\w.-]*)\]\]?\s*(?:#.*)?$")  # of a table, or of one of several
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_KEY = re.compile(r"\s*([A-Za-z_][\w.-]*)\s*=")
HEAD = """\
# A scene for frictionlab: what rig, material, sensors and model a job is about.
#
# Each key stands here with its sentence and its default, and is switched off by the # before it: take the # away and
# give the value. All keys are optional. A file of this name, frictionlab.toml, is used by every command that finds it
# in the working folder or beside its first input and is given no --scene.
"""


def read_scene(path: str | PathLike[str]) -> Scene:
    """Read and validate a scene file.

    Parameters
    ----------
    path : str or Path
        A TOML file.

    Returns
    -------
    Scene
        Frozen; its ``folder`` is the file's.

    Raises
    ------
    SceneError
        The file cannot be read, is no TOML, or has faults: all of them are named, one a line, each with its line in the
        file, its key path and, where a name is misspelt, the name that was meant.
    """
    path = Path(path)
    try:
        check_regular(path)
        text = path.read_text(encoding="utf-8")
        tables = tomllib.loads(text)
    except RecursionError as error:
        raise SceneError(f"scene {path}: nested too deep: expected the tables of a scene") from error
    except OSError as error:
        raise SceneError(f"scene {path}: cannot be read ({error.strerror}): give the path of a TOML file") from error
    except UnicodeDecodeError as error:
        raise SceneError(f"scene {path}: expected UTF-8 text; byte {error.start} is not") from error
    except ValueError as error:  # tomllib's own among them; Python's, of a number of more than 4300 digits
        comma = re.search(r"(?m)^[^#\"'\[]*=\s*[-+]?(\d+),(\d+)\s*(#.*)?$", text)
        said = f": {comma[0].strip()}: TOML writes a decimal point, {comma[1]}.{comma[2]}" if comma else ""
        raise SceneError(f"scene {path}: expected TOML: {error}{said}") from error
    return Scene.of(tables, Origin(path.parent, path), name=f"scene {path}", lines=lines_of(text))


def find_scene(beside: Path | None = None) -> Path | None:
    """The scene that stands where a command is called, or beside its first input; None where there is none.

    Results in ``LOGS_results`` belong to the scene in ``LOGS``.

    Parameters
    ----------
    beside
        The first input: a file, or a folder of inputs.
    """
    places = [Path()]
    if beside is not None:
        places.append(beside if beside.is_dir() else beside.parent)
        above = (places[-1].absolute(), *places[-1].absolute().parents[:1])
        places += [
            folder.with_name(folder.name.removesuffix(RESULTS)) for folder in above if folder.name.endswith(RESULTS)
        ]
    return next((place / SCENE_NAME for place in places if (place / SCENE_NAME).is_file()), None)


def scene_from_tables(tables: Mapping[str, object], *, name: str = "scene", folder: Path = Path()) -> Scene:
    """Validate tables as :func:`read_scene` does, for scenes that stand in a notebook instead of a file.

    Raises
    ------
    SceneError
        All faults, one a line, each with its key path.

    Examples
    --------
    >>> scene_from_tables({"analysis": {"transient_s": -1.0}})
    Traceback (most recent call last):
    frictionlab.errors.SceneError: scene: analysis.transient_s: expected 0 or more; got -1.0
    """
    return Scene.of(tables, Origin(folder), name=name if name == "scene" else f"scene {name}")


def lines_of(text: str) -> dict[tuple[str, ...], int]:
    r"""Where which key and table of a TOML text stands; of a value over several lines that is its first."""
    found: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    count = Counter[tuple[str, ...]]()
    for number, line in enumerate(text.splitlines(), 1):
        path: tuple[str, ...] = ()
        if head := _HEAD.match(line):
            path = table = tuple(head[2].split("."))
            if head[1] == "[[":
                path = table = (*table, str(count[table]))
                count[table[:-1]] += 1
        elif key := _KEY.match(line):
            path = (*table, *key[1].split("."))
        for length in range(1, len(path) + 1):
            found.setdefault(path[:length], number)
    return found


class TableOfKeys(NamedTuple):
    """A table: its head as in a file (``[rig]``), its sentence, and its keys.

    ``keys``: name -> sentence, and value where it is left out (None: not known, or to be found).
    """

    head: str
    words: str
    keys: Mapping[str, tuple[str, object]]


def tables_of_keys(root: type[BaseModel] = Scene, path: tuple[str, ...] = ()) -> Iterator[TableOfKeys]:
    """All tables of a scene in order, those inside others after them."""
    for name, field in root.model_fields.items():
        for table in tables_in(field.annotation):
            where = ".".join((*path, name))
            head = f"[{where}]" if isinstance(field.get_default(), table) else f"[[{where}]]"
            words = (table.__doc__ or "").partition("\n")[0].partition(": ")[2]
            keys = {
                key: (one.description or "", None if one.is_required() else one.get_default())
                for key, one in table.model_fields.items()
                if not list(tables_in(one.annotation))
            }
            yield TableOfKeys(head, words[:1].upper() + words[1:], keys)
            yield from tables_of_keys(table, (*path, name))


def template() -> str:
    """A commented scene to fill in: every key with its sentence and default."""
    lines = [HEAD]
    comment = TextWrapper(WIDTH, initial_indent="# ", subsequent_indent="# ", break_long_words=False)
    for table in tables_of_keys():
        off = "# " if table.head.startswith("[[") else ""
        lines += [*comment.wrap(table.words), f"{off}{table.head}"]
        for key, (words, default) in table.keys.items():
            lines += [*comment.wrap(words), f"# {key} = {value_text(default)}".rstrip()]
        lines.append("")
    return "\n".join(lines)


def to_toml(scene: Scene) -> str:
    """A scene as TOML with all its defaults; read back it is the same scene. What is not known is left out.

    Examples
    --------
    >>> print(to_toml(Scene()).partition("[analysis]")[2].partition("[model]")[0].strip())
    cycles = "all"
    accuracy = "balanced"
    """
    tables, texts = scene.model_dump(), []
    for table in tables_of_keys():
        found: Any = tables
        for part in table.head.strip("[]").split("."):
            found = found[part]
        for row in found if isinstance(found, list) else [found]:
            said = (f"{key} = {value_text(row[key])}" for key in table.keys if row[key] is not None)
            texts.append("\n".join([table.head, *said, ""]))
    return "\n".join(texts)


def value_text(value: object) -> str:
    r"""A value as TOML writes it.

    Examples
    --------
    >>> [value_text(v) for v in (True, 20.0, 3, "a \"b\"", [1.5, 2.0], {"gradient": 0.02})]
    ['true', '20.0', '3', '"a \\"b\\""', '[1.5, 2.0]', '{ gradient = 0.02 }']
    """
    if isinstance(value, bool):
        return str(value).lower()
    if value is None or isinstance(value, (int, float)):
        return "" if value is None else repr(value)
    if isinstance(value, dict):
        keys = ((key if _BARE.fullmatch(key) else value_text(key), value_text(v)) for key, v in value.items())
        inner = ", ".join(f"{key} = {text}" for key, text in keys)
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(value_text(v) for v in value)}]"
    plain = str(value).replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08X}" for c in plain) + '"'
