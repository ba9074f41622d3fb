"""Many steady cycles in one call are those of one problem after the other."""

import numpy as np
import pytest

from frictionlab.simulator import steady_state
from frictionlab.simulator.cycles import steady_cycles
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.problem import Wall
from frictionlab.simulator.sweep import Family

PHASES = 2 * np.pi * np.arange(64) / 64


def drawn(names: tuple[str, ...]) -> list[list[float]]:
    generator = np.random.default_rng(7)
    own = [generator.uniform(0.0, 0.06, 12) + (1.0 if name.startswith("static") else 0.0) for name in names]
    columns = [generator.uniform(0.1, 2.0, 12), generator.uniform(0.05, 0.9, 12), np.ones(12), np.zeros(12), *own]
    return [list(map(float, row)) for row in np.column_stack(columns)]


@pytest.mark.parametrize("wall", ["fixed", "base"])
@pytest.mark.parametrize(
    ("law", "names"),
    [
        ("coulomb", ()),
        ("coulomb+place+speed", ("gradient", "contact_damping_ratio")),
        ("coulomb+breakaway", ("static_ratio_up", "static_ratio_down")),
        ("coulomb+speed", ("contact_damping_ratio", "frame_damping_ratio")),
    ],
)
def test_cycles_are_those_of_one_problem_after_the_other(law: str, names: tuple[str, ...], wall: Wall) -> None:
    family, points = Family(law, names, wall), drawn(names)
    rows, cycles = steady_cycles(np.array(points), family, 64)
    for point, row, cycle in zip(points, rows, cycles, strict=True):
        state = steady_state(family.problem(point))
        assert state.energy_per_cycle == row[layout.ENERGY]
        assert state.orbit is not None
        turns = 2 * np.pi * np.arange(state.period_cycles or 1)[:, None]
        np.testing.assert_allclose(cycle, state.orbit.at(PHASES + turns)[0].mean(axis=0), atol=1e-11)


def test_a_mass_that_stands_still_shows_nothing_and_one_without_a_steady_state_no_number() -> None:
    rows, cycles = steady_cycles(np.array([[0.5, 1.2, 1.0, 0.0], [1.0, 0.5, 1.0, 0.0]]), Family(), 64)
    assert rows[:, layout.OUTCOME].tolist() == [layout.STUCK, layout.UNBOUNDED]
    assert not cycles[0].any()
    assert np.isnan(cycles[1]).all()


def test_laws_that_are_not_rigid_are_solved_one_by_one() -> None:
    family = Family("coulomb+compliance", ("stiffness_ratio",))
    points = np.array([[0.5, 0.4, 1.0, 0.0, 50.0], [0.5, 2.5, 1.0, 0.0, 50.0]])
    rows, cycles = steady_cycles(points, family, 64)
    orbit = steady_state(family.problem(points[0])).orbit
    assert orbit is not None
    np.testing.assert_allclose(cycles[0], orbit.at(PHASES)[0], atol=1e-12)
    assert rows[1, layout.OUTCOME] == layout.STUCK
    assert np.isfinite(cycles[1]).all()
