"""What the elastic kernel's tuples and buffers hold; its numbers' places and codes are in `kernel.layout`."""

from typing import NamedTuple

from frictionlab.simulator.kernel.layout import Buffer, Force

# The kernel's functions that Python calls.
ENTRIES = (
    *("start_at_rest", "follow", "carry_elastic", "steady_elastic", "steady_elastic_from"),
    *("report", "distance", "span_of"),
)

OWNERS = ("shooting", "settling", "orbits")  # modules that make buffers of their own, or are handed such
INLINED = ()  # functions worth a copy at each call


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
