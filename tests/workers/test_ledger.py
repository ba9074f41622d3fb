"""Whatever comes back in whatever order, each case is handed on once, in order, and only the deadly one is lost."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab.workers import Ledger, Portion


def naive(total: int, deadly: set[int]) -> list[int | None]:
    return [None if case in deadly else case for case in range(total)]


def flat(batch: Portion[list[int]]) -> list[int | None]:
    return [None] if batch.results is None else [*batch.results]


@given(
    total=st.integers(0, 200),
    deadly=st.sets(st.integers(0, 199), max_size=4),
    workers=st.integers(1, 5),
    seed=st.integers(0, 2**32 - 1),
)
def test_cases_come_out_once_and_in_order(total: int, deadly: set[int], workers: int, seed: int) -> None:
    chance = np.random.default_rng(seed)
    ledger: Ledger[list[int]] = Ledger(total, float(chance.choice([0.0, 0.01, 1.0])))
    out: list[Portion[list[int]]] = []
    seen: list[int | None] = []
    while not ledger.finished:
        while len(out) < 2 * workers and ledger.may_take(workers=workers):
            out.append(ledger.take(workers=workers))
        assert len(out) == 1 or not any(task.deaths for task in out)
        task = out.pop(int(chance.integers(len(out))))
        cases = range(task.start, task.stop)
        dies = bool(deadly & set(cases))
        if dies or (not task.deaths and chance.random() < 0.02):  # together with a batch that kills
            ledger.book_death(task, 1)
        else:
            ledger.book(task, list(cases), chance.uniform(1e-6, 0.1))
        for batch in ledger.in_order():
            seen += flat(batch)
    assert seen == naive(total, deadly)


@given(total=st.integers(2, 10**9), cost=st.floats(1e-9, 100.0), workers=st.integers(1, 999))
def test_a_batch_is_never_empty_nor_too_long(total: int, cost: float, workers: int) -> None:
    ledger: Ledger[range] = Ledger(total, 0.25)
    for _ in range(12):
        task = ledger.take(workers=workers)
        size = task.stop - task.start
        assert 1 <= size <= total - task.start
        assert size == 1 or size * cost <= 0.25 * (1 + 1e-9)
        ledger.book(task, range(size), cost * size)
        if task.stop == total:
            break


def test_a_single_case_is_given_up_after_three_deaths() -> None:
    ledger: Ledger[list[int]] = Ledger(1, 0.25)
    for _ in range(3):
        task = ledger.take(workers=1)
        assert not list(ledger.in_order())
        ledger.book_death(task, 1)
    (batch,) = ledger.in_order()
    assert batch.lost == "its worker died each time, 3 times: out of memory, or a crash in a library"
    assert ledger.finished


def test_an_error_is_raised_when_its_turn_comes() -> None:
    ledger: Ledger[list[int]] = Ledger(2, 0.0)
    first, second = ledger.take(workers=1), ledger.take(workers=1)
    ledger.book(second, ArithmeticError("second"))
    assert not list(ledger.in_order())
    ledger.book(first, [0])
    handed_on = ledger.in_order()
    assert next(handed_on).results == [0]
    with pytest.raises(ArithmeticError, match="second"):
        next(handed_on)


def test_a_case_that_a_cluster_blames_is_tried_alone_before_it_is_given_up() -> None:
    """Two cases share a worker that one of them kills: the cluster blames both, and the other is not lost."""
    ledger: Ledger[list[int]] = Ledger(2, 0.0)
    for task in [ledger.take(workers=2), ledger.take(workers=2)]:
        ledger.book_death(task, 2)
    first = ledger.take(workers=2)
    assert first.deaths
    assert not ledger.may_take(workers=2)
    ledger.book(first, [0])
    ledger.book_death(ledger.take(workers=2), 2)
    assert [flat(batch) for batch in ledger.in_order()] == [[0], [None]]
