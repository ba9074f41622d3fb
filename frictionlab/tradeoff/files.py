"""The files' knobs: precision and compression of a recording, and who reads the text of a log."""

import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from frictionlab.files import write_whole
from frictionlab.hdf5 import read_recording
from frictionlab.hdf5.recordings import Compression, pieces_of
from frictionlab.logs import LogOptions, read_log
from frictionlab.recording import Recording
from frictionlab.tradeoff.setting import Setting, Trial, run_trials
from frictionlab.tradeoff.signals import recording

if TYPE_CHECKING:
    from collections.abc import Callable

FloatArray = NDArray[np.float64]
RATE_HZ = 4000.0
STEP_MM = 1.02 * 50 / 65520  # optoNCDT 1420, 50 mm measuring range
Precision = Literal["f8", "f4"]
STORED: dict[str, tuple[Precision, Compression]] = {
    "doubles": ("f8", None),
    "doubles, lzf": ("f8", "lzf"),
    "doubles, gzip 1": ("f8", 1),
    "doubles, gzip 4": ("f8", 4),
    "floats": ("f4", None),
    "floats, gzip 1": ("f4", 1),
}


def _quantised() -> Recording:
    """A recording of 280,000 samples as a sensor writes it: in steps."""
    clean = recording(RATE_HZ, 0)
    step = STEP_MM / 1e3
    mass, base = (np.round(c / step) * step for c in (clean.mass_displacement, clean.base_displacement))
    return Recording(clean.time, mass, base)


def storage() -> tuple[Setting, ...]:
    """Precision and compression of the displacements in a recording: written, read back, compared."""
    original = _quantised()
    size = float(np.abs(original.mass_displacement).max())
    sizes = {name: sum(map(len, pieces_of(original, precision=p, compression=c))) for name, (p, c) in STORED.items()}

    def error(result: object) -> float:
        back = result if isinstance(result, Recording) else original
        return float(np.abs(back.mass_displacement - original.mass_displacement).max()) / size

    with tempfile.TemporaryDirectory() as folder:
        trials = [
            Trial(name, partial(_stored, original, Path(folder) / "stored.h5", p, c), error, name == "doubles")
            for name, (p, c) in STORED.items()
        ]
        found = run_trials("recording stored as", "mass_displacement", "the recording before it was stored", trials)
    return tuple(replace(s, size_bytes=sizes[s.setting]) for s in found)


def _stored(original: Recording, path: Path, precision: Precision, compression: Compression) -> Recording:
    write_whole(path, pieces_of(original, precision=precision, compression=compression), replace=True)
    return read_recording(path)


def csv_reader() -> tuple[Setting, ...]:
    """Who turns a log's text into numbers; all but the first check nothing of what they read."""
    table = _quantised()
    columns = np.column_stack([table.time, 1e3 * table.mass_displacement, 1e3 * table.base_displacement])
    lines = [f"{t:.6f},{x:.9f},{y:.9f}" for t, x, y in columns.tolist()]
    truth = 1e-3 * np.array([float(line.split(",")[1]) for line in lines])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        write_whole(path, ("time [s],mass [mm],base [mm]\n" + "\n".join(lines) + "\n").encode())
        readers: dict[str, Callable[[], FloatArray]] = {
            "frictionlab, checked": lambda: read_log(path, LogOptions()).mass_displacement,
            "pandas, C": partial(_by_pandas, path, None),
            "pandas, round trip": partial(_by_pandas, path, "round_trip"),
            "numpy.loadtxt": lambda: 1e-3 * np.loadtxt(path, delimiter=",", skiprows=1)[:, 1],
        }
        readers["frictionlab, checked"]()  # what it loads and compiles once is not part of a log
        trials = [
            Trial(name, read, partial(_farthest, truth), name.startswith("frictionlab"))
            for name, read in readers.items()
        ]
        found = run_trials("log read by", "mass_displacement", "Python's float of each text", trials)
    return tuple(replace(s, size_bytes=sum(map(len, lines)) + len(lines)) for s in found)


def _farthest(truth: FloatArray, found: object) -> float:
    return float(np.abs(np.asarray(found) - truth).max() / np.abs(truth).max())


def _by_pandas(path: Path, precision: str | None) -> FloatArray:
    import pandas as pd  # noqa: PLC0415 - half a second that no other knob needs

    frame = pd.read_csv(path, engine="c", float_precision="round_trip" if precision else None)
    return np.asarray(1e-3 * frame.iloc[:, 1].to_numpy(dtype=np.float64))
