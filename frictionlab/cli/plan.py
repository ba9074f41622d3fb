"""``frictionlab plan``: the tests that tell most."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from frictionlab.cli.drawing import figure_file
from frictionlab.cli.options import scene_of
from frictionlab.cli.output import complain, paragraph, print_table
from frictionlab.tables import Row, json_line

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionlab.planning import Plan, PlannedTest

MINUTE = 60.0
DECIDES, CERTAIN = 5.0, 1000.0  # logarithm of a Bayes factor


def plan(
    *,
    scene: Path | None = None,
    law: str | None = None,
    against: str | None = None,
    aim: list[str] | None = None,
    tests: int = 10,
    hours: float | None = None,
    measured: list[Path] | None = None,
    output: Path | None = None,
    every: bool = False,
    plot: Path | None = None,
    as_json: bool = False,
    force: bool = False,
    quiet: bool = False,
) -> None:
    """Plan the next tests: which frequency ratios and forces tell most about a contact law, with what errors.

    Example: frictionlab plan --scene my_rig.toml --law coulomb+place+speed --tests 6 -o tests.csv

    Two laws: frictionlab plan --scene my_rig.toml --law coulomb+place --against coulomb+speed --hours 2
    """
    from frictionlab.planning import waiting
    from frictionlab.verbs.plan import check_sheet, plan

    known = scene_of(scene, quiet=quiet)
    read = [*(measured or ()), *known.files]
    check_sheet(output, read, force=force)
    plot = figure_file(plot, "plan", force=force, inputs=read)
    if not quiet and (time := waiting(known, law, against)) is not None:
        complain(time)
    found = plan(
        known,
        law=law,
        against=against,
        tests=tests,
        hours=hours,
        aim=aim or (),
        measured=measured or (),
        sheet=output,
        force=force,
        everything=every or (plot is not None and against is not None),
    )
    for note in () if quiet else found.notes:
        complain(note)
    told = [*found.tests, *(found.others if every else ())]
    if plot is not None:
        _draw(found, plot, force=force)
    if as_json:
        for test in told:
            typer.echo(json_line(test.row()))
    elif not quiet:
        _print(found, told, output)


def _print(found: "Plan", told: "Sequence[PlannedTest]", output: Path | None) -> None:
    """The table, what its last columns mean, and what to do in the laboratory."""
    from frictionlab.planning import steps

    apart = "" if found.against is None else f" against {found.against}"
    count = len({(t.frequency_ratio, t.normal_force_n, t.base_amplitude_m, t.duration_s) for t in found.tests})
    typer.echo(
        f"law {found.law}{apart}: {len(found.tests)} tests, of {count + len(found.others)} candidates, best first"
    )
    print_table([_flat(test) for test in told], _heads(found, told))
    paragraph(_meaning(found))
    typer.echo("\nIn the laboratory, in the order that saves changes:")
    for line in steps(found):
        paragraph(line, indent="    ")
    if output is not None:
        typer.echo("")
        paragraph(f"the sheet is {output}: name the logs as it says, then give it as [experiment] sheet")


def _heads(found: "Plan", told: "Sequence[PlannedTest]") -> dict[str, str]:
    """Columns of the table; what is the same in all tests is told by the steps below it."""
    names = [] if found.against is not None else list(found.tests[0].expected)
    differs = {
        "base_amplitude_mm": len({t.base_amplitude_m for t in told}) > 1,
        "duration_s": len({t.duration_s for t in told}) > 1,
    }
    heads = {
        "rank": "test",
        "frequency_ratio": "r",
        "normal_force_n": "force N",
        "base_amplitude_mm": "base mm",
        "duration_s": "length s",
        "total_min": "lab min",
        **{f"u({name})": "friction %" if name == "beta" else f"u({name})" for name in names},
        **({} if found.against is None else {"one": "if A", "other": "if B", "after": "after"}),
    }
    return {key: head for key, head in heads.items() if differs.get(key, True)}


def _meaning(found: "Plan") -> str:
    time = "lab min: laboratory time so far"
    if found.against is not None:
        return (
            f"A: {found.law}; B: {found.against}; {time}; if A: evidence for A to expect of this test alone if A holds"
            " (logarithm of the Bayes factor; about half of such tests give more, half less); if B: for B if B holds;"
            f" after: sum of this test and all better ones, the lesser of both; {DECIDES:g} or more decides"
        )
    return (
        f"{time}; the last columns: standard uncertainty to expect after this test and all better ones, of friction in"
        " per cent of it"
    )


def _flat(test: "PlannedTest") -> Row:
    after = test.cumulative_u or test.expected_u
    known = {
        f"u({name})": _short(error if name != "beta" or error is None else 100.0 * error / test.values[name])
        for name, error in after.items()
    }
    evidence = {"one": test.log_bayes, "other": test.log_bayes_against, "after": test.log_bayes_after}
    more = {
        "base_amplitude_mm": 1e3 * test.base_amplitude_m,
        "total_min": None if test.total_s is None else _short(test.total_s / MINUTE, 3),
        **{key: _evidence(value) for key, value in evidence.items()},
    }
    return {**test.row(), **more, **known}


def _evidence(value: float | None) -> float | str | None:
    """Evidence for a screen: beyond what decides many times over its size says no more."""
    return f"> {CERTAIN:g}" if value is not None and value > CERTAIN else _short(value)


def _short(value: float | None, digits: int = 2) -> float | None:
    return None if value is None else float(f"{value:.{digits}g}")


def _draw(found: "Plan", path: Path, *, force: bool) -> None:
    from frictionlab.verbs.presenting import plot

    plot(found, path, force=force)
