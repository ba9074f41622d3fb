"""Measurements -> what a whole campaign says -> its tables, figures and report."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionlab.analysis.measurement import Measurement, measure
from frictionlab.campaign import Campaign, Watch
from frictionlab.campaign import evaluate as evaluate_trials
from frictionlab.campaign.files import read_measurements, recording_path, refuse_comparisons
from frictionlab.campaign.trials import Trial, trial_of
from frictionlab.errors import UsageError
from frictionlab.experiment import facts_of
from frictionlab.hdf5 import read_recording
from frictionlab.inference.compare import AUTO
from frictionlab.inference.force import ForceObservation, observe_force, with_force
from frictionlab.inference.observations import CycleObservation, observe
from frictionlab.scene import Scene
from frictionlab.simulator.laws import law_of
from frictionlab.tables import Row
from frictionlab.verbs.inputs import AnyScene, FilePath, files_of, rows_of, scene_given, tables_in

if TYPE_CHECKING:
    from frictionlab.figures.plates import Plate

TABLES = ("model", "rig")


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
        A file, or measurements, rows of them (failed ones too), files that `frictionlab analyze` wrote, folders, mixed.
    scene, **settings
        ``[rig]`` stiffness turns friction ratios into forces and coefficients; ``[model]`` is what predictions hold;
        ``[experiment]`` gives the facts of each test by the name of its source. Keys of the first two may be set.
    folders : iterable of str or Path
        Where recordings are looked for too, beside the measurements and where `frictionlab batch` puts them.
    law : str, optional
        In place of the scene's; "auto" finds the one that the tests of each material require together.
    workers, watch : optional
        Processes that read the recordings (None: what the machine has); wraps what is gone through, for progress.

    Raises
    ------
    UsageError, RecordingError
        A file does not hold measurements, the law cannot be, or something else is given (a recording).
    """
    known = scene_given(scene, settings, TABLES)
    if law not in (None, AUTO) and law_of(law).name != law_of(known.model.law).name:  # parameters are the other law's
        known = known.changed(model={"law": law_of(law).name, "parameters": {}})
    rows: list[Row] = []
    places = {Path(folder) for folder in folders}
    if isinstance(measurements, (str, PathLike, Mapping)) or not isinstance(measurements, Iterable):
        measurements = [measurements]
    for what in measurements:
        if isinstance(what, (Measurement, Mapping)):
            rows.append(what if isinstance(what, Mapping) else what.row())
        elif isinstance(what, (str, PathLike)):
            for path in files_of([Path(what)], tables_in):
                rows += read_measurements(path)
                places |= set(recordings_beside(path))
        else:
            raise UsageError(f"evaluate: expected measurements, rows or files of them; got a {type(what).__name__}")
    refuse_comparisons(rows, "evaluate")
    trials = [trial_of(row, facts_of(known, Path(str(row["source"]))).values) for row in rows]
    # the mean cycle of each test that moves and whose recording is at hand: of a long one where its group has no short
    short = {t.group for t in trials if not (t.failed or t.is_long)}
    wanted = [t for t in trials if not (t.failed or t.regime == "stuck" or (t.is_long and t.group in short))]
    tests = {there: trial for trial in wanted if (there := recording_path(trial, sorted(places))) is not None}
    observed = rows_of(list(tests), partial(_observed, scene=known, tests=tests), workers=workers)
    found = [one for row in observed if isinstance(one := row.get("observation"), (CycleObservation, ForceObservation))]
    return evaluate_trials(
        trials,
        known,
        folders=sorted(places),
        observations={observation.source: observation for observation in found},
        find_law=law == AUTO,
        watch=watch,
    )


def recordings_beside(table: Path) -> list[Path]:
    """Folders in which the recordings of a table of measurements may stand: its own, and where `batch` puts them."""
    here = table.parent
    return [here, *(place for place in (here / "recordings", here.parent / "recordings") if place.is_dir())]


def _observed(path: Path, *, scene: Scene, tests: Mapping[Path, Trial]) -> Row:
    """What is done to each recording, here or where a worker is."""
    trial = tests[path]
    facts: Any = {"source": trial.source, "material": trial.material, "normal_force_n": trial.normal_force_n}
    measured = replace(measure(read_recording(path), scene), **facts)
    if scene.rig.kind != "prescribed":
        return {"observation": with_force(observe(measured, scene), measured, scene)}
    return {"observation": observe_force(measured, scene)}


def publish(
    campaign: Campaign,
    folder: FilePath,
    *,
    force: bool = False,
    watch: "Callable[[Sequence[Plate]], Iterable[Plate]]" = iter,
) -> Path:
    """Write a campaign's tables, figures and report into a folder, and return the report's path.

    Parameters
    ----------
    campaign : Campaign
        What `evaluate` returns.
    folder : str or Path
        Made if it is not there.
    force : bool
        Replace files of these names that are not an earlier campaign's.
    watch : callable, optional
        Wraps the figures while they are drawn, to show progress.

    Raises
    ------
    OutputError
        The folder cannot be written, or holds other files of these names.
    """
    from frictionlab.campaign import write_tables
    from frictionlab.campaign.files import REPORT, check_folder
    from frictionlab.figures import check_figures
    from frictionlab.figures.plates import plates
    from frictionlab.report import write_report
    from frictionlab.report.page_of_test import write_sheets

    place = Path(folder)
    check_folder(place, force=force)
    drawn = plates(campaign)
    check_figures([path for plate in drawn for path in plate.files(place / "figures")], force=force)
    write_tables(campaign, place)
    for plate in watch(drawn):
        plate.save(place / "figures", force=force)
    write_report(campaign, drawn, place)
    write_sheets(campaign, place / "tests", force=force)
    return place / REPORT
