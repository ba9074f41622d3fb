"""What holds for all tests: property tests draw the same examples in every run; machine code is made once.

Linear algebra has one thread in each process of the tests and in those that they start: the matrices are small, and
threads that wait for each other cost more than they bring (560 against 474 s of CPU for all tests).
"""

import gc
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

sys.dont_write_bytecode = False  # or each process that tests start would compile the package and its tests again
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
gc.disable()  # until all is loaded: nothing of it is ever garbage, and looking for some takes a quarter of the loading
for library in ("OPENBLAS", "OMP", "MKL"):  # read once, when numpy is loaded
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from frictionlab.simulator.sweep import warm_up  # noqa: E402 - loads numpy
from tests.desk import ROOT, Run, invoke  # noqa: E402 - loads numpy

settings.register_profile("house", derandomize=True, deadline=None)  # on a busy machine any example may take long
settings.load_profile("house")

COMPILE = """
from frictionlab.simulator import Problem, Structure, simulate
from frictionlab.simulator.record import BaseRecord, respond
from frictionlab.simulator.sweep import sweep, warm_up
warm_up({0!r})
sweep([0.5, 0.7], [0.2, 0.4], law={0!r}, parameters={1!r})
simulate(Problem(0.5, 0.4), cycles=1).at(0.0)
respond(Problem(1.0, 0.2), BaseRecord([0.0, 0.2, 0.4], [0.0, 0.1, 0.3]))
simulate(Structure.of_storeys(0.5, [1.0, 1.0], [1.0, 1.0], [0.02, 0.02]), cycles=1)
"""
KERNELS = {"coulomb": {}, "coulomb+stribeck": {"static_ratio": [1.2], "stribeck_speed": [0.2]}}
"""A law of each flow, exact and integrated, with its parameters."""


def pytest_configure(config: pytest.Config) -> None:
    """Have the kernels compiled side by side before several processes test: each would compile all by itself."""
    if getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput"):
        gc.enable()  # the process that leads others loads no tests
        kept = getattr(config, "cache", None)  # when the sources were changed that were compiled last
        changed = max(path.stat().st_mtime for path in (ROOT / "frictionlab" / "simulator").rglob("*.py"))
        if kept is None or kept.get("frictionlab/kernels", 0.0) != changed:
            started = [subprocess.Popen([sys.executable, "-c", COMPILE.format(*law)]) for law in KERNELS.items()]
            if [process for process in started if process.wait()]:
                pytest.exit("the simulator's kernels could not be compiled ahead of the tests", returncode=3)
        if kept is not None:
            kept.set("frictionlab/kernels", changed)
    if hasattr(config, "workerinput"):  # what each process of the tests solves, it solves compiled
        for law in KERNELS:
            warm_up(law)


@pytest.fixture(autouse=True, scope="session")
def _a_sentence_is_one_line() -> Iterator[None]:
    """What a person sees at 80 columns is tested by itself."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "1000")
        yield


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs a command, in this process and in a folder of the test's own."""
    monkeypatch.chdir(tmp_path)
    return invoke


@pytest.fixture
def one_format(monkeypatch: pytest.MonkeyPatch) -> None:
    """A campaign's figures are written as its report needs them, not as pictures and pages beside."""
    monkeypatch.setattr("frictionlab.figures.plates.SUFFIXES", (".svg",))


FAST = """
    test_cli test_output test_scene test_tables test_uncertainty analysis/test_kernels campaign/test_ranking
    campaign/test_trials inference/test_evidence logs/test_dialects simulator/test_laws simulator/test_motion
    simulator/test_steady_state
"""


SLOW = """
    inference/test_ladder campaign/test_laws test_comparison test_make test_whole_record inference/test_fit
    planning/test_choice planning/test_plan inference/test_over_frequency workers/test_run
"""
"""Begun first, so that no long test is left for the end, when one process alone has work."""


def _name(path: Path) -> str:
    return path.relative_to(ROOT / "tests").with_suffix("").as_posix() if path.is_relative_to(ROOT / "tests") else ""


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Pass over the files that hold nothing fast, where nothing else is wanted: to collect them takes as long."""
    wanted = (
        config.getoption("markexpr") != "fast" or collection_path.is_dir() or _name(collection_path) in FAST.split()
    )
    return None if wanted else True


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put slow files first, mark the tests of those of `make test-fast`; from here on garbage is collected."""
    gc.freeze()
    gc.enable()
    slow, fast = SLOW.split(), FAST.split()
    items.sort(key=lambda item: slow.index(_name(item.path)) if _name(item.path) in slow else len(slow))
    for item in items:
        if _name(item.path) in fast:
            item.add_marker(pytest.mark.fast)
