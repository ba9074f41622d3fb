"""Whatever comes back in whatever order, each case is handed on once, in order, and only the deadly one is lost."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab.workers.ledger import Batch, Ledger, Task
from frictionlab.workers.pace import Pace


def naive(total: int, deadly: set[int]) -> list[int | None]:
    return [None if case in deadly else case for case in range(total)]


def flat(batch: Batch[list[int]]) -> list[int | None]:
    return [None] if batch.results is None else [*batch.results]


@given(
    total=st.integers(0, 200),
    deadly=st.sets(st.integers(0, 199), max_size=4),
    workers=st.integers(1, 5),
    seed=st.integers(0, 2**32 - 1),
)
def test_cases_come_out_once_and_in_order(total: int, deadly: set[int], workers: int, seed: int) -> None:
    chance = np.random.default_rng(seed)
    pace = Pace(total, seconds_per_batch=float(chance.choice([0.0, 0.01, 1.0])))
    ledger: Ledger[list[int]] = Ledger(0, pace)
    out: list[Task] = []
    seen: list[int | None] = []
    while not ledger.finished:
        while len(out) < 2 * workers and (ledger.urgent or ledger.held < 8 * workers):
            task = ledger.take(workers=workers)
            if task is None:
                break
            out.append(task)
        assert ledger.held <= 8 * workers + len(deadly) + 2 * workers
        task = out.pop(int(chance.integers(len(out))))
        cases = range(task.start, task.stop)
        if deadly & set(cases) or chance.random() < 0.02:
            ledger.book_death(task, deaths=1 if deadly & set(cases) else 0)
        else:
            pace.learn(len(cases), seconds=chance.uniform(1e-6, 0.1))
            ledger.book(task, list(cases))
        for batch in ledger.in_order():
            seen += flat(batch)
    assert seen == naive(total, deadly)


@given(total=st.integers(1, 10**9), cost=st.floats(1e-9, 100.0), start=st.floats(0.0, 1.0), workers=st.integers(1, 999))
def test_a_batch_is_never_empty_nor_too_long(total: int, cost: float, start: float, workers: int) -> None:
    pace = Pace(total, seconds_per_batch=0.25)
    pace.learn(10**9, seconds=cost * 10**9)
    first = min(int(start * total), total - 1)
    size = pace.size(first, workers=workers)
    assert 1 <= size <= total - first
    assert size == 1 or size * cost <= 0.25 * (1 + 1e-9)


def test_the_first_batches_grow_by_steps() -> None:
    pace = Pace(10**6, seconds_per_batch=0.25)
    assert pace.size(0, workers=2) == 1
    pace.learn(1, seconds=1e-6)
    assert pace.size(1, workers=2) == 8


def test_a_single_case_is_given_up_after_three_deaths() -> None:
    ledger: Ledger[list[int]] = Ledger(0, Pace(1, seconds_per_batch=0.25))
    for _ in range(3):
        task = ledger.take(workers=1)
        assert task is not None
        assert not list(ledger.in_order())
        ledger.book_death(task, deaths=1)
    (batch,) = ledger.in_order()
    assert batch.lost == "its worker died each time, 3 times: out of memory, or a crash in a library"
    assert ledger.finished


def test_an_error_is_raised_when_its_turn_comes() -> None:
    pace = Pace(2, seconds_per_batch=0.0)
    ledger: Ledger[list[int]] = Ledger(0, pace)
    first, second = ledger.take(workers=1), ledger.take(workers=1)
    assert first is not None
    assert second is not None
    ledger.book(second, ArithmeticError("second"))
    assert not list(ledger.in_order())
    ledger.book(first, [0])
    handed_on = ledger.in_order()
    assert next(handed_on).results == [0]
    with pytest.raises(ArithmeticError, match="second"):
        next(handed_on)


def test_a_case_that_a_cluster_blames_is_tried_alone_before_it_is_given_up() -> None:
    """Two cases share a worker that one of them kills: the cluster blames both, and the other is not lost."""
    ledger: Ledger[list[int]] = Ledger(0, Pace(2, seconds_per_batch=0.0))
    both = [ledger.take(workers=2), ledger.take(workers=2)]
    for task in both:
        assert task is not None
        ledger.book_death(task, deaths=2)
    first = ledger.take(workers=2)
    assert first is not None
    assert first.alone
    assert ledger.take(workers=2) is None
    ledger.book(first, [0])
    second = ledger.take(workers=2)
    assert second is not None
    ledger.book_death(second, deaths=2)
    assert [flat(batch) for batch in ledger.in_order()] == [[0], [None]]
