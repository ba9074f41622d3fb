"""Which contact law recordings require, with which values, and how sure each is.

what was measured -> an observation --infer--> Posterior --climb--> Ladder --compare--> Comparison
"""

from frictionlab.inference.compare import AUTO, compare_measurement, compare_record
from frictionlab.inference.comparison import Comparison, ContactForce, Fitted, WholeRecord

__all__ = ["AUTO", "Comparison", "ContactForce", "Fitted", "WholeRecord", "compare_measurement", "compare_record"]
