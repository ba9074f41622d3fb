"""A page per test: linked, whole, escaped, with what the recording shows where it is at hand."""

from pathlib import Path

import numpy as np
import pytest

from frictionlab.analysis.measurement import measure
from frictionlab.campaign import Campaign, evaluate
from frictionlab.campaign.trials import trial_of
from frictionlab.figures.materials import energy
from frictionlab.hdf5 import write_recording
from frictionlab.report import page
from frictionlab.report.charts import ChartLine, chart
from frictionlab.report.page_of_test import PageOfTest, sheet_name, sheet_page, sheets_of, write_sheet
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.simulator import Problem, steady_state
from frictionlab.verbs.evaluate import evaluate as evaluate_all
from tests.campaign.fabricate import AMPLITUDE, NATURAL, SCENE, row, steady_recording

EVIL = "<img src=x onerror=alert(1)>"


def test_every_test_has_a_page_and_the_table_links_it(campaign: Campaign) -> None:
    text = page(campaign, (), {})
    for number, trial in enumerate(campaign.trials, 1):
        assert f'href="tests/{sheet_name(number, trial)}"' in text


def test_a_page_without_a_recording_tells_numbers_and_joules(campaign: Campaign) -> None:
    pages = sheets_of(campaign)
    text = sheet_page(pages[0], back="../report.html")
    assert str(pages[0].trial.energy.scaled(1e3 * 1191.0 * 1.8e-3**2)) in text
    assert "mJ" in text
    assert "The recording is not at hand" in text
    assert "in the fit of its group" in text
    assert any(">1 standard error<" in sheet_page(one) for one in pages)
    assert not any(">1 standard errors<" in sheet_page(one) for one in pages)
    assert 'href="../report.html"' in text
    failed = sheet_page(pages[-1])
    assert "<b>Failed:</b> no drive &amp; &lt;b&gt;nothing" in failed


def test_energies_are_shown_at_the_lag_found_and_a_gradient_of_both_signs_is_said(tmp_path: Path) -> None:
    """Points stood at the lag declared beside a law at the lag found: -4 % on one page, -23 % in the figure."""
    known: dict[str, object] = {"rig": SCENE["rig"], "sensors": {"lag_s_u": 5e-3}, "model": {"law": "coulomb+place"}}
    scene, rows, truth, late = scene_from_tables(known), [], [], 8e-3
    for number, (beta, gradient) in enumerate(((0.3, 0.06), (0.4, -0.06), (0.5, 0.06))):
        problem = Problem(0.32, beta, law="coulomb+place", parameters={"gradient": gradient})
        log = steady_recording(problem=problem)
        seen = log.changed(
            base_displacement=AMPLITUDE * np.cos(2.0 * np.pi * 0.32 * NATURAL * (log.time - late)),
            experiment={"material": "brass", "normal_force_n": 1.5 * beta / 0.3},
        )
        write_recording(seen, tmp_path / f"{number}.h5")
        rows.append({**measure(seen, scene).row(), "source": str(tmp_path / f"{number}.h5")})
        truth.append(steady_state(problem).energy_per_cycle)
    campaign = evaluate_all(rows, scene, folders=[tmp_path])
    assert campaign.lag_found_s == pytest.approx(late, abs=5e-4)
    shown = [campaign.verdicts[str(r["source"])].energy.value for r in rows]
    assert shown == pytest.approx(truth, rel=0.01)
    assert shown == pytest.approx([test["measured_energy_per_cycle"] for test in campaign.left_out], rel=1e-9)
    for one in campaign.tables["measurements.csv"]:  # at the lag declared: a prediction beside it is as sensors show it
        ratio = float(str(one["energy_per_cycle"])) / float(str(one["predicted_energy_per_cycle"]))
        assert ratio - 1.0 == pytest.approx(one["energy_residual"], abs=1e-12)
    assert abs(float(str(rows[0]["energy_per_cycle"])) / (truth[0] or 0.0) - 1.0) > 0.1
    assert any("the gradient changes its sign from test to test (-0.06" in note for note in campaign.notes)
    assert "measured, at the lag found (+8" in sheet_page(sheets_of(campaign)[0])
    assert "at the lag found (+8" in energy(campaign, "brass").axes[0].get_title(loc="left")


def test_what_stood_in_a_log_is_escaped(scene: Scene) -> None:
    trial = trial_of({**row("steel", 1.5, 0.5, 0.6), "material": EVIL, "source": f"{EVIL}.h5", "warnings": [EVIL]})
    text = sheet_page(PageOfTest(trial, scene, comparison={"law": EVIL, "warnings": [EVIL + "2"]}))
    assert "<img" not in text
    assert text.count("&lt;img") >= 5
    assert "default-src 'none'" in text
    assert sheet_name(3, trial).replace("-", "").replace(".", "").replace("_", "").isalnum()


def test_a_page_replaces_its_own_kind_alone(scene: Scene, tmp_path: Path) -> None:
    sheet = PageOfTest(trial_of(row("steel", 1.5, 0.5, 0.6)), scene)
    write_sheet(sheet, tmp_path / "a.html")
    write_sheet(sheet, tmp_path / "a.html")
    (tmp_path / "b.html").write_text("mine")
    with pytest.raises(OSError, match=r"b\.html"):
        write_sheet(sheet, tmp_path / "b.html")


def test_a_chart_shows_its_lines_between_round_ticks() -> None:
    x = np.linspace(0.0, 1.0, 5001)
    text = chart([ChartLine(x, 10.0 * x - 5.0, "a < b")], "time [s]", "x & y")
    assert "a &lt; b" in text
    assert "x &amp; y" in text
    for tick in (">0.2<", ">0.8<", ">\N{MINUS SIGN}4<", ">4<"):
        assert tick in text
    assert text.count("L") < 2000
    assert chart([ChartLine(x, np.full_like(x, np.nan), "nothing")], "x", "y") == ""
    assert "NaN" not in chart([ChartLine(x, np.zeros_like(x), "level")], "x", "y")


def test_the_recording_is_drawn(scene: Scene) -> None:
    recording = steady_recording()
    measured = measure(recording, scene)
    trial = trial_of({**measured.row(), "material": "steel", "normal_force_n": 1.5})
    verdict = evaluate([trial], scene).verdicts[trial.source]
    text = sheet_page(PageOfTest(trial, scene, verdict, measurement=measured, recording=recording))
    assert text.count("<svg") == 5
    for words in (
        "Time response",
        "Loop",
        "Force over displacement",
        "Force over speed",
        "Cycles",
        "friction force [N]",
    ):
        assert words in text
