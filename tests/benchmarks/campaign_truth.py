"""What a virtual campaign says of itself against what is known of it: run ``make campaign`` first.

    python -m tests.benchmarks.campaign_truth [build/campaign]

Prints how many truths lie inside the stated 95 % intervals, and the largest error.
"""

import sys
from collections.abc import Iterable
from pathlib import Path

from frictionlab.files import stem_of
from frictionlab.tables import read_rows

Triple = tuple[float, float, float, float]
"""Truth, value, low and high end."""


def coefficients(folder: Path, truths: dict[str, dict[str, object]]) -> list[Triple]:
    """The friction coefficient of each material and normal force."""
    known = {(t["material"], t["normal_force_n"]): t["friction_coefficient"] for t in truths.values()}
    rows = read_rows(folder / "friction.csv")
    return [
        _triple(known[row["material"], row["normal_force_n"]], row, "friction_coefficient", "friction_coefficient")
        for row in rows
    ]


def slopes(folder: Path, truths: dict[str, dict[str, object]]) -> list[Triple]:
    """The slope of the energy of each long test."""
    return [
        _triple(truths[stem_of(Path(str(row["source"])))]["energy_slope_per_hour"], row, "slope_per_hour")
        for row in read_rows(folder / "drift.csv")
    ]


def irregularities(folder: Path, truths: dict[str, dict[str, object]]) -> list[Triple]:
    """The irregularity index of each test that has one."""
    found = []
    for row in read_rows(folder / "measurements.csv"):
        truth = truths[stem_of(Path(str(row["source"])))].get("irregularity_index", 0.0)
        if row["irregularity_index"] is not None:
            found.append(_triple(truth, row, "irregularity_index", "irregularity"))
    return found


def _triple(truth: object, row: dict[str, object], key: str, ends: str | None = None) -> Triple:
    names = (key, f"{ends or key}_low", f"{ends or key}_high")
    value, low, high = (float(str(row[name])) for name in names)
    return float(str(truth)), value, low, high


def line(name: str, triples: Iterable[Triple]) -> str:
    """One line of the table; the error is that of the truths that are a tenth of the largest and more."""
    all_of = list(triples)
    inside = sum(low <= truth <= high for truth, _, low, high in all_of)
    least = 0.1 * max((abs(truth) for truth, *_ in all_of), default=0.0)
    errors = [abs(value / truth - 1.0) for truth, value, *_ in all_of if abs(truth) > least]
    return f"{name:22s}{inside:5d} of {len(all_of):4d} inside   largest error {max(errors, default=0.0):8.2%}"


def main() -> None:
    """Print the table."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "build/campaign")
    truths = {stem_of(Path(str(row["log"]))): dict(row) for row in read_rows(folder / "logs" / "truth.jsonl")}
    for name, kind in (
        ("friction coefficient", coefficients),
        ("slope of the energy", slopes),
        ("irregularity index", irregularities),
    ):
        sys.stdout.write(line(name, kind(folder, truths)) + "\n")
    signed = [value / truth - 1.0 for truth, value, *_ in coefficients(folder, truths)]
    sys.stdout.write(f"coefficients are off by {min(signed):+.3%} to {max(signed):+.3%}\n")


if __name__ == "__main__":
    main()
