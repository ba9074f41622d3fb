"""The frame's real recordings through other ways of identification, all judged by the prediction that follows.

Run: ``python -m tests.benchmarks.identification_peers`` where mujoco[sysid] and pysindy are installed (none is
needed to use or to test this project); the result goes to results/identification_peers.txt. A peer that is absent is
named and left out. Each is given the mean steady cycle, and each law found is simulated anew: the nrmse is that of the
motion, not of the force that a regression fits.
"""

import contextlib
import importlib.util
import math
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement
from frictionlab.inference import compare
from frictionlab.inference.comparison import contact_force
from frictionlab.inference.observations import measured_base, nrmse_of
from frictionlab.logs import read_log
from frictionlab.recording import Recording
from frictionlab.scene import Scene, read_scene
from frictionlab.simulator import Problem, steady_state

FloatArray = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
RESULT = Path(__file__).parent / "results" / "identification_peers.txt"
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
class Found:
    """What a way of identification says: value and standard error by name (0: none given), nrmse of its prediction."""

    law: str
    values: Mapping[str, tuple[float, float]]
    nrmse: float


Way = Callable[[Recording, Measurement, Scene], Found]


def ours(law: str) -> Way:
    """This project, under a law or the one that the recording requires."""

    def found(recording: Recording, _: Measurement, scene: Scene) -> Found:
        said = compare(recording, scene, law=law)
        values = {n: (p["value"], p["u"]) for n, p in said.parameters.items() if p["se"] is not None}
        return Found(said.law, values, said.response_nrmse or math.nan)

    return found


def inverted(_recording: Recording, measurement: Measurement, _scene: Scene) -> Found:
    """A static map n(v, z) by least squares on the force that the equation of motion leaves (as FrictionModels.jl)."""
    v, z, force, kept = _sliding(measurement)
    columns = np.stack([np.sign(v), z * np.sign(v), v], axis=1)[kept]
    values, residual, *_ = np.linalg.lstsq(columns, force[kept], rcond=None)
    spread = math.sqrt(float(residual[0]) / (kept.sum() - 3))
    errors = spread * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    return _of_map(measurement, values, errors)


def sindy(_recording: Recording, measurement: Measurement, _scene: Scene) -> Found:
    """The same force by sparse regression (pysindy's STLSQ) on a library of seven terms."""
    import pysindy  # noqa: PLC0415 - optional

    v, z, force, kept = _sliding(measurement)
    side = np.sign(v)
    columns = np.stack([side, z * side, v, z, v**3, z * v, np.ones_like(v)], axis=1)[kept]
    sparse = pysindy.STLSQ(threshold=0.01, alpha=1e-6).fit(columns, force[kept][:, None])
    values = np.ravel(sparse.coef_)
    found = _of_map(measurement, values[:3], np.zeros(3))
    more = dict(zip(("z", "v^3", "z v", "1"), ((float(c), 0.0) for c in values[3:] if c), strict=False))
    return Found(found.law, {**found.values, **more}, found.nrmse)


def _sliding(measurement: Measurement) -> tuple[FloatArray, FloatArray, FloatArray, NDArray[np.bool_]]:
    v, z = measurement.cycle.mass_velocity, measurement.cycle.mass_smooth
    rig = Problem(
        measurement.frequency_ratio or math.nan, 0.3, base=measured_base(measurement), frame_damping_ratio=FRAME
    )
    return v, z, contact_force(measurement, rig), np.abs(v) > SLIDES * np.abs(v).max()


def _of_map(measurement: Measurement, values: FloatArray, errors: FloatArray) -> Found:
    """A law of place and speed from its force's coefficients; what makes no sense there is held at zero."""
    r, (side, place, speed) = measurement.frequency_ratio or math.nan, (float(value) for value in values)
    own = {"gradient": place / side, "contact_damping_ratio": max(speed, 0.0) / (2.0 * r)}
    problem = Problem(r, side, law="coulomb+place+speed", parameters=own, frame_damping_ratio=FRAME)
    orbit, tau = steady_state(problem).orbit, measurement.cycle.tau
    missed = math.nan if orbit is None else nrmse_of(measurement.cycle.mass, orbit.at(tau)[0])
    scale = np.abs([1.0, 1.0 / side, 1.0 / (2.0 * r)]) * errors
    told = zip(("beta", "gradient", "contact_damping_ratio"), (side, *own.values()), scale, strict=True)
    return Found("coulomb+place+speed", {n: (value, float(error)) for n, value, error in told}, missed)


def mujoco_sysid(*, sensors: bool) -> Way:
    """MuJoCo's joint least squares: friction loss and damping of a slide joint, gain and delay beside them."""

    def found(_recording: Recording, measurement: Measurement, _scene: Scene) -> Found:
        from mujoco import sysid  # noqa: PLC0415 - optional

        roll, cycle = _Rollout(measurement.frequency_ratio or math.nan), measurement.cycle
        params = sysid.ParameterDict()
        ranges = {"beta": (0.4, 0.01, 2.0), "contact_damping_ratio": (0.03, 0.0, 0.5)}
        ranges |= {"gain": (1.0, 0.9, 1.1), "delay": (0.0, -0.3, 0.3)} if sensors else {}
        for name, (middle, low, high) in ranges.items():
            params.add(sysid.Parameter(name, middle, low, high))

        def residual(x: FloatArray, _params: object) -> tuple[list[FloatArray], None, None]:
            beta, zeta, gain, delay = [*x, 1.0, 0.0][:4]
            return [cycle.mass - roll.cycle(beta, zeta, gain, delay, cycle.tau)], None, None

        best, result = sysid.optimize(params, residual, optimizer="scipy", verbose=False, diff_step=1e-3)
        x = best.as_vector()
        left = residual(x, None)[0]
        _, reach = sysid.calculate_intervals(left, result.jac)
        values = {n: (float(v), float(h) / 1.96) for n, v, h in zip(ranges, x, reach, strict=True)}
        return Found("friction loss + damping", values, float(np.std(left[0]) / np.std(cycle.mass)))

    return found


class _Rollout:
    """MuJoCo's steady cycle of the frame, dimensionless: mass r^2, stiffness 1."""

    def __init__(self, r: float) -> None:
        import mujoco  # noqa: PLC0415 - optional

        self.r, self.mujoco, step = r, mujoco, 2.0 * math.pi / STEPS
        self.model = mujoco.MjModel.from_xml_string(MUJOCO.format(step=step, double=2.0 * step, mass=r * r))
        tau = step * np.arange(TURNS * STEPS)
        self.force = np.cos(tau) - 2.0 * FRAME * r * np.sin(tau)

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
        grid = 2.0 * math.pi * np.arange(STEPS) / STEPS
        return np.asarray(gain * np.interp(np.mod(tau - delay, 2.0 * math.pi), grid, last, period=2.0 * math.pi))


WAYS: Mapping[str, tuple[str | None, Way]] = {
    "frictionlab, coulomb": (None, ours("coulomb")),
    "frictionlab, auto": (None, ours("auto")),
    "inverted force, n(v, z)": (None, inverted),
    "pysindy, STLSQ": ("pysindy", sindy),
    "mujoco.sysid": ("mujoco", mujoco_sysid(sensors=False)),
    "mujoco.sysid, gain, delay": ("mujoco", mujoco_sysid(sensors=True)),
}


def line_of(name: str, found: Found, seconds: float) -> str:
    """One way as a line."""
    told = (f"{n} {value:.4g}" + (f" ({error:.2g})" if error else "") for n, (value, error) in found.values.items())
    return f"  {name:27s}{100 * found.nrmse:7.2f}{seconds:8.2f}  {found.law}: {', '.join(told)}"


def main() -> None:
    """Write the table."""
    scene = read_scene(ROOT / "configs" / "frame.toml")
    lines = [f"  {'':27s}{'nrmse %':>7s}{'CPU s':>8s}  law: value (standard error; none where none is given)"]
    for log in ("frame_250g.csv", "frame_450g.csv"):
        recording = read_log(DATA / log)
        measurement = measure(recording, scene)
        lines.append(log)
        for name, (package, way) in WAYS.items():
            if package and importlib.util.find_spec(package) is None:
                lines.append(f"  {name:27s} {package} is not installed: left out")
                continue
            with contextlib.redirect_stdout(sys.stderr):  # a peer tells its steps
                way(recording, measurement, scene)  # loads and compiles
                begin = time.process_time()
                found = way(recording, measurement, scene)
            lines.append(line_of(name, found, time.process_time() - begin))
            sys.stdout.write(lines[-1] + "\n")
    RESULT.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
