"""Stability shown: how errors grow with the number of cycles, towards resonance, and with the sensors' noise."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from frictionlab.analysis.measure import measure
from frictionlab.figures.style import PAGE, PALETTE, look, new_figure, save
from frictionlab.simulator import Problem, simulate, steady_state
from frictionlab.tradeoff import knobs

FloatArray = NDArray[np.float64]
CYCLES = (1, 3, 10, 30, 100, 300, 1000, 3000, 10_000, 30_000)
DISTANCES = range(1, 16)
NOISES = (1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2)
SEEDS = range(6)
FLOOR = 1e-17  # an error of zero is drawn here


@dataclass(frozen=True)
class Growth:
    """An error over what makes it grow: ``x`` (n,), ``error`` (n,), and ``law`` (n,): what it is expected to be."""

    name: str
    x_name: str
    x: FloatArray
    error: FloatArray
    law_name: str
    law: FloatArray


def over_cycles() -> tuple[Growth, ...]:
    """Free of friction from rest, x = (cos tau - cos(tau / r)) / (1 - r^2); and stick-slip against its orbit."""
    return _free_growth(), _stick_slip_growth()


def _free_growth() -> Growth:
    """Error of the free motion 1 rad into a cycle; the turns of free vibration before it are reduced as a fraction."""
    r = 0.7
    run = simulate(Problem(r, 0.0), cycles=CYCLES[-1])
    late = np.array([run.at([1.0], cycle=n - 1)[0][0] for n in CYCLES])
    turns = np.array([float(Fraction(n - 1) / Fraction(r) % 1) for n in CYCLES])
    truth = (math.cos(1.0) - np.cos(2 * math.pi * turns + 1.0 / r)) / (1 - r * r)
    x = np.array(CYCLES, dtype=float)
    law = 4.0 * 2.0**-52 * x
    return Growth(
        "no friction, r = 0.7", "cycles from rest", x, np.abs(late - truth), "four roundings a cycle; one", law
    )


def _stick_slip_growth() -> Growth:
    """Distance of a motion from rest to the orbit it settles on; friction forgets what rounding did."""
    problem = Problem(0.5, 0.4)
    orbit = steady_state(problem).orbit
    run = simulate(problem, cycles=CYCLES[-1])
    late = np.array([run.at([1.0], cycle=n - 1)[0][0] for n in CYCLES])
    truth = late if orbit is None else orbit.at([1.0])[0]
    x = np.array(CYCLES, dtype=float)
    return Growth(
        "stick-slip, r = 0.5, beta = 0.4", "cycles from rest", x, np.abs(late - truth), "rounding", 0 * x + 2.0**-52
    )


def towards_resonance() -> tuple[Growth, ...]:
    """Relative error of the energy at r = 1 - 2^-k against Den Hartog's formula, which is exact there to rounding."""
    found = []
    for name, below in (("r below 1", -1.0), ("r above 1", 1.0)):
        r = np.array([1.0 + below * 2.0 ** (-3 * k) for k in DISTANCES])
        energy = np.array([steady_state(Problem(float(q), 0.4), solver="exact").energy_per_cycle for q in r])
        truth = np.array([_den_hartog_energy(below * 2.0 ** (-3 * k), 0.4) for k in DISTANCES])
        law = np.full(len(r), 2.0**-52)
        found.append(Growth(name, "1/|r - 1|", 1 / np.abs(r - 1), np.abs(energy / truth - 1), "rounding", law))
    return tuple(found)


def _den_hartog_energy(distance: float, beta: float) -> float:
    """4 beta X at r = 1 + distance, (2.11)-(2.14), written in the distance so that nothing is lost."""
    r = 1.0 + distance
    detuning = -distance * (2.0 + distance)  # 1 - r^2
    away = -distance / r  # 1 / r - 1
    ratio = beta * detuning / (math.tan(0.5 * math.pi * away) * r)
    return 4.0 * beta * math.sqrt((1.0 - ratio) * (1.0 + ratio)) / abs(detuning)


def with_noise() -> tuple[Growth, ...]:
    """Rms error of frequency, energy and amplitude over the noise of both sensors, and the error bar they are given."""
    found = [[_noisy(share, seed) for seed in SEEDS] for share in NOISES]
    return tuple(
        Growth(
            name,
            "noise over the base's amplitude",
            np.array(NOISES),
            np.array([math.sqrt(sum(error[key] ** 2 for error, _ in row) / len(row)) for row in found]),
            "its standard error",
            np.array([math.sqrt(sum(bar[key] ** 2 for _, bar in row) / len(row)) for row in found]),
        )
        for key, name in (("frequency", "drive frequency"), ("energy", "energy per cycle"), ("amplitude", "amplitude"))
    )


def _noisy(share: float, seed: int) -> tuple[dict[str, float], dict[str, float]]:
    """Relative errors of one recording, and the relative standard errors stated."""
    recording = knobs.recording(knobs.RATE_HZ, seed, share)
    found = measure(recording, knobs.SCENE)
    orbit, energy = knobs.orbit()
    amplitude = 0.5 * float(np.ptp(orbit.turning_points[1]))
    errors = {
        "frequency": found.drive_frequency_hz / knobs.DRIVE_HZ - 1,
        "energy": found.energy_per_cycle / energy - 1,
        "amplitude": found.response_amplitude / amplitude - 1,
    }
    bars = {
        "frequency": (found.drive_frequency_hz_se or 0.0) / knobs.DRIVE_HZ,
        "energy": found.energy_per_cycle_se / energy,
        "amplitude": found.response_amplitude_se / amplitude,
    }
    return errors, bars


def stability_figure(panels: Sequence[Sequence[Growth]]) -> Figure:
    """One panel for each cause of error."""
    with look():
        figure = new_figure(PAGE, 2.8)
        for growths, ax in zip(panels, figure.subplots(1, len(panels)).ravel().tolist(), strict=True):
            draw_growth(growths, ax)
    return figure


def draw_growth(growths: Sequence[Growth], ax: Axes) -> Axes:
    """Errors as points, what was to be expected as dashed lines of the same colour."""
    for growth, color in zip(growths, PALETTE, strict=False):
        ax.plot(growth.x, np.maximum(growth.error, FLOOR), "o", markersize=3.0, color=color, label=growth.name)
        ax.plot(growth.x, growth.law, "--", linewidth=0.8, color=color)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel(growths[0].x_name)
    ax.set_ylabel("error")
    ax.set_title(f"dashed: {growths[0].law_name}")
    ax.legend(fontsize=5.5)
    return ax


def main(folder: Path) -> None:
    """Measure and draw; used by ``make stability``."""
    folder.mkdir(parents=True, exist_ok=True)
    panels = (over_cycles(), towards_resonance(), with_noise())
    save(stability_figure(panels), folder / "stability.png", force=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
