"""One worker or several, killed or not, or a Dask cluster over TCP: the same results in the same order."""

import json
import multiprocessing
import os
import platform
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab import workers as run
from frictionlab.errors import ClusterError, UsageError
from frictionlab.workers import Lost, Pace, run_batches, run_each, sites
from tests.desk import ROOT, until
from tests.workers import jobs

CASES = range(300)
TRUTH = [jobs.wave(case) for case in CASES]


@pytest.mark.parametrize(("workers", "seconds"), [(None, 0.25), (1, 0.0), (2, 0.0), (3, 0.25)])
def test_results_do_not_depend_on_workers_or_batches(workers: int | None, seconds: float) -> None:
    cases = range(40)
    assert not list(run_each(jobs.wave, [], workers=workers))
    assert list(run_each(jobs.wave, cases, workers=workers, seconds_per_batch=seconds)) == TRUTH[:40]


def test_batches_of_arrays_join_to_the_whole() -> None:
    batches = list(run_batches(jobs.waves, CASES, workers=2))
    assert np.array_equal(np.concatenate([np.asarray(batch) for batch in batches]), jobs.waves(CASES))


def test_long_work_is_handed_to_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "WORTH_S", 0.2)
    monkeypatch.setattr(run, "cores", lambda: 2)
    numbers = set(run_each(jobs.who, range(20)))
    assert os.getpid() in numbers
    assert len(numbers) == 3


@pytest.fixture(params=["two processes", "a Dask cluster"])
def site(request: pytest.FixtureRequest) -> dict[str, Any]:
    """Where work is done, as options say it."""
    if request.param == "two processes":
        return {"workers": 2}
    return {"scheduler": request.getfixturevalue("scheduler")}


def test_a_killed_worker_costs_no_result(site: dict[str, Any], tmp_path: Path) -> None:
    job = partial(jobs.wave_unless_shot, shot=150, mark=tmp_path / "shot")
    assert list(run_each(job, CASES, **site, seconds_per_batch=0.05)) == TRUTH
    assert (tmp_path / "shot").exists()


def test_a_case_that_always_kills_is_reported_alone(site: dict[str, Any]) -> None:
    job = partial(jobs.wave_or_death, deadly=5)
    results = list(run_each(job, range(12), **site))
    lost = results[5]
    assert isinstance(lost, Lost)
    assert lost.reason.startswith("its worker died each time, 3 times: out of memory, a crash in a library, or ")
    assert results[:5] + results[6:] == TRUTH[:5] + TRUTH[6:12]


@given(total=st.integers(2, 10**9), cost=st.floats(1e-9, 100.0), workers=st.integers(1, 999))
def test_a_batch_is_never_empty_nor_too_long(total: int, cost: float, workers: int) -> None:
    pace = Pace(total, 0.25)
    while pace.taken < min(total, 10**6) and cost < 1:
        batch = pace.take(workers=workers)
        size = len(batch)
        assert batch.stop == pace.taken <= total
        assert size == 1 or size * cost <= 0.25 * (1 + 1e-9)
        pace.note(range(1, 1 + size), cost * size)
        if batch.start > 12:
            break


def test_an_error_of_the_job_comes_at_its_place(site: dict[str, Any]) -> None:
    for where in (site, {"workers": 1}):
        results = run_each(partial(jobs.wave_or_error, wrong=3), CASES, **where, seconds_per_batch=0.0)
        assert [next(results) for _ in range(3)] == TRUTH[:3]
        with pytest.raises(ArithmeticError, match="case 3"):
            next(results)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_job_must_give_one_result_per_case(workers: int) -> None:
    with pytest.raises(UsageError, match="one result per case, 1; got 0"):
        list(run_batches(jobs.one_too_few, CASES, workers=workers))


def test_an_iterator_left_early_leaves_no_process() -> None:
    before = set(multiprocessing.active_children())
    results = run_each(jobs.slow_wave, CASES, workers=2)
    next(results)
    results.close()  # type: ignore[attr-defined]  # it is a generator
    assert set(multiprocessing.active_children()) == before


def test_a_worker_is_told_to_use_one_thread() -> None:
    assert set(run_each(jobs.threads, range(2), workers=2)) == {"1"}


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only GNU's C library can be told")
def test_a_worker_keeps_the_memory_it_has_freed() -> None:
    """Fetched anew for each array it would be 49,000 pages."""
    assert max(float(str(n)) for n in run_each(jobs.pages_fetched, range(4), workers=2)) < 1500


def test_workers_here_and_a_scheduler_exclude_each_other() -> None:
    with pytest.raises(UsageError, match="got both"):
        list(run_each(jobs.wave, CASES, workers=2, scheduler="tcp://h:1"))


SCRIPT = """
import functools, pathlib, signal, sys
from frictionlab.workers import run_each
from tests.workers import jobs
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # tests in a shell's background begin with it ignored
    job = functools.partial(jobs.note_and_wait, folder=pathlib.Path(sys.argv[1]))
    for case in run_each(job, range(8), workers=2, seconds_per_batch=0.0):
        print(case, flush=True)
"""


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT])
def test_workers_leave_with_their_master(tmp_path: Path, end: signal.Signals) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    notes = tmp_path / "notes"
    notes.mkdir()
    master = subprocess.Popen(
        [sys.executable, script, notes],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert master.stdout is not None
    done = [master.stdout.readline().strip() for _ in range(4)]
    until(lambda: len(list(notes.iterdir())) == 2)  # one may have done all four before the other had started
    workers = [int(note.name) for note in notes.iterdir()]
    if end == signal.SIGINT:
        os.killpg(master.pid, end)  # as a terminal does: everybody hears it
    else:
        master.send_signal(end)
    _, errors = master.communicate(timeout=30)
    assert done == ["0", "1", "2", "3"]
    assert len(workers) == 2
    assert errors.count("Traceback") == int(end == signal.SIGINT)  # the master's own; the workers say nothing
    left = until(lambda: not any(Path(f"/proc/{number}").exists() for number in workers), 15.0)
    assert left, "workers outlived their master"


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
    text = until(lambda: file.exists() and file.read_text().strip())
    assert text, "the scheduler did not start"
    return str(json.loads(text)["address"])


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
        until(site.look, 20.0)
    site.stop()
    assert future.done()


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
