"""What a test would tell: Fisher's information on the law's parameters, nuisances beside them, as the fit counts it.

All tests share one set of coordinates: the friction coefficient (beta is proportional to it), the law's other
parameters at a reference amplitude, and the rig's nuisances (gain, lag, natural frequency, frame damping), each in
deviations of what is known before. So the information of several tests adds up.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.identification.coordinates import Coordinate, nuisances, of_parameter, point_of, values_of
from frictionlab.identification.forward import Forward
from frictionlab.identification.observed import FEW, by_base, parts
from frictionlab.planning.candidates import Candidate, Laboratory

FloatArray = NDArray[np.float64]
HARMONICS = 24
OVER_AMPLITUDE = {"gradient": 1, "slip_distance": -1, "stribeck_speed": -1, "rate_speed": -1, "reference_speed": -1}
OVER_FREQUENCY = {"bristle_damping": 1, "stribeck_speed": -1, "rate_speed": -1, "reference_speed": -1}


@dataclass(frozen=True)
class Prospect:
    """What one candidate would tell.

    ``regime``, ``response_m``: its expected motion, None where there is no steady state; ``information`` (n, n): on the
    shared coordinates, zero where it tells nothing; ``coordinates``: their names and scales.
    """

    candidate: Candidate
    regime: str | None
    response_m: float | None
    information: FloatArray
    coordinates: tuple[Coordinate, ...]

    @property
    def tells(self) -> bool:
        """Whether it tells anything."""
        return bool(self.information.any())


def shared_coordinates(lab: Laboratory, reference: Candidate) -> tuple[Coordinate, ...]:
    """The coordinates that all tests share: the law's free parameters, then the nuisances."""
    value, error = lab.coefficient
    beta = Coordinate(
        "beta", "friction coefficient", middle=math.log(value), width=error / value, is_log=True, law=True
    )
    own = [of_parameter(lab.law.parameter(name)) for name in reference.family.free if name != "beta"]
    turn = reference.turn(lab.natural_frequency_hz)
    return (beta, *own, *nuisances(reference.family, lab.sources, turn=turn))


def prospect(lab: Laboratory, candidate: Candidate, shared: tuple[Coordinate, ...], reference: Candidate) -> Prospect:
    """Return what a candidate would tell, at the values that are expected."""
    forward = Forward(candidate.family, _own_coordinates(lab, candidate, shared), HARMONICS)
    point = point_of(forward.coordinates, dict(candidate.values))
    values = values_of(forward.coordinates, point)
    state = forward.state(values)
    nothing = np.zeros((len(shared), len(shared)))
    if state is None or state.orbit is None or state.response_amplitude is None:
        return Prospect(candidate, None if state is None else state.regime, None, nothing, shared)
    response = state.response_amplitude * candidate.base_amplitude_m
    lines = forward.lines_of(state)
    if lines is None or _may_stand(lab, candidate):
        return Prospect(candidate, state.regime, response, nothing, shared)
    here = parts(forward.seen(lines, values))
    jacobian = forward.jacobian(point, here)
    covariance = _covariance(lab, candidate, jacobian[:, 0], shared[0].width) + by_base(
        here, _base_error(lab, candidate)
    )
    whitened = np.linalg.solve(np.linalg.cholesky(covariance), jacobian)
    scaled = whitened * _to_shared(candidate, reference, shared)
    return Prospect(candidate, state.regime, response, scaled.T @ scaled, shared)


def _may_stand(lab: Laboratory, candidate: Candidate) -> bool:
    """Whether the mass would stand still if friction were one standard error higher: then a test may tell nothing."""
    value, error = lab.coefficient
    more = candidate.values["beta"] * (1.0 + error / value)
    problem = candidate.family.problem({**candidate.values, "beta": more})
    return problem.mu * problem.beta >= problem.force_size


def _own_coordinates(lab: Laboratory, candidate: Candidate, shared: tuple[Coordinate, ...]) -> tuple[Coordinate, ...]:
    """The shared coordinates as they act on one test: beta about its own value, the lag in its own angle."""
    own = {c.name: c for c in nuisances(candidate.family, lab.sources, turn=candidate.turn(lab.natural_frequency_hz))}
    beta = Coordinate(
        "beta",
        "friction ratio",
        middle=math.log(candidate.values["beta"]),
        width=shared[0].width,
        is_log=True,
        law=True,
    )
    return (beta, *(own.get(c.name, c) for c in shared[1:]))


def _to_shared(candidate: Candidate, reference: Candidate, shared: tuple[Coordinate, ...]) -> FloatArray:
    """Change of each of the test's own coordinates by the shared one: dimensionless numbers scale with Y and omega."""
    amplitude = candidate.base_amplitude_m / reference.base_amplitude_m
    frequency = candidate.frequency_ratio / reference.frequency_ratio
    factors = [
        1.0 if c.is_log else amplitude ** OVER_AMPLITUDE.get(c.name, 0) * frequency ** OVER_FREQUENCY.get(c.name, 0)
        for c in shared
    ]
    return np.array(factors)


def _base_error(lab: Laboratory, candidate: Candidate) -> float:
    """Standard error to expect of the base's amplitude, over it: white noise and steps over all samples."""
    plan = lab.scene.plan
    samples = max(1.0, (plan.duration_s - lab.scene.analysis.transient_s) * plan.sampling_rate_hz)
    return math.sqrt(2.0 * (plan.noise_m**2 + plan.step_m**2 / 12.0) / samples) / candidate.base_amplitude_m


def _covariance(lab: Laboratory, candidate: Candidate, by_friction: FloatArray, width: float) -> FloatArray:
    """Covariance of the mean cycle to expect: white noise and steps of the sensors, and friction that scatters."""
    plan, drive = lab.scene.plan, candidate.frequency_ratio * lab.natural_frequency_hz
    cycles = max(1.0, math.floor(max(0.0, plan.duration_s - lab.scene.analysis.transient_s) * drive))
    white = (plan.noise_m**2 + plan.step_m**2 / 12.0) / candidate.base_amplitude_m**2
    one = 2.0 * white * drive / plan.sampling_rate_hz
    scatter = plan.cycle_scatter * by_friction / width
    least = FEW / cycles * (one + float(np.mean(scatter**2)))
    return np.asarray(((one + least) * np.eye(len(by_friction)) + np.outer(scatter, scatter)) / cycles)
