"""Log or recording of a free decay -> natural frequency, damping ratio and friction of each tap."""

from pathlib import Path

from frictionlab.analysis.free_vibration import FreeVibration, free_vibrations
from frictionlab.errors import AnalysisError
from frictionlab.hdf5 import read_recording
from frictionlab.logs import read_mass_log
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.verbs.given import AnyScene, FilePath, is_recording_name, scene_given

TABLES = ("log",)


def free_vibration(what: Recording | FilePath, scene: AnyScene = None, **settings: object) -> tuple[FreeVibration, ...]:
    """Natural frequency, viscous damping ratio and friction of each free decay in a record, in the order of time.

    Parameters
    ----------
    what : Recording, str or Path
        A recording, its file, or a log; a log of the mass alone has a base at rest.
    scene : Scene, str, Path or None
        ``[log]`` says what the log does not say itself.
    **settings
        Keys of ``[log]`` that win over the scene's.

    Raises
    ------
    AnalysisError
        There is no free decay.
    LogError, RecordingError, SceneError, UsageError
        The file, the scene or a setting is refused.
    """
    known = scene_given(scene, settings, TABLES)
    recording = what if isinstance(what, Recording) else decay_of(Path(what), known)
    taps: list[FreeVibration] = []
    refused: list[AnalysisError] = []
    for part in sorted(recording.stretches(), key=len, reverse=True):
        try:
            taps += free_vibrations(part.time, part.mass_displacement, part.base_displacement)
        except AnalysisError as error:  # a stretch without a decay is passed over where another has some
            refused.append(error)
    if not taps:
        raise refused[0]
    return tuple(sorted(taps, key=lambda tap: tap.start_s))


def decay_of(path: Path, scene: Scene) -> Recording:
    """A recording from its file, or one made of a log that may hold the mass alone."""
    return read_recording(path) if is_recording_name(path) else read_mass_log(path, scene.log)
