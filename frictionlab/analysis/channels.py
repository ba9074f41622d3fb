"""From what is measured to what is needed: displacements of mass and base from whatever channels a recording has.

A velocity is integrated once, an acceleration twice, in the frequency domain: what moves slower than a fifth of the
motion's strongest line is taken off, and with it drift and any static offset. The ends, where a record's past and
future are missing, are cut.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis import integration, spectrum
from frictionlab.analysis.noise import white_noise
from frictionlab.errors import AnalysisError

FloatArray = NDArray[np.float64]
SLOWEST = 0.2  # of the strongest line: slower motions are not integrated
RATES = {"velocity": 1, "acceleration": 2}  # quantity -> integrations
FORCES = ("contact_force", "torque")
KEPT = (*FORCES, "normal_force", "mass_velocity")
"""Channels that are measured beside the displacements."""


@dataclass(frozen=True)
class Motions:
    """Displacements (n,) of mass and base on an even clock; ``first``, ``last``: the samples that are sound."""

    mass: FloatArray
    base: FloatArray
    first: int
    last: int
    warnings: tuple[str, ...]


def motions(measured: Mapping[str, FloatArray], step: float, *, prescribed: bool) -> Motions:
    """Return the displacements of mass and base, measured or integrated.

    Parameters
    ----------
    measured : mapping
        Channels by their names, (n,) each, SI units, one sample every ``step`` seconds.
    step : float
    prescribed : bool
        The motion of the mass is given, as on a tribometer: it drives, and stands in the base's place.

    Raises
    ------
    AnalysisError
        Neither displacement, velocity nor acceleration of one of the two was measured.

    Examples
    --------
    >>> t = np.arange(0.0, 40.0, 0.005)
    >>> seen = {"mass_velocity": 2e-3 * np.cos(2 * np.pi * t), "base_displacement": 1e-3 * np.sin(2 * np.pi * t)}
    >>> found = motions(seen, 0.005, prescribed=False)
    >>> off = found.mass - 2e-3 / (2 * np.pi) * np.sin(2 * np.pi * t)
    >>> bool(np.abs(off[found.first : found.last]).max() < 2e-6)
    True
    """
    mass, of_mass, edge = _displacement(measured, "mass", step)
    base, of_base, other = (mass, (), edge) if prescribed else _displacement(measured, "base", step)
    edge = max(edge, other)
    return Motions(mass, base, edge, len(mass) - edge, (*of_mass, *of_base))


def _displacement(
    measured: Mapping[str, FloatArray], place: str, step: float
) -> tuple[FloatArray, tuple[str, ...], int]:
    """Displacement of mass or base, what to say of it, and how many samples at either end are doubtful."""
    known = f"{place}_displacement"
    if known in measured:
        return measured[known], (), 0
    if place == "mass" and "angle" in measured:
        return measured["angle"], (), 0
    rates = {f"{place}_{quantity}": times for quantity, times in RATES.items()}
    rates |= {"angular_velocity": 1} if place == "mass" else {}
    name = next((name for name in rates if name in measured), None)
    if name is None:
        raise AnalysisError(
            f"analysis: the {place}'s motion was not measured: expected its displacement, velocity or acceleration; got"
            f" {', '.join(measured)}: name its column (--{place}, --{place}-velocity, --{place}-acceleration)"
            + ("" if place == "mass" else ', or say [rig] kind = "prescribed" where the motion is given')
        )
    signal, rate, times = measured[name], 1.0 / step, rates[name]
    slowest = SLOWEST * spectrum.strongest_tone(signal, step).frequency
    moved = integration.integrated(signal, rate, slowest, times=times)
    u = integration.integrated_noise(white_noise(signal), rate, slowest, times=times)
    edge = min(round(rate / slowest), len(signal) // 4)
    share = 100.0 * u / max(float(np.std(moved)), 1e-300)
    said = (
        f"{known}: integrated {'once' if times == 1 else 'twice'} from {name.replace('_', ' ')}: what moves slower than"
        f" {slowest:.3g} Hz, drift and offset are gone, {edge * step:.3g} s at either end are cut, and its sensor's"
        f" noise makes {1e6 * u:.3g} um rms of displacement ({share:.2g} % of the motion)"
    )
    return moved, (said,), edge
