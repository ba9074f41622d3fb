"""Long tests: how the energy per cycle drifts, and what that says of the friction force (thesis 4.4.3)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from frictionlab.analysis.steadiness import Trend
from frictionlab.campaign.friction import FrictionFit
from frictionlab.campaign.prediction import Model, local
from frictionlab.campaign.trials import Trial

HOUR = 3600.0
NORMAL = 1.959964
INSENSITIVE = 0.15  # |d ln E / d ln beta| below which the energy does not tell the friction force
LEAST_CHANGE, MOST_CHANGE = 0.1, 0.6  # of the friction force, over which that must hold


@dataclass(frozen=True)
class Drift:
    """The drift of one long test.

    ``slope_per_hour``: of the energy per cycle (k Y^2 per hour), with its standard error and 95 % interval ``low`` to
    ``high``; ``relative_*``: the same over the mean energy; ``friction_*``: the relative change of the friction force
    per hour that explains it by Coulomb's law; ``trend``: the points behind the slope where the recording is at hand.
    ``None`` is not known, and ``note`` says why.
    """

    trial: Trial
    slope_per_hour: float | None
    slope_per_hour_se: float | None
    low: float | None
    high: float | None
    friction_per_hour: float | None
    friction_per_hour_se: float | None
    trend: Trend | None
    note: str

    @property
    def relative_per_hour(self) -> float | None:
        """Slope over the test's mean energy."""
        return self._over_energy(self.slope_per_hour)

    @property
    def relative_per_hour_se(self) -> float | None:
        """Standard error of it."""
        error = self._over_energy(self.slope_per_hour_se)
        return None if error is None else abs(error)

    def _over_energy(self, value: float | None) -> float | None:
        level = self.trend.level if self.trend is not None else self.trial.energy.value
        return None if value is None or not level else value / level

    @property
    def verdict(self) -> str:
        """``rises``, ``falls``, ``no drift shown`` (the interval holds zero) or ``not known``."""
        if self.low is None or self.high is None:
            return "not known"
        if self.low <= 0 <= self.high:
            return "no drift shown"
        return "rises" if self.low > 0 else "falls"


def drift_of(trial: Trial, trend: Trend | None, model: Model, fits: Sequence[FrictionFit]) -> Drift:
    """The drift of a long test, from its trend or, without that, from the measurement's own slope.

    Parameters
    ----------
    trend : Trend or None
        Energy per cycle over time (s), slope per second.
    fits : sequence of FrictionFit
        Where the friction ratio of the test's group is looked up.
    """
    slope, error, low, high = _slope(trial, trend)
    friction, friction_error = _friction_slope(trial, model, fits, slope, error)
    if slope is None:
        note = "no slope: its recording is not at hand and its measurement holds no energy_trend_per_hour"
    elif friction is None:
        note = "the energy is near its largest over the friction force, so it does not tell how that drifts"
    else:
        note = "" if trend is not None else "its recording is not at hand: no points are drawn"
    return Drift(trial, slope, error, low, high, friction, friction_error, trend, note)


def _slope(trial: Trial, trend: Trend | None) -> tuple[float, float, float, float] | tuple[None, None, None, None]:
    if trend is not None:
        return trend.slope * HOUR, trend.slope_se * HOUR, trend.low * HOUR, trend.high * HOUR
    slope, error = (trial.row.get(f"energy_trend_per_hour{end}") for end in ("", "_se"))
    if not isinstance(slope, (int, float)) or not isinstance(error, (int, float)):
        return None, None, None, None
    return float(slope), float(error), slope - NORMAL * error, slope + NORMAL * error


def _friction_slope(
    trial: Trial, model: Model, fits: Sequence[FrictionFit], slope: float | None, error: float | None
) -> tuple[float, float] | tuple[None, None]:
    """Relative change of the friction force per hour: the energy's over its elasticity d ln E / d ln beta."""
    beta = next((f.friction_ratio for f in fits if (f.material, f.normal_force_n) == trial.group), None)
    energy = trial.energy.value
    if slope is None or error is None or not beta or not energy:
        return None, None
    middle = _elasticity(trial.r, beta, model)
    if abs(middle) < INSENSITIVE or not math.isfinite(middle):
        return None, None
    change = abs(slope) * trial.duration_s / HOUR / energy / abs(middle)
    reach = min(max(change, LEAST_CHANGE), MOST_CHANGE)
    ends = [_elasticity(trial.r, beta * (1 + side * reach), model) for side in (-0.5, 0.5)]
    if not all(0.5 < end / middle < 2.0 for end in ends):
        return None, None
    return slope / energy / middle, error / energy / abs(middle)


def _elasticity(r: float, beta: float, model: Model) -> float:
    """Relative change of the energy over that of beta, d ln E / d ln beta; nan where there is no steady state."""
    here = local(model, r, beta)
    return float(here.by_beta[0]) * beta / here.here.energy if here is not None and here.here.energy else math.nan
