"""What the tuples and buffers of the numeric kernel hold, and the codes it answers with."""

from math import pi

TURN = 2.0 * pi
STAGES, NODES, WIDTH = 7, 8, 4  # of a step; WIDTH: z, v and up to two inner states

Buffer = list[float]  # or an array: anything indexed
# code, r, beta, gradient, zeta_c, zeta_f, five parameters of the law, static ratios up and down, components, what
# ends a phase (1: v, 2: the contact's force), bounds of |F'| and |F''|, speed below which
# friction changes (0: it does not)
Rig = tuple[float, ...]
Series = tuple[Buffer, Buffer]
# F; f where the frame's dashpot sees it; f where it adds to x; G, whose rate times -z is the power put in
Force = tuple[Buffer, Buffer, Buffer, Buffer, Buffer, Buffer, Buffer, Buffer]
Table = tuple[Buffer, Buffer, Buffer, Buffer]  # the tableau as buffers
Room = tuple[Buffer, ...]

ENTRIES = ("carry", "account", "slips", "travel", "force_now", "close")  # what Python calls of the kernel
OWNERS = ()
INLINED = ()  # functions worth a copy at each call

COULOMB, STRIBECK, LOGARITHM, DAHL, BOUC_WEN, LUGRE, RATE_STATE = range(7)

# The buffers of a room.
(
    STATE,
    VALUES,
    TRIAL,
    PULL,
    RATE,
    JACOBIAN,
    MATRIX,
    PIVOT,
    RIGHT,
    REDUCED,
    SLOPES,
    SCALE,
    CURVE,
    PART,
    SCRATCH,
    TALLY,
    LOG,
) = range(17)
SIZES = (4, 32, 32, 7, 28, 112, 441, 21, 28, 21, 16, 4, 8, 8, 8, 16, 0)

# A recorded step: start, length, side (0: at rest), then the nodes' values.
ROW = 3 + NODES * WIDTH

# The tally: recorded steps, steps tried, steps allowed; tolerance; next length, last length (0: none to go on from)
ROWS, STEPS, BUDGET, TOLERANCE, LENGTH, LAST = range(6)
WORK, FRAME, INPUT, HIGH, LOW = range(6, 11)

FINE, TOO_MANY, STALLED, NEGATIVE = range(4)  # how a motion ended

# What is seen of a motion along a record: integrals (n v, v^2, frame's dashpot, work of F), path, extremes, stops; then
# how the watch for stops stands: slow or not, a stop not yet judged, its begin, end and place, direction of slip before
# and after it, the last node's time and slip.
(
    SEEN_WORK,
    SEEN_SQUARED,
    SEEN_FRAME,
    SEEN_INPUT,
    SEEN_PATH,
    SEEN_STUCK,
    SEEN_STOPS,
    SEEN_EVENTS,
    IS_SLOW,
    IS_OPEN,
    SINCE,
    UNTIL,
    PLACE,
    WAY,
    NEXT_WAY,
    LAST_TIME,
    LAST_SLIP,
) = range(17)
SEEN = 17
EVENT = 3  # a recorded event: time, what begins (slip up 1, slip down -1, stop 0), displacement relative to the wall
