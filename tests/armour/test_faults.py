"""A share of the mutated files of `tests.armour.fuzz`, faults that it found, and tables from elsewhere."""

import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from frictionlab.campaign.files import elsewhere, read_measurements, recording_path
from frictionlab.campaign.trials import trial_of
from frictionlab.errors import LogError, RecordingError, SceneError
from frictionlab.hdf5 import trial
from frictionlab.logs import read_log
from frictionlab.scene import scene_from_tables
from frictionlab.synthetic import virtual_tests
from frictionlab.tables import read_rows
from frictionlab.verbs.evaluate import evaluate
from tests.armour import fuzz
from tests.armour.sound import MAKE, sound
from tests.campaign.fabricate import SCENE, row, small_campaign


def test_a_number_where_matlab_names_a_class_takes_no_memory(tmp_path: Path) -> None:
    """``bytes(10**15)`` asks for so many bytes."""
    path = tmp_path / "l.mat"
    path.write_bytes(sound("log.mat73"))
    with h5py.File(path, "r+") as file:
        file["x"].attrs["MATLAB_class"] = 10**15
    with pytest.raises(LogError, match=r"l\.mat: .*no column"):
        read_log(path)


@pytest.mark.parametrize(
    ("place", "data"), [("rows/asymmetry", h5py.Empty("f8")), ("rows/asymmetry", 1.0), ("rows", np.zeros(3))]
)
def test_columns_that_are_none_are_damage(place: str, data: object, tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    path.write_bytes(sound("rows.h5"))
    with h5py.File(path, "r+") as file:
        del file[place]
        file[place] = data
    for reader in (read_rows, read_measurements):
        with pytest.raises(RecordingError, match=r"r\.h5: "):
            reader(path)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("sampling_rate_hz", 5e-324, "sampling_rate_hz"),
        ("energy_rule", 'window: {"b": 1}}', "energy_rule: expected 'last', 'all' or 'window:SECONDS'"),
    ],
)
def test_what_no_measurement_can_tell_is_left_out(key: str, value: object, words: str) -> None:
    rows = small_campaign()[:6]
    rows[0] = {**rows[0], key: value}
    (left_out,) = (t for t in evaluate(rows, scene_from_tables(SCENE)).trials if t.failed)
    assert words in str(left_out.reason)


def test_an_amplitude_that_is_no_length_makes_no_virtual_test() -> None:
    test = {"material": "steel", "normal_forces_n": [1.0], "frequency_ratios": [0.5], "friction_coefficient": 0.5}
    tables = {"synthetic": {"base_amplitude_m": 5e-324, "tests": [test]}}
    with pytest.raises(SceneError, match=r"synthetic\.base_amplitude_m: expected an amplitude"):
        virtual_tests(scene_from_tables({"rig": {"mass_kg": 3.0, "stiffness_n_per_m": 0.1}, **tables}))


CASES = 5
"""Of each kind; `make fuzz` reads 20,000."""


@pytest.mark.parametrize("kind", list(MAKE))
def test_mutated_files_are_read_or_refused(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial, "tried", fuzz.forked)
    found = {number: fuzz.check(kind, 7, number, tmp_path) for number in range(CASES)}
    assert {number: outcome for number, outcome in found.items() if outcome not in ("read", "refused")} == {}


@pytest.mark.parametrize("kind", list(MAKE))
def test_the_sound_file_is_read(kind: str, tmp_path: Path) -> None:
    path = tmp_path / MAKE[kind][0]
    path.write_bytes(sound(kind))
    fuzz.read(kind, path)


@pytest.fixture
def outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A recording beside the folder that the table and the work are in."""
    (tmp_path / "in").mkdir()
    monkeypatch.chdir(tmp_path / "in")
    path = tmp_path / "a.h5"
    path.write_bytes(sound("recording"))
    return path


@pytest.mark.parametrize("how", ["absolute", "above", "link"])
def test_a_recording_outside_is_not_opened(how: str, outside: Path) -> None:
    source = {"absolute": str(outside), "above": "../a.h5", "link": "link.h5"}[how]
    Path("link.h5").symlink_to(outside)
    trial = trial_of({**row("steel", 1.0, 0.5, 0.6), "source": source})
    assert recording_path(trial, [Path()]) is None
    assert elsewhere([trial], [Path()]) == ([source] if how != "link" else [])
    assert recording_path(trial, [outside.parent]) is not None


def test_what_is_not_opened_is_said(outside: Path) -> None:
    rows = [{**row("steel", force, 0.5, 0.6), "source": f"{outside.parent}/{force}.h5"} for force in (1.0, 1.5)]
    (note,) = [n for n in evaluate(rows, scene_from_tables(SCENE)).notes if "not opened" in n or "ments' sources" in n]
    assert note.startswith("2 tests name recordings outside the folders of their tables and the working folder (such")
    os.link(outside, "1.0.h5")
    (note,) = [n for n in evaluate(rows, scene_from_tables(SCENE), folders=["."]).notes if "not opened" in n]
    assert note.startswith("1 tests")


@pytest.mark.parametrize("source", ["a\0b.h5", "x" * 5000 + ".h5", "loop.h5", "pipe.h5"])
def test_a_source_that_cannot_be_a_file_is_none(source: str, outside: Path) -> None:
    Path("loop.h5").symlink_to("loop.h5")
    os.mkfifo("pipe.h5")
    assert recording_path(trial_of({**row("steel", 1.0, 0.5, 0.6), "source": source}), [outside.parent]) is None
