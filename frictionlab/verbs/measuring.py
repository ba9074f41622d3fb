"""What is measured: log -> recording -> measurement; free decay -> the frame's own frequency and damping."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from frictionlab.errors import OutputError
from frictionlab.verbs.inputs import AnyScene, FilePath, is_recording_name, recording_given, scene_given

if TYPE_CHECKING:
    from frictionlab.analysis.free_vibration import FreeVibration, Mode
    from frictionlab.analysis.measurement import Measurement
    from frictionlab.logs.text import Progress
    from frictionlab.recording import Recording
    from frictionlab.scene import Scene


def ingest(
    log: FilePath,
    scene: AnyScene = None,
    *,
    base_log: FilePath | None = None,
    output: FilePath | None = None,
    force: bool = False,
    progress: "Progress | None" = None,
    **settings: object,
) -> "Recording":
    r"""Read a log, whatever its dialect and damage, into a recording in SI units.

    Parameters
    ----------
    log : str or Path
        The log; of a pair of logs, the mass's.
    scene : "Scene", str, Path or None
        ``[log]`` says what the log does not say itself; ``[experiment]`` gives the facts of its test.
    base_log : str or Path, optional
        The log of the base, where each sensor has its own.
    output : str or Path, optional
        Write the recording here too (HDF5), whole or not at all.
    force : bool
        Replace whatever file stands there; else only a recording of the same log.
    progress : callable, optional
        Called with bytes read and bytes in all.
    **settings
        Keys of ``[log]`` and ``[experiment]`` that win over the scene's: ``unit="mm"``, ``material="steel"``.

    Raises
    ------
    LogError
        The log cannot be read, can be read in more than one way, or is damaged beyond use.
    SceneError, UsageError
        The scene or a setting is refused.
    OutputError
        The recording cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> log = Path(tempfile.mkdtemp()) / "test.csv"
    >>> _ = log.write_text("t [s];mass;base\n" + "".join(f"0,{i:02};1,5;-2,25\n" for i in range(50)))
    >>> recording = ingest(log, unit="mm", material="steel")
    >>> float(recording.mass_displacement[0]), recording.experiment["material"]
    (0.0015, 'steel')
    """
    from frictionlab.files import refuse_inputs
    from frictionlab.hdf5 import check_writable, write_recording

    known = scene_given(scene, settings, ("log", "experiment"))
    if output is not None:
        refuse_inputs([Path(output)], [*(Path(part) for part in (log, base_log) if part is not None), *known.files])
        check_writable(Path(output), force=force)
    recording = _read(Path(log), None if base_log is None else Path(base_log), known, progress)
    if output is not None:
        if not force:
            _refuse_another(Path(output), recording)
        write_recording(recording, Path(output), force=force)
    return recording


def _refuse_another(output: Path, recording: "Recording") -> None:
    """Refuse to replace the recording of another log, one of the same name too: the same bytes may be read again."""
    from frictionlab.hdf5 import is_recording, read_recording

    if not output.exists() or not is_recording(output):
        return
    there, new = ([(f.name, f.sha256) for f in r.source.files] for r in (read_recording(output), recording))
    if there and there != new:
        what = "of other bytes" if there[0][0] == new[0][0] else f"got {new[0][0]}"
        raise OutputError(
            f"{output}: holds the recording of {there[0][0]}; {what}: choose another output, or give --force"
        )


def _read(log: Path, base_log: Path | None, scene: "Scene", progress: "Progress | None") -> "Recording":
    from frictionlab.experiment import facts_of
    from frictionlab.logs import read_log, read_two_logs

    facts = facts_of(scene, log)
    if base_log is None:
        recording = read_log(log, scene.log, progress=progress)
    else:
        recording = read_two_logs(log, base_log, scene.log, progress=progress)
    source = replace(recording.source, warnings=(*recording.source.warnings, *facts.warnings))
    return recording.changed(source=source, experiment=facts.values)


def analyze(what: "Recording | FilePath", scene: AnyScene = None, **settings: object) -> "Measurement":
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
    from frictionlab.analysis.measure import measure

    known = scene_given(scene, settings, ("analysis", "rig", "model"))
    return measure(recording_given(what, known), known)


def free_vibration(
    what: "Recording | FilePath", scene: AnyScene = None, **settings: object
) -> "tuple[FreeVibration, ...]":
    """Natural frequency, viscous damping ratio and friction of each free decay in a record, in the order of time.

    Parameters
    ----------
    what : Recording, str or Path
        A recording, its file, or a log; a log of the mass alone has a base at rest.
    scene : Scene, str, Path or None
        ``[log]`` says what the log does not say itself; ``[rig] restoring = "pendulum"``: angles, whose restoring
        torque is a sine.
    **settings
        Keys of ``[log]`` that win over the scene's.

    Raises
    ------
    AnalysisError
        There is no free decay.
    LogError, RecordingError, SceneError, UsageError
        The file, the scene or a setting is refused.
    """
    from frictionlab.analysis.free_vibration import FreeVibration, free_vibrations
    from frictionlab.errors import AnalysisError, UsageError
    from frictionlab.recording import Recording

    known = scene_given(scene, settings, ("log",))
    recording = what if isinstance(what, Recording) else decay_of(Path(what), known)
    pendulum = known.rig.restoring == "pendulum"
    measured = recording.measured()
    mass = "mass_displacement" if "mass_displacement" in measured and not pendulum else "angle"
    if mass not in measured:
        raise UsageError(
            f"free vibration: expected {'the angle of a pendulum' if pendulum else 'a displacement or an angle'}; got"
            f" {', '.join(measured)}: name its column (--angle), or change restoring in [rig]"
        )
    taps: list[FreeVibration] = []
    refused: list[AnalysisError] = []
    for part in sorted(recording.stretches(), key=len, reverse=True):
        try:
            found = part.measured()
            taps += free_vibrations(part.time, found[mass], found.get("base_displacement"), pendulum=pendulum)
        except AnalysisError as error:  # a stretch without a decay is passed over where another has some
            refused.append(error)
    if not taps:
        raise refused[0]
    return tuple(sorted(taps, key=lambda tap: tap.start_s))


def free_vibration_modes(
    what: "Recording | FilePath", scene: AnyScene = None, **settings: object
) -> "tuple[Mode, ...]":
    """Natural frequency, damping ratio and shape of each mode of a frame of several masses, slowest first.

    Parameters as of `free_vibration`; the recording holds ``mass_displacement``, ``mass_2_displacement`` and so on.

    Raises
    ------
    AnalysisError
        Fewer modes show than there are masses, or the motion is no free decay.
    """
    import numpy as np

    from frictionlab.analysis.free_vibration import modes
    from frictionlab.recording import Recording

    known = scene_given(scene, settings, ("log",))
    recording = what if isinstance(what, Recording) else decay_of(Path(what), known)
    part = max(recording.stretches(), key=len)
    return modes(part.time, np.array([part.measured()[name] for name in masses_of(part)]))


def masses_of(recording: "Recording") -> list[str]:
    """The displacements of all masses, from mass 1 up."""
    found = recording.measured()
    return [name for name in ("mass_displacement", *(f"mass_{k}_displacement" for k in range(2, 100))) if name in found]


def decay_of(path: Path, scene: "Scene") -> "Recording":
    """A recording from its file, or one made of a log that may hold the mass alone."""
    from frictionlab.hdf5 import read_recording
    from frictionlab.logs import read_mass_log

    return read_recording(path) if is_recording_name(path) else read_mass_log(path, scene.log)
