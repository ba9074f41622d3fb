"""``frictionlab free-vibration``: natural frequency, damping ratio and friction of the frame from free decays."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from frictionlab.cli.drawing import Figures, figure_places
from frictionlab.cli.inputs import Files, exit_status, expanded, on_disk, report_rows
from frictionlab.cli.options import scene_of
from frictionlab.cli.output import Shown, print_table, print_tests, print_warnings, with_error
from frictionlab.files import make_folder
from frictionlab.schema import FREE_VIBRATIONS
from frictionlab.tables import Row, check_output, write_rows

if TYPE_CHECKING:
    from frictionlab.analysis.free_vibration import FreeVibration
    from frictionlab.analysis.pooling import Average
    from frictionlab.scene import Scene

FIGURE = "free_vibration"
TAPS, MODES = "taps", "modes"
Means = dict[str, "Average"]


def free_vibration(
    inputs: list[Path],
    *,
    scene: Path | None = None,
    output: Path | None = None,
    plot: Path | None = None,
    as_json: bool = False,
    wide: bool = False,
    verbose: bool = False,
    force: bool = False,
    quiet: bool = False,
) -> None:
    """Natural frequency, damping ratio and friction of each free decay, their average, and the lines of a scene.

    Several taps in one file are found; a log of the mass alone is enough. Of several masses `modes` are given, each
    with its frequency, damping and shape. In --json an input's numbers are the averages
    over its own `taps`; over all inputs they stand as mean_natural_frequency_hz, mean_damping_ratio, mean_friction_m.

    Example: frictionlab free-vibration tap1.csv tap2.csv tap3.csv
    """
    from frictionlab.verbs.rows import rows_of

    what = scene_of(scene, beside=inputs[0], quiet=quiet)
    inputs = expanded(inputs, recordings=True)
    if output is not None:
        check_output(output, FREE_VIBRATIONS, force=force, inputs=[*inputs, *what.files])
    plots = figure_places(plot, inputs, (FIGURE,), force=force)
    with on_disk(inputs) as files:
        rows = list(rows_of(inputs, partial(_row, scene=what, plots=plots, files=files, force=force)))
    means = _means([tap for row in rows for tap in _taps(row)])
    shown = report_rows((_told(row, means) for row in rows), as_json=as_json)
    lines = [line for row in rows for line in _lines(row)]
    if output is not None:
        write_rows(lines, output, FREE_VIBRATIONS, force=force, inputs=[*inputs, *what.files])
    if not as_json:
        _tell(lines, means, wide=wide)
        if not quiet:
            print_warnings(rows, verbose=verbose)
    exit_status(shown)


def _row(path: Path, *, scene: "Scene", plots: Figures | None, files: Files, force: bool) -> Row:
    from frictionlab.analysis.free_vibration import averages
    from frictionlab.verbs.measuring import decay_of, free_vibration, free_vibration_modes, masses_of

    recording = decay_of(files.get(path, path), scene)
    if len(masses_of(recording)) > 1:
        found = [asdict(mode) for mode in free_vibration_modes(recording, scene)]
        head = {"source": str(path), "status": "ok", "reason": None, "warnings": list(recording.source.warnings)}
        return {**head, **{key: value for key, value in found[0].items() if key != "shape"}, MODES: found}
    taps = free_vibration(recording, scene)
    means = averages(taps)
    if plots is not None:
        _draw(taps, path, plots[path][FIGURE], force=force)
    return {
        "source": str(path),
        "status": "ok",
        "reason": None,
        "warnings": [*recording.source.warnings, *dict.fromkeys(w for tap in taps for w in tap.warnings)],
        **{key: value for name, mean in means.items() for key, value in _with_error(name, mean).items()},
        **_force(means["friction_m"], means["natural_frequency_hz"].mean, scene),
        "stiffness_n_per_m": _stiffness(scene, means["natural_frequency_hz"].mean),
        TAPS: taps,
    }


def _with_error(name: str, mean: "Average") -> Row:
    return {name: mean.mean, f"{name}_se": mean.se}


def _stiffness(scene: "Scene", natural_frequency: float) -> float | None:
    """The scene's stiffness [N/m], or that of its mass at the frequency found."""
    from math import pi

    if scene.rig.stiffness is not None or scene.rig.mass_kg is None:
        return scene.rig.stiffness
    return scene.rig.mass_kg * (2.0 * pi * natural_frequency) ** 2


def _force(friction: "Average", natural_frequency: float, scene: "Scene") -> Row:
    """Friction force, and its coefficient, where the scene says enough for them."""
    stiffness, normal = _stiffness(scene, natural_frequency), scene.experiment.normal_force_n
    force = None if stiffness is None else stiffness * friction.mean
    error = None if stiffness is None else stiffness * friction.se
    known = force is not None and normal is not None
    return {
        "friction_n": force,
        "friction_n_se": error,
        "friction_coefficient": force / normal if known and force is not None and normal else None,
    }


def _draw(taps: "Sequence[FreeVibration]", path: Path, place: Path, *, force: bool) -> None:
    from frictionlab.figures.free_vibration import free_vibration_figure
    from frictionlab.figures.style import save

    make_folder(place.parent)
    save(free_vibration_figure(taps, path.name), place, force=force)


def _taps(row: Row) -> "Sequence[FreeVibration]":
    taps = row.get(TAPS)
    return taps if isinstance(taps, tuple) else ()


def _means(taps: "Sequence[FreeVibration]") -> Means:
    from frictionlab.analysis.free_vibration import averages

    return averages(taps) if taps else {}


def _told(row: Row, means: Means) -> Row:
    """A row as people and programs see it: its taps as rows, and the averages over all inputs."""
    if row["status"] != "ok":
        return row
    over_all = {
        f"mean_{key}": value
        for name, mean in means.items()
        for key, value in {**_with_error(name, mean), f"{name}_spread": mean.spread}.items()
    }
    if MODES in row:
        return row
    return {**row, TAPS: [_plain(tap) for tap in _taps(row)], **over_all}


def _plain(tap: "FreeVibration") -> dict[str, object]:
    """A tap's numbers, without the samples."""
    return {f.name: getattr(tap, f.name) for f in fields(tap) if f.name != "swing"}


def _lines(row: Row) -> Iterator[dict[str, object]]:
    """A line for each tap of an input; one for an input that failed."""
    if row["status"] != "ok":
        yield dict(row)
    stiffness = row.get("stiffness_n_per_m")
    modes = row.get(MODES)
    for number, mode in enumerate(modes if isinstance(modes, list) else [], 1):
        yield {"source": row["source"], "status": "ok", "reason": None, "tap": number, **mode}
    for number, tap in enumerate(_taps(row), 1):
        force = tap.friction_m * stiffness if isinstance(stiffness, float) else None
        head = {"source": row["source"], "status": "ok", "reason": None, "tap": number}
        yield {**head, **_plain(tap), "friction_n": force}


TAPPED = (
    Shown("tap", lambda row: str(row.get("tap", "-")), 9),
    Shown("f [Hz]", lambda row: with_error(row.get("natural_frequency_hz"), row.get("natural_frequency_hz_se")), 9),
    Shown("zeta", lambda row: with_error(row.get("damping_ratio"), row.get("damping_ratio_se")), 9),
    Shown("F/k [um]", lambda row: with_error(row.get("friction_m"), row.get("friction_m_se"), 1e6), 8),
    Shown("F [N]", lambda row: with_error(row.get("friction_n"), None), 5),
    Shown("half-cycles", lambda row: str(row.get("half_cycles", "-")), 4),
    Shown("shape", lambda row: _shape(row.get("shape")), 5),
)


def _shape(masses: object) -> str:
    return " ".join(f"{mass:+.3f}" for mass in masses) if isinstance(masses, tuple | list) else "-"


def _tell(lines: Sequence[Row], means: Means, *, wide: bool) -> None:
    from frictionlab.analysis.free_vibration import scene_snippet

    good = [line for line in lines if line["status"] == "ok"]
    failed = [line for line in lines if line["status"] != "ok"]
    taps = "1 tap" if len(good) == 1 else f"{len(good)} taps"
    if wide and good:
        print_table(good, FREE_VIBRATIONS)
    print_tests(failed if wide and good else lines, TAPPED, f"{taps}, {len(failed)} inputs failed" if failed else taps)
    if not means:
        return
    words = {
        "natural_frequency_hz": ("f", 1.0, " Hz"),
        "damping_ratio": ("zeta", 1.0, ""),
        "friction_m": ("F/k", 1e6, " um"),
    }
    told = ", ".join(
        f"{word} {with_error(means[name].mean, means[name].se, times)}{unit}"
        for name, (word, times, unit) in words.items()
    )
    typer.echo(f"\naverage of {taps}: {told}. For a scene:\n")
    typer.echo(scene_snippet(means))
