"""What the elastic kernel's tuples and buffers hold, beside those of `frictionlab.simulator.kernel.layout`."""

from typing import NamedTuple

from frictionlab.simulator.kernel.layout import TALLY, Buffer, Force

__all__ = [
    "COLUMNS",
    "CONTACT",
    "DERIVED",
    "ELASTIC_PHASE",
    "ELASTIC_TALLY",
    "ENTRIES",
    "FREE",
    "HASTY",
    "HELD_FOR",
    "LIMIT",
    "OUTER",
    "PATIENT",
    "PLAIN",
    "PULLED",
    "REACHED",
    "SLIDING",
    "TURNED",
    "ElasticRoom",
    "OrbitGuess",
    "Point",
    "Sliders",
]

# The kernel's functions that Python calls.
ENTRIES = (
    *("start_at_rest", "follow", "carry_elastic", "steady_elastic", "steady_elastic_from", "evaluate_elastic"),
    *("account_elastic", "fill_elastic_row", "is_mirrored", "distance", "span_of"),
)

OWNERS = ("residues", "shooting", "settling", "orbits")  # modules that make buffers of their own, or are handed such
INLINED = ()  # functions worth a copy at each call

LIMIT, TURNED, REACHED = 0, 1, 2  # what ended a phase: the time, a zero of the velocity, a slider's limit
PULLED = 3  # how a motion ended (beside DONE, CHATTER, WANDERS): where friction would turn into a pull

# A recorded phase: how many sliders slip, tau, duration, z, v, a, stiffness, force of the sliders at its start.
ELASTIC_PHASE = 8

# The tally of a motion, beyond the rigid kernel's: integral of the sliders' force over the way, time since the last
# slip ended, columns of the jacobian.
CONTACT, HELD_FOR, COLUMNS = range(TALLY, TALLY + 3)
ELASTIC_TALLY = TALLY + 3

# What a slider's force is at the section of a map: tied to its limit, to a spring that never slips, or an unknown.
SLIDING, OUTER, FREE = 0.0, 1.0, 2.0

# What is asked of a motion over a leg: where it ends, or the derivative of that, too.
PLAIN, DERIVED = 0, 1

# How often a search applies the map itself, where Newton's step does not help, before it gives up.
HASTY, PATIENT = 2.0, 1e9


class Sliders(NamedTuple):
    """Elastic sliders side by side: ``n_i' = stiffness_i v``, at most ``strength_i (1 + q z)``."""

    stiffness: Buffer
    strength: Buffer
    force: Buffer  # n_i now
    side: Buffer  # of the limit it slips along; 0: held
    slips: Buffer  # how often it has begun to slip
    falls: Buffer  # how often of it downwards


class ElasticRoom(NamedTuple):
    """Where the event loop writes."""

    jacobian: Buffer  # rows z, v, n_1 ...; tally[COLUMNS] columns
    tally: Buffer
    phases: Buffer  # recorded
    wall: Force  # motion of the wall; empty: it stands
    meter: Buffer  # 1: looks at a phase left, each as many as the force has harmonics
    slow: Force  # the forced motion of a held contact
    kinds: Buffer  # of the sliders at the section
    start: Buffer  # z, v, then force and side of each slider
    image: Buffer
    trial: Buffer  # a start, and
    known: Buffer  # its image
    matrix: Buffer  # of Newton's equations, with the right side


class OrbitGuess(NamedTuple):
    """An orbit that a motion may settle on, at the section of whole cycles."""

    state: list[float]  # as the room's start
    passed: list[float]  # slips and falls of each slider in a cycle
    rows: list[int]  # of the jacobian that are unknowns: z, v, 2 + i of slider i
    jacobian: list[float]  # their derivative, row by row
    contraction: float  # 1 less its largest multiplier; not positive: no candidate
    high: float  # of z
    low: float


class Point(NamedTuple):
    """The way made in a phase, velocity, acceleration and its rate."""

    way: float
    v: float
    a: float
    bend: float
