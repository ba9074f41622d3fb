"""Do the stated errors of one test hold its truth? Draws of what is declared of sensors and rig, analyzed and compared.

    python -m tests.benchmarks.recording_coverage KIND [DRAWS [FIRST SEED]]    # to results/coverage_KIND.txt

``noise``: 20 s at 250 Hz through the optoNCDT's noise and step; errors over standard errors. ``rig``: 30 s at 250 Hz,
each with its own lag, gains, curvature of both sensors, crosstalk either way, natural frequency and frame damping, each
drawn from the uncertainty that its scene declares, mains hum on the mass's sensor, noise and scatter of friction.
``filtered``: the same, and every other draw has a low-pass filter of its own in each channel, drawn and declared.
``force velocity acceleration angle``: 40 s at 500 Hz of a load cell beside two lasers, a vibrometer or an accelerometer
on the mass, a torque over an angle; gains of 0.5 % and a normal force of 1 % are drawn and declared. Errors are over
combined uncertainties but for ``noise``. No two draws share a random number.
"""

import math
import sys
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from frictionlab import compare
from frictionlab.analysis.channels import low_pass
from frictionlab.analysis.measurement import measure
from frictionlab.arrays import FloatArray
from frictionlab.scene import scene_from_tables
from frictionlab.simulator import Problem, steady_state
from tests.analysis import seen
from tests.analysis import test_force as cell
from tests.benchmarks import study
from tests.inference.contacts import BASE_M, NATURAL_HZ, recorded, scene

Scores = Mapping[str, float]
POINTS = ((0.1, 0.4), (0.2, 0.4), (0.3, 0.4), (0.5, 0.4), (0.7, 0.3), (0.9, 0.3), (1.2, 0.3), (1.6, 0.3), (2.0, 0.2))
TWO = ((0.5, 0.4), (0.8, 0.3))
LAG_S, GAIN, LINEARITY, CROSSTALK = 0.001, 0.001, 0.0005, 0.0005
FREQUENCY, DAMPING, DAMPING_U = 0.002, 0.005, 0.001
HUM_M, MAINS_HZ = 2e-6, 50.0
CELL_GAIN, NORMAL = 0.005, 0.01
TABLES: dict[str, dict[str, object]] = {
    "rig": {"natural_frequency_hz_u": FREQUENCY * NATURAL_HZ, "damping_ratio": DAMPING, "damping_ratio_u": DAMPING_U},
    "sensors": {"lag_s_u": LAG_S, "gain_error": GAIN, "linearity": LINEARITY, "crosstalk": CROSSTALK},
}
FILTERS_HZ, ORDERS = (15.0, 60.0), (1, 2, 4)


class Sensors:
    """Two sensors that are off by so many standard uncertainties (7,): gains, curvatures, crosstalk, hum.

    ``filters``: keys of ``[sensors]`` that say what low-pass filter each channel has.
    """

    def __init__(self, drawn: FloatArray, filters: Mapping[str, float]) -> None:
        self.filters = filters
        self.gain, self.bent, self.mixed, self.hum = drawn[:2] * GAIN, drawn[2:4], drawn[4:6] * CROSSTALK, drawn[6]

    def __call__(self, t: FloatArray, mass: FloatArray, base: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What they show of a motion [m]."""
        shown = mass + self.mixed[0] * base, base + self.mixed[1] * mass
        one, two = (
            (1.0 + gain) * (x + LINEARITY * bent * 2.0 * x**3 / (0.5 * np.ptp(x)) ** 2)
            for x, gain, bent in zip(shown, self.gain, self.bent, strict=True)
        )
        one = one + HUM_M * self.hum * np.sin(2.0 * math.pi * MAINS_HZ * t + 0.3)
        return self._filtered(t, one, "mass"), self._filtered(t, two, "base")

    def _filtered(self, t: FloatArray, signal: FloatArray, role: str) -> FloatArray:
        """Through the channel's analog filter, by the spectrum of the signal and its mirror image."""
        if not self.filters:
            return signal
        both = np.concatenate([signal, signal[::-1]])
        frequency = np.asarray(np.fft.rfftfreq(len(both), float(t[1] - t[0])), dtype=np.float64)
        passed = low_pass(frequency, self.filters[f"{role}_filter_hz"], int(self.filters[f"{role}_filter_order"]))
        return np.asarray(np.fft.irfft(np.fft.rfft(both) * passed, len(both))[: len(signal)])


def score(value: float | None, stated: float | None, truth: float | None) -> float:
    """Error over stated error; NaN where there is none."""
    return (value - truth) / stated if stated and value is not None and truth is not None else math.nan


def of_noise(r: float, beta: float, seed: int) -> Scores:
    """Of a recording whose sensors have noise and a step alone."""
    _, _, energy, amplitude = seen.steady(r, beta)
    m = measure(seen.seen(seen.motion(r, beta), seed=seed, seconds=20.0, rate=250.0), what := seen.scene("all", 0.0))
    c = compare(m, what)
    return {
        "drive frequency": score(m.drive_frequency_hz, m.drive_frequency_hz_se, r * NATURAL_HZ),
        "energy": score(m.energy_per_cycle, m.energy_per_cycle_se, energy),
        "friction ratio": score(c.friction_ratio, c.friction_ratio_se, beta),
        "amplitude": score(m.response_amplitude, m.response_amplitude_se, amplitude),
    }


def of_rig(r: float, beta: float, seed: int, *, filtered: bool = False) -> Scores:
    """Of a recording whose sensors and frame are off by what `TABLES` declare."""
    generator = np.random.default_rng([18, round(1000 * r), seed])
    detuned, damped, late, *drawn = generator.standard_normal(10)
    filters: dict[str, float] = {}
    if filtered and seed % 2:
        own = np.random.default_rng([19, round(1000 * r), seed])
        for role in ("mass", "base"):
            filters[f"{role}_filter_hz"] = float(own.uniform(*FILTERS_HZ))
            filters[f"{role}_filter_order"] = int(own.choice(ORDERS))
    tuned = 1.0 + FREQUENCY * detuned
    frame = {"frame_damping_ratio": max(0.0, DAMPING + DAMPING_U * damped)}
    truth = Problem(r, beta)._but(r=r / tuned).with_parameters(frame)
    sensors = Sensors(np.array(drawn), filters)
    recording = recorded(truth, generator, seconds=30.0, lag_s=LAG_S * float(late), tuned=tuned, sensors=sensors)
    what, shown = scene(**{**TABLES, "sensors": {**TABLES["sensors"], **filters}}), steady_state(truth)
    m = measure(recording, what)
    c = compare(m, what)
    return {
        "energy": score(m.energy_per_cycle, m.energy_per_cycle_u, shown.energy_per_cycle),
        "amplitude": score(m.response_amplitude, m.response_amplitude_u, shown.response_amplitude),
        "friction ratio": score(c.friction_ratio, c.friction_ratio_u, beta),
    }


def of_channel(kind: str, r: float, beta: float, seed: int) -> Scores:
    """Of one test on the frame whose mass or contact has another sensor than a laser."""
    _, _, energy, amplitude = seen.steady(r, beta)
    off = 1.0 + np.array([*3 * [CELL_GAIN], NORMAL]) * np.random.default_rng([28, seed]).standard_normal(4)
    channels, mass = cell.channels_of(r, beta, seed=seed), "mass_displacement" if kind == "force" else f"mass_{kind}"
    for name, factor in ((mass, off[0]), ("base_displacement", off[1]), ("contact_force", off[2] * off[3])):
        channels[name] = channels[name] * factor
    names = (mass, "base_displacement", *(["contact_force"] if kind == "force" else []))
    m = measure(cell.recording(channels, *names), cell.scene(gain_error=CELL_GAIN, linearity=0.0, lag_s_u=1e-9))
    if kind == "force":
        truth = beta * cell.STIFFNESS * BASE_M / cell.NORMAL_N
        return {"coefficient": score(m.measured_coefficient.value, m.measured_coefficient.u, truth)}
    return {
        "energy": score(m.energy.value, m.energy.u, energy),
        "amplitude": score(m.amplitude.value, m.amplitude.u, amplitude),
    }


def of_angle(_r: float, _beta: float, seed: int) -> Scores:
    """Of one rotary test: torque of dry friction over an angle that swings to and fro."""
    rng, t = np.random.default_rng([29, seed]), np.arange(0.0, 40.0, 0.002)
    tau, size, torque, off = 2 * math.pi * 0.8 * t, 0.2, 1.5, 1.0 + CELL_GAIN * rng.standard_normal(2)
    channels = {"time": t, "angle": off[0] * (size * np.sin(tau) + 1e-4 * rng.standard_normal(len(t)))}
    channels["torque"] = off[1] * (torque * np.sign(np.cos(tau)) + 0.01 * rng.standard_normal(len(t)))
    given = scene_from_tables({"rig": {"kind": "prescribed"}, "sensors": {"gain_error": CELL_GAIN, "linearity": 0.0}})
    m = measure(cell.recording(channels, "angle", "torque"), given)
    return {
        "energy": score(m.force_energy_j.value, m.force_energy_j.u, 4 * size * torque),
        "swing": score(m.base_amplitude.value, m.base_amplitude.u, size),
    }


KINDS: Mapping[str, tuple[Callable[[float, float, int], Scores], tuple[tuple[float, float], ...]]] = {
    "noise": (of_noise, TWO),
    "rig": (of_rig, POINTS),
    "filtered": (partial(of_rig, filtered=True), POINTS),
    **{kind: (partial(of_channel, kind), TWO) for kind in ("force", "velocity", "acceleration")},
    "angle": (of_angle, ((0.0, 0.0),)),
}
"""What scores a draw, and the motions it is asked of: r, beta."""


def main(kind: str, draws: int = 200, first: int = 0) -> None:
    """Write the table, and again after every tenth draw of all motions: a study that is cut short is one of fewer."""
    scores, points = KINDS[kind]
    found: list[list[Scores]] = []
    for seed in range(first, first + draws):
        found.append([scores(r, beta, seed) for r, beta in points])
        if len(found) % 10 and len(found) < draws:
            continue
        lines = [f"{len(found)} draws a motion; share of truths within 1 and 1.96 stated errors"]
        lines += [f"{'r':>5s}{'beta':>6s}  {'quantity':16s}{study.COVERAGE}"]
        for name in found[0][0]:
            for k, (r, beta) in enumerate(points):
                lines.append(f"{r:5g}{beta:6g}  {name:16s}{study.coverage(row[k][name] for row in found)}")
            lines.append(f"{'all':>11s}  {name:16s}{study.coverage(one[name] for row in found for one in row)}")
        study.write(f"coverage_{kind}{f'_{first}' if first else ''}", lines)


if __name__ == "__main__":
    main(sys.argv[1], *(int(word) for word in sys.argv[2:]))
