"""Tests not made: ``frictionlab plan``, which say most; ``predict``, what they would show; ``sweep``, a map of them."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from frictionlab.cli import complain
from frictionlab.cli.options import Drawn, Results, doubt_amplitude, named_values, scene_of, values_of
from frictionlab.cli.screen import count, counted, heads, paragraph, print_table, print_warnings, track
from frictionlab.errors import UsageError
from frictionlab.schema import AMPLITUDE, ENERGY, PREDICTIONS, STEADY_STATES, STOPS
from frictionlab.tables import Row, check_output, json_line, write_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionlab.inference.predictive import PredictedTest
    from frictionlab.planning.plan import Plan, PlannedTest

CERTAIN = 1000.0  # logarithm of a Bayes factor
SETTING = ("frequency_ratio", "normal_force_n", "base_amplitude_m", "duration_s")


def plan(
    *,
    scene: Path | None = None,
    law: str | None = None,
    against: str | None = None,
    tests: int | None = None,
    law_file: Path | None = None,
    every: bool = False,
    to: Results,
) -> None:
    """Plan the next tests: which frequency ratios and forces say most about a contact law, with what errors.

    Example: frictionlab plan --scene my_rig.toml --law coulomb+place+speed --tests 6 -o tests.csv

    Two laws: frictionlab plan --scene my_rig.toml --law coulomb+place --against coulomb+speed
    """
    from frictionlab.verbs.simulating import plan

    known = scene_of(scene, quiet=to.quiet)
    found = plan(
        known,
        law=law,
        against=against,
        tests=tests,
        law_file=law_file,
        sheet=to.output,
        force=to.force,
        everything=every,
        watch=partial(track, title="plan", quiet=to.quiet or to.as_json),
    )
    for note in () if to.quiet else found.notes:
        complain(note)
    listed = [*found.tests, *(found.others if every else ())]
    if to.as_json:
        for test in listed:
            typer.echo(json_line(test.row()))
    else:
        _print(found, listed, to.output)


def _print(found: "Plan", listed: "Sequence[PlannedTest]", output: Path | None) -> None:
    """The table, and what its last columns mean."""
    from frictionlab.inference.ladder import REQUIRED

    apart = "" if found.against is None else f" against {found.against}"
    count = len({tuple(getattr(test, key) for key in SETTING) for test in found.tests})
    typer.echo(
        f"law {found.law}{apart}: {counted(len(found.tests), 'test')}, of {count + len(found.others)} candidates,"
        " best first"
    )
    rows: list[Row] = []
    for row in map(_flat, listed):  # repeats of a setting are one row, with what is known after the last
        again = rows and row["rank"] is not None and all(row[key] == rows[-1][key] for key in SETTING)
        first = str(rows.pop()["rank"]).partition("-")[0] if again else ""
        rows.append({**row, "rank": f"{first}-{row['rank']}"} if again else row)
    last = {f"u({name})": "friction %" if name == "beta" else f"u({name})" for name in found.tests[0].expected}
    last = last if found.against is None else {"one": "if A", "other": "if B", "after": "after"}
    print_table(rows, heads("planned") | last)
    meaning = (
        "the last columns: standard uncertainty after this test and all better ones, of friction in per cent of it"
    )
    if found.against is not None:
        meaning = (
            f"A: {found.law}; B: {found.against}; if A: evidence for A to expect of this test alone if A holds"
            " (logarithm of the Bayes factor; about half of such tests give more, half less); if B: for B if B holds;"
            f" after: sum of this test and all better ones, the lesser of both; {REQUIRED:g} or more decides"
        )
    paragraph(meaning)
    if output is not None:
        paragraph(f"the sheet is {output}: name the logs as it says, then give it as [experiment] sheet")


def _flat(test: "PlannedTest") -> Row:
    """A test's row as the table shows it; evidence beyond what decides many times over has no size."""
    errors = {name: error for name, error in (test.cumulative_u or test.expected_u).items() if error is not None}
    value, u = test.friction_coefficient, test.friction_coefficient_u_after or test.friction_coefficient_u
    if "beta" in errors and value and u:  # with the gains of the sensors, as a comparison will state it
        errors["beta"] = 100.0 * u / value
    evidence = {"one": test.log_bayes, "other": test.log_bayes_against, "after": test.log_bayes_after}
    return {
        **test.row(),
        "base_amplitude_mm": 1e3 * test.base_amplitude_m,
        **{f"u({name})": _short(error) for name, error in errors.items()},
        **{key: f"> {CERTAIN:g}" if (value or 0.0) > CERTAIN else _short(value) for key, value in evidence.items()},
    }


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.2g}")


def predict(
    *,
    law_file: Path,
    normal_force: float | None = None,
    base_amplitude: float | None = None,
    r: str | None = None,
    base_motion: Path | None = None,
    to: Drawn,
) -> None:
    """Predict tests not made by the law that a campaign found for their material, with 95 % bands.

    The bands hold the errors of the law and the scatter from test to test: 95 of 100 such tests fall into them.

    Example: frictionlab predict --law-file law_brass.toml --normal-force 4 --base-amplitude 1.8e-3 --r 0.3:0.7:0.1
    """
    from frictionlab.verbs.simulating import predict

    doubt_amplitude(base_amplitude)
    read = [law_file, *([] if base_motion is None else [base_motion])]
    figure = to.figure("prediction", read)
    ratios = None if r is None else values_of(r, "--r")
    if to.output is not None:
        check_output(to.output, PREDICTIONS, force=to.force, inputs=read)
    with count("predict", quiet=to.quiet or to.as_json or ratios is None, total=len(ratios or ())) as progress:
        found = predict(
            law_file, ratios, normal_force_n=normal_force, base_amplitude_m=base_amplitude, base_motion=base_motion,
            progress=progress,
        )  # fmt: skip
    names = ["the record" if t.frequency_ratio is None else f"r = {t.frequency_ratio:.6g}" for t in found.tests]
    if to.as_json:
        for test in found.tests:
            typer.echo(json_line(test.row()))
    else:
        first = found.tests[0]
        size = f"{1e3 * first.base_amplitude_m:.4g} mm"
        base = size if first.frequency_ratio is not None else f"at most {size} away from where it begins"
        about = f"{first.material}, {first.law}: normal force {first.normal_force_n:.4g} N, base {base}"
        asked = {"normal_force_n": normal_force, "base_amplitude_m": base_amplitude or base_motion}
        taken = [f"--{key.rpartition('_')[0].replace('_', '-')}" for key, given in asked.items() if given is None]
        paragraph(f"{about}; each number with its 95 % band: errors of the law, not of the rig (stiffness, load)")
        if taken:
            paragraph(f"Not given, so the middle of those that the law was found under: {', '.join(taken)}.")
        more = {"unsteady": "no steady state"} if any(test.unsteady for test in found.tests) else {}
        print_table([_shown(t, name) for t, name in zip(found.tests, names, strict=True)], heads("predicted") | more)
        if not to.quiet:
            warned = ({"source": name, "warnings": t.warnings} for t, name in zip(found.tests, names, strict=True))
            print_warnings(list(warned))
    if to.output is not None:
        write_rows(found.rows(), to.output, PREDICTIONS, force=to.force, inputs=read)
    to.draw(found, figure)


def _shown(test: "PredictedTest", name: str) -> Row:
    from frictionlab.inference.predictive import in_words

    numbers, record = test.numbers, test.frequency_ratio is None
    return {
        "r": name.removeprefix("r = "),
        "amplitude": in_words(numbers[f"{AMPLITUDE}_m"]),
        "energy": in_words(numbers["record_energy_j" if record else f"{ENERGY}_j"]),
        "stops": in_words(numbers["record_stops" if record else STOPS], 1.0),
        "regime": test.regime,
        "unsteady": f"{100.0 * test.unsteady:.2g} % of draws",
    }


def sweep(
    *,
    r: str,
    beta: str,
    law: str | None = None,
    parameter: list[str] | None = None,
    mu: str | None = None,
    zeta: str | None = None,
    wall: Literal["fixed", "base"] = "fixed",
    workers: int | None = None,
    scheduler: str | None = None,
    to: Drawn,
) -> None:
    """Map steady states over frequency ratio, friction ratio, static friction, damping and parameters of a law.

    Each takes a list (0.1,0.2), a range with both ends (0.1:0.9:0.1), or one number; so does --parameter, as in
    --parameter gradient=0:0.1:0.02. The file appears when all is solved.

    Example: frictionlab sweep --r 0.02:2.5:0.01 --beta 0.1:0.9:0.1 -o map.h5
    """
    from frictionlab import maps

    said = named_values(parameter, {"mu": mu, "zeta": zeta})
    four = zip(("r", "beta", "mu", "zeta"), (r, beta, mu or "1", zeta or "0"), strict=True)
    rs, betas, mus, zetas = (tuple(values_of(text, f"--{name}")) for name, text in four)
    more = tuple((name, tuple(values_of(text, f"--parameter {name}"))) for name, text in said.items())
    grid = maps.Grid(rs, betas, mus, zetas, wall, law or "coulomb", more)
    if to.output is None:
        raise UsageError("-o FILE: expected where the map goes; got none")
    check_output(to.output, STEADY_STATES, force=to.force)
    figure = to.figure("map")
    if figure is not None:  # before the work
        from frictionlab.figures.grids import check_axes

        check_axes(grid)
    steps = maps.make_map(grid, to.output, workers=workers, scheduler=scheduler, force=to.force)
    with count("sweep", quiet=to.quiet, total=len(grid)) as progress:
        for step in steps:
            progress(step.done, len(grid))
            for row in step.rows() if to.as_json else ():
                typer.echo(json_line(row))
            for sentence in step.failures():
                complain(sentence)
    found = step.found
    if not (to.as_json or to.quiet):
        for sentence in found.warnings:
            complain(f"warning: {sentence}")
        outcomes = ", ".join(f"{number} {outcome}" for outcome, number in found.outcomes.items())
        paragraph(f"{len(grid)} steady states ({outcomes}) are in {to.output}")
    to.draw(found, figure)
    if found.outcomes[maps.FAILED]:
        raise typer.Exit(1)
