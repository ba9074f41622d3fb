"""Log -> recording, with the facts that its scene has for it."""

from dataclasses import replace
from pathlib import Path

from frictionlab.experiment import facts_of
from frictionlab.files import refuse_inputs
from frictionlab.hdf5 import check_writable, write_recording
from frictionlab.logs import read_log, read_two_logs
from frictionlab.logs.lines import Progress
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.verbs.given import AnyScene, FilePath, scene_given

TABLES = ("log", "experiment")


def ingest(
    log: FilePath,
    scene: AnyScene = None,
    *,
    base_log: FilePath | None = None,
    output: FilePath | None = None,
    force: bool = False,
    progress: Progress | None = None,
    **settings: object,
) -> Recording:
    r"""Read a log, whatever its dialect and damage, into a recording in SI units.

    Parameters
    ----------
    log : str or Path
        The log; of a pair of logs, the mass's.
    scene : Scene, str, Path or None
        ``[log]`` says what the log does not say itself; ``[experiment]`` gives the facts of its test.
    base_log : str or Path, optional
        The log of the base, where each sensor has its own.
    output : str or Path, optional
        Write the recording here too (HDF5), whole or not at all.
    force : bool
        Replace whatever file stands there; else only a recording.
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
    known = scene_given(scene, settings, TABLES)
    if output is not None:
        refuse_inputs([Path(output)], [*(Path(part) for part in (log, base_log) if part is not None), *known.files])
        check_writable(Path(output), force=force)
    recording = _read(Path(log), None if base_log is None else Path(base_log), known, progress)
    if output is not None:
        write_recording(recording, Path(output), force=force)
    return recording


def _read(log: Path, base_log: Path | None, scene: Scene, progress: Progress | None) -> Recording:
    facts = facts_of(scene, log)
    if base_log is None:
        recording = read_log(log, scene.log, progress=progress)
    else:
        recording = read_two_logs(log, base_log, scene.log, progress=progress)
    source = replace(recording.source, warnings=(*recording.source.warnings, *facts.warnings))
    return replace(recording, source=source, experiment=facts.values)
