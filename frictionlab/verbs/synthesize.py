"""Scene -> logs of a virtual rig whose truth is known."""

from collections.abc import Callable
from pathlib import Path

from frictionlab import synthetic
from frictionlab.synthetic import VirtualTest
from frictionlab.verbs.given import AnyScene, FilePath, scene_given

TABLES = ("synthetic", "rig", "model")


def synthesize(
    scene: AnyScene, folder: FilePath, *, progress: Callable[[int, int], None] | None = None, **settings: object
) -> tuple[VirtualTest, ...]:
    """Write one log per virtual test of a scene into a folder, and their truth beside them (``truth.jsonl``).

    Parameters
    ----------
    scene : Scene, str or Path
        Its ``[rig]``, ``[model]`` and ``[synthetic]`` tables say all; the same scene gives the same bytes.
    folder : str or Path
        Made if it is not there. Synthetic logs of the same names are replaced, measured ones never.
    progress : callable, optional
        Called with logs written and logs in all.
    **settings
        Keys of ``[synthetic]``, ``[rig]`` and ``[model]`` that win over the scene's: ``seed=1``.

    Raises
    ------
    SceneError
        The scene asks for no tests, or lacks what they need.
    OutputError
        The folder cannot be written, or a log that is not synthetic stands there.
    """
    known = scene_given(scene, settings, TABLES)
    total = len(synthetic.virtual_tests(known))
    tests = []
    for test in synthetic.synthesize(known, Path(folder)):
        tests.append(test)
        if progress is not None:
            progress(len(tests), total)
    return tuple(tests)
