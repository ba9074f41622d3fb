"""What a test says of friction: the law that is identified, its prediction, and a short text about both."""

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from frictionlab.errors import UsageError
from frictionlab.verbs.inputs import (
    AnyScene,
    FilePath,
    frequency_table_given,
    measurement_given,
    recording_given,
    scene_given,
)

if TYPE_CHECKING:
    from frictionlab.analysis.measurement import Measurement
    from frictionlab.inference import Comparison, Fitted
    from frictionlab.inference.explain import Explanation
    from frictionlab.inference.material_law import MaterialLaw
    from frictionlab.recording import FrequencyTable, Recording

JUDGED = ("model", "analysis", "rig")
"""Tables of a scene whose keys these verbs take as settings."""


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
    LogError, RecordingError, SceneError, UsageError
        The file, the scene or a setting is refused.
    """
    from frictionlab.analysis.measurement import Measurement
    from frictionlab.inference import compare as compare_recording
    from frictionlab.inference import predict
    from frictionlab.inference.compare import judge
    from frictionlab.inference.material_law import MaterialLaw, read_material_law

    known = scene_given(scene, settings, JUDGED)
    table = frequency_table_given(what, known)
    if table is not None:
        if law_file is not None or whole or fit == "whole":
            raise UsageError(f"{table.source}: a table over frequency: expected neither law_file, whole nor fit")
        from frictionlab.experiment import facts_of
        from frictionlab.inference.over_frequency import compare_table

        facts = facts_of(known, Path(what if isinstance(what, str | PathLike) else table.source)).values
        return compare_table(table, known, facts, law=law, friction_ratio=friction_ratio)
    if TYPE_CHECKING:
        assert not isinstance(what, FrequencyTable)
    if law_file is not None:
        if law is not None or friction_ratio is not None or whole or fit == "whole":
            raise UsageError("law_file: a given law leaves nothing to find: give neither law, beta, whole nor fit")
        known_law = law_file if isinstance(law_file, MaterialLaw) else read_material_law(law_file)
        return judge(measurement_given(what, known), known, known_law)
    if not whole and fit == "cycle":
        return predict(measurement_given(what, known), known, law=law, friction_ratio=friction_ratio)
    if isinstance(what, Measurement):
        raise UsageError("compare: the whole record; expected a recording, its file or a log; got a measurement")
    recording = recording_given(what, known)
    return compare_recording(recording, known, law=law, friction_ratio=friction_ratio, whole=whole, fit=fit)


def explain(
    what: "Comparison | Measurement | Recording | FilePath", scene: AnyScene = None, **settings: object
) -> "Explanation":
    """Say which contact law a test requires, what it is made of in newtons, and what the next simpler law gets wrong.

    Parameters
    ----------
    what : Comparison, Measurement, Recording, str or Path
        A comparison, which is put into words as it is; what is measured already, a recording, its file, or a log.
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
    from frictionlab.inference import Comparison
    from frictionlab.inference.explain import explain as explain_measurement
    from frictionlab.inference.explain import explain_comparison

    known = scene_given(scene, settings, JUDGED)
    if isinstance(what, Comparison):
        return explain_comparison(what)
    return explain_measurement(measurement_given(what, known), known)
