"""How fast a sampled base motion is followed, at which error: beside OpenSees on the same record, and on long records.

    python -m tests.benchmarks.record_speed > tests/benchmarks/results/record_speed.txt

Errors are rms over rms, against an event-driven integration (DOP853, rtol 1e-12) of the same multisine known between
its samples too. Times are the shortest of some runs, of the processor, without loading and compiling. OpenSees (PyPI:
openseespy, with the system's libblas3 and liblapack3) takes Newmark's steps with an elastoplastic contact as stiff as
it says; its lines are left out where it cannot be loaded.
"""

import math
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from frictionlab.simulator import Problem
from frictionlab.simulator.record import BaseRecord, prepare, respond

Floats = NDArray[np.float64]
FN, BETA, REPEATS = 1.0, 0.12, 5
TONES = np.random.default_rng(7).uniform([0.3, 0.2, 0.0], [1.0, 2.0, 2 * math.pi], (12, 3))  # size, Hz, phase


def base_at(t: Any) -> Any:
    """A multisine of twelve tones between 0.2 and 2 Hz, over its largest value on the record, from 0."""
    phase = np.multiply.outer(np.asarray(t), 2 * math.pi * TONES[:, 1]) + TONES[:, 2]
    return (np.sin(phase) @ TONES[:, 0] - np.sin(TONES[:, 2]) @ TONES[:, 0]) / SIZE


SIZE = 1.0
SIZE = float(np.abs(base_at(np.arange(24_000) / 1000.0)).max())


def seconds(work: Callable[[], object]) -> float:
    """Shortest of some runs."""
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def truth(t: Floats) -> Floats:
    """The mass at the samples, by an integration that stops at each event."""
    now, end = 0.0, float(t[-1])
    x, side = 0.0, 0.0
    found = np.zeros(len(t))
    fine = np.arange(0.0, end, 1e-4)
    pull = np.asarray(base_at(fine))
    while now < end - 1e-12:
        if side == 0.0:
            loose = np.flatnonzero((np.abs(pull - x) > BETA) & (fine > now))
            when = end if not len(loose) else _bisect(x, fine[loose[0] - 1], fine[loose[0]])
            found[(t >= now) & (t <= when)] = x
            now, side = when, float(np.sign(base_at(when) - x))
            continue
        run = _slide(now, end, x, side)
        inside = (t >= now) & (t <= run.t[-1])
        found[inside] = run.sol(t[inside])[0]
        now, x = float(run.t[-1]), float(run.y[0, -1])
        gap = float(base_at(now)) - x
        side = float(np.sign(gap)) if abs(gap) > BETA else 0.0
    return found


def _slide(begin: float, end: float, x: float, side: float) -> Any:
    """One slide from rest to rest, by Dormand and Prince's method of order 8."""
    omega = 2 * math.pi * FN

    def rates(s: float, y: Floats) -> list[float]:
        return [y[1], omega**2 * (float(base_at(s)) - y[0] - BETA * side)]

    def rest(s: float, y: Floats) -> float:
        return float(y[1]) if s > begin + 1e-9 else side

    rest.terminal, rest.direction = True, -side  # type: ignore[attr-defined]
    return solve_ivp(rates, (begin, end), (x, 0.0), "DOP853", events=rest, rtol=1e-12, atol=1e-14, dense_output=True)


def _bisect(x: float, low: float, high: float) -> float:
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if abs(float(base_at(middle)) - x) > BETA else (middle, high)
    return high


def error(x: Floats, exact: Floats) -> float:
    """Rms of the difference over the rms."""
    return float(np.sqrt(np.mean((x - exact) ** 2) / np.mean(exact**2)))


def opensees(ops: Any, t: Floats, stiffness: float, substeps: int, file: Path) -> None:
    """The same oscillator in OpenSees, m = 1: a contact that yields at BETA k and is so stiff over k; into a file."""
    k, dt = (2 * math.pi * FN) ** 2, float(t[1] - t[0])
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(1, 0.0)
    ops.node(2, 0.0)
    ops.fix(1, 1)
    ops.mass(2, 1.0)
    ops.uniaxialMaterial("Elastic", 1, k)
    ops.uniaxialMaterial("ElasticPP", 2, stiffness * k, BETA / stiffness)
    ops.element("zeroLength", 1, 1, 2, "-mat", 1, "-dir", 1)
    ops.element("zeroLength", 2, 1, 2, "-mat", 2, "-dir", 1)
    ops.timeSeries("Path", 1, "-dt", dt, "-values", *(k * np.asarray(base_at(t))).tolist())
    ops.pattern("Plain", 1, 1)
    ops.load(2, 1.0)
    ops.recorder("Node", "-file", str(file), "-precision", 16, "-dT", dt, "-node", 2, "-dof", 1, "disp")
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")
    ops.test("NormDispIncr", 1e-12, 20)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    ops.analyze((len(t) - 1) * substeps, dt / substeps)
    ops.wipe()


def load_opensees() -> Any:
    """OpenSees, or None where it is not installed or lacks a library of the system."""
    try:
        import openseespy.opensees as ops  # noqa: PLC0415 - a peer that need not be there
    except (ImportError, RuntimeError):
        return None
    return ops


def against_opensees() -> None:
    """The record of `measured`: 24,000 samples at 1 kHz."""
    t = np.arange(24_000) / 1000.0
    exact, problem = truth(t), Problem(1.0, BETA)
    tau, y = 2 * math.pi * FN * t, np.asarray(base_at(t))
    prepare(problem, BaseRecord(tau, y, scale=1.0), 1000)
    say(f"24,000 samples at 1 kHz, a multisine, beta = {BETA}: time [ms], error")
    for every in (1, 2, 5, 10, 20):
        some = slice(None, None, every)
        spent = seconds(lambda s=some: respond(problem, BaseRecord(tau[s], y[s], scale=1.0)))  # type: ignore[misc]
        x = respond(problem, BaseRecord(tau[some], y[some], scale=1.0)).displacement
        say(f"  frictionlab, every {every:2d}. sample      {1e3 * spent:8.2f}  {error(x, exact[some]):.1e}")
    ops = load_opensees()
    if ops is None:
        say("  OpenSees: not here (pip install openseespy, and the system's libblas3 and liblapack3)")
        return
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "x.bin"
        for stiffness, substeps in ((1e2, 1), (1e3, 1), (1e4, 4), (1e5, 16)):
            spent = seconds(lambda k=stiffness, n=substeps: opensees(ops, t, k, n, file))  # type: ignore[misc]
            x = np.array(file.read_text().split(), dtype=np.float64)
            n = min(len(x), len(t) - 1)
            line = f"  OpenSees, contact {stiffness:6g} k, {substeps:2d} steps  {1e3 * spent:8.2f}"
            say(f"{line}  {error(x[:n], exact[1 : n + 1]):.1e}")


def long_records() -> None:
    """How long long records take, and how much memory."""
    say("long records: time [s], closure error over energy, peak memory of the process [MB]")
    for rate, length in ((500.0, 90.0), (4000.0, 1800.0)):
        t = np.arange(int(rate * length)) / rate
        y = np.concatenate([base_at(part) for part in np.array_split(t, max(1, len(t) // 100_000))])
        laws = [("coulomb", {}), ("coulomb+place+speed", {"gradient": 0.03, "contact_damping_ratio": 0.02})]
        for law, parameters in laws:
            problem = Problem(1.0, BETA, law=law, parameters=parameters)
            start = time.process_time()
            response = respond(problem, BaseRecord(2 * math.pi * FN * t, y))
            spent = time.process_time() - start
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
            closure = response.closure_error / response.energy
            say(f"  {len(t):9,d} samples, {law:20s} {spent:7.3f}  {closure:.0e}  {memory:6.0f}")


def say(line: str) -> None:
    """Print a line."""
    sys.stdout.write(f"{line}\n")


def main() -> None:
    """Print the tables."""
    say(f"Python {sys.version.split()[0]}")
    against_opensees()
    long_records()


if __name__ == "__main__":
    main()
