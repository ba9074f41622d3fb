"""How many cases go into one batch, by what the last ones cost."""

import math

FIRST = 1
GROWTH = 8  # a batch is at most so many times the largest that was measured: the first ones carry imports
SHORTEST_S = 0.02  # below that a batch is not worth its way: 0.4 ms to a process here, 3 ms through Dask


class Pace:
    """What cases cost, learnt from the batches that came back; it decides how they are grouped, never what they give.

    Parameters
    ----------
    total
        Cases in all.
    seconds_per_batch
        How long a batch shall take a worker [s].

    Examples
    --------
    >>> pace = Pace(1_000_000, seconds_per_batch=0.25)
    >>> pace.size(0, workers=2)
    1
    >>> pace.learn(100, seconds=0.001)
    >>> pace.size(101, workers=2), round(pace.left(101), 2)
    (800, 10.0)
    """

    def __init__(self, total: int, *, seconds_per_batch: float) -> None:
        self.total = total
        self.seconds_per_batch = seconds_per_batch
        self.cost = math.inf  # s per case
        self.largest = 0

    def learn(self, cases: int, *, seconds: float) -> None:
        """Note what a batch of so many cases took."""
        self.cost = max(seconds, 1e-9) / cases
        self.largest = max(self.largest, cases)

    def size(self, start: int, *, workers: int) -> int:
        """Cases of the batch that begins at case ``start``: near the end smaller ones, so that all finish together."""
        left = self.total - start
        if not self.largest:
            return min(FIRST, left)
        share = max(left / (2 * workers), SHORTEST_S / self.cost)
        wanted = min(self.seconds_per_batch / self.cost, share, GROWTH * self.largest)
        return min(max(int(wanted), 1), left)

    def left(self, start: int) -> float:
        """Work that is left from case ``start`` on, for one worker [s]; infinite before anything is known."""
        return (self.total - start) * self.cost
