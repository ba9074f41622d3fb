"""In one chunk or many, in one process or two: the same bits; and machine code is kept where it may be."""

import io
import logging
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from frictionlab.cli import announce_compiling
from frictionlab.errors import UsageError
from frictionlab.simulator import compiled, steady_state, sweep
from frictionlab.simulator.problem import Base, Wall
from frictionlab.simulator.state import to_numbers
from frictionlab.simulator.sweep import Family, sweep_points

POINTS = np.array(
    [
        (0.5, 0.4, 1.0, 0.0),
        (0.7, 0.5, 1.0, 0.0),
        (0.03, 0.3, 1.0, 0.0),
        (1.0, 0.3, 1.0, 0.0),
        (1.0 + 1e-12, 0.3, 1.0, 0.0),
        (0.4, 0.3, 1.7, 0.0),
        (0.4, 0.3, 1.0, 0.05),
        (0.4, 0.3, 1.0, 1.0),
        (2.0, 0.9, 1.2, 7.0),
        (0.6, 1.1, 1.0, 0.0),
    ]
)


LAWS = np.array(
    [
        (0.5, 0.4, 1.0, 0.0, 0.1, 1.0, 1.0, 0.0),
        (0.7, 0.5, 1.0, 0.02, -0.06, 1.0, 1.0, 0.03),
        (0.45, 0.5, 1.0, 0.02, 0.08, 1.3, 1.1, 0.03),
        (0.7, 0.4, 1.0, 0.0, 3.0, 1.0, 1.0, 0.0),
        (0.6, 0.3, 1.0, 0.0, 0.0, 1.2, 1.0, 1.5),
    ]
)
NAMES = ("gradient", "static_ratio_up", "static_ratio_down", "frame_damping_ratio")


@pytest.mark.timeout(300)
@pytest.mark.parametrize("wall", ["fixed", "base"])
def test_every_rigid_law_has_the_same_bits_in_a_map_and_alone(wall: Wall) -> None:
    family = Family("coulomb+place+breakaway", NAMES, wall, Base((1.0, 0.1)))
    for point, row in zip(LAWS, sweep_points(LAWS, family), strict=True):
        np.testing.assert_array_equal(to_numbers(steady_state(family.problem(point)))[1:9], row[1:9])


def test_chunks_do_not_matter() -> None:
    whole = sweep_points(POINTS, Family())
    parts = [sweep_points(POINTS[i : i + 1], Family()) for i in range(len(POINTS))]
    np.testing.assert_array_equal(whole, np.vstack(parts))


def test_a_map_has_its_axes_in_order() -> None:
    states = sweep([0.3, 0.5], [0.2, 0.4, 0.6], zeta=[0.0, 0.1])
    rows = list(states.rows())
    assert states.shape == (2, 3, 1, 2)
    assert [(row["r"], row["beta"], row["zeta"]) for row in rows[:3]] == [
        (0.3, 0.2, 0.0),
        (0.3, 0.2, 0.1),
        (0.3, 0.4, 0.0),
    ]
    energy = states.datasets()["energy_per_cycle"]
    assert energy[1, 1, 0, 0] == pytest.approx(2.1260422664, abs=1e-10)
    assert rows[8]["energy_per_cycle"] == energy[1, 1, 0, 0]


def test_an_empty_axis_is_refused() -> None:
    with pytest.raises(UsageError, match="beta; expected at least one value"):
        sweep([0.5], [])


def test_importing_the_simulator_loads_neither_compiler_nor_scipy() -> None:
    code = "import sys, frictionlab.simulator as s; s.Problem(0.5, 0.4); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"numba", "scipy", "pandas", "matplotlib", "h5py"} & set(loaded)


def test_machine_code_is_kept_outside_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    folder = compiled._machine_code_folder()
    assert folder.is_relative_to(tmp_path)
    assert Path(str(compiled.__file__)).parent not in folder.parents


def test_where_nothing_can_be_kept_the_kernel_still_compiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "a file, not a folder"
    blocked.write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(blocked))
    code = (
        "from frictionlab.simulator.compiled import OPTIONS, compiled; "
        "print(OPTIONS['cache'], compiled(lambda x: 2.0 * x)(1.0))"
    )
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, capture_output=True, text=True, env=dict(os.environ), check=False)
    assert done.stdout.strip() == "False 2.0", done.stderr


@pytest.fixture
def quiet_again() -> Iterator[None]:
    yield
    logger = logging.getLogger("frictionlab.simulator")
    logger.handlers[:] = []
    logger.setLevel(logging.NOTSET)


@pytest.mark.usefixtures("quiet_again")
@pytest.mark.parametrize(("words", "terminal", "told"), [([], True, 1), (["--json"], True, 0), ([], False, 0)])
def test_a_compiler_that_begins_is_announced_on_a_terminal(
    words: list[str], terminal: bool, told: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    screen = io.StringIO()
    monkeypatch.setattr(screen, "isatty", lambda: terminal)
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setattr(compiled, "FOLDER", tmp_path)
    announce_compiling(["simulate", *words])
    compiled.announce("kernel")
    assert screen.getvalue() == "compiling the simulator once for this machine, about half a minute\n" * told


@pytest.mark.parametrize("module", ["exact.solve", "numeric.radau"])
def test_each_flow_that_is_to_be_compiled_says_so(module: str, tmp_path: Path) -> None:
    code = (
        "import importlib, logging, sys; logging.basicConfig(level=logging.INFO, stream=sys.stdout); "
        "from frictionlab.simulator import compiled; compiled._kept = lambda _, function: function; "
        "compiled.address_of = lambda *_: 0; "
        f"importlib.import_module('frictionlab.simulator.{module}')"
    )
    run = [sys.executable, "-c", code]
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    told = subprocess.run(run, capture_output=True, text=True, env=env, check=True).stdout
    assert told.count("compiling the simulator once for this machine") == 1
