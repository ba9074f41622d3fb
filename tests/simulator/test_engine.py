"""One compiled flow for every exact law: the same bits in chunks and processes; plain Python as its twin."""

import io
import json
import logging
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from frictionlab.cli import announce_compiling
from frictionlab.errors import UsageError
from frictionlab.simulator import Base, Contact, Problem, Structure, compiled, simulate, steady_state, sweep
from frictionlab.simulator.exact import phase
from frictionlab.simulator.exact.phase import SIDE, SLOTS
from frictionlab.simulator.exact.solve import Flow
from frictionlab.simulator.numeric.integrated import Integrated
from frictionlab.simulator.problem import Wall
from frictionlab.simulator.state import to_numbers
from frictionlab.simulator.sweep import Grid, sweep_points
from tests.desk import told_by
from tests.simulator.twin import LAWS as LAWS_BY_STEPS
from tests.simulator.twin import problem_of, rubs

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
    more = tuple((name, (1.0,)) for name in NAMES)
    grid = Grid((0.5,), (0.4,), wall=wall, law="coulomb+place+breakaway", parameters=more, base=Base((1.0, 0.1)))
    for of, points in ((grid, LAWS), (Grid((0.5,), (0.4,), wall=wall), POINTS)):
        for point, row in zip(points, sweep_points(points, of), strict=True):
            np.testing.assert_array_equal(to_numbers(steady_state(of.problem(point)))[1:9], row[1:9])


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


def test_machine_code_is_kept_outside_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    folder = compiled._machine_code_folder()
    assert folder.is_relative_to(tmp_path)
    assert Path(str(compiled.__file__)).parent not in folder.parents


def test_where_nothing_can_be_kept_the_kernel_still_compiles(tmp_path: Path) -> None:
    blocked = tmp_path / "a file, not a folder"
    blocked.write_text("")
    code = (
        "from frictionlab.simulator.compiled import OPTIONS, compiled; "
        "print(OPTIONS['cache'], compiled(lambda x: 2.0 * x)(1.0))"
    )
    assert told_by(code, NUMBA_CACHE_DIR=str(blocked)).strip() == "False 2.0"


def test_what_is_raised_where_compiled_code_calls_python_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Ctrl-C while it was in Python was ignored, and the process crashed."""
    monkeypatch.setattr(phase, "_eigen", lambda *_: int("interrupted"))
    with pytest.raises(ValueError, match="interrupted"):
        steady_state(Structure.of_storeys(0.5, [1.0, 1.0], [1.0, 1.0], [0.02, 0.02]))


@pytest.fixture
def quiet_again() -> Iterator[None]:
    yield
    logger = logging.getLogger("frictionlab.simulator")
    logger.handlers[:] = []
    logger.setLevel(logging.NOTSET)


@pytest.mark.usefixtures("quiet_again")
@pytest.mark.parametrize(("words", "told"), [([], 1), (["--json"], 0), (["-q"], 0)])
def test_a_compiler_that_begins_is_announced_whether_or_not_stderr_is_a_terminal(
    words: list[str], told: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    screen = io.StringIO()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setattr(compiled, "FOLDER", tmp_path / "simulator-1")
    announce_compiling(["simulate", *words])
    compiled.announce("kernel")
    assert screen.getvalue() == f"compiling the simulator once, about half a minute, into {tmp_path}\n" * told


@pytest.mark.parametrize("module", ["exact.solve", "numeric.radau"])
def test_each_flow_that_is_to_be_compiled_says_so(module: str, tmp_path: Path) -> None:
    code = (
        "import importlib, logging, sys; logging.basicConfig(level=logging.INFO, stream=sys.stdout); "
        "from frictionlab.simulator import compiled; compiled._kept = lambda _, function: function; "
        "compiled.address_of = lambda *_: 0; "
        f"importlib.import_module('frictionlab.simulator.{module}')"
    )
    told = told_by(code, NUMBA_CACHE_DIR=str(tmp_path))
    assert told.count("compiling the simulator once") == 1


IWAN = {"stiffness_ratio": 20.0, "sliders": 3, "chi": -0.3}
NUMBERS = ("energy_per_cycle", "contact_energy_per_cycle", "floquet_multiplier")


def frame(*contacts: Contact) -> Structure:
    return Structure.of_storeys(0.6, [1.0, 0.7], [1.0, 1.3], [0.02, 0.01], list(contacts))


TWO = frame(rubs("coulomb+place", 2, "base", beta=0.2, gradient=0.1), rubs("coulomb", 1, 2, beta=0.2))
ONE = (
    Problem(0.5, 0.4, law="coulomb+place", parameters={"gradient": 0.1}),
    Problem(0.6, 0.3, law="coulomb+iwan", parameters=IWAN, base=Base((1.0, 0.1))),
)


def numbers() -> list[list[float]]:
    """What three problems say: rigid with a gradient, Iwan's sliders, two masses with two contacts."""
    one, two = [steady_state(problem) for problem in ONE], steady_state(TWO)
    found = [[*(getattr(state, name) for name in NUMBERS), state.response_amplitude] for state in one]
    return [*found, [*(getattr(two, name) for name in NUMBERS), *two.response_amplitudes]]


def integrated() -> list[list[float]]:
    """State and slopes after a part of a cycle from rest, under each integrated law."""
    found = []
    for law, values in LAWS_BY_STEPS.items():
        flow = Integrated(Problem(0.4, 0.5, law=law, parameters=values), 1e-6)
        reached, slopes, _ = flow.carried(flow.rest(), 0.0, 1.0, derived=True)
        found.append([*reached.tolist(), *slopes.ravel().tolist()])
    return found


def test_plain_python_is_the_twin_of_the_compiled_flows() -> None:
    code = "import json; from tests.simulator import test_engine as t; print(json.dumps([t.numbers(), t.integrated()]))"
    exact, stepped = json.loads(told_by(code, NUMBA_DISABLE_JIT="1"))
    for fast, plain in zip(numbers(), exact, strict=True):
        np.testing.assert_allclose(fast, plain, rtol=1e-13, atol=1e-13)
    for fast, plain in zip(integrated(), stepped, strict=True):
        np.testing.assert_allclose(fast, plain, rtol=1e-9, atol=1e-9)


BREAKAWAY = {"static_ratio_up": 1.2, "static_ratio_down": 1.1}
MOVED = {
    "gradient": ONE[0],
    "iwan": ONE[1],
    "break-away": problem_of(0.5, 0.4, "base", contact_damping_ratio=0.02, **BREAKAWAY),
    "iwan, all": problem_of(0.6, 0.3, gradient=0.1, **IWAN, **BREAKAWAY),
    "two masses": TWO,
    "two masses, iwan": frame(rubs("coulomb+iwan", 1, 2, beta=0.3, **IWAN), rubs("coulomb", 2, "wall", beta=0.1)),
}


@pytest.mark.parametrize("what", MOVED.values(), ids=MOVED)
def test_the_derivative_of_a_run_is_its_difference_quotient(what: Problem | Structure) -> None:
    flow, h = Flow(what), 1e-6
    q, v, _ = np.split(flow.carried(flow.rest(), 0.0, 7.0)[0], (flow.masses, 2 * flow.masses))
    state = flow.rest_at(q, v, float(what.base.at(0.7)))  # relaxed: no slider is about to give way
    exact = flow.carried(state, 0.7, 5.0, derived=True)[1]
    for slope, step in zip(exact.T, h * np.eye(flow.size), strict=True):
        ends = [flow.carried(state + side * step, 0.7, 5.0)[0] for side in (-1.0, 1.0)]
        np.testing.assert_allclose(slope, (ends[1] - ends[0]) / (2 * h), atol=1e-5)


def test_phases_that_were_forgotten_are_made_again() -> None:
    many = {"stiffness_ratio": 20.0, "sliders": 90, "chi": -0.3}
    rich = frame(rubs("coulomb+iwan", 1, "wall", beta=0.4, **many), rubs("coulomb+iwan", 2, 1, beta=0.3, **many))
    run = simulate(rich, cycles=2)
    assert len(np.unique(run.rows[:, -4:-2], axis=0)) > SLOTS  # stiffnesses of the contacts
    ends = run.flow.evaluate(run.rows, np.arange(len(run.rows) - 1), run.rows[:-1, 1].copy())[0]
    np.testing.assert_allclose(ends, run.rows[1:, SIDE + 2 : SIDE + 4], atol=1e-12)
