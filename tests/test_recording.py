"""A recording is validated once, and cuts itself into sound stretches."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.errors import RecordingError
from frictionlab.recording import LineCount, Quality, Recording, Source, SourceFile
from frictionlab.sampling import sampling_interval

T = np.arange(100, dtype=np.float64) * np.float64(0.01)
X = np.sin(T)
FIFTH = np.arange(100) == 5


def test_arrays_cannot_be_changed() -> None:
    own = X.copy()
    recording = Recording(T, own, own, experiment={"material": "steel"})
    own[5] = np.nan
    np.testing.assert_array_equal(recording.mass_displacement, X)
    assert recording == recording and {recording: 1}  # noqa: PT018, PLR0124 - by identity: arrays have no single answer
    with pytest.raises(ValueError, match="read-only"):
        recording.time[0] = 1.0
    with pytest.raises(TypeError, match="does not support item assignment"):
        recording.experiment["material"] = "rubber"  # type: ignore[index] # that it is refused is the test


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ((T, X[:-1], X), "expected arrays of one length"),
        ((T[:1], X[:1], X[:1]), "at least 2 samples"),
        ((T[::-1], X, X), "expected increasing stamps"),
        ((np.where(FIFTH, T[4], T), X, X), "expected increasing stamps; got 0.04 then 0.04 at sample 5"),
        ((np.where(FIFTH, np.nan, T), X, X), "expected finite stamps"),
        ((np.append(T[:-1], np.inf), X, X), "expected finite stamps"),
        ((np.append(T[:-2], [np.inf, np.inf]), X, X), "expected finite stamps"),
        ((T, np.where(FIFTH, np.nan, X), X), "mass_displacement: expected finite values; got nan unflagged"),
        ((T, X, np.where(FIFTH, np.inf, X)), "base_displacement: expected finite values; got inf unflagged"),
        ((T, np.where(FIFTH, 1e12, X), X), "mass_displacement: expected metres; got 1e"),
        ((T, np.where(FIFTH, -1e300, X), X), "mass_displacement: .*another unit"),
        ((np.append(T[:-1], 1e300), X, X), "time: expected seconds; got 1e"),
        ((T, X.reshape(10, 10), X), "expected one dimension"),
        ((T, X, X, [300] * 100), "quality: expected whole numbers from 0 to 255"),
    ],
)
def test_what_breaks_the_rules_is_refused(arrays: tuple[np.ndarray, ...], words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        Recording(*arrays)  # type: ignore[arg-type] # three arrays and the quality


def test_lines_must_add_up() -> None:
    with pytest.raises(RecordingError, match="do not add up: expected 3 in all"):
        LineCount(read=3, data=1, header=1)
    files = (SourceFile("a", lines=LineCount(read=2, data=2)), SourceFile("b", lines=LineCount(read=1, header=1)))
    assert Source(files).lines == LineCount(read=3, data=2, header=1)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 99), st.sampled_from(list(Quality))), max_size=12))
def test_stretches_hold_what_is_sound_and_never_cross_a_hole(damage: list[tuple[int, Quality]]) -> None:
    """Compared with the slow and obvious way: walk from sample to sample."""
    quality, x, t = np.zeros(100, np.uint8), X.copy(), T.copy()
    for i, flag in damage:
        quality[i] |= flag.value
        if flag is Quality.NOT_BRIDGED and i % 2:
            x[i] = np.nan
        if flag is Quality.DUPLICATED and i:
            t[i] = t[i - 1]
    repeated = np.flatnonzero(np.diff(t) < 0)
    if len(repeated):
        return
    expected: list[list[int]] = [[]]
    for i in range(100):
        if quality[i] & Quality.NOT_BRIDGED or quality[i] & Quality.HELD or np.isnan(x[i]):
            expected.append([])
        if quality[i] & Quality.HELD or np.isnan(x[i]) or quality[i] & Quality.DUPLICATED:
            continue
        expected[-1].append(i)
    parts = Recording(t, x, X, quality).stretches()
    assert [part.mass_displacement.tolist() for part in parts] == [x[p].tolist() for p in expected if len(p) > 1]
    for part in parts:
        assert np.diff(part.time).min() > 0
        assert part.stretches() == (part,) or len(part.stretches()) == 1


@given(st.floats(1e-5, 1.0), st.integers(10, 2000), st.floats(-1e3, 1e3), st.integers(0, 8))
def test_the_interval_is_that_of_the_clock_whatever_is_missing(step: float, n: int, start: float, lost: int) -> None:
    keep = np.sort(np.random.default_rng(n).permutation(np.arange(1, n - 1))[: n - 2 - min(lost, n // 4)])
    time = start + np.concatenate([[0], keep, [n - 1]]) * step
    assert sampling_interval(time) == pytest.approx(step, rel=1e-9 + 1e-12 * abs(start) / step)
