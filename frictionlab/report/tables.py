"""The report's tables and lists; every text that comes from a log is escaped on its way in."""

import math
from collections.abc import Iterable, Sequence
from html import escape

from frictionlab.campaign import CRITERIA, Campaign, Drift, FrictionFit, LawEvidence, LawParameter, Rank, Trial, Verdict
from frictionlab.campaign.trials import short_name
from frictionlab.campaign.warned import Warned, kinds_of
from frictionlab.report.sheet import sheet_name
from frictionlab.schema import DRIFTS, FRICTION, LAW_PARAMETERS, MATERIAL_LAWS, TESTS, Column, Table

DASH = "–"
NO_LAWS = "Not asked: `frictionlab campaign ... --law auto` finds the law that each material's tests require together."
LAWS_RULE = (
    "Log evidence of all tests of a material together, over plain Coulomb friction. Required is a law whose evidence is"
    " more than 5 above that of every simpler one, and which predicts tests left out better by more than their error."
    " Where tests were fitted together they share the law's parameters in newtons, metres and seconds; a law that was"
    " only screened has no nrmse: its evidence is that of straight lines about a simpler law's fit."
)


def words(text: object) -> str:
    """A cell of text."""
    return f"<td>{escape(str(text)) if text not in (None, '') else DASH}</td>"


def sentence(text: object) -> str:
    """A cell of text that may be long."""
    return f'<td class="words">{escape(str(text)) if text not in (None, "") else DASH}</td>'


def number(value: float | None, digits: int = 4) -> str:
    """A cell with a number; its full value is kept for sorting.

    Examples
    --------
    >>> number(0.123456), number(None)
    ('<td class="n" data-v="0.123456">0.1235</td>', '<td class="n">–</td>')
    """
    if value is None or not math.isfinite(value):
        return f'<td class="n">{DASH}</td>'
    return f'<td class="n" data-v="{value:.9g}">{value:.{digits}g}</td>'


def with_error(value: float | None, error: float | None) -> str:
    """A cell with a value and its standard error, rounded to two digits of the error.

    Examples
    --------
    >>> with_error(0.123456, 0.0021)
    '<td class="n" data-v="0.123456">0.1235 ± 0.0021</td>'
    """
    if value is None or error is None or not 0 < error < math.inf:
        return number(value)
    digits = max(0, 1 - math.floor(math.log10(error)))
    return f'<td class="n" data-v="{value:.9g}">{value:.{digits}f} ± {error:.{digits}f}</td>'


def paragraph(text: str) -> str:
    """One paragraph."""
    return f"<p>{running(text)}</p>"


def running(text: str) -> str:
    """Escaped text in which no line breaks before a percent sign."""
    return escape(text.replace(" %", "\N{NO-BREAK SPACE}%"))


def listing(sentences: Iterable[str]) -> str:
    """A list of sentences; nothing for none."""
    items = "".join(f"<li>{running(text)}</li>\n" for text in sentences)
    return f"<ul>\n{items}</ul>" if items else ""


def table(heads: Sequence[str | Column], rows: Iterable[str], *, sortable: bool = False) -> str:
    """A table in its own scrolling box; a head is a column, or words (of numbers if they start with ``#``)."""
    head = "".join(_head(text, sortable=sortable) for text in heads)
    body = "\n".join(rows)
    kinds = ("scroll tall", "sortable") if sortable else ("scroll", "plain")
    return (
        f'<div class="{kinds[0]}"><table class="{kinds[1]}">\n<thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody></table></div>"
    )


def _head(what: str | Column, *, sortable: bool) -> str:
    name, is_number, about = _told(what)
    inner = f'<button type="button">{escape(name)}</button>' if sortable else escape(name)
    kind, sort = ' class="n"' if is_number else "", " aria-sort=none" if sortable else ""
    return f'<th scope="col"{kind}{sort}{about}>{inner}</th>'


def _told(what: str | Column) -> tuple[str, bool, str]:
    """Words of a head, whether numbers stand below it, and what it says when it is pointed at."""
    if isinstance(what, Column):
        return what.head, what.type.is_number, f' title="{escape(what.sentence)}"'
    return what.removeprefix("#"), what.startswith("#"), ""


def columns(of: Table, *names: str) -> tuple[Column, ...]:
    """The columns of these names, with their titles, units and sentences."""
    return tuple(column for column in of.columns if column.name in names)


def _row(*cells: str, kind: str = "") -> str:
    return f"<tr{kind}>{''.join(cells)}</tr>"


def ranking(campaign: Campaign) -> str:
    """The three rankings, each with what its value is and with its evidence."""
    rule = "A rank is one more than the number of materials that are better beyond doubt (95 %): equal ranks are ties."
    parts = [paragraph(rule)]
    for criterion in CRITERIA:
        ranks = [rank for rank in campaign.ranking if rank.criterion == criterion]
        if ranks:
            parts += [f"<h3>By {criterion}</h3>", paragraph(f"{_capital(ranks[0].unit)}; {ranks[0].evidence}.")]
        if any(rank.rank for rank in ranks):
            parts.append(table(("#rank", "material", "#value ± uncertainty", "tied with"), map(_rank, ranks)))
    return "\n".join(parts)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _rank(rank: Rank) -> str:
    return _row(
        number(rank.rank),
        words(rank.material),
        with_error(rank.value, rank.value_u),
        words(", ".join(rank.tied_with)),
    )


def friction(campaign: Campaign) -> str:
    """Friction per material and normal force, and Amontons' test in words."""
    heads: tuple[str | Column, ...] = (
        *columns(FRICTION, "material", "normal_force_n", "tests"),
        "#used",
        *columns(FRICTION, "friction_ratio", "friction_force_n", "friction_coefficient"),
        *("#95 % confidence", "#scatter [%]", "note"),
    )
    verdicts = listing(test.verdict for test in campaign.amontons)
    return table(heads, (_friction(fit) for fit in campaign.fits)) + "\n<h3>Amontons' law</h3>\n" + verdicts


def _friction(fit: FrictionFit) -> str:
    low, high = fit.coefficient_interval
    short = [v for v in fit.verdicts if not v.trial.is_long] or list(fit.verdicts)
    interval = DASH if low is None or high is None else f"{low:.4f} to {high:.4f}"
    return _row(
        words(fit.material),
        number(fit.normal_force_n),
        number(len(short)),
        number(len(fit.used)),
        with_error(fit.friction_ratio, fit.ratio.error),
        with_error(fit.friction_force_n, fit.force.error),
        with_error(fit.friction_coefficient, fit.coefficient.error),
        f'<td class="n">{interval}</td>',
        number(None if fit.scatter is None else 100 * fit.scatter, 2),
        sentence(fit.note),
    )


def laws(campaign: Campaign) -> str:
    """Which contact law each material requires, by the evidence of all its tests."""
    told = _parameters(campaign)
    if not campaign.laws:
        return paragraph(NO_LAWS) + told
    heads = columns(MATERIAL_LAWS, "material", "law", "tests", "gain", "response_nrmse", "chosen_in")
    head: tuple[str | Column, ...] = (*heads[:3], "required", *heads[3:])
    return paragraph(LAWS_RULE) + table(head, map(_law, campaign.laws)) + told


def _parameters(campaign: Campaign) -> str:
    """The parameters of the laws, as all tests of a material tell them."""
    if not campaign.parameters:
        return ""
    heads = columns(LAW_PARAMETERS, "material", "law", "parameter", "value", "scatter", "physical_value", "unit")
    return "\n<h3>Parameters</h3>\n" + table((*heads, "told"), map(_parameter, campaign.parameters))


def _parameter(parameter: LawParameter) -> str:
    return _row(
        words(parameter.material),
        words(parameter.law),
        words(parameter.parameter),
        with_error(parameter.value, parameter.number.error),
        number(parameter.scatter, 2),
        with_error(parameter.physical_value, parameter.physical.error),
        words(parameter.unit),
        words("yes" if parameter.is_told else "no: the tests do not tell it"),
    )


def _law(law: LawEvidence) -> str:
    return _row(
        words(law.material),
        words(law.law),
        number(law.tests),
        words("required" if law.required else ""),
        number(law.gain),
        number(law.response_nrmse, 2),
        number(law.chosen_in),
    )


def drift(campaign: Campaign) -> str:
    """The long tests."""
    if not campaign.drifts:
        return paragraph("No long test.")
    heads: tuple[str | Column, ...] = (
        *columns(DRIFTS, "material", "normal_force_n", "frequency_ratio"),
        "#minutes",
        *columns(DRIFTS, "slope_per_hour"),
        *("#95 % confidence", "#relative [%/h]", "#friction force [%/h]", "verdict", "note"),
    )
    return table(heads, (_drift(d) for d in campaign.drifts))


def _drift(d: Drift) -> str:
    interval = DASH if d.low is None or d.high is None else f"{d.low:+.3g} to {d.high:+.3g}"
    return _row(
        words(d.trial.material),
        number(d.trial.normal_force_n),
        number(d.trial.frequency_ratio),
        number(d.trial.duration_s / 60),
        with_error(d.slope_per_hour, d.slope_per_hour_se),
        f'<td class="n">{interval}</td>',
        with_error(_percent(d.relative_per_hour), _percent(d.relative_per_hour_se)),
        with_error(_percent(d.friction_per_hour), _percent(d.friction_per_hour_se)),
        words(d.verdict),
        sentence(d.note),
    )


def _percent(value: float | None) -> float | None:
    return None if value is None else 100 * value


def tests(campaign: Campaign) -> str:
    """All tests, failed ones too, to be sorted and filtered."""
    heads: tuple[str | Column, ...] = (
        *("test", "status"),
        *columns(TESTS, "material", "normal_force_n", "frequency_ratio", "energy_per_cycle"),
        "#energy [mJ]",
        *columns(TESTS, "predicted_energy_per_cycle"),
        "#residual [%]",
        *columns(TESTS, "response_amplitude", "irregularity_index", "stops_per_cycle", "regime", "test_friction_ratio"),
        "remark",
    )
    verdicts = campaign.verdicts
    rows = (_test(n, trial, verdicts.get(trial.source), campaign) for n, trial in enumerate(campaign.trials, 1))
    return _controls(campaign) + table(heads, rows, sortable=True)


def _controls(campaign: Campaign) -> str:
    materials = "".join(f"<option>{escape(m)}</option>" for m in campaign.materials)
    states = "".join(f"<option>{state}</option>" for state in ("used", "left out", "long", "failed"))
    return (
        '<div class="controls"><label>Filter <input id="filter-words" type="search" placeholder="any words"></label>'
        f'<label>Material <select data-column="2"><option value="">all</option>{materials}</select></label>'
        f'<label>Status <select data-column="1"><option value="">all</option>{states}</select></label>'
        '<span id="filter-count" class="soft" role="status"></span></div>\n'
    )


def status(trial: Trial, verdict: Verdict | None) -> str:
    """One word for what a test is to the campaign."""
    if trial.failed:
        return "failed"
    if trial.is_long:
        return "long"
    return "used" if verdict is not None and verdict.excluded is None else "left out"


def _test(place: int, trial: Trial, verdict: Verdict | None, campaign: Campaign) -> str:
    state = status(trial, verdict)
    predicted = verdict.predicted.energy if verdict is not None and verdict.predicted is not None else None
    remark = trial.reason or (str(verdict.excluded) if verdict is not None and verdict.excluded else None)
    return _row(
        f'<td title="{escape(trial.source)}"><a href="tests/{sheet_name(place, trial)}">'
        f"{escape(short_name(trial.source))}</a></td>",
        words(state),
        words(trial.material),
        number(trial.normal_force_n),
        number(trial.frequency_ratio),
        with_error(trial.mean[0], trial.mean_se[0]),
        number(_millijoules(trial, campaign)),
        number(predicted),
        number(_percent(verdict.residual) if verdict is not None else None, 2),
        number(trial.amplitude.value),
        number(trial.irregularity, 2),
        number(trial.stops, 3),
        words(trial.regime),
        with_error(*(verdict.friction_ratio, verdict.friction_ratio_se) if verdict is not None else (None, None)),
        sentence(remark),
        kind=' class="failed"' if trial.failed else "",
    )


def _millijoules(trial: Trial, campaign: Campaign) -> float | None:
    """Energy per cycle in mJ, where stiffness and base amplitude are known."""
    stiffness, amplitude = campaign.scene.rig.stiffness, trial.base_amplitude_m
    return None if stiffness is None else 1e3 * stiffness * amplitude**2 * trial.mean[0]


def left_out(campaign: Campaign) -> str:
    """Which short tests Coulomb's law cannot explain, or which say nothing of it, by reason."""
    left = [v for f in campaign.fits for v in f.verdicts if v.excluded is not None and not v.trial.is_long]
    if not left:
        return paragraph("None: Coulomb's law explains every short test.")
    return listing(f"{v.trial.source}: {v.excluded}" for v in left)


def failures(campaign: Campaign) -> str:
    """Failed tests with their reasons."""
    found = [f"{t.source}: {t.reason}" for t in campaign.failures]
    return listing(found) if found else paragraph("None.")


def warnings(campaign: Campaign) -> str:
    """What was said of the tests when they were measured, once for all that it was said of."""
    found = kinds_of((short_name(t.source), text) for t in campaign.trials for text in t.warnings)
    return listing(map(_warned, found)) if found else paragraph("None.")


def _warned(kind: Warned) -> str:
    first, *others = kind.sources
    alike = f" Alike in {len(others)} more: {', '.join(others)}." if others else ""
    return f"{first}: {kind.sentence}{'.' * bool(others)}{alike}"
