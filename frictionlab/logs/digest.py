"""The SHA-256 of a log, computed beside its reading: by a thread of its own that costs no time of the others."""

import hashlib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from threading import Event

_ROOM = 1 << 24
"""Read so much at once at most: between two reads the thread may have to wait for its turn."""


@contextmanager
def sha256_beside(path: Path) -> Iterator[Callable[[], str]]:
    """Begin to hash a file; what is yielded waits for the digest. Leaving the context ends the work, done or not.

    Examples
    --------
    >>> import tempfile
    >>> log = Path(tempfile.mkdtemp()) / "log.csv"
    >>> _ = log.write_text("0.00,1.5,-2.25")
    >>> with sha256_beside(log) as digest:
    ...     print(digest()[:16])
    49b17070fd599f87
    """
    leave = Event()
    with ThreadPoolExecutor(1) as pool:
        done = pool.submit(_sha256, path, leave)
        try:
            yield done.result
        finally:
            leave.set()


def _sha256(path: Path, leave: Event) -> str:
    digest = hashlib.sha256()
    with path.open("rb", buffering=0) as file:
        room = memoryview(bytearray(min(_ROOM, path.stat().st_size + 1)))
        while not leave.is_set() and (size := file.readinto(room)):
            digest.update(room[:size])
    return digest.hexdigest()
