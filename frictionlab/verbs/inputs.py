"""What callers may give a verb: paths or results, a scene in any form, keys of its tables as keywords; many inputs.

Several inputs are done one by one: one that fails becomes a row with its reason, the others go on.
"""

import contextlib
import difflib
import os
import re
import traceback
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from functools import partial
from os import PathLike
from pathlib import Path

from frictionlab.errors import FrictionlabError, LogError, SceneError, UsageError
from frictionlab.files import PACKED, as_disks_see, stem_of
from frictionlab.scene import Scene, read_scene
from frictionlab.tables import SUFFIXES, Row
from frictionlab.tables.texts import few_of
from frictionlab.workers import Lost, run_each

FilePath = str | PathLike[str]
AnyScene = Scene | FilePath | None
FAILED = "failed"
PACKAGE = Path(__file__).parents[1]
OTHER_DATA = (".json", ".npz", ".npy", ".pkl", ".pickle", ".feather", ".xls", ".ods", ".wav", ".sqlite", ".db")
"""Suffixes of files that hold numbers, and that no reader here knows."""
PLAIN = (".csv", ".txt", ".tsv", ".asc", ".dat", ".lvm", ".mat", ".xlsx", ".parquet", ".tdms")

EXPECTED_LOGS = (
    f"expected *.csv (or {', '.join(s[1:] for s in PLAIN[1:])}, or one of them packed as"
    f" {', '.join(s[1:] for s in PACKED)}); give a folder with logs (make: LOGS=folder)"
)


def scene_given(scene: AnyScene, settings: Mapping[str, object] | None = None, tables: tuple[str, ...] = ()) -> Scene:
    """The scene in any form that a verb takes, with keys of some of its tables set anew.

    ``settings``: keys of these tables, looked up in their order, and their values; None stands for: as the scene says.
    `SceneError`: the scene or a value is refused; `UsageError`: no such key in these tables.

    Examples
    --------
    >>> scene_given(None, {"cycles": "all", "padding": None}, ("rig", "analysis")).analysis.cycles
    'all'
    """
    known = scene if isinstance(scene, Scene) else Scene() if scene is None else read_scene(scene)
    said = {key: value for key, value in (settings or {}).items() if value is not None}
    if not said:
        return known
    places = {key: table for table in reversed(tables) for key in type(getattr(known, table)).model_fields}
    changes: dict[str, dict[str, object]] = {}
    for key, value in said.items():
        if key not in places:
            near = difflib.get_close_matches(key, places, n=1)
            meant = f"did you mean {near[0]}? " if near else ""
            raise UsageError(f"{key}: unknown setting; {meant}expected one of {', '.join(sorted(places))}")
        changes.setdefault(places[key], {})[key] = value
    if "natural_frequency_hz" in said and known.rig.first.stiffness_n_per_m is not None and not known.rig.masses:
        changes["rig"].setdefault("mass_kg", None)  # stiffness and frequency say all; a third number could contradict
    return known.changed(**changes)


def is_recording_name(path: Path) -> bool:
    """Whether a file is a recording by its name, not a log."""
    return path.suffix.lower() in (".h5", ".hdf5")


def files_of(places: Iterable[Path], of_folder: Callable[[Path], list[Path]] | None = None) -> list[Path]:
    """The files that are meant, each once: of a pattern that no shell has opened up, all files that fit it, in order.

    A folder stands for the files that ``of_folder`` finds in it; without, for itself. What fits nothing is refused.
    """
    found: dict[Path, None] = {}
    for place in places:
        named = [place]
        if not place.exists() and any(sign in str(place) for sign in "*?["):
            root = place.parent if place.parent.is_dir() else Path(place.anchor)
            named = sorted(path for path in root.glob(str(place.relative_to(root))) if path.is_file())
            if not named:
                raise UsageError(f"{place}: no file fits this pattern")
        for path in named:
            found |= dict.fromkeys(of_folder(path) if of_folder is not None and path.is_dir() else [path])
    return list(found)


def logs_in(folder: Path) -> list[Path]:
    """All logs of a folder, by their suffix; folders, sheets and hidden files are passed over. None: `UsageError`."""
    from frictionlab.experiment import is_sheet

    files = (p for p in sorted(folder.iterdir()) if is_log_name(p) and p.name[0] != "." and p.is_file())
    logs = [p for p in files if not is_sheet(p)]
    if not logs:
        inner = few_of([p.name for p in sorted(folder.iterdir()) if p.is_dir() and _holds_logs(p)])
        raise UsageError(f"no logs in {folder}{f', but in its folders {inner}' * bool(inner)}: {EXPECTED_LOGS}")
    return logs


def not_read_in(places: Iterable[Path]) -> dict[Path, str]:
    """Files in these folders that seem to hold numbers and cannot be read, and folders of logs, with what to do."""
    reason = "no log by its name: give the file itself, or save it as CSV, with columns of time, mass and base"
    inner = "logs of a folder in the folder: give that folder by itself"
    files = [path for place in places if place.is_dir() for path in sorted(place.iterdir())]
    found = {path: reason for path in files if path.suffix.lower() in OTHER_DATA}
    return found | {path: inner for path in files if path.name[0] != "." and path.is_dir() and _holds_logs(path)}


def sheets_in(places: Iterable[Path]) -> list[Path]:
    """Sheets that list tests in these folders."""
    from frictionlab.experiment import is_sheet

    files = (path for place in places if place.is_dir() for path in sorted(place.iterdir()))
    return [path for path in files if is_log_name(path) and path.is_file() and is_sheet(path)]


def _holds_logs(folder: Path) -> bool:
    """Whether a folder holds logs, and not results; one that must not be looked into holds none."""
    try:
        names = {path.name for path in folder.iterdir()}
    except OSError:
        return False
    return names.isdisjoint(("made.json", "measurements.csv", "report.html")) and any(
        map(is_log_name, map(Path, names))
    )


def recordings_in(folder: Path) -> list[Path]:
    """The recordings of a folder, or its logs where it holds none."""
    return sorted(folder.glob("*.h5")) or logs_in(folder)


def tables_in(folder: Path) -> list[Path]:
    """All tables of a folder; of one of `frictionlab batch` its measurements."""
    own = folder / "measurements"
    place = own if own.is_dir() and (folder / "made").is_dir() else folder
    found = [p for p in sorted(place.iterdir()) if p.suffix in SUFFIXES]
    if not found:
        raise UsageError(f"no tables in {folder}: expected files ending in {', '.join(SUFFIXES)}")
    return found


def is_log_name(path: Path) -> bool:
    """Whether a file is a log by its suffix, in any case, packed or not: ``a.csv``, ``B.CSV``, ``c.txt.gz``."""
    name = path.with_suffix("") if path.suffix.lower() in PACKED else path
    return name.suffix.lower() in PLAIN


def names_of(logs: Sequence[Path]) -> Mapping[Path, str]:
    """A name for the results of each log: its own without suffix, where no other log has that too.

    Like-named logs keep their suffixes, and a number where that is not enough; names that differ in case, or in how an
    accent is written, count as like, so that results may be copied to a disk that takes them for one.

    Examples
    --------
    >>> list(names_of([Path("a.csv"), Path("a.txt"), Path("b.csv"), Path("x/c.csv"), Path("y/C.csv")]).values())
    ['a.csv', 'a.txt', 'b', 'c.csv', 'C.csv~2']
    """
    stems = {log: stem_of(log) for log in logs}
    many = Counter(map(as_disks_see, stems.values()))
    names: dict[Path, str] = {}
    taken: Counter[str] = Counter()
    for log, stem in stems.items():
        name = stem if many[as_disks_see(stem)] == 1 else log.name
        taken[as_disks_see(name)] += 1
        names[log] = name if taken[as_disks_see(name)] == 1 else f"{name}~{taken[as_disks_see(name)]}"
    return names


def rows_of(
    inputs: Sequence[Path], job: Callable[[Path], Row], *, workers: int | None = 1, scheduler: str | None = None
) -> Generator[Row, None, None]:
    """Do the job on each input and yield its row, in order; a failed one yields its source, status and reason.

    Faults of the scene or of the command line concern all inputs and are raised. With workers or a scheduler the job
    travels by pickle (a function of a module, with `functools.partial`) and runs in the folder of the same name there.
    """
    one = partial(row_of, job, folder=None if scheduler is None else Path.cwd())
    for path, row in zip(inputs, run_each(one, inputs, workers=workers, scheduler=scheduler), strict=True):
        yield {"source": str(path), "status": FAILED, "reason": row.reason} if isinstance(row, Lost) else row


def row_of(job: Callable[[Path], Row], path: Path, *, folder: Path | None) -> Row:
    """The row of one input, in this folder or in that one; a failed one gives its reason and is not raised.

    Whatever a job raises stays with its input, a fault of the program too: the others go on and no row is lost.
    """
    if folder is not None and not os.access(folder, os.X_OK):
        raise UsageError(f"{folder}: a worker does not see it: expected the same files there: use a shared folder")
    try:
        with contextlib.nullcontext() if folder is None else contextlib.chdir(folder):
            return job(path)
    except (SceneError, UsageError):
        raise
    except Exception as error:  # noqa: BLE001  # the one place where what nobody foresaw becomes a row
        return failure(path, error)


def failure(path: Path, error: Exception) -> Row:
    """The row of an input that failed, as in the contract; its source stands beside the reason, not in it again."""
    reason = reason_of(error)
    for name in (str(path), path.name):
        reason = reason.removeprefix(f"{name}: ")
    if isinstance(error, LogError) and re.search("--(?!(mass|base)-log)[a-z]", reason):  # no options of other commands
        reason += " (options of `frictionlab ingest`; the scene has them as keys of [log])"
    notes = getattr(error, "__notes__", [])
    return {"source": str(path), "status": FAILED, "reason": reason} | ({"warnings": notes} if notes else {})


def reason_of(error: Exception) -> str:
    """Why something failed, as a sentence: what this package says, what the system says, or a fault of the program."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if isinstance(error, (FrictionlabError, OSError)):
        return str(error)
    if isinstance(error, MemoryError):
        return "not enough memory: give it a machine with more, or a shorter log"
    steps = [s for s in traceback.extract_tb(error.__traceback__) if PACKAGE in Path(s.filename).parents]
    steps = [s for s in steps if s.filename != __file__]
    place = f" ({Path(steps[-1].filename).relative_to(PACKAGE.parent)}, line {steps[-1].lineno})" if steps else ""
    said = f"{type(error).__name__}: {error}".removesuffix(": ")
    return f"a fault of the program, not of the input: {said}{place}: please report it with the input"
