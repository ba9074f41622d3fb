"""Logs as they are named on a command line: files, folders, patterns that a shell left alone, standard input."""

import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from frictionlab.errors import UsageError

STANDARD_INPUT = Path("-")


def is_standard_input(log: Path) -> bool:
    """Whether a log is to be read from standard input."""
    return log == STANDARD_INPUT


def expanded(logs: Sequence[Path], *, recordings: bool = False) -> list[Path]:
    """The logs that are meant, each once: of a folder all logs in it, of a pattern all files that fit it, in order.

    Parameters
    ----------
    logs : sequence of Path
        As they were typed.
    recordings : bool
        Whether a folder's recordings are meant where it holds any.

    Raises
    ------
    UsageError
        A folder without logs, or a pattern that fits nothing.
    """
    from frictionlab.chain.names import logs_of

    found: dict[Path, None] = {}
    for log in logs:
        if log.is_dir():
            made = sorted(log.glob("*.h5")) if recordings else []
            found |= dict.fromkeys(made or logs_of([log]))
        elif not is_standard_input(log) and not log.exists() and any(sign in log.name for sign in "*?["):
            found |= dict.fromkeys(_fitting(log))
        else:
            found[log] = None
    return list(found)


def _fitting(pattern: Path) -> list[Path]:
    """Files that fit a pattern; a shell of Windows leaves that to the program."""
    files = sorted(path for path in pattern.parent.glob(pattern.name) if path.is_file())
    if not files:
        raise UsageError(f"{pattern}: no file fits this pattern")
    return files


@contextmanager
def on_disk(log: Path) -> Iterator[Path]:
    """The log as a file: itself, or what standard input holds, which is read more than once."""
    if not is_standard_input(log):
        yield log
        return
    with tempfile.TemporaryDirectory(prefix="frictionlab-") as folder:
        file = Path(folder) / "standard_input"
        with file.open("wb") as copy:
            shutil.copyfileobj(sys.stdin.buffer, copy)
        yield file
