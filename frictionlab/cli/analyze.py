"""``frictionlab analyze``: recording -> measurement; ``frictionlab free-vibration``: a free decay -> the frame."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, fields, replace
from functools import partial
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from frictionlab.cli.arguments import Figures, Files, exit_status, expanded, report_rows, result_names
from frictionlab.cli.options import ANALYSIS, takes
from frictionlab.cli.screen import Shown, print_table, print_tests, print_warnings
from frictionlab.cli.work import MEASURED, Judged, ManyInputs
from frictionlab.schema import FREE_VIBRATIONS, MEASUREMENTS
from frictionlab.tables import Row
from frictionlab.tables.texts import with_error

if TYPE_CHECKING:
    from frictionlab.analysis.free_vibration import FreeVibration
    from frictionlab.analysis.measurement import Measurement
    from frictionlab.estimate import Average
    from frictionlab.scene import Scene

SERIES = "series"  # travels with a row from its worker and is taken off before anybody sees the row
FIGURE = "free_vibration"
TAPS, MODES = "taps", "modes"
Means = dict[str, "Average"]


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
    series: dict[str, object] = {}
    is_tree = work.output is not None and work.output.suffix == ".h5"
    job = partial(_measured, scene=scene, plots=plots, pages=pages, force=work.force, with_series=is_tree)
    rows, shown = work.rows(inputs, job, "analyze", sifted=partial(_put_apart, series=series))
    work.write(rows, inputs, scene, MEASUREMENTS, series=series)
    work.show(shown, MEASUREMENTS, MEASURED, scene, noun="recordings measured")
    exit_status(rows)


def _measured(
    path: Path,
    *,
    scene: "Scene",
    plots: Figures | None,
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
    silent = replace(work, as_json=False, quiet=work.quiet or work.as_json)  # averages come before the first line
    rows, _ = silent.rows(paths, partial(_tapped, scene=scene, plots=plots, force=work.force), "free vibration")
    means = _means([tap for row in rows for tap in _taps(row)])
    if work.as_json:
        report_rows((_with_means(row, means) for row in rows), as_json=True)
    lines = [line for row in rows for line in _lines(row)]
    work.write(lines, paths, scene, FREE_VIBRATIONS)
    if not work.as_json:
        _print_taps(lines, means, wide=work.wide)
        if not work.quiet:
            print_warnings(rows, verbose=work.verbose)
    exit_status(rows)


def _tapped(path: Path, *, scene: "Scene", plots: Figures | None, files: Files, force: bool) -> Row:
    from frictionlab.analysis.free_vibration import averages
    from frictionlab.verbs.measuring import decay_of, free_vibration, free_vibration_modes, masses_of

    recording = decay_of(files.get(path, path), scene)
    head = {"source": str(path), "status": "ok", "reason": None}
    if len(masses_of(recording)) > 1:
        found = [asdict(mode) for mode in free_vibration_modes(recording, scene)]
        first = {key: value for key, value in found[0].items() if key != "shape"}
        return {**head, "warnings": list(recording.source.warnings), **first, MODES: found}
    taps = free_vibration(recording, scene)
    means = averages(taps)
    if plots is not None:
        from frictionlab.verbs.presenting import plot

        plot(taps, plots[path][FIGURE], title=path.name, force=force)
    stiffness = _stiffness(scene, means["natural_frequency_hz"].mean)
    return {
        **head,
        "warnings": [*recording.source.warnings, *dict.fromkeys(w for tap in taps for w in tap.warnings)],
        **{key: value for name, mean in means.items() for key, value in _with_error(name, mean).items()},
        **_force(means["friction_m"], stiffness, scene.experiment.normal_force_n),
        "stiffness_n_per_m": stiffness,
        TAPS: taps,
    }


def _with_error(name: str, mean: "Average") -> Row:
    return {name: mean.mean, f"{name}_se": mean.se}


def _stiffness(scene: "Scene", natural_frequency: float) -> float | None:
    """The scene's stiffness [N/m], or that of its mass at the frequency found."""
    if scene.rig.stiffness is not None or scene.rig.mass_kg is None:
        return scene.rig.stiffness
    return scene.rig.mass_kg * (2.0 * pi * natural_frequency) ** 2


def _force(friction: "Average", stiffness: float | None, normal: float | None) -> Row:
    """Friction force, and its coefficient, where the scene says enough for them."""
    if stiffness is None:
        return dict.fromkeys(("friction_n", "friction_n_se", "friction_coefficient"))
    force = stiffness * friction.mean
    coefficient = force / normal if normal else None
    return {"friction_n": force, "friction_n_se": stiffness * friction.se, "friction_coefficient": coefficient}


def _taps(row: Row) -> "Sequence[FreeVibration]":
    taps = row.get(TAPS)
    return taps if isinstance(taps, tuple) else ()


def _means(taps: "Sequence[FreeVibration]") -> Means:
    from frictionlab.analysis.free_vibration import averages

    return averages(taps) if taps else {}


def _with_means(row: Row, means: Means) -> Row:
    """A row as programs see it: its taps as rows, and the averages over all inputs."""
    if row["status"] != "ok" or MODES in row:
        return row
    over_all = {
        f"mean_{key}": value
        for name, mean in means.items()
        for key, value in {**_with_error(name, mean), f"{name}_spread": mean.spread}.items()
    }
    return {**row, TAPS: [_plain(tap) for tap in _taps(row)], **over_all}


def _plain(tap: "FreeVibration") -> dict[str, object]:
    """A tap's numbers, without the samples."""
    return {f.name: getattr(tap, f.name) for f in fields(tap) if f.name != "swing"}


def _lines(row: Row) -> Iterator[dict[str, object]]:
    """A line for each tap or mode of an input; one for an input that failed."""
    if row["status"] != "ok":
        yield dict(row)
        return
    stiffness, modes = row.get("stiffness_n_per_m"), row.get(MODES)
    for number, mode in enumerate(modes if isinstance(modes, list) else [], 1):
        yield {"source": row["source"], "status": "ok", "reason": None, "tap": number, **mode}
    for number, tap in enumerate(_taps(row), 1):
        force = tap.friction_m * stiffness if isinstance(stiffness, float) else None
        head = {"source": row["source"], "status": "ok", "reason": None, "tap": number}
        yield {**head, **_plain(tap), "friction_n": force}


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


def _print_taps(lines: Sequence[Row], means: Means, *, wide: bool) -> None:
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
