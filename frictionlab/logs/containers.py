"""Logs that are not text, each read by a small adapter over a library; `READERS` lists them.

MATLAB's .mat, foreign HDF5, NumPy, JSON, Parquet, and National Instruments' TDMS where npTDMS is installed. Excel's
workbooks become text instead (`frictionlab.logs.unpack`). What is known and not read is named by `refuse_by_name`.
"""

import json
import logging
import warnings
import zipfile
from importlib.util import find_spec
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import FrictionlabError, LogError
from frictionlab.hdf5 import arrays_inside, is_recording
from frictionlab.hdf5.trial import fault_of
from frictionlab.log_options import LogOptions
from frictionlab.logs.sheet import FREE_BYTES, Sheet, check_size, sheet_of, usual_length

_READ = (
    *("double", "single", "logical", "struct", "cell"),
    *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
)
"""Kinds of MATLAB's variables, as scipy calls them, that are read: others hold no vector."""


def read_matlab(path: Path, options: LogOptions) -> Sheet:
    """Read the arrays of a file: versions 4 to 7 by scipy, 7.3 (HDF5) by h5py.

    Raises
    ------
    LogError
        Damaged, of another kind, or without arrays of numbers: what is there is named.
    """
    with path.open("rb") as file:
        is_hdf5 = b"\x89HDF" in file.read(1024)
    if is_hdf5:
        if is_recording(path):
            raise LogError("a recording of frictionlab, not a log: give it to `frictionlab analyze`")
        return sheet_of("MATLAB", arrays_inside(path, check_size), options)
    if fault := fault_of(path):
        raise LogError(f"damaged: {fault}: save it again")
    from scipy.io import loadmat, whosmat  # noqa: PLC0415 - 0.2 s that other logs need not wait for

    listed = whosmat(str(path))
    check_size(sum(int(np.prod(shape)) for _, shape, _ in listed), path.stat().st_size)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # duplicate names, objects it passes over
        wanted = [name for name, _, kind in listed if kind in _READ]
        found = loadmat(str(path), simplify_cells=True, variable_names=wanted)
    content = {name: value for name, value in found.items() if not name.startswith("__")}
    others = ", ".join(f"{name} ({kind})" for name, _, kind in listed) or "nothing"
    return sheet_of("MATLAB", content, options, others)


def read_numpy(path: Path, options: LogOptions) -> Sheet:
    """Read the arrays of a file; none that holds Python objects is.

    Raises
    ------
    LogError
        Damaged, larger than it may be, or without arrays of numbers.
    """
    if path.suffix.lower() == ".npz":
        with zipfile.ZipFile(path) as archive:
            check_size(sum(member.file_size for member in archive.infolist()) // 8, path.stat().st_size)
        with np.load(path, allow_pickle=False) as found:
            return sheet_of("NumPy", dict(found), options)
    array = np.load(path, allow_pickle=False, mmap_mode="r")
    check_size(int(array.size), path.stat().st_size)
    return sheet_of("NumPy", {path.stem: np.array(array)} if array.dtype.names is None else np.array(array), options)


def read_json(path: Path, options: LogOptions) -> Sheet:
    """Read arrays by name, records (a mapping a row), columns with data, or a list of tests.

    Raises
    ------
    LogError
        Damaged, larger than it may be, or without arrays of numbers.
    """
    if path.stat().st_size > FREE_BYTES:
        raise LogError(f"more than {FREE_BYTES / 1e6:.0f} MB of JSON: save it as text or Parquet")
    return sheet_of("JSON", json.loads(path.read_bytes()), options)


def read_parquet(path: Path, _options: LogOptions) -> Sheet:
    """Read the columns of numbers and of moments.

    Raises
    ------
    LogError
        Damaged, or without such columns.
    """
    import pyarrow as pa  # noqa: PLC0415 - 0.1 s that other logs need not wait for
    import pyarrow.parquet as pq  # noqa: PLC0415

    file = pq.ParquetFile(path)
    check_size(file.metadata.num_rows * file.metadata.num_columns, path.stat().st_size)
    table = file.read()
    chosen, moments = dict[str, NDArray[np.float64]](), set[int]()
    for name in table.column_names:
        column, kind = table.column(name), table.schema.field(name).type
        if pa.types.is_timestamp(kind):
            moments.add(len(chosen))
            nanoseconds = column.cast(pa.timestamp("ns")).cast(pa.int64())
            chosen[name] = np.asarray(nanoseconds.to_numpy(), dtype=np.float64) / 1e9
        elif pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind):
            chosen[name] = np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
    if not chosen:
        raise LogError(f"no columns of numbers; got {', '.join(table.column_names) or 'none'}")
    return Sheet("Parquet", tuple(chosen), tuple(chosen.values()), moments=frozenset(moments))


def read_tdms(path: Path, _options: LogOptions) -> Sheet:
    """Read the channels of the length that most have, with their units; and the waveform's interval and start.

    Raises
    ------
    LogError
        npTDMS is not installed; or the file is damaged or without channels of numbers.
    """
    if find_spec("nptdms") is None:
        raise LogError(
            "a TDMS log: reading it needs npTDMS: pip install npTDMS (or frictionlab[tdms]), or export it as text"
        )
    from nptdms import TdmsFile  # noqa: PLC0415 - optional

    for logger in [name for name in logging.root.manager.loggerDict if name.startswith("nptdms")]:
        logging.getLogger(logger).setLevel(logging.CRITICAL)  # what it complains of is said here
    with path.open("rb") as handle, TdmsFile.open(handle) as file:
        channels = [c for group in file.groups() for c in group.channels() if len(c) > 1 and c.dtype.kind in "fiuM"]
        if not channels:
            raise LogError("no channels of numbers")
        check_size(sum(len(c) for c in channels), path.stat().st_size)
        chosen = [c for c in channels if len(c) == usual_length(channels)]
        names = [c.name for c in chosen]
        units = (c.properties.get("unit_string") or c.properties.get("NI_UnitDescription") or "" for c in chosen)
        return Sheet(
            "TDMS",
            tuple(names if len(set(names)) == len(names) else [f"{c.group_name} {c.name}" for c in chosen]),
            tuple(_doubles(c[:]) for c in chosen),
            tuple(map(str, units)),
            frozenset(i for i, c in enumerate(chosen) if c.dtype.kind == "M"),
            _waveform(chosen),
        )


def _doubles(values: NDArray[Any]) -> NDArray[np.float64]:
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]").astype(np.int64) / 1e9
    return values.astype(np.float64)


def _waveform(channels: list[Any]) -> dict[str, float | str]:
    """Interval and start of the waveform, where the channels state one and the same."""
    facts: dict[str, float | str] = {}
    steps = {float(c.properties["wf_increment"]) for c in channels if c.properties.get("wf_increment")}
    if len(steps) == 1 and (step := steps.pop()) > 0.0:
        facts["interval_s"] = step
    start = channels[0].properties.get("wf_start_time")
    if start is not None and "interval_s" in facts:
        facts["start_s"] = float(np.datetime64(start, "ns").astype(np.int64)) / 1e9
    return facts


READERS = {
    "matlab": read_matlab, "numpy": read_numpy, "json": read_json, "parquet": read_parquet, "tdms": read_tdms,
}  # fmt: skip


def kind_of_container(first: bytes, path: Path) -> str:
    """Which of `READERS` reads a file, by its first bytes and its name; "" for none."""
    suffix = path.suffix.lower()
    if first.startswith((b"MATLAB 5.0", b"MATLAB 7.3", b"\x89HDF\r\n\x1a\n")) or (
        suffix == ".mat" and b"\0" in first[:20]
    ):
        return "matlab"
    if first.startswith(b"\x93NUMPY") or (first.startswith(b"PK") and suffix == ".npz"):
        return "numpy"
    if suffix == ".json" and first.lstrip()[:1] in (b"{", b"["):
        return "json"
    return {b"TDSm": "tdms", b"PAR1": "parquet"}.get(first[:4], "")


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
    (b"BZh", "compressed by bzip2: unpack it first, or pack it by gzip or zip"),
    (b"\xfd7zXZ\0", "compressed by xz: unpack it first, or pack it by gzip or zip"),
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
    kind = kind_of_container(first, path)
    try:
        return READERS[kind](path, options) if kind else None
    except FrictionlabError as error:
        raise LogError(f"{path.name}: {error}") from error
    except MemoryError:
        raise
    except Exception as error:
        raise LogError(
            f"{path.name}: a damaged {kind} file ({type(error).__name__}: {error}): save it again"
        ) from error


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
