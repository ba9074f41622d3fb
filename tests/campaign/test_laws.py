"""The law per material: what its tests require together."""

from pathlib import Path

import pytest

from frictionlab.analysis.measure import measure
from frictionlab.campaign import Campaign
from frictionlab.errors import ParameterError, UsageError
from frictionlab.hdf5 import write_recording
from frictionlab.scene import Scene
from frictionlab.tables import write_rows
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


@pytest.fixture
def joined(scene: Scene, tmp_path: Path) -> Campaign:
    """Measurements and comparisons of the same tests, and one test of which there is a comparison alone."""
    rows = [row("steel", 1.5, r, 0.6) for r in (0.3, 0.7, 1.4)]
    told = [comparison(str(r["source"]), coulomb=0.0, coulomb_place=6.0) for r in rows]
    alone = {**comparison("alone.h5", coulomb=0.0, coulomb_place=6.0), "material": "steel", "normal_force_n": 1.5}
    write_rows(rows, tmp_path / "m.jsonl")
    write_rows([*told, alone, {"source": "lost.h5", "status": "failed", "reason": "no drive"}], tmp_path / "c.jsonl")
    return evaluate([tmp_path / "m.jsonl", tmp_path / "c.jsonl"], scene)


def test_comparisons_join_their_measurements_and_stand_alone_where_there_is_none(joined: Campaign) -> None:
    assert [t.source for t in joined.failures] == ["lost.h5"]
    assert len(joined.trials) == 5
    assert joined.laws == ()  # evidence of single tests is none of the material: its scatter would be counted as law


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
