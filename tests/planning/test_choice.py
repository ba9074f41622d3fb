"""Which tests are chosen, and a laboratory's round: a plan, its sheet, the tests, the next plan that knows them."""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionlab as fl
from frictionlab.analysis.measurement import measure
from frictionlab.inference.observations import observe
from frictionlab.inference.posterior import infer
from frictionlab.planning.plan import Plan, running_order, sheet_rows
from frictionlab.scene import Scene
from frictionlab.scene.text import to_toml
from frictionlab.simulator import Problem
from tests.desk import invoke, present, rows_of
from tests.inference.contacts import recorded
from tests.planning.rig import scene


@pytest.fixture(scope="module")
def free() -> Plan:
    """Six tests."""
    return fl.plan(scene(), law="coulomb+place", tests=6)


def test_friction_that_differs_from_test_to_test_limits_what_one_test_tells() -> None:
    few = scene(frequency_ratios=[0.5], normal_forces_n=[1.0], repeatability=0.05)
    tests = fl.plan(few, tests=4).tests
    left = [(t.cumulative["beta"] or math.nan) / t.values["beta"] for t in tests if t.cumulative is not None]
    assert left == pytest.approx([0.05 / math.sqrt(n) for n in (1, 2, 3, 4)], rel=0.06)


def test_the_running_order_sets_each_force_once_and_says_it_in_words(free: Plan) -> None:
    forces = [t.normal_force_n for t in running_order(free)]
    assert forces == sorted(forces)
    assert "Hz with 1.8 mm, record 60 s; the mass should swing" in str(sheet_rows(free, scene()))
    logs = [str(row["log"]) for row in sheet_rows(free, scene())]
    assert logs[0].startswith("01_test_N")
    assert sheet_rows(free, scene())[0]["material"] is None
    assert len(set(logs)) == 6


PLACE, SPEED = "coulomb+place", "coulomb+speed"
SMALL = {"gradient": 5e-4, "contact_damping_ratio": 2e-3}


def test_tests_between_two_laws_tell_more_than_those_for_small_errors() -> None:
    """Of the evidence, the lesser way counts."""
    what = scene(expected=SMALL, model_error=0.003, frequency_ratios=[0.3, 0.8, 1.4], normal_forces_n=[0.5, 1.5])
    apart = fl.plan(what, law=PLACE, against=SPEED, tests=2)
    assert apart.against == SPEED
    for test in apart.tests:
        assert test.log_bayes is not None
        assert test.log_bayes_against is not None
    every = fl.plan(what, law=PLACE, against=SPEED, tests=1, everything=True)
    best = max(min(t.log_bayes or 0.0, t.log_bayes_against or 0.0) for t in (*every.tests, *every.others))
    first = every.tests[0]
    assert min(first.log_bayes or 0.0, first.log_bayes_against or 0.0) > 0.3 * best
    after = [t.log_bayes_after or 0.0 for t in apart.tests]
    assert after[1] > after[0] > 5.0
    decides = fl.plan(what, law=PLACE, against=SPEED)
    assert len(decides.tests) == 1, "without a number of tests the one that decides is the last"
    assert len(decides.others) == len(apart.others) + len({t.frequency_ratio for t in apart.tests}) - 1


def test_a_law_inside_another_gains_only_what_its_simplicity_is_worth() -> None:
    test = fl.plan(scene(expected={"gradient": 0.03}), law="coulomb", against=PLACE, tests=1).tests[0]
    assert 3.0 < present(test.log_bayes) < 30.0
    richer = Problem(test.frequency_ratio, test.values["beta"], law=PLACE, parameters={"gradient": 0.03})
    measured = measure(recorded(richer, np.random.default_rng(0)), scene())
    place, coulomb = (infer([observe(measured, scene(), law)]).fit.log_evidence for law in (PLACE, "coulomb"))
    assert test.log_bayes_against == pytest.approx(place - coulomb, rel=0.1)  # what a recording then gives


LAW, DASHPOT, COEFFICIENT = "coulomb+speed", 0.02, 0.52


def rig(coefficient: float = 0.5, dashpot: float = 0.03) -> Scene:
    """A rig whose contact is expected to be so, and two candidates; its sheet is of the plan."""
    candidates = {"frequency_ratios": [0.4, 1.4], "normal_forces_n": [1.0], "duration_s": 16.0}
    expected = {"friction_coefficient": [coefficient, 0.1], "expected": {"contact_damping_ratio": dashpot}}
    facts = {"material": "steel", "sheet": "tests.csv"}
    tables: dict[str, dict[str, Any]] = {"sensors": {"lag_s_u": 1e-5}, "experiment": facts, "model": {"law": LAW}}
    return scene(tables, **candidates, **expected, repeatability=0.001)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the plan's sheet, and with the logs that the sheet names, of a rig whose truth is known."""
    folder = tmp_path_factory.mktemp("laboratory")
    (folder / "rig.toml").write_text(to_toml(rig()))
    invoke("plan", "--scene", folder / "rig.toml", "--tests", "2", "-o", folder / "tests.csv", status=0)
    with (folder / "tests.csv").open(newline="") as sheet:
        lines = list(csv.DictReader(sheet))
    contact = {"material": "steel", "friction_coefficient": COEFFICIENT, "friction_scatter": 0.003, "label": "run"}
    contact |= {"law": LAW, "parameters": {"contact_damping_ratio": DASHPOT}}
    settings = {"normal_forces_n": "normal_force_n", "frequency_ratios": "nominal_frequency_ratio"}
    tests = [contact | {key: [float(line[name])] for key, name in settings.items()} for line in lines]
    virtual = rig().changed(synthetic={"duration_s": 16.0, "start": "steady", "tests": tests})
    (folder / "virtual.toml").write_text(to_toml(virtual))
    invoke("synthesize", "--scene", folder / "virtual.toml", "-o", folder / "virtual", status=0)
    for line in lines:
        (found,) = (folder / "virtual").glob(f"*_r{line['nominal_frequency_ratio']}_*.csv")
        found.rename(folder / line["log"])
    logs = [folder / line["log"] for line in lines]
    invoke("ingest", *logs, "--scene", folder / "rig.toml", "-o", folder / "recordings", status=0)
    return folder


def _plan(folder: Path, *more: object, scene: str = "rig.toml") -> list[dict[str, Any]]:
    """The two tests of a plan, by their frequency ratios."""
    said = invoke("plan", "--scene", folder / scene, "--tests", "2", "--json", *more, status=0)
    return sorted(rows_of(said), key=lambda test: test["frequency_ratio"])


@pytest.mark.usefixtures("one_format")
def test_what_was_planned_is_measured_and_the_next_plan_knows_it(desk: Path) -> None:
    recordings, campaign = sorted((desk / "recordings").glob("*.h5")), desk / "campaign"
    assert len(recordings) == 2
    invoke("analyze", *recordings, "--scene", desk / "rig.toml", "-o", desk / "measured.jsonl", status=0)
    invoke("campaign", desk / "measured.jsonl", "--scene", desk / "rig.toml", "-o", campaign, status=0)
    law = fl.read_material_law(campaign / "law_steel.toml")
    assert law.values["friction_coefficient"] == pytest.approx(COEFFICIENT, rel=0.01)
    before, after = _plan(desk), _plan(desk, "--law-file", campaign / "law_steel.toml")
    for old, new in zip(before, after, strict=True):
        assert new["values"]["contact_damping_ratio"] == pytest.approx(DASHPOT, rel=0.02)
        assert new["values"]["beta"] / old["values"]["beta"] == pytest.approx(COEFFICIENT / 0.5, rel=0.01)
    (desk / "truth.toml").write_text(to_toml(rig(COEFFICIENT, DASHPOT)))  # what is expected changes the errors
    done, next_done = (max(p, key=lambda test: test["rank"]) for p in (_plan(desk, scene="truth.toml"), after))
    for name in ("beta", "contact_damping_ratio"):
        one, two = (test["cumulative_u"][name] / test["values"][name] for test in (next_done, done))
        assert one < two
