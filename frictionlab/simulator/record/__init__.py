"""Any motion of the base: a sampled record in, the motion of the mass out.

BaseRecord --respond(problem, record)--> Response

Between samples the base is a polynomial, and between events the mass a linear oscillator: its motion is a closed form.
Laws that have none are integrated over the same pieces.
The mathematics, and how good it is, stand in the README of this folder.
"""

from frictionlab.simulator.record.base import BaseRecord, Quantity
from frictionlab.simulator.record.respond import respond
from frictionlab.simulator.record.response import Response

__all__ = ["BaseRecord", "Quantity", "Response", "respond"]
