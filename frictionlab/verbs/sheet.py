"""A recording and its measurement -> one page in a file."""

from dataclasses import replace
from pathlib import Path

from frictionlab.analysis.measurement import Measurement
from frictionlab.campaign import trial_of
from frictionlab.files import make_folder
from frictionlab.recording import Recording
from frictionlab.report.sheet import Sheet, write_sheet
from frictionlab.verbs.given import AnyScene, FilePath, scene_given
from frictionlab.verbs.recordings import recording_given


def sheet(
    measurement: Measurement,
    what: Recording | FilePath,
    path: FilePath,
    scene: AnyScene = None,
    *,
    force: bool = False,
) -> Path:
    """Write the page of one test: its numbers, time response, loop, contact force, cycles, warnings.

    Parameters
    ----------
    measurement : Measurement
    what : Recording, str or Path
        What it was measured from.
    path : str or Path
        Ends in ``.html``; its folder is made if it is not there.
    scene : Scene, str, Path or None
        ``[rig]`` gives the stiffness, for newtons and joules.
    force : bool
        Replace a file of this name that is no page of this tool.

    Raises
    ------
    OutputError
        The file cannot be written or replaced.
    """
    known, place = scene_given(scene, {}, ()), Path(path)
    trial = replace(trial_of(measurement.row()), reason=None)  # a page needs no facts that a campaign needs
    make_folder(place.parent)
    page = Sheet(trial, known, measurement=measurement, recording=recording_given(what, known))
    write_sheet(page, place, force=force)
    return place
