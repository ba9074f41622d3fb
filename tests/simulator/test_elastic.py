"""Elastic contacts: the slow twin, where rest settles, what never slips, work of a search, and honest refusals."""

import re
from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab.errors import SimulationError
from frictionlab.simulator import Base, Problem, last_cycle, simulate, steady_state
from frictionlab.simulator.exact.solve import Flow, iwan_sliders
from tests.desk import present
from tests.simulator.phases import settles_on
from tests.simulator.twin import TURN, Twin, problem_of

UP_DOWN = {"static_ratio_up": 1.3, "static_ratio_down": 1.2}


def drawn(seed: int) -> Problem:
    """Every term, five harmonics, either wall, a damped frame; one slider or three."""
    rng = np.random.default_rng(seed)
    base = Base((1.0, *map(float, rng.uniform(-0.3, 0.3, 4))), tuple(map(float, rng.uniform(-0.3, 0.3, 5))))
    moves, r, beta = seed // 2 % 2 == 1, float(rng.uniform(0.3, 1.5)), float(rng.uniform(0.2, 0.7))
    given = {"stiffness_ratio": float(rng.uniform(5.0, 100.0)), "gradient": float(rng.uniform(-0.15, 0.15))}
    given |= {"contact_damping_ratio": float(rng.uniform(0.0, 0.1))}
    given |= {f"static_ratio_{way}": float(rng.uniform(1.0, 1.4)) for way in ("up", "down")}
    given |= {"sliders": 3.0, "chi": float(rng.uniform(-0.8, 0.0))} if seed % 2 else {}
    given |= {"frame_damping_ratio": float(rng.uniform(0.0, 0.1))}
    return problem_of(r, beta * (r * r if moves else 1.0), "base" if moves else "fixed", base, **given)


@pytest.mark.parametrize(
    "problem",
    [
        problem_of(0.5, 0.4, stiffness_ratio=100.0),
        problem_of(0.3, 0.6, stiffness_ratio=300.0),
        problem_of(0.4, 0.5, stiffness_ratio=50.0, static_ratio_up=1.4, static_ratio_down=1.4),
        problem_of(
            *(0.4, 0.4, "fixed", Base((1.0, 0.2), (0.0, 0.1))),
            stiffness_ratio=50.0,
            gradient=0.2,
            contact_damping_ratio=0.1,
            frame_damping_ratio=0.03,
        ),
        problem_of(0.4, 0.5, stiffness_ratio=0.3, gradient=0.5),  # gives way along the limit that sinks
        problem_of(0.6, 0.3, stiffness_ratio=20.0, sliders=6, chi=-0.5),
        problem_of(0.6, 0.3, "base", stiffness_ratio=20.0, sliders=4, chi=0.0, gradient=-0.1, **UP_DOWN),
        *map(drawn, range(4)),
    ],
    ids=lambda problem: problem.law.name,
)
def test_two_cycles_from_rest_agree_with_the_slow_twin(problem: Problem) -> None:
    moved = float(problem.base.at(0.0)), float(problem.base.rate_at(0.0))
    x0, v0 = moved if problem.wall == "base" else (0.0, 0.0)
    fast, twin = simulate(problem, cycles=2, x0=x0, v0=v0), Twin(problem)
    assert np.array(fast.at(fast.end)) == pytest.approx(twin.run([0.0, 2.0 * TURN], np.array([x0, v0])), abs=1e-10)
    assert float(fast.force(fast.end)) == pytest.approx(twin.forces[-1][0], abs=1e-10)
    assert float(np.diff(fast.stops).sum()) == pytest.approx(twin.stuck, abs=1e-9)


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
    state = steady_state(problem_of(r, limit * (1 + 1e-6), stiffness_ratio=kappa))
    assert state.outcome == "stuck"
    assert state.response_amplitude == pytest.approx(1.0 / abs(1 + kappa - r * r), rel=1e-12)
    assert state.energy_per_cycle == pytest.approx(0.0, abs=1e-12)
    assert state.stuck_fraction == 1.0
    assert "never slips" in state.verdict  # the mass moves as far as the contact yields
    assert state.floquet_multiplier == pytest.approx(1.0, abs=1e-9)  # nothing damps it
    assert steady_state(problem_of(r, limit * (1 - 1e-5), stiffness_ratio=kappa)).outcome == "periodic"


def test_a_held_contact_with_a_residual_force_need_not_slip_under_an_uneven_drive() -> None:
    base = Base((1.0, 0.4))  # the held force has crests of 1.34 and troughs of -0.68
    state = steady_state(problem_of(0.3, 1.1, "fixed", base, stiffness_ratio=20.0))
    assert state.outcome == "stuck"
    tau = np.linspace(0.0, 2 * pi, 400)
    pull = present(state.orbit).force(tau)
    assert np.abs(pull).max() <= 1.1 * (1.0 + 1e-9)  # with any residual force that it can hold


def test_motion_is_bounded_at_the_held_contacts_resonance_and_grows_at_the_slipping_masss() -> None:
    held = steady_state(problem_of(sqrt(1 + 100.0), 0.3, stiffness_ratio=100.0))
    assert held.outcome == "periodic"
    assert (held.energy_per_cycle or 0.0) > 0.0
    weak, strong = (steady_state(problem_of(1.0, beta, stiffness_ratio=50.0)) for beta in (0.7, 0.9))
    assert (weak.outcome, strong.outcome) == ("unbounded", "periodic")


def test_a_gradient_that_makes_friction_a_pull_is_refused_by_name() -> None:
    steep = problem_of(0.9, 0.3, stiffness_ratio=50.0, gradient=1.5)
    assert "gradient" in steady_state(steep).warnings[0]
    with pytest.raises(SimulationError, match=r"gradient; expected 1 . gradient z > 0"):
        simulate(steep, cycles=5)
    runaway = problem_of(0.9, 0.3, stiffness_ratio=50.0, gradient=4.0)
    assert "runs away" in steady_state(runaway).warnings[0]
    with pytest.raises(SimulationError, match=r"beta \|gradient\| < 1"):
        simulate(runaway, cycles=1)


HARDLY = {"stiffness_ratio": 7232.497, "frame_damping_ratio": 0.0899809}
FORCED = Base((1.0, -0.05245721561649713), (0.0, 0.0, 0.061263856394369154))
SEARCHES = [  # problem, looks at a phase: of cycles, phases of each, looks at each, harmonics
    (
        problem_of(0.6, 0.4, "fixed", Base((1.0, 0.1)), stiffness_ratio=10.0, sliders=sliders, chi=-0.3, **own),
        12 * (4 + 2 * sliders) * looks * 2,
    )
    for looks, own, counts in ((5, {}, (1, 4, 12)), (14, UP_DOWN, (1, 6)))  # with break-away rest is followed too
    for sliders in counts
]
# it took 110,000: started elsewhere, its vibration dies out by what little slips
SEARCHES += [(problem_of(1.489346183764216, 1.0520595440064922, "fixed", FORCED, **HARDLY), 40_000)]


@pytest.mark.parametrize(("problem", "looks"), SEARCHES, ids=str)
def test_a_search_takes_a_handful_of_cycles(problem: Problem, looks: int) -> None:
    assert Flow(problem).solved().spent < looks


def test_a_slider_too_weak_to_be_relaxed_at_the_section_is_not_forced_to_be() -> None:
    # it was put at its limit instead, half cycle after half cycle, and the search never ended
    numbers = {"stiffness_ratio": 92.32785908315341, "sliders": 2, "chi": -0.6933537117352948}
    problem = problem_of(0.08504522830857346, 1.0855186333106606, **numbers, frame_damping_ratio=0.035855970757566274)
    state, late = steady_state(problem), last_cycle(problem, cycles=40)
    assert state.outcome == late.outcome == "periodic"
    assert state.energy_per_cycle == pytest.approx(late.energy_per_cycle, rel=1e-8)


SETTLING = """
sliders that give way at once do not begin a cycle: a phase of no length was taken for the begin of one
    0.3569030607078718 0.13358106257405972 fixed, 0.0 60 1, stiffness_ratio=13.927174899438791 sliders=5
    chi=-0.08327430956159687
nor do they along a path
    0.5011922540640246 0.0612888329833582 fixed, 0.0 60 1, stiffness_ratio=22.523110916949356 sliders=6
    chi=-0.2683429033506971 gradient=0.0964722648370136
with a gradient what never slips holds what rest leaves: Newton's orbit has a slider that only just touches its limit
    1.322143446588725 1.1493546184824242 fixed, 0.0 150 1, stiffness_ratio=0.8034819640601791 sliders=3
    chi=-0.38365531963430444 gradient=-0.133942357463257 frame_damping_ratio=0.07379479418479876
on a moving wall the search begins at rest on the wall
    1.5 0.9 base, 1.0 100 1, stiffness_ratio=1.0 sliders=3 chi=-0.4 gradient=0.1 frame_damping_ratio=0.05
with break-away the orbit is the one that rest settles on: carried on from Newton's trials another had energy 0.36815
    0.06341084881420596 0.09842763921765396 fixed 0.0014414262567462033 -0.07219565353094892, 0.0 80 1,
    stiffness_ratio=174.6358790914 static_ratio_up=1.2638205197503 static_ratio_down=1.326786918658
with break-away and gradient the orbit holds what rest leaves: the first orbit close by told the energy 4e-5 off
    1.9966684304040216 0.21153953529101732 base, 1.0 600 1, stiffness_ratio=0.19122238263780167 sliders=4
    chi=-0.7834686064859966 gradient=-0.18135282385048504 contact_damping_ratio=0.01473978378323338
    static_ratio_up=1.4491830523903007 static_ratio_down=1.0418150844224923
an orbit of seven cycles is not taken for one of two beside it
    0.19145588878011086 0.5061793110697208 fixed 0.17982654807900456 -0.03174933091937436, 0.0 607 7,
    static_ratio_up=1.2749633156028937 static_ratio_down=1.244413424921524 stiffness_ratio=18.899445520381267
uneven break-away may hold, yet rest settles on a motion that slips
    0.5986 0.735 fixed, 0.0 500 1, static_ratio_up=1.29 static_ratio_down=1.47 stiffness_ratio=87.2
an orbit of many cycles is found
    3.51 1.0735 fixed, 0.0 126 18, static_ratio_up=1.434 static_ratio_down=1.383 stiffness_ratio=209.5
    sliders=2 chi=-0.56
"""
"""Why, then: r, beta, wall, the base's second cosine and third sine, if any; the place (at rest on the wall) that the
motion begins at, cycles and period; numbers of the law."""
CASES = [case.split("\n", 1) for case in re.split(r"\n(?! )", SETTLING.strip())]


@pytest.mark.parametrize("case", [numbers for _, numbers in CASES], ids=[why for why, _ in CASES])
def test_the_steady_state_is_where_the_motion_from_rest_comes(case: str) -> None:
    point, begin, numbers = case.split(",")
    (r, beta), (x0, cycles, period) = map(float, point.split()[:2]), map(float, begin.split())
    more = [float(word) for word in point.split()[3:]]
    base = Base((1.0, more[0], 0.0), (0.0, 0.0, more[1])) if more else Base()
    law = {name: float(value) for name, value in re.findall(r"(\w+)=(\S+)", numbers)}
    state = steady_state(problem_of(r, beta, "base" if "base" in point else "fixed", base, **law))
    assert state.period_cycles == period
    assert present(state.orbit).end - present(state.orbit).start == pytest.approx(TURN * period, abs=1e-11)
    assert settles_on(state, int(cycles), 1e-9, x0)
