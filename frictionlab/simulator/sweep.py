"""Maps of steady states over r, beta, mu and zeta: chunks of points, each one call of the compiled kernel.

Each point is solved by itself, so that the numbers are the same bits whatever the chunks and whoever solves them.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator import engine as engines
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.problem import COSINE, Base, Problem, Wall
from frictionlab.simulator.state import KEYS, OUTCOMES

__all__ = ["StateMap", "check_axes", "named", "sweep", "sweep_points", "table", "worth_compiling"]

Floats = NDArray[np.float64]
FAILED = "failed"  # outcome of a point that could not be solved
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
        return {key: values.reshape(self.shape) for key, values in named(self.numbers).items()}

    def rows(self) -> Iterator[dict[str, object]]:
        """Yield the contract's keys of each steady state, zeta fastest; what does not exist is None."""
        return table(_points([self.r, self.beta, self.mu, self.zeta]), self.wall, named(self.numbers))


def named(numbers: Floats) -> dict[str, NDArray[Any]]:
    """Return one array (n,) per key of the contract: numbers with NaN, texts with "", for what is not.

    Parameters
    ----------
    numbers : ndarray of shape (n, columns)
        Rows of the kernel; one that is all NaN is a point that could not be solved.
    """
    code = np.nan_to_num(numbers[:, layout.OUTCOME], nan=len(OUTCOMES)).astype(np.int64)
    outcome = np.array([*(OUTCOMES[number] for number in range(len(OUTCOMES))), FAILED])[code]
    regime = np.where(numbers[:, layout.STOPS] > 0.0, "stick-slip", "continuous")
    regime = np.where(outcome == "stuck", "stuck", np.where(outcome == "periodic", regime, ""))
    texts = {
        "solver": np.where(numbers[:, layout.CLOSED_FORM] == 1.0, "closed-form", "exact"),
        "outcome": outcome,
        "regime": regime,
    }
    return texts | {key: numbers[:, position] for key, position in COLUMNS.items()}


def table(points: Floats, wall: Wall, columns: Mapping[str, NDArray[Any]]) -> Iterator[dict[str, object]]:
    """Yield the contract's keys of points (n, 4) and what `named` says of them; what does not exist is None."""
    arrays = dict(columns) | dict(zip(AXES, points.T, strict=True)) | {"wall": np.full(len(points), wall)}
    for values in zip(*(_listed(key, arrays[key]) for key in KEYS), strict=True):
        yield dict(zip(KEYS, values, strict=True))


def _listed(key: str, values: NDArray[Any]) -> list[object]:
    """Return an array as a list in which what does not exist is None, and counts and truths are what they are."""
    known = values.astype(object)
    if values.dtype.kind == "f":
        known[np.isnan(values)] = None
    kind = {"symmetric": bool, "period_cycles": int}.get(key)
    return [None if value == "" or value is None else kind(value) if kind else value for value in known.tolist()]


def sweep(
    r: Sequence[float],
    beta: Sequence[float],
    mu: Sequence[float] = (1.0,),
    zeta: Sequence[float] = (0.0,),
    *,
    wall: Wall = "fixed",
    base: Base = COSINE,
) -> StateMap:
    """Return the steady states at every combination of r, beta, mu and zeta, solved by this process.

    Large maps, several processes and files: `frictionlab.maps`.

    Parameters
    ----------
    r, beta, mu, zeta : sequence of float
        Values along the four axes.
    wall, base
        As in `Problem`, the same at all points.

    Returns
    -------
    StateMap

    Raises
    ------
    SimulationError
        If a value is outside its domain.
    UsageError
        If an axis is empty.

    Examples
    --------
    >>> states = sweep([0.3, 0.5], [0.4, 0.6])
    >>> [row["stops_per_cycle"] for row in states.rows()]
    [2.0, 2.0, 2.0, 2.0]
    """
    axes = [np.array(values, dtype=np.float64).ravel() for values in (r, beta, mu, zeta)]
    check_axes(axes, wall, base)
    points = _points(axes)
    fast = worth_compiling(axes)
    chunks = [points[start : start + CHUNK] for start in range(0, len(points), CHUNK)]
    rows = np.concatenate([sweep_points(chunk, wall, base, fast=fast) for chunk in chunks])
    return StateMap(axes[0], axes[1], axes[2], axes[3], wall, base, rows)


def check_axes(axes: Sequence[Floats], wall: Wall, base: Base) -> None:
    """Refuse empty axes and values outside their domain before anything is computed."""
    for name, values in zip(AXES, axes, strict=True):
        if not values.size:
            raise UsageError(f"sweep: {name}; expected at least one value; got none")
    for position, values in enumerate(axes):
        for value in values:
            point = [float(axis[0]) for axis in axes]
            point[position] = float(value)
            Problem(point[0], point[1], point[2], point[3], wall, base)


def worth_compiling(axes: Sequence[Floats]) -> bool:
    """Tell whether the map over these axes is large enough for the compiled kernel."""
    others = float(np.prod([len(axis) for axis in axes[1:]]))
    return engines.is_worth_it(others * (10.0 * len(axes[0]) + float(np.sum(4.0 / axes[0]))))


def _points(axes: Sequence[Floats]) -> Floats:
    return np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=1)


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


def full_points(points: Floats) -> Floats:
    """Return points (n, 4) of r, beta, mu, zeta as the kernel reads them: r and the numbers of `layout.Contact`."""
    r, beta, mu, zeta = points.T
    none = np.zeros_like(r)
    return np.column_stack((r, beta, none, mu, mu, zeta, none))


def _call(engine: engines.Engine, points: Floats, wall: Wall, base: Base, phases: int) -> Floats:
    """Call the kernel once for all points."""
    problem = Problem(1.0, 0.0, wall=wall, base=base)
    room = engines.make_room(engine, problem, phases)
    force = engines.make_force(engine, base.cosine, base.sine)
    rows = engine.buffer((0.0,) * (layout.ROW * len(points)))
    flat = engine.buffer(tuple(full_points(points).ravel().tolist()))
    engine.kernel.sweep(flat, engine.buffer(base.cosine), engine.buffer(base.sine), force, 0, room, rows)
    return np.array(rows, dtype=np.float64).reshape(len(points), layout.ROW)
