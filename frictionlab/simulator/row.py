"""A steady state as a row of numbers: what stands where, and the codes of its outcome. Maps are made of such rows."""

# The row of a steady state; ENERGY is the area of the loop (2.18).
OUTCOME, ENERGY, AMPLITUDE, STOPS, STUCK_SHARE, SYMMETRIC, PERIOD, MULTIPLIER, CLOSURE, MISS, SOLVER = range(11)
GROWTH, NOTES = 11, 12  # written by Python: of a motion that does not repeat, what MISS says; `notes.Note` as bits
CONTACT_ENERGY, FRAME_ENERGY = 13, 14
ROW = 15

# Outcomes; RUNAWAY: a slide's stiffness is not positive, PULLING: friction would turn into a pull on the orbit,
# PARTING: the motion does not repeat, and its MISS is the factor by which a neighbour's distance grows in a cycle;
# COSTLY: the search took more work than it may. Of a search that is to go on, OVERFULL: more pieces than there is space
# for; AWAITED: the motion from a start is to be followed.
PERIODIC, STUCK, UNBOUNDED, NOT_FOUND, CHATTERED, RUNAWAY, PULLING, PARTING, COSTLY, OVERFULL, AWAITED = range(11)

PATIENCE = 4096  # cycles that a motion is followed for
EXACT, CLOSED_FORM, INTEGRATED = 0.0, 1.0, 2.0  # what SOLVER says
