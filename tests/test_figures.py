"""What is common to all figures: the warnings below them, drawn once, the same bytes each time."""

from pathlib import Path

import pytest
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure

from frictionlab.figures.style import caution, look, new_figure, plain_decades, save


def test_what_warns_of_a_number_stands_below_its_figure() -> None:
    figure = new_figure()
    caution(figure, ["base: noise", "energy_per_cycle: of a passing state", "a", "b", "c"])
    told = figure.get_supxlabel()
    assert told.startswith("! base: noise\n! energy_per_cycle: of a passing state")
    assert told.endswith("(and 3 more in the table)")
    quiet = new_figure()
    caution(quiet, ())
    assert not quiet.get_supxlabel()


def test_a_picture_is_drawn_once_and_is_the_same_bytes_each_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []
    draw = Figure.draw

    def counted(self: Figure, renderer: RendererBase) -> None:
        drawn.append(self)
        draw(self, renderer)

    monkeypatch.setattr(Figure, "draw", counted)
    for name in ("a.png", "b.png"):
        with look():
            figure = new_figure()
            ax = figure.subplots()
            ax.semilogy([1.0, 2.0], [1e-3, 10.0])
            plain_decades(ax)
        save(figure, tmp_path / name)
        assert "10⁻²" in [text.get_text() for text in ax.get_yticklabels()]
        assert not ax.yaxis.get_minorticklocs().size
    assert len(drawn) == 2
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
