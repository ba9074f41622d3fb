"""A scene: what rig, material, sensor and model a job is about (TOML -> frozen :class:`Scene`).

A scene is read once, validated, and frozen. Every key is optional. An unknown key, a wrong type or an impossible value
is refused with its key path, all faults at once.

- ``keys``: the keys, their types, limits, defaults and sentences, and what is wrong with them
- ``rig``: what all tables have in common, ``[rig]`` and ``[synthetic]``
- ``text``: TOML <-> scenes, and one to fill in
- ``physical``: the simulator's dimensionless numbers of a scene
"""

from frictionlab.log_options import LogOptions
from frictionlab.scene.keys import Analysis, Experiment, Infer, Model, Scene, Sensors, Solver
from frictionlab.scene.rig import Rig, RigContact, RigMass, Synthetic, VirtualTests
from frictionlab.scene.text import SCENE_NAME, find_scene, read_scene, scene_from_tables

__all__ = [
    "SCENE_NAME", "Analysis", "Experiment", "Infer", "LogOptions", "Model", "Rig", "RigContact", "RigMass", "Scene",
    "Sensors", "Solver", "Synthetic", "VirtualTests", "find_scene", "read_scene",
    "scene_from_tables",
]  # fmt: skip
