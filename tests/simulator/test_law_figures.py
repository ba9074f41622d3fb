"""The figures of the contact laws draw what the laws are."""

from pathlib import Path

import numpy as np
import pytest

from frictionlab.figures import laws
from frictionlab.figures.motion import force_over_displacement
from frictionlab.figures.style import new_figure
from frictionlab.simulator import Problem, steady_state


def test_the_loop_of_force_over_displacement_has_the_energy_as_its_area() -> None:
    ax = new_figure().subplots()
    state = steady_state(Problem(0.5, 0.4))
    force_over_displacement(state, ax)
    x, n = (np.asarray(part, dtype=float) for part in ax.lines[0].get_data())
    assert np.sum(0.5 * (n[1:] + n[:-1]) * np.diff(x)) == pytest.approx(state.energy_per_cycle, rel=1e-3)


def test_both_figures_appear(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    state = steady_state(Problem(0.5, 0.4))
    drawn = laws.LawFigures(loops={"coulomb": state, "again": state}, slow=(state, state))
    monkeypatch.setattr(laws, "compute", lambda: drawn)
    laws.main(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"laws_force.png", "laws_slow.png"}
