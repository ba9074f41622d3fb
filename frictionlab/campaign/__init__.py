"""Many measurements become friction, Amontons' test, ranking and drift of a whole campaign (thesis chapter 4).

- ``trials``: one row of measurements, one `Trial`, failed ones too
- ``prediction``: what the model says of a test; a row of measurements as an observation of the inference
- ``joint_fit``: all tests fitted together by the inference
- ``friction``: which tests count; the `FrictionFit` of a material and normal force
- ``laws``: Amontons' law, evidence, loops, each test predicted by all others
- ``ranking``: drift of long tests, and which material is best
- ``files``: tables of measurements in, examples from the recordings
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from frictionlab import schema
from frictionlab.analysis.steadiness import LONG_S
from frictionlab.arrays import FloatArray
from frictionlab.campaign.files import TABLES, elsewhere, law_file, measured_again, recording_path
from frictionlab.campaign.friction import (
    NO_STEADY_CYCLE,
    SLOWEST_HZ,
    FrictionFit,
    Group,
    Reason,
    Setting,
    Verdict,
    friction_of,
    screen,
)
from frictionlab.campaign.joint_fit import JointFit, fit_together
from frictionlab.campaign.laws import AmontonsTest, amontons_of, laws_together, left_out, loops_of, not_predicted
from frictionlab.campaign.prediction import RowObservation, model_of
from frictionlab.campaign.ranking import Drift, Rank, drift_of, rank_all
from frictionlab.campaign.trials import LONGEST_NAME, Trial, in_order
from frictionlab.errors import UsageError
from frictionlab.inference.comparison import ContactForce
from frictionlab.inference.force import ForceObservation
from frictionlab.inference.material_law import MaterialLaw, is_material_law, material_law_of
from frictionlab.inference.observations import CycleObservation, OfCycles
from frictionlab.scene import Scene
from frictionlab.schema import Result
from frictionlab.tables import Row, write_rows
from frictionlab.uncertainty import sources_of

NO_STIFFNESS = (
    "The scene gives no stiffness ([rig] stiffness_n_per_m, or mass and natural frequency): friction ratios are known,"
    " forces and coefficients are not."
)
NO_RECORDINGS = (
    "The recordings are not at hand, or not read: friction rests on energy and amplitude by Coulomb's law: nothing"
    " shows whether this law holds, and no error counts that it may not."
)
NOT_OPENED = (
    "{} tests name recordings outside the folders of their tables and the working folder (such as {}): these are not"
    " opened. If they are yours, start from a folder above them, or copy them beside the table."
)
PLAIN = "by plain Coulomb friction, for rows of measurements do not give the scene's law: no recordings are at hand"
SHARED_ERRORS = (
    "Standard errors (_se) hold the scatter from test to test; combined uncertainties (_u) and 95 % intervals also hold"
    " what all tests share: gain, lag, natural frequency, stiffness, normal force."
)
NO_DRIFT = f"No test lasts {LONG_S:g} s or longer: nothing is said of drift."
ASSUMED = "Assumed, for nobody has declared them in the scene: {}."
OF_TRIAL = ("source", "material", "normal_force_n", "frequency_ratio", "duration_s")
NO_FRAME = (
    "The motion of the contact is given and its force measured, as on a tribometer: no frame answers, so that there is"
    " no frequency ratio, no energy of a loop over a base, no amplitude of a response, no map of stops, no ranking and"
    " no drift. Friction, its coefficient and the law in newtons are those of the measured force; energies of tests"
    " left out are of the loop of force over displacement, over normal force and half the stroke. Combined"
    " uncertainties (_u) and 95 % intervals also hold what all tests share: gain of the load cell, normal force."
)
OF_GIVEN = ("experiment.normal_force_n_u",)  # what a campaign without a frame assumes
Tested = CycleObservation | ForceObservation
Watch = Callable[[Sequence[Any]], Iterable[Any]]


@dataclass(frozen=True)
class Campaign(Result):
    """What a whole campaign says; everything that its tables, figures and report show.

    ``trials``: all tests, failed ones last; ``fits``: one per material and normal force; ``amontons``: one per
    material; ``ranking``: the contract's criteria in order, best first; ``drifts``: one per long test; ``curves``:
    frequency ratios and predicted energies of each setting; ``notes``: sentences about the campaign as a whole;
    ``model``: the scene's, in words; ``folders``: where recordings stand; ``joint``: the fit of all tests together,
    where recordings are at hand.
    """

    trials: tuple[Trial, ...]
    fits: tuple[FrictionFit, ...]
    amontons: tuple[AmontonsTest, ...]
    ranking: tuple[Rank, ...]
    drifts: tuple[Drift, ...]
    curves: Mapping[Setting, tuple[FloatArray, FloatArray]]
    notes: tuple[str, ...]
    model: str
    scene: Scene
    folders: tuple[Path, ...] = ()
    joint: JointFit | None = field(default=None, repr=False)

    @cached_property
    def laws(self) -> tuple[Mapping[str, Any], ...]:
        """The joint evidence of the laws tried, a row per material and law."""
        return () if self.joint is None else laws_together(self.joint.ladders)

    @cached_property
    def loops(self) -> Sequence[tuple[OfCycles, ContactForce]]:
        """Tests of each material, and what their contacts do."""
        return () if self.joint is None else loops_of(self.joint, self.scene.rig.stiffness)

    @cached_property
    def material_laws(self) -> tuple[MaterialLaw, ...]:
        """Each material's law in physical units."""
        joint, scene = self.joint, self.scene
        stiffness, frequency = (None, None) if self.is_given else (scene.rig.stiffness, scene.rig.natural_frequency)
        if joint is None or not (self.is_given or (stiffness and frequency)):
            return ()
        found = []
        for test in self.amontons:
            posterior, known = joint.by_force if test.holds is False else joint.posterior, scene.sensors.lag_s
            law = material_law_of(
                posterior, test.material, stiffness_n_per_m=stiffness, natural_frequency_hz=frequency, lag_s=known
            )
            found += [] if law is None else [law]
        return tuple(found)

    @cached_property
    def left_out(self) -> tuple[Mapping[str, Any], ...]:
        """Each test as the law of all others predicts it, a row per test."""
        if self.joint is None:
            return ()
        found, verdicts = left_out(self.joint.posterior, self.scene.sensors.lag_s), self.verdicts
        for t in self.trials:
            excluded = verdicts[t.source].excluded if t.source in verdicts else None
            reason = t.reason or (excluded or Reason.NO_CYCLE.because()).sentence
            found.setdefault(t.source, not_predicted(t.source, t.material, reason))
        return tuple(found[t.source] for t in self.trials)

    @cached_property
    def tables(self) -> Mapping[str, list[Row]]:
        """The rows of each table, by the name of its file."""
        p = {test.material: test.p for test in self.amontons}
        return {
            "measurements.csv": [_measurement(trial, self.verdicts.get(trial.source)) for trial in self.trials],
            "friction.csv": [schema.FRICTION.row(fit, amontons_p=p[fit.material]) for fit in self.fits],
            "ranking.csv": [schema.RANKING.row(r, tied_with=", ".join(r.tied_with) or None) for r in self.ranking],
            "drift.csv": [schema.DRIFTS.row(d, **{k: getattr(d.trial, k) for k in OF_TRIAL}) for d in self.drifts],
            "laws.csv": list(self.laws),
            "left_out.csv": list(self.left_out),
        }

    def rows(self) -> list[dict[str, object]]:
        """One row for each material and normal force, as in ``friction.csv``."""
        return [dict(row) for row in self.tables["friction.csv"]]

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
    def is_given(self) -> bool:
        """Whether motions were given and forces measured, as on a tribometer."""
        return self.scene.rig.kind == "prescribed"

    @property
    def failures(self) -> tuple[Trial, ...]:
        """The tests without a measurement, or without the facts it takes."""
        return tuple(t for t in self.trials if t.failed)


def evaluate(
    trials: Sequence[Trial],
    scene: Scene,
    *,
    folders: Sequence[Path] = (),
    observations: Mapping[str, Tested] = {},
    find_law: bool = False,
    watch: Watch = iter,
) -> Campaign:
    """Evaluate a campaign: `frictionlab.evaluate`, once files are read.

    ``trials``: one per test, in any order, failed ones too; ``folders``: where recordings are looked for, which give
    the long tests' points and the examples; ``observations``: by source the mean cycle of each test whose recording is
    at hand: these are fitted together on one rig; ``find_law``: find the law that each material's tests require
    together; ``watch``: wraps the materials, then the groups.

    Raises
    ------
    UsageError
        No test at all, or one stands twice.
    """
    if not trials:
        raise UsageError("campaign: expected at least one measurement; got none")
    recorded = bool(observations) or all(trial.failed for trial in trials)  # why they failed is said, not of the law
    tests, model, stiffness = in_order(trials), model_of(scene, recorded=recorded), scene.rig.stiffness
    forces = {t.source: t.normal_force_n for t in tests if t.normal_force_n is not None}
    own: dict[Setting, list[Trial]] = {}
    for trial in tests:
        if not trial.failed:
            own.setdefault(trial.group, []).append(trial)
    groups = {setting: screen(some, model.first, scene) for setting, some in own.items()}
    by_mass = scene.rig.first.stiffness_n_per_m is None and stiffness is not None
    cycles, doubtful = _cycles(groups, observations)
    how: dict[str, Any] = {"accuracy": scene.accuracy, "forces": forces}
    joint, unfitted = fit_together(cycles, find_law=find_law, doubtful=doubtful, by_mass=by_mass, watch=watch, **how)
    joints = {} if joint is None else {setting: joint for setting in groups if joint.tests(*setting)}
    rest = {setting: group for setting, group in groups.items() if setting not in joints}
    by_rows, _ = fit_together(_rows(rest), find_law=False, **how)
    joints |= {} if by_rows is None else {setting: by_rows for setting in rest if by_rows.tests(*setting)}
    fits = list[FrictionFit]()
    for g in watch(sorted(groups)):
        said = "" if model.first is model or joints.get(g) is joint else PLAIN
        fits.append(friction_of(groups[g], joints.get(g), stiffness, said))
    long = [t for t in tests if t.is_long and not t.failed]
    drifts = tuple(drift_of(t, m.trend if (m := measured_again(t, folders, scene)) else None) for t in long)
    ratios = [v.trial.r for fit in fits for v in fit.verdicts]
    span = (min(ratios, default=math.nan), max(ratios, default=math.nan))
    materials = sorted({fit.material for fit in fits})
    found = Campaign(
        trials=tests,
        fits=tuple(fits),
        amontons=tuple(amontons_of(m, [f for f in fits if f.material == m], joints, stiffness) for m in materials),
        ranking=rank_all(fits, drifts, materials),
        drifts=drifts,
        curves={g: joints[g].curve(g, next(iter(rows.values())), *span) for g in joints if (rows := groups[g].rows)},
        notes=(),
        model=model.words,
        scene=scene,
        folders=tuple(folders),
        joint=joint,
    )
    by_rig = () if joint is None else (*joint.test_notes(), *joint.rig_notes(scene))
    named = elsewhere(tests, folders)
    strangers = [NOT_OPENED.format(len(named), named[0][:LONGEST_NAME])] if named else []
    return replace(found, notes=(*_notes(found), *unfitted, *by_rig, *strangers))


def _cycles(
    groups: Mapping[Setting, Group], observations: Mapping[str, Tested]
) -> tuple[dict[str, list[Tested]], set[str]]:
    """The observations of each material that a law can be fitted to, and which of them are doubtful.

    Where a law has many steady states the cycle depends on which of them it is more than on the law. Those of Coulomb's
    law are doubtful, but in a group that has no other tests.
    """
    found: dict[str, list[Tested]] = {}
    doubtful = set[str]()
    for (material, _), group in groups.items():
        out = {source for source, why in group.left_out.items() if why.cause in NO_STEADY_CYCLE}
        here = [t.source for t in group.trials if t.source in observations and t.source not in out]
        unsure = group.not_unique & set(here)
        doubtful |= unsure if len(unsure) < len(here) else set()
        if here:
            found.setdefault(material, []).extend(observations[source] for source in here)
    return found, doubtful


def _rows(groups: Mapping[Setting, Group]) -> dict[str, list[RowObservation]]:
    """The rows of each material that determine its friction."""
    rows: dict[str, list[RowObservation]] = {}
    for (material, _), group in groups.items():
        if own := [group.rows[t.source] for t in group.trials if t.source in group.rows.keys() - group.left_out]:
            rows.setdefault(material, []).extend(own)
    return rows


def _notes(campaign: Campaign) -> list[str]:
    """Sentences about the campaign as a whole."""
    failed, tests = len(campaign.failures), len(campaign.trials)
    left = sum(v.excluded is not None and not v.trial.is_long for v in campaign.verdicts.values())
    assumed = [
        key for key in sources_of(campaign.scene, SLOWEST_HZ).assumed if key in OF_GIVEN or not campaign.is_given
    ]
    alike = ", ".join(m for m in campaign.materials if [*map(str.casefold, campaign.materials)].count(m.casefold()) > 1)
    said: tuple[tuple[object, str], ...] = (
        (alike, f"{alike}: names that differ in capitals only are other materials here; if wrong, write them alike."),
        (failed, f"{failed} of {tests} tests failed; each is listed with its reason."),
        (left, f"{left} short tests are left out of the friction fits; each is listed with its reason."),
        (campaign.is_given, NO_FRAME),
        (campaign.scene.rig.stiffness is None and not campaign.is_given, NO_STIFFNESS),
        (not (campaign.drifts or campaign.is_given), NO_DRIFT),
        (not any(recording_path(t, campaign.folders) for t in campaign.trials if not t.failed), NO_RECORDINGS),
        (not campaign.is_given, SHARED_ERRORS),
        (assumed, ASSUMED.format(", ".join(assumed))),
    )
    return [sentence for holds, sentence in said if holds]


def write_tables(campaign: Campaign, folder: Path) -> tuple[Path, ...]:
    """Write `TABLES`, and the law of each material, ``law_MATERIAL.toml``; laws of an earlier campaign go.

    Raises
    ------
    OutputError
        A file cannot be written.
    """
    for name, table in TABLES.items():
        write_rows(campaign.tables[name], folder / name, table, force=True)
    laws = {law_file(law.material): law for law in campaign.material_laws}
    for old in set(folder.glob("law_*.toml")) - {folder / name for name in laws}:
        if is_material_law(old):
            old.unlink()
    for name, law in laws.items():
        law.write(folder / name)
    return (*(folder / name for name in TABLES), *(folder / name for name in laws))


def _measurement(trial: Trial, verdict: Verdict | None) -> Row:
    """One test, and what the fit says of it."""
    status = "failed" if trial.failed else trial.row.get("status") or "ok"
    own = {"source": trial.source, "status": status, "reason": trial.reason}
    row = {**trial.row, **own}
    if verdict is None:
        return row
    state, excluded = verdict.predicted, verdict.excluded
    return row | {
        "test_friction_ratio": verdict.friction_ratio,
        "test_friction_ratio_se": verdict.friction_ratio_se,
        "test_friction_ratio_u": verdict.alone.u,
        "test_misfit": verdict.misfit,
        f"predicted_{schema.ENERGY}": verdict.seen,
        f"predicted_{schema.AMPLITUDE}": state and state.response_amplitude,
        f"predicted_{schema.STOPS}": state and state.stops_per_cycle,
        "energy_residual": verdict.residual,
        "left_out_of_fit": excluded and excluded.sentence,
        "left_out_code": excluded and excluded.cause.code,
    }
