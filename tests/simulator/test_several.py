"""Several masses, contacts anywhere: against one mass, a slow twin, and closed forms."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from frictionlab.errors import ParameterError, SimulationError
from frictionlab.simulator import Base, Contact, Problem, Structure, coexisting, simulate, steady_state
from frictionlab.simulator.record import BaseRecord, respond
from tests.benchmarks.several_masses import draw
from tests.desk import present
from tests.simulator.test_record import some_base
from tests.simulator.twin import LAWS, TURN, Twin, problem_of, rubs
from tests.simulator.twin import steady as integrated


@pytest.mark.parametrize("wall", ["fixed", "base"])
@pytest.mark.parametrize(
    ("law", "values"),
    [
        ("coulomb", {}),
        ("coulomb+place", {"gradient": 0.05}),
        ("coulomb+speed", {"contact_damping_ratio": 0.05}),
        ("coulomb+breakaway", {"static_ratio_up": 1.3, "static_ratio_down": 1.3}),
        ("coulomb+compliance", {"stiffness_ratio": 20.0}),
        ("coulomb+iwan", {"stiffness_ratio": 20.0, "sliders": 10, "chi": -0.3}),
    ],
)
def test_a_structure_of_one_mass_is_the_problem(law: str, values: dict[str, float], wall: str) -> None:
    r, beta = 0.5, 0.4
    one = steady_state(Problem(r, beta, law=law, parameters=values, frame_damping_ratio=0.02, wall=wall))  # type: ignore[arg-type]
    contact = rubs(law, 1, "wall" if wall == "fixed" else "base", beta=beta, **values)
    found = steady_state(Structure.of_storeys(r, [3.0], [700.0], [0.02], [contact]))
    assert found.outcome == one.outcome
    assert found.response_amplitudes[0] == pytest.approx(one.response_amplitude, abs=1e-12)
    assert found.energy_per_cycle == pytest.approx(one.energy_per_cycle, abs=1e-12)
    assert found.contact_energy_per_cycle == pytest.approx(one.contact_energy_per_cycle, abs=1e-12)
    assert found.contacts[0].stops_per_cycle == one.stops_per_cycle
    assert found.contacts[0].stuck_fraction == pytest.approx(one.stuck_fraction, abs=1e-12)
    if one.outcome == "periodic":
        assert found.floquet_multiplier == pytest.approx(one.floquet_multiplier, abs=1e-9)


def test_without_contacts_it_is_the_linear_response() -> None:
    frame = Structure.of_storeys(0.7, [2.0, 1.0], [800.0, 400.0], [0.01, 0.02])
    dynamic = frame.stiffness + 1j * 0.7 * frame.damping - 0.7**2 * frame.mass
    driven = np.linalg.solve(dynamic, (frame.stiffness + 1j * 0.7 * frame.damping) @ np.ones(2))
    found = steady_state(frame)
    assert found.response_amplitudes == pytest.approx(np.abs(driven), rel=1e-12)
    assert found.energy_per_cycle == pytest.approx(-math.pi * driven[0].imag, rel=1e-11)
    assert found.closure_error == pytest.approx(0.0, abs=1e-10)


def test_motions_of_a_frame_coexist_and_each_repeats_in_the_twin() -> None:
    sticky = rubs("coulomb+breakaway", 1, beta=0.2, static_ratio_up=3.0, static_ratio_down=3.0)
    frame = Structure.of_storeys(0.38, [1.0, 0.1], [1.0, 1.0], [0.005, 0.005], [sticky])
    found = [attractor.state for attractor in coexisting(frame, starts=12)]
    assert {state.period_cycles for state in found} == {1, 3}
    for state in found:
        assert abs(state.floquet_multiplier or 2.0) < 1.0
        start = np.concatenate([values[0] for values in present(state.orbit).all_at([0.0])[:2]])
        end, taken = start, 0.0
        for _ in range(state.period_cycles or 0):
            twin = Twin(frame)
            end, taken = twin.run([0.0, TURN], end), taken + (twin.friction + twin.viscous) / (state.period_cycles or 1)
        assert end == pytest.approx(start, abs=1e-9)
        assert state.contact_energy_per_cycle == pytest.approx(taken, abs=1e-9)


UNEVEN = {"static_ratio_up": 1.3, "static_ratio_down": 1.1}
TWO = [
    [rubs("coulomb", 1, beta=0.3), rubs("coulomb", 2, 1, beta=0.2)],
    [rubs("coulomb+speed", 2, "base", beta=0.3, contact_damping_ratio=0.05)],
    [rubs("coulomb+compliance", 1, beta=0.3, stiffness_ratio=5.0), rubs("coulomb+place", 2, 1, beta=0.2, gradient=0.1)],
    [rubs("coulomb+breakaway", 2, beta=0.3, static_ratio_up=1.4, static_ratio_down=1.2)],
    [rubs("coulomb+compliance+breakaway", 1, 2, beta=0.2, stiffness_ratio=9.0, **UNEVEN), rubs("coulomb", 2, beta=0.2)],
    # what rigid contacts hold, an elastic one beside them waits on: they stop and give way together
    [rubs("coulomb", 2, beta=0.2), rubs("coulomb+compliance", 2, beta=0.3, stiffness_ratio=5.0)],
    [
        *(rubs("coulomb+compliance", 1, 2, beta=0.3, stiffness_ratio=9.0), rubs("coulomb", 2, 1, beta=0.06)),
        rubs("coulomb+speed", 2, beta=0.25, contact_damping_ratio=0.05),
    ],
]


@pytest.mark.parametrize("contacts", TWO)
def test_two_masses_move_as_the_slow_twin_does(contacts: list[Contact]) -> None:
    frame, tau = of_two(contacts), np.linspace(0.0, TURN, 10)
    motion, twin = simulate(frame, cycles=1), Twin(frame)
    assert motion.solver == "exact"
    twin.run(tau.tolist())
    q, v, forces = motion.all_at(tau)
    assert np.hstack((q, v)) == pytest.approx(np.array(twin.states), abs=1e-9)
    assert np.concatenate((q[-1], v[-1])) == pytest.approx(twin.states[-1], abs=3e-10)
    assert forces[1:] == pytest.approx(np.array(twin.forces)[1:], abs=1e-8)  # at rest a force may be any that holds


def of_two(contacts: list[Contact], r: float = 0.6) -> Structure:
    return Structure.of_storeys(
        r, [1.0, 0.7], [1.0, 1.3], [0.02, 0.01], contacts, Base(cosine=(1.0, 0.1), sine=(0.0, 0.05))
    )


EXACT = [
    Problem(0.5, 0.4),
    Problem(0.3, 0.6, mu=1.3),
    Problem(0.4, 0.3, zeta=0.03, base=Base((1.0, 0.0, 0.1), (0.0, 0.0, 0.05))),
    Problem(1.3, 0.3, wall="base", frame_damping_ratio=0.02),
    Problem(0.6, 0.0, zeta=0.1),
    problem_of(0.6, 0.3, stiffness_ratio=9.0),
    problem_of(0.4, 0.3, stiffness_ratio=9.0, sliders=3, chi=0.0, gradient=0.1),
    *map(of_two, TWO),
]


@pytest.mark.parametrize("what", EXACT, ids=str)
def test_the_integrated_flow_moves_a_frame_as_the_exact_one(what: Problem | Structure) -> None:
    exact = steady_state(what, solver="exact") if isinstance(what, Problem) else steady_state(what)
    found = integrated(what)
    for key in ("energy_per_cycle", "contact_energy_per_cycle", "frame_energy_per_cycle", "response_amplitude"):
        assert getattr(found, key) == pytest.approx(getattr(exact, key), rel=1e-9, abs=1e-15), key
    taus = np.linspace(0.0, 7.0, 41)
    for one, other, few in zip(*(present(s.orbit).all_at(taus)[:2] for s in (found, exact)), (1e-8, 1e-6), strict=True):
        np.testing.assert_allclose(one, other, atol=few)
    if isinstance(what, Structure) and what.contacts in map(tuple, TWO[5:]):
        return  # an elastic contact beside one that holds has the stops of neither
    assert present(found.floquet_multiplier) == pytest.approx(present(exact.floquet_multiplier), abs=1e-8)
    assert found.stops_per_cycle == exact.stops_per_cycle
    assert found.stuck_fraction == pytest.approx(exact.stuck_fraction, abs=1e-8)
    for mine, theirs in zip(found.contacts, exact.contacts, strict=isinstance(what, Structure)):
        assert mine[3:] == pytest.approx(theirs[3:], abs=1e-8)


LUGRE, AGES = (LAWS[f"coulomb+{law}"] for law in ("lugre", "rate-state"))
MIXED = [rubs("coulomb+lugre", 1, beta=0.3, **LUGRE), rubs("coulomb+rate-state", 2, 1, beta=0.2, **AGES)]


def test_laws_with_states_of_their_own_move_two_masses_as_scipys_radau_does() -> None:
    frame = Structure.of_storeys(0.6, [1.0, 0.7], [1.0, 1.3], [0.02, 0.01], MIXED)
    q, v, _ = simulate(frame, cycles=1).all_at([TURN])
    assert np.concatenate((q[0], v[0])) == pytest.approx(Twin(frame).run([0.0, TURN])[:4], abs=2e-9)
    state = steady_state(frame)
    assert (state.outcome, state.solver) == ("periodic", "numeric")
    assert state.closure_error == pytest.approx(0.0, abs=1e-9)
    assert sum(contact.energy_per_cycle or 0.0 for contact in state.contacts) == state.contact_energy_per_cycle


def test_a_search_near_a_state_knows_what_its_elastic_sliders_hold() -> None:
    contacts = [rubs("coulomb+stribeck", 1, beta=0.2, **LAWS["coulomb+stribeck"]), TWO[2][0]]
    orbit = present(steady_state(of_two(contacts)).orbit)
    assert len(present(orbit.section)) == orbit.flow.size == 5
    assert orbit.flow.carried(orbit.section, 0.0, TURN)[0] == pytest.approx(orbit.section, abs=1e-8)


def test_a_record_moves_two_masses_with_states_of_their_own_as_the_slow_twin_does() -> None:
    base = BaseRecord(*some_base(7, 9, even=False))
    seen, twin = respond(of_two(MIXED, 1.0), base), Twin(of_two(MIXED, 1.0), CubicSpline(base.time, base.values))
    twin.run(base.time.tolist())
    assert seen.displacements == pytest.approx(np.array(twin.states)[:, :2], abs=1e-8)
    assert seen.closure_error < 1e-11


RUBBED = {"gradient": 0.05, "contact_damping_ratio": 0.02, "frame_damping_ratio": 0.03}


@pytest.mark.parametrize(
    "what",
    [
        *(problem_of(1.0, 0.2, "fixed", **RUBBED), problem_of(1.0, 0.2, "base", **RUBBED)),
        *(of_two(TWO[number], 1.0) for number in (0, 1, 4)),
    ],
    ids=str,
)
def test_the_integrated_flow_follows_a_record_as_the_exact_one(what: Problem | Structure) -> None:
    base = BaseRecord(*some_base(3, 60, even=True))
    exact, stepped = (respond(what, base, solver=solver) for solver in ("auto", "numeric"))
    assert (exact.solver, stepped.solver) == ("exact", "numeric")
    assert exact.closure_error < 1e-9
    for key in ("displacements", "velocities", "contact_forces", "contact_energies", "paths"):
        assert getattr(stepped, key) == pytest.approx(getattr(exact, key), abs=1e-8), key
    for key in ("energy", "friction_energy"):
        assert getattr(stepped, key) == pytest.approx(getattr(exact, key), abs=1e-8), key
    for one, other in zip(stepped.contact_stops, exact.contact_stops, strict=True):
        assert one == pytest.approx(other, abs=1e-8)


@pytest.mark.parametrize("seed", range(14))
def test_what_goes_in_is_what_is_taken(seed: int) -> None:
    """In random frames of two and three masses."""
    try:
        found = steady_state(draw(seed))
    except SimulationError as error:
        assert "rigid contacts hold a mass twice over" in str(error)  # noqa: PT017 - as is right
        return
    assert found.outcome in ("periodic", "stuck")
    assert present(found.closure_error) < 1e-10
    assert present(found.residual) < 1e-10
    assert abs(found.floquet_multiplier or 0.0) <= 1.0 + 1e-14  # of contacts that hold for good it is 1, rounded


@pytest.mark.parametrize(
    ("contacts", "match"),
    [
        ([rubs("coulomb", 1, beta=0.2), rubs("coulomb", 1, beta=0.2)], "rigid contacts hold a mass twice over"),
        ([rubs("coulomb+place", 2, 1, beta=0.1, gradient=0.9)], "coulomb.place.*gradient; expected 1 . gradient z > 0"),
    ],
)
def test_what_cannot_move_is_refused_by_name(contacts: list[Contact], match: str) -> None:
    frame = Structure.of_storeys(0.6, [1.0, 1.0], [1.0, 1.0], [0.001, 0.001], contacts)
    with pytest.raises(SimulationError, match=match):
        steady_state(frame)


def test_structures_that_cannot_be_are_refused_by_name() -> None:
    with pytest.raises(ParameterError, match="contact 1: expected a mass from 1 to 2; got 3"):
        Structure.of_storeys(0.5, [1.0, 1.0], [1.0, 1.0], [0.0, 0.0], [rubs("coulomb", 3, beta=0.1)])
    with pytest.raises(ParameterError, match=r"storeys: stiffness; expected finite numbers > 0 .* got \[1\.0, -1\.0\]"):
        Structure.of_storeys(0.5, [1.0, 1.0], [1.0, -1.0], [0.0, 0.0])


def test_an_undamped_mode_at_resonance_has_no_steady_state() -> None:
    slowest = float(Structure.of_storeys(1.0, [1.0, 1.0], [1.0, 1.0], [0.0, 0.0]).natural_frequencies[0])
    assert steady_state(Structure.of_storeys(slowest, [1.0, 1.0], [1.0, 1.0], [0.0, 0.0])).outcome == "unbounded"
