"""Several masses, any number of contacts: one exact flow of linear phases (README of the simulator).

Structure --steady--> StructureState (its motion: one period)
Structure --follow--> StructureMotion (so many cycles from rest)
"""

from frictionlab.simulator.several.answer import ContactNumbers, StructureMotion, StructureState
from frictionlab.simulator.several.steady import follow, steady

__all__ = ["ContactNumbers", "StructureMotion", "StructureState", "follow", "steady"]
