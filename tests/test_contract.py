"""The contract's keys and habits, command by command: one table of what a script may rely on."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import pytest

from frictionlab import tradeoff
from frictionlab.campaign import write_tables
from frictionlab.campaign.files import REPORT, TABLES
from frictionlab.scene import scene_from_tables
from frictionlab.tables import read_rows
from frictionlab.tradeoff import Setting
from frictionlab.verbs.evaluate import evaluate
from tests.campaign.fabricate import SCENE as RIG
from tests.campaign.fabricate import small_campaign
from tests.desk import ROOT, SCENE, invoke, rows_of

LOG = ROOT / "sample_data" / "aramid_N1.25_r1.2.csv"


def words(text: str) -> list[str]:
    return text.split()


MEASUREMENT = words(
    "source status reason warnings material normal_force_n sampling_rate_hz duration_s transient_s drive_frequency_hz"
    " drive_frequency_hz_se natural_frequency_hz frequency_ratio frequency_ratio_se base_amplitude_m"
    " base_amplitude_m_se base_distortion cycles energy_per_cycle energy_per_cycle_se energy_per_cycle_j energy_rule"
    " response_amplitude response_amplitude_se irregularity_index irregularity_floor base_irregularity_index"
    " stops_per_cycle stuck_fraction regime asymmetry"
)
MEASURED_TOO = ["frequency_ratio_u", "base_amplitude_m_u", "energy_per_cycle_u", "response_amplitude_u", "budget"]
COMPARISON = words(
    "source status reason warnings frequency_ratio energy_per_cycle response_amplitude stops_per_cycle regime"
    " friction_ratio friction_ratio_se friction_force_n friction_coefficient predicted_energy_per_cycle"
    " predicted_response_amplitude predicted_stops_per_cycle predicted_regime energy_difference response_nrmse model"
    " solver closure_error"
)
COMPARED_TOO = words(
    "law parameters response_floor misfit verdict laws record_nrmse record_energy_difference friction_ratio_u"
    " friction_force_n_u friction_coefficient_u budget"
)
STATE = words(
    "r beta mu zeta wall solver outcome energy_per_cycle response_amplitude stops_per_cycle stuck_fraction regime"
    " symmetric period_cycles floquet_multiplier closure_error"
)
SIMULATED_TOO = ["wall_s", "law", "parameters"]
RUNG = words("law parameters log_evidence response_nrmse held_out_nrmse required seconds")
VALUE = ["value", "se", "told", "lower", "upper"]
TYPES: Mapping[str, type | tuple[type, ...]] = {
    **dict.fromkeys(["source", "status", "reason", "material", "energy_rule", "regime", "predicted_regime"], str),
    **dict.fromkeys(["model", "solver", "law", "verdict", "wall", "outcome"], str),
    **dict.fromkeys(["parameters", "budget", "nuisances", "levels"], dict),
    **dict.fromkeys(["warnings", "laws", "response_amplitudes", "contacts"], list),
    **dict.fromkeys(["cycles", "period_cycles"], int),
    "symmetric": bool,
    "accuracy": str,
}
"""What a value is, unless it is null; a number where nothing else is said."""
SCENED = ("--scene", str(SCENE))
SWEPT = ("sweep", "--r", "0.5,1", "--beta", "0.4", "-o", "TMP/map.h5")
KEYS: Mapping[tuple[str, ...], tuple[list[str], list[str]]] = {
    ("analyze", str(LOG), *SCENED): (MEASUREMENT, MEASURED_TOO),
    ("compare-numeric", str(LOG), *SCENED): (COMPARISON, COMPARED_TOO),
    ("compare-numeric", str(LOG), *SCENED, "--whole"): (COMPARISON, COMPARED_TOO),
    ("simulate", "--r", "0.5", "--beta", "0.4"): (STATE, SIMULATED_TOO),
    ("simulate", "--r", "1", "--beta", "0.2"): (STATE, SIMULATED_TOO),
    SWEPT: (STATE, []),
}


@cache
def run_json(*command: str, status: int = 0) -> list[dict[str, Any]]:
    """The rows that a command prints; nothing else may be on its standard output."""
    return rows_of(invoke(*command, "--json", status=status))


@pytest.mark.parametrize(
    ("command", "keys"), KEYS.items(), ids=lambda x: " ".join(x)[:14] if isinstance(x[0], str) else ""
)
def test_json_has_the_contracts_keys_in_its_order_each_of_its_type(
    command: tuple[str, ...], keys: tuple[list[str], list[str]], tmp_path: Path
) -> None:
    first, too = keys
    for row in run_json(*(word.replace("TMP", str(tmp_path)) for word in command)):
        assert list(row)[: len(first)] == first
        assert not [key for key in too if key not in row]
        if row.get("outcome") == "unbounded":
            assert {row[key] for key in STATE[STATE.index("outcome") + 1 :]} == {None}
        for key, value in row.items():
            kind = TYPES.get(key, (int, float))
            assert value is None or (isinstance(value, kind) and (kind is bool or not isinstance(value, bool))), key


def test_parameters_and_the_ladder_are_objects_of_the_contract_in_the_order_climbed() -> None:
    (row,), (climbed,) = (run_json("compare-numeric", str(LOG), *SCENED, *more) for more in ((), ("--law", "auto")))
    assert row["laws"] is None
    assert [key for key in row["parameters"]["beta"] if key in VALUE] == VALUE
    assert row["parameters"]["beta"]["told"] is True
    assert row["parameters"]["beta"]["value"] == row["friction_ratio"]
    assert row["misfit"] == pytest.approx(row["response_nrmse"] / row["response_floor"], rel=1e-12)
    assert row["verdict"] in ("explained", "misfit")
    assert row["energy_difference"] == pytest.approx(
        row["predicted_energy_per_cycle"] / row["energy_per_cycle"] - 1.0, abs=1e-14
    )
    assert {"friction_ratio", "friction_force_n", "friction_coefficient"} <= set(row["budget"])
    assert [list(rung)[: len(RUNG)] for rung in climbed["laws"]] == [RUNG] * len(climbed["laws"])
    assert climbed["laws"][0]["law"] == "coulomb"
    assert {type(rung["required"]) for rung in climbed["laws"]} == {bool}


def test_a_failed_input_is_its_source_and_reason_and_the_others_go_on(tmp_path: Path) -> None:
    bad = tmp_path / "bad.h5"
    bad.write_bytes(b"no recording")
    first, second = run_json("analyze", str(bad), str(LOG), *SCENED, status=1)
    assert list(first) == ["source", "status", "reason"]
    assert first["status"] == "failed"
    assert second["status"] == "ok"
    driven = ("simulate", "--base-motion", str(bad), "--natural-frequency", "3", "--beta", "0.4")
    for command in (("free-vibration", str(bad)), driven):
        (alone,) = run_json(*command, status=1)
        assert list(alone) == ["source", "status", "reason"]


@pytest.mark.parametrize("suffix", [".csv", ".jsonl", ".h5"])
def test_a_table_of_any_suffix_begins_with_the_contracts_columns(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"new/table{suffix}"
    done = invoke("analyze", LOG, *SCENED, "-q", "-o", path, status=0)
    assert done.stdout.startswith("1 of 1 recordings measured")
    (row,) = read_rows(path)
    assert [key for key in row if key in MEASUREMENT] == [key for key in MEASUREMENT if key in row]
    assert row["cycles"] == 149
    if suffix == ".csv":
        head, line = path.read_text().splitlines()
        assert head.split(",")[: len(MEASUREMENT)] == MEASUREMENT
        assert line.split(",")[2:4] == ["", ""]
    if suffix == ".h5":
        with h5py.File(path) as file:
            assert file["rows/base_amplitude_m"].attrs["units"] == "m"
            assert file["rows/energy_per_cycle"].attrs["long_name"]


def test_a_map_is_drawn_over_one_axis_and_two_and_refused_over_three(tmp_path: Path) -> None:
    place = tmp_path / "new" / "map.svg"
    one = ["sweep", "--r", "0.5:1.5:0.25", "--beta", "0.4", "-o", f"{tmp_path}/a.csv", "--plot", str(place)]
    law = ["--law", "coulomb+place", "--parameter", "gradient=0,0.1"]
    two = ["sweep", "--r", "0.5,1", "--beta", "0.4", *law, "-o", f"{tmp_path}/b.csv", "--plot", f"{tmp_path}/b.pdf"]
    for command in (one, two):
        invoke(*command, status=0)
    assert b"<dc:title>frictionlab</dc:title>" in place.read_bytes()
    assert invoke("show", f"{tmp_path}/b.csv").stdout.split()[0] == "gradient", "an axis of its own"
    assert "expected one or two axes" in invoke(*two, "--mu", "1,2", "--force", status=2).stderr


FRICTION = words(
    "material normal_force_n tests friction_ratio friction_ratio_se friction_force_n friction_force_n_se"
    " friction_coefficient friction_coefficient_se"
)
RANKING = words("criterion rank material value value_se")


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tables of a campaign of three materials."""
    folder = tmp_path_factory.mktemp("campaign")
    write_tables(evaluate(small_campaign(), scene_from_tables(RIG)), folder)
    return folder


def test_tables_of_a_campaign_begin_with_the_contracts_columns(tables: Path) -> None:
    assert {path.name for path in tables.iterdir()} == set(TABLES)
    assert {"measurements.csv", "friction.csv", "ranking.csv", "drift.csv"} <= set(TABLES)
    assert REPORT == "report.html"
    heads = {name: (tables / name).read_text(encoding="utf-8").splitlines()[0].split(",") for name in TABLES}
    assert heads["friction.csv"][: len(FRICTION)] == FRICTION
    assert heads["ranking.csv"][: len(RANKING)] == RANKING
    assert [key for key in MEASUREMENT if key not in heads["measurements.csv"]] == []
    assert {"material", "normal_force_n", "slope_per_hour", "slope_per_hour_low", "slope_per_hour_high"} <= set(
        heads["drift.csv"]
    )


def test_rows_of_a_campaign_are_one_a_material_and_force_and_best_first(tables: Path) -> None:
    fits = read_rows(tables / "friction.csv")
    assert len({(row["material"], row["normal_force_n"]) for row in fits}) == len(fits) == 9
    for row in fits:
        assert all(isinstance(row[key], (int, float)) for key in FRICTION[1:])
    ranks = read_rows(tables / "ranking.csv")
    assert list(dict.fromkeys(row["criterion"] for row in ranks)) == ["energy", "consistency", "drift"]
    for criterion in ("energy", "consistency", "drift"):
        places = [float(str(row["rank"])) for row in ranks if row["criterion"] == criterion]
        assert len(places) == 3
        assert places == sorted(places)
    assert len(read_rows(tables / "drift.csv")) == 3


def test_the_trade_is_a_line_per_setting_with_the_contracts_keys(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def knob() -> tuple[Setting, ...]:
        return (
            Setting("padding", "1", "frequency_ratio", 1e-6, 0.1),
            Setting("padding", "4", "frequency_ratio", 1e-8, 0.2, default=True),
        )

    monkeypatch.setattr(tradeoff, "KNOBS", (knob,))
    rows = run_json("tradeoff", "-o", str(tmp_path / "new" / "folder"))
    kinds = {"knob": str, "setting": str, "quantity": str, "error": float, "seconds": float, "default": bool}
    for row in rows:
        assert list(row)[:7] == [*kinds, "dominated"]
        assert all(isinstance(row[key], kind) for key, kind in {**kinds, "dominated": bool}.items())
    assert [row["default"] for row in rows] == [False, True]
    assert len(read_rows(tmp_path / "new" / "folder" / "tradeoff.csv")) == 2
