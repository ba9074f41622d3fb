"""Recording -> friction identified, prediction, difference: what ``compare-numeric`` does, as one story.

What was measured is an observation: the mean cycle of one mass or of several, the whole record, a table over
frequency. `infer` finds the values of a law for any of them, `climb` the law that they require; a single test is a
campaign of one.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, cast

import numpy as np

from frictionlab.analysis.measurement import Measurement, measure
from frictionlab.arrays import FloatArray, shifted
from frictionlab.errors import AnalysisError, UsageError
from frictionlab.inference import verdict as words
from frictionlab.inference.comparison import AtContact, Comparison, ContactForce, Fitted, WholeRecord
from frictionlab.inference.diagnose import OTHER_CAUSE, Diagnosis, against_richer, diagnose, strained_facts
from frictionlab.inference.fit import Model, Test, fit_from, placed
from frictionlab.inference.force import GAIN, ForceObservation, observe_force, with_force
from frictionlab.inference.ladder import Ladder, climb
from frictionlab.inference.material_law import DETUNING, FRAME, MaterialLaw
from frictionlab.inference.observation import Observation
from frictionlab.inference.observations import CycleObservation, OfCycles, law_and_held, observe, refuse_several
from frictionlab.inference.posterior import EXPLAINED, Posterior, explains, infer, model_of, posterior_of
from frictionlab.inference.record import RecordObservation, follow, observe_record
from frictionlab.inference.table import TableObservation, observe_table
from frictionlab.inference.unknowns import STRAINED, STRONGEST, Unknown
from frictionlab.recording import FrequencyTable, Recording
from frictionlab.scene import Scene
from frictionlab.schema import EXPECTED
from frictionlab.simulator import SteadyState
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.record import respond
from frictionlab.uncertainty import FREQUENCY, Estimate

HELD = 1e-9  # standard deviation of what a law was found with
AUTO = "auto"  # the law that the recording requires
PERIODIC, EVEN = 0.1, 0.02  # irregularity of the base, scatter of its cycles' lengths, up to which it has a cycle
NO_ERRORS = (
    "verdict: none, for the table states no error of some numbers (columns amplitude_u, phase_u): errors are those of"
    " the scatter about the law"
)
BAD_TABLE = (
    "verdict: the law leaves {:.0f} % of the table, more than errors of a measurement: are amplitudes half the swing"
    " (no rms, not peak to peak), are units and signs right, and is it this law?"
)
ONE_WAY = (
    "no other law was tried: the contact slides one way at one speed, which shows Coulomb friction alone; over the way"
    " friction varies by up to {:.2g} %"
)
OF_RECORD = "it is the law that the whole record requires, of those that --law auto tried"
NOT_STEADY = "its mean cycle is {:.3g} times its standard error off the steady state, for the motion was not steady"
UNEVEN, OF_UNEVEN = "normal force that varies in the cycle", 0.02  # share of that that is open where it is counted
OVER_TIME, LARGEST = "friction over time", "largest displacement of the base"
OF_CYCLE = "the steady cycle of the record"
MEASURED = ("frequency_ratio", "energy_per_cycle", "response_amplitude", "stops_per_cycle", "regime")
"""What a comparison repeats of its measurement."""


def compare_record(
    recording: Recording,
    scene: Scene,
    *,
    law: str | None = None,
    friction_ratio: float | None = None,
    fit: Fitted = "cycle",
) -> Comparison:
    """Compare a whole recording with the law of its steady cycle, or with a law fitted to all of it (``fit``).

    ``law``, ``friction_ratio``: as in `compare_measurement`. A recording without a steady cycle (a sweep, a start-up)
    can only be fitted whole: what is said of a cycle is None then.

    Raises
    ------
    AnalysisError
        No measurement can be made, the natural frequency is not known, or no values tried have a motion.
    RecordingError
        The record has a gap or jumps.
    UsageError
        The law cannot be, or no spring is driven.
    """
    if scene.rig.kind == "prescribed":
        raise UsageError(
            'the whole record (--whole, --fit whole): needs a base that drives a spring; got rig.kind = "prescribed"'
        )
    refuse_several(scene)
    if lacking := {"mass_displacement", "base_displacement"} - set(recording.measured()):
        raise UsageError(
            "the whole record (--whole, --fit whole): needs displacements, for integrals have no start; the recording"
            f" has no {' and no '.join(sorted(lacking))}: leave it out: the cycle takes velocities and accelerations"
        )
    measurement, why = _steady(recording, scene, fit)
    if measurement is None:
        return _without_cycle(recording, scene, why, law, friction_ratio)
    found, ladder = identified(measurement, scene, law, friction_ratio)
    cycle, climbed = found.observations[0], None
    observation, said = observe_record(recording, scene, cycle.law, cycle.held, measurement)
    if fit == "whole":
        best, climbed = _found(observation, scene, law, None, near=found.values())
        record = follow(cast("RecordObservation", best.tests[0].observation), best.values(), fits_start=False)
        whole = _of_whole(best.with_doubt(OVER_TIME, record.wandering), scene, found)
        step = words.ANOTHER if climbed is None else OF_RECORD
        by_record = compared(measurement, scene, best, None, step, cycle=cycle.under(best.law()), diagnosis=whole)
        laws = _rows(ladder, found, found.fit.nrmse(), explained=explains(found.fit, [0]))
        comparison = replace(by_record, laws=laws, cycle_law=cycle.law.name if law == AUTO else None)
    else:
        comparison = compared(measurement, scene, found, ladder)
        record = follow(observation, found.values() | observation.start, fits_start=True)
    warnings = (*comparison.warnings, *said, *record.warnings, *words.not_tried(climbed))
    return replace(comparison, warnings=warnings, **_of_record(record, climbed))


def compare_measurement(
    measurement: Measurement, scene: Scene, *, law: str | None = None, friction_ratio: float | None = None
) -> Comparison:
    """Identify the contact of a measured test, predict its cycle (or its force), and say how they differ.

    ``law``: in place of the scene's, "auto" climbs the ladder as far as the test requires; ``friction_ratio``: beta
    (2.8) to predict with instead of identifying it. Errors as of `compare_record`.
    """
    if scene.rig.kind == "prescribed":
        return compare_force(measurement, scene, law=law, friction_ratio=friction_ratio)
    try:
        return compared(measurement, scene, *identified(measurement, scene, law, friction_ratio))
    except AnalysisError as error:
        for said in measurement.warnings:  # they may name what is wrong
            error.add_note(said)
        raise


def identified(
    measurement: Measurement, scene: Scene, law: str | None, friction_ratio: float | None = None
) -> tuple[Posterior, Ladder | None]:
    """Return the posterior of a measured test under the law that is given or required, and the ladder if climbed."""
    observation = observe(measurement, scene, None if law == AUTO else law)
    if measurement.cycle.cell is not None:
        observation = with_force(observation, measurement, scene)
    return _found(observation, scene, law, friction_ratio)


def _found(
    observation: Observation,
    scene: Scene,
    law: str | None,
    friction_ratio: float | None,
    near: Mapping[str, float] | None = None,
) -> tuple[Posterior, Ladder | None]:
    """The posterior of any observation, and the ladder if climbed; a law whose values are all given is not fitted."""
    if law == AUTO:
        first = observation if observation.shows_rig else observation.under(law_of("coulomb"))
        ladder = climb([first], accuracy=scene.accuracy, near=near)
        return ladder.posterior, ladder
    if friction_ratio is not None:
        observation = observation.under(observation.law, {**observation.held, "beta": friction_ratio})
    if observation.shows_rig or any(p.name not in observation.held for p in observation.law.own if not p.whole):
        return infer([observation], near=near), None
    model = model_of([observation], rig=False)
    looked = model.look(0, np.zeros(0))  # None: it stands still, or has no steady state
    left = observation.white(observation.data) if looked is None else looked[0]
    return posterior_of(placed(model, np.zeros(0), [left], [np.zeros((len(left), 0))])), None


def judge(measurement: Measurement, scene: Scene, law: MaterialLaw) -> Comparison:
    """Compare a measured test with the law of its material, found elsewhere.

    Fitted are only the values of the law, each held by its error and its scatter from test to test, the natural
    frequency by its error and the scene's, and a lag by what the scene declares of it: the frame's damping and an
    undeclared lag are those that the law was found with. Where the motion is given the force is judged, whatever the
    law was found on, and energy and coefficient that the law alone expects are there with their bands.

    Raises
    ------
    AnalysisError
        By this law the test has no steady state, or no force was measured where the motion is given.
    UsageError
        The test's normal force or frequency ratio is not known, or the law holds for other normal forces only.
    """
    seen: CycleObservation | ForceObservation | None = None
    if scene.rig.kind == "prescribed":
        seen = observe_force(measurement, scene, law.law)
    elif measurement.frequency_ratio is not None:
        seen = replace(observe(measurement, scene, law.law), wall=law.wall)
    if seen is None or (force := seen.normal_force) is None:
        raise UsageError(
            f"{measurement.source}: a law of a material needs the test's normal force and frequency ratio: give"
            " normal_force_n in [experiment] and natural_frequency_hz in [rig] of the scene"
        )
    frame, held = seen.frame, dict[str, float]()
    errors = dict(zip(law.values, np.sqrt(np.diag(law.covariance)).tolist(), strict=True))
    if isinstance(seen, ForceObservation):
        of_rig = seen.rig_unknowns
    else:
        frame["frequency"] = law.natural_frequency_hz * law.values.get(DETUNING, 1.0)
        frame["stiffness"] = law.frame["stiffness_n_per_m"]
        held[FRAME] = law.values.get(FRAME, law.frame.get(FRAME, 0.0))
        of_rig = _rig_by(law, errors, scene, seen)
    apart = {name: value + math.hypot(*law.scatter.get(name, ()), errors[name]) for name, value in law.values.items()}
    middle, moved, own = law.over(law.values, force, frame), law.over(apart, force, frame), list[Unknown]()
    for p in law_of(law.law).own:
        mean, sd = middle[p.name], moved[p.name] - middle[p.name]
        if sd > 0.0:
            low = max(-STRONGEST, (p.low - mean) / sd)
            own.append(Unknown(p.name, p.words, "test", mean=mean, sd=sd, low=low, law=True))
        else:
            held[p.name] = mean
    own += of_rig
    one = Test(seen.under(seen.law, held), np.arange(len(own)), np.ones(len(own)))
    starts = [np.array([start * (u.level == "test") for u in own]) for start in (0.0, 1.0, -1.0)]
    found = posterior_of(fit_from(Model((one,), tuple(own), np.zeros(len(own))), starts))
    if isinstance(seen, ForceObservation):
        judged = replace(forced(measurement, scene, found, None), expected=_expected(law, seen, force))
    else:
        judged = compared(measurement, scene, found, None)
    far = [
        f"{u.name}: {u.value(c):.4g} fits this test, the law says {u.mean:.4g}: {abs(c):.0f} times its error and"
        " scatter: the law does not hold here: is it another material, or another normal force?"
        for u, c in zip(own, found.fit.point.tolist(), strict=True)
        if u.law and abs(c) > STRAINED
    ]
    verdict = "strained" if far and judged.verdict == "explained" else judged.verdict
    if (own_name := measurement.material) not in (None, law.material):
        far.append(f"material: {own_name} by its name, sheet or scene, and the law is that of {law.material}")
    rest = [w for w in judged.warnings if w.partition(f": {words.NOT_DETERMINED}")[0] not in middle]
    return replace(judged, verdict=verdict, warnings=(*far, *rest))


def _rig_by(law: MaterialLaw, errors: Mapping[str, float], scene: Scene, seen: CycleObservation) -> tuple[Unknown, ...]:
    """Natural frequency and lag of a test: as its law was found with them, and as the scene knows them."""
    known, drive = seen.sources, seen.turn / (2.0 * math.pi)
    tuned = law.natural_frequency_hz * law.values.get(DETUNING, 1.0) / (drive / seen.r) - 1.0
    lag = (law.rig.get("lag_s", 0.0) - scene.sensors.lag_s, 0.0) if known.lag_is_assumed else (0.0, known.lag)
    by_both = math.hypot(errors.get(DETUNING, 0.0), 0.0 if FREQUENCY in known.assumed else known.natural_frequency)
    each = (("natural_frequency", tuned, by_both), ("lag_s", *lag))
    return tuple(Unknown(name, name, mean=value, sd=max(HELD, sd)) for name, value, sd in each)


def _expected(law: MaterialLaw, seen: ForceObservation, force: float) -> dict[str, Any]:
    """Energy of the loop (J) and coefficient that a law alone expects of a given motion, by their columns: bands."""
    from frictionlab.inference.predictive import MOST_DRAWS, band_of  # noqa: PLC0415 - for laws found elsewhere alone

    found, joules = list[tuple[float | None, float]](), 2.0 * math.pi * seen.unit_n * seen.unit
    for values in (law.values, *law.draws(MOST_DRAWS)):
        own = law.over(values, force, seen.frame)
        cycle = seen.motion(own)
        work = None if cycle is None else joules * float(np.mean(cycle * shifted(seen.place, order=1)))
        found.append((work, own["beta"] * seen.unit_n / force))
    return {name: band_of(each[0], each[1:]) for name, each in zip(EXPECTED, zip(*found, strict=True), strict=True)}


def compare_table(
    table: FrequencyTable,
    scene: Scene,
    facts: Mapping[str, Any],
    *,
    law: str | None = None,
    friction_ratio: float | None = None,
) -> Comparison:
    """Identify the contact of a table over frequency, predict its rows, and say how they differ.

    What a number's ``_u`` is not stated for is taken from the scatter about the law, and no verdict is given then.
    ``facts`` of the test: ``material``, ``normal_force_n``, ``base_amplitude_m``; law "auto" climbs the exact laws.

    Raises
    ------
    AnalysisError
        Fewer rows than unknowns, or no value tried has a steady state in every row.
    """
    observation = observe_table(table, scene, None if law == AUTO else law, facts)
    count = len(observation.law_unknowns)
    if friction_ratio is None and len(observation.data) <= count:
        raise AnalysisError(
            f"a table over frequency: expected more numbers than the {count} unknowns; got {len(observation.data)}"
        )
    found, ladder = _found(observation, scene, law, friction_ratio)
    observation, values = cast("TableObservation", found.tests[0].observation), found.values()
    state = observation.state(values)  # of the reference
    nrmse = found.fit.nrmse()
    bad = [BAD_TABLE.format(100.0 * nrmse)] * (nrmse > words.FAINT)
    return _judged(
        *(found, scene, ladder, nrmse, [*scene.rig.doubts, *table.said, *found.warnings]),
        after=() if observation.is_stated else (*bad, NO_ERRORS),
        floor=observation.floor if observation.is_stated else None,
        amplitude=Estimate(observation.unit, 0.0) if math.isfinite(observation.unit) else Estimate(),
        model=words.model_words(observation.law, f"{observation.wall} wall", observation.held, "cosine base"),
        solver="exact" if state is None else state.solver,
        closure_error=None if state is None else state.closure_error,
        over_frequency=observation.curve(values),
    )


def compare_force(
    measurement: Measurement, scene: Scene, *, law: str | None = None, friction_ratio: float | None = None
) -> Comparison:
    """Identify a contact whose motion is given, as on a tribometer, from its measured force, and say what is left.

    Numbers are over the normal force (so that the friction ratio is the coefficient; over the measured friction force
    where it is not known), lengths over half the stroke Y, speeds over omega Y.
    """
    if measurement.slides_one_way:  # at one speed, which shows nothing but Coulomb friction
        asked, law = "coulomb" if law == AUTO else law_and_held(scene, law)[0].name, "coulomb"
        if asked != law:
            raise UsageError(f"law: the contact slides one way at one speed, which shows no {asked}: do: --law coulomb")
    found, ladder = _found(observe_force(measurement, scene, None if law == AUTO else law), scene, law, friction_ratio)
    return forced(measurement, scene, found, ladder)


def forced(measurement: Measurement, scene: Scene, found: Posterior, ladder: Ladder | None) -> Comparison:
    """Return the measured force of a given motion over that of a posterior, judged."""
    observation = cast("ForceObservation", found.tests[0].observation)
    contact = contact_of(observation, found.values())
    said = [*measurement.warnings, *observation.said, *found.warnings]
    momentary = "" if observation.pressed is None else "momentary "
    over = "friction" if observation.normal_force is None else f"{momentary}normal"
    stroke = f"Y = {1e3 * observation.unit:.4g} mm" if measurement.force_energy_j.known else "half the stroke"
    unit = f"forces over the {over} force {observation.unit_n:.4g} N, lengths over {stroke}"
    missed, of_law = np.abs(np.array([contact.residual, cast("AtContact", contact.predicted).force], dtype=np.float64))
    varies = 100.0 * float(np.nanmax(missed) / of_law.mean())
    return _judged(
        *(found, scene, ladder, found.fit.nrmse(), said),
        step=ONE_WAY.format(varies) if measurement.slides_one_way else words.ANOTHER,
        floor=observation.floor,
        amplitude=measurement.base_amplitude,
        model=words.model_words(observation.law, "prescribed motion", observation.held, unit),
        solver="prescribed",
        closure_error=None,
        **{key: getattr(measurement, key) for key in MEASURED[2:]},
        at_contact=contact,
        force_energy_per_cycle_j=measurement.force_energy_per_cycle_j,
    )


def compared(
    measurement: Measurement,
    scene: Scene,
    found: Posterior,
    ladder: Ladder | None,
    step: str = words.ANOTHER,
    *,
    cycle: CycleObservation | None = None,
    diagnosis: Diagnosis | None = None,
) -> Comparison:
    """Return a measured cycle over the prediction of a posterior, diagnosed and judged; ``step``: as of `doubts`.

    ``cycle``: the posterior is that of the whole record, whose ``diagnosis`` is known; where it explains that, what the
    mean cycle misses is that it was not steady.
    """
    observation = found.observations[0] if cycle is None else cycle
    state = observation.solved(found.values(), scene.model.solver)
    predicted, energy, amplitude = observation.shown(state, found.values())
    nrmse = None if predicted is None else observation.left(predicted, found.values())
    misfit = None if nrmse is None else nrmse / observation.floor
    first = "" if nrmse is None else words.start_left(observation, state, nrmse)
    explained = misfit is not None and misfit <= EXPLAINED
    unsteady = cycle is not None and misfit is not None and not explained and explains(found.fit, [0])
    diagnosis = diagnosis or diagnose(found, scene, explained=explained)
    found, restless = diagnosis.posterior, words.never_settles(state, measurement.cycles, observation.floor)
    if restless is not None:
        found = found.with_doubt(words.UNSETTLED, 1.0)
    found, uneven = _pressed_unevenly(found, measurement, counted=cycle is None and observation.single)
    contact = contact_of(observation, found.values(), state, scene.rig.stiffness)
    return _judged(
        *(found, scene, ladder, nrmse, [*measurement.warnings, *found.warnings, *diagnosis.said, *state.warnings]),
        after=[
            *(observation.disagreement(found) if cycle is None else ()),
            *uneven,
            *([restless] if restless else []),
            *([f"no prediction: {state.outcome}"] if predicted is None else []),
            *([f"verdict: of the whole record; {NOT_STEADY.format(misfit)}"] if unsteady else []),
        ],
        seen=observation,
        of_record=unsteady,
        step=step,
        first=first,
        floor=observation.floor,
        diagnosis=diagnosis,
        unsettled=restless is not None,
        amplitude=measurement.base_amplitude,
        budget=measurement.budget,
        **{key: getattr(measurement, key) for key in MEASURED},
        model=words.model_words(
            *(observation.law, observation.place_words, observation.held),
            f"{observation.base.harmonics} base harmonics" if observation.base.harmonics > 1 else "cosine base",
        ),
        solver=state.solver,
        closure_error=state.closure_error,
        predicted_energy_per_cycle=energy,
        predicted_response_amplitude=amplitude,
        predicted_stops_per_cycle=state.stops_per_cycle,
        predicted_regime=state.regime,
        energy_difference=None if energy is None else energy / measurement.energy_per_cycle - 1,
        tau=measurement.cycle.tau,
        base=measurement.cycle.base,
        measured=measurement.cycle.mass,
        predicted=predicted,
        at_contact=replace(contact, residual=None if predicted is None else measurement.cycle.mass - predicted),
    )


def _pressed_unevenly(found: Posterior, measurement: Measurement, *, counted: bool) -> tuple[Posterior, list[str]]:
    """The posterior with what a normal force that varies within the cycle leaves open, and what is to be said.

    ``counted``: its momentary value was; then all but its own calibration and the times of turns is known.
    """
    if (each := measurement.cycle.pressed) is None:
        return found, []
    varies = float(np.abs(each.mean(axis=0) / each.mean() - 1.0).max())
    said = (
        f"friction_ratio: the measured normal force varies by up to {100 * varies:.2g} % within the cycle, which only"
        " the fit to the mean cycle of a single mass counts: its error holds so much"
    )
    return found.with_doubt(UNEVEN, varies * (OF_UNEVEN if counted else 1.0)), [] if counted else [said]


def _of_whole(found: Posterior, scene: Scene, cycle: Posterior | None = None) -> Diagnosis:
    """What else may have made a whole record; ``cycle``: the posterior of its steady cycle, where it has one.

    A law that misses the record is held against a richer one. Other causes than the law are tried on the cycle (if that
    is missed alone, it was not steady), and friction is held against the cycle's, if the same law explains it.
    """
    said, strained, causes = list[str](), bool(found.strained), tuple[str, ...]()
    steady, missed = cycle is not None and explains(cycle.fit, [0]), not explains(found.fit, [0])
    if cycle is not None and (steady or missed):
        other = diagnose(cycle, scene, explained=steady)
        own, there, moved = (one.parameters()["beta"] for one in (found, cycle, other.posterior))
        own_u, there_u, moved_u = own.u or 0.0, there.u or 0.0, moved.u or 0.0
        strained, causes = strained or (other.strained and not cycle.strained), other.causes
        found = found.with_doubt(OTHER_CAUSE, math.sqrt(max(moved_u**2 - there_u**2, 0.0)) / (there.value or 1.0))
        same = steady and cycle.law() == found.law()
        if same and abs(there.value - own.value) > math.hypot(own_u, there_u) > 0.0:
            found = found.with_doubt(OF_CYCLE, there.value / own.value - 1.0)
            two = f"{own.value:.4g} by the whole record, {there.value:.4g} by its steady cycle"
            said.append(f"friction_ratio: {two}; its error holds the difference")
    if found.strained or missed:
        found, more = against_richer(found)
        said += more
    return Diagnosis(found, strained, (*said, *strained_facts(found, scene), *causes))


def _judged(
    found: Posterior,
    scene: Scene,
    ladder: Ladder | None,
    nrmse: float | None,
    said: list[str],
    *,
    floor: float | None,
    seen: Observation | None = None,
    diagnosis: Diagnosis | None = None,
    unsettled: bool = False,
    of_record: bool = False,
    after: Sequence[str] = (),
    step: str = words.ANOTHER,
    first: str = "",
    amplitude: Estimate,
    budget: Mapping[str, Mapping[str, float]] | None = None,
    **more: Any,
) -> Comparison:
    """The comparison of an observation that leaves an nrmse over a floor: with its verdict, its doubts, its ladder.

    ``seen``: what is compared, where the fit is to something else; ``said``, ``after``: sentences before the doubts,
    and behind them; ``diagnosis``: of a cycle; without one sensors and rig are doubted where they strain; ``step``: to
    take where no ladder was climbed; ``first``: before any; ``of_record``: the verdict is not that of the cycle, whose
    misfit is said elsewhere; ``amplitude``: Y [m]; ``budget``: what the measurement's own errors come from.
    """
    misfit = None if nrmse is None or floor is None else nrmse / floor
    judged_by, observation = 0.0 if of_record else misfit, found.tests[0].observation
    known = diagnosis or Diagnosis(found, bool(found.strained), tuple(strained_facts(found, scene)))
    verdict = words.verdict_of(judged_by, strained=known.strained, answered=known.answered, unsettled=unsettled)
    moved = known.said if verdict == "strained" and diagnosis is None else ()
    doubted = words.doubts(found, seen or observation, verdict, judged_by, ladder, step=step, first=first)
    friction = words.friction_of(found, scene, amplitude)
    rough = words.unlike_contacts(friction["coefficient"], observation.normal_force)
    parameters = {name: asdict(e) for name, e in found.parameters().items()}
    parameters["beta"] |= {"se": friction["friction"].se, "u": friction["friction"].u}
    return Comparison(
        source=observation.source,
        status="ok",
        reason=None,
        warnings=(*said, *moved, *doubted, *after, *rough),
        law=found.law().name,
        parameters=parameters,
        nuisances=found.nuisances(),
        levels={u.name: u.level for u in found.unknowns},
        budget={**(budget or {}), **friction.pop("budget")},
        accuracy=scene.accuracy,
        assumed=observation.sources.assumed,
        material=observation.material,
        normal_force_n=observation.normal_force,
        response_nrmse=nrmse,
        response_floor=floor,
        misfit=misfit,
        verdict=verdict,
        laws=_rows(ladder, found, nrmse, explained=misfit is None or misfit <= EXPLAINED),
        **friction,
        **more,
    )


def contact_of(
    observation: CycleObservation | ForceObservation,
    values: Mapping[str, float],
    state: SteadyState | None = None,
    stiffness: float | None = None,
) -> ContactForce:
    """Return the contact's force as measured (by the cycle, or its sensor), over that of a law at some values.

    ``state``: the steady state there, of a cycle; ``stiffness`` N/m. AnalysisError where the law has no motion there.
    """
    if isinstance(observation, ForceObservation):
        return _measured_contact(observation, values)
    state = observation.state(values) if state is None else state
    if state is None:
        raise AnalysisError(f"law {observation.law.name}: the values found have no steady state")
    late, tau = observation.gain_and_phase(0.0, values)[1], observation.cycle.tau
    law, unit_n = observation.law_at_contact(state, tau + late), None
    seen = observation.measured_contact(state, late) or AtContact(*np.full((3, len(tau)), math.nan))
    if law is not None:
        seen = seen._replace(force=seen.force + law.force.mean())
        law = law._replace(displacement=law.displacement - law.displacement.mean())
    if stiffness is not None:
        unit_n = stiffness * observation.unit
    return _contact(observation, tau, seen, law, unit_n)


def _measured_contact(observation: ForceObservation, values: Mapping[str, float]) -> ContactForce:
    """A measured force about that of its law: a load cell has no zero, it is fitted about the mean of its parts."""
    force, place = observation.motion(values), observation.place
    if force is None:
        raise AnalysisError(f"force: law {observation.law.name} has none at the values found")
    tau, velocity = 2.0 * np.pi * np.arange(len(place)) / len(place), shifted(place, order=1)
    shown = force * (1.0 + values.get(GAIN, 0.0))
    slides = np.isin(np.arange(len(force)) * observation.count // len(force), observation.parts)
    seen = observation.force - (0.0 if observation.one_way else np.mean((observation.force - shown)[slides]))
    return _contact(
        *(observation, tau, AtContact(place, velocity, seen), AtContact(place, velocity, shown), observation.unit_n),
        residual=np.where(slides, seen - shown, math.nan),
        is_measured=True,
        is_one_way=observation.one_way,
    )


def _contact(
    observation: OfCycles, tau: FloatArray, seen: AtContact, law: AtContact | None, unit_n: float | None, **more: Any
) -> ContactForce:
    """A contact over a cycle, as measured and as its law has it."""
    return ContactForce(
        *(observation.source, observation.law.name, tau, seen, law),
        floor=observation.floor * math.sqrt(observation.power),
        unit_m=observation.unit,
        turn=observation.turn,
        unit_n=unit_n,
        stiffness_u=observation.sources.stiffness,
        **more,
    )


def _rows(
    ladder: Ladder | None, found: Posterior, nrmse: float | None, *, explained: bool = True
) -> tuple[dict[str, Any], ...] | None:
    """The ladder's rows; ``found``, ``nrmse``: of the law chosen, as they are reported.

    Of one that does not explain the test the row has what its best fit leaves, as the others' have: what is reported of
    it holds sensors and rig nearer to what is known of them.
    """
    rows: list[dict[str, Any]] = []
    for rung in () if ladder is None else ladder.rungs:
        chosen = ladder is not None and rung.law.name == ladder.chosen.law.name
        posterior = found if chosen else rung.posterior
        rows.append(
            {
                "law": rung.law.name,
                "parameters": {} if posterior is None else {n: asdict(e) for n, e in posterior.parameters().items()},
                "log_evidence": rung.log_evidence if math.isfinite(rung.log_evidence) else None,
                "response_nrmse": nrmse if chosen and explained else rung.nrmse,
                "held_out_nrmse": rung.held_out_nrmse,
                "required": chosen,
                "seconds": rung.seconds,
                "note": rung.said or None,
            }
        )
    return None if ladder is None else tuple(rows)


def _steady(recording: Recording, scene: Scene, fit: Fitted) -> tuple[Measurement | None, str]:
    """The measured steady cycle of a recording; None, and why, where it has none but its record can be fitted."""
    try:
        measurement = measure(recording, scene)
    except AnalysisError as error:
        if fit == "whole":
            return None, str(error)
        raise AnalysisError(f"{error}; do: --whole --fit whole fits the record itself, which needs no cycle") from error
    index, lengths = measurement.base_irregularity_index, np.diff(measurement.series.time)
    if fit == "cycle":
        return measurement, ""
    if index is not None and index > PERIODIC:
        return None, f"base_irregularity_index: {index:.2g}: no cycle of the base is like the next"
    usual = float(np.median(lengths)) if len(lengths) else np.nan
    scatter = 1.4826 * float(np.median(np.abs(lengths - usual))) / usual if len(lengths) else 0.0
    if scatter > EVEN:
        return None, f"drive_frequency_hz: it changes by {100 * scatter:.2g} % rms from cycle to cycle: a sweep"
    return measurement, ""


def _without_cycle(
    recording: Recording, scene: Scene, why: str, law: str | None, friction_ratio: float | None
) -> Comparison:
    """A whole record without a steady cycle over its prediction.

    Lengths are over the largest displacement Y of the base from its first value, forces over k Y, speeds over omega_n
    Y, as in `simulate --base-motion`; numbers of a cycle are None.
    """
    chosen, held = law_and_held(scene, "coulomb" if law == AUTO else law)
    held |= {} if friction_ratio is None else {"beta": friction_ratio}
    observation, said = observe_record(recording, scene, chosen, held)
    found, climbed = _found(observation, scene, law, None)
    observation, values = cast("RecordObservation", found.tests[0].observation), found.values()
    record, motion = follow(observation, values, fits_start=False), observation.motion(values)
    if motion is None:
        raise AnalysisError(f"record: law {observation.law.name} has no motion at the values found")
    diagnosis, amplitude = _of_whole(found, scene), Estimate(observation.unit, 0.0)
    found = diagnosis.posterior.with_doubt(OVER_TIME, record.wandering)
    if observation.unit_u:  # noise of Y changes the numbers that are over it
        by_unit = [abs(values[u.name]) / found.slope(k) if u.law else 0.0 for k, u in enumerate(found.unknowns)]
        found = found.with_shift(LARGEST, observation.unit_u * np.array(by_unit))
    no_cycle = (
        f"record: no steady cycle ({why}), so what is said of a cycle is left out; the law is fitted to the whole"
        f" record, its numbers over Y = {1e3 * observation.unit:.4g} mm, the largest displacement of the base from its"
        " first value, and speeds over omega_n Y"
    )
    x0, v0 = motion.displacements[0], motion.velocities[0]
    judged = _judged(
        *(found, scene, climbed, found.fit.nrmse()),
        [*scene.rig.doubts, *recording.source.warnings, no_cycle, *diagnosis.said, *said, *found.warnings],
        diagnosis=diagnosis,
        after=record.warnings,
        floor=observation.floor,
        amplitude=amplitude,
        model=f"{observation.law.words}, {observation.wall} wall, measured base",
        solver=motion.solver,
        closure_error=respond(motion.problem, motion.base, x0=x0, v0=v0).closure_error,
        **_of_record(record, climbed),
    )
    return replace(judged, response_nrmse=None, response_floor=None, misfit=None, verdict=None, laws=None)


def _of_record(record: WholeRecord, climbed: Ladder | None) -> dict[str, Any]:
    """What a comparison holds of a whole record, and of its ladder."""
    return {
        "record_nrmse": record.nrmse,
        "record_energy_difference": record.energy_difference,
        "record": record,
        "record_laws": None if climbed is None else _rows(climbed, climbed.posterior, record.nrmse),
    }
