"""``frictionlab show``: what is in a recording, a scene or a result."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from frictionlab.cli.output import print_table, printable
from frictionlab.errors import FrictionlabError, UsageError
from frictionlab.tables import Row, read_rows

# The columns that say most, for a table that fits a terminal; all others are in the file.
COMPARISON = {
    "source": "source",
    "frequency_ratio": "r",
    "energy_per_cycle": "energy",
    "friction_ratio": "beta",
    "friction_ratio_se": "se",
    "predicted_energy_per_cycle": "predicted",
    "response_nrmse": "nrmse",
    "stops_per_cycle": "stops",
    "predicted_stops_per_cycle": "predicted",
    "regime": "regime",
}
MEASUREMENT = {
    "source": "source",
    "frequency_ratio": "r",
    "energy_per_cycle": "energy",
    "energy_per_cycle_se": "se",
    "response_amplitude": "amplitude",
    "irregularity_index": "irregularity",
    "stops_per_cycle": "stops",
    "regime": "regime",
}
STEADY_STATE = {
    key: key
    for key in ("r", "beta", "mu", "zeta", "energy_per_cycle", "response_amplitude", "stops_per_cycle", "outcome")
}


def show(file: Annotated[Path, typer.Argument(metavar="FILE", help="A recording, scene or result.")]) -> None:
    """Show what is in a recording (.h5), a scene (.toml) or a result (.jsonl, .csv, .h5).

    Example: frictionlab show configs/frame.toml
    """
    readers: Mapping[str, Callable[[Path], None]] = {
        ".toml": _show_scene,
        ".h5": _show_tree,
        ".jsonl": _show_rows,
        ".csv": _show_rows,
    }
    if file.suffix not in readers:
        raise UsageError(f"{file}: expected one of {', '.join(readers)}; got {file.suffix or 'no suffix'}")
    try:
        readers[file.suffix](file)
    except OSError as error:
        if isinstance(error, (FrictionlabError, BrokenPipeError)):
            raise
        raise UsageError(f"{file}: cannot be read ({error.strerror}): give the path of an existing file") from error


def _show_scene(file: Path) -> None:
    from frictionlab.scene import read_scene

    for table, keys in read_scene(file).model_dump().items():
        typer.echo(f"[{table}]")
        for key, value in keys.items():
            typer.echo(f"  {key} = {printable(str(value))}")


def _show_tree(file: Path) -> None:
    from frictionlab.hdf5 import describe

    for line in describe(file):
        typer.echo(printable(line))


def _show_rows(file: Path) -> None:
    rows = read_rows(file)
    print_table(rows, _columns_of(rows))
    for row in rows:
        _tell(row)


def _columns_of(rows: Sequence[Row]) -> Mapping[str, str]:
    keys = {key for row in rows for key in row}
    for columns, mark in (
        (COMPARISON, "friction_ratio"),
        (MEASUREMENT, "irregularity_index"),
        (STEADY_STATE, "outcome"),
    ):
        if mark in keys:
            return columns
    return {key: key for key in rows[0]} if rows else {"(no rows)": "(no rows)"}


def _tell(row: Row) -> None:
    source = row.get("source")
    if row.get("status") == "failed":
        typer.echo(f"{printable(str(source))}: failed: {printable(str(row.get('reason')))}")
    warnings = row.get("warnings")
    for warning in warnings if isinstance(warnings, list) else []:
        typer.echo(f"{printable(str(source))}: {printable(str(warning))}")
