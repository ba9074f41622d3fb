"""The law of a material -> what tests not made would show."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from frictionlab.errors import UsageError
from frictionlab.verbs.inputs import FilePath, is_recording_name

if TYPE_CHECKING:
    from frictionlab.inference.material_law import MaterialLaw
    from frictionlab.inference.predictive import Prediction
    from frictionlab.recording import Recording


def predict(
    law: "MaterialLaw | FilePath",
    r: float | Sequence[float] | None = None,
    *,
    normal_force_n: float | None = None,
    base_amplitude_m: float | None = None,
    base_motion: FilePath | None = None,
    draws: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> "Prediction":
    """Predict tests not made by the law of their material: motion, amplitude, energy, stops, each with a 95 % band.

    The bands hold the errors of the law and the scatter from test to test.

    Parameters
    ----------
    law : MaterialLaw, str or Path
        A ``law_MATERIAL.toml`` that a campaign wrote.
    r : float or sequence of float, optional
        Frequency ratios; by default the middle of those that were tested.
    normal_force_n, base_amplitude_m : float, optional
        By default the middle of those that were tested.
    base_motion : str or Path, optional
        A recording or a log whose base, from rest, drives the mass, in place of a steady drive.
    draws : int, optional
        Motions behind each band.
    progress : callable, optional
        Called with tests predicted and tests in all.

    Raises
    ------
    UsageError
        The file is no law of a material, or a number is impossible.
    LogError, RecordingError
        The base's motion cannot be read, or has a gap.

    Examples
    --------
    >>> from frictionlab.inference.material_law import example_law
    >>> predict(example_law(), r=0.5, normal_force_n=4.0, draws=20).tests[0].regime
    'stick-slip'
    """
    from frictionlab.inference.material_law import MaterialLaw, read_material_law
    from frictionlab.inference.predictive import predict_record, predict_tests

    known = law if isinstance(law, MaterialLaw) else read_material_law(law)
    given = {"normal_force_n": normal_force_n, "base_amplitude_m": base_amplitude_m}
    test = {name: _positive(known, name, value) for name, value in given.items()}
    if base_motion is not None:
        if r is not None or base_amplitude_m is not None:
            raise UsageError("base_motion: a recorded base has its own amplitude and times: give neither r nor Y")
        found = _base_of(Path(base_motion))
        more = {} if draws is None else {"draws": draws}
        return predict_record(known, found, normal_force_n=test["normal_force_n"], **more)
    ratios = _positive(known, "frequency_ratio", None) if r is None else r
    several = [float(ratios)] if isinstance(ratios, int | float) else [float(x) for x in ratios]
    return predict_tests(
        known,
        several,
        normal_force_n=test["normal_force_n"],
        base_amplitude_m=test["base_amplitude_m"],
        draws=draws,
        progress=progress,
    )


def _positive(law: "MaterialLaw", name: str, value: float | None) -> float:
    """A number of the test, by default the middle of those that the law was found under."""
    if value is None:
        if name not in law.conditions:
            raise UsageError(
                f"{name}: expected a number; got none, and the law of {law.material} says none of its tests"
            )
        value = 0.5 * sum(law.conditions[name])
    if not 0.0 < value < math.inf:
        raise UsageError(f"{name}: expected a finite number above 0; got {value:g}")
    return float(value)


def _base_of(path: Path) -> "Recording":
    from frictionlab.hdf5 import read_recording
    from frictionlab.logs import read_base_acceleration, read_base_log

    if is_recording_name(path):
        return read_recording(path)
    if read_base_acceleration(path) is not None:
        raise UsageError(f"{path}: expected the base's displacement; got its acceleration: integrate it first")
    return read_base_log(path)
