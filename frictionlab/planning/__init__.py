"""The next tests planned: what each candidate would tell of a law, and which ones together tell most.

    scene --laboratory, candidates--> Candidate --outlook--> cycles and slopes --told_by--> Told --plan_tests--> Plan

The README of this folder tells the method.
"""

from frictionlab.planning.choose import plan_tests, waiting
from frictionlab.planning.plan import Plan, PlannedTest
from frictionlab.planning.sheet import running_order, sheet_rows, steps

__all__ = ["Plan", "PlannedTest", "plan_tests", "running_order", "sheet_rows", "steps", "waiting"]
