"""The whole thread on the synthetic samples: what comes out is what was put in."""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from frictionlab.inference import Comparison, compare
from frictionlab.logs import read_log
from frictionlab.scene import read_scene
from frictionlab.synthetic import log_text, truth, virtual_tests

ROOT = Path(__file__).parents[1]
SCENE = read_scene(ROOT / "configs" / "sample_data.toml")
TRUTHS = [json.loads(line) for line in (ROOT / "sample_data" / "truth.jsonl").read_text().splitlines()]


@cache
def compared(log: str) -> Comparison:
    return compare(read_log(ROOT / "sample_data" / log), SCENE)


@pytest.fixture(params=TRUTHS, ids=lambda row: row["log"])
def known(request: pytest.FixtureRequest) -> dict[str, object]:
    row = request.param
    assert isinstance(row, dict)
    return row


def test_the_folder_is_small_complete_and_honest() -> None:
    logs = sorted((ROOT / "sample_data").glob("*.csv"))
    assert [path.name for path in logs] == sorted(row["log"] for row in TRUTHS)
    assert len(logs) == 6
    assert sum(path.stat().st_size for path in (ROOT / "sample_data").iterdir()) < 6_000_000
    assert all(path.read_text().startswith("# SYNTHETIC: simulated by frictionlab") for path in logs)
    assert {(row["material"], row["regime"]) for row in TRUTHS} == {
        (material, regime) for material in ("steel", "rubber", "aramid") for regime in ("continuous", "stick-slip")
    }


def test_the_scene_gives_the_committed_logs_bit_for_bit() -> None:
    for test in virtual_tests(SCENE):
        assert (ROOT / "sample_data" / test.log).read_bytes() == log_text(test, SCENE).encode()
    assert [json.loads(json.dumps(truth(test))) for test in virtual_tests(SCENE)] == TRUTHS


def test_one_make_target_makes_them(tmp_path: Path) -> None:
    makefile = (ROOT / "Makefile").read_text()
    line = next(x for x in makefile.splitlines() if "synthesize --scene configs/sample_data.toml" in x)
    words = [sys.executable.replace("python", "frictionlab") if w.startswith("$(") else w for w in line.split()]
    assert words[-2:] == ["-o", "sample_data"]
    command = [str(Path(sys.executable).parent / "frictionlab"), *words[1:-1], str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, timeout=100)
    for made in tmp_path.iterdir():
        assert made.read_bytes() == (ROOT / "sample_data" / made.name).read_bytes()


def test_frequency_ratio_within_1e_5(known: dict[str, float]) -> None:
    assert compared(str(known["log"])).frequency_ratio == pytest.approx(known["frequency_ratio"], rel=1e-5)


def test_energy_within_half_a_percent(known: dict[str, float]) -> None:
    assert compared(str(known["log"])).energy_per_cycle == pytest.approx(known["energy_per_cycle"], rel=0.005)


def test_amplitude_within_a_thousandth(known: dict[str, float]) -> None:
    assert compared(str(known["log"])).response_amplitude == pytest.approx(known["response_amplitude"], rel=1e-3)


def test_friction_ratio_within_two_percent(known: dict[str, float]) -> None:
    assert compared(str(known["log"])).friction_ratio == pytest.approx(known["friction_ratio"], rel=0.02)


def test_stops_and_regime_are_right(known: dict[str, float]) -> None:
    comparison = compared(str(known["log"]))
    assert comparison.stops_per_cycle == pytest.approx(known["stops_per_cycle"], abs=0.05)
    assert comparison.regime == str(known["regime"])


def test_the_prediction_lies_on_the_measurement(known: dict[str, float]) -> None:
    assert compared(str(known["log"])).response_nrmse == pytest.approx(0, abs=0.01)
