"""Raw logs -> recordings: dialect, body, defects, two clocks on one time base."""

from frictionlab.log_options import LogOptions as LogOptions
from frictionlab.logs.read import read_base_log as read_base_log
from frictionlab.logs.read import read_log as read_log
from frictionlab.logs.read import read_mass_log as read_mass_log
from frictionlab.logs.read import read_two_logs as read_two_logs
