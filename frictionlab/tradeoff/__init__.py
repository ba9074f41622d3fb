"""What accuracy costs: error and time of every knob, measured together on this machine.

``measure_trade`` yields one `Setting` after the other; errors are the same each time, seconds are this machine's.
The README of this folder says what was found and why the defaults are where they are.
"""

from frictionlab.tradeoff.measure import FAMILIES, measure_trade
from frictionlab.tradeoff.setting import Setting, marked, pareto_front

__all__ = ["FAMILIES", "Setting", "marked", "measure_trade", "pareto_front"]
