"""The tests of a virtual rig: what each of them is, all numbers known."""

import math
import zlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from frictionlab.errors import ParameterError, SceneError
from frictionlab.files import as_disks_see
from frictionlab.scene import Scene, VirtualTests
from frictionlab.scene.physical import structure_of, to_physical
from frictionlab.simulator import Problem, Structure
from frictionlab.simulator.laws import law_of

MOST_SAMPLES = 20_000_000  # of a log, written from memory: some 4 GB


@dataclass(frozen=True)
class SyntheticTest:
    """One test of the virtual rig, all numbers known.

    ``group``: its table of ``[[synthetic.tests]]``, which says how its friction behaves; ``friction_ratio`` (beta),
    ``frequency_ratio`` (r), ``damping_ratio`` (the frame's own) and the law's ``parameters`` dimensionless; ``frame``:
    of several masses or contacts.
    """

    log: str
    group: VirtualTests
    normal_force_n: float
    frequency_ratio: float
    friction_ratio: float
    natural_frequency_hz: float
    base_amplitude_m: float
    stiffness_n_per_m: float
    static_ratio: float
    damping_ratio: float
    wall: Literal["fixed", "base"]
    law: str
    parameters: Mapping[str, float]
    duration_s: float
    frame: Structure | None

    @property
    def drive_frequency_hz(self) -> float:
        """Frequency of the base in Hz, eq. (2.7)."""
        return self.frequency_ratio * self.natural_frequency_hz

    @property
    def cycles(self) -> int:
        """Cycles that are begun, one at least."""
        return max(1, math.ceil(self.duration_s * self.drive_frequency_hz))

    @property
    def is_plain_coulomb(self) -> bool:
        """Whether the friction force is the same in every cycle."""
        group = self.group
        return not (group.friction_drift_per_hour or group.friction_scatter) and group.jump_s is None

    def draws(self, scene: Scene, purpose: str) -> np.random.Generator:
        """A stream of random numbers of its own for each test and purpose: adding a test changes no other."""
        return np.random.default_rng([scene.synthetic.seed, zlib.crc32(f"{self.log}/{purpose}".encode())])

    def problem(self, friction_ratio: float | None = None) -> Problem:
        """The dimensionless problem (eq. 2.9) of this test, or of it with another friction ratio."""
        beta = self.friction_ratio if friction_ratio is None else friction_ratio
        return Problem(
            self.frequency_ratio,
            beta,
            mu=self.static_ratio,
            wall=self.wall,
            law=self.law,
            parameters=self.parameters,
            frame_damping_ratio=self.damping_ratio,
        )


def virtual_tests(scene: Scene) -> tuple[SyntheticTest, ...]:
    """All tests that a scene's ``[[synthetic.tests]]`` asks for, in its order; SceneError if one cannot be."""
    rig, synthetic = scene.rig, scene.synthetic
    if not synthetic.tests:
        raise SceneError("synthetic.tests: expected at least one [[synthetic.tests]] table; got none")
    if rig.natural_frequency is None or rig.stiffness is None:
        two = "natural_frequency_hz, mass_kg, stiffness_n_per_m"
        raise SceneError(f"rig: a virtual rig needs natural frequency and stiffness: give two of {two}")
    if not 0.0 < rig.stiffness * synthetic.base_amplitude_m < math.inf:
        got = f"got {synthetic.base_amplitude_m:g} m, times {rig.stiffness:g} N/m"
        raise SceneError(f"synthetic.base_amplitude_m: expected an amplitude that makes a finite force; {got}")
    tests = []
    for number, group in enumerate(synthetic.tests):
        law = group.law or ("coulomb" if scene.model.law == "auto" else scene.model.law)
        _check_group(scene, group, law, f"synthetic.tests.{number}")
        for force, ratio in product(group.normal_forces_n, group.frequency_ratios):
            tests.append(_virtual_test(scene, group, law, force, ratio))
            _check_test(tests[-1], f"synthetic.tests.{number}")
    many = Counter(as_disks_see(test.log) for test in tests)
    twice = sorted({test.log for test in tests if many[as_disks_see(test.log)] > 1})
    if twice:
        raise SceneError(f"synthetic.tests: the same test stands twice: {', '.join(twice)}; leave one out")
    return tuple(tests)


def _check_group(scene: Scene, group: VirtualTests, law: str, place: str) -> None:
    """Refuse physical parameters that its law lacks, and a log that no memory holds."""
    for name in group.physical:
        try:
            law_of(law).parameter(name)
        except ParameterError as error:
            raise SceneError(f"{place}.physical: {error}") from error
    duration_s, rate = group.duration_s or scene.synthetic.duration_s, scene.synthetic.sampling_rate_hz
    if duration_s * rate > MOST_SAMPLES:
        got = f"{duration_s:g} s at {rate:g} Hz are {duration_s * rate:.3g} samples: expected at most {MOST_SAMPLES}"
        raise SceneError(f"{place}: {got}: shorten duration_s, or lower sampling_rate_hz")


def _virtual_test(scene: Scene, group: VirtualTests, law: str, force: float, ratio: float) -> SyntheticTest:
    rig, model, synthetic = scene.rig, scene.model, scene.synthetic
    stiffness, natural, amplitude = rig.stiffness or 0.0, rig.natural_frequency or 0.0, synthetic.base_amplitude_m
    beta = group.friction_coefficient * force / (stiffness * amplitude)
    # a friction ratio fixed in [model.parameters] is for fits: a virtual contact has its friction coefficient
    fixed = {} if group.law else {name: value for name, value in model.parameters.items() if name != "beta"}
    parameters = fixed | group.parameters
    for name, value in group.physical.items():  # over the test's own Y and omega
        turn = 2.0 * math.pi * ratio * natural
        factor, _ = to_physical(law_of(law).parameter(name), stiffness, natural, amplitude=amplitude, turn=turn)
        parameters[name] = value / (factor or 1.0)
    named = [group.material, f"N{force:g}", f"r{ratio:g}", *([group.label] if group.label else [])]
    return SyntheticTest(
        log="_".join(named) + ".csv",
        group=group,
        normal_force_n=force,
        frequency_ratio=ratio,
        friction_ratio=beta,
        natural_frequency_hz=natural,
        base_amplitude_m=amplitude,
        stiffness_n_per_m=stiffness,
        static_ratio=model.static_ratio,
        damping_ratio=scene.frame_damping_ratio,
        wall=model.wall,
        law=law,
        parameters=parameters,
        duration_s=group.duration_s or synthetic.duration_s,
        frame=structure_of(scene, ratio, amplitude, beta=beta) if scene.rig.masses or scene.rig.contacts else None,
    )


def _check_test(test: SyntheticTest, place: str) -> None:
    """Refuse a law that cannot be, friction that cannot change as it is said to, and what a frame of several cannot."""
    group = test.group
    if test.frame is not None:
        own = group.law or group.parameters or group.physical
        asked = {
            "law, parameters or physical (they stand in [[rig.contacts]])": own,
            "friction that drifts, scatters or jumps": not test.is_plain_coulomb,
        }
        for what in (what for what, is_asked in asked.items() if is_asked):
            raise SceneError(f"{place}: a frame with [[rig.masses]] or [[rig.contacts]]; got {what}: leave it out")
        return
    place = f"{place}.{'law' if group.law else 'parameters'}" if group.law or group.parameters else "model.law"
    try:
        law = test.problem().law
    except ParameterError as error:
        raise SceneError(f"{place}: {error}") from error
    if law.kind in ("elastic", "inner") and not test.is_plain_coulomb:
        what = f"law {law.name} remembers more than where the mass is"
        raise SceneError(f"{place}: {what}: expected a law without memory, or friction that stays the same")
