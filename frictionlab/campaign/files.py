"""Files of a campaign: tables of measurements in, recordings behind them, of which examples are shown, its folder."""

import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path, PureWindowsPath

from frictionlab import schema
from frictionlab.analysis.measurement import Measurement, measure
from frictionlab.campaign.trials import Trial
from frictionlab.errors import FrictionlabError, UsageError
from frictionlab.files import make_folder, refuse_outputs
from frictionlab.hdf5 import is_recording, read_recording
from frictionlab.scene import Scene
from frictionlab.tables import SUFFIXES, Row, is_table, read_rows

IS_RECORDING = (
    "a recording; campaign evaluates measurements: `frictionlab analyze RECORDING... -o measurements.jsonl`, then"
    " `frictionlab campaign measurements.jsonl -o FOLDER`"
)
IS_COMPARISON = "comparisons; campaign evaluates measurements: give those of `analyze -o`, or batch's measurements"
TABLES = {
    "measurements.csv": schema.TESTS,
    "friction.csv": schema.FRICTION,
    "ranking.csv": schema.RANKING,
    "drift.csv": schema.DRIFTS,
    "laws.csv": schema.MATERIAL_LAWS,
    "left_out.csv": schema.LEFT_OUT,
}
REPORT = "report.html"
MARK = '<meta name="generator" content="frictionlab'


def read_measurements(path: Path) -> list[Row]:
    """Read the rows of one file of measurements.

    Raises
    ------
    UsageError
        It is a recording, is not there, is of another kind (comparisons), is empty, or a line of it is damaged.
    RecordingError
        An ``.h5`` file that holds no measurements, a recording for example.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f"{path}: expected measurements as {', '.join(SUFFIXES)}; got {path.suffix or 'no suffix'}")
    if not path.is_file():
        raise UsageError(f"{path}: there is no such file: expected what `frictionlab analyze -o` wrote")
    if is_recording(path):
        raise UsageError(f"{path}: {IS_RECORDING}")
    rows = [_at_home(row) for row in read_rows(path, schema.MEASUREMENTS if path.suffix.lower() == ".h5" else None)]
    if not rows:
        raise UsageError(f"{path}: expected at least one measurement; got none")
    strange = [n for n, row in enumerate(rows, 1) if "source" not in row]
    if strange:
        raise UsageError(
            f"{path}: row {strange[0]}: expected a measurement with a source; got none: is it another table? (of raw"
            " logs, `frictionlab batch LOGS --campaign`)"
        )
    refuse_comparisons(rows, str(path))
    return rows


def refuse_comparisons(rows: Iterable[Row], where: str) -> None:
    """Refuse (`UsageError`) rows with the columns of comparisons; a user's own column may have any name."""
    if any(schema.table_of(list(row)) is schema.COMPARISONS for row in rows):
        raise UsageError(f"{where}: {IS_COMPARISON}")


def _at_home(row: Row) -> Row:
    """The row with its source as this system writes paths: a table may have been made under Windows."""
    source = row.get("source")
    if not (isinstance(source, str) and "\\" in source) or Path(source).exists():
        return row
    return {**row, "source": PureWindowsPath(source).as_posix()}


def measured_again(trial: Trial, folders: Sequence[Path], scene: Scene) -> Measurement | None:
    """What the recording of a trial shows, looked for at its source and in the folders.

    None if it is not there; nor can one be measured that was measured under another scene.
    """
    path = recording_path(trial, folders)
    try:
        return None if path is None else measure(read_recording(path), scene)
    except (FrictionlabError, OSError):
        return None


def recording_path(trial: Trial, folders: Sequence[Path]) -> Path | None:
    """The file of that recording; None if there is none.

    None counts that lies elsewhere than in these folders and the working folder: a table may come from others.
    """
    roots = _roots(folders)
    for path in _places(trial, folders):
        if _is_inside(path, roots) and _is_file(path) and _is_inside(Path(os.path.realpath(path)), roots):
            return path
    return None


def elsewhere(trials: Sequence[Trial], folders: Sequence[Path]) -> list[str]:
    """Sources that name recordings outside these folders and the working folder, where no twin beside stands in."""
    roots = _roots(folders)
    named = [t for t in trials if not t.failed and t.source.endswith(".h5") and not _is_inside(Path(t.source), roots)]
    return [t.source for t in named if not any(_is_inside(p, roots) and _is_file(p) for p in _places(t, folders))]


def _places(trial: Trial, folders: Sequence[Path]) -> list[Path]:
    source = Path(trial.source)
    places = (source, *(folder / source for folder in folders), *(folder / source.name for folder in folders))
    return [path for path in places if path.suffix == ".h5"]


def _roots(folders: Sequence[Path]) -> list[str]:
    return [kind(folder) for folder in (Path.cwd(), *folders) for kind in (os.path.abspath, os.path.realpath)]


def _is_inside(path: Path, roots: Sequence[str]) -> bool:
    """Whether a path leads into one of these folders; known from its name, without looking at the disk."""
    return any(Path(os.path.abspath(path)).is_relative_to(root) for root in roots)  # noqa: PTH100 - leaves out ".."


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long, a folder that may not be entered
        return False


def check_folder(folder: Path, *, force: bool = False, inputs: Iterable[Path] = ()) -> None:
    """Make the output folder, and refuse one that holds files of these names which are not an earlier campaign's.

    Raises
    ------
    OutputError
        It cannot be made.
    UsageError
        The files in it may not be replaced, or one of them is an input.
    """
    make_folder(folder / "figures")
    what = "file of an earlier campaign of frictionlab"
    refuse_outputs((folder / name for name in (*TABLES, REPORT)), _is_ours, what, force=force, inputs=inputs)


def _is_ours(path: Path) -> bool:
    return is_table(path, TABLES[path.name]) if path.name in TABLES else is_page(path)


def is_page(path: Path) -> bool:
    """Whether this file is a page of a report of this tool."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return MARK.encode() in file.read(4000)


def law_file(material: str) -> str:
    """Return the name of a material's law; what stands badly in a file's name is an underscore.

    Examples
    --------
    >>> law_file("brass on steel/2")
    'law_brass_on_steel_2.toml'
    """
    plain = re.sub(r"[^\w.+-]", "_", material)
    return f"law_{plain}.toml"
