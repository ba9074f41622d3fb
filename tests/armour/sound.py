"""A sound file of every kind that the program reads, small, to be mutated."""

import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import scipy.io
from nptdms import ChannelObject, TdmsWriter

from frictionlab.hdf5.recordings import pieces_of
from frictionlab.maps import Grid, make_map
from frictionlab.recording import LineCount, QuarantinedLine, Recording, Source, SourceFile
from frictionlab.scene import read_scene
from frictionlab.scene.text import to_toml
from frictionlab.schema import COMPARISONS, MEASUREMENTS
from frictionlab.tables import write_rows
from tests.armour.mutations import BINARY, TEXT, cells, entries, hurt, keys
from tests.campaign.fabricate import small_campaign
from tests.desk import ROOT
from tests.logs.samples import matlab, truth, write, zipped

COLUMNS = dict(zip("txy", truth(60).columns, strict=True))


def _recording() -> Recording:
    """Sixteen cycles at 5 Hz of which the mass is held at its turning points."""
    time, rng = np.arange(800) / 250.0, np.random.default_rng(0)
    base = 1e-3 * np.sin(10 * np.pi * time)
    mass = np.clip(0.9e-3 * np.sin(10 * np.pi * time - 0.6), -0.7e-3, 0.7e-3) + 1e-6 * rng.standard_normal(800)
    source = Source(
        files=(SourceFile("a.csv", "0" * 64, 1000, LineCount(read=802, header=1, data=800, quarantined=1)),),
        dialect={"layout": "plain", "sampling_rate_hz": 250.0},
        options={"unit": "mm"},
        quarantined=(QuarantinedLine("a.csv", 17, "1,2", "two cells"),),
        warnings=("a warning",),
        evidence=("an evidence",),
    )
    return Recording(time, mass, base, source=source, experiment={"material": "steel", "normal_force_n": 1.25})


def _write(path: Path) -> None:
    """The same bytes each time."""
    path.write_bytes(b"".join(pieces_of(_recording(), created=datetime(2026, 1, 1, tzinfo=UTC))))


def _bytes_of(name: str, write: Callable[[Path], object]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / name)
        return (Path(folder) / name).read_bytes()


def _frame() -> pd.DataFrame:
    return pd.DataFrame(truth(60).columns.T, columns=["t [s]", "x [mm]", "y [mm]"])


def _rows(path: Path) -> None:
    write_rows(small_campaign()[:2], path, MEASUREMENTS)


def _sheet(path: Path) -> None:
    path.write_text("log,material,normal_force_n\n" + "".join(f"a{i},steel,{1 + i}\n" for i in range(10)))


def _map(path: Path) -> None:
    for _ in make_map(Grid((0.3, 0.5), (0.4,)), path, workers=1):
        pass


def _tdms(path: Path) -> None:
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("log", name, col.to_numpy()) for name, col in _frame().items()])


def _comparisons(path: Path) -> None:
    parameters = {"beta": {"value": 0.35, "se": 1e-3, "told": True, "lower": None, "upper": None}}
    rows = [
        {**row, "friction_ratio": 0.35, "friction_ratio_se": 1e-3, "law": "coulomb", "parameters": parameters}
        for row in small_campaign()[:2]
    ]
    write_rows(rows, path, COMPARISONS)


def _bare(write: Callable[[Path], object]) -> Callable[[Path], None]:
    """What writes the same file without its seal, as other programs leave one."""

    def bare(path: Path) -> None:
        write(path)
        with h5py.File(path, "r+"):
            pass

    return bare


MAKE: dict[str, tuple[str, Callable[[Path], object]]] = {
    "scene": ("s.toml", lambda path: path.write_text(to_toml(read_scene(ROOT / "configs" / "sample_data.toml")))),
    "sheet": ("tests.csv", _sheet),
    "recording": ("a.h5", _write),
    "map": ("m.h5", _map),
    "recording.bare": ("a.h5", _bare(_write)),
    "map.bare": ("m.h5", _bare(_map)),
    "rows.h5.bare": ("r.h5", _bare(_rows)),
    **{f"rows.{end}": (f"r.{end}", _rows) for end in ("csv", "jsonl", "h5")},
    "comparisons.csv": ("c.csv", _comparisons),
    "log.gz": ("l.csv.gz", lambda path: write(path, _frame().to_csv(index=False))),
    "log.zip": ("l.zip", lambda path: path.write_bytes(zipped(_frame().to_csv(index=False).encode(), "log.csv"))),
    "log.tdms": ("l.tdms", _tdms),
    "log.mat4": ("l.mat", lambda path: matlab(path, "4", **COLUMNS)),
    "log.mat5": ("l.mat", lambda path: scipy.io.savemat(path, {str(k): v.to_numpy() for k, v in _frame().items()})),
    "log.mat73": ("l.mat", lambda path: matlab(path, "7.3", **COLUMNS)),
    "log.parquet": ("l.parquet", lambda path: _frame().to_parquet(path)),
    "log.xlsx": ("l.xlsx", lambda path: _frame().to_excel(path, index=False)),
}
"""Kind -> name of the file, and what writes a sound one. A bare one has no seal."""
TEXTS = ("scene", "sheet", "rows.csv", "rows.jsonl", "comparisons.csv")
OTHER: dict[str, tuple[str, Callable[[bytes, np.random.Generator], bytes]]] = {
    "tree": ("recording", hurt),
    "map.tree": ("map", hurt),
    "rows.h5.tree": ("rows.h5", hurt),
    "log.mat73.tree": ("log.mat73", hurt),
    "scene.keys": ("scene", keys),
    "sheet.cells": ("sheet", cells),
    "rows.csv.cells": ("rows.csv", cells),
    "rows.jsonl.entries": ("rows.jsonl", entries),
    "comparisons.csv.cells": ("comparisons.csv", cells),
}
"""Kind -> the kind whose sound file is changed, and how: its bytes stay those of its format, what they say does not."""
MAKE |= {kind: MAKE[of] for kind, (of, _) in OTHER.items()}


@cache
def sound(kind: str) -> bytes:
    """The bytes of a sound file of this kind."""
    return _bytes_of(*MAKE[kind])


def case(kind: str, seed: int, number: int) -> bytes:
    """Make a mutated file."""
    rng = np.random.default_rng((seed, number))
    raw = sound(kind)
    if kind in OTHER:
        return OTHER[kind][1](raw, rng)
    mutations = TEXT if kind in TEXTS else BINARY
    for _ in range(int(rng.integers(1, 4))):
        raw = mutations[int(rng.integers(len(mutations)))](raw, rng) or b"\n"
    return raw
