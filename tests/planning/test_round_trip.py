"""A laboratory's round: a plan, its sheet, the tests recorded, analysed, and the next plan that knows them."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from tests.desk import invoke

LAW, DASHPOT, COEFFICIENT = "coulomb+speed", 0.02, 0.52
RIG = """
[rig]
natural_frequency_hz = 3.13
stiffness_n_per_m = 1191.0
damping_ratio = 0.0
[sensors]
lag_s_u = 1e-5
[experiment]
material = "steel"
sheet = "tests.csv"
[analysis]
transient_s = 2.0
cycles = "all"
[model]
law = "coulomb+speed"
[plan]
frequency_ratios = [0.4, 1.4]
normal_forces_n = [1.0]
duration_s = 16.0
friction_coefficient = [0.5, 0.1]
repeatability = 0.001
most_repeats = 1
expected = {contact_damping_ratio = 0.03}
"""
TEST = """
[[synthetic.tests]]
material = "steel"
label = "run"
normal_forces_n = [{normal_force_n}]
frequency_ratios = [{nominal_frequency_ratio}]
friction_coefficient = 0.52
friction_scatter = 0.003
law = "coulomb+speed"
parameters = {{contact_damping_ratio = 0.02}}
"""


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the plan's sheet, and with the logs that the sheet names, of a rig whose truth is known."""
    folder = tmp_path_factory.mktemp("laboratory")
    (folder / "rig.toml").write_text(RIG)
    _run("plan", "--scene", folder / "rig.toml", "--tests", "2", "-o", folder / "tests.csv")
    with (folder / "tests.csv").open(newline="") as sheet:
        lines = list(csv.DictReader(sheet))
    groups = "".join(TEST.format(**line) for line in lines)
    (folder / "virtual.toml").write_text(f'{RIG}\n[synthetic]\nduration_s = 16.0\nstart = "steady"\n{groups}')
    _run("synthesize", "--scene", folder / "virtual.toml", "-o", folder / "virtual")
    for line in lines:
        (found,) = (folder / "virtual").glob(f"*_r{line['nominal_frequency_ratio']}_*.csv")
        found.rename(folder / line["log"])
    logs = [folder / line["log"] for line in lines]
    _run("ingest", *logs, "--scene", folder / "rig.toml", "-o", folder / "recordings")
    return folder


def _run(*words: object) -> str:
    done = invoke(*words)
    assert done.exit_code == 0, done.output
    return done.stdout


def _plan(folder: Path, *more: object, scene: str = "rig.toml") -> list[dict[str, Any]]:
    """The two tests of a plan, by their frequency ratios."""
    said = _run("plan", "--scene", folder / scene, "--tests", "2", "--json", *more)
    return sorted((json.loads(line) for line in said.splitlines()), key=lambda test: test["frequency_ratio"])


def test_what_was_planned_is_measured_and_the_next_plan_knows_it(laboratory: Path) -> None:
    recordings, compared = sorted((laboratory / "recordings").glob("*.h5")), laboratory / "compared.jsonl"
    assert len(recordings) == 2
    _run("compare-numeric", *recordings, "--scene", laboratory / "rig.toml", "-o", compared)
    rows = [json.loads(line) for line in compared.read_text().splitlines()]
    for row in rows:  # the sheet's force makes the coefficient; what is found is the truth, and within what it says
        dashpot = row["parameters"]["contact_damping_ratio"]
        assert row["friction_coefficient"] == pytest.approx(COEFFICIENT, rel=0.01)
        assert abs(dashpot["value"] - DASHPOT) < 3.0 * dashpot["u"]
    before, after = _plan(laboratory), _plan(laboratory, "--measured", compared)
    for row, old, new in zip(rows, before, after, strict=True):
        assert new["values"]["contact_damping_ratio"] == pytest.approx(DASHPOT, rel=0.02)
        assert new["values"]["beta"] / old["values"]["beta"] == pytest.approx(COEFFICIENT / 0.5, rel=0.01)
        for name in ("beta", "contact_damping_ratio"):
            assert 0.4 < row["parameters"][name]["u"] / new["expected_u"][name] < 2.5
    truth = RIG.replace("[0.5, 0.1]", f"[{COEFFICIENT}, 0.1]").replace("ratio = 0.03}", f"ratio = {DASHPOT}}}")
    (laboratory / "truth.toml").write_text(truth)  # what is expected changes the errors: here it is the same
    done, next_done = (max(p, key=lambda test: test["rank"]) for p in (_plan(laboratory, scene="truth.toml"), after))
    for name in ("beta", "contact_damping_ratio"):
        one, two = (test["cumulative_u"][name] / test["values"][name] for test in (next_done, done))
        assert one < two
