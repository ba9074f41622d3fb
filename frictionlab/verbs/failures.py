"""Why an input failed: as a sentence, and as the row that stands in place of its result."""

import traceback
from pathlib import Path

from frictionlab.errors import FrictionlabError
from frictionlab.tables import Row

FAILED = "failed"
PACKAGE = Path(__file__).parents[1]


def failure(path: Path, error: Exception) -> Row:
    """The row of an input that failed, as in the contract; its source is told beside the reason, not in it again."""
    reason = reason_of(error)
    for name in (str(path), path.name):
        reason = reason.removeprefix(f"{name}: ")
    return {"source": str(path), "status": FAILED, "reason": reason}


def reason_of(error: Exception) -> str:
    """Why something failed, as a sentence: what this package says, what the system says, or a fault of the program.

    Examples
    --------
    >>> reason_of(KeyError("µs"))
    "a fault of the program, not of the input: KeyError: 'µs': please report it with the input"
    """
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if isinstance(error, (FrictionlabError, OSError)):
        return str(error)
    if isinstance(error, MemoryError):
        return "not enough memory: give it a machine with more, or a shorter log"
    steps = [s for s in traceback.extract_tb(error.__traceback__) if PACKAGE in Path(s.filename).parents]
    steps = [s for s in steps if Path(s.filename).name != "each.py"]
    place = f" ({Path(steps[-1].filename).relative_to(PACKAGE.parent)}, line {steps[-1].lineno})" if steps else ""
    said = f"{type(error).__name__}: {error}".removesuffix(": ")
    return f"a fault of the program, not of the input: {said}{place}: please report it with the input"
