"""Loads left out: what the law of the frame's other recordings says of one, by this project and by its peers.

Run: ``python -m tests.benchmarks.identification_peers`` where mujoco[sysid] and pysindy are installed (none is
needed to use or to test this project); the result goes to results/identification_peers.txt. A peer that is absent is
named and left out. Each is given the mean steady cycles of the other loads and finds one law for them, in friction over
normal force; the load left out is simulated with it. The nrmse is that of its motion, with nothing taken from it and,
where the law has a gradient, with the gradient of that test fitted to it.
"""

import contextlib
import importlib.util
import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from frictionlab.analysis.measurement import Measurement, measure
from frictionlab.arrays import FloatArray
from frictionlab.campaign import evaluate
from frictionlab.campaign.trials import trial_of
from frictionlab.inference.comparison import contact_force
from frictionlab.inference.observations import base_of, nrmse_of, observe
from frictionlab.logs import read_log
from frictionlab.scene import read_scene
from frictionlab.simulator import Problem, steady_state
from tests.benchmarks import study
from tests.desk import ROOT

DATA = ROOT.parent / "shared" / "data"
SCENE = read_scene(ROOT / "configs" / "frame.toml")
LOADS, GRAM = (250, 350, 450), 9.80665e-3
FRAME = 0.0055  # the frame's damping ratio, as published
SLIDES = 0.1  # of the largest speed: slower is a stop, to a regression
STEPS, TURNS = 1000, 6  # of MuJoCo: steps a cycle, cycles until it is steady
MUJOCO = """
<mujoco><option timestep="{step}" gravity="0 0 0" integrator="implicitfast"/>
<worldbody><body><joint name="x" type="slide" axis="1 0 0" stiffness="1" damping="0.01" frictionloss="0.3"
 solreffriction="{double} 1" solimpfriction="0.99 0.9999 0.001"/><geom size="0.1" mass="{mass}"/></body></worldbody>
<actuator><motor joint="x"/></actuator></mujoco>
"""


@dataclass(frozen=True)
class Law:
    """Friction ratio over normal force (1/N), gradient, dashpot: what all loads share."""

    friction: float
    gradient: float = 0.0
    dashpot: float = 0.0

    def cycle(self, test: Measurement, gradient: float | None = None) -> FloatArray:
        """The cycle (p,) of a test; NaN where the law has none."""
        own = {"gradient": self.gradient if gradient is None else gradient, "contact_damping_ratio": self.dashpot}
        state = steady_state(_problem(test, self.friction * _force(test), own))
        tau = test.cycle.tau
        return np.full(len(tau), np.nan) if state.orbit is None else np.asarray(state.orbit.at(tau)[0])


Prediction = tuple[float, float]
"""nrmse with nothing taken from the test left out, and with its own gradient (NaN: the law has none)."""
Way = Callable[[Sequence[Measurement], Measurement], tuple[Prediction, str]]


def _force(test: Measurement) -> float:
    return test.normal_force_n or math.nan


def _problem(test: Measurement, beta: float = 0.3, own: Mapping[str, float] | None = None) -> Problem:
    r, base = test.frequency_ratio or math.nan, base_of(test.cycle, test.base_amplitude_m_se / test.base_amplitude_m)
    own = own or {"gradient": 0.0, "contact_damping_ratio": 0.0}
    return Problem(r, beta, base=base, law="coulomb+place+speed", parameters=own, frame_damping_ratio=FRAME)


def _judged(law: Law, out: Measurement, *, has_gradient: bool = True) -> Prediction:
    def missed(gradient: float | None = None) -> FloatArray:
        x = law.cycle(out, gradient)
        gap = out.cycle.mass - (x - x.mean())
        return np.where(np.isfinite(gap), gap, 1e3)

    nothing = nrmse_of(out.cycle.mass, law.cycle(out))
    if not has_gradient:
        return nothing, math.nan

    def residual(x: FloatArray) -> FloatArray:
        return missed(float(x[0]))

    starts = [least_squares(residual, [g], diff_step=[1e-4], x_scale=0.03) for g in (-0.04, 0.04)]
    own = min(starts, key=lambda found: found.cost).x[0]
    return nothing, nrmse_of(out.cycle.mass, law.cycle(out, own))


def plain(others: Sequence[Measurement], out: Measurement) -> tuple[Prediction, str]:
    """Least squares of Coulomb's law on the cycles."""

    def residual(x: FloatArray) -> FloatArray:
        return np.concatenate([t.cycle.mass - (c := Law(x[0]).cycle(t)) + c.mean() for t in others])

    law = Law(float(least_squares(residual, [0.14], diff_step=[1e-4]).x[0]))
    return _judged(law, out, has_gradient=False), _words(law)


def _regression(
    tests: Sequence[Measurement], terms: Callable[[FloatArray, FloatArray, FloatArray], list[FloatArray]]
) -> tuple[FloatArray, list[FloatArray]]:
    """Terms of speed, place and direction times normal force (n, m), and each test's force, while the mass slides."""
    columns, forces = [], []
    for test in tests:
        v, z, force = test.cycle.mass_velocity, test.cycle.mass_smooth, contact_force(test.cycle, _problem(test))
        kept = np.abs(v) > SLIDES * np.abs(v).max()
        columns.append(np.stack(terms(v[kept], z[kept], _force(test) * np.sign(v[kept])), axis=1))
        forces.append(force[kept])
    return np.concatenate(columns), forces


def _of_map(values: FloatArray, out: Measurement) -> tuple[Prediction, str]:
    """A law of place and speed from its force's coefficients; what makes no sense there is held at zero."""
    side, place, speed = (float(value) for value in values)
    law = Law(side, place / side, max(speed, 0.0) / (2.0 * (out.frequency_ratio or math.nan)))
    return _judged(law, out), _words(law)


def inverted(others: Sequence[Measurement], out: Measurement) -> tuple[Prediction, str]:
    """A static map n(v, z) by least squares on the force that the equation of motion leaves (as FrictionModels.jl)."""
    columns, forces = _regression(others, lambda v, z, side: [side, z * side, v])
    about_zero = np.concatenate([force - force.mean() for force in forces])
    return _of_map(np.linalg.lstsq(columns, about_zero, rcond=None)[0], out)


def sindy(others: Sequence[Measurement], out: Measurement) -> tuple[Prediction, str]:
    """The same force by sparse regression (pysindy's STLSQ) on a library of seven terms."""
    import pysindy  # noqa: PLC0415 - optional

    columns, forces = _regression(others, lambda v, z, side: [side, z * side, v, z, v**3, z * v, np.ones_like(v)])
    sparse = pysindy.STLSQ(threshold=0.01, alpha=1e-6).fit(columns, np.concatenate(forces)[:, None])
    return _of_map(np.ravel(sparse.coef_)[:3], out)


def mujoco_sysid(*, sensors: bool) -> Way:
    """MuJoCo's joint least squares: friction loss and damping of a slide joint, gain and delay beside them."""

    def found(others: Sequence[Measurement], out: Measurement) -> tuple[Prediction, str]:
        from mujoco import sysid  # noqa: PLC0415 - optional

        rolls = {test.source: _Rollout(test) for test in (*others, out)}
        params = sysid.ParameterDict()
        ranges = {"friction": (0.14, 0.01, 1.0), "dashpot": (0.03, 0.0, 0.5)}
        ranges |= {"gain": (1.0, 0.9, 1.1), "delay": (0.0, -0.3, 0.3)} if sensors else {}
        for name, (middle, low, high) in ranges.items():
            params.add(sysid.Parameter(name, middle, low, high))

        def cycle(x: FloatArray, test: Measurement) -> FloatArray:
            friction, zeta, gain, delay = [*x, 1.0, 0.0][:4]
            return rolls[test.source].cycle(friction * _force(test), zeta, gain, delay, test.cycle.tau)

        def residual(x: FloatArray, _params: object) -> tuple[list[FloatArray], None, None]:
            return [test.cycle.mass - cycle(x, test) for test in others], None, None

        best, _ = sysid.optimize(params, residual, optimizer="scipy", verbose=False, diff_step=1e-3)
        x = best.as_vector()
        words = ", ".join(f"{name} {value:.4g}" for name, value in zip(ranges, x, strict=True))
        return (nrmse_of(out.cycle.mass, cycle(x, out)), math.nan), words

    return found


class _Rollout:
    """MuJoCo's steady cycle of the frame, dimensionless: mass r^2, stiffness 1, driven by the measured base."""

    def __init__(self, test: Measurement) -> None:
        import mujoco  # noqa: PLC0415 - optional

        self.r, self.mujoco, step = test.frequency_ratio or math.nan, mujoco, 2.0 * math.pi / STEPS
        xml = MUJOCO.format(step=step, double=2.0 * step, mass=self.r**2)
        self.model, self.tau = mujoco.MjModel.from_xml_string(xml), step * np.arange(STEPS)
        base = base_of(test.cycle, test.base_amplitude_m_se / test.base_amplitude_m)
        rate = np.gradient(base.at(np.arange(-1, STEPS + 1) * step), step)[1:-1]
        self.force = np.tile(base.at(self.tau) + 2.0 * FRAME * self.r * rate, TURNS)

    def cycle(self, beta: float, zeta: float, gain: float, delay: float, tau: FloatArray) -> FloatArray:
        """The last cycle about its mean, at given phases."""
        self.model.dof_frictionloss[0] = beta
        self.model.dof_damping[0] = 2.0 * self.r * (zeta + FRAME)
        data, x = self.mujoco.MjData(self.model), np.empty(len(self.force))
        for i, force in enumerate(self.force):
            x[i] = data.qpos[0]
            data.ctrl[0] = force
            self.mujoco.mj_step(self.model, data)
        last = x[-STEPS:] - x[-STEPS:].mean()
        return np.asarray(gain * np.interp(np.mod(tau - delay, 2.0 * math.pi), self.tau, last, period=2.0 * math.pi))


def _words(law: Law) -> str:
    return f"beta over N {law.friction:.4g}, gradient {law.gradient:+.3g}, dashpot {law.dashpot:.3g}"


def ours(law: str, tests: Sequence[Measurement]) -> dict[str, tuple[Prediction, str]]:
    """This project's campaign: each load as ``left_out.csv`` has it."""
    trials = [trial_of({**test.row(), "warnings": []}) for test in tests]
    observations = {test.source: observe(test, SCENE, law) for test in tests}
    done = evaluate(trials, SCENE, observations=observations)
    words = (
        f"coefficient of all: {done.amontons[0].coefficient:.4g} +- {done.material_laws[0].covariance[0, 0] ** 0.5:.2g}"
    )
    left = {t["source"]: (t["response_nrmse"] or math.nan, t["response_nrmse_own"] or math.nan) for t in done.left_out}
    return {source: (both, words) for source, both in left.items()}


WAYS: Mapping[str, tuple[str | None, Way]] = {
    "plain least squares, Coulomb": (None, plain),
    "inverted force, n(v, z)": (None, inverted),
    "pysindy, STLSQ": ("pysindy", sindy),
    "mujoco.sysid": ("mujoco", mujoco_sysid(sensors=False)),
    "mujoco.sysid, gain, delay": ("mujoco", mujoco_sysid(sensors=True)),
}


def _line(name: str, found: Sequence[tuple[Prediction, str]], seconds: float) -> str:
    """One way as a line: nrmse of each load with nothing taken, then with its own gradient."""
    each = [[100.0 * pair[k] for pair, _ in found] for k in (0, 1)]
    shown = ("".join(f"{v:7.2f}" if math.isfinite(v) else "      -" for v in some) for some in each)
    return f"  {name:29s}{'   '.join(shown)}{seconds:8.1f}  {found[-1][1]}"


def main() -> None:
    """Write the table."""
    tests = []
    for load in LOADS:
        measured = measure(read_log(DATA / f"frame_{load}g.csv"), SCENE)
        tests.append(replace(measured, source=f"{load}g", material="brass", normal_force_n=load * GRAM))
    head = "".join(f"{load:6d}g" for load in LOADS)
    lines = [
        "nrmse % of each load, left out",
        f"  {'':29s}{'nothing taken from it':>21s}   {'its own gradient':>21s}",
        f"  {'':29s}{head}   {head}   CPU s  law (of the last)",
    ]
    for law in ("coulomb", "coulomb+place+speed"):
        begin = time.process_time()
        found = ours(law, tests)
        lines.append(_line(f"frictionlab, {law[8:] or 'coulomb'}", list(found.values()), time.process_time() - begin))
    for name, (package, way) in WAYS.items():
        if package and importlib.util.find_spec(package) is None:
            lines.append(f"  {name:29s} {package} is not installed: left out")
            continue
        begin = time.process_time()
        with contextlib.redirect_stdout(sys.stderr):  # a peer tells its steps
            each = [way([t for t in tests if t is not out], out) for out in tests]
        lines.append(_line(name, each, time.process_time() - begin))
        sys.stdout.write(lines[-1] + "\n")
    study.write("identification_peers", lines)


if __name__ == "__main__":
    main()
