"""Recording -> friction identified, prediction, difference: what ``compare-numeric`` does, as one story.

A single test is a campaign of one: its observation goes through the same `infer` and `climb` as all tests of a
material.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from frictionlab.analysis.channels import in_band
from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError, UsageError
from frictionlab.estimate import Estimate
from frictionlab.inference.comparison import AtContact, Comparison, ContactForce, Fitted, Verdict
from frictionlab.inference.diagnose import Diagnosis, diagnose
from frictionlab.inference.fit import Fit, Model, Test, fit_from, start_place
from frictionlab.inference.ladder import Ladder, Rung, climb
from frictionlab.inference.material_law import MaterialLaw
from frictionlab.inference.observation import BENDS
from frictionlab.inference.observations import CycleObservation, bent, cycle_of, observe
from frictionlab.inference.posterior import (
    EXPLAINED,
    ParameterEstimate,
    Posterior,
    infer,
    limits_in_words,
    model_of,
    posterior_of,
)
from frictionlab.inference.unknowns import STRONGEST, Unknown
from frictionlab.recording import Recording
from frictionlab.scene import Scene, Solver
from frictionlab.simulator import Problem, SteadyState, steady_state
from frictionlab.simulator.laws import Law, law_of
from frictionlab.uncertainty import Sources, unit_uncertainty

UNDAMPED = ("thesis", "closed-form")  # solvers that know no frame's dashpot
FAINT = 0.1  # error of the measured cycle over its size from which nearly any law explains it
VAGUE = 0.1  # relative uncertainty from which a friction ratio is called vague
HELD = 1e-9  # standard deviation of what a law was found with
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
        cycle (a sweep, a start-up) can only be fitted whole: what is said of a cycle is None then.

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
    from frictionlab.inference.whole import compare_whole  # noqa: PLC0415 - a cycle has no use for it

    return compare_whole(recording, scene, law=law, friction_ratio=friction_ratio, solver=solver, fit=fit)


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
    found, ladder = identified(measurement, scene, law, friction_ratio)
    return compared(measurement, scene, found, ladder, solver or scene.model.solver)


def judge(measurement: Measurement, scene: Scene, law: MaterialLaw) -> Comparison:
    """Compare a measured test with the law of its material, found elsewhere.

    Fitted are only the values that scatter from test to test, each held by its scatter: the other values, the natural
    frequency, the frame's damping and an undeclared lag are those that the law was found with.

    Raises
    ------
    AnalysisError
        The law has no steady state in this test.
    UsageError
        The test's normal force or frequency ratio is not known.
    """
    if measurement.normal_force_n is None or measurement.frequency_ratio is None:
        raise UsageError(
            f"{measurement.source}: a law of a material needs the test's normal force and frequency ratio: give"
            " normal_force_n in [experiment] and natural_frequency_hz in [rig] of the scene"
        )
    observation = replace(observe(measurement, scene, law.law), wall=law.wall)
    drive = measurement.drive_frequency_hz
    test = (measurement.normal_force_n, measurement.base_amplitude_m, drive / law.rig["natural_frequency_hz"])
    middle = law.problem(*test)
    moved = law.problem(*test, values={n: v + law.scatter.get(n, (0.0,))[0] for n, v in law.values.items()}).parameters
    own = []
    for p in law_of(law.law).own:
        mean, sd = middle.parameters[p.name], moved[p.name] - middle.parameters[p.name]
        if sd > 0.0:
            low = max(-STRONGEST, (p.low - mean) / sd)
            own.append(Unknown(p.name, p.words, "test", mean=mean, sd=sd, low=low, law=True))
    tuned = drive / middle.r / (drive / measurement.frequency_ratio) - 1.0
    lag = law.rig.get("lag_s", 0.0) - scene.sensors.lag_s if scene.sensors.lag_s_u is None else 0.0
    own += [Unknown(n, n, mean=v, sd=HELD) for n, v in (("natural_frequency", tuned), ("lag_s", lag))]
    names = {u.name for u in own}
    held = {name: value for name, value in middle.parameters.items() if name not in names}
    one = Test(observation.under(observation.law, held), np.arange(len(own)), np.ones(len(own)))
    starts = [np.array([start * (u.level == "test") for u in own]) for start in (0.0, 1.0, -1.0)]
    found = posterior_of(fit_from(Model((one,), tuple(own), np.zeros(len(own))), starts))
    return compared(measurement, scene, found, None, scene.model.solver)


def _check_given(law: str | None, friction_ratio: float | None) -> None:
    if friction_ratio is not None and not (friction_ratio >= 0 and math.isfinite(friction_ratio)):
        raise UsageError(f"friction ratio: expected a number of at least 0; got {friction_ratio:g}")
    if law == AUTO and friction_ratio is not None:
        raise UsageError("friction ratio: a given one (--beta) and a law to be found (--law auto) exclude each other")


def identified(
    measurement: Measurement, scene: Scene, law: str | None, friction_ratio: float | None = None
) -> tuple[Posterior, Ladder | None]:
    """Return the posterior under the law that is given or required, and the ladder if climbed.

    Raises
    ------
    AnalysisError
        The mass stands still, or no value tried has a steady state.
    """
    observation = observe(measurement, scene, None if law == AUTO else law)
    if law == AUTO:
        ladder = climb([observation.under(law_of("coulomb"))], accuracy=scene.accuracy)
        return ladder.posterior, ladder
    if friction_ratio is not None:
        observation = replace(observation, held={**observation.held, "beta": friction_ratio})
    if any(p.name not in observation.held for p in observation.law.own if not p.whole):
        return infer([observation]), None
    return unfitted(observation), None


def unfitted(observation: CycleObservation) -> Posterior:
    """Return what a law whose values are all given says of a test: no unknowns."""
    model = model_of([observation], rig=False)
    try:
        place = start_place(model, np.zeros(0))
    except AnalysisError:
        stuck = observation.white(observation.data)
        empty = start_place(replace(model, tests=()), np.zeros(0))
        place = replace(empty, local=(np.zeros(0),), residual=(stuck,), slopes=(np.zeros((len(stuck), 0)),))
    return posterior_of(Fit(model, place))


@dataclass(frozen=True)
class ShownState:
    """What two sensors would show of a state: the cycle (p,) about its mean, energy and amplitude; None: no motion."""

    cycle: FloatArray | None
    energy: float | None
    amplitude: float | None


def seen(observation: CycleObservation, values: Mapping[str, float], state: SteadyState) -> ShownState:
    """Return a state as the sensors would show it: through the gain and the lag that the fit found."""
    measurement = observation.measurement
    if state.orbit is None:
        return ShownState(None, state.energy_per_cycle, state.response_amplitude)
    tau, periods, orbit = measurement.cycle.tau, state.period_cycles or 1, state.orbit

    def mean_cycle(late: float) -> FloatArray:
        cycles = [orbit.at(tau + late + 2.0 * math.pi * period)[0] for period in range(periods)]
        return np.asarray(np.stack(cycles).mean(axis=0))

    plain = mean_cycle(0.0)
    gain, late = observation.gain_and_phase(complex(np.fft.rfft(plain)[1]) * 2.0 / len(plain), values)
    amplitude = None if state.response_amplitude is None else gain * state.response_amplitude
    cycle = gain * mean_cycle(late) + values.get("base_in_mass", 0.0) * np.cos(tau)
    for name, power in BENDS.items():
        cycle = cycle + values.get(name, 0.0) * bent(cycle, power)
    energy = state.energy_per_cycle
    if energy is not None and (gain != 1.0 or late != 0.0):
        energy += _area(cycle, state.problem) - _area(plain, state.problem)
    return ShownState(in_band(cycle - cycle.mean(), measurement.cycle.kept), energy, amplitude)


def _area(cycle: FloatArray, problem: Problem) -> float:
    """Loop area of a cycle (p,) over the simulated base: the integral of f dx, by their harmonics."""
    base = problem.base
    count = min(base.harmonics, len(cycle) // 2 - 1)
    lines = np.fft.rfft(cycle)[1 : count + 1] * (2.0 / len(cycle))
    return float(math.pi * np.sum(np.arange(1, count + 1) * (np.conj(base.lines[:count]) * 1j * lines).real))


def state_of(observation: CycleObservation, values: Mapping[str, float], solver: Solver = "auto") -> SteadyState:
    """Return the predicted steady state; a solver without a frame's dashpot leaves out one that was only fitted."""
    plain = solver in UNDAMPED and "frame_damping_ratio" not in observation.held
    kept = {name: value for name, value in values.items() if not (plain and name == "frame_damping_ratio")}
    if not observation.single:
        return observation.state(kept) or SteadyState(observation.problem(kept), "exact", "not found")
    return steady_state(observation.problem(kept), solver=solver)


MEASURED = (
    *("source", "status", "reason", "frequency_ratio", "energy_per_cycle", "response_amplitude", "stops_per_cycle"),
    *("regime", "material", "normal_force_n"),
)
"""What a comparison repeats of its measurement."""


def compared(
    measurement: Measurement, scene: Scene, found: Posterior, ladder: Ladder | None, solver: Solver
) -> Comparison:
    """Return a measured cycle over the prediction of a posterior, diagnosed and judged."""
    observation = cycle_of(found.tests[0])
    state = state_of(observation, found.values(), solver)
    prediction, cycle = seen(observation, found.values(), state), measurement.cycle
    nrmse = None if prediction.cycle is None else observation.left(prediction.cycle, found.values())
    floor = observation.cycles.floor
    misfit = None if nrmse is None else nrmse / floor
    explained = misfit is not None and misfit <= EXPLAINED
    diagnosis = diagnose(found, scene, explained=explained)
    found, verdict = diagnosis.posterior, _verdict(misfit, diagnosis)
    parameters = found.parameters()
    said = [*measurement.warnings, *found.warnings, *diagnosis.said, *caveats(found, parameters), *state.warnings]
    said += _of_verdict(observation, floor, verdict, misfit, ladder)
    if ladder is not None:
        said += _required_untold(observation, parameters)
        said += [f"law {name}: {why}" for name, why in ladder.left_out.items()]
    if prediction.cycle is None:
        said.append(f"no prediction: {state.outcome}")
    rows, points = _rows(ladder, nrmse)
    amplitude, normal_force = measurement.base_amplitude, observation.normal_force
    friction = friction_of(found, scene, measurement.sources, amplitude=amplitude, normal_force=normal_force)
    words = f"{observation.law.name}{_judged_words(nrmse, misfit, verdict)}"
    contact = replace(_contact(found, scene, state, prediction, words, said), laws=points)
    return Comparison(
        **{key: getattr(measurement, key) for key in MEASURED},
        warnings=tuple(said),
        law=observation.law.name,
        predicted_energy_per_cycle=prediction.energy,
        predicted_response_amplitude=prediction.amplitude,
        predicted_stops_per_cycle=state.stops_per_cycle,
        predicted_regime=state.regime,
        energy_difference=None if prediction.energy is None else prediction.energy / measurement.energy_per_cycle - 1,
        response_nrmse=nrmse,
        response_floor=floor,
        misfit=misfit,
        verdict=verdict,
        parameters={name: asdict(e) for name, e in parameters.items()},
        model=model_words(
            observation.law, observation.place_words, observation.held, base_words(observation.base.harmonics)
        ),
        solver=state.solver,
        closure_error=state.closure_error,
        nuisances=found.nuisances(),
        levels=found.levels(),
        laws=rows,
        accuracy=scene.accuracy,
        tau=cycle.tau,
        base=cycle.base,
        measured=cycle.mass,
        predicted=prediction.cycle,
        contact=contact,
        budget={**measurement.budget, **friction.pop("budget")},
        **friction,
    )


def _contact(
    found: Posterior, scene: Scene, state: SteadyState, prediction: ShownState, said: str, warnings: Sequence[str]
) -> ContactForce:
    """Measured friction force over the predicted one; ``said``: law and verdict in words."""
    observation = cycle_of(found.tests[0])
    measurement, cycles = observation.measurement, observation.cycles
    late, cycle = observation.gain_and_phase(0.0, found.values())[1], measurement.cycle
    law = observation.law_at_contact(state, cycle.tau + late)
    seen = observation.measured_contact(state, late) or AtContact(*np.full((3, len(cycle.tau)), math.nan))
    return ContactForce(
        source=measurement.source,
        law=state.problem.law.name,
        tau=cycle.tau,
        displacement=seen.displacement,
        velocity=seen.velocity,
        force=seen.force + (0.0 if law is None else law.force.mean()),
        law_displacement=None if law is None else law.displacement - law.displacement.mean(),
        law_velocity=None if law is None else law.velocity,
        law_force=None if law is None else law.force,
        residual=None if prediction.cycle is None else cycle.mass - prediction.cycle,
        floor=cycles.floor * math.sqrt(cycles.power),
        laws={},
        unit_m=measurement.base_amplitude_m,
        turn=observation.turn,
        unit_n=None if scene.rig.stiffness is None else scene.rig.stiffness * measurement.base_amplitude_m,
        said=said,
        warnings=tuple(warnings),
    )


def _verdict(misfit: float | None, diagnosis: Diagnosis) -> Verdict | None:
    """Whether a law explains a cycle: strained, where only sensors or rig unlike what is declared make it do so."""
    if misfit is None:
        return None
    if misfit > EXPLAINED:
        return "strained" if diagnosis.answered else "misfit"
    return "strained" if diagnosis.strained else "explained"


def _judged_words(nrmse: float | None, misfit: float | None, verdict: Verdict | None) -> str:
    """The verdict as it stands behind a law's name.

    Examples
    --------
    >>> _judged_words(0.005, 0.5, "explained")
    ': explained, it leaves 0.5 % of the motion, 0.5 times the error of the measured cycle'
    """
    if nrmse is None or misfit is None:
        return ": no prediction"
    said = {"explained": "explained", "strained": "strained"}.get(verdict or "", "not explained")
    return f": {said}, it leaves {100 * nrmse:.2g} % of the motion, {misfit:.2g} times the error of the measured cycle"


def _rows(
    ladder: Ladder | None, nrmse: float | None
) -> tuple[tuple[dict[str, object], ...] | None, dict[str, tuple[int, float, float]]]:
    """The ladder's rows, and its points for a figure: parameters found, nrmse, log evidence of each law."""
    if ladder is None:
        return None, {}
    rows: list[dict[str, object]] = []
    points: dict[str, tuple[int, float, float]] = {}
    for rung in ladder.rungs:
        own = nrmse if rung.law.name == ladder.chosen.law.name else _nrmse_of_rung(rung)
        chosen = rung.law.name == ladder.chosen.law.name
        posterior = ladder.posterior if chosen else rung.posterior
        rows.append(
            {
                "law": rung.law.name,
                "parameters": {} if posterior is None else {n: asdict(e) for n, e in posterior.parameters().items()},
                "log_evidence": rung.log_evidence if math.isfinite(rung.log_evidence) else None,
                "response_nrmse": own,
                "held_out_nrmse": rung.held_out_nrmse,
                "required": rung.required,
                "seconds": rung.seconds,
                "note": rung.said or None,
            }
        )
        if own is not None and math.isfinite(rung.log_evidence) and rung.fit is not None:
            free = sum(u.law for u in rung.fit.model.unknowns)
            points[rung.law.name] = (free, own, rung.log_evidence)
    return tuple(rows), points


def _nrmse_of_rung(rung: Rung) -> float | None:
    if rung.fit is None:
        return None
    observation = cycle_of(rung.fit.model.tests[0])
    return observation.nrmse(rung.fit.residual())


def model_words(law: Law, place: str, held: Mapping[str, float], base: str) -> str:
    """Return the physics that was switched on, as words; ``place``: where it rubs; ``base``: what drove it."""
    held = {name: value for name, value in held.items() if name != "beta"}
    frame = held.pop("frame_damping_ratio", 0.0)
    if "static_ratio_up" in held and held["static_ratio_up"] == held.get("static_ratio_down"):
        held = {"static ratio": held.pop("static_ratio_up")} | held
        del held["static_ratio_down"]
    held |= {"frame damping": frame} if frame else {}
    return ", ".join([law.words, place, *(f"{name} {value:g}" for name, value in held.items()), base])


def base_words(count: int) -> str:
    """Return the base motion of so many harmonics as words."""
    return f"{count} base harmonics" if count > 1 else "cosine base"


def caveats(found: Posterior, parameters: Mapping[str, ParameterEstimate]) -> list[str]:
    """Say which parameters are not known."""
    beta, said = parameters["beta"], []
    if beta.u is not None and beta.u > VAGUE * beta.value:
        said.append(
            f"friction_ratio: known only to {100 * beta.u / beta.value:.2g} %: this test hardly tells it, or the law"
            " does not explain the test; see misfit and --budget"
        )
    law = {u.name for u in found.unknowns if u.law}
    said += [
        f"{name}: this test does not tell it; {limits_in_words(e.lower, e.upper)} (95 %)"
        for name, e in parameters.items()
        if name != "beta" and name in law and not e.told
    ]
    return said


def _of_verdict(
    observation: CycleObservation, floor: float, verdict: Verdict | None, misfit: float | None, ladder: Ladder | None
) -> list[str]:
    """What a reader must know of a law that does not explain the cycle, or that noise alone would let explain it."""
    if verdict == "explained" and floor > FAINT:
        faint = f"the measurement's own error is {100 * floor:.2g} % of the motion"
        return [
            f"verdict: explained says little here: {faint}, and most laws would pass; measure more or larger cycles"
        ]
    if misfit is None or misfit <= EXPLAINED:
        return []
    missed = f"what it misses is {misfit:.2g} times the standard error of the measured mean cycle"
    if ladder is not None:
        step = "no law that --law auto tried explains it"
    elif "beta" in observation.held:
        beta = observation.held["beta"]
        step = f"the friction ratio is held at {beta:g}: leave out --beta, and beta of [model.parameters], to fit it"
    else:
        step = "try --law auto"
    return [f"verdict: {observation.law.name} does not explain this cycle: {missed}; {step}"]


def _required_untold(observation: CycleObservation, parameters: Mapping[str, ParameterEstimate]) -> list[str]:
    """Say of a term that is required though no value of it is known why both are so."""
    return [
        f"law: the recording requires the term {term.name}, for without it cycles are predicted worse; how much of it"
        " there is it does not tell, for errors of sensors and rig do nearly the same: declare them in [sensors], [rig]"
        for term in observation.law.terms
        if (own := [parameters[p.name] for p in term.parameters if p.name not in observation.held and not p.whole])
        and term.name != "coulomb"
        and not any(e.told for e in own)
    ]


def friction_of(
    found: Posterior, scene: Scene, sources: Sources, *, amplitude: Estimate, normal_force: float | None, test: int = 0
) -> dict[str, Any]:
    """Return friction ratio, force (N) and coefficient as estimates, and what adds to their uncertainty.

    By the names of a comparison's fields: ``friction``, ``force``, ``coefficient``, ``budget``. ``amplitude``: Y [m],
    that the friction ratio is over; ``normal_force``: N, if it is known.
    """
    beta = found.parameters(test)["beta"]
    friction = Estimate(beta.value, beta.se, beta.u)
    unit = amplitude.u / amplitude.value if amplitude.u is not None and amplitude.value else None
    unit = math.hypot(amplitude.relative_se or 0.0, unit_uncertainty(sources)) if unit is None else unit
    force = friction.scaled(scene.rig.stiffness).scaled(amplitude.value)
    relative: dict[str, float] = {}
    if force.value is None or amplitude.relative_se is None or beta.se is None or beta.u is None or not beta.value:
        force = Estimate(force.value)
    else:
        relative = {"friction ratio": beta.u / beta.value, "stiffness": sources.stiffness, "base amplitude": unit}
        se = math.hypot(beta.se / beta.value, amplitude.relative_se)
        force = Estimate(force.value, force.value * se, force.value * _quadrature(relative.values()))
    coefficient = force.over(normal_force)
    whole = relative | {"normal force": sources.normal_force}
    if coefficient.u is not None and coefficient.value is not None:
        coefficient = coefficient.with_u(coefficient.value * _quadrature(whole.values()))
    budget = {"friction_ratio": found.shares("beta", test)}
    for name, estimate, causes in (("friction_force_n", force, relative), ("friction_coefficient", coefficient, whole)):
        if estimate.value is not None and relative:
            budget[name] = {cause: estimate.value * share for cause, share in causes.items() if share}
    return {"friction": friction, "force": force, "coefficient": coefficient, "budget": budget}


def _quadrature(shares: Sequence[float] | Any) -> float:
    return math.sqrt(math.fsum(share**2 for share in shares))
