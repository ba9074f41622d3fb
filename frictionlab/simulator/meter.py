"""How much work a search over steady states may still do, in units that do not depend on the machine or its load."""

from collections.abc import Iterator
from contextlib import contextmanager

from frictionlab.errors import FrictionlabError

STATE = 100.0  # steps of integration that an integrated steady state costs beside its own
EXACT_STATE, LOOKS = 50.0, 13.0  # what an exact one costs beside its evaluations, and how many of these cost a step


class OverspentError(FrictionlabError, RuntimeError):
    """The work that a search may do is used up; no fault of what was asked last."""


class Meter:
    """Work left to a search, in steps of integration: the same on every machine, so that it ends at the same place."""

    def __init__(self, steps: float) -> None:
        self.left = steps

    @contextmanager
    def keeping(self, steps: float) -> Iterator[None]:
        """Within it, so many steps are out of reach: what comes after has them."""
        self.left -= steps
        try:
            yield
        finally:
            self.left += steps

    def take(self, steps: float) -> None:
        """Book so many steps; OverspentError where no work is left."""
        self.left -= steps
        if self.left < 0.0:
            raise OverspentError("the steps of integration allowed are used up")
