"""``frictionlab compare-numeric``: measured over predicted; ``frictionlab explain``: the law required, in words."""

from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

from frictionlab.cli import complain, printable
from frictionlab.cli.options import ANALYSIS, check_law, takes
from frictionlab.cli.screen import print_table
from frictionlab.cli.work import COMPARED, HIDDEN, Figures, Judged, exit_status, expanded
from frictionlab.schema import COMPARISONS, LAWS, RECORD_LAWS
from frictionlab.tables import Row

if TYPE_CHECKING:
    from frictionlab.scene import Scene

PARAMETERS = {
    "parameter": "parameter",
    "value": "value",
    "se": "se",
    "u": "u",
    "told": "known by this test",
    "lower": "lower 95 %",
    "upper": "upper 95 %",
}
MOST = 12  # lines of an explanation, where not all are asked for
MOVED = {"moved": "moved", "value": "value", "u": "u", "known_to": "known before to"}


@takes(ANALYSIS)
def compare_numeric(
    recordings: list[Path],
    *,
    law: str | None = None,
    law_file: Path | None = None,
    beta: float | None = None,
    whole: bool = False,
    fit: Literal["cycle", "whole"] = "cycle",
    solver: Literal["auto", "closed-form", "exact", "numeric", "thesis"] | None = None,
    settings: Mapping[str, object],
    work: Judged,
) -> None:
    """Identify the friction, predict the steady cycle with the simulator, and draw measured over predicted.

    Example: frictionlab compare-numeric build/recordings/steel_N1.25_r0.3.h5 --scene configs/sample_data.toml --plot .
    """
    scene = work.scene_for(recordings[0], {**settings, "solver": solver}, ("model", "analysis", "rig"))
    check_law(law)
    inputs = expanded(recordings, recordings=True)
    kinds = ("record", "comparison", "contact") if fit == "whole" else ("comparison", "contact", *("record",) * whole)
    plots = work.places(inputs, scene, COMPARISONS, kinds)
    asked = {"law": law, "law_file": law_file, "friction_ratio": beta, "whole": whole, "fit": fit}
    job = partial(_compared, scene=scene, asked=asked, plots=plots, force=work.force)
    rows, shown = work.rows(inputs, job, "compare")
    work.write(rows, inputs, scene, COMPARISONS)
    good = work.show(shown, COMPARISONS, COMPARED, scene, noun="recordings compared")
    if work.wide:
        _print_parts(good)
    exit_status(rows)


def _print_parts(rows: Iterable[Row]) -> None:
    """Print the parameters of laws beyond Coulomb's, what a whole record moved beside them, and the ladder of laws."""
    for row in rows:
        parameters, laws = row.get("parameters"), row.get("laws")
        if isinstance(parameters, Mapping) and (laws or len(parameters) > 2):
            typer.echo(f"\n{row['source']}: {row['law']}")
            print_table([{"parameter": name, **values} for name, values in parameters.items()], PARAMETERS)
        moved = row.get("nuisances")
        if isinstance(moved, Mapping) and moved and row.get("record_nrmse") is not None:
            typer.echo(f"\n{row['source']}: what the fit moved beside the law (natural frequency and gain: relative)")
            lag = {key: 1e3 * value for key, value in moved.get("lag_s", {}).items()}  # in milliseconds
            told = [("lag [ms]", lag) if name == "lag_s" else (name, values) for name, values in moved.items()]
            print_table([{"moved": name, **values} for name, values in told], MOVED)
        required, record_laws = row.get("cycle_law") or row["law"], row.get("record_laws")
        if isinstance(laws, (list, tuple)):
            typer.echo(f"\n{row['source']}: laws in the order tried; the recording requires {required}")
            print_table(laws, LAWS)
        if isinstance(record_laws, (list, tuple)):
            typer.echo(f"\n{row['source']}: laws tried on the whole record, which requires {row['law']}")
            print_table(record_laws, RECORD_LAWS)


def _compared(
    path: Path, file: Path, *, scene: "Scene", asked: Mapping[str, Any], plots: Figures | None, force: bool
) -> Row:
    from frictionlab.verbs.inputs import frequency_table_given
    from frictionlab.verbs.judging import compare
    from frictionlab.verbs.measuring import analyze

    shown = {}
    if asked["whole"] or asked["fit"] == "whole" or frequency_table_given(file, scene) is not None:
        comparison = compare(file, scene, **asked)
    else:
        measurement = analyze(file, scene)
        comparison = compare(measurement, scene, **asked)
        row = measurement.row()
        shown = {HIDDEN: {key: row[key] for key in ("energy_per_cycle_j", "energy_per_cycle_u", "base_amplitude_m")}}
    if plots is not None:
        from frictionlab.verbs.presenting import plot

        drawn = {
            "comparison": comparison if len(comparison.tau) or comparison.over_frequency else None,
            "contact": comparison.contact,
            "record": comparison.record,
        }
        for kind, place in plots[path].items():
            if drawn[kind] is not None:
                plot(drawn[kind], place, title=None if kind == "comparison" else path.name, force=force)
    return {**comparison.row(), "source": str(path), **shown}


@takes(ANALYSIS)
def explain(recordings: list[Path], *, settings: Mapping[str, object], work: Judged) -> None:
    """Say which friction law a recording requires, in a dozen lines: values in newtons, and what is not known.

    Example: frictionlab explain build/recordings/steel_N1.25_r0.3.h5 --scene configs/sample_data.toml --plot .
    """
    scene = work.scene_for(recordings[0], settings, ("model", "analysis", "rig"))
    inputs = expanded(recordings, recordings=True)
    plots = work.places(inputs, scene, COMPARISONS, ("contact",))
    rows, shown = work.rows(inputs, partial(_explained, scene=scene, plots=plots, force=work.force), "explain")
    work.write(rows, inputs, scene, COMPARISONS)
    for number, row in enumerate(() if work.as_json else shown):
        text, short = row.get("text"), row.get("short")
        if not isinstance(text, list) or not isinstance(short, list):
            complain(f"{row['source']}: {row['reason']}")
            continue
        lines = text if work.wide else short
        typer.echo("\n".join([*([""] if number else []), *(printable(str(line)) for line in lines)]))
        if len(lines) < len(text):
            typer.echo(f"... {len(text) - len(lines)} more lines: --wide")
    exit_status(rows)


def _explained(path: Path, file: Path, *, scene: "Scene", plots: Figures | None, force: bool) -> Row:
    from frictionlab.verbs.judging import explain

    told = explain(file, scene)
    if plots is not None and told.contact is not None:
        from frictionlab.verbs.presenting import plot

        plot(told.contact, plots[path]["contact"], title=path.name, force=force)
    return {**told.row(), "source": str(path), HIDDEN: {"short": told.short(MOST - 1)}}
