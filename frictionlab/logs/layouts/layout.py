"""What a layout says of a log."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from frictionlab.logs.columns import Column
from frictionlab.logs.dialect import Dialect


@dataclass(frozen=True)
class Layout:
    """Where things stand in a log.

    Parameters
    ----------
    name
        Of the layout.
    dialect
        Separator, decimal mark, shape of a data line.
    columns
        One for each field.
    header
        Indices from 0 of the lines that are header: names and units.
    body
        Index from 0 of the first line below the header.
    facts
        What the preamble tells: ``interval_s``, ``start_s`` (seconds since 1970 UTC), ``sensor``.
    prefer
        Columns of a role, by index, where the layout knows better than the names.
    time_of
        For each channel its own time column, by index, where a log has several.
    spare
        So many cells of text may follow the fields of a data line.
    is_header
        Says of a stripped line in the body whether it is a header repeated.
    evidence
        Sentences on why.
    """

    name: str
    dialect: Dialect
    columns: tuple[Column, ...]
    header: tuple[int, ...]
    body: int
    facts: Mapping[str, float | str] = field(default_factory=dict)
    prefer: Mapping[str, int] = field(default_factory=dict)
    time_of: Mapping[int, int] = field(default_factory=dict)
    spare: int = 0
    is_header: Callable[[str], bool] = field(default=lambda _: False)
    evidence: tuple[str, ...] = ()
