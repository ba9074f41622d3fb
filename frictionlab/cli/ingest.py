"""``frictionlab ingest``: logs -> recordings."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frictionlab.cli.inputs import Files, exit_status, expanded, is_standard_input, on_disk, report_rows, result_names
from frictionlab.cli.options import (
    LOG,
    AsJson,
    Force,
    Quiet,
    SceneFile,
    Scheduler,
    Verbose,
    Wide,
    Workers,
    scene_of,
    takes,
)  # fmt: skip
from frictionlab.cli.output import Shown, print_table, print_tests, print_warnings, printable
from frictionlab.cli.progress import bytes_read, track
from frictionlab.errors import UsageError
from frictionlab.files import refuse_inputs

if TYPE_CHECKING:
    from frictionlab.recording import Recording
    from frictionlab.scene import Scene
    from frictionlab.tables import Row

TABLE = {
    "source": "log", "layout": "layout", "samples": "samples", "sampling_rate_hz": "rate [Hz]",
    "duration_s": "duration [s]", "lines_quarantined": "quarantined", "flagged": "flagged", "output": "recording",
}  # fmt: skip

TOLD = 100  # quarantined lines in a row; the recording keeps more


@takes(*LOG)
def ingest(
    logs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="LOG...", help="Logs with both channels, folders of them, patterns, - for standard input."
        ),
    ] = None,
    *,
    mass_log: Annotated[
        Path | None, typer.Option("--mass-log", metavar="FILE", help="Log of the mass alone, or -.")
    ] = None,
    base_log: Annotated[
        Path | None, typer.Option("--base-log", metavar="FILE", help="Log of the base alone, or -.")
    ] = None,
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE_OR_FOLDER", help="Without it: LOG's name + .h5, beside it."),
    ] = None,
    scene: SceneFile = None,
    settings: Mapping[str, object],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Report what is found, write nothing.")] = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
    wide: Wide = False,
    verbose: Verbose = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Read logs, whatever their dialect and damage, into one HDF5 recording each.

    Example: frictionlab ingest logs/*.csv --scene configs/sample_data.toml -o build/recordings
    """
    from frictionlab.verbs.inputs import scene_given
    from frictionlab.verbs.rows import rows_of

    what = scene_given(scene_of(scene, beside=logs[0] if logs else mass_log, quiet=quiet), settings, ("log",))
    inputs = _inputs(logs or [], mass_log, base_log)
    read = [*inputs, *([] if base_log is None else [base_log]), *what.files]
    places = None if dry_run else _places(inputs, read, output)
    with on_disk([*inputs, *([] if base_log is None else [base_log])]) as files:
        job = _Ingest(what, base_log, places, files, force=force, quiet=quiet or as_json or len(inputs) > 1)
        made = rows_of(inputs, job, workers=workers, scheduler=scheduler)
        watched = track(made, total=len(inputs), title="ingest", quiet=quiet or as_json or len(inputs) == 1)
        rows = report_rows(watched, as_json=as_json)
    if not as_json:
        _tell(rows, evidence=dry_run, wide=wide)
        if not quiet:
            print_warnings(rows, verbose=verbose)
    exit_status(rows)


@dataclass(frozen=True)
class _Ingest:
    """What is done to each log, here or where a worker is."""

    scene: "Scene"
    base_log: Path | None
    places: "Mapping[Path, Path] | None"
    files: Files
    force: bool
    quiet: bool

    def __call__(self, log: Path) -> "Row":
        from frictionlab.verbs.measuring import ingest

        output = None if self.places is None else self.places[log]
        file = self.files.get(log, log)
        base = None if self.base_log is None else self.files.get(self.base_log, self.base_log)
        with bytes_read(log.name, quiet=self.quiet) as progress:
            recording = ingest(file, self.scene, base_log=base, output=output, force=self.force, progress=progress)
        return _row(recording, log, output)


def _inputs(logs: Sequence[Path], mass_log: Path | None, base_log: Path | None) -> list[Path]:
    """The logs to read, folders and patterns opened up; of a pair of logs, the mass's stands for both."""
    if (mass_log is None) != (base_log is None):
        raise UsageError("one file per sensor: expected both --mass-log and --base-log; got one of them")
    if mass_log is not None and base_log is not None and is_standard_input(mass_log) and is_standard_input(base_log):
        raise UsageError("--mass-log - and --base-log -: standard input holds one log: give the other one as a file")
    if mass_log is not None and logs:
        raise UsageError("expected either LOG... or --mass-log with --base-log; got both: do them one after the other")
    if mass_log is None and not logs:
        raise UsageError("no logs: expected LOG..., or --mass-log FILE --base-log FILE")
    return [mass_log] if mass_log is not None else expanded(logs)


def _places(inputs: Sequence[Path], read: Sequence[Path], output: str | None) -> "Mapping[Path, Path]":
    """Where each log's recording goes; made sure that no two go to one place and none over a file that is read."""
    if output is None:
        folders = {log: _beside(log) for log in inputs}
        places = {
            log: folder / name for folder in set(folders.values()) for log, name in _named(inputs, folders, folder)
        }
    elif _is_folder(output):
        _make_folder(Path(output))
        places = {log: Path(output) / name for log, name in _named(inputs, dict.fromkeys(inputs, Path()), Path())}
    elif len(inputs) == 1:
        _check_suffix(Path(output))
        _make_folder(Path(output).parent)
        places = {inputs[0]: Path(output)}
    else:
        raise UsageError(f"-o {output}: expected a folder for {len(inputs)} logs; got the name of a file")
    refuse_inputs(places.values(), read)
    return places


def _beside(log: Path) -> Path:
    """The folder of a log; of standard input the one that is worked in."""
    return Path() if is_standard_input(log) else log.parent


def _named(inputs: Sequence[Path], folders: "Mapping[Path, Path]", folder: Path) -> "Iterator[tuple[Path, str]]":
    """Each log of a folder with the name of its recording, like no other's."""
    for log, name in result_names([log for log in inputs if folders[log] == folder]).items():
        yield log, f"{name}.h5"


def _is_folder(output: str) -> bool:
    return Path(output).is_dir() or output.endswith((os.sep, "/")) or not Path(output).suffix


def _check_suffix(output: Path) -> None:
    if output.suffix.lower() not in (".h5", ".hdf5", ".nc"):
        raise UsageError(f"-o {output}: a recording is an HDF5 file: expected a name ending in .h5, or a folder")


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"-o {folder}: the folder cannot be made ({error.strerror})") from error


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


def _tell(rows: Sequence[Mapping[str, Any]], *, evidence: bool, wide: bool) -> None:
    """Print a table of what was made, and below it what its user should know."""
    good = [row for row in rows if row["status"] == "ok"]
    if wide and good:
        print_table(good, TABLE, elsewhere="--json gives")
    verb = "read" if evidence else "ingested"
    print_tests([row for row in rows if row not in good or not wide], FOUND, f"{len(good)} of {len(rows)} logs {verb}")
    for row in good if evidence else ():
        for sentence in row["evidence"]:
            typer.echo(f"{printable(row['source'])}: {printable(sentence)}")
        for line in row["quarantined"][:5]:
            typer.echo(printable(f"{row['source']}: line {line['line']} quarantined: {line['reason']}: {line['text']}"))
