"""A share of the mutated files of `tests.armour.fuzz`, of every kind that is read."""

from pathlib import Path

import pytest

from tests.armour import fuzz
from tests.armour.sound import MAKE, sound

CASES = 5
"""Of each kind; `make fuzz` reads 20,000."""


@pytest.mark.parametrize("kind", list(MAKE))
def test_mutated_files_are_read_or_refused(kind: str, tmp_path: Path) -> None:
    found = {number: outcome for number, outcome, _ in fuzz.outcomes(kind, 7, range(CASES), tmp_path)}
    assert len(found) == CASES
    assert {number: outcome for number, outcome in found.items() if outcome not in ("read", "refused")} == {}


@pytest.mark.parametrize("kind", list(MAKE))
def test_the_sound_file_is_read(kind: str, tmp_path: Path) -> None:
    path = tmp_path / MAKE[kind][0]
    path.write_bytes(sound(kind))
    fuzz.read(kind, path)
