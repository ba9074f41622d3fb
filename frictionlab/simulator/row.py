"""A steady state as a row of numbers: what stands where, and the codes of its outcome. Maps are made of such rows."""

# The row of a steady state; ENERGY is the area of the loop (2.18).
OUTCOME, ENERGY, AMPLITUDE, STOPS, STUCK_SHARE, SYMMETRIC, PERIOD, MULTIPLIER, CLOSURE, MISS, SOLVER = range(11)
CONTACT_ENERGY, FRAME_ENERGY, NOTES = 11, 12, 13  # NOTES: `notes.Note` as bits, written by Python
ROW = 14

# Outcomes; RUNAWAY: a slide's stiffness is not positive, PULLING: friction would turn into a pull on the orbit,
# COSTLY: the search took more work than it may. Of one that goes on, OVERFULL: more pieces than there is space for;
# RESTING: friction may hold the mass; UNREACHED: other starts are to be tried; AWAITED: a motion is to be followed.
PERIODIC, STUCK, UNBOUNDED, NOT_FOUND, CHATTERED, RUNAWAY, PULLING, COSTLY = range(8)
OVERFULL, RESTING, UNREACHED, AWAITED = range(8, 12)

PATIENCE = 4096  # cycles that a motion is followed for
EXACT, CLOSED_FORM, INTEGRATED = 0.0, 1.0, 2.0  # what SOLVER says
