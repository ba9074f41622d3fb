"""What a measurement costs: time over the recording's own FFT (90 s at 4 kHz), memory over the recording's size.

Run: ``python -m tests.benchmarks.analysis_speed``. Ratios of one run; the relative error of the energy stands beside.
"""

import math
import sys
import time
import tracemalloc
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy import fft

from frictionlab.analysis.measure import measure
from frictionlab.analysis.spectrum import amplitude_spectrum
from frictionlab.recording import Recording
from frictionlab.scene import Analysis, Rig, Scene
from frictionlab.simulator import Problem, steady_state

NATURAL_HZ, BASE_M, NOISE_M, STEP_M = 3.13, 1.8e-3, 0.8e-6, 1.02 * 0.05 / 65520
SCENE = Scene(rig=Rig(natural_frequency_hz=NATURAL_HZ), analysis=Analysis(transient_s=20.0, cycles="all"))


def recording(r: float, beta: float, rate: float, duration: float) -> tuple[Recording, float]:
    """A steady motion through noise and the sensor's step, and its energy per cycle."""
    generator = np.random.default_rng(4)
    state = steady_state(Problem(r, beta))
    if state.orbit is None or state.energy_per_cycle is None:
        raise SystemExit(f"no steady state at r = {r}, beta = {beta}")
    t = np.arange(round(rate * duration)) / rate
    tau = 2 * math.pi * r * NATURAL_HZ * t
    signals = [BASE_M * state.orbit.at(np.mod(tau, 2 * math.pi))[0], BASE_M * np.cos(tau)]
    mass, base = (np.round((s + NOISE_M * generator.standard_normal(len(s))) / STEP_M) * STEP_M for s in signals)
    return Recording(t, mass, base), state.energy_per_cycle


def best(job: Callable[[], object], times: int) -> float:
    """Least wall time of a few runs, s."""
    seconds = []
    for _ in range(times):
        begin = time.perf_counter()
        job()
        seconds.append(time.perf_counter() - begin)
    return min(seconds)


def main() -> None:
    """Print the two ratios."""
    for r, beta in ((0.1, 0.4), (0.5, 0.4), (2.0, 0.4)):
        one, energy = recording(r, beta, 4000.0, 90.0)
        plain = best(partial(fft.rfft, one.base_displacement), 9)
        padded = best(partial(amplitude_spectrum, one.base_displacement, 1 / 4000.0), 5)
        all_of_it = best(partial(measure, one, SCENE), 5)
        error = measure(one, SCENE).energy_per_cycle / energy - 1
        sys.stdout.write(
            f"90 s at 4 kHz, r = {r}: measure {1e3 * all_of_it:.0f} ms, energy off by {error:+.1e};"
            f" {all_of_it / padded:.2f} times its FFT (Hann, padding 4: {1e3 * padded:.0f} ms),"
            f" {all_of_it / plain:.1f} times a bare FFT of one channel ({1e3 * plain:.0f} ms)\n"
        )
    for r, rate in ((0.3, 500.0), (1.2, 500.0), (1.2, 4000.0)):
        one, energy = recording(r, 0.4, rate, 1800.0)
        size = sum(a.nbytes for a in (one.time, one.mass_displacement, one.base_displacement, one.quality))
        tracemalloc.start()
        begin = time.perf_counter()
        error = measure(one, SCENE).energy_per_cycle / energy - 1
        seconds = time.perf_counter() - begin
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        sys.stdout.write(
            f"30 min at {rate:g} Hz, r = {r}: {size / 1e6:.0f} MB, {peak / size:.2f} times that on top,"
            f" {1 + peak / size:.2f} with it; {seconds:.1f} s, energy off by {error:+.1e}\n"
        )


if __name__ == "__main__":
    main()
