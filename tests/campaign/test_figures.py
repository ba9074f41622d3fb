"""The figures: all there, vector and PNG, the resonance band blank, the same bytes each time."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.collections import QuadMesh

from frictionlab.campaign import Campaign, evaluate
from frictionlab.campaign.trials import trial_of
from frictionlab.figures import grids, is_figure
from frictionlab.figures.grids import resonance_band
from frictionlab.figures.plates import Plate, plates
from frictionlab.figures.style import AT_REST, StopColours
from frictionlab.report import page
from frictionlab.scene import Scene
from tests.campaign.fabricate import row

NAMES = {
    *("ranking", "friction", "irregularity", "stops", "energy_aramid", "energy_rubber", "energy_steel", "comparison"),
    "residuals",
}


def plate(campaign: Campaign, name: str) -> Plate:
    return next(p for p in plates(campaign) if p.name == name)


def test_a_campaign_without_recordings_has_all_figures_but_the_time_responses(campaign: Campaign) -> None:
    drawn = {plate.name: plate.draw() for plate in plates(campaign)}
    assert set(drawn) == NAMES
    for figure in drawn.values():
        assert all(ax.has_data() or ax.texts for ax in figure.axes)
        assert any(ax.get_xlabel() for ax in figure.axes)


def test_a_plate_is_saved_as_vector_and_picture(campaign: Campaign, tmp_path: Path) -> None:
    saved = plate(campaign, "ranking").save(tmp_path)
    assert [path.name for path in saved if is_figure(path)] == ["ranking.svg", "ranking.pdf", "ranking.png"]


def test_the_irregularity_maps_share_one_scale_and_leave_resonance_blank(campaign: Campaign) -> None:
    figure = grids.irregularity(campaign)
    meshes = [mesh for ax in figure.axes for mesh in ax.collections if isinstance(mesh, QuadMesh)][:3]
    assert len({mesh.get_clim() for mesh in meshes}) == 1
    for mesh in meshes:
        edges = np.asarray(mesh.get_coordinates())[0, :, 0]
        blank = np.isnan(np.asarray(mesh.get_array(), dtype=float))
        (place,) = np.flatnonzero(blank.all(axis=0))
        assert edges[place] < 1.0 < edges[place + 1]


@given(st.lists(st.floats(0.05, 0.8), min_size=2, max_size=8, unique=True))
def test_a_band_is_left_blank_only_over_resonance(below: list[float]) -> None:
    assert resonance_band(below) is None
    assert resonance_band([*below, 1.0, 1.5]) is None
    band = resonance_band([*sorted(below), 9.0])
    assert band is None or band == (max(below), 9.0)


def test_stops_are_whole_numbers_of_distinct_colours_over_their_full_range() -> None:
    scale = StopColours(np.array([AT_REST, 0.0, 2.02, 131.0, np.nan]))
    assert scale.names == ["at rest", *"012345678", "9-16", "17-24", "25-40", "41-72", "73-136"]
    colours = {scale.mapped["cmap"](scale.mapped["norm"](n)) for n in (AT_REST, 0, 1, 2, 8, 12, 20, 30, 60, 131)}
    assert len(colours) == 10
    assert scale.edges[0] < AT_REST < 131.0 < scale.edges[-1]


def test_a_campaign_of_one_force_has_lines_in_place_of_maps_and_no_caption_of_absent_panels(scene: Scene) -> None:
    few = evaluate([trial_of(row("steel", 1.0, r, 0.6)) for r in (0.3, 0.45, 0.7)], scene)
    drawn = {plate.name: plate for plate in plates(few)}
    assert not any(ax.collections for ax in drawn["stops"].draw().axes)
    assert len(drawn["friction"].draw().axes) == 1
    assert "Right" not in drawn["friction"].caption
    (residuals,) = drawn["residuals"].draw().axes
    assert residuals.get_xlim()[0] == 0.0
    one = evaluate([trial_of(row("steel", 1.0, 0.3, 0.6))], scene)
    assert not {"stops", "irregularity"} & {plate.name for plate in plates(one)}


def test_lines_of_all_materials_have_one_scale_and_ranks_stand_whole_in_their_panels(scene: Scene) -> None:
    tests = {"steel": 0.2, "brass": 0.6}
    trials = [trial_of(row(name, 1.0, r, beta)) for name, beta in tests.items() for r in (0.3, 0.45, 0.7)]
    drawn = {plate.name: plate.draw() for plate in plates(evaluate(trials, scene))}
    assert len({ax.get_ylim() for ax in drawn["irregularity"].axes}) == 1
    for ax in drawn["ranking"].axes:
        left, right = ax.get_xlim()
        places = np.concatenate([np.asarray(line.get_xdata(), float) for line in ax.lines])
        assert left + 0.04 * (right - left) < places.min()
        assert places.max() < right - 0.04 * (right - left)


def test_tests_of_one_frequency_ratio_are_drawn_over_normal_force_with_space_around(scene: Scene) -> None:
    rows = [row("steel", force, 0.31978 + 1e-5 * force, 0.6) for force in (1.0, 1.5, 2.0)]
    campaign = evaluate([trial_of(one) for one in rows], scene)
    drawn = {plate.name: plate.draw().axes[0] for plate in plates(campaign)}
    for name in ("energy_steel", "residuals"):
        assert drawn[name].get_xlabel() == "normal force [N]"
        assert drawn[name].get_xlim() == pytest.approx((0.0, 2.2))
    captions = " ".join(plate.caption for plate in plates(campaign))
    assert not any(word in captions for word in ("dotted lines", "Blank", "at an edge"))
    dashes = [line for line in drawn["energy_steel"].lines if line.get_marker() == "_"]
    predicted = [line for line in dashes if line.get_markersize() > 10]  # smaller ones are ends of error bars
    assert len(predicted) == 3
    assert (
        max(float(np.asarray(line.get_ydata(), dtype=float)[0]) for line in predicted)
        < drawn["energy_steel"].get_ylim()[1]
    )
    text = page(campaign, [], {})
    assert "energy per cycle [kY²] over normal force [N]" in text
    low, *_, high = re.findall(r'<circle class="group0" cx="([0-9.]+)"', text)
    assert 62.0 + 10.0 < float(low) < float(high) < 908.0 - 10.0
