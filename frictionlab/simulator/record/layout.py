"""What the record kernel's tuples and buffers hold, and the codes it answers with."""

from typing import NamedTuple

Buffer = list[float]  # or an array: anything indexed

ENTRIES = ("travel",)  # what Python calls of the kernel
OWNERS = ()
INLINED = ()  # functions worth a copy at each call


class RecordRig(NamedTuple):
    """The numbers of a problem: damping ratios of frame and contact, the law's parameters; wall as `piece.force_of`."""

    frame: float
    contact: float
    beta: float
    gradient: float
    up: float
    down: float
    wall: float


class RecordSliders(NamedTuple):
    """Elastic sliders, one entry each: stiffness, slip force, where its spring is relaxed, 1 while it slips."""

    stiff: Buffer
    limit: Buffer
    anchor: Buffer
    slips: Buffer


# c0 + c1 t + c2 t^2 + c3 t^3, about the start of a piece or of a part of it
Cubic = tuple[float, float, float, float]
# the motion from rest at a time: under a unit velocity (h), and under the forces 1, t, t^2/2, t^3/6
Free = tuple[float, float, float, float, float]

Jet = tuple[float, float, float]  # a value and its first two derivatives

# The state: displacement relative to the wall and its rate; direction of slip (0: the contact holds); 1 while a rigid
# contact holds; stiffness and constant force of the present phase, and the displacements at which a slider gives way;
# since when the contact holds, and whether it slipped before.
Z, V, SIDE, HELD, STIFFNESS, OFFSET, LOWER, UPPER, SINCE, FRESH = range(10)
STATE = 10

# The tally of a motion.
PATH, FRICTION_WORK, SQUARED_SPEED, SQUARED_FRAME_SPEED, INPUT, STUCK_TIME, STOPS, HIGH, LOW, EVENTS = range(10)
TALLY = 10

# A recorded event: time, what begins (slide up 1, slide down -1, stop 0), displacement relative to the wall.
EVENT = 3

NOTHING, TURN, YIELD = range(3)  # what ends a slide
# What `moved` needs for a step, kept as long as it stays the same: the five of Free, their stiffness and length.
FREE = 7

DONE, CHATTER = range(2)  # how a motion ended
