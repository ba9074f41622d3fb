"""One test's own friction ratio, and what the sensors and the rig, which all tests share, do to it.

Errors that each test makes anew fall with the number of tests; a gain, a lag or a natural frequency that is wrong is
wrong in all of them. So each test has an error of its own and *shifts*: by how much one standard uncertainty of a
shared source moves its estimate. The shifts of a group are the weighted means of its tests' shifts, and do not fall.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.campaign.prediction import Local
from frictionlab.campaign.trials import Trial
from frictionlab.uncertainty import Sources

FloatArray = NDArray[np.float64]
MODEL_FLOOR = 0.002  # relative: no model is better than this
RATIO_FLOOR = 0.0005  # relative: of a frequency ratio where nobody tells how well the natural frequency is known
GAIN = "gain and linearity of the sensors"
LAG = "lag between the channels"
CROSSTALK = "crosstalk"
FREQUENCY = "natural frequency"
SIGNED = (GAIN, FREQUENCY)  # the others turn their sign from test to test, nobody knows how: their worst is taken
RIG = (GAIN, LAG, CROSSTALK, FREQUENCY)


@dataclass(frozen=True)
class Own:
    """What one test says: ``step`` from the present friction ratio to its own.

    ``error``: its own standard error, with misfit; ``whole``: with the shared sources, as it weighs; ``misfit``: by
    which factor energy and amplitude contradict each other beyond their errors, at least 1; ``shifts``: of the step by
    one standard uncertainty of each shared source.
    """

    step: float
    error: float
    whole: float
    misfit: float
    shifts: Mapping[str, float]

    def scaled(self, factor: float) -> "Own":
        """The same for a friction ratio in another unit."""
        shifts = {source: shift * factor for source, shift in self.shifts.items()}
        return Own(self.step * factor, self.error * factor, self.whole * factor, self.misfit, shifts)


def own_estimate(trial: Trial, here: Local, sources: Sources | None) -> Own | None:
    """Generalized least squares of energy and amplitude; None where neither tells the friction ratio."""
    measured = np.array(trial.mean)
    noise = np.diag(np.hypot(trial.mean_se, MODEL_FLOOR * measured) ** 2)
    shared = _moved(trial, here, sources)
    floor = 0.0 if shared[FREQUENCY].any() else RATIO_FLOOR * trial.r
    noise += np.outer(here.by_r, here.by_r) * math.hypot(trial.frequency_ratio_se or 0.0, floor) ** 2
    weight = np.linalg.inv(noise + sum(np.outer(v, v) for v in shared.values()))
    information = float(here.by_beta @ weight @ here.by_beta)
    if not information > 0.0:
        return None
    gain = here.by_beta @ weight / information
    gap = measured - np.array([here.here.energy, here.here.amplitude])
    step = float(gain @ gap)
    left = gap - here.by_beta * step
    misfit = math.sqrt(max(1.0, float(left @ weight @ left)))
    error = misfit * math.sqrt(float(gain @ noise @ gain))
    shifts = {source: float(gain @ v) for source, v in shared.items()}
    return Own(step, error, math.hypot(error, *shifts.values()), misfit, shifts)


def _moved(trial: Trial, here: Local, sources: Sources | None) -> dict[str, FloatArray]:
    """What one standard uncertainty of each shared source does to energy and amplitude (2,).

    What moves both alike is a gain; what is left of the energy's uncertainty a lag, of the amplitude's a crosstalk.
    """
    energy, amplitude = trial.mean
    of_energy, of_amplitude = _relative(trial, sources)
    both = min(of_energy, of_amplitude)
    return {
        GAIN: both * np.array([energy, amplitude]),
        LAG: np.array([energy * math.sqrt(of_energy**2 - both**2), 0.0]),
        CROSSTALK: np.array([0.0, amplitude * math.sqrt(of_amplitude**2 - both**2)]),
        FREQUENCY: -here.by_r * _ratio_uncertainty(trial, sources),
    }


def _relative(trial: Trial, sources: Sources | None) -> tuple[float, float]:
    """Relative uncertainty of energy and amplitude: as measured, else from the scene with the worst that a lag does."""
    of_energy, of_amplitude = trial.systematic
    gain = 0.0 if sources is None else math.hypot(sources.gain, sources.linearity)
    late = 0.0
    if sources is not None and math.isfinite(trial.drive_frequency_hz):
        energy, amplitude = trial.mean
        late = math.pi * amplitude / energy * 2.0 * math.pi * trial.drive_frequency_hz * sources.lag
    return (
        math.hypot(gain, late) if of_energy is None else of_energy,
        gain if of_amplitude is None else of_amplitude,
    )


def _ratio_uncertainty(trial: Trial, sources: Sources | None) -> float:
    ratio = trial.ratio
    if ratio.u is not None:
        return math.sqrt(max(ratio.u**2 - (ratio.se or 0.0) ** 2, 0.0))
    return 0.0 if sources is None else sources.natural_frequency * trial.r


def pooled_shifts(shifts: Iterable[Mapping[str, float]], weight: FloatArray) -> dict[str, float]:
    """Shifts of a weighted mean: with their signs where these are known, else as if all tests moved the same way."""
    each, share = list(shifts), weight / weight.sum()
    found = {}
    for source in RIG:
        moved = np.array([s.get(source, 0.0) for s in each])
        found[source] = float(share @ (moved if source in SIGNED else np.abs(moved)))
    return found
