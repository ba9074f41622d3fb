"""What is simulated: a steady state, the response to a recorded base, the logs of a virtual rig; tests to be made.

Whatever needs a scene or files is imported where it is used: a steady state is solved without them. A verb raises
SceneError or UsageError where its scene or a setting is refused; its docstring says what else.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from frictionlab.errors import UsageError

if TYPE_CHECKING:
    from frictionlab.base_motion import RecordResponse
    from frictionlab.inference.material_law import MaterialLaw
    from frictionlab.inference.predictive import Prediction
    from frictionlab.planning.plan import Plan, Watch
    from frictionlab.recording import Recording
    from frictionlab.scene import Scene
    from frictionlab.simulator import Problem, Solver, SteadyState, Structure
    from frictionlab.synthetic import SyntheticTest
    from frictionlab.verbs.inputs import AnyScene, FilePath

PLANNED = ("plan", "model", "rig", "sensors")
"""Tables of a scene whose keys `plan` takes as settings."""


def simulate(problem: "Problem | Structure", *, cycles: int | None = None, solver: "Solver" = "auto") -> "SteadyState":
    """Solve one steady state of the friction oscillator, or run so many cycles from rest.

    Parameters
    ----------
    problem : Problem or Structure
        Frequency ratio, contact law and base motion, dimensionless; or several masses with their contacts.
    cycles : int, optional
        The last of so many cycles from rest, instead of the steady state that is solved for.
    solver : {"auto", "closed-form", "exact", "numeric", "thesis"}
        ``auto``: the closed form where it is valid, else the exact orbit.

    Raises
    ------
    SimulationError
        A solver outside its domain, or one that finds no motion.
    UsageError
        ``cycles`` of several masses.

    Examples
    --------
    >>> from frictionlab.simulator import Problem
    >>> print(f"{simulate(Problem(r=0.5, beta=0.4)).energy_per_cycle:.10f}")
    2.1260422664
    """
    from frictionlab.simulator import Problem, last_cycle, steady_state

    if cycles is None:
        return steady_state(problem, solver=solver)
    if not isinstance(problem, Problem):
        raise UsageError("simulate: of several masses the steady state is solved for exactly: leave cycles out")
    return last_cycle(problem, cycles=cycles, solver=solver)


def respond(
    what: "Recording | FilePath",
    problem: "Problem | Callable[[float], Problem | Structure]",
    scene: "AnyScene" = None,
    *,
    highpass_hz: float | None = None,
    **settings: object,
) -> "RecordResponse":
    """Simulate one mass, or a frame of several, from rest, under any recorded motion of the base.

    Parameters
    ----------
    what : Recording, str or Path
        A recording, its file, a log with a base column, or one column of any table (``base="2"``).
    problem : Problem or callable
        The contact law, with r = 1 (time is counted in omega_n t); beta is over k times the largest displacement of the
        base from its first value, Y. Friction that is known in newtons, or a frame of several masses, is given as a
        function of Y [m].
    scene, **settings
        ``[rig]`` gives natural frequency, stiffness and, where the problem has none, the frame's damping ratio;
        ``[log]`` what the log does not say itself. Keys of both may be set: ``natural_frequency_hz=3.13, unit="mm"``.
    highpass_hz : float, optional
        A base that is given as an acceleration, with a fixed wall: it is integrated twice, without what is slower.

    Raises
    ------
    LogError, RecordingError
        The base cannot be read, has a gap or jumps, or is an acceleration and needs `highpass_hz`.
    SimulationError
        The base does not move, or the law cannot be integrated.
    """
    from frictionlab.base_motion import respond_to
    from frictionlab.logs import read_base_log
    from frictionlab.recording import Recording
    from frictionlab.verbs.inputs import scene_given
    from frictionlab.verbs.one_test import recording_given

    known = scene_given(scene, settings, ("rig", "log"))
    frequency = known.rig.natural_frequency
    if frequency is None:
        raise UsageError("rig.natural_frequency_hz: expected the frame's; got none: give --natural-frequency HZ")
    if not callable(problem) and problem.frame_damping_ratio == 0.0:
        problem = problem.with_parameters({"frame_damping_ratio": known.frame_damping_ratio})
    recording, source = recording_given(what, known, read_base_log), "" if isinstance(what, Recording) else str(what)
    if highpass_hz is not None and "base_displacement" in recording.measured():
        raise UsageError(f"{what}: --highpass belongs to a base that is an acceleration; got a displacement")
    return respond_to(
        recording,
        problem,
        natural_frequency_hz=frequency,
        stiffness_n_per_m=known.rig.stiffness,
        source=source,
        highpass_hz=highpass_hz,
    )


def synthesize(
    scene: "AnyScene", folder: "FilePath", *, progress: Callable[[int, int], None] | None = None, **settings: object
) -> "tuple[SyntheticTest, ...]":
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
        The scene has no ``[[synthetic.tests]]``, or one that cannot be simulated.
    OutputError
        A log of the same name is a measured one, or the folder cannot be written.
    """
    from frictionlab import synthetic
    from frictionlab.verbs.inputs import scene_given

    known = scene_given(scene, settings, ("synthetic", "rig", "model"))
    total = len(synthetic.virtual_tests(known))
    tests = []
    for test in synthetic.synthesize(known, Path(folder)):
        tests.append(test)
        if progress is not None:
            progress(len(tests), total)
    return tuple(tests)


def plan(
    scene: "AnyScene",
    *,
    law: str | None = None,
    against: str | None = None,
    tests: int | None = None,
    law_file: "MaterialLaw | FilePath | None" = None,
    sheet: "FilePath | None" = None,
    force: bool = False,
    everything: bool = False,
    watch: "Watch" = iter,
    **settings: object,
) -> "Plan":
    """Return the tests that say most about a contact law, or most between two, best first.

    Parameters
    ----------
    scene : Scene, str or Path
        ``[plan]``: what the rig can set, its sensors, what is known of the friction coefficient; ``[rig]``;
        ``[model]``: the law and its expected parameters.
    law, against : str, optional
        A law in place of the scene's; another law that the tests are to decide against.
    tests : int, optional
        How many at most: by default ten, between two laws no more than are expected to decide.
    law_file : MaterialLaw, str or Path, optional
        What is known before: the law of the material, ``law_MATERIAL.toml`` of its campaign. Where neither `law` nor
        the scene names a law, it is planned for.
    sheet : str or Path, optional
        Write the plan here as a sheet (CSV) for the laboratory, which ``[experiment] sheet`` reads after the tests;
        a file that stands there may have been filled in, and is replaced with ``force`` only.
    everything : bool
        Judge candidates that are not chosen as closely as those that are (seconds).
    watch : callable, optional
        Wraps the candidates while their motions are solved for, to show progress.
    **settings
        Keys of ``[plan]``, ``[model]``, ``[rig]`` and ``[sensors]`` that win over the scene's: ``duration_s=90.0``.

    Raises
    ------
    SceneError
        Natural frequency or stiffness is not known, ``[plan.expected]`` names what the law lacks, a range is empty, the
        bounds forbid all, or no test outlasts its transient.
    UsageError
        A law cannot be, no candidate shows anything about it, or the sheet exists.
    """
    from frictionlab.inference.material_law import MaterialLaw, read_material_law
    from frictionlab.planning.candidates import laboratory
    from frictionlab.planning.plan import plan_tests, sheet_rows
    from frictionlab.tables import check_output, write_rows
    from frictionlab.verbs.inputs import scene_given

    known = scene_given(scene, settings, PLANNED)
    inputs = [] if law_file is None or isinstance(law_file, MaterialLaw) else [Path(law_file)]
    if sheet is not None:
        check_output(Path(sheet), force=force, inputs=[*inputs, *known.files])
        if Path(sheet).exists() and not force:
            raise UsageError(f"{sheet}: exists, and may hold what was filled in: choose another output, or --force")
    before = law_file if law_file is None or isinstance(law_file, MaterialLaw) else read_material_law(law_file)
    if before is not None and known.experiment.material not in (None, before.material):
        raise UsageError(f"law_file: expected the law of {known.experiment.material}; got that of {before.material}")
    known, notes = _not_said(known, before)
    if before is not None:
        known = known.changed(experiment={"material": before.material})
    if sheet is not None and known.experiment.material is None:
        notes.append(f"experiment.material: not given: {sheet} leaves it empty: fill it in")
    lab = laboratory(known, law, before)
    lab = replace(lab, notes=(*notes, *lab.notes))
    found = plan_tests(lab, against=against, tests=tests, everything=everything, watch=watch)
    if sheet is not None:
        write_rows(sheet_rows(found, known), Path(sheet), force=True, inputs=inputs)
    return found


def _not_said(scene: "Scene", before: "MaterialLaw | None") -> "tuple[Scene, list[str]]":
    """The scene with the base amplitudes of the law's tests where it names none; what is assumed, in words."""
    open_keys, notes = [k for k in ("base_amplitudes_m", "duration_s") if k not in scene.plan.model_fields_set], []
    if before is not None and "base_amplitudes_m" in open_keys and "base_amplitude_m" in before.conditions:
        tested = sorted({float(f"{amplitude:.3g}") for amplitude in before.conditions["base_amplitude_m"]})
        scene, open_keys = scene.changed(plan={"base_amplitudes_m": tested}), open_keys[1:]
        notes.append(f"plan.base_amplitudes_m: not given: {tested}, as in the tests of {before.material}")
    assumed = ", ".join(f"{key} = {getattr(scene.plan, key)}" for key in open_keys)
    return scene, notes + [f"plan: not given, assumed: {assumed}: name yours under [plan]"] * bool(assumed)


def predict(
    law: "MaterialLaw | FilePath",
    r: float | Sequence[float] | None = None,
    *,
    normal_force_n: float | None = None,
    base_amplitude_m: float | None = None,
    base_motion: "FilePath | None" = None,
    draws: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> "Prediction":
    """Predict tests not made by the law of their material: motion, amplitude, energy, stops, each with a 95 % band.

    The bands hold the errors of the law and the scatter from test to test.

    Parameters
    ----------
    law : MaterialLaw, str or Path
        A ``law_MATERIAL.toml`` that a campaign wrote.
    r : float or sequence of float, optional
        Frequency ratios; like the next two, by default the middle of those that were tested.
    normal_force_n, base_amplitude_m : float, optional
        In N, and in m.
    base_motion : str or Path, optional
        A recording or a log whose base, from rest, drives the mass, in place of a steady drive.
    draws : int, optional
        Motions behind each band.
    progress : callable, optional
        Called with tests predicted and tests in all.

    Raises
    ------
    UsageError
        It is no file of a law, a number cannot be, or the law holds for other normal forces only.
    LogError, RecordingError
        The base's motion cannot be read, or has a gap.

    Examples
    --------
    >>> from frictionlab.inference.material_law import example_law
    >>> predict(example_law(), r=0.5, normal_force_n=4.0, draws=20).tests[0].regime
    'stick-slip'
    """
    from frictionlab.inference.material_law import MaterialLaw, read_material_law
    from frictionlab.inference.predictive import predict_record, predict_tests
    from frictionlab.logs import read_base_log
    from frictionlab.scene import Scene
    from frictionlab.verbs.one_test import recording_given

    known = law if isinstance(law, MaterialLaw) else read_material_law(law)
    force = _positive(known, "normal_force_n", normal_force_n)
    amplitude = _positive(known, "base_amplitude_m", base_amplitude_m)
    if base_motion is not None:
        if r is not None or base_amplitude_m is not None:
            raise UsageError("base_motion: a recorded base has its own amplitude and times: give neither r nor Y")
        found = recording_given(base_motion, Scene(), read_base_log)
        if "base_displacement" not in found.measured():
            raise UsageError(f"{base_motion}: expected the base's displacement; got its acceleration: integrate it")
        more = {} if draws is None else {"draws": draws}
        return predict_record(known, found, normal_force_n=force, **more)
    ratios = _positive(known, "frequency_ratio", None) if r is None else r
    several = [float(ratios)] if isinstance(ratios, int | float) else [float(x) for x in ratios]
    if wrong := [x for x in several if not 0.0 < x < math.inf]:
        raise UsageError(f"r: expected frequency ratios above 0; got {wrong[0]:g}")
    return predict_tests(
        known, several, normal_force_n=force, base_amplitude_m=amplitude, draws=draws, progress=progress
    )


def _positive(law: "MaterialLaw", name: str, value: float | None) -> float:
    """A number of the test, by default the middle of those that the law was found under."""
    if value is None:
        if name not in law.conditions:
            raise UsageError(f"{name}: expected a number; got none, and the law's own tests have none: give one")
        value = 0.5 * sum(law.conditions[name])
    if not 0.0 < value < math.inf:
        raise UsageError(f"{name}: expected a finite number above 0; got {value:g}")
    return float(value)
