"""Maps of steady states over r, beta, mu and zeta: chunks of points, each one call of the compiled kernel.

Each point is solved by itself, so that the numbers are the same bits whatever the chunks and however many processes.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import product
from multiprocessing import get_context
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator import engine as engines
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.problem import COSINE, Base, Problem, Wall
from frictionlab.simulator.state import KEYS, OUTCOMES

__all__ = ["StateMap", "sweep", "sweep_points"]

Floats = NDArray[np.float64]
CHUNK = 500  # points a call: some 10 ms of work
AXES = ("r", "beta", "mu", "zeta")
COLUMNS = {
    "energy_per_cycle": layout.ENERGY,
    "response_amplitude": layout.AMPLITUDE,
    "stops_per_cycle": layout.STOPS,
    "stuck_fraction": layout.STUCK_SHARE,
    "symmetric": layout.SYMMETRIC,
    "period_cycles": layout.PERIOD,
    "floquet_multiplier": layout.MULTIPLIER,
    "closure_error": layout.CLOSURE,
}
MOST_PHASES = 1 << 22  # recorded per orbit, 200 MB: beyond that the point is given up by name


@dataclass(frozen=True)
class StateMap:
    """A map of steady states over four axes.

    Parameters
    ----------
    r, beta, mu, zeta : ndarray
        The axes.
    wall : {"fixed", "base"}
        What the mass rubs against.
    base : Base
        Motion of the base.
    numbers : ndarray of shape (n, columns)
        One row of the kernel per point, zeta fastest; `column` and `rows` read it.
    """

    r: Floats
    beta: Floats
    mu: Floats
    zeta: Floats
    wall: Wall
    base: Base
    numbers: Floats

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Number of values along r, beta, mu, zeta."""
        return len(self.r), len(self.beta), len(self.mu), len(self.zeta)

    def column(self, position: int) -> Floats:
        """Return one number of the kernel's rows (positions: `kernel.layout`) over the map, NaN where there is none."""
        return self.numbers[:, position].reshape(self.shape)

    def datasets(self) -> dict[str, NDArray[Any]]:
        """Return one array per key of the contract over the map: numbers with NaN, texts with "", for what is not."""
        code = self.column(layout.OUTCOME).astype(np.int64)
        outcome = np.array([OUTCOMES[number] for number in range(len(OUTCOMES))])[code]
        stops = self.column(layout.STOPS)
        regime = np.where(stops > 0.0, "stick-slip", "continuous")
        regime = np.where(outcome == "stuck", "stuck", np.where(outcome == "periodic", regime, ""))
        texts = {
            "solver": np.where(self.column(layout.CLOSED_FORM) == 1.0, "closed-form", "exact"),
            "outcome": outcome,
            "regime": regime,
        }
        return texts | {key: self.column(position) for key, position in COLUMNS.items()}

    def rows(self) -> Iterator[dict[str, object]]:
        """Yield the contract's keys of each steady state, zeta fastest; what does not exist is None."""
        axes = np.meshgrid(self.r, self.beta, self.mu, self.zeta, indexing="ij")
        arrays: dict[str, NDArray[Any]] = dict(zip(AXES, axes, strict=True)) | self.datasets()
        arrays["wall"] = np.full(self.shape, self.wall)
        columns = [_listed(key, arrays[key]) for key in KEYS]
        for values in zip(*columns, strict=True):
            yield dict(zip(KEYS, values, strict=True))


def _listed(key: str, values: NDArray[Any]) -> list[object]:
    """Return an array as a list in which what does not exist is None, and counts and truths are what they are."""
    known = values.astype(object)
    if values.dtype.kind == "f":
        known[np.isnan(values)] = None
    kind = {"symmetric": bool, "period_cycles": int}.get(key)
    return [
        None if value == "" or value is None else kind(value) if kind else value for value in known.ravel().tolist()
    ]


def sweep(
    r: Sequence[float],
    beta: Sequence[float],
    mu: Sequence[float] = (1.0,),
    zeta: Sequence[float] = (0.0,),
    *,
    wall: Wall = "fixed",
    base: Base = COSINE,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> StateMap:
    """Return the steady states at every combination of r, beta, mu and zeta.

    Parameters
    ----------
    r, beta, mu, zeta : sequence of float
        Values along the four axes.
    wall, base
        As in `Problem`, the same at all points.
    workers : int
        Processes; 1 stays in this one.
    progress : callable, optional
        Called with the number of points done and of all points after each chunk.

    Returns
    -------
    StateMap

    Raises
    ------
    SimulationError
        If a value is outside its domain.
    UsageError
        If an axis is empty or the number of workers is not positive.

    Examples
    --------
    >>> states = sweep([0.3, 0.5], [0.4, 0.6])
    >>> [row["stops_per_cycle"] for row in states.rows()]
    [2.0, 2.0, 2.0, 2.0]
    """
    axes = [np.array(values, dtype=np.float64).ravel() for values in (r, beta, mu, zeta)]
    _check(axes, wall, base, workers)
    points = np.array(list(product(*axes)), dtype=np.float64).reshape(-1, 4)
    chunks = [points[start : start + CHUNK] for start in range(0, len(points), CHUNK)]
    total, done = len(points), 0
    results: list[Floats | None] = [None] * len(chunks)
    for index, numbers in _evaluate(chunks, wall, base, workers):
        results[index] = numbers
        done += len(numbers)
        if progress is not None:
            progress(done, total)
    rows = np.concatenate([numbers for numbers in results if numbers is not None])
    return StateMap(axes[0], axes[1], axes[2], axes[3], wall, base, rows)


def _check(axes: list[Floats], wall: Wall, base: Base, workers: int) -> None:
    """Refuse empty axes and values outside their domain before anything is computed."""
    for name, values in zip(AXES, axes, strict=True):
        if not values.size:
            raise UsageError(f"sweep: {name}; expected at least one value; got none")
    if workers < 1:
        raise UsageError(f"sweep: workers; expected >= 1; got {workers}")
    for position, values in enumerate(axes):
        for value in values:
            point = [float(axis[0]) for axis in axes]
            point[position] = float(value)
            Problem(point[0], point[1], point[2], point[3], wall, base)


def _evaluate(chunks: list[Floats], wall: Wall, base: Base, workers: int) -> Iterator[tuple[int, Floats]]:
    """Yield index and numbers of each chunk as it is done."""
    size = sum(len(chunk) * 10.0 + float(np.sum(4.0 / chunk[:, 0])) for chunk in chunks)
    fast = engines.is_worth_it(size)
    if workers == 1 or len(chunks) == 1:
        for index, chunk in enumerate(chunks):
            yield index, sweep_points(chunk, wall, base, fast=fast)
        return
    if fast:
        engines.compiled()  # once, here: the processes then find the machine code
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        futures: dict[Future[Floats], int] = {
            pool.submit(sweep_points, chunk, wall, base, fast=fast): index for index, chunk in enumerate(chunks)
        }
        for future in as_completed(futures):
            yield futures[future], future.result()


def sweep_points(points: Floats, wall: Wall, base: Base, *, fast: bool) -> Floats:
    """Return the kernel's rows of points given as (n, 4): r, beta, mu, zeta. What a worker does."""
    engine = engines.compiled() if fast else engines.choose(0.0)
    phases = 64 + int(10 * (base.harmonics + 1.0 / float(points[:, 0].min())))
    numbers = _call(engine, points, wall, base, phases)
    while np.any(full := numbers[:, layout.OUTCOME] == layout.OVERFULL):
        phases *= 4
        if phases > MOST_PHASES:
            r, beta = points[full][0, :2]
            raise SimulationError(f"sweep: r = {r!r}, beta = {beta!r}; expected at most {MOST_PHASES} phases; got more")
        numbers[full] = _call(engine, points[full], wall, base, phases)
    return numbers


def _call(engine: engines.Engine, points: Floats, wall: Wall, base: Base, phases: int) -> Floats:
    """Call the kernel once for all points."""
    problem = Problem(1.0, 0.0, wall=wall, base=base)
    room = engines.make_room(engine, problem, phases)
    force = engines.make_force(engine, base.cosine, base.sine)
    rows = engine.buffer((0.0,) * (layout.ROW * len(points)))
    flat = engine.buffer(tuple(points.ravel().tolist()))
    engine.kernel.sweep(flat, engine.buffer(base.cosine), engine.buffer(base.sine), force, 0, room, rows)
    return np.array(rows, dtype=np.float64).reshape(len(points), layout.ROW)
