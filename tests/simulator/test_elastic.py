"""Elastic contacts: 50 digits, the slow twin, the rigid limit, energies, what never slips, and honest refusals."""

import json
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mpf

from frictionlab.errors import SimulationError
from frictionlab.simulator import Base, Problem, last_cycle, simulate, steady_state
from frictionlab.simulator.exact.solve import iwan_sliders
from tests.desk import present
from tests.simulator import elastic_twin

TURN = 2.0 * pi
REFERENCE = json.loads((Path(__file__).parent / "reference" / "elastic_reference.json").read_text())


def jenkins(r: float, beta: float, kappa: float, terms: str = "", **more: Any) -> Problem:
    parameters = {"stiffness_ratio": kappa} | more.pop("parameters", {})
    return Problem(r, beta, law="coulomb+compliance" + terms, parameters=parameters, **more)


def iwan(r: float, beta: float, kappa: float, sliders: int, chi: float, terms: str = "", **more: Any) -> Problem:
    parameters = {"stiffness_ratio": kappa, "sliders": sliders, "chi": chi} | more.pop("parameters", {})
    return Problem(r, beta, law="coulomb+iwan" + terms, parameters=parameters, **more)


def of_reference(row: dict[str, Any]) -> Problem:
    keys = {"up": "static_ratio_up", "down": "static_ratio_down", "q": "gradient", "zeta_c": "contact_damping_ratio"}
    names = {"up": "breakaway", "q": "place", "zeta_c": "speed"}
    terms = "".join(f"+{term}" for key, term in names.items() if key in row)
    parameters = {name: row[key] for key, name in keys.items() if key in row}
    parameters["frame_damping_ratio"] = row.get("zeta_f", 0.0)
    base = Base(tuple(row.get("cosine", (1.0,))), tuple(row.get("sine", (0.0,))))
    more = {"parameters": parameters, "base": base, "wall": row.get("wall", "fixed")}
    if "sliders" in row:
        return iwan(row["r"], row["beta"], row["kappa"], row["sliders"], row["chi"], terms, **more)
    return jenkins(row["r"], row["beta"], row["kappa"], terms, **more)


def error(value: float | None, truth: str) -> float:
    assert value is not None
    return float(abs(value / mpf(truth) - 1))


@pytest.mark.parametrize("row", REFERENCE, ids=lambda row: row["why"])
def test_agrees_with_fifty_digits_at_hard_points(row: dict[str, Any]) -> None:
    state = steady_state(of_reference(row))
    few = (
        1e-9 if "critically" in row["why"] else 1e-11 if row["kappa"] >= 1e9 else 1e-12
    )  # two rates that are one are parted by 1e-10 of zeta
    assert error(state.energy_taken, row["energy_per_cycle"]) < few
    assert row["response_amplitude"] is None or error(state.response_amplitude, row["response_amplitude"]) < few
    assert error(state.stuck_fraction, row["stuck_fraction"]) < (1e-7 if row["kappa"] >= 1e9 else max(1e-10, few))
    assert state.stops_per_cycle == row["stops_per_cycle"]
    assert present(state.closure_error) < max(1e-11, few) * present(state.energy_per_cycle)


def drawn(seed: int) -> Problem:
    """Every term, five harmonics, either wall, a damped frame; one slider or three."""
    rng = np.random.default_rng(seed)
    base = Base((1.0, *map(float, rng.uniform(-0.3, 0.3, 4))), tuple(map(float, rng.uniform(-0.3, 0.3, 5))))
    kind, wall = ("compliance", "iwan")[seed % 2], ("fixed", "base")[seed // 2 % 2]
    r, beta = float(rng.uniform(0.3, 1.5)), float(rng.uniform(0.2, 0.7))
    given = {"stiffness_ratio": float(rng.uniform(5.0, 100.0)), "gradient": float(rng.uniform(-0.15, 0.15))}
    given |= {"contact_damping_ratio": float(rng.uniform(0.0, 0.1))}
    given |= {f"static_ratio_{way}": float(rng.uniform(1.0, 1.4)) for way in ("up", "down")}
    given |= {"sliders": 3.0, "chi": float(rng.uniform(-0.8, 0.0))} if kind == "iwan" else {}
    law = f"coulomb+{kind}+place+speed+breakaway"
    size = r * r if wall == "base" else 1.0
    frame = float(rng.uniform(0.0, 0.1))
    return Problem(r, beta * size, wall=wall, base=base, law=law, parameters=given, frame_damping_ratio=frame)  # type: ignore[arg-type]  # one of two words


@pytest.mark.parametrize(
    "problem",
    [
        jenkins(0.5, 0.4, 100.0),
        jenkins(0.3, 0.6, 300.0),
        jenkins(0.4, 0.5, 50.0, mu=1.4),
        jenkins(
            *(0.4, 0.4, 50.0, "+place+speed"),
            parameters={"gradient": 0.2, "contact_damping_ratio": 0.1},
            frame_damping_ratio=0.03,
            base=Base((1.0, 0.2), (0.0, 0.1)),
        ),
        jenkins(0.4, 0.5, 0.3, "+place", parameters={"gradient": 0.5}),  # gives way along the limit that sinks
        iwan(0.6, 0.3, 20.0, 6, -0.5),
        iwan(
            *(0.6, 0.3, 20.0, 4, 0.0, "+breakaway+place"),
            parameters={"static_ratio_up": 1.2, "static_ratio_down": 1.1, "gradient": -0.1},
            wall="base",
        ),
        *map(drawn, range(4)),
    ],
    ids=lambda problem: problem.law.name,
)
def test_two_cycles_from_rest_agree_with_the_slow_twin(problem: Problem) -> None:
    slow = elastic_twin.run(problem, 4 * pi)
    moved = float(problem.base.at(0.0)), float(problem.base.rate_at(0.0))
    x0, v0 = moved if problem.wall == "base" else (0.0, 0.0)
    fast = simulate(problem, cycles=2, x0=x0, v0=v0)
    x, v = fast.at(fast.end)
    assert float(x) - x0 == pytest.approx(slow.z, abs=1e-10)
    assert float(v) - v0 == pytest.approx(slow.v, abs=1e-10)
    spring = float(fast.force(fast.end)) - 2 * problem.zeta * problem.r * slow.v
    assert spring == pytest.approx(slow.force, abs=1e-10)
    assert float(np.diff(fast.stops).sum()) == pytest.approx(slow.held, abs=1e-9)


@settings(max_examples=15, deadline=None)
@given(
    r=st.floats(0.1, 3.0),
    beta=st.floats(0.02, 0.9),
    kappa=st.floats(0.1, 300.0),
    zeta=st.floats(0.0, 1.5),
    frame=st.floats(0.0, 0.2),
    gradient=st.floats(-0.1, 0.1),
    even=st.sampled_from([0.0, 0.1]),
    sliders=st.sampled_from([0, 1, 4]),
    wall=st.sampled_from(["fixed", "base"]),
)
def test_energies_close_and_the_orbit_repeats(
    r: float,
    beta: float,
    kappa: float,
    zeta: float,
    frame: float,
    gradient: float,
    even: float,
    sliders: int,
    wall: Any,
) -> None:
    more: dict[str, Any] = {"zeta": zeta + 0.01, "frame_damping_ratio": frame, "wall": wall, "base": Base((1.0, even))}
    more |= {"parameters": {"gradient": gradient}}
    law = "+place"
    problem = iwan(r, beta, kappa, sliders, -0.4, law, **more) if sliders else jenkins(r, beta, kappa, law, **more)
    state = steady_state(problem)
    if state.outcome == "not found":
        assert "gradient" in state.warnings[0]
        return
    assert state.outcome in ("periodic", "stuck")
    assert state.orbit is not None
    assert present(state.closure_error) < 1e-11 * present(state.energy_per_cycle) + 1e-13
    ends = state.orbit.at([state.orbit.start, state.orbit.start + 2 * pi * (1 - 1e-15)])
    size = 1e-9 * (1.0 + abs(state.response_amplitude or 0.0))
    np.testing.assert_allclose(ends[0][0], ends[0][1], atol=size)


@given(count=st.integers(1, 200), chi=st.floats(-0.99, 0.0), kappa=st.floats(1e-3, 1e9), beta=st.floats(1e-3, 2.0))
def test_iwans_sliders_have_the_whole_stiffness_and_strength(count: int, chi: float, kappa: float, beta: float) -> None:
    stiffness, strength = iwan_sliders(kappa, beta, count, chi)
    assert sum(stiffness) == pytest.approx(kappa, rel=1e-12)
    assert sum(strength) == pytest.approx(beta, rel=1e-12)
    lengths = np.array(strength) / np.array(stiffness)
    assert np.all(np.diff(lengths) > 0.0)
    assert lengths[-1] <= beta * (chi + 2) / (kappa * (chi + 1)) * (1 + 1e-12)


@pytest.mark.parametrize("chi", [0.0, -0.5, -0.9])
def test_more_sliders_come_to_the_backbone_of_the_distribution_as_one_over_n_squared(chi: float) -> None:
    top = (chi + 2) / (chi + 1)  # phi_max for kappa = beta = 1
    x = np.linspace(0.0, top, 4001)
    held = (chi + 2) / (chi + 1) * (x / top) - (x / top) ** (chi + 2) / (chi + 1)  # integral of min(x, phi) over phi
    off = []
    for count in (10, 40):
        stiffness, strength = iwan_sliders(1.0, 1.0, count, chi)
        steps = [np.minimum(k * x, b) for k, b in zip(stiffness, strength, strict=True)]
        off.append(np.abs(np.sum(steps, axis=0) - held).max())
    assert off[0] == pytest.approx(0.5 / (chi + 2) / 10**2, rel=0.6)  # a first piece from phi = 0 errs by more
    assert off[1] == pytest.approx(0.5 / (chi + 2) / 40**2, rel=0.15)


@pytest.mark.parametrize(
    ("r", "kappa", "limit"), [(0.5, 1.0, 1 / 1.75), (2.0, 0.5, 0.5 / 2.5), (0.5, 1e3, 1e3 / 1000.75)]
)
def test_a_contact_that_is_strong_enough_never_slips(r: float, kappa: float, limit: float) -> None:
    # held, n = kappa cos(tau) / (1 + kappa - r^2)
    state = steady_state(jenkins(r, limit * (1 + 1e-6), kappa))
    assert state.outcome == "stuck"
    assert state.response_amplitude == pytest.approx(1.0 / abs(1 + kappa - r * r), rel=1e-12)
    assert state.energy_per_cycle == pytest.approx(0.0, abs=1e-12)
    assert state.stuck_fraction == 1.0
    assert "never slips" in state.verdict  # the mass moves as far as the contact yields
    assert state.floquet_multiplier == pytest.approx(1.0, abs=1e-9)  # nothing damps it
    assert steady_state(jenkins(r, limit * (1 - 1e-5), kappa)).outcome == "periodic"


def test_a_held_contact_with_a_residual_force_need_not_slip_under_an_uneven_drive() -> None:
    base = Base((1.0, 0.4))  # the held force has crests of 1.34 and troughs of -0.68
    state = steady_state(jenkins(0.3, 1.1, 20.0, base=base))
    assert state.outcome == "stuck"
    tau = np.linspace(0.0, 2 * pi, 400)
    pull = present(state.orbit).force(tau)
    assert np.abs(pull).max() <= 1.1 * (1.0 + 1e-9)  # with any residual force that it can hold


def test_at_the_held_contacts_resonance_it_slips_and_stays_bounded() -> None:
    state = steady_state(jenkins(sqrt(1 + 100.0), 0.3, 100.0))
    assert state.outcome == "periodic"
    assert (state.energy_per_cycle or 0.0) > 0.0


def test_at_the_slipping_masss_resonance_it_grows_without_bound() -> None:
    assert steady_state(jenkins(1.0, 0.7, 50.0)).outcome == "unbounded"
    assert steady_state(jenkins(1.0, 0.9, 50.0)).outcome == "periodic"


def test_a_gradient_that_makes_friction_a_pull_is_refused_by_name() -> None:
    steep = jenkins(0.9, 0.3, 50.0, "+place", parameters={"gradient": 1.5})
    assert "gradient" in steady_state(steep).warnings[0]
    with pytest.raises(SimulationError, match=r"gradient; expected 1 . gradient z > 0"):
        simulate(steep, cycles=5)
    runaway = jenkins(0.9, 0.3, 50.0, "+place", parameters={"gradient": 4.0})
    assert "runs away" in steady_state(runaway).warnings[0]
    with pytest.raises(SimulationError, match=r"beta \|gradient\| < 1"):
        simulate(runaway, cycles=1)


def test_a_slider_too_weak_to_be_relaxed_at_the_section_is_not_forced_to_be() -> None:
    # it was put at its limit instead, half cycle after half cycle, and the search never ended
    problem = iwan(0.08504522830857346, 1.0855186333106606, 92.32785908315341, 2, -0.6933537117352948)
    problem = problem.with_parameters({"frame_damping_ratio": 0.035855970757566274})
    state, late = steady_state(problem), last_cycle(problem, cycles=40)
    assert state.outcome == late.outcome == "periodic"
    assert state.energy_per_cycle == pytest.approx(late.energy_per_cycle, rel=1e-8)


@pytest.mark.parametrize(
    "problem",
    [
        Problem(
            0.3569030607078718,
            0.13358106257405972,
            law="coulomb+iwan",
            parameters={"stiffness_ratio": 13.927174899438791, "sliders": 5.0, "chi": -0.08327430956159687},
        ),
        Problem(
            0.5011922540640246,
            0.0612888329833582,
            law="coulomb+iwan+place",
            parameters={
                "stiffness_ratio": 22.523110916949356,
                "sliders": 6.0,
                "chi": -0.2683429033506971,
                "gradient": 0.0964722648370136,
            },
        ),
    ],
)
def test_sliders_that_give_way_at_once_do_not_begin_a_cycle(problem: Problem) -> None:
    """The orbit at each phase is the motion from rest; a phase of no length was taken for the begin of a cycle."""
    orbit, late = steady_state(problem).orbit, simulate(problem, cycles=60, keep=1)
    assert orbit is not None
    tau = np.linspace(0.0, 2.0 * pi, 40, endpoint=False)
    assert orbit.end - orbit.start == pytest.approx(2.0 * pi, abs=1e-12)
    assert np.abs(np.subtract(orbit.at(tau), late.at(late.start + tau))).max() < 1e-11
    assert np.abs(orbit.force(tau) - late.force(late.start + tau)).max() < 1e-11
