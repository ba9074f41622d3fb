"""The whole thread on the synthetic samples: what comes out is what was put in."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from frictionlab import compare
from frictionlab.logs import read_log
from frictionlab.scene import read_scene

ROOT = Path(__file__).parents[1]
SCENE = read_scene(ROOT / "configs" / "sample_data.toml")
TRUTHS = [json.loads(line) for line in (ROOT / "sample_data" / "truth.jsonl").read_text().splitlines()]


def test_the_folder_is_small_complete_and_honest() -> None:
    logs = sorted((ROOT / "sample_data").glob("*.csv"))
    assert [path.name for path in logs] == sorted(row["log"] for row in TRUTHS)
    assert len(logs) == 6
    assert sum(path.stat().st_size for path in (ROOT / "sample_data").iterdir()) < 6_000_000
    assert all(path.read_text().startswith("# SYNTHETIC: simulated by frictionlab") for path in logs)
    assert {(row["material"], row["regime"]) for row in TRUTHS} == {
        (material, regime) for material in ("steel", "rubber", "aramid") for regime in ("continuous", "stick-slip")
    }


def test_one_make_target_makes_them(tmp_path: Path) -> None:
    makefile = (ROOT / "Makefile").read_text()
    line = next(x for x in makefile.splitlines() if "synthesize --scene configs/sample_data.toml" in x)
    words = [sys.executable.replace("python", "frictionlab") if w.startswith("$(") else w for w in line.split()]
    assert words[-2:] == ["-o", "sample_data"]
    command = [str(Path(sys.executable).parent / "frictionlab"), *words[1:-1], str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, timeout=100)
    assert {row["log"] for row in TRUTHS} | {"truth.jsonl"} <= {made.name for made in tmp_path.iterdir()}
    for made in tmp_path.iterdir():
        assert made.read_bytes() == (ROOT / "sample_data" / made.name).read_bytes()


@pytest.mark.parametrize("known", TRUTHS, ids=lambda row: row["log"])
def test_what_was_put_in_comes_out(known: dict[str, float]) -> None:
    seen = compare(read_log(ROOT / "sample_data" / str(known["log"])), SCENE)
    assert seen.frequency_ratio == pytest.approx(known["frequency_ratio"], rel=1e-5)
    assert seen.energy_per_cycle == pytest.approx(known["energy_per_cycle"], rel=0.005)
    assert seen.response_amplitude == pytest.approx(known["response_amplitude"], rel=1e-3)
    assert seen.friction_ratio == pytest.approx(known["friction_ratio"], rel=0.02)
    assert seen.stops_per_cycle == pytest.approx(known["stops_per_cycle"], abs=0.05)
    assert seen.regime == str(known["regime"])
    assert seen.response_nrmse == pytest.approx(0, abs=0.01)
