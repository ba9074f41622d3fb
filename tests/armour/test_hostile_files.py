"""Files that lead a reader astray, are not as they were written, or make the HDF5 library loop for ever."""

import os
import struct
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.sparse
from filelock import lock_descriptor

from frictionlab.base_motion import sound_base
from frictionlab.errors import LogError, RecordingError, SceneError, SimulationError, UsageError
from frictionlab.experiment import facts_of
from frictionlab.figures.style import drawing, save
from frictionlab.hdf5 import arrays_inside, describe, is_recording, read_recording, read_tree, trial
from frictionlab.hdf5.opening import is_whole
from frictionlab.logs import LogOptions, read_log
from frictionlab.recording import Recording
from frictionlab.scene import read_scene, scene_from_tables
from frictionlab.simulator import Problem, last_cycle
from frictionlab.simulator.record import BaseRecord, respond
from frictionlab.tables import read_rows
from tests.armour.sound import case, sound


def test_a_pipe_is_no_recording(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.h5")
    with pytest.raises(RecordingError, match="a folder, a pipe or a device, not a file"):
        read_recording(tmp_path / "a.h5")
    assert not is_recording(tmp_path / "a.h5")


def test_a_group_inside_itself_is_told_and_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": "x", "format_version": 1})
        file.create_group("a")["b"] = file["/"]
    assert "  b/ (the same group as one above)" in describe(path)
    with pytest.raises(RecordingError, match="is the same group as one above"):
        read_tree(path, kind="x")


def test_a_scene_that_is_too_much_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    for value, words in (
        ("[" * 5000 + "]" * 5000, "nested too deep"),
        ("9" * 5000, "expected TOML: Exceeds the limit"),
    ):
        path.write_text(f"a = {value}")
        with pytest.raises(SceneError, match=words):
            read_scene(path)


@pytest.mark.parametrize("kind", ["pipe", "loop", "folder"])
def test_scene_and_sheet_are_files(kind: str, tmp_path: Path) -> None:
    place = tmp_path / "t.csv"
    {"pipe": os.mkfifo, "loop": lambda p: p.symlink_to(p), "folder": Path.mkdir}[kind](place)
    with pytest.raises(SceneError, match="cannot be read"):
        read_scene(place)
    for name, words in (("t.csv", "cannot be read"), ("a\0b.csv", "cannot be the name of a file")):
        with pytest.raises(SceneError, match=words):
            facts_of(scene_from_tables({"experiment": {"sheet": name}}, folder=tmp_path), Path("a.csv"))


@pytest.mark.parametrize("depth", [120, 400, 900, 100_000])
def test_json_that_is_nested_too_deep_is_refused(depth: int, tmp_path: Path) -> None:
    for begin, end in (('{"a":', "}"), ("[", "]"), ('[{"a":', "}]")):
        deep = begin * depth + "1" + end * depth
        (tmp_path / "m.jsonl").write_text(f'{{"source": "a.h5", "x": {deep}}}\n')
        with pytest.raises(UsageError, match=r"m\.jsonl, line 1: .*nested too deep"):
            read_rows(tmp_path / "m.jsonl")
        for content in (deep, f'{{"t": [1, 2, 3], "x": {deep}}}'):
            (tmp_path / "l.json").write_text(content)
            with pytest.raises(LogError, match=r"l\.json: JSON nested more than 20 deep"):
                read_log(tmp_path / "l.json")


def test_a_log_is_a_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    for name, words in (("pipe.csv", "a pipe or a device"), ("", "a folder"), ("none", "No such file")):
        with pytest.raises(LogError, match=words):
            read_log(tmp_path / name)


def test_a_name_that_is_no_text_is_drawn_as_it_is_escaped(tmp_path: Path) -> None:
    with drawing(title="caf\udce9.h5: 钢\t") as figure:
        pass
    for suffix in (".png", ".svg"):
        save(figure, tmp_path / f"a{suffix}")
    assert "caf\\udce9.h5" in [text.get_text()[:12] for text in figure.texts]


def test_more_cycles_than_anybody_waits_for_are_refused() -> None:
    with pytest.raises(UsageError, match="expected 1 to 10000000; got 1000000000"):
        last_cycle(Problem(r=0.5, beta=0.4), cycles=10**9)


@pytest.mark.parametrize("name", [b"xl/workbook.xml", b"docProps/app.xml"])
def test_a_name_in_an_archive_that_is_no_text_is_refused(name: bytes, tmp_path: Path) -> None:
    path = tmp_path / "log.xlsx"
    path.write_bytes(_with_flag(sound("log.xlsx"), 0x0800).replace(name, b"\xff" + name[1:]))
    with pytest.raises(LogError, match=r"log\.xlsx: damaged zip data"):
        read_log(path)


def test_a_matlab_file_is_checked_whatever_its_first_words_are(tmp_path: Path) -> None:
    """A type of element that there is not ends the process in SciPy; what is said to be sparse is passed over."""
    path, whole, t = tmp_path / "log.mat", sound("log.mat5"), np.arange(60) / 250
    element = whole.index(struct.pack("<I", 9), 128)
    flags = whole.index(struct.pack("<4I", 6, 8, 6, 0), 600)  # of the second variable: of doubles
    for damaged, words in (
        (b"MATLAB 5.\0" + whole[10:element] + struct.pack("<I", 0xFF09) + whole[element + 4 :], "damaged: .*: save it"),
        (whole[: flags + 8] + struct.pack("<I", 5) + whole[flags + 12 :], "no column for mass"),
    ):
        path.write_bytes(damaged)
        with pytest.raises(LogError, match=rf"log\.mat: {words}"):
            read_log(path, LogOptions(unit="mm"))
    plain = {"t": t, "x": np.sin(9 * t), "y": np.cos(9 * t), "s": scipy.sparse.eye(3, format="csc")}
    for packed in (False, True):  # sound sparse matrices are passed over
        scipy.io.savemat(path, {"log": plain} if packed else plain, do_compression=packed)
        assert len(read_log(path, LogOptions(unit="mm", mass="x", base="y"))) == 60


def test_a_member_of_an_archive_without_a_name_is_no_log(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("x", "nameless")
    path.write_bytes(path.read_bytes().replace(b"xPK", b"\0PK").replace(b"xnameless", b"\0nameless"))
    with pytest.raises(LogError, match="a zip archive of 0 files"):
        read_log(path)


def _with_flag(archive: bytes, flag: int) -> bytes:
    """The same archive with a flag (0x0001: encrypted, 0x0800: names are UTF-8) on all it holds."""
    data = bytearray(archive)
    for magic, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        at = data.find(magic)
        while at >= 0:
            data[at + offset] |= flag & 0xFF
            data[at + offset + 1] |= flag >> 8
            at = data.find(magic, at + 4)
    return bytes(data)


def test_nothing_is_simulated_across_a_hole_that_carries_no_flag() -> None:
    """Thirty years of it would be, step by step."""
    time = np.r_[np.arange(1000) / 250, 1e9 + np.arange(1000) / 250]
    base = 1e-3 * np.sin(2 * np.pi * 1.5 * np.arange(2000) / 250)
    with pytest.raises(
        RecordingError, match=r"base: no samples from 3\.996 s to 1e\+09 s: nothing is simulated across"
    ):
        sound_base(Recording(time, base, base))


def test_stamps_beyond_all_time_are_refused(tmp_path: Path) -> None:
    log = tmp_path / "a.csv"
    log.write_text("time [s],mass [mm],base [mm]\n" + "".join(f"{n}e300,{n % 7},{n % 5}\n" for n in range(300)))
    with pytest.raises(LogError, match=r"a\.csv: time: expected seconds; got 2\.99e\+302"):
        read_log(log)


def test_a_record_that_lasts_for_ages_is_not_simulated() -> None:
    with pytest.raises(SimulationError, match=r"it lasts 1\.59e\+10 natural periods; expected at most 1e\+07"):
        respond(Problem(1.0, beta=0.4), BaseRecord(np.array([0.0, 5e10, 1e11]), np.array([0.0, 1.0, 0.0])))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    found = tmp_path / "a.h5"
    found.write_bytes(sound("recording"))
    return found


@pytest.mark.parametrize("kind", ["recording", "map", "rows.h5"])
def test_what_this_package_writes_is_sealed(kind: str, path: Path) -> None:
    raw = sound(kind)
    for at in range(0, len(raw) - 16, len(raw) // 200):
        path.write_bytes(raw[:at] + bytes([raw[at] ^ 0x41]) + raw[at + 1 :])
        assert is_whole(path) is False
    for reader in (read_recording, describe):
        with pytest.raises(RecordingError, match=r"a\.h5: damaged: its bytes are not those that were written"):
            reader(path)
    assert not is_recording(path)
    path.write_bytes(raw)
    assert is_whole(path) is True
    path.write_bytes(sound(f"{kind}.bare"))
    assert is_whole(path) is None


@pytest.mark.skipif(sys.platform == "win32", reason="there memory is not bounded")
@pytest.mark.parametrize(
    ("number", "words"),
    [
        (118, "damaged"),  # an address among the root's attributes leads the library round in C for ever
        # a chunk that says it is 1.9 GB; the library's own word for no memory was passed over
        (38, "damaged: reading it takes far more memory than it holds"),
        (13510, "damaged"),  # text of an encoding that there is not
    ],
)
def test_what_the_library_does_not_survive_is_refused_in_seconds(number: int, words: str, path: Path) -> None:
    """Bytes found by the fuzz."""
    path.write_bytes(case("recording.bare", 1, number))
    start = time.monotonic()
    for reader in (read_recording, describe, lambda p: arrays_inside(p, lambda *_: None)):
        with pytest.raises(RecordingError, match=words):
            reader(path)
    assert not is_recording(path)
    assert time.monotonic() - start < 60


def test_an_attribute_that_kills_who_reads_it_by_name_is_refused(path: Path) -> None:
    """Found by the fuzz: going through all attributes of this file ends in a sentence, asking for one in a crash."""
    path.write_bytes(case("map.bare", 1, 4674))
    code = "import sys; from pathlib import Path; from frictionlab.hdf5 import describe; describe(Path(sys.argv[1]))"
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    assert "RecordingError" in done.stderr


@pytest.mark.parametrize(
    ("does", "words"),
    [
        ("import time; time.sleep(60)", "does not end"),
        ("import os; os.abort()", "ends the process"),
        ("raise SystemExit(3)", "takes far more memory than it holds"),
    ],
)
def test_what_the_trial_dies_of_is_said(
    does: str, words: str, path: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    script = tmp_path / "reader.py"
    script.write_text(does)
    monkeypatch.setattr(trial, "__file__", str(script))
    monkeypatch.setattr(trial, "_LONGEST_S", 1.0)
    path.write_bytes(sound("recording.bare"))
    os.utime(path, ns=(1, len(does)))  # as no other test has tried it
    with pytest.raises(RecordingError, match=words):
        read_recording(path)


def test_another_programs_lock_does_not_keep_readers_out(path: Path) -> None:
    with path.open("r+b", buffering=0) as writer:
        assert lock_descriptor(writer.fileno(), blocking=False)
        assert len(read_recording(path)) == 800
