"""What scale costs: points and recordings on one worker, two, and a two-worker Dask cluster over loopback TCP.

    python -m tests.benchmarks.scale map [POINTS]          a map over r, beta, mu, zeta (default 1,000,000 points)
    python -m tests.benchmarks.scale recordings [NUMBER]   90 s at 500 Hz each (default 1,000), analysed, with memory
    python -m tests.benchmarks.scale overhead              what handing the work out costs, on work of known length

Set OMP_NUM_THREADS=1, as the frictionlab command does. Ratios in one run; start-up (processes, imports) is measured by
itself and taken off. The rows of all runs are compared bit for bit; a difference ends the benchmark with an error.
"""

import hashlib
import importlib
import json
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from frictionlab.analysis.measure import measure
from frictionlab.hdf5 import read_recording
from frictionlab.hdf5.recordings import pieces_of
from frictionlab.maps import Grid, Solve
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem, simulate
from frictionlab.tables import json_line
from frictionlab.workers import Lost, run_batches, run_each

ROOT = Path(__file__).parents[2]


def say(text: str) -> None:
    """Print a line at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def nap(_: int) -> float:
    """Work of a known length that needs the core: 2 ms."""
    end = time.process_time() + 0.002
    while time.process_time() < end:
        pass
    return 0.0


def measured(path: Path) -> str:
    """What analyze does with a recording."""
    return json_line(measure(read_recording(path), Scene()).row())


@contextmanager
def cluster(folder: Path) -> Iterator[str]:
    """A scheduler and two workers, as the README starts them."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    where = folder / "scheduler.json"

    def start(*arguments: str) -> subprocess.Popen[bytes]:
        order = (sys.executable, "-m", "dask", *arguments)
        return subprocess.Popen(order, cwd=folder, env=environment, stderr=subprocess.DEVNULL)

    parts = [start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", where.name)]
    while not where.exists() or not where.read_text():
        time.sleep(0.1)
    address = str(json.loads(where.read_text())["address"])
    parts.append(start("worker", address, "--nworkers", "2", "--nthreads", "1", "--no-dashboard"))
    time.sleep(5.0)
    try:
        yield address
    finally:
        for part in reversed(parts):
            part.terminate()
            part.wait()


def timed(name: str, run: Callable[[], Iterator[bytes]]) -> tuple[float, float, str]:
    """Wall time from the second result on (the first carries start-up), the start-up, and a digest of all results."""
    begin, cpu = time.perf_counter(), used()
    digest = hashlib.sha256()
    first = 0.0
    for result in run():
        first = first or time.perf_counter() - begin
        digest.update(result)
    seconds = time.perf_counter() - begin - first
    spent = f"{used() - cpu:7.2f} s of CPU" if "Dask" not in name else " " * 16
    say(f"{name:34s} {seconds:8.2f} s  {spent}  start-up {first:5.2f} s  {digest.hexdigest()[:12]}")
    return seconds, first, digest.hexdigest()


def used() -> float:
    """Processor time of this process and of those children that have ended [s]."""
    return sum(os.times()[:4])


def compare(title: str, count: int, run: Callable[..., Iterator[bytes]]) -> None:
    """The same work in all ways; ratios and cost per case."""
    say(f"\n{title}: {count} cases; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    with tempfile.TemporaryDirectory() as folder, cluster(Path(folder)) as address:
        one = timed("one worker (this process)", partial(run, workers=1))
        two = timed("two workers (processes)", partial(run, workers=2))
        tcp = timed("two workers (Dask, loopback TCP)", partial(run, scheduler=address))
    say(f"cost per case on one worker: {one[0] / count * 1e6:.1f} us")
    say(f"two workers over one: {one[0] / two[0]:.2f}; Dask over two processes: {tcp[0] / two[0]:.3f} of the time")
    if len({one[2], two[2], tcp[2]}) != 1:
        sys.exit("the rows differ")


def grid_of(points: int) -> Grid:
    """About so many points: r from 0.1 to 2.6, beta to 0.98, mu 1 and 1.2, zeta 0.01 to 0.05."""
    side = max(round((points / 10) ** 0.5 / 2) * 2, 2)
    r = np.linspace(0.1, 2.6, side)
    beta = np.linspace(0.02, 0.98, points // (10 * side))
    return Grid(tuple(r), tuple(beta), (1.0, 1.2), (0.01, 0.02, 0.03, 0.04, 0.05))


def a_map(points: int = 1_000_000) -> None:
    """A map on all ways."""
    grid = grid_of(points)
    job = Solve(grid, fast=True)
    job(range(10))  # the machine code is there

    def run(**way: object) -> Iterator[bytes]:
        for batch in run_batches(job, range(len(grid)), **way):  # type: ignore[arg-type]  # options by name
            if batch.results is None:
                sys.exit(batch.lost)
            yield batch.results.tobytes()

    compare("map", len(grid), run)


def recordings(number: int = 1000) -> None:
    """Recordings on all ways, with the memory of this process and of its workers."""
    with tempfile.TemporaryDirectory() as folder:
        paths = made_recordings(Path(folder), number)
        memory: list[float] = []
        stop = threading.Event()
        threading.Thread(target=watch, args=(memory, stop), daemon=True).start()

        def run(**way: object) -> Iterator[bytes]:
            for row in run_each(measured, paths, **way):  # type: ignore[arg-type]  # options by name
                yield row.reason.encode() if isinstance(row, Lost) else row.encode()

        compare("recordings of 90 s at 500 Hz", number, run)
        stop.set()
        quarter = len(memory) // 4
        early, late = max(memory[quarter // 2 : quarter]), max(memory[-quarter:])
        say(f"largest process: {early:.0f} MB early, {late:.0f} MB late, {max(memory):.0f} MB at most")
    say(f"this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB at most")


def watch(memory: list[float], stop: threading.Event) -> None:
    """Note the resident memory of the largest process of this one's family, ten times a second [MB]."""
    psutil = importlib.import_module("psutil")  # comes with dask; it has no types
    me = psutil.Process()
    while not stop.wait(0.1):
        family = [me]
        try:
            family += me.children(recursive=True)
            memory.append(max(one.memory_info().rss for one in family) / 1e6)
        except psutil.Error:
            continue


def made_recordings(folder: Path, number: int) -> list[Path]:
    """Recordings of a virtual rig: ten different ones with noise, written again and again under other names."""
    time_s = np.arange(0.0, 90.0, 0.002)
    images = []
    for kind in range(10):
        chance = np.random.default_rng(kind)
        r = 0.3 + 0.12 * kind
        tau = 2.0 * np.pi * 3.13 * r * time_s
        mass = simulate(Problem(r, 0.3, zeta=0.02), cycles=int(tau[-1] / (2.0 * np.pi)) + 1).at(tau)[0]
        noise = chance.normal(scale=0.8e-6, size=(2, len(tau)))
        base = 1.8e-3 * np.cos(tau)
        images.append(b"".join(pieces_of(Recording(time_s, 1.8e-3 * mass + noise[0], base + noise[1]))))
    paths = [folder / f"{index:07d}.h5" for index in range(number)]
    for index, path in enumerate(paths):
        path.write_bytes(images[index % 10])
    return paths


def overhead(cases: int = 5000) -> None:
    """Work of 2 ms a case, 10 s in all: what the way there costs."""

    def run(**way: object) -> Iterator[bytes]:
        for result in run_each(nap, range(cases), **way):  # type: ignore[arg-type]  # options by name
            yield str(result).encode()

    compare("work of 2 ms", cases, run)


if __name__ == "__main__":
    what = {"map": a_map, "recordings": recordings, "overhead": overhead}[sys.argv[1]]
    what(*(int(word) for word in sys.argv[2:]))
