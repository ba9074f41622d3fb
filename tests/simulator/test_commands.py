"""``simulate`` and ``sweep`` as users meet them: rows, files, refusals."""

import json
import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from frictionlab import maps
from frictionlab.errors import OutputError, SimulationError, UsageError
from frictionlab.maps import Grid, make_map
from frictionlab.schema import STEADY_STATES
from frictionlab.simulator import sweep
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.state import KEYS
from frictionlab.simulator.sweep import sweep_points
from frictionlab.tables import read_rows
from tests.desk import invoke as run
from tests.desk import rows_of
from tests.test_cli import PLACE


def test_a_scene_gives_newtons_millimetres_and_millijoules(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text("[rig]\nmass_kg = 2.0\nstiffness_n_per_m = 800.0\n[plan]\nbase_amplitudes_m = [2e-3]\n")
    words = ("simulate", "--scene", scene, "--r", "0.5", "--normal-force", "2.0")
    row = json.loads(run(*words, "--coefficient", "0.32", "--json").stdout)
    assert row["beta"] == pytest.approx(0.32 * 2.0 / (800.0 * 2e-3), rel=1e-12)
    assert row["friction_force_n"] == pytest.approx(0.64, rel=1e-12)
    assert row["energy_per_cycle"] == pytest.approx(2.1260422664, abs=1e-10)
    assert row["energy_per_cycle_j"] == pytest.approx(row["energy_per_cycle"] * 800.0 * 4e-6, rel=1e-12)
    assert row["response_amplitude_m"] == pytest.approx(row["response_amplitude"] * 2e-3, rel=1e-12)
    shown = run(*words, "--coefficient", "0.32")
    assert re.search(r"\nr +Y \[mm\] +E \[mJ\] +X \[mm\] +F \[N\] .*\n0\.5 +2 +6\.\d+ +2\.\d+ +0\.64 +2 ", shown.stdout)
    assert "assumed" not in shown.stderr
    scene.write_text(scene.read_text().partition("[plan]")[0])
    assert "1.8 mm is assumed: --base-amplitude M" in run(*words, "--coefficient", "0.32").stderr
    assert "or, all of them: --coefficient MU" in run(*words, status=2).stderr


def test_the_map_of_a_sweep_is_not_replaced_by_one_state(tmp_path: Path) -> None:
    path = tmp_path / "map.csv"
    assert run("sweep", "--r", "0.5,0.6", "--beta", "0.4", "-o", path).exit_code == 0
    state = ("simulate", "--r", "0.5", "--beta", "0.4", "-o", path)
    assert "exists and is no table of motion" in run(*state, status=2).stderr
    assert [run(*state, "--force").exit_code, run(*state).exit_code] == [0, 0]


def test_a_law_and_its_parameters_are_said_and_told() -> None:
    done = run("simulate", "--r", "0.5", "--beta", "0.4", *PLACE, "--parameter", "frame_damping_ratio=0.01", "--json")
    row = json.loads(done.stdout)
    assert list(row) == [*KEYS, "wall_s", "law", "parameters", "response_amplitudes", "contacts"]
    assert row["law"] == "coulomb+place"
    assert row["response_amplitudes"] == [row["response_amplitude"]]
    assert [(each["mass"], each["against"], each["law"]) for each in row["contacts"]] == [(1, "wall", row["law"])]
    assert row["parameters"] == {"beta": 0.4, "gradient": 0.05, "frame_damping_ratio": 0.01}
    shown = run("simulate", "--r", "0.5", "--beta", "0.4", "--parameter", "frame_damping_ratio=0.01").stdout
    assert "stick-slip with 2 stops per cycle" in shown
    assert shown.startswith("coulomb: beta = 0.4, frame_damping_ratio = 0.01; fixed wall\nr    E [kY²]")
    assert row["stops_per_cycle"] == 1


def test_all_steady_states_are_told_with_their_shares(tmp_path: Path) -> None:
    path = tmp_path / "all.csv"
    rows = rows_of(run("simulate", "--r", "0.3", "--beta", "0.9", "--mu", "1.3", "--all", "--json", "-o", path))
    assert [row["outcome"] for row in rows] == ["periodic", "stuck"]
    assert sum(row["basin_share"] for row in rows) == pytest.approx(1.0)
    assert len(path.read_text().splitlines()) == 3
    alone = run("simulate", "--r", "0.5", "--beta", "0.4", "--all", "--plot", tmp_path / "all.png").stdout
    assert (tmp_path / "all.png").stat().st_size > 10_000
    assert "100 % of the starts: The motion repeats every cycle" in alone
    assert "mirror image" not in alone
    of_twins = run("simulate", "--r", "0.5287", "--beta", "0.2235", "--mu", "3.27", "--all").stdout.split()
    assert "; so does its mirror image, counted with it." in " ".join(of_twins)
    for more in (["--cycles", "3"], ["--plot", "x.txt"], ["--solver", "exact"], ["-o", str(tmp_path / "all.h5")]):
        assert run("simulate", "--r", "0.5", "--beta", "0.4", "--all", *more).exit_code == 2
    scene = Path(__file__).parents[2] / "configs" / "two_storeys.toml"
    frame = json.loads(run("simulate", "--scene", scene, "--r", "0.4", "--all", "--json").stdout)
    assert (frame["basin_share"], frame["outcome"], len(frame["response_amplitudes"])) == (1.0, "periodic", 2)


def test_a_motion_is_written(tmp_path: Path) -> None:
    assert run("simulate", "--r", "0.3", "--beta", "0.6", "-o", tmp_path / "m.h5", "--quiet").exit_code == 0
    with h5py.File(tmp_path / "m.h5") as file:
        x, y = file["motion/displacement"][:], file["motion/base"][:]
        assert file.attrs["stops_per_cycle"] == 2
    area = float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)))
    assert area == pytest.approx(1.8726108802, rel=1e-5)


def test_the_closed_form_alone_refuses_stops_with_status_one() -> None:
    done = run("simulate", "--r", "0.5", "--beta", "0.4", "--solver", "closed-form", status=1)
    assert re.search(r"closed form at r = 0\.5.*use solver 'exact'", done.stderr)


def test_a_range_goes_up_by_a_step_and_any_other_is_refused(tmp_path: Path) -> None:
    grid = ("sweep", "--r", "0.5", "--beta", "0.4", "--law", "coulomb+compliance", "-o", str(tmp_path / "map.csv"))
    run(*grid, "--parameter", "stiffness_ratio=1:3:1", "--plot", str(tmp_path / "map.svg"), status=0)
    assert [row["stiffness_ratio"] for row in read_rows(tmp_path / "map.csv")] == [1.0, 2.0, 3.0]
    wrong = "0:1:x10 1:inf:1 1:10:NaN 5:1:1 a 1:2:0 1:2 0:1:1e-9"
    for said in (*wrong.split(), f"1:9.{'9' * 28}e999999:1"):
        refused = run(*grid, "--force", "--parameter", f"stiffness_ratio={said}")
        assert (refused.exit_code, "stiffness_ratio: expected" in refused.stderr) == (2, True), said


GRID = Grid((0.3, 0.5, 0.7, 1.0, 1.3), (0.2, 0.5, 0.8), (1.0, 1.2), (0.02, 0.05))


def made(path: Path, grid: Grid = GRID, **options: object) -> bytes:
    for _ in make_map(grid, path, **options):  # type: ignore[arg-type]  # options by name
        pass
    return path.read_bytes()


def test_the_file_holds_what_the_simulator_says_described_and_with_units(tmp_path: Path) -> None:
    path = tmp_path / "map.h5"
    made(path, workers=1)
    states = sweep(GRID.r, GRID.beta, GRID.mu, GRID.zeta)
    with h5py.File(path) as file:
        assert [axis[0].name for axis in file["energy_per_cycle"].dims] == ["/r", "/beta", "/mu", "/zeta"]
        for key, values in states.datasets().items():
            found = file[key][...]
            assert found.shape == (5, 3, 2, 2)
            assert np.array_equal(found.astype(values.dtype), values, equal_nan=values.dtype.kind == "f"), key
        assert file.attrs["wall"] == "fixed"
        assert {"r", "energy_per_cycle", "outcome"} <= set(file)
        for name in file:
            assert file[name].attrs["long_name"] == str(getattr(STEADY_STATES.column(name), "sentence", ""))
            assert file[name].attrs["units"] == (
                "" if name in ("wall", "solver", "outcome", "regime", "warnings") else "1"
            )


def test_a_point_that_cannot_be_solved_costs_only_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solve = sweep_points

    def moody(points: np.ndarray, *arguments: object, **options: object) -> np.ndarray:
        if np.any(points[:, 0] == 0.7):
            raise SimulationError("chatter")
        return solve(points, *arguments, **options)  # type: ignore[arg-type]  # handed through

    monkeypatch.setattr(maps, "sweep_points", moody)
    grid = Grid((0.5, 0.7, 1.3), (0.4,))
    steps = make_map(grid, tmp_path / "map.csv", workers=1)
    assert [sentence for step in steps for sentence in step.failures()] == [
        "r = 0.7, beta = 0.4, mu = 1, zeta = 0 could not be solved: `frictionlab simulate` says why"
    ]
    rows = read_rows(tmp_path / "map.csv")
    assert [row["outcome"] for row in rows] == ["periodic", "failed", "periodic"]
    assert rows[1]["energy_per_cycle"] is None


def test_a_map_goes_over_any_parameter_of_any_law(tmp_path: Path) -> None:
    grid = Grid((0.5, 0.7), (0.4,), law="coulomb+place", parameters=(("gradient", (0.0, 0.05, 0.1)),))
    for name in ("map.h5", "map.csv", "map.jsonl"):
        made(tmp_path / name, grid, workers=1)
    with h5py.File(tmp_path / "map.h5") as file:
        assert file["energy_per_cycle"].shape == (2, 1, 1, 1, 3)
        assert file["energy_per_cycle"].dims[4][0].name == "/gradient"
        axis = file["gradient"].attrs
        assert (axis["units"], axis["long_name"]) == ("1", law_of(grid.law).parameters[1].words)
        assert file.attrs["law"] == "coulomb+place"
    rows = read_rows(tmp_path / "map.csv")
    assert [row["gradient"] for row in rows] == [0.0, 0.05, 0.1] * 2
    assert {row["law"] for row in rows} == {"coulomb+place"}
    axes = {"law": "coulomb+place", "parameters": {"gradient": [0.0, 0.05, 0.1]}}
    assert rows == read_rows(tmp_path / "map.jsonl") == list(sweep([0.5, 0.7], [0.4], **axes).rows())  # type: ignore[arg-type]  # options by name
    with pytest.raises(SimulationError, match="'gradient' is none of its parameters"):
        Grid((0.5,), (0.4,), parameters=(("gradient", (0.1,)),))


def test_a_map_that_cannot_be_is_refused_before_anything_is_solved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "map.h5"
    path.write_bytes(b"mine")
    with pytest.raises(OutputError, match="is not a file of this kind"):
        made(path)
    assert path.read_bytes() == b"mine"
    monkeypatch.setattr(maps, "MOST_POINTS", 3)
    with pytest.raises(UsageError, match="expected at most 3 points; got 60: give fewer values, or several maps"):
        made(path, force=True)
