"""The tables as files: the contract's columns, no missing row, nothing of others replaced."""

import csv
from pathlib import Path

import pytest

from frictionlab.campaign import Campaign
from frictionlab.campaign.files import check_folder, write_tables
from frictionlab.errors import OutputError
from frictionlab.tables import read_rows

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
