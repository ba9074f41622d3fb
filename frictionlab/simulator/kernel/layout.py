"""What the kernel's tuples and buffers hold, and the codes it answers with."""

from math import pi
from typing import NamedTuple

TURN = 2.0 * pi

# The kernel's functions that Python calls.
ENTRIES = (
    *("make_rig", "carry", "steady", "steady_from", "sweep"),
    *("evaluate", "account", "fill_row", "mirrored", "spectral_radius"),
)

OWNERS = ("resonance", "settle", "points")  # modules that make buffers of their own, or are handed such
# A call hands over a hundred numbers: a fifth of the time of a steady state, for a fifth more to compile.
INLINED = (
    *("gap", "free_motion", "forced_motion", "motion_at", "push_at", "local_force"),
    *("jerk_bound", "snap_bound", "least_step", "cubic_step", "slide_start", "slide_end", "advance"),
    *("propagate", "record", "write_phase", "along", "release_cosine", "stick", "panels_work"),
)

Buffer = list[float]  # or an array: anything indexed


class RigidContact(NamedTuple):
    """The numbers of a rigid contact law, and the frame's own dashpot."""

    beta: float
    gradient: float
    static_up: float  # static over kinetic friction force, for a start up and for one down
    static_down: float
    damping: float  # of the contact's dashpot
    frame: float  # damping ratio of the dashpot between mass and base


class Oscillator(NamedTuple):
    """A linear oscillator ``r^2 z'' + 2 zeta r z' + z = share F``: a slide after division by its stiffness."""

    r: float
    zeta: float
    omega: float  # of the free motion
    rate: float  # bounds of |share F'| and |share F''|
    rate2: float
    share: float  # 1 / stiffness


class Rig(NamedTuple):
    """A contact and its slides: without a gradient (also what holds in a stop), upwards and downwards."""

    contact: RigidContact
    plain: Oscillator
    rising: Oscillator
    falling: Oscillator


class Force(NamedTuple):
    """Coefficients of a Fourier series, and the same about the start of the present phase."""

    cosine: Buffer
    sine: Buffer
    p: Buffer
    q: Buffer


class Room(NamedTuple):
    """Where the event loop writes."""

    jacobian: Buffer  # 4, row by row
    tally: Buffer
    phases: Buffer  # recorded
    wall: Force  # motion of the wall; empty: it stands
    meter: Buffer  # 1: looks at a slide left, each as many as the force has harmonics


class State(NamedTuple):
    """Displacement relative to the wall, velocity, acceleration."""

    z: float
    v: float
    a: float


class Point(NamedTuple):
    """The way made in a phase, velocity, acceleration and its rate."""

    way: float
    v: float
    a: float
    bend: float


class Leg(NamedTuple):
    """The map whose fixed point is an orbit: turns times a span from tau on, the end multiplied by sign."""

    tau: float
    span: float
    turns: float
    sign: float


class Home(NamedTuple):
    """The orbit without a stop at tau = 0, and how near to it a motion does not stop any more; 0: there is none."""

    z: float
    v: float
    near: float


class Past(NamedTuple):
    """A motion after one of its legs, the logarithm of what a neighbour's distance grew by, and the phases passed."""

    z: float
    v: float
    grown: float
    passed: float


Found = tuple[Leg, float, float, float, int]  # leg, z, v, miss, code

# How a motion ended; WANDERS: it does not repeat, and motions beside it part; FAR: it no longer stops, but has not
# settled yet; TIRED: the meter has run out.
DONE, CHATTER, WANDERS, FAR, TIRED = 0, 1, 2, 3, 4

# A recorded phase: direction (0: stuck), or how many sliders slip; tau, duration, z, v, a; stiffness of the oscillator
# (infinite: the mass stands), force of the contact but for its dashpot at the start.
PHASE = 8

# The tally of a motion. PATH is the way slid, CONTACT the integral of the contact's force over it (of both dashpots'
# force: VISCOUS), CROSS that of v f'; HIGH and LOW bound z, TOP and BOTTOM the mass's own displacement. Of elastic
# contacts: time since the last slip ended, columns of the jacobian.
PATH, STUCK_TIME, STOPS_MADE, HIGH, LOW, FIRST, LAST, PHASES, WORK, VISCOUS, EVALUATIONS = range(11)
CONTACT, CROSS, TOP, BOTTOM = range(11, 15)
CARRIED = 15  # from here on: tau, span, turns and sign of the leg carried, and the state it was carried from
HELD_FOR, COLUMNS = 21, 22
TALLY = 23

# The row of a steady state.
OUTCOME, ENERGY, AMPLITUDE, STOPS, STUCK_SHARE, SYMMETRIC, PERIOD, MULTIPLIER, CLOSURE, MISS, CLOSED_FORM = range(11)
START, SPAN, TURNS, SIGN, START_Z, START_V = range(11, 17)
UNAWAITED = 17  # 1: an orbit from which the run from rest was still far when it was left
GROWTH, NOTES = 18, 19  # written by Python: of a motion that does not repeat, what MISS says; `notes.Note` as bits
CONTACT_ENERGY, FRAME_ENERGY = 20, 21  # written by Python; in a kernel's row ENERGY is what both take
ROW = 22

# Outcomes; RUNAWAY: a slide's stiffness is not positive, PULLING: friction would turn into a pull on the orbit,
# PARTING: the motion does not repeat, and its MISS is the factor by which a neighbour's distance grows in a cycle;
# COSTLY: the search took more slides than it may. UPCOMING, within a search: PERIODIC and UNAWAITED.
PERIODIC, STUCK, UNBOUNDED, NOT_FOUND, CHATTERED, RUNAWAY, PULLING, PARTING, COSTLY, OVERFULL = range(10)
UPCOMING = 10

# A point of a map: r, then the contact's numbers.
POINT = 7

# Of elastic contacts.
LIMIT, TURNED, REACHED = 0, 1, 2  # what ended a phase: the time, a zero of the velocity, a slider's limit
PULLED = 3  # how a motion ended (beside DONE, CHATTER, WANDERS): where friction would turn into a pull

# What a slider's force is at the section of a map: tied to its limit, to a spring that never slips, or an unknown.
SLIDING, OUTER, FREE = 0.0, 1.0, 2.0

# What is asked of a motion over a leg: where it ends, or the derivative of that, too.
PLAIN, DERIVED = 0, 1

# How often a search applies the map itself, where Newton's step does not help, before it gives up.
HASTY, PATIENT = 2.0, 1e9
