"""The dial between speed and accuracy: three names for documented settings of a scene's knobs.

What each level costs and brings is measured by ``frictionlab tradeoff`` and stands in the README of `tradeoff`. A
result names its level; a scene whose knobs are set otherwise is ``own``.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Literal

from frictionlab.errors import UsageError
from frictionlab.scene import Scene

Level = Literal["fast", "balanced", "exact"]

LEVELS: Mapping[str, Mapping[str, Mapping[str, Any]]] = MappingProxyType(
    {
        # Cycles on 64 points, and no zero-padding.
        "fast": {
            "analysis": {"padding": 1, "least_points": 64, "most_points": 64},
        },
        # Every sample used. The defaults of a scene.
        "balanced": {
            "analysis": {"padding": 4, "least_points": 64, "most_points": None},
        },
        # At least 1024 points a cycle: what interpolation between few samples still brings.
        "exact": {
            "analysis": {"padding": 16, "least_points": 1024, "most_points": None},
        },
    }
)


def with_accuracy(scene: Scene, level: str) -> Scene:
    """The scene with the knobs of a level in place of its own.

    Raises
    ------
    UsageError
        There is no such level.

    Examples
    --------
    >>> with_accuracy(Scene(), "fast").analysis.padding
    1
    """
    if level not in LEVELS:
        raise UsageError(f"accuracy: expected one of {', '.join(LEVELS)}; got {level!r}")
    tables = {name: getattr(scene, name).model_copy(update=knobs) for name, knobs in LEVELS[level].items()}
    return scene.model_copy(update=tables)


def accuracy_of(scene: Scene) -> str:
    """The level whose knobs a scene has: ``fast``, ``balanced``, ``exact``, or ``own`` for any other setting.

    Examples
    --------
    >>> accuracy_of(Scene()), accuracy_of(with_accuracy(Scene(), "exact"))
    ('balanced', 'exact')
    """
    for level, tables in LEVELS.items():
        if all(getattr(getattr(scene, t), k) == v for t, knobs in tables.items() for k, v in knobs.items()):
            return level
    return "own"
