"""A map on file: the same bytes whoever solved it."""

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from frictionlab import maps
from frictionlab.errors import ClusterError, OutputError, SimulationError, UsageError
from frictionlab.maps import Grid, make_map
from frictionlab.schema import STEADY_STATES
from frictionlab.simulator import sweep
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.sweep import sweep_points
from frictionlab.tables import read_rows

GRID = Grid((0.3, 0.5, 0.7, 1.0, 1.3), (0.2, 0.5, 0.8), (1.0, 1.2), (0.02, 0.05))
COMMAND = Path(sys.executable).with_name("frictionlab")


def made(path: Path, grid: Grid = GRID, **options: object) -> bytes:
    for _ in make_map(grid, path, **options):  # type: ignore[arg-type]  # options by name
        pass
    return path.read_bytes()


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The map as one process writes it without a stop."""
    return made(tmp_path_factory.mktemp("truth") / "map.h5", workers=1)


def test_the_file_holds_what_the_simulator_says_described_and_with_units(tmp_path: Path, truth: bytes) -> None:
    path = tmp_path / "map.h5"
    path.write_bytes(truth)
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


def test_two_workers_write_the_same_bytes(tmp_path: Path, truth: bytes) -> None:
    assert made(tmp_path / "map.h5", workers=2) == truth


@pytest.mark.parametrize("suffix", [".csv", ".jsonl"])
def test_tables_hold_the_same_rows(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"map{suffix}"
    made(path, workers=1)
    assert read_rows(path) == list(sweep(GRID.r, GRID.beta, GRID.mu, GRID.zeta).rows())
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_point_that_cannot_be_solved_costs_only_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solve = sweep_points

    def moody(points: np.ndarray, *arguments: object, **options: object) -> np.ndarray:
        if np.any(points[:, 0] == 0.7):
            raise SimulationError("chatter")
        return solve(points, *arguments, **options)  # type: ignore[arg-type]  # handed through

    monkeypatch.setattr(maps, "sweep_points", moody)
    grid = Grid((0.5, 0.7, 1.3), (0.4,))
    tally = maps.Tally(grid)
    steps = make_map(grid, tmp_path / "map.csv", workers=1)
    assert [sentence for step in steps for sentence in tally.add(step)] == [
        "r = 0.7, beta = 0.4, mu = 1, zeta = 0 could not be solved: `frictionlab simulate` says why"
    ]
    rows = read_rows(tmp_path / "map.csv")
    assert [row["outcome"] for row in rows] == ["periodic", "failed", "periodic"]
    assert rows[1]["energy_per_cycle"] is None


def test_a_map_goes_over_any_parameter_of_any_law(tmp_path: Path) -> None:
    grid = Grid((0.5, 0.7), (0.4,), law="coulomb+place", parameters=(("gradient", (0.0, 0.05, 0.1)),))
    for name in ("map.h5", "map.csv"):
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
    assert rows == list(sweep([0.5, 0.7], [0.4], **axes).rows())  # type: ignore[arg-type]  # options by name
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


def test_a_worker_with_another_build_of_the_simulator_refuses() -> None:
    """Two builds of one version number would mix their rows."""
    with pytest.raises(ClusterError, match=r"a worker has another build of the simulator \([0-9a-f]{16}\)"):
        maps.solve(range(1), GRID, "ours")
