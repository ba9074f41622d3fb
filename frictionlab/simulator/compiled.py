"""How formulas and flows are compiled: numba's decorators, machine code kept in the user's cache folder.

Imported with the kernels only, which are imported when they are needed: numba takes half a second to load.
``NUMBA_DISABLE_JIT=1`` leaves everything plain Python.
"""

import contextlib
import ctypes
import functools
import hashlib
import importlib
import logging
import os
import shutil
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

numba: Any = importlib.import_module("numba")  # its types are none that a formula in numbers could name
llvm: Any = importlib.import_module("llvmlite.ir")

Function = TypeVar("Function", bound=Callable[..., Any])

EXACT = ("phase", "motion", "flow", "account", "orbit", "answer")
SOURCES = ("compiled", "row", "laws/law", *(f"exact/{name}" for name in EXACT), "numeric/radau")


def _machine_code_folder() -> Path:
    """Return where machine code is kept: a folder of its own for each state of the source that is compiled.

    It stands in ``NUMBA_CACHE_DIR`` if that is set, else in the user's cache folder. numba's own check sees a change of
    a function's own file only (which is enough for a law's formula), hence the digest of all these.
    """
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    try:
        root = Path(home) if home else Path("~/.cache").expanduser()
    except RuntimeError:  # a user without a home folder
        root = Path(tempfile.gettempdir())
    digest = hashlib.sha256(numba.__version__.encode())
    for name in SOURCES:
        digest.update((Path(__file__).parent / f"{name}.py").read_bytes())
    return root / "frictionlab" / f"simulator-{digest.hexdigest()[:16]}"


FOLDER = _machine_code_folder()
with contextlib.suppress(OSError):  # where nothing can be written each process compiles for itself
    FOLDER.mkdir(parents=True, exist_ok=True)
_ANNOUNCED: set[Path] = set()
_CALLED: list[Any] = []  # functions called by their address
_RAISED: dict[int, BaseException] = {}  # by thread: what compiled code cannot raise, until it returns
OPTIONS = {"cache": os.access(FOLDER, os.W_OK), "error_model": "numpy"}


def announce(module: str) -> None:
    """Say once to whoever listens to this module's logger that compiling begins, if it has to."""
    if numba.config.DISABLE_JIT or FOLDER in _ANNOUNCED:
        return
    if not any(FOLDER.glob(f"**/{module.rpartition('.')[2]}.*.nbi")):
        _ANNOUNCED.add(FOLDER)
        logging.getLogger(__name__).info("compiling the simulator once, about half a minute, into %s", FOLDER.parent)


def clear_cache() -> str:
    """Remove the machine code kept for this user, of all versions, and say how much; OSError where it may not be."""
    folders = sorted(FOLDER.parent.glob("simulator-*"))
    size = sum(file.stat().st_size for folder in folders for file in folder.rglob("*") if file.is_file())
    for folder in folders:
        shutil.rmtree(folder)
    return f"{FOLDER.parent}: {size / 1e6:.0f} MB of machine code removed"


def compiled(function: Function) -> Function:
    """Compile a function when it is first called."""
    fast: Function = _kept(numba.njit(nogil=True, **OPTIONS), function)
    return fast


def inner(function: Function) -> Function:
    """Compile a function that only compiled functions call: it needs no way in from Python, a quarter of the time."""
    fast: Function = _kept(numba.njit(nogil=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **OPTIONS), function)
    return fast


def inlined(function: Function) -> Function:
    """Compile a function into its only caller, in whose code numba would optimise it once more, and so at each level.

    It pays where much is called: putting it in takes time, too.
    """
    fast: Function = _kept(numba.njit(nogil=True, inline="always", **OPTIONS), function)
    return fast


def entry(function: Function) -> Function:
    """Compile a function that Python calls, for the types of its first call, which are those of all.

    numba looks the type of a record up at each call, which takes longer than a steady state; so that is left out.
    """
    if numba.config.DISABLE_JIT:
        return function
    dispatcher = _kept(numba.njit(nogil=True, **OPTIONS), function)
    made: list[Callable[..., Any]] = []

    @functools.wraps(function)
    def called(*arguments: Any) -> Any:
        if not made:
            made.append(dispatcher.compile(tuple(numba.typeof(argument) for argument in arguments)))
        result = made[0](*arguments)
        if _RAISED and (fault := _RAISED.pop(threading.get_ident(), None)) is not None:
            raise fault
        return result

    return cast("Function", called)


def record_of(kind: np.dtype[Any], count: int = 1) -> Any:
    """Return records of a kind, all zeros, in an array: compiled functions take its elements."""
    array = np.zeros(count, kind)
    return array.view(np.recarray) if numba.config.DISABLE_JIT else array  # fields as attributes in plain Python too


@functools.cache
def address_of(function: Callable[..., Any], signature: Any) -> int:
    """Compile a function at once and return its address, by which compiled ones call it; in plain Python its number."""
    _CALLED.append(_kept(numba.cfunc(signature, **OPTIONS), function))
    return len(_CALLED) if numba.config.DISABLE_JIT else int(_CALLED[-1].address)


@functools.cache
def address_in_python(function: Callable[..., int], *kinds: np.dtype[Any]) -> int:
    """Return the address by which compiled code calls a function that is not compiled, of records and a number.

    Where the function raises, Ctrl-C too, it gives 0, upon which its caller returns; the `entry` then raises it.
    """
    if numba.config.DISABLE_JIT:
        _CALLED.append(function)
        return len(_CALLED)

    def called(*values: int) -> int:
        try:
            places = [(ctypes.c_char * kind.itemsize).from_address(at) for kind, at in zip(kinds, values, strict=False)]
            records = [np.frombuffer(memoryview(place), kind)[0] for kind, place in zip(kinds, places, strict=True)]
            return function(*records, values[-1])
        except BaseException as fault:  # noqa: BLE001 - raised by the entry
            _RAISED[threading.get_ident()] = fault
            return 0

    kept = ctypes.CFUNCTYPE(ctypes.c_int64, *(ctypes.c_void_p for _ in kinds), ctypes.c_int64)(called)
    _CALLED.append(kept)
    return int(ctypes.cast(kept, ctypes.c_void_p).value or 0)


def caller(signature: Any) -> Any:
    """Return what calls, from compiled code, a function of a signature: of its address and a tuple of arguments.

    An address in a record costs nothing at a call from Python, where a function's type is looked up each time.
    """
    if numba.config.DISABLE_JIT:
        return lambda address, arguments: _CALLED[address - 1](*arguments)

    def typed(_typing: Any, address: Any, arguments: Any) -> Any:
        def lowered(context: Any, builder: Any, called: Any, values: Any) -> Any:
            kinds = [context.get_value_type(kind) for kind in signature.args]
            kind = llvm.FunctionType(context.get_value_type(signature.return_type), kinds).as_pointer()
            parts = zip(
                numba.core.cgutils.unpack_tuple(builder, values[1]), called.args[1], signature.args, strict=True
            )
            given = [context.cast(builder, value, own, wanted) for value, own, wanted in parts]
            return builder.call(builder.inttoptr(values[0], kind), given)

        return signature.return_type(address, arguments), lowered

    return numba.extending.intrinsic(typed)


def _kept(decorate: Callable[[Any], Any], function: Any) -> Any:
    """Decorate a function so that its machine code is kept."""
    if numba.config.DISABLE_JIT:
        return function
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(FOLDER)
    try:
        return decorate(function)
    finally:
        numba.config.CACHE_DIR = before
