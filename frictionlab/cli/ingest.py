"""``frictionlab ingest``: logs -> recordings; ``frictionlab init``: a folder of logs -> the scene that they need."""

import os
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from frictionlab.cli import printable
from frictionlab.cli.options import LOG, number_of, scene_of, takes
from frictionlab.cli.screen import Shown, count, paragraph, print_tests, print_warnings, track
from frictionlab.cli.work import STANDARD_INPUT, exit_status, expanded, on_disk, report_rows, result_names
from frictionlab.errors import UsageError
from frictionlab.files import refuse_inputs
from frictionlab.tables.texts import with_error

if TYPE_CHECKING:
    from frictionlab.recording import Recording
    from frictionlab.scene import Scene
    from frictionlab.tables import Row
    from frictionlab.verbs.starting import Found

TOLD = 100  # quarantined lines in a row; the recording keeps more
QUESTIONS = {
    "rig.natural_frequency_hz": "natural frequency of the frame in Hz",
    "rig.mass_kg": "mass that moves in kg (or stiffness, like 1191 N/m)",
    "experiment.material": "material of the tests",
    "experiment.normal_force_n": "normal force in N",
}


@takes(LOG)
def ingest(
    logs: list[Path] | None = None,
    *,
    mass_log: Path | None = None,
    base_log: Path | None = None,
    output: str | None = None,
    scene: Path | None = None,
    settings: Mapping[str, object],
    dry_run: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    as_json: bool = False,
    verbose: bool = False,
    force: bool = False,
    quiet: bool = False,
) -> None:
    """Read logs, whatever their dialect and damage, into one HDF5 recording each.

    Example: frictionlab ingest logs/*.csv --scene configs/sample_data.toml -o build/recordings
    """
    from frictionlab.verbs.inputs import rows_of, scene_given

    what = scene_given(scene_of(scene, beside=logs[0] if logs else mass_log, quiet=quiet), settings, ("log",))
    inputs = _inputs(logs or [], mass_log, base_log)
    read = [*inputs, *([] if base_log is None else [base_log]), *what.files]
    places = None if dry_run else _places(inputs, read, output)
    with on_disk([*inputs, *([] if base_log is None else [base_log])]) as files:
        alone = len(inputs) == 1 and not (quiet or as_json)
        job = partial(
            _ingested, scene=what, base_log=base_log, places=places, files=files, force=force, quiet=not alone
        )
        made = rows_of(inputs, job, workers=workers, scheduler=scheduler)
        watched = track(made, total=len(inputs), title="ingest", quiet=quiet or as_json or alone)
        rows = report_rows(watched, as_json=as_json)
    if not as_json:
        good = [row for row in rows if row["status"] == "ok"]
        print_tests(rows, FOUND, f"{len(good)} of {len(rows)} logs {'read' if dry_run else 'ingested'}")
        _print_evidence(good if dry_run else ())
        if not quiet:
            print_warnings(rows, verbose=verbose)
    exit_status(rows)


def _ingested(
    log: Path,
    *,
    scene: "Scene",
    base_log: Path | None,
    places: "Mapping[Path, Path] | None",
    files: "Mapping[Path, Path]",
    force: bool,
    quiet: bool,
) -> "Row":
    """The row of a log, ingested here or where a worker is."""
    from frictionlab.verbs.measuring import ingest

    output = None if places is None else places[log]
    base = None if base_log is None else files.get(base_log, base_log)
    with count(log.name, quiet=quiet, in_bytes=True) as progress:
        recording = ingest(files.get(log, log), scene, base_log=base, output=output, force=force, progress=progress)
    return _row(recording, log, output)


def _inputs(logs: Sequence[Path], mass_log: Path | None, base_log: Path | None) -> list[Path]:
    """The logs to read, folders and patterns opened up; of a pair of logs, the mass's stands for both."""
    if (mass_log is None) != (base_log is None):
        raise UsageError("one file per sensor: expected both --mass-log and --base-log; got one of them")
    if mass_log is not None and base_log is not None and mass_log == base_log == STANDARD_INPUT:
        raise UsageError("--mass-log - and --base-log -: standard input holds one log: give the other one as a file")
    if mass_log is not None and logs:
        raise UsageError("expected either LOG... or --mass-log with --base-log; got both: do them one after the other")
    if mass_log is None and not logs:
        raise UsageError("no logs: expected LOG..., or --mass-log FILE --base-log FILE")
    return [mass_log] if mass_log is not None else expanded(logs)


def _places(inputs: Sequence[Path], read: Sequence[Path], output: str | None) -> "Mapping[Path, Path]":
    """Where each log's recording goes; made sure that no two go to one place and none over a file that is read."""
    into = None if output is None else Path(output)
    is_folder = into is None or into.is_dir() or str(output).endswith((os.sep, "/")) or not into.suffix
    places: dict[Path, Path] = {}
    if is_folder:
        folders = {log: into or (Path() if log == STANDARD_INPUT else log.parent) for log in inputs}
        for folder in dict.fromkeys(folders.values()):
            names = result_names([log for log in inputs if folders[log] == folder])
            places |= {log: folder / f"{name}.h5" for log, name in names.items()}
    elif len(inputs) > 1:
        raise UsageError(f"-o {output}: expected a folder for {len(inputs)} logs; got the name of a file")
    elif into is not None and into.suffix.lower() not in (".h5", ".hdf5", ".nc"):
        raise UsageError(f"-o {output}: a recording is an HDF5 file: expected a name ending in .h5, or a folder")
    elif into is not None:
        places = {inputs[0]: into}
    for place in places.values():
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UsageError(f"-o {place.parent}: the folder cannot be made ({error.strerror})") from error
    refuse_inputs(places.values(), read)
    return places


def _row(recording: "Recording", log: Path, output: Path | None) -> "Row":
    """What was found in a log, as one row."""
    from dataclasses import asdict

    source = recording.source
    return {
        "source": str(log),
        "status": "ok",
        "output": output,
        **source.dialect,
        "samples": len(recording),
        "duration_s": recording.duration_s,
        **{f"lines_{kind}": count for kind, count in asdict(source.lines).items()},
        "flagged": int((recording.quality != 0).sum()),
        "flags": recording.flag_counts(),
        "gaps_s": recording.gaps,
        "quarantined": [
            {"file": q.file, "line": q.number, "text": q.text, "reason": q.reason} for q in source.quarantined[:TOLD]
        ],
        "files": [{"name": f.name, "sha256": f.sha256, "size_bytes": f.size_bytes} for f in source.files],
        "experiment": dict(recording.experiment),
        "warnings": source.warnings,
        "evidence": source.evidence,
    }


FOUND = (
    Shown("layout", lambda row: str(row["layout"]), 4),
    Shown("samples", lambda row: str(row["samples"]), 9),
    Shown("rate [Hz]", lambda row: f"{row['sampling_rate_hz']:.6g}", 8),
    Shown("length [s]", lambda row: f"{row['duration_s']:.4g}", 9),
    Shown("flagged", lambda row: str(row["flagged"] or "-"), 6),
    Shown("quarantined", lambda row: str(row["lines_quarantined"] or "-"), 5),
    Shown("recording", lambda row: "-" if row["output"] is None else printable(str(row["output"])), 3),
)


def _print_evidence(rows: Sequence[Mapping[str, Any]]) -> None:
    """Below the table: why each log was read as it was, and the first lines that were set aside."""
    for row in rows:
        for sentence in row["evidence"]:
            typer.echo(f"{printable(row['source'])}: {printable(sentence)}")
        for line in row["quarantined"][:5]:
            typer.echo(printable(f"{row['source']}: line {line['line']} quarantined: {line['reason']}: {line['text']}"))


def init(
    folder: Path = Path(),
    *,
    every: bool = False,
    force: bool = False,
    quiet: bool = False,
) -> None:
    """Look at logs and write the scene that they need, frictionlab.toml, with what was found in them.

    Taps among the logs give the natural frequency, names and a sheet the facts of each test, the tests the time after
    which they have settled. On a terminal it asks for what logs cannot tell; an empty answer leaves it open. Every
    command finds the scene in the working folder or beside its first input.

    Example: frictionlab init my_logs
    """
    from frictionlab.scene import SCENE_NAME
    from frictionlab.verbs.starting import init, look

    if (folder / SCENE_NAME).exists() and not force:
        raise UsageError(f"{folder / SCENE_NAME}: exists: fill it in, or give --force to replace it")
    found = look(folder)
    asks = sys.stdin.isatty() and sys.stdout.isatty() and not (quiet or every) and bool(found.tests)
    prompts = {key: QUESTIONS[key] for key in found.lacks if asks}
    said = {key: str(typer.prompt(text, default="", show_default=False)).strip() for key, text in prompts.items()}
    answers = {key: text for key, text in said.items() if text}
    facts = dict(_fact(key, text) for key, text in answers.items())
    path = init(folder, force=force, everything=every, found=found, **facts)
    if not quiet:
        _print_found(found, path, open_keys=[key for key in found.lacks if key not in answers])


def _fact(key: str, said: str) -> tuple[str, object]:
    """A key of the scene and its value, of what was answered; a stiffness may be given in place of the mass."""
    name = key.partition(".")[2]
    if name == "material":
        return name, said
    if name == "mass_kg" and said.replace(" ", "").endswith("N/m"):
        return "stiffness_n_per_m", number_of(said.replace(" ", "").removesuffix("N/m"), "stiffness")
    return name, number_of(said, QUESTIONS[key])


def _print_found(found: "Found", path: Path, open_keys: list[str]) -> None:
    """What was found, what is still to be filled in, and the one next command."""
    if found.tests or found.taps or found.unread:
        counts = {"tests": found.tests, "taps": found.taps, "not read": found.unread}
        typer.echo(", ".join(f"{len(logs)} {kind}" for kind, logs in counts.items() if logs))
    for log, reason in found.unread.items():
        paragraph(printable(f"not read: {log.name}: {reason}"), indent="    ")
    if found.frame:
        mean = found.frame["natural_frequency_hz"]
        typer.echo(f"natural frequency {with_error(mean.mean, mean.se)} Hz, from the taps")
    if found.sheet:
        typer.echo(printable(f"facts of the tests: from the sheet {found.sheet}"))
    elif found.name_pattern:
        typer.echo(printable(f"facts of the tests: from their names, {found.name_pattern}"))
    typer.echo(printable(f"the scene is {path}" + (f"; to fill in: {', '.join(open_keys)}" if open_keys else "")))
    several = " --campaign" if len(found.tests) > 1 else ""
    typer.echo(printable(f"next: frictionlab batch {path.parent}{several}"))
