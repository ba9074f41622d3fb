"""Logs that are not text, each read by a small adapter over a library into columns of doubles; `READERS` lists them.

MATLAB's .mat, foreign HDF5, NumPy, JSON, Parquet, and National Instruments' TDMS where npTDMS is installed. Excel's
workbooks become text instead (`frictionlab.logs.text`), which also names what is known and not read.
"""

import json
import logging
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import FrictionlabError, LogError
from frictionlab.files import check_regular
from frictionlab.hdf5 import arrays_inside, is_recording, matlab_inside
from frictionlab.log_options import LogOptions
from frictionlab.logs.columns import columns_of
from frictionlab.logs.dialect import LogLayout
from frictionlab.units import known_unit

FREE_BYTES = 1 << 28
MOST_DEPTH = 20  # of JSON
MOST_EXPANSION = 200
"""Numbers may take this many times the file's size, and always `FREE_BYTES`."""
_RATES = ("fs", "sampling_rate", "samplerate", "sample_rate", "srate", "f_s")
_STEPS = ("dt", "ts", "tsample", "sampling_interval", "wf_increment")
_FACTS = dict.fromkeys((*_RATES, *_STEPS), "interval_s") | {"wf_start_time": "start_s"}
_MOST_COLUMNS = 64  # of a matrix


def read_container(path: Path, options: LogOptions) -> tuple[LogLayout, tuple[FloatArray, ...]] | None:
    """Read a log of a kind in `READERS`: what its columns are, and they, (n,) each, nan for no value; else None."""
    check_regular(path)
    with path.open("rb") as file:
        kind = _kind_of(file.read(1024), path)
    if not kind:
        return None
    name, read = READERS[kind]
    try:
        return _columns(name, read(path), options)
    except FrictionlabError:
        raise
    except Exception as error:
        raise LogError(f"a damaged {kind} file ({type(error).__name__}: {error}): save it again") from error


def _kind_of(first: bytes, path: Path) -> str:
    """Which of `READERS` reads a file, by its first bytes and its name; "" for none."""
    suffix = path.suffix.lower()
    if b"\x89HDF\r\n\x1a\n" in first:  # that of MATLAB 7.3 begins behind 512 bytes
        return "hdf5"
    if first.startswith((b"MATLAB 5.0", b"MATLAB 7.3")) or (suffix == ".mat" and b"\0" in first[:20]):
        return "matlab"
    if first.startswith(b"\x93NUMPY") or (first.startswith(b"PK") and suffix == ".npz"):
        return "numpy"
    is_table = suffix == ".jsonl" and first.startswith((b'{"source"', b'{"log"'))  # of results, or of truths
    if suffix in (".json", ".jsonl") and first.lstrip()[:1] in (b"{", b"[") and not is_table:
        return "json"
    return {b"TDSm": "tdms", b"PAR1": "parquet"}.get(first[:4], "")


def _hdf5(path: Path) -> Any:
    """MATLAB 7.3, and whatever else is HDF5."""
    if is_recording(path):
        raise LogError("a recording of frictionlab, not a log: give it to `frictionlab analyze`")
    return arrays_inside(path, _check_size)


def _matlab(path: Path) -> Any:
    """Versions 4 to 7."""
    content, others = matlab_inside(path)
    if not content:
        raise _no_arrays(others)
    return content


def _numpy(path: Path) -> Any:
    """Arrays of numbers; none of Python objects."""
    if path.suffix.lower() == ".npz":
        with zipfile.ZipFile(path) as archive:
            _check_size(sum(member.file_size for member in archive.infolist()) // 8, path.stat().st_size)
        with np.load(path, allow_pickle=False) as found:
            return dict(found)
    array = np.load(path, allow_pickle=False, mmap_mode="r")
    _check_size(int(array.size), path.stat().st_size)
    return {path.stem: np.array(array)} if array.dtype.names is None else np.array(array)


def _json(path: Path) -> Any:
    """Arrays by name, records (a mapping a row, in JSON Lines too), columns with data, or a list of tests."""
    if path.stat().st_size > FREE_BYTES:
        raise LogError(f"more than {FREE_BYTES / 1e6:.0f} MB of JSON: save it as text or Parquet")
    too_deep = f"JSON nested more than {MOST_DEPTH} deep: expected arrays by name: save the log's arrays alone"
    try:
        raw = path.read_bytes()
        is_lines = path.suffix.lower() == ".jsonl"
        content = [json.loads(line) for line in raw.splitlines() if line.strip()] if is_lines else json.loads(raw)
    except RecursionError as error:
        raise LogError(too_deep) from error
    level = [content]
    for _ in range(MOST_DEPTH):
        inner = (each.values() if isinstance(each, dict) else each for each in level)
        level = [value for values in inner for value in values if isinstance(value, (dict, list))]
    if level:
        raise LogError(too_deep)
    return content


def _parquet(path: Path) -> Any:
    """The columns of numbers and of moments."""
    import pyarrow as pa  # noqa: PLC0415 - 0.1 s that other logs need not wait for
    import pyarrow.parquet as pq  # noqa: PLC0415

    file = pq.ParquetFile(path)
    _check_size(file.metadata.num_rows * file.metadata.num_columns, path.stat().st_size)
    table, columns = file.read(), dict[str, NDArray[Any]]()
    for name in table.column_names:
        column, kind = table.column(name), table.schema.field(name).type
        if pa.types.is_decimal(kind):
            columns[name] = column.cast(pa.float64(), safe=False).to_numpy()
        elif pa.types.is_timestamp(kind) or pa.types.is_floating(kind) or pa.types.is_integer(kind):
            columns[name] = column.to_numpy()
    return columns


def _tdms(path: Path) -> Any:
    """The channels of the length that most have, with their units; the waveform's interval and start."""
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
        _check_size(sum(len(c) for c in channels), path.stat().st_size)
        chosen = [c for c in channels if len(c) == _usual_length(channels)]
        names = [c.name for c in chosen]
        names = names if len(set(names)) == len(names) else [f"{c.group_name} {c.name}" for c in chosen]
        units = [c.properties.get("unit_string") or c.properties.get("NI_UnitDescription") or "" for c in chosen]
        steps = {float(c.properties["wf_increment"]) for c in chosen if c.properties.get("wf_increment")}
        content: dict[str, Any] = {"units": dict(zip(names, units, strict=True))}
        if len(steps) == 1:
            content["wf_increment"] = steps.pop()
            content["wf_start_time"] = chosen[0].properties.get("wf_start_time")
        return content | {name: c[:] for name, c in zip(names, chosen, strict=True)}


READERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "hdf5": ("MATLAB", _hdf5),
    "matlab": ("MATLAB", _matlab),
    "numpy": ("NumPy", _numpy),
    "json": ("JSON", _json),
    "parquet": ("Parquet", _parquet),
    "tdms": ("TDMS", _tdms),
}
"""Kind -> the layout's name, and what reads its arrays, by name, in structures, lists of records, several tests."""


def _check_size(numbers: int, packed: int) -> None:
    """Refuse a file of so many bytes that asks for far more memory, by its count of doubles, than a log of it could."""
    most = max(FREE_BYTES, MOST_EXPANSION * packed)
    if 8 * numbers > most:
        raise LogError(
            f"a file of {packed} bytes that asks for {8 * numbers / 1e9:.3g} GB of numbers: accepted are "
            f"{most / 1e9:.3g} GB: expected a log"
        )


def _no_arrays(got: str) -> LogError:
    return LogError(
        f"no arrays of numbers found: expected vectors such as t, x, y; got {got or 'nothing'}: save the columns of "
        "tables and other objects as plain vectors (x = T.x; save log.mat t x y)"
    )


def _columns(name: str, content: Any, options: LogOptions) -> tuple[LogLayout, tuple[FloatArray, ...]]:
    """The columns of the test that is asked for, in what a container holds: those of the length that most have."""
    if options.variable is not None:
        content = _part(content, options.variable)
    found = _tests(content)
    if options.test is not None and not 1 <= int(options.test) <= len(found):
        raise LogError(f"--test {options.test}: expected one of 1 to {len(found)}, as many as the file holds")
    if options.test is None and len(found) > 1:
        raise LogError(f"holds {len(found)} tests: which one? give --test 1 to --test {len(found)}")
    chosen = found[int(options.test or 1) - 1]
    columns: dict[tuple[str, ...], NDArray[Any]] = {}
    facts: dict[str, float] = {}
    for path, value in _leaves((), chosen):
        plain, flat = path[-1].lower(), value.squeeze()
        if flat.ndim == 1:
            columns[path] = flat
        elif flat.ndim == 2:
            tall = flat if flat.shape[0] >= flat.shape[1] else flat.T
            numbered = range(min(tall.shape[1], _MOST_COLUMNS))
            columns |= {(*path[:-1], f"{path[-1]}{i + 1}"): tall[:, i] for i in numbered}
        elif value.size == 1 and plain in _FACTS and 0.0 < (number := float(_doubles(flat))) < np.inf:
            facts[_FACTS[plain]] = 1.0 / number if plain in _RATES else number
    if not columns:
        raise _no_arrays(_names(chosen))
    usual = _usual_length([*columns.values()])
    wanted = {path: column for path, column in columns.items() if len(column) == usual}
    short = [path[-1] for path in wanted]
    titles = short if len(set(short)) == len(short) else [*map(".".join, wanted)]
    said = chosen.get("units", {}) if isinstance(chosen, Mapping) else {}
    units = [known_unit(str(said.get(title, ""))) for title in titles] if isinstance(said, Mapping) else []
    kinds = "".join("m" if column.dtype.kind == "M" else "n" for column in wanted.values())
    evidence = (f"{len(titles)} columns of {usual} numbers",)
    layout = LogLayout(
        "", "", kinds, evidence=evidence, name=name, columns=columns_of(titles, units, kinds), facts=facts
    )
    return layout, tuple(map(_doubles, wanted.values()))


def _doubles(values: NDArray[Any]) -> FloatArray:
    """As doubles; moments as seconds since 1970, nan for none."""
    if values.dtype.kind != "M":
        return values.astype(np.float64)
    return np.where(np.isnat(values), np.nan, values.astype("datetime64[ns]").astype(np.int64) / 1e9)


def _part(content: Any, variable: str) -> Any:
    """A variable by its name, or by its path: ``data.run``."""
    for name in variable.split("."):
        if not isinstance(content, Mapping) or name not in content:
            raise LogError(f"--variable {variable!r}: expected one of {_names(content)}; got no such one")
        content = content[name]
    return content if isinstance(content, (Mapping, list)) or _cells(content) else {variable: content}


def _names(content: Any) -> str:
    return ", ".join(map(str, content)) if isinstance(content, Mapping) and content else "none"


def _tests(content: Any) -> list[Any]:
    """The tests in a container: a list of them, mappings of the same keys, or cells of the same number; else one."""
    while isinstance(content, Mapping) and len(content) == 1:
        (inner,) = content.values()
        if not isinstance(inner, Mapping) and not (isinstance(inner, list) and _cells(inner)):
            break
        content = inner
    if isinstance(content, list) and content and all(isinstance(each, Mapping) for each in content):
        if not any(np.ndim(value) for each in content for value in each.values()):
            return [{key: [each.get(key) for each in content] for key in content[0]}]  # records: a row each
        return content
    if not isinstance(content, Mapping):
        content = {"column": content}
    if {"columns", "data"} <= set(content) and np.ndim(content["data"]) == 2:
        names, data = [str(name) for name in content["columns"]], np.asarray(content["data"], dtype=object)
        data = data if len(data) == len(names) != data.shape[1] else data.T
        said = content.get("units", {})
        if len(data) != len(names) or (isinstance(said, list) and len(said) != len(names)):
            raise LogError(f"columns: {len(names)} names for {len(data)} columns of data, units {said}: name each")
        units = dict(zip(names, said, strict=True)) if isinstance(said, list) else said
        return [dict(zip(names, data, strict=True)) | {"units": units}]
    groups = [each for each in content.values() if isinstance(each, Mapping)]
    if len(groups) > 1 and len({tuple(each) for each in groups}) == 1:
        return groups
    cells = {name: each for name, each in content.items() if _cells(each)}
    if len(cells) == len(content) == 1:
        ((name, some),) = cells.items()
        if {np.ndim(each) for each in some} == {1} and len({len(each) for each in some}) == 1:  # columns of one test
            return [{f"{name}{i}": each for i, each in enumerate(some, 1)}]
    counts = {len(each) for each in cells.values()}
    if len(counts) == 1 and (count := counts.pop()) > 1:
        shared = {name: each for name, each in content.items() if name not in cells}
        return [shared | {name: each[i] for name, each in cells.items()} for i in range(count)]
    return [content]


def _cells(value: Any) -> bool:
    """Whether this is a row of arrays, as MATLAB's cells are (in JSON those of several lengths), or of structures."""
    if not isinstance(value, (list, np.ndarray)) or not len(np.atleast_1d(np.asarray(value, dtype=object))):
        return False
    if isinstance(value, np.ndarray):
        return value.dtype == object and all(np.ndim(each) in (1, 2) for each in value)
    if all(isinstance(each, Mapping) for each in value):
        return True
    return len({np.size(each) for each in value}) > 1 and all(np.ndim(each) == 1 for each in value)


def _leaves(path: tuple[str, ...], value: Any) -> Iterator[tuple[tuple[str, ...], NDArray[Any]]]:
    """The arrays of numbers and moments below a part of a container, each with its path; no value is nan."""
    if isinstance(value, Mapping):
        for key, inner in value.items() if len(path) < 3 else ():
            yield from _leaves((*path, str(key)), inner)
        return
    try:
        array = np.asarray(value)
        if array.dtype.names is not None:
            for field in array.dtype.names:
                yield from _leaves((*path, field), array[field])
            return
        if array.dtype == object:
            array = np.array([np.nan if each is None else each for each in array.ravel()]).reshape(array.shape)
    except ValueError:  # rows of several lengths
        return
    if array.dtype.kind in "fiuM" and array.size:
        yield path, array


def _usual_length(columns: Sequence[Any]) -> int:
    """The length that most columns have; of several, the largest."""
    lengths = [len(column) for column in columns]
    return max(set(lengths), key=lambda n: (lengths.count(n), n))
