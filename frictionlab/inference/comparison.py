"""A measured steady cycle, or a whole record, over its prediction: the results, with the contract's keys."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from frictionlab.analysis.response import Cycle
from frictionlab.arrays import ComplexArray, FloatArray
from frictionlab.recording import FrequencyTable
from frictionlab.schema import COMPARISONS, ENERGY, EXPECTED, Result, banded, with_error
from frictionlab.simulator import Base, Problem
from frictionlab.uncertainty import NOT_KNOWN, Estimate, FlatKnown, FrictionNames

FADE = 25.0  # harmonics of a contact's force above this fade out

Verdict = Literal["explained", "strained", "misfit"]
Fitted = Literal["cycle", "whole"]
SURE = 4.0  # errors between the least and the largest friction from which it is said to wander
LIKELY = 5.0  # the logarithm by which friction that wanders is more likely, from which it is said
MATTERS = 1e-3  # of the friction, below which its wandering is in the error alone
SHOWN = 5  # stretches reported one by one


@dataclass(frozen=True)
class WholeRecord:
    """A record over its prediction, from the first sample to the last.

    ``time`` (n,) s, by the recording's clock; ``base``, ``measured``, ``predicted`` (n,) over Y, the mass about the
    mean of its measured record; ``nrmse``: rms of measured minus predicted over the rms of the measured about its mean;
    ``energy_difference``: predicted / measured - 1, of the loop's area over the whole record, eq. (2.18).
    ``cycle_time``, ``cycle_measured``, ``cycle_predicted``, ``cycle_nrmse`` (c,): start of each period of the drive;
    its energy (k Y^2) as measured and as predicted; its own nrmse. ``cycle_friction``, ``cycle_friction_se`` (c,):
    friction ratio of each period as a random walk about the fitted one, and the standard error of its changes; their
    common level is as sure as the friction ratio itself. ``wanders``: logarithm of how much more likely friction that
    changes is than friction that does not. ``left``: where the prediction leaves the measurement: from, to (s), and the
    largest nrmse of a period there.
    """

    time: FloatArray
    base: FloatArray
    measured: FloatArray
    predicted: FloatArray
    nrmse: float
    energy_difference: float
    cycle_time: FloatArray
    cycle_measured: FloatArray
    cycle_predicted: FloatArray
    cycle_nrmse: FloatArray
    cycle_friction: FloatArray
    cycle_friction_se: FloatArray
    wanders: float
    left: tuple[tuple[float, float, float], ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on where the prediction leaves the measurement, and between which values friction wanders."""
        usual = 100.0 * float(np.median(self.cycle_nrmse)) if len(self.cycle_nrmse) else math.nan
        said = [
            f"record: the prediction leaves the measurement from {begin:.4g} s to {end:.4g} s: {100 * worst:.2g} %"
            f" of the response there, {usual:.2g} % in the usual period: friction that wanders, a jump, or a start"
            " that the law does not know"
            for begin, end, worst in self.left[:SHOWN]
        ]
        if self.wandering and np.ptp(self.cycle_friction) > MATTERS * np.max(self.cycle_friction):
            friction, error, time = self.cycle_friction, self.cycle_friction_se, self.cycle_time
            ends = int(np.argmin(friction)), int(np.argmax(friction))
            least, most = (f"{with_error(friction[i], error[i])} at {time[i]:.4g} s" for i in ends)
            said.append(f"record: friction wanders between {least} and {most}")
        if len(self.left) > SHOWN:
            said.append(f"record: the prediction leaves the measurement in {len(self.left) - SHOWN} more places")
        return tuple(said)

    @property
    def wandering(self) -> float:
        """Rms of the changes of friction over its mean; 0 where it is not beyond doubt that there are any."""
        friction, error = self.cycle_friction, self.cycle_friction_se
        if len(friction) < 2 or self.wanders < LIKELY:
            return 0.0
        low, high = int(np.argmin(friction)), int(np.argmax(friction))
        sure = friction[high] - friction[low] > SURE * math.hypot(float(error[low]), float(error[high]))
        return float(np.std(friction) / np.mean(friction)) if sure else 0.0


class AtContact(NamedTuple):
    """What a contact does at the phases of a cycle (p,): place in Y, velocity by phase, force on its mass over k Y."""

    displacement: FloatArray
    velocity: FloatArray
    force: FloatArray


@dataclass(frozen=True)
class ContactForce:
    """The contact's force over one cycle: recovered from the motion, and as the identified law has it.

    On the phases ``tau`` (p,) of the mean cycle, places about their means: ``seen``, its force as recovered, with lag,
    natural frequency and base motion as the fit has found them, about the law's mean, for sensors do not show where the
    spring is without force; ``predicted``, by the law, None without a prediction. ``residual`` x/Y (p,): measured minus
    predicted; ``floor``: what noise alone leaves of it, rms, Y. ``law``: its name.
    ``unit_m``: Y [m]; ``turn``: omega [rad/s]; ``unit_n``: k Y [N], None where the stiffness is not known, and
    ``stiffness_u``, relative; ``is_measured``: the force and, over its unit, ``residual`` and ``floor`` are a load
    cell's; ``is_one_way``: it slides one way, folded. As its comparison has them (`Comparison.contact`), ``laws``: the
    ladder's rungs, name -> (parameters, nrmse, logarithm of the evidence), ``said``: law and verdict in words, and
    ``warnings``.
    """

    source: str
    law: str
    tau: FloatArray
    seen: AtContact
    predicted: AtContact | None
    floor: float
    unit_m: float
    turn: float
    residual: FloatArray | None = None
    unit_n: float | None = None
    stiffness_u: float = 0.0
    is_measured: bool = False
    is_one_way: bool = False
    laws: Mapping[str, tuple[int, float, float]] = field(default_factory=dict)
    said: str = ""
    warnings: tuple[str, ...] = ()


def contact_force(cycle: Cycle, problem: Problem, late: float = 0.0) -> FloatArray:
    """Return the force of the contact on the mass over the measured cycle: what the equation of motion leaves for it.

    ``n = y - x - 2 zeta_f r (x' - y') - r^2 x''`` of the mean cycle without its noise.

    Over k Y, (p,) at the phases of ``cycle.tau``; positive against a motion in the positive direction. ``problem``: its
    frequency ratio, damping and base motion; ``late``: phase by which the base's channel is behind the mass's, rad.
    """
    lines, one = harmonics_of(cycle.mass_smooth[None, :]), np.ones(1)
    base, damping = base_lines(problem.base, lines.shape[1], late), 2.0 * problem.frame_damping_ratio * one
    return over_cycle(left_for_contact(lines, base, problem.r, one, one, damping), len(cycle.tau))


def harmonics_of(cycle: FloatArray, count: int | None = None) -> ComplexArray:
    """Return complex harmonics 1 to count (else all) of cycles (..., p) on equally spaced phases from 0."""
    return np.asarray(np.fft.rfft(cycle)[..., 1:][..., :count] * (2.0 / cycle.shape[-1]))


def base_lines(base: Base, count: int, late: float) -> ComplexArray:
    """Return so many harmonics of a base whose channel is behind by a phase, rad."""
    lines, known = np.zeros(count, dtype=np.complex128), min(base.harmonics, count)
    lines[:known] = base.lines[:known]
    return np.asarray(lines * np.exp(1j * late * np.arange(1, count + 1)))


def loop_energy(lines: ComplexArray, base: ComplexArray, late: float = 0.0) -> float:
    """Return the area of the loop (k Y^2, eq. 2.18) of a motion over a base, by harmonics 1 to K of both, over Y.

    ``late``: phase (rad) by which the base's channel is behind: it shows the motion so far ahead. Every energy that a
    lag changes, or is freed of one (``-late``), is this one; an amplitude does not change.
    """
    count = min(len(lines), len(base))
    order = np.arange(1, count + 1)
    turned = np.conj(base[:count]) * lines[:count] * np.exp(1j * late * order)
    return -math.pi * float(order @ turned.imag)


def left_for_contact(
    lines: ComplexArray, base: ComplexArray, r: float, mass: FloatArray, stiffness: FloatArray, damping: FloatArray
) -> ComplexArray:
    """Return what the equation of motion leaves at a mass: by harmonics (n, k) of all, and rows (n,) of matrices."""
    rate, stretch = r * np.arange(1, len(base) + 1), base - lines
    return np.asarray(stiffness @ stretch + 1j * rate * (damping @ stretch) + rate**2 * (mass @ lines))


def over_cycle(lines: ComplexArray, points: int) -> FloatArray:
    """Return a motion (p,) by its harmonics; high ones fade out, for noise times k^2 rules there."""
    fade = np.exp(-((np.arange(1, len(lines) + 1) / FADE) ** 2))
    return np.asarray(np.fft.irfft(np.concatenate([[0.0], 0.5 * points * fade * lines]), points))


@dataclass(frozen=True)
class OverFrequency:
    """A table over frequency, amplitudes in Y, at its ratios ``r`` (n,), and the law's curve as the sensors show it.

    ``curve_r``, ``curve_amplitude`` (Y), ``curve_phase`` (rad behind the base) (m,), NaN without a steady state.
    """

    r: FloatArray
    table: FrequencyTable
    curve_r: FloatArray
    curve_amplitude: FloatArray
    curve_phase: FloatArray


@dataclass(frozen=True, repr=False, kw_only=True)
class Comparison(FrictionNames, Result):
    """A measured steady cycle and its prediction; the contract's keys, ``None`` is not known.

    What each number is says its column in `frictionlab.schema`. ``friction`` (the friction ratio), ``force`` (N) and
    ``coefficient`` are estimates, with the contract's keys as flat names: ``_se`` with sensors and rig as they are
    known, ``_u`` with what is not known of them. ``tau`` (p,) rad from the top of the base's fundamental, ``base``,
    ``measured``, ``predicted`` (p,) in Y stand behind them. ``expected``: of a given motion, column -> what a law found
    elsewhere expects alone, and its 95 % band. ``record``: of the whole record, where it was asked for.
    A record without a steady cycle (a sweep, a start-up) has None for all that is a cycle's, and empty arrays: its law
    is given over the largest displacement of the base from its first value and, of speeds, over omega_n times that.
    Of a table over frequency (``over_frequency``) the nrmse is of amplitudes relative, of phases in radians.
    """

    source: str
    status: str
    reason: str | None
    warnings: tuple[str, ...]
    law: str
    friction: Estimate
    force: Estimate
    coefficient: Estimate
    parameters: Mapping[str, Mapping[str, Any]]
    model: str
    solver: str
    closure_error: float | None
    nuisances: Mapping[str, Mapping[str, float]]
    levels: Mapping[str, str]
    budget: Mapping[str, Mapping[str, float]]
    accuracy: str
    assumed: tuple[str, ...]
    material: str | None
    normal_force_n: float | None

    frequency_ratio: float | None = None
    energy_per_cycle: float | None = None
    response_amplitude: float | None = None
    stops_per_cycle: float | None = None
    regime: str | None = None
    predicted_energy_per_cycle: float | None = None
    predicted_response_amplitude: float | None = None
    predicted_stops_per_cycle: float | None = None
    predicted_regime: str | None = None
    force_energy_per_cycle_j: float | None = None
    expected: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    energy_difference: float | None = None
    response_nrmse: float | None = None
    response_floor: float | None = None
    misfit: float | None = None
    verdict: Verdict | None = None
    laws: tuple[Mapping[str, Any], ...] | None = None
    tau: FloatArray = field(default_factory=lambda: np.zeros(0))
    base: FloatArray = field(default_factory=lambda: np.zeros(0))
    measured: FloatArray = field(default_factory=lambda: np.zeros(0))
    predicted: FloatArray | None = None
    at_contact: ContactForce | None = None

    over_frequency: OverFrequency | None = None
    record_nrmse: float | None = None
    record_energy_difference: float | None = None
    record: WholeRecord | None = None
    cycle_law: str | None = None
    record_laws: tuple[Mapping[str, object], ...] | None = None

    friction_ratio = FlatKnown("friction")

    @property
    def energy(self) -> Estimate:
        """The measured energy per cycle (k Y^2), its error the sum of its budget's squares."""
        return Estimate(self.energy_per_cycle, None, math.hypot(*self.budget.get(ENERGY, {}).values()) or None)

    @property
    def energy_joules(self) -> Estimate:
        """The measured energy per cycle, where the stiffness is known: its error holds that of the stiffness."""
        contact = self.at_contact
        if contact is None or contact.unit_n is None:
            return NOT_KNOWN
        return self.energy.scaled(contact.unit_n * contact.unit_m).widened(contact.stiffness_u)

    @property
    def judged(self) -> str:
        """The verdict as it stands behind a law's name; nothing where no error is known to judge by."""
        if self.response_nrmse is None or self.misfit is None:
            return ": no prediction" if self.response_nrmse is None else ""
        said = self.verdict if self.verdict in ("explained", "strained") else "not explained"
        of = "force" if self.at_contact is not None and self.at_contact.is_measured else "motion"
        left = f"{100 * self.response_nrmse:.2g} % of the {of}"
        return f": {said}, it leaves {left}, {self.misfit:.3g} times the error of the measured cycle"

    @property
    def contact(self) -> ContactForce | None:
        """The contact over a cycle, with ladder, verdict and warnings of the comparison; None: nothing to compare."""
        if self.at_contact is None:
            return None
        points = {
            row["law"]: (sum(e["u"] is not None for e in row["parameters"].values()), row["response_nrmse"], evidence)
            for row in self.laws or ()
            if (evidence := row["log_evidence"]) is not None and row["response_nrmse"] is not None
        }
        return replace(self.at_contact, laws=points, said=f"{self.law}{self.judged}", warnings=self.warnings)

    def row(self) -> dict[str, object]:
        """The contract's keys alone: a line of JSON or of a table."""
        return COMPARISONS.row(self, **banded({name: self.expected.get(name, (None, None, None)) for name in EXPECTED}))

    def __repr__(self) -> str:
        left = "no prediction" if self.response_nrmse is None else f"nrmse {self.response_nrmse:.2g}, {self.verdict}"
        if not len(self.tau) and self.record_nrmse is not None:
            left = f"record nrmse {self.record_nrmse:.2g}"
        said = f", {len(self.warnings)} warnings" if self.warnings else ""
        ratio = "no steady cycle" if self.frequency_ratio is None else f"r = {self.frequency_ratio:.4g}"
        ratio = "over frequency" if self.over_frequency else ratio
        named = f"{self.source}: {ratio}, {self.law}"
        return f"<Comparison {named}, beta {self.friction}, {left}{said}>"
