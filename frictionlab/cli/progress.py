"""Progress bars: on stderr, and only on a terminal."""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")


def track(items: Iterable[T], *, total: int, title: str, quiet: bool = False) -> Iterator[T]:
    """Yield the items; draw a bar with rate and time left on stderr if that is a terminal and ``quiet`` is not set."""
    if quiet or not sys.stderr.isatty():
        yield from items
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        yield from progress.track(items, total=total, description=title)


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
    """Give a function that takes things done and things in all, and draws them; ``None`` where nothing is drawn."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(title, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)
