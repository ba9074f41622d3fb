"""A table over frequency (amplitude and phase of a steady motion), in any dialect and container of a log."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.columns import LogColumn, candidates
from frictionlab.logs.table import Log, naming, open_log
from frictionlab.recording import FrequencyTable
from frictionlab.units import LENGTH, QUANTITIES

_OVER_FREQUENCY: dict[str, tuple[str, Mapping[str, float], str]] = {
    "r": (r"r|frequency[ _]ratio", dict.fromkeys(("", "-", "1"), 1.0), "r has no unit"),
    "frequency": (
        r"(drive[ _])?(frequency|freq)|f|omega|(erreger)?frequenz",
        {"hz": 1.0, "khz": 1e-3, "rad/s": 2.0 * np.pi},
        "[Hz] or [rad/s]",
    ),
    "amplitude": (
        r"((response|mass)[ _])?(amplitude|amp)([ _](ratio|y))?|gain|magnitude|transmissibility|x ?/ ?y",
        LENGTH,
        "[Y] (over the base's amplitude) or a length such as [mm]",
    ),
    "phase": (r"phase([ _](angle|lag))?|phi", QUANTITIES["angle"], "[deg] or [rad]"),
    "base_amplitude": (r"base[ _](amplitude|amp)(_m)?|basisamplitude", LENGTH, "a length such as [mm]"),
}
"""Of each column: its names, how many of its units make that of a `FrequencyTable`, and what is expected in words."""
_COLUMNS = ("drive", "drive_u", "amplitude", "amplitude_u", "phase", "phase_u", "base_amplitude")
_PART_OF_Y = re.compile(
    r"[\[({<]\s*(Y|-|1|x/y)\s*[\])}>]|^(x ?/ ?y|gain|transmissibility)\b|.*[ _](ratio|y)$", re.IGNORECASE
)


def read_frequency_table(path: Path, options: LogOptions | None = None) -> FrequencyTable | None:
    r"""Read a table of amplitude, phase or both over ``r`` or ``frequency [Hz]``; None for a file that is none.

    Columns: ``amplitude [Y]`` or in a length, ``phase [deg]`` or ``[rad]`` of the mass behind the base, and ``base
    amplitude [mm]``; a column's standard uncertainty has its name with ``_u``, and its unit where it names none. A time
    column makes it a log.

    Raises
    ------
    LogError
        A column is there twice, without a unit or in a wrong one; or no row holds numbers.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "sweep.csv"
    >>> _ = path.write_text("r;phase [deg];phase_u [deg]\n0,5;10,5;0,5\n0,8;25;0,5\n1,2;150;0,5\n")
    >>> table = read_frequency_table(path)
    >>> table.drive.tolist(), np.rad2deg(table.phase).round(9).tolist()
    ([0.5, 0.8, 1.2], [10.5, 25.0, 150.0])
    """
    try:
        log = open_log(path, options or LogOptions())
    except (LogError, OSError):
        return None  # whoever reads it as a log says why
    with naming(path):
        return _over_frequency(log)


def _over_frequency(log: Log) -> FrequencyTable | None:
    columns = log.layout.columns
    found = _by_name(columns)
    drives = [name for name in ("r", "frequency") if name in found]
    if not drives or not {"amplitude", "phase"} & set(found) or candidates(columns, "time"):
        return None
    if log.text is not None and not log.text.whole:
        raise LogError("a table over frequency of more than 256 kB: expected some hundred rows")
    numbers, used = log.numbers(), {c.index for c in found.values()}
    said = [f"column {c} is not used" for c in columns if c.index not in used]
    said += ["r is taken, frequency [Hz] is not used"] if len(drives) > 1 else []
    names = {key: key.replace("drive", drives[0]) for key in _COLUMNS}
    values = dict.fromkeys(_COLUMNS, np.full(len(numbers), np.nan))
    values |= {key: _in_si(numbers[:, found[n].index], found, n) for key, n in names.items() if n in found}
    phase = values["phase"]
    kept = np.isfinite(values["drive"]) & (np.isfinite(values["amplitude"]) | np.isfinite(phase))
    if not kept.any():
        raise LogError(f"a table over frequency: no row has numbers of {drives[0]} and a response")
    said += [f"{np.count_nonzero(~kept)} of {len(kept)} rows lack a number"] if not kept.all() else []
    if (phase[kept & np.isfinite(phase)] < 0.0).all() and np.isfinite(phase[kept]).any():
        values["phase"] = -phase
        said.append("phase: every one is below 0: taken as those of x over y, whose mass is behind by minus them")
    column = found.get("amplitude")
    return FrequencyTable(
        source=log.name,
        is_ratio=drives[0] == "r",
        in_metres=column is not None and column.unit in LENGTH,
        said=tuple(said),
        **{key: column[kept] for key, column in values.items()},
    )


def _by_name(columns: tuple[LogColumn, ...]) -> dict[str, LogColumn]:
    """The columns of a table over frequency by name, their uncertainties as ``NAME_u``."""
    found: dict[str, LogColumn] = {}
    for column in columns:
        plain = re.sub(r"[ _]u$", "", column.name)
        of_error = plain != column.name or column.title.endswith("_u")
        for name, (pattern, *_) in _OVER_FREQUENCY.items():
            if not re.fullmatch(pattern, plain.removesuffix("_u"), re.IGNORECASE):
                continue
            key = f"{name}_u" if of_error else name
            if key in found:
                raise LogError(f"columns {found[key]} and {column} are both {key}: expected one")
            found[key] = column
    return found


def _in_si(values: FloatArray, found: Mapping[str, LogColumn], name: str) -> FloatArray:
    """The numbers of a column in r, Hz, Y or m, and rad; an error without a unit has that of its number."""
    column, name = found[name], name.removesuffix("_u")
    column = column if column.unit or _PART_OF_Y.search(column.title) else found.get(name, column)
    if name == "amplitude" and column.unit in ("", "-", "1") and _PART_OF_Y.search(column.title):
        return values.copy()
    _, known, expected = _OVER_FREQUENCY[name]
    if column.unit not in known:
        got = column.unit or "no unit"
        raise LogError(f"column {column}: expected {expected}; got {got}: name the unit in the head")
    return values / known[column.unit]
