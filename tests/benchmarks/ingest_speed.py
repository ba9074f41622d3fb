"""How long ingest takes against ``pandas.read_csv`` of the same file.

Makes a clean log of 12.5 million rows (389 MB) and its decimal-comma, TAB, cp1252 twin once in a scratch folder, then
runs each job in a fresh process, in turn, and prints the median of the seconds, the ratios (of the medians, and the
range over the rounds) and the peak memory (that of this script at least). ``ingest`` is the command as users give it,
with its bar on a terminal. The error beside it is that of the values against Python's ``float``, on rows drawn at
random: 0 means bit for bit.

A virtual machine gives memory it does not use back to its host, and fetching it again can take longer than the work:
before each run as much memory as any of them needs is touched, so that none pays for it. ``--cold`` leaves that out.

    python -m tests.benchmarks.ingest_speed [--rows 12500000] [--folder build/benchmarks] [--rounds 5] [--cold]
"""

import argparse
import os
import pty
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from frictionlab.hdf5 import read_recording

HEADER = "time [s],mass [mm],base [mm]\n"
CHUNK = 250_000
RAW = "f = open({path!r}, 'rb', buffering=0)\nb = bytearray(1 << 22)\nwhile f.readinto(b): pass"
PANDAS = "import pandas; pandas.read_csv({path!r}, {options})"
READ = "from pathlib import Path; from frictionlab.logs import read_log; read_log(Path({path!r}))"
TOUCH = "import numpy; numpy.empty(2_000_000_000, numpy.uint8)[::4096] = 1"


def make_logs(folder: Path, rows: int) -> tuple[Path, Path]:
    """Write the two logs, if they are not there yet."""
    clean, german = folder / f"clean_{rows}.csv", folder / f"german_{rows}.txt"
    if not (clean.exists() and german.exists()):
        rng = np.random.default_rng(1)
        with clean.open("w", encoding="utf-8") as a, german.open("w", encoding="cp1252") as b:
            a.write(HEADER)
            b.write("# Auflösung 1 µm\r\n" + HEADER.replace(",", "\t").replace("\n", "\r\n"))
            for start in range(0, rows, CHUNK):
                text = _rows(start, min(rows, start + CHUNK), rng)
                a.write(text)
                b.write(text.replace(",", "\t").replace(".", ",").replace("\n", "\r\n"))
    return clean, german


def _rows(start: int, end: int, rng: np.random.Generator) -> str:
    t = np.arange(start, end) * 0.001
    x = 3.0 * np.sin(6.0 * t) + rng.normal(0, 1e-3, len(t))
    y = 2.0 * np.cos(6.0 * t) + rng.normal(0, 1e-3, len(t))
    rows = zip(t.tolist(), x.tolist(), y.tolist(), strict=True)
    return "".join(f"{a:.6f},{b:.6f},{c:.6f}\n" for a, b, c in rows)


def run(words: Sequence[str], *, warm: bool) -> tuple[float, float, float]:
    """Seconds on the clock, seconds of processor, and peak memory [MB] of a fresh process; its stderr is a terminal."""
    if warm:
        subprocess.run([sys.executable, "-c", TOUCH], check=True)
    ours, theirs = pty.openpty()
    begin = time.perf_counter()
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=theirs) as process:
        os.close(theirs)
        said = _all_said(ours)
        _, status, used = os.wait4(process.pid, 0)
        taken = time.perf_counter() - begin
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{words[:4]} ended with {process.returncode}:\n{said}")
    return taken, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def _all_said(terminal: int) -> str:
    said = b""
    while True:
        try:
            part = os.read(terminal, 1 << 16)
        except OSError:  # a terminal whose other end is closed
            part = b""
        if not part:
            os.close(terminal)
            return said.decode(errors="replace")
        said += part


def worst_error(log: Path, recording: Path, *, german: bool) -> float:
    """Largest difference to Python's float over 2,000 lines drawn at random."""
    got = read_recording(recording)
    draw = np.random.default_rng(5)
    wanted = set(draw.choice(len(got), 2000, replace=False).tolist())
    worst = 0.0
    with log.open("rb") as file:
        lines = enumerate(islice(file, 2 if german else 1, None))
        drawn = [(i, line) for i, line in lines if i in wanted]
    for i, line in drawn:
        cells = line.decode("cp1252").replace(",", "." if german else ",").split("\t" if german else ",")
        t, x, y = (float(cell) for cell in cells)
        here = got.time[i], got.mass_displacement[i], got.base_displacement[i]
        worst = max(worst, *(abs(a - b) for a, b in zip(here, (t, x / 1000, y / 1000), strict=True)))
    return worst


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=12_500_000)
    parser.add_argument("--folder", type=Path, default=Path("build/benchmarks"))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--cold", action="store_true")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    say(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, memory {'as it is' if given.cold else 'at hand'}")
    for log, options, bound in zip(
        make_logs(given.folder, given.rows),
        ("", "sep='\\t', decimal=',', encoding='cp1252', comment='#'"),
        (2, 3),
        strict=True,
    ):
        _measure(log, options, bound, given)


def _measure(log: Path, options: str, bound: int, given: argparse.Namespace) -> None:
    path, out = str(log), str(given.folder / f"{log.stem}.h5")
    python = (sys.executable, "-c")
    command = str(Path(sys.executable).with_name("frictionlab"))
    jobs = {
        "raw read": (*python, RAW.format(path=path)),
        "pandas.read_csv": (*python, PANDAS.format(path=path, options=options)),
        "read_log": (*python, READ.format(path=path)),
        "ingest": (command, "ingest", path, "-o", out),
    }
    taken: dict[str, list[tuple[float, float, float]]] = {name: [] for name in jobs}
    for _ in range(given.rounds):
        for name, words in jobs.items():
            taken[name].append(run(words, warm=not given.cold))
    error = worst_error(log, Path(out), german=bound == 3)
    say(f"{log.name}: {log.stat().st_size / 1e6:.0f} MB, {given.rows} rows; bound {bound} x; error {error:g}")
    yardstick = taken["pandas.read_csv"]
    for name, runs in taken.items():
        clock, cpu = (statistics.median(column) for column in list(zip(*runs, strict=True))[:2])
        ratios = [mine[0] / its[0] for mine, its in zip(runs, yardstick, strict=True)]
        say(
            f"  {name:17s} {clock:5.2f} s = {clock / statistics.median(y[0] for y in yardstick):4.2f} x "
            f"({min(ratios):4.2f} to {max(ratios):4.2f})   processor {cpu:5.2f} s   "
            f"peak {max(peak for *_, peak in runs):5.0f} MB"
        )


if __name__ == "__main__":
    main()
