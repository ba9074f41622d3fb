"""A recording from whatever a verb is given: one as it is, one from its file, or one made of a log."""

from pathlib import Path

import frictionlab
from frictionlab.hdf5 import read_recording
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.verbs.given import FilePath, is_recording_name


def recording_given(what: Recording | FilePath, scene: Scene) -> Recording:
    """The recording that is meant; what reads logs is loaded for a log alone."""
    if isinstance(what, Recording):
        return what
    path = Path(what)
    return read_recording(path) if is_recording_name(path) else frictionlab.ingest(path, scene)
