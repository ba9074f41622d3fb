"""Plans: the errors they promise against those that tests achieve, the choice, the sheet, and what is refused."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import frictionlab as fl
from frictionlab.analysis.measurement import measure
from frictionlab.errors import SceneError, UsageError
from frictionlab.experiment import facts_of
from frictionlab.inference.compare import identified
from frictionlab.inference.material_law import MaterialLaw, example_law
from frictionlab.planning.plan import Plan
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.scene.text import to_toml
from frictionlab.simulator import Problem
from tests.desk import invoke, present, rows_of
from tests.inference.contacts import BASE_M, NATURAL_HZ, recorded
from tests.planning.rig import scene

SAMPLING_HZ = 250.0  # of a plan that names none

LINE = ["rank", "frequency_ratio", "normal_force_n", "base_amplitude_m", "duration_s", "regime", "expected"]
LINE += ["cumulative"]


@pytest.fixture(scope="module")
def coulomb() -> Plan:
    return fl.plan(scene(), tests=3)


def test_each_further_test_leaves_less_unknown(coulomb: Plan) -> None:
    left = [t.cumulative["beta"] / t.normal_force_n for t in coulomb.tests if t.cumulative and t.cumulative["beta"]]
    assert len(left) == 3
    assert left == sorted(left, reverse=True)
    assert [t.rank for t in coulomb.tests] == [1, 2, 3]
    first = coulomb.tests[0]
    assert first.cumulative == pytest.approx(first.expected, rel=1e-3)  # what is known before adds a little
    assert first.cumulative_u == pytest.approx(first.expected_u, rel=1e-3)


def test_the_errors_promised_are_those_achieved(coulomb: Plan) -> None:
    """The scatter of the friction ratio over repeats of the best test, each with its own noise and cycles."""
    best = coulomb.tests[0]
    beta = 0.6 * best.normal_force_n / (1191.0 * BASE_M)
    found = []
    for seed in range(30):
        recording = recorded(Problem(best.frequency_ratio, beta), np.random.default_rng(seed))
        found.append(identified(measure(recording, scene()), scene(), None)[0].values()["beta"])
    achieved = float(np.std(found, ddof=1))
    assert achieved == pytest.approx(present(best.expected["beta"]), rel=0.45)  # thirty repeats tell a scatter to 13 %


def test_a_test_that_stands_still_tells_nothing() -> None:
    plan = fl.plan(scene(normal_forces_n=[1.0, 6.0]), tests=1)
    still = [t for t in plan.others if t.normal_force_n == 6.0]
    assert still
    assert all(t.expected["beta"] is None for t in still)
    assert plan.tests[0].normal_force_n == 1.0


def test_place_and_speed_are_told_apart_by_what_is_planned() -> None:
    plan = fl.plan(scene(), law="coulomb+place+speed", tests=2)
    first = plan.tests[0]
    assert set(first.expected) == {"beta", "gradient", "contact_damping_ratio"}
    assert first.log_bayes is None, "between two laws alone"
    for name, alone in first.expected_u.items():
        held = present(first.expected[name])
        assert held <= present(alone) * (1 + 1e-9)  # what is not known of the rig can only add


def test_an_undeclared_lag_leaves_more_unknown_than_a_declared_one_of_its_size() -> None:
    """What is assumed where no lag is declared may be far off: 68 % of its curve lie within 2.6 deviations, not 1."""
    assumed_s = 0.5 / (SAMPLING_HZ * math.sqrt(3.0))  # half a sample either way
    rigs = (
        scene(sensors, frequency_ratios=[1.2], normal_forces_n=[1.0], duration_s=10.0)
        for sensors in ({}, {"sensors": {"lag_s_u": assumed_s}})
    )
    plans = (fl.plan(rig, law="coulomb+speed", tests=1) for rig in rigs)
    assumed, known = (present(plan.tests[0].expected_u["contact_damping_ratio"]) for plan in plans)
    assert 1.2 * known < assumed < 2.6 * known


def test_what_was_measured_is_known_before() -> None:
    known = replace(example_law(), law="coulomb", values={"friction_coefficient": 0.6}, covariance=np.eye(1) * 1e-10)

    def left(measured: MaterialLaw | None = None) -> float:
        few = scene(frequency_ratios=[0.3, 0.8], normal_forces_n=[0.5, 1.0])
        test = fl.plan(few, tests=1, law_file=measured).tests[0]
        return (present(test.cumulative)["beta"] or math.inf) / test.normal_force_n

    assert left(known) < left()


def test_a_base_amplitude_that_is_assumed_is_named_and_so_where_every_candidate_stands_still() -> None:
    rig: dict[str, Mapping[str, object]] = {"rig": {"natural_frequency_hz": NATURAL_HZ, "stiffness_n_per_m": 1191.0}}
    known = scene_from_tables(rig | {"plan": {"normal_forces_n": [3.6], "frequency_ratios": [0.5]}})
    with pytest.raises(UsageError, match=r"(?s)no candidate shows anything.*base_amplitudes_m = \[0\.0018\]"):
        fl.plan(known)
    found = fl.plan(known, tests=1, friction_coefficient=[0.3, 0.1])
    assert found.notes[0].startswith("plan: not given, assumed: base_amplitudes_m = [0.0018], duration_s = 60.0")
    found = fl.plan(known, tests=1, law="coulomb", law_file=example_law())  # of tests at 1.5 and 1.9 mm
    assert found.notes[0] == "plan.base_amplitudes_m: not given: [0.0015, 0.0019], as in the tests of brass"
    assert found.notes[1].startswith("plan: not given, assumed: duration_s = 60.0")


def test_what_the_sensors_gain_does_is_promised_as_a_comparison_states_it() -> None:
    """A gain of 5 % moves the coefficient by 5 %, whatever the noise: tests do not average it out."""
    known = scene({"sensors": {"gain_error": 0.05}}, frequency_ratios=[0.5], normal_forces_n=[1.0])
    first, second = fl.plan(known, tests=2).tests
    recording = recorded(Problem(0.5, first.values["beta"]), np.random.default_rng(0))
    found = fl.compare(replace(measure(recording, known), normal_force_n=1.0), known)
    assert first.friction_coefficient_u == pytest.approx(found.friction_coefficient_u, rel=0.02)
    assert second.friction_coefficient_u_after == pytest.approx(first.friction_coefficient_u, rel=0.02)


def test_the_law_that_a_campaign_has_found_is_planned_for_unless_another_is_named(tmp_path: Path) -> None:
    few: dict[str, object] = {"frequency_ratios": [0.5], "normal_forces_n": [1.0]}
    law = tmp_path / "law_brass.toml"
    example_law().write(law)
    plan = fl.plan(scene(**few), tests=1, law_file=law)
    assert plan.law == "coulomb+place"
    assert plan.tests[0].values["beta"] == pytest.approx(
        0.309 * plan.tests[0].normal_force_n / (1191.0 * BASE_M), rel=1e-6
    )
    assert fl.plan(scene(**few), law="coulomb", tests=1, law_file=law).law == "coulomb"
    assert fl.plan(scene({"model": {"law": "coulomb"}}, **few), tests=1, law_file=law).law == "coulomb"
    with pytest.raises(UsageError, match="law_file: expected the law of steel; got that of brass"):
        fl.plan(scene({"experiment": {"material": "steel"}}), law_file=law)


@pytest.mark.parametrize(
    ("change", "options", "fault"),
    [
        ({"normal_forces_n": []}, {}, r"plan\.normal_forces_n: expected at least one value"),
        ({"frequency_ratios": []}, {}, r"plan\.frequency_ratios: expected at least one value"),
        ({"avoid_frequency_ratios": [0.1, 2.0]}, {}, r"plan\.avoid_frequency_ratios: 0\.1 to 2 forbids all"),
        ({"largest_response_m": 1e-6}, {}, r"plan\.largest_response_m: 1e-06 m forbids all candidates"),
        ({"duration_s": 1.5}, {}, r"plan\.duration_s: 1\.5 s are over before the transient .*transient_s = 2 s"),
        ({"expected": {"beta": 0.3}}, {}, r"plan\.expected\.beta: it follows from friction_coefficient"),
        ({"normal_forces_n": [50.0]}, {}, "no candidate shows anything: the mass stands still"),
        ({}, {"against": "coulomb"}, r"against: law coulomb is the one that is planned for"),
        ({}, {"law": "coulomb+place", "against": "coulomb+nothing"}, r"nothing"),
    ],
)
def test_a_plan_that_cannot_be_is_refused_by_name(
    change: Mapping[str, object], options: Mapping[str, object], fault: str
) -> None:
    error = SceneError if fault.startswith("plan") else UsageError
    with pytest.raises(error, match=fault):
        fl.plan(scene(**change), **options)  # type: ignore[arg-type]


def test_all_that_a_plan_lacks_is_named_at_once() -> None:
    lacking = r"(?s)a plan needs natural frequency and stiffness.*plan\.normal_forces_n: expected.*plan\.base_amp"
    with pytest.raises(SceneError, match=lacking):
        fl.plan(Scene.model_validate({"plan": {"base_amplitudes_m": []}}))


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """The rig's scene with two candidates, as a file."""
    path = tmp_path / "rig.toml"
    few = scene({"experiment": {"material": "steel"}}, frequency_ratios=[0.3, 0.8], normal_forces_n=[1.0])
    path.write_text(to_toml(few))
    return path


def test_the_command_prints_the_contracts_keys_and_writes_a_sheet_that_scenes_read(
    written: Path, tmp_path: Path
) -> None:
    sheet = tmp_path / "tests.csv"
    lines = rows_of(invoke("plan", "--scene", written, "--tests", "2", "-o", sheet, "--json", status=0))
    assert len(lines) == 2
    assert list(lines[0])[: len(LINE)] == LINE
    assert lines[0]["rank"] == 1
    assert lines[0]["expected"]["beta"] > 0
    assert math.isfinite(lines[1]["cumulative"]["beta"])
    log = tmp_path / str(fl.read_rows(sheet)[0]["log"])
    facts = facts_of(scene_from_tables({"experiment": {"sheet": sheet.name}}, folder=tmp_path), log).values
    assert (facts["normal_force_n"], facts["material"]) == (1.0, "steel")
    assert "give --force" in invoke("plan", "--scene", written, "-o", sheet, status=2).output


def test_two_laws_are_told_apart_on_the_command_line(written: Path) -> None:
    asked = ["plan", "--scene", str(written), "--law", "coulomb+place", "--against", "coulomb+speed", "--tests", "1"]
    told = json.loads(invoke(*asked, "--json").stdout)
    assert told["log_bayes_after"] == pytest.approx(min(told["log_bayes"], told["log_bayes_against"]), rel=0.05)
    said = invoke(*asked).stdout
    assert "law coulomb+place against coulomb+speed: 1 test, of 2 candidates" in said
