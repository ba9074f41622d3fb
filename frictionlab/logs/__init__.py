"""Raw logs -> recordings: dialect, body, defects, two clocks on one time base; the only unit conversion there is."""

from frictionlab.log_options import LogOptions
from frictionlab.logs.read import read_base_acceleration, read_base_log, read_log, read_mass_log, read_two_logs

__all__ = ["LogOptions", "read_base_acceleration", "read_base_log", "read_log", "read_mass_log", "read_two_logs"]
