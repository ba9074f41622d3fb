"""The ladder of laws: the simplest law that the tests of a material require, all together or a single one.

A rung is required if its log evidence (the scatter from test to test marginalised) is more than 5 above that of every
simpler law tried, and what was left out of the fit is predicted better by more than its error: single cycles of one
test, rows of a table, periods of a record, whole tests of several. Sensors and rig stand beside every law, so that what
a lag or a detuned frame explains is not taken for a property of the contact. Whatever happens to one rung, the others
are kept, and its row says it.
"""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations, product

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError, ParameterError
from frictionlab.inference.diagnose import by_energy, misses_start
from frictionlab.inference.fit import Fit, Model, cost, fit_from, followed, tempered, weighed, with_scatter
from frictionlab.inference.force import ForceObservation
from frictionlab.inference.observation import NO_MOTION, Observation
from frictionlab.inference.observations import CycleObservation, OfCycles
from frictionlab.inference.posterior import Posterior, explains, infer, misfit_is_noise, model_of, posterior_of
from frictionlab.inference.starts import point_at, starting_points
from frictionlab.inference.unknowns import Unknown
from frictionlab.simulator.laws import TERMS, Law, excluded_by, law_of, tried_of
from frictionlab.simulator.problem import Meter, OverspentError

CHEAP = tried_of("rigid")  # a fraction of a millisecond a steady state
YIELDING = tried_of("elastic")
EXACT = (*CHEAP, *YIELDING)
SMOOTH, INNER = tried_of("smooth"), tried_of("inner")  # milliseconds a steady state: the first cost less ...
NUMERIC = (*SMOOTH, *INNER)
RIVALS = {"rigid": ("stribeck", "compliance"), "smooth": ("stribeck",), "elastic": ("dahl",)}  # kind of a law -> terms
DEAR = tried_of("smooth", "inner", effort=2)  # ... and up to a second
WORK = 9e5  # steps of integration, or as much work, for all laws of one test: some ten seconds
OF_RECORD = 2.0  # times as much for a whole record, whose rigid laws count too
KEPT = 0.5  # share of it that elastic laws leave to those that are integrated
SHARE, LEAST = 0.5, 0.02  # of what is left, for one law or one start of it; of it all, below which none is begun
RESERVE = 4e5  # the same for the values of the one that is required, found once more from all starts ...
OF_RIVAL = 2.0, 3.0  # ... times so much, of one test and of several, for one held against it: it may take half
REQUIRED = 5.0  # logarithm of the Bayes factor from which a rung is climbed
DEEPER = 1.0  # chi-square by which a second search of a simpler law must find a better minimum
PUSHED = 3.0  # standard deviations from which what is known of sensors and rig is not where a richer law begins
WRONG = 50.0  # scenes of which one has a wrong fact of sensors or rig
SURE = 3.5  # errors from where a term of a record does nothing: half its square is an evidence of 6
TRIALS = (1.0, -1.0, 0.0)  # standard deviations from its prior's mean at which a new parameter is tried
SCALES = (-1.5, -1.0, -0.5, 0.0, 0.5)  # the same on a logarithmic scale: where it does most, first
LIKELY, SELDOM = 0.05, 0.01  # times as likely as the law given: so another law counts, or if it doubles the variance
APART = 1.0  # errors away from which the friction ratio of another law is named
SPENT = "the work of a ladder was used up"
NOT_DISTINGUISHED = "laws that the data do not distinguish"
NO_DIFFERENCE = "does not distinguish"

Begun = tuple[Model, FloatArray, list[FloatArray]]  # model, point and deviations at which a fit begins


@dataclass(frozen=True)
class Rung:
    """One law on the ladder.

    ``held_out``: score of each part left out (a sum of squares, smaller is better); ``required``: whether the tests
    require this law over the simpler ones; ``said``: what happened, where it could not be fitted (fit is None then).
    """

    law: Law
    fit: Fit | None = None
    held_out: FloatArray = field(default_factory=lambda: np.zeros(0))
    held_out_nrmse: float | None = None
    required: bool = False
    seconds: float = 0.0
    said: str = ""

    @cached_property
    def log_evidence(self) -> float:
        """Logarithm of its evidence; minus infinity where it could not be fitted."""
        return -math.inf if self.fit is None else self.fit.log_evidence

    @cached_property
    def freed_evidence(self) -> float:
        """The same if the one fact of sensors or rig that a law which explains had to push may be wrong in the scene.

        A scene is wrong once in so many (`WRONG`); the fact's prior is then as wide as it was moved.
        """
        if self.fit is None or not explains(self.fit, range(len(self.fit.model.tests))):
            return self.log_evidence
        if self.posterior is None or len(self.posterior.strained) != 1:
            return self.log_evidence
        k = self.posterior.strained[0]
        u, c = self.fit.model.unknowns[k], float(self.fit.point[k])
        return self.log_evidence + max(0.0, 0.5 * u.strain(c) ** 2 - 0.5 - math.log(WRONG * abs(c) / u.known_to))

    @cached_property
    def nrmse(self) -> float | None:
        """Rms over the tests of what it leaves of each; None where it could not be fitted."""
        return None if self.fit is None else self.fit.nrmse()

    @cached_property
    def posterior(self) -> Posterior | None:
        """The posterior of the rung's own fit, weighed by what the law leaves."""
        return None if self.fit is None else posterior_of(weighed(self.fit, self.fit.shares_missed(), follows=False))


@dataclass(frozen=True)
class Ladder:
    """All laws fitted, in the order climbed; ``left_out``: law -> why it was not tried."""

    rungs: tuple[Rung, ...]
    chosen: Rung
    posterior: Posterior
    left_out: Mapping[str, str] = field(default_factory=dict)


def climb(
    observations: Sequence[Observation], *, accuracy: str = "balanced", near: Mapping[str, float] | None = None
) -> Ladder:
    """Return the ladder of the tests of one material, from their own law up: exact laws first, then integrated ones.

    These where those leave a misfit. ``accuracy``: "fast": one term beside the first law, values less sharp; "exact":
    pairs of terms and integrated laws even where a simpler law leaves nothing but noise. ``near``: values of another
    fit, at which that of a whole record begins.

    Raises
    ------
    AnalysisError
        The mass stands still, or not one law has a steady state here.
    """
    ladder, rigid = _Climb(observations, accuracy, near), not all(observation.single for observation in observations)
    bottom, whole = ladder.tried(observations[0].law.name, None), observations[0].shows_rig
    cycles = not rigid and all(isinstance(observation, OfCycles) for observation in observations)
    first = CHEAP if rigid or accuracy == "fast" or whole else EXACT
    top = ladder.upward(bottom, first)
    if whole and accuracy != "fast" and not _is_noise(top.fit):  # of a record every motion is dear
        top = max((top, *ladder.required(bottom, YIELDING, 1)), key=lambda rung: rung.log_evidence)
        top = ladder.upward(top, EXACT)
    if accuracy == "exact" or (accuracy != "fast" and not _is_noise(top.fit)):
        if cycles:
            top = ladder.onto_numeric(bottom, top)
        else:
            why = "in a frame of several masses the contact that is fitted is rigid"
            why = why if rigid else "a record or a table is held against the exact laws alone; do: --law names one"
            dear = tuple(term for term in (*EXACT, *NUMERIC, *DEAR) if term not in (CHEAP if rigid else EXACT))
            ladder.left_out |= dict.fromkeys(laws_above(bottom.law, dear, 1), f"not tried: {why}")
    if accuracy != "fast" and cycles:
        top = ladder.against_its_rivals(top)
    rungs = tuple(ladder.rungs)
    ladder.left_out = {rung.law.name: rung.said for rung in rungs if rung.said} | ladder.left_out
    as_it_is = posterior_of(top.fit) if top.fit is not None and whole else None
    found = as_it_is or beside_energy(undistinguished(ladder.found_again(top), top, rungs), top, rungs)
    return Ladder(rungs, top, found, ladder.left_out)


class _Climb:
    """The rungs of some tests as they come."""

    def __init__(
        self, observations: Sequence[Observation], accuracy: str, near: Mapping[str, float] | None = None
    ) -> None:
        times = sum(OF_RECORD if o.shows_rig else 1.0 for o in observations)
        self.work, self.kept, self.least = Meter(WORK * times), KEPT * WORK * times, LEAST * WORK * times
        self.observations = [o.missing(0.0).metered(self.work) for o in observations]
        self.accuracy, self.near = accuracy, near
        self.rungs: list[Rung] = []
        self.valleys: list[dict[str, float]] = []  # in which a contact rings as often: by the first law that yields
        self.left_out: dict[str, str] = {}

    def upward(self, here: Rung, terms: tuple[str, ...]) -> Rung:
        """Climb from a rung, one term at a time (or two where no single one helps), as far as it is required."""
        while True:
            worth = tuple(t for t in terms if t in CHEAP) if _is_noise(here.fit) else terms
            good = self.required(here, worth, 1)
            pairs = self.accuracy == "exact" or (self.accuracy != "fast" and not _is_noise(here.fit))
            if not good and pairs:
                good = self.required(here, worth, 2)
            below, good = self._confirmed(here, good) if good else (here, good)
            if not good and below is here:
                return here
            here = max(good, key=lambda rung: rung.log_evidence, default=below)

    def onto_numeric(self, bottom: Rung, top: Rung) -> Rung:
        """The best of the laws without exact slides: each alone, beside what the exact ones have, and what it takes."""
        best, tests = top, range(len(self.observations))
        for terms in (SMOOTH, INNER):
            if best is not top and _is_noise(best.fit):
                break
            for below, term in product((bottom, top), terms):
                good = self.required(below, (term,), 1)
                # a richer law may explain as much with another friction ratio: its error must hold that
                fits = [rung for rung in good if rung.fit is not None and explains(rung.fit, tests)]
                richer = [more for rung in fits for more in self.required(rung, CHEAP, 1)]
                best = max((best, *good, *richer), key=lambda rung: rung.log_evidence)
        if not _is_noise(best.fit):
            alone = self.required(bottom, DEAR, 1)
            worth = tuple(name for name in DEAR if any(rung.law.has(name) for rung in alone))
            both = self.required(top, worth, 1) if top is not bottom else []
            best = max((best, *alone, *both), key=lambda rung: rung.log_evidence)
        for name in laws_above(bottom.law, (*NUMERIC, *DEAR), 1):
            if not any(rung.law.name == name for rung in self.rungs):
                self.left_out[name] = f"not tried: a law that costs less, {best.law.name}, leaves nothing but noise"
        return best if best is top or _is_noise(best.fit) else self.upward(best, CHEAP)

    def against_its_rivals(self, top: Rung) -> Rung:
        """The better of a law and of those with a rival term, beside its other terms and alone.

        Rivals of a rigid contact are friction that falls with speed and, in one test, a contact that yields; of one
        that yields at once it is one that yields by and by. In a slow test, or in one without stops, all may leave
        nothing but noise, each with another friction ratio. Alone such a law is held against the best of several tests
        only where beside the others' terms it is better.
        """
        tests, terms = range(len(self.observations)), RIVALS.get(top.law.kind, ())
        if top.law.kind == "elastic" and isinstance(self.observations[0], ForceObservation):
            terms = ()  # a force that is measured shows its size, however the contact yields
        if top.fit is None or not (explains(top.fit, tests) or _is_noise(top.fit)):
            return top
        for term in terms[:1] if len(tests) > 1 else terms:
            kept = "+".join(t.name for t in top.law.terms if t.name not in excluded_by(TERMS[term]))
            for name in dict.fromkeys(laws_above(law_of(kept), (term,), 1) + laws_above(law_of("coulomb"), (term,), 1)):
                self.work.left = OF_RIVAL[len(tests) > 1] * RESERVE * len(tests)
                self.rungs = [rung for rung in self.rungs if rung.law.name != name or SPENT not in rung.said]
                rival = self.tried(name, top)
                simpler = set(rival.law.terms) < set(top.law.terms)  # then the top is to be required over it
                gain = rival.log_evidence - top.freed_evidence + (2.0 * REQUIRED if simpler else 0.0)
                if gain > REQUIRED and (simpler or _is_better(top.held_out, rival.held_out)):
                    top = rival
                elif len(tests) > 1:
                    break
        return top

    def found_again(self, top: Rung) -> Posterior:
        """The required law as it is found when it is given; where that cannot be done, as on the ladder."""
        again = [o.under(top.law).metered(Meter(RESERVE * len(self.observations))) for o in self.observations]
        try:
            found = infer(again)
            more = max(DEEPER, found.may_leave)
            if top.fit is not None and found.fit.chi_square > top.fit.chi_square + more * top.fit.excess():
                found = infer(again, near=top.fit.values())
        except NO_MOTION as fault:
            if (own := top.posterior) is None:
                raise AnalysisError(f"law {top.law.name}: {fault}") from fault
            self.left_out[top.law.name] = (
                f"its values and errors are those found from the simpler laws, for the search without them did not end"
                f" ({fault}). Compare with --law {top.law.name}, which searches longer"
            )
            return own
        return found

    def required(self, here: Rung, terms: tuple[str, ...], count: int) -> list[Rung]:
        """The rungs with so many more terms that are required over this one."""
        tried = [self.tried(name, here) for name in laws_above(here.law, terms, count)]
        return [rung for rung in tried if rung.required]

    def tried(self, name: str, below: Rung | None) -> Rung:
        """The rung of a law fitted from the one below; whatever happens to it is said in its row."""
        if (known := next((rung for rung in self.rungs if rung.law.name == name), None)) is not None:
            return replace(known, required=False)
        law, begin, said = law_of(name), time.perf_counter(), ""
        made, kept = Rung(law), self.kept if law.kind == "elastic" else 0.0
        if self.observations[0].shows_rig or not law.is_exact:  # one that finds no end leaves as much to the others
            kept = SHARE * self.work.left
        if law.kind != "rigid" and self.work.left - kept < self.least:
            said = f"not tried, for {SPENT}. Give one to --law to fit it alone"
        else:
            try:
                with self.work.keeping(kept):
                    made = self._rung(law, below)
            except OverspentError:
                said = f"not fitted to the end, for {SPENT}. Give one to --law to fit it alone"
            except Exception as fault:  # one law's fault must not end the others
                if below is None and isinstance(fault, AnalysisError):
                    raise
                kind = "" if isinstance(fault, AnalysisError) else f"{type(fault).__name__}: "
                said = f"not compared: {kind}{fault}"
        made = replace(made, seconds=time.perf_counter() - begin, said=said)
        self.rungs.append(made)
        return made

    def _rung(self, law: Law, below: Rung | None) -> Rung:
        known = None if below is None else below.fit
        tests = [o.under(law) for o in self.observations]
        if known is None and tests[0].shows_rig:
            tests = [o.metered(Meter(math.inf)) for o in tests]  # without the first law there is no ladder
        if known is not None:
            tests = [o.missing(t.observation.missed) for o, t in zip(tests, known.model.tests, strict=True)]
        model = model_of(tests)
        if self.accuracy == "fast" or (below is not None and not law.is_exact and _is_noise(below.fit)):
            model = replace(model, tolerance=1e3)
        fits = [] if known is None else [followed(self._fitted(model, known, law))]
        if not fits and tests[0].shows_rig:
            fits = [infer(tests, near=self.near).fit]
        elif not fits or (len(tests) > 1 and law.kind == "rigid" and not _is_noise(fits[0])):  # which misses: astray
            fits += [fit_from(model, [start], tempers=False) for start in starting_points(model)]
        if tests[0].shows_rig:  # of samples so many, and autocorrelated, what a law misses counts from the first
            fits = [tempered(f) for f in fits]
        found = _unmetered(min(map(with_scatter, fits), key=lambda f: f.cost + 2.0 * f.reduced.log_volume))
        made = Rung(law, found, *held_out(found))
        return replace(made, required=below is None or self._is_required(made, below))

    def _fitted(self, model: Model, below: Fit, law: Law) -> Fit:
        """The best fit of a richer law near the values of a simpler one."""
        begun, sure = [_carried(model, below, trial) for trial in _trials(model, below)], law.is_exact
        several = len(model.tests) > 1 or not isinstance(model.tests[0].observation, CycleObservation)
        of_force = len(model.tests) == 1 and isinstance(model.tests[0].observation, ForceObservation)
        if "stiffness_ratio" in {u.name for u in model.unknowns} and (of_force or not several):
            begun = [*self._in_valleys(model, below), *(begun if of_force else ())]
        elif not law.is_exact or law.has("breakaway"):  # a simpler law's sensors and rig may lead it astray
            alike = [np.zeros(len(test.index)) for test in model.tests]
            begun += [(model, point, alike) for point in with_known_rig(model)]
            if not law.is_exact:  # dear: the likeliest start first, for one may be enough
                begun.sort(key=lambda start: cost(*start))
                sure = cost(*begun[0]) < below.cost  # no other start is worth keeping work for
        enough = 4.0 * min(r.fit.cost for r in self.rungs if r.fit is not None)
        best: Fit | None = None
        spent, reserve = None, 0.0
        missed = AnalysisError("no starting point has a steady state")
        for there, point, local in begun:
            if best is not None and law.kind != "rigid" and (best.cost > enough or _is_noise(best)):
                break
            kept = reserve if sure else max(reserve, SHARE * self.work.left)  # a start without an end is not the last
            try:
                with self.work.keeping(kept):
                    found = fit_from(there, [point], local, tempers=False)
            except AnalysisError as fault:
                missed = fault  # no steady state there; another start may have one
            except OverspentError as fault:
                spent = fault
                if law.is_exact or self.work.left < self.least:
                    break
            else:
                best = found if best is None or found.cost < best.cost else best
                reserve = reserve or (0.0 if law.is_exact else SHARE * self.work.left)  # to follow the best to its end
        if best is None:
            raise spent or missed
        return self._no_worse(best, law)

    def _no_worse(self, found: Fit, law: Law) -> Fit:
        """The fit of a law, or a better one from where its new terms do nothing beside a simpler law's values.

        A law that ends worse than one it contains is a failed fit, and no evidence: AnalysisError where it stays so.
        """
        missed, best, contained = found.model.tests[0].observation.missed, found, law
        for rung in (rung for rung in self.rungs if set(rung.law.terms) < set(law.terms)):
            rests = all(p.neutral != math.inf for p in law.own if p not in rung.law.own)  # of several weights none
            if rung.fit is not None and rests and rung.fit.model.tests[0].observation.missed == missed:
                best, contained = min((best, contained), (rung.fit, rung.law), key=lambda one: one[0].cost)
        if best.cost > found.cost - DEEPER * found.excess():
            return found
        new = {p.name: p.neutral for p in law.own if p not in contained.own and p.neutral is not None}
        at_rest = {u.name: u.at(new[u.name]) for u in found.model.unknowns if u.name in new}
        model, point, local = _carried(found.model, best, at_rest, as_is=True)
        try:
            again = fit_from(model, [point], local, tempers=False)
        except AnalysisError as fault:
            raise AnalysisError(f"its fit is worse than that of {contained.name}, which it contains") from fault
        return min(found, again, key=lambda fit: fit.cost)

    def _in_valleys(self, model: Model, below: Fit) -> list[Begun]:
        """Where a contact that yields begins: in the valleys that the first such law has found."""
        known = below.values()
        values = {u.name: known[u.name] for u in model.unknowns if u.law and u.name in known}
        values = {} if set(values) <= {"beta"} else values
        names = [u.name for u in model.unknowns]
        if not self.valleys:
            at = [k for k, name in enumerate(names) if name in ("stiffness_ratio", "beta", "lag_s")]
            self.valleys = [{names[k]: float(point[k]) for k in at} for point in starting_points(model, values)]
        near = dict(zip(names, point_at(model, values).tolist(), strict=True))
        points = [np.array(list({**near, **{n: c for n, c in v.items() if n in near}}.values())) for v in self.valleys]
        return [(replace(model, most=30), point, [np.zeros(len(point))]) for point in points]

    def _confirmed(self, here: Rung, good: list[Rung]) -> tuple[Rung, list[Rung]]:
        """A rigid law fitted once more, from the values of the best richer one, and those still required over it.

        A fit may end in a minimum that is not the deepest. Then a richer law that happens to find the deeper one looked
        required.
        """
        best = max(good, key=lambda rung: rung.log_evidence)
        if here.law.kind != "rigid" or here.fit is None or best.fit is None:
            return here, good
        model, point, local = _carried(here.fit.model, best.fit, {})
        try:
            again = with_scatter(fit_from(model, [point], local, tempers=False)) if model.unknowns else here.fit
        except NO_MOTION:
            return here, good  # the simpler law has no steady state there, so no minimum either
        if again.cost > here.fit.cost - DEEPER:
            return here, good
        again = _unmetered(again)
        scores, nrmse = held_out(again)
        deeper = replace(here, fit=again, held_out=scores, held_out_nrmse=nrmse)
        self.rungs = [deeper if rung.law is here.law else rung for rung in self.rungs]
        judged = {rung.law.name: replace(rung, required=self._is_required(rung, deeper)) for rung in good}
        self.rungs = [judged.get(rung.law.name, rung) for rung in self.rungs]
        return deeper, [rung for rung in judged.values() if rung.required]

    def _is_required(self, rung: Rung, below: Rung) -> bool:
        """Whether a law is required over the simpler ones: by its evidence, and by what was left out of the fit."""
        simpler = [r.freed_evidence for r in self.rungs if set(r.law.terms) < set(rung.law.terms)]
        if not rung.log_evidence - max(simpler, default=below.log_evidence) > REQUIRED:
            return False
        if below.fit is None or rung.fit is None:
            return True
        fits = explains(below.fit, range(len(self.observations)))
        if any(o.starting for o in self.observations) and (fits or (below.law.is_exact and misses_start(below.fit))):
            return False  # what is left of a start looks like a term
        scores = below.held_out, rung.held_out
        shares = rung.fit.shares_missed()
        if shares.any():  # what not even the richer law explains is no noise: with it counted the gain must stand
            both = [weighed(fit, shares) for fit in (below.fit, rung.fit)]
            if not both[1].log_evidence - both[0].log_evidence > REQUIRED:
                return False
            scores = held_out(both[0])[0], held_out(both[1])[0]
        return _is_better(*scores) and (not self.observations[0].shows_rig or _is_sure(rung, below.fit))


def _is_noise(found: Fit | None) -> bool:
    """Whether a fit leaves nothing but noise of its tests."""
    return found is not None and all(misfit_is_noise(found, i) for i in range(len(found.model.tests)))


def _unmetered(found: Fit) -> Fit:
    """The fit of a whole record by which its rung is judged, whatever work is left to find others."""
    if not found.model.tests[0].observation.shows_rig:
        return found
    tests = [replace(t, observation=t.observation.metered(Meter(math.inf))) for t in found.model.tests]
    return replace(found, model=replace(found.model, tests=tuple(tests)))


def _is_better(below: FloatArray, above: FloatArray) -> bool:
    """Whether scores of parts fall by more than their error; where there are none, nothing speaks against it."""
    better = below - above
    if len(better) < 2 or not np.all(np.isfinite(better)):
        return True
    return float(better.mean()) > float(better.std(ddof=1)) / math.sqrt(len(better))


def _is_sure(rung: Rung, below: Fit) -> bool:
    """Whether one of a term's parameters lies far enough from where it does nothing; many samples please any term."""
    found, known = rung.posterior, below.values()
    values = {} if found is None else found.parameters()
    new = [(p.neutral, values[p.name]) for p in rung.law.own if p.name in values and p.name not in known]
    # where no value of it does nothing its evidence alone decides
    return any(at is None or math.isinf(at) or abs(e.value - at) > SURE * (e.u or math.inf) for at, e in new)


def _trials(model: Model, below: Fit) -> list[dict[str, float]]:
    """Coordinates at which the parameters that a richer law adds are tried."""
    known = {u.name for u in below.model.unknowns}
    new = [u for u in model.unknowns if u.law and u.name not in known]
    one_way = all(u.folded or (u.level == "test" and len(model.tests) > 1) for u in new)  # else both signs
    tried = SCALES if any(u.scale == "log" for u in new) else TRIALS[:1] if one_way else TRIALS

    def begin(u: Unknown, trial: float) -> float:
        guess = 0.5 * abs(trial) if u.first is None else u.at(u.first)
        return max(guess if u.folded else trial, u.low + 0.01)

    return [{u.name: begin(u, trial) for u in new} for trial in tried]


def _carried(model: Model, below: Fit, new: Mapping[str, float], *, as_is: bool = False) -> Begun:
    """A richer law's model, point and deviations at the values of a simpler one, and ``new`` coordinates.

    Sensors and rig that the simpler law had to push far begin as known. A new parameter of the test's level begins in
    each test at the sign that fits it better. Neither so of a motion that is to stay ``as_is``.
    """
    keys = {u.name: k for k, u in enumerate(below.model.unknowns)}
    point, scatter = np.zeros(len(model.unknowns)), np.zeros(len(model.unknowns))
    several = len(model.tests) > 1
    for k, u in enumerate(model.unknowns):
        if u.name in keys:
            c = float(below.point[keys[u.name]])
            point[k] = 0.0 if not as_is and not u.law and abs(u.strain(c)) > PUSHED else c
            scatter[k] = below.model.scatter[keys[u.name]]
        elif u.law:
            own = several and u.level == "test"
            point[k] = 0.0 if own else new.get(u.name, 0.0)
            scatter[k] = u.scatter_scale(0.0) if own else 0.0
    model = replace(model, scatter=scatter)
    point, local = np.clip(point, *model.bounds), []
    for i, test in enumerate(model.tests):
        names = [below.model.unknowns[k].name for k in below.model.tests[i].index]
        before = dict(zip(names, below.local[i], strict=True))
        d = np.array([before.get(model.unknowns[k].name, 0.0) for k in test.index])
        free = [j for j, k in enumerate(test.index) if model.unknowns[k].name not in before and scatter[k] > 0.0]
        costs = []
        for sign in (0.0, 0.6, -0.6)[: 1 if as_is else 3] if free else ():
            d[free] = sign
            looked = model.look(i, model.own(i, point, d))
            costs.append((math.inf if looked is None else float(looked[0] @ looked[0]), sign))
        if free:
            d[free] = min(costs)[1]
        local.append(d)
    return model, point, local


def with_known_rig(model: Model) -> list[FloatArray]:
    """Return where a law fits with sensors and rig as known (nothing: nowhere); a simpler law's may lead it astray."""
    plain = replace(model_of([model.tests[0].observation.missing(0.0)], rig=False), most=25, tolerance=1e3)
    try:
        return [point_at(model, fit_from(plain, starting_points(plain), tempers=False).values())]
    except NO_MOTION:
        return []


def held_out(found: Fit) -> tuple[FloatArray, float | None]:
    """Return the score of each part left out (smaller is better) and the nrmse over them: tests, or parts of one.

    Each is one linear step from the fit to all. Of several tests the score is minus twice the log predictive density
    of each by the law of the others. A rig unlike itself is no prediction: of one test what its unknowns strain counts.
    """
    model = found.model
    if len(model.tests) == 1:
        law = np.array([u.law for u in model.unknowns])
        strain = float((model.strains(found.point)[~law] ** 2).sum())
        gain: FloatArray = np.asarray(np.linalg.solve(found.precision, found.slopes[0].T))
        scores, nrmse = model.tests[0].observation.left_out(found.residuals[0], found.slopes[0], gain)
        return scores + strain, nrmse
    if len(model.tests) < 3:
        return np.zeros(0), None
    posterior = Posterior(found, tuple(j.T @ j for j in found.slopes), model.scatter)
    parts, squares = [], []
    for i, test in enumerate(model.tests):
        mean, covariance = posterior.left_out(i)
        slopes = found.slopes[i]
        residual = found.residuals[i] + slopes @ (found.own(i) - mean)
        spread = np.eye(len(residual)) + slopes @ covariance @ slopes.T
        parts.append(float(residual @ np.linalg.solve(spread, residual)) + float(np.linalg.slogdet(spread)[1]))
        squares.append(test.observation.nrmse(residual) ** 2)
    return np.array(parts), math.sqrt(float(np.mean(squares)))


def left_for_work(said: Mapping[str, str | None]) -> list[str]:
    """Return the laws that a ladder's work did not suffice for, fewest terms first; ``said``: what happened to each."""
    return sorted((law for law, why in said.items() if SPENT in (why or "")), key=lambda law: law.count("+"))


def laws_above(law: Law, terms: tuple[str, ...], count: int) -> list[str]:
    """Return the names of the laws with so many more terms, without sums that exclude each other."""
    order, found = list(TERMS), list[str]()
    for more in combinations([t for t in terms if not law.has(t)], count):
        name = "+".join(sorted((*(t.name for t in law.terms), *more), key=order.index))
        try:
            law_of(name)
        except ParameterError:
            continue  # two of its terms exclude each other
        found.append(name)
    return found


def beside_energy(found: Posterior, chosen: Rung, rungs: Sequence[Rung]) -> Posterior:
    """Return the posterior of a law of speed with errors that reach to energy over path, if its rival was not fitted.

    One law's friction ratio is that of a stop, another's that of a fast slide, and both may explain a slow test.
    """
    term, k = RIVALS["smooth"][0], found.fit.find("beta")
    rivals = [rung for rung in rungs if rung.law.has(term)]
    if k is None or chosen.law.kind != "smooth" or not rivals or any(rung.fit is not None for rung in rivals):
        return found
    shift = np.zeros(len(found.unknowns))
    shift[k] = (by_energy(found, range(len(found.tests))) - 1.0) / found.relative(k)
    said = f"friction_ratio: {term} could not be fitted beside {chosen.law.name}; the error reaches to energy over path"
    return replace(found.with_shift(NOT_DISTINGUISHED, shift), warnings=(*found.warnings, said))


def undistinguished(found: Posterior, chosen: Rung, rungs: Sequence[Rung]) -> Posterior:
    """Return the posterior with errors that hold what other laws say, each as likely as its evidence makes it.

    The law given is the simplest that is required; richer ones may be as likely, because a weak term stays unseen. Each
    counts by its evidence over that of the law given, at most once: how far it stands from a value, and how much less
    sure it is of it, in quadrature. Between laws of which neither holds the other, a Bayes factor that would not make
    one required is one of their priors: such a law counts as one of two.
    """
    terms = {term.name for term in chosen.law.terms}
    index = {u.name: k for k, u in enumerate(found.unknowns) if u.law}
    more, named = np.zeros(len(found.unknowns)), []
    own = np.diag(found.covariance)
    for rung in rungs:
        gain, others = rung.log_evidence - chosen.log_evidence, {term.name for term in rung.law.terms}
        share = math.exp(min(0.0, gain)) if rung.fit is not None else 0.0
        if gain > -REQUIRED and not (others <= terms or terms <= others):
            share = max(share, 0.5)
        other = None if share <= SELDOM or rung.law.name == chosen.law.name else rung.posterior
        if other is None:
            continue
        variance = np.diag(other.covariance)
        for k, u in enumerate(other.unknowns):
            if u.law and u.name in index:
                here = index[u.name]
                apart = float(other.fit.point[k] - found.fit.point[here])
                moved = share * (apart**2 + max(float(variance[k] - own[here]), 0.0))
                more[here] += moved if share > LIKELY or moved > own[here] else 0.0
                if u.name == "beta" and abs(apart) > APART * math.sqrt(float(own[here])):
                    named.append(f"{rung.law.name} ({other.values()['beta']:.4g})")
    more = np.where(more > 0.05 * own, more, 0.0)
    if not more.any():
        return found
    found = found.with_shift(NOT_DISTINGUISHED, np.sqrt(more))
    if named:
        law = f"{chosen.law.name} ({found.values()['beta']:.4g})"
        said = (
            f"friction_ratio: what is recorded {NO_DIFFERENCE} {law} from {', '.join(dict.fromkeys(named))}: its"
            " error holds the difference. Tests at other frequencies or forces do: frictionlab plan chooses them"
        )
        found = replace(found, warnings=(*found.warnings, said))
    return found
