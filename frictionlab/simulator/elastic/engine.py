"""Run the elastic kernel as it stands, or compiled: as `frictionlab.simulator.engine` runs the rigid one."""

import functools
from math import inf, sqrt
from typing import Any

from frictionlab.simulator import engine as engines
from frictionlab.simulator.elastic import events, layout, orbits, phases, settling, shooting, starts
from frictionlab.simulator.elastic.sliders import sliders_of
from frictionlab.simulator.engine import LOOKS, Engine
from frictionlab.simulator.kernel.layout import PHASE, TALLY, Force, Rig, RigidContact
from frictionlab.simulator.problem import Problem

# Each uses only those before it, and the rigid kernel.
MODULES = (phases, events, starts, shooting, settling, orbits)
COMPILED = (*engines.MODULES, *MODULES)
WORTH_LOADING = 2e4  # phases; in plain Python they take about as long (1 s) as loading the compiled kernel
WORTH_COMPILING = 3e5  # the same for compiling it, once per machine and version


@functools.cache
def plain() -> Engine:
    """Return the kernel as plain Python: nothing to load."""
    return engines.as_it_stands(COMPILED)


@functools.cache
def compiled() -> Engine:
    """Return the kernel compiled by numba.

    Raises
    ------
    SimulationError
        If numba cannot be loaded.
    """
    return engines.compile_modules(layout, MODULES, below=engines.compiled())


def set_up(engine: Engine, problem: Problem) -> tuple[Rig, layout.Sliders, Force]:
    """Return the kernel's rig, sliders and force of a problem."""
    stiffness, strength = sliders_of(problem)
    none = (0.0,) * len(stiffness)
    sliders = layout.Sliders(*(engine.buffer(values) for values in (stiffness, strength, none, none, none, none)))
    up, down = problem.static_ratios
    damping = problem.zeta, problem.frame_damping_ratio
    contact = RigidContact(problem.beta, problem.parameter("gradient"), up, down, *damping)
    force = engines.make_force(engine, *problem.force)
    return engines.plain().kernel.make_rig(problem.r, contact, force), sliders, force


def make_elastic_room(engine: Engine, problem: Problem, phases: int) -> Any:
    """Return the kernel's buffers, with space to record a number of phases."""
    base, count = problem.base, len(sliders_of(problem)[0])
    wall = (base.cosine, base.sine) if problem.wall == "base" else ((), ())
    size = 2 + count
    sizes = (size * size, TALLY, PHASE * phases)
    jacobian, tally, recorded = (engine.zeros(n) for n in sizes)
    start, image, trial, known = (engine.zeros(2 + 2 * count) for _ in range(4))
    matrix, kinds = engine.zeros(size * (size + 1)), engine.zeros(count)
    moved, meter = engines.make_force(engine, *wall), engine.buffer((inf,))
    slow = engines.make_force(engine, *problem.force)
    return layout.ElasticRoom(jacobian, tally, recorded, moved, meter, slow, kinds, start, image, trial, known, matrix)


def phases_per_cycle(problem: Problem) -> float:
    """Return about how many phases a cycle has: each natural period of the held contact may have some."""
    stiffness, _ = sliders_of(problem)
    return 4.0 * (len(stiffness) + problem.base.harmonics) + 2.0 * sqrt(1.0 + sum(stiffness)) / problem.r


def choose(work: float) -> Engine:
    """Return the engine for about so many phases of work."""
    if compiled.cache_info().currsize or work > WORTH_COMPILING:
        return compiled()
    return compiled() if work > WORTH_LOADING and _is_compiled() else plain()


def hand_over_after() -> float:
    """Return after how many looks at a phase plain Python hands its work over to the compiled kernel."""
    return LOOKS * (WORTH_LOADING if _is_compiled() else WORTH_COMPILING)


def _is_compiled() -> bool:
    """Tell whether machine code of this kernel is kept already."""
    return any(engines.machine_code_folder(layout, COMPILED).glob("**/*.nbi"))
