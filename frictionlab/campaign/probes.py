"""Laws beyond a rigid contact's: where those explain too few tests, single ladders of some tests say what else to try.

A contact that yields, or whose friction has a state of its own, costs much a steady state and has many valleys, so that
three tests are probed, each by its own full ladder; what they find is then fitted to all tests of the material, or to
some where the law has to be integrated step by step.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.campaign.cycles import Cycle
from frictionlab.campaign.joint import cost_at
from frictionlab.campaign.required import Rung, predicts_better, rung_of
from frictionlab.campaign.shared import FRICTION
from frictionlab.errors import AnalysisError, SimulationError
from frictionlab.identification import AUTO
from frictionlab.identification.ladder import REQUIRED
from frictionlab.identification.observed import EXPLAINED
from frictionlab.simulator.laws import Law, law_of
from frictionlab.tables import Row

FloatArray = NDArray[np.float64]
Probe = Callable[[Sequence[str], str], Sequence[Row]]
"""Rows of single comparisons of tests, by their sources, under a law or with `AUTO` a ladder of laws."""
Frictions = Mapping[tuple[str, float], float]
PROBED = 3
MANY = 0.25  # share of tests that a law leaves unexplained, from which others are looked for
SOME = 12  # tests that a law without exact slides is fitted to


def beyond_rigid(cycles: Sequence[Cycle], top: Rung, probe: Probe) -> tuple[list[Rung], Rung, list[Cycle], list[Row]]:
    """Return the other laws tried, the one that is required with them, the tests that it was fitted to, and ladders."""
    if not _leaves_much(top):
        return [], top, list(cycles), []
    rows = list(probe([cycle.source for cycle in spread_over(cycles, PROBED)], AUTO))
    found, best, fitted = [], top, list(cycles)
    for law, starts in _candidates(rows, top.law).items():
        some = affordable(cycles, law)
        before = top if len(some) == len(cycles) else _again(some, top)
        rung = _tried(some, law, starts, rows, before)
        if rung is None:
            continue
        gain = rung.log_evidence - before.log_evidence
        required = gain > REQUIRED and predicts_better(rung, before)
        rung = Rung(law, top.log_evidence + gain, rung.left_out, required, rung.joint)
        found.append(rung)
        if required and rung.log_evidence > best.log_evidence:
            best, fitted = rung, some
    return found, best, fitted, rows


def _leaves_much(top: Rung) -> bool:
    if top.joint is None:
        return False
    return float(np.mean([f.nrmse > EXPLAINED * f.observed.floor for f in top.joint.fits])) > MANY


def spread_over(cycles: Sequence[Cycle], count: int) -> list[Cycle]:
    """So many tests, evenly over the frequency ratios of each normal force."""
    groups = sorted({cycle.group for cycle in cycles})
    each = max(1, count // len(groups))
    chosen: list[Cycle] = []
    for group in groups if count >= len(groups) else groups[:1]:
        own = sorted((c for c in cycles if c.group == group), key=lambda c: c.family.r)
        want = min(len(own), each if count >= len(groups) else count)
        chosen += [own[round((i + 0.5) * len(own) / want - 0.5)] for i in range(want)]
    return chosen


def affordable(cycles: Sequence[Cycle], law: Law) -> list[Cycle]:
    """The tests that a law is fitted to: some, where each steady state has to be integrated step by step."""
    return list(cycles) if law.is_exact else spread_over(cycles, SOME)


@dataclass(frozen=True)
class Begun:
    """Where a fit of a law to tests begins: its values but the friction ratios, those, and the tests."""

    start: Mapping[str, float]
    frictions: Frictions
    cycles: list[Cycle]


def begin(cycles: Sequence[Cycle], law: Law, frictions: Frictions, probe: Probe) -> Begun:
    """Return where the fit of a given law begins: by single comparisons of some tests, where the law has valleys.

    Parameters
    ----------
    cycles : sequence of Cycle
        Of one material.
    law : Law
    frictions : mapping
        Friction ratio of each group under a simpler law.
    probe : callable
        Compares single tests.
    """
    some = affordable(cycles, law)
    found = {c.source: dict(c.alone.fit.law_values) for c in some if c.alone is not None}
    if len(found) == len(some):
        known = found
    elif law.kind == "rigid":
        return Begun({}, frictions, some)
    else:
        known = _compared(probe([cycle.source for cycle in spread_over(some, PROBED)], law.name))
    groups = {cycle.source: cycle.group for cycle in some}
    scales = [values[FRICTION] / frictions[groups[source]] for source, values in known.items() if FRICTION in values]
    scale = float(np.median(scales)) if scales else 1.0
    scaled = {group: scale * beta for group, beta in frictions.items()}
    starts = [{name: value for name, value in values.items() if name != FRICTION} for values in known.values()]
    if len(starts) > 1:
        starts.sort(key=lambda start: cost_at(some, law, start, scaled, {}))
    return Begun(starts[0] if starts else {}, scaled, some)


def _compared(rows: Sequence[Row]) -> dict[str, dict[str, float]]:
    """Values of the law that single comparisons found, by source; those that failed found none."""
    told = {str(row["source"]): row.get("parameters") for row in rows}
    return {
        source: {name: float(one["value"]) for name, one in parameters.items()}
        for source, parameters in told.items()
        if isinstance(parameters, Mapping)
    }


def _candidates(rows: Sequence[Row], tried: Law) -> dict[Law, list[dict[str, float]]]:
    """Laws that the ladders of single tests require and that were not tried together, with the values they found."""
    found: dict[Law, list[dict[str, float]]] = {}
    for row in rows:
        rungs = row.get("laws")
        for rung in rungs if isinstance(rungs, (list, tuple)) else ():
            law = law_of(str(rung["law"]))
            if law.kind == "rigid" or not (rung["required"] or rung["law"] == row.get("law")):
                continue
            values = {name: float(told["value"]) for name, told in rung["parameters"].items()}
            if law.name != tried.name:
                found.setdefault(law, []).append(values)
    return found


def _again(some: Sequence[Cycle], rung: Rung) -> Rung:
    if rung.joint is None:
        return rung
    return rung_of(some, rung.law, [rung.joint.start], rung.joint.frictions, ())


def _tried(
    cycles: Sequence[Cycle], law: Law, starts: Sequence[dict[str, float]], rows: Sequence[Row], before: Rung
) -> Rung | None:
    """A law fitted to the tests, friction scaled as in those that were probed; None if it cannot be."""
    if before.joint is None:
        return None
    known = before.joint.frictions
    own = {c.source: known[c.group] for c in cycles if c.group in known}
    scales = [
        float(rung["parameters"][FRICTION]["value"]) / own[source]
        for row in rows
        if (source := str(row.get("source"))) in own and isinstance(rungs := row.get("laws"), (list, tuple))
        for rung in rungs
        if rung["law"] == law.name
    ]
    scale = float(np.median(scales)) if scales else 1.0
    rest = [{name: value for name, value in values.items() if name != FRICTION} for values in starts]
    try:
        return rung_of(cycles, law, rest, {group: scale * beta for group, beta in known.items()}, ())
    except (AnalysisError, SimulationError, np.linalg.LinAlgError):
        return None
