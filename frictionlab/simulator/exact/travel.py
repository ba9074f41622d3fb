"""One mass along a sampled motion of the base: a cubic between samples, event by event inside the pieces."""

from typing import Any

from frictionlab.arrays import FloatArray
from frictionlab.simulator.compiled import entry, inner
from frictionlab.simulator.exact.motion import base_at_time, contact_force
from frictionlab.simulator.exact.orbit import Carrier
from frictionlab.simulator.exact.phase import DONE, slot_of


@inner
def sample(flow: Any, found: FloatArray, i: int) -> None:
    """Write displacement, velocity and the contact's force at the state at hand."""
    system, work = flow.systems[0], flow.works[0]
    base_at_time(system, work)
    work.now_q[0], work.now_v[0] = work.q[0], work.v[0]
    slot = slot_of(system, work.phases, work.kappa)
    found[i, 0], found[i, 1], found[i, 2] = work.q[0], work.v[0], contact_force(system, work, slot, 0)


@entry
def travel(flow: Carrier, time: FloatArray, cubics: FloatArray, found: FloatArray) -> int:
    """Carry the state at hand along sampled times (n,); return the piece that it did not come through, or -1.

    `cubics` (n - 1, 4): what drives the mass, in the time from each sample on; `found` (n, 3): displacement, velocity
    and force of the contact at the samples.
    """
    system, work = flow.systems[0], flow.works[0]
    for i in range(len(time) - 1):
        for k in range(4):
            system.cubic[k] = cubics[i, k]
        work.tau = time[i]
        code = flow.run(flow.systems, flow.works, flow.pieces, time[i + 1] - time[i], False, i == 0)
        if code != DONE:
            return i
        if i == 0:
            found[0, 0], found[0, 1] = flow.pieces[0, 2], flow.pieces[0, 3]
        sample(flow, found, i + 1)
    return -1
