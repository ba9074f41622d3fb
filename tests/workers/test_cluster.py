"""A Dask cluster over TCP gives the same results, also when one of its workers is killed."""

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from frictionlab.errors import ClusterError, UsageError
from frictionlab.workers import Lost, run_each, sites
from tests.workers import jobs

CASES = range(200)
TRUTH = [jobs.wave(case) for case in CASES]
ROOT = Path(__file__).parents[2]


def start(folder: Path, *arguments: str) -> subprocess.Popen[bytes]:
    """Start one part of a cluster as the README does, where the tests' jobs can be imported."""
    (folder / "dask.yaml").write_text(
        "distributed: {scheduler: {allowed-failures: 0}, admin: {low-level-log-length: 0}}"
    )
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "DASK_CONFIG": str(folder)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def address_in(file: Path) -> str:
    for _ in range(600):
        if file.exists() and (text := file.read_text()).strip():
            return str(json.loads(text)["address"])
        time.sleep(0.05)
    return pytest.fail("the scheduler did not start")


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    pytest.importorskip("distributed", reason="the extra frictionlab[cluster] is not installed")
    folder = tmp_path_factory.mktemp("cluster")
    at_home = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    parts = [start(folder, "scheduler", *at_home, "--scheduler-file", "address.json")]
    address = address_in(folder / "address.json")
    parts.append(start(folder, "worker", address, "--nworkers", "2", "--nthreads", "1", "--no-dashboard"))
    yield address
    for part in reversed(parts):
        part.terminate()
        part.wait(timeout=30)


def test_results_are_those_of_one_process(scheduler: str) -> None:
    assert list(run_each(jobs.slow_wave, CASES, scheduler=scheduler, seconds_per_batch=0.05)) == TRUTH


def test_a_killed_worker_costs_no_result(scheduler: str, tmp_path: Path) -> None:
    job = partial(jobs.wave_unless_shot, shot=150, mark=tmp_path / "shot")
    assert list(run_each(job, CASES, scheduler=scheduler, seconds_per_batch=0.05)) == TRUTH
    assert (tmp_path / "shot").exists()


def test_a_case_that_always_kills_is_reported_alone(scheduler: str) -> None:
    results = list(run_each(partial(jobs.wave_or_death, deadly=2), range(5), scheduler=scheduler))
    assert isinstance(results[2], Lost)
    assert results[:2] + results[3:] == TRUTH[:2] + TRUTH[3:5]


def test_an_error_of_the_job_is_raised_here(scheduler: str) -> None:
    with pytest.raises(ArithmeticError, match="case 3"):
        list(run_each(partial(jobs.wave_or_error, wrong=3), CASES, scheduler=scheduler))


def test_workers_of_another_version_are_refused(scheduler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.importorskip("distributed").Client(scheduler, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=30)  # those that a test before has killed are back
    monkeypatch.setattr(sites, "__version__", "0.0")
    with pytest.raises(
        ClusterError, match=r"([12]) of \1 workers lack this version: expected frictionlab 0\.0, as here; got"
    ):
        next(run_each(jobs.wave, CASES, scheduler=scheduler))


def test_a_cluster_without_workers_and_one_that_dies_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="the extra frictionlab[cluster] is not installed")
    monkeypatch.setattr(sites, "EMPTY_S", 0.5)
    monkeypatch.setattr(sites, "ANSWER_S", 5.0)
    part = start(tmp_path, "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", "address.json")
    address = address_in(tmp_path / "address.json")
    with pytest.raises(ClusterError, match="has had no workers for"):
        next(run_each(jobs.wave, CASES, scheduler=address))
    site = sites.Cluster(address)
    future = site.submit(jobs.wave, 1)
    part.kill()
    part.wait(timeout=30)
    with pytest.raises(ClusterError, match="the scheduler went away"):
        check_until(site, 20.0)
    site.stop()
    assert future.done()


def check_until(site: sites.Cluster, seconds: float) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        site.look()
        time.sleep(0.05)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense", "tpc://127.0.0.1:8786"])
def test_a_wrong_address_is_answered_soon(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="the extra frictionlab[cluster] is not installed")
    monkeypatch.setattr(sites, "ANSWER_S", 0.5)
    with pytest.raises(ClusterError, match=f"{address}: no Dask scheduler answered within .*; do: start one with"):
        next(run_each(jobs.wave, CASES, scheduler=address))


def test_a_port_where_something_else_listens_is_answered_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="the extra frictionlab[cluster] is not installed")
    monkeypatch.setattr(sites, "ANSWER_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(ClusterError, match="accepts the connection and does not answer"):
            next(run_each(jobs.wave, CASES, scheduler=address))


def test_without_dask_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"pip install 'frictionlab\[cluster\]'"):
        next(run_each(jobs.wave, CASES, scheduler="tcp://127.0.0.1:8786"))
