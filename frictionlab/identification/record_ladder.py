"""The ladder of laws on a whole record: from the law that the cycle requires, as far as the record asks for more.

What a law leaves of a record hangs together over many samples. So the evidence of a rung counts a record as
``n / (autocorrelation time)`` samples of unknown variance, ``- N / 2 log(rms^2)``, beside the volumes of Laplace's
approximation; two laws are held against each other with the smaller N of both. A rung is climbed if the logarithm of
its Bayes factor is above 5, if the sums of squares of single periods fall by more than their own error, and if one of
its new parameters lies 3.5 errors from where its term does nothing.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import AnalysisError, ParameterError, SimulationError, UsageError
from frictionlab.identification.colour import Whitener
from frictionlab.identification.coordinates import Coordinate
from frictionlab.identification.family import Family
from frictionlab.identification.fit import Fit, log_evidence
from frictionlab.identification.identify import Identified, with_errors
from frictionlab.identification.ladder import EXACT, NUMERIC, REQUIRED, laws_above, trial_values
from frictionlab.identification.observed import Observed
from frictionlab.identification.record_fit import RecordFit, errors_held, errors_of_record, fit_record, together
from frictionlab.identification.track import RecordForward, Track, start_coordinates
from frictionlab.simulator.laws import law_of

FloatArray = NDArray[np.float64]
Unknowns = Callable[[Family], tuple[Coordinate, ...]]
MOST_RUNGS = 24
SURE = 3.5  # errors from where a term does nothing: half its square is an evidence of 6


@dataclass(frozen=True)
class RecordRung:
    """One law fitted to a record.

    ``found``: its fit; ``per_period``: samples of a period; ``gain``: its log evidence over the best simpler law tried;
    ``required``: whether the record requires it; ``seconds``: what it took.
    """

    found: RecordFit
    forward: RecordForward
    nrmse: float
    per_period: int
    gain: float = 0.0
    required: bool = True
    seconds: float = 0.0

    @property
    def law(self) -> str:
        """The law's name."""
        return self.forward.family.law.name

    def weighed_by(self, whitener: Whitener) -> tuple[FloatArray, float]:
        """Mean square (c,) of what it leaves of each period, filtered, and how many samples that is worth."""
        left = whitener(self.found.gap - self.found.gap.mean())
        return _squares(left, self.per_period), len(left) / together(left)

    def row(self) -> dict[str, object]:
        """The rung as one object of the ladder."""
        return {
            "law": self.law,
            "parameters": {n: v for n, v in self.found.law_values.items() if n != "frame_damping_ratio"},
            "log_evidence_gain": self.gain,
            "record_nrmse": self.nrmse,
            "required": self.required,
            "seconds": self.seconds,
        }


@dataclass
class RecordLadder:
    """The rungs of one record as they come.

    ``unknowns``: the coordinates of a family of problems; ``tries``: starts of its bottom that are followed;
    ``left_out``: law -> why it could not be fitted.
    """

    track: Track
    unknowns: Unknowns
    observed: Observed
    tries: int = 1
    rungs: list[RecordRung] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)

    def climb(self, family: Family, starts: Sequence[Mapping[str, float]]) -> Identified:
        """Return the law that the record requires, with its values and their errors."""
        here = self._rung(family, starts, None)
        while len(self.rungs) < MOST_RUNGS:
            good = self._above(here, 1) or self._above(here, 2)
            if not good:
                break
            here = max(good, key=lambda rung: rung.gain)
        return with_errors(here.forward.family, here.found, errors=errors_held(here.found, here.forward, starts))

    @property
    def rows(self) -> tuple[dict[str, object], ...]:
        """The rungs as objects of the contract's ladder."""
        return tuple(rung.row() for rung in self.rungs)

    @property
    def said(self) -> tuple[str, ...]:
        """Which laws were not held against the record, and why."""
        numeric = ", ".join(NUMERIC)
        tried = f"record_laws: the exact laws alone were tried on the whole record, not {numeric}"
        return (
            f"{tried}; do: --law coulomb+NAME --fit whole for one of them",
            *(f"law {name}: not compared on the record: {why}" for name, why in self.left_out.items()),
        )

    def _above(self, here: RecordRung, count: int) -> list[RecordRung]:
        """The rungs with so many more terms that the record requires over this one."""
        tried = [self._try(here, name) for name in laws_above(here.forward.family.law, EXACT, count)]
        return [rung for rung in tried if rung is not None and rung.required]

    def _try(self, here: RecordRung, name: str) -> RecordRung | None:
        """A law fitted from the one below; None where it has been tried, or cannot be fitted."""
        if name in self.left_out or any(rung.law == name for rung in self.rungs):
            return None
        known = here.found.values
        family = here.forward.family.under(law_of(name))
        new = [c for c in self.unknowns(family) if c.law and c.name not in known]
        try:
            return self._rung(family, [known | values for values in trial_values(new)], here)
        except (AnalysisError, ParameterError, SimulationError, UsageError, np.linalg.LinAlgError) as fault:
            self.left_out[name] = str(fault)
            return None

    def _rung(self, family: Family, starts: Sequence[Mapping[str, float]], below: RecordRung | None) -> RecordRung:
        begin = time.perf_counter()
        forward = RecordForward(family, (*self.unknowns(family), *start_coordinates(self.track)), self.track)
        found = fit_record(forward, self.observed, starts, tries=self.tries if below is None else 1)
        gap = found.gap
        rung = RecordRung(
            found,
            forward,
            nrmse=float(np.sqrt(np.mean(gap**2))) / self.track.rms,
            per_period=self.track.per_period,
            seconds=time.perf_counter() - begin,
        )
        if below is not None:
            rung = _judged(rung, below, self._simpler(rung, below))
            rung = replace(rung, required=rung.required and _is_sure(rung, below))
        self.rungs.append(rung)
        return rung

    def _simpler(self, rung: RecordRung, below: RecordRung) -> list[RecordRung]:
        """The rungs with fewer terms that were tried: two terms must beat each alone."""
        terms = {t.name for t in rung.forward.family.law.terms}
        return [r for r in self.rungs if {t.name for t in r.forward.family.law.terms} < terms] or [below]


def _judged(rung: RecordRung, below: RecordRung, simpler: list[RecordRung]) -> RecordRung:
    """A rung with its gain over the law below, and whether it is required over all simpler ones."""
    gain = min(evidence_gain(rung, other) for other in simpler)
    (before, _), (after, _) = (one.weighed_by(below.found.whitener) for one in (below, rung))
    count = min(len(before), len(after))
    better = before[:count] - after[:count]
    error = float(better.std(ddof=1)) / math.sqrt(count) if count > 1 else math.inf
    return replace(rung, gain=gain, required=gain > REQUIRED and float(better.mean()) > error)


def _is_sure(rung: RecordRung, below: RecordRung) -> bool:
    """Whether one of the new parameters lies far enough from where its term does nothing.

    Its error holds what the base's noise does to the motion itself: a stop that it moves stands for many samples.
    """
    errors, law = errors_of_record(rung.found, rung.forward), rung.forward.family.law
    known = {c.name for c in below.found.coordinates}
    for i, c in enumerate(rung.found.coordinates):
        if not c.law or c.name in known:
            continue
        neutral = law.parameter(c.name).neutral
        if neutral is None or not math.isfinite(neutral):
            return True  # no value of it does nothing: its evidence alone decides
        if abs(rung.found.point[i] - c.at(neutral)) > SURE * math.sqrt(errors.combined[i, i]):
            return True
    return False


def evidence_gain(rung: RecordRung, below: RecordRung) -> float:
    """Logarithm of the Bayes factor of one law over another on the same record.

    Both are weighed as the lower one was: where that leaves nothing but noise, by what makes the noise white. Else the
    base's noise, which shakes the mass for many samples in a row, would pass for a property of the contact.
    """
    (before, fewer), (after, fewest) = (one.weighed_by(below.found.whitener) for one in (below, rung))
    fits = 0.5 * min(fewer, fewest) * math.log(float(np.mean(before)) / float(np.mean(after)))
    return fits + _volume(rung.found) - _volume(below.found)


def _volume(found: Fit) -> float:
    """What is left of a fit's log evidence without its misfit: the priors, and the volume that the record leaves."""
    root = math.sqrt(found.excess)
    scaled = replace(found, residual=found.residual / root, jacobian=found.jacobian / root, excess=1.0)
    return log_evidence(scaled) + 0.5 * scaled.chi_square


def _squares(gap: FloatArray, per_period: int) -> FloatArray:
    """Mean square of each whole period (c,)."""
    whole = len(gap) // per_period * per_period
    parts = gap[:whole].reshape(-1, per_period) if whole else gap.reshape(1, -1)
    return np.asarray(np.mean(parts**2, axis=1))
