"""What commands over many recordings share: their options, the way through them, what a screen shows of their rows."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

from frictionlab.cli.arguments import Figures, Rows, figure_places, on_disk, report_rows
from frictionlab.cli.options import Results, scene_of
from frictionlab.cli.screen import Shown, print_table, print_tests, print_warnings, track
from frictionlab.tables import Row, check_output, write_rows
from frictionlab.tables.texts import with_error

if TYPE_CHECKING:
    from frictionlab.scene import Scene
    from frictionlab.schema import Table

HIDDEN = "of the screen"  # key of what travels with a row for the screen alone
LAG = (
    "lag_s_u of [sensors] is not declared: half a sampling interval of lag between the channels, either way, is assumed"
    " in the uncertainties"
)
BUDGET = {"quantity": "quantity", "cause": "cause", "uncertainty": "standard uncertainty", "share": "share [%]"}


@dataclass(frozen=True, kw_only=True)
class ManyInputs(Results):
    """The options that commands over recordings share, and what they do with the rows."""

    scene: Path | None = None
    wide: bool = False
    verbose: bool = False
    workers: int | None = None
    scheduler: str | None = None

    def scene_for(self, first: Path, settings: Mapping[str, object], tables: tuple[str, ...]) -> "Scene":
        """The scene, with what the command line says in place of its keys."""
        from frictionlab.verbs.inputs import scene_given

        found = scene_of(self.scene, beside=first, quiet=self.quiet or self.as_json)
        return scene_given(found, settings, tables)

    def places(self, inputs: Sequence[Path], scene: "Scene", table: "Table", kinds: Sequence[str]) -> Figures | None:
        """Where the figures go; refuses outputs that would replace something else, before the work."""
        if self.output is not None:
            check_output(self.output, table, force=self.force, inputs=[*inputs, *scene.files])
        return figure_places(self.plot, inputs, kinds, force=self.force)

    def rows(
        self,
        inputs: Sequence[Path],
        job: Callable[..., Row],
        title: str,
        sifted: Callable[[Iterable[Row]], Iterable[Row]] = iter,
    ) -> tuple[Rows, list[Row]]:
        """The rows of all inputs, and the same with what the screen alone shows.

        ``job`` makes a row of a path and ``files``: where what stands on no disk has been put.
        """
        from frictionlab.verbs.inputs import rows_of

        shown: list[Row] = []
        with on_disk(inputs) as files:
            made = rows_of(inputs, partial(job, files=files), workers=self.workers, scheduler=self.scheduler)
            watched = track(sifted(made), total=len(inputs), title=title, quiet=self.quiet or self.as_json)
            rows = report_rows(_parted(watched, shown), as_json=self.as_json)
        return rows, shown

    def write(self, rows: Sequence[Row], inputs: Sequence[Path], scene: "Scene", table: "Table", **more: Any) -> None:
        """Write the table, where one is asked for."""
        if self.output is not None:
            write_rows(rows, self.output, table, force=self.force, inputs=[*inputs, *scene.files], **more)

    def show(
        self, rows: Sequence[Row], table: "Table", columns: Sequence[Shown], scene: "Scene", *, noun: str
    ) -> list[Row]:
        """Print the table and its warnings, unless JSON was printed; return the rows that did not fail."""
        if self.as_json:
            return []
        good = [row for row in rows if row.get("status") == "ok"]
        if good and self.wide:
            print_table(good, table)
            print_tests([row for row in rows if row.get("status") != "ok"], columns, "")
        else:
            print_tests(rows, columns, headline(rows, noun))
        if not self.quiet:
            print_warnings(rows, verbose=self.verbose, notes=assumed(scene, good))
        return good


@dataclass(frozen=True, kw_only=True)
class Judged(ManyInputs):
    """The options of analyze, compare-numeric and explain."""

    budget: bool = False
    accuracy: Literal["fast", "balanced", "exact"] | None = None

    def scene_for(self, first: Path, settings: Mapping[str, object], tables: tuple[str, ...]) -> "Scene":
        """The scene, its knobs set to the level of accuracy."""
        scene = super().scene_for(first, settings, tables)
        return scene if self.accuracy is None else scene.with_accuracy(self.accuracy)

    def show(
        self, rows: Sequence[Row], table: "Table", columns: Sequence[Shown], scene: "Scene", *, noun: str
    ) -> list[Row]:
        """The table, then the budget of each row: cause, standard uncertainty, its share of the combined variance."""
        good = super().show(rows, table, columns, scene, noun=noun)
        for row in good if self.budget else ():
            budget = row.get("budget")
            if isinstance(budget, Mapping):
                typer.echo(f"\n{row['source']}: what adds to the uncertainty")
                print_table(list(_causes(budget)), BUDGET, elsewhere="--json gives")
        return good


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
    moved = [row.get("nuisances") or {"lag_s": None} for row in good]
    lags = any(isinstance(names, Mapping) and "lag_s" in names for names in moved)  # a table over frequency has none
    return [LAG] if lags and scene.sensors.lag_s_u is None else []


def _causes(budget: Mapping[str, Mapping[str, float]]) -> Iterable[Row]:
    for quantity, causes in budget.items():
        variance = sum(size**2 for size in causes.values())
        for cause, size in causes.items():
            share = 100.0 * size**2 / variance if variance else 0.0
            yield {"quantity": quantity, "cause": cause, "uncertainty": size, "share": float(f"{share:.3g}")}


def _ratio(row: Row) -> str:
    value = row.get("frequency_ratio")
    return f"{value:.3f}" if isinstance(value, float) else "-"


def _scaled(unit: str, title: str, key: str, factor: Callable[[Row], float | None], keep: int) -> tuple[Shown, Shown]:
    """A number with its uncertainty in physical units, and beside it dimensionless where those are not known."""

    def text(row: Row, *, physical: bool) -> str:
        times = factor(row)
        if physical != (times is not None):
            return "-"
        return with_error(row.get(key), row.get(f"{key}_u"), times or 1.0)

    plain = "kY²" if title == "E" else "Y"
    return (
        Shown(f"{title} [{unit}]", partial(text, physical=True), keep),
        Shown(f"{title} [{plain}]", partial(text, physical=False), keep),
    )


def _millijoules(row: Row) -> float | None:
    joules, plain = row.get("energy_per_cycle_j"), row.get("energy_per_cycle")
    known = isinstance(joules, float) and isinstance(plain, float) and plain
    return 1e3 * joules / plain if known else None  # type: ignore[operator]


def _millimetres(row: Row) -> float | None:
    base = row.get("base_amplitude_m")
    return 1e3 * base if isinstance(base, float) else None


def _word(title: str, key: str, keep: int) -> Shown:
    """A text or a plain number of a row."""

    def text(row: Row) -> str:
        value = row.get(key)
        return "-" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)

    return Shown(title, text, keep)


def _known(title: str, key: str, keep: int) -> Shown:
    """A number of a row with its combined uncertainty."""
    return Shown(title, lambda row: with_error(row.get(key), row.get(f"{key}_u")), keep)


_R, _ENERGY = Shown("r", _ratio, 9), _scaled("mJ", "E", "energy_per_cycle", _millijoules, 9)
MEASURED = (
    *(_R, *_ENERGY, *_scaled("mm", "X", "response_amplitude", _millimetres, 7)),
    *(_word("stops", "stops_per_cycle", 5), _word("regime", "regime", 8)),
)
COMPARED = (
    *(_R, *_ENERGY, _known("beta", "friction_ratio", 4)),
    *(_known("F [N]", "friction_force_n", 5), _known("mu", "friction_coefficient", 8)),
    *(_word("law", "law", 6), _word("verdict", "verdict", 9)),
)
