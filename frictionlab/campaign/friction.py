"""Friction of one material under one normal force: which tests count, what each says, and what the joint fit gives.

A test is left out by what its row says, by the memory that its law has of how a motion began, or because its own
friction stands out of the joint fit.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import NamedTuple

import numpy as np
from scipy.special import stdtr

from frictionlab.campaign.joint_fit import KEPT, JointFit
from frictionlab.campaign.prediction import STEP, Model, RowObservation, fundamental, loop_ratio, observe_row
from frictionlab.campaign.trials import UNKNOWN_ERROR, Trial, short_name
from frictionlab.errors import DOUBTED
from frictionlab.inference.comparison import loop_energy
from frictionlab.inference.force import ForceObservation
from frictionlab.inference.observation import NO_MOTION
from frictionlab.inference.observations import CycleObservation
from frictionlab.inference.posterior import EXPLAINED, infer
from frictionlab.inference.verdict import unlike_contacts
from frictionlab.scene import Scene
from frictionlab.simulator import COSINE, SteadyState
from frictionlab.uncertainty import NOT_KNOWN, Estimate, Flat, FrictionNames, Sources, sources_of, unit_uncertainty

UNSTEADY = 0.2  # excess irregularity above which one steady state cannot stand for the test
ASYMMETRIC = 0.1  # asymmetry above which a symmetric law cannot stand for the test
NOTHING = 1e-9  # energy or amplitude below which the mass does not move
UNSETTLED = 0.01  # what may be left of the transient, by Coulomb's own memory
SLOWEST_HZ = 100.0  # sampling rate that is taken where no measurement says it
FEWEST_BESIDE, OUTLYING, LEAST_OFF = 5, 0.01, 0.02  # tests, chance and relative size from which one stands out
FEW = 3  # tests more than one, below which they hardly show how friction scatters
Setting = tuple[str, float]
"""Material and normal force [N]."""
SHARED = ("gain", "lag_s", "crosstalk", "natural_frequency")  # what all tests of all materials share


class Reason(Enum):
    """Why a test is left out, in words; its name is the code in ``measurements.csv``."""

    UNIT = "its unit looks wrong; see its warnings"
    LONG = "a long test: in drift.csv"
    STUCK = "stuck: all it shows is that the friction ratio is 1 / (static over kinetic friction) or more"
    UNSTEADY = "unsteady: irregularity {:.2g} beyond noise and base; one steady state cannot stand for it"
    ASYMMETRIC = "asymmetric ({:.2g}): Coulomb's law on a symmetric contact cannot explain it"
    NEAR_RESONANCE = "near resonance: by Coulomb's law the response grows without bound"
    UNSETTLED = "unsettled: by Coulomb's own reckoning {:.0%} of the transient is left where it was measured"
    UNEXPLAINED = "unexplained: alone it would say {:.3g} where the group says {:.3g}"
    NO_CYCLE = "no recording at hand, or no cycle in it that a law can be fitted to"
    NOT_UNIQUE = "not unique: by its law the motion keeps the asymmetry it began with: no one cycle stands for it"
    NO_PREDICTION = "no prediction: no steady state of the law explains these tests"

    @property
    def code(self) -> str:
        """What stands in a table."""
        return self.name.lower().replace("_", " ")

    def because(self, *numbers: float) -> "LeftOut":
        """The cause for one test, with its numbers in the sentence."""
        return LeftOut(self, self.value.format(*numbers))


SOFT = frozenset({Reason.UNSTEADY, Reason.ASYMMETRIC, Reason.UNSETTLED})
"""Such a test is left out for what it is like, and could still say something where there is no other."""
TRANSIENT = frozenset({Reason.UNSETTLED, Reason.NEAR_RESONANCE})
"""A transient still decays: that is the frame's doing, not the material's."""
NO_STEADY_CYCLE = frozenset({Reason.LONG, Reason.STUCK, Reason.UNSTEADY, Reason.UNSETTLED, Reason.UNIT})
"""Such a test has no steady cycle that a law could be fitted to."""
BADLY_EXPLAINED = "rests on tests that Coulomb's law explains badly, for there are no others"


class LeftOut(NamedTuple):
    """One test left out: the ``cause`` to compare, the ``sentence`` to read, with this test's numbers."""

    cause: Reason
    sentence: str

    def __str__(self) -> str:
        return self.sentence


@dataclass(frozen=True)
class Verdict:
    """What the fit says of one test.

    ``alone``: the friction ratio of this test (scatter from test to test not included in its error); ``predicted``: by
    the group's friction; ``seen``: its energy as the sensors show it, with the lag found; ``residual``: measured energy
    over that, less 1; ``by_lag``: part of the measured energy that is due to the lag found; ``excluded``: why it is
    left out, or None; ``elasticity``: relative change of the energy over that of the friction ratio; ``misfit``: root
    of chi-square per number fitted; ``nrmse``, ``floor``: of its cycle, and what noise alone leaves of it, where that
    was fitted.
    """

    trial: Trial
    excluded: LeftOut | None
    alone: Estimate = NOT_KNOWN
    predicted: SteadyState | None = None
    seen: float | None = None
    by_lag: float = 0.0
    elasticity: float = 0.0
    misfit: float | None = None
    nrmse: float | None = None
    floor: float | None = None

    friction_ratio = Flat("alone")
    friction_ratio_se = Flat("alone", "se")

    @property
    def is_misread(self) -> bool:
        """Whether its unit is doubted: then its numbers belong to no mean."""
        return self.excluded is not None and self.excluded.cause is Reason.UNIT

    @property
    def residual(self) -> float | None:
        """Measured over predicted energy - 1."""
        return self.trial.mean[0] / self.seen - 1 if self.seen and math.isfinite(self.trial.mean[0]) else None

    @property
    def energy(self) -> Estimate:
        """Measured energy (k Y^2) as it is at the lag found, to be held against ``predicted``."""
        energy = self.trial.energy
        return energy if energy.value is None else replace(energy, value=energy.value - self.by_lag)


@dataclass(frozen=True)
class FrictionFit(FrictionNames):
    """Friction of one material under one normal force; ``None`` is not known, and ``note`` says why.

    ``friction`` (beta), ``force`` = beta k Y in N, ``coefficient`` = force / normal force are estimates, with the
    contract's columns as flat names; ``scatter``: relative standard deviation from test to test beyond measurement
    error, ``scatter_counted``: as errors count it; ``shares``: relative uncertainty of the ratio by each source that
    all tests share; ``normal_force_u``: relative. ``law``: that its cycles were fitted with, None where it rests on
    energies and amplitudes.
    """

    material: str
    normal_force_n: float
    verdicts: tuple[Verdict, ...]
    friction: Estimate = NOT_KNOWN
    force: Estimate = NOT_KNOWN
    coefficient: Estimate = NOT_KNOWN
    scatter: float | None = None
    scatter_counted: float | None = None
    note: str = ""
    shares: Mapping[str, float] = field(default_factory=dict)
    normal_force_u: float = 0.0
    law: str | None = None

    friction_ratio = Flat("friction")
    friction_coefficient_low, friction_coefficient_high = Flat("coefficient", "low"), Flat("coefficient", "high")

    @property
    def friction_ratio_scatter(self) -> float | None:
        """Standard deviation of the friction ratio from test to test, as ``law_MATERIAL.toml`` counts a scatter."""
        return self.friction.scaled(self.scatter).value

    @property
    def friction_coefficient_scatter(self) -> float | None:
        """Standard deviation of the coefficient from test to test."""
        return self.coefficient.scaled(self.scatter).value

    @property
    def setting(self) -> Setting:
        """Material and normal force, N."""
        return self.material, self.normal_force_n

    @property
    def used(self) -> tuple[Verdict, ...]:
        """The tests that the fit rests on."""
        return tuple(v for v in self.verdicts if v.excluded is None)

    @property
    def tests_used(self) -> int:
        """How many these are."""
        return len(self.used)

    @property
    def tests(self) -> int:
        """How many short tests there are, or long ones where there are no others."""
        return sum(not v.trial.is_long for v in self.verdicts) or len(self.verdicts)


@dataclass(frozen=True)
class Group:
    """The tests of one material under one normal force, none failed, and what is known of them before any fit.

    ``sources``: what is not known of sensors, rig and normal force. By source of a test: ``left_out``: why some say
    nothing of one friction ratio; ``rows``: their rows as observations, under a model whose friction ratio is that of
    the group's loops; Y is the mean one where a row does not say it; ``not_unique``: those with many motions by
    Coulomb's law. ``note``: what a reader must know.
    """

    trials: Sequence[Trial]
    sources: Sources
    left_out: Mapping[str, LeftOut]
    rows: Mapping[str, RowObservation] = field(default_factory=dict)
    not_unique: frozenset[str] = frozenset()
    note: str = ""


def screen(trials: Sequence[Trial], model: Model, scene: Scene) -> Group:
    """Say which tests of one material and normal force show its friction, by their rows and by a model's own memory.

    Where no other is left, tests that are left out for what they are like serve, and the note says so.
    """
    rates = [rate for t in trials if isinstance(rate := t.row.get("sampling_rate_hz"), (int, float)) and rate > 0]
    sources = sources_of(scene, min(rates, default=SLOWEST_HZ), normal_force_n=trials[0].group[1])
    short = any(not t.is_long for t in trials)
    out = {t.source: why for t in trials if (why := _by_its_row(t, leave_long=short)) is not None}
    soft = {source for source, why in out.items() if why.cause in SOFT}
    moving = [t for t in trials if not t.is_given and (t.source not in out or t.source in soft)]
    if not moving:
        return Group(trials, sources, out)
    amplitudes = np.array([t.base_amplitude_m for t in trials])
    mean = float(np.nanmean(amplitudes)) if np.isfinite(amplitudes).any() else 1.0
    units = {t.source: t.base_amplitude_m if math.isfinite(t.base_amplitude_m) else mean for t in trials}
    steady = [t for t in moving if t.source not in soft] or moving
    force = float(np.median([loop_ratio(t, model.wall) * units[t.source] for t in steady]))  # shared: beta = F / (k Y)
    still = {source for source, why in out.items() if why.cause in (Reason.LONG, Reason.STUCK)}
    shown = [t for t in trials if t.source not in still and min(t.mean) > NOTHING]
    rows = {t.source: observe_row(t, model, sources, force / (y := units[t.source]), y) for t in shown}
    not_unique = set()
    for trial in moving:
        row = rows[trial.source]
        state = row.state({"beta": row.guess or 0.0})
        if state is None or state.energy_per_cycle is None:
            out[trial.source] = Reason.NEAR_RESONANCE.because()
            continue
        not_unique |= {trial.source} if state.memory >= KEPT else set()
        if state.memory**trial.cycles_before > UNSETTLED and trial.settled_s is None:
            out.setdefault(trial.source, Reason.UNSETTLED.because(state.memory**trial.cycles_before))
    kept = {source: why for source, why in out.items() if why.cause not in SOFT}
    alone = len(kept) < len(out) == len(trials)
    note = BADLY_EXPLAINED if alone else ""
    return Group(trials, sources, kept if alone else out, rows, frozenset(not_unique), note)


def _by_its_row(trial: Trial, *, leave_long: bool) -> LeftOut | None:
    """Why a test says nothing of one friction ratio, by what its measurement says."""
    if any(DOUBTED in said for said in trial.warnings):
        return Reason.UNIT.because()
    if trial.is_given:
        return None
    if trial.is_long and leave_long:
        return Reason.LONG.because()
    if trial.regime == "stuck" or not min(trial.mean) > NOTHING:
        return Reason.STUCK.because()
    excess = trial.excess_irregularity
    if excess is not None and excess > UNSTEADY:
        return Reason.UNSTEADY.because(excess)
    return Reason.ASYMMETRIC.because(trial.asymmetry) if trial.asymmetry > ASYMMETRIC else None


def friction_of(group: Group, joint: JointFit | None, stiffness: float | None, said: str = "") -> FrictionFit:
    """Return the friction of a group and of each test by the joint fit of its material (None: nothing could be fitted).

    ``stiffness``: N/m; ``said``: what else a reader must know.
    """
    trials, sources = group.trials, group.sources
    material, force = trials[0].group
    tests = [] if joint is None else joint.tests(material, force)
    ratio = NOT_KNOWN if joint is None or not tests else joint.friction(material, force)
    if joint is None or ratio.value is None:
        other = (Reason.NO_CYCLE if trials[0].is_given else Reason.NO_PREDICTION).because()
        verdicts = tuple(Verdict(t, group.left_out.get(t.source, other)) for t in trials)
        kinds = sorted({v.excluded.cause.code for v in verdicts if v.excluded is not None})
        note = f"no friction ratio: every test was left out ({', '.join(kinds)})"
        return FrictionFit(material, force, verdicts, note=note)
    verdicts = tuple(_verdict(t, group, joint) for t in trials)
    posterior, freedom = joint.posterior, len(joint.tests(material)) - 1
    first, by_rig, of_normal = posterior.observations[tests[0]], 0.0, sources.normal_force
    if is_given := isinstance(first, ForceObservation):  # by the load cell, over the normal force
        of_normal = first.normal_force_u
        coefficient, newtons = ratio.widened(of_normal), ratio.scaled(force)
    else:
        amplitudes = [y for v in verdicts if v.excluded is None and math.isfinite(y := v.trial.base_amplitude_m)]
        by_rig = math.hypot(sources.stiffness, unit_uncertainty(sources))
        newtons = ratio.scaled(stiffness).scaled(float(np.mean(amplitudes)) if amplitudes else None)
        coefficient = newtons.over(force).widened(math.hypot(by_rig, of_normal))
    k, law = posterior.fit.find("beta", tests[0]) or 0, posterior.law(tests[0]).name
    own = _notes(verdicts, group.note, law, freedom, has_stiffness=is_given or stiffness is not None)
    return FrictionFit(
        material=material,
        normal_force_n=force,
        verdicts=verdicts,
        friction=ratio,
        force=newtons.widened(by_rig),
        coefficient=coefficient,
        scatter=float(posterior.fit.model.scatter[k]) * posterior.relative(k) if freedom else None,
        scatter_counted=float(posterior.scatter[k]) * posterior.relative(k) if freedom else None,
        note="; ".join(filter(None, (*own, *unlike_contacts(coefficient, force), said))),
        shares={n: share / ratio.value for n, share in posterior.shares("beta", tests[0]).items() if n in SHARED},
        normal_force_u=of_normal,
        law=None if joint.of_rows else law,
    )


def _verdict(trial: Trial, group: Group, joint: JointFit) -> Verdict:
    """What the joint fit says of one test."""
    source, i, posterior = trial.source, joint.place.get(trial.source), joint.posterior
    excluded, row = None, group.rows.get(source)
    if source in joint.out:
        excluded = Reason.UNEXPLAINED.because(*joint.out[source])
    elif i is None:
        other = Reason.NOT_UNIQUE if source in group.not_unique else Reason.NO_CYCLE
        excluded = group.left_out.get(source)
        if excluded is None or (not joint.of_rows and excluded.cause not in NO_STEADY_CYCLE):
            excluded = other.because()  # a law for cycles may be asymmetric
    found = Verdict(trial, excluded) if row is None else _predicted(trial, excluded, row, joint)
    if i is not None:
        observation, residual = posterior.observations[i], posterior.fit.residuals[i]
        return replace(
            found,
            alone=posterior.parameters(i)["beta"],
            misfit=math.sqrt(observation.chi_square(residual) / len(residual)),
            nrmse=None if joint.of_rows else observation.nrmse(residual),
            floor=None if joint.of_rows else observation.floor,
        )
    if row is not None:
        with suppress(*NO_MOTION):
            return replace(found, alone=infer([row]).parameters()["beta"])
    return found


def _predicted(trial: Trial, excluded: LeftOut | None, row: RowObservation, joint: JointFit) -> Verdict:
    """What the group's friction says of a test, in the fit or not."""
    i = joint.place.get(trial.source)
    seen_as = None if i is None else joint.posterior.observations[i]
    cycle = seen_as if isinstance(seen_as, CycleObservation) else None
    low, state, high = joint.states(trial.group, cycle or row, (1.0 - STEP, 1.0, 1.0 + STEP))
    seen = here = None if state is None else state.energy_per_cycle
    late, by_lag, steep = 2.0 * math.pi * trial.drive_frequency_hz * joint.lag_s(i), 0.0, 0.0
    if cycle is not None and i is not None:
        by_lag = cycle.energy_by_lag(late)
        seen = seen if state is None else cycle.shown(state, joint.posterior.values(i))[1]
    elif late and math.isfinite(late):  # a test left out has the lag of all
        by_lag = trial.mean[0] - loop_energy(fundamental(*trial.mean, trial.r), COSINE.lines, -late)
        if state is not None and seen is not None:
            seen = loop_energy(fundamental(seen, state.response_amplitude or 0.0, trial.r), COSINE.lines, late)
    if here and low is not None and high is not None:
        steep = ((high.energy_per_cycle or 0.0) - (low.energy_per_cycle or 0.0)) / (2.0 * STEP * here)
    return Verdict(trial, excluded, predicted=state, seen=seen, by_lag=by_lag, elasticity=steep)


def _notes(verdicts: Sequence[Verdict], screened: str, law: str, freedom: int, *, has_stiffness: bool) -> Iterator[str]:
    """What a reader must know of a group."""
    used, tests = [v for v in verdicts if v.excluded is None], sum(not v.trial.is_long for v in verdicts)
    missed = [v for v in used if v.nrmse is not None and v.floor is not None]
    if screened and not missed:
        yield screened
    if not freedom:
        yield "one test only: its scatter from test to test is not known"
    elif freedom < FEW:
        yield f"{freedom + 1} tests only hardly show how friction scatters from test to test: ± is wide for it"
    if len(used) < tests:
        yield f"{tests - len(used)} of {tests} tests left out"
    if misread := [short_name(v.trial.source) for v in verdicts if v.is_misread]:
        yield f"left out of all means, for {DOUBTED}: {', '.join(misread)}"
    silent = sum(v.trial.energy.se is None or v.trial.amplitude.se is None for v in used)
    if silent and not missed:
        yield f"{silent} tests give no standard error: {UNKNOWN_ERROR:.0%} is taken"
    if not has_stiffness:
        yield "no force: the scene gives no stiffness ([rig] stiffness_n_per_m, or mass and natural frequency)"
    elif not any(math.isfinite(v.trial.base_amplitude_m) for v in used):
        yield "no force: no test gives its base amplitude"
    yield from _outliers(used)
    off = sum((v.nrmse or 0.0) > EXPLAINED * (v.floor or 0.0) for v in missed)
    if off:
        which = "its test" if len(missed) == 1 else f"{off} of {len(missed)} tests"
        yield f"{law} leaves more than noise of {which} unexplained"


def _outliers(used: Sequence[Verdict]) -> Iterator[str]:
    """Say which test stands out of the others: residuals over their scatter, by Student's t, as Bonferroni has it."""
    every = [(v, v.alone.value, 1.0 if v.trial.is_given else v.trial.base_amplitude_m) for v in used]
    known = [(v, math.log(ratio * y)) for v, ratio, y in every if ratio and y > 0.0]
    if (n := len(known)) >= FEWEST_BESIDE:
        about = np.array([own for _, own in known]) - np.mean([own for _, own in known])
        share = about**2 / max(float(np.sum(about**2)), 1e-300) * (n / (n - 1.0))
        far = np.sqrt((n - 2.0) * share / np.maximum(1.0 - share, 1e-12))
        for (verdict, _), off, times in zip(known, about * (n / (n - 1.0)), far, strict=True):
            if abs(off) > LEAST_OFF and 2.0 * n * float(stdtr(n - 2.0, -times)) < OUTLYING:
                by = f"{100.0 * math.expm1(off):+.2g} % off the other {n - 1}, {times:.2g} scatters of theirs"
                yield f"{short_name(verdict.trial.source)} stands out: its friction is {by}"
