"""One measured cycle over its prediction, under a law that is given or under the one that the recording requires."""

import math
from collections.abc import Mapping
from dataclasses import asdict, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.accuracy import accuracy_of
from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import UsageError
from frictionlab.identification.comparison import Comparison
from frictionlab.identification.contact_force import ContactForce, contact_of
from frictionlab.identification.family import Family, family_of
from frictionlab.identification.force import friction_of
from frictionlab.identification.identify import Identified, as_known, identify
from frictionlab.identification.ladder import Ladder, Rung, climb
from frictionlab.identification.seen import Judged, judge, seen
from frictionlab.identification.whole_record import Fitted
from frictionlab.recording import Recording
from frictionlab.scene import Scene, Solver
from frictionlab.simulator import SteadyState, steady_state
from frictionlab.uncertainty import Sources

FloatArray = NDArray[np.float64]
UNDAMPED = ("thesis", "closed-form")  # solvers that know no frame's dashpot
FAINT = 0.1  # error of the measured cycle over its size from which nearly any law explains it
AUTO = "auto"  # the law that the recording requires


def compare(
    recording: Recording,
    scene: Scene,
    *,
    law: str | None = None,
    friction_ratio: float | None = None,
    solver: Solver | None = None,
    whole: bool = False,
    fit: Fitted = "cycle",
) -> Comparison:
    """Identify the contact of a recording, predict its steady cycle, and say how they differ.

    Parameters
    ----------
    recording : Recording
    scene : Scene
        ``[rig]`` gives the natural frequency (and stiffness, for newtons), ``[model]`` the physics.
    law : str, optional
        In place of the scene's; "auto" climbs the ladder of laws as far as the recording requires.
    friction_ratio : float, optional
        Predict with this friction ratio (beta, eq. 2.8) instead of identifying it.
    solver : {"auto", "closed-form", "exact", "numeric", "thesis"}, optional
        Of the prediction, in place of the scene's.
    whole : bool
        Compare the whole record too, from its first sample, driven by the measured base.
    fit : {"cycle", "whole"}
        What the law's parameters are fitted to: the mean steady cycle, or the whole record. A record without a steady
        cycle (a sweep, a start-up) can only be fitted whole: what is told of a cycle is None then.

    Raises
    ------
    AnalysisError
        No measurement can be made, or the natural frequency is not known.
    RecordingError
        The whole record is asked for and has a gap or jumps.
    UsageError
        The law or the friction ratio cannot be.
    """
    if not whole and fit == "cycle":
        return predict(measure(recording, scene), scene, law=law, friction_ratio=friction_ratio, solver=solver)
    _check_given(law, friction_ratio)
    from frictionlab.identification.unsteady import compare_unsteady, cycle_of  # noqa: PLC0415 - a cycle needs it not

    measurement, why = cycle_of(recording, scene, fit=fit)
    if measurement is None:
        return compare_unsteady(recording, scene, why, law=law, friction_ratio=friction_ratio)
    return _with_record(recording, scene, measurement, law, friction_ratio, solver, fit)


def _with_record(
    recording: Recording,
    scene: Scene,
    measurement: Measurement,
    law: str | None,
    friction_ratio: float | None,
    solver: Solver | None,
    fit: Fitted,
) -> Comparison:
    """A steady cycle and the whole record over their predictions."""
    from frictionlab.identification.track import track_of  # noqa: PLC0415 - these two load what a cycle has no use for
    from frictionlab.identification.whole import (  # noqa: PLC0415
        climb_whole,
        follow,
        identify_whole,
        question_of,
        under_measured_base,
    )

    sources = measurement.sources
    found, ladder = _identified(measurement, scene, sources, law, friction_ratio)
    track, said = track_of(recording, scene, measurement, measurement.drive_frequency_hz / found.family.r)
    cycle_law, climbed = found.family.law.name, None
    if fit == "whole" and law == AUTO:
        found, climbed = climb_whole(question_of(track, measurement, found, sources))
    elif fit == "whole":
        found = identify_whole(question_of(track, measurement, found, sources))
    if fit == "whole":
        found = under_measured_base(measurement, found)
    record = follow(track, found)
    state = _state(found, solver or scene.model.solver)
    comparison = _compared(measurement, scene, found, state, sources, ladder)
    whole = replace(
        comparison,
        warnings=(*comparison.warnings, *said, *record.warnings, *(climbed.said if climbed else ())),
        record_nrmse=record.nrmse,
        record_energy_difference=record.energy_difference,
        record=record,
        cycle_law=cycle_law if law == AUTO else None,
        record_laws=climbed.rows if climbed else None,
    )
    return _with_figure(whole, measurement, scene)


def predict(
    measurement: Measurement,
    scene: Scene,
    *,
    law: str | None = None,
    friction_ratio: float | None = None,
    solver: Solver | None = None,
) -> Comparison:
    """As :func:`compare`, from a measurement that is already made; so without the whole record."""
    _check_given(law, friction_ratio)
    sources = measurement.sources
    found, ladder = _identified(measurement, scene, sources, law, friction_ratio)
    state = _state(found, solver or scene.model.solver)
    return _with_figure(_compared(measurement, scene, found, state, sources, ladder), measurement, scene)


def _check_given(law: str | None, friction_ratio: float | None) -> None:
    if friction_ratio is not None and not (friction_ratio >= 0 and math.isfinite(friction_ratio)):
        raise UsageError(f"friction ratio: expected a number of at least 0; got {friction_ratio:g}")
    if law == AUTO and friction_ratio is not None:
        raise UsageError("friction ratio: a given one (--beta) and a law to be found (--law auto) exclude each other")


def _identified(
    measurement: Measurement, scene: Scene, sources: Sources, law: str | None, friction_ratio: float | None
) -> tuple[Identified, Ladder | None]:
    """Return the law that is given or required, with its values for the mean cycle, and the ladder if climbed."""
    family = family_of(measurement, scene, None if law == AUTO else law)
    if law == AUTO:
        ladder = climb(measurement, family.under_plain_coulomb(), sources)
        return ladder.chosen.identified, ladder
    if friction_ratio is None:
        return identify(measurement, family, sources), None
    return as_known(measurement, family.holding({"beta": friction_ratio}), sources), None


def _state(found: Identified, solver: Solver) -> SteadyState:
    """The predicted steady state: of the problem as it was fitted.

    A solver without a frame's dashpot leaves out the one that was fitted beside the law, unless the scene has it.
    """
    plain = solver in UNDAMPED and "frame_damping_ratio" not in found.family.held
    problem = found.family.problem_at(found.fit.values, without=("frame_damping_ratio",) if plain else ())
    return steady_state(problem, solver=solver)


def model_words(family: Family, base: str | None = None) -> str:
    """The physics that was switched on, as words; ``base``: what drove it, where that is no series of harmonics."""
    words = [family.law.words, f"{family.wall} wall"]
    words += [f"{name} {value:g}" for name, value in _held_words(family.held).items()]
    count = family.base.harmonics
    words.append(base or (f"{count} base harmonics" if count > 1 else "cosine base"))
    return ", ".join(words)


def _held_words(held: Mapping[str, float]) -> dict[str, float]:
    """Parameters that were held at a value, by the words for them; the friction ratio is told elsewhere."""
    named = {name: value for name, value in held.items() if name != "beta"}
    frame = named.pop("frame_damping_ratio", 0.0)
    if "static_ratio_up" in named and named["static_ratio_up"] == named.get("static_ratio_down"):
        named = {"static ratio": named.pop("static_ratio_up")} | named
        del named["static_ratio_down"]
    return named | ({"frame damping": frame} if frame else {})


def _with_figure(made: Comparison, measurement: Measurement, scene: Scene) -> Comparison:
    """The comparison as it is told: the contact's figure has its newtons, its verdict, and every warning of it."""
    if made.contact is None:
        return made
    words = Judged(made.response_floor or math.nan, made.response_nrmse, made.misfit, made.verdict).words
    stiffness = scene.rig.stiffness
    unit = None if stiffness is None else stiffness * measurement.base_amplitude_m
    return replace(made, contact=replace(made.contact, unit_n=unit, said=f"{made.law}{words}", warnings=made.warnings))


def _compared(
    measurement: Measurement,
    scene: Scene,
    found: Identified,
    state: SteadyState,
    sources: Sources,
    ladder: Ladder | None,
) -> Comparison:
    cycle, prediction = measurement.cycle, seen(measurement, found, state)
    judged = judge(cycle.mass, prediction.cycle, found.fit.observed.floor)
    said = [*measurement.warnings, *found.warnings, *state.warnings, *_of_verdict(found, judged, ladder)]
    if ladder is not None:
        said += _required_untold(found)
        said += [f"law {name}: {why}" for name, why in ladder.left_out.items()]
    if prediction.cycle is None:
        said.append(f"no prediction: {state.outcome}")
    left = {} if ladder is None else _left(measurement, ladder, found, judged)
    amplitude, normal_force = measurement.base_amplitude, measurement.normal_force_n
    friction = friction_of(found, scene, sources, amplitude=amplitude, normal_force=normal_force)
    return Comparison(
        source=measurement.source,
        status=measurement.status,
        reason=measurement.reason,
        warnings=tuple(said),
        frequency_ratio=found.family.r,
        energy_per_cycle=measurement.energy_per_cycle,
        response_amplitude=measurement.response_amplitude,
        stops_per_cycle=measurement.stops_per_cycle,
        regime=measurement.regime,
        law=found.family.law.name,
        predicted_energy_per_cycle=prediction.energy,
        predicted_response_amplitude=prediction.amplitude,
        predicted_stops_per_cycle=state.stops_per_cycle,
        predicted_regime=state.regime,
        energy_difference=None if prediction.energy is None else prediction.energy / measurement.energy_per_cycle - 1,
        response_nrmse=judged.nrmse,
        response_floor=judged.floor,
        misfit=judged.misfit,
        verdict=judged.verdict,
        parameters={name: asdict(e) for name, e in found.parameters.items()},
        model=model_words(found.family),
        solver=state.solver,
        closure_error=state.closure_error,
        nuisances=nuisances_told(found),
        laws=None if ladder is None else tuple(_rung_row(rung, left[rung.law.name]) for rung in ladder.rungs),
        accuracy=accuracy_of(scene),
        material=measurement.material,
        normal_force_n=measurement.normal_force_n,
        tau=cycle.tau,
        base=cycle.base,
        measured=cycle.mass,
        predicted=prediction.cycle,
        contact=_contact(measurement, found, state, prediction.cycle, _points(ladder, left)),
        budget={**measurement.budget, **friction.pop("budget")},
        **friction,
    )


def nuisances_told(found: Identified) -> dict[str, dict[str, float]]:
    """What the fit moved beside the law, by name; a lag in seconds."""
    told = {}
    for c in found.fit.coordinates:
        if c.name in found.nuisances:
            name, one = ("lag_s", 1e-3 * c.unit[0]) if c.name == "lag" else (c.name, 1.0)
            told[name] = dict(zip(("value", "u", "known_to"), (one * x for x in found.nuisances[c.name]), strict=True))
    return told


def _contact(
    measurement: Measurement,
    found: Identified,
    state: SteadyState,
    predicted: FloatArray | None,
    points: Mapping[str, tuple[int, float, float]],
) -> ContactForce:
    observed = found.fit.observed
    return contact_of(
        measurement,
        state,
        predicted=predicted,
        lag=found.fit.values.get("lag", 0.0),
        floor=observed.floor * math.sqrt(observed.power),
        laws=points,
    )


def _points(ladder: Ladder | None, left: Mapping[str, float | None]) -> dict[str, tuple[int, float, float]]:
    """Number of parameters found, nrmse, log evidence of each law: the points of the ladder's figure."""
    if ladder is None:
        return {}
    known = ((rung, left[rung.law.name]) for rung in ladder.rungs)
    return {
        r.law.name: (len(r.identified.family.free), nrmse, r.log_evidence) for r, nrmse in known if nrmse is not None
    }


def _left(measurement: Measurement, ladder: Ladder, found: Identified, judged: Judged) -> dict[str, float | None]:
    """The nrmse of each law of a ladder, reckoned as the comparison's own: over the whole mean cycle."""

    def of(rung: Rung) -> float | None:
        if rung.identified is found:
            return judged.nrmse
        cycle = seen(measurement, rung.identified, _state(rung.identified, "auto")).cycle
        return judge(measurement.cycle.mass, cycle, judged.floor).nrmse

    return {rung.law.name: of(rung) for rung in ladder.rungs}


def _rung_row(rung: Rung, nrmse: float | None) -> dict[str, object]:
    return {
        "law": rung.law.name,
        "parameters": {name: asdict(e) for name, e in rung.identified.parameters.items()},
        "log_evidence": rung.log_evidence,
        "response_nrmse": nrmse,
        "held_out_nrmse": rung.held_out_nrmse,
        "required": rung.required,
        "seconds": rung.seconds,
    }


def _of_verdict(found: Identified, judged: Judged, ladder: Ladder | None) -> list[str]:
    """What a reader must know of a law that does not explain the cycle, or that noise alone would let explain it."""
    if judged.verdict == "explained" and judged.floor > FAINT:
        faint = f"the measurement's own error is {100 * judged.floor:.2g} % of the motion"
        return [
            f"verdict: explained says little here: {faint}, and most laws would pass; measure more or larger cycles"
        ]
    if judged.verdict != "misfit" or judged.misfit is None:
        return []
    missed = f"what it misses is {judged.misfit:.2g} times the standard error of the measured mean cycle"
    return [f"verdict: {found.family.law.name} does not explain this cycle: {missed}; {_next_step(found, ladder)}"]


def _required_untold(found: Identified) -> list[str]:
    """Say of a term that is required though no value of it is told why both are so."""
    return [
        f"law: the recording requires the term {term.name}, for without it cycles are predicted worse; how much of it"
        " there is it does not tell, for errors of sensors and rig do nearly the same: declare them in [sensors], [rig]"
        for term in found.family.law.terms
        if (own := [found.parameters[p.name] for p in term.parameters if p.name in found.family.free])
        and term.name != "coulomb"
        and not any(e.told for e in own)
    ]


def _next_step(found: Identified, ladder: Ladder | None) -> str:
    """What may explain a cycle that a law does not."""
    if ladder is not None:
        return "no law that --law auto tried explains it"
    if "beta" in found.family.held:
        beta = found.family.held["beta"]
        return f"the friction ratio is held at {beta:g}: leave out --beta, and beta of [model.parameters], to fit it"
    return "try --law auto"
