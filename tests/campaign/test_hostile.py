"""Measurement tables edited by hand: each row is evaluated, or told with its reason; nothing ends in a traceback."""

import json
import math
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.campaign import evaluate, read_measurements, trial_of
from frictionlab.campaign.files import check_folder, write_tables
from frictionlab.errors import FrictionlabError, UsageError
from frictionlab.report import page
from frictionlab.scene import Rig, Scene
from tests.campaign.fabricate import STIFFNESS, row, small_campaign
from tests.desk import invoke

SCENE = Scene(rig=Rig(natural_frequency_hz=3.13, stiffness_n_per_m=STIFFNESS))
SOUND = [r for r in small_campaign() if r.get("status") != "failed"][:8]
MORE = ("trend", "steady_energy_per_cycle", "settled_s", "energy_trend_per_hour", "energy_trend_per_hour_se")
NASTY: list[object] = [
    0, -1, -0.5, 1e308, 1e-308, 5e-324, True, "x", "", None, [], {}, math.nan, math.inf, 10**400, "9" * 400, "\x00",
    "\ud800", "=1+1", 1e9, 1e-9, 0.999999, 1.0, "steel" * 2000, [1, [2]], "window:x", "window:-5", "window:1e999",
]  # fmt: skip


@settings(max_examples=30, deadline=None)
@given(st.randoms(use_true_random=False))
def test_a_hostile_table_is_evaluated_or_refused(tmp_path_factory: pytest.TempPathFactory, chance: Random) -> None:
    """Some 4,400 such tables of a few rows were tried with a longer loop; each fault found is a case below."""
    rows = [dict(r) for r in chance.sample(SOUND, chance.randint(1, 2))]
    for _ in range(chance.randint(1, 3)):
        hurt = chance.choice(rows)
        hurt[chance.choice([*hurt, *MORE])] = chance.choice(NASTY)
    path = tmp_path_factory.mktemp("hostile") / "m.jsonl"
    path.write_text("\n".join(map(json.dumps, rows)))
    try:
        found = evaluate([trial_of(r, {}) for r in read_measurements(path)], SCENE)
    except FrictionlabError:
        return
    folder = path.parent / "out"
    check_folder(folder)
    write_tables(found, folder)
    page(found, (), {}).encode()
    assert invoke("show", folder / "friction.csv").exit_code == 0


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
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
def test_a_number_that_cannot_be_fails_its_test_alone(key: str, value: float, words: str) -> None:
    good = [row("steel", 1.5, r, 0.6) for r in (0.3, 0.6, 1.4)]
    bad = {**row("steel", 1.5, 0.9, 0.6), key: value}
    found = evaluate([trial_of(r) for r in (*good, bad)], SCENE)
    (failed,) = found.failures
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(failed.reason)
    assert found.fits == evaluate([trial_of(r) for r in good], SCENE).fits


def test_a_campaign_without_base_amplitudes_has_ratios_and_says_why_no_forces() -> None:
    rows = [{**row("steel", 1.5, r, 0.6), "base_amplitude_m": None} for r in (0.3, 0.6, 1.4)]
    (fit,) = evaluate([trial_of(r) for r in rows], SCENE).fits
    assert fit.friction_ratio is not None
    assert fit.friction_force_n is None
    assert "no force: no test tells its base amplitude" in fit.note


def test_an_input_in_the_output_folder_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "measurements.csv").write_text("")
    with pytest.raises(UsageError, match="an output never replaces an input"):
        check_folder(tmp_path, force=True, inputs=[tmp_path / "measurements.csv"])
