"""What a recording, and else its scene, say about a test: its logs, its contact, its sensors."""

import math
from collections.abc import Iterator

from frictionlab.analysis import restoring
from frictionlab.recording import Fact, Recording
from frictionlab.scene import Scene
from frictionlab.uncertainty import Sources, sources_of


def channels_of(scene: Scene) -> tuple[restoring.Channel, restoring.Channel]:
    """The ways of mass and base into the log, as the scene declares them."""
    s = scene.sensors
    mass = restoring.Channel(0.0, s.mass_filter_hz or s.filter_hz, s.mass_filter_order or s.filter_order)
    return mass, restoring.Channel(s.lag_s, s.base_filter_hz or s.filter_hz, s.base_filter_order or s.filter_order)


def of_the_force(recording: Recording) -> Iterator[str]:
    """Say so where the normal force of a recording is none."""
    force = recording.experiment.get("normal_force_n")
    if force is not None and not _is_force(force):
        yield f"normal_force_n: expected a number above 0; got {force!r} in the recording: it is not used"


def _is_force(value: Fact) -> bool:
    return isinstance(value, (int, float)) and math.isfinite(value) and value > 0.0


def source_of(recording: Recording) -> str:
    """The names of the logs that a recording was made of."""
    return ", ".join(f.name for f in recording.source.files)


def material_of(recording: Recording, scene: Scene) -> str | None:
    """Material of a test's contact, as the recording has it, else the scene."""
    value = recording.experiment.get("material", scene.experiment.material)
    return None if value is None else str(value)


def normal_force_of(recording: Recording, scene: Scene) -> float | None:
    """Normal force of a test [N], as the recording has it, else the scene."""
    value = recording.experiment.get("normal_force_n", scene.experiment.normal_force_n)
    return float(value) if value is not None and _is_force(value) else None


def of_sensors_and_rig(recording: Recording, scene: Scene, sampling_rate_hz: float) -> Sources:
    """What is not known of the sensors and the rig of a test."""
    lag = recording.source.dialect.get("lag_s_u")
    lag_s_u = lag if isinstance(lag, float) else None
    return sources_of(scene, sampling_rate_hz, normal_force_n=normal_force_of(recording, scene), lag_s_u=lag_s_u)
