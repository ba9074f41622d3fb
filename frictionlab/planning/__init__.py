"""The next tests planned: what each candidate would show of a law, and which ones together show most.

scene --laboratory--> Candidate --virtual_test--> what a fit of it would state --plan_tests--> Plan
"""

from frictionlab.planning.candidates import Before, laboratory
from frictionlab.planning.choose import plan_tests, waiting
from frictionlab.planning.plan import Plan, PlannedTest, running_order, sheet_rows, steps

__all__ = [
    "Before",
    "Plan",
    "PlannedTest",
    "laboratory",
    "plan_tests",
    "running_order",
    "sheet_rows",
    "steps",
    "waiting",
]
