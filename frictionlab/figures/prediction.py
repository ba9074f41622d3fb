"""Tests not made, by the law of their material: the motion of one, or the curve of several, with 95 % bands."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.style import BASE, PREDICTED, caution, headline, look, new_figure

if TYPE_CHECKING:
    from frictionlab.inference.predictive import PredictedTest, Prediction

CURVES = {"response_amplitude_m": "amplitude [mm]", "energy_per_cycle_j": "energy per cycle [mJ]"}
SHADE = 0.25
FEW = 20  # points of a curve that are marked


def prediction_figure(prediction: "Prediction") -> Figure:
    """One test: its displacement over time, and the loop; several: amplitude and energy over the frequency ratio."""
    tests, first = prediction.tests, prediction.tests[0]
    with look():
        figure = new_figure()
        axes = figure.subplots(1, 2, width_ratios=(1.6, 1.0) if len(tests) == 1 else (1.0, 1.0))
        if len(tests) == 1:
            draw_predicted_motion(first, axes[0])
            draw_predicted_loop(first, axes[1])
        else:
            for ax, name in zip(axes, CURVES, strict=True):
                draw_predicted_curve(prediction, name, ax)
        at = f"{first.normal_force_n:.4g} N, base {1e3 * first.base_amplitude_m:.4g} mm"
        headline(figure, f"{first.material}, {first.law}: {at}; shaded: 95 of 100 such tests")
        caution(figure, list(dict.fromkeys(said for test in tests for said in test.warnings)))
    return figure


def draw_predicted_motion(test: "PredictedTest", ax: Axes) -> Axes:
    """Displacement of the mass with its band, and of the base, in mm."""
    ax.plot(test.time, 1e3 * test.base, color=BASE, linewidth=0.8, label="base")
    ax.plot(test.time, 1e3 * test.displacement, color=PREDICTED, label="mass")
    ax.fill_between(
        test.time, 1e3 * test.displacement_low, 1e3 * test.displacement_high,
        color=PREDICTED, alpha=SHADE, linewidth=0.0,
    )  # fmt: skip
    ax.set(xlabel="time [s]", ylabel="displacement [mm]")
    ax.margins(y=0.18)
    ax.legend(loc="upper right", ncols=2)
    return ax


def draw_predicted_loop(test: "PredictedTest", ax: Axes) -> Axes:
    """Base over mass: the area is the energy per cycle (2.18)."""
    ax.plot(1e3 * test.displacement, 1e3 * test.base, color=PREDICTED)
    ax.fill_betweenx(
        1e3 * test.base, 1e3 * test.displacement_low, 1e3 * test.displacement_high,
        color=PREDICTED, alpha=SHADE, linewidth=0.0,
    )  # fmt: skip
    ax.set(xlabel="mass [mm]", ylabel="base [mm]")
    return ax


def draw_predicted_curve(prediction: "Prediction", name: str, ax: Axes) -> Axes:
    """One number over the frequency ratio, with its band."""
    rows = np.array([(test.frequency_ratio, *test.numbers[name]) for test in prediction.tests], dtype=np.float64)
    r, value, low, high = rows[np.argsort(rows[:, 0])].T
    ax.plot(r, 1e3 * value, color=PREDICTED, marker="." if len(r) <= FEW else None)
    ax.fill_between(r, 1e3 * low, 1e3 * high, color=PREDICTED, alpha=SHADE, linewidth=0.0)
    ax.set(xlabel="frequency ratio $r$", ylabel=CURVES[name])
    ax.set_ylim(bottom=0.0)
    return ax
