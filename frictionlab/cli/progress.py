"""How far the work is, on stderr: a bar on a terminal, elsewhere a plain line now and then."""

import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")


SURE_S, LEAST_TOLD = 2.0, 4  # from when on a rate is told
LINE_S = 60.0  # between two plain lines; shorter work prints none


def track(items: Iterable[T], *, total: int, title: str, quiet: bool = False) -> Iterator[T]:
    """Yield the items and show how far they are, with rate and time left, on stderr if ``quiet`` is not set."""
    with count(title, quiet=quiet, total=total) as progress:
        for number, item in enumerate(items, 1):
            yield item
            if progress is not None:
                progress(number, total)


@contextmanager
def bytes_read(title: str, *, quiet: bool = False) -> Iterator[Callable[[int, int], None] | None]:
    """Give a function that takes bytes read and bytes in all, and draws them; ``None`` where nothing is to be drawn."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TransferSpeedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(escape(title.encode("ascii", "backslashreplace").decode()), total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


@contextmanager
def count(title: str, *, quiet: bool = False, total: int | None = None) -> Iterator[Callable[[int, int], None] | None]:
    """Give a function that takes things done and things in all, and shows them with rate and time left."""
    if quiet:
        yield None
        return
    if not sys.stderr.isatty():
        yield Lines(title)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[pace]}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(title, total=total, pace="")
        pulse = Rate()
        yield lambda done, total: progress.update(task, completed=done, total=total, pace=pulse.words(done, total))


class Rate:
    """Things per second over the last half of the time since the first were told.

    The first ones carry imports, compiling and processes that start: a rate that counts them promises hours for
    minutes. So the first half of the time is forgotten, and nothing is said of the first two seconds or four tellings.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._begin: float | None = None
        self._past: deque[tuple[float, int]] = deque()  # when, and how many were done then

    def of(self, done: int) -> float | None:
        """The rate now; None while it is not known."""
        now = self._clock()
        self._begin = now if self._begin is None else self._begin
        self._past.append((now, done))
        while len(self._past) > LEAST_TOLD and self._past[1][0] <= 0.5 * (self._begin + now):
            self._past.popleft()
        before, first = self._past[0]
        is_known = now - self._begin >= SURE_S and len(self._past) >= LEAST_TOLD and done > first
        return (done - first) / (now - before) if is_known else None

    def words(self, done: int, total: int) -> str:
        """The rate and the time left, where they are known.

        Examples
        --------
        >>> times = iter([0.0, 10.0, 11.0, 12.0, 22.0])
        >>> rate = Rate(lambda: next(times))
        >>> [rate.words(done, 1000) for done in (0, 1, 50, 100, 600)]
        ['', '', '', '8.3/s, 108 s left', '49.9/s, 8 s left']
        """
        rate = self.of(done)
        return "" if rate is None else f"{rate:,.1f}/s, {(total - done) / rate:.0f} s left"


class Lines:
    """Progress as plain lines, one a minute; for a log file or a batch system."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._rate = Rate()
        self._told = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        """Tell how far it is, if it is time."""
        pace = self._rate.words(done, total)
        if pace and time.monotonic() - self._told > LINE_S:
            self._told = time.monotonic()
            print(f"{self._title}: {done:,} of {total:,}, {pace}", file=sys.stderr, flush=True)
