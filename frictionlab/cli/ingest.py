"""``frictionlab ingest``: logs -> recordings; ``frictionlab init``: a folder of logs -> the scene that they need."""

import os
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from frictionlab.cli import complain, printable, screen
from frictionlab.cli.options import Inputs, LogSettings, Made, number_of
from frictionlab.errors import UsageError
from frictionlab.experiment import without_base_logs
from frictionlab.files import make_folder, refuse_inputs
from frictionlab.schema import with_error
from frictionlab.tables.texts import few_of, kinds_of
from frictionlab.verbs.inputs import files_of, logs_in, names_of

if TYPE_CHECKING:
    from frictionlab.scene import Scene
    from frictionlab.verbs.starting import Found

LISTED, SOME = 100, 5  # quarantined lines in a row, and on a screen; the recording keeps more
QUESTIONS = {
    "rig.natural_frequency_hz": "natural frequency of the frame in Hz",
    "rig.mass_kg": "mass that moves in kg (or stiffness, like 1191 N/m)",
    "experiment.material": "material of the tests",
    "experiment.normal_force_n": "normal force in N",
}


def ingest(
    logs: list[Path] | None = None,
    *,
    mass_log: Path | None = None,
    base_log: Path | None = None,
    output: str | None = None,
    settings: LogSettings,
    dry_run: bool = False,
    force: bool = False,
    work: Inputs,
) -> None:
    """Read logs, whatever their dialect and damage, into one HDF5 recording each.

    Example: frictionlab ingest logs/*.csv --scene configs/sample_data.toml -o build/recordings
    """
    if (mass_log is None) != (base_log is None):
        raise UsageError("one file per sensor: expected both --mass-log and --base-log; got one of them")
    if (mass_log is None) == (not logs):
        got = "both" if logs else "no logs"
        raise UsageError(f"expected either LOG... or --mass-log FILE with --base-log FILE; got {got}")
    scene = work.scene_for(logs[0] if logs else mass_log, settings, ("log",))
    inputs = without_base_logs(scene, files_of(logs or [], logs_in)) if mass_log is None else [mass_log]
    work.note_not_read(logs or [log for log in (mass_log, base_log) if log], scene)
    outputs: Mapping[Path, Path] = {}
    if not dry_run:
        outputs = _places(inputs, output)
        refuse_inputs(outputs.values(), [*inputs, *([] if base_log is None else [base_log]), *scene.files])
    job = partial(ingested, scene=scene, base=base_log, outputs=outputs, force=force)
    rows = work.rows(inputs, job, "ingest")
    if not work.as_json:
        good = [row for row in rows if row["status"] == "ok"]
        faults = ("flagged", "lines_quarantined")  # where there are none, no column counts them
        shown = [{**row, **{key: row.get(key) or None for key in faults}} for row in rows]
        screen.print_tests(shown, screen.FOUND, f"{len(good)} of {len(rows)} logs {'read' if dry_run else 'ingested'}")
        seen: list[Any] = good if dry_run else []
        for sentence, where in kinds_of((row["source"], said) for row in seen for said in row["evidence"]):
            whose = where[0] if len(where) == 1 else f"{len(where)} logs"
            screen.paragraph(f"{whose}: {sentence}", indent="    ")
        for each in seen:
            for line in each["quarantined"][:SOME]:
                said = f"line {line['line']} quarantined: {line['reason']}: {line['text']}"
                screen.paragraph(f"{each['source']}: {said}", indent="    ")
        if not work.quiet:
            screen.print_warnings(rows, verbose=work.verbose)
    screen.exit_status(rows)


def ingested(
    log: Path,
    *,
    scene: "Scene",
    base: Path | None = None,
    outputs: Mapping[Path, Path] | None = None,
    force: bool = False,
) -> Made:
    """What was found in a log, as one row; its recording goes where ``outputs`` says."""
    from frictionlab.verbs.one_test import ingest

    output = (outputs or {}).get(log)
    recording = ingest(log, scene, base_log=base, output=output, force=force)
    source = recording.source
    row = {
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
            {"file": q.file, "line": q.number, "text": q.text, "reason": q.reason} for q in source.quarantined[:LISTED]
        ],
        "files": [{"name": f.name, "sha256": f.sha256, "size_bytes": f.size_bytes} for f in source.files],
        "experiment": dict(recording.experiment),
        "warnings": source.warnings,
        "evidence": source.evidence,
    }
    return row, {}


def _places(inputs: Sequence[Path], output: str | None) -> Mapping[Path, Path]:
    """Where each log's recording goes; no two go to one place."""
    into = None if output is None else Path(output)
    places: dict[Path, Path] = {}
    if into is None or into.is_dir() or str(output).endswith((os.sep, "/")) or not into.suffix:
        folders = {log: into or log.parent for log in inputs}
        for folder in dict.fromkeys(folders.values()):
            names = names_of([log for log in inputs if folders[log] == folder])
            places |= {log: folder / f"{name}.h5" for log, name in names.items()}
    elif len(inputs) > 1:
        raise UsageError(
            f"-o {output}: expected a folder for {len(inputs)} logs; got the name of a file"
            " (one file per sensor: --mass-log FILE --base-log FILE)"
        )
    elif into.suffix.lower() not in (".h5", ".hdf5", ".nc"):
        raise UsageError(f"-o {output}: a recording is an HDF5 file: expected a name ending in .h5, or a folder")
    else:
        places = {inputs[0]: into}
    for place in places.values():
        make_folder(place.parent)
    return places


def init(folder: Path = Path(), *, every: bool = False, force: bool = False, quiet: bool = False) -> None:
    """Look at logs and write the scene that they need, frictionlab.toml, with what was found in them.

    Taps among the logs give the natural frequency, names and a sheet the facts of each test. On a terminal it asks for
    what logs do not say; an empty answer leaves it open. Every command finds the scene in the working folder or beside
    its first input.

    Example: frictionlab init my_logs
    """
    from frictionlab.scene import SCENE_NAME
    from frictionlab.verbs.starting import init, look

    if (folder / SCENE_NAME).exists() and not force:
        raise UsageError(f"{folder / SCENE_NAME}: exists: fill it in, or give --force to replace it")
    is_new, found = not folder.exists(), look(folder)
    if is_new and not force and folder.absolute().parent.is_dir():
        near = (place.name for place in folder.absolute().parent.iterdir() if place.is_dir())
        same = [name for name in near if re.findall(r"\d", name) == re.findall(r"\d", folder.name)]  # run2 is no run1
        if meant := get_close_matches(folder.name, same, n=1, cutoff=0.8):
            raise UsageError(f"{folder}: there is no such folder: did you mean {meant[0]}? --force makes it new")
    asks = sys.stdin.isatty() and sys.stdout.isatty() and not (quiet or every) and bool(found.tests)
    answers = {key: fact for key in found.lacks if asks and (fact := _asked(key))}
    path = init(folder, force=force, everything=every, found=found, **dict(answers.values()))
    if not quiet:
        if is_new:
            screen.paragraph(f"{folder} was not there: it was made new and is empty: put logs there")
        _print_found(found, path, open_keys=[key for key in found.lacks if key not in answers])


def _asked(key: str) -> tuple[str, object] | None:
    """A key of the scene and its value, of what is answered; asked again where it is no number, None for nothing.

    A stiffness may be given in place of the mass.
    """
    name = key.partition(".")[2]
    while said := str(typer.prompt(QUESTIONS[key], default="", show_default=False)).strip():
        bare = said.replace(" ", "")
        try:
            if name == "mass_kg" and bare.endswith("N/m"):
                return "stiffness_n_per_m", number_of(bare.removesuffix("N/m"), "stiffness")
            return name, said if name == "material" else number_of(said, QUESTIONS[key])
        except UsageError as error:
            complain(str(error))
    return None


def _print_found(found: "Found", path: Path, open_keys: list[str]) -> None:
    """What was found, what is still to be filled in, and the one next command."""
    from frictionlab.experiment import as_remarks
    from frictionlab.verbs.starting import OVER_FREQUENCY

    counts = [screen.counted(len(logs), noun) for logs, noun in ((found.tests, "test"), (found.taps, "tap")) if logs]
    counts += [f"{len(found.unread)} not read"] if found.unread else []
    typer.echo(", ".join(counts) or printable(f"no logs in {path.parent} yet"))
    for log, reason in found.unread.items():
        screen.paragraph(f"not read: {log.name}: {reason}", indent="    ")
    if found.pairs:
        said = "each sensor has a log of its own: that sheet lists them in pairs: check which is the mass's (`log`)"
        screen.paragraph(f"{found.sheet} is written: {said} and fill in what its columns ask for", indent="    ")
    if found.frame:
        mean = found.frame["natural_frequency_hz"]
        typer.echo(f"natural frequency {with_error(mean.mean, mean.se)} Hz, from the taps")
    for doubt in found.doubts:
        screen.paragraph(f"warning: {doubt}", indent="    ")
    is_open = any(key.startswith("experiment.") for key in open_keys)
    if found.sheet or found.name_pattern:
        where = f"the sheet {found.sheet}" if found.sheet else f"their names, {found.name_pattern}"
        screen.paragraph(f"facts of the tests: from {where}", indent="    ")
    elif found.tests and is_open:
        pattern = "[experiment] name_pattern takes them from names, like '{material} {normal_force_n}N {note}'"
        screen.paragraph(f"facts of the tests: none found: {pattern}", indent="    ")
    if found.remarks and is_open:
        screen.paragraph(f"warning: {as_remarks(found.remarks)}", indent="    ")
    if found.odd and not found.sheet:
        odd = f"names that do not follow it: {few_of(found.odd)}: rename them, or list all in a sheet"
        screen.paragraph(odd, indent="    ")
    to_fill_in = f"; to fill in: {', '.join(open_keys)}" if open_keys else ""
    screen.paragraph(f"the scene is {path}{to_fill_in}", indent="    ")
    table = next((log for log, reason in found.unread.items() if reason == OVER_FREQUENCY), None)
    if found.unread and not (found.tests or table):
        typer.echo("next: mend what is not read, as it says, and frictionlab init again")
        return
    together = " --campaign" if len(found.tests) > 1 else ""
    verb = "batch" if found.tests or not (found.taps or table) else "compare-numeric" if table else "free-vibration"
    place = table if verb == "compare-numeric" else path.parent
    shown = f'"{place}"' if " " in str(place) else place
    typer.echo(printable(f"next: frictionlab {verb} {shown}{together}"))
