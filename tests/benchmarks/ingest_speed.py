"""How long ingest takes against ``pandas.read_csv`` of the same file, and where the time goes.

Makes a clean log of 12.5 million rows (379 MB) and its decimal-comma, TAB, cp1252 twin once in a scratch folder, then
runs each job in a fresh process, alternating, and prints seconds, ratios and peak memory. The error beside each time is
that of the values against Python's ``float``, on rows drawn at random: 0 means bit for bit.

    python -m tests.benchmarks.ingest_speed [--rows 12500000] [--folder build/benchmarks] [--rounds 3]
"""

import argparse
import resource
import statistics
import subprocess
import sys
import time
from itertools import islice
from pathlib import Path

import numpy as np

from frictionlab.hdf5 import read_recording

HEADER = "time [s],mass [mm],base [mm]\n"
CHUNK = 250_000
PANDAS = "import pandas; pandas.read_csv({path!r}, {options})"
READ = "from pathlib import Path; from frictionlab.logs import read_log; read_log(Path({path!r}))"
INGEST = """
from pathlib import Path
from frictionlab.logs import read_log
from frictionlab.hdf5 import write_recording
write_recording(read_log(Path({path!r})), Path({out!r}))
"""
RAW = "f = open({path!r}, 'rb', buffering=0)\nb = bytearray(1 << 22)\nwhile f.readinto(b): pass"
STEPS = """
import time; from time import process_time; from pathlib import Path; from collections import Counter
import frictionlab.hdf5.recordings as h, frictionlab.logs.read as r
import frictionlab.logs.kernel
def clocked(module, name):
    inner = getattr(module, name)
    def run(*a, **k):
        t = process_time()
        try: return inner(*a, **k)
        finally: spent[name] += process_time() - t
    setattr(module, name, run)
spent = Counter()
for module, name in ((r, 'read_table'), (r, '_examined'), (r, '_recording'), (h, 'write_whole')):
    clocked(module, name)
begin = process_time()
rec = r.read_log(Path({path!r})); h.write_recording(rec, Path({out!r}))
spent['all'] = process_time() - begin
print({{k: round(v, 2) for k, v in spent.items()}})
"""


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


def run(script: str) -> tuple[float, float, float]:
    """Seconds on the clock, seconds of processor, and peak memory [MB] of a fresh process."""
    code = f"{script}\nprint(open('/proc/self/status').read())"
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    taken, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    peak = next(int(line.split()[1]) for line in done.stdout.splitlines() if line.startswith("VmHWM"))
    return taken, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, peak / 1024


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
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    for log, options, bound in zip(
        make_logs(given.folder, given.rows),
        ("", "sep='\\t', decimal=',', encoding='cp1252', comment='#'"),
        (2, 3),
        strict=True,
    ):
        out = str(given.folder / "out.h5")
        path = str(log)
        scripts = {
            "raw read": RAW.format(path=path),
            "pandas.read_csv": PANDAS.format(path=path, options=options),
            "read_log": READ.format(path=path),
            "ingest": INGEST.format(path=path, out=out),
        }
        taken: dict[str, list[tuple[float, float, float]]] = {name: [] for name in scripts}
        for _ in range(given.rounds):
            for name, script in scripts.items():
                taken[name].append(run(script))
        yardstick = [statistics.median(column) for column in zip(*taken["pandas.read_csv"], strict=True)]
        error = worst_error(log, Path(out), german=bound == 3)
        say(f"{log.name}: {log.stat().st_size / 1e6:.0f} MB, {given.rows} rows; bound {bound} x; error {error:g}")
        for name, runs in taken.items():
            clock, cpu, _ = (statistics.median(column) for column in zip(*runs, strict=True))
            say(
                f"  {name:16s} {clock:6.2f} s = {clock / yardstick[0]:4.2f} x   processor {cpu:6.2f} s = "
                f"{cpu / yardstick[1]:4.2f} x   peak {max(peak for *_, peak in runs):5.0f} MB"
            )
        steps = subprocess.run(
            [sys.executable, "-c", STEPS.format(path=path, out=out)], check=True, capture_output=True, text=True
        )
        say(f"  processor seconds: {steps.stdout.strip()}")


if __name__ == "__main__":
    main()
