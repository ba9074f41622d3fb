"""The response to a sampled base motion: against slow twins, its own refinement, the steady state."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from frictionlab.errors import SimulationError
from frictionlab.simulator import Base, Problem
from frictionlab.simulator.numeric import integrated as by_steps
from frictionlab.simulator.record import BaseRecord, respond
from tests.simulator.twin import LAWS, Twin, problem_of

CASES = {
    "coulomb": problem_of(1.0, 0.25),
    "no friction": problem_of(1.0, 0.0, contact_damping_ratio=0.1),
    "breakaway by direction": problem_of(1.0, 0.2, static_ratio_up=1.3, static_ratio_down=1.1),
    "place, speed, frame": problem_of(1.0, 0.2, frame_damping_ratio=0.02, gradient=0.1, contact_damping_ratio=0.05),
    "overdamped": problem_of(1.0, 0.1, frame_damping_ratio=0.8, contact_damping_ratio=0.9),
    "moving wall": problem_of(
        *(1.0, 0.2, "base"), gradient=-0.05, static_ratio_up=1.2, static_ratio_down=1.2, frame_damping_ratio=0.03
    ),
    "elastic": problem_of(1.0, 0.2, stiffness_ratio=30.0),
    "elastic, place, breakaway": problem_of(
        *(1.0, 0.2), gradient=0.08, static_ratio_up=1.1, static_ratio_down=1.2, contact_damping_ratio=0.02,
        stiffness_ratio=12.0,
    ),
}  # fmt: skip


def some_base(seed: int, n: int, *, even: bool) -> tuple[np.ndarray, np.ndarray]:
    """A random multisine of four tones, sampled evenly or not."""
    rng = np.random.default_rng(seed)
    tau = 0.35 * np.arange(n) + (0.0 if even else 0.1 * rng.uniform(-1.0, 1.0, n))
    tones = rng.uniform([0.3, 0.2, 0.0], [1.0, 1.6, 2 * np.pi], (4, 3))
    return tau, sum(a * np.sin(w * tau + p) for a, w, p in tones)


@pytest.mark.parametrize(("name", "even"), [("coulomb", True), *((name, False) for name in sorted(CASES))])
def test_it_is_the_slow_twin(name: str, *, even: bool) -> None:
    problem = CASES[name]
    tau, y = some_base(len(name), 60, even=even)
    base = BaseRecord(tau, y)
    v0 = float(base.motion[1, 0]) if problem.wall == "base" else 0.3
    seen, slow = respond(problem, base, x0=0.1, v0=v0), Twin(problem, CubicSpline(tau, base.values))
    _, v = slow.run(tau.tolist(), np.array([0.1, v0]))
    assert seen.displacement == pytest.approx(np.array(slow.states)[:, 0], abs=1e-10)
    assert seen.contact_force == pytest.approx(np.array(slow.forces)[:, 0], abs=1e-9)
    assert seen.path == pytest.approx(slow.path, abs=1e-9)
    assert np.diff(seen.contact_stops[0]).sum() == pytest.approx(slow.stuck, abs=1e-7)
    assert seen.stops == slow.stops
    kappa, spring = problem.parameters.get("stiffness_ratio"), slow.forces[-1][0] - 2 * problem.zeta * v
    stored = 0.5 * spring**2 / kappa if kappa else 0.0
    assert seen.friction_energy == pytest.approx(slow.friction - stored, abs=1e-9)
    assert seen.closure_error < 1e-8


def cosine_record(r: float, cycles: int, points: int) -> BaseRecord:
    tau = np.arange(cycles * points + 1) * (2 * np.pi / r / points)
    return BaseRecord(tau, np.cos(r * tau), rest=0.0)


def test_the_error_falls_with_the_fourth_power_of_the_sampling_interval() -> None:
    def last(points: int) -> np.ndarray:
        return respond(Problem(1.0, 0.4), cosine_record(0.5, 4, points)).displacement[:: points // 25]

    coarse, fine = (float(np.abs(last(points) - last(1600)).max()) for points in (50, 100))
    assert np.log2(coarse / fine) == pytest.approx(4, abs=0.35)


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    beta=st.floats(0.0, 1.0),
    q=st.floats(-0.1, 0.1),
    mu=st.floats(1.0, 1.5),
    stiff=st.one_of(st.none(), st.floats(5.0, 200.0)),
)
def test_a_finer_sampling_of_the_same_curve_changes_nothing(
    seed: int, beta: float, q: float, mu: float, stiff: float | None
) -> None:
    """A cubic spline through its own points is itself: every old sample must be met again, and so must the mirror."""
    tau, y = some_base(seed, 40, even=False)
    fine = np.sort(np.concatenate([tau, tau[:-1] + np.diff(tau) * np.random.default_rng(seed).uniform(0.2, 0.8, 39)]))
    own = {"stiffness_ratio": stiff} if stiff else {}
    law = problem_of(1.0, beta, frame_damping_ratio=0.01, gradient=q, static_ratio_up=mu, **own)
    coarse = respond(law, BaseRecord(tau, y))
    finer = respond(law, BaseRecord(fine, CubicSpline(tau, y)(fine), scale=coarse.base.scale))
    assert finer.displacement[::2] == pytest.approx(coarse.displacement, abs=1e-8)
    assert finer.energy == pytest.approx(coarse.energy, abs=1e-7)
    other = problem_of(1.0, beta, frame_damping_ratio=0.01, gradient=-q, static_ratio_down=mu, **own)
    mirror = respond(other, BaseRecord(tau, -y))
    assert mirror.displacement == pytest.approx(-coarse.displacement, abs=1e-12)


def test_a_base_that_is_held_back_moves_nothing() -> None:
    still = respond(Problem(1.0, 1.2), BaseRecord(*some_base(5, 50, even=True)))
    assert not still.displacement.any()
    assert (still.energy, still.path, still.stops, still.stuck_fraction) == (0.0, 0.0, 0, 1.0)
    assert still.contact_stops[0].tolist() == [[still.time[0], still.time[-1]]]


def test_free_vibration_loses_four_beta_a_cycle() -> None:
    """A base that has stopped: each half turn of friction takes 2 beta off the amplitude (Lorenz)."""
    tau = np.linspace(0.0, 7.0 * np.pi, 421)
    base = BaseRecord(tau, np.where(tau == tau[-1], 1e-12, 0.0), scale=1.0)
    response = respond(Problem(1.0, 0.1), base, x0=1.05)
    turns = response.displacement[::60]
    assert turns[1:6] == pytest.approx([-0.85, 0.65, -0.45, 0.25, -0.05], abs=1e-11)
    assert response.path == pytest.approx(1.9 + 1.5 + 1.1 + 0.7 + 0.3, abs=1e-10)
    assert response.contact_stops[0] == pytest.approx(np.array([[5 * np.pi, 7 * np.pi]]), abs=1e-10)


@pytest.mark.parametrize(
    ("problem", "match"),
    [
        (Problem(0.5, 0.4), "expected 1"),
        (Problem(1.0, 0.4, law="coulomb+place", parameters={"gradient": 3.0}), "faster than the spring"),
        (Problem(1.0, 0.1, law="coulomb+place", parameters={"gradient": 2.0}), "expected 1 [+] gradient z > 0"),
    ],
)
def test_what_cannot_be_simulated_is_refused(problem: Problem, match: str) -> None:
    with pytest.raises(SimulationError, match=match):
        respond(problem, BaseRecord(*some_base(5, 50, even=True)))


@pytest.mark.parametrize(
    ("time", "y", "match"),
    [
        ([0.0], [1.0], "at least 2"),
        ([0.0, 1.0], [1.0, 2.0, 3.0], "one length"),
        ([0.0, 1.0, 1.0], [0.0, 1.0, 2.0], "1.0 then 1.0 at sample 2"),
        ([0.0, 1.0, 2.0], [0.0, np.nan, 2.0], "displacement; expected finite numbers; got nan at sample 1"),
        ([0.0, 1.0, 2.0], [3.0, 3.0, 3.0], "drives nothing"),
    ],
)
def test_what_is_no_motion_is_refused(time: list[float], y: list[float], match: str) -> None:
    with pytest.raises(SimulationError, match=match):
        BaseRecord(time, y)


def test_the_periodic_base_of_a_problem_is_not_used() -> None:
    base = BaseRecord(*some_base(5, 50, even=True))
    plain, other = Problem(1.0, 0.2), Problem(1.0, 0.2, base=Base((0.5, 0.5)))
    np.testing.assert_array_equal(respond(plain, base).displacement, respond(other, base).displacement)


def integrated(law: str, wall: Any = "fixed") -> Problem:
    more = LAWS[law] | {"contact_damping_ratio": 0.02, "gradient": 0.05}
    return Problem(1.0, 0.15, wall=wall, law=f"{law}+speed+place", parameters=more, frame_damping_ratio=0.03)


@pytest.mark.parametrize(
    ("law", "wall"), [*((law, "fixed") for law in LAWS), ("coulomb+stribeck", "base"), ("coulomb+dahl", "base")]
)
def test_an_integrated_law_is_the_slow_twin(law: str, wall: str) -> None:
    problem, base = integrated(law, wall), BaseRecord(*some_base(7, 9, even=False))
    first = (base.values[0], base.motion[1, 0]) if wall == "base" else (0.0, 0.0)
    seen = respond(problem, base, x0=0.1 + first[0], v0=0.3 + first[1])
    slow = Twin(problem, CubicSpline(base.time, base.values))
    slow.run(base.time.tolist(), np.array([0.1 + first[0], 0.3 + first[1]]))
    assert seen.solver == "numeric"
    assert seen.displacement == pytest.approx(np.array(slow.states)[:, 0], abs=1e-8)
    assert seen.velocity == pytest.approx(np.array(slow.states)[:, 1], abs=1e-7)
    assert seen.contact_force[1:] == pytest.approx(np.array(slow.forces)[1:, 0], abs=1e-6)
    assert seen.closure_error < 1e-11


def test_a_contact_that_creeps_has_the_stops_of_the_rigid_one() -> None:
    """Dahl's contact, stiff: as many stops as the rigid contact, nearly as long; its slip is the rigid one's way."""
    base = cosine_record(0.3, 6, 60)
    rigid = respond(Problem(1.0, 0.6), base)
    stiff = respond(Problem(1.0, 0.6, law="coulomb+dahl", parameters={"stiffness_ratio": 3e4}), base)
    assert stiff.stops == rigid.stops
    assert stiff.stuck_fraction == pytest.approx(rigid.stuck_fraction, abs=0.005)
    assert stiff.path == pytest.approx(rigid.path, rel=1e-3)
    assert stiff.friction_energy == pytest.approx(rigid.friction_energy, rel=1e-3)


def test_what_cannot_be_integrated_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    base = BaseRecord(*some_base(5, 20, even=True))
    with pytest.raises(SimulationError, match="friction turns negative"):
        respond(
            Problem(1.0, 0.1, law="coulomb+stribeck+place", parameters=LAWS["coulomb+stribeck"] | {"gradient": 2.0}),
            base,
        )
    monkeypatch.setattr(by_steps, "ALLOWED", 3.0)
    with pytest.raises(SimulationError, match=r"more steps than allowed.* too stiff"):
        respond(Problem(1.0, 0.1, law="coulomb+dahl", parameters={"stiffness_ratio": 1e5}), base)
