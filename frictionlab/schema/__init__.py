"""Every column of every table: its name, type, unit, title and a sentence; the one home of these facts.

From here follow the files (CSV, JSON Lines, Excel, Parquet, HDF5 with ``units`` and ``long_name``), what ``show`` and
the commands print, and the list of columns in this folder's README. Nothing but the standard library is imported.
"""

from collections.abc import Sequence

from frictionlab.schema.campaign import DRIFTS, FRICTION, LAW_PARAMETERS, MATERIAL_LAWS, RANKING, TESTS
from frictionlab.schema.column import Column, Table, Type
from frictionlab.schema.measured import COMPARISONS, FREE_VIBRATIONS, LAWS, MEASUREMENTS, OUTCOME, RECORD_LAWS
from frictionlab.schema.simulated import MOTIONS, PLANS, RESPONSES, STEADY_STATES, TRADES

__all__ = [
    "COMPARISONS",
    "DRIFTS",
    "FREE_VIBRATIONS",
    "FRICTION",
    "LAWS",
    "LAW_PARAMETERS",
    "MATERIAL_LAWS",
    "MEASUREMENTS",
    "MOTIONS",
    "OUTCOME",
    "PLANS",
    "RANKING",
    "RECORD_LAWS",
    "RESPONSES",
    "STEADY_STATES",
    "TABLES",
    "TESTS",
    "TRADES",
    "Column",
    "Table",
    "Type",
    "column_of",
    "is_marked",
    "table_of",
]

TABLES = (
    *(MEASUREMENTS, COMPARISONS, LAWS, RECORD_LAWS, FREE_VIBRATIONS, TESTS, FRICTION, RANKING, DRIFTS, MATERIAL_LAWS),
    LAW_PARAMETERS,
    *(STEADY_STATES, MOTIONS, RESPONSES, PLANS, TRADES),
)


def is_marked(names: Sequence[str], table: Table) -> bool:
    """Whether columns of these names bear the mark of a kind: all of its first columns, first and in order.

    Examples
    --------
    >>> is_marked(("log", "material", "normal_force_n"), FRICTION)
    False
    """
    return tuple(names[: table.lead]) == table.mark


def table_of(names: Sequence[str]) -> Table | None:
    """The kind of table that columns of these names belong to; None if to none.

    Columns may be added, taken away behind the mark, or moved by hand: the kind is that which has most of them.

    Examples
    --------
    >>> found = table_of(("material", *FRICTION.names))
    >>> found is not None and found.kind
    'friction'
    """
    known = set(names)
    fitting = [table for table in TABLES if known.issuperset(table.mark)]
    return max(fitting, key=lambda t: (len(known & set(t.names)), -len(t.names)), default=None)


def column_of(name: str, table: Table | None = None) -> Column | None:
    """The column of this name in a table or, without one, in the first that has it; None for a user's own column."""
    found = (t.column(name) for t in (TABLES if table is None else (table,)))
    return next((column for column in found if column is not None), None)
