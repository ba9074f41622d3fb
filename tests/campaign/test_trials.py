"""Rows of measurements become tests: facts, failures, order."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab.campaign import trial_of
from frictionlab.campaign.trials import in_order, levels, nearest
from frictionlab.errors import UsageError
from tests.campaign.fabricate import row, small_campaign


def test_means_over_all_settled_cycles_are_preferred() -> None:
    more = {"steady_energy_per_cycle": 2.0, "steady_response_amplitude": 1.0, "steady_energy_per_cycle_se": 0.1}
    trial = trial_of({**row("steel", 1.25, 0.3, 0.6), **more})
    assert trial.mean == (2.0, 1.0)
    assert trial.mean_se == (0.1, 0.05)  # an error that is not told is not 0
    assert not trial.tells_errors


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"status": "failed", "reason": "no drive"}, "^no drive$"),
        ({"status": "failed", "reason": None}, "gives no reason"),
        ({"material": None}, "^no material: name them"),
        ({"normal_force_n": 0.0}, "^no normal_force_n: name them"),
        ({"frequency_ratio": None}, "natural_frequency_hz"),
        ({"energy_per_cycle": math.nan}, "no energy_per_cycle in the measurement"),
        ({"energy_per_cycle": -2.0}, "^energy_per_cycle is -2 kY.2: a contact takes energy: a channel is inverted"),
    ],
)
def test_what_cannot_take_part_says_why(change: dict[str, object], reason: str) -> None:
    trial = trial_of({**row("steel", 1.25, 0.3, 0.6), **change})
    assert trial.failed
    with pytest.raises(AssertionError, match=reason):
        raise AssertionError(trial.reason)


def test_facts_fill_what_the_row_lacks_and_contradictions_are_said() -> None:
    bare = {**row("steel", 1.25, 0.3, 0.6), "material": None}
    trial = trial_of(bare, {"material": "iron", "normal_force_n": 1.5, "nominal_frequency_ratio": 0.3})
    assert trial.group == ("iron", 1.25)
    assert trial.row["nominal_frequency_ratio"] == 0.3
    assert trial.warnings == ("normal_force_n is 1.25 in the measurement, 1.5 by the scene: 1.25 is taken",)


def test_a_test_measured_twice_is_refused() -> None:
    trial = trial_of(row("steel", 1.25, 0.3, 0.6))
    with pytest.raises(UsageError, match=r"measured twice: steel_N1\.25_r0\.3\.h5; expected one"):
        in_order([trial, trial])


def test_failed_tests_come_last_and_none_goes_missing() -> None:
    trials = in_order([trial_of(r) for r in reversed(small_campaign())])
    assert len(trials) == len(small_campaign())
    assert [t.failed for t in trials] == sorted(t.failed for t in trials)


@given(st.lists(st.floats(0.05, 2.5), min_size=1, max_size=40))
def test_every_ratio_lies_near_its_level(ratios: list[float]) -> None:
    found = levels(ratios)
    assert list(found) == sorted(found)
    assert all(abs(nearest(r, found) - r) <= max(0.02 * r, 0.008) for r in ratios)
