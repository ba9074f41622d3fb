"""Each test predicted by the law of all others: amplitude, energy and cycle, and whether the 95 % bands held them.

Of a few tests the fit is made again without the one left out; of many it is one linear step away. What the others say
of a test is a normal distribution of its unknowns: their posterior, and the scatter from test to test. It is carried to
amplitude and energy by three points (Gauss and Hermite) along each direction that moves the cycle. The scatter is known
from few tests, so its share of the variance has that few degrees of freedom (Welch and Satterthwaite), and a band is as
wide as Student's t of them asks.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.special import stdtrit

from frictionlab.arrays import FloatArray
from frictionlab.errors import FrictionlabError
from frictionlab.inference.fit import Model, fit_from, scatter_scale
from frictionlab.inference.observations import CycleObservation, cycle_of, parts
from frictionlab.inference.posterior import Posterior, of_several

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
    hold what was measured; ``lag_s``: by how much the base's channel is behind, as all tests find it: energies,
    measured and predicted, are without it, as `frictionlab predict` has them.
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
    lag_s: float | None = None


@dataclass(frozen=True)
class _Expected:
    """What the other tests say of test ``i`` of a model: its coordinates' ``mean`` (n,) and ``covariance`` (n, n).

    ``scatter`` (n,): from test to test, in it already; ``others``: how many tests of its material they are.
    """

    model: Model
    i: int
    mean: FloatArray
    covariance: FloatArray
    scatter: FloatArray
    others: int

    def lines(self, own: FloatArray) -> FloatArray | None:
        """Harmonics (2 K,) at the test's own coordinates; None where there is no motion."""
        return self.model.tests[self.i].observation.predict(self.model.values(self.i, own))


def left_out(posterior: Posterior, lag_s: float = 0.0) -> dict[str, LeftOutTest]:
    """Return by source each test of a joint fit as the others predict it; ``lag_s``: that the scene declares."""
    materials = [observation.material for observation in posterior.observations]
    found = {}
    for i, (observation, material) in enumerate(zip(posterior.observations, materials, strict=True)):
        source, others = observation.measurement.source, materials.count(material) - 1
        found[source] = LeftOutTest(source, material, reason=ALONE)
        if not others:
            continue
        late = posterior.values(i).get("lag_s", 0.0)
        try:
            test = _predicted(_expected(posterior, i, others), observation, late)
            found[source] = replace(test, lag_s=lag_s + late)
        except (FrictionlabError, ArithmeticError, np.linalg.LinAlgError) as error:
            found[source] = replace(found[source], reason=f"the other tests' law cannot be fitted: {error}")
    return found


def _expected(posterior: Posterior, i: int, others: int) -> _Expected:
    """What the others say of test i: by a fit of them in the same unknowns, or of many by one step."""
    model, index = posterior.fit.model, posterior.tests[i].index
    if len(model.tests) > FEW:
        return _Expected(model, i, *posterior.left_out(i), model.scatter[index], others)
    tests = tuple(replace(t, observation=t.observation.missing(0.0)) for j, t in enumerate(model.tests) if j != i)
    rest = of_several(fit_from(replace(model, tests=tests, scatter=0.0 * model.scatter), [posterior.fit.point]))
    rest = replace(rest, shifts=posterior.shifts)  # of what the law misses the others know no more
    mean, scatter = rest.fit.point[index], rest.fit.model.scatter[index]
    if others == 1:  # one test shows no scatter: what is assumed of it before any
        scatter = np.array([scatter_scale(model.unknowns[k], float(rest.fit.point[k])) for k in index])
    covariance = rest.covariance[np.ix_(index, index)] + np.diag(scatter**2)
    return _Expected(model, i, mean, covariance, scatter, others)


def _predicted(expected: _Expected, observation: CycleObservation, lag_s: float) -> LeftOutTest:
    """One test as the others predict it, its energies without a lag beyond the declared one."""
    measurement, lines, late = observation.measurement, expected.lines(expected.mean), lag_s * observation.turn
    if lines is None:
        return LeftOutTest(measurement.source, observation.material, reason=STILL)
    measured = np.array([measurement.energy_per_cycle, measurement.response_amplitude])
    error = np.array([measurement.energy_per_cycle_se or 0.0, measurement.response_amplitude_se or 0.0])
    offset = measured - seen_in(observation.data, observation)  # a mean of cycles is not the cycle of means
    measured = offset + seen_in(observation.data, observation, late)
    value = seen_in(lines, observation, late)
    middle, variance, scattered = _spread(expected, value, late)
    whole = variance + error**2
    freedom = (expected.others - 1 or 1) * (whole / np.maximum(scattered, 1e-9 * whole + 1e-300)) ** 2
    reach = stdtrit(np.minimum(freedom, 1e6), LEVEL) * np.sqrt(whole)
    low, high, value = offset + middle - reach, offset + middle + reach, offset + value
    own = _with_own(expected, observation)
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


def seen_in(lines: FloatArray, observation: CycleObservation, late: float = 0.0) -> FloatArray:
    """Return energy (k Y^2, eq. 2.18) and amplitude (Y) of a cycle by its harmonics: cosine parts, then sine parts.

    The energy is the area of the base over the mass: ``pi sum_k k (C_k b_k - S_k a_k)``; ``late``: phase (rad) by which
    the mass is shown ahead, taken off.
    """
    order, cycle = np.arange(1, len(lines) // 2 + 1), observation.measurement.cycle
    a, b = parts((lines[: len(order)] - 1j * lines[len(order) :]) * np.exp(-1j * late * order)).reshape(2, -1)
    count = min(len(cycle.base_cosine), len(a))
    area = cycle.base_cosine[:count] * b[:count] - cycle.base_sine[:count] * a[:count]
    phase = np.outer(np.linspace(0.0, 2.0 * np.pi, POINTS, endpoint=False), order)
    x = np.cos(phase) @ a + np.sin(phase) @ b
    return np.array([math.pi * float(order[:count] @ area), 0.5 * float(np.ptp(x))])


def _spread(expected: _Expected, here: FloatArray, late: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean and variance of energy and amplitude over what the others say of the test, and the scatter's part of it.

    Independent deviations of the test's unknowns are followed, the most telling first; the scatter of a test, and of
    the others about their mean, is a share of each.
    """
    model, i, observation = expected.model, expected.i, cycle_of(expected.model.tests[expected.i])
    values, vectors = np.linalg.eigh(expected.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    _, sizes, turned = np.linalg.svd(model.slopes(i, expected.mean) @ root, full_matrices=False)
    scatter = expected.scatter * math.sqrt(1.0 + 1.0 / expected.others)
    back = vectors / np.sqrt(np.maximum(values, 1e-300))
    middle, variance, scattered = here.copy(), np.zeros(2), np.zeros(2)
    for row in turned[sizes > MOVES][:MOST_DIRECTIONS]:
        ends = [expected.lines(expected.mean + sign * HERMITE * (root @ row)) for sign in (1.0, -1.0)]
        both = np.array([seen_in(end, observation, late) - here for end in ends if end is not None])
        if not len(both):
            continue
        weights = OUTER * 2.0 / len(both)
        mean = weights * both.sum(axis=0)
        added = weights * (both**2).sum(axis=0) - mean**2
        share = min(1.0, float(np.sum((scatter * (back @ row)) ** 2)))
        middle, variance, scattered = middle + mean, variance + added, scattered + share * added
    return middle, variance, scattered


def _with_own(expected: _Expected, observation: CycleObservation) -> FloatArray:
    """Harmonics (2 K,) with the test's own unknowns fitted to it, each held by its scatter from test to test."""
    test, unknowns = expected.model.tests[expected.i], expected.model.unknowns
    own = [j for j, k in enumerate(test.index) if unknowns[k].level == "test"]
    sd = np.sqrt(np.diag(expected.covariance))[own]

    def lines(d: FloatArray) -> FloatArray | None:
        moved = expected.mean.copy()
        moved[own] += sd * d
        return expected.lines(moved)

    def residual(d: FloatArray) -> FloatArray:
        seen = lines(d)
        gap = 1e3 * np.ones(len(observation.data)) if seen is None else observation.white(observation.data - seen)
        return np.concatenate([gap, d])

    found = np.zeros(len(own))
    if own:
        best = min((np.full(len(own), sign) for sign in SIGNS), key=lambda d: float(residual(d) @ residual(d)))
        found = least_squares(residual, best, method="lm", diff_step=[1e-3] * len(own), max_nfev=40).x
    seen = lines(found)
    return observation.data if seen is None else seen
