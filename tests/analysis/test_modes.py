"""Modes of two storeys against the eigenvalue problem written out."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from frictionlab.analysis.free_vibration import modes
from frictionlab.errors import AnalysisError
from frictionlab.hdf5 import write_recording
from frictionlab.recording import Channel, Recording
from tests.desk import invoke

FloatArray = NDArray[np.float64]
MASSES, STIFFNESSES, ZETA = (3.0, 2.0), (1200.0, 800.0), (0.01, 0.02)


def two_storeys(seed: int = 1) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Time, displacements (2, n) of a release, and the truth: frequencies [Hz] and shapes (mode, mass)."""
    k1, k2 = STIFFNESSES
    square, shapes = np.linalg.eig(np.diag(1 / np.array(MASSES)) @ np.array([[k1 + k2, -k2], [-k2, k2]]))
    order = np.argsort(square)
    omega, shapes = np.sqrt(square[order]), shapes[:, order].T
    shapes /= np.take_along_axis(shapes, np.abs(shapes).argmax(axis=1)[:, None], axis=1)
    t = np.arange(0.0, 25.0, 0.004)
    since = np.maximum(t - 1.0, 0.0)
    held = np.array(
        [np.exp(-z * w * since) * np.cos(w * math.sqrt(1 - z * z) * since) for z, w in zip(ZETA, omega, strict=True)]
    )
    x = 5e-3 * held[0] * shapes[0][:, None] + 3e-3 * held[1] * shapes[1][:, None]
    noise = 1e-6 * np.random.default_rng(seed).standard_normal(x.shape) + 5e-6 * np.cos(2 * math.pi * 50 * t)
    return t, x + noise, omega / (2 * math.pi), shapes


def test_frequencies_damping_and_shapes_are_those_of_the_frame() -> None:
    t, x, hz, shapes = two_storeys()
    found = modes(t, x)
    for mode, frequency, zeta, shape in zip(found, hz, ZETA, shapes, strict=True):
        assert mode.natural_frequency_hz == pytest.approx(frequency, rel=1e-4)
        assert mode.damping_ratio == pytest.approx(zeta, rel=2e-3)
        assert mode.shape == pytest.approx(tuple(shape), abs=1e-3)
        assert mode.natural_frequency_hz_se < 1e-4 * frequency


def test_errors_of_modes_hold_damping_that_wanders() -> None:
    """White residuals alone made them 23 to 50 times too small."""
    t, rng, scores = np.arange(0.0, 20.0, 0.005), np.random.default_rng(5), []
    for _ in range(8):
        slow, fast = (
            np.exp(-0.01 * w * t + 2e-3 * np.cumsum(rng.standard_normal(len(t)))) * np.cos(w * t) for w in (12.0, 31.0)
        )
        found = modes(t, 1e-3 * np.array([0.6 * slow + fast, slow - 0.6 * fast]))
        scores += [(mode.damping_ratio - 0.01) / mode.damping_ratio_se for mode in found]
    assert 0.5 < math.sqrt(float(np.mean(np.square(scores)))) < 2.0


def test_one_mode_in_two_columns_is_refused() -> None:
    t = np.arange(0.0, 20.0, 0.005)
    x = np.exp(-0.2 * t) * np.cos(20.0 * t)
    with pytest.raises(AnalysisError, match="expected 2 modes, one for each mass; got 1 clear"):
        modes(t, np.array([x, 0.5 * x]))


def test_the_command_gives_each_mode(tmp_path: Path) -> None:
    t, x, hz, _ = two_storeys()
    one = Recording(t, x[0], np.zeros(len(t)), channels=(Channel("mass_2_displacement", x[1]),))
    write_recording(one, tmp_path / "tap.h5")
    result = invoke("free-vibration", tmp_path / "tap.h5", "--json")
    row = json.loads(result.stdout)
    assert [mode["natural_frequency_hz"] for mode in row["modes"]] == pytest.approx(hz.tolist(), rel=1e-4)
    assert len(row["modes"][0]["shape"]) == 2
