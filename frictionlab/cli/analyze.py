"""One test: ``frictionlab analyze`` and ``free-vibration`` measure it, ``compare-numeric`` and ``explain`` judge it."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, fields
from functools import partial
from math import degrees, pi
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

from frictionlab.cli import complain, printable, screen
from frictionlab.cli.options import AnalysisSettings, Judged, Made, ManyInputs, check_law
from frictionlab.schema import AMPLITUDE, BASE, COMPARISONS, ENERGY, FREE_VIBRATIONS, LAWS, MEASUREMENTS, with_error
from frictionlab.tables import Row
from frictionlab.verbs.inputs import files_of, recordings_in

if TYPE_CHECKING:
    from frictionlab.scene import Scene
    from frictionlab.uncertainty import Average

MOST = 12  # lines of an explanation, where not all are asked for
DRAWN = ("time", "measured", "fitted", "unit")  # of a tap: no part of its row


def analyze(recordings: list[Path], *, settings: AnalysisSettings, work: Judged) -> None:
    """Measure recordings: drive, response, energy per cycle, irregularity, stops, regime, each with its error.

    Example: frictionlab analyze build/recordings/*.h5 --scene configs/sample_data.toml -o build/measurements.csv
    """
    scene = work.scene_for(recordings[0], settings, ("analysis", "rig"))
    inputs = files_of(recordings, recordings_in)
    places = work.places(inputs, scene, MEASUREMENTS, ("measurement",))
    is_tree = work.output is not None and work.output.suffix == ".h5"
    rows = work.rows(inputs, partial(_measured, scene=scene, with_series=is_tree), "analyze", places, force=work.force)
    series = {str(number): row["_series"] for number, row in enumerate(rows) if "_series" in row}
    work.write(rows, inputs, scene, MEASUREMENTS, series=series)
    good = work.show(rows, MEASUREMENTS, screen.MEASURED, scene, noun="recordings measured")
    screen.print_budgets(good if work.budget else ())
    screen.exit_status(rows)


def _measured(file: Path, *, scene: "Scene", with_series: bool) -> Made:
    """The measurement of a file, with its series and its mean cycle where they are to be written."""
    import numpy as np

    from frictionlab.verbs.one_test import analyze

    found = analyze(file, scene)
    row, drawn = {**found.row(), "_assumed": found.sources.assumed}, {"measurement": found}
    if not (found.energy.known or found.force_energy_j.known):  # of a turning contact with no radius: not in metres
        row[f"_{AMPLITUDE}"] = None
    if not with_series:
        return row, drawn
    series: dict[str, object] = {f.name: np.asarray(getattr(found.series, f.name), float) for f in fields(found.series)}
    series["mean_cycle"] = {name: each for name, each in vars(found.cycle).items() if isinstance(each, np.ndarray)}
    if found.trend is not None:
        series["trend"] = {f.name: getattr(found.trend, f.name) for f in fields(found.trend)}
    return {**row, "_series": series}, drawn


def compare_numeric(
    recordings: list[Path],
    *,
    law: str | None = None,
    law_file: Path | None = None,
    beta: float | None = None,
    whole: bool = False,
    fit: Literal["cycle", "whole"] = "cycle",
    solver: Literal["auto", "closed-form", "exact", "numeric", "thesis"] | None = None,
    settings: AnalysisSettings,
    work: Judged,
) -> None:
    """Identify the friction, predict the steady cycle with the simulator, and draw measured over predicted.

    A table over frequency has columns r or frequency [Hz], and amplitude [Y], gain or amplitude [mm], or phase [deg];
    amplitude_u and phase_u are their standard uncertainties.

    Example: frictionlab compare-numeric build/recordings/steel_N1.25_r0.3.h5 --scene configs/sample_data.toml --plot .
    """
    scene = work.scene_for(recordings[0], {**settings, "solver": solver}, ("model", "analysis", "rig"))
    check_law(law)
    inputs = files_of(recordings, recordings_in)
    kinds = ("record", "comparison", "contact") if fit == "whole" else ("comparison", "contact", *("record",) * whole)
    places = work.places(inputs, scene, COMPARISONS, kinds)
    asked = {"law": law, "law_file": law_file, "friction_ratio": beta, "whole": whole, "fit": fit}
    rows = work.rows(inputs, partial(_compared, scene=scene, asked=asked), "compare", places, force=work.force)
    work.write(rows, inputs, scene, COMPARISONS)
    good = work.show(rows, COMPARISONS, screen.COMPARED, scene, noun="recordings compared")
    screen.print_budgets(good if work.budget else ())
    if work.wide:
        _print_parts(good)
    screen.exit_status(rows)


def _compared(file: Path, *, scene: "Scene", asked: Mapping[str, Any]) -> Made:
    from frictionlab.verbs.one_test import analyze, compare, frequency_table_given

    if asked["whole"] or asked["fit"] == "whole" or frequency_table_given(file, scene) is not None:
        found, base = compare(file, scene, **asked), {}
    else:
        measurement = analyze(file, scene)
        found, base = compare(measurement, scene, **asked), {f"_{BASE}": measurement.base_amplitude_m}
    joules = found.energy_joules
    shown = {f"_{ENERGY}_j": joules.value, f"_{ENERGY}_j_u": joules.u, f"_{ENERGY}_u": found.energy.u}
    steady = found if len(found.tau) or found.over_frequency else None
    drawn = {"comparison": steady, "contact": found.contact, "record": found.record}
    return {**found.row(), **base, **shown, "_assumed": found.assumed}, drawn


def _print_parts(rows: Iterable[Any]) -> None:
    """Print the parameters of laws beyond Coulomb's, what a whole record moved beside them, and the ladder of laws."""
    for row in rows:
        parameters, moved = (dict(row.get(key) or {}) for key in ("parameters", "nuisances"))
        laws, law, required = screen.each_of(row.get("laws")), row["law"], row.get("cycle_law") or row["law"]
        said = f"the recording requires {required}"
        if row.get("verdict") == "misfit":
            said = "none explains it; each row is a best fit, and leaves less than one that holds sensors and rig"
        if "lag_s" in moved:
            moved["lag [ms]"] = {key: 1e3 * value for key, value in moved.pop("lag_s").items()}
        values = [{"parameter": name, **each} for name, each in parameters.items()] * bool(laws or len(parameters) > 2)
        beside = [{"moved": name, **each} for name, each in moved.items()] * (row.get("record_nrmse") is not None)
        heads = screen.heads
        parts: tuple[tuple[str, Sequence[Row], Any], ...] = (
            (f"{law}", values, heads("parameters")),
            ("what the fit moved beside the law (natural frequency and gain: relative)", beside, heads("nuisances")),
            (f"laws in the order tried; {said}", laws, LAWS),
            (f"laws tried on the whole record, which requires {law}", screen.each_of(row.get("record_laws")), LAWS),
        )
        for title, lines, columns in parts:
            if lines:
                typer.echo()
                screen.paragraph(f"{row['source']}: {title}")
                screen.print_table(lines, columns)


def explain(recordings: list[Path], *, settings: AnalysisSettings, work: Judged) -> None:
    """Say which friction law a recording requires, in a dozen lines: values in newtons, and what is not known.

    Example: frictionlab explain build/recordings/steel_N1.25_r0.3.h5 --scene configs/sample_data.toml --plot .
    """
    scene = work.scene_for(recordings[0], settings, ("model", "analysis", "rig"))
    inputs = files_of(recordings, recordings_in)
    places = work.places(inputs, scene, COMPARISONS, ("contact",))
    rows = work.rows(inputs, partial(_explained, scene=scene), "explain", places, force=work.force)
    work.write(rows, inputs, scene, COMPARISONS)
    for number, row in enumerate(() if work.as_json else rows):
        text, short = screen.each_of(row.get("text")), screen.each_of(row.get("_short"))
        if not text:
            complain(f"{row['source']}: {row['reason']}")
            continue
        lines = text if work.wide else short
        typer.echo("\n".join([*([""] if number else []), *(printable(str(line)) for line in lines)]))
        if len(lines) < len(text):
            typer.echo(f"... {len(text) - len(lines)} more lines: --wide")
    screen.exit_status(rows)


def _explained(file: Path, *, scene: "Scene") -> Made:
    from frictionlab.verbs.one_test import explain

    found = explain(file, scene)
    return {**found.row(), "_short": found.short(MOST - 1)}, {"contact": found.contact}


def free_vibration(inputs: list[Path], *, work: ManyInputs) -> None:
    """Natural frequency, damping ratio and friction of each free decay, their average, and the lines of a scene.

    Several taps in one file are found; a log of the mass alone is enough. Of several masses `modes` are given, each
    with its frequency, damping and shape. In --json an input's numbers are the averages
    over its own `taps`; over all inputs they stand as mean_natural_frequency_hz, mean_damping_ratio, mean_friction_m.

    Example: frictionlab free-vibration tap1.csv tap2.csv tap3.csv
    """
    from frictionlab.analysis.free_vibration import averages, taps_apart

    scene = work.scene_for(inputs[0], {}, ())
    paths = files_of(inputs, recordings_in)
    places = work.places(paths, scene, FREE_VIBRATIONS, ("free_vibration",))
    rows = work.rows(paths, partial(_tapped, scene=scene), "free vibration", places, force=work.force, silent=True)
    taps = [tap for row in rows for tap in screen.each_of(row.get("_taps"))]
    means = averages(taps)  # before the first line of --json
    warned: list[Any] = [row["warnings"] for row in rows for _ in screen.each_of(row.get("_taps"))]
    for number, sentence in taps_apart(taps):
        warned[number].append(sentence)
    if work.as_json:
        over_all = {f"mean_{name}": value for name, value in _numbers(means, spread=True).items()}
        screen.report_rows(({**row, **over_all} if "taps" in row else row for row in rows), as_json=True)
    lines = [line for row in rows for line in _lines(row)]
    work.write(lines, paths, scene, FREE_VIBRATIONS)
    if work.plot is not None and any("modes" in row for row in rows) and not work.quiet:
        complain("note: modes are a table only: --plot draws taps of one mass")
    if not work.as_json:
        _print_taps(lines, means, taps[0].unit if taps else "m", wide=work.wide)
        if not work.quiet:
            screen.print_warnings(rows, verbose=work.verbose)
    screen.exit_status(rows)


def _tapped(file: Path, *, scene: "Scene") -> Made:
    """The row of an input: the averages over its taps and each of them, or the modes of several masses."""
    from frictionlab.analysis.channels import other_masses
    from frictionlab.analysis.free_vibration import averages
    from frictionlab.logs import read_mass_log
    from frictionlab.uncertainty import Estimate
    from frictionlab.verbs.one_test import free_vibration, modes, recording_given

    recording = recording_given(file, scene, read_mass_log)
    head = {"source": str(file), "status": "ok", "reason": None}
    if other_masses(recording.measured()) and "mass_displacement" in recording.measured():
        every = list(map(asdict, modes(recording, scene)))
        first = {key: value for key, value in every[0].items() if key != "shape"}
        return {**head, "warnings": list(recording.source.warnings), **first, "modes": every}, {}
    taps = free_vibration(recording, scene)
    means = averages(taps)
    stiffness, normal = scene.rig.stiffness, scene.experiment.normal_force_n
    if taps[0].unit != "m":  # of an angle: a stiffness in N/m makes no newtons of it
        stiffness = None
    elif stiffness is None and scene.rig.mass_kg is not None:
        stiffness = scene.rig.mass_kg * (2.0 * pi * means["natural_frequency_hz"].mean) ** 2
    mean = means["friction_m"]
    force = Estimate(mean.mean, mean.se).scaled(stiffness)
    each = (Estimate(tap.friction_m, tap.friction_m_se).scaled(stiffness) for tap in taps)
    newtons = [{"friction_n": one.value, "friction_n_se": one.se} for one in each]
    row = {
        **head,
        "warnings": [*recording.source.warnings, *dict.fromkeys(w for tap in taps for w in tap.warnings)],
        **_numbers(means),
        "friction_n": force.value,
        "friction_n_se": force.se,
        "friction_coefficient": force.over(normal).value,
        "stiffness_n_per_m": stiffness,
        "taps": [
            {f.name: getattr(tap, f.name) for f in fields(tap) if f.name not in DRAWN} | friction
            for tap, friction in zip(taps, newtons, strict=True)
        ],
        "_taps": taps,
    }
    return row, {"free_vibration": taps}


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
    what = "mode" if "modes" in row else "tap"
    for number, numbers in enumerate(screen.each_of(row[f"{what}s"]), 1):
        line = {"source": row["source"], "status": "ok", "reason": None, what: number, **numbers}
        if "shape" in numbers:
            line["_shape"] = " ".join(f"{mass:+.3f}" for mass in numbers["shape"])
        if (taps := screen.each_of(row.get("_taps"))) and taps[0].unit != "m":
            line |= {"_friction_deg": degrees(numbers["friction_m"])}
            line |= {"_friction_deg_se": degrees(numbers["friction_m_se"]) if numbers["friction_m_se"] else None}
        yield line


def _print_taps(lines: Sequence[Row], means: "dict[str, Average]", unit: str, *, wide: bool) -> None:
    from frictionlab.analysis.free_vibration import scene_snippet

    failed = sum(line["status"] != "ok" for line in lines)
    taps = screen.counted(sum("tap" in line for line in lines) + sum(line.get("mode") == 1 for line in lines), "tap")
    headline = f"{taps}, {failed} inputs failed" if failed else taps
    lines = [{key.removeprefix("_"): value for key, value in line.items()} for line in lines]
    screen.print_tests(lines, screen.TAPPED, headline, FREE_VIBRATIONS if wide else None)
    if means:
        f, zeta, friction = (means[name] for name in ("natural_frequency_hz", "damping_ratio", "friction_m"))
        size, word = (1e6, "um") if unit == "m" else (degrees(1.0), "deg")
        typer.echo()
        screen.paragraph(
            f"average of {taps}: f {with_error(f.mean, f.se)} Hz, zeta {with_error(zeta.mean, zeta.se)}, F/k"
            f" {with_error(friction.mean, friction.se, size)} {word}. For a scene:"
        )
        typer.echo(f"\n{scene_snippet(means, unit)}")
