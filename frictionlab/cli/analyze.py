"""``frictionlab analyze``: recording -> measurement; ``frictionlab free-vibration``: a free decay -> the frame."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, fields
from functools import partial
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from frictionlab.cli.options import ANALYSIS, takes
from frictionlab.cli.screen import Shown, print_table, print_tests, print_warnings
from frictionlab.cli.work import (
    HIDDEN,
    MEASURED,
    Figures,
    Judged,
    ManyInputs,
    exit_status,
    expanded,
    report_rows,
    result_names,
)
from frictionlab.schema import FREE_VIBRATIONS, MEASUREMENTS
from frictionlab.tables import Row
from frictionlab.tables.texts import with_error

if TYPE_CHECKING:
    from frictionlab.analysis.free_vibration import FreeVibration
    from frictionlab.analysis.measurement import Measurement
    from frictionlab.estimate import Average
    from frictionlab.scene import Scene

SERIES = "series"
FIGURE = "free_vibration"
TAPS, MODES, FOUND = "taps", "modes", "taps with their samples"


@takes(ANALYSIS)
def analyze(
    recordings: list[Path],
    *,
    settings: Mapping[str, object],
    report: Path | None = None,
    work: Judged,
) -> None:
    """Measure recordings: drive, response, energy per cycle, irregularity, stops, regime, each with its error.

    Example: frictionlab analyze build/recordings/*.h5 --scene configs/sample_data.toml -o build/measurements.csv
    """
    scene = work.scene_for(recordings[0], settings, ("analysis", "rig"))
    inputs = expanded(recordings, recordings=True)
    plots = work.places(inputs, scene, MEASUREMENTS, ("measurement",))
    pages = {} if report is None else {path: report / f"{name}.html" for path, name in result_names(inputs).items()}
    is_tree = work.output is not None and work.output.suffix == ".h5"
    job = partial(_measured, scene=scene, plots=plots, pages=pages, force=work.force, with_series=is_tree)
    rows, shown = work.rows(inputs, job, "analyze")
    series = {str(number): row[SERIES] for number, row in enumerate(shown) if SERIES in row}
    work.write(rows, inputs, scene, MEASUREMENTS, series=series)
    work.show(shown, MEASUREMENTS, MEASURED, scene, noun="recordings measured")
    exit_status(rows)


def _measured(
    path: Path,
    file: Path,
    *,
    scene: "Scene",
    plots: Figures | None,
    pages: Mapping[Path, Path],
    force: bool,
    with_series: bool,
) -> Row:
    from frictionlab.verbs.measuring import analyze

    measurement = analyze(file, scene)
    if plots is not None:
        from frictionlab.verbs.presenting import plot

        plot(measurement, plots[path]["measurement"], title=path.name, force=force)
    if path in pages:
        from frictionlab.verbs.presenting import sheet

        sheet(measurement, file, pages[path], scene, force=force)
    hidden = {HIDDEN: {SERIES: _series(measurement)}} if with_series else {}
    return {**measurement.row(), "source": str(path), **hidden}


def _series(measurement: "Measurement") -> dict[str, object]:
    import numpy as np

    series = {f.name: np.asarray(getattr(measurement.series, f.name), dtype=float) for f in fields(measurement.series)}
    cycle = {name: values for name, values in vars(measurement.cycle).items() if isinstance(values, np.ndarray)}
    tree: dict[str, object] = {**series, "mean_cycle": cycle}
    if measurement.trend is not None:
        tree["trend"] = {f.name: getattr(measurement.trend, f.name) for f in fields(measurement.trend)}
    return tree


def free_vibration(inputs: list[Path], *, work: ManyInputs) -> None:
    """Natural frequency, damping ratio and friction of each free decay, their average, and the lines of a scene.

    Several taps in one file are found; a log of the mass alone is enough. Of several masses `modes` are given, each
    with its frequency, damping and shape. In --json an input's numbers are the averages
    over its own `taps`; over all inputs they stand as mean_natural_frequency_hz, mean_damping_ratio, mean_friction_m.

    Example: frictionlab free-vibration tap1.csv tap2.csv tap3.csv
    """
    scene = work.scene_for(inputs[0], {}, ())
    paths = expanded(inputs, recordings=True)
    plots = work.places(paths, scene, FREE_VIBRATIONS, (FIGURE,))
    job = partial(_tapped, scene=scene, plots=plots, force=work.force)
    rows, shown = work.rows(paths, job, "free vibration", silent=True)  # averages come before the first line
    means = _means([tap for row in shown if isinstance(taps := row.get(FOUND), tuple) for tap in taps])
    if work.as_json:
        over_all = {f"mean_{name}": value for name, value in _numbers(means, spread=True).items()}
        report_rows(({**row, **over_all} if TAPS in row else row for row in rows), as_json=True)
    lines = [line for row in rows for line in _lines(row)]
    work.write(lines, paths, scene, FREE_VIBRATIONS)
    if not work.as_json:
        _print_taps(lines, means, wide=work.wide)
        if not work.quiet:
            print_warnings(rows, verbose=work.verbose)
    exit_status(rows)


def _tapped(path: Path, file: Path, *, scene: "Scene", plots: Figures | None, force: bool) -> Row:
    """The row of an input: the averages over its taps and each of them, or the modes of several masses."""
    from frictionlab.verbs.measuring import decay_of, free_vibration, free_vibration_modes, masses_of

    recording = decay_of(file, scene)
    head = {"source": str(path), "status": "ok", "reason": None}
    if len(masses_of(recording)) > 1:
        found = [asdict(mode) for mode in free_vibration_modes(recording, scene)]
        first = {key: value for key, value in found[0].items() if key != "shape"}
        return {**head, "warnings": list(recording.source.warnings), **first, MODES: found}
    taps = free_vibration(recording, scene)
    means = _means(taps)
    if plots is not None:
        from frictionlab.verbs.presenting import plot

        plot(taps, plots[path][FIGURE], title=path.name, force=force)
    stiffness, normal = scene.rig.stiffness, scene.experiment.normal_force_n
    if stiffness is None and scene.rig.mass_kg is not None:
        stiffness = scene.rig.mass_kg * (2.0 * pi * means["natural_frequency_hz"].mean) ** 2
    force_n = None if stiffness is None else stiffness * means["friction_m"].mean
    return {
        **head,
        "warnings": [*recording.source.warnings, *dict.fromkeys(w for tap in taps for w in tap.warnings)],
        **_numbers(means),
        "friction_n": force_n,
        "friction_n_se": None if stiffness is None else stiffness * means["friction_m"].se,
        "friction_coefficient": force_n / normal if force_n is not None and normal else None,
        "stiffness_n_per_m": stiffness,
        TAPS: [{f.name: getattr(tap, f.name) for f in fields(tap) if f.name != "swing"} for tap in taps],
        HIDDEN: {FOUND: taps},
    }


def _means(taps: "Sequence[FreeVibration]") -> "dict[str, Average]":
    from frictionlab.analysis.free_vibration import averages

    return averages(taps) if taps else {}


def _numbers(means: "dict[str, Average]", *, spread: bool = False) -> dict[str, float | None]:
    """Averages as keys of a row, each with its standard error, and with their spread where that is asked for."""
    found: dict[str, float | None] = {}
    for name, mean in means.items():
        found |= {name: mean.mean, f"{name}_se": mean.se, **({f"{name}_spread": mean.spread} if spread else {})}
    return found


def _lines(row: Row) -> Iterator[dict[str, object]]:
    """A line for each tap or mode of an input; one for an input that failed."""
    if row["status"] != "ok":
        yield dict(row)
        return
    stiffness, each = row.get("stiffness_n_per_m"), row.get(MODES) or row[TAPS]
    for number, numbers in enumerate(each if isinstance(each, list) else [], 1):
        line = {"source": row["source"], "status": "ok", "reason": None, "tap": number, **numbers}
        if TAPS in row:
            line["friction_n"] = numbers["friction_m"] * stiffness if isinstance(stiffness, float) else None
        yield line


def _shape(masses: object) -> str:
    return " ".join(f"{mass:+.3f}" for mass in masses) if isinstance(masses, tuple | list) else "-"


TAPPED = (
    Shown("tap", lambda row: str(row.get("tap", "-")), 9),
    Shown("f [Hz]", lambda row: with_error(row.get("natural_frequency_hz"), row.get("natural_frequency_hz_se")), 9),
    Shown("zeta", lambda row: with_error(row.get("damping_ratio"), row.get("damping_ratio_se")), 9),
    Shown("F/k [um]", lambda row: with_error(row.get("friction_m"), row.get("friction_m_se"), 1e6), 8),
    Shown("F [N]", lambda row: with_error(row.get("friction_n"), None), 5),
    Shown("half-cycles", lambda row: str(row.get("half_cycles", "-")), 4),
    Shown("shape", lambda row: _shape(row.get("shape")), 5),
)


def _print_taps(lines: Sequence[Row], means: "dict[str, Average]", *, wide: bool) -> None:
    from frictionlab.analysis.free_vibration import scene_snippet

    good = [line for line in lines if line["status"] == "ok"]
    failed = [line for line in lines if line["status"] != "ok"]
    taps = "1 tap" if len(good) == 1 else f"{len(good)} taps"
    if wide and good:
        print_table(good, FREE_VIBRATIONS)
    print_tests(failed if wide and good else lines, TAPPED, f"{taps}, {len(failed)} inputs failed" if failed else taps)
    if not means:
        return
    told = ", ".join(
        f"{word} {with_error(means[name].mean, means[name].se, times)}{unit}"
        for name, word, times, unit in (
            ("natural_frequency_hz", "f", 1.0, " Hz"),
            ("damping_ratio", "zeta", 1.0, ""),
            ("friction_m", "F/k", 1e6, " um"),
        )
    )
    typer.echo(f"\naverage of {taps}: {told}. For a scene:\n")
    typer.echo(scene_snippet(means))
