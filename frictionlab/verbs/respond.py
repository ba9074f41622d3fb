"""Recorded motion of the base -> what the mass does under it."""

from pathlib import Path

from frictionlab.base_motion import RecordResponse, respond_to, respond_to_acceleration
from frictionlab.errors import UsageError
from frictionlab.hdf5 import read_recording
from frictionlab.logs import read_base_acceleration, read_base_log
from frictionlab.recording import Recording
from frictionlab.simulator import Problem
from frictionlab.verbs.given import AnyScene, FilePath, is_recording_name, scene_given

TABLES = ("rig", "log")


def respond(
    what: Recording | FilePath,
    problem: Problem,
    scene: AnyScene = None,
    *,
    highpass_hz: float | None = None,
    **settings: object,
) -> RecordResponse:
    """Simulate the mass, from rest, under any recorded motion of the base.

    Parameters
    ----------
    what : Recording, str or Path
        A recording, its file, a log with a base column, or one column of any table (``base="2"``).
    problem : Problem
        The contact law, with r = 1 (time is counted in omega_n t); beta is over k times the largest displacement of the
        base from its first value.
    scene : Scene, str, Path or None
        ``[rig]`` gives natural frequency, stiffness and, where the problem has none, the frame's damping ratio;
        ``[log]`` what the log does not say itself.
    highpass_hz : float, optional
        A base that is given as an acceleration, with a fixed wall: it is integrated twice, without what is slower.
    **settings
        Keys of ``[rig]`` and ``[log]`` that win over the scene's: ``natural_frequency_hz=3.13``, ``unit="mm"``.

    Raises
    ------
    UsageError
        The natural frequency is not known.
    LogError, RecordingError
        The base cannot be read, has a gap or jumps, or is an acceleration and needs `highpass_hz`.
    SimulationError
        The base does not move, or the law cannot be integrated.
    SceneError
        The scene or a setting is refused.
    """
    known = scene_given(scene, settings, TABLES)
    frequency = known.rig.natural_frequency
    if frequency is None:
        raise UsageError(
            "natural frequency: expected the frame's, in Hz; got none; do: give --natural-frequency HZ, or "
            "natural_frequency_hz in [rig] of the scene; `frictionlab free-vibration` measures it"
        )
    if known.rig.damping_ratio is not None and problem.frame_damping_ratio == 0.0:
        problem = problem.with_parameters({"frame_damping_ratio": known.rig.damping_ratio})
    if isinstance(what, Recording):
        return respond_to(what, problem, natural_frequency_hz=frequency, stiffness_n_per_m=known.rig.stiffness)
    path = Path(what)
    acceleration = None if is_recording_name(path) else read_base_acceleration(path, known.log)
    if acceleration is not None:
        return respond_to_acceleration(
            acceleration,
            problem,
            natural_frequency_hz=frequency,
            highpass_hz=highpass_hz,
            stiffness_n_per_m=known.rig.stiffness,
            source=str(what),
        )
    if highpass_hz is not None:
        raise UsageError(f"{path}: --highpass belongs to a base that is an acceleration; got a displacement")
    recording = read_recording(path) if is_recording_name(path) else read_base_log(path, known.log)
    return respond_to(
        recording,
        problem,
        natural_frequency_hz=frequency,
        stiffness_n_per_m=known.rig.stiffness,
        source=str(what),
    )
