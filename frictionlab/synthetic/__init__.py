"""The simulator seen through a laser: logs whose truth is known.

A virtual rig runs each test of ``[[synthetic.tests]]``; two virtual optoNCDT sensors add noise and round to their step.
Nothing here is measured, and every log says so in its first lines.

- ``rig``: what each test is
- ``base``: how the base moves: sine, sweep, random, as recorded; a motor that starts up and wanders
- ``motion``: how the mass moves, what changes while a test runs, and channels beyond the two displacements
- ``truth``: what is true of it; ``write``: logs and truth into files
"""

from frictionlab.synthetic.motion import cycle_friction_ratios, driven, motion
from frictionlab.synthetic.rig import VirtualTest, virtual_tests
from frictionlab.synthetic.truth import truth
from frictionlab.synthetic.write import is_synthetic, is_truth, log_text, synthesize

__all__ = [
    "VirtualTest",
    "cycle_friction_ratios",
    "driven",
    "is_synthetic",
    "is_truth",
    "log_text",
    "motion",
    "synthesize",
    "truth",
    "virtual_tests",
]
