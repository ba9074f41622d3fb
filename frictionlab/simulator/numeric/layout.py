"""What the tuples and buffers of the numeric kernel hold, and the codes it answers with."""

from typing import NamedTuple

STAGES, NODES, WIDTH = 7, 8, 4  # of a step; WIDTH: z, v and up to two inner states

Buffer = list[float]  # or an array: anything indexed

ENTRIES = ("carry", "contacts", "travel")  # what Python calls of the kernel
OWNERS = ()
INLINED = ()  # functions worth a copy at each call

COULOMB, STRIBECK, LOGARITHM, DAHL, BOUC_WEN, LUGRE, RATE_STATE = range(7)


class Rig(NamedTuple):
    """The numbers of a problem."""

    code: int  # of the law
    r: float
    beta: float
    gradient: float
    dashpot: float  # 2 zeta_c r
    lead: float  # 2 zeta_f r
    law: tuple[float, float, float, float, float]  # its own parameters, in the order of `machine.CODES`
    static_up: float
    static_down: float
    size: int  # components of the state
    ending: int  # the component that ends a phase: 1, v; 2, the contact's force
    narrow: float  # speed below which friction changes; 0: it does not


class Room(NamedTuple):
    """What drives, the tableau, and where the kernel writes."""

    cosine: Buffer  # of the force F; without sine parts: the coefficients of a polynomial
    sine: Buffer
    bounds: Buffer  # of |F'| and |F''|
    nodes: Buffer
    weights: Buffer
    stages: Buffer
    bernstein: Buffer
    state: Buffer
    values: Buffer  # of the last step, at its nodes
    trial: Buffer
    pull: Buffer
    rate: Buffer
    jacobian: Buffer
    matrix: Buffer
    pivot: Buffer
    right: Buffer
    reduced: Buffer
    slopes: Buffer  # of the state over where it began
    scale: Buffer
    curve: Buffer
    part: Buffer
    scratch: Buffer
    tally: Buffer
    log: Buffer


SIZES = (4, 32, 32, 7, 28, 112, 441, 21, 28, 21, 16, 4, 8, 8, 8, 6)  # of the buffers from `state` to `tally`

# A recorded step: start, length, side (0: at rest), then the nodes' values.
ROW = 3 + NODES * WIDTH

# The tally: recorded steps, steps tried, steps allowed; tolerance; next length, last length (0: none to go on from)
ROWS, STEPS, BUDGET, TOLERANCE, LENGTH, LAST = range(6)

FINE, TOO_MANY, STALLED, NEGATIVE = range(4)  # how a motion ended
