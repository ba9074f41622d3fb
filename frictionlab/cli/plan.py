"""``frictionlab plan``: the tests that tell most."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frictionlab.cli.drawing import check_figure_name
from frictionlab.cli.options import AsJson, Force, Quiet, SceneFile, scene_of
from frictionlab.cli.output import complain, print_table
from frictionlab.schema import PLANS
from frictionlab.tables import Row, json_line

if TYPE_CHECKING:
    from frictionlab.planning import Plan, PlannedTest


def plan(
    *,
    scene: SceneFile = None,
    law: Annotated[
        str | None, typer.Option("--law", metavar="LAW", help="Contact law, in place of the scene's.")
    ] = None,
    tests: Annotated[int, typer.Option("--tests", metavar="N", min=1, help="How many tests to plan.")] = 10,
    measured: Annotated[
        list[Path] | None,
        typer.Option("--measured", metavar="FILE", help="Comparisons at hand (compare-numeric -o): they are known."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="SHEET", help="Write the tests here as a sheet (.csv) to fill in."),
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="Tell every candidate, not only those chosen.")] = False,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Draw what each candidate tells (.png .svg .pdf).")
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Plan the next tests: which frequency ratios and forces tell most about a contact law, with the errors to expect.

    Example: frictionlab plan --scene my_rig.toml --law coulomb+place+speed --tests 6 -o tests.csv
    """
    from frictionlab.figures.mark import check_figures
    from frictionlab.verbs.plan import plan

    if plot is not None:
        check_figure_name(plot)
        check_figures([plot], force=force, inputs=measured or ())
    found = plan(scene_of(scene, quiet=quiet), law=law, tests=tests, measured=measured or (), sheet=output, force=force)
    for note in () if quiet else found.notes:
        complain(note)
    told = [*found.tests, *(found.others if everything else ())]
    if plot is not None:
        _draw(found, plot, force=force)
    if as_json:
        for test in told:
            typer.echo(json_line(test.row()))
    elif not quiet:
        _print(found, told, output)


def _print(found: "Plan", told: "list[PlannedTest]", output: Path | None) -> None:
    typer.echo(f"law {found.law}: {len(found.tests)} of {len(found.tests) + len(found.others)} candidates, best first")
    print_table([_flat(test) for test in told], [*PLANS.shown, *_names(told)])
    typer.echo("the last columns: standard uncertainty to expect after this test and all better ones")
    if output is not None:
        typer.echo(f"the sheet is {output}: name the logs as it says, then give it as [experiment] sheet")


def _names(told: "list[PlannedTest]") -> list[str]:
    return [f"u({name})" for name in told[0].expected] if told else []


def _flat(test: "PlannedTest") -> Row:
    after = test.cumulative_u or test.expected_u
    return {**test.row(), **{f"u({name})": error for name, error in after.items()}}


def _draw(found: "Plan", path: Path, *, force: bool) -> None:
    from frictionlab.verbs.plot import plot

    plot(found, path, force=force)
