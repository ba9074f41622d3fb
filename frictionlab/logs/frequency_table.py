"""A table over frequency (amplitude and phase of a steady motion) in any dialect of a log."""

import re
from collections.abc import Collection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.columns import LogColumn, candidates
from frictionlab.logs.table import open_log
from frictionlab.recording import FrequencyTable
from frictionlab.units import LENGTH, QUANTITIES, to_si

_NAMES = {
    "r": re.compile(r"r|frequency[ _]ratio", re.IGNORECASE),
    "frequency": re.compile(r"(drive[ _])?(frequency|freq)|f", re.IGNORECASE),
    "amplitude": re.compile(r"(response[ _])?(amplitude|amp)", re.IGNORECASE),
    "phase": re.compile(r"phase([ _](angle|lag))?|phi", re.IGNORECASE),
    "base amplitude": re.compile(r"base[ _](amplitude|amp)(_m)?", re.IGNORECASE),
}
_HERTZ = {"hz": 1.0, "khz": 1e3}
_UNITS: dict[str, tuple[Collection[str], str]] = {
    "r": (("", "-", "1"), "r has no unit"),
    "frequency": (_HERTZ, "[Hz]"),
    "amplitude": (LENGTH, "[Y] (over the base's amplitude) or a length such as [mm]"),
    "phase": (QUANTITIES["angle"], "[deg] or [rad]"),
    "base amplitude": (LENGTH, "a length such as [mm]"),
}
"""Units of each column, and what is expected in words."""
_PART_OF_Y = re.compile(r"[\[({<]\s*(Y|-|1|x/y)\s*[\])}>]", re.IGNORECASE)


def read_frequency_table(path: Path, options: LogOptions | None = None) -> FrequencyTable | None:
    r"""Read a table of amplitude, phase or both over ``r`` or ``frequency [Hz]``; None for a file that is none.

    Columns: ``amplitude [Y]`` or in a length, ``phase [deg]`` or ``[rad]`` of the mass behind the base, and ``base
    amplitude [mm]``; a column's standard uncertainty has its name with ``_u``. A time column makes it a log.

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
    except LogError:
        return None  # whoever reads it as a log says why
    columns, numbers = log.layout.columns, log.numbers()
    found = _found(columns, path.name)
    drives = [name for name in ("r", "frequency") if name in found]
    if not drives or not {"amplitude", "phase"} & set(found) or candidates(columns, "time"):
        return None
    if numbers is None:
        raise LogError(f"{path.name}: a table over frequency of more than 256 kB: expected some hundred rows")
    used = {c.index for c in found.values()}
    said = [f"column {c} is not used" for c in columns if c.index not in used]
    said += ["r is taken, frequency [Hz] is not used"] if len(drives) > 1 else []
    absent = np.full(len(numbers), np.nan)

    def values(name: str) -> NDArray[np.float64]:
        column = found.get(name)
        return absent.copy() if column is None else _in_si(numbers[:, column.index], column, name, path.name)

    drive = values(drives[0])
    kept = np.isfinite(drive) & (np.isfinite(values("amplitude")) | np.isfinite(values("phase")))
    if not kept.any():
        raise LogError(f"{path.name}: a table over frequency: no row has numbers of {drives[0]} and a response")
    said += [f"{np.count_nonzero(~kept)} of {len(kept)} rows lack a number"] if not kept.all() else []
    phase = values("phase")
    if (phase[kept & np.isfinite(phase)] < 0.0).all() and np.isfinite(phase[kept]).any():
        phase = -phase
        said.append("phase: every one is below 0: taken as those of x over y, whose mass is behind by minus them")
    column = found.get("amplitude")
    return FrequencyTable(
        source=path.name,
        is_ratio=drives[0] == "r",
        in_metres=column is not None and column.unit in LENGTH,
        drive=drive[kept],
        drive_u=values(f"{drives[0]}_u")[kept],
        amplitude=values("amplitude")[kept],
        amplitude_u=values("amplitude_u")[kept],
        phase=phase[kept],
        phase_u=values("phase_u")[kept],
        base_amplitude=values("base amplitude")[kept],
        said=tuple(said),
    )


def _found(columns: tuple[LogColumn, ...], file: str) -> dict[str, LogColumn]:
    """The columns of a table over frequency by name, their uncertainties as ``NAME_u``."""
    found: dict[str, LogColumn] = {}
    for column in columns:
        plain = re.sub(r"[ _]u$", "", column.name)
        of_error = plain != column.name or column.title.endswith("_u")
        for name, pattern in _NAMES.items():
            if not pattern.fullmatch(plain.removesuffix("_u")):
                continue
            key = f"{name}_u" if of_error else name
            if key in found:
                raise LogError(f"{file}: columns {found[key]} and {column} are both {key}: expected one")
            found[key] = column
    return found


def _in_si(values: NDArray[np.float64], column: LogColumn, name: str, file: str) -> NDArray[np.float64]:
    """The numbers of a column in r, Hz, Y or m, and rad."""
    name = name.removesuffix("_u")
    if name == "amplitude" and _PART_OF_Y.search(column.title):
        return values.copy()
    known, expected = _UNITS[name]
    if column.unit not in known:
        got = column.unit or "no unit"
        raise LogError(f"{file}: column {column}: expected {expected}; got {got}: name the unit in the head")
    if name in ("r", "frequency"):
        return values * _HERTZ.get(column.unit, 1.0)
    return to_si(values.copy(), column.unit)
