"""Standard output that ends early: a full disk is told in one line, a reader that has gone (``| head``) in none.

Standard error that takes no more loses its messages and nothing else: results and exit status stand without them.
"""

import contextlib
import io
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

CLOSED = 128 + 13  # the exit status that shells give to what a closed pipe has stopped


class LostOutputError(Exception):
    """Standard output takes no more: its disk is full, or who read it has gone."""

    @property
    def is_closed(self) -> bool:
        """Whether its reader has gone: nobody is to be told, and it is no fault."""
        return isinstance(self.__cause__, BrokenPipeError)

    @property
    def status(self) -> int:
        """The exit status that follows."""
        return CLOSED if self.is_closed else 1


class Output(io.TextIOWrapper):
    """Standard output whose faults cannot be taken for those of a file."""

    def write(self, text: str, /) -> int:
        """Write, or raise `LostOutputError`."""
        with _faults():
            return super().write(text)

    def flush(self) -> None:
        """Flush, or raise `LostOutputError`."""
        with _faults():
            super().flush()


class Messages(io.TextIOWrapper):
    """Standard error that drops what it cannot tell: there is nowhere left to tell so."""

    def write(self, text: str, /) -> int:
        """Write, or drop it."""
        try:
            return super().write(text)
        except OSError:
            _drop(sys.stderr)
            return len(text)

    def flush(self) -> None:
        """Flush, or drop what is there."""
        try:
            super().flush()
        except OSError:
            _drop(sys.stderr)


def guard_standard_output() -> None:
    """Let nothing but `LostOutputError` come from standard output; a file's name need not be text that it can print."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    plain: TextIO | None = sys.stdout
    if isinstance(plain, io.TextIOWrapper):
        sys.stdout = Output(plain.buffer, plain.encoding, plain.errors, line_buffering=plain.line_buffering)
    plain = sys.stderr
    if isinstance(plain, io.TextIOWrapper):
        sys.stderr = Messages(plain.buffer, plain.encoding, plain.errors, line_buffering=True, write_through=True)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who started this: what is printed goes nowhere
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115 - open to the end


@contextlib.contextmanager
def standard_output() -> Iterator[None]:
    """Turn what the system says of standard output into `LostOutputError`; all that was printed is there afterwards."""
    with _faults():
        yield
        sys.stdout.flush()


@contextlib.contextmanager
def _faults() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        _drop(sys.stdout)
        raise LostOutputError(f"standard output: {error.strerror or error}") from error


def _drop(stream: TextIO) -> None:
    """Let what is still to be printed go nowhere, so that nothing is raised again when Python leaves."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
