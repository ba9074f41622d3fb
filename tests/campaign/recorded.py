"""A recording of a steady Coulomb contact, made from the simulator's own motion."""

import numpy as np

from frictionlab.recording import Recording
from frictionlab.simulator import Problem, steady_state
from tests.campaign.fabricate import AMPLITUDE, NATURAL

SECONDS, RATE = 40.0, 250.0


def steady_recording(
    r: float = 0.6, beta: float = 0.4, *, problem: Problem | None = None, amplitude: float = AMPLITUDE
) -> Recording:
    """40 s at 250 Hz with the noise of a good sensor; ``problem``: another contact's, in the place of r and beta."""
    contact = Problem(r, beta) if problem is None else problem
    time = np.arange(round(SECONDS * RATE)) / RATE
    tau = 2.0 * np.pi * contact.r * NATURAL * time
    motion = steady_state(contact).orbit
    assert motion is not None
    phase = motion.start + np.mod(tau - motion.start, motion.end - motion.start)
    noise = np.random.default_rng(3).normal(0.0, 0.8e-6, (2, len(time)))
    mass, base = amplitude * motion.at(phase)[0] + noise[0], amplitude * np.cos(tau) + noise[1]
    return Recording(time=time, mass_displacement=mass, base_displacement=base)
