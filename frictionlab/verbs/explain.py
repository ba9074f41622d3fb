"""Log, recording or measurement -> which law it requires, in a dozen lines."""

from frictionlab.analysis.measurement import Measurement
from frictionlab.identification.explain import Explanation
from frictionlab.identification.explain import explain as explain_measurement
from frictionlab.recording import Recording
from frictionlab.verbs.analyze import analyze
from frictionlab.verbs.compare import TABLES
from frictionlab.verbs.given import AnyScene, FilePath, scene_given


def explain(what: Measurement | Recording | FilePath, scene: AnyScene = None, **settings: object) -> Explanation:
    """Say which contact law a test requires, what it is made of in newtons, and what the next simpler law gets wrong.

    Parameters
    ----------
    what : Measurement, Recording, str or Path
        What is measured already, a recording, its file, or a log.
    scene : Scene, str, Path or None
        ``[rig]`` gives the natural frequency (and stiffness, for newtons), ``[model]`` the physics.
    **settings
        Keys of ``[model]``, ``[analysis]`` and ``[rig]`` that win over the scene's.

    Returns
    -------
    Explanation
        ``print(explanation.text)``; its ``comparison`` is that of ``compare(what, scene, law="auto")``.

    Raises
    ------
    AnalysisError
        No measurement can be made, or the natural frequency is not known.
    LogError, RecordingError, SceneError, UsageError
        The file, the scene or a setting is refused.
    """
    known = scene_given(scene, settings, TABLES)
    measurement = what if isinstance(what, Measurement) else analyze(what, known)
    return explain_measurement(measurement, known)
