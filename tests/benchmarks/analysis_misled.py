"""What misleads, case by case: how far off energy, amplitude, drive and stops are, what error is stated, what is said.

Run: ``python -m tests.benchmarks.analysis_misled``; the table goes to results/analysis_misled.txt. The same table of
the version before these cases were looked at stands in results/analysis_misled_before.txt. The cases are made by
tests/analysis/hostile.py from exact motions.
"""

import math
import re
import sys
from pathlib import Path

from frictionlab.analysis.measure import measure
from frictionlab.errors import FrictionlabError
from tests.analysis.hostile import CASES, Case

RESULT = Path(__file__).parent / "results" / "analysis_misled.txt"
HEAD = (
    f"{'case':52s} {'energy off':>11s} {'stated':>8s} {'amplitude off':>13s} {'stated':>8s} {'drive':>7s} {'stops':>9s}"
    "  said"
)
NOTE = "off and stated error in %; drive: error over its stated error; stops: found/true per cycle"


def off(found: float, true: float, error: float) -> tuple[str, str]:
    """Error and stated error, in per cent of the truth."""
    return f"{100 * (found / true - 1):+.3f}", f"{100 * error / true:.3f}"


def line(name: str, case: Case) -> str:
    """One case, measured."""
    try:
        m = measure(case.recording, case.scene)
    except FrictionlabError as error:
        return f"{name:52s} refused: {error}"
    energy = off(m.energy_per_cycle, case.truth.energy, m.energy_per_cycle_se)
    amplitude = off(m.response_amplitude, case.truth.amplitude, m.response_amplitude_se)
    drive = abs(m.drive_frequency_hz - case.truth.hz) / (m.drive_frequency_hz_se or math.nan)
    said = "; ".join(re.sub(r"\s+", " ", warning)[:76] for warning in m.warnings[:2]) or "-"
    more = f" and {len(m.warnings) - 2} more" if len(m.warnings) > 2 else ""
    stops = f"{m.stops_per_cycle:.2f}/{case.truth.stops:.2f}"
    return (
        f"{name:52s} {energy[0]:>11s} {energy[1]:>8s} {amplitude[0]:>13s} {amplitude[1]:>8s} {drive:7.1f} {stops:>9s}"
        f"  {said}{more}"
    )


def main() -> None:
    """Write the table."""
    lines = [HEAD, *(line(name, make()) for name, make in CASES.items()), NOTE]
    RESULT.write_text("\n".join(lines) + "\n")
    sys.stdout.write(RESULT.read_text())


if __name__ == "__main__":
    main()
