"""What a recording says of its contact, in a dozen lines: the law, its values in newtons, what a simpler law leaves.

Everything here is a `Comparison` in words; nothing is found anew. What a simpler law leaves is its row of the ladder.
"""

import html
import math
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError
from frictionlab.inference.compare import AUTO, compare_measurement
from frictionlab.inference.comparison import Comparison, ContactForce
from frictionlab.inference.ladder import REQUIRED, left_for_work
from frictionlab.inference.posterior import limits_in_words
from frictionlab.inference.verdict import NOT_DETERMINED
from frictionlab.scene import Scene
from frictionlab.scene.physical import to_physical
from frictionlab.schema import GRAVE, OF_LAWS
from frictionlab.simulator.laws import law_of
from frictionlab.uncertainty import STIFF, Estimate, unit_share

WIDTH = 80
VERDICTS = {
    "explained": "It explains the cycle: it",
    "strained": "It explains the cycle only with sensors or rig unlike the scene (below): it",
}


@dataclass(frozen=True)
class Explanation:
    """What a recording says of its contact.

    ``comparison``: under the law that the recording requires; ``physical``: parameter -> value, uncertainty, unit,
    words.
    """

    comparison: Comparison
    physical: Mapping[str, tuple[float, float | None, str, str]]

    @property
    def contact(self) -> ContactForce | None:
        """What the one figure shows; None where there is nothing to compare."""
        return self.comparison.contact

    @property
    def simpler(self) -> dict[str, Any] | None:
        """The ladder's row of the likeliest law with fewer terms; None of plain Coulomb friction, or without a ladder.

        The row has ``gain`` beside the rest: by how much the log evidence of the law required is larger.
        """
        rows: dict[str, Any] = {str(r["law"]): r for r in self.comparison.laws or () if r["log_evidence"] is not None}
        own, terms = rows.get(self.comparison.law), {t.name for t in law_of(self.comparison.law).terms}
        fewer = [row for name, row in rows.items() if {t.name for t in law_of(name).terms} < terms]
        best = max(fewer, key=lambda row: row["log_evidence"], default=None)
        return {**best, "gain": own["log_evidence"] - best["log_evidence"]} if own and best else None

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.text)}</pre>"

    @property
    def text(self) -> str:
        """The explanation, in lines of at most 80 letters."""
        return "\n".join(said for _, said in self._sentences())

    def short(self, most: int) -> list[str]:
        """So many lines of the text, those of what matters most: law, values, what decides, what is doubtful, next."""
        kept: dict[int, list[str]] = {}
        for place, (_, said) in sorted(enumerate(self._sentences()), key=lambda sentence: sentence[1][0]):
            if sum(map(len, kept.values())) + len(lines := said.splitlines()) <= most:
                kept[place] = lines
        return [line for place in sorted(kept) for line in kept[place]]

    def _sentences(self) -> list[tuple[int, str]]:
        """Each sentence in lines; before it its rank, 0 for what matters most."""
        found = []
        for rank, text in (*_what_it_is(self), *_what_it_is_not(self), *_what_next(self)):
            indent = "  " if text.startswith("  ") else ""
            lines = textwrap.fill(text.strip(), WIDTH, initial_indent=indent, subsequent_indent=indent + "  ")
            found.append((rank, lines))
        return found

    def row(self) -> dict[str, object]:
        """The comparison's row, with the text and values in physical units."""
        return {
            **self.comparison.row(),
            "physical": {n: {"value": v, "u": u, "unit": unit} for n, (v, u, unit, _) in self.physical.items()},
            "text": self.text.splitlines(),
        }

    def __repr__(self) -> str:
        return f"<Explanation of {self.comparison!r}>"


def explain(measurement: Measurement, scene: Scene) -> Explanation:
    """Say which law a measured test requires, what it is made of, and what the next simpler law leaves."""
    comparison = compare_measurement(measurement, scene, law=AUTO)
    found, turn = _force(comparison), 2.0 * math.pi * measurement.drive_frequency_hz
    frame = scene.rig.stiffness, scene.rig.natural_frequency
    if scene.rig.kind == "prescribed" and comparison.contact is not None and comparison.contact.unit_n is not None:
        frame = comparison.contact.unit_n / measurement.base_amplitude_m, measurement.drive_frequency_hz  # there r is 1
    for parameter in law_of(comparison.law).own:
        own = comparison.parameters[parameter.name]
        if parameter.shown is not None and own["u"] is not None:
            times, unit, words = parameter.shown
            factor, of = to_physical(parameter, *frame, amplitude=measurement.base_amplitude_m, turn=turn)
            if factor is not None:
                share = 0.0 if scene.rig.kind == "prescribed" else unit_share(of, measurement.sources)
                physical = Estimate(own["value"], None, own["u"]).scaled(times * factor).widened(share)
                found[parameter.name] = (physical.value or 0.0, physical.u, unit, words)
    return Explanation(comparison, found)


def explain_comparison(comparison: Comparison) -> Explanation:
    """Put a comparison into words as it is; AnalysisError without a steady cycle."""
    if comparison.contact is None or comparison.energy_per_cycle is None:
        raise AnalysisError("explain: the comparison has no steady cycle: expected one of compare(recording)")
    return Explanation(comparison, _force(comparison))


def _force(comparison: Comparison) -> dict[str, tuple[float, float | None, str, str]]:
    """The friction force, where the stiffness is known."""
    force, u = comparison.friction_force_n, comparison.friction_force_n_u
    return {} if force is None else {"beta": (force, u, "N", "friction force")}


def _left_for_work(c: Comparison) -> list[str]:
    return left_for_work({str(row["law"]): str(row["note"] or "") for row in c.laws or ()})


def _what_it_is(about: Explanation) -> Iterator[tuple[int, str]]:
    """Law, energy, values and what their error comes from, each sentence behind its rank."""
    c = about.comparison
    law = law_of(c.law)
    at = "under a given motion" if c.frequency_ratio is None else f"at r = {c.frequency_ratio:.4g}"
    head, words = f"{c.source}: {c.law} {at}", f" ({law.words})"
    yield 0, head + words * (len(head + words) <= WIDTH)
    if c.response_nrmse is None or c.response_floor is None:
        yield 0, "No prediction: this law has no steady state here."
    else:
        tried = "tried to the end" if _left_for_work(c) else "tried"
        best = f"No law that was {tried} explains the cycle. The best one"
        verdict = VERDICTS.get(c.verdict or "", best if c.laws else f"{c.law} does not explain the cycle: it")
        noise = f"the measurement's own error is {100 * c.response_floor:.2g} %"
        what = "force" if c.contact is not None and c.contact.is_measured else "motion"
        yield 0, f"{verdict} leaves {100 * c.response_nrmse:.2g} % of the {what} unexplained; {noise}."
    if c.energy_difference is not None:
        joules = f" = {c.energy_joules.scaled(1e3)} mJ" if c.energy_joules.known else ""
        more = f"predicted {abs(100 * c.energy_difference):.2g} % {'more' if c.energy_difference > 0 else 'less'}"
        yield 3, f"Energy per cycle: {c.energy} k Y^2{joules} measured, {more}."
    vague: list[str] = []
    for name, e in c.parameters.items():
        if e["u"] is None:
            continue
        own, words = Estimate(e["value"], None, e["u"]), law.parameter(name).words
        if not e["told"]:
            limits = limits_in_words(e["lower"], e["upper"])
            vague.append(f"{name} {limits.replace('at most', '<=').replace('at least', '>=')}")
        elif name in about.physical:
            size, error, unit, words = about.physical[name]
            mu = c.coefficient.value if name == "beta" else None
            more = "" if mu is None else f"; coefficient {Estimate(mu, None, c.coefficient.u)}"
            yield 1, f"  {words}: {Estimate(size, None, error)} {unit} ({name} {own}){more}"
        else:
            yield 1, f"  {words}: {own} ({name})"
    if STIFF in c.assumed and c.contact is not None and c.contact.unit_n is not None and not c.contact.is_measured:
        k, u = c.contact.unit_n / c.contact.unit_m, 100.0 * c.contact.stiffness_u
        yield 2, f"  N and J rest on k = {k:.4g} N/m, assumed to be known to {u:.2g} % (stiffness_n_per_m_u)"
    if vague:
        yield 2, f"  not determined (95 %): {', '.join(vague)}"
    shares = c.budget.get("friction_ratio", {})
    if shares:
        most = max(shares, key=lambda name: shares[name])
        yield 4, f"What adds most to the error of beta: {most} (compare-numeric --budget lists all)."


def _what_it_is_not(about: Explanation) -> Iterator[tuple[int, str]]:
    """What a simpler law leaves, and which laws were left out."""
    c, simpler = about.comparison, about.simpler
    if simpler is not None and simpler["response_nrmse"] is not None:
        enough = f"Its log evidence is {simpler['gain']:.0f} lower; {REQUIRED:.0f} is enough."
        yield 3, f"A simpler law, {simpler['law']}, leaves {100 * simpler['response_nrmse']:.2g} %. {enough}"
    if (left := _left_for_work(c)) and c.verdict != "explained":
        yield 6 if c.verdict == "strained" else 0, f"Left out, for the ladder's work was used up: {', '.join(left)}."


def _what_next(about: Explanation) -> Iterator[tuple[int, str]]:
    """What to measure next, and what the comparison warns of."""
    c = about.comparison
    untold, law = [name for name, e in c.parameters.items() if e["u"] is not None and not e["told"]], law_of(c.law)
    yield from ((2, f"To measure {name}: {law.parameter(name).determined_by}.") for name in untold)
    if c.verdict == "strained":
        yield 0, "Next: check rig and sensors, as the lines with ! say, in their order: law and values may change."
    elif (left := _left_for_work(c)) and c.verdict != "explained":
        yield 0, f"Next: frictionlab compare-numeric --law {left[0]} fits that law alone."
    elif not untold:
        yield 2, "Next: tests at another amplitude and another speed; frictionlab plan says which."
    warnings = (said for said in c.warnings if NOT_DETERMINED not in said)
    yield from ((1 if GRAVE.search(said) and not OF_LAWS.match(said) else 5, f"! {said}") for said in warnings)
