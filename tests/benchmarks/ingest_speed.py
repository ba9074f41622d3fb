"""How long ingest takes against ``pandas.read_csv`` of the same file.

Makes a clean log of 12.5 million rows (389 MB) and its decimal-comma, TAB, cp1252 twin once in a scratch folder, then
runs each job in a fresh process, in turn, and prints the median of the seconds, the ratios (of the medians, and the
range over the rounds), the seconds of processor and the peak memory. That values are Python's ``float`` bit for bit is
what ``tests/logs/test_numbers.py`` proves.

A virtual machine gives memory it does not use back to its host, and fetching it again can take longer than the work:
before each run as much memory as any of them needs is touched, so that none pays for it. ``--cold`` leaves that out.

    python -m tests.benchmarks.ingest_speed [--rows 12500000] [--folder build/benchmarks] [--rounds 5] [--cold]
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

HEADER = "time [s],mass [mm],base [mm]\n"
CHUNK = 250_000
RAW = "f = open({path!r}, 'rb', buffering=0)\nb = bytearray(1 << 22)\nwhile f.readinto(b): pass"
PANDAS = "import pandas; pandas.read_csv({path!r}, {options})"
READ = "from pathlib import Path; from frictionlab.logs import read_log; read_log(Path({path!r}))"
TOUCH = "import numpy; numpy.empty(2_000_000_000, numpy.uint8)[::4096] = 1"


def make_logs(folder: Path, rows: int) -> tuple[Path, Path]:
    """Write the two logs, if they are not there yet."""
    clean, german = folder / f"clean_{rows}.csv", folder / f"german_{rows}.txt"
    if clean.exists() and german.exists():
        return clean, german
    rng = np.random.default_rng(1)
    with clean.open("w", encoding="utf-8") as a, german.open("w", encoding="cp1252") as b:
        a.write(HEADER)
        b.write("# Auflösung 1 µm\r\n" + HEADER.replace(",", "\t").replace("\n", "\r\n"))
        for start in range(0, rows, CHUNK):
            t = np.arange(start, min(rows, start + CHUNK)) * 0.001
            x = 3.0 * np.sin(6.0 * t) + rng.normal(0, 1e-3, len(t))
            y = 2.0 * np.cos(6.0 * t) + rng.normal(0, 1e-3, len(t))
            lines = zip(t.tolist(), x.tolist(), y.tolist(), strict=True)
            text = "".join(f"{i:.6f},{j:.6f},{k:.6f}\n" for i, j, k in lines)
            a.write(text)
            b.write(text.replace(",", "\t").replace(".", ",").replace("\n", "\r\n"))
    return clean, german


def run(words: Sequence[str], *, warm: bool) -> tuple[float, float, float]:
    """Seconds on the clock, seconds of processor, and peak memory [MB] of a fresh process."""
    if warm:
        subprocess.run([sys.executable, "-c", TOUCH], check=True)
    begin = time.perf_counter()
    with subprocess.Popen(words, stdout=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        taken = time.perf_counter() - begin
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{words[:4]} ended with {process.returncode}")
    return taken, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def measure(log: Path, given: argparse.Namespace, options: str = "", bound: int = 2) -> None:
    """Run each job in turn, and print."""
    path, out, python = str(log), str(given.folder / f"{log.stem}.h5"), (sys.executable, "-c")
    jobs = {
        "raw read": (*python, RAW.format(path=path)),
        "pandas.read_csv": (*python, PANDAS.format(path=path, options=options)),
        "read_log": (*python, READ.format(path=path)),
        "ingest": (sys.executable, "-m", "frictionlab", "ingest", path, "-o", out),
    }
    taken: dict[str, list[tuple[float, float, float]]] = {name: [] for name in jobs}
    for _ in range(given.rounds):
        for name, words in jobs.items():
            taken[name].append(run(words, warm=not given.cold))
    size = log.stat().st_size / 1e6
    sys.stdout.write(f"{log.name}: {size:.0f} MB, {given.rows} rows; bound {bound} x\n")
    yardstick = [clock for clock, *_ in taken["pandas.read_csv"]]
    for name, runs in taken.items():
        clock, cpu, peak = (statistics.median(column) for column in zip(*runs, strict=True))
        ratios = [mine[0] / its for mine, its in zip(runs, yardstick, strict=True)]
        sys.stdout.write(
            f"  {name:17s} {clock:5.2f} s = {clock / statistics.median(yardstick):4.2f} x ({min(ratios):4.2f} to "
            f"{max(ratios):4.2f})   processor {cpu:5.2f} s   peak {peak:5.0f} MB\n"
        )
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
    load = f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
    sys.stdout.write(f"{load}, memory {'as it is' if given.cold else 'at hand'}\n")
    clean, german = make_logs(given.folder, given.rows)
    measure(clean, given)
    measure(german, given, "sep='\\t', decimal=',', encoding='cp1252', comment='#'", bound=3)


if __name__ == "__main__":
    main()
