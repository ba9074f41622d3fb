"""Log or recording -> measurement."""

from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement
from frictionlab.recording import Recording
from frictionlab.verbs.given import AnyScene, FilePath, scene_given
from frictionlab.verbs.recordings import recording_given

TABLES = ("analysis", "rig", "model")


def analyze(what: Recording | FilePath, scene: AnyScene = None, **settings: object) -> Measurement:
    """Measure one test: drive, response, energy per cycle, irregularity, stops, regime, each with its error.

    Parameters
    ----------
    what : Recording, str or Path
        A recording, its file, or a log.
    scene : Scene, str, Path or None
        ``[analysis]`` says which part is measured and how; ``[rig]`` gives natural frequency and stiffness where known.
    **settings
        Keys of ``[analysis]``, ``[rig]`` and ``[model]`` that win over the scene's: ``natural_frequency_hz=3.13``,
        ``transient_s=10.0``, ``cycles="all"``, ``padding=8``.

    Raises
    ------
    AnalysisError
        The test holds no measurement: no drive, shorter than its transient, no full cycle.
    LogError, RecordingError, SceneError, UsageError
        The file, the scene or a setting is refused.
    """
    known = scene_given(scene, settings, TABLES)
    return measure(recording_given(what, known), known)
