"""Columns that grow: blocks are parsed straight into their place, so that no number is copied twice."""

import numpy as np
from numpy.typing import NDArray

_SPARE = 1.02
_GROWTH = 1.5


class Columns:
    """Room for (width, n) doubles, filled from the left.

    Places are reserved in the order of the file before the numbers are known (a thread writes them), and settled in the
    same order; what a block did not fill is closed up then.
    """

    def __init__(self, width: int) -> None:
        self.data: NDArray[np.float64] = np.empty((width, 0))
        self.size = 0
        self._reserved = 0

    def has_room(self, rows: int) -> bool:
        """Whether so many rows can be reserved without moving what is there."""
        return bool(self._reserved + rows <= self.data.shape[1])

    def grow(self, rows: int) -> None:
        """Make room for so many rows more; only while no place is reserved but not settled."""
        wanted = max(int((self.size + rows) * _SPARE) + 16, int(self.data.shape[1] * _GROWTH))
        data = np.empty((len(self.data), wanted))
        data[:, : self.size] = self.data[:, : self.size]
        self.data, self._reserved = data, self.size

    def reserve(self, rows: int) -> int:
        """Reserve a place and give its first row."""
        start = self._reserved
        self._reserved += rows
        return start

    def settle(self, start: int, values: NDArray[np.float64]) -> None:
        """Take the rows of the oldest place that is not settled yet: as written there, or given anew."""
        rows = values.shape[1]
        if start != self.size or values.base is not self.data:
            self.data[:, self.size : self.size + rows] = values
        self.size += rows

    def append(self, values: NDArray[np.float64]) -> None:
        """Add rows that stand elsewhere."""
        self._reserved = self.size
        if not self.has_room(values.shape[1]):
            self.grow(values.shape[1])
        self.settle(self.reserve(values.shape[1]), values)

    def columns(self) -> list[NDArray[np.float64]]:
        """Give the columns as they are now, not copied."""
        return [column[: self.size] for column in self.data]
