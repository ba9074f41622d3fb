"""Energy per cycle: the area of the hysteresis loop, eq. (2.18), and the energy input, eq. (2.16), beside it.

A load cell at the contact gives energy, friction force and coefficient without a model. The energy is the loop of force
over displacement, ``E = integral F dx`` once round; what a mass between sensor and contact adds, ``m x''``, closes to
nothing in it. The friction force is that energy over the way, ``E / integral |dx|``, a mean over the way of sliding,
and the coefficient is ``E / integral N |dx|``.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from frictionlab.analysis import channels, steadiness
from frictionlab.analysis.cycles import some_cycles
from frictionlab.analysis.signals import variance_of_mean
from frictionlab.arrays import FloatArray, shifted
from frictionlab.estimate import NOT_KNOWN, Estimate
from frictionlab.uncertainty import Sources, unit_uncertainty

if TYPE_CHECKING:
    from frictionlab.analysis.layout import Layout
    from frictionlab.analysis.response import Response


def loop_area(mass: FloatArray, base: FloatArray) -> FloatArray:
    """Area of closed loops, the integral of base d(mass) once round; positive when energy is dissipated.

    The polygon through all points and the two through every second one are combined (Richardson), which removes the
    second-order error of a polygon in a smooth curve: 3e-6 at 64 points a cycle where the polygon alone is 1.6e-3 off.

    ``mass``, ``base`` (n, points), 5 at least: one cycle a row, equally spaced in phase. Returns (n,), in the product
    of the units given; dimensionless (k Y^2) for x/Y and y/Y.
    """
    fine, coarse = (  # sums of base_i (mass_{i+stride} - mass_{i-stride}) / 2 round the loop
        0.5 * np.einsum("ij,ij->i", base, np.roll(mass, -stride, axis=1) - np.roll(mass, stride, axis=1))
        for stride in (1, 2)
    )
    return np.asarray((4.0 * fine - 0.5 * coarse) / 3.0)


def energy_input(mass: FloatArray) -> FloatArray:
    """Energy input of a pure cosine base, eq. (2.16): the integral of x' cos(tau), as pi times x's sine part.

    ``mass`` (n, points): x/Y, one cycle a row, from tau = -pi/2 (the base rises through zero).
    """
    points = mass.shape[1]
    tau = 2.0 * math.pi * np.arange(points) / points - 0.5 * math.pi
    return np.asarray(np.einsum("ij,j->i", mass, np.sin(tau)) * (2.0 * math.pi / points))


def loop_area_noise(mass: FloatArray, base: FloatArray, mass_noise: float, base_noise: float, samples: float) -> float:
    """Standard error of the area of a mean cycle's loop from white noise, rms of one of the ``samples`` of a cycle."""
    d_mass, d_base = ((np.roll(c, -1) - np.roll(c, 1)) * (len(c) / (4.0 * math.pi)) for c in (mass, base))
    variance = mass_noise**2 * float(np.mean(d_base**2)) + base_noise**2 * float(np.mean(d_mass**2))
    variance += 0.9 * (mass_noise * base_noise * samples / (2.0 * math.pi)) ** 2  # noise times noise, 5-point slope
    return 2.0 * math.pi * math.sqrt(variance / samples)


def mean_over(values: FloatArray, used: slice, *, noise: float = 0.0, shared: float = 0.0) -> Estimate:
    """Mean of a per-cycle series (n,) over the cycles used, with its standard error; a steady drift is no scatter.

    ``noise``: standard error of one value from sensor noise alone, below which none is stated (0: not known, and then
    fewer than three cycles have no error); ``shared``: what all cycles have in common.
    """
    part, n, drift = values[used], len(values), steadiness.growth(values)
    mean = float(part.mean())
    # a few cycles take the scatter of all, about the line of a drift; what leaves much of the variance is a step
    level = values - drift * float(values.mean()) * np.linspace(-0.5, 0.5, n)
    some = part if len(part) >= 8 else level if level.var() < 0.1 * values.var() else values
    if len(some) <= 2 and not noise:
        return Estimate(mean)
    drift *= (len(part) - 1) / max(n - 1, 1)  # within the cycles used
    square = noise * noise / len(part)
    if len(some) > 2 and float(some.var(ddof=1)) > noise * noise * (1.0 + 2.0 * math.sqrt(2.0 / (len(some) - 1))):
        alone = float(some.var(ddof=1)) / len(part)
        square = max(alone if len(part) == 1 else variance_of_mean(some) * len(some) / len(part), square)
    return Estimate(mean, math.hypot(math.sqrt(square), shared, steadiness.OF_A_RAMP * drift * mean))


@dataclass(frozen=True)
class LoadCell:
    """The measured force in single steady cycles ``each`` (n, p) N, as `Cycle.force`, and what pressed the contact.

    ``normal_force``: mean over the way, N; None: not known; ``normal_is_measured``: by a channel of its own.
    """

    each: FloatArray
    normal_force: float | None
    normal_is_measured: bool


@dataclass(frozen=True, kw_only=True)
class ByForce:
    """Means by a load cell.

    ``force_energy`` (k Y^2) and ``force_energy_j`` of a cycle, friction force ``measured_force`` (N),
    ``measured_coefficient``.
    """

    force_energy: Estimate = NOT_KNOWN
    force_energy_j: Estimate = NOT_KNOWN
    measured_force: Estimate = NOT_KNOWN
    measured_coefficient: Estimate = NOT_KNOWN


def by_load_cell(
    layout: "Layout",
    answer: "Response",
    used: slice,
    sources: Sources,
    joules: float | None,
    *,
    normal_force_n: float | None,
    inertia_kg: float,
    wall_moves: bool,
    has_metres: bool,
    one_way: bool,
) -> tuple[ByForce, FloatArray | None, LoadCell | None, list[str]]:
    """Measure friction by the channel of force or torque, if there is one.

    Returns means, the mean cycle (p,) from tau = 0 on, of a force also its single cycles, and what is to be said.
    ``joules``: k Y^2; ``normal_force_n``: of this test, where no channel has it; ``inertia_kg``: mass between sensor
    and contact; ``one_way``: the contact slides one way, so that the mean of the force is no offset.
    """
    name = next((name for name in channels.FORCES if name in layout.more), None)
    if name is None or answer.is_stuck:
        return ByForce(), None, None, []
    unit, points, is_torque = layout.drive.amplitude, layout.mass.shape[1], name == "torque"
    slid = layout.mass - layout.base if wall_moves else layout.mass
    mean = slid[used].mean(axis=0) if wall_moves else answer.how.cycle(points)[0]
    speed = np.abs(shifted(mean, order=1))
    way = 2.0 * math.pi * float(speed.mean()) * unit * answer.series.amplitude / max(answer.size, 1e-300)
    each, rows = loop_area(slid * unit, layout.more[name]), layout.more[name]
    said = list[str]()
    if float(each[used].mean()) < 0.0:
        each, rows = -each, -rows
        said.append(f"{name}: it counts the other way, for friction against motion is negative: its sign is turned")
    normal, u_normal = np.full(len(rows), normal_force_n or math.nan), sources.normal_force
    if is_measured := "normal_force" in layout.more:
        normal = np.abs(layout.more["normal_force"] @ speed) / max(float(speed.sum()), 1e-300)
        u_normal = sources.mass_gain

    def over(size: FloatArray) -> Estimate:
        """Sum over sum: a cycle in which little moves counts little; its error by what each cycle is off."""
        usual = float(size[used].mean())
        if is_torque or not usual > 0.0:
            return NOT_KNOWN
        ratio = float(each[used].mean()) / usual
        return mean_over(ratio + (each - ratio * size) / usual, used)

    inertia = inertia_kg * (2.0 * math.pi * layout.drive.frequency) ** 2 * unit * shifted(mean, order=2)

    def at_contact(cycles: FloatArray) -> FloatArray:
        """Cycles (..., p) about their means from tau = 0 on, the inertia taken off."""
        return np.asarray(np.roll(cycles - cycles.mean(axis=-1, keepdims=True) - inertia, -(points // 4), axis=-1))

    gain, pressed = sources.mass_gain, float(normal[used].mean())
    energy = (mean_over(each, used) if has_metres or is_torque else NOT_KNOWN).with_relative(math.sqrt(2.0) * gain)
    force, coefficient = over(way).with_relative(gain), over(way * normal).with_relative(math.hypot(gain, u_normal))
    of_unit = math.hypot(sources.stiffness, 2.0 * unit_uncertainty(sources), math.sqrt(2.0) * gain)
    by_force = ByForce(
        force_energy=energy.over(joules).with_relative(of_unit),
        force_energy_j=energy,
        measured_force=force,
        measured_coefficient=coefficient,
    )
    mean_force = at_contact(rows[used].mean(axis=0)) + (float(rows[used].mean()) if one_way else 0.0)
    single = at_contact(rows[some_cycles(len(rows))])
    cell = LoadCell(single, pressed if math.isfinite(pressed) else None, is_measured)
    return by_force, mean_force, None if is_torque else cell, said


def taken_by_the_frame(stretched: FloatArray, damping_ratio: float, r: float) -> float:
    """Energy (k Y^2) that the dashpot between mass and base takes in a mean cycle of their distance (p,), Y."""
    return 4.0 * math.pi * damping_ratio * r * float(np.mean(shifted(stretched, order=1) ** 2))
