"""Uninterrupted samples of both channels, and the lines in them that are no harmonic of the drive, taken out."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis import cycles, lines, noise, spectrum
from frictionlab.analysis.lines import Line

FloatArray = NDArray[np.float64]
ROUNDS = 0.1  # of a sensor's step: a line below it may be rounding


@dataclass(frozen=True)
class Stretch:
    """Uninterrupted samples (n,): ``time`` of the first [s], ``step`` [s], ``mass`` and ``base`` [m], evenly spaced."""

    time: float
    step: float
    mass: FloatArray
    base: FloatArray

    def after(self, time: float) -> "Stretch":
        """The part from a time on; empty if there is none."""
        passed = min((time - self.time) / self.step, float(len(self.mass)))
        first = min(max(0, math.ceil(passed - 1e-6)), len(self.mass))
        return Stretch(self.time + first * self.step, self.step, self.mass[first:], self.base[first:])

    def without(self, role: str, found: tuple[Line, ...], cut: cycles.Cut) -> "Stretch":
        """The stretch with the lines that are to go taken out of one channel.

        At first in windows long enough to tell them from the drive's harmonics; then, with those taken off, in short
        ones that follow a line which swells and wanders.
        """
        signal, drive = (self.mass if role == "mass" else self.base), cut.frequency / self.step
        gone = [line for line in found if line.removed]
        for line in gone:
            signal = signal - lines.line_in(signal, self.step, line, lines.window(line, drive))
        if gone and len(cut):
            own = signal - cycles.common(signal, cut, cycles.points_per_cycle(1.0 / cut.frequency))
            signal = signal - sum(lines.line_in(own, self.step, line, lines.SHORTEST_S) for line in gone)
        return replace(self, mass=signal) if role == "mass" else replace(self, base=signal)


@dataclass(frozen=True)
class Foreign:
    """Lines that are no harmonics of the drive, by channel (m), and after how many cycles of the drive all repeats.

    ``faintest``: amplitude of the faintest line that would be found in the mass's channel above the frame's reach (m);
    ``on_harmonics``: harmonics of the mass that stand out of those beside them; ``masked``: amplitude of hum that a
    harmonic of the drive may hide (m).
    """

    mass: tuple[Line, ...] = ()
    base: tuple[Line, ...] = ()
    period: int = 1
    faintest: float = 0.0
    on_harmonics: tuple[Line, ...] = ()
    masked: float = 0.0


@dataclass(frozen=True)
class Lines:
    """What lines are looked for in the longest stretch, whose cycles are known."""

    longest: Stretch
    cut: cycles.Cut

    @property
    def drive(self) -> float:
        """Frequency of the drive [Hz]."""
        return self.cut.frequency / self.longest.step

    @cached_property
    def unit(self) -> float:
        """Amplitude of the base [m]."""
        return float(np.std(self.longest.base)) * math.sqrt(2.0)

    @cached_property
    def spread(self) -> float:
        """Relative width of the drive's line."""
        return float(np.std(self.cut.end - self.cut.start)) * self.cut.frequency if len(self.cut) else 0.0

    def foreign(self, signal: FloatArray, of: spectrum.Spectrum) -> tuple[Line, ...]:
        """Lines of one channel that are no harmonics, by its spectrum."""
        found = lines.foreign(of, self.drive, unit=self.unit, resolution=of.resolution, spread=self.spread)
        return _beyond_rounding(found, signal, self.unit)


def cleaned(
    stretches: list[Stretch],
    cuts: list[cycles.Cut],
    lines_of: Lines,
    mass_lines: spectrum.Spectrum,
    of_base: tuple[Line, ...],
) -> tuple[list[Stretch], Foreign]:
    """Take high lines that are no harmonics out of all stretches; say what was found in each channel of the longest."""
    drive, resolution = lines_of.drive, mass_lines.resolution
    found = [lines_of.foreign(lines_of.longest.mass, mass_lines), of_base]
    period = lines.period_of((*found[0], *found[1]), drive, resolution) if len(stretches) == 1 else 1
    if period > 1:  # high lines of that period are the motion's
        found = [lines.beside_period(some, drive / period, resolution) for some in found]
    for role, of_role in zip(("mass", "base"), found, strict=True):
        if any(line.removed for line in of_role):
            stretches = [s.without(role, of_role, c) for s, c in zip(stretches, cuts, strict=True)]
    faintest, spread = lines.faintest(mass_lines, drive, unit=lines_of.unit), lines_of.spread
    if period > 1:
        return stretches, Foreign(found[0], found[1], period, faintest)
    out, masked = lines.on_harmonics(mass_lines, drive, unit=lines_of.unit, spread=spread, found=found[0])
    return stretches, Foreign(found[0], found[1], period, faintest, out, masked)


def _beyond_rounding(found: tuple[Line, ...], signal: FloatArray, unit: float) -> tuple[Line, ...]:
    """Without the faint lines that may be a quiet sensor's steps: rounding of a periodic motion makes many."""
    faint = lines.LEAST * unit
    if all(line.amplitude > faint for line in found):
        return found
    least = min(faint, ROUNDS * noise.sensor_step(signal))
    return tuple(line for line in found if line.amplitude > least)
