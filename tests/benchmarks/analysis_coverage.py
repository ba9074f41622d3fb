"""Do the stated errors cover the truth? Noise realisations of two motions, and of each kind of channel.

Run: ``python -m tests.benchmarks.analysis_coverage [DRAWS [KIND ...]]`` (1,000 if not said). Without a kind every draw
is one test of 20 s at 250 Hz through the optoNCDT's noise and step, measured over all its cycles and identified, its
errors over the standard errors. A kind, of ``force velocity acceleration angle``: 40 s at 500 Hz of a load cell beside
two lasers, a vibrometer or an accelerometer on the mass, a torque over an angle; gains of 0.5 % and a normal force of
1 % are drawn, and declared alone; errors are over the combined uncertainties. The result goes to
results/analysis_coverage[_KIND].txt.
"""

import math
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from frictionlab import compare
from frictionlab.analysis.measurement import measure
from frictionlab.estimate import Estimate
from frictionlab.recording import Recording
from frictionlab.scene import scene_from_tables
from tests.analysis import test_force as cell
from tests.analysis.seen import BASE_M, NATURAL_HZ, scene, steady, through_laser

DRAWS, SECONDS, RATE = 1000, 20.0, 250.0
CASES = ((0.5, 0.4, "stick-slip"), (0.8, 0.3, "continuous"))
QUANTITIES = ("drive frequency", "energy per cycle", "friction ratio", "amplitude")
KINDS = ("force", "velocity", "acceleration", "angle")
GAIN, NORMAL = 0.005, 0.01
RESULTS = Path(__file__).parent / "results"
Scores = dict[str, list[float]]


def errors_over_stated(r: float, beta: float, draws: int) -> Scores:
    """Error over stated standard error of frequency, energy, friction ratio and amplitude."""
    _, orbit, energy, amplitude = steady(r, beta)
    generator = np.random.default_rng(20261121)
    t = np.arange(round(SECONDS * RATE)) / RATE
    tau = 2 * math.pi * r * NATURAL_HZ * t
    mass, base = BASE_M * orbit.at(np.mod(tau, 2 * math.pi))[0], BASE_M * np.cos(tau)
    what, scores = scene("all", 0.0), np.empty((draws, 4))
    for j in range(draws):
        m = measure(Recording(t, through_laser(mass, generator), through_laser(base, generator)), what)
        c = compare(m, what)
        scores[j] = (
            (m.drive_frequency_hz - r * NATURAL_HZ) / (m.drive_frequency_hz_se or math.nan),
            (m.energy_per_cycle - energy) / m.energy_per_cycle_se,
            (c.friction_ratio - beta) / (c.friction_ratio_se or math.nan),
            (m.response_amplitude - amplitude) / m.response_amplitude_se,
        )
    return dict(zip(QUANTITIES, scores.T.tolist(), strict=True))


def errors_of_a_kind(kind: str, r: float, beta: float, draws: int) -> Scores:
    """Error over combined uncertainty of what a kind of channel is for."""
    scores: Scores = {}
    for seed in range(draws):
        found = _turned(seed) if kind == "angle" else _watched(kind, r, beta, seed)
        for name, (number, truth) in found.items():
            error = (number.value or math.nan) - truth
            scores.setdefault(name, []).append(error / (number.u or math.nan))
    return scores


def _watched(kind: str, r: float, beta: float, seed: int) -> Mapping[str, tuple[Estimate, float]]:
    """Of one test on the frame: what was measured, and its truth."""
    _, _, energy, amplitude = steady(r, beta)
    off = 1.0 + np.array([GAIN, GAIN, GAIN, NORMAL]) * np.random.default_rng([28, seed]).standard_normal(4)
    channels, mass = cell.channels_of(r, beta, seed=seed), "mass_displacement" if kind == "force" else f"mass_{kind}"
    for name, factor in ((mass, off[0]), ("base_displacement", off[1]), ("contact_force", off[2] * off[3])):
        channels[name] = channels[name] * factor
    names = (mass, "base_displacement", *(["contact_force"] if kind == "force" else []))
    m = measure(cell.recording(channels, *names), cell.scene(gain_error=GAIN, linearity=0.0, lag_s_u=1e-9))
    if kind != "force":
        return {"energy per cycle": (m.energy, energy), "amplitude": (m.amplitude, amplitude)}
    return {"coefficient": (m.measured_coefficient, beta * cell.STIFFNESS * BASE_M / cell.NORMAL_N)}


def _turned(seed: int) -> Mapping[str, tuple[Estimate, float]]:
    """Of one rotary test: torque of dry friction over an angle that swings to and fro."""
    rng, t = np.random.default_rng([29, seed]), np.arange(0.0, 40.0, 0.002)
    tau, size, torque, off = 2 * math.pi * 0.8 * t, 0.2, 1.5, 1.0 + GAIN * rng.standard_normal(2)
    channels = {"time": t, "angle": off[0] * (size * np.sin(tau) + 1e-4 * rng.standard_normal(len(t)))}
    channels["torque"] = off[1] * (torque * np.sign(np.cos(tau)) + 0.01 * rng.standard_normal(len(t)))
    given = scene_from_tables({"rig": {"kind": "prescribed"}, "sensors": {"gain_error": GAIN, "linearity": 0.0}})
    m = measure(cell.recording(channels, "angle", "torque"), given)
    return {"energy of a cycle": (m.force_energy_j, 4 * size * torque), "swing": (m.base_amplitude, size)}


def main() -> None:
    """Write a table for each kind asked for."""
    draws, kinds = int(sys.argv[1]) if len(sys.argv) > 1 else DRAWS, sys.argv[2:] or [""]
    for kind in kinds:
        lines = [f"{draws} draws; share of truths within 1 and 1.96 stated {'' if kind else 'standard '}errors"]
        lines.append(f"{'motion':34s}{'quantity':18s}{'68.3 %':>8s}{'95.0 %':>8s}{'rms':>7s}{'mean':>7s}")
        for r, beta, words in CASES[: 1 if kind == "angle" else 2]:
            scores = errors_of_a_kind(kind, r, beta, draws) if kind else errors_over_stated(r, beta, draws)
            title = "a swing of 0.2 rad" if kind == "angle" else f"r = {r}, beta = {beta}, {words}"
            for name, score in scores.items():
                inside = [100 * float(np.mean(np.abs(score) < limit)) for limit in (1.0, 1.96)]
                rms = math.sqrt(float(np.mean(np.square(score))))
                numbers = f"{inside[0]:8.1f}{inside[1]:8.1f}{rms:7.2f}{float(np.mean(score)):7.2f}"
                lines.append(f"{title:34s}{name:18s}{numbers}")
        place = RESULTS / f"analysis_coverage{f'_{kind}' if kind else ''}.txt"
        place.write_text("\n".join(lines) + "\n")
        sys.stdout.write(place.read_text())


if __name__ == "__main__":
    main()
