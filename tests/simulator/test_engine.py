"""Plain or compiled, in one chunk or many, in one process or two: the same bits."""

import io
import logging
import os
import subprocess
import sys
import typing
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from frictionlab.cli import announce_compiling
from frictionlab.errors import UsageError
from frictionlab.simulator import engine, steady_state, sweep
from frictionlab.simulator.elastic import engine as elastic
from frictionlab.simulator.elastic import events
from frictionlab.simulator.elastic import layout as elastic_layout
from frictionlab.simulator.kernel import layout, motion
from frictionlab.simulator.problem import COSINE, Base, Wall
from frictionlab.simulator.record import layout as record_layout
from frictionlab.simulator.record.respond import MODULES as RECORD_MODULES
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


def test_a_name_that_two_modules_of_the_kernel_use_stays_each_ones_own() -> None:
    taken = engine.borrowed(events)
    assert "nearest" not in taken  # nor does the rigid kernel's function of that name replace it
    assert taken["local_force"][0] == "frictionlab.simulator.kernel.motion"
    assert borrowed_names(events) <= {name for module in elastic.COMPILED for name in engine.functions_of(module)}


def borrowed_names(module: ModuleType) -> set[str]:
    return {name for _, name in engine.borrowed(module).values()}


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
def test_every_rigid_law_has_the_same_bits_in_a_map_and_alone(wall: Wall, monkeypatch: pytest.MonkeyPatch) -> None:
    family = Family("coulomb+place+breakaway", NAMES, wall, Base((1.0, 0.1)))
    fast = sweep_points(LAWS, family, fast=True)
    monkeypatch.setattr(engine, "is_worth_it", lambda _: False)
    np.testing.assert_array_equal(sweep_points(LAWS, family, fast=False), fast)
    for point, row in zip(LAWS, fast, strict=True):
        np.testing.assert_array_equal(to_numbers(steady_state(family.problem(point)))[1:9], row[1:9])


@pytest.mark.timeout(300)  # compiles once on a new machine
@pytest.mark.parametrize(("wall", "base"), [("fixed", COSINE), ("base", Base((1.0, 0.1, 0.05), (0.0, 0.02)))])
def test_plain_and_compiled_kernels_give_the_same_bits(wall: Wall, base: Base, monkeypatch: pytest.MonkeyPatch) -> None:
    fast = sweep_points(POINTS, Family(wall=wall, base=base), fast=True)
    monkeypatch.setattr(engine, "is_worth_it", lambda _: False)
    slow = sweep_points(POINTS, Family(wall=wall, base=base), fast=False)
    np.testing.assert_array_equal(slow, fast)


def test_chunks_do_not_matter() -> None:
    whole = sweep_points(POINTS, Family(), fast=False)
    parts = [sweep_points(POINTS[i : i + 1], Family(), fast=False) for i in range(len(POINTS))]
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
    code = "import sys, frictionlab.simulator as s; s.steady_state(s.Problem(0.5, 0.4)); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"numba", "scipy", "pandas", "matplotlib", "h5py"} & set(loaded)


def test_machine_code_is_kept_outside_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    folder = engine.machine_code_folder()
    assert folder.is_relative_to(tmp_path)
    assert Path(str(engine.__file__)).parent not in folder.parents


def test_where_nothing_can_be_kept_the_kernel_still_compiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "a file, not a folder"
    blocked.write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(blocked))
    code = (
        "from frictionlab.simulator import Problem, engine; "
        "print(engine.set_up(engine.compiled(), Problem(0.5, 0.4))[0].plain.omega)"
    )
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, capture_output=True, text=True, env=dict(os.environ), check=False)
    assert done.stdout.strip() == "2.0", done.stderr


def test_what_only_compiled_functions_call_is_not_offered_to_python() -> None:
    fast = engine.compiled()
    assert set(vars(fast.kernel)) == set(layout.ENTRIES)
    assert {name for _, name in fast.functions} > set(layout.ENTRIES)


def holds_no_buffer(kind: Any) -> bool:
    """Tell whether an annotation means numbers only, or tuples of such."""
    parts = typing.get_args(kind) or tuple(getattr(kind, "__annotations__", {}).values())
    numbers = {float, int, bool, complex, type(None), ...}
    return kind in numbers or (bool(parts) and all(holds_no_buffer(part) for part in parts))


@pytest.mark.parametrize(
    ("names", "modules"),
    [
        (layout, engine.MODULES),
        (elastic_layout, elastic.MODULES),
        (record_layout, RECORD_MODULES),
    ],
    ids=["rigid", "elastic", "record"],
)
def test_a_buffer_that_nobody_counts_is_not_handed_back(names: ModuleType, modules: tuple[ModuleType, ...]) -> None:
    lean = [module for module in modules if module.__name__.rpartition(".")[2] not in names.OWNERS]
    made = [getattr(module, name) for module in lean for name in engine.functions_of(module)]
    assert not [f.__name__ for f in made if not holds_no_buffer(typing.get_type_hints(f)["return"])]


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
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    announce_compiling(["simulate", *words])
    engine.compile_modules(layout, (motion,))
    assert screen.getvalue() == "compiling the simulator once for this machine, about half a minute\n" * told
