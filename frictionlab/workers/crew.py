"""The workers of one run: batches are given to them and collected, whether they are processes here or a cluster."""

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from typing import Any, Protocol

from frictionlab.workers.cluster import Cluster
from frictionlab.workers.ledger import Ledger, Task
from frictionlab.workers.local import Process
from frictionlab.workers.pace import Pace

AHEAD = 2  # batches per worker: one in work, one waiting, so that no worker waits for this process
LOOK_S = 1.0  # how often to look whether anybody is still there

Outcome = tuple[Any, float]  # results and the seconds they took
Held = list[tuple["Future[Outcome]", Task]]


class Site(Protocol):
    """A place where batches are done: an executor and what it means when that fails."""

    @property
    def executor(self) -> Executor:
        """What takes the next batch."""

    def workers(self) -> int:
        """How many batches it works on at a time."""

    def deaths(self, error: BaseException) -> int:
        """How many workers died over the batch that ended in this error."""

    def mend(self) -> None:
        """Replace an executor that broke."""

    def check(self) -> None:
        """Raise if nobody is left to do the work."""

    def stop(self) -> None:
        """Drop what is still in work and let the workers go."""


class Crew:
    """Sites and the batches that each holds, oldest first."""

    def __init__(self, sites: Sequence[Site]) -> None:
        self._posts: list[tuple[Site, Held]] = [(site, []) for site in sites]

    @property
    def workers(self) -> int:
        """How many batches are worked on at a time."""
        return sum(site.workers() for site, _ in self._posts)

    @property
    def has_room(self) -> bool:
        """Whether somebody can take another batch."""
        return any(_room(post) > 0 for post in self._posts)

    def give(self, task: Task, work: Callable[..., Outcome], *arguments: object) -> None:
        """Give a batch to the site with most room."""
        site, held = max(self._posts, key=_room)
        try:
            future = site.executor.submit(work, *arguments)
        except BrokenExecutor as error:
            future = Future()
            future.set_exception(error)
        held.append((future, task))

    def collect(self, ledger: Ledger[Any], pace: Pace) -> None:
        """Wait until something came back, or for a moment, and book what did."""
        out = [future for _, held in self._posts for future, _ in held]
        if out:
            wait(out, timeout=LOOK_S, return_when=FIRST_COMPLETED)
        else:  # a cluster that has no workers yet
            time.sleep(LOOK_S)
        for site, held in self._posts:
            site.check()
            _book(site, held, ledger, pace)

    def stop(self) -> None:
        """Let all workers go."""
        for site, _ in self._posts:
            site.stop()


def _room(post: tuple[Site, Held]) -> int:
    site, held = post
    return AHEAD * site.workers() - len(held)


def _book(site: Site, held: Held, ledger: Ledger[Any], pace: Pace) -> None:
    """Book what came back; of the batches in a broken executor the oldest was in work, the others only waited."""
    broken = any(_broke(future) for future, _ in held)
    if broken:
        wait([future for future, _ in held])
    fallen = []
    for future, task in [pair for pair in held if pair[0].done()]:
        held.remove((future, task))
        if _broke(future):
            fallen.append(task)
        else:
            _book_one(site, future, task, ledger, pace)
    for place, task in enumerate(fallen):
        ledger.book_death(task, deaths=int(place == 0))
    if broken:
        site.mend()


def _broke(future: "Future[Outcome]") -> bool:
    return future.done() and not future.cancelled() and isinstance(future.exception(), BrokenExecutor)


def _book_one(site: Site, future: "Future[Outcome]", task: Task, ledger: Ledger[Any], pace: Pace) -> None:
    try:
        results, seconds = future.result()
    except CancelledError:
        site.mend()
    except Exception as error:  # noqa: BLE001 - raised by the ledger when the turn of this batch comes
        if deaths := site.deaths(error):
            ledger.book_death(task, deaths=deaths)
        else:
            ledger.book(task, error)
    else:
        pace.learn(task.stop - task.start, seconds=seconds)
        ledger.book(task, results)


@contextmanager
def crew_of(*, workers: int, scheduler: str | None) -> Iterator[Crew]:
    """Gather the workers; they leave with the context, however it ends."""
    crew = Crew([Cluster(scheduler)] if scheduler is not None else [Process() for _ in range(workers)])
    try:
        yield crew
    finally:
        crew.stop()
