"""A predicted steady state as the two sensors would show it, through the gain and lag that the fit found; judged."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.filters import in_band
from frictionlab.analysis.measurement import Measurement
from frictionlab.identification.comparison import Verdict
from frictionlab.identification.forward import BENDS, bent, through
from frictionlab.identification.identify import Identified
from frictionlab.identification.observed import EXPLAINED
from frictionlab.simulator import SteadyState, observe

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Prediction:
    """What two sensors would show of the predicted state: the cycle (p,) about its mean, energy and amplitude."""

    cycle: FloatArray | None
    energy: float | None
    amplitude: float | None


def seen(measurement: Measurement, found: Identified, state: SteadyState) -> Prediction:
    """The prediction as the sensors would show it: through the gain and the lag that the fit found."""
    shown, values = observe(state), found.fit.values
    if state.orbit is None:
        return Prediction(None, shown.energy_per_cycle, shown.response_amplitude)
    tau, turns = measurement.cycle.tau, state.period_cycles or 1
    plain = np.stack([state.orbit.at(tau + 2.0 * math.pi * turn)[0] for turn in range(turns)]).mean(axis=0)
    gain, lag = through(complex(np.fft.rfft(plain)[1]) * 2.0 / len(plain), values)
    amplitude = None if shown.response_amplitude is None else gain * shown.response_amplitude
    whole = np.stack([state.orbit.at(tau + lag + 2.0 * math.pi * turn)[0] for turn in range(turns)])
    cycle = gain * whole.mean(axis=0) + values.get("base_in_mass", 0.0) * np.cos(tau)
    for power, name in BENDS.items():
        cycle = cycle + values.get(name, 0.0) * bent(cycle, power)
    moved = 0.0
    if gain != 1.0 or lag != 0.0:
        moved = _area(cycle, state) - _area(plain, state)
    energy = None if shown.energy_per_cycle is None else shown.energy_per_cycle + moved
    return Prediction(in_band(cycle - cycle.mean(), measurement.cycle.kept), energy, amplitude)


def _area(cycle: FloatArray, state: SteadyState) -> float:
    """Loop area of a cycle (p,) over the simulated base: the integral of f dx, by their harmonics."""
    base = state.problem.base
    count = min(base.harmonics, len(cycle) // 2 - 1)
    lines = np.fft.rfft(cycle)[1 : count + 1] * (2.0 / len(cycle))
    return float(math.pi * np.sum(np.arange(1, count + 1) * (np.conj(base.lines[:count]) * 1j * lines).real))


def nrmse_of(measured: FloatArray, predicted: FloatArray) -> float:
    """Rms of measured minus predicted, both about their means, over the rms of the measured."""
    gap = measured - measured.mean() - (predicted - predicted.mean())
    return float(np.sqrt(np.mean(gap**2) / np.mean((measured - measured.mean()) ** 2)))


@dataclass(frozen=True)
class Judged:
    """How well a prediction explains a measured cycle; None where there is no prediction.

    ``nrmse``: rms of what is left over the rms of the measured; ``floor``: what noise alone would leave; ``misfit``:
    their ratio; ``verdict``: whether that is little enough.
    """

    floor: float
    nrmse: float | None = None
    misfit: float | None = None
    verdict: Verdict | None = None

    @property
    def words(self) -> str:
        """The verdict as it stands behind a law's name.

        Examples
        --------
        >>> Judged(0.01, 0.005, 0.5, "explained").words
        ': explained, it leaves 0.5 % of the motion, 0.5 times the error of the measured cycle'
        """
        if self.nrmse is None:
            return ": no prediction"
        said = "explained" if self.verdict == "explained" else "not explained"
        against = f"{self.misfit:.2g} times the error of the measured cycle"
        return f": {said}, it leaves {100 * self.nrmse:.2g} % of the motion, {against}"


def judge(measured: FloatArray, predicted: FloatArray | None, floor: float) -> Judged:
    """Hold a predicted cycle (p,) against the measured one."""
    if predicted is None:
        return Judged(floor)
    nrmse = nrmse_of(measured, predicted)
    return Judged(floor, nrmse, nrmse / floor, "explained" if nrmse <= EXPLAINED * floor else "misfit")
