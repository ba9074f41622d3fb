"""Mistakes of a channel: inverted, swapped, a copy, relative to the base, only noise, or clipped."""

import math

import numpy as np

from frictionlab.analysis import stops
from frictionlab.analysis.spectrum import smoothed, smoother
from frictionlab.arrays import FloatArray

ALIKE = 0.005  # rms of mass minus base over the base's: no frame with a contact follows its base so closely
GIVES = 0.01  # energy (k Y^2) below minus this is no error of a contact that takes nearly none
SURE = 5.0  # standard errors
CLEANER = 0.3  # harmonics of the mass over those of the base: friction makes harmonics, a motor fewer
DISTORTED = 0.02
NOISIER = 10.0  # noise of a mass that stands, over the base's
STANDS = 0.05  # of a cycle that the mass would stand if the column were relative
SLOW = 0.05  # of the highest speed: 3 % of a cosine is slower
OFF, FITS, CLEARER = 0.1, 0.3, 2.0  # what friction leaves of the force where the mass never stops, one over the other
DETUNED = np.linspace(-0.015, 0.015, 7)  # relative: how far the natural frequency may be from what is known of it
MATTERS = 0.01  # relative difference of the two amplitudes
LEVELS = (0.01, 0.04, 0.16)  # depths below an extreme, as shares of the whole stroke
SCALES = {1.0: 2.5, 1 / 4: 2.3, 1 / 16: 2.35}  # of the levels, and the sharpness no motion has
FINE = {1 / 4: 2.6, 1 / 16: 2.6}  # near enough to the extreme that stops on the way there do not count
"""2 for any motion whose speed passes through zero (2.2 at most for 1,900 motions of the simulator), 4 for a corner."""
BACK = 0.5  # of the first level: a flank that comes back by more is a motion that rings beside its extreme
POINTS = 20.0  # of a cycle over the root of the scale; below it the levels lie within a point of the extreme


def copied(mass: FloatArray, base: FloatArray, *, noise: float) -> str | None:
    """Tell whether the mass's mean cycle (p,) is the base's, but for this much noise in one point."""
    apart = math.sqrt(max(float(np.var(mass - base)) - noise * noise, 0.0)) / float(np.std(base))
    if apart >= ALIKE:
        return None
    return (
        f"mass: its channel repeats the base's (they differ by {100.0 * apart:.2g} % of the base's motion): energy,"
        " amplitude and stops are not of the mass: choose the mass's column (--mass, [log] mass)"
    )


def turned(mass: FloatArray, base: FloatArray, *, energy: float, error: float) -> str | None:
    """Tell whether the loop of two mean cycles (p,) goes round the wrong way, and what may have turned it."""
    if energy > -max(SURE * error, GIVES):
        return None
    of_base, of_mass = _distortion(base), _distortion(mass)
    gives = f"energy_per_cycle: {energy:.3g} kY^2: a contact takes energy, this one would give it: "
    if of_base > DISTORTED and of_mass < CLEANER * of_base:
        return (
            f"{gives}mass and base look swapped (harmonics of the base {100.0 * of_base:.2g} %, of the mass"
            f" {100.0 * of_mass:.2g} %): exchange --mass and --base ([log]), or turn the sign of one column"
        )
    return (
        f"{gives}one of the sensors counts the other way (turn the sign of its column), or mass and base are swapped"
        " (--mass and --base, [log])"
    )


def only_noise(mass_noise: float, base_noise: float, *, step: float) -> str | None:
    """Tell whether the channel of a mass that stands is much noisier than the base's; all in Y."""
    if mass_noise < NOISIER * max(base_noise, step):
        return None
    return (
        f"mass: its channel holds nothing but noise of {mass_noise:.3g} Y rms,"
        f" {mass_noise / max(base_noise, 1e-300):.2g} times the base's: check the mass's column (--mass, [log] mass)"
        " and its sensor"
    )


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
    moves = r is not None and stuck == 0.0
    own = _left(mass, base, r) if moves and r is not None else 1.0
    for sign, word in ((1.0, "+"), (-1.0, "-")):
        other = base + sign * mass
        least, why = max(STANDS, 4.0 * stuck), ""
        stands = _stuck(other, noise, samples) if _may_stand(other, least) else 0.0
        others = _left(other, base, r) if moves and r is not None else 1.0
        size = 0.5 * float(np.ptp(other))
        if stands > least and float(np.std(other)) > 0.05 * float(np.std(base)):
            why = f"mass {word} base stands for {100.0 * stands:.2g} % of a cycle, the column for {100.0 * stuck:.2g} %"
        elif others < FITS and own > max(OFF, CLEARER * others):
            why = f"mass {word} base fits the equation of motion"
        if why:
            return (
                f"response_amplitude: the mass's column looks like the displacement relative to the base ({why}): the"
                f" energy is the same, amplitude and stops are not: give the mass's own displacement, mass {word} base"
            )
        if CLEARER * own > others < FITS and abs(size / (0.5 * float(np.ptp(mass))) - 1.0) > MATTERS:
            return (
                "response_amplitude: so near resonance the motion does not tell whether the mass's column is its own"
                f" displacement or that relative to the base, whose own would be {size:.3g} Y (mass {word} base): the"
                " energy is the same, the amplitude is not: check what the sensor stands on"
            )
    return None


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
    """What friction against the motion does not explain of the force f - x - r^2 x'', harmonics 1 to 5: 0 to 1.

    It may grow with the place, as of a contact that is no plane. The least within what the natural frequency may be
    off by.
    """
    x, f = (np.fft.rfft(cycle)[1:6] for cycle in (mass, base))
    k = np.arange(1, 6)
    speed = np.fft.irfft(np.concatenate([[0.0], 1j * k * x]), 512)
    place = np.fft.irfft(np.concatenate([[0.0], x]), 512)
    kinds = np.sign(speed) * np.array([np.ones(512), place / max(float(np.abs(place).max()), 1e-300)])
    against = np.fft.rfft(kinds)[:, 1:6]
    both = np.concatenate([against.real, against.imag], axis=1)
    force = f - (1.0 - (r * (1.0 + DETUNED[:, None]) * k) ** 2) * x
    parts = np.concatenate([force.real, force.imag], axis=1)
    share = np.linalg.solve(both @ both.T, both @ parts.T)
    left = np.linalg.norm(parts - share.T @ both, axis=1) / np.linalg.norm(parts, axis=1)
    return float(np.where(share[0] > 0.0, left, 1.0).min())


def _distortion(cycle: FloatArray) -> float:
    """Harmonics 2 to 9 of a cycle over its first."""
    lines = np.abs(np.fft.rfft(cycle)[1:10])
    return float(np.linalg.norm(lines[1:]) / max(float(lines[0]), 1e-300))


def is_clipped(cycle: FloatArray, *, noise: float, stops_on_its_way: bool = False) -> bool:
    """Tell whether a mean cycle is cut off at one of its extremes.

    Near a true extreme, a stop included, the depth grows with the square of the time, so that from 4 to 16 % of the
    stroke takes twice as long as from 1 to 4 %; where the signal is cut off it arrives with its full speed and takes up
    to four times as long. Both flanks of the extreme must have the corner. A signal of which little is cut off shows it
    only close to its extreme: the same is asked at a quarter and a sixteenth of these depths, where the cycle has
    points enough to tell (40 and 80).

    Parameters
    ----------
    cycle : (p,) array
        One cycle, equally spaced in phase.
    noise : float
        Rms of the noise left in one point, in the cycle's unit; where it hides the levels, nothing is found.
    stops_on_its_way : bool
        The mass slows or stops between its extremes: its flanks are steep everywhere.

    Examples
    --------
    >>> x = np.sin(2 * np.pi * np.arange(400) / 400)
    >>> is_clipped(x, noise=0.0), is_clipped(np.minimum(x, 0.9), noise=0.0)
    (False, True)
    """
    stroke = float(np.ptp(cycle))
    if not stroke > 0.0:
        return False
    asked = [
        (scale, sharpest)
        for scale, sharpest in (FINE if stops_on_its_way else SCALES).items()
        if 8.0 * noise <= scale * LEVELS[0] * stroke and cycle.size * scale**0.5 >= POINTS
    ]
    return any(_is_cut_off(side, asked) for side in (cycle / stroke, -cycle / stroke))


def _is_cut_off(side: FloatArray, asked: list[tuple[float, float]]) -> bool:
    """Whether both flanks of the highest point have a corner; the second is looked at only where the first has."""
    for flank in (side, side[::-1]):
        depth = _depths(flank)
        asked = [(scale, sharpest) for scale, sharpest in asked if _sharpness(depth, scale) > sharpest]
        if not asked:
            return False
    return True


def _depths(cycle: FloatArray) -> FloatArray:
    """Depths below the highest point, from there on."""
    top = int(np.argmax(cycle))
    return np.asarray(cycle[top] - np.concatenate([cycle[top:], cycle[:top]]))


def _sharpness(depth: FloatArray, scale: float) -> float:
    """Time from the second to the third level over the time from the first to the second, after the highest point.

    A signal that was cut off falls all the way. An elastic contact rings about its extreme and comes back: no flank.
    """
    first, second, third = (_crossing(depth, scale * level) for level in LEVELS)
    flank = depth[int(first) : int(third) + 1]
    if np.any(np.maximum.accumulate(flank) - flank > BACK * scale * LEVELS[0]):
        return 0.0
    return (third - second) / max(second - first, 1e-300)


def _crossing(depth: FloatArray, level: float) -> float:
    """Where the depth last passes the level on its first way down to the next, in points."""
    below = int(np.argmax(depth > 1.5 * level))
    above = below - 1 - int(np.argmax(depth[:below][::-1] <= level))
    rise = depth[above + 1] - depth[above]
    return float(above + (level - depth[above]) / rise)
