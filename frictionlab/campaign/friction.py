"""One friction ratio per material and normal force, fitted over all frequency ratios at once.

Each test i gives an energy E_i and an amplitude X_i. Coulomb's law says E(r_i, b) and X(r_i, b), where b is the
friction ratio of the whole group. The fit is a least-squares one (Gauss-Newton) in which test i counts by its own error
and by the scatter from test to test, ``s_i^2 + scatter^2``, where the scatter makes chi-square equal to its degrees of
freedom [Paule and Mandel 1982]. A test's own error comes from its measured errors, from that of its r (so that the
neighbourhood of resonance counts by its *shape*, the ratio E / X, rather than by its level), from a floor of model
error, and from what energy and amplitude say against each other. The group's standard error is never below what the
scatter of its tests says [Hartung and Knapp 2001]; its combined uncertainty holds what all tests share.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from frictionlab.arrays import FloatArray
from frictionlab.campaign.prediction import Local, Model, Own, PredictedState, local, own_estimate, pooled_shifts
from frictionlab.campaign.trials import UNKNOWN_ERROR, Trial
from frictionlab.estimate import NOT_KNOWN, Estimate, Flat, scatter_beyond, weighted_mean
from frictionlab.uncertainty import Sources, unit_uncertainty

UNSTEADY = 0.2  # excess irregularity above which one steady state cannot stand for the test
ASYMMETRIC = 0.1  # asymmetry above which a symmetric law cannot stand for the test
OUTLIER = 4.0  # robust standard deviations
NOTHING = 1e-9  # energy or amplitude below which the mass does not move
UNSETTLED = 0.01  # what may be left of the transient, by Coulomb's own memory
STEPS = 30
CLOSE = 1e-7
NORMAL = 1.959964


class Cause(Enum):
    """Why a test is left out; the value is the code in ``measurements.csv``, ``sentence`` the words."""

    LONG = "long", "a long test: in drift.csv"
    STUCK = "stuck", "stuck: all it tells is that the friction ratio is 1 / (static over kinetic friction) or more"
    UNSTEADY = (
        "unsteady",
        "unsteady: irregularity {:.2g} beyond noise and base; one steady state cannot stand for it",
    )
    ASYMMETRIC = "asymmetric", "asymmetric ({:.2g}): Coulomb's law on a symmetric contact cannot explain it"
    NEAR_RESONANCE = "near resonance", "near resonance: by Coulomb's law the response grows without bound"
    UNSETTLED = (
        "unsettled",
        "unsettled: by Coulomb's own reckoning {:.0%} of the transient is left where it was measured",
    )
    UNEXPLAINED = "unexplained", "unexplained: alone it would say {:.3g} where the group says {:.3g}"
    NO_CYCLE = "no cycle", "no recording at hand, or no cycle in it that a law can be fitted to"
    NOT_UNIQUE = (
        "not unique",
        "not unique: by Coulomb's law the motion keeps the asymmetry it began with: no one cycle stands for it",
    )
    DEAR = "dear", "dear: its law has no exact slides, and some tests of each normal force stand for all"
    UNPREDICTED = "no prediction", "no prediction: Coulomb's law finds no steady state here"

    sentence: str

    def __new__(cls, code: str, sentence: str) -> "Cause":
        """Take the code for the value."""
        cause = object.__new__(cls)
        cause._value_ = code
        cause.sentence = sentence
        return cause

    def because(self, *numbers: float) -> "LeftOut":
        """The cause for one test, with its numbers in the sentence."""
        return LeftOut(self, self.sentence.format(*numbers))


SCREENED = frozenset({Cause.LONG, Cause.STUCK})
"""Such a test says nothing of a friction ratio, and none is predicted for it."""
SOFT = frozenset({Cause.UNSTEADY, Cause.ASYMMETRIC, Cause.UNSETTLED})
"""Such a test is left out for what it is like, and could still say something where there is no other."""
JUDGED_ANEW = frozenset({Cause.NEAR_RESONANCE, Cause.UNSETTLED, Cause.UNEXPLAINED})
"""What depends on the friction ratio itself, and is asked again at each step of the fit."""
TRANSIENT = frozenset({Cause.UNSETTLED, Cause.NEAR_RESONANCE})
"""A transient still decays: that is the frame's doing, not the material's."""


@dataclass(frozen=True)
class LeftOut:
    """One test left out: the ``cause`` to compare, the ``sentence`` to read, with this test's numbers."""

    cause: Cause
    sentence: str

    def __str__(self) -> str:
        return self.sentence


@dataclass(frozen=True)
class Verdict:
    """What the fit says of one test.

    ``alone``: the friction ratio that this test alone would give (scatter not included in its error); ``predicted``:
    the group's prediction; ``residual``: measured over predicted energy - 1; ``excluded``: why it is left out, or None;
    ``elasticity``: relative change of the energy over that of the friction ratio; ``misfit``: by which factor energy
    and amplitude contradict each other beyond their errors, at least 1; where its cycle was fitted, the root of its
    chi-square per degree of freedom; ``nrmse``, ``floor``: of its cycle, and what noise alone leaves of it.
    """

    trial: Trial
    excluded: LeftOut | None
    alone: Estimate = NOT_KNOWN
    predicted: PredictedState | None = None
    elasticity: float = 0.0
    misfit: float | None = None
    nrmse: float | None = None
    floor: float | None = None

    friction_ratio = Flat("alone")
    friction_ratio_se = Flat("alone", "se")

    @property
    def residual(self) -> float | None:
        """Measured over predicted energy - 1."""
        if self.predicted is None or not self.predicted.energy or not math.isfinite(self.trial.mean[0]):
            return None
        return self.trial.mean[0] / self.predicted.energy - 1


@dataclass(frozen=True)
class FrictionFit:
    """Friction of one material under one normal force.

    ``ratio`` (beta), ``force`` = beta k Y in N, ``coefficient`` = force / normal force are estimates, with the
    contract's columns as flat names; ``low``, ``high``: 95 % confidence of the ratio, by Student's t with ``freedom``
    degrees, and what the tests share; ``scatter``: relative standard deviation from test to test beyond measurement
    error; ``shares``: relative shift of the ratio by one standard uncertainty of each source that all tests share;
    ``normal_force_u``: relative. ``law``: the contact law that its cycles were fitted with, None where it rests on
    energies and amplitudes; ``tests_chi_square``, ``tests_freedom``, ``tests_p``: whether its tests agree by their own
    errors. ``None`` is not known, and ``note`` says why.
    """

    material: str
    normal_force_n: float
    verdicts: tuple[Verdict, ...]
    ratio: Estimate
    force: Estimate
    coefficient: Estimate
    low: float | None
    high: float | None
    freedom: int
    scatter: float | None
    note: str
    shares: Mapping[str, float] = field(default_factory=dict)
    normal_force_u: float = 0.0
    law: str | None = None
    tests_chi_square: float | None = None
    tests_freedom: int = 0
    tests_p: float | None = None

    friction_ratio = Flat("ratio")
    friction_ratio_se = Flat("ratio", "se")
    friction_ratio_u = Flat("ratio", "u")
    friction_force_n = Flat("force")
    friction_force_n_se = Flat("force", "se")
    friction_force_n_u = Flat("force", "u")
    friction_coefficient = Flat("coefficient")
    friction_coefficient_se = Flat("coefficient", "se")
    friction_coefficient_u = Flat("coefficient", "u")

    @property
    def coefficient_interval(self) -> tuple[float | None, float | None]:
        """95 % confidence of the friction coefficient."""
        if self.friction_coefficient is None or self.friction_coefficient_se is None:
            return None, None
        reach = reach_of(self.coefficient, self.freedom)
        return self.friction_coefficient - reach, self.friction_coefficient + reach

    @property
    def used(self) -> tuple[Verdict, ...]:
        """The tests that the fit rests on."""
        return tuple(v for v in self.verdicts if v.excluded is None)


@dataclass(frozen=True)
class _Estimates:
    """Each test's own estimate of the group's friction ratio about the present one.

    ``value``; ``error``: its own; ``whole``: with what tests share, and without misfit ``plain``; all (n,).
    """

    value: FloatArray
    error: FloatArray
    whole: FloatArray
    plain: FloatArray
    owns: tuple[Own | None, ...]
    locals: tuple[Local | None, ...]


@dataclass(frozen=True)
class Known:
    """What a fit takes as known: the model, the stiffness (N/m), the uncertainties of the rig."""

    model: Model
    stiffness: float | None
    sources: Sources | None


def fit_group(
    trials: Sequence[Trial], model: Model, stiffness: float | None, *, sources: Sources | None = None
) -> FrictionFit:
    """Fit one friction ratio to the tests of one material under one normal force.

    Parameters
    ----------
    trials : sequence of Trial
        At least one, none failed, all of one group.
    model : Model
        What the prediction includes.
    stiffness : float or None
        N/m; without it there is a friction ratio but no force and no coefficient.
    sources : Sources, optional
        Of the rig and the normal force; of the sensors where the measurements tell no combined uncertainty.
    """
    known = Known(model, stiffness, sources)
    found = _fit(trials, known, strict=True)
    if not found.ratio.known and any(v.excluded and v.excluded.cause in SOFT for v in found.verdicts):
        found = _fit(trials, known, strict=False)
        said = "rests on tests that Coulomb's law explains badly, for there are no others"
        found = replace(found, note="; ".join(filter(None, (said, found.note))))
    return found


def _fit(trials: Sequence[Trial], known: Known, *, strict: bool) -> FrictionFit:
    short = any(not t.is_long for t in trials)
    reasons = [_screen(t, leave_long=short, strict=strict) for t in trials]
    beta, spread = _start(trials, reasons)
    for _ in range(STEPS):
        estimates = _estimate(trials, known, beta, reasons)
        reasons = _judge(trials, estimates, reasons, spread, strict=strict)
        good = np.array([reason is None for reason in reasons])
        if not good.any():
            break
        spread = scatter_beyond(estimates.value[good], estimates.whole[good])
        moved = weighted_mean(estimates.value[good], estimates.whole[good], spread)
        step, beta = moved - beta, float(np.clip(moved, 0.7 * beta, 1.4 * beta))
        if abs(step) < CLOSE * beta:
            break
    return _fit_of(trials, known, beta, spread, reasons)


def _screen(trial: Trial, *, leave_long: bool, strict: bool) -> LeftOut | None:
    """Why a test says nothing of one friction ratio, before any fit."""
    if trial.is_long and leave_long:
        return Cause.LONG.because()
    if trial.regime == "stuck" or not min(trial.mean) > NOTHING:
        return Cause.STUCK.because()
    if not strict:
        return None
    excess = trial.excess_irregularity
    if excess is not None and excess > UNSTEADY:
        return Cause.UNSTEADY.because(excess)
    if trial.asymmetry > ASYMMETRIC:
        return Cause.ASYMMETRIC.because(trial.asymmetry)
    return None


def _start(trials: Sequence[Trial], reasons: Sequence[LeftOut | None]) -> tuple[float, float]:
    """Median of E / (4 X), eq. (2.23), which holds for any Coulomb motion that turns twice a cycle; and no spread."""
    scale = _amplitude_scales(trials)
    guesses = [
        trial.mean[0] / (4.0 * trial.mean[1]) * s
        for trial, s, reason in zip(trials, scale, reasons, strict=True)
        if reason is None
    ]
    return (float(np.median(guesses)) if guesses else math.nan), 0.0


def _amplitude_scales(trials: Sequence[Trial]) -> FloatArray:
    """Base amplitude of each test over the group's mean: beta is F / (k Y), and F is what the tests share."""
    amplitude = np.array([t.base_amplitude_m for t in trials])
    mean = np.nanmean(amplitude) if np.isfinite(amplitude).any() else math.nan
    return np.where(np.isfinite(amplitude), amplitude / mean, 1.0)


def _estimate(trials: Sequence[Trial], known: Known, beta: float, reasons: Sequence[LeftOut | None]) -> _Estimates:
    """Linearize every test about the present friction ratio of the group."""
    found: list[Local | None] = []
    owns: list[Own | None] = []
    for trial, scale, reason in zip(trials, _amplitude_scales(trials), reasons, strict=True):
        here = local(known.model, trial.r, beta / scale) if _may_predict(reason) else None
        own = None if here is None else own_estimate(trial, here, known.sources)
        found.append(here)
        owns.append(None if own is None else own.scaled(float(scale)))
    table = np.array([(math.nan,) * 4 if o is None else (o.step, o.error, o.whole, o.misfit) for o in owns])
    step, error, whole, misfit = table.T
    return _Estimates(beta + step, error, whole, whole / misfit, tuple(owns), tuple(found))


def _may_predict(reason: LeftOut | None) -> bool:
    return reason is None or reason.cause not in SCREENED


def _judge(
    trials: Sequence[Trial], estimates: _Estimates, reasons: Sequence[LeftOut | None], spread: float, *, strict: bool
) -> list[LeftOut | None]:
    """Screened tests stay out; the others are judged anew: no steady state, not settled, or far from their group."""
    fresh = [None if r is None or r.cause in JUDGED_ANEW else r for r in reasons]
    for i, (trial, here) in enumerate(zip(trials, estimates.locals, strict=True)):
        if fresh[i] is None:
            fresh[i] = _by_prediction(trial, here, strict=strict)
    good = np.array([reason is None for reason in fresh]) & np.isfinite(estimates.value)
    if good.sum() < 3:
        return fresh
    middle = float(np.median(estimates.value[good]))
    width = 1.4826 * float(np.median(np.abs(estimates.value[good] - middle)))
    limit = OUTLIER * np.sqrt(estimates.plain**2 + max(width, 0.5 * spread) ** 2)
    far = good & (np.abs(estimates.value - middle) > limit)
    for i in map(int, np.flatnonzero(far)):
        fresh[i] = Cause.UNEXPLAINED.because(float(estimates.value[i]), middle)
    return fresh


def _by_prediction(trial: Trial, here: Local | None, *, strict: bool) -> LeftOut | None:
    if here is None:
        return Cause.NEAR_RESONANCE.because()
    left = here.here.memory**trial.cycles_before
    if strict and left > UNSETTLED and trial.settled_s is None:
        return Cause.UNSETTLED.because(left)
    return None


def _fit_of(
    trials: Sequence[Trial], known: Known, beta: float, spread: float, reasons: Sequence[LeftOut | None]
) -> FrictionFit:
    material, normal = trials[0].group
    estimates = _estimate(trials, known, beta, reasons)
    verdicts = tuple(
        _verdict(trial, reason, estimates, i, beta)
        for i, (trial, reason) in enumerate(zip(trials, reasons, strict=True))
    )
    good = np.array([v.excluded is None and v.friction_ratio is not None for v in verdicts])
    if not good.any():
        return _no_fit(material, normal, verdicts, _why_none(verdicts))
    ratio, shares = _pooled(estimates, good, beta, spread)
    freedom = int(good.sum()) - 1
    reach = reach_of(ratio, freedom)
    force, coefficient = in_newtons(ratio, trials, known, normal)
    return FrictionFit(
        material=material,
        normal_force_n=normal,
        verdicts=verdicts,
        ratio=ratio,
        force=force,
        coefficient=coefficient,
        low=beta - reach,
        high=beta + reach,
        freedom=freedom,
        scatter=spread / beta if freedom else None,
        note=_note(trials, good, known.stiffness, has_force=force.known),
        shares={source: shift / beta for source, shift in shares.items()},
        normal_force_u=0.0 if known.sources is None else known.sources.normal_force,
    )


def reach_of(number: Estimate, freedom: int) -> float:
    """Half of the 95 % interval: Student's for the tests' own scatter, normal for what they share."""
    own, whole = number.se or 0.0, number.u or number.se or 0.0
    t = float(stats.t.ppf(0.975, freedom)) if freedom else NORMAL
    return math.hypot(t * own, NORMAL * math.sqrt(max(whole**2 - own**2, 0.0)))


def in_newtons(
    ratio: Estimate, trials: Sequence[Trial], known: Known, normal_force: float
) -> tuple[Estimate, Estimate]:
    """Friction force beta k Y and coefficient: stiffness, base sensor's gain and normal force are in their u."""
    amplitudes = [t.base_amplitude_m for t in trials if math.isfinite(t.base_amplitude_m)]
    if known.stiffness is None or not amplitudes:
        return NOT_KNOWN, NOT_KNOWN
    force = ratio.scaled(known.stiffness * float(np.mean(amplitudes)))
    coefficient = force.over(normal_force)
    if known.sources is None:
        return force, coefficient
    by_rig = math.hypot(known.sources.stiffness, unit_uncertainty(known.sources))
    return _widened(force, by_rig), _widened(coefficient, math.hypot(by_rig, known.sources.normal_force))


def _widened(number: Estimate, relative: float) -> Estimate:
    return number.with_u(math.hypot(number.u or 0.0, relative * (number.value or 0.0)))


def _verdict(trial: Trial, reason: LeftOut | None, estimates: _Estimates, i: int, beta: float) -> Verdict:
    here, own = estimates.locals[i], estimates.owns[i]
    if here is None or own is None or not math.isfinite(own.step):
        return Verdict(trial, reason or Cause.UNPREDICTED.because())
    alone = Estimate(beta + own.step, own.error, math.hypot(own.error, *own.shifts.values()))
    elasticity = float(here.by_beta[0]) * beta / here.here.energy if here.here.energy else 0.0
    return Verdict(trial, reason, alone, here.here, elasticity, own.misfit)


def _pooled(
    estimates: _Estimates, good: NDArray[np.bool_], beta: float, spread: float
) -> tuple[Estimate, dict[str, float]]:
    """The group's friction ratio and its shifts by shared sources.

    Its standard error holds the tests' own errors and their scatter, and is never below what the scatter shows.
    """
    value, error = estimates.value[good], estimates.error[good]
    weight = 1.0 / (estimates.whole[good] ** 2 + spread**2)
    stated = float(np.sum(weight**2 * (error**2 + spread**2)) / weight.sum() ** 2)
    shown = float(np.sum(weight * (value - beta) ** 2) / weight.sum()) / max(len(value) - 1, 1)
    shares = pooled_shifts([o.shifts for o, used in zip(estimates.owns, good, strict=True) if used and o], weight)
    se = math.sqrt(max(stated, shown))
    return Estimate(beta, se, math.hypot(se, *shares.values())), shares


def _no_fit(material: str, force: float, verdicts: tuple[Verdict, ...], note: str) -> FrictionFit:
    nothing = (NOT_KNOWN,) * 3
    return FrictionFit(material, force, verdicts, *nothing, low=None, high=None, freedom=0, scatter=None, note=note)


def _why_none(verdicts: Sequence[Verdict]) -> str:
    kinds = sorted({v.excluded.cause.value for v in verdicts if v.excluded is not None})
    return f"no friction ratio: every test was left out ({', '.join(kinds)})"


def _note(trials: Sequence[Trial], good: NDArray[np.bool_], stiffness: float | None, *, has_force: bool) -> str:
    used = int(good.sum())
    tests = sum(not t.is_long for t in trials) or len(trials)
    silent = sum(not t.tells_errors for t, is_used in zip(trials, good, strict=True) if is_used)
    parts = [] if used > 1 else ["one test only: its scatter from test to test is not known"]
    parts += [f"{tests - used} of {tests} tests left out"] if used < tests else []
    parts += [f"{silent} tests tell no standard error: {UNKNOWN_ERROR:.0%} is taken"] if silent else []
    missing = "the scene gives no stiffness" if stiffness is None else "no test tells its base amplitude"
    parts += [] if has_force else [f"no force: {missing}"]
    return "; ".join(parts)
