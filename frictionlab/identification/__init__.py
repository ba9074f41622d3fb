"""Measurement + simulator -> which contact law, with which values, and what it predicts.

    measurement --family_of--> Family (what the test may be) --identify--> Identified (a law's values with errors)
                                                             --climb-----> Ladder (which law the recording requires)
                --predict---> Comparison (a measured cycle over its prediction)
    recording   --compare---> the same, and the whole record over its prediction (WholeRecord)

`observed` says what was measured and how sure it is, `coordinates` what is not known, `forward` what two sensors would
show, `fit` finds the best values; `track`, `record_fit` and `whole` do the same for a whole record, `colour` weighs it,
`friction_over_time` follows its friction, `unsteady` compares records that have no cycle. The README of this folder
tells the method.
"""

from frictionlab.identification.compare import AUTO, compare, predict
from frictionlab.identification.comparison import Comparison
from frictionlab.identification.contact_force import ContactForce, contact_force
from frictionlab.identification.family import Family, family_of
from frictionlab.identification.identify import Identified, ParameterEstimate, identify
from frictionlab.identification.ladder import Ladder, Rung, climb
from frictionlab.identification.loop import loop_friction_ratio
from frictionlab.identification.whole_record import Fitted, WholeRecord

__all__ = [
    "AUTO",
    "Comparison",
    "ContactForce",
    "Family",
    "Fitted",
    "Identified",
    "Ladder",
    "ParameterEstimate",
    "Rung",
    "WholeRecord",
    "climb",
    "compare",
    "contact_force",
    "family_of",
    "identify",
    "loop_friction_ratio",
    "predict",
]
