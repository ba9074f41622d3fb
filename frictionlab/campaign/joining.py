"""The materials of a campaign, each fitted to the cycles of its tests together, not to two numbers of each test."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from frictionlab.campaign.cycles import Cycle
from frictionlab.campaign.friction import FrictionFit, Known, Verdict, in_newtons, reach_of
from frictionlab.campaign.joined import Joined, TestTold, join, joined_again
from frictionlab.campaign.prediction import Model, local
from frictionlab.campaign.probes import Probe, begin, beyond_rigid
from frictionlab.campaign.required import Rung, climb_together
from frictionlab.campaign.rig import on_one_rig
from frictionlab.campaign.trials import Trial
from frictionlab.campaign.verdicts import Cause, LeftOut
from frictionlab.errors import AnalysisError
from frictionlab.estimate import Estimate
from frictionlab.simulator import COSINE
from frictionlab.simulator.laws import Law
from frictionlab.tables import Row

FloatArray = NDArray[np.float64]
OUT = frozenset({Cause.LONG, Cause.STUCK, Cause.UNSTEADY, Cause.UNSETTLED})
"""Such a test has no steady cycle that a law could be fitted to."""
OUTLIER = 4.0  # robust standard deviations
FEWEST = 5  # tests of a material from which one of them may stand out
KEPT = 0.999  # of a disturbance after a cycle: from so much on a motion is one of many
SLIGHT = 1e-3  # relative: a friction ratio that differs by less does not stand out
BY_TWO_NUMBERS = (
    "{}: friction from two numbers of each test (energy and amplitude), for no law could be fitted to their cycles: {}"
)


@dataclass(frozen=True)
class Material:
    """One material whose tests were fitted together.

    ``rungs``: the laws tried, where they were; ``scenes``: the scene's model; ``out``: tests that stand out, with their
    own friction ratio and that of the others; ``dear``: tests that others stand for; ``ladders``: rows of the single
    tests that were probed.
    """

    name: str
    joined: Joined
    rungs: tuple[Rung, ...]
    scenes: Model
    out: Mapping[str, tuple[float, float]]
    dear: frozenset[str] = frozenset()
    ladders: tuple[Row, ...] = ()

    @property
    def law(self) -> Law:
        """The law that was fitted."""
        return self.joined.best.shared.law

    @cached_property
    def model(self) -> Model:
        """What its tests are predicted with."""
        best = self.joined.best
        held = dict(best.cycles[0].family.under(self.law).held) | best.values
        return Model(self.law, tuple(sorted(held.items())), self.scenes.wall, self.scenes.solver)


def usable(fits: Sequence[FrictionFit], cycles: Mapping[str, Cycle]) -> dict[str, list[Cycle]]:
    """The cycles of each material that a law can be fitted to.

    Where Coulomb's law has many steady states the cycle tells which of them it is more than the law; it counts only in
    a group that has no other tests.
    """
    found: dict[str, list[Cycle]] = {}
    for fit in fits:
        steady = [v for v in fit.verdicts if v.excluded is None or v.excluded.cause not in OUT]
        here = [v for v in steady if v.trial.source in cycles]
        alone = [v for v in here if v.predicted is None or v.predicted.memory < KEPT]
        if here:
            found.setdefault(fit.material, []).extend(cycles[v.trial.source] for v in alone or here)
    return found


def materials_of(
    fits: Sequence[FrictionFit],
    cycles: Mapping[str, Cycle],
    model: Model,
    laws: Mapping[str, Law | None],
    probe: Probe,
) -> tuple[dict[str, Material], list[str]]:
    """Fit the tests of each material together.

    Parameters
    ----------
    fits : sequence of FrictionFit
        From two numbers of each test: where the fit begins, and which tests have no steady cycle.
    cycles : mapping
        By source.
    model : Model
        The scene's.
    laws : mapping
        Law by material; None is found by climbing from plain Coulomb friction.
    probe : callable
        Gives the ladders of single tests, by their sources.

    Returns
    -------
    The materials by name, and sentences of those that could not be fitted.
    """
    found, notes = {}, []
    for name, all_of in usable(fits, cycles).items():
        starts = _starts(fits, all_of)
        own = [cycle for cycle in all_of if cycle.group in starts]
        try:
            if own:
                found[name] = _material(name, own, starts, model, laws.get(name, model.law), probe)
        except (AnalysisError, np.linalg.LinAlgError) as error:
            notes.append(BY_TWO_NUMBERS.format(name, error))
    return _on_one_rig(found), notes


def _on_one_rig(found: Mapping[str, Material]) -> dict[str, Material]:
    """The materials with the rig that they share; fitted again where parameters differ from test to test."""
    joined = _sharing({name: material.joined for name, material in found.items()})
    if any(one.shown for one in joined.values()):
        joined = _sharing({name: joined_again(one) for name, one in joined.items()})
    return {name: replace(material, joined=joined[name]) for name, material in found.items()}


def _sharing(joined: Mapping[str, Joined]) -> dict[str, Joined]:
    held = {name: one.held for name, one in joined.items()}
    moved, rig = on_one_rig(held, {name: replace(one.moved, on_one_rig=None) for name, one in joined.items()})
    return {name: Joined(held[name], moved[name], rig) for name in joined}


def _starts(fits: Sequence[FrictionFit], cycles: Sequence[Cycle]) -> dict[tuple[str, float], float]:
    """Friction ratio of each group to begin with: the tests' own where they were fitted alone, else by two numbers."""
    starts = {(f.material, f.normal_force_n): f.friction_ratio for f in fits if f.friction_ratio}
    alone: dict[tuple[str, float], list[float]] = {}
    for cycle in cycles:
        if cycle.alone is not None:
            alone.setdefault(cycle.group, []).append(cycle.alone.parameters["beta"].value)
    return starts | {group: float(np.median(values)) for group, values in alone.items()}


def _material(
    name: str,
    all_of: list[Cycle],
    starts: Mapping[tuple[str, float], float],
    model: Model,
    law: Law | None,
    probe: Probe,
) -> Material:
    cycles, ladders = all_of, list[Row]()
    rungs: list[Rung] = []
    known: Mapping[str, float]
    if law is not None:
        begun = begin(all_of, law, starts, probe)
        known, starts, cycles = begun.start, begun.frictions, begun.cycles
    else:
        rungs, top = climb_together(cycles, starts)
        others, top, cycles, ladders = beyond_rigid(cycles, top, probe)
        rungs += others
        law, known = top.law, {} if top.joint is None else top.joint.start
        starts = starts if top.joint is None else top.joint.frictions
    joined = join(cycles, law, known, starts)
    out = _standing_out(joined)
    if out:
        rest = [cycle for cycle in cycles if cycle.source not in out]
        joined = join(rest, law, joined.moved.start, joined.best.frictions)
    dear = frozenset(cycle.source for cycle in all_of) - {cycle.source for cycle in cycles}
    return Material(name, joined, tuple(rungs), model, out, dear, tuple(ladders))


def _standing_out(joined: Joined) -> dict[str, tuple[float, float]]:
    """Tests whose friction is far from that of the others, by source: their own and what the others say."""
    best, told = joined.best, joined.tests()
    if len(best.fits) < FEWEST:
        return {}
    shared = [float(p.scale[p.friction or 0] @ best.solution.point + p.offset[p.friction or 0]) for p in best.places]
    of_all = [f.coordinates[p.friction or 0].value(at) for f, p, at in zip(best.fits, best.places, shared, strict=True)]
    own = [told[cycle.source].friction for cycle in best.cycles]
    gap = np.array([math.log((e.value or 1.0) / value) for e, value in zip(own, of_all, strict=True)])
    error = np.array([(e.u or 0.0) / (e.value or 1.0) for e in own])
    width = 1.4826 * float(np.median(np.abs(gap - np.median(gap))))
    limit = OUTLIER * np.sqrt(error**2 + max(width, SLIGHT) ** 2)
    far = np.abs(gap - np.median(gap)) > limit
    return {
        cycle.source: (float(e.value or math.nan), value)
        for cycle, e, value, is_far in zip(best.cycles, own, of_all, far, strict=True)
        if is_far
    }


def fit_of(fit: FrictionFit, material: Material, known: Known) -> FrictionFit:
    """The friction of a group as its material's tests tell it together, in the place of that by two numbers."""
    joined, group = material.joined, (fit.material, fit.normal_force_n)
    best = joined.best
    if group not in best.shared.groups:
        return fit
    k = best.shared.groups.index(group)
    told = joined.tests()
    mine = [cycle for cycle in best.cycles if cycle.group == group]
    scale = best.shared.amplitude / float(np.mean([cycle.amplitude for cycle in mine]))
    ratio = joined.friction(k).scaled(scale)
    if ratio.value is None:
        return fit
    verdicts = tuple(_verdict(v, material, told, ratio.value, mine) for v in fit.verdicts)
    used = [v.trial for v in verdicts if v.excluded is None]
    reach = reach_of(ratio, joined.freedom)
    force, coefficient = in_newtons(_with_base(ratio, used), used, known, fit.normal_force_n)
    square, freedom, p = joined.evenness(group)
    return replace(
        fit,
        verdicts=verdicts,
        ratio=ratio,
        force=force,
        coefficient=coefficient,
        low=ratio.value - reach,
        high=ratio.value + reach,
        freedom=joined.freedom,
        scatter=joined.scatter,
        note=_note(fit, material, verdicts, has_force=force.known),
        shares=joined.shares(k),
        law=material.law.name,
        tests_chi_square=square if freedom else None,
        tests_freedom=freedom,
        tests_p=p,
    )


def _with_base(ratio: Estimate, used: Sequence[Trial]) -> Estimate:
    """The ratio with the error of the base's amplitude, which a force is told by."""
    errors = [v for t in used if isinstance(v := t.row.get("base_amplitude_m_se"), float) and t.base_amplitude_m > 0]
    if not errors or ratio.value is None:
        return ratio
    amplitude = float(np.mean([t.base_amplitude_m for t in used]))
    relative = math.sqrt(math.fsum(e * e for e in errors)) / len(errors) / amplitude
    se, u = (math.hypot(error or 0.0, relative * ratio.value) for error in (ratio.se, ratio.u))
    return Estimate(ratio.value, se, u)


def _verdict(
    verdict: Verdict, material: Material, told: Mapping[str, TestTold], beta: float, mine: Sequence[Cycle]
) -> Verdict:
    """What the joint fit says of one test."""
    trial = verdict.trial
    excluded = _excluded(verdict, material)
    if trial.regime == "stuck" or trial.is_long:
        return replace(verdict, excluded=excluded)
    mean = float(np.mean([cycle.amplitude for cycle in mine]))
    base = next((cycle.family.base for cycle in mine if cycle.source == trial.source), COSINE)
    here = local(material.model, trial.r, beta * mean / trial.base_amplitude_m, base)
    own = told.get(trial.source)
    return replace(
        verdict,
        excluded=excluded,
        alone=verdict.alone if own is None else own.friction,
        predicted=None if here is None else here.here,
        elasticity=float(here.by_beta[0]) * beta / here.here.energy if here is not None and here.here.energy else 0.0,
        misfit=verdict.misfit if own is None else own.misfit,
        nrmse=None if own is None else own.nrmse,
        floor=None if own is None else own.floor,
    )


def _excluded(verdict: Verdict, material: Material) -> LeftOut | None:
    source, best = verdict.trial.source, material.joined.best
    if source in {cycle.source for cycle in best.cycles}:
        return None
    if source in material.out:
        return Cause.UNEXPLAINED.because(*material.out[source])
    if source in material.dear:
        return Cause.DEAR.because()
    if source in best.lost:
        return Cause.NEAR_RESONANCE.because()
    if verdict.excluded is None and verdict.predicted is not None and verdict.predicted.memory >= KEPT:
        return Cause.NOT_UNIQUE.because()
    return verdict.excluded or Cause.NO_CYCLE.because()


def _note(fit: FrictionFit, material: Material, verdicts: Sequence[Verdict], *, has_force: bool) -> str:
    used, tests = sum(v.excluded is None for v in verdicts), sum(not v.trial.is_long for v in verdicts)
    parts = [] if material.joined.freedom else ["one test only: its scatter from test to test is not known"]
    parts += [f"{tests - used} of {tests} tests left out"] if used < tests else []
    parts += [] if has_force else [part for part in fit.note.split("; ") if part.startswith("no force")]
    missed = [v for v in verdicts if v.excluded is None and v.nrmse is not None and v.floor is not None]
    off = sum((v.nrmse or 0.0) > 2.0 * (v.floor or 0.0) for v in missed)
    parts += [f"{material.law.name} does not explain {off} of {len(missed)} cycles to their noise"] if off else []
    parts += [
        f"{told.name} differs from test to test by {told.scatter:.2g} about {told.value.value:.3g}: in its error"
        for told in material.joined.parameters()
        if told.differs
    ]
    return "; ".join(parts)
