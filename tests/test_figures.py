"""What is common to all figures: the warnings below them, drawn once, the same bytes each time."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure

from frictionlab.figures.simulated import draw_contact_force, draw_motion
from frictionlab.figures.style import drawing, new_figure, plain_numbers, save
from frictionlab.simulator import Problem, last_cycle, steady_state


def test_what_warns_of_a_number_stands_below_its_figure() -> None:
    with drawing(cautions=["base: noise", "energy_per_cycle: of a passing state", "a", "b", "c"]) as figure:
        pass
    told = figure.get_supxlabel()
    assert told.startswith("! base: noise\n! energy_per_cycle: of a passing state")
    assert told.endswith("(and 3 more in the table)")
    with drawing() as quiet:
        pass
    assert not quiet.get_supxlabel()


@pytest.mark.parametrize(
    ("law", "parameters"), [("coulomb", {}), ("coulomb+stribeck", {"static_ratio": 1.2, "stribeck_speed": 0.2})]
)
def test_a_stop_that_goes_on_into_the_next_period_is_shaded_in_both(law: str, parameters: dict[str, float]) -> None:
    state = steady_state(Problem(0.3, 0.5, law=law, parameters=parameters))
    assert state.orbit is not None
    ax = draw_motion(state, new_figure().subplots())
    shaded = [patch.get_extents().transformed(ax.transData.inverted()) for patch in ax.patches]
    for place in (0.02, 1.98, 2.02, 3.98):  # the mass stands where the base turns
        assert any(box.x0 < place < box.x1 for box in shaded)
    assert ax.get_xlim() == pytest.approx((0.0, 4.0))


def test_cycles_from_rest_are_all_drawn() -> None:
    state = last_cycle(Problem(0.95, 0.1), cycles=7)
    ax = draw_motion(state, new_figure().subplots())
    assert ax.get_xlim() == pytest.approx((0.0, 14.0))
    assert np.asarray(ax.lines[1].get_ydata())[0] == pytest.approx(0.0)  # the mass begins at rest


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_a_picture_is_drawn_once_and_is_the_same_bytes_each_time(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []
    draw = Figure.draw

    def counted(self: Figure, renderer: RendererBase) -> None:
        drawn.append(self)
        draw(self, renderer)

    monkeypatch.setattr(Figure, "draw", counted)
    for name in ("a", "b"):
        with drawing(1.5) as figure:
            ax = figure.subplots()
            ax.semilogy([1.0, 2.0], [1e-3, 10.0])
            plain_numbers(ax.yaxis)
        save(figure, tmp_path / f"{name}{suffix}")
        assert {"10⁻³", "10¹"} <= {text.get_text() for text in ax.get_yticklabels()}
        assert not ax.yaxis.get_minorticklocs().size
    assert len(drawn) == 2
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


def test_the_loop_of_force_over_displacement_has_the_energy_as_its_area() -> None:
    ax = new_figure().subplots()
    state = steady_state(Problem(0.5, 0.4))
    draw_contact_force(state, ax)
    x, n = (np.asarray(part, dtype=float) for part in ax.lines[0].get_data())
    assert np.sum(0.5 * (n[1:] + n[:-1]) * np.diff(x)) == pytest.approx(state.energy_per_cycle, rel=1e-3)
