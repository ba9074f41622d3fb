"""``frictionlab free-vibration``: natural frequency and damping ratio from free decays."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frictionlab.cli.inputs import exit_status, report_rows, rows_of
from frictionlab.cli.options import AsJson, Quiet, SceneFile, scene_of
from frictionlab.cli.output import print_table
from frictionlab.tables import Row

if TYPE_CHECKING:
    from frictionlab.recording import Recording
    from frictionlab.scene import Scene

COLUMNS = {
    "source": "source",
    "natural_frequency_hz": "f_n [Hz]",
    "natural_frequency_hz_se": "se",
    "damping_ratio": "zeta",
    "damping_ratio_se": "se",
    "coulomb_m": "F/k [m]",
    "decay": "fits better",
    "swings": "swings",
}


def free_vibration(
    inputs: Annotated[list[Path], typer.Argument(metavar="LOG_OR_RECORDING...", help="Free decays of the mass.")],
    *,
    scene: SceneFile = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Natural frequency and damping ratio of each free decay, their average, and the lines of a scene to paste.

    The averages over all inputs stand in each object of --json as mean_natural_frequency_hz and mean_damping_ratio.

    Example: frictionlab free-vibration tap1.csv tap2.csv tap3.csv
    """
    what = scene_of(scene)
    rows = list(rows_of(inputs, lambda path: _row(path, what)))
    means = _means(rows)
    rows = report_rows(({**row, **means} if row["status"] == "ok" else row for row in rows), as_json=as_json)
    if not (as_json or quiet):
        _tell(rows, means)
    exit_status(rows)


def _row(path: Path, scene: "Scene") -> Row:
    from frictionlab.analysis.free_vibration import free_vibration as measure

    recording = _read(path, scene)
    longest = max(recording.stretches(), key=len)
    decay = measure(longest.mass_displacement, 1.0 / longest.sampling_rate_hz)
    return {"source": str(path), "status": "ok", "reason": None, "warnings": recording.source.warnings, **asdict(decay)}


def _read(path: Path, scene: "Scene") -> "Recording":
    """A recording as it is, a log through ingest."""
    if path.suffix in (".h5", ".hdf5"):
        from frictionlab.hdf5 import read_recording

        return read_recording(path)
    from frictionlab.logs import options_of, read_log

    return read_log(path, options_of(scene.log))


def _means(rows: Sequence[Row]) -> dict[str, float | None]:
    from frictionlab.analysis.free_vibration import average

    found = [row for row in rows if row["status"] == "ok"]
    if not found:
        return {}
    means: dict[str, float | None] = {}
    for key in ("natural_frequency_hz", "damping_ratio"):
        over = average([float(str(row[key])) for row in found])
        means |= {f"mean_{key}": over.mean, f"mean_{key}_spread": over.spread, f"mean_{key}_se": over.se}
    return means


def _tell(rows: Sequence[Row], means: dict[str, float | None]) -> None:
    from frictionlab.analysis.free_vibration import scene_snippet

    good = [row for row in rows if row["status"] == "ok"]
    if not good:
        return
    print_table(good, COLUMNS)
    frequency, damping = means["mean_natural_frequency_hz"] or 0.0, means["mean_damping_ratio"] or 0.0
    spread = means["mean_natural_frequency_hz_spread"]
    told = "" if spread is None else f", spread {spread:.2g} Hz over {len(good)} tests"
    typer.echo(f"\naverage: natural frequency {frequency:.6g} Hz{told}; damping ratio {damping:.3g}. For a scene:\n")
    typer.echo(scene_snippet(frequency, damping))
