"""Commands killed at moments drawn at random: all that stands is whole, and the next run ends in the same bytes.

Each is killed once, by SIGKILL or SIGTERM, then run again. After the kill every file that stands under its own name
must be whole: a map, a table, a figure, a report have the bytes of a run that nobody stopped; a recording, which holds
the time it was made, its seal. After the last run the folder holds these files and nothing else, and no process of the
command is left.

    python -m tests.benchmarks.kills [--times 100] [--seed 1]
"""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from frictionlab.hdf5.opening import is_whole
from frictionlab.scene.text import to_toml
from frictionlab.schema import MEASUREMENTS
from frictionlab.tables import write_rows
from tests.armour.sound import sound
from tests.campaign.fabricate import small_campaign
from tests.desk import SAMPLE, SCENE, until
from tests.planning.rig import scene

PLAN = to_toml(scene(frequency_ratios=[0.3, 0.5, 0.7, 1.2], normal_forces_n=[1.0, 1.5], duration_s=60.0))
VIRTUAL = {"material": "steel", "normal_forces_n": [1.0, 1.25, 1.5], "frequency_ratios": [0.3, 1.2]}
SYNTHETIC = to_toml(scene().changed(synthetic={"duration_s": 20.0, "tests": [VIRTUAL | {"friction_coefficient": 0.6}]}))
SWEEP = ("sweep", "--r", "0.5:2:0.1", "--beta", "0.1:0.9:0.02", "--zeta", "0.02", "-q")
DRIVE = ("--natural-frequency", "6", "--transient", "0.5")
COMMANDS: dict[str, tuple[str, ...]] = {
    "ingest": ("ingest", str(SAMPLE), "--scene", str(SCENE), "-o", "out/a.h5"),
    "analyze csv": ("analyze", "a.h5", *DRIVE, "-o", "out/m.csv", "--plot", "out"),
    "analyze h5": ("analyze", "a.h5", *DRIVE, "-o", "out/m.h5"),
    "simulate": ("simulate", "--r", "0.3", "--beta", "0.4", "-o", "out/s.h5", "--plot", "out/s.pdf"),
    "campaign": ("campaign", "m.jsonl", "-o", "out"),
    "synthesize": ("synthesize", "--scene", "synthetic.toml", "-o", "out"),
    "sweep csv": (*SWEEP, "--workers", "1", "-o", "out/map.csv"),
    "sweep h5": (*SWEEP, "--workers", "2", "-o", "out/map.h5"),
    "plan": ("plan", "--scene", "plan.toml", "--tests", "3", "-o", "out/plan.csv"),
}
MARK = "FRICTIONLAB_KILLS"
TRUTH: dict[str, tuple[dict[str, bytes], float]] = {}
SEEN: defaultdict[str, Counter[str]] = defaultdict(Counter)


def main() -> int:
    """Run all, print the counts; 1 if something was not whole."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name, count in {"times": 100, "seed": 1}.items():
        parser.add_argument(f"--{name}", type=int, default=count)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        faults: list[str] = []
        for name, words in COMMANDS.items():
            for _ in range(given.times // len(COMMANDS)):
                faults += killed(name, words, folder, rng)
        sys.stdout.write("".join(f"{name}: {dict(seen)}\n" for name, seen in SEEN.items()))
    sys.stdout.write("".join(f"FAULT {fault}\n" for fault in faults) + f"{len(faults)} faults\n")
    return 1 if faults else 0


def start(words: Sequence[str], folder: Path, mark: str) -> "subprocess.Popen[bytes]":
    """A command in a session of its own, whose processes are known by a mark in their environment."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    command = [sys.executable, "-m", "frictionlab", *words]
    return subprocess.Popen(command, cwd=folder, env=os.environ | {MARK: mark}, start_new_session=True, **quiet)  # type: ignore[call-overload, no-any-return] # mypy knows no keywords by name


def stop(child: "subprocess.Popen[bytes]", after: float, how: signal.Signals) -> bool:
    """Kill a command after so many seconds, the master alone; whether it was still at work."""
    try:
        child.wait(after)
    except subprocess.TimeoutExpired:
        child.send_signal(how)
        child.wait()
        return True
    return False


def left(mark: str) -> int:
    """Processes of this mark that are still there after ten seconds."""
    until(lambda: not _marked(mark), 10.0)
    return len(_marked(mark))


def _marked(mark: str) -> list[int]:
    found, wanted = [], f"{MARK}={mark}\0".encode()
    for place in Path("/proc").glob("[0-9]*/environ"):
        try:
            if wanted in place.read_bytes() + b"\0":
                found.append(int(place.parent.name))
        except OSError:  # it has left, or is not ours
            continue
    return found


def files(folder: Path) -> dict[str, bytes]:
    """All files under a folder."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def desk(folder: Path) -> Path:
    """A folder anew, with what the commands read."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "out").mkdir(parents=True)
    (folder / "a.h5").write_bytes(sound("recording"))
    (folder / "plan.toml").write_text(PLAN)
    (folder / "synthetic.toml").write_text(SYNTHETIC)
    write_rows(small_campaign()[:12], folder / "m.jsonl", MEASUREMENTS)
    return folder


def undisturbed(name: str, words: Sequence[str], place: Path) -> tuple[dict[str, bytes], float]:
    """The files and the seconds of a run that nobody stops, once for each command; that of one worker for all."""
    if name not in TRUTH:
        folder, begin = desk(place / "truth"), time.monotonic()
        if status := start(words, folder, "truth").wait():
            sys.exit(f"{name}: status {status} where nobody stops it")
        TRUTH[name] = files(folder), time.monotonic() - begin
    return TRUTH[name]


def killed(name: str, words: Sequence[str], place: Path, rng: np.random.Generator) -> list[str]:
    """A command that is killed, then run to its end: what is wrong, if anything."""
    (whole, seconds), folder, seen = undisturbed(name, words, place), desk(place / "work"), SEEN[name]
    how, mark = signal.SIGKILL if rng.random() < 0.7 else signal.SIGTERM, f"{folder}{rng.integers(1 << 40)}"
    if stop(start(words, folder, mark), float(rng.uniform(0.2, 1.1) * seconds), how):
        seen[f"killed by {how.name}"] += 1
    if left(mark):
        return [f"{name}: a process is left"]
    there = files(folder)
    seen["with a part left"] += any(Path(file).name.startswith(".") for file in there)
    odd = [file for file in there if not Path(file).name.startswith(".") and not same(folder, file, whole)]
    if odd:
        return [f"{name}: after {how.name}: {odd} are not whole"]
    status = start(words, folder, "last").wait()
    odd = [file for file in whole.keys() | files(folder).keys() if not same(folder, file, whole)]
    if odd or (status and there.keys() < whole.keys()):  # a plan that was written is not written again: it says so
        return [f"{name}: run again: status {status}, {odd} are not as they should be"]
    seen["made whole again, in the same bytes"] += 1
    return []


def same(folder: Path, name: str, whole: dict[str, bytes]) -> bool:
    """Whether a file is there and as in a run that nobody stopped; a recording holds the time it was made."""
    path = folder / name
    if name not in whole or not path.exists():
        return False
    return path.read_bytes() == whole[name] or (name == "out/a.h5" and is_whole(path) is True)


if __name__ == "__main__":
    sys.exit(main())
