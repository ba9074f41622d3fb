"""The ladder of laws: the simplest law that a recording requires, by its evidence and by cycles that were left out.

A rung is climbed only if the logarithm of its Bayes factor is above 5 and the cycles left out of the fit are predicted
better by more than their error. Nuisances stand beside every law, so that what a lag or a detuned frame explains is not
taken for a property of the contact.
"""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError, ParameterError, SimulationError, UsageError
from frictionlab.identification.coordinates import Coordinate, strains, values_of
from frictionlab.identification.engines import STATES, prepare, warm
from frictionlab.identification.family import Family
from frictionlab.identification.fit import HOPELESS, Fit, fit, followed, log_evidence, misfit_is_noise
from frictionlab.identification.forward import Forward
from frictionlab.identification.held_out import held_out
from frictionlab.identification.identify import (
    Identified,
    forward_of,
    identify,
    with_errors,
)
from frictionlab.identification.indistinct import held_against
from frictionlab.identification.observed import Observed, observe_cycle
from frictionlab.identification.valleys import FROM_ENERGY, start_at, starts_of
from frictionlab.simulator.laws import TERMS, Law, law_of
from frictionlab.simulator.meter import Meter, OverspentError
from frictionlab.uncertainty import Sources

FloatArray = NDArray[np.float64]
EXACT = ("place", "speed", "breakaway", "compliance")
CHEAP = EXACT[:3]  # a rigid contact: some ten microseconds a steady state
NUMERIC = ("logarithm", "stribeck", "dahl", "bouc-wen")  # milliseconds a steady state ...
DEAR = ("lugre", "rate-state")  # ... and up to a second
WORK = 1.5e6  # steps of integration of all laws tried: some fifteen seconds, ...
EXACT_WORK = 5e5  # ... of which elastic contacts may use so many: what they leave is added to the numeric laws' ...
RESERVE = 3e5  # ... and of the values of the one that is required, found once more from all friction ratios
SPENT = "the ladder had used up its {steps:,.0f} steps of simulation for such laws; give --law {name} to fit it alone"
REQUIRED = 5.0  # logarithm of the Bayes factor from which a rung is climbed
DEEPER = 1.0  # chi-square by which a second search of a simpler law must find a better valley
PUSHED = 3.0  # deviations of its prior from which what is known of sensors and rig is not where a richer law begins
SHORT = 8  # steps from which the best start of an elastic law is told
TRIALS = (1.0, -1.0, 0.0)  # deviations from its prior's middle at which a new parameter is tried
SCALES = (-1.5, -1.0, -0.5, 0.0, 0.5)  # the same for one on a logarithmic scale: where it does most, first


@dataclass(frozen=True)
class Rung:
    """One law on the ladder.

    ``held_out`` (2, parts): of the cycles left out, part by part, each by a fit to the others, the nrmse and the sum of
    squares over the noise's; ``required``: whether the recording requires this law over the simpler ones;
    ``seconds``: what it took.
    """

    identified: Identified
    log_evidence: float
    held_out: FloatArray
    required: bool
    seconds: float

    @property
    def law(self) -> Law:
        """The law that was fitted."""
        return self.identified.family.law

    @property
    def held_out_nrmse(self) -> float:
        """The same over the cycles left out."""
        return math.sqrt(float(np.mean(self.held_out[0] ** 2)))


@dataclass(frozen=True)
class Ladder:
    """All laws fitted, in the order climbed.

    ``chosen``: the one that the recording requires; ``left_out``: law -> why it was not fitted, or not to the end.
    """

    rungs: tuple[Rung, ...]
    chosen: Rung
    left_out: Mapping[str, str] = field(default_factory=dict)


def climb(measurement: Measurement, family: Family, sources: Sources) -> Ladder:
    """Return the ladder of a recording: exact laws first, numeric ones where none of those explains the cycle.

    Steady states that are integrated, or elastic, may cost `WORK` steps in all: the same laws are tried anywhere.

    Raises
    ------
    AnalysisError
        As :func:`identify`: not even Coulomb friction has a steady state here.
    """
    ladder = _Climb(measurement, family, sources)
    prepare(family, 10 * STATES)
    warm(family.law)
    bottom = ladder.bottom()
    top = ladder.upward(bottom, EXACT)
    if not misfit_is_noise(top.identified.fit):
        top = ladder.onto_numeric(bottom, top)
    top = ladder.found_again(top)
    others = [(rung.identified, rung.log_evidence) for rung in ladder.rungs if rung.law.name != top.law.name]
    top = replace(top, identified=held_against(top.identified, top.log_evidence, others))
    ladder.meter.left = math.inf  # what is asked of these fits later is not the ladder's
    rungs = tuple(top if rung.law.name == top.law.name else rung for rung in ladder.rungs)
    return Ladder(rungs, top, ladder.left_out)


class _Climb:
    """The rungs of one recording as they come."""

    def __init__(self, measurement: Measurement, family: Family, sources: Sources) -> None:
        self.measurement, self.family, self.sources = measurement, family, sources
        self.rungs: list[Rung] = []
        self.left_out: dict[str, str] = {}
        self.starts: dict[str, list[FloatArray]] = {}  # of laws that begin the same way when they are given
        self.allowed = EXACT_WORK
        self.meter = Meter(self.allowed)

    def bottom(self) -> Rung:
        """Plain Coulomb friction, which every recording begins with."""
        begin, observed = time.perf_counter(), observe_cycle(self.measurement)
        forward = forward_of(self.family, self.measurement, self.sources, observed)
        starts = starts_of(self.measurement, forward, observed)
        found = min((fit(forward, observed, [start], excess=1.0) for start in starts), key=lambda f: f.cost)
        return self.rung(found, begin, None)

    def upward(self, here: Rung, terms: tuple[str, ...]) -> Rung:
        """Climb from a rung, one term at a time (or two where no single one helps), as far as it is required."""
        while True:
            worth = _worth(here, terms)
            good = self._required(here, worth, 1)
            if not good and terms is EXACT and not misfit_is_noise(here.identified.fit):
                good = self._required(here, worth, 2)
            below, good = self.confirmed(here, good) if good else (here, good)
            if not good and below is here:
                return here
            here = max(good, key=lambda rung: rung.log_evidence, default=below)  # one fitted deeper: pairs may help it

    def confirmed(self, here: Rung, good: list[Rung]) -> tuple[Rung, list[Rung]]:
        """A rigid law fitted once more, from the values of the best richer one, and those still required over it.

        A fit may end in a valley that is not the deepest. Then a richer law that happens to find the deeper one looked
        required: place, beside a break-away that leaves 0.8 % where it could leave 0.1 %.
        """
        begin, found, best = time.perf_counter(), here.identified.fit, max(good, key=lambda rung: rung.log_evidence)
        if here.law.kind != "rigid":
            return here, good
        start = start_at(found.forward, best.identified.fit.values)
        try:
            again = fit(found.forward, found.observed, [start], excess=found.excess)
        except AnalysisError:
            return here, good  # the simpler law has no steady state there, so no valley either
        if again.cost > found.cost - DEEPER:
            return here, good
        seconds = here.seconds + time.perf_counter() - begin
        identified = with_errors(again.forward.family, again)
        deeper = Rung(identified, log_evidence(again), held_out(again), here.required, seconds)
        self.rungs = [deeper if rung is here else rung for rung in self.rungs]
        return deeper, [rung for rung in map(partial(self._judged_again, deeper), good) if rung.required]

    def _judged_again(self, below: Rung, rung: Rung) -> Rung:
        """A rung after one below it has changed."""
        judged = replace(rung, required=self._is_required(rung.identified.fit, rung.log_evidence, rung.held_out, below))
        self.rungs = [judged if each is rung else each for each in self.rungs]
        return judged

    def onto_numeric(self, bottom: Rung, top: Rung) -> Rung:
        """The best of the laws without exact slides: each alone, beside what the exact ones have, and what it takes.

        Alone too, because some exclude what the exact laws needed in their place.
        """
        self.allowed = self.meter.left = WORK - EXACT_WORK + max(0.0, self.meter.left)
        good = [rung for below in (bottom, top) for rung in self._required(below, NUMERIC, 1)]
        best = max((top, *good), key=lambda rung: rung.log_evidence)
        if not misfit_is_noise(best.identified.fit):
            best = max((best, *self._dear(bottom, top)), key=lambda rung: rung.log_evidence)
        else:
            self._spare(bottom, DEAR, f"a law that costs less, {best.law.name}, leaves nothing but noise")
        return best if best is top or misfit_is_noise(best.identified.fit) else self.upward(best, CHEAP)

    def _dear(self, bottom: Rung, top: Rung) -> list[Rung]:
        """Laws that cost much: each alone, and beside what the exact ones have if it is worth anything alone."""
        alone = self._required(bottom, DEAR, 1)
        worth = tuple(name for name in DEAR if any(rung.law.has(name) for rung in alone))
        spared = tuple(name for name in DEAR if name not in worth)
        if not self.meter.is_spent:
            self._spare(top, spared, "alone it predicts no better than plain Coulomb friction")
        return [*alone, *self._required(top, worth, 1)]

    def _spare(self, below: Rung, terms: tuple[str, ...], why: str) -> None:
        """Say of laws that they were not tried, and why."""
        tried = {rung.law.name for rung in self.rungs} | set(self.left_out)
        self.left_out |= {name: f"not tried: {why}" for name in laws_above(below.law, terms, 1) if name not in tried}

    def _required(self, here: Rung, terms: tuple[str, ...], count: int) -> list[Rung]:
        """The rungs with so many more terms that the recording requires over this one."""
        tried = [self._try(here, name) for name in laws_above(here.law, terms, count)]
        return [rung for rung in tried if rung is not None and rung.required]

    def _try(self, below: Rung, name: str) -> Rung | None:
        """The rung of a law fitted from the one below; None where it has been tried, or cannot be fitted."""
        if name in self.left_out or any(rung.law.name == name for rung in self.rungs):
            return None
        law, spent = law_of(name), SPENT.format(steps=self.allowed, name=name)
        if self.meter.is_spent and law.kind != "rigid":
            self.left_out[name] = f"not tried: {spent}"
            return None
        prepare(self.family.under(law), STATES)
        warm(law)
        begin = time.perf_counter()
        try:
            return self.rung(self._fitted(below, law), begin, below)
        except OverspentError:
            self.left_out[name] = f"not fitted to the end: {spent}"
            return None
        except (AnalysisError, SimulationError, UsageError, np.linalg.LinAlgError) as fault:
            self.left_out[name] = f"not compared: {fault}"
            return None

    def _fitted(self, below: Rung, law: Law) -> Fit:
        family = self.family.under(law)
        forward = forward_of(family, self.measurement, self.sources, below_observed(below), self.meter)
        known = _begun_at(below.identified.fit)
        new = [c for c in forward.coordinates if c.law and c.name not in known]
        starts = [start_at(forward, known | values) for values in trial_values(new)]
        if any(c.name == "stiffness_ratio" for c in new):
            guessed = _shifted(new, 0.0) | {c.name: known[c.name] for c in below.identified.fit.coordinates if c.law}
            starts = starts_of(self.measurement, forward, below_observed(below), guessed)
            if set(guessed) <= FROM_ENERGY:
                self.starts[law.name] = starts
        elif any(c.is_log for c in new):
            found = fit(forward, below_observed(below), starts, excess=1.0)
            if misfit_is_noise(found):
                return found
            near = fit(forward, below_observed(below), self._near_the_likeliest(forward, new), excess=1.0)
            return min(found, near, key=lambda f: f.cost)
        elif law.kind != "rigid":  # where the new term does nothing the simpler law's misfit is there already
            starts = [start_at(forward, below.identified.fit.values | _shifted(new, 0.0)), *starts]
        return self._best_of(starts, forward, below_observed(below))

    def _near_the_likeliest(self, forward: Forward, new: list[Coordinate]) -> list[FloatArray]:
        """Starting points at the values of the likeliest law so far; a law's static ratio begins at break-away's."""
        known = _begun_at(max(self.rungs, key=lambda rung: rung.log_evidence).identified.fit)
        static = [value for name, value in known.items() if name.startswith("static_ratio_")]
        own = {"static_ratio": sum(static) / len(static)} if static else {}
        return [start_at(forward, known | values | own) for values in trial_values(new)]

    def _best_of(self, starts: list[FloatArray], forward: Forward, observed: Observed) -> Fit:
        """The best fit from some starts; where even the first misses much more than a rung does, it is enough."""
        enough = HOPELESS * min(rung.identified.fit.chi_square for rung in self.rungs)
        found: Fit | None = None
        kind, missed = forward.family.law.kind, AnalysisError("no starting point")
        for start in starts:
            if found is not None and kind != "rigid" and (found.chi_square > enough or misfit_is_noise(found)):
                break
            try:
                if kind == "elastic" and found is not None:
                    other = fit(forward, observed, [start], excess=1.0, most=SHORT)
                    found = followed(other) if other.cost < found.cost else found
                else:
                    other = fit(forward, observed, [start], excess=1.0)
                    found = other if found is None or other.cost < found.cost else found
            except AnalysisError as fault:
                missed = fault  # no steady state there; another start may have one
            except OverspentError:
                if found is None:
                    raise
                name = forward.family.law.name
                self.left_out[name] = f"not fitted from every start: {SPENT.format(steps=self.allowed, name=name)}"
                break
        if found is None:
            raise missed
        return found

    def found_again(self, top: Rung) -> Rung:
        """The required law as it is found when it is given, if what is reserved is enough; else as on the ladder."""
        self.meter.left = RESERVE
        near, starts = top.identified.fit.values, self.starts.get(top.law.name)
        try:
            identified = identify(self.measurement, self.family.under(top.law), self.sources, self.meter, near, starts)
        except OverspentError:
            said = f"{RESERVE:,.0f} steps of simulation; give --law {top.law.name} to search them all"
            self.left_out[top.law.name] = (
                f"its values are those near the simpler laws': a search of all takes over {said}"
            )
            return top
        return replace(top, identified=identified)

    def _simpler(self, found: Fit, below: Rung) -> float:
        """Best evidence of the laws with fewer terms that were tried: two terms must beat each alone."""
        terms = {t.name for t in found.forward.family.law.terms}
        fewer = [r.log_evidence for r in self.rungs if {t.name for t in r.law.terms} < terms]
        return max(fewer, default=below.log_evidence)

    def rung(self, found: Fit, begin: float, below: Rung | None) -> Rung:
        """Put a fit on the ladder; the bottom is required anyway."""
        evidence, left_out = log_evidence(found), held_out(found)
        required = below is None or self._is_required(found, evidence, left_out, below)
        identified = with_errors(found.forward.family, found)
        made = Rung(identified, evidence, left_out, required, time.perf_counter() - begin)
        self.rungs.append(made)
        return made

    def _is_required(self, found: Fit, evidence: float, left_out: FloatArray, below: Rung) -> bool:
        """Whether the recording requires a law over the simpler ones: by its evidence, and by the cycles left out."""
        if evidence - self._simpler(found, below) <= REQUIRED:
            return False
        better = below.held_out[1] - left_out[1]
        return float(better.mean()) > float(better.std(ddof=1)) / math.sqrt(len(better))


def below_observed(rung: Rung) -> Observed:
    """The measured cycle that a rung was fitted to."""
    return rung.identified.fit.observed


def _begun_at(found: Fit) -> dict[str, float]:
    """Values of a simpler law at which a richer one begins: sensors and rig that it had to push far begin as known."""
    begun = np.where(np.abs(strains(found.coordinates, found.point)) > PUSHED, 0.0, found.point)
    law = np.array([c.law for c in found.coordinates], dtype=bool)
    return values_of(found.coordinates, np.where(law, found.point, begun))


def _shifted(new: list[Coordinate], trial: float) -> dict[str, float]:
    """Values at which new parameters are tried: so many deviations from their prior's middle, inside their bounds."""
    return {c.name: c.value(max(trial if not c.folded else 0.5 * abs(trial), c.low + 0.01)) for c in new}


def trial_values(new: list[Coordinate]) -> list[dict[str, float]]:
    """Values at which a richer law's new parameters are tried."""
    return [_shifted(new, trial) for trial in _trials(new)]


def _trials(new: list[Coordinate]) -> tuple[float, ...]:
    """Where new parameters are tried: many places on a scale; one for what only grows; three of a gradient.

    Both its signs, and where it does nothing: its valley may be narrow, and the simpler law's values lie in it.
    """
    if any(c.is_log for c in new):
        return SCALES
    return TRIALS[:1] if all(c.folded for c in new) else TRIALS


def _worth(here: Rung, terms: tuple[str, ...]) -> tuple[str, ...]:
    """The terms worth a trial above a rung: those that cost much are tried only where it leaves more than noise."""
    return tuple(t for t in terms if t in CHEAP) if misfit_is_noise(here.identified.fit) else terms


def laws_above(law: Law, terms: tuple[str, ...], count: int) -> list[str]:
    """Names of the laws with so many more terms, without sums that exclude each other."""
    order = list(TERMS)
    found = []
    for more in combinations([t for t in terms if not law.has(t)], count):
        name = "+".join(sorted((*(t.name for t in law.terms), *more), key=order.index))
        try:
            law_of(name)
        except ParameterError:
            continue  # two of its terms exclude each other
        found.append(name)
    return found
