"""Scenes from files and from tables: read once, validated, frozen."""

import tomllib
from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from pydantic import ValidationError

from frictionlab.errors import SceneError
from frictionlab.files import check_regular
from frictionlab.scene.faults import Lines, check_hidden, lines_of, refusal
from frictionlab.scene.keys import Origin, Scene

SCENE_NAME = "frictionlab.toml"
RESULTS = "_results"  # behind the name of a folder of logs: that of its results


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
        The file cannot be read, is no TOML, or has faults: all of them are told, one a line, each with its line in the
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
        raise SceneError(f"scene {path}: expected TOML: {error}") from error
    return _validated(tables, name=f"scene {path}", folder=path.parent, file=path, lines=lines_of(text))


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
    return _validated(tables, name=name if name == "scene" else f"scene {name}", folder=folder, file=None, lines={})


def _validated(tables: Mapping[str, object], *, name: str, folder: Path, file: Path | None, lines: Lines) -> Scene:
    check_hidden(tables, Scene, name)
    try:
        return Scene.model_validate({**tables, "folder": folder, "origin": Origin(file)})
    except ValidationError as error:
        raise refusal(error, Scene, name=name, lines=lines) from error
