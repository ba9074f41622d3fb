"""Whether the two channels are what they are called: inverted, swapped, a copy, relative to the base, or only noise."""

import enum
import math

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis import stops
from frictionlab.analysis.smoothing import smoothed, smoother

FloatArray = NDArray[np.float64]
ALIKE = 0.005  # rms of mass minus base over the base's: no frame with a contact follows its base so closely
GIVES = 0.01  # energy (k Y^2) below minus this is no error of a contact that takes nearly none
SURE = 5.0  # standard errors
CLEANER = 0.3  # harmonics of the mass over those of the base: friction makes harmonics, a motor fewer
DISTORTED = 0.02
NOISIER = 10.0  # noise of a mass that stands, over the base's
STANDS = 0.05  # of a cycle that the mass would stand if the column were relative
SLOW = 0.05  # of the highest speed: 3 % of a cosine is slower
OFF, FITS, CLEARER = 0.3, 0.3, 2.5  # what friction leaves of the force where the mass never stops, one over the other


class Mistake(enum.Enum):
    """What a channel is instead of what it is called; the value is the sentence, `{...}` filled by its finder."""

    COPY = (
        "mass: its channel repeats the base's (they differ by {share:.2g} % of the base's motion): energy, amplitude"
        " and stops are not of the mass: choose the mass's column (--mass, [log] mass)"
    )
    INVERTED = (
        "energy_per_cycle: {energy:.3g} kY^2: a contact takes energy, this one would give it: one of the sensors counts"
        " the other way (turn the sign of its column), or mass and base are swapped (--mass and --base, [log])"
    )
    SWAPPED = (
        "energy_per_cycle: {energy:.3g} kY^2: a contact takes energy, this one would give it: mass and base look"
        " swapped (harmonics of the base {base:.2g} %, of the mass {mass:.2g} %): exchange --mass and --base ([log]),"
        " or turn the sign of one column"
    )
    NOISE = (
        "mass: its channel holds nothing but noise of {noise:.3g} Y rms, {times:.2g} times the base's: check the mass's"
        " column (--mass, [log] mass) and its sensor"
    )
    RELATIVE = (
        "response_amplitude: the mass's column looks like the displacement relative to the base ({why}): the energy is"
        " the same, amplitude and stops are not: give the mass's own displacement, mass {sign} base"
    )

    def said(self, **numbers: object) -> str:
        """The sentence with its numbers."""
        return str(self.value).format(**numbers)


def copied(mass: FloatArray, base: FloatArray, *, noise: float) -> str | None:
    """Tell whether the mass's mean cycle (p,) is the base's, but for this much noise in one point."""
    apart = math.sqrt(max(float(np.var(mass - base)) - noise * noise, 0.0)) / float(np.std(base))
    return Mistake.COPY.said(share=100.0 * apart) if apart < ALIKE else None


def turned(mass: FloatArray, base: FloatArray, *, energy: float, error: float) -> str | None:
    """Tell whether the loop of two mean cycles (p,) goes round the wrong way, and what may have turned it."""
    if energy > -max(SURE * error, GIVES):
        return None
    of_base, of_mass = _distortion(base), _distortion(mass)
    if of_base > DISTORTED and of_mass < CLEANER * of_base:
        return Mistake.SWAPPED.said(energy=energy, base=100.0 * of_base, mass=100.0 * of_mass)
    return Mistake.INVERTED.said(energy=energy)


def only_noise(mass_noise: float, base_noise: float, *, step: float) -> str | None:
    """Tell whether the channel of a mass that stands is much noisier than the base's; all in Y."""
    if mass_noise < NOISIER * max(base_noise, step):
        return None
    return Mistake.NOISE.said(noise=mass_noise, times=mass_noise / max(base_noise, 1e-300))


def relative(
    mass: FloatArray, base: FloatArray, *, noise: float, samples: float, stuck: float, r: float | None
) -> str | None:
    """Tell whether a mean cycle of the mass (p,) is relative to the base, as x - y or y - x.

    Either the sum (or difference) stands still where the column itself moves; or, where nothing stands, the column
    breaks the equation of motion and the sum (or difference) keeps it.

    Parameters
    ----------
    mass, base : (p,) arrays
        Mean cycles, x/Y and y/Y.
    noise : float
        Rms of the noise in a point of their sum.
    samples : float
        Samples of a cycle.
    stuck : float
        Fraction of a cycle that the column stands.
    r : float or None
        Frequency ratio, where known.
    """
    for sign, word in ((1.0, "+"), (-1.0, "-")):
        other = base + sign * mass
        least = max(STANDS, 4.0 * stuck)
        stands = _stuck(other, noise, samples) if _may_stand(other, least) else 0.0
        if stands > least and float(np.std(other)) > 0.05 * float(np.std(base)):
            why = f"mass {word} base stands for {100.0 * stands:.2g} % of a cycle, the column for {100.0 * stuck:.2g} %"
            return Mistake.RELATIVE.said(why=why, sign=word)
        if r is not None and stuck == 0.0 and _fits_better(other, mass, base, r):
            return Mistake.RELATIVE.said(why=f"mass {word} base fits the equation of motion", sign=word)
    return None


def _fits_better(other: FloatArray, mass: FloatArray, base: FloatArray, r: float) -> bool:
    """Whether another motion keeps the equation of motion clearly better than the column does."""
    own, others = _left(mass, base, r), _left(other, base, r)
    return own > OFF and others < FITS and own > CLEARER * others


def _may_stand(cycle: FloatArray, least: float) -> bool:
    """Whether a cycle is slow for more than this share of it; quick."""
    width = max(1, len(cycle) // 128)
    speed = np.abs(cycle[width:] - cycle[:-width])
    return bool(np.count_nonzero(speed < SLOW * speed.max()) > least * len(speed))


def _stuck(cycle: FloatArray, noise: float, samples: float) -> float:
    """Fraction of a single cycle that it stands."""
    rows = (cycle - cycle.mean())[None]
    how = smoother(rows, noise=noise, samples=samples)
    limits = stops.thresholds(how.v_noise, how.resolution)
    (part,) = smoothed(rows, how, len(cycle))
    found = stops.stops_of(stops.pauses(part.v, limits.still), limits, len(cycle))
    return float(np.sum(found.end - found.begin)) / stops.TURN


def _left(mass: FloatArray, base: FloatArray, r: float) -> float:
    """What friction against the motion does not explain of the force f - x - r^2 x'', harmonics 1 to 5: 0 to 1."""
    x, f = (np.fft.rfft(cycle)[1:6] for cycle in (mass, base))
    k = np.arange(1, 6)
    force = f - (1.0 - (r * k) ** 2) * x
    speed = np.fft.irfft(np.concatenate([[0.0], 1j * k * x]), 512)
    against = np.fft.rfft(np.sign(speed))[1:6]
    share = max(float(np.vdot(against, force).real), 0.0) / float(np.vdot(against, against).real)
    return float(np.linalg.norm(force - share * against) / np.linalg.norm(force))


def _distortion(cycle: FloatArray) -> float:
    """Harmonics 2 to 9 of a cycle over its first."""
    lines = np.abs(np.fft.rfft(cycle)[1:10])
    return float(np.linalg.norm(lines[1:]) / max(float(lines[0]), 1e-300))
