"""Tables of measurements from elsewhere: many materials, long names, paths that lead out of the folder."""

import os
from pathlib import Path

import pytest

from frictionlab.campaign.files import elsewhere, recording_of
from frictionlab.campaign.trials import LONGEST_NAME, trial_of
from frictionlab.scene import scene_from_tables
from frictionlab.verbs.evaluate import evaluate
from tests.armour.sound import sound
from tests.campaign.fabricate import SCENE, row


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
    assert recording_of(trial, [Path()]) is None
    assert elsewhere([trial], [Path()]) == ([source] if how != "link" else [])
    assert recording_of(trial, [outside.parent]) is not None


def test_what_is_not_opened_is_said(outside: Path) -> None:
    rows = [{**row("steel", force, 0.5, 0.6), "source": f"{outside.parent}/{force}.h5"} for force in (1.0, 1.5)]
    (note,) = [note for note in evaluate(rows, scene_from_tables(SCENE)).notes if "not opened" in note]
    assert note.startswith("2 tests name recordings outside the folders of their tables and the working folder (such")
    os.link(outside, "1.0.h5")
    (note,) = [n for n in evaluate(rows, scene_from_tables(SCENE), folders=["."]).notes if "not opened" in n]
    assert note.startswith("1 tests")


@pytest.mark.parametrize("source", ["a\0b.h5", "x" * 5000 + ".h5", "loop.h5", "pipe.h5"])
def test_a_source_that_cannot_be_a_file_is_none(source: str, outside: Path) -> None:
    Path("loop.h5").symlink_to("loop.h5")
    os.mkfifo("pipe.h5")
    assert recording_of(trial_of({**row("steel", 1.0, 0.5, 0.6), "source": source}), [outside.parent]) is None


def test_a_name_too_long_for_a_figure_is_a_reason() -> None:
    assert trial_of(row("x" * LONGEST_NAME, 1.0, 0.5, 0.6)).reason is None
    reason = trial_of(row("x" * 5000, 1.0, 0.5, 0.6)).reason
    assert reason == "material: expected a name of at most 60 characters; got 5000: shorten it"
