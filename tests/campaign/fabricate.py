"""Fabricated measurements: rows as `analyze` gives them, of tests whose truth is known."""

import math
import zlib

import numpy as np

from frictionlab.campaign import evaluate
from frictionlab.campaign.friction import FrictionFit
from frictionlab.campaign.trials import Trial
from frictionlab.recording import Recording
from frictionlab.scene import scene_from_tables
from frictionlab.simulator import Problem, steady_state
from tests.inference.contacts import BASE_M, NATURAL_HZ, recorded

STIFFNESS = 1191.0
AMPLITUDE = BASE_M
NATURAL = 3.1297
SCENE: dict[str, dict[str, object]] = {"rig": {"stiffness_n_per_m": STIFFNESS, "natural_frequency_hz": NATURAL}}

QUIET: dict[str, dict[str, object]] = {
    "rig": {
        "stiffness_n_per_m": STIFFNESS, "natural_frequency_hz": NATURAL,
        "natural_frequency_hz_u": 1e-9, "stiffness_n_per_m_u": 1e-9, "damping_ratio": 0.0,
    },
    "sensors": {"gain_error": 0.0, "linearity": 0.0, "lag_s_u": 0.0},
    "experiment": {"normal_force_n_u": 1e-9},
}  # fmt: skip
"""A rig and sensors that are known exactly."""


def fit_of(trials: list[Trial]) -> FrictionFit:
    """The fit of tests of one material and normal force, on a rig that is known exactly."""
    (fit,) = evaluate(trials, scene_from_tables(QUIET)).fits
    return fit


def row(
    material: str,
    force: float,
    r: float,
    coefficient: float,
    *,
    noise: float = 0.002,
    seed: int = 0,
    damping: float = 0.0,
    irregularity: float = 0.01,
    **more: object,
) -> dict[str, object]:
    """One measurement of a Coulomb contact; ``noise``: relative error of both, as stated; ``damping``: of the frame."""
    name = f"{material}_N{force:g}_r{r:g}"
    generator = np.random.default_rng([seed, zlib.crc32(name.encode())])
    beta = coefficient * force / (STIFFNESS * AMPLITUDE)
    state = steady_state(Problem(r, beta, frame_damping_ratio=damping))
    energy = state.energy_per_cycle if state.energy_per_cycle is not None else 9.0
    amplitude = state.response_amplitude if state.response_amplitude is not None else 9.0
    one, two, three = generator.standard_normal(3)
    return {
        "source": f"{name}.h5", "status": "ok", "reason": None, "warnings": [], "material": material,
        "normal_force_n": force, "sampling_rate_hz": 250.0, "duration_s": 90.0, "transient_s": 20.0,
        "drive_frequency_hz": r * NATURAL, "frequency_ratio": r, "frequency_ratio_se": 1e-5,
        "base_amplitude_m": AMPLITUDE, "energy_per_cycle": energy * (1 + noise * one),
        "energy_per_cycle_se": noise * energy, "response_amplitude": amplitude * (1 + noise * two),
        "response_amplitude_se": noise * amplitude,
        "irregularity_index": irregularity * math.exp(0.2 * three), "irregularity_floor": 0.001,
        "base_irregularity_index": 0.001, "stops_per_cycle": state.stops_per_cycle, "regime": state.regime,
        "asymmetry": 0.0, **more,
    }  # fmt: skip


COEFFICIENTS = {"steel": 0.6, "aramid": 0.35, "rubber": 0.95}
IRREGULARITY = {"steel": 0.05, "aramid": 0.01, "rubber": 0.03}
RATIOS = (0.3, 0.45, 0.7, 1.3, 1.6)


def small_campaign(*, seed: int = 0) -> list[dict[str, object]]:
    """Three materials x three forces x five ratios, a long test of each material, and a test that failed."""
    rows = [
        row(m, force, r, mu, irregularity=IRREGULARITY[m], seed=seed)
        for m, mu in COEFFICIENTS.items()
        for force in (1.0, 1.25, 1.5)
        for r in RATIOS
    ]
    for slope, (material, mu) in zip((0.05, 0.001, -0.2), COEFFICIENTS.items(), strict=True):
        long = row(material, 1.5, 0.3, mu, duration_s=1800.0, energy_trend_per_hour=slope)
        rows.append({**long, "source": f"{material}_long.h5", "energy_trend_per_hour_se": 0.005})
    rows.append(
        {"source": "<script>alert('x')</script>.csv", "status": "failed", "reason": "no drive & <b>nothing</b>"}
    )
    return rows


def steady_recording(problem: Problem | None = None, *, late: float = 0.0) -> Recording:
    """40 s of a steady contact on this rig, without scatter, whose base is shown so late [s]."""
    contact, generator, tuned = problem or Problem(0.6, 0.4), np.random.default_rng(3), NATURAL / NATURAL_HZ
    return recorded(contact, generator, scatter=0.0, seconds=40.0, tuned=tuned, lag_s=late)
