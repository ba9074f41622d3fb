"""Any motion of the base: a sampled record in, the motion of the mass out.

BaseRecord --respond(problem, record)--> Response

Between samples the base is a polynomial, and between events the mass a linear oscillator: its motion is a closed form.
The mathematics, and how good it is, stand in the README of this folder.
"""

from frictionlab.simulator.record.base import BaseRecord, Interpolation
from frictionlab.simulator.record.respond import Response, can_follow, prepare, respond

__all__ = ["BaseRecord", "Interpolation", "Response", "can_follow", "prepare", "respond"]
