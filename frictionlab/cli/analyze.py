"""``frictionlab analyze``: recording -> measurement."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from frictionlab.cli.inputs import Files, expanded, result_names
from frictionlab.cli.options import ANALYSIS, takes
from frictionlab.cli.work import MEASURED, Work
from frictionlab.schema import MEASUREMENTS
from frictionlab.tables import Row

if TYPE_CHECKING:
    from frictionlab.analysis.measurement import Measurement
    from frictionlab.cli.drawing import Figures
    from frictionlab.scene import Scene

SERIES = "series"  # travels with a row from its worker and is taken off before anybody sees the row


@takes(*ANALYSIS)
def analyze(
    recordings: list[Path],
    *,
    settings: Mapping[str, object],
    report: Path | None = None,
    work: Work,
) -> None:
    """Measure recordings: drive, response, energy per cycle, irregularity, stops, regime, each with its error.

    Example: frictionlab analyze build/recordings/*.h5 --scene configs/sample_data.toml -o build/measurements.csv
    """
    scene = work.scene_for(recordings[0], settings, ("analysis", "rig"))
    inputs = expanded(recordings, recordings=True)
    plots = work.places(inputs, scene, MEASUREMENTS, ("measurement",))
    pages = {} if report is None else {path: report / f"{name}.html" for path, name in result_names(inputs).items()}
    series: dict[str, object] = {}
    job = partial(_row, plots=plots, pages=pages, force=work.force, with_series=_is_tree(work.output))
    rows, shown = work.rows(inputs, job, scene, "analyze", sifted=partial(_put_apart, series=series))
    work.write(rows, inputs, scene, MEASUREMENTS, series=series)
    work.show(shown, MEASUREMENTS, MEASURED, scene, noun="recordings measured")
    work.leave(rows)


def _is_tree(output: Path | None) -> bool:
    return output is not None and output.suffix == ".h5"


def _row(
    path: Path,
    *,
    scene: "Scene",
    plots: "Figures | None",
    pages: Mapping[Path, Path],
    files: Files,
    force: bool,
    with_series: bool,
) -> Row:
    from frictionlab.verbs.measuring import analyze

    file = files.get(path, path)
    measurement = analyze(file, scene)
    if plots is not None:
        from frictionlab.verbs.presenting import plot

        plot(measurement, plots[path]["measurement"], title=path.name, force=force)
    if path in pages:
        from frictionlab.verbs.presenting import sheet

        sheet(measurement, file, pages[path], scene, force=force)
    series = {SERIES: _series(measurement)} if with_series else {}
    return {**measurement.row(), "source": str(path), **series}


def _put_apart(rows: Iterable[Row], series: dict[str, object]) -> Iterator[Row]:
    """The rows without their series, which go into the other place under the number of the row."""
    for number, row in enumerate(rows):
        if SERIES in row:
            series[str(number)] = row[SERIES]
        yield {key: value for key, value in row.items() if key != SERIES}


def _series(measurement: "Measurement") -> dict[str, object]:
    import numpy as np

    series = {f.name: np.asarray(getattr(measurement.series, f.name), dtype=float) for f in fields(measurement.series)}
    cycle = {name: values for name, values in vars(measurement.cycle).items() if values is not None}
    tree: dict[str, object] = {**series, "mean_cycle": cycle}
    if measurement.trend is not None:
        tree["trend"] = {f.name: getattr(measurement.trend, f.name) for f in fields(measurement.trend)}
    return tree
