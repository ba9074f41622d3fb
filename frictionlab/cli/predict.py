"""``frictionlab predict``: what tests not made would show, by the law of their material."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from frictionlab.cli.drawing import figure_file
from frictionlab.cli.options import values_of
from frictionlab.cli.output import print_table, print_warnings
from frictionlab.cli.progress import count
from frictionlab.schema import PREDICTIONS
from frictionlab.tables import check_output, json_line, write_rows

if TYPE_CHECKING:
    from frictionlab.inference.predictive import PredictedTest

SEVERAL = 5  # tests from which progress is shown
HEADS = {"r": "r", "amplitude": "amplitude mm", "energy": "energy mJ", "stops": "stops", "regime": "regime"}


def predict(
    *,
    law_file: Path,
    normal_force: float | None = None,
    base_amplitude: float | None = None,
    r: str | None = None,
    base_motion: Path | None = None,
    as_json: bool = False,
    plot: Path | None = None,
    output: Path | None = None,
    force: bool = False,
    quiet: bool = False,
) -> None:
    """Predict tests not made by the law that a campaign found for their material, with 95 % bands.

    The bands hold the errors of the law and the scatter from test to test: 95 of 100 such tests fall into them.

    Example: frictionlab predict --law-file law_brass.toml --normal-force 4 --base-amplitude 1.8e-3 --r 0.3:0.7:0.1
    """
    from frictionlab.verbs.predicting import predict

    read = [law_file, *([] if base_motion is None else [base_motion])]
    figure = figure_file(plot, "prediction", force=force, inputs=read)
    ratios = None if r is None else values_of(r, "--r")
    if output is not None:
        check_output(output, PREDICTIONS, force=force, inputs=read, rows=len(ratios or ()))

    with count("predict", quiet=quiet or as_json or len(ratios or ()) < SEVERAL) as progress:
        found = predict(
            law_file, ratios, normal_force_n=normal_force, base_amplitude_m=base_amplitude, base_motion=base_motion,
            progress=progress,
        )  # fmt: skip
    for test in found.tests if as_json else ():
        typer.echo(json_line(test.row()))
    if not as_json:
        first = found.tests[0]
        typer.echo(
            f"{first.material}, {first.law}: normal force {first.normal_force_n:.4g} N, base"
            f" {1e3 * first.base_amplitude_m:.4g} mm; each number with its 95 % band"
        )
        print_table([_shown(test) for test in found.tests], HEADS)
    if not (as_json or quiet):
        print_warnings([{"source": _named(test), "warnings": list(test.warnings)} for test in found.tests])
    if output is not None:
        write_rows(found.rows(), output, PREDICTIONS, force=force, inputs=read)
    if figure is not None:
        from frictionlab.verbs.presenting import plot as draw

        draw(found, figure, force=force)


def _shown(test: "PredictedTest") -> dict[str, object]:
    from frictionlab.inference.predictive import in_words

    numbers, record = test.numbers, test.frequency_ratio is None
    return {
        "r": _named(test).removeprefix("r = "),
        "amplitude": in_words(numbers["response_amplitude_m"]),
        "energy": in_words(numbers["record_energy_j" if record else "energy_per_cycle_j"]),
        "stops": in_words(numbers["record_stops" if record else "stops_per_cycle"], 1.0),
        "regime": test.regime,
    }


def _named(test: "PredictedTest") -> str:
    return "the record" if test.frequency_ratio is None else f"r = {test.frequency_ratio:.6g}"
