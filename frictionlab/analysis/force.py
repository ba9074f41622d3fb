"""Friction by a load cell at the contact: energy of a cycle, friction force and coefficient, without a model.

The energy is the loop of force over displacement, ``E = integral F dx`` once round; what a mass between sensor and
contact adds, ``m x''``, closes to nothing in it. The friction force is that energy over the way, ``E / integral |dx|``,
a mean over the way of sliding, and the coefficient is ``E / integral N |dx|``.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis import channels, energy, steadiness
from frictionlab.analysis.layout import Layout
from frictionlab.analysis.measurement import Cycle
from frictionlab.analysis.response import Response
from frictionlab.estimate import Estimate
from frictionlab.uncertainty import Sources

FloatArray = NDArray[np.float64]
APART = 3.0  # combined uncertainties between the two energies, and ...
MATTERS = 0.02  # ... relative: from both on it is said


@dataclass(frozen=True)
class Friction:
    """What the load cell says: energy of a cycle (J), friction force (N), coefficient, the mean cycle of force (p,) N.

    ``cycle`` starts at tau = 0.
    """

    energy: Estimate
    force: Estimate
    coefficient: Estimate
    cycle: FloatArray
    warnings: tuple[str, ...]


def by_load_cell(
    layout: Layout,
    answer: Response,
    used: slice,
    sources: Sources,
    *,
    normal_force_n: float | None,
    inertia_kg: float = 0.0,
    wall_moves: bool = False,
) -> Friction | None:
    """Measure friction by the channel of force or torque; None where there is none.

    Parameters
    ----------
    layout, answer, used
        Cycles, the motion in them, and which of them are used.
    sources : Sources
        Gains and the normal force are as uncertain as it says.
    normal_force_n : float or None
        Of this test; a channel of its own wins.
    inertia_kg : float
        Mass between sensor and contact.
    wall_moves : bool
        The contact slides on the base.

    Examples
    --------
    >>> from frictionlab.recording import Channel, Recording
    >>> from frictionlab.analysis.measure import measure
    >>> from frictionlab.scene import Scene
    >>> t = np.arange(0.0, 30.0, 0.004)
    >>> x, y = 1e-3 * np.sin(2 * np.pi * t), 2e-3 * np.cos(2 * np.pi * t)
    >>> force = Channel("contact_force", 0.5 * np.sign(np.cos(2 * np.pi * t)))
    >>> m = measure(Recording(t, x, y, channels=(force,), experiment={"normal_force_n": 2.0}), Scene())
    >>> print(f"{m.force_energy_per_cycle_j:.4f} {m.measured_friction_coefficient:.3f}")
    0.0020 0.250
    """
    name = next((name for name in channels.FORCES if name in layout.more), None)
    if name is None or answer.is_stuck:
        return None
    unit, points = layout.drive.amplitude, layout.mass.shape[1]
    slid = layout.mass - layout.base if wall_moves else layout.mass
    rows = layout.more[name]
    spectrum = np.fft.rfft(slid[used].mean(axis=0))
    if not wall_moves:
        spectrum = answer.how.mean * points if answer.how.period == 1 else spectrum
    k = np.arange(len(spectrum))
    speed = np.abs(np.fft.irfft(1j * k * spectrum, points))
    way = 2.0 * math.pi * float(speed.mean()) * unit * answer.amplitude / max(answer.size, 1e-300)
    each = energy.loop_area(slid * unit, rows)
    turned = float(each[used].mean()) < 0.0
    each, rows = (-each, -rows) if turned else (each, rows)
    normal, u_normal = np.full(len(rows), math.nan), sources.normal_force
    if "normal_force" in layout.more:
        normal = np.abs(layout.more["normal_force"] @ speed) / max(float(speed.sum()), 1e-300)
        u_normal = sources.mass_gain
    elif normal_force_n is not None:
        normal[:] = normal_force_n
    gain = math.hypot(sources.mass_gain, 1e-9)
    loop = _mean(each, used, layout).with_relative(math.hypot(gain, sources.mass_gain))
    force = _ratio(each, way, used, layout).with_relative(gain)
    known = bool(np.isfinite(normal).all()) and name != "torque"
    coefficient = _ratio(each, way * normal, used, layout) if known else Estimate()
    cycle = rows[used].mean(axis=0)
    omega = 2.0 * math.pi * layout.drive.frequency
    cycle = cycle - inertia_kg * omega**2 * unit * np.fft.irfft(-(k**2) * spectrum, points)
    said = (
        (f"{name}: it counts the other way, friction against the motion is negative in it: its sign is turned",)
        if turned
        else ()
    )
    return Friction(
        energy=loop,
        force=force if name != "torque" else Estimate(),
        coefficient=coefficient.with_relative(math.hypot(gain, u_normal)),
        cycle=np.roll(cycle - cycle.mean(), -(points // 4)),
        warnings=said,
    )


def _mean(values: FloatArray, used: slice, layout: Layout) -> Estimate:
    drift = steadiness.growth(values)
    mean = energy.mean_over(values, used, noise=0.0, drift=drift, period=layout.foreign.period)
    return Estimate(mean.value, mean.se)


def _ratio(values: FloatArray, over: FloatArray, used: slice, layout: Layout) -> Estimate:
    """Sum over sum: a cycle in which little moves counts little; its error by what each cycle is off."""
    size = float(over[used].mean())
    if not size > 0.0:
        return Estimate()
    ratio = float(values[used].mean()) / size
    return _mean(ratio + (values - ratio * over) / size, used, layout)


def taken_by_the_frame(cycle: Cycle, damping_ratio: float, r: float) -> float:
    """Energy (k Y^2) that the dashpot between mass and base takes in a mean cycle."""
    lines = np.fft.rfft(cycle.mass_smooth - cycle.base)
    speed = np.fft.irfft(1j * np.arange(len(lines)) * lines, len(cycle.tau))
    return 4.0 * math.pi * damping_ratio * r * float(np.mean(speed**2))


def doubts_of(friction: Friction, loop: Estimate, stiffness: float | None, unit: float, taken: float) -> list[str]:
    """Say where the loop of force and that of the motion do not agree; ``taken``: by the frame (k Y^2)."""
    said = list(friction.warnings)
    if stiffness is None or loop.value is None or not friction.energy.value:
        return said
    scale = stiffness * unit**2
    by_motion = (loop.value - taken) * scale
    apart = friction.energy.value - by_motion
    u = math.hypot(friction.energy.error or 0.0, (loop.error or 0.0) * scale)
    if abs(apart) > max(APART * u, MATTERS * abs(by_motion)):
        said.append(
            f"force_energy_per_cycle: the load cell gives {friction.energy.value:.3g} J, the loop of the motion"
            f" {by_motion:.3g} J, {100.0 * apart / by_motion:+.2g} %: gain or place of the load cell, stiffness_n_per_m"
            " or the frame's damping_ratio in [rig] are off"
        )
    return said
