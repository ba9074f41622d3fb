"""Log, recording or measurement -> friction identified, prediction, difference."""

from frictionlab.analysis.measurement import Measurement
from frictionlab.identification import Comparison, predict
from frictionlab.recording import Recording
from frictionlab.verbs.analyze import analyze
from frictionlab.verbs.given import AnyScene, FilePath, scene_given

TABLES = ("model", "analysis", "rig")


def compare(
    what: Measurement | Recording | FilePath,
    scene: AnyScene = None,
    *,
    law: str | None = None,
    friction_ratio: float | None = None,
    **settings: object,
) -> Comparison:
    """Identify the friction of a test, predict its steady cycle with the simulator, and say how they differ.

    Parameters
    ----------
    what : Measurement, Recording, str or Path
        What is measured already, a recording, its file, or a log.
    scene : Scene, str, Path or None
        ``[rig]`` gives the natural frequency (and stiffness, for newtons), ``[model]`` the physics.
    law : str, optional
        In place of the scene's: ``"coulomb+place+speed"``; ``"auto"`` finds the simplest law that explains the test.
    friction_ratio : float, optional
        Predict with this friction ratio (beta, eq. 2.8) instead of identifying it.
    **settings
        Keys of ``[model]``, ``[analysis]`` and ``[rig]`` that win over the scene's: ``solver="exact"``.

    Raises
    ------
    AnalysisError
        No measurement can be made, or the natural frequency is not known.
    LogError, RecordingError, SceneError, UsageError
        The file, the scene or a setting is refused.
    """
    known = scene_given(scene, settings, TABLES)
    measurement = what if isinstance(what, Measurement) else analyze(what, known)
    return predict(measurement, known, law=law, friction_ratio=friction_ratio)
