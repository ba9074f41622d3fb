"""One test: log -> recording -> measurement -> comparison, explanation; a free decay -> the frame's own facts.

Whatever a verb does, it raises SceneError or UsageError where the scene or a setting is refused, LogError or
RecordingError where a file cannot be read; its docstring says what else. ``scene``: a Scene, its path, or None.
"""

import math
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from frictionlab.errors import AnalysisError, OutputError, UsageError
from frictionlab.files import refuse_inputs
from frictionlab.hdf5 import check_writable, is_recording, read_recording, write_recording
from frictionlab.recording import FrequencyTable, Recording
from frictionlab.verbs.inputs import AnyScene, FilePath, is_recording_name, scene_given

if TYPE_CHECKING:
    from collections.abc import Callable

    from frictionlab.analysis.free_vibration import FreeVibration, Mode
    from frictionlab.analysis.measurement import Measurement
    from frictionlab.inference.comparison import Comparison, Fitted
    from frictionlab.inference.explain import Explanation
    from frictionlab.inference.material_law import MaterialLaw
    from frictionlab.scene import LogOptions, Scene

NO_PENDULUM = 'natural_frequency_hz: the spring is taken as linear; of a pendulum say [rig] restoring = "pendulum"'
JUDGED = ("model", "analysis", "rig")
"""Tables of a scene whose keys `compare` and `explain` take as settings."""


def ingest(
    log: FilePath,
    scene: AnyScene = None,
    *,
    base_log: FilePath | None = None,
    output: FilePath | None = None,
    force: bool = False,
    **settings: object,
) -> "Recording":
    r"""Read a log, whatever its dialect and damage, into a recording in SI units.

    Parameters
    ----------
    log : str or Path
        The log; of a pair of logs, the mass's; or a recording, whose facts are the scene's then.
    scene : Scene, str, Path or None
        ``[log]`` says what the log does not say itself; ``[experiment]`` gives the facts of its test.
    base_log : str or Path, optional
        The log of the base, where each sensor has its own; by default what the scene's sheet names.
    output : str or Path, optional
        Write the recording here too (HDF5), whole or not at all.
    force : bool
        Replace whatever file stands there; else only a recording of the same log.
    **settings
        Keys of ``[log]`` and ``[experiment]`` that win over the scene's: ``unit="mm"``, ``material="steel"``.

    Raises
    ------
    LogError
        The log cannot be read, can be read in more than one way, or is damaged beyond use.
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
    from frictionlab.experiment import base_log_of, facts_of
    from frictionlab.logs import read_log, read_two_logs

    known = scene_given(scene, settings, ("log", "experiment"))
    place, facts = None if output is None else Path(output), facts_of(known, Path(log))
    base = base_log_of(facts.values, Path(log)) if base_log is None else Path(base_log)
    if place is not None:
        refuse_inputs([place], [Path(log), *([] if base is None else [base]), *known.files])
        check_writable(place, force=force)
    if base_log is None and is_recording_name(Path(log)) and is_recording(Path(log)):
        read = read_recording(Path(log))
    else:
        read = read_log(Path(log), known.log) if base is None else read_two_logs(Path(log), base, known.log)
    source = replace(read.source, warnings=(*read.source.warnings, *facts.warnings))
    recording = read.changed(source=source, experiment=facts.values)
    if place is not None:
        if not force and place.exists() and is_recording(place):  # the same bytes may be read again
            made = (read_recording(place), recording)
            old, now = ([(f.name, f.sha256) for f in each.source.files] for each in made)
            if old and old != now:
                what = "of other bytes" if old[0][0] == now[0][0] else f"got {now[0][0]}"
                raise OutputError(f"{place}: holds the recording of {old[0][0]}; {what}: name another, or give --force")
        write_recording(recording, place, force=force)
    return recording


def analyze(what: "Measurement | Recording | FilePath", scene: AnyScene = None, **settings: object) -> "Measurement":
    """Measure one test: drive, response, energy per cycle, irregularity, stops, regime, each with its error.

    Parameters
    ----------
    what : Measurement, Recording, str or Path
        A recording, its file, or a log; what is measured already is returned as it is.
    scene : Scene, str, Path or None
        ``[analysis]`` says which part is measured and how; ``[rig]`` gives natural frequency and stiffness where known.
    **settings
        Keys of ``[analysis]``, ``[rig]`` and ``[model]`` that win over the scene's: ``natural_frequency_hz=3.13``,
        ``transient_s=10.0``, ``cycles="all"``, ``padding=8``.

    Raises
    ------
    AnalysisError
        The test holds no measurement: no drive, shorter than its transient, no full cycle.
    UsageError
        What is measured already left out another transient than is asked for.
    """
    from frictionlab.analysis.measurement import Measurement, measure

    known = scene_given(scene, settings, ("analysis", "rig", "model"))
    if isinstance(what, Measurement):
        asked = known.analysis.transient_s
        if asked is not None and abs(asked - what.transient_s) * what.sampling_rate_hz > 1.0:
            made = f"the measurement was made with {what.transient_s:g} s"
            raise UsageError(f"analysis.transient_s = {asked:g}: {made}: give the recording in its place")
        return what
    recording = recording_given(what, known)
    try:
        return measure(recording, known)
    except AnalysisError as error:  # a time in another unit than the log says would be the cause
        doubts = [said for said in recording.source.warnings if said.startswith("time: ")]
        if not doubts:
            raise
        raise AnalysisError("; ".join([str(error), *doubts])) from error


def recording_given(
    what: "Recording | FilePath", scene: "Scene", read: "Callable[[Path, LogOptions], Recording] | None" = None
) -> "Recording":
    """The recording that is meant: one as it is, one from its file, or one made of a log.

    ``read``: reads a log that need not hold both channels, `read_mass_log` or `read_base_log`.
    """
    if isinstance(what, Recording):
        return what
    if is_recording_name(Path(what)):
        return read_recording(Path(what))
    return ingest(what, scene) if read is None else read(Path(what), scene.log)


def frequency_table_given(what: object, scene: "Scene") -> "FrequencyTable | None":
    """The table over frequency that is meant: one as it is, or that of a file; None for anything else."""
    if isinstance(what, FrequencyTable):
        return what
    if not isinstance(what, str | PathLike) or is_recording_name(path := Path(what)) or not path.is_file():
        return None
    from frictionlab.logs.frequencies import read_frequency_table

    return read_frequency_table(path, scene.log)


def compare(
    what: "Measurement | Recording | FrequencyTable | FilePath",
    scene: AnyScene = None,
    *,
    law: str | None = None,
    friction_ratio: float | None = None,
    law_file: "MaterialLaw | FilePath | None" = None,
    whole: bool = False,
    fit: "Fitted" = "cycle",
    **settings: object,
) -> "Comparison":
    """Identify the friction of a test, predict its steady cycle with the simulator, and say how they differ.

    Parameters
    ----------
    what : Measurement, Recording, str or Path
        What is measured already, a recording, its file, a log, or a table over frequency (columns ``r`` or ``frequency
        [Hz]``, ``amplitude [Y]`` or ``[mm]``, ``phase [deg]``, each with its standard uncertainty as ``NAME_u``).
    scene : Scene, str, Path or None
        ``[rig]`` gives the natural frequency (and stiffness, for newtons), ``[model]`` the physics.
    law : str, optional
        In place of the scene's: ``"coulomb+place+speed"``; ``"auto"`` finds the simplest law that explains the test.
    friction_ratio : float, optional
        Predict with this friction ratio (beta, eq. 2.8) instead of identifying it.
    law_file : MaterialLaw, str or Path, optional
        Judge the test by the law of its material, found elsewhere: fitted are only values that scatter between tests.
    whole : bool
        Compare the whole record too, from its first sample, driven by the measured base: `record_nrmse`,
        `record_energy_difference` and ``record``.
    fit : {"cycle", "whole"}
        What the law's parameters are fitted to; a record without a steady cycle (a sweep, a start-up) only "whole".
    **settings
        Keys of ``[model]``, ``[analysis]`` and ``[rig]`` that win over the scene's: ``solver="exact"``.

    Raises
    ------
    AnalysisError
        No measurement can be made, or the natural frequency is not known.
    """
    from frictionlab.analysis.measurement import Measurement
    from frictionlab.inference.compare import AUTO, compare_measurement, compare_record, compare_table, judge
    from frictionlab.inference.material_law import MaterialLaw, read_material_law

    known = scene_given(scene, settings, JUDGED)
    if friction_ratio is not None and not 0.0 <= friction_ratio < math.inf:
        raise UsageError(f"friction ratio: expected a number of at least 0; got {friction_ratio:g}")
    if friction_ratio is not None and law == AUTO:
        raise UsageError("friction ratio: a given one (--beta) and a law to be found (--law auto) exclude each other")
    table = frequency_table_given(what, known)
    if table is not None:
        if law_file is not None or whole or fit == "whole":
            raise UsageError(f"{table.source}: a table over frequency: expected neither law_file, whole nor fit")
        from frictionlab.experiment import facts_of

        facts = facts_of(known, Path(what if isinstance(what, str | PathLike) else table.source)).values
        return compare_table(table, known, facts, law=law, friction_ratio=friction_ratio)
    if TYPE_CHECKING:
        assert not isinstance(what, FrequencyTable)
    if law_file is not None:
        if whole or fit == "whole":
            predict = "`frictionlab predict --law-file LAW --base-motion RECORDING` predicts a whole record"
            raise UsageError(f"law_file: expected neither whole nor fit: {predict}")
        if law is not None or friction_ratio is not None:
            raise UsageError("law_file: a given law leaves nothing to find: give neither law nor beta")
        known_law = law_file if isinstance(law_file, MaterialLaw) else read_material_law(law_file)
        return judge(analyze(what, known), known, known_law)
    if not whole and fit == "cycle":
        return compare_measurement(analyze(what, known), known, law=law, friction_ratio=friction_ratio)
    if isinstance(what, Measurement):
        raise UsageError("compare: the whole record; expected a recording, its file or a log; got a measurement")
    from frictionlab.simulator.problem import OverspentError

    recording = recording_given(what, known)
    try:
        return compare_record(recording, known, law=law, friction_ratio=friction_ratio, fit=fit)
    except OverspentError as error:
        do = "name a law (--law coulomb+place+speed) in place of auto" if law == AUTO else "choose a simpler law"
        raise AnalysisError(f"{error} before the whole record is fitted: {do}, or --fit cycle --whole") from error


def explain(
    what: "Comparison | Measurement | Recording | FilePath", scene: AnyScene = None, **settings: object
) -> "Explanation":
    """Say which contact law a test requires, what it is made of in newtons, and what the next simpler law leaves.

    Parameters and settings as of `compare`; a comparison is put into words as it is. Returned is an `Explanation`:
    ``print(explanation.text)``; its ``comparison`` is that of ``compare(what, scene, law="auto")``.

    Raises
    ------
    AnalysisError
        No measurement can be made, the natural frequency is not known, or a comparison has no steady cycle.
    UsageError
        A law is given: explain finds it.
    """
    from frictionlab.inference.comparison import Comparison
    from frictionlab.inference.explain import explain as explain_measurement
    from frictionlab.inference.explain import explain_comparison

    if "law" in settings:
        raise UsageError("law: explain finds the law; expected none; got one: explain(compare(..., law=...)) keeps it")
    known = scene_given(scene, settings, JUDGED)
    if isinstance(what, Comparison):
        return explain_comparison(what)
    return explain_measurement(analyze(what, known), known)


def free_vibration(
    what: "Recording | FilePath", scene: AnyScene = None, **settings: object
) -> "tuple[FreeVibration, ...]":
    """Natural frequency, viscous damping ratio and friction of each free decay in a record, in the order of time.

    Parameters
    ----------
    what : Recording, str or Path
        A recording, its file, or a log; a log of the mass alone has a base at rest.
    scene, **settings
        ``[log]`` and its keys; ``[rig] restoring = "pendulum"``: angles, whose restoring torque is a sine.

    Raises
    ------
    AnalysisError
        There is no free decay.
    """
    from frictionlab.analysis.free_vibration import FreeVibration, free_vibrations
    from frictionlab.logs import read_mass_log

    known = scene_given(scene, settings, ("log",))
    recording = recording_given(what, known, read_mass_log)
    pendulum = known.rig.restoring == "pendulum"
    measured = recording.measured()
    able = ("angle",) if pendulum else ("mass_displacement", "angle", "mass_acceleration", "mass_velocity")
    mass = next((name for name in able if name in measured), None)
    if mass is None:
        wanted = "the angle of a pendulum" if pendulum else "the mass's displacement, velocity or acceleration"
        raise UsageError(f"free vibration: expected {wanted}; got {', '.join(measured)}: name its column in ingest")
    of_base = "base_displacement" if mass == "angle" else mass.replace("mass", "base")
    order = {"mass_velocity": 1, "mass_acceleration": 2}.get(mass, 0)
    taps: list[FreeVibration] = []
    refused: list[AnalysisError] = []
    for part in sorted(recording.stretches(), key=len, reverse=True):
        try:
            found = part.measured()
            taps += free_vibrations(part.time, found[mass], found.get(of_base), pendulum=pendulum, order=order)
        except AnalysisError as error:  # a stretch without a decay is passed over where another has some
            refused.append(error)
    if not taps:
        raise refused[0]
    if mass == "angle":
        said = () if pendulum else (NO_PENDULUM,)
        taps = [replace(tap, unit="rad", warnings=(*tap.warnings, *said)) for tap in taps]
    return tuple(sorted(taps, key=lambda tap: tap.start_s))


def modes(what: "Recording | FilePath", scene: AnyScene = None, **settings: object) -> "tuple[Mode, ...]":
    """Frequency, damping ratio and shape of each mode of a frame of several masses, from its free decay.

    Parameters and errors as of `free_vibration`; UsageError, too, where fewer than two masses were measured.
    """
    from frictionlab.analysis.channels import other_masses
    from frictionlab.analysis.free_vibration import modes as fitted
    from frictionlab.logs import read_mass_log

    recording = recording_given(what, scene_given(scene, settings, ("log",)), read_mass_log)
    part = max(recording.stretches(), key=len)
    measured = part.measured()
    if not (others := other_masses(measured)) or "mass_displacement" not in measured:
        raise UsageError(f"modes: expected the displacements of two masses or more; got {', '.join(measured)}")
    return fitted(part.time, np.array([measured[name] for name in ("mass_displacement", *others)]))
