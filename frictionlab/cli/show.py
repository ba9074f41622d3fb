"""To look up: ``frictionlab show`` a file, ``laws`` of contact; ``synthesize`` logs, ``tradeoff`` of accuracy."""

import sys
from dataclasses import asdict
from pathlib import Path

import typer

from frictionlab.cli import printable
from frictionlab.cli.options import Drawn, Results, scene_of
from frictionlab.cli.screen import count, paragraph, print_table, print_warnings, track
from frictionlab.errors import FrictionlabError, UsageError
from frictionlab.files import make_folder
from frictionlab.schema import TRADES, table_of
from frictionlab.tables import Row, check_output, has_rows, json_line, read_rows, write_rows

MOST = 100  # rows on a terminal
LOOP = (0.3, 0.6)  # frequency and friction ratio of the loop of a law
TABLES = (".csv", ".jsonl")
OF_A_LOG = "; what is in a log says `frictionlab ingest --dry-run {}`"


def show(file: Path) -> None:
    """Show what is in a recording (.h5), a scene (.toml) or a result (.csv, .jsonl, .h5).

    Example: frictionlab show configs/frame.toml
    """
    suffix = file.suffix.lower()
    if not file.exists():
        raise UsageError(f"{file}: there is no such file: give the path of a recording, scene or result")
    if not file.is_file():
        raise UsageError(f"{file}: expected a file; got a folder or a device: give the path of a file")
    try:
        if suffix == ".toml":
            _show_scene(file)
        elif suffix in TABLES or (suffix == ".h5" and has_rows(file)):
            _show_rows(file)
        elif suffix == ".h5":
            from frictionlab.hdf5 import describe

            typer.echo("\n".join(map(printable, describe(file))))
        else:
            got = f"{file.suffix or 'no suffix'}{OF_A_LOG.format(file)}"
            raise UsageError(f"{file}: expected one of .csv, .jsonl, .toml, .h5; got {got}")
    except OSError as error:
        if isinstance(error, FrictionlabError):
            raise
        raise UsageError(f"{file}: cannot be read ({error.strerror}): give the path of an existing file") from error


def _show_scene(file: Path) -> None:
    from frictionlab.inference.material_law import is_material_law, read_material_law
    from frictionlab.scene import read_scene
    from frictionlab.scene.text import to_toml

    if is_material_law(file):
        for line in read_material_law(file).text().splitlines():
            paragraph(line, indent="# " if line.startswith("#") else "    ")
        return
    typer.echo(f"{to_toml(read_scene(file))}# keys that are not given: `frictionlab init --all` lists them")


def _show_rows(file: Path) -> None:
    """The table, then failures and warnings, once for each kind."""
    try:
        rows = read_rows(file)
    except UsageError as error:
        raise UsageError(f"{error}{OF_A_LOG.format(file) if file.suffix == '.csv' else ''}") from error
    good = [row for row in rows if row.get("status") != "failed"]
    names = list(dict.fromkeys(key for row in good for key in row))
    if good:
        table = table_of(names)
        seen = good[:MOST] if sys.stdout.isatty() or table is None else good
        print_table(seen, table or {name: name for name in names if name != "warnings"})  # these stand below
        if len(seen) < len(good):
            more = "a pipe has all, as in: frictionlab show ... | more" if table else "it is no result of frictionlab"
            typer.echo(f"the first {len(seen)} of {len(good)} rows; {more}")
    else:
        typer.echo("no rows" if not rows else "no row without a failure")
    named: list[Row] = [{"source": f"row {number}"} | dict(row) for number, row in enumerate(rows, 1)]
    for row in named:
        if row.get("status") == "failed":
            paragraph(f"{row['source']}: failed: {row.get('reason')}", indent="    ")
    print_warnings(named, verbose=True)


def laws(name: str | None = None, *, plot: Path | None = None, as_json: bool = False, force: bool = False) -> None:
    """List the contact laws: terms, parameters with their domains and usual ranges, and what excludes what.

    A law is coulomb, or a sum that begins with it: coulomb+place+speed. NAME lists the terms of one law.

    Example: frictionlab laws coulomb+place --plot loop.png
    """
    from frictionlab.simulator.laws import TERMS, excluded_by, law_of

    known = None if name is None else law_of(f"coulomb+{name}" if name in TERMS and name != "coulomb" else name)
    if plot is not None and known is None:
        raise UsageError("--plot: expected the name of a law whose loop is drawn; got none")
    to = Drawn(plot=plot, force=force)
    figure = to.figure("loop")
    if known is None and not as_json:
        print_table([{"term": t.name, "words": t.words} for t in TERMS.values()], {"term": "term", "words": ""})
        paragraph("A law is coulomb, or a sum: coulomb+place. More: frictionlab laws NAME")
        return
    for term in TERMS.values() if known is None else known.terms:
        about = {"law": term.name, "words": term.words, "equation": term.equation, "excludes": excluded_by(term)}
        if as_json:
            typer.echo(json_line({**about, "parameters": {p.name: asdict(p) for p in term.parameters}}))
            continue
        excludes = f"; not with {', '.join(excluded_by(term))}" if excluded_by(term) else ""
        paragraph(f"{term.name}: {term.words}: {term.equation}{excludes}", indent="    ")
        for p in term.parameters:
            usual = f"usually {p.usual[0]:g} to {p.usual[1]:g}"
            paragraph(f"    {p.name}: {p.words}; {p.domain}, {usual}", indent="        ")
    if figure is not None and known is not None:
        from frictionlab.simulator import Problem, steady_state

        own = {p.name: 0.5 * sum(p.usual) or p.usual[1] for p in known.parameters if p.name != "beta"}
        state = steady_state(Problem(*LOOP, law=known.name, parameters=own))
        to.draw(state, figure)


def synthesize(output: Path, *, scene: Path | None = None, quiet: bool = False) -> None:
    """Write logs of a virtual rig whose truth is known, with truth.jsonl beside them.

    Example: frictionlab synthesize --scene configs/sample_data.toml -o build/logs
    """
    from frictionlab.verbs.simulating import synthesize

    what = scene_of(scene, quiet=quiet)
    with count("synthesize", quiet=quiet) as progress:
        tests = synthesize(what, output, progress=progress)
    if not quiet:
        typer.echo(f"{len(tests)} synthetic logs and their truth.jsonl are in {output}")


def tradeoff(to: Results) -> None:
    """Measure error against time for every accuracy knob, on this machine; about a minute.

    Example: frictionlab tradeoff -o build/tradeoff
    """
    from frictionlab.tradeoff import KNOBS

    if to.output is not None:
        make_folder(to.output)
        check_output(to.output / "tradeoff.csv", TRADES, force=to.force)
    rows: list[Row] = []
    measured = (knob() for knob in KNOBS)
    for settings in track(measured, total=len(KNOBS), title="tradeoff", quiet=to.quiet or to.as_json):
        rows += [setting.row() for setting in settings]
        for setting in settings if to.as_json else ():
            typer.echo(json_line(setting.row()))
    if not (to.as_json or to.quiet):
        print_table(rows, TRADES)
    if to.output is not None:
        write_rows(rows, to.output / "tradeoff.csv", TRADES, force=to.force)
