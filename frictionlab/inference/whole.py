"""The whole record against its prediction: fitted to it or to the steady cycle, followed from the first sample.

A record without a steady cycle (a sweep, random motion, an earthquake, a start-up alone) has no drive frequency:
lengths are over the largest displacement Y of the base from its first value, forces over k Y, speeds over omega_n Y, as
in `simulate --base-motion`. Its fit is the same, its numbers of a cycle are None.
"""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace

import numpy as np

from frictionlab.analysis.measure import material_of, measure, normal_force_of, source_of, sources_of_test
from frictionlab.analysis.measurement import Measurement
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError
from frictionlab.estimate import Estimate
from frictionlab.inference.compare import AUTO, compared, friction_of, identified
from frictionlab.inference.comparison import Comparison, Fitted, WholeRecord
from frictionlab.inference.diagnose import strained_facts
from frictionlab.inference.fit import Fit, Place, Test, log_evidence, reweighed
from frictionlab.inference.ladder import EXACT, NUMERIC, REQUIRED, laws_above
from frictionlab.inference.observations import CycleObservation, cycle_of, law_and_held, refuse_several
from frictionlab.inference.posterior import ParameterEstimate, Posterior, posterior_of
from frictionlab.inference.record import (
    RUNS,
    RecordObservation,
    Track,
    fit_record,
    record_of,
    start_values,
    track_of,
    unsteady_track,
)
from frictionlab.inference.starts import FIRST_GUESSES
from frictionlab.inference.wander import Walk, friction_over_time
from frictionlab.recording import Recording
from frictionlab.scene import Scene, Solver
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.record import prepare

LEAVES = 2.0  # times the usual misfit of a period at which the prediction has left the measurement
NOISE = 3.0  # times the sensor's noise, at least
FEW = 3  # periods, at most, that tell no usual one
CALM = 3  # periods below that end such a stretch
SEARCH = (0.5, 0.7, 0.85, 1.2, 1.5, 2.0)  # friction ratios tried, over the cycle's
TRIED = tuple(np.geomspace(0.01, 2.0, 12).tolist())  # friction ratios to begin from without a cycle
OFF = 0.003  # relative, of the natural frequency: what such a fit begins from, too
FOLLOWED = 4  # starts, at most, without a cycle
PERIODIC, EVEN = 0.1, 0.02  # irregularity of the base, scatter of its cycles' lengths, up to which it has a cycle
SURE = 3.5  # errors from where a term does nothing: half its square is an evidence of 6
MOST_RUNGS = 24
OVER_TIME = "friction over time"


def compare_whole(
    recording: Recording,
    scene: Scene,
    *,
    law: str | None,
    friction_ratio: float | None,
    solver: Solver | None,
    fit: Fitted,
) -> Comparison:
    """Return a recording over its prediction from the first sample, its steady cycle too where it has one.

    Raises
    ------
    AnalysisError
        No measurement can be made, the natural frequency is not known, or no values tried have a motion.
    RecordingError
        The base has a gap or jumps.
    """
    refuse_several(scene)
    measurement, why = _measured(recording, scene, fit=fit)
    if measurement is None:
        return _without_cycle(recording, scene, why, law, friction_ratio)
    found, ladder = identified(measurement, scene, law, friction_ratio)
    comparison = compared(measurement, scene, found, ladder, solver or scene.model.solver)
    cycle = cycle_of(found.tests[0])
    track, said = track_of(recording, scene, measurement, measurement.drive_frequency_hz / cycle.r)
    observation = RecordObservation(
        track, cycle.law, cycle.held, cycle.wall, measurement.sources, cycle.r, measurement.material
    )
    values, rows = found.values() | start_values(track), None
    if fit == "whole":
        starts = [values] + [values | {"beta": times * values["beta"]} for times in SEARCH if "beta" in found.values()]
        if law == AUTO:
            best, rows = climb_whole(observation, starts)
        else:
            best = fit_record(observation, starts)
        values, observation = best.values(), record_of(best.model.tests[0])
        record = follow(observation, values, fits_start=False)
        posterior = _over_time(as_cycle(cycle.under(observation.law), posterior_of(best)), record)
        whole = compared(measurement, scene, posterior, None, solver or scene.model.solver)
        comparison = replace(whole, laws=comparison.laws, cycle_law=cycle.law.name if law == AUTO else None)
    else:
        record = follow(observation, values, fits_start=True)
    warnings = (*comparison.warnings, *said, *record.warnings, *_of_the_climb(rows))
    if comparison.contact is not None:
        comparison = replace(comparison, contact=replace(comparison.contact, warnings=warnings))
    return replace(
        comparison,
        warnings=warnings,
        record_nrmse=record.nrmse,
        record_energy_difference=record.energy_difference,
        record=record,
        record_laws=rows,
    )


def as_cycle(observation: CycleObservation, record: Posterior) -> Posterior:
    """Return the posterior of a record as that of its steady cycle: the values and errors of the record."""
    model = record.fit.model
    keep = [k for k, u in enumerate(record.unknowns) if u.law or u.level == "rig"]
    test = Test(observation, np.arange(len(keep)), np.ones(len(keep)))
    unknowns = tuple(record.unknowns[k] for k in keep)
    cycle = replace(model, tests=(test,), unknowns=unknowns, scatter=np.zeros(len(keep)))
    point = record.fit.point[keep]
    residual = cycle.residual(0, point)
    if residual is None:
        residual = observation.white(observation.data)
    slopes = np.ones((len(residual), len(keep)))  # each told, as far as its error says
    place = Place(point, (np.zeros(len(keep)),), (residual,), (slopes,), cycle.strains(point))
    covariance = record.covariance[np.ix_(keep, keep)]
    doubt = np.diag(model.holds(record.fit.point))[np.ix_(keep, keep)]
    information = np.linalg.inv(covariance) - doubt
    return Posterior(Fit(cycle, place), (information,), np.zeros(len(keep)), warnings=record.warnings)


def _over_time(found: Posterior, record: WholeRecord) -> Posterior:
    """The posterior whose errors hold what friction does during the record, where that is not one friction ratio."""
    k, values = found.fit.find("beta"), found.values()
    if k is None or not record.friction_wanders:
        return found
    shift, beta = np.zeros(len(found.unknowns)), found.unknowns[k]
    shift[k] = beta.at(values["beta"] + float(np.std(record.cycle_friction))) - beta.at(values["beta"])
    return found.with_shift(OVER_TIME, shift)


def _measured(recording: Recording, scene: Scene, *, fit: Fitted) -> tuple[Measurement | None, str]:
    """The measured steady cycle of a recording; None, and why, where it has none but its record can be fitted."""
    try:
        measurement = measure(recording, scene)
    except AnalysisError as error:
        if fit == "whole":
            return None, str(error)
        raise AnalysisError(f"{error}; do: --whole --fit whole fits the record itself, which needs no cycle") from error
    why = _not_periodic(measurement) if fit == "whole" else ""
    return (None, why) if why else (measurement, "")


def _not_periodic(measurement: Measurement) -> str:
    """Why cycles that were cut are none of a steady motion; nothing where they are."""
    index, lengths = measurement.base_irregularity_index, np.diff(measurement.series.time)
    if index is not None and index > PERIODIC:
        return f"base_irregularity_index: {index:.2g}: no cycle of the base is like the next"
    usual = float(np.median(lengths)) if len(lengths) else np.nan
    scatter = 1.4826 * float(np.median(np.abs(lengths - usual))) / usual if len(lengths) else 0.0
    if scatter > EVEN:
        return f"drive_frequency_hz: it changes by {100 * scatter:.2g} % rms from cycle to cycle: a sweep"
    return ""


def _natural_frequency(scene: Scene) -> float:
    """The declared natural frequency (Hz), where a fit begins."""
    natural = scene.rig.natural_frequency
    if natural is None:
        raise AnalysisError(
            "record: the natural frequency is not known: give rig.natural_frequency_hz in the scene, or mass_kg and"
            " stiffness_n_per_m (--natural-frequency); the fit corrects it, `frictionlab free-vibration` measures it"
        )
    return natural


def _without_cycle(
    recording: Recording, scene: Scene, why: str, law: str | None, friction_ratio: float | None
) -> Comparison:
    """A whole record without a steady cycle over its prediction."""
    track, said = unsteady_track(recording, scene, _natural_frequency(scene))
    sources = sources_of_test(recording, scene, recording.sampling_rate_hz)
    chosen, held = law_and_held(scene, "coulomb" if law == AUTO else law)
    held |= {} if friction_ratio is None else {"beta": friction_ratio}
    observation = RecordObservation(track, chosen, held, scene.model.wall, sources, 1.0)
    ratios = TRIED if "beta" not in held else (held["beta"],)
    start = start_values(track)
    starts = [start | {"beta": b, "natural_frequency": off * OFF} for b in ratios for off in (0.0, -1.0, 1.0)]
    rows = None
    if law == AUTO:
        best, rows = climb_whole(observation, starts, tries=FOLLOWED)
    else:
        best = fit_record(observation, starts, tries=FOLLOWED)
    found, observation = posterior_of(best), record_of(best.model.tests[0])
    record, motion = follow(observation, best.values(), fits_start=False), observation.motion(best.values())
    found = _over_time(found, record)
    if motion is None:
        raise AnalysisError(f"record: law {observation.law.name} has no motion at the values found")
    normal_force = normal_force_of(recording, scene)
    forces = friction_of(found, scene, sources, amplitude=Estimate(track.scale, 0.0), normal_force=normal_force)
    parameters = {name: _widened(e, track.scale_u * abs(e.value)) for name, e in found.parameters().items()}
    beta = parameters["beta"]
    shares = found.shares("beta")
    forces["budget"]["friction_ratio"] = (
        shares | {"largest displacement of the base": track.scale_u * beta.value} if shares else {}
    )
    no_cycle = (
        f"record: no steady cycle ({why}), so what is said of a cycle is left out; the law is fitted to the whole"
        f" record, its numbers over Y = {1e3 * track.scale:.4g} mm, the largest displacement of the base from its first"
        " value, and speeds over omega_n Y"
    )
    told = (*scene.rig.doubts, *recording.source.warnings, no_cycle, *said, *strained_facts(found, scene))
    return Comparison(
        source=source_of(recording),
        status="ok",
        reason=None,
        warnings=(*told, *found.warnings, *record.warnings, *_of_the_climb(rows)),
        law=observation.law.name,
        parameters={name: asdict(e) for name, e in parameters.items()},
        model=f"{observation.law.words}, {observation.wall} wall, measured base",
        solver=motion.solver,
        closure_error=motion.closure_error,
        nuisances={name: n for name, n in found.nuisances().items() if found.levels()[name] == "rig"},
        levels=found.levels(),
        accuracy=scene.accuracy,
        material=material_of(recording, scene),
        normal_force_n=normal_force,
        record_nrmse=record.nrmse,
        record_energy_difference=record.energy_difference,
        record=record,
        record_laws=rows,
        **{**forces, "friction": Estimate(beta.value, beta.se, beta.u)},
    )


def _widened(estimate: ParameterEstimate, more: float) -> ParameterEstimate:
    """A value whose errors hold that of Y too: its noise changes the number that a force is expressed by."""
    if estimate.u is None:
        return estimate
    u = math.hypot(estimate.u, more)
    lower, upper = (
        None if limit is None else estimate.value + (limit - estimate.value) * u / estimate.u
        for limit in (estimate.lower, estimate.upper)
    )
    return replace(estimate, u=u, lower=lower, upper=upper)


def climb_whole(
    observation: RecordObservation, starts: Sequence[Mapping[str, float]], *, tries: int = 1
) -> tuple[Fit, tuple[dict[str, object], ...]]:
    """Return the fit of the law that a record requires, from the one asked about upward, and the ladder's rows.

    Both laws are weighed by what the richer one leaves. A term is climbed if the logarithm of its Bayes factor is above
    5, if the sums of squares of single periods fall by more than their error, and if one of its parameters lies 3.5
    errors from where it does nothing.
    """
    begin = time.perf_counter()
    here = fit_record(observation, starts, tries=tries)
    rows = [_record_row(here, None, time.perf_counter() - begin, required=True)]
    tried = {observation.law.name}
    count = 1
    while count <= 2 and len(rows) < MOST_RUNGS:
        own = record_of(here.model.tests[0])
        good: list[tuple[float, Fit]] = []
        for name in laws_above(own.law, EXACT, count):
            if name in tried:
                continue
            tried.add(name)
            begin = time.perf_counter()
            try:
                found = fit_record(replace(own, spread=0.0).under(law_of(name)), _above(here, name))
                gain = _gain(found, here)
            except Exception as fault:  # noqa: BLE001 - one law's fault must not end the others
                rows.append({"law": name, "parameters": {}, "log_evidence_gain": None, "record_nrmse": None})
                rows[-1] |= {"required": False, "seconds": time.perf_counter() - begin, "note": str(fault)}
                continue
            required = gain > REQUIRED and _is_sure(found, here)
            rows.append(_record_row(found, gain, time.perf_counter() - begin, required=required))
            good += [(gain, found)] if required else []
        if good:
            here, count = max(good, key=lambda pair: pair[0])[1], 1
        else:
            count += 1
    return here, tuple(rows)


def _of_the_climb(rows: Sequence[Mapping[str, object]] | None) -> Iterator[str]:
    """Say which laws were not held against a record, and why."""
    if rows is None:
        return
    numeric = ", ".join(NUMERIC)
    yield (
        f"record_laws: the exact laws alone were tried on the whole record, not {numeric}; do: --law coulomb+NAME --fit"
        " whole for one of them"
    )
    for row in rows:
        if row["note"]:
            yield f"law {row['law']}: not compared on the record: {row['note']}"


def _above(here: Fit, name: str) -> list[dict[str, float]]:
    """Values at which a richer law begins: where its new terms do something, of either sign."""
    known, law = here.values(), law_of(name)
    new = [p for p in law.own if p.name not in known]
    guesses = {p.name: FIRST_GUESSES.get(p.name, p.usual[1] if p.neutral is None else 0.5 * p.usual[1]) for p in new}
    turned = {p.name: (p.neutral or 0.0) - guesses[p.name] if p.low < 0.0 else guesses[p.name] for p in new}
    return [known | guesses, *([known | turned] if turned != guesses else [])]


def _gain(found: Fit, below: Fit) -> float:
    """Logarithm of the Bayes factor of a law over a simpler one on the same record, unless single periods deny it."""
    own = record_of(found.model.tests[0])
    under = record_of(below.model.tests[0])
    test = replace(below.model.tests[0], observation=replace(under, spread=float(own.sd[0])))
    same = reweighed(below, (test,), follows=False)
    squares = [_squares(f.model.tests[0].observation.gap(f.residual()), own.track.per_period) for f in (below, found)]
    better = squares[0] - squares[1]
    if len(better) > 1 and float(better.mean()) < float(better.std(ddof=1)) / math.sqrt(len(better)):
        return -math.inf
    return log_evidence(found) - log_evidence(same)


def _squares(gap: FloatArray, per_period: int) -> FloatArray:
    """Mean square of each whole period (c,)."""
    whole = len(gap) // per_period * per_period
    parts = gap[:whole].reshape(-1, per_period) if whole else gap.reshape(1, -1)
    return np.asarray(np.mean(parts**2, axis=1))


def _is_sure(found: Fit, below: Fit) -> bool:
    """Whether one of the new parameters lies far enough from where its term does nothing."""
    covariance, known = posterior_of(found).covariance, {u.name for u in below.model.unknowns}
    law = found.model.tests[0].observation.law
    for k, u in enumerate(found.model.unknowns):
        if not u.law or u.name in known:
            continue
        neutral = law.parameter(u.name).neutral
        if neutral is None or not math.isfinite(neutral):
            return True  # no value of it does nothing: its evidence alone decides
        if abs(float(found.point[k]) - u.at(neutral)) > SURE * math.sqrt(covariance[k, k]):
            return True
    return False


def _record_row(found: Fit, gain: float | None, seconds: float, *, required: bool) -> dict[str, object]:
    observation = record_of(found.model.tests[0])
    names = {u.name for u in found.model.unknowns if u.law}
    return {
        "law": observation.law.name,
        "parameters": {name: value for name, value in found.values().items() if name in names},
        "log_evidence_gain": gain if gain is None or math.isfinite(gain) else None,
        "record_nrmse": observation.nrmse(found.residual()),
        "required": required,
        "seconds": seconds,
        "note": None,
    }


def follow(observation: RecordObservation, values: Mapping[str, float], *, fits_start: bool) -> WholeRecord:
    """Return the record over its prediction at some values; its start is fitted where it was not.

    Raises
    ------
    AnalysisError
        The law has no motion under the measured base at these values.
    """
    track = observation.track
    prepare(observation.problem(values).in_frame_time(), observation.base(values), RUNS)
    if fits_start:
        values = {**values, **_fitted_start(observation, values)}
    predicted = observation.predict(values)
    if predicted is None:
        raise AnalysisError(f"record: law {observation.law.name} has no motion at the values found")
    return _over(track, predicted, friction_over_time(observation, values, predicted))


def _fitted_start(observation: RecordObservation, values: Mapping[str, float]) -> dict[str, float]:
    """Where and how fast the mass begins, by least squares, all else given."""
    from scipy.optimize import least_squares  # noqa: PLC0415 - for whole records alone

    names = tuple(start_values(observation.track))
    far = np.full(len(observation.data), 10.0 * observation.track.rms)

    def residual(point: FloatArray) -> FloatArray:
        predicted = observation.predict({**values, **dict(zip(names, point.tolist(), strict=True))})
        return far if predicted is None else observation.data - predicted

    begun = [values[name] for name in names]
    found = least_squares(residual, begun, method="trf", max_nfev=25, diff_step=[1e-6] * len(begun))
    return dict(zip(names, found.x.tolist(), strict=True))


def _over(track: Track, predicted: FloatArray, friction: Walk) -> WholeRecord:
    """Measured over predicted, as a whole and period by period."""
    gap = track.mass - predicted
    area, area_predicted = loop_areas(track.base, track.mass), loop_areas(track.base, predicted)
    edges = np.minimum(track.period * np.arange(track.periods + 1), track.time[-1])
    power = np.concatenate([[0.0], np.cumsum(0.5 * (gap[1:] ** 2 + gap[:-1] ** 2) * np.diff(track.time))])
    each = np.sqrt(np.diff(np.interp(edges, track.time, power)) / np.diff(edges)) / track.rms
    limit = max(LEAVES * float(np.median(each)), NOISE * track.noise / track.rms) if len(each) > FEW else math.inf
    apart = stretches_apart(each, limit, edges)
    return WholeRecord(
        time=track.start + track.time,
        base=track.base,
        measured=track.mass,
        predicted=predicted,
        nrmse=math.sqrt(float(np.mean(gap**2))) / track.rms,
        energy_difference=float(area_predicted[-1] / area[-1] - 1.0),
        cycle_time=track.start + edges[:-1],
        cycle_measured=np.diff(np.interp(edges, track.time, area)),
        cycle_predicted=np.diff(np.interp(edges, track.time, area_predicted)),
        cycle_nrmse=each,
        cycle_friction=friction.values,
        cycle_friction_se=friction.errors,
        wanders=friction.sure,
        left=tuple((track.start + begin, track.start + end, worst) for begin, end, worst in apart),
    )


def loop_areas(base: FloatArray, mass: FloatArray) -> FloatArray:
    """Integral of y dx from the first sample to each (n,): what the loop takes in (2.18), by trapezia."""
    steps = 0.5 * (base[1:] + base[:-1]) * np.diff(mass)
    return np.concatenate([[0.0], np.cumsum(steps)])


def stretches_apart(each: FloatArray, limit: float, edges: FloatArray) -> Iterator[tuple[float, float, float]]:
    """Stretches of periods whose misfit is above a limit: from, to, the largest; a short calm ends none.

    Parameters
    ----------
    each : ndarray of shape (c,)
        Misfit of each period.
    limit : float
    edges : ndarray of shape (c + 1,)
        Where the periods begin and end.

    Examples
    --------
    >>> misfit = np.array([1.0, 5.0, 1.0, 6.0, 1.0, 1.0, 1.0, 1.0, 4.0])
    >>> [(float(begin), float(end)) for begin, end, _ in stretches_apart(misfit, 2.0, np.arange(10.0))]
    [(1.0, 4.0), (8.0, 9.0)]
    """
    out = np.flatnonzero(each > limit)
    for places in np.split(out, np.flatnonzero(np.diff(out) > CALM) + 1):
        if len(places):
            yield float(edges[places[0]]), float(edges[places[-1] + 1]), float(each[places].max())
