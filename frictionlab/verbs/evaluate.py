"""Measurements -> what a whole campaign says."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from frictionlab.analysis.measurement import Measurement
from frictionlab.campaign import Campaign, Watch, is_comparison, read_measurements, trial_of
from frictionlab.campaign import evaluate as evaluate_trials
from frictionlab.errors import UsageError
from frictionlab.experiment import facts_of
from frictionlab.tables import Row
from frictionlab.verbs.given import AnyScene, FilePath, scene_given
from frictionlab.verbs.ladders import AUTO, ladders_of

TABLES = ("model", "rig")


def evaluate(
    measurements: Iterable[Measurement | Row | FilePath],
    scene: AnyScene = None,
    *,
    folders: Iterable[FilePath] = (),
    law: str | None = None,
    workers: int | None = 1,
    watch: Watch = iter,
    **settings: object,
) -> Campaign:
    """Evaluate a whole campaign: friction per material and force, Amontons' law, ranking, drift.

    Parameters
    ----------
    measurements : iterable
        Measurements, rows of measurements (failed ones too), or files that `frictionlab analyze` wrote, in any mixture;
        comparisons or files of them too: their ``laws`` tell which law each material requires.
    scene : Scene, str, Path or None
        ``[rig]`` stiffness turns friction ratios into forces and coefficients; ``[model]`` is what predictions hold;
        ``[experiment]`` gives the facts of each test by the name of its source.
    folders : iterable of str or Path
        Where recordings are looked for too, beside where the measurements stand.
    law : {"auto"}, optional
        Climb the ladder of laws of each short test from its recording, where no comparison given has done so.
    workers : int, optional
        Processes that do so; None takes what the machine has.
    watch : callable
        Wraps what is gone through, to show progress.
    **settings
        Keys of ``[model]`` and ``[rig]`` that win over the scene's.

    Raises
    ------
    UsageError, RecordingError
        A file does not hold measurements, or the law is another one.
    SceneError
        The scene is refused.
    """
    known = scene_given(scene, settings, TABLES)
    if law not in (None, AUTO):
        raise UsageError(f"campaign: law; expected auto, or the scene's own ([model] law) by giving none; got {law!r}")
    rows: list[Row] = []
    places = {Path(folder) for folder in folders}
    for what in measurements:
        if isinstance(what, (Measurement, Mapping)):
            rows.append(what.row() if isinstance(what, Measurement) else what)
        else:
            rows += read_measurements(Path(what))
            places.add(Path(what).parent)
    comparisons = [row for row in rows if is_comparison(row)]
    measured = [row for row in rows if not is_comparison(row)]
    sources = {str(row["source"]) for row in measured}
    alone = [row for row in comparisons if str(row["source"]) not in sources]
    trials = [trial_of(row, facts_of(known, Path(str(row["source"]))).values) for row in (*measured, *alone)]
    if law == AUTO:
        told = {str(row["source"]) for row in comparisons if row.get("laws")}
        untold = [trial for trial in trials if trial.source not in told]
        comparisons += ladders_of(untold, known, folders=sorted(places), workers=workers)
    return evaluate_trials(trials, known, folders=sorted(places), comparisons=comparisons, watch=watch)
