"""What is said of a comparison: verdict, model, caveats, and friction in newtons with what adds to its error."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from frictionlab.inference.comparison import Verdict
from frictionlab.inference.ladder import CHEAP, Ladder, left_for_work
from frictionlab.inference.observation import Observation
from frictionlab.inference.observations import OfCycles
from frictionlab.inference.posterior import EXPLAINED, Posterior, limits_in_words
from frictionlab.scene import Scene
from frictionlab.simulator import SteadyState
from frictionlab.simulator.laws import Law
from frictionlab.uncertainty import Estimate, unit_uncertainty

FAINT = 0.1  # error of the measured cycle over its size from which nearly any law explains it
VAGUE = 0.1  # relative uncertainty from which a friction ratio is called vague
RESTLESS = 0.02  # error of the measured cycle over its size that steady motions do not have
OUTLASTS = 100.0  # times the cycles measured: what disturbs a motion so long has not died out in them
START = 0.3  # of what a law misses, or of the noise: of a start as large as the motion, less than that is gone
SMALLEST, LARGEST = 8e-3, 5.0  # friction coefficients of dry contacts; 0.8 of grams taken for newtons is 0.008
UNLIKELY = 100.0  # of log evidence: more than unknowns that are not needed cost
ANOTHER = "another law may explain it: --law auto looks for one"
UNSETTLED = "motion that is not steady"
NOT_DETERMINED = "this test does not determine it"


def verdict_of(
    misfit: float | None, *, strained: bool, answered: bool = False, unsettled: bool = False
) -> Verdict | None:
    """Return whether a law explains a test: strained, where only sensors or rig unlike what is declared make it do so.

    ``answered``: whether another cause than the law explains what the law does not; ``unsettled``: whether the motion
    cannot have become the steady state predicted, so that the law alone explains nothing.
    """
    if misfit is None:
        return None
    if misfit > EXPLAINED:
        return "strained" if answered else "misfit"
    return "strained" if strained else "misfit" if unsettled else "explained"


def better_of(ladder: Ladder, misfit: float) -> str:
    """Return the laws of a ladder that leave less than an unexplained one, though evidence does not require them.

    One that leaves less of the motion and is far less likely misses the force beside it.
    """
    most, least = EXPLAINED / misfit * (ladder.chosen.nrmse or 0.0), ladder.chosen.log_evidence - UNLIKELY
    better = [
        rung.law.name
        for rung in ladder.rungs
        if rung.nrmse is not None and rung.nrmse <= most and rung.log_evidence > least
    ]
    if better:
        return f"the law {' or '.join(better)} would, but the evidence does not require so much: record more cycles"
    spent, laws = left_for_work(ladder.left_out), [rung.law for rung in ladder.rungs]
    dear = dict.fromkeys(t.name for law in laws for t in law.terms if t.kind in ("smooth", "inner"))
    alone = [name for name in dear if not any(law.has(name) and len(law.terms) > 2 for law in laws)]
    sums = f", and sums of {', '.join(alone)} with {', '.join(CHEAP)} were not tried" if alone else ""
    do = f"; do: --law {spent[0]}, left out for its work" if spent else ""
    return f"no law that --law auto tried{' to the end' if spent else ''} explains it{sums}{do}"


def never_settles(state: SteadyState, cycles: int, floor: float) -> str | None:
    """Say that cycles which differ cannot have become a steady state whose disturbances outlast them by far.

    ``floor``: error of the measured mean cycle over its rms.
    """
    lasts = math.inf if state.memory >= 1.0 else -1.0 / math.log(max(state.memory, 1e-300))
    if floor < RESTLESS or lasts < OUTLASTS * cycles:
        return None
    return (
        f"verdict: the motion is not steady (its mean cycle is known to {100 * floor:.2g} %) and cannot have become so:"
        f" a disturbance of the steady state lasts {lasts:.2g} cycles, {cycles} were measured; the error of the"
        " friction ratio is as large as itself; do: measure farther from resonance, or give rig.damping_ratio"
    )


def start_left(observation: OfCycles, state: SteadyState, nrmse: float) -> str:
    """Say what to do about the start of a recording that may be what a law misses; nothing where it is not.

    It has not died out in the cycles left out by the memory of the ``state``, or the motion settled only after them.
    """
    memory, drive, cycles = state.memory, observation.turn / (2.0 * math.pi), observation.used
    if 0.0 < memory < 1.0:
        in_mean = memory ** (observation.left_out_s * drive) * (1.0 - memory**cycles) / (cycles * (1.0 - memory))
        if in_mean >= START * nrmse:
            needed = math.ceil(math.log(START * observation.floor) / math.log(memory) / drive)
            cut = f"--transient {needed}, or " if needed < observation.left_out_s + cycles / drive else ""
            return (
                f"the start of the recording may still be in it, for a disturbance of this motion lasts"
                f" {-1.0 / math.log(memory):.2g} cycles: {cut}record longer"
            )
    at = observation.settles_later_s
    if at is None:
        return ""
    how = "record longer" if at == math.inf else f"--transient {at:.3g}"
    return f"the motion had not settled when what is measured begins: {how}"


def model_words(law: Law, place: str, held: Mapping[str, float], base: str) -> str:
    """Return the physics that was switched on, as words; ``place``: where it rubs; ``base``: what drove it."""
    held = {name: value for name, value in held.items() if name != "beta"}
    frame = held.pop("frame_damping_ratio", 0.0)
    if "static_ratio_up" in held and held["static_ratio_up"] == held.get("static_ratio_down"):
        held = {"static ratio": held.pop("static_ratio_up")} | held
        del held["static_ratio_down"]
    held |= {"frame damping": frame} if frame else {}
    return ", ".join([law.words, place, *(f"{name} {value:g}" for name, value in held.items()), base])


def doubts(
    found: Posterior,
    seen: Observation,
    verdict: Verdict | None,
    misfit: float | None,
    ladder: Ladder | None,
    *,
    step: str,
    first: str = "",
) -> Iterator[str]:
    """Yield what is not known of a law, why it does not explain a test, or why it says little that it does.

    ``seen``: what it was compared with; ``step``: to take without a ladder; ``first``: before any other.
    """
    observation, parameters = found.tests[0].observation, found.parameters()
    beta, law = parameters["beta"], {u.name for u in found.unknowns if u.law}
    if beta.u is not None and beta.lower is None and beta.upper is not None:
        yield f"friction_ratio: no friction is seen: at most {beta.upper:.2g} (95 %)"
    elif beta.u is not None and beta.u > VAGUE * beta.value:
        yield (
            f"friction_ratio: known only to {100 * beta.u / beta.value:.0f} %: this test hardly determines it, or the"
            " law does not explain the test; see misfit and --budget"
        )
    for name, e in parameters.items():
        if name != "beta" and name in law and not e.told:
            yield f"{name}: {NOT_DETERMINED}; {limits_in_words(e.lower, e.upper)} (95 %)"
    if verdict == "explained" and observation.floor > FAINT:
        faint = f"the measurement's own error is {100 * observation.floor:.2g} % of the motion"
        yield f"verdict: explained says little here: {faint}, and most laws would pass; measure more or larger cycles"
    if misfit is not None and misfit > EXPLAINED:
        step = step if ladder is None else better_of(ladder, misfit)
        if ladder is None and "beta" in observation.held:
            held = f"{observation.held['beta']:g}"
            step = f"the friction ratio is held at {held}: leave out --beta, and beta of [model.parameters], to fit it"
        words = f"does not explain this {seen.kind}"
        missed = f"what it misses is {misfit:.3g} times the {seen.noise_words}"
        if verdict == "strained":
            words = f"explains this {seen.kind} only with a rig or sensors unlike the scene"
            step = "other warnings name what to check"
        step = f"{first}; else {step}" if first else step
        yield f"verdict: {observation.law.name} {words}: {missed}. {step[0].upper()}{step[1:]}"
    for term in observation.law.terms if ladder is not None else ():
        own = [parameters[p.name] for p in term.parameters if p.name not in observation.held and not p.whole]
        if own and term.name != "coulomb" and not any(e.told for e in own):
            yield (
                f"law: the recording requires the term {term.name}, for without it cycles are predicted worse; how"
                " much of it there is it does not show, for errors of sensors and rig do nearly the same: declare them"
                " in [sensors], [rig]"
            )
    yield from not_tried(ladder)


def not_tried(ladder: Ladder | None) -> Iterator[str]:
    """Yield which laws a ladder did not try, or not to the end, and why; those of one reason in one sentence."""
    left_out = ladder.left_out if ladder is not None else {}
    for why in dict.fromkeys(left_out.values()):
        names = [name for name in left_out if left_out[name] == why]
        yield f"{'law' if len(names) == 1 else 'laws'} {', '.join(names)}: {why}"


def unlike_contacts(coefficient: Estimate, normal_force: float | None) -> list[str]:
    """Return a doubt of the normal force (N), and of lengths read in another unit, where no contact rubs like this."""
    value, u = coefficient.value or 0.0, coefficient.error or 0.0
    if value - 3.0 * u <= LARGEST and not 0.0 < value + 3.0 * u < SMALLEST:
        return []
    asked = f"is the normal force {normal_force:g} N?{' Are lengths in another unit?' * (value < SMALLEST)}"
    return [f"friction_coefficient: {value:.3g}: no dry contact has it: {asked}"]


def friction_of(found: Posterior, scene: Scene, amplitude: Estimate) -> dict[str, Any]:
    """Return friction ratio, force (N) and coefficient as estimates, and what adds to their uncertainty.

    By the names of a comparison's fields: ``friction``, ``force``, ``coefficient``, ``budget``. ``amplitude``: Y [m],
    that the friction ratio is over. A measured force says them where there is one.
    """
    observation = found.tests[0].observation
    sources, normal_force = observation.sources, observation.normal_force
    beta = found.parameters()["beta"]
    unit = amplitude.u / amplitude.value if amplitude.u is not None and amplitude.value else None
    unit = math.hypot(amplitude.relative_se or 0.0, unit_uncertainty(sources)) if unit is None else unit
    force: Estimate = beta.scaled(scene.rig.stiffness).scaled(amplitude.value)
    relative: dict[str, float] = {}
    if force.value is None or amplitude.relative_se is None or beta.se is None or beta.u is None or not beta.value:
        force = Estimate(force.value)
    else:
        relative = {"friction ratio": beta.u / beta.value, "stiffness": sources.stiffness, "base amplitude": unit}
        se = math.hypot(beta.se / beta.value, amplitude.relative_se)
        force = Estimate(force.value, force.value * se, force.value * math.hypot(*relative.values()))
    coefficient = force.over(normal_force)
    whole = relative | {"normal force": sources.normal_force}
    if coefficient.u is not None and coefficient.value is not None:
        coefficient = coefficient.with_u(coefficient.value * math.hypot(*whole.values()))
    budget = {"friction_ratio": found.shares("beta")}
    for name, estimate, causes in (("friction_force_n", force, relative), ("friction_coefficient", coefficient, whole)):
        if estimate.value is not None and relative:
            budget[name] = {cause: estimate.value * share for cause, share in causes.items() if share}
    by_force = observation.in_newtons(found)
    budget |= by_force.pop("budget", {})
    return {"friction": beta, "force": force, "coefficient": coefficient, "budget": budget} | by_force
