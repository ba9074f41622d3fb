"""A scene: what rig, material, sensor and model a job is about (TOML -> frozen :class:`Scene`).

A scene is read once, validated, and frozen. Every key is optional. An unknown key, a wrong type or an impossible value
is refused with its key path, all faults at once.

- ``keys``: the keys, their types, defaults and sentences; ``rig``: ``[rig]``; ``virtual``: ``[synthetic]``
- ``toml_file``: files and tables of a notebook -> `Scene`; ``faults``: what is wrong, where, and what was meant
- ``text``: each key with its sentence, scenes as text
"""

from frictionlab.log_options import LogOptions
from frictionlab.scene.faults import keys_of
from frictionlab.scene.keys import Analysis, Experiment, Infer, Model, Scene, Sensors, Solver
from frictionlab.scene.rig import Rig, RigContact, RigMass
from frictionlab.scene.toml_file import SCENE_NAME, find_scene, read_scene, scene_from_tables
from frictionlab.scene.virtual import Synthetic, VirtualBase, VirtualTests

__all__ = [
    "SCENE_NAME", "Analysis", "Experiment", "Infer", "LogOptions", "Model", "Rig", "RigContact", "RigMass", "Scene",
    "Sensors", "Solver", "Synthetic", "VirtualBase", "VirtualTests", "find_scene", "keys_of", "read_scene",
    "scene_from_tables",
]  # fmt: skip
