"""The contract's keys and habits, command by command: one table of what a script may rely on."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import NoReturn

import pytest
from typer.testing import CliRunner

from frictionlab.cli import app
from frictionlab.figures.style import caution, new_figure

ROOT = Path(__file__).parents[1]
SCENE = ROOT / "configs" / "sample_data.toml"
LOG = ROOT / "sample_data" / "aramid_N1.25_r1.2.csv"
MEASUREMENT = (
    "source status reason warnings material normal_force_n sampling_rate_hz duration_s transient_s drive_frequency_hz"
    " drive_frequency_hz_se natural_frequency_hz frequency_ratio frequency_ratio_se base_amplitude_m"
    " base_amplitude_m_se base_distortion cycles energy_per_cycle energy_per_cycle_se energy_per_cycle_j energy_rule"
    " response_amplitude response_amplitude_se irregularity_index irregularity_floor base_irregularity_index"
    " stops_per_cycle stuck_fraction regime asymmetry"
    " frequency_ratio_u base_amplitude_m_u energy_per_cycle_u response_amplitude_u budget"
)
COMPARISON = (
    "source status reason warnings frequency_ratio energy_per_cycle response_amplitude stops_per_cycle regime"
    " friction_ratio friction_ratio_se friction_force_n friction_coefficient predicted_energy_per_cycle"
    " predicted_response_amplitude predicted_stops_per_cycle predicted_regime energy_difference response_nrmse model"
    " solver closure_error law parameters response_floor misfit verdict friction_ratio_u friction_force_n_u"
    " friction_coefficient_u budget"
)
STATE = (
    "r beta mu zeta wall solver outcome energy_per_cycle response_amplitude stops_per_cycle stuck_fraction regime"
    " symmetric period_cycles floquet_multiplier closure_error"
)
SWEPT = ("sweep", "--r", "0.5,1.5", "--beta", "0.4", "-o", "TMP/map.h5")
KEYS: Mapping[tuple[str, ...], str] = {
    ("analyze", str(LOG), "--scene", str(SCENE)): MEASUREMENT,
    ("compare-numeric", str(LOG), "--scene", str(SCENE)): COMPARISON,
    ("compare-numeric", str(LOG), "--scene", str(SCENE), "--whole"): (
        f"{COMPARISON} record_nrmse record_energy_difference"
    ),
    ("simulate", "--r", "0.5", "--beta", "0.4"): f"{STATE} wall_s law parameters",
    ("simulate", "--r", "1", "--beta", "0.2"): f"{STATE} wall_s law parameters",
    SWEPT: STATE,
}


def refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is no JSON")


@pytest.mark.parametrize(
    ("words", "keys"), KEYS.items(), ids=lambda x: " ".join(x)[:14] if isinstance(x, tuple) else ""
)
def test_json_has_the_contracts_keys_and_no_nan(words: tuple[str, ...], keys: str, tmp_path: Path) -> None:
    told = CliRunner().invoke(app, [*(word.replace("TMP", str(tmp_path)) for word in words), "--json"])
    assert told.exit_code == 0, told.stderr
    for line in told.stdout.splitlines():
        row = json.loads(line, parse_constant=refuse)
        assert not [key for key in keys.split() if key not in row]


def test_a_map_is_drawn_over_one_axis_and_two_and_refused_over_three(tmp_path: Path) -> None:
    place = tmp_path / "new" / "map.svg"
    one = ["sweep", "--r", "0.5:1.5:0.25", "--beta", "0.4", "-o", f"{tmp_path}/a.csv", "--plot", str(place)]
    two = ["sweep", "--r", "0.5,1", "--beta", "0.2,0.4", "-o", f"{tmp_path}/b.h5", "--plot", f"{tmp_path}/b.pdf"]
    for words in (one, two):
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 0, done.stderr
    assert b"<dc:title>frictionlab</dc:title>" in place.read_bytes()
    three = CliRunner().invoke(app, [*two, "--mu", "1,2", "--force"])
    assert three.exit_code == 2
    assert "expected one or two axes" in three.stderr


def test_a_named_figure_is_that_file_and_several_inputs_need_a_folder(tmp_path: Path) -> None:
    words = ["analyze", str(LOG), "--scene", str(SCENE), "--quiet"]
    assert CliRunner().invoke(app, [*words, "--plot", f"{tmp_path}/new/x.svg"]).exit_code == 0
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["x.svg"]
    for wrong, fault in (("x.docx", "ending in .pdf"), ("x.pdf", "expected a folder")):
        done = CliRunner().invoke(app, [*words, str(ROOT / "other.h5"), "--plot", str(tmp_path / wrong)])
        assert done.exit_code == 2
        assert fault in done.stderr


def test_what_warns_of_a_number_stands_below_its_figure() -> None:
    figure = new_figure()
    caution(figure, ["base: noise", "energy_per_cycle: of a passing state", "a", "b", "c"])
    told = figure.get_supxlabel()
    assert told.startswith("! base: noise\n! energy_per_cycle: of a passing state")
    assert told.endswith("and 2 more, in the table")
    quiet = new_figure()
    caution(quiet, ())
    assert not quiet.get_supxlabel()


def test_like_named_inputs_keep_figures_of_their_own(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "log.csv").write_bytes(LOG.read_bytes())
    logs = [str(tmp_path / name / "log.csv") for name in ("a", "b")]
    done = CliRunner().invoke(app, ["analyze", *logs, "--scene", str(SCENE), "-q", "--plot", f"{tmp_path}/figures"])
    assert done.exit_code == 0, done.stderr
    assert len(list((tmp_path / "figures").iterdir())) == 2


def test_a_maps_own_axes_are_shown(tmp_path: Path) -> None:
    path = str(tmp_path / "map.csv")
    words = ["sweep", "--r", "0.5", "--beta", "0.4", "--law", "coulomb+place", "--parameter", "gradient=0,0.1"]
    assert CliRunner().invoke(app, [*words, "-o", path]).exit_code == 0
    assert CliRunner().invoke(app, ["show", path]).stdout.split()[0] == "gradient"


@pytest.mark.parametrize("name", ["nothing.h5", "nothing.csv", "nothing.toml"])
def test_a_file_that_is_not_there_is_said_so(name: str) -> None:
    done = CliRunner().invoke(app, ["show", name])
    assert "there is no such file" in done.stderr
    assert done.exit_code == 2
