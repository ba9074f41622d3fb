"""The uncertainty budget on the screen: what adds how much to each number, and what was assumed."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Annotated

import typer

from frictionlab.cli.output import complain, print_table
from frictionlab.tables import Row

if TYPE_CHECKING:
    from frictionlab.scene import Scene

Budget = Annotated[bool, typer.Option("--budget", help="Print what adds how much to the uncertainty of each number.")]
TITLES = {"quantity": "quantity", "cause": "cause", "uncertainty": "standard uncertainty", "share": "share [%]"}


def print_budgets(rows: Iterable[Row]) -> None:
    """Print the budget of each row: cause, standard uncertainty, and its share of the combined variance."""
    for row in rows:
        budget = row.get("budget")
        if isinstance(budget, Mapping):
            typer.echo(f"\n{row['source']}: what adds to the uncertainty")
            print_table(list(_lines(budget)), TITLES, elsewhere="--json gives")


def _lines(budget: Mapping[str, Mapping[str, float]]) -> Iterable[Row]:
    for quantity, causes in budget.items():
        variance = sum(size**2 for size in causes.values())
        for cause, size in causes.items():
            share = 100.0 * size**2 / variance if variance else 0.0
            yield {"quantity": quantity, "cause": cause, "uncertainty": size, "share": float(f"{share:.3g}")}


def tell_assumed(scene: "Scene", rows: Iterable[Row], *, quiet: bool) -> None:
    """Say once, of numbers that there are, that the lag between the channels is assumed and not declared."""
    if not quiet and scene.sensors.lag_s_u is None and any(row.get("status") == "ok" for row in rows):
        complain(
            "note: the lag between the channels is not declared: half a sampling interval either way is assumed in the"
            " uncertainties; say what is known in lag_s_u of [sensors]"
        )
