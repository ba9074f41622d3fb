"""What the kernel's tuples and buffers hold, and the codes it answers with."""

from math import pi

TURN = 2.0 * pi

Buffer = list[float]  # or an array: anything indexed

# r, beta, mu, zeta, frequency of the free motion, bounds of |F'| and |F''|
Rig = tuple[float, float, float, float, float, float, float]
# coefficients A, B of the force, and p, q: the same about the start of the present phase
Force = tuple[Buffer, Buffer, Buffer, Buffer]
# jacobian (4, row by row), tally, recorded phases, motion of the wall (coefficients and two buffers; empty: it stands)
Room = tuple[Buffer, Buffer, Buffer, Force]
State = tuple[float, float, float]  # z, v, a
Leg = tuple[float, float, float, float]  # tau, span, turns, sign: the map whose fixed point is an orbit
Found = tuple[Leg, float, float, float, int]  # leg, z, v, miss, code

DONE, CHATTER = 0, 1  # how a motion ended

# A recorded phase: direction (0: stuck), tau, duration, z, v, a.
PHASE = 6

# The tally of a motion.
PATH, STUCK_TIME, STOPS_MADE, HIGH, LOW, FIRST, LAST, PHASES, WORK, VISCOUS, EVALUATIONS = range(11)
TALLY = 11

# The row of a steady state.
OUTCOME, ENERGY, AMPLITUDE, STOPS, STUCK_SHARE, SYMMETRIC, PERIOD, MULTIPLIER, CLOSURE, MISS, CLOSED_FORM = range(11)
START, SPAN, TURNS, SIGN, START_Z, START_V = range(11, 17)
ROW = 17

PERIODIC, STUCK, UNBOUNDED, NOT_FOUND, CHATTERED, OVERFULL = range(6)  # outcomes
