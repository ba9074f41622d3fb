"""A file that is not as it was written is refused before the library sees it; one that nobody vouches for is tried."""

import os
import subprocess
import sys
import time
from pathlib import Path

import h5py
import pytest
from filelock import lock_descriptor

from frictionlab.errors import RecordingError
from frictionlab.hdf5 import arrays_inside, describe, is_recording, read_recording, trial
from frictionlab.hdf5.opening import is_whole
from tests.armour.sound import case, sound


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


def test_a_recording_that_others_have_changed_is_tried_and_read(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["experiment"].attrs["material"] = "brass"
    assert is_whole(path) is None
    assert read_recording(path).experiment["material"] == "brass"


def test_a_file_that_makes_the_library_loop_is_refused_in_seconds(path: Path) -> None:
    """Bytes found by the fuzz: an address among the root's attributes leads the library round in C for ever."""
    path.write_bytes(case("recording.bare", 1, 118))
    start = time.monotonic()
    for reader in (read_recording, describe, lambda p: arrays_inside(p, lambda *_: None)):
        with pytest.raises(RecordingError, match="damaged"):
            reader(path)
    assert not is_recording(path)
    assert time.monotonic() - start < 60


@pytest.mark.skipif(sys.platform == "win32", reason="there memory is not bounded")
def test_a_small_file_that_takes_gigabytes_is_refused(path: Path) -> None:
    """Found by the fuzz: a chunk that says it is 1.9 GB; the library's own word for no memory was passed over."""
    path.write_bytes(case("recording.bare", 1, 3932))
    for reader in (read_recording, describe):
        with pytest.raises(RecordingError, match="damaged: reading it takes far more memory than it holds"):
            reader(path)


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
