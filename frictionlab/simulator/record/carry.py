"""A sampled base motion under any laws, by either flow: what is carried between samples, and accounted for."""

from collections.abc import Iterator
from math import ceil, inf
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.simulator.exact.account import NUMBERS
from frictionlab.simulator.exact.answer import travel
from frictionlab.simulator.exact.solve import Flow
from frictionlab.simulator.numeric import Integrated
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord
from frictionlab.simulator.structure import Structure

LONGEST = 0.5  # rad: what steps carry at once at most
ALLOWED = 20_000  # steps that may be tried within it
CHUNK = 20_000  # times between samples that are carried, and accounted for, at once


def carry(
    what: Problem | Structure, base: BaseRecord, q: FloatArray, v: FloatArray, *, exact: bool, accounted: bool
) -> dict[str, Any]:
    """Return a motion along a record by the names of `RecordMotion`, from displacements and velocities (n,) on.

    It is relative to the base where every contact is against it, for so a flow has it. Accounted for: by the names of
    `Response` too.
    """
    frame = what if isinstance(what, Structure) else Structure.of(what)
    flow: Flow = Flow(what) if exact else Integrated(what)
    parts = 1 if exact else ceil(float(np.diff(base.time).max()) / LONGEST)
    time, cubics = base.pieces(parts, acceleration=frame.follows_base)
    system, n = flow.systems[0], flow.masses
    if isinstance(flow, Integrated):
        push = np.array([system["push"][:n] @ cubics[:, k : k + 2].T for k in (0, 1)])  # on the masses, and its slope
        rms = [float(np.sqrt(2.0 * np.max(x**2 @ np.diff(time)) / (time[-1] - time[0]))) for x in push]
        size, rate, law = float(np.abs(push[0]).max()), float(np.abs(base.motion[1]).max()), flow.law
        law["scale"][:n], law["scale"][n : 2 * n] = min(size, 1.0), min(size, max(rate, 1e-3 * size))
        law["force"], law["first"], flow.drive_rate, flow.drive_time = size, LONGEST, rms[1], rms[0] / rms[1]
    system["harmonics"], found = 0, np.zeros((len(time), 2 * n + flow.contacts))
    passed = _passed(flow, time, cubics, flow.rest_at(q, v, float(cubics[0, 0])), found, kept=accounted)
    account = _account(flow, base, found, passed) if accounted else {}
    list(passed)  # if nothing is accounted for, it is carried here
    q, v, force = np.split(found[::parts], (n, 2 * n), axis=1)
    return {"displacements": q, "velocities": v, "contact_forces": force} | account


def _passed(
    flow: Flow, time: FloatArray, cubics: FloatArray, state: FloatArray, found: FloatArray, *, kept: bool
) -> Iterator[FloatArray]:
    """Carry a state along, and write what is at the samples; yield the pieces of each chunk, if they are kept."""
    works, done, left = flow.workspace(), 0, float(ALLOWED) if isinstance(flow, Integrated) else inf
    space = 256 + 2 * min(len(cubics), CHUNK) if kept else 0
    while done < len(cubics):
        flow.put(works, state)
        part, whole, pieces = slice(done, done + CHUNK), slice(done, done + CHUNK + 1), np.empty((space, flow.width))
        reached, code = travel(flow.systems, works, pieces, time[whole], cubics[part], found[whole], left)
        flow.refuse(code, f" of a record at tau = {time[done + reached]:.6g}")
        count = int(works[0]["count"])
        if kept and count > space:
            space = count
            continue
        state, done = flow.at_hand(works), done + len(cubics[part])
        if kept:
            yield pieces[:count]


def _account(flow: Flow, base: BaseRecord, found: FloatArray, passed: Iterator[FloatArray]) -> dict[str, Any]:
    """Return what a motion does in all."""
    system, n, contacts = flow.systems[0], flow.masses, flow.contacts
    held: list[list[FloatArray]] = [[] for _ in range(contacts)]
    stored, totals = np.zeros(contacts), np.zeros(1, NUMBERS)
    for pieces in passed:
        stored = flow.stored(found[-1], base.values[-1])  # before what is at hand is written over; the last one counts
        for contact, spans in enumerate(held):
            spans.append(flow.held_in(pieces[:, 0], pieces, contact))
        sums = flow.sums(pieces)
        for name in ("input", "gap", "frame", "contact", "dashpot", "path"):
            totals[name] += sums[name]
    total = totals[0]
    gap, taken = float(total["gap"]), total["contact"][:contacts] - stored
    for sample, sign in ((found[-1], 0.5), (found[0], -0.5)):  # energy of motion and in the frame's springs
        q, v = sample[:n], sample[n : 2 * n]
        gap -= sign * float(q @ system["stiffness"][:n, :n] @ q + v @ system["inertia"][:n, :n] @ v)
    return {
        "contact_stops": [flow.stops(np.concatenate(spans), contact) for contact, spans in enumerate(held)],
        "paths": total["path"][:contacts],
        "energy": float(taken.sum() + total["frame"]),
        "contact_energies": taken,
        "energy_input": float(total["input"]),
        "friction_energy": float((taken - total["dashpot"][:contacts]).sum()),
        "closure_error": abs(gap),
    }
