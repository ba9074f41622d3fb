"""Logs that are not text, each read by a small adapter over a library that is kept; here they are registered.

An adapter has ``is_NAME(first bytes, path)`` and ``read_NAME(path) -> Sheet``; add the pair to `READERS`. Excel's
workbooks become text instead (`excel`, registered in `frictionlab.logs.unpack`); `refused` names what is not read.
"""

from collections.abc import Callable
from pathlib import Path

from frictionlab.errors import FrictionlabError, LogError
from frictionlab.logs.binary.matlab import is_matlab, read_matlab
from frictionlab.logs.binary.parquet import is_parquet, read_parquet
from frictionlab.logs.binary.sheet import Sheet
from frictionlab.logs.binary.tdms import is_tdms, read_tdms

READERS: tuple[tuple[Callable[[bytes, Path], bool], Callable[[Path], Sheet]], ...] = (
    (is_matlab, read_matlab),
    (is_parquet, read_parquet),
    (is_tdms, read_tdms),
)


def read_binary(path: Path) -> Sheet | None:
    """Read a log of a kind that is registered; ``None`` for any other file, and for one that cannot be opened.

    Raises
    ------
    LogError
        It is of such a kind and cannot be read.
    """
    if not path.is_file():  # a pipe or a device is never read: it may not end
        return None
    try:
        with path.open("rb") as file:
            first = file.read(1024)
    except OSError:
        return None  # whoever reads it as text says why
    for fits, read in READERS:
        if fits(first, path):
            return _read(path, read)
    return None


def _read(path: Path, read: Callable[[Path], Sheet]) -> Sheet:
    """Read with an adapter; whatever it raises is said of the file."""
    try:
        return read(path)
    except FrictionlabError as error:
        raise LogError(f"{path.name}: {error}") from error
    except MemoryError:
        raise
    except Exception as error:
        kind = read.__name__.removeprefix("read_")
        raise LogError(
            f"{path.name}: a damaged {kind} file ({type(error).__name__}: {error}): save it again"
        ) from error


__all__ = ["READERS", "Sheet", "read_binary"]
