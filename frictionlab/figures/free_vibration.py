"""Free decays in one figure: what was measured over what was fitted, and what the fit leaves."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.analysis.free_vibration import FreeVibration
from frictionlab.figures.style import MEASURED, PAGE, PREDICTED, headline, look, new_figure


def draw_decays(taps: Sequence[FreeVibration], ax: Axes) -> Axes:
    """Each tap's displacement and the motion fitted to it."""
    for number, tap in enumerate(taps):
        label = ("measured", "fitted") if number == 0 else (None, None)
        ax.plot(tap.swing.time, 1e3 * tap.swing.measured, color=MEASURED, label=label[0])
        ax.plot(tap.swing.time, 1e3 * tap.swing.fitted, color=PREDICTED, lw=0.8, ls="--", label=label[1])
    ax.set(xlabel="time [s]", ylabel="displacement of the mass [mm]")
    ax.legend(loc="upper right", ncols=2)
    return ax


def draw_residuals(taps: Sequence[FreeVibration], ax: Axes) -> Axes:
    """What the fit leaves of each tap."""
    for tap in taps:
        ax.plot(tap.swing.time, 1e6 * (tap.swing.measured - tap.swing.fitted), color=MEASURED, lw=0.5)
    ax.set(xlabel="time [s]", ylabel="measured - fitted [µm]")
    return ax


def free_vibration_figure(taps: Sequence[FreeVibration], name: str = "") -> Figure:
    """Both, with the numbers of each tap above; ``name`` stands above them."""
    with look():
        figure = new_figure(PAGE, 4.6)
        grid = figure.add_gridspec(2, 1, height_ratios=(2.0, 1.0))
        shown = "\n".join(_title(tap) for tap in taps[:3]) + (f"\n... {len(taps)} taps" if len(taps) > 3 else "")
        draw_decays(taps, figure.add_subplot(grid[0])).set_title(shown)
        draw_residuals(taps, figure.add_subplot(grid[1]))
        headline(figure, name)
        return figure


def _title(tap: FreeVibration) -> str:
    return (
        f"{tap.start_s:.4g} s:   f_n = {tap.natural_frequency_hz:.6g} ± {tap.natural_frequency_hz_se:.1g} Hz   "
        f"zeta = {_known(tap.damping_ratio, tap.damping_ratio_se, tap.damping_ratio_upper)}   "
        f"F/k = {_known(1e6 * tap.friction_m, _scaled(tap.friction_m_se), _scaled(tap.friction_m_upper))} µm"
    )


def _scaled(value: float | None) -> float | None:
    return None if value is None else 1e6 * value


def _known(value: float, se: float | None, upper: float | None) -> str:
    return f"below {upper:.2g}" if se is None else f"{value:.4g} ± {se:.1g}"
