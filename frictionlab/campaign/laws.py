"""Which law each material requires: the evidence of single tests, as a ladder of laws gives it, taken together.

Each test has parameters of its own, so the joint evidence of a law is the product of its tests', and its logarithm the
sum. Only laws that were tried in all tests of a material are compared.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from frictionlab.campaign.joining import Material
from frictionlab.identification.ladder import REQUIRED
from frictionlab.tables import Row


@dataclass(frozen=True)
class LawEvidence:
    """One law for one material.

    ``tests``: that it was tried in; ``log_evidence``: sum over them; ``gain``: the same less plain Coulomb's;
    ``response_nrmse``: rms over the tests; ``chosen_in``: tests that require it on their own; ``required``: whether it
    is the simplest law within `REQUIRED` of the best, joint evidence decides; ``screened``: whether its evidence is of
    straight lines about a simpler law's fit, None where single ladders were climbed.
    """

    material: str
    law: str
    tests: int
    log_evidence: float
    gain: float | None
    response_nrmse: float | None
    chosen_in: int | None
    required: bool
    screened: bool | None = None


def laws_together(joined: Mapping[str, Material], single: Sequence[LawEvidence]) -> tuple[LawEvidence, ...]:
    """The laws tried on all tests of a material together, best first; else what single ladders say of it."""
    lines = [line for material in joined.values() for line in _of_rungs(material)]
    told = {line.material for line in lines}
    return tuple(sorted([*lines, *(line for line in single if line.material not in told)], key=lambda e: e.material))


def _of_rungs(material: Material) -> list[LawEvidence]:
    if not material.rungs:
        return []
    plain = material.rungs[0].log_evidence
    tests = len(material.joined.best.fits)
    lines = [
        LawEvidence(
            material=material.name,
            law=rung.law.name,
            tests=tests if rung.joint is None else len(rung.joint.fits),
            log_evidence=rung.log_evidence,
            gain=rung.log_evidence - plain,
            response_nrmse=rung.nrmse,
            chosen_in=None,
            required=rung.law.name == material.law.name,
            screened=rung.joint is None,
        )
        for rung in material.rungs
    ]
    return sorted(lines, key=lambda line: -line.log_evidence)


def is_comparison(row: Row) -> bool:
    """Whether a row tells a comparison (or its failure), no measurement."""
    return "law" in row or "laws" in row


def laws_of(comparisons: Sequence[Row], materials: Mapping[str, str]) -> tuple[LawEvidence, ...]:
    """Return the joint evidence of each material, best law first.

    Parameters
    ----------
    comparisons : sequence of rows
        Of `compare-numeric --law auto`, with ``laws``; rows without are passed over.
    materials : mapping
        Material by source.
    """
    by_material: dict[str, list[Row]] = {}
    for row in comparisons:
        material = materials.get(str(row.get("source")))
        if material is not None and _ladder(row):
            by_material.setdefault(material, []).append(row)
    return tuple(line for m in sorted(by_material) for line in _of_material(m, by_material[m]))


def _ladder(row: Row) -> dict[str, Mapping[str, object]]:
    """Rungs by law; empty where the row has none."""
    laws = row.get("laws")
    rungs = laws if isinstance(laws, (list, tuple)) else ()
    known = [rung for rung in rungs if isinstance(rung, Mapping) and _number(rung.get("log_evidence")) is not None]
    return {str(rung["law"]): rung for rung in known if rung.get("law")}


def _number(value: object) -> float | None:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    return float(value) if is_number and isinstance(value, (int, float)) else None


def _of_material(material: str, rows: Sequence[Row]) -> list[LawEvidence]:
    ladders = [_ladder(row) for row in rows]
    common = sorted(set.intersection(*(set(ladder) for ladder in ladders)))
    total = {law: math.fsum(_number(ladder[law]["log_evidence"]) or 0.0 for ladder in ladders) for law in common}
    if not total:
        return []
    best = max(total.values())
    near = [law for law in common if total[law] >= best - REQUIRED]
    required = min(near, key=lambda law: (law.count("+"), -total[law]))
    lines = [
        LawEvidence(
            material=material,
            law=law,
            tests=len(rows),
            log_evidence=total[law],
            gain=total[law] - total["coulomb"] if "coulomb" in total else None,
            response_nrmse=_rms([_number(ladder[law].get("response_nrmse")) for ladder in ladders]),
            chosen_in=sum(row.get("law") == law for row in rows),
            required=law == required,
        )
        for law in common
    ]
    return sorted(lines, key=lambda line: -line.log_evidence)


def _rms(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return math.sqrt(math.fsum(v * v for v in known) / len(known)) if known else None
