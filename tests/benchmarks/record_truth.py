"""Fits of whole records held against the truth of a virtual rig: errors, and how often they cover it.

    python -m tests.benchmarks.record_truth [tests] > tests/benchmarks/results/record_truth.txt

Each test draws its rig: friction, and what the scene does not know exactly (natural frequency, frame damping, gain,
lag) from what `frictionlab` takes as their uncertainty; its sensors are straight, and declared so. A motor starts up
within two seconds and wanders a little in amplitude. Coverage: share of tests whose truth lies within one and within
1.96 combined uncertainties; 68 and 95 % are due.
"""

import math
import sys
from collections.abc import Iterator

import numpy as np

import frictionlab as fl
from frictionlab.errors import FrictionlabError
from frictionlab.recording import Recording
from frictionlab.scene import Analysis, Rig, Scene
from frictionlab.scene.keys import Sensors
from frictionlab.simulator import Problem
from frictionlab.simulator.record import BaseRecord, respond
from frictionlab.uncertainty import NATURAL_FREQUENCY, UNKNOWN_DAMPING

FN, Y, RATE, SECONDS, NOISE = 3.0, 2e-3, 250.0, 30.0, 1e-6
SCENE = Scene(
    rig=Rig(natural_frequency_hz=FN),
    sensors=Sensors(linearity=0.0),  # straight, and declared so
    analysis=Analysis(transient_s=10.0, cycles="all"),
)
RATIOS = (0.3, 0.7, 0.95, 1.4)
LAW = "coulomb+place+speed"


def truth_of(rng: np.random.Generator) -> dict[str, float]:
    """What a test's rig is."""
    return {
        "beta": float(rng.uniform(0.2, 0.6)),
        "gradient": float(rng.uniform(-0.08, 0.08)),
        "contact_damping_ratio": float(rng.uniform(0.01, 0.06)),
        "frame_damping_ratio": abs(float(rng.normal(0.0, UNKNOWN_DAMPING))),
        "natural_frequency": float(rng.normal(0.0, NATURAL_FREQUENCY)),
        "gain": float(rng.normal(0.0, math.sqrt(2.0) * SCENE.sensors.gain_error)),
        "lag_s": float(rng.uniform(-0.5, 0.5)) / RATE,
    }


def record_of(r: float, truth: dict[str, float], rng: np.random.Generator, *, seconds: float = SECONDS) -> Recording:
    """What its lasers see."""
    t = np.arange(int(RATE * seconds)) / RATE
    ramp = np.clip(t / 2.0, 0.0, 1.0)
    drive, phase = 2 * math.pi * r * FN, float(rng.uniform(0.0, 2 * math.pi))

    def base_at(s: np.ndarray) -> np.ndarray:
        wander = 1.0 + 0.01 * np.sin(2 * math.pi * 0.11 * s + phase)
        return np.asarray(Y * np.interp(s, t, ramp**2 * (3.0 - 2.0 * ramp)) * wander * np.sin(drive * s))

    law = {n: truth[n] for n in ("gradient", "contact_damping_ratio")}
    problem = Problem(1.0, truth["beta"], law=LAW, parameters=law, frame_damping_ratio=truth["frame_damping_ratio"])
    omega = 2 * math.pi * FN * (1.0 + truth["natural_frequency"])
    x = (1.0 + truth["gain"]) * Y * respond(problem, BaseRecord(omega * t, base_at(t), rest=0.0, scale=Y)).displacement
    y = base_at(t - truth["lag_s"])
    return Recording(t, x + NOISE * rng.standard_normal(len(t)), y + NOISE * rng.standard_normal(len(t)))


def results(r: float, tests: int) -> Iterator[tuple[float, dict[str, tuple[float, float]]]]:
    """Record nrmse of each test, and for each unknown its relative error and its error over its uncertainty."""
    for seed in range(tests):
        rng = np.random.default_rng([seed, int(100 * r)])
        truth = truth_of(rng)
        try:
            recording = record_of(r, truth, rng)
            larger = fl.analyze(recording, SCENE).base_amplitude_m / Y  # what the wandering motor is measured as
            truth |= {"beta": truth["beta"] / larger, "gradient": truth["gradient"] * larger}
            seen = fl.compare(recording, SCENE, law=LAW, fit="whole")
        except FrictionlabError as error:
            sys.stdout.write(f"  r = {r}, test {seed}: {error}\n")
            continue
        found = {}
        for name in ("beta", "gradient", "contact_damping_ratio"):
            value, u = seen.parameters[name]["value"], seen.parameters[name]["u"]
            found[name] = ((value or 0.0) - truth[name], u or math.nan)
        known = seen.nuisances["natural_frequency"]
        found["natural_frequency"] = (known["value"] - truth["natural_frequency"], known["u"])
        yield seen.record_nrmse or math.nan, {n: (e, e / u) for n, (e, u) in found.items()}


def main() -> None:
    """Print the table."""
    tests = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    line = "{:5} {:24} {:>12} {:>12} {:>8} {:>8}  {}\n"
    sys.stdout.write(line.format("r", "unknown", "rms error", "median", "in 1 u", "in 1.96", "record nrmse, median"))
    for r in RATIOS:
        all_of = list(results(r, tests))
        nrmse = float(np.median([n for n, _ in all_of]))
        for name in ("beta", "gradient", "contact_damping_ratio", "natural_frequency"):
            errors = np.array([found[name] for _, found in all_of])
            inside = [f"{100 * np.mean(np.abs(errors[:, 1]) < k):.0f} %" for k in (1.0, 1.96)]
            rms, median = math.sqrt(float(np.mean(errors[:, 0] ** 2))), float(np.median(np.abs(errors[:, 0])))
            sys.stdout.write(line.format(r, name, f"{rms:.2e}", f"{median:.2e}", *inside, f"{nrmse:.1e}"))
        sys.stdout.flush()


if __name__ == "__main__":
    main()
