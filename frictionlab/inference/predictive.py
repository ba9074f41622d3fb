"""What the law of a material says of tests not made: each number with the band that 95 of 100 such tests fall into."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.base_motion import RecordResponse, respond_to
from frictionlab.errors import FrictionlabError
from frictionlab.inference.material_law import DETUNING, MaterialLaw
from frictionlab.recording import Recording
from frictionlab.schema import AMPLITUDE, ENERGY, PREDICTED, PREDICTED_RECORD, PREDICTIONS, Result, banded, value_of
from frictionlab.simulator import steady_state

LOW, HIGH = 0.025, 0.975  # probabilities at the ends of a band
POINTS = 361  # of a cycle, both ends
MOST_DRAWS, FEWEST_DRAWS, ALL_DRAWS = 200, 60, 4000  # of one test, and of all tests together
NOT_ALL = "{} of {} motions that the law's errors allow have no steady state: the bands hold the others"


class Band(NamedTuple):
    """A number and the ends of its 95 % band; all None where there is none."""

    value: float | None
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, kw_only=True, repr=False)
class PredictedTest:
    """One test not made; the contract's keys are those of `row`.

    ``numbers``: name -> its band; ``unsteady``: share of the motions drawn that have no steady state (of a record no
    motion), and which no band holds. ``time`` (p,) s of a cycle from the top of the base's motion, or of the whole
    record; ``displacement`` of the mass with ``displacement_low``, ``displacement_high``, and ``base`` (p,) in m.
    """

    material: str
    law: str
    frequency_ratio: float | None
    normal_force_n: float
    base_amplitude_m: float
    regime: str | None
    numbers: Mapping[str, Band]
    warnings: tuple[str, ...]
    unsteady: float
    time: FloatArray
    displacement: FloatArray
    displacement_low: FloatArray
    displacement_high: FloatArray
    base: FloatArray

    def __repr__(self) -> str:
        energy = self.numbers.get(f"{ENERGY}_j") or self.numbers["record_energy_j"]
        said = f"amplitude {in_words(self.numbers[f'{AMPLITUDE}_m'])} mm, energy {in_words(energy)} mJ"
        where = "a record" if self.frequency_ratio is None else f"r = {self.frequency_ratio:.4g}"
        return f"<PredictedTest of {self.material}, {where}: {said}>"

    def row(self) -> dict[str, object]:
        """The contract's keys alone: a line of JSON or of a table."""
        known = {name: getattr(self, name, None) for name in PREDICTIONS.names}
        return {**known, **banded(self.numbers), "warnings": list(self.warnings)}


@dataclass(frozen=True)
class Prediction(Result):
    """What a law says of some tests not made, in order of the frequency ratios asked for."""

    law: MaterialLaw
    tests: tuple[PredictedTest, ...]

    def __repr__(self) -> str:
        return f"<Prediction of {len(self.tests)} tests by {self.law!r}>"

    def rows(self) -> list[dict[str, object]]:
        """One row per test."""
        return [test.row() for test in self.tests]


def in_words(band: Band, times: float = 1e3) -> str:
    """Return a number with its band, in thousandths of its unit; alone, where the band has no width."""
    if band.value is None or band.low is None or band.high is None:
        return "not known"
    if band.low == band.high:
        return f"{times * band.value:.4g}"
    return f"{times * band.value:.4g} ({times * band.low:.4g} to {times * band.high:.4g})"


def predict_tests(
    law: MaterialLaw,
    frequency_ratios: Sequence[float],
    *,
    normal_force_n: float,
    base_amplitude_m: float,
    draws: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Prediction:
    """Predict tests not made, one per frequency ratio.

    ``draws``: motions behind each band, by default 200, fewer of many tests; ``progress``: called with tests predicted
    and tests in all.

    Raises
    ------
    UsageError
        The law holds for other normal forces only.
    ParameterError
        A number is outside its domain.
    """
    count = draws or min(MOST_DRAWS, max(FEWEST_DRAWS, ALL_DRAWS // max(len(frequency_ratios), 1)))
    others, tau = law.draws(count), np.linspace(0.0, 2.0 * np.pi, POINTS)
    force, amplitude, found = normal_force_n, base_amplitude_m, []
    factors = (1.0, amplitude, 1.0, law.frame["stiffness_n_per_m"] * amplitude**2, 1.0)
    for r in frequency_ratios:
        best, states = steady_state(law.problem(force, amplitude, r)), []
        for values in others:
            with suppress(FrictionlabError):  # values outside a law's domain have no motion
                states.append(steady_state(law.problem(force, amplitude, r, values=values)))
        states = [state for state in states if state.orbit is not None]
        middle = np.full(POINTS, np.nan) if best.orbit is None else best.orbit.at(tau)[0]
        motions = np.array([s.orbit.at(tau)[0] for s in states if s.orbit is not None])
        numbers = {
            name: band_of(value_of(best, key), [value_of(s, key) for s in states], factor)
            for name, factor in zip(PREDICTED, factors, strict=True)
            for key in [name.removesuffix("_m").removesuffix("_j")]
        }
        unsolved = () if best.outcome in ("periodic", "stuck") else (best.verdict,)
        beyond = law.beyond(frequency_ratio=r, normal_force_n=force, base_amplitude_m=amplitude)
        lost = (NOT_ALL.format(count - len(states), count),) if len(states) < count else ()
        found.append(
            PredictedTest(
                material=law.material,
                law=law.law,
                frequency_ratio=r,
                normal_force_n=force,
                base_amplitude_m=amplitude,
                regime=best.regime,
                numbers=numbers,
                warnings=(*unsolved, *best.warnings, *beyond, *lost),
                unsteady=1.0 - len(states) / count,
                time=tau / (2.0 * np.pi * r * law.natural_frequency_hz),
                base=amplitude * best.problem.base.at(tau),
                **_displacements(amplitude * middle, amplitude * motions),
            )
        )
        if progress is not None:
            progress(len(found), len(frequency_ratios))
    return Prediction(law, tuple(found))


def _displacements(middle: FloatArray, motions: FloatArray) -> dict[str, FloatArray]:
    low, high = np.quantile(motions, (LOW, HIGH), axis=0) if len(motions) else (middle, middle)
    return {
        "displacement": middle,
        "displacement_low": np.fmin(low, middle),
        "displacement_high": np.fmax(high, middle),
    }


def band_of(value: float | None, drawn: Sequence[float | None], factor: float = 1.0) -> Band:
    """Return the 95 % band about a number by what was drawn for it, times a factor."""
    known = [x for x in drawn if x is not None]
    if value is None or not known:
        return Band(None if value is None else factor * value)
    low, high = np.quantile(known, (LOW, HIGH))
    return Band(factor * value, factor * min(float(low), value), factor * max(float(high), value))


def predict_record(
    law: MaterialLaw, recording: Recording, *, normal_force_n: float, draws: int = FEWEST_DRAWS
) -> Prediction:
    """Predict the response, from rest, to any recorded motion of the base; ``draws``: motions behind each band.

    Its amplitude is the largest displacement of the mass, its energy and its stops are those of the whole record.

    Raises
    ------
    RecordingError, SimulationError
        The base jumps, has a gap or does not move.
    """
    largest = float(np.abs(recording.base_displacement - recording.base_displacement[0]).max())
    swing = 0.5 * float(np.ptp(recording.base_displacement))  # a record may begin at a crest: tests are told by this
    frequency, stiffness = law.natural_frequency_hz, law.frame["stiffness_n_per_m"]

    def respond(values: Mapping[str, float]) -> RecordResponse:
        detuned = values.get(DETUNING, 1.0)
        problem = law.problem(normal_force_n, largest or 1.0, 1.0, values={**values, DETUNING: 1.0})
        return respond_to(recording, problem, natural_frequency_hz=frequency * detuned, stiffness_n_per_m=stiffness)

    best, found = respond(law.values), []
    answers = [best]
    for values in law.draws(draws):
        with suppress(FrictionlabError):
            answers.append(respond(values))
    lost = (NOT_ALL.format(draws + 1 - len(answers), draws),) if len(answers) <= draws else ()
    for a in answers:
        peak, energy, y = a.response.peaks["displacement"], a.response.energy, a.response.base.scale
        joules = energy * (a.stiffness_n_per_m or 0.0) * y**2
        found.append((peak, peak * y, energy, joules, float(a.response.stops)))
    drawn = np.array([a.recording.mass_displacement for a in answers[1:]])
    test = PredictedTest(
        material=law.material,
        law=law.law,
        frequency_ratio=None,
        normal_force_n=normal_force_n,
        base_amplitude_m=largest,
        regime=None,
        numbers={name: band_of(found[0][i], [n[i] for n in found[1:]]) for i, name in enumerate(PREDICTED_RECORD)},
        warnings=(*best.warnings, *law.beyond(normal_force_n=normal_force_n, base_amplitude_m=swing), *lost),
        unsteady=1.0 - (len(answers) - 1) / draws,
        time=best.recording.time,
        base=best.recording.base_displacement,
        **_displacements(best.recording.mass_displacement, drawn),
    )
    return Prediction(law, (test,))
