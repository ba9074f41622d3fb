"""Which batches are out, which have died and are due again, and which come next in order."""

from collections.abc import Iterator, Sized
from dataclasses import dataclass
from typing import Generic, TypeVar

from frictionlab.workers.pace import Pace

S = TypeVar("S", bound=Sized)
SPLIT = 2  # a batch that has lost so many workers is halved, to find the case that kills
GIVEN_UP = 3  # a single case that has lost so many is reported and left


@dataclass(frozen=True)
class Batch(Generic[S]):
    """Some neighbouring cases and what came of them.

    Attributes
    ----------
    start, stop
        The cases are those from ``start`` up to, not including, ``stop``.
    results
        What the job returned, one result per case; None if the case was lost.
    lost
        Why there are no results, as a sentence; empty if there are. A lost batch holds a single case.
    """

    start: int
    stop: int
    results: S | None
    lost: str = ""

    def __len__(self) -> int:
        return self.stop - self.start


@dataclass(frozen=True)
class Task:
    """Cases ``start`` up to ``stop`` and how many workers died over them; ``alone``: with nothing else in work."""

    start: int
    stop: int
    deaths: int = 0
    alone: bool = False


class Ledger(Generic[S]):
    """The book of one run, kept by the process that hands the work out.

    Parameters
    ----------
    start
        The first case.
    pace
        How large batches are.
    """

    def __init__(self, start: int, pace: Pace) -> None:
        self._pace = pace
        self._fresh = start
        self._due: list[Task] = []
        self._back: dict[int, Batch[S] | BaseException] = {}
        self._next = start
        self._out = 0
        self._alone_out = False

    @property
    def finished(self) -> bool:
        """Whether every case has been handed on."""
        return self._next >= self._pace.total

    @property
    def held(self) -> int:
        """Batches that are out or wait for an earlier one."""
        return self._out + len(self._back)

    @property
    def urgent(self) -> bool:
        """Whether a batch is due again; it goes first, for all later ones wait for it."""
        return bool(self._due)

    def take(self, *, workers: int) -> Task | None:
        """The next batch to hand out, or None if all are out."""
        if self._alone_out or (self._due and self._due[-1].alone and self._out):
            return None
        if self._due:
            task = self._due.pop()
        elif self._fresh < self._pace.total:
            task = Task(self._fresh, self._fresh + self._pace.size(self._fresh, workers=workers))
            self._fresh = task.stop
        else:
            return None
        self._out += 1
        self._alone_out = task.alone
        return task

    def book(self, task: Task, outcome: S | BaseException) -> None:
        """Note what came back for a batch; an error is raised when its turn comes, as it would be without workers."""
        self._out -= 1
        self._alone_out = False
        if isinstance(outcome, BaseException):
            self._back[task.start] = outcome
        else:
            self._back[task.start] = Batch(task.start, task.stop, outcome)

    def book_death(self, task: Task, *, deaths: int) -> None:
        """Note that so many workers died over this batch: it is due again, then halved, then given up.

        None, if the worker died over another one while this one waited. A cluster tells several deaths at once and not
        which of the cases there caused them: then a single case is tried once more, alone, before it is given up.
        """
        self._out -= 1
        self._alone_out = False
        unsure = deaths > 1 and not task.alone
        deaths += task.deaths
        middle = (task.start + task.stop) // 2
        if task.stop - task.start > 1 and deaths >= SPLIT:
            self._put_back(Task(middle, task.stop, SPLIT - 1), Task(task.start, middle, SPLIT - 1))
        elif unsure:
            self._put_back(Task(task.start, task.stop, deaths, alone=True))
        elif deaths < GIVEN_UP:
            self._put_back(Task(task.start, task.stop, deaths, alone=task.alone))
        else:
            reason = f"its worker died each time, {deaths} times: out of memory, or a crash in a library"
            self._back[task.start] = Batch(task.start, task.stop, None, lost=reason)

    def _put_back(self, *tasks: Task) -> None:
        self._due = sorted([*self._due, *tasks], key=lambda task: -task.start)

    def in_order(self) -> Iterator[Batch[S]]:
        """Hand on the batches whose turn has come."""
        while self._next in self._back:
            batch = self._back.pop(self._next)
            if isinstance(batch, BaseException):
                raise batch
            self._next = batch.stop
            yield batch
