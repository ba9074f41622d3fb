"""What the results of a log were made of: its size and time, the scene, the facts of its test, this version.

A log is looked at by size and time of its last change, whichever way that differs: one replaced by an older file is
seen too, and so is one that was touched.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from frictionlab import __version__
from frictionlab.experiment import facts_of
from frictionlab.files import make_folder, write_whole
from frictionlab.scene import Scene

Stamp = Mapping[str, object]
NOT_MEASURED_BY = {"synthetic", "plan"}  # tables of a scene that no result of a log depends on


def stamp_of(log: Path, scene: Scene, steps: Iterable[str]) -> Stamp:
    """What the results of a log would be made of now; a log that is not there has no size and time."""
    facts = facts_of(scene, log)
    try:
        state = log.stat()
        size, changed = state.st_size, state.st_mtime_ns
    except OSError:
        size, changed = -1, -1
    return {
        "log": log.name,
        "size_bytes": size,
        "changed_ns": changed,
        "facts": dict(facts.values),
        "scene": digest(scene.model_dump(mode="json", exclude=NOT_MEASURED_BY)),
        "steps": list(steps),
        "frictionlab_version": __version__,
    }


def digest(thing: object) -> str:
    """A number for a tree of plain values: SHA-256 of its JSON."""
    return hashlib.sha256(json.dumps(thing, sort_keys=True, default=str).encode()).hexdigest()


def is_fresh(path: Path, stamp: Stamp, results: Iterable[Path]) -> bool:
    """Whether all results are there and their stamp at this path says that they were made of the same."""
    return read_stamp(path) == stamp and all(result.exists() for result in results)


def read_stamp(path: Path) -> Stamp | None:
    """The stamp at a path; None if there is none that can be read: its results are made again."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def write_stamp(path: Path, stamp: Stamp) -> None:
    """Write a stamp, after the results it speaks for."""
    make_folder(path.parent)
    write_whole(path, json.dumps(stamp, indent=1).encode())
