"""Many measurements become friction, Amontons' test, ranking and drift of a whole campaign (thesis chapter 4).

- ``trials``: one row of measurements, one `Trial`, failed ones too
- ``prediction``: what the model says of a test, and what tests share in error
- ``friction``: all tests of a material and normal force, one `FrictionFit`
- ``amontons``: is a material's coefficient the same under every force?
- ``drift``: long tests; ``ranking``: which material is best, and how sure that is
- ``reading``: tables of measurements, examples from the recordings; ``output``: the tables as files
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from frictionlab.analysis.measure import measure
from frictionlab.analysis.steadiness import Trend
from frictionlab.arrays import FloatArray
from frictionlab.campaign.amontons import AmontonsTest, amontons
from frictionlab.campaign.drift import Drift, drift_of
from frictionlab.campaign.friction import Cause, FrictionFit, Known, Verdict, fit_group
from frictionlab.campaign.joint_fit import JointFit, fit_of, fit_together, model_under
from frictionlab.campaign.laws import (
    LawEvidence,
    LawParameter,
    Loop,
    is_comparison,
    laws_together,
    loops_of,
    parameters_of,
)
from frictionlab.campaign.left_out import LeftOutTest, left_out
from frictionlab.campaign.prediction import Curve, Model, curve, model_of, prepare
from frictionlab.campaign.ranking import CRITERIA, Rank, rank_all
from frictionlab.campaign.reading import (
    MeasuredResponse,
    elsewhere,
    envelope,
    examples,
    last_cycles,
    read_measurements,
    recording_of,
    recording_path,
)
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
        from frictionlab.campaign.output import friction_row  # noqa: PLC0415 - it imports this class

        return [dict(friction_row(fit)) for fit in self.fits]

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
    first = model.first
    groups = _groups(tests)
    prepare(20 * len(tests) + CURVE_POINTS * len(groups))
    fits = tuple(_fit(groups[group], first, scene) for group in watch(sorted(groups)))
    laws = _laws(fits, comparisons, find_law=find_law)
    joint, unfitted = fit_together(fits, observations, laws, scene.accuracy)
    if joint is not None:
        rows = (joint, {f.material: model_under(joint, f.material, model) for f in fits})
        fits = tuple(_joined(fit, *rows, first, scene) for fit in fits)
    fits = fits if first is model else tuple(_by_two_numbers(fit) for fit in fits)
    materials = sorted({fit.material for fit in fits})
    models = {} if joint is None else {m: model_under(joint, m, model) for m in materials if joint.tests(m)}
    drifts = tuple(
        drift_of(t, _trend(t, scene, folders), models.get(t.group[0], first), fits)
        for t in tests
        if t.is_long and not t.failed
    )
    responses = _responses(tests, folders)
    tested = tuple(amontons(m, [f for f in fits if f.material == m], joint, scene.rig.stiffness) for m in materials)
    return Campaign(
        trials=tests,
        fits=fits,
        amontons=tested,
        ranking=rank_all(fits, drifts, materials),
        drifts=drifts,
        curves=_curves(fits, first, models),
        responses=responses,
        notes=(
            *_notes(tests, fits, drifts, responses, scene),
            *unfitted,
            *(() if joint is None else joint.rig_notes()),
            *_not_opened(tests, folders),
        ),
        model=model,
        scene=scene,
        laws=laws_together({} if joint is None else joint.ladders),
        folders=tuple(folders),
        comparisons={str(row.get("source")): row for row in comparisons},
        joint=joint,
        parameters=() if joint is None else parameters_of(joint, scene),
        loops=() if joint is None else loops_of(joint, scene.rig.stiffness),
        material_laws=() if joint is None else tuple(_material_laws(joint, tested, scene)),
        left_out=() if joint is None else _left_out(joint, tests, fits),
    )


def _left_out(joint: JointFit, tests: Sequence[Trial], fits: Sequence[FrictionFit]) -> tuple[LeftOutTest, ...]:
    """Each test as the law of all others predicts it; one that no fit takes is there with the reason."""
    excluded = {v.trial.source: v.excluded.sentence for fit in fits for v in fit.verdicts if v.excluded}
    found = {test.source: test for test in left_out(joint.posterior)}
    return tuple(
        found.get(t.source)
        or LeftOutTest(t.source, t.material, reason=t.reason or excluded.get(t.source, Cause.NO_CYCLE.sentence))
        for t in tests
    )


def _material_laws(joint: JointFit, tested: Sequence[AmontonsTest], scene: Scene) -> Iterator[MaterialLaw]:
    """The law of each material whose coefficient (or, where Amontons' law fails, force) is known."""
    stiffness, frequency = scene.rig.stiffness, scene.rig.natural_frequency
    for test in tested if stiffness and frequency else ():
        posterior = joint.by_force if test.holds is False else joint.posterior
        law = material_law_of(
            posterior,
            test.material,
            stiffness_n_per_m=stiffness or 0.0,
            natural_frequency_hz=frequency or 0.0,
            lag_s=scene.sensors.lag_s,
        )
        if law is not None:
            yield law


def _not_opened(trials: Sequence[Trial], folders: Sequence[Path]) -> Sequence[str]:
    named = elsewhere(trials, folders)
    return [NOT_OPENED.format(len(named), named[0][:LONGEST_NAME])] if named else []


def _groups(trials: Sequence[Trial]) -> dict[tuple[str, float], list[Trial]]:
    groups: dict[tuple[str, float], list[Trial]] = {}
    for trial in trials:
        if not trial.failed:
            groups.setdefault(trial.group, []).append(trial)
    return groups


def _fit(trials: Sequence[Trial], model: Model, scene: Scene) -> FrictionFit:
    return fit_group(trials, model, scene.rig.stiffness, sources=_sources(trials, scene))


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


def _laws(fits: Sequence[FrictionFit], comparisons: Sequence[Row], *, find_law: bool) -> dict[str, Law | None]:
    """The law of each material that is not the scene's: to be found, or what the ladder of its only test says."""
    if not find_law:
        return {}
    found: dict[str, Law | None] = dict.fromkeys(fit.material for fit in fits)
    climbed = {str(row["source"]): str(row["law"]) for row in comparisons if row.get("laws")}
    for material in found:
        own = [v.trial.source for fit in fits if fit.material == material for v in fit.verdicts]
        laws = {climbed[source] for source in own if source in climbed}
        if len(own) == 1 and laws:
            found[material] = law_of(laws.pop())
    return found


def _joined(fit: FrictionFit, joint: JointFit, models: Mapping[str, Model], model: Model, scene: Scene) -> FrictionFit:
    sources = _sources([v.trial for v in fit.verdicts], scene)
    return fit_of(fit, joint, models[fit.material], Known(model, scene.rig.stiffness, sources))


def _by_two_numbers(fit: FrictionFit) -> FrictionFit:
    """Say of a group without recordings that its friction is another law's than the scene's."""
    return fit if fit.law else replace(fit, note="; ".join(filter(None, (fit.note, PLAIN))))


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


def _curves(fits: Sequence[FrictionFit], model: Model, models: Mapping[str, Model]) -> tuple[Curve, ...]:
    ratios = [v.trial.r for f in fits for v in f.verdicts]
    if not ratios:
        return ()
    known = ((f, f.friction_ratio, models.get(f.material, model)) for f in fits)
    return tuple(
        curve(own, f.material, f.normal_force_n, beta, _grid(min(ratios), max(ratios), own))
        for f, beta, own in known
        if beta is not None
    )


def _grid(low: float, high: float, model: Model) -> FloatArray:
    """Frequency ratios to draw a prediction at: close at the low end, where the number of stops changes fast."""
    half = (CURVE_POINTS if model.is_cheap else DEAR_POINTS) // 2
    return np.unique(np.concatenate([np.geomspace(low, high, half), np.linspace(low, high, half)]))


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
