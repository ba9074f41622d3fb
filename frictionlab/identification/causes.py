"""What sensors and rig add to a fit: how far it pushed what is known of them, and each one's share of the error."""

import math

import numpy as np

from frictionlab.identification.coordinates import PRESSED, Coordinate, doubts, pulled
from frictionlab.identification.family import HIGHER
from frictionlab.identification.fit import Fit
from frictionlab.identification.fit_errors import Errors

AS_KNOWN = "sensors and rig as known, or as fitted"  # the share of how far the two fits are from each other
CAUSES = {
    "natural_frequency": "the natural frequency (rig.natural_frequency_hz)",
    "gain": "the gain of a sensor (sensors.gain_error)",
    "lag": "the lag between the channels (sensors.lag_s)",
    "frame_damping_ratio": "the frame's damping (rig.damping_ratio)",
    "parabola": "the linearity of the mass's sensor (sensors.linearity)",
    "cubic": "the linearity of the mass's sensor (sensors.linearity)",
    "base_in_mass": "the base's channel in the mass's (sensors.crosstalk)",
    "mass_in_base": "the mass's channel in the base's (sensors.crosstalk)",
    "second_cosine": "a second harmonic of the base",
    "second_sine": "a second harmonic of the base",
    HIGHER: "the share of the base's higher harmonics that is no sensor's (model.base_harmonics)",
}


def pressed(found: Fit) -> tuple[str, ...]:
    """Say which known quantity the fit had to push away from what is known of it."""
    said = []
    for c, far in _pushed(found):
        count, unit = c.unit
        times = abs(far) / c.assumed
        against = "what is assumed where none is declared: measure it and declare it"
        if math.isinf(c.tail):
            against = "its standard uncertainty: check it"
        moved_by = f"{count * c.width * far:.2g}{unit}, which is {times:.2g} times {against}"
        said.append(f"friction_ratio: the fit moved {CAUSES[c.name]} by {moved_by}")
    return tuple(dict.fromkeys(said))


def _pushed(found: Fit) -> list[tuple[Coordinate, float]]:
    """What is known of sensors and rig that a fit had to push far, each with the distance in widths of its prior."""
    told = zip(found.coordinates, found.point.tolist(), strict=True)
    return [(c, far) for c, far in told if not c.law and abs(far) > PRESSED * c.assumed]


def shares(found: Fit, errors: Errors) -> dict[str, float]:
    """Standard uncertainty that each source adds to the friction ratio: in quadrature they make the combined one.

    A source's share is what its own error, as it was known before, leaves in the values found (`errors_of`).
    """
    names = [c.name for c in found.coordinates]
    if "beta" not in names:
        return {}
    i = names.index("beta")
    slope = found.coordinates[i].slope(float(found.point[i]))
    left = pulled(np.asarray(np.linalg.inv(found.precision)), doubts(found.coordinates, found.point))[i]
    by_cause = {c.name: slope * abs(float(left[k])) for k, c in enumerate(found.coordinates) if not c.law}
    apart = slope * float(np.broadcast_to(errors.apart, len(names))[i])
    by_cause |= {AS_KNOWN: apart} if apart else {}
    rest = slope**2 * float(errors.combined[i, i]) - sum(share**2 for share in by_cause.values())
    return {"noise and misfit": math.sqrt(max(rest, 0.0)), **by_cause}
