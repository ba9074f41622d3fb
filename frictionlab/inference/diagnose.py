"""Is it the law, or the rig? Where a fit strains or misses, other causes are each tried free, and the answer is named.

The natural frequency over a factor of two, the frame's damping, the lag, a cubic spring and play in the frame are no
part of a law, and a law that bends to them explains a recording and predicts none. A spring that is not linear is known
from the measured motion itself: its force is what the frame's stretch makes it, and it drives the mass like the base.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import FrictionlabError
from frictionlab.inference.fit import Fit, Test, beside, descend, fit_from, looked, weighed, with_scatter
from frictionlab.inference.observation import NO_MOTION
from frictionlab.inference.observations import CycleObservation, OfCycles, cycle_of, mean_cycle
from frictionlab.inference.posterior import EXPLAINED, MISSED, Posterior, explains, infer, model_of
from frictionlab.inference.starts import at_medians, point_at, starting_points
from frictionlab.inference.unknowns import STRAINED, Unknown
from frictionlab.scene import Scene
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.problem import Meter
from frictionlab.uncertainty import with_digits

NEAR_RESONANCE = 0.8  # frequency ratio from which all other causes are tried whatever the fit says
OF_START = 0.5  # of what a law misses: where the cycles show so much of the start, nothing else is asked for
FEW = 4  # data an unknown: with fewer nothing strains, whatever the rig is
ALWAYS = ("spring_cubic", "play", "load_by_base", "mass_filter_s", "natural_frequency")  # on every fit, dearest last
ANSWERS = 5.0  # logarithm of the Bayes factor from which a cause is named
BY_FAR = 50.0  # the same of a cause that leaves a misfit, or where the law explains as well and nothing strains
OFF = 2.0  # standard uncertainties from what is declared from which a cause let free is one
AS_LIKELY = -4.0  # the same from which what it moves belongs to u
BETTER = 0.7  # of what a law misses: a richer one that leaves less was right to be asked
RICHER = ("place", "speed")  # what a rigid law that leaves a misfit is held against
VARIED, BY_ENERGY = "if friction may vary with place and speed", "by the energy taken in over the path"
OTHER_CAUSE = "another cause than the law"
FOLLOWS = "normal force that follows the base's acceleration"
LEAST_FREE = 0.1  # share of what is known of a fact that its data must say: else the prior alone does
STEPS, WORK = 25, 1.5e5  # of the fit with a cause let free, and what all of them may cost
NEARLY = 1e2  # its sum of squares over the usual tolerance: 0.02 of a standard deviation is near enough
WIDE = 0.3  # relative: prior of a natural frequency that is let free
TRIED = {
    "natural_frequency": [x / WIDE for x in (0.0, -0.45, -0.3, -0.2, -0.1, -0.05, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0)],
    "frame_damping_ratio": [0.2, 1.0],
    "lag_s": [-1.0, 1.0],
    "spring_cubic": [-0.4, 0.4],
    "play": [0.5, 2.0],
    "load_by_base": [-0.5, 0.5],
    "mass_filter_s": [0.2, 0.8],
    "filter_s": [0.2, 0.8],
}
"""Coordinates at which each cause is tried."""
USUAL_PLAY = 1e-5  # m to either side: what a bolted frame may have
HIDDEN_PLAY = (
    "friction_ratio: its error of {:.1g} assumes a frame without play. {:.0f} um of play to either side would look like"
    " friction here and move the ratio by {:.2g}: make sure that nothing is loose"
)
ALONG_THE_PATH = (
    "friction_ratio: friction that is higher amid the path than at its ends looks like a dashpot: tests at other base"
    " amplitudes tell which"
)
VARIES = 0.1  # of friction, along the path: with an error above it, nothing is said


@dataclass(frozen=True)
class Diagnosis:
    """A posterior whose errors hold what other causes move, and what is to be said.

    ``strained``: whether sensors, rig or another cause stand where the scene does not put them; ``answered``: whether
    another cause than the law explains what the law does not; ``causes``: the sentences on other causes.
    """

    posterior: Posterior
    strained: bool
    said: tuple[str, ...]
    answered: bool = False
    causes: tuple[str, ...] = ()


def diagnose(found: Posterior, scene: Scene, *, explained: bool) -> Diagnosis:
    """Return what else may have made the recording of one test; ``explained``: its law leaves no more than noise."""
    fitted, strained, said = found, bool(found.strained), list[str]()
    if not found.unknowns:
        return Diagnosis(found, strained, tuple(said))
    if strained or not explained:
        found, said = against_richer(found)
    found, named, answered, hidden = other_causes(found, [0], explained=explained)
    cycle = cycle_of(found.tests[0])
    starts = cycle.starting and misses_start(found.fit)
    if (starts or cycle.settles_later_s is not None) and not explained:
        named = []  # a start that is still in the cycles looks like any cause
    at = fitted.values()  # one that is hardly elsewhere when it is free only makes the fit less sure
    named = [(c, o) for c, o in named if abs(o.values()[c.name] - at.get(c.name, 0.0)) > OFF * _known_to(c, o)]
    moved = _unnamed(fitted, named)
    rival = f", or {fitted.unknowns[moved[0]].words} (either fits)" if explained and len(moved) == 1 else ""
    facts = strained_facts(fitted, scene, named) if explained else ()
    causes = [named_cause(cause, other, found, scene, rival) for cause, other in named]
    answered = answered and bool(named) and not explained
    said = [*causes, *facts, *said, *hidden, *(along_the_path(found) if explained else ())]
    return Diagnosis(found, strained or bool(named), tuple(said), answered, (*causes, *hidden))


def along_the_path(found: Posterior) -> Iterator[str]:
    """Yield that friction along the path may be what one test's law takes for a dashpot, if it errs by no more.

    Of a motion near a sine of amplitude X, place and speed know each other: ``z^2 + (v / w)^2 = X^2``.
    """
    friction = found.estimate("beta", 0)
    is_known = (friction.u or math.inf) < VARIES * (friction.value or 0.0)
    if is_known and found.tests[0].observation.single and found.law(0).has("speed"):
        yield ALONG_THE_PATH


def _unnamed(found: Posterior, named: Sequence[tuple[Unknown, Fit]]) -> list[int]:
    """Which strained unknowns are not among the causes named."""
    return [k for k in found.strained if found.unknowns[k].name not in [cause.name for cause, _ in named]]


def _known_to(cause: Unknown, other: Fit) -> float:
    """Standard uncertainty of a cause by the fit in which it is free."""
    k = other.find(cause.name)
    return 0.0 if k is None else cause.sd * math.sqrt(float(np.linalg.inv(other.precision)[k, k]))


def misses_start(found: Fit) -> bool:
    """Whether half of what a fit misses may be what cycles, its tests, show of their starts."""
    seen = [test.observation for test in found.model.tests]
    left = [o.start_seen(found.values(i)) for i, o in enumerate(seen) if isinstance(o, OfCycles)]
    return len(left) == len(seen) and math.sqrt(float(np.mean(np.square(left)))) > OF_START * found.nrmse()


def strained_facts(found: Posterior, scene: Scene, named: Sequence[tuple[Unknown, Fit]] = ()) -> Iterator[str]:
    """Yield which known quantity the fit had to move away from what is known of it, and what to declare instead.

    Of a law that explains the test: any other law finds a lag or a frequency that makes up for what it lacks. What is
    to be declared is what the data say without the prior, which has pulled the value found; its error holds how far,
    for that is one linear step, and data that say too little (`LEAST_FREE`) ask for nothing. Causes that are ``named``
    say their own value; several others that were moved for want of one of these are not to be declared.
    """
    moved = _unnamed(found, named)
    if len(moved) > 1 and any(_strain(other, cause) < STRAINED for cause, other in named):
        each = ((found.unknowns[k], abs(float(found.fit.point[k]))) for k in moved)
        words = ", ".join(f"{u.words} ({c / u.known_to:.2g} times)" for u, c in each)
        yield f"friction_ratio: without that cause the fit moved much that the scene knows, over its u: {words}"
        return
    for k in found.strained:
        u, seen = found.unknowns[k], found.nuisances().get(found.unknowns[k].name)
        if seen is None:
            continue
        c = float(found.fit.point[k])
        times, says = abs(c) / u.known_to, 1.0 - u.hold(c) * float(found.plain[k, k])
        free = 1.0 / max(says, LEAST_FREE)
        asked = u.mean + u.sd * c * free, math.hypot(seen["u"] * math.sqrt(free), u.sd * c * (free - 1.0))
        declare = "" if k not in moved or says < LEAST_FREE else to_declare(u.name, *asked, scene)
        against = "what is assumed where none is declared: measure it and declare it"
        if not u.assumed:
            against = "its standard uncertainty: check it"
        by = u.unit[0] * (seen["value"] - u.mean)
        unit = f" {u.unit[1]}" if u.unit[1] else ""
        key, fits = ("", f" ({declare})") if declare else (f" ({u.key})", "")
        yield f"friction_ratio: the fit moved the {u.words}{key} by {by:.2g}{unit}, {times:.2g} times {against}{fits}"


def to_declare(name: str, value: float, u: float, scene: Scene) -> str:
    """Return what of a scene would fit, with key, number and unit, and the two lines that declare it.

    ``value``, ``u``: of the unknown, and its standard uncertainty; nothing for what no line declares.
    """
    frequency = scene.rig.natural_frequency
    if name == "lag_s":
        value += scene.sensors.lag_s
        table, key, said = "sensors", name, f"{1e3 * value:+.3g} ms"
    elif name == "natural_frequency" and frequency:
        value, u = frequency * (1.0 + value), frequency * u
        table, key, said = "rig", "natural_frequency_hz", f"{with_digits(value, u)} Hz"
    elif name == "frame_damping_ratio" and value >= 0.0:
        table, key, said = "rig", "damping_ratio", f"{value:.3g}"
    elif name.endswith("filter_s") and value > 0.0:
        key = name.replace("_s", "_hz")
        return f"sensors.{key} = {0.5 / math.pi / value:.3g} Hz would fit"
    else:
        return ""
    return f"{table}.{key} = {said} would fit: {key} = {with_digits(value, u)} and {key}_u = {u:.2g}"


def _causes(observation: CycleObservation, *, misses: bool, few: bool) -> tuple[Unknown, ...]:
    """What is tried free, a filter where a law misses: each with a prior so wide that only the data hold it.

    ``few``: those alone that are tried on every fit.
    """
    unit, lag = observation.unit, max(5.0 / observation.rate, 0.04 * math.pi / observation.turn)
    frequency = {"sd": WIDE, "low": -1.8, "high": 4.0, "key": "rig.natural_frequency_hz"}
    causes: tuple[Unknown, ...] = (
        Unknown("natural_frequency", "natural frequency", **frequency),  # type: ignore[arg-type]
        Unknown("frame_damping_ratio", "frame's damping", sd=0.05, low=0.0, folded=True, key="rig.damping_ratio"),
        Unknown("lag_s", "lag", sd=lag, key="sensors.lag_s", unit=(1e3, "ms")),
        Unknown("spring_cubic", "cubic spring", sd=0.05, unit=(100.0, "% of its force at Y by a cubic")),
        Unknown("play", "play in the frame", sd=3e-5 / unit, low=0.0, folded=True, unit=(1e6 * unit, "um either way")),
        Unknown("load_by_base", FOLLOWS, sd=0.2, unit=(100.0, "% where that is largest")),
    )
    place, delay = "low-pass filter in {}".format, (1e3, "ms of delay")
    filters = (
        Unknown("mass_filter_s", place("the mass's channel"), sd=lag, low=0.0, folded=True, unit=delay),
        Unknown("filter_s", place("both channels"), sd=lag, low=0.0, folded=True, unit=delay),
    )
    causes = causes if observation.wall == "fixed" and observation.single else causes[:3]
    causes = (*causes, *filters[: 2 if misses else 1]) if (observation.kept == 1.0).all() else causes
    return tuple(sorted((c for c in causes if c.name in ALWAYS), key=lambda c: ALWAYS.index(c.name))) if few else causes


def other_causes(
    found: Posterior, some: Sequence[int], *, explained: bool
) -> tuple[Posterior, list[tuple[Unknown, Fit]], bool, list[str]]:
    """Return the posterior whose errors hold what causes move, those to name with their fits, whether one explains.

    Then what is to be said of a usual play that the tests do not show, where it would move the friction ratio far.
    ``some``: the tests that show it; a cause is one fact of the rig, the same in all: what differs from test to test as
    it says is no scatter of the material. ``explained``: whether the laws leave no more than noise of them.
    """
    tests = [cycle_of(found.tests[i]) for i in some]
    plain = explained and not found.strained and max(test.r for test in tests) <= NEAR_RESONANCE
    few = plain and sum(len(test.data) for test in tests) >= FEW * len(found.unknowns)
    causes, enough = _causes(tests[0], misses=not explained, few=few), BY_FAR if plain and len(some) == 1 else ANSWERS
    try:
        main = _alone(found, some)
    except NO_MOTION:
        return found, [], False, []
    likely: list[tuple[float, Unknown, Fit]] = []  # the likeliest fit with each cause
    more, known, hidden = np.zeros(len(found.unknowns)), np.diag(found.covariance), 0.0
    friction = [k for k, u in enumerate(found.unknowns) if u.name == "beta"]
    before = (found.fit.point, known) if len(some) == 1 else (main.point, np.diag(np.linalg.inv(main.precision)))
    for cause in causes:
        tried = list[tuple[float, Fit]]()
        with suppress(*NO_MOTION):
            tried = [one for one in _tried(main, cause) if math.isfinite(one[0])]
        if not tried:  # or no motion with this cause: it shows nothing
            continue
        likely.append((tried[0][0], cause, tried[0][1]))
        hidden = _of_hidden_play(tried[0][1], cause, tests[0].unit) if cause.name == "play" else hidden
        assumed_none = cause.name == "play" and hidden > 0.0  # a warning says what a usual one would move
        for gain, other in tried:
            if gain > (ANSWERS if assumed_none else AS_LIKELY):
                apart, wider = _apart(main, other, *before)
                moved = np.hypot(apart, wider) if cause.name in ALWAYS and not assumed_none else apart
                more += math.exp(min(0.0, gain)) * moved**2
    named, answered = list[tuple[Unknown, Fit]](), False
    best = max((gain for gain, _, _ in likely), default=0.0)
    for gain, cause, other in sorted(likely, key=lambda one: -one[0]):
        far = (_apart(main, other, *before)[0][friction] > np.sqrt(known[friction])).any()
        fits = explained or explains(other, range(len(some)))
        answers = gain > max(enough, best - ANSWERS) and (fits or gain > BY_FAR)
        eases = _strain(other, cause) < max(STRAINED, _strain(found.fit, cause))
        if eases and (answers or (enough == ANSWERS and explained and gain > 0.0 and far)):
            named.append((cause, other))
            answered = answered or fits
    if (more > 0.09 * known).any():
        found = found.with_shift(OTHER_CAUSE, np.sqrt(more))
    error = found.estimate("beta", some[0]).u or math.inf
    is_silent = explained and not named and hidden > error
    return found, named, answered, [HIDDEN_PLAY.format(error, 1e6 * USUAL_PLAY, hidden)] if is_silent else []


def _alone(found: Posterior, some: Sequence[int]) -> Fit:
    """The same fit of some tests, weighed by noise alone, at its minimum; the mass stands where its law has it."""
    own, meter, tests = found.fit, Meter(WORK * math.sqrt(len(some))), list[Test]()
    for i in some:
        observation = cycle_of(own.model.tests[i])
        motion = observation.motion(own.values(i)) if observation.single else None
        stands = 0.0 if motion is None else float(mean_cycle(motion[0], len(observation.cycle.tau)).mean())
        tests.append(replace(own.model.tests[i], observation=replace(observation.metered(meter), stands=stands)))
    local, residuals, slopes = (tuple(each[i] for i in some) for each in (own.local, own.residuals, own.slopes))
    model = replace(own.model, tests=tuple(tests), most=STEPS)
    bare = replace(own, model=model, local=local, residuals=residuals, slopes=slopes, motions=())
    return with_scatter(weighed(bare, np.zeros(len(some))))


def _apart(main: Fit, other: Fit, point: FloatArray, known: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far the law's coordinates (m,) of another fit are from a point, and by how much less sure than ``known``."""
    apart, wider = np.zeros(len(point)), np.zeros(len(point))
    variance = np.diag(np.linalg.inv(other.precision))
    for i, test in enumerate(main.model.tests):
        for k in test.index.tolist():
            u, there = main.model.unknowns[k], other.find(main.model.unknowns[k].name, i)
            if u.law:
                apart[k] = abs((0.0 if there is None else float(other.point[there])) - float(point[k]))
                wider[k] = 0.0 if there is None else math.sqrt(max(float(variance[there] - known[k]), 0.0))
    return apart, wider


def _tried(main: Fit, cause: Unknown) -> list[tuple[float, Fit]]:
    """The fits with a cause let free, and how much likelier each is: one that strains nothing else goes first.

    A natural frequency is tried under the plainest law that bends too: a law found in a wrong rig is bent to it, and
    away from it no start leads to the right frequency.
    """
    freed, observation = _freed(main, cause), cycle_of(main.model.tests[0])
    found = [(_gain(main, freed), freed)]
    if cause.name == "natural_frequency" and observation.single and len(main.model.tests) == 1:
        law = law_of("coulomb+place+speed")
        plain = replace(model_of([observation.under(law)]), most=STEPS, tolerance=NEARLY)
        is_inside = all(law.has(term.name) for term in observation.law.terms)
        starts = [point_at(plain, main.values())] if is_inside else starting_points(plain)
        held = fit_from(plain, starts, tempers=False)
        freed = _freed(held, cause)
        found.append((min(_gain(main, freed), _gain(held, freed)), freed))
    return sorted(found, key=lambda one: (one[0] <= ANSWERS or _strain(one[1], cause) >= STRAINED, -one[0]))


def _strain(fit: Fit, cause: Unknown) -> float:
    """How many standard uncertainties sensors and rig were moved at most, this cause left out."""
    moved = zip(fit.model.unknowns, fit.point.tolist(), strict=True)
    return max((abs(at) / u.known_to for u, at in moved if not u.law and u.name != cause.name), default=0.0)


def _gain(main: Fit, other: Fit) -> float:
    """Logarithm of the Bayes factor of a cause; what not even it explains is counted as misfit of both."""
    shares = other.shares_missed()
    freed, own = (weighed(fit, shares) if shares.any() else fit for fit in (other, main))
    return freed.log_evidence - own.log_evidence


def _freed(main: Fit, cause: Unknown) -> Fit:
    """The fit with a cause let free: from the main fit's values, and from each value tried with friction to match."""
    unknowns, tests, first = list(main.model.unknowns), main.model.tests, cycle_of(main.model.tests[0])
    k = next((j for j, u in enumerate(unknowns) if u.name == cause.name), len(unknowns))
    unknowns[k:] = [cause, *unknowns[k + 1 :]]
    scatter, local = np.append(main.model.scatter, 0.0)[: len(unknowns)], main.local
    scatter[k] = 0.0
    if k == len(main.point):
        times = [np.append(t.factors, t.observation.factor(cause, first)) for t in tests]
        each = zip(tests, times, strict=True)
        tests = tuple(replace(t, index=np.append(t.index, k), factors=own) for t, own in each)
        local = tuple(np.append(d, 0.0) for d in local)
    open_ = replace(main.model, tests=tests, unknowns=tuple(unknowns), scatter=scatter, most=STEPS, tolerance=NEARLY)
    begun = [np.append(main.point, 0.0)[: len(unknowns)]]
    if cause.name == "natural_frequency" and "beta" in main.values():  # a wrong one changes the friction ratio with it
        with suppress(FrictionlabError):
            begun.append(at_medians(open_, point_at(open_, {}), [cycle_of(t).loop_friction_ratio for t in tests]))
    own, its = (cause.at(main.values().get(cause.name, 0.0)), *TRIED[cause.name]), np.arange(len(unknowns)) == k
    starts = (np.where(its, c, point) for c in own for point in begun)
    places = [place for start in starts if (place := looked(open_, start, local)) is not None]
    likeliest = sorted(places, key=lambda place: place.cost)[:2]
    fits = (descend(beside(place, main, k), true=False) for place in likeliest)
    return with_scatter(descend(min(fits, key=lambda fit: fit.cost + 2.0 * fit.reduced.log_volume)))


def _of_hidden_play(freed: Fit, play: Unknown, unit: float) -> float:
    """By how much a usual play moves the friction ratio; 0 where the recording would show it, or has no friction.

    At low frequency ratios a play p moves the ends of a stop as friction of ``k p`` does. ``freed``: the fit with it.
    """
    beta, k, usual = freed.find("beta"), freed.find(play.name), USUAL_PLAY / unit / play.sd
    if beta is None or k is None:
        return 0.0
    moved = np.linalg.inv(freed.precision)[k]
    if (1.0 / moved[k] - 1.0) * usual**2 >= STRAINED**2:
        return 0.0
    return abs(freed.model.unknowns[beta].slope(float(freed.point[beta])) * float(moved[beta] / moved[k])) * usual


def named_cause(cause: Unknown, other: Fit, found: Posterior, scene: Scene, rival: str = "") -> str:
    """Say which cause answers, or its ``rival``, its value, and what it makes of the friction of the first test."""
    value, u, frequency = other.values()[cause.name], _known_to(cause, other), scene.rig.natural_frequency
    who = "this recording asks" if len(found.tests) == 1 else "all tests together ask"
    if cause.name == "natural_frequency" and frequency:
        asks = f"{frequency:.6g} Hz is declared; {who} for {with_digits(frequency * (1 + value), frequency * u)} Hz"
    else:
        sign, unit = "" if cause.folded else "+", f" {cause.unit[1]}".rstrip()
        asks = f"{who} for {cause.unit[0] * value:{sign}.3g}{unit}"
    fits = explains(other, range(len(other.model.tests)))
    declare = to_declare(cause.name, value, u, scene) if fits else "it leaves less, but a misfit too"
    declared = f"; {declare}" if declare else ""
    own, there = found.values().get("beta"), other.values().get("beta")
    moves = "" if own is None or there is None else f". The friction ratio would be {there:.4g} in place of {own:.4g}"
    return f"rig: {cause.words}{rival}: {asks}{declared}{moves}; its error holds the difference"


def varied_friction(found: Posterior, tests: Sequence[int]) -> tuple[float, float] | None:
    """Return what the friction ratio would be if friction could vary with place and speed, and what that law leaves.

    ``tests``: of one material, fitted together; the ratio is that of the first, what is left the rms of their nrmse.
    None where the law takes no such term, has no motion with it, or misses hardly less (`BETTER`).
    """
    law = found.law(tests[0])
    more = [term for term in RICHER if not law.has(term)]
    if not more or law.kind != "rigid":
        return None
    richer, values = law_of("+".join((law.name, *more))), found.values(tests[0])
    free = [found.tests[i].observation.under(richer).metered(Meter(0.5 * WORK * len(tests))) for i in tests]
    try:
        if len(free) > 1 or free[0].shows_rig:
            fit = infer(free, near=values | {"gradient": 0.05}).fit
        else:
            model = model_of(free)
            fit = fit_from(model, [point_at(model, values | {"gradient": g}) for g in (0.05, -0.05)])
    except NO_MOTION:
        return None
    k, test = fit.find("beta"), fit.model.tests[0]
    if k is None:
        return None
    shared = fit.model.unknowns[k].value(float(fit.point[k])) * test.factor(k)
    before, leaves = found.fit.nrmse(tests), fit.nrmse()
    return (shared, leaves) if leaves < BETTER * before else None


def beside_the_law(found: Posterior, tests: Sequence[int]) -> tuple[Posterior, float, str]:
    """Return the posterior whose errors hold what another law says of the friction that some tests share.

    With it how many times as large that is, and in words by which law; none where nothing says another. ``tests``: of
    one material. By how much place and speed in the law, or the energy of their motions over its path, would move it:
    at the edge of sticking a fit looks certain however wrong it is, and energy over path has no edge. Only laws of
    contacts that do not yield are held against these, and those of speed against energy alone.
    """
    k, seen, times, said, leaves = found.fit.find("beta", tests[0]), [found.tests[i] for i in tests], 1.0, "", math.inf
    if k is None or seen[0].observation.law.kind not in ("rigid", "smooth"):
        return found, times, said
    varied = varied_friction(found, tests)
    if varied is not None:
        times, leaves, said = varied[0] / found.shared(k, tests[0])[0], varied[1], VARIED
    dashpot = seen[0].observation.law.has("speed")
    if not dashpot and leaves > EXPLAINED * math.sqrt(float(np.mean([test.observation.floor**2 for test in seen]))):
        energy = by_energy(found, tests)
        if abs(energy - 1.0) > max(abs(times - 1.0), 0.01):
            times, said = energy, BY_ENERGY
    shift = np.zeros(len(found.unknowns))
    shift[k] = (times - 1.0) / found.relative(k)
    return found.with_shift(MISSED, shift) if said else found, times, said


def by_energy(found: Posterior, tests: Sequence[int]) -> float:
    """Return how many times the friction ratio of some tests is their energy over the path; 1 where none says it."""
    each = ((found.tests[i].observation.friction_by_energy, found.values(i)) for i in tests)
    return float(np.median([energy / values["beta"] for energy, values in each if energy] or [1.0]))


def against_richer(found: Posterior) -> tuple[Posterior, list[str]]:
    """Return the posterior of one test whose errors hold what its law misses, and what is to be said of it."""
    found, times, why = beside_the_law(found, [0])
    own = found.values().get("beta", math.nan)
    said = f"friction_ratio: {own:.4g} under this law, {own * times:.4g} {why}. Its error holds the difference"
    return found, [said] if why else []
