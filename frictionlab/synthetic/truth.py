"""What is true of a virtual test: its numbers, its steady state, how its energy and its cycles change."""

from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from frictionlab.simulator import observe, steady_state
from frictionlab.synthetic.motion import HOUR
from frictionlab.synthetic.rig import VirtualTest

FloatArray = NDArray[np.float64]


def truth(test: VirtualTest) -> dict[str, object]:
    """What is known of a test: its parameters and the steady state of its (undisturbed) problem, as sensors show it.

    ``energy_per_cycle`` is the loop's (2.18); where the wall moves with the base, or the frame has a dashpot, the
    energy dissipated is another number and stands beside it. Numbers have twelve digits, which are the same on every
    machine; the last four of a double are not.
    """
    given = {key: value for key, value in asdict(test).items() if value is not None and key != "base"}
    known = given | {
        "drive_frequency_hz": test.drive_frequency_hz,
        "friction_force_n": test.friction_coefficient * test.normal_force_n,
    }
    if not test.base.is_plain:
        known["base"] = {"motion": test.base.motion} | test.base.model_dump(exclude_defaults=True)
    if test.is_periodic:
        known |= _steady_truth(test)
    else:
        known |= {"frequency_ratio": None, "drive_frequency_hz": None}
    return {key: twelve_digits(value) for key, value in known.items()}


def _steady_truth(test: VirtualTest) -> dict[str, object]:
    state = steady_state(test.problem())
    seen = observe(state)
    return {
        "outcome": state.outcome,
        "energy_per_cycle": seen.energy_per_cycle,
        "energy_dissipated_per_cycle": state.energy_per_cycle,
        "response_amplitude": seen.response_amplitude,
        "stops_per_cycle": seen.stops_per_cycle,
        "stuck_fraction": state.stuck_fraction,
        "regime": seen.regime,
    }


def twelve_digits(value: object) -> object:
    """A number, or those of a table, with the digits that are the same on every machine."""
    if isinstance(value, dict):
        return {key: twelve_digits(each) for key, each in value.items()}
    return float(f"{value:.12g}") if isinstance(value, float) else value


def irregularity_index(cycles: FloatArray) -> float | None:
    """Eq. (4.1) of the motion itself, one cycle a row: what a sensor without noise would give."""
    if len(cycles) < 2 or not np.ptp(cycles):
        return None
    about = cycles - cycles.mean()
    return float(np.mean(np.abs(np.diff(about, axis=0)).sum(axis=1) / np.abs(about[:-1]).sum(axis=1)))


def energy_slope(test: VirtualTest, transient: float) -> float | None:
    """Change of the steady energy per cycle (k Y^2 per hour) from the end of the transient to the end of the test."""
    if test.jump_s is not None or test.duration_s <= transient:
        return None
    times = (transient, test.duration_s)
    betas = [test.friction_ratio * (1 + test.friction_drift_per_hour * time / HOUR) for time in times]
    energies = [observe(steady_state(test.problem(beta))).energy_per_cycle for beta in betas]
    if energies[0] is None or energies[1] is None:
        return None
    return (energies[1] - energies[0]) / (times[1] - times[0]) * HOUR
