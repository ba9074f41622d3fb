"""Tables by libraries of their own: Parquet by pyarrow, National Instruments' TDMS by npTDMS where it is installed."""

import logging
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.binary.sheet import Sheet, check_size, usual_length


def is_parquet(first: bytes, _path: Path) -> bool:
    """Whether a file is a Parquet table."""
    return first.startswith(b"PAR1")


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


def is_tdms(first: bytes, _path: Path) -> bool:
    """Whether a file is a TDMS log."""
    return first.startswith(b"TDSm")


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
