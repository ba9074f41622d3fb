"""Logs that are not text, each read by a small adapter over a library that is kept; here they are registered.

An adapter has ``is_NAME(first bytes, path)`` and ``read_NAME(path, options) -> Sheet``; add the pair to `READERS`.
Excel's workbooks become text instead (`excel`, registered in `frictionlab.logs.unpack`); what is known and not read is
named by `refuse_by_name`.
"""

from collections.abc import Callable
from pathlib import Path, PurePath

from frictionlab.errors import FrictionlabError, LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.binary.arrays import is_json, is_matlab, is_numpy, read_json, read_matlab, read_numpy
from frictionlab.logs.binary.sheet import Sheet
from frictionlab.logs.binary.tables import is_parquet, is_tdms, read_parquet, read_tdms

READERS: tuple[tuple[Callable[[bytes, Path], bool], Callable[[Path, LogOptions], Sheet]], ...] = (
    (is_matlab, read_matlab),
    (is_numpy, read_numpy),
    (is_json, read_json),
    (is_parquet, read_parquet),
    (is_tdms, read_tdms),
)
_KINDS = (
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an Excel 97 file (.xls), or another old Office file: save it as .xlsx"),
    (b"RIFF", "a sound file (WAV, AVI): its samples have no unit of length: export the displacement as text"),
    (b"\x89PNG", "a picture: give the log itself"),
    (b"\xff\xd8\xff", "a picture: give the log itself"),
    (b"GIF8", "a picture: give the log itself"),
    (b"%PDF", "a PDF document: give the log itself"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive: unpack it first"),
    (b"Rar!", "a rar archive: unpack it first"),
    (b"\x28\xb5\x2f\xfd", "compressed by Zstandard: unpack it first"),
    (b"\x04\x22\x4d\x18", "compressed by LZ4: unpack it first"),
    (b"MDF     ", "an ASAM MDF measurement: export it as text or as MATLAB"),
    (b"SQLite format 3", "a database (SQLite): export the log as text"),
    (b"\x80\x04\x95", "a Python pickle, which could run anything: save it as text"),
    (b"\x80\x05\x95", "a Python pickle, which could run anything: save it as text"),
    (b"ARROW1", "an Arrow (Feather) file: save it as Parquet"),
    (b"CDF\x01", "a netCDF 3 file: save it as text, MATLAB or Parquet"),
    (b"CDF\x02", "a netCDF 3 file: save it as text, MATLAB or Parquet"),
    (b"\x7fELF", "a program"),
    (b"MZ", "a Windows program"),
    (b"source,status,reason,", "a table of results, not a log: `frictionlab show` and `frictionlab campaign` read it"),
)  # fmt: skip

_SUFFIXES = {
    ".toml": "a scene (give it to --scene)",
    ".jsonl": "a table of results",
    ".md": "a text to read",
    ".html": "a web page",
    ".svg": "a drawing",
}


def read_binary(path: Path, options: LogOptions) -> Sheet | None:
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
            try:
                return read(path, options)
            except FrictionlabError as error:
                raise LogError(f"{path.name}: {error}") from error
            except MemoryError:
                raise
            except Exception as error:
                kind = read.__name__.removeprefix("read_")
                raise LogError(
                    f"{path.name}: a damaged {kind} file ({type(error).__name__}: {error}): save it again"
                ) from error
    return None


def refuse_by_name(first: bytes, name: str) -> None:
    r"""Raise for a file whose first bytes are those of a kind that is not read.

    Examples
    --------
    >>> refuse_by_name(b"RIFF\x24\0\0\0WAVE", "tap.wav")
    Traceback (most recent call last):
    frictionlab.errors.LogError: tap.wav: a sound file (WAV, AVI): its samples have no unit of length: export ...
    """
    if (kind := _SUFFIXES.get(PurePath(name).suffix.lower())) is not None:
        raise LogError(f"{name}: {kind}, not a log")
    for magic, words in _KINDS:
        if first.startswith(magic) and (len(magic) > 2 or b"\0" in first[:64]):
            raise LogError(f"{name}: {words}")
