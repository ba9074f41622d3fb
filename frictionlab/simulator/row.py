"""A steady state as a row of numbers: what stands where, and the codes of its outcome. Maps are made of such rows."""

# The row of a steady state; ENERGY is the area of the loop (2.18).
OUTCOME, ENERGY, AMPLITUDE, STOPS, STUCK_SHARE, SYMMETRIC, PERIOD, MULTIPLIER, CLOSURE, MISS, SOLVER = range(11)
UNAWAITED = 11  # 1: an orbit from which the run from rest was still far when it was left
GROWTH, NOTES = 12, 13  # written by Python: of a motion that does not repeat, what MISS says; `notes.Note` as bits
CONTACT_ENERGY, FRAME_ENERGY = 14, 15
ROW = 16

# Outcomes; RUNAWAY: a slide's stiffness is not positive, PULLING: friction would turn into a pull on the orbit,
# PARTING: the motion does not repeat, and its MISS is the factor by which a neighbour's distance grows in a cycle;
# COSTLY: the search took more work than it may. OVERFULL: more pieces than there is space for. Within a search,
# UPCOMING: PERIODIC and UNAWAITED; AWAITED: the motion from rest is to be followed.
PERIODIC, STUCK, UNBOUNDED, NOT_FOUND, CHATTERED, RUNAWAY, PULLING, PARTING, COSTLY, OVERFULL = range(10)
UPCOMING, AWAITED = 10, 11

PATIENCE = 4096  # cycles that a motion is followed for
EXACT, CLOSED_FORM, INTEGRATED = 0.0, 1.0, 2.0  # what SOLVER says
