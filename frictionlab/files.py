"""Files that appear whole or not at all.

A file is written under a temporary name of its own in the folder of its final one, synced to the disk and then renamed
over it, so that a killed process, a full disk or a second writer leaves a whole file or none. What a killed run left is
swept by who writes there an hour later.
"""

import errno
import os
import secrets
import stat
import time
import unicodedata
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

from frictionlab.errors import OutputError, UsageError

Bytes = bytes | bytearray | memoryview
SUFFIX = ".frictionlab-part"
PACKED = (".gz", ".zip")
"""Suffixes of packed logs: the log's own stands before."""
PROTECTED = "{}: is write-protected: choose another output, or give --force"
_BLOCK = 1 << 23  # bytes of one write
_LEFT_S = 3600.0  # since its last byte, after which a temporary file has no writer
_sync, _rename = os.fsync, os.replace
OPEN_FLAGS = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
"""Not for children of this process, not through a link, bytes as they are: whichever of them this system knows."""
WINDOWS = os.name == "nt"  # folders cannot be synced there


def write_whole(path: Path, data: Bytes | Iterable[Bytes], *, replace: bool | Callable[[Path], bool] = True) -> None:
    """Write a file so that it appears whole or not at all.

    ``path``: its folder exists, a symbolic link is followed; ``data``: all of its bytes, in one or in pieces;
    ``replace``: whether an existing file may be replaced: yes, no, or a function that looks at it and says.

    Raises
    ------
    OutputError
        If it exists and may not be replaced, or the system refuses (full disk, read-only folder). What stood there
        before is untouched.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> write_whole(folder / "a.txt", b"whole")
    >>> (folder / "a.txt").read_bytes()
    b'whole'
    """
    _check_name(path)
    final = Path(os.path.realpath(path))
    check_replaceable(final, replace=replace)
    part = final.with_name(f".{final.name[:100]}.{secrets.token_hex(4)}{SUFFIX}")
    try:
        for left in final.parent.glob(f".*{SUFFIX}"):  # by runs that were killed
            with suppress(OSError):  # gone meanwhile, or not ours to touch
                if time.time() - left.lstat().st_mtime > _LEFT_S:
                    left.unlink()
        descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | OPEN_FLAGS, 0o666)
        try:
            with os.fdopen(descriptor, "wb", buffering=0):
                for piece in (data,) if isinstance(data, (bytes, bytearray, memoryview)) else data:
                    view, done = memoryview(piece).cast("B"), 0
                    while done < len(view):
                        done += os.write(descriptor, view[done : done + _BLOCK])
                _sync(descriptor)
            check_replaceable(final, replace=replace)
            if final.exists():  # as private as the file it replaces; a protection that was overruled ends
                part.chmod(stat.S_IMODE(final.stat().st_mode) | stat.S_IWUSR)
            _rename(part, final)
        except BaseException:
            part.unlink(missing_ok=True)
            raise
    except OutputError:
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"{path}: could not be written ({reason}); what stood there before is untouched") from error
    _sync_folder(final.parent)


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it, where there is none; `OutputError` if it cannot be made.

    Examples
    --------
    >>> make_folder(Path(os.devnull))
    Traceback (most recent call last):
    frictionlab.errors.OutputError: /dev/null: the folder cannot be made (a file has this name): choose another output
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = "a file has this name" if isinstance(error, FileExistsError) else error.strerror
        raise OutputError(f"{folder}: the folder cannot be made ({reason}): choose another output") from error


def check_replaceable(path: Path, *, replace: bool | Callable[[Path], bool]) -> None:
    """Raise `OutputError` if something stands at this path that must not be replaced; asked before long work too.

    A file that its user has write-protected is replaced only where ``replace`` is plainly True.
    """
    _check_name(path)
    if not path.parent.is_dir():
        raise OutputError(f"{path}: no such folder as {path.parent}: make it first")
    if not os.path.lexists(path):
        return
    if not path.is_file():
        raise OutputError(f"{path}: expected a file or nothing there; got something else: choose another output")
    if not (replace(path) if callable(replace) else replace):
        raise OutputError(f"{path}: exists and is not a file of this kind: choose another output, or give --force")
    if callable(replace) and _is_protected(path):
        raise OutputError(PROTECTED.format(path))


def refuse_inputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Refuse (`UsageError`) an output that is one of the inputs, by any name or link; ``--force`` does not allow it."""
    read: dict[object, Path] = {}
    for path in inputs:
        for one in identities(path):
            read.setdefault(one, path)
    for output in outputs:
        for one in identities(output) & read.keys():
            raise UsageError(f"{output}: is the input {read[one]}: an output never replaces an input: choose another")


def refuse_outputs(
    outputs: Iterable[Path], ours: Callable[[Path], bool], what: str, *, force: bool, inputs: Iterable[Path] = ()
) -> None:
    """Refuse (`UsageError`), before long work, outputs that are inputs, cannot be written, or would replace another's.

    ``ours``: whether a file that stands there may be replaced without ``force``; ``what``: what it is then, in words.
    """
    places = list(outputs)
    refuse_inputs(places, inputs)
    for path in places:
        if not force and os.path.lexists(path):
            if not ours(path):
                raise UsageError(f"{path}: exists and is no {what}: choose another output, or give --force")
            if path.exists() and _is_protected(path):
                raise UsageError(PROTECTED.format(path))
        above = next(parent for parent in (*path.parents, Path.cwd()) if os.path.lexists(parent))
        if not above.is_dir() or not os.access(above, os.W_OK):
            fault = "cannot be written to" if above.is_dir() else "is no folder"
            raise UsageError(f"{path}: {above} {fault}: choose another output")


def _is_protected(path: Path) -> bool:
    """Whether this file's mode allows nobody to write it: its user wants it to stay."""
    return not path.stat().st_mode & (stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH)


def _check_name(path: Path) -> None:
    if "\0" in str(path):
        raise OutputError(f"{str(path)!r}: cannot be the name of a file: choose another output")


def check_regular(path: Path) -> None:
    """Raise `OSError` for a folder, a pipe or a device, whose reading may never end, or if nothing is there."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(errno.EINVAL, "a folder, a pipe or a device, not a file", str(path))


def identities(path: Path) -> set[object]:
    """What distinguishes a file: its true path and, where it stands, its number on the disk (links share it)."""
    found: set[object] = {os.path.normcase(os.path.realpath(path))}
    if path.exists():
        known = path.stat()
        found.add((known.st_dev, known.st_ino))
    return found


def as_disks_see(name: str) -> str:
    """Return a file's name as disks see it that distinguish neither case nor ways to write an accent.

    Examples
    --------
    >>> as_disks_see("A\N{COMBINING DIAERESIS}.csv") == as_disks_see("\N{LATIN SMALL LETTER A WITH DIAERESIS}.CSV")
    True
    """
    return unicodedata.normalize("NFC", name).casefold()


def stem_of(log: Path) -> str:
    """Give the log's name without its suffix, that of a packed one (``.gz``) included.

    Examples
    --------
    >>> stem_of(Path("a/steel_N1.25_r0.3.csv.gz"))
    'steel_N1.25_r0.3'
    """
    return (log.with_suffix("") if log.suffix.lower() in PACKED else log).stem


def _sync_folder(folder: Path) -> None:
    if WINDOWS:
        return
    try:
        descriptor = os.open(folder, os.O_RDONLY | OPEN_FLAGS)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        raise OutputError(f"{folder}: the file is written, its folder cannot be synced ({error.strerror})") from error
