"""What is printed: tables for people on stdout; on stderr complaints, and on a terminal how far the work is.

Text that stood in a log or a file name is never trusted: control characters are shown, not sent to the terminal.
"""

import os
import shutil
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer

from frictionlab.cli import STOPPED, LostOutputError, complain, folded, printable
from frictionlab.schema import BASE, ENERGY, LINES, Table, with_error
from frictionlab.tables import Row, json_line, plain
from frictionlab.tables.texts import kinds_of
from frictionlab.verbs.inputs import FAILED

if TYPE_CHECKING:
    from frictionlab.scene import Scene

GAP = 2  # blanks between columns
LARGE_J = 10.0  # from here on joules are shown, not millijoules
LEAST_TEXT = 17  # letters that a text keeps in one line before it is folded
MOST_WARNINGS = 10  # lines
NO_LAG = (
    "lag_s_u of [sensors] is not declared: half a sampling interval of lag between the channels, either way, is assumed"
    " in the uncertainties, and no filter of one channel, which lags too (mass_filter_hz; compare-numeric may see it)"
)
NO_STIFFNESS = (
    "stiffness_n_per_m_u of [rig] is not declared: {:.2g} % of {:.4g} N/m is assumed, also where mass and frequency"
    " make it. N, coefficient and J are as wrong as mass or stiffness, and no test shows it: weigh the mass and declare"
)
T = TypeVar("T")


def cell(value: object) -> str:
    """A value as it stands in a table: six significant digits, a dash for not known."""
    value = plain(value)
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list) and all(isinstance(item, str) for item in value):
        return printable("; ".join(map(str, value))) or "-"
    if isinstance(value, dict):
        return ", ".join(f"{printable(str(key))} = {cell(item)}" for key, item in value.items()) or "-"
    return printable(str(value))


@dataclass(frozen=True)
class Shown:
    """A column of a table on a screen, as ``columns.toml`` lists it: a number with its uncertainty, or in its form."""

    title: str
    key: str
    keep: int = 9
    form: str = ".4g"
    error: str = "u"
    times: str = "1"

    def text(self, row: Row) -> str:
        """What stands in a row."""
        value, error = plain(row.get(self.key)), row.get(f"{self.key}_{self.error}")
        size, _, by = self.times.partition(" ")
        length = row.get(by) if by else 1.0
        if value is None or not isinstance(length, float):
            return "-"
        factor = float(size) * length
        if error is not None:
            return with_error(value, error, factor)
        return format(factor * value, self.form) if isinstance(value, float) else cell(value)


def _line(kind: str) -> tuple[Shown, ...]:
    """The columns of one line a test of a kind of table."""
    return tuple(
        Shown(title, key, int(keep), form or ".4g", error or "u", times or "1")
        for table, title, key, keep, form, error, times in LINES
        if table == kind
    )


MEASURED, COMPARED, FITTED = _line("measurements"), _line("comparisons"), _line("friction")
FOUND, TAPPED, SIMULATED = _line("logs"), _line("free vibrations"), _line("simulated")
"""What a screen shows of measurements, comparisons, rows of ``friction.csv``, logs, taps, and states in SI units."""


def heads(kind: str) -> dict[str, str]:
    """Titles by key of a kind of table whose columns all stand."""
    return {column.key: column.title for column in _line(kind)}


def _columns(table: Table, names: Iterable[str]) -> list[Shown]:
    """Columns of a table as `show` has them: six significant digits of a number without an uncertainty.

    An error is a column where it is no other's uncertainty.
    """
    heads = {name: column.head if (column := table.column(name)) else printable(name) for name in names}
    return [Shown(head, name, form=".6g") for name, head in heads.items() if not name.endswith("_u")]


def each_of(value: Any) -> Sequence[Any]:
    """The members of a row's list, if it is one."""
    return value if isinstance(value, tuple | list) else ()


def print_tests(rows: Sequence[Row], columns: Sequence[Shown], headline: str, wide: Table | None = None) -> None:
    """Print one line a test, failures among them, within the window; the columns kept least gladly go first.

    With ``wide``, the table of the schema that these are rows of, all that a screen shows of it, in blocks that fit.
    Where all failed there is no table: each failure is a line on stderr.
    """
    known = [row.get("status") != "failed" for row in rows]
    if not any(known):
        for row in rows:
            complain(f"{row.get('source')}: {row.get('reason')}")
        return
    short = short_names([str(row.get("source")) for row in rows])
    names = [n if k else printable(Path(str(r["source"])).name) for n, r, k in zip(short, rows, known, strict=True)]
    filled = _filled(columns, rows, known)
    works = [work for row in rows if isinstance(work := row.get(f"force_{ENERGY}_j"), float)]
    if max(works, default=0.0) >= LARGE_J:  # of a damper of a building; every energy of one table has one unit
        joules = {c: replace(c, title=c.title.replace("[mJ]", "[J]"), times="1") for c in columns}
        filled = _filled([joules[c] if "[mJ]" in c.title else c for c in columns], rows, known)
    if wide is None:  # a law that the headline names is no column
        filled = {c: each for c, each in filled.items() if c.key != "law" or ", law " not in headline}
    else:
        there = {column.key for column in filled if BASE not in column.times} | {"source"}
        filled |= _filled(_columns(wide, (name for name in wide.shown if name not in there)), rows, known)
    width, widest = _width(), max(map(len, ["test", *names]))
    widths = {c: max(len(c.title), *map(len, texts)) + GAP for c, texts in filled.items()}
    gone: list[str] = []
    while wide is None and len(filled) > 1 and width - sum(widths[c] for c in filled) < min(widest, LEAST_TEXT):
        least = min(filled, key=lambda c: c.keep)
        gone += [least.title] if least.key != "friction_ratio" else []  # force and coefficient say it
        del filled[least]
    first = max(min(widest, width // 2 if wide else width - sum(widths[c] for c in filled)), len("test"))
    typer.echo(_bold(headline))
    ends = range(6, max(7, first - 5))  # letters that a cut name keeps of its end: where most names differ
    cuts = [[n if len(n) <= first else f"{n[: first - 2 - end]}..{n[-end:]}" for n in names] for end in ends]
    cut = max(cuts, key=lambda cut: len(set(cut)))
    lines: list[list[str] | str] = []
    for number, row in enumerate(rows):
        said = f"{names[number]:<{first}}{' ' * GAP}failed: {row.get('reason')}"
        cells = [f"{cut[number]:<{first}}", *(filled[c][number] for c in filled)]
        lines.append(cells if known[number] else folded(said, " " * (first + GAP)))
    _print_blocks(["test", *(c.title for c in filled)], lines)
    if gone:
        typer.echo(f"no space for {', '.join(gone)}: {'--json' if columns is FOUND else '--wide'}")


def _print_blocks(heads: Sequence[str], lines: Sequence[Sequence[str] | str]) -> None:
    """Print lines of cells under their heads, in blocks that fit; a text as it is.

    Each block is led by the first columns that distinguish the rows, where they leave half of the width.
    """
    cells = [heads, *(line for line in lines if not isinstance(line, str))]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lead = next((n for n in range(1, len(heads)) if len({tuple(line[:n]) for line in cells}) == len(cells)), 1)
    lead = lead if 2 * sum(widths[:lead]) <= _width() else 1
    block, blocks = [*range(lead)], list[list[int]]()  # places of the columns side by side
    for place in range(lead, len(widths)):
        if len(block) > lead and sum(widths[p] + GAP for p in (*block, place)) - GAP > _width():
            blocks.append(block)
            block = [*range(lead)]
        block.append(place)
    blocks.append(block)
    for shown in blocks:
        if shown is not blocks[0]:
            typer.echo()
        typer.echo(_bold(_joined([heads[p] for p in shown], [widths[p] for p in shown])))
        for line in lines:
            if not isinstance(line, str):
                typer.echo(_joined([line[p] for p in shown], [widths[p] for p in shown]))
            elif shown is blocks[0]:
                typer.echo(line)


def _filled(columns: Iterable[Shown], rows: Sequence[Row], known: Sequence[bool]) -> dict[Shown, list[str]]:
    """The columns in which something stands, with the text of each row; of one that is not known there is none.

    Of columns of one quantity, ``E [mJ]`` and ``E [kY²]``, the first that is known stands.
    """
    texts = {c: [printable(c.text(row)) if k else "" for row, k in zip(rows, known, strict=True)] for c in columns}
    found = {c: each for c, each in texts.items() if set(each) - {"", "-"}}
    first = {c.title.partition(" [")[0]: c for c in reversed(found)}
    return {c: each for c, each in found.items() if c in first.values()}


def counted(number: int, noun: str) -> str:
    """A number of things: "1 tap", "3 taps"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def short_names(sources: Sequence[str]) -> list[str]:
    """The names of files without folder and suffix; with them where another file would be called the same."""
    names = {source: Path(source).name for source in sources}
    stems = {source: Path(name.removesuffix(".gz")) for source, name in names.items()}
    short = {source: s.stem if s.suffix[1:2].isalpha() else s.name for source, s in stems.items()}  # r = 0.5 has none
    for longer in (names, {source: source for source in names}):
        owners = Counter(short.values())
        short = {source: name if owners[name] == 1 else longer[source] for source, name in short.items()}
    return [printable(short[source]) for source in sources]


def print_warnings(rows: Iterable[Row], *, verbose: bool = False, notes: Sequence[str] = ()) -> None:
    """Print the warnings of all rows on stderr, once a cause with its count; at most ten lines, or all of them."""
    found = [(str(row.get("source") or ""), said) for row in rows for said in warnings_of(row)]
    sources = list(dict.fromkeys(source for source, _ in found))
    short = dict(zip(sources, short_names(sources), strict=True))
    lines: list[str] = []
    for sentence, where in kinds_of(found):
        count = f" ({len(where)} tests)" if len(where) > 1 else f" ({short[where[0]]})" if where[0] else ""
        lines += folded(f"warning{count}: {sentence}").splitlines()
        if verbose and len(where) > 1:
            lines += folded(f"    in {', '.join(short[source] for source in where)}", " " * 7).splitlines()
    lines += [line for note in notes for line in folded(f"note: {note}").splitlines()]
    shown = lines if verbose or len(lines) <= MOST_WARNINGS else lines[: MOST_WARNINGS - 1]
    for line in shown:
        typer.echo(line, err=True)
    if len(shown) < len(lines):
        typer.echo(f"... {len(lines) - len(shown)} more lines of warnings: -v shows them, --json has them", err=True)


def warnings_of(row: Row) -> list[str]:
    """The warnings of a row."""
    return list(map(str, each_of(row.get("warnings"))))


def headline(rows: Sequence[Row], noun: str) -> str:
    """How many inputs went well, and the law where it is one for all."""
    good = [row for row in rows if row.get("status") == "ok"]
    laws = {row.get("law") for row in good} - {None}
    law = f", law {laws.pop()}" if len(laws) == 1 else ""
    return f"{len(good)} of {len(rows)} {noun}{law}"


def assumed(scene: "Scene", good: Sequence[Row]) -> list[str]:
    """What the uncertainties assume that nobody declared; of rows that do not say so, by the scene alone."""
    from frictionlab.uncertainty import LAG, STIFF, sources_of

    by_scene = sources_of(scene, 1.0)
    known = {key for row in good for key in each_of(row.get("assumed", by_scene.assumed))}
    stiff = NO_STIFFNESS.format(100.0 * by_scene.stiffness, scene.rig.stiffness or 0.0)
    return [NO_LAG] * (LAG in known) + [stiff] * (STIFF in known and scene.rig.stiffness is not None)


def print_table(rows: Iterable[Row], columns: Table | Mapping[str, str] | Sequence[Shown]) -> None:
    """Print rows as a table of aligned text on stdout, in blocks that fit; no number is ever cut.

    ``columns``: a table of the schema, of which those for a screen are shown; or titles by key; or as they are.
    """
    every = list(rows)
    short = short_names([str(row.get("source")) for row in every])
    every = [{**row, "source": name} if "source" in row else row for row, name in zip(every, short, strict=True)]
    if isinstance(columns, Table):
        known = {key for row in every for key, value in row.items() if plain(value) is not None}
        own = {*columns.names, *(() if columns.kind in ("map", "motion") else known)}
        more = dict.fromkeys(key for row in every for key in row if key not in own)  # the parameters of a map's law
        columns = _columns(columns, (*more, *(name for name in columns.shown if name in known)))
    elif isinstance(columns, Mapping):
        columns = [Shown(printable(title), key, form=".6g") for key, title in columns.items()]
    else:
        columns = list(_filled(columns, every, [True] * len(every)))
    _print_blocks([column.title for column in columns], [[column.text(row) for column in columns] for row in every])


def print_budgets(rows: Iterable[Any]) -> None:
    """Print what adds how much to the uncertainty of each number of a row, and its share of the combined variance."""
    for row in rows:
        causes = [
            {"quantity": name, "cause": cause, "uncertainty": size, "share": float(f"{100.0 * size**2 / total:.3g}")}
            for name, sizes in (row.get("budget") or {}).items()
            for total in [sum(size**2 for size in sizes.values()) or 1.0]
            for cause, size in sizes.items()
        ]
        if causes:
            typer.echo(f"\n{row['source']}: what adds to the uncertainty")
            print_table(causes, heads("budget"))


def paragraph(text: str, *, indent: str = "") -> None:
    """Print a sentence on stdout, in lines that fit."""
    typer.echo(folded(text, indent))


def _bold(text: str) -> str:
    bold = sys.stdout.isatty() and not os.environ.get("NO_COLOR")
    return typer.style(text, bold=True) if bold else text


def _joined(texts: Sequence[str], widths: Sequence[int]) -> str:
    return (" " * GAP).join(text.ljust(width) for text, width in zip(texts, widths, strict=True)).rstrip()


def _width() -> int:
    return shutil.get_terminal_size().columns


class Rows(list[Row]):
    """The rows of the inputs that are done."""

    ended = 0  # the exit status that follows from what came before the last


def report_rows(rows: Iterable[Row], *, as_json: bool) -> Rows:
    """Return all rows; with ``as_json`` print each as it comes, a line of JSON.

    Ctrl-C and a standard output that takes no more end it; the rows until then are returned, to be written.
    """
    seen = Rows()
    try:
        for row in rows:
            seen.append(row)
            if as_json:
                typer.echo(json_line({key: value for key, value in row.items() if key[0] != "_"}))
    except KeyboardInterrupt:
        seen.ended = STOPPED
        complain(f"stopped: {len(seen)} inputs are done, the others are not")
    except LostOutputError as error:
        seen.ended = error.status
        if not error.is_closed:
            complain(f"{error}: {len(seen)} inputs are done, the others are not")
    return seen


def exit_status(rows: Iterable[Row]) -> None:
    """Leave with status 1 if some input failed (contract: 0 all well, 1 some input failed), as shells do if stopped."""
    status = rows.ended if isinstance(rows, Rows) else 0
    if status or any(row.get("status") == FAILED for row in rows):
        raise typer.Exit(status or 1)


def track(items: Iterable[T], *, title: str, total: int = 0, quiet: bool = False) -> Iterator[T]:
    """Yield the items and show how many are done, if ``quiet`` is not set; ``total``: of items without a length."""
    total = len(items) if isinstance(items, Sized) else total
    with count(title, quiet=quiet, total=total) as progress:
        for number, item in enumerate(items, 1):
            yield item
            progress(number, total)


@contextmanager
def count(title: str, *, quiet: bool = False, total: int | None = None) -> Iterator[Callable[[int, int], None]]:
    """Give a function of what is done and what there is in all, which shows it with the time taken and left."""
    if quiet or not sys.stderr.isatty():
        yield lambda *_: None
        return
    from rich import progress as bars
    from rich.console import Console
    from rich.markup import escape

    counted = (bars.MofNCompleteColumn(), bars.TimeElapsedColumn(), bars.TextColumn("left"), bars.TimeRemainingColumn())
    columns = (bars.TextColumn("{task.description}"), bars.BarColumn(), *counted)
    with bars.Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(escape(title.encode("ascii", "backslashreplace").decode()), total=total)
        yield lambda done, total: progress.update(task, completed=done, total=total)
