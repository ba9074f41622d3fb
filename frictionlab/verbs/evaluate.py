"""Measurements -> what a whole campaign says."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path

import numpy as np

from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement, Traces
from frictionlab.campaign import Campaign, Trial, Watch, is_comparison, read_measurements, recording_path, trial_of
from frictionlab.campaign import evaluate as evaluate_trials
from frictionlab.experiment import facts_of
from frictionlab.hdf5 import read_recording
from frictionlab.inference.compare import AUTO
from frictionlab.inference.observations import CycleObservation, observe
from frictionlab.scene import Scene
from frictionlab.simulator.laws import law_of
from frictionlab.tables import Row
from frictionlab.verbs.inputs import AnyScene, FilePath, rows_of, scene_given

TABLES = ("model", "rig")
NO_TRACES = Traces(*[np.zeros(0)] * 10)  # what figures show of a measurement; a campaign of hundreds holds none


def evaluate(
    measurements: Iterable[Measurement | Row | FilePath] | FilePath,
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
    measurements : iterable, str or Path
        A file, or measurements, rows of them (failed ones too) and files that `frictionlab analyze` wrote, mixed;
        comparisons or files of them too: their ``laws`` tell which law each material requires.
    scene : Scene, str, Path or None
        ``[rig]`` stiffness turns friction ratios into forces and coefficients; ``[model]`` is what predictions hold;
        ``[experiment]`` gives the facts of each test by the name of its source.
    folders : iterable of str or Path
        Where recordings are looked for too, beside the measurements and where `frictionlab batch` puts them.
    law : str, optional
        In place of the scene's; "auto" finds the one that the tests of each material require together.
    workers : int, optional
        Processes that read the recordings; None takes what the machine has.
    watch : callable
        Wraps what is gone through, to show progress.
    **settings
        Keys of ``[model]`` and ``[rig]`` that win over the scene's.

    Raises
    ------
    UsageError, RecordingError
        A file does not hold measurements, or the law cannot be.
    SceneError
        The scene is refused.
    """
    known = _under(scene_given(scene, settings, TABLES), law)
    rows: list[Row] = []
    places = {Path(folder) for folder in folders}
    for what in [measurements] if isinstance(measurements, (str, PathLike)) else measurements:
        if isinstance(what, (Measurement, Mapping)):
            rows.append(what.row() if isinstance(what, Measurement) else what)
        else:
            rows += read_measurements(Path(what))
            places |= set(recordings_beside(Path(what)))
    comparisons = [row for row in rows if is_comparison(row)]
    measured = [row for row in rows if not is_comparison(row)]
    sources = {str(row["source"]) for row in measured}
    alone = [row for row in comparisons if str(row["source"]) not in sources]
    trials = [trial_of(row, facts_of(known, Path(str(row["source"]))).values) for row in (*measured, *alone)]
    return evaluate_trials(
        trials,
        known,
        folders=sorted(places),
        comparisons=comparisons,
        observations=observations_of(trials, known, folders=sorted(places), workers=workers),
        find_law=law == AUTO,
        watch=watch,
    )


def recordings_beside(table: Path) -> list[Path]:
    """Folders in which the recordings of a table of measurements may stand: its own, and where `batch` puts them."""
    here = table.parent
    return [here, *(place for place in (here / "recordings", here.parent / "recordings") if place.is_dir())]


def _under(scene: Scene, law: str | None) -> Scene:
    """The scene with another law; what it holds of its own law's parameters is none of the other's."""
    if law is None or law == AUTO or law_of(law).name == law_of(scene.model.law).name:
        return scene
    return scene.changed(model={"law": law_of(law).name, "parameters": {}})


def observations_of(
    trials: Sequence[Trial], scene: Scene, *, folders: Sequence[Path], workers: int | None = 1
) -> dict[str, CycleObservation]:
    """Return the mean cycle of each short test whose recording is at hand, by source.

    A mass that stands still says nothing of a law, and a long test drifts: both are passed over.
    """
    wanted = [t for t in trials if not t.failed and not t.is_long and t.regime != "stuck" and t.material]
    tests = {path: trial for trial in wanted if (path := recording_path(trial, folders)) is not None}
    rows = rows_of(list(tests), partial(_observed, scene=scene, tests=tests), workers=workers)
    found = [observation for row in rows if isinstance(observation := row.get("observation"), CycleObservation)]
    return {observation.measurement.source: observation for observation in found}


def _observed(path: Path, *, scene: Scene, tests: Mapping[Path, Trial]) -> Row:
    """What is done to each recording, here or where a worker is."""
    trial = tests[path]
    facts = {"source": trial.source, "material": trial.material, "normal_force_n": trial.normal_force_n}
    measured = replace(measure(read_recording(path), scene), **facts, traces=NO_TRACES)  # type: ignore[arg-type]
    return {"observation": observe(measured, scene)}
