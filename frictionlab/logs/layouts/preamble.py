"""What the lines above the header state: sampling interval or rate, and when the record began."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from frictionlab.logs.cells import moment, number, plain
from frictionlab.units import TIME, known_unit

_INTERVAL = re.compile(r"(samp\w*[ _-]*)?(time[ _-]*)?(interval|period)|delta_x|dt|abtastintervall", re.IGNORECASE)
_RATE = re.compile(r"samp\w*[ _-]*(rate|frequency)|abtastrate|messrate", re.IGNORECASE)
_UNIT = re.compile(r"^(.*?)\s*[\[(]?\s*(s|sec|ms|us|µs|ns|hz|khz|1/s)?\s*[\])]?\s*[:=]?$", re.IGNORECASE)
_IN_NAME = re.compile(r"(\d{4})-(\d{2})-(\d{2})[_T ](\d{2})-(\d{2})-(\d{2}(?:\.\d+)?)")
_SHORTEST_S, _LONGEST_S = 1e-9, 1e5
_HERTZ = {"hz": 1.0, "khz": 1e3, "1/s": 1.0, "": 1.0}


def stated_facts(lines: Sequence[str], decimal: str) -> dict[str, float | str]:
    """Read ``interval_s`` and ``start_s`` from lines of the form "key <separator> value", where they are stated.

    Examples
    --------
    >>> stated_facts(["Sampling time interval(ms),0.5", "made by hand"], ".")
    {'interval_s': 0.0005}
    """
    facts: dict[str, float | str] = {}
    for line in lines:
        cells = [plain(cell) for cell in re.split(r"[;\t:=]|,(?!\d)|(?<=\D),", line.lstrip("#%! "), maxsplit=1)]
        if len(cells) < 2 or len(line) > 500:
            continue
        interval = _interval(cells[0], re.split(r"[;\t]|, ?(?=\D)", cells[1])[0], decimal)
        if interval is not None:
            facts.setdefault("interval_s", interval)
    return facts


def _interval(key: str, value: str, decimal: str) -> float | None:
    match = _UNIT.match(key)
    name, unit = (match[1].strip(), (match[2] or "").lower()) if match else (key, "")
    amount, _, behind = value.strip().partition(" ")
    found = number(amount, decimal) if decimal == "." else number(amount, decimal) or number(amount, ".")
    if found is None or not 0.0 < found < float("inf"):
        return None
    unit = unit or behind.strip("[]() ").lower()
    interval = 0.0
    if _RATE.fullmatch(name) and unit in _HERTZ:
        interval = 1.0 / (found * _HERTZ[unit])
    elif _INTERVAL.fullmatch(name) and (known_unit(unit) in TIME or not unit):
        interval = found / TIME[known_unit(unit) or "s"]
    return interval if believable(interval) else None


def believable(interval_s: float) -> bool:
    """Whether samples may be so far apart [s]; a damaged preamble states anything."""
    return _SHORTEST_S < interval_s < _LONGEST_S


def start_in_name(path: Path) -> float | None:
    """When the record began, as the file's name says it [s since 1970, as if UTC].

    Examples
    --------
    >>> start_in_name(Path("protocol_optoNCDT-ILD1420_1970-01-02_00-00-01.500.csv"))
    86401.5
    """
    match = _IN_NAME.search(path.name)
    if match is None:
        return None
    return moment(f"{match[1]}-{match[2]}-{match[3]} {match[4]}:{match[5]}:{match[6]}")


def as_time(start_s: float) -> str:
    """Write a moment for people."""
    return datetime.fromtimestamp(start_s, UTC).isoformat(sep=" ", timespec="milliseconds").removesuffix("+00:00")
