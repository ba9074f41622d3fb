"""The campaign's fits, slow and obvious: a grid instead of Gauss-Newton, brute force instead of bisection."""

import numpy as np
from numpy.typing import NDArray

from frictionlab.campaign.prediction import MODEL_FLOOR, RATIO_FLOOR
from frictionlab.campaign.trials import Trial
from frictionlab.simulator import Problem, steady_state

FloatArray = NDArray[np.float64]


def prediction(r: float, beta: float) -> FloatArray:
    state = steady_state(Problem(r, beta))
    return np.array([state.energy_per_cycle, state.response_amplitude], dtype=float)


def chi_square(trials: list[Trial], beta: float) -> float:
    """Distance of all tests from one friction ratio; the error of r enters through finite differences."""
    total = 0.0
    for trial in trials:
        measured = np.array(trial.mean)
        errors = np.hypot(trial.mean_se, MODEL_FLOOR * measured)
        ratio_error = np.hypot(trial.frequency_ratio_se or 0.0, RATIO_FLOOR * trial.r)
        step = 1e-4
        by_r = (prediction(trial.r + step, beta) - prediction(trial.r - step, beta)) / (2 * step)
        covariance = np.diag(errors**2) + np.outer(by_r, by_r) * ratio_error**2
        gap = measured - prediction(trial.r, beta)
        total += float(gap @ np.linalg.solve(covariance, gap))
    return total


def best_friction_ratio(trials: list[Trial], low: float, high: float) -> float:
    """The lowest point of chi-square on a fine grid, and the vertex of the parabola through its neighbours."""
    grid = np.linspace(low, high, 61)
    values = np.array([chi_square(trials, float(beta)) for beta in grid])
    i = int(np.clip(np.argmin(values), 1, len(grid) - 2))
    a, b, _ = np.polyfit(grid[i - 1 : i + 2] - grid[i], values[i - 1 : i + 2], 2)
    return float(grid[i] - b / (2 * a))


def scatter(value: FloatArray, error: FloatArray) -> float:
    """Paule and Mandel's scatter by trying many."""
    tries = np.linspace(0.0, 3 * float(np.ptp(value)), 20001)
    weight = 1 / (error[:, None] ** 2 + tries**2)
    mean = (weight * value[:, None]).sum(axis=0) / weight.sum(axis=0)
    excess = (weight * (value[:, None] - mean) ** 2).sum(axis=0) - (len(value) - 1)
    return float(tries[np.argmax(excess <= 0)])
