"""Mutated files of every kind that is read: a result or a clear error, never a traceback, a hang or a full memory.

    python -m tests.armour.fuzz --count 20000 [--first 0] [--kinds recording scene ...] [--workers 2] [--keep PLACE]

Each case runs in a child that is killed after `LONGEST_S` and has `MEMORY` bytes: the HDF5 library can loop for ever,
or end the process. A case that fails is kept as a file; its number makes it again. `log.text` is `tests.logs.fuzz`.
"""

import argparse
import hashlib
import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path

from frictionlab.campaign import write_tables
from frictionlab.campaign.files import read_measurements
from frictionlab.errors import FrictionlabError
from frictionlab.experiment import facts_of
from frictionlab.hdf5 import describe, is_recording, read_recording, trial
from frictionlab.logs import LogOptions, read_log
from frictionlab.report import page
from frictionlab.scene import read_scene, scene_from_tables
from frictionlab.synthetic import virtual_tests
from frictionlab.tables import is_table, read_rows
from frictionlab.verbs.evaluate import evaluate
from frictionlab.verbs.one_test import analyze
from frictionlab.verbs.simulating import plan
from tests.armour.sound import MAKE, case, sound
from tests.campaign.fabricate import SCENE
from tests.logs import fuzz as logs

ARRAYS = ("time", "mass_displacement", "base_displacement", "quality")
PLAN = SCENE | {
    "plan": {
        "frequency_ratios": [0.5],
        "normal_forces_n": [1.0],
        "base_amplitudes_m": [1.8e-3],
        "duration_s": 60.0,
    }
}
MANY = 10_000
_MET: set[bytes] = set()
LONGEST_S = 60
MEMORY = 3 << 30
PART = 250
TEXT = "log.text"


def read(kind: str, path: Path) -> None:
    """Read a file as commands do, and go on with what it holds."""
    if kind.startswith("scene"):
        _each(path, _simulated)
    elif kind.startswith("sheet"):
        scene = scene_from_tables({"experiment": {"sheet": path.name}}, folder=path.parent)
        facts_of(scene, Path("a3.csv"))
    elif kind.startswith("log."):
        read_log(path, LogOptions(unit="mm"))
    elif kind.startswith("map"):
        is_recording(path), is_table(path)
        describe(path)
    elif kind.startswith("comparisons"):
        is_table(path)
        _each(path, read_rows, _planned)
    elif kind.startswith("rows"):
        is_table(path)
        _each(path, read_rows, _evaluated)
    else:
        is_table(path)
        _each(path, describe, _analyzed)


def _simulated(path: Path) -> None:
    scene = read_scene(path)
    if len(virtual_tests(scene)) < MANY:
        facts_of(scene, Path("steel_N1_r0.3.csv"))


def _analyzed(path: Path) -> None:
    recording = read_recording(path)
    if _is_new(*(getattr(recording, name).tobytes() for name in ARRAYS)):
        analyze(recording, natural_frequency_hz=6.0, transient_s=0.5)


def _evaluated(path: Path) -> None:
    rows = read_measurements(path)
    if _is_new(repr(rows).encode()):
        found = evaluate([path], scene_from_tables(SCENE))
        write_tables(found, path.parent / "out")
        page(found, (), {}).encode()


def _planned(path: Path) -> None:
    rows = read_rows(path)
    if _is_new(repr(rows).encode()):
        plan(scene_from_tables(PLAN), law="coulomb", tests=1, measured=[path])


def _is_new(*parts: bytes) -> bool:
    """Whether this is met for the first time: damage often leaves the numbers as they were."""
    digest = hashlib.blake2b(b"|".join(parts)).digest()
    new = digest not in _MET
    _MET.add(digest)
    return new


def _each(path: Path, *readers: Callable[[Path], object]) -> None:
    """All readers have their turn; the first refusal is raised at the end."""
    said: list[FrictionlabError] = []
    for reader in readers:
        try:
            reader(path)
        except FrictionlabError as error:
            said.append(error)
    if said:
        raise said[0]


def check(kind: str, seed: int, number: int, folder: Path) -> str:
    """The outcome of a case in a word, or the traceback of a fault."""
    try:
        if kind == TEXT:
            return logs.check(*logs.case(seed, number), folder)
        path = folder / MAKE[kind][0]
        path.write_bytes(case(kind, seed, number))
        read(kind, path)
    except FrictionlabError as error:
        return "refused" if str(error).strip() else "FAULT an error without words"
    except BaseException:  # noqa: BLE001 - every fault of every kind is what is looked for
        return "FAULT " + traceback.format_exc()
    return "read"


def outcomes(kind: str, seed: int, numbers: range, folder: Path) -> Iterator[tuple[int, str, float]]:
    """Number, outcome and seconds of each case; a child that hangs or dies over one is replaced."""
    if kind != TEXT:
        sound(kind)
    done, said = numbers.start, folder / "said"
    while done < numbers.stop:
        said.write_text("")
        if (child := os.fork()) == 0:
            _serve(kind, seed, range(done, numbers.stop), folder, said)
        _, status = os.waitpid(child, 0)
        for line in said.read_text(encoding="utf-8").splitlines():
            outcome, seconds = json.loads(line)
            yield done, outcome, seconds
            done += 1
        if done < numbers.stop:
            late = os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGALRM
            yield done, f"FAULT hangs: longer than {LONGEST_S} s" if late else "FAULT the process died", 0.0
            done += 1


def _forked(path: Path) -> str:
    """What `trial` does, in a fork instead of a new interpreter, a hundred times as fast; the clock is the case's."""
    child = os.fork()
    if child == 0:
        os._exit(trial.main(str(path)))
    return "reading it ends the process" if os.waitpid(child, 0)[1] else ""


def _serve(kind: str, seed: int, numbers: range, folder: Path, said: Path) -> None:
    """Say each outcome before the next case begins; the alarm ends this process over one that hangs."""
    try:
        trial.fault_of = _forked
        warnings.simplefilter("error")
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
        for number in numbers:
            signal.alarm(LONGEST_S)
            begin = time.perf_counter()
            line = json.dumps([check(kind, seed, number, folder)[-3000:], time.perf_counter() - begin])
            with said.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
    finally:
        os._exit(0)


def run(kind: str, seed: int, numbers: range, keep: Path) -> tuple[str, Counter[str], list[str], tuple[float, int]]:
    """Check some cases and keep those that fail: kind, count of outcomes, faults in words, slowest [s] and number."""
    seen, faults, slowest = Counter[str](), [], (0.0, numbers.start)
    with tempfile.TemporaryDirectory() as folder:
        for number, outcome, seconds in outcomes(kind, seed, numbers, Path(folder)):
            slowest = max(slowest, (seconds, number))
            seen[outcome.split()[0]] += 1
            if outcome.startswith("FAULT"):
                keep.mkdir(parents=True, exist_ok=True)
                raw = logs.case(seed, number)[0] if kind == TEXT else case(kind, seed, number)
                (keep / f"{kind}_{seed}_{number}").write_bytes(raw)
                faults.append(f"{kind} {number}: {outcome}")
    return kind, seen, faults, slowest


def main() -> int:
    """Run the cases, print what became of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kinds", nargs="*", default=list(MAKE), choices=[*MAKE, TEXT])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"))
    given = parser.parse_args()
    begin, last, failed = time.perf_counter(), given.first + given.count, False
    seen, slowest = defaultdict[str, Counter[str]](Counter), dict[str, tuple[float, int]]()
    parts = [(k, range(at, min(at + PART, last))) for k in given.kinds for at in range(given.first, last, PART)]
    with ProcessPoolExecutor(given.workers, mp_context=get_context("spawn")) as pool:
        of, numbers = zip(*parts, strict=True)
        for kind, more, faults, slow in pool.map(run, of, repeat(given.seed), numbers, repeat(given.keep)):
            sys.stdout.write("".join(f"{fault}\n" for fault in faults))
            seen[kind] += more
            slowest[kind], failed = max(slow, slowest.get(kind, slow)), failed or bool(faults)
            if seen[kind].total() == given.count:
                seconds, number = slowest[kind]
                counts = ", ".join(f"{count} {outcome}" for outcome, count in sorted(seen[kind].items()))
                what = f"{kind}: {given.count} mutated files: {counts}"
                sys.stdout.write(f"{what}; slowest {seconds:.2f} s (number {number})\n")
            sys.stdout.flush()
    sys.stdout.write(f"{time.perf_counter() - begin:.0f} s\n")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
