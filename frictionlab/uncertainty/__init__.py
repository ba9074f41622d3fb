"""What is not known of sensors, clock and rig, and what that does to each number (GUM, JCGM 100).

    scene --sources_of--> Sources (standard uncertainties of one test, each of one cause)
    Sources + mean cycle --cycle_budget--> shares of energy and amplitude; `combined` adds shares in quadrature

Type A, the numbers' own scatter, is the standard error `_se`; with these, type B, it makes the combined `_u`.
"""

from frictionlab.uncertainty.budget import (
    FILTER,
    LINES,
    STATISTICAL,
    Shares,
    bent_gain,
    bent_unknown,
    combined,
    cycle_budget,
    unit_uncertainty,
)
from frictionlab.uncertainty.sources import Sources, sources_of

__all__ = [
    "FILTER",
    "LINES",
    "STATISTICAL",
    "Shares",
    "Sources",
    "bent_gain",
    "bent_unknown",
    "combined",
    "cycle_budget",
    "sources_of",
    "unit_uncertainty",
]
