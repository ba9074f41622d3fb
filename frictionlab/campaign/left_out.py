"""Each test predicted by the law of all others: amplitude, energy and cycle, and whether the 95 % bands held them.

Of a few tests the fit is made again without the one left out; of many it is one linear step away. What the others say
of a test is a normal distribution of its unknowns: their posterior, and the scatter from test to test. It is carried to
amplitude and energy by three points (Gauss and Hermite) along each direction that moves the cycle. The scatter is known
from few tests, so its share of the variance has that few degrees of freedom (Welch and Satterthwaite), and a band is as
wide as Student's t of them asks.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.special import stdtrit

from frictionlab.arrays import FloatArray
from frictionlab.errors import FrictionlabError
from frictionlab.inference.fit import Model, scatter_scale
from frictionlab.inference.observations import CycleObservation
from frictionlab.inference.posterior import Posterior, infer, model_of

FEW = 8  # tests up to which the fit is made again
MOVES = 0.1  # of the noise: a direction along which the cycle moves by less is not followed ...
MOST_DIRECTIONS = 6  # ... nor are more than these
HERMITE = math.sqrt(3.0)  # of three points: the outer ones, in standard deviations
OUTER = 1.0 / 6.0  # and the weight of each
LEVEL = 0.975  # of the upper end of a 95 % band
SIGNS = (0.0, 0.6, -0.6)  # scatters at which a test's own unknowns begin
POINTS = 256  # of a cycle
ALONE = "no other test of its material is at hand"
STILL = "by the law of the other tests there is no steady motion here"


@dataclass(frozen=True)
class LeftOutTest:
    """One test predicted by the law of all others; where that cannot be, ``reason`` says why and no number is known.

    Energies in k Y^2, amplitudes in Y; ``_low`` and ``_high``: 95 % bands; ``response_nrmse``: with nothing taken from
    the test; ``response_nrmse_own``: with its own test-level unknowns fitted to it; ``band_holds``: whether both bands
    hold what was measured.
    """

    source: str
    material: str | None
    predicted_energy_per_cycle: float | None = None
    measured_energy_per_cycle: float | None = None
    predicted_response_amplitude: float | None = None
    response_nrmse: float | None = None
    response_nrmse_own: float | None = None
    band_holds: bool | None = None
    measured_response_amplitude: float | None = None
    predicted_energy_per_cycle_low: float | None = None
    predicted_energy_per_cycle_high: float | None = None
    predicted_response_amplitude_low: float | None = None
    predicted_response_amplitude_high: float | None = None
    reason: str | None = None


@dataclass(frozen=True)
class Expected:
    """What the other tests say of one: ``model``, the test's number in it, coordinates and their covariance.

    ``others``: how many tests of its material they are.
    """

    model: Model
    i: int
    mean: FloatArray
    covariance: FloatArray
    others: int

    @property
    def observation(self) -> CycleObservation:
        """The test."""
        found = self.model.tests[self.i].observation
        if not isinstance(found, CycleObservation):
            raise TypeError(f"expected the mean cycle of a test; got {type(found).__name__}")
        return found

    def lines(self, own: FloatArray) -> FloatArray | None:
        """Harmonics (2 K,) at the test's own coordinates; None where there is no motion."""
        return self.observation.predict(self.model.values(self.i, own))


def left_out(posterior: Posterior) -> tuple[LeftOutTest, ...]:
    """Return each test of a joint fit as the others predict it."""
    materials = [test.observation.material for test in posterior.tests]
    found = []
    for i, (observation, material) in enumerate(zip(posterior.observations, materials, strict=True)):
        source, others = observation.measurement.source, materials.count(material) - 1
        if others == 0:
            found.append(LeftOutTest(source, material, reason=ALONE))
            continue
        try:
            expect = _made_again if len(materials) <= FEW else _one_step
            found.append(predicted_by_others(expect(posterior, i, others)))
        except (FrictionlabError, ArithmeticError, np.linalg.LinAlgError) as error:
            found.append(LeftOutTest(source, material, reason=f"the other tests' law cannot be fitted: {error}"))
    return tuple(found)


def _one_step(posterior: Posterior, i: int, others: int) -> Expected:
    mean, covariance = posterior.left_out(i)
    return Expected(posterior.fit.model, i, mean, covariance, others)


def _made_again(posterior: Posterior, i: int, others: int) -> Expected:
    """What a fit without test i says of it: its values, in the unknowns of a model that has the test as its last."""
    observations = list(posterior.observations)
    out = observations.pop(i)
    rest = infer(observations, near=posterior.values(1 if i == 0 else 0))
    model = model_of([*observations, out])
    mean, scale = np.zeros(len(model.unknowns)), np.ones(len(model.unknowns))
    place = np.full(len(model.unknowns), -1)
    scatter = np.zeros(len(model.unknowns))
    for old, new in zip(rest.tests, model.tests, strict=False):
        for k, m in zip(old.index, new.index, strict=True):
            u, other = rest.unknowns[k], model.unknowns[m]
            scale[m] = u.sd / other.sd
            mean[m], place[m] = other.at(u.value(float(rest.fit.point[k]))), k
            scatter[m] = rest.fit.model.scatter[k] * scale[m]
    index = model.tests[-1].index
    if others == 1:  # one test tells no scatter: what is assumed of it before any
        scatter[index] = [scatter_scale(model.unknowns[k], float(mean[k])) for k in index]
    covariance = np.eye(len(index))
    known = place[index] >= 0
    covariance[np.ix_(known, known)] = rest.covariance[np.ix_(place[index][known], place[index][known])]
    covariance *= np.outer(scale[index], scale[index])
    covariance += np.diag(scatter[index] ** 2)
    return Expected(replace(model, scatter=scatter), len(model.tests) - 1, mean[index], covariance, others)


def predicted_by_others(expected: Expected) -> LeftOutTest:
    """Return one test as the others predict it."""
    observation, measurement = expected.observation, expected.observation.measurement
    lines = expected.lines(expected.mean)
    if lines is None:
        return LeftOutTest(measurement.source, observation.material, reason=STILL)
    measured = np.array([measurement.energy_per_cycle, measurement.response_amplitude])
    error = np.array([measurement.energy_per_cycle_se or 0.0, measurement.response_amplitude_se or 0.0])
    offset = measured - seen_in(observation.data, observation)  # a mean of cycles is not the cycle of means
    middle, variance, scattered = _spread(expected, lines)
    whole = variance + error**2
    freedom = (expected.others - 1 or 1) * (whole / np.maximum(scattered, 1e-9 * whole + 1e-300)) ** 2
    value, reach = offset + seen_in(lines, observation), student(freedom) * np.sqrt(whole)
    low, high = offset + middle - reach, offset + middle + reach
    own = _with_own(expected)
    return LeftOutTest(
        source=measurement.source,
        material=observation.material,
        predicted_energy_per_cycle=float(value[0]),
        measured_energy_per_cycle=float(measured[0]),
        predicted_response_amplitude=float(value[1]),
        response_nrmse=observation.nrmse(observation.white(observation.data - lines)),
        response_nrmse_own=observation.nrmse(observation.white(observation.data - own)),
        band_holds=bool(np.all((low <= measured) & (measured <= high))),
        measured_response_amplitude=float(measured[1]),
        predicted_energy_per_cycle_low=float(min(low[0], value[0])),
        predicted_energy_per_cycle_high=float(max(high[0], value[0])),
        predicted_response_amplitude_low=float(min(low[1], value[1])),
        predicted_response_amplitude_high=float(max(high[1], value[1])),
    )


def seen_in(lines: FloatArray, observation: CycleObservation) -> FloatArray:
    """Return energy (k Y^2, eq. 2.18) and amplitude (Y) of a cycle by its harmonics: cosine parts, then sine parts.

    The energy is the area of the base over the mass: ``pi sum_k k (C_k b_k - S_k a_k)``.
    """
    a, b = lines.reshape(2, -1)
    cycle, order = observation.measurement.cycle, np.arange(1, len(a) + 1)
    count = min(len(cycle.base_cosine), len(a))
    area = cycle.base_cosine[:count] * b[:count] - cycle.base_sine[:count] * a[:count]
    phase = np.outer(np.linspace(0.0, 2.0 * np.pi, POINTS, endpoint=False), order)
    x = np.cos(phase) @ a + np.sin(phase) @ b
    return np.array([math.pi * float(order[:count] @ area), 0.5 * float(np.ptp(x))])


def student(freedom: FloatArray) -> FloatArray:
    """Return from how many standard deviations on 2.5 % lie beyond either end, at so many degrees of freedom.

    Examples
    --------
    >>> student(np.array([2.0, 1e9])).round(3).tolist()
    [4.303, 1.96]
    """
    return np.asarray(stdtrit(np.minimum(freedom, 1e6), LEVEL))


def _spread(expected: Expected, lines: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean and variance of energy and amplitude over what the others say of the test, and the scatter's part of it."""
    observation = expected.observation
    here = seen_in(lines, observation)
    middle, variance, scattered = here.copy(), np.zeros(2), np.zeros(2)
    for direction, share in _directions(expected):
        ends = [expected.lines(expected.mean + sign * HERMITE * direction) for sign in (1.0, -1.0)]
        both = np.array([seen_in(end, observation) - here for end in ends if end is not None])
        if not len(both):
            continue
        weights = OUTER * 2.0 / len(both)
        mean = weights * both.sum(axis=0)
        added = weights * (both**2).sum(axis=0) - mean**2
        middle, variance, scattered = middle + mean, variance + added, scattered + share * added
    return middle, variance, scattered


def _directions(expected: Expected) -> Sequence[tuple[FloatArray, float]]:
    """Independent deviations (one standard deviation each) of the test's unknowns, the most telling first.

    With each stands which share of it is scatter from test to test: of the test, and of the others about their mean.
    """
    values, vectors = np.linalg.eigh(expected.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    slopes = expected.model.slopes(expected.i, expected.mean)
    _, sizes, turned = np.linalg.svd(slopes @ root, full_matrices=False)
    kept = [row for size, row in zip(sizes, turned, strict=True) if size > MOVES][:MOST_DIRECTIONS]
    scatter = expected.model.scatter[expected.model.tests[expected.i].index]
    scatter = scatter * math.sqrt(1.0 + 1.0 / expected.others)
    back = vectors / np.sqrt(np.maximum(values, 1e-300))
    return [(root @ row, min(1.0, float(np.sum((scatter * (back @ row)) ** 2)))) for row in kept]


def _with_own(expected: Expected) -> FloatArray:
    """Harmonics (2 K,) with the test's own unknowns fitted to it, each held by its scatter from test to test."""
    test, observation = expected.model.tests[expected.i], expected.observation
    own = [j for j, k in enumerate(test.index) if expected.model.unknowns[k].level == "test"]
    sd = np.sqrt(np.diag(expected.covariance))[own]

    def coordinates(d: FloatArray) -> FloatArray:
        moved = expected.mean.copy()
        moved[own] += sd * d
        return moved

    def residual(d: FloatArray) -> FloatArray:
        lines = expected.lines(coordinates(d))
        gap = 1e3 * np.ones(len(observation.data)) if lines is None else observation.white(observation.data - lines)
        return np.concatenate([gap, d])

    if own:
        starts = [np.full(len(own), sign) for sign in SIGNS]
        best = min(starts, key=lambda d: float(residual(d) @ residual(d)))
        found = least_squares(residual, best, method="lm", diff_step=[1e-3] * len(own), max_nfev=40).x
    else:
        found = np.zeros(0)
    lines = expected.lines(coordinates(found))
    return observation.data if lines is None else lines
