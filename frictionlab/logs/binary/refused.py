"""Files that are no logs, or logs of a kind that is not read: named, with what to do."""

from pathlib import PurePath

from frictionlab.errors import LogError

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
    (b"\x93NUMPY", "a NumPy array: save it as text, with names above its columns"),
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
