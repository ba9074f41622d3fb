"""Many steady states in one call: a map."""

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.accounts import set_force, steady
from frictionlab.simulator.kernel.layout import Buffer, Force, RigidContact, Room
from frictionlab.simulator.kernel.motion import make_rig


def sweep(points: Buffer, cosine: Buffer, sine: Buffer, force: Force, closed: int, room: Room, rows: Buffer) -> None:
    """Fill one row of `rows` for each point: r and the numbers of its contact; each by itself, whatever the chunks."""
    row = rows[: layout.ROW].copy()
    for i in range(len(points) // layout.POINT):
        at = layout.POINT * i
        r, beta, gradient, up, down = points[at], points[at + 1], points[at + 2], points[at + 3], points[at + 4]
        contact = RigidContact(beta, gradient, up, down, points[at + 5], points[at + 6])
        set_force(r, contact.frame, cosine, sine, force, room.wall)
        steady(make_rig(r, contact, force), force, closed, room, row)
        for j in range(layout.ROW):
            rows[layout.ROW * i + j] = row[j]
