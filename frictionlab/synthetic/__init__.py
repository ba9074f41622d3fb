"""The simulator seen through a laser: logs whose truth is known.

A virtual rig runs each test of ``[[synthetic.tests]]``; two virtual optoNCDT sensors add noise and round to their step.
Nothing here is measured, and every log says so in its first lines.

- ``virtual_rig``: what each test is
- ``virtual_motion``: how base and mass move, what changes while a test runs, channels beyond the two displacements
- ``write``: logs, and what is true of them, into files
"""

from frictionlab.synthetic.virtual_motion import cycle_friction_ratios as cycle_friction_ratios
from frictionlab.synthetic.virtual_motion import driven as driven
from frictionlab.synthetic.virtual_motion import motion as motion
from frictionlab.synthetic.virtual_rig import SyntheticTest as SyntheticTest
from frictionlab.synthetic.virtual_rig import virtual_tests as virtual_tests
from frictionlab.synthetic.write import is_synthetic as is_synthetic
from frictionlab.synthetic.write import is_truth as is_truth
from frictionlab.synthetic.write import log_of as log_of
from frictionlab.synthetic.write import synthesize as synthesize
from frictionlab.synthetic.write import truth as truth
