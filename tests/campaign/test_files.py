"""Files of a campaign: rows in from every kind of file, the contract's tables out, nothing of others replaced."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from frictionlab.campaign import Campaign, write_tables
from frictionlab.campaign.files import check_folder, read_measurements
from frictionlab.campaign.trials import trial_of
from frictionlab.errors import OutputError, RecordingError, UsageError
from frictionlab.hdf5 import write_tree
from frictionlab.schema import MEASUREMENTS
from frictionlab.tables import read_rows, write_rows
from tests.campaign.fabricate import row

FRICTION = [
    *("material", "normal_force_n", "tests", "friction_ratio", "friction_ratio_se", "friction_force_n"),
    *("friction_force_n_se", "friction_coefficient", "friction_coefficient_se"),
]
RANKING = ["criterion", "rank", "material", "value", "value_se"]


@pytest.fixture
def folder(campaign: Campaign, tmp_path: Path) -> Path:
    check_folder(tmp_path)
    write_tables(campaign, tmp_path)
    return tmp_path


def header(path: Path) -> list[str]:
    with path.open(encoding="utf-8", newline="") as file:
        return next(csv.reader(file))


def test_the_contracts_columns_come_first(folder: Path) -> None:
    assert header(folder / "friction.csv")[: len(FRICTION)] == FRICTION
    assert header(folder / "ranking.csv")[: len(RANKING)] == RANKING


def test_every_test_is_a_row_failed_ones_with_their_reason(folder: Path, campaign: Campaign) -> None:
    rows = read_rows(folder / "measurements.csv")
    assert len(rows) == len(campaign.trials)
    (failed,) = [row for row in rows if row["status"] == "failed"]
    assert failed["reason"] == "no drive & <b>nothing</b>"
    assert len(read_rows(folder / "friction.csv")) == 9
    assert len(read_rows(folder / "drift.csv")) == 3
    assert {row["tests"] for row in read_rows(folder / "friction.csv")} == {5}


def test_the_same_campaign_gives_the_same_bytes(
    folder: Path, campaign: Campaign, tmp_path_factory: pytest.TempPathFactory
) -> None:
    other = tmp_path_factory.mktemp("other")
    write_tables(campaign, other)
    for path in sorted(folder.glob("*.csv")):
        assert path.read_bytes() == (other / path.name).read_bytes()


def test_an_earlier_campaign_is_replaced_and_nothing_else(folder: Path) -> None:
    check_folder(folder)
    (folder / "measurements.csv").write_text("my,own,table\n")
    with pytest.raises(OutputError, match=r"measurements\.csv: exists and was not written by frictionlab campaign"):
        check_folder(folder)
    check_folder(folder, force=True)


def test_a_file_in_the_folders_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    with pytest.raises(OutputError, match="cannot be made"):
        check_folder(tmp_path / "out")


def test_rows_come_back_the_same_from_every_kind_of_file(tmp_path: Path) -> None:
    rows = [row("steel", 1.25, r, 0.6) for r in (0.3, 1.2)]
    write_rows(rows, tmp_path / "m.csv")
    (tmp_path / "m.jsonl").write_text("".join(json.dumps(r) + "\n" for r in rows))
    columns = {key: [str(r[key]) for r in rows] for key in ("source", "status", "material", "regime")}
    numbers = {k: np.array([r[k] for r in rows], float) for k in rows[0] if _is_number(rows[0][k])}
    write_tree({"rows": {**columns, **numbers}, "cycles": {}}, tmp_path / "m.h5", kind=MEASUREMENTS.format)
    expected = [trial_of(r) for r in rows]
    for name in ("m.csv", "m.jsonl", "m.h5"):
        trials = [trial_of(r) for r in read_measurements(tmp_path / name)]
        assert [(t.group, t.r, t.mean, t.mean_se) for t in trials] == [
            (t.group, t.r, t.mean, t.mean_se) for t in expected
        ]


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def test_an_h5_file_brings_the_trend_of_a_long_test(tmp_path: Path) -> None:
    trend = {"time": np.arange(3.0), "value": np.ones(3), "slope": 1e-4, "slope_se": 1e-5, "low": 8e-5, "high": 12e-5}
    tree = {"rows": {"source": ["a.h5"]}, "cycles": {"0": {"trend": {**trend, "level": 1.0}}}}
    write_tree(tree, tmp_path / "m.h5", kind=MEASUREMENTS.format)
    (found,) = read_measurements(tmp_path / "m.h5")
    trial = trial_of(found)
    assert trial.trend is not None
    assert trial.trend.slope == 1e-4
    assert "trend" not in trial.row


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("m.txt", "", "expected measurements as"),
        ("m.jsonl", "", "expected at least one measurement"),
        ("m.jsonl", "{\n", "line 1: expected a JSON object"),
        ("m.csv", "a,b\n1,2\n", "row 1: expected a measurement with a source"),
        ("gone.jsonl", None, "there is no such file"),
    ],
)
def test_files_that_hold_no_measurements_are_refused(tmp_path: Path, name: str, text: str | None, words: str) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(UsageError, match=words):
        read_measurements(tmp_path / name)
    write_tree({"a": 1.0}, tmp_path / "other.h5", kind="frictionlab example")
    with pytest.raises(RecordingError, match="expected a file of frictionlab measurements"):
        read_measurements(tmp_path / "other.h5")
