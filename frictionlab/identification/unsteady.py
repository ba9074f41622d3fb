"""A record without a steady cycle (a sweep, random motion, an earthquake, a start-up alone) over its prediction.

There is no drive frequency and no cycle: lengths are over the largest displacement Y of the base from its first value,
forces over k Y, speeds over omega_n Y, as in `simulate --base-motion`. What is fitted is the whole record.
"""

import math
from dataclasses import asdict, replace

import numpy as np

from frictionlab.accuracy import accuracy_of
from frictionlab.analysis.measure import material_of, measure, normal_force_of, source_of, sources_of_test
from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError
from frictionlab.estimate import Estimate
from frictionlab.identification.compare import AUTO, model_words, nuisances_told
from frictionlab.identification.comparison import Comparison
from frictionlab.identification.coordinates import Coordinate, nuisances, of_parameter, of_sensors
from frictionlab.identification.family import Family, law_and_held
from frictionlab.identification.force import friction_of
from frictionlab.identification.identify import Identified, ParameterEstimate
from frictionlab.identification.observed import Observed
from frictionlab.identification.record_ladder import RecordLadder
from frictionlab.identification.track import RecordForward, Track, of_a_record, start_values, unsteady_track
from frictionlab.identification.whole import Question, climb_whole, follow, identify_whole
from frictionlab.identification.whole_record import Fitted
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator.record import Response
from frictionlab.uncertainty import Sources

PERIODIC, EVEN = 0.1, 0.02  # irregularity of the base, spread of its cycles' lengths, up to which it has a cycle
TRIED = tuple(np.geomspace(0.01, 2.0, 12).tolist())  # friction ratios to begin from
OFF = 0.003  # relative, of the natural frequency: what the fit begins from, too
FOLLOWED = 4  # starts, at most
NOTHING = Observed(
    cosine_sine=np.zeros(2),
    each=np.zeros((0, 2)),
    covariance=np.eye(2),
    sensor=1.0,
    used=0,
    freedom=np.inf,
    power=1.0,
    beyond=0.0,
    of_base=np.zeros((2, 2)),
)  # the cycle of a record that has none


def cycle_of(recording: Recording, scene: Scene, *, fit: Fitted) -> tuple[Measurement | None, str]:
    """Return the measured steady cycle of a recording; None, and why, where it has none but its record can be fitted.

    Raises
    ------
    AnalysisError
        It has no cycle, and a cycle is what the law is to be fitted to.
    """
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
    spread = 1.4826 * float(np.median(np.abs(lengths - usual))) / usual if len(lengths) else 0.0
    if spread > EVEN:
        return f"drive_frequency_hz: it changes by {100 * spread:.2g} % rms from cycle to cycle: a sweep"
    return ""


def compare_unsteady(
    recording: Recording, scene: Scene, why: str, *, law: str | None, friction_ratio: float | None
) -> Comparison:
    """Identify the contact from a whole record without a steady cycle, and hold the record against its prediction.

    Parameters
    ----------
    recording : Recording
    scene : Scene
        ``[rig]`` gives the natural frequency, from which the fit may move it by what is not known of it.
    why : str
        Why there is no cycle.
    law, friction_ratio
        As of `compare`.

    Raises
    ------
    AnalysisError
        The natural frequency is not known, the record is too short or still, or no values tried have a motion.
    RecordingError
        It has a gap or jumps.
    """
    natural = scene.rig.natural_frequency
    if natural is None:
        raise AnalysisError(
            "record: the natural frequency is not known: give rig.natural_frequency_hz in the scene, or mass_kg and"
            " stiffness_n_per_m (--natural-frequency); the fit corrects it, `frictionlab free-vibration` measures it"
        )
    track, said = unsteady_track(recording, scene, natural)
    sources = sources_of_test(recording, scene, recording.sampling_rate_hz)
    chosen, held = law_and_held(scene, "coulomb" if law == AUTO else law)
    family = Family(1.0, chosen, held, scene.model.wall)
    family = family if friction_ratio is None else family.holding({"beta": friction_ratio})
    question = _question(track, family, sources)
    found, ladder = climb_whole(question) if law == AUTO else (identify_whole(question), None)
    told = (*scene.rig.doubts, *recording.source.warnings, _no_cycle(why, track), *said)
    return _compared(recording, scene, sources, track, found, ladder, told)


def _no_cycle(why: str, track: Track) -> str:
    return (
        f"record: no steady cycle ({why}), so what is told of a cycle is left out; the law is fitted to the whole"
        f" record, its numbers over Y = {1e3 * track.scale:.4g} mm, the largest displacement of the base from its first"
        " value, and speeds over omega_n Y"
    )


def _question(track: Track, family: Family, sources: Sources) -> Question:
    def unknowns(family: Family) -> tuple[Coordinate, ...]:
        own = (of_parameter(family.law.parameter(name)) for name in family.free)
        gain, shown = of_sensors(sources, amplitude=track.swing, unit=track.scale)
        known = nuisances(family, sources, turn=2.0 * np.pi / track.period, gain=gain)
        return of_a_record((*own, *known, *shown))

    start = start_values(track)
    ratios = TRIED if "beta" in family.free else (family.held["beta"],)
    starts = (start | {"beta": beta, "natural_frequency": off * OFF} for beta in ratios for off in (0.0, -1.0, 1.0))
    return Question(track, family, unknowns, tuple(starts), NOTHING, FOLLOWED)


def _compared(
    recording: Recording,
    scene: Scene,
    sources: Sources,
    track: Track,
    found: Identified,
    ladder: RecordLadder | None,
    said: tuple[str, ...],
) -> Comparison:
    record, motion = follow(track, found), _motion(track, found)
    normal_force = normal_force_of(recording, scene)
    of_forces = friction_of(found, scene, sources, amplitude=Estimate(track.scale, 0.0), normal_force=normal_force)
    found = _over_size(found, track)  # in a force Y's own error goes out
    beta, shares = found.parameters["beta"], {"friction_ratio": found.shares}
    return Comparison(
        source=source_of(recording),
        status="ok",
        reason=None,
        warnings=(*said, *found.warnings, *record.warnings, *(ladder.said if ladder else ())),
        law=found.family.law.name,
        parameters={name: asdict(e) for name, e in found.parameters.items()},
        model=model_words(found.family, "measured base"),
        solver=motion.solver,
        closure_error=motion.closure_error,
        nuisances=nuisances_told(found),
        accuracy=accuracy_of(scene),
        material=material_of(recording, scene),
        normal_force_n=normal_force,
        record_nrmse=record.nrmse,
        record_energy_difference=record.energy_difference,
        record=record,
        record_laws=ladder.rows if ladder else None,
        **(of_forces | {"friction": Estimate(beta.value, beta.se, beta.u), "budget": of_forces["budget"] | shares}),
    )


def _over_size(found: Identified, track: Track) -> Identified:
    """The same values, their errors holding that of Y: its noise changes the number that a force is told by."""
    parameters = {name: _widened(e, track.scale_u * abs(e.value)) for name, e in found.parameters.items()}
    shares = found.shares | {"largest displacement of the base": track.scale_u * found.parameters["beta"].value}
    return replace(found, parameters=parameters, shares=shares if found.shares else {})


def _widened(estimate: ParameterEstimate, more: float) -> ParameterEstimate:
    if estimate.u is None:
        return estimate
    u = math.hypot(estimate.u, more)
    lower, upper = (
        None if limit is None else estimate.value + (limit - estimate.value) * u / estimate.u
        for limit in (estimate.lower, estimate.upper)
    )
    return replace(estimate, u=u, lower=lower, upper=upper)


def _motion(track: Track, found: Identified) -> Response:
    """The simulated record with the values found."""
    motion = RecordForward(found.family, (), track).response(found.fit.values)
    if motion is None:
        raise AnalysisError(f"record: law {found.family.law.name} has no motion at the values found")
    return motion
