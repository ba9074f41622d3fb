"""Long tests: the slope, its interval, and the friction force behind it."""

import numpy as np
import pytest

from frictionlab.analysis.steadiness import linear_trend
from frictionlab.campaign import Campaign, Model, trial_of
from frictionlab.campaign.ranking import drift_of
from frictionlab.simulator import Problem, steady_state
from tests.campaign.fabricate import AMPLITUDE, STIFFNESS, fit_of, row

LAW = Model()


def test_the_energys_drift_gives_back_the_frictions() -> None:
    """Friction grows by 4 % an hour; the energy of each cycle is the simulator's own."""
    fit = fit_of([trial_of(row("steel", 1.25, r, 0.6, noise=0.0)) for r in (0.3, 0.7, 1.2)])
    beta = 0.6 * 1.25 / (STIFFNESS * AMPLITUDE)
    time = np.arange(20.0, 1800.0, 10.0)
    states = [steady_state(Problem(0.3, beta * (1 + 0.04 * (t - 910) / 3600))) for t in time]
    energy = np.array([s.energy_per_cycle for s in states], dtype=float)
    long = trial_of({**row("steel", 1.25, 0.3, 0.6, noise=0.0), "duration_s": 1800.0})
    found = drift_of(long, linear_trend(time, energy), LAW, [fit])
    assert found.friction_slope_per_hour == pytest.approx(0.04, rel=0.01)
    assert found.verdict == "rises"
    assert found.relative_slope_per_hour == pytest.approx((found.slope_per_hour or 0) / energy.mean())


def test_without_points_the_measurements_own_slope_serves(campaign: Campaign) -> None:
    slopes = {d.trial.material: d.slope_per_hour for d in campaign.drifts}
    assert slopes == {"steel": 0.05, "aramid": 0.001, "rubber": -0.2}
    verdicts = {d.trial.material: d.verdict for d in campaign.drifts}
    assert verdicts == {"steel": "rises", "aramid": "no drift shown", "rubber": "falls"}


def test_without_any_slope_it_says_so() -> None:
    found = drift_of(trial_of({**row("steel", 1.25, 0.3, 0.6), "duration_s": 900.0}), None, LAW, [])
    assert found.slope_per_hour is None
    assert found.verdict == "not known"
    assert "its recording is not at hand" in found.note
