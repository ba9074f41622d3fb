"""Mutated files of every kind that is read: a result or a clear error, never a traceback, a hang or a full memory.

    python -m tests.armour.fuzz --count 20000 [--first 0] [--kinds recording scene ...] [--workers 2] [--keep PLACE]

Cases run in workers, each killed after `LONGEST_S` and with `MEMORY` bytes: the HDF5 library can loop for ever, or end
the process. A case that fails is kept as a file; its number makes it again. `log.text` is `tests.logs.fuzz`.
"""

import argparse
import hashlib
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
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
from frictionlab.workers import Lost, cores, run_batches
from tests.armour.sound import MAKE, case
from tests.campaign.fabricate import SCENE
from tests.logs import fuzz as logs

ARRAYS = ("time", "mass_displacement", "base_displacement", "quality")
MANY = 10_000
_MET: set[bytes] = set()
LONGEST_S = 60
MEMORY = 3 << 30
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
        _each(path, read_rows)
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


def forked(path: Path) -> tuple[str, bytes]:
    """What `trial` does, in a fork instead of a new interpreter, a hundred times as fast; the clock is the case's."""
    with tempfile.TemporaryFile() as output:
        if (child := os.fork()) == 0:
            os._exit(trial.main(str(path), output.fileno()))
        fault, _ = "reading it ends the process" if os.waitpid(child, 0)[1] else "", output.seek(0)
        return fault, output.read()


def outcomes(numbers: Sequence[int], kind: str, seed: int) -> list[tuple[str, float]]:
    """Outcome and seconds of each case, in a process of its own: the alarm ends it over one that hangs."""
    trial.tried = forked
    warnings.simplefilter("error")
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, resource.RLIM_INFINITY))
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for number in numbers:
            signal.alarm(LONGEST_S)
            begin = time.perf_counter()
            outcome = check(kind, seed, number, Path(folder))
            found.append((outcome, time.perf_counter() - begin))
    signal.alarm(0)
    return found


def main() -> int:
    """Run the cases, print what became of them and keep those that fail."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kinds", nargs="*", default=list(MAKE), choices=[*MAKE, TEXT])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=cores())
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"))
    given = parser.parse_args()
    begin, failed, numbers = time.perf_counter(), False, range(given.first, given.first + given.count)
    for kind in given.kinds:
        seen, slowest, number = Counter[str](), (0.0, given.first), given.first
        job = partial(outcomes, kind=kind, seed=given.seed)
        for batch in run_batches(job, numbers, workers=max(given.workers, 2)):  # 1 would be this process
            for outcome, seconds in [(f"FAULT {batch.reason}", 0.0)] if isinstance(batch, Lost) else batch:
                slowest = max(slowest, (seconds, number))
                seen[outcome.split()[0]] += 1
                if outcome.startswith("FAULT"):
                    failed = True
                    given.keep.mkdir(parents=True, exist_ok=True)
                    raw = logs.case(given.seed, number)[0] if kind == TEXT else case(kind, given.seed, number)
                    (given.keep / f"{kind}_{given.seed}_{number}").write_bytes(raw)
                    sys.stdout.write(f"{kind} {number}: {outcome}\n")
                number += 1
        counts = ", ".join(f"{count} {outcome}" for outcome, count in sorted(seen.items()))
        what = f"{kind}: {given.count} mutated files: {counts}; slowest {slowest[0]:.2f} s (number {slowest[1]})"
        sys.stdout.write(f"{what}\n")
        sys.stdout.flush()
    sys.stdout.write(f"{time.perf_counter() - begin:.0f} s\n")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
