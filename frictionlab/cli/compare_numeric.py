"""``frictionlab compare-numeric``: measured over predicted."""

from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from frictionlab.cli.inputs import Files, expanded
from frictionlab.cli.options import ANALYSIS, check_law, takes
from frictionlab.cli.output import print_table
from frictionlab.cli.work import COMPARED, HIDDEN, Work, of_measurement
from frictionlab.schema import COMPARISONS, LAWS, RECORD_LAWS
from frictionlab.tables import Row

if TYPE_CHECKING:
    from frictionlab.cli.drawing import Figures
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
MOVED = {"moved": "moved", "value": "value", "u": "u", "known_to": "known before to"}


@takes(*ANALYSIS)
def compare_numeric(
    recordings: list[Path],
    *,
    law: str | None = None,
    beta: float | None = None,
    whole: bool = False,
    fit: Literal["cycle", "whole"] = "cycle",
    solver: Literal["auto", "closed-form", "exact", "numeric", "thesis"] | None = None,
    settings: Mapping[str, object],
    work: Work,
) -> None:
    """Identify the friction, predict the steady cycle with the simulator, and draw measured over predicted.

    Example: frictionlab compare-numeric build/recordings/steel_N1.25_r0.3.h5 --scene configs/sample_data.toml --plot .
    """
    scene = work.scene_for(recordings[0], {**settings, "solver": solver}, ("model", "analysis", "rig"))
    check_law(law)
    inputs = expanded(recordings, recordings=True)
    kinds = ("record", "comparison", "contact") if fit == "whole" else ("comparison", "contact", *("record",) * whole)
    plots = work.places(inputs, scene, COMPARISONS, kinds)
    job = partial(_row, law=law, beta=beta, plots=plots, whole=whole, fit=fit, force=work.force)
    rows, shown = work.rows(inputs, job, scene, "compare")
    work.write(rows, inputs, scene, COMPARISONS)
    good = work.show(shown, COMPARISONS, COMPARED, scene, noun="recordings compared")
    if work.wide:
        _print_parts(good)
    work.leave(rows)


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
            print_table([_moved(name, values) for name, values in moved.items()], MOVED)
        required, record_laws = row.get("cycle_law") or row["law"], row.get("record_laws")
        if isinstance(laws, (list, tuple)):
            typer.echo(f"\n{row['source']}: laws in the order tried; the recording requires {required}")
            print_table(laws, LAWS)
        if isinstance(record_laws, (list, tuple)):
            typer.echo(f"\n{row['source']}: laws tried on the whole record, which requires {row['law']}")
            print_table(record_laws, RECORD_LAWS)


def _moved(name: str, values: Mapping[str, float]) -> Row:
    """One line of what a fit moved; a lag in milliseconds."""
    if name != "lag_s":
        return {"moved": name, **values}
    return {"moved": "lag [ms]", **{key: 1e3 * value for key, value in values.items()}}


def _row(
    path: Path,
    *,
    scene: "Scene",
    law: str | None,
    beta: float | None,
    plots: "Figures | None",
    files: Files,
    whole: bool,
    fit: Literal["cycle", "whole"],
    force: bool,
) -> Row:
    from frictionlab.verbs.judging import compare
    from frictionlab.verbs.measuring import analyze

    file, shown = files.get(path, path), {}
    if whole or fit == "whole":
        comparison = compare(file, scene, law=law, friction_ratio=beta, whole=whole, fit=fit)
    else:
        measurement = analyze(file, scene)
        comparison = compare(measurement, scene, law=law, friction_ratio=beta)
        shown = {HIDDEN: of_measurement(measurement)}
    if plots is not None:
        from frictionlab.verbs.presenting import plot

        drawn = {
            "comparison": comparison if len(comparison.tau) else None,
            "contact": comparison.contact,
            "record": comparison.record,
        }
        for kind, place in plots[path].items():
            if drawn[kind] is not None:
                plot(drawn[kind], place, title=None if kind == "comparison" else path.name, force=force)
    return {**comparison.row(), "source": str(path), **shown}
