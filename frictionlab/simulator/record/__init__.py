"""Any motion of the base: a sampled record in, the motion of the mass out.

BaseRecord --respond(problem, record)--> Response
"""

from frictionlab.simulator.record.base import BaseRecord, Quantity
from frictionlab.simulator.record.respond import RecordMotion, Response, motion_under, respond

__all__ = ["BaseRecord", "Quantity", "RecordMotion", "Response", "motion_under", "respond"]
