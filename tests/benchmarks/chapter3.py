"""The thesis's chapter 3, redrawn from exact steady states, with the figures that prove where it is wrong.

    python -m tests.benchmarks.chapter3 FOLDER

The numbering is the thesis's. Figures 3.2x and 3.5x are not in it: they show what a hundred cycles from rest miss.
"""

import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from frictionlab.arrays import FloatArray
from frictionlab.figures.simulated import draw_motion
from frictionlab.figures.style import GREY, LOOK, PAGE, PALETTE, PREDICTED, new_figure, save, shades
from frictionlab.simulator import Motion, Problem, SteadyState, last_cycle, simulate, steady_state, sweep
from tests.simulator.closed_form import continuous_energy, viscous_energy

TURN = 2.0 * np.pi
BETAS = tuple(round(0.1 * i, 1) for i in range(1, 10))
RATIOS = np.array([round(0.02 + 0.01 * i, 2) for i in range(249)])
REGIMES = ((0.9, 0.4, "continuous"), (0.5, 0.2, "asymmetric"), (0.5, 0.4, "two stops"), (0.1, 0.4, "six stops"))
WAITS = (10, 20, 50, 100, 200, 500, 1000, 2000)
WAITED = 100  # cycles the thesis waits
CEILING = 9.0  # k Y^2: where energies without bound at r = 1 leave the page


@cache
def energy_and_stops() -> tuple[FloatArray, FloatArray]:
    """Energy and stops per cycle over RATIOS and BETAS; NaN where there is no steady state."""
    states = sweep(RATIOS.tolist(), BETAS).datasets()
    return states["energy_per_cycle"][:, :, 0, 0], states["stops_per_cycle"][:, :, 0, 0]


@cache
def regime(number: int) -> SteadyState:
    """The state of a panel of Fig. 3.2; the asymmetric one after 100 cycles, as the thesis has it."""
    r, beta, name = REGIMES[number]
    return last_cycle(Problem(r, beta), cycles=WAITED) if name == "asymmetric" else steady_state(Problem(r, beta))


def orbit_of(state: SteadyState) -> Motion:
    """The motion of a state that has one."""
    assert state.orbit is not None, state.verdict
    return state.orbit


def loop_area(state: SteadyState, samples: int = 400) -> float:
    """Area of the hysteresis loop of one cycle, by the trapezoidal rule on so many samples, eq. (2.18)."""
    tau = np.linspace(0.0, TURN, samples + 1)
    x, y = orbit_of(state).at(tau)[0], np.cos(tau)
    return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)))


def draw_regimes() -> Figure:
    """Figure 3.2: the four regimes in time."""
    figure = new_figure(PAGE, 4.2)
    for number, ((r, beta, name), ax) in enumerate(zip(REGIMES, figure.subplots(2, 2).flat, strict=True)):
        end = 2.0 * (draw_motion(regime(number), ax).get_xlim()[1] // 2.0)
        ax.set(xlim=(end - 2.0, end), xticks=np.linspace(end - 2.0, end, 5))  # of several periods the last whole one
        ax.set_title(rf"{name}: $r = {r:g}$, $\beta = {beta:g}$")
    return figure


def draw_non_stop() -> Figure:
    """Figure 3.2x: the "non-stop" of Fig. 3.2b is a stop that shortens like N^(-1/2) and is gone only in the limit."""
    figure = new_figure(PAGE, 2.6)
    left, right = figure.subplots(1, 2)
    orbit = orbit_of(regime(1))
    begin, end = max(orbit.stops, key=lambda stop: stop[1] - stop[0])
    tau = np.linspace(begin - 0.15, end + 0.15, 600)
    tau = tau[(tau >= orbit.start) & (tau <= orbit.end)]
    left.plot((tau - begin), (orbit.at(tau)[0] - orbit.at(begin)[0]) * 1e6, color=PREDICTED)
    left.axvspan(0.0, end - begin, color=GREY, alpha=0.3, linewidth=0)
    left.set(ylabel=r"displacement, $10^{-6}\,Y$", title=r"$r = 0.5$, $\beta = 0.2$: the flat peak is a stop")
    left.set(xlabel=f"time since the mass stopped, rad (cycle {WAITED})", ylim=(-2.0, 2.0))
    cycles, runs = np.array(WAITS, dtype=float), [simulate(Problem(0.5, 0.2), cycles=n + 1, keep=2) for n in WAITS]
    longest = [float(np.diff(run.stops).max()) for run in runs]
    right.loglog(cycles, longest, "o", color=PREDICTED, markersize=4, label="exact phases from rest")
    right.loglog(cycles, longest[-1] * np.sqrt(cycles[-1] / cycles), color=GREY, label=r"$\propto N^{-1/2}$")
    title = "it shortens for ever: no 100 cycles settle it"
    right.set(xlabel="cycles from rest $N$", ylabel="longest stop, rad", title=title)
    right.legend()
    return figure


def draw_loops() -> Figure:
    """Figure 3.3: hysteresis loops of a continuous and of a two-stop motion."""
    figure = new_figure(PAGE, 2.8)
    for ax, index in zip(figure.subplots(1, 2), (0, 2), strict=True):
        state, (r, beta, name) = regime(index), REGIMES[index]
        tau = np.linspace(0.0, TURN, 1500)
        x, y = orbit_of(state).at(tau)[0], np.cos(tau)
        ax.plot(x, y, color=PREDICTED)
        ax.set_title(rf"{name}: $r = {r:g}$, $\beta = {beta:g}$, area ${state.energy_per_cycle:.4f}\,kY^2$")
        ax.set(xlabel="mass $x/Y$", ylabel="base $y/Y$")
    return figure


def _spread(some: FloatArray, values: list[float]) -> FloatArray:
    """Values at some of RATIOS over all of them: NaN elsewhere."""
    found = np.full(len(RATIOS), np.nan)
    found[np.isin(RATIOS, some)] = values
    return found


def draw_family(
    ceiling: float, title: str, lines: Mapping[str, FloatArray], dots: Sequence[tuple[FloatArray, Sequence[float]]]
) -> Figure:
    """Energies over the frequency ratio, a colour for each line and the dots (r, energy) that belong to it."""
    figure = new_figure(PAGE, 3.4)
    labels = {"xlabel": "frequency ratio $r$", "ylabel": "energy per cycle, $kY^2$"}
    ax = figure.subplots(subplot_kw={**labels, "ylim": (0.0, ceiling)})
    for (label, line), (r, marked), colour in zip(lines.items(), dots, shades(len(lines)), strict=True):
        ax.plot(RATIOS, line, color=colour, label=label)
        ax.plot(r, marked, "o", color=colour, markersize=2.3)
    ax.legend(ncols=2, title=title)
    return figure


def draw_continuous_energy() -> Figure:
    """Figure 3.4: continuous motion, the analytical method 4 beta X (2.23) on the loop's area (2.18)."""
    (_, stops), lines, dots = energy_and_stops(), {}, []
    for j, beta in enumerate(BETAS[:8]):
        smooth = RATIOS[stops[:, j] == 0]
        areas = [loop_area(steady_state(Problem(r, beta))) for r in smooth]
        lines[rf"$\beta = {beta:g}$"] = _spread(smooth, areas)
        dots.append((smooth[::5], [continuous_energy(r, beta) for r in smooth[::5]]))
    figure = draw_family(CEILING, "line: loop area; dots: $4\\beta X$", lines, dots)
    figure.axes[0].axvline(1.0, color=GREY, linewidth=0.6, linestyle=":")
    figure.axes[0].text(0.4, 0.97 * CEILING, r"$\beta < \pi/4$: no bound at $r = 1$", fontsize=7, va="top")
    return figure


def draw_energy() -> Figure:
    """Figure 3.5: the whole map, continuous motion as lines and stick-slip as dots."""
    energy, stops = energy_and_stops()
    smooth = {beta: np.where(stops[:, j] == 0, energy[:, j], np.nan) for j, beta in enumerate(BETAS)}
    dots = [(RATIOS, np.where(stops[:, j] == 0, np.nan, energy[:, j]).tolist()) for j in range(len(BETAS))]
    lines = {rf"$\beta = {beta:g}$": line for beta, line in smooth.items()}
    return draw_family(CEILING, "line: continuous; dots: stick-slip", lines, dots)


def draw_unconverged() -> Figure:
    """Figure 3.5x: what a hundred cycles from rest give near resonance, against the limit."""
    figure = new_figure(PAGE, 2.8)
    ax, (energy, _) = figure.subplots(), energy_and_stops()
    for j, (beta, colour) in enumerate(zip(BETAS, PALETTE[:3], strict=False)):
        runs = [last_cycle(Problem(r, beta), cycles=WAITED).energy_per_cycle or np.nan for r in RATIOS]
        error = np.abs(np.array(runs) / energy[:, j] - 1.0)
        ax.semilogy(RATIOS, error, ".", color=colour, markersize=3.5, label=rf"$\beta = {beta:g}$")
    ax.axhline(0.01, color=GREY, linewidth=0.8)
    title = f"energy of cycle {WAITED} from rest against the steady state"
    ax.set(xlabel="frequency ratio $r$", ylabel="relative error of the energy", title=title, ylim=(1e-16, 1e2))
    ax.legend(loc="upper right", ncols=3)
    return figure


def draw_viscous() -> Figure:
    """Figure 3.7: the viscous oscillator, formula (3.7) as lines and hysteresis as dots."""
    lines = {rf"$\zeta = {zeta:g}$": np.array([viscous_energy(r, zeta) for r in RATIOS]) for zeta in BETAS}
    marked = RATIOS[::8]
    dots = [(marked, [loop_area(steady_state(Problem(r, 0.0, zeta=zeta))) for r in marked]) for zeta in BETAS]
    return draw_family(16.5, "line: formula (3.7); dots: loop area", lines, dots)


FIGURES = {
    "figure_3.2_regimes": draw_regimes,
    "figure_3.2x_non_stop": draw_non_stop,
    "figure_3.3_loops": draw_loops,
    "figure_3.4_continuous_energy": draw_continuous_energy,
    "figure_3.5_energy": draw_energy,
    "figure_3.5x_hundred_cycles": draw_unconverged,
    "figure_3.7_viscous": draw_viscous,
}


def draw_all(folder: Path) -> None:
    """Write the chapter's figures (.pdf, and .png to look at) into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with rc_context(LOOK):
        for figure, name in [(draw(), name) for name, draw in FIGURES.items()]:
            for suffix in (".pdf", ".png"):
                save(figure, folder / f"{name}{suffix}", force=True)


if __name__ == "__main__":
    draw_all(Path(sys.argv[1] if len(sys.argv) > 1 else "build/chapter3"))
