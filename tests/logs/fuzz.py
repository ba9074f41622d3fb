"""Mutated logs by the thousand: a recording or a clear error, never a traceback, a hang or a line unaccounted for.

Each is read twice, in blocks and line by line, with one result. `tests.armour.fuzz` runs them: its kind `log.text`.
"""

import gzip
from datetime import UTC, datetime
from pathlib import Path
from unittest.mock import patch

import numpy as np

from frictionlab.errors import FrictionlabError
from frictionlab.hdf5.recordings import pieces_of
from frictionlab.logs import LogOptions, read_log
from frictionlab.logs.table import Reader
from frictionlab.recording import Recording
from tests.armour.mutations import TEXT
from tests.logs.samples import CLEAN, truth

ROWS = 40
DAY = datetime(2026, 1, 1, tzinfo=UTC)
OPTIONS = (
    LogOptions(), LogOptions(), LogOptions(unit="mm", time_unit="s"), LogOptions(time=1, mass=2, base=3),
    LogOptions(sampling_rate_hz=250.0), LogOptions(most_damage=1.0), LogOptions(separator=";", decimal=","),
)  # fmt: skip


def case(seed: int, number: int) -> tuple[bytes, str, LogOptions]:
    """Make a mutated log, the suffix of its name and the options to read it with."""
    rng = np.random.default_rng((seed, number))
    names = list(CLEAN)
    make, encoding, _ = CLEAN[names[int(rng.integers(len(names)))]]
    raw = make(truth(ROWS, seed=int(rng.integers(5)))).encode(encoding)
    for _ in range(int(rng.integers(1, 5))):
        raw = TEXT[int(rng.integers(len(TEXT)))](raw, rng) or b"\n"
    return raw, ".csv.gz" if rng.random() < 0.05 else ".csv", OPTIONS[int(rng.integers(len(OPTIONS)))]


def lines_of(raw: bytes, encoding: str) -> int:
    """Count lines the slow and obvious way, as the encoding found has them."""
    text = raw.decode(encoding if encoding.startswith(("utf-16", "utf-32")) else "latin-1", "replace")
    if "\n" not in text[: 1 << 18]:
        text = text.replace("\r", "\n")
    return text.count("\n") + (not text.endswith("\n"))


def check(raw: bytes, suffix: str, options: LogOptions, folder: Path) -> str:
    """Read one case; the outcome in a word. Whatever else is raised is a fault."""
    path = folder / f"case{suffix}"
    path.write_bytes(gzip.compress(raw, mtime=0) if suffix.endswith(".gz") else raw)
    recording = _read(path, options)
    with patch.object(Reader, "_regular", lambda *_: None):  # every line is judged on its own
        judged = _read(path, options)
    if isinstance(recording, str) or isinstance(judged, str):
        if recording != judged:
            raise AssertionError(f"two ways to read, two results: {recording} and {judged}")
        return "refused"
    if b"".join(pieces_of(recording, created=DAY)) != b"".join(pieces_of(judged, created=DAY)):
        raise AssertionError("two ways to read, two recordings")
    lines, encoding = recording.source.lines, str(recording.source.dialect["encoding"])
    aligned = "alignment" in recording.source.dialect  # a time column per channel: samples are those in common
    if lines.read != lines_of(raw, encoding) or (lines.data != len(recording) and not aligned):
        raise AssertionError(f"{lines} for {lines_of(raw, encoding)} lines and {len(recording)} samples")
    return "damaged" if recording.source.warnings else "read"


def _read(path: Path, options: LogOptions) -> Recording | str:
    """Give the recording, or the words of the error."""
    try:
        return read_log(path, options)
    except FrictionlabError as error:
        if not str(error) or "Traceback" in str(error):
            raise AssertionError("an error without words") from error
        return str(error)
