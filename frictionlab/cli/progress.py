"""How far the work is, on stderr: a bar on a terminal, elsewhere a plain line now and then."""

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")


LINE_S = 60.0  # between two plain lines; shorter work prints none


def track(items: Iterable[T], *, total: int, title: str, quiet: bool = False) -> Iterator[T]:
    """Yield the items and show how far they are, with rate and time left, on stderr if ``quiet`` is not set."""
    with count(title, quiet=quiet) as progress:
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
def count(title: str, *, quiet: bool = False) -> Iterator[Callable[[int, int], None] | None]:
    """Give a function that takes things done and things in all, and shows them with rate and time left."""
    if quiet:
        yield None
        return
    if not sys.stderr.isatty():
        yield Lines(title)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"))
    with Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(title, total=None, rate="")
        pulse = Rate()
        yield lambda done, total: progress.update(task, completed=done, total=total, rate=f"{pulse.of(done):,.1f}/s")


class Rate:
    """Things per second since the first were told, which may have been done before."""

    def __init__(self) -> None:
        self._begin = time.monotonic()
        self._before: int | None = None

    def of(self, done: int) -> float:
        """The rate now."""
        if self._before is None:
            self._begin, self._before = time.monotonic(), done
        return (done - self._before) / max(time.monotonic() - self._begin, 1e-3)


class Lines:
    """Progress as plain lines, one a minute; for a log file or a batch system.

    Examples
    --------
    >>> Lines("sweep").line(250, 1000, rate=50.0)
    'sweep: 250 of 1,000, 50.0/s, 15 s left'
    """

    def __init__(self, title: str) -> None:
        self._title = title
        self._rate = Rate()
        self._told = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        """Tell how far it is, if it is time."""
        rate = self._rate.of(done)
        if time.monotonic() - self._told > LINE_S and rate > 0.0:
            self._told = time.monotonic()
            print(self.line(done, total, rate=rate), file=sys.stderr, flush=True)

    def line(self, done: int, total: int, *, rate: float) -> str:
        """What is told."""
        return f"{self._title}: {done:,} of {total:,}, {rate:,.1f}/s, {(total - done) / rate:.0f} s left"
