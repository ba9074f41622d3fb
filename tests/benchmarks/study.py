"""What the studies share: by which commit a result was made, how well stated errors hold, where results go."""

import math
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

RESULTS = Path(__file__).parent / "results"
COVERAGE = f"{'68.3 %':>8s}{'95.0 %':>8s}{'rms':>7s}{'mean':>7s}"
"""Head of what `coverage` says."""


def commit() -> str:
    """The commit that this tree stands at."""
    git = ["git", "rev-parse", "--short", "HEAD"]
    return subprocess.run(git, capture_output=True, text=True, check=False, cwd=RESULTS).stdout.strip()


def coverage(scores: Iterable[float]) -> str:
    """Of errors over stated errors: shares in % within 1 and 1.96, root mean square and mean."""
    of = np.array(list(scores))
    inside = [100 * float(np.mean(np.abs(of) < limit)) for limit in (1.0, 1.96)]
    return f"{inside[0]:8.1f}{inside[1]:8.1f}{math.sqrt(float(np.mean(of**2))):7.2f}{float(np.mean(of)):7.2f}"


def write(name: str, lines: Iterable[str]) -> None:
    """Put a result, with its commit and command, into its file, and print it."""
    said = f"commit {commit()}: python -m tests.benchmarks.{Path(sys.argv[0]).stem} {' '.join(sys.argv[1:])}"
    text = "\n".join([said, *lines]) + "\n"
    (RESULTS / f"{name}.txt").write_text(text, encoding="utf-8")
    sys.stdout.write(text)
    sys.stdout.flush()
