"""One friction ratio per material and normal force, fitted over all frequency ratios at once.

Each test i gives an energy E_i and an amplitude X_i. Coulomb's law says E(r_i, b) and X(r_i, b), where b is the
friction ratio of the whole group. The fit is a least-squares one (Gauss-Newton) in which test i counts by its own error
and by the scatter from test to test, ``s_i^2 + scatter^2``, where the scatter makes chi-square equal to its degrees of
freedom [Paule and Mandel 1982]. A test's own error comes from its measured errors, from that of its r (so that the
neighbourhood of resonance counts by its *shape*, the ratio E / X, rather than by its level), and from a floor of model
error. The group's standard error is never below what the scatter of its tests says [Hartung and Knapp 2001].
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from frictionlab.analysis.pooling import scatter_beyond, weighted_mean
from frictionlab.campaign.prediction import Law, Local, Prediction, local
from frictionlab.campaign.trials import Trial
from frictionlab.campaign.verdicts import JUDGED_ANEW, SCREENED, SOFT, Cause, LeftOut
from frictionlab.estimate import NOT_KNOWN, Estimate, Flat

FloatArray = NDArray[np.float64]
MODEL_FLOOR = 0.002  # relative: no model and no sensor gain is better known than this
RATIO_FLOOR = 0.0005  # relative: how well a natural frequency is known
UNSTEADY = 0.2  # excess irregularity above which one steady state cannot stand for the test
ASYMMETRIC = 0.1  # asymmetry above which a symmetric law cannot stand for the test
OUTLIER = 4.0  # robust standard deviations
NOTHING = 1e-9  # energy or amplitude below which the mass does not move
UNSETTLED = 0.01  # what may be left of the transient, by Coulomb's own memory
STEPS = 30
CLOSE = 1e-7


@dataclass(frozen=True)
class Verdict:
    """What the fit says of one test.

    ``alone``: the friction ratio that this test alone would give (scatter not included in its error); ``predicted``:
    the group's prediction; ``residual``: measured over predicted energy - 1; ``excluded``: why it is left out, or None.
    """

    trial: Trial
    excluded: LeftOut | None
    alone: Estimate = NOT_KNOWN
    predicted: Prediction | None = None

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
    degrees; ``scatter``: relative standard deviation from test to test beyond measurement error. ``None`` is not known,
    and ``note`` says why.
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
        if self.friction_coefficient is None or not self.friction_ratio or self.low is None or self.high is None:
            return None, None
        unit = self.friction_coefficient / self.friction_ratio
        return self.low * unit, self.high * unit

    @property
    def used(self) -> tuple[Verdict, ...]:
        """The tests that the fit rests on."""
        return tuple(v for v in self.verdicts if v.excluded is None)


@dataclass(frozen=True)
class _Estimates:
    """Each test's own estimate of the group's friction ratio about the present one: ``value``, ``error`` (n,)."""

    value: FloatArray
    error: FloatArray
    locals: tuple[Local | None, ...]


def fit_group(trials: Sequence[Trial], law: Law, stiffness: float | None) -> FrictionFit:
    """Fit one friction ratio to the tests of one material under one normal force.

    Parameters
    ----------
    trials : sequence of Trial
        At least one, none failed, all of one group.
    law : Law
        What the prediction includes.
    stiffness : float or None
        N/m; without it there is a friction ratio but no force and no coefficient.
    """
    found = _fit(trials, law, stiffness, strict=True)
    if not found.ratio.known and any(v.excluded and v.excluded.cause in SOFT for v in found.verdicts):
        found = _fit(trials, law, stiffness, strict=False)
        said = "rests on tests that Coulomb's law explains badly, for there are no others"
        found = replace(found, note="; ".join(filter(None, (said, found.note))))
    return found


def _fit(trials: Sequence[Trial], law: Law, stiffness: float | None, *, strict: bool) -> FrictionFit:
    short = any(not t.is_long for t in trials)
    reasons = [_screen(t, leave_long=short, strict=strict) for t in trials]
    beta, spread = _start(trials, reasons)
    for _ in range(STEPS):
        estimates = _estimate(trials, law, beta, reasons)
        reasons = _judge(trials, estimates, reasons, spread, strict=strict)
        good = np.array([reason is None for reason in reasons])
        if not good.any():
            break
        spread = scatter_beyond(estimates.value[good], estimates.error[good])
        moved = weighted_mean(estimates.value[good], estimates.error[good], spread)
        step, beta = moved - beta, float(np.clip(moved, 0.7 * beta, 1.4 * beta))
        if abs(step) < CLOSE * beta:
            break
    return _fit_of(trials, law, beta, spread, reasons, stiffness)


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


def _estimate(trials: Sequence[Trial], law: Law, beta: float, reasons: Sequence[LeftOut | None]) -> _Estimates:
    """Linearize every test about the present friction ratio of the group."""
    value, error = np.full(len(trials), math.nan), np.full(len(trials), math.nan)
    found: list[Local | None] = []
    for i, (trial, scale) in enumerate(zip(trials, _amplitude_scales(trials), strict=True)):
        here = local(law, trial.r, beta / scale) if _may_predict(reasons[i]) else None
        found.append(here)
        if here is not None:
            step, error[i] = _own_estimate(trial, here)
            value[i], error[i] = beta + step * scale, error[i] * scale
    return _Estimates(value, error, tuple(found))


def _may_predict(reason: LeftOut | None) -> bool:
    return reason is None or reason.cause not in SCREENED


def _own_estimate(trial: Trial, here: Local) -> tuple[float, float]:
    """Step from the present beta to the test's own, and its standard error: generalized least squares of E and X."""
    measured = np.array(trial.mean)
    errors = np.hypot(trial.mean_se, MODEL_FLOOR * measured)
    ratio_error = math.hypot(trial.frequency_ratio_se, RATIO_FLOOR * trial.r)
    weight = np.linalg.inv(np.diag(errors**2) + np.outer(here.by_r, here.by_r) * ratio_error**2)
    information = float(here.by_beta @ weight @ here.by_beta)
    if information <= 0.0:
        return math.nan, math.nan
    gap = measured - np.array([here.here.energy, here.here.amplitude])
    return float(here.by_beta @ weight @ gap) / information, 1.0 / math.sqrt(information)


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
    limit = OUTLIER * np.sqrt(estimates.error**2 + max(width, 0.5 * spread) ** 2)
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
    trials: Sequence[Trial],
    law: Law,
    beta: float,
    spread: float,
    reasons: Sequence[LeftOut | None],
    stiffness: float | None,
) -> FrictionFit:
    material, force = trials[0].group
    estimates = _estimate(trials, law, beta, reasons)
    verdicts = tuple(
        _verdict(trial, reason, estimates, i) for i, (trial, reason) in enumerate(zip(trials, reasons, strict=True))
    )
    good = np.array([v.excluded is None and v.friction_ratio is not None for v in verdicts])
    if not good.any():
        return _no_fit(material, force, verdicts, _why_none(verdicts))
    error = _group_error(estimates.value[good], estimates.error[good], beta, spread)
    known = [t.base_amplitude_m for t in trials if math.isfinite(t.base_amplitude_m)]
    newtons = stiffness * float(np.mean(known)) if stiffness is not None and known else None
    freedom = int(good.sum()) - 1
    ratio = Estimate(beta, error)
    reach = float(stats.t.ppf(0.975, freedom)) if freedom else 1.959964
    return FrictionFit(
        material=material,
        normal_force_n=force,
        verdicts=verdicts,
        ratio=ratio,
        force=ratio.scaled(newtons),
        coefficient=ratio.scaled(newtons).over(force),
        low=beta - reach * error,
        high=beta + reach * error,
        freedom=freedom,
        scatter=spread / beta if freedom else None,
        note=_note(int(good.sum()), sum(not v.trial.is_long for v in verdicts) or len(verdicts), newtons, stiffness),
    )


def _verdict(trial: Trial, reason: LeftOut | None, estimates: _Estimates, i: int) -> Verdict:
    here = estimates.locals[i]
    if here is None or not math.isfinite(estimates.value[i]):
        return Verdict(trial, reason or Cause.UNPREDICTED.because())
    return Verdict(trial, reason, Estimate(float(estimates.value[i]), float(estimates.error[i])), here.here)


def _group_error(value: FloatArray, error: FloatArray, beta: float, spread: float) -> float:
    """Standard error of the group's friction ratio: errors and scatter, and never below what the scatter shows."""
    weight = 1.0 / (error**2 + spread**2)
    stated = 1.0 / math.sqrt(float(weight.sum()))
    if len(value) < 2:
        return stated
    shown = float(np.sum(weight * (value - beta) ** 2)) / (len(value) - 1)
    return stated * math.sqrt(max(1.0, shown))


def _no_fit(material: str, force: float, verdicts: tuple[Verdict, ...], note: str) -> FrictionFit:
    nothing = (NOT_KNOWN,) * 3
    return FrictionFit(material, force, verdicts, *nothing, low=None, high=None, freedom=0, scatter=None, note=note)


def _why_none(verdicts: Sequence[Verdict]) -> str:
    kinds = sorted({v.excluded.cause.value for v in verdicts if v.excluded is not None})
    return f"no friction ratio: every test was left out ({', '.join(kinds)})"


def _note(used: int, tests: int, newtons: float | None, stiffness: float | None) -> str:
    parts = [] if used > 1 else ["one test only: its scatter from test to test is not known"]
    parts += [f"{tests - used} of {tests} tests left out"] if used < tests else []
    missing = "the scene gives no stiffness" if stiffness is None else "no test tells its base amplitude"
    parts += [] if newtons is not None else [f"no force: {missing}"]
    return "; ".join(parts)
