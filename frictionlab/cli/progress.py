"""How far the work is, on stderr: a bar with the time left on a terminal, nothing elsewhere."""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")
Count = Callable[[int, int], None]
"""Called with what is done and what there is in all."""


def track(items: Iterable[T], *, total: int, title: str, quiet: bool = False) -> Iterator[T]:
    """Yield the items and show how many are done, if ``quiet`` is not set."""
    with count(title, quiet=quiet, total=total) as progress:
        for number, item in enumerate(items, 1):
            yield item
            if progress is not None:
                progress(number, total)


@contextmanager
def count(
    title: str, *, quiet: bool = False, total: int | None = None, in_bytes: bool = False
) -> Iterator[Count | None]:
    """Give a function that shows how much is done, with speed and time left; None where nothing is to be shown."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import (
        BarColumn,
        DownloadColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
        TransferSpeedColumn,
    )  # fmt: skip

    done = (DownloadColumn(), TransferSpeedColumn()) if in_bytes else (MofNCompleteColumn(), TimeRemainingColumn())
    columns = (TextColumn("{task.description}"), BarColumn(), *done)
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(escape(title.encode("ascii", "backslashreplace").decode()), total=total)
        yield lambda done, total: progress.update(task, completed=done, total=total)
