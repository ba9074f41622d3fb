"""National Instruments' TDMS, by npTDMS where it is installed."""

import logging
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.logs.binary.sheet import Sheet, check_size


def is_tdms(first: bytes, _path: Path) -> bool:
    """Whether a file is a TDMS log."""
    return first.startswith(b"TDSm")


def read_tdms(path: Path) -> Sheet:
    """Read the channels of the group that holds most numbers.

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
        return _sheet(file, path)


def _sheet(file: Any, path: Path) -> Sheet:
    channels = [c for group in file.groups() for c in group.channels() if len(c) > 1 and c.dtype.kind in "fiuM"]
    if not channels:
        raise LogError("no channels of numbers")
    check_size(sum(len(c) for c in channels), path.stat().st_size)
    lengths = [len(c) for c in channels]
    usual = max(set(lengths), key=lambda n: (lengths.count(n), n))
    chosen = [c for c in channels if len(c) == usual]
    names = [c.name for c in chosen]
    titles = names if len(set(names)) == len(names) else [f"{c.group_name} {c.name}" for c in chosen]
    moments = frozenset(i for i, c in enumerate(chosen) if c.dtype.kind == "M")
    return Sheet(
        "TDMS",
        tuple(titles),
        tuple(_numbers(c[:]) for c in chosen),
        tuple(_unit(c) for c in chosen),
        moments,
        _facts(chosen),
    )


def _numbers(values: NDArray[Any]) -> NDArray[np.float64]:
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]").astype(np.int64) / 1e9
    return values.astype(np.float64)


def _unit(channel: Any) -> str:
    return str(channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription") or "")


def _facts(channels: list[Any]) -> dict[str, float | str]:
    """Interval and start of the waveform, where the channels state one and the same."""
    facts: dict[str, float | str] = {}
    steps = {float(c.properties["wf_increment"]) for c in channels if c.properties.get("wf_increment")}
    if len(steps) == 1 and (step := steps.pop()) > 0.0:
        facts["interval_s"] = step
    start = channels[0].properties.get("wf_start_time")
    if start is not None and "interval_s" in facts:
        facts["start_s"] = float(np.datetime64(start, "ns").astype(np.int64)) / 1e9
    return facts
