"""``frictionlab tradeoff``: error against time for every accuracy knob, on this machine."""

from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from frictionlab.cli.output import print_table
from frictionlab.cli.progress import track
from frictionlab.files import make_folder
from frictionlab.schema import TRADES
from frictionlab.tables import check_output, json_line, write_rows

if TYPE_CHECKING:
    from frictionlab.tradeoff.setting import Setting


def tradeoff(
    output: Path | None = None,
    as_json: bool = False,
    force: bool = False,
    quiet: bool = False,
) -> None:
    """Measure error against time for every accuracy knob, on this machine; about a minute.

    Example: frictionlab tradeoff -o build/tradeoff
    """
    from frictionlab.figures.mark import check_figures
    from frictionlab.tradeoff.knobs import FAMILIES, measure_trade

    if output is not None:
        make_folder(output)
        check_output(output / "tradeoff.csv", TRADES, force=force)
        check_figures([_figure(output, family) for family in FAMILIES], force=force)
    families: dict[str, list[tuple[Setting, ...]]] = defaultdict(list)
    total = sum(len(knobs) for knobs in FAMILIES.values())
    for family, settings in track(measure_trade(), total=total, title="tradeoff", quiet=quiet or as_json):
        families[family].append(settings)
        for setting in settings if as_json else ():
            typer.echo(json_line(setting.row()))
    rows = [setting.row() for knobs in families.values() for settings in knobs for setting in settings]
    if not (as_json or quiet):
        print_table(rows, TRADES)
    if output is not None:
        write_rows(rows, output / "tradeoff.csv", TRADES, force=force)
        _draw(families, output, force=force)


def _figure(folder: Path, family: str) -> Path:
    return folder / f"tradeoff_{family}.png"


def _draw(families: "dict[str, list[tuple[Setting, ...]]]", folder: Path, *, force: bool) -> None:
    from frictionlab.figures.style import save
    from frictionlab.figures.tradeoff import family_figure

    for family, knobs in families.items():
        save(family_figure(knobs), _figure(folder, family), force=force)
