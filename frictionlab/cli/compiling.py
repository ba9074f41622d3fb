"""One line on a terminal while the simulator is compiled: half a minute of silence looks like a hang."""

import sys
from collections.abc import Sequence

__all__ = ["announce_compiling"]

SILENT = frozenset({"--json", "--quiet", "-q"})


def announce_compiling(arguments: Sequence[str]) -> None:
    """Let the simulator's compiler say that it begins, if stderr is a terminal and nobody asked for silence.

    Parameters
    ----------
    arguments : sequence of str
        The command line's.
    """
    if not sys.stderr.isatty() or SILENT.intersection(arguments):
        return
    import logging

    class ToStderr(logging.Handler):
        """Prints to stderr as it is now: a progress bar may have taken it over."""

        def emit(self, record: logging.LogRecord) -> None:
            """Print one line."""
            print(record.getMessage(), file=sys.stderr, flush=True)

    logger = logging.getLogger("frictionlab.simulator.engine")
    logger.setLevel(logging.INFO)
    logger.handlers[:] = [ToStderr()]
