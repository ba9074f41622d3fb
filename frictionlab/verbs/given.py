"""What callers may give a verb: paths or results, a scene in any form, keys of its tables as keywords."""

import difflib
from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from frictionlab.errors import UsageError
from frictionlab.scene import Scene, keys_of, read_scene

FilePath = str | PathLike[str]
AnyScene = Scene | FilePath | None


def scene_given(scene: AnyScene, settings: Mapping[str, object] | None = None, tables: tuple[str, ...] = ()) -> Scene:
    """The scene in any form that a verb takes, with keys of some of its tables set anew.

    Parameters
    ----------
    scene : Scene, str, Path or None
        A path is read; None is a scene with all defaults.
    settings : mapping, optional
        Keys of these tables and their values; None stands for: as the scene says.
    tables : tuple of str
        The tables that the verb's settings belong to, in the order in which a key is looked up.

    Raises
    ------
    SceneError
        The scene or a value is refused.
    UsageError
        No such key in these tables.

    Examples
    --------
    >>> scene_given(None, {"cycles": "all", "padding": None}, ("rig", "analysis")).analysis.cycles
    'all'
    """
    known = scene if isinstance(scene, Scene) else Scene() if scene is None else read_scene(scene)
    said = {key: value for key, value in (settings or {}).items() if value is not None}
    if not said:
        return known
    places = {key: table for table in reversed(tables) for key in keys_of(type(getattr(known, table)))}
    changes: dict[str, dict[str, object]] = {}
    for key, value in said.items():
        if key not in places:
            raise UsageError(_unknown(key, list(places)))
        changes.setdefault(places[key], {})[key] = value
    if "natural_frequency_hz" in said and known.rig.stiffness_n_per_m is not None:
        changes["rig"].setdefault("mass_kg", None)  # stiffness and frequency say all; a third number could contradict
    return known.changed(**changes)


def _unknown(key: str, known: list[str]) -> str:
    near = difflib.get_close_matches(key, known, n=1)
    meant = f"did you mean {near[0]}? " if near else ""
    return f"{key}: unknown setting; {meant}expected one of {', '.join(sorted(known))}"


def is_recording_name(path: Path) -> bool:
    """Whether a file is a recording by its name, not a log."""
    return path.suffix.lower() in (".h5", ".hdf5")
