"""Many measurements become friction, Amontons' test, ranking and drift of a whole campaign (thesis chapter 4).

- ``trials``: one row of measurements, one `Trial`, failed ones too
- ``prediction``: what the model says of a test; a row of measurements as an observation of the inference
- ``friction``: which tests count; the `FrictionFit` of a material and normal force
- ``joint_fit``: all tests fitted together by the inference
- ``laws``: Amontons' law, evidence, parameters and loops; ``left_out``: each test predicted by all others
- ``ranking``: drift of long tests, and which material is best
- ``files``: tables of measurements in, examples from the recordings, tables out
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from frictionlab.analysis.measure import measure
from frictionlab.analysis.steadiness import Trend
from frictionlab.campaign.files import (
    MeasuredResponse,
    elsewhere,
    envelope,
    examples,
    last_cycles,
    read_measurements,
    recording_of,
    recording_path,
    rows_of,
)
from frictionlab.campaign.friction import NO_STEADY_CYCLE, Cause, FrictionFit, Screened, Verdict, screen
from frictionlab.campaign.joint_fit import FAULTS, JointFit, Known, fit_cycles, fit_rows, friction_of
from frictionlab.campaign.laws import (
    AmontonsTest,
    LawEvidence,
    LawParameter,
    Loop,
    amontons_of,
    is_comparison,
    laws_together,
    loops_of,
    parameters_of,
)
from frictionlab.campaign.left_out import LeftOutTest, left_out
from frictionlab.campaign.prediction import Curve, Model, RowObservation, curve, model_of, observe_row
from frictionlab.campaign.ranking import CRITERIA, Drift, Rank, drift_of, rank_all
from frictionlab.campaign.trials import LONG_S, LONGEST_NAME, Trial, in_order, trial_of
from frictionlab.errors import AnalysisError, UsageError
from frictionlab.inference.material_law import MaterialLaw, material_law_of
from frictionlab.inference.observations import CycleObservation
from frictionlab.scene import Scene
from frictionlab.schema import Result
from frictionlab.simulator.laws import Law, law_of
from frictionlab.tables import Row
from frictionlab.uncertainty import Sources, sources_of

__all__ = [
    "CRITERIA",
    "AmontonsTest",
    "Campaign",
    "Curve",
    "Drift",
    "FrictionFit",
    "LawEvidence",
    "LawParameter",
    "LeftOutTest",
    "Loop",
    "MeasuredResponse",
    "Model",
    "Rank",
    "Trial",
    "Verdict",
    "evaluate",
    "is_comparison",
    "read_measurements",
    "recording_path",
    "trial_of",
]

CURVE_POINTS = 160
DEAR_POINTS = 16  # of a law that is integrated step by step
SLOWEST_HZ = 100.0  # sampling rate that is taken where no measurement tells it
NO_STIFFNESS = (
    "The scene gives no stiffness ([rig] stiffness_n_per_m, or mass and natural frequency): friction ratios are known,"
    " forces and coefficients are not."
)
NO_RECORDINGS = "The recordings are not at hand at the measurements' sources: no example responses are drawn."
NOT_OPENED = (
    "{} tests name recordings outside the folders of their tables and the working folder (such as {}): these are not"
    " opened. If they are yours, start from a folder above them, or copy them beside the table."
)
PLAIN = "by plain Coulomb friction, for rows of measurements do not tell the scene's law: no recordings are at hand"
SHARED_ERRORS = (
    "Standard errors (_se) hold the scatter from test to test; combined uncertainties (_u) and 95 % intervals also hold"
    " what all tests share: gain, lag, natural frequency, stiffness, normal force."
)
ASSUMED = "Assumed, for nobody has declared them in the scene: {}."
Setting = tuple[str, float]
"""Material and normal force [N]."""
Watch = Callable[[Sequence[tuple[str, float]]], Iterable[tuple[str, float]]]


@dataclass(frozen=True)
class Campaign(Result):
    """What a whole campaign says; everything that its tables, figures and report show.

    ``trials``: all tests, failed ones last; ``fits``: one per material and normal force; ``amontons``: one per
    material; ``ranking``: the contract's criteria in order, best first; ``drifts``: one per long test; ``curves``: the
    prediction of each fit over frequency; ``responses``: examples, where the recordings are at hand; ``notes``:
    sentences about the campaign as a whole; ``laws``: the joint evidence of the laws tried, one per material and law;
    ``comparisons``: the row of `compare-numeric` by source, where it is given; ``folders``: where recordings stand;
    ``joint``: the fit of all tests together, where recordings are at hand; ``parameters``: of the materials' laws;
    ``loops``: of their contacts; ``material_laws``: each material's law in physical units; ``left_out``: each test as
    the law of all others predicts it.
    """

    trials: tuple[Trial, ...]
    fits: tuple[FrictionFit, ...]
    amontons: tuple[AmontonsTest, ...]
    ranking: tuple[Rank, ...]
    drifts: tuple[Drift, ...]
    curves: tuple[Curve, ...]
    responses: tuple[MeasuredResponse, ...]
    notes: tuple[str, ...]
    model: Model
    scene: Scene
    laws: tuple[LawEvidence, ...] = ()
    comparisons: Mapping[str, Row] = field(default_factory=dict, repr=False)
    folders: tuple[Path, ...] = ()
    joint: JointFit | None = field(default=None, repr=False)
    parameters: tuple[LawParameter, ...] = ()
    loops: tuple[Loop, ...] = ()
    material_laws: tuple[MaterialLaw, ...] = ()
    left_out: tuple[LeftOutTest, ...] = ()

    def rows(self) -> list[dict[str, object]]:
        """One row for each material and normal force, as in ``friction.csv``."""
        return [dict(row) for row in rows_of(self)["friction.csv"]]

    def __repr__(self) -> str:
        tests = f"{len(self.trials)} tests, {len(self.failures)} failed"
        return f"<Campaign: {tests}, {len(self.fits)} fits of {', '.join(self.materials) or 'no material'}>"

    @property
    def materials(self) -> tuple[str, ...]:
        """The materials measured, in alphabetical order."""
        return tuple(sorted({fit.material for fit in self.fits}))

    @property
    def verdicts(self) -> dict[str, Verdict]:
        """What the fits say of each test, by its source."""
        return {v.trial.source: v for fit in self.fits for v in fit.verdicts}

    @property
    def failures(self) -> tuple[Trial, ...]:
        """The tests without a measurement, or without the facts it takes."""
        return tuple(t for t in self.trials if t.failed)


def evaluate(
    trials: Sequence[Trial],
    scene: Scene,
    *,
    folders: Sequence[Path] = (),
    comparisons: Sequence[Row] = (),
    observations: Mapping[str, CycleObservation] = {},
    find_law: bool = False,
    watch: Watch = iter,
) -> Campaign:
    """Evaluate a campaign.

    Parameters
    ----------
    trials : sequence of Trial
        One per test, in any order; failed ones are kept and shown.
    scene : Scene
        ``[rig]`` stiffness turns friction ratios into forces and coefficients; ``[model]`` is what predictions hold.
    folders : sequence of Path
        Where recordings are looked for beside their ``source``: they give the long tests' points and the examples.
    comparisons : sequence of rows
        Of `compare-numeric`: shown beside their tests.
    observations : mapping
        The mean cycle of each test whose recording is at hand, by source: these are fitted together on one rig.
    find_law : bool
        Find the law that each material's tests require together; else it is the scene's.
    watch : callable
        Wraps the sequence of groups to show progress.

    Raises
    ------
    UsageError
        No test at all, or one stands twice.
    """
    if not trials:
        raise UsageError("campaign: expected at least one measurement; got none")
    tests = in_order(trials)
    model = model_of(scene, recorded=bool(observations))
    groups: dict[Setting, list[Trial]] = {}
    for trial in tests:
        if not trial.failed:
            groups.setdefault(trial.group, []).append(trial)
    screened = {group: screen(own, model.first) for group, own in groups.items()}
    laws = _laws(groups, comparisons) if find_law else {}
    joint, unfitted = fit_cycles(_cycles(groups, screened, observations), laws, scene.accuracy)
    joints = {} if joint is None else {group: joint for group in groups if joint.tests(*group)}
    joints |= _by_rows({g: own for g, own in groups.items() if g not in joints}, screened, model.first, scene)
    models = {g: joints[g].model(g[0], model) if g in joints else model.first for g in groups}
    fits = tuple(
        friction_of(
            groups[g],
            screened[g],
            joints.get(g),
            Known(models[g], scene.rig.stiffness, _sources(groups[g], scene)),
            said="" if model.first is model or joints.get(g) is joint else PLAIN,
        )
        for g in watch(sorted(groups))
    )
    drifts = tuple(
        drift_of(t, _trend(t, scene, folders), models[t.group], fits) for t in tests if t.is_long and not t.failed
    )
    responses = _responses(tests, folders)
    materials = sorted({fit.material for fit in fits})
    tested = tuple(amontons_of(m, [f for f in fits if f.material == m], joints, scene.rig.stiffness) for m in materials)
    found = Campaign(
        trials=tests,
        fits=fits,
        amontons=tested,
        ranking=rank_all(fits, drifts, materials),
        drifts=drifts,
        curves=_curves(fits, models),
        responses=responses,
        notes=(
            *_notes(tests, fits, drifts, responses, scene),
            *unfitted,
            *(() if joint is None else joint.rig_notes()),
            *_not_opened(tests, folders),
        ),
        model=model,
        scene=scene,
        folders=tuple(folders),
        comparisons={str(row.get("source")): row for row in comparisons},
    )
    return found if joint is None else _with_laws(found, joint)


def _cycles(
    groups: Mapping[Setting, Sequence[Trial]],
    screened: Mapping[Setting, Screened],
    observations: Mapping[str, CycleObservation],
) -> dict[str, list[CycleObservation]]:
    """The observations of each material that a law can be fitted to.

    Where Coulomb's law has many steady states the cycle depends on which of them it is more than on the law; it counts
    only in a group that has no other tests.
    """
    found: dict[str, list[CycleObservation]] = {}
    for group, trials in groups.items():
        known = screened[group]
        out = {source for source, why in known.left_out.items() if why.cause in NO_STEADY_CYCLE}
        here = [t.source for t in trials if t.source in observations and t.source not in out]
        here = [source for source in here if source not in known.not_unique] or here
        if here:
            found.setdefault(group[0], []).extend(observations[source] for source in here)
    return found


def _by_rows(
    groups: Mapping[Setting, Sequence[Trial]], screened: Mapping[Setting, Screened], model: Model, scene: Scene
) -> dict[Setting, JointFit]:
    """The fit of each material by its rows, by group; none of a material that has no steady state in all its tests."""
    rows: dict[str, list[RowObservation]] = {}
    for group, trials in groups.items():
        known, sources = screened[group], _sources(trials, scene)
        rows.setdefault(group[0], []).extend(
            observe_row(t, model, sources, known.betas[t.source], known.units[t.source])
            for t in trials
            if t.source not in known.left_out
        )
    found: dict[str, JointFit] = {}
    for material, own in rows.items():
        with suppress(*FAULTS):
            if own:
                found[material] = fit_rows(own)
    return {g: found[g[0]] for g in groups if g[0] in found and found[g[0]].tests(*g)}


def _with_laws(campaign: Campaign, joint: JointFit) -> Campaign:
    """The campaign with what the mean cycles say of each material's law."""
    stiffness, frequency = campaign.scene.rig.stiffness, campaign.scene.rig.natural_frequency
    laws = []
    for test in campaign.amontons if stiffness and frequency else ():
        law = material_law_of(
            joint.by_force if test.holds is False else joint.posterior,
            test.material,
            stiffness_n_per_m=stiffness or 0.0,
            natural_frequency_hz=frequency or 0.0,
            lag_s=campaign.scene.sensors.lag_s,
        )
        laws += [] if law is None else [law]
    verdicts = campaign.verdicts
    found = {test.source: test for test in left_out(joint.posterior)}
    for t in campaign.trials:
        excluded = verdicts[t.source].excluded if t.source in verdicts else None
        reason = t.reason or (excluded or Cause.NO_CYCLE).sentence
        found.setdefault(t.source, LeftOutTest(t.source, t.material, reason=reason))
    return replace(
        campaign,
        joint=joint,
        laws=laws_together(joint.ladders),
        parameters=parameters_of(joint, campaign.scene),
        loops=loops_of(joint, stiffness),
        material_laws=tuple(laws),
        left_out=tuple(found[t.source] for t in campaign.trials),
    )


def _not_opened(trials: Sequence[Trial], folders: Sequence[Path]) -> Sequence[str]:
    named = elsewhere(trials, folders)
    return [NOT_OPENED.format(len(named), named[0][:LONGEST_NAME])] if named else []


def _sources(trials: Sequence[Trial], scene: Scene) -> Sources:
    """What sensors, clock and rig may do to the tests of one group."""
    rates = [rate for t in trials if isinstance(rate := t.row.get("sampling_rate_hz"), (int, float)) and rate > 0]
    return sources_of(scene, min(rates, default=SLOWEST_HZ), normal_force_n=trials[0].group[1])


def _trend(trial: Trial, scene: Scene, folders: Sequence[Path]) -> Trend | None:
    """The trend behind a long test's slope, measured again if its file did not hold it; None if unknown."""
    recording = recording_of(trial, folders) if trial.trend is None else None
    if recording is None:
        return trial.trend
    try:
        return measure(recording, scene).trend
    except AnalysisError:
        return None


def _laws(groups: Mapping[Setting, Sequence[Trial]], comparisons: Sequence[Row]) -> dict[str, Law | None]:
    """The law of each material: to be found, or what the ladder of its only test says."""
    climbed = {str(row["source"]): str(row["law"]) for row in comparisons if row.get("laws")}
    found: dict[str, Law | None] = {}
    for material in {group[0] for group in groups}:
        own = [trial.source for group, trials in groups.items() if group[0] == material for trial in trials]
        found[material] = law_of(climbed[own[0]]) if len(own) == 1 and own[0] in climbed else None
    return found


def _responses(trials: Sequence[Trial], folders: Sequence[Path]) -> tuple[MeasuredResponse, ...]:
    found = []
    for label, trial in examples(trials):
        recording = recording_of(trial, folders)
        if recording is not None:
            found.append(last_cycles(trial, recording, label))
    for trial in trials:
        recording = recording_of(trial, folders) if trial.is_long and not trial.failed else None
        if recording is not None:
            found += [envelope(trial, recording), last_cycles(trial, recording, "end of long")]
    return tuple(found)


def _curves(fits: Sequence[FrictionFit], models: Mapping[Setting, Model]) -> tuple[Curve, ...]:
    """Each fit's prediction over frequency: close at the low end, where the number of stops changes fast."""
    ratios = [v.trial.r for f in fits for v in f.verdicts]
    found = []
    for f in fits:
        if f.friction_ratio is not None:
            model = models[f.material, f.normal_force_n]
            low, high, half = min(ratios), max(ratios), (CURVE_POINTS if model.law.is_exact else DEAR_POINTS) // 2
            grid = np.unique(np.concatenate([np.geomspace(low, high, half), np.linspace(low, high, half)]))
            found.append(curve(model, f.material, f.normal_force_n, f.friction_ratio, grid))
    return tuple(found)


def _notes(
    trials: Sequence[Trial],
    fits: Sequence[FrictionFit],
    drifts: Sequence[Drift],
    responses: Sequence[MeasuredResponse],
    scene: Scene,
) -> tuple[str, ...]:
    failed = sum(t.failed for t in trials)
    left = sum(v.excluded is not None and not v.trial.is_long for f in fits for v in f.verdicts)
    assumed = sources_of(scene, SLOWEST_HZ).assumed
    said: tuple[tuple[object, str], ...] = (
        (failed, f"{failed} of {len(trials)} tests failed; each is listed with its reason."),
        (left, f"{left} short tests are left out of the friction fits; each is listed with its reason."),
        (scene.rig.stiffness is None, NO_STIFFNESS),
        (not drifts, f"No test lasts {LONG_S:g} s or longer: nothing is said of drift."),
        (not responses, NO_RECORDINGS),
        (True, SHARED_ERRORS),
        (assumed, ASSUMED.format(", ".join(assumed))),
    )
    return tuple(sentence for holds, sentence in said if holds)
