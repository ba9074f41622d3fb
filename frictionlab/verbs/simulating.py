"""What is simulated: a steady state, the response to a recorded base, the logs of a virtual rig."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from frictionlab.errors import UsageError
from frictionlab.verbs.inputs import AnyScene, FilePath, is_recording_name, scene_given

if TYPE_CHECKING:
    from frictionlab.base_motion import RecordResponse
    from frictionlab.recording import Recording
    from frictionlab.simulator import Problem, Solver, SteadyState
    from frictionlab.synthetic import VirtualTest


def simulate(problem: "Problem", *, cycles: int | None = None, solver: "Solver" = "auto") -> "SteadyState":
    """Solve one steady state of the friction oscillator, or run so many cycles from rest.

    Parameters
    ----------
    problem : Problem
        Frequency ratio, contact law and base motion, dimensionless.
    cycles : int, optional
        The last of so many cycles from rest, instead of the steady state that is solved for.
    solver : str
        ``auto``: the closed form where it is valid, else the exact orbit.

    Raises
    ------
    SimulationError
        The problem is outside the solver's domain.

    Examples
    --------
    >>> from frictionlab.simulator import Problem
    >>> print(f"{simulate(Problem(r=0.5, beta=0.4)).energy_per_cycle:.10f}")
    2.1260422664
    """
    from frictionlab.simulator import last_cycle, steady_state

    if cycles is None:
        return steady_state(problem, solver=solver)
    return last_cycle(problem, cycles=cycles, solver=solver)


def respond(
    what: "Recording | FilePath",
    problem: "Problem",
    scene: AnyScene = None,
    *,
    highpass_hz: float | None = None,
    **settings: object,
) -> "RecordResponse":
    """Simulate the mass, from rest, under any recorded motion of the base.

    Parameters
    ----------
    what : Recording, str or Path
        A recording, its file, a log with a base column, or one column of any table (``base="2"``).
    problem : Problem
        The contact law, with r = 1 (time is counted in omega_n t); beta is over k times the largest displacement of the
        base from its first value.
    scene : Scene, str, Path or None
        ``[rig]`` gives natural frequency, stiffness and, where the problem has none, the frame's damping ratio;
        ``[log]`` what the log does not say itself.
    highpass_hz : float, optional
        A base that is given as an acceleration, with a fixed wall: it is integrated twice, without what is slower.
    **settings
        Keys of ``[rig]`` and ``[log]`` that win over the scene's: ``natural_frequency_hz=3.13``, ``unit="mm"``.

    Raises
    ------
    UsageError
        The natural frequency is not known.
    LogError, RecordingError
        The base cannot be read, has a gap or jumps, or is an acceleration and needs `highpass_hz`.
    SimulationError
        The base does not move, or the law cannot be integrated.
    SceneError
        The scene or a setting is refused.
    """
    from frictionlab.base_motion import respond_to
    from frictionlab.hdf5 import read_recording
    from frictionlab.logs import read_base_acceleration, read_base_log
    from frictionlab.recording import Recording

    known = scene_given(scene, settings, ("rig", "log"))
    frequency = known.rig.natural_frequency
    if frequency is None:
        raise UsageError(
            "natural frequency: expected the frame's, in Hz; got none; do: give --natural-frequency HZ, or "
            "natural_frequency_hz in [rig] of the scene; `frictionlab free-vibration` measures it"
        )
    if known.rig.damping is not None and problem.frame_damping_ratio == 0.0:
        problem = problem.with_parameters({"frame_damping_ratio": known.rig.damping})
    if isinstance(what, Recording):
        return respond_to(what, problem, natural_frequency_hz=frequency, stiffness_n_per_m=known.rig.stiffness)
    path = Path(what)
    acceleration = None if is_recording_name(path) else read_base_acceleration(path, known.log)
    if acceleration is None and highpass_hz is not None:
        raise UsageError(f"{path}: --highpass belongs to a base that is an acceleration; got a displacement")
    recording = acceleration
    if recording is None:
        recording = read_recording(path) if is_recording_name(path) else read_base_log(path, known.log)
    return respond_to(
        recording,
        problem,
        natural_frequency_hz=frequency,
        stiffness_n_per_m=known.rig.stiffness,
        source=str(what),
        is_acceleration=acceleration is not None,
        highpass_hz=highpass_hz,
    )


def synthesize(
    scene: AnyScene, folder: FilePath, *, progress: Callable[[int, int], None] | None = None, **settings: object
) -> "tuple[VirtualTest, ...]":
    """Write one log per virtual test of a scene into a folder, and their truth beside them (``truth.jsonl``).

    Parameters
    ----------
    scene : Scene, str or Path
        Its ``[rig]``, ``[model]`` and ``[synthetic]`` tables say all; the same scene gives the same bytes.
    folder : str or Path
        Made if it is not there. Synthetic logs of the same names are replaced, measured ones never.
    progress : callable, optional
        Called with logs written and logs in all.
    **settings
        Keys of ``[synthetic]``, ``[rig]`` and ``[model]`` that win over the scene's: ``seed=1``.

    Raises
    ------
    SceneError
        The scene asks for no tests, or lacks what they need.
    OutputError
        The folder cannot be written, or a log that is not synthetic stands there.
    """
    from frictionlab import synthetic

    known = scene_given(scene, settings, ("synthetic", "rig", "model"))
    total = len(synthetic.virtual_tests(known))
    tests = []
    for test in synthetic.synthesize(known, Path(folder)):
        tests.append(test)
        if progress is not None:
            progress(len(tests), total)
    return tuple(tests)
