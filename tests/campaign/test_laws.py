"""The law per material: evidence of its tests taken together, from tables of comparisons."""

from pathlib import Path

import pytest

from frictionlab.analysis.measure import measure
from frictionlab.campaign import Campaign
from frictionlab.campaign.laws import laws_of
from frictionlab.campaign.output import check_folder, write_tables
from frictionlab.errors import ParameterError, UsageError
from frictionlab.hdf5 import write_recording
from frictionlab.scene import Scene
from frictionlab.tables import Row, read_rows, write_rows
from frictionlab.verbs.evaluate import evaluate
from tests.campaign.fabricate import row
from tests.campaign.recorded import steady_recording


def comparison(source: str, **evidence: float) -> dict[str, object]:
    """A comparison whose ladder found these log evidences, by law ('_' for '+')."""
    rungs = [{"law": law.replace("_", "+"), "log_evidence": e, "response_nrmse": 0.03} for law, e in evidence.items()]
    best = max(rungs, key=lambda rung: float(str(rung["log_evidence"])))
    known = {
        "source": source,
        "status": "ok",
        "frequency_ratio": 0.5,
        "energy_per_cycle": 2.0,
        "response_amplitude": 1.3,
    }
    return {**known, "law": best["law"], "laws": rungs}


def test_evidence_of_single_tests_adds_up_to_a_law_that_none_of_them_requires() -> None:
    rows: list[Row] = [comparison(f"{n}", coulomb=0.0, coulomb_place=2.5, coulomb_speed=-1.0) for n in range(3)]
    found = laws_of(rows, {f"{n}": "steel" for n in range(3)})
    assert [(line.law, line.log_evidence, line.required) for line in found] == [
        ("coulomb+place", 7.5, True),
        ("coulomb", 0.0, False),
        ("coulomb+speed", -3.0, False),
    ]
    assert found[0].gain == 7.5
    assert found[0].tests == 3
    assert found[0].response_nrmse == pytest.approx(0.03)


def test_the_simplest_law_near_the_best_is_the_required_one() -> None:
    found = laws_of([comparison("a", coulomb=0.0, coulomb_place=4.9)], {"a": "steel"})
    assert {line.law: line.required for line in found} == {"coulomb": True, "coulomb+place": False}


def test_only_laws_tried_in_all_tests_of_a_material_are_compared() -> None:
    rows = [comparison("a", coulomb=0.0, coulomb_place=9.0), comparison("b", coulomb=0.0, coulomb_dahl=50.0)]
    assert [line.law for line in laws_of(rows, {"a": "steel", "b": "steel"})] == ["coulomb"]
    assert {(x.material, x.law) for x in laws_of(rows, {"a": "steel", "b": "iron"})} == {
        ("steel", "coulomb"), ("steel", "coulomb+place"), ("iron", "coulomb"), ("iron", "coulomb+dahl"),
    }  # fmt: skip


def test_a_damaged_ladder_is_passed_over() -> None:
    rows: list[Row] = [{"source": "a", "law": "coulomb", "laws": [{"law": "coulomb", "log_evidence": None}, 3]}]
    assert laws_of([*rows, {"source": "a", "law": None}], {"a": "steel"}) == ()


@pytest.fixture
def joined(scene: Scene, tmp_path: Path) -> Campaign:
    """Measurements and comparisons of the same tests, and one test of which there is a comparison alone."""
    rows = [row("steel", 1.5, r, 0.6) for r in (0.3, 0.7, 1.4)]
    told = [comparison(str(r["source"]), coulomb=0.0, coulomb_place=6.0) for r in rows]
    alone = {**comparison("alone.h5", coulomb=0.0, coulomb_place=6.0), "material": "steel", "normal_force_n": 1.5}
    write_rows(rows, tmp_path / "m.jsonl")
    write_rows([*told, alone, {"source": "lost.h5", "status": "failed", "reason": "no drive"}], tmp_path / "c.jsonl")
    return evaluate([tmp_path / "m.jsonl", tmp_path / "c.jsonl"], scene)


def test_comparisons_join_their_measurements_and_stand_alone_where_there_is_none(
    joined: Campaign, tmp_path: Path
) -> None:
    assert [t.source for t in joined.failures] == ["lost.h5"]
    assert len(joined.trials) == 5
    check_folder(tmp_path / "out")
    write_tables(joined, tmp_path / "out")
    first, second = read_rows(tmp_path / "out" / "laws.csv")
    assert (first["material"], first["law"], first["tests"], first["required"]) == ("steel", "coulomb+place", 4, True)
    assert second["law"] == "coulomb"


def test_a_campaign_finds_the_law_of_each_material_from_its_own_recordings(scene: Scene, tmp_path: Path) -> None:
    write_recording(steady_recording(), tmp_path / "a.h5")
    measured = {**measure(steady_recording(), scene).row(), "source": "a.h5", "material": "steel"}
    found = evaluate([{**measured, "normal_force_n": 1.5}], scene, folders=[tmp_path], law="auto")
    assert [law.law for law in found.laws if law.required] == ["coulomb"]
    assert found.joint is not None
    law = found.joint.law("steel")
    assert law is not None
    assert law.name == "coulomb"
    assert len(found.laws) > 1


def test_a_law_that_does_not_exist_is_refused_by_name(scene: Scene) -> None:
    with pytest.raises(ParameterError, match=r"law 'coulomb\+plaice': 'plaice' is no term"):
        evaluate([], scene, law="coulomb+plaice")


def test_a_law_with_open_parameters_needs_recordings(scene: Scene) -> None:
    with pytest.raises(UsageError, match=r"coulomb\+place.*put the recordings beside them.*gradient"):
        evaluate([row("steel", 1.5, 0.5, 0.6)], scene, law="coulomb+place")
