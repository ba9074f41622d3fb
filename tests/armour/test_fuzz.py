"""A share of the mutated files of `tests.armour.fuzz`, of every kind that is read."""

from pathlib import Path

import pytest

from tests.armour import fuzz
from tests.armour.sound import MAKE, OTHER, sound

CASES = 1000
MORE = {"log.gz", "log.bz2", "log.xz", "log.zip", "log.tdms", "log.mat4", "comparisons.csv"} | set(OTHER) - {"tree"}
FEWER = dict.fromkeys(MORE, 100) | {"rows.h5.bare": 300, "rows.h5.tree": 50}
"""Of kinds beside those of the first fuzz, and of those that cost 10 ms a file and more: the suite has five minutes."""


@pytest.mark.parametrize("kind", list(MAKE))
def test_mutated_files_are_read_or_refused(kind: str, tmp_path: Path) -> None:
    cases = FEWER.get(kind, CASES)
    found = dict(fuzz.outcomes(kind, 7, range(cases), tmp_path))
    assert len(found) == cases
    assert {number: told for number, told in found.items() if told not in ("read", "refused")} == {}


@pytest.mark.parametrize("kind", list(MAKE))
def test_the_sound_file_is_read(kind: str, tmp_path: Path) -> None:
    path = tmp_path / MAKE[kind][0]
    path.write_bytes(sound(kind))
    fuzz.read(kind, path)
