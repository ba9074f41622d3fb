"""The next tests planned: what each candidate would tell of a law, and which ones together tell most.

    scene --laboratory, candidates--> Candidate --prospect--> Prospect (its information) --plan_tests--> Plan

The README of this folder tells the method.
"""

from frictionlab.planning.choose import Plan, PlannedTest, plan_tests
from frictionlab.planning.sheet import sheet_rows

__all__ = ["Plan", "PlannedTest", "plan_tests", "sheet_rows"]
