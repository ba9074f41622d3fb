"""Which files of a folder are logs, and a name for the results of each that no other has."""

import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from frictionlab.errors import UsageError
from frictionlab.experiment import PACKED, stem_of
from frictionlab.files import as_disks_see

PLAIN = (".csv", ".txt", ".tsv", ".asc", ".dat", ".lvm", ".mat", ".xlsx", ".parquet", ".tdms")

_EXPECTED = (
    f"expected *.csv (or {', '.join(s[1:] for s in PLAIN[1:])}, or one of them packed as"
    f" {', '.join(s[1:] for s in PACKED)}); give a folder with logs (make: LOGS=folder)"
)


def logs_of(inputs: Iterable[Path], *, beside: Sequence[Path] = ()) -> list[Path]:
    """The logs among files and folders: a file as it is named, of a folder all files whose suffix is that of a log.

    Parameters
    ----------
    inputs
        Files and folders; folders in them and hidden files are passed over.
    beside
        Files that stand among the logs and are none, like a campaign's sheet.

    Raises
    ------
    UsageError
        An input is not there, or is a folder without logs.
    """
    others = {os.path.realpath(path) for path in beside}
    found: dict[Path, None] = {}
    for place in map(Path, inputs):
        logs = [log for log in _logs_at(place) if os.path.realpath(log) not in others]
        if not logs:
            raise UsageError(f"no logs in {place}: {_EXPECTED}")
        found |= dict.fromkeys(logs)
    return list(found)


def _logs_at(place: Path) -> list[Path]:
    if not place.is_dir():
        return [place] if place.exists() or is_log_name(place) else []
    return [p for p in sorted(place.iterdir()) if is_log_name(p) and not p.name.startswith(".") and p.is_file()]


def is_log_name(path: Path) -> bool:
    """Whether a file is a log by its suffix, in any case, packed or not.

    Examples
    --------
    >>> [is_log_name(Path(name)) for name in ("a.csv", "B.CSV", "c.txt.gz", "d.gz", "truth.jsonl")]
    [True, True, True, False, False]
    """
    name = path.with_suffix("") if path.suffix.lower() in PACKED else path
    return name.suffix.lower() in PLAIN


def names_of(logs: Sequence[Path]) -> Mapping[Path, str]:
    """A name for the results of each log: its own without suffix, where no other log has that too.

    Like-named logs keep their suffixes, and a number where that is not enough; names that differ in case, or in how an
    accent is written, count as like, so that results may be copied to a disk that does not tell them apart.

    Examples
    --------
    >>> list(names_of([Path("a.csv"), Path("a.txt"), Path("b.csv"), Path("x/c.csv"), Path("y/C.csv")]).values())
    ['a.csv', 'a.txt', 'b', 'c.csv', 'C.csv~2']
    """
    many = Counter(as_disks_see(stem_of(log)) for log in logs)
    names: dict[Path, str] = {}
    taken: Counter[str] = Counter()
    for log in logs:
        name = stem_of(log) if many[as_disks_see(stem_of(log))] == 1 else log.name
        taken[as_disks_see(name)] += 1
        names[log] = name if taken[as_disks_see(name)] == 1 else f"{name}~{taken[as_disks_see(name)]}"
    return names
