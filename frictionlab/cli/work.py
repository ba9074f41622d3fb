"""What analyze, compare-numeric and explain share: their options, the way through many recordings, what is shown."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from frictionlab.cli.drawing import Figures, figure_places
from frictionlab.cli.inputs import Rows, exit_status, on_disk, report_rows
from frictionlab.cli.options import scene_of
from frictionlab.cli.output import Shown, print_table, print_tests, print_warnings, with_error
from frictionlab.cli.progress import track
from frictionlab.tables import Row, check_output, write_rows

if TYPE_CHECKING:
    from frictionlab.analysis.measurement import Measurement
    from frictionlab.scene import Scene
    from frictionlab.schema import Table as Columns

HIDDEN = "of the screen"  # key of what travels with a row for the screen alone
LAG = (
    "lag_s_u of [sensors] is not declared: half a sampling interval of lag between the channels, either way, is assumed"
    " in the uncertainties"
)
BUDGET = {"quantity": "quantity", "cause": "cause", "uncertainty": "standard uncertainty", "share": "share [%]"}


@dataclass(frozen=True, kw_only=True)
class Work:
    """The options that commands over recordings share, and what they do with the rows."""

    scene: Path | None = None
    output: Path | None = None
    as_json: bool = False
    plot: Path | None = None
    wide: bool = False
    budget: bool = False
    workers: int | None = None
    scheduler: str | None = None
    accuracy: Literal["fast", "balanced", "exact"] | None = None
    force: bool = False
    verbose: bool = False
    quiet: bool = False

    def scene_for(self, first: Path, settings: Mapping[str, object], tables: tuple[str, ...]) -> "Scene":
        """The scene, with what the command line says in place of its keys."""
        from frictionlab.verbs.inputs import scene_given

        found = scene_of(self.scene, self.accuracy, beside=first, quiet=self.quiet or self.as_json)
        return scene_given(found, settings, tables)

    def places(self, inputs: Sequence[Path], scene: "Scene", table: "Columns", kinds: Sequence[str]) -> Figures | None:
        """Where the figures go; refuses outputs that would replace something else, before the work."""
        if self.output is not None:
            check_output(self.output, table, force=self.force, inputs=[*inputs, *scene.files])
        return figure_places(self.plot, inputs, kinds, force=self.force)

    def rows(
        self,
        inputs: Sequence[Path],
        job: Callable[..., Row],
        scene: "Scene",
        title: str,
        sifted: Callable[[Iterable[Row]], Iterable[Row]] = iter,
    ) -> tuple[Rows, list[Row]]:
        """The rows of all inputs, and the same with what the screen alone shows.

        ``job`` makes a row of a path, its ``scene`` and ``files``: where what stands on no disk has been put.
        """
        from frictionlab.verbs.rows import rows_of

        shown: list[Row] = []
        with on_disk(inputs) as files:
            made = rows_of(
                inputs, partial(job, scene=scene, files=files), workers=self.workers, scheduler=self.scheduler
            )
            watched = track(sifted(made), total=len(inputs), title=title, quiet=self.quiet or self.as_json)
            rows = report_rows(_parted(watched, shown), as_json=self.as_json)
        return rows, shown

    def write(self, rows: Rows, inputs: Sequence[Path], scene: "Scene", table: "Columns", **more: object) -> None:
        """Write the table, where one is asked for."""
        if self.output is not None:
            read = [*inputs, *scene.files]
            write_rows(rows, self.output, table, force=self.force, inputs=read, **more)  # type: ignore[arg-type]

    def show(
        self, rows: Sequence[Row], table: "Columns", columns: Sequence[Shown], scene: "Scene", *, noun: str
    ) -> list[Row]:
        """Print the table, its warnings and budgets, unless JSON was printed; return the rows that did not fail."""
        good = [row for row in rows if row.get("status") == "ok"]
        if self.as_json:
            return []
        if good and self.wide:
            print_table(good, table)
            print_tests([row for row in rows if row.get("status") != "ok"], columns, "")
        else:
            print_tests(rows, columns, headline(rows, noun))
        if self.budget:
            print_budgets(good)
        if not self.quiet:
            print_warnings(rows, verbose=self.verbose, notes=assumed(scene, good))
        return good

    def leave(self, rows: Rows) -> None:
        """Leave with the exit status that the rows ask for."""
        exit_status(rows)


def _parted(rows: Iterable[Row], shown: list[Row]) -> Iterable[Row]:
    """The rows without what is meant for the screen; with it they are put apart."""
    for row in rows:
        plain = {key: value for key, value in row.items() if key != HIDDEN}
        more = row.get(HIDDEN)
        shown.append({**plain, **more} if isinstance(more, Mapping) else plain)
        yield plain


def headline(rows: Sequence[Row], noun: str) -> str:
    """How many inputs went well, and the law where it is one for all."""
    good = [row for row in rows if row.get("status") == "ok"]
    laws = {row.get("law") for row in good} - {None}
    law = f", law {laws.pop()}" if len(laws) == 1 else ""
    return f"{len(good)} of {len(rows)} {noun}{law}"


def assumed(scene: "Scene", good: Sequence[Row]) -> list[str]:
    """What the uncertainties assume that nobody declared."""
    return [LAG] if good and scene.sensors.lag_s_u is None else []


def print_budgets(rows: Iterable[Row]) -> None:
    """Print the budget of each row: cause, standard uncertainty, and its share of the combined variance."""
    for row in rows:
        budget = row.get("budget")
        if isinstance(budget, Mapping):
            typer.echo(f"\n{row['source']}: what adds to the uncertainty")
            print_table(list(_causes(budget)), BUDGET, elsewhere="--json gives")


def _causes(budget: Mapping[str, Mapping[str, float]]) -> Iterable[Row]:
    for quantity, causes in budget.items():
        variance = sum(size**2 for size in causes.values())
        for cause, size in causes.items():
            share = 100.0 * size**2 / variance if variance else 0.0
            yield {"quantity": quantity, "cause": cause, "uncertainty": size, "share": float(f"{share:.3g}")}


def of_measurement(measurement: "Measurement") -> Row:
    """What a comparison's screen shows of its measurement."""
    row = measurement.row()
    return {key: row[key] for key in ("energy_per_cycle_j", "energy_per_cycle_u", "base_amplitude_m")}


def ratio(row: Row) -> str:
    """The frequency ratio, its digits by its uncertainty where that is known."""
    value = row.get("frequency_ratio")
    return f"{value:.4f}"[:5] if isinstance(value, float) else "-"


def energy(unit: str) -> Shown:
    """The energy per cycle in mJ, or in k Y^2 where joules are not known."""

    def text(row: Row) -> str:
        joules, plain = row.get("energy_per_cycle_j"), row.get("energy_per_cycle")
        known = isinstance(joules, float) and isinstance(plain, float) and plain
        if unit == "mJ":
            return with_error(plain, row.get("energy_per_cycle_u"), 1e3 * joules / plain) if known else "-"  # type: ignore[operator]
        return "-" if known else with_error(plain, row.get("energy_per_cycle_u"))

    return Shown(f"E [{unit}]", text, 9)


def amplitude(unit: str) -> Shown:
    """The amplitude of the mass in mm, or in Y where that is not known."""

    def text(row: Row) -> str:
        base, value, error = (row.get(k) for k in ("base_amplitude_m", "response_amplitude", "response_amplitude_u"))
        if unit == "mm":
            return with_error(value, error, 1e3 * base) if isinstance(base, float) else "-"
        return "-" if isinstance(base, float) else with_error(value, error)

    return Shown(f"X [{unit}]", text, 7)


def word(title: str, key: str, keep: int) -> Shown:
    """A text or a plain number of a row."""

    def text(row: Row) -> str:
        value = row.get(key)
        return "-" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)

    return Shown(title, text, keep)


def known(title: str, key: str, keep: int) -> Shown:
    """A number of a row with its combined uncertainty."""
    return Shown(title, lambda row: with_error(row.get(key), row.get(f"{key}_u")), keep)


MEASURED = (
    *(Shown("r", ratio, 9), energy("mJ"), energy("kY²"), amplitude("mm"), amplitude("Y")),
    *(word("stops", "stops_per_cycle", 5), word("regime", "regime", 8)),
)
COMPARED = (
    *(Shown("r", ratio, 9), energy("mJ"), energy("kY²")),
    Shown("beta", lambda row: with_error(row.get("friction_ratio"), row.get("friction_ratio_u")), 4),
    *(known("F [N]", "friction_force_n", 5), known("mu", "friction_coefficient", 8)),
    *(word("law", "law", 6), word("verdict", "verdict", 9)),
)
