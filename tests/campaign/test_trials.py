"""Rows of measurements become tests; files of a campaign: rows in from every kind of file, tables out."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab.campaign import Campaign, evaluate, write_tables
from frictionlab.campaign.files import check_folder, read_measurements
from frictionlab.campaign.trials import in_order, levels, nearest, trial_of
from frictionlab.errors import RecordingError, UsageError
from frictionlab.hdf5 import write_tree
from frictionlab.scene import Rig, Scene
from tests.campaign.fabricate import STIFFNESS, row, small_campaign


def test_an_error_that_is_not_told_is_not_zero() -> None:
    trial = trial_of({**row("steel", 1.25, 0.3, 0.6), "response_amplitude": 1.0, "response_amplitude_se": None})
    assert trial.mean_se[1] == 0.05


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


SCENE = Scene(rig=Rig(natural_frequency_hz=3.13, stiffness_n_per_m=STIFFNESS))


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("status", "failed", "^its measurement failed and gives no reason"),
        ("material", None, "^no material: name them"),
        ("material", "x" * 61, "^material: expected a name of at most 60 characters; got 61: shorten it"),
        ("normal_force_n", 0.0, "^no normal_force_n: name them"),
        ("frequency_ratio", None, "natural_frequency_hz"),
        ("energy_per_cycle", math.nan, "no energy_per_cycle in the measurement"),
        ("energy_per_cycle", -2.0, "^energy_per_cycle is -2 kY.2: a contact takes energy: a channel is inverted"),
        ("normal_force_n", 1e12, r"normal_force_n = 1e\+12: expected 1e-06 to 1e\+09: correct the measurement"),
        ("frequency_ratio", 0.0, "frequency_ratio = 0: expected 0.005 to 50"),
        ("energy_per_cycle", 1e6, r"energy_per_cycle = 1e\+06: expected -10000 to 10000"),
        ("response_amplitude", -1.0, "response_amplitude = -1: expected 0 to 10000"),
        ("irregularity_index", 1e200, r"irregularity_index = 1e\+200: expected 0 to 10000"),
        ("base_amplitude_m", 0.0, "base_amplitude_m = 0: expected 1e-09 to 10"),
        ("frequency_ratio_se", 1e9, r"frequency_ratio_se = 1e\+09: expected 0 to 1"),
        ("energy_per_cycle_se", -0.1, "energy_per_cycle_se = -0.1: expected 0"),
        ("duration_s", 10**400, "duration_s = a number beyond all bounds: expected 0"),
    ],
)
def test_a_value_that_cannot_be_fails_its_test_alone_and_says_why(key: str, value: object, words: str) -> None:
    good = [row("steel", 1.5, r, 0.6) for r in (0.3, 0.6, 1.4)]
    bad = {**row("steel", 1.5, 0.9, 0.6), key: value}
    found = evaluate([trial_of(r) for r in (*good, bad)], SCENE)
    (failed,) = found.failures
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(failed.reason)
    assert found.rows() == evaluate([trial_of(r) for r in good], SCENE).rows()


def test_a_campaign_without_base_amplitudes_has_ratios_and_says_why_no_forces() -> None:
    rows = [{**row("steel", 1.5, r, 0.6), "base_amplitude_m": None} for r in (0.3, 0.6, 1.4)]
    (fit,) = evaluate([trial_of(r) for r in rows], SCENE).fits
    assert fit.friction_ratio is not None
    assert fit.friction_force_n is None
    assert "no force: no test gives its base amplitude" in fit.note


@pytest.fixture
def folder(campaign: Campaign, tmp_path: Path) -> Path:
    check_folder(tmp_path)
    write_tables(campaign, tmp_path)
    return tmp_path


def test_the_same_campaign_gives_the_same_bytes(
    folder: Path, campaign: Campaign, tmp_path_factory: pytest.TempPathFactory
) -> None:
    other = tmp_path_factory.mktemp("other")
    write_tables(campaign, other)
    for path in sorted(folder.glob("*.csv")):
        assert path.read_bytes() == (other / path.name).read_bytes()


def test_an_earlier_campaign_is_replaced_and_nothing_else(folder: Path) -> None:
    check_folder(folder)
    with pytest.raises(UsageError, match="an output never replaces an input"):
        check_folder(folder, force=True, inputs=[folder / "measurements.csv"])
    (folder / "measurements.csv").write_text("my,own,table\n")
    with pytest.raises(UsageError, match=r"measurements\.csv: exists and is no file of an earlier campaign"):
        check_folder(folder)
    check_folder(folder, force=True)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("m.txt", "", "expected measurements as"),
        ("m.jsonl", "", "expected at least one measurement"),
        ("m.csv", "a,b\n1,2\n", "row 1: expected a measurement with a source"),
    ],
)
def test_files_that_hold_no_measurements_are_refused(tmp_path: Path, name: str, text: str, words: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(UsageError, match=words):
        read_measurements(tmp_path / name)
    write_tree({"a": 1.0}, tmp_path / "other.h5", kind="frictionlab example")
    with pytest.raises(RecordingError, match="expected a file of frictionlab measurements"):
        read_measurements(tmp_path / "other.h5")
