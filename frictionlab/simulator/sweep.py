"""Maps of steady states over r, beta, mu, zeta and the parameters of a law: chunks of points.

Laws with exact phases are one call of the compiled flow per chunk; others are solved point by point. Each point is
solved by itself, so that the numbers are the same bits whatever the chunks and whoever solves them.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import UsageError
from frictionlab.schema import Result
from frictionlab.simulator import row as places
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.notes import WORDS, Note, notes_of
from frictionlab.simulator.problem import COSINE, Base, Problem, Wall
from frictionlab.simulator.solve import steady_state
from frictionlab.simulator.state import KEYS, OUTCOMES, PLACES, SOLVERS, from_numbers, to_numbers

FAILED = "failed"  # outcome of a point that could not be solved
CHUNK = 500  # points a call: some 10 ms of work
AXES = ("r", "beta", "mu", "zeta")


@dataclass(frozen=True)
class Grid:
    """Every combination of r, beta, mu, zeta and further parameters of a law, the last one fastest.

    Attributes
    ----------
    r, beta, mu, zeta
        The values of each.
    wall
        What the mass rubs against, the same at all points.
    law
        Contact law, the same at all points.
    parameters
        Name and values of further parameters of the law.
    base
        Motion of the base, the same at all points.

    Raises
    ------
    SimulationError
        A value is outside its domain.
    UsageError
        An axis is empty.

    Examples
    --------
    >>> grid = Grid((0.3, 0.5), (0.4, 0.6), (1.0,), (0.0,))
    >>> len(grid), grid.points(range(1, 3)).tolist()
    (4, [[0.3, 0.6, 1.0, 0.0], [0.5, 0.4, 1.0, 0.0]])
    """

    r: tuple[float, ...]
    beta: tuple[float, ...]
    mu: tuple[float, ...] = (1.0,)
    zeta: tuple[float, ...] = (0.0,)
    wall: Wall = "fixed"
    law: str = "coulomb"
    parameters: tuple[tuple[str, tuple[float, ...]], ...] = ()
    base: Base = COSINE

    def __post_init__(self) -> None:
        axes = self.axes()
        for name, values in axes.items():
            if not values.size:
                raise UsageError(f"sweep: {name}; expected at least one value; got none")
        first = {name: float(values[0]) for name, values in axes.items()}
        for name, values in axes.items():
            for value in values.tolist():
                self.problem(tuple((first | {name: value}).values()))

    def __len__(self) -> int:
        return prod(len(values) for values in self.axes().values())

    def axes(self) -> dict[str, FloatArray]:
        """The values along each axis."""
        values = {name: getattr(self, name) for name in AXES} | dict(self.parameters)
        return {name: np.array(along, dtype=np.float64) for name, along in values.items()}

    def points(self, numbers: Sequence[int]) -> FloatArray:
        """The points of these neighbouring numbers, shape (n, 4 and more): r, beta, mu, zeta, further parameters."""
        axes = list(self.axes().values())
        places = np.unravel_index(np.arange(numbers[0], numbers[-1] + 1), tuple(len(axis) for axis in axes))
        return np.stack([axis[place] for axis, place in zip(axes, places, strict=True)], axis=1)

    def problem(self, point: Sequence[float]) -> Problem:
        """Return the problem at a point; what a parameter says goes before mu and zeta."""
        r, beta, mu, zeta, *more = (float(value) for value in point)
        values = dict(zip((name for name, _ in self.parameters), more, strict=True))
        return Problem(r, beta, mu, zeta, self.wall, self.base, law=self.law, parameters=values)

    def values(self, points: FloatArray) -> dict[str, FloatArray]:
        """Return the numbers (n,) of the law at points (n, axes); what a parameter says goes before mu and zeta."""
        values = dict(zip((*AXES, *(name for name, _ in self.parameters)), points.T, strict=True))
        mu, zeta = values.pop("mu"), values.pop("zeta")
        return {"static_ratio_up": mu, "static_ratio_down": mu, "contact_damping_ratio": zeta} | values


@dataclass(frozen=True)
class StateMap(Result):
    """A map of steady states over r, beta, mu, zeta and further parameters of a law.

    Parameters
    ----------
    grid : Grid
        Its points.
    numbers : ndarray of shape (n, columns)
        One row per point, the last axis fastest: all NaN where it could not be solved; `datasets` and `rows` read it.
    """

    grid: Grid
    numbers: FloatArray

    def __repr__(self) -> str:
        along = [
            f"{name} {a[0]:g}" if len(a) == 1 else f"{len(a)} {name} {a[0]:g} to {a[-1]:g}"
            for name, a in self.grid.axes().items()
        ]
        return f"<StateMap {self.grid.law}: {', '.join(along)}; {self.grid.wall} wall>"

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values along r, beta, mu, zeta and the further parameters."""
        return tuple(len(axis) for axis in self.grid.axes().values())

    def datasets(self) -> dict[str, NDArray[Any]]:
        """Return one array per key of the contract over the map: numbers with NaN, texts with "", for what is not."""
        return {key: values.reshape(self.shape) for key, values in named(self.numbers).items()}

    def rows(self) -> list[dict[str, object]]:
        """Return the contract's keys of each steady state, the last axis fastest; what does not exist is None."""
        return list(self.rows_among(range(len(self.grid))))

    def rows_among(self, part: range) -> Iterator[dict[str, object]]:
        """Yield the rows of neighbouring points; a law other than plain Coulomb friction stands after the others."""
        grid, points, columns = self.grid, self.grid.points(part), named(self.numbers[part.start : part.stop])
        also = () if (grid.law, grid.parameters) == ("coulomb", ()) else ("law", *(name for name, _ in grid.parameters))
        columns |= dict(zip(grid.axes(), points.T, strict=True))
        columns |= {"wall": np.full(len(points), grid.wall), "law": np.full(len(points), grid.law)}
        keys = (*KEYS, *also)
        listed = zip(*(_listed(key, columns[key]) for key in keys), strict=True)
        for point, numbers, values in zip(points, self.numbers[part.start : part.stop], listed, strict=True):
            row = dict(zip(keys, values, strict=True))
            said: Sequence[str] = [f"{WORDS[Note.FAILED]}."] if row["outcome"] == FAILED else ()
            if row["warnings"] and not said:
                said = from_numbers(grid.problem(point.tolist()), numbers, notes=row["warnings"]).warnings
            yield row | {"warnings": list(said)}

    def place(self, number: int) -> str:
        """The coordinates of a point in words."""
        point = self.grid.points(range(number, number + 1))[0]
        return ", ".join(f"{name} = {value:g}" for name, value in zip(self.grid.axes(), point, strict=True))

    @property
    def outcomes(self) -> Counter[str]:
        """How many points have which outcome, the most frequent first."""
        return Counter(dict(Counter(named(self.numbers)["outcome"].tolist()).most_common()))

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each kind of note: at how many points it stands, what it says, and which is the first."""
        notes, sentences = named(self.numbers)["warnings"], list[str]()
        for note in Note:
            here = np.flatnonzero(notes & note.value)
            if here.size and note != Note.FAILED:  # that is said point by point
                where = f"at {here.size} of {len(notes)} points"
                sentences.append(f"{where} {WORDS[note]} (the first: {self.place(int(here[0]))})")
        return tuple(sentences)


def named(numbers: FloatArray) -> dict[str, NDArray[Any]]:
    """Return one array (n,) per key of the contract: numbers with NaN, texts with "", for what is not.

    `numbers`: rows of steady states; one that is all NaN is a point that could not be solved. Warnings are the bits of
    `notes.Note`.
    """
    code = np.nan_to_num(numbers[:, places.OUTCOME], nan=len(OUTCOMES)).astype(np.int64)
    outcome = np.array([*(OUTCOMES[number] for number in range(len(OUTCOMES))), FAILED])[code]
    regime = np.where(numbers[:, places.STOPS] > 0.0, "stick-slip", "continuous")
    regime = np.where(outcome == "stuck", "stuck", np.where(outcome == "periodic", regime, ""))
    texts = {
        "solver": np.array(SOLVERS)[np.nan_to_num(numbers[:, places.SOLVER]).astype(np.int64)],
        "outcome": outcome,
        "regime": regime,
    }
    notes = np.nan_to_num(numbers[:, places.NOTES], nan=Note.FAILED).astype(np.uint32)
    return texts | {key: numbers[:, position] for key, position in PLACES.items()} | {"warnings": notes}


def _listed(key: str, values: NDArray[Any]) -> list[object]:
    """Return an array as a list in which what does not exist is None, and counts and truths are what they are."""
    known = values.astype(object)
    if values.dtype.kind == "f":
        known[np.isnan(values)] = None
    kind = {"symmetric": bool, "period_cycles": int, "warnings": int}.get(key)
    return [None if value == "" or value is None else kind(value) if kind else value for value in known.tolist()]


def sweep(
    r: Sequence[float],
    beta: Sequence[float],
    mu: Sequence[float] = (1.0,),
    zeta: Sequence[float] = (0.0,),
    *,
    wall: Wall = "fixed",
    base: Base = COSINE,
    law: str = "coulomb",
    parameters: Mapping[str, Sequence[float]] | None = None,
) -> StateMap:
    """Return the steady states at every combination of r, beta, mu, zeta and a law's parameters, solved here.

    Large maps, several processes and files: `frictionlab.maps`.

    Parameters
    ----------
    r, beta, mu, zeta : sequence of float
        Values along the first four axes.
    wall, base, law
        As in `Problem`, the same at all points.
    parameters : mapping of str to sequence of float, optional
        Values along further axes, by the names of the law's parameters.

    Returns
    -------
    StateMap

    Raises
    ------
    SimulationError
        If a value is outside its domain, or a point cannot be solved.
    UsageError
        If an axis is empty.

    Examples
    --------
    >>> states = sweep([0.3, 0.5], [0.4, 0.6])
    >>> [row["stops_per_cycle"] for row in states.rows()]
    [2.0, 2.0, 2.0, 2.0]
    >>> states = sweep([0.5], [0.4], law="coulomb+place", parameters={"gradient": [0.0, 0.05]})
    >>> [(row["gradient"], row["stops_per_cycle"]) for row in states.rows()]
    [(0.0, 2.0), (0.05, 1.0)]
    """
    more = tuple((name, tuple(map(float, values))) for name, values in (parameters or {}).items())
    rs, betas, mus, zetas = (tuple(map(float, values)) for values in (r, beta, mu, zeta))
    grid = Grid(rs, betas, mus, zetas, wall, law, more, base)
    chunks = [range(start, min(start + CHUNK, len(grid))) for start in range(0, len(grid), CHUNK)]
    return StateMap(grid, np.concatenate([sweep_points(grid.points(c), grid) for c in chunks]))


def warm_up(law: str) -> None:
    """Load the compiled code that answers for a law, or compile it: its solver then takes it for every point."""
    steady_state(Problem(0.5, 0.4), solver="auto" if law_of(law).is_exact else "numeric")


def sweep_points(points: FloatArray, grid: Grid) -> FloatArray:
    """Return the rows of points (n, axes) of a grid. What a worker does."""
    if not law_of(grid.law).is_exact:
        return np.array([to_numbers(steady_state(grid.problem(point))) for point in points.tolist()])
    from frictionlab.simulator.exact.solve import rows_of, systems_of  # noqa: PLC0415 - half a second to load

    values, rigid = grid.values(points), law_of(grid.law).kind == "rigid"
    rows = rows_of(systems_of(values, grid.wall, grid.base))
    rows[:, places.NOTES] = notes_of(values, grid.wall, grid.base, rows.T, rigid=rigid)
    return rows
