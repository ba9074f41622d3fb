"""Run the kernel as it stands, or compiled: one source, two speeds, the same bits.

Plain Python starts at once and needs about a millisecond per steady state; the compiled kernel needs a second to load
and some ten microseconds. Which one runs changes nothing but the time.
"""

import contextlib
import functools
import hashlib
import importlib
import importlib.util
import inspect
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SimulationError
from frictionlab.simulator.kernel import (
    accounts,
    events,
    layout,
    motion,
    orbits,
    outlook,
    points,
    resonance,
    settle,
    shooting,
)
from frictionlab.simulator.problem import Problem

# Each uses only those before it.
MODULES = (motion, events, shooting, outlook, resonance, settle, orbits, accounts, points)
LOOKS = 6.0  # at a slide, while its end is looked for
INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # what only other compiled functions call
WORTH_LOADING = 2e4  # slides; in plain Python they take about as long (1 s) as loading the compiled kernel
WORTH_COMPILING = 3e5  # the same for compiling it, once per machine and version; they take some 15 s in plain Python


@dataclass(frozen=True)
class Engine:
    """A kernel ready to run: its functions by name, and what makes its buffers.

    Parameters
    ----------
    kernel : namespace
        Its functions by name; of a compiled one those that Python calls.
    buffer : callable
        Makes a buffer of some numbers.
    zeros : callable
        Makes one of so many zeros.
    flat : callable
        Makes one of an array's numbers, row by row.
    functions : mapping
        Of a compiled kernel all functions, by module and name: what another kernel may build on.
    """

    kernel: Any
    buffer: Callable[[tuple[float, ...]], Any]
    zeros: Callable[[int], Any]
    flat: Callable[[NDArray[np.float64]], Any]
    functions: Mapping[tuple[str, str], Any] = field(default_factory=dict)


@functools.cache
def plain() -> Engine:
    """Return the kernel as plain Python: nothing to load."""
    return as_it_stands(MODULES)


@functools.cache
def compiled() -> Engine:
    """Return the kernel compiled by numba; machine code is kept between processes, see `machine_code_folder`."""
    return compile_modules(layout, MODULES)


def functions_of(module: ModuleType) -> list[str]:
    """Return the names of the functions that a module defines."""
    return [name for name, f in vars(module).items() if inspect.isfunction(f) and f.__module__ == module.__name__]


def as_it_stands(modules: tuple[ModuleType, ...]) -> Engine:
    """Return the functions of modules as plain Python."""
    functions = {name: getattr(module, name) for module in modules for name in functions_of(module)}
    return Engine(SimpleNamespace(**functions), list, lambda count: [0.0] * count, lambda array: array.ravel().tolist())


def compile_modules(
    names: ModuleType,
    modules: tuple[ModuleType, ...],
    *,
    formulas: Mapping[ModuleType, tuple[str, ...]] | None = None,
    below: Engine | None = None,
) -> Engine:
    """Return a kernel of the functions of modules, compiled.

    What only other compiled functions call needs no way in from Python: a quarter of the time to compile. Buffers are
    Python's, so that nothing counts who refers to them (`_nrt`): numba would at every call of a function, by atomic
    steps that took half the time of a steady state. Only buffers made on the way are counted.

    Parameters
    ----------
    names : module
        Holds their constants, as ENTRIES the names of the functions that Python calls, as OWNERS those of the modules
        that make buffers of their own or are handed such, and as INLINED those of functions worth a copy at each call.
    modules : tuple of modules
        Each uses those before it only.
    formulas : mapping, optional
        Functions of further modules that use nothing but their arguments and `math`; they come first.
    below : Engine, optional
        A compiled kernel whose functions these use.

    Raises
    ------
    SimulationError
        If numba cannot be loaded.
    """
    try:
        import numba  # noqa: PLC0415 - half a second that a single steady state does not need
    except ImportError as error:
        raise SimulationError(
            f"simulation: the compiled kernel; expected the package numba; got: {error}; "
            "do: pip install numba, or keep the work small enough for plain Python"
        ) from error
    functions = dict(below.functions) if below else {}  # by module and name: two modules may use a name for their own
    sources, entries = formulas or {}, names.ENTRIES
    others = tuple(importlib.import_module(name) for name in dict.fromkeys(name for name, _ in functions))
    folder = machine_code_folder(names, (*sources, *others, *modules))
    if not any(folder.glob("**/*.nbi")):
        _announce()
    with _cached_in(folder, numba.config) as cache:
        njit: Any = functools.partial(numba.njit, cache=cache, error_model="numpy", nogil=True)
        for module, listed in sources.items():
            functions.update({(module.__name__, name): njit(**INNER)(getattr(module, name)) for name in listed})
        for module in modules:
            twin, owns = _fresh(module), module.__name__.rpartition(".")[2] in names.OWNERS
            vars(twin).update({name: functions[home] for name, home in borrowed(twin).items() if home in functions})
            for name in functions_of(module):
                inlined = name in names.INLINED
                declare = njit(_nrt=owns, forceinline=inlined, **({} if name in entries else INNER))
                fast = declare(getattr(twin, name))
                setattr(twin, name, fast)
                functions[module.__name__, name] = fast
    called = {name: fast for (_, name), fast in functions.items() if name in entries}
    return Engine(
        SimpleNamespace(**(vars(below.kernel) if below else {}), **called),
        lambda values: np.array(values, dtype=np.float64),
        np.zeros,
        lambda array: np.ascontiguousarray(array).ravel(),
        functions,
    )


def _announce() -> None:
    """Say to whoever listens to this module's logger that compiling begins."""
    import logging  # noqa: PLC0415 - two milliseconds that only a compiler's start is worth

    logging.getLogger(__name__).info("compiling the simulator once for this machine, about half a minute")


def borrowed(module: ModuleType) -> dict[str, tuple[str, str]]:
    """Return the functions that a module uses from others: name -> their module and name there."""
    used = {name: thing for name, thing in vars(module).items() if inspect.isfunction(thing)}
    return {name: (f.__module__, f.__name__) for name, f in used.items() if f.__module__ != module.__name__}


def machine_code_folder(names: ModuleType = layout, modules: tuple[ModuleType, ...] = MODULES) -> Path:
    """Return where machine code is kept: a folder of its own for each state of the kernel's source.

    It stands in ``NUMBA_CACHE_DIR`` if that is set, else in the user's cache folder; never in the package. The
    compiler's own check sees a change of a function's own file only, hence the digest of all files.
    """
    digest = hashlib.sha256()
    for module in (layout, names, *modules):
        digest.update(Path(str(module.__file__)).read_bytes())
    return _cache_root() / "frictionlab" / f"kernel-{digest.hexdigest()[:16]}"


def _cache_root() -> Path:
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    try:
        return Path(home) if home else Path("~/.cache").expanduser()
    except RuntimeError:  # a user without a home folder
        return Path(tempfile.gettempdir())


@contextlib.contextmanager
def _cached_in(folder: Path, config: Any) -> Iterator[bool]:
    """Point the compiler's cache to a folder while functions are declared; False where nothing can be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        yield False  # compiled anew in each process: slower to start, the same otherwise
        return
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder)
    try:
        yield os.access(folder, os.W_OK)
    finally:
        config.CACHE_DIR = before


def _fresh(module: ModuleType) -> ModuleType:
    """Return a second copy of a module, whose functions can be replaced without touching the first."""
    spec = importlib.util.find_spec(module.__name__)
    if spec is None or spec.loader is None:
        raise SimulationError(f"simulation: the kernel's source; expected a module {module.__name__}; got none")
    twin = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(twin)
    return twin


def is_worth_it(slides: float) -> bool:
    """Tell whether about so many slides of work are done sooner by the compiled kernel, its loading included."""
    if compiled.cache_info().currsize or slides > WORTH_COMPILING:
        return True
    return slides > WORTH_LOADING and any(machine_code_folder().glob("**/*.nbi"))


def choose(slides: float) -> Engine:
    """Return the engine for about so many slides of work."""
    return compiled() if is_worth_it(slides) else plain()


def hand_over_after() -> float:
    """Return after how many looks at a slide plain Python hands its work over to the compiled kernel."""
    return LOOKS * (WORTH_LOADING if any(machine_code_folder().glob("**/*.nbi")) else WORTH_COMPILING)


def make_force(engine: Engine, cosine: tuple[float, ...], sine: tuple[float, ...]) -> layout.Force:
    """Return the kernel's buffers of a Fourier series: its coefficients, and space for them about another time."""
    none = (0.0,) * len(cosine)
    return layout.Force(engine.buffer(cosine), engine.buffer(sine), engine.buffer(none), engine.buffer(none))


def make_room(engine: Engine, problem: Problem, phases: int) -> layout.Room:
    """Return the kernel's buffers, with space to record a number of phases."""
    base = problem.base
    wall = make_force(engine, base.cosine, base.sine) if problem.wall == "base" else make_force(engine, (), ())
    jacobian, tally, record = (engine.zeros(size) for size in (4, layout.TALLY, layout.PHASE * phases))
    return layout.Room(jacobian, tally, record, wall, engine.buffer((inf,)))


def contact_of(problem: Problem) -> layout.RigidContact:
    """Return the numbers of a rigid contact law, in the kernel's order.

    Raises
    ------
    SimulationError
        Another solver answers for the law.
    """
    if problem.law.kind != "rigid":
        raise SimulationError(f"simulation: law {problem.law.name}: rigid exact phases do not know it")
    up, down = problem.static_ratios
    gradient = problem.parameter("gradient")
    return layout.RigidContact(problem.beta, gradient, up, down, problem.zeta, problem.frame_damping_ratio)


def set_up(engine: Engine, problem: Problem) -> tuple[layout.Rig, layout.Force]:
    """Return the kernel's rig and force of a problem."""
    force = make_force(engine, *problem.force)
    return engine.kernel.make_rig(problem.r, contact_of(problem), force), force
