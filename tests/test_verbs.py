"""The library's face: public names that load when used, verbs that take paths or results, the README's example."""

import ast
import contextlib
import io
import re
from dataclasses import FrozenInstanceError
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure

import frictionlab as fl
from frictionlab.errors import SceneError, UsageError
from frictionlab.figures.simulated import draw_contact_force, draw_motion
from frictionlab.figures.style import drawing, new_figure, plain_numbers, save
from frictionlab.inference.material_law import example_law
from frictionlab.simulator import Problem, last_cycle, steady_state
from tests.desk import ROOT, SCENE
from tests.desk import SAMPLE as LOG


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> fl.Recording:
    return fl.ingest(str(LOG), str(SCENE), output=tmp_path_factory.mktemp("recordings") / "a.h5")


@pytest.fixture(scope="module")
def measurement(recording: fl.Recording) -> fl.Measurement:
    return fl.analyze(recording, SCENE)


def test_every_public_name_is_there_and_stands_in_the_stub() -> None:
    stub = ast.parse((ROOT / "frictionlab" / "__init__.pyi").read_text(encoding="utf-8"))
    told = {name.asname for node in stub.body if isinstance(node, ast.ImportFrom) for name in node.names}
    assert told | {"__version__"} == set(dir(fl))
    for name in dir(fl):
        assert getattr(fl, name) is getattr(fl, name)


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="did you mean analyze"):
        fl.analyse  # type: ignore[attr-defined]  # noqa: B018  # the access is what is tested
    with pytest.raises(AttributeError, match="did you mean evaluate, then publish"):
        fl.__getattr__("campaign")


def test_ingest_honours_log_and_experiment_of_the_scene(recording: fl.Recording, tmp_path: Path) -> None:
    fl.write_recording(recording, tmp_path / "a.h5")
    assert recording.experiment["material"] == "steel"
    assert recording.experiment["normal_force_n"] == 1.25
    assert fl.read_recording(tmp_path / "a.h5").experiment == recording.experiment
    other = fl.ingest(LOG, SCENE, unit="µm", material="rubber")
    assert other.mass_displacement[0] == pytest.approx(recording.mass_displacement[0] / 1000, rel=1e-12)
    assert other.experiment["material"] == "steel"  # the file's name wins over [experiment]


def test_a_comparison_of_a_log_knows_material_and_coefficient(measurement: fl.Measurement) -> None:
    comparison = fl.compare(LOG, SCENE)
    assert comparison.material == "steel"
    assert comparison.friction_coefficient == pytest.approx(0.6, rel=1e-3)
    assert fl.compare(measurement, SCENE).row() == comparison.row()


def test_a_measurement_of_another_transient_is_refused(measurement: fl.Measurement) -> None:
    """It was taken as it was, without a word: a cycle that had not settled was compared."""
    later = measurement.transient_s + 5.0
    with pytest.raises(UsageError, match=r"analysis.transient_s = .*give the recording in its place"):
        fl.compare(measurement, SCENE, transient_s=later)


def test_settings_win_over_the_scene_and_are_validated(recording: fl.Recording) -> None:
    scene = fl.read_scene(SCENE)
    measurement = fl.analyze(recording, scene, cycles="all", natural_frequency_hz=3.0, padding=None)
    assert measurement.energy_rule == "all"
    assert measurement.natural_frequency_hz == 3.0
    said = scene.changed(analysis={"cycles": "all"})
    assert measurement.row() == fl.analyze(recording, said, natural_frequency_hz=3.0).row()
    with pytest.raises(UsageError, match="cycle: unknown setting; did you mean cycles"):
        fl.analyze(recording, scene, cycle="all")
    with pytest.raises(SceneError, match=r"analysis\.cycles: expected 'last'"):
        fl.analyze(recording, scene, cycles="first")
    with pytest.raises(FrozenInstanceError, match="cannot assign"):
        measurement.cycles = 3  # type: ignore[misc]


def test_a_campaign_is_evaluated_from_results_rows_and_files_alike(tmp_path: Path) -> None:
    measurements = [fl.analyze(log, SCENE) for log in sorted((ROOT / "sample_data").glob("*r0.3.csv"))]
    fl.write_rows([m.row() for m in measurements[:2]], tmp_path / "m.csv")
    scene = fl.read_scene(SCENE)
    mixed = fl.evaluate([tmp_path / "m.csv", measurements[2].row(), *measurements[3:]], scene)
    assert [fit.friction_ratio for fit in mixed.fits] == pytest.approx(
        [fit.friction_ratio for fit in fl.evaluate(measurements, scene).fits], rel=1e-12
    )


def test_plot_draws_each_result_and_refuses_others(tmp_path: Path) -> None:
    state = fl.simulate(fl.Problem(r=0.5, beta=0.4))
    assert fl.plot(state, tmp_path / "new" / "motion.svg").read_text(encoding="utf-8").startswith("<?xml")
    with pytest.raises(UsageError, match=r"expected a figure ending in \.pdf"):
        fl.plot(state, "motion.doc")
    with pytest.raises(UsageError, match="got a Scene"):
        fl.plot(fl.Scene(), tmp_path / "a.png")
    with pytest.raises(UsageError, match="expected one SteadyState; got 2: plot each by itself"):
        fl.plot([state, state])
    assert fl.plot([state]).get_axes()


def test_a_notebook_gets_frames_pages_and_figures(
    recording: fl.Recording, measurement: fl.Measurement, tmp_path: Path
) -> None:
    comparison = fl.compare(measurement, SCENE)
    campaign = fl.evaluate([measurement], SCENE)
    for judged in (comparison, fl.compare(measurement, SCENE, friction_ratio=0.3)):
        assert judged.energy_joules.u == pytest.approx(measurement.energy_per_cycle_j_u), "with the stiffness's error"
    assert repr(recording) == f"<Recording {LOG.name}: 15000 samples, 60 s at 250 Hz>"
    work = fl.batch(LOG, SCENE, output=tmp_path)
    assert repr(work) == f"<Batch: 1 of 1 logs to be done into {tmp_path}: .run() does the work>"
    assert repr(campaign) == "<Campaign: 1 tests, 0 failed, 1 fits of steel>"
    state, states = fl.simulate(fl.Problem(0.5, 0.4)), fl.sweep([0.3, 0.5], [0.2, 0.4])
    prediction = fl.predict(example_law(), r=0.5, normal_force_n=4.0, draws=5)
    for result in (measurement, comparison, campaign, state, states, prediction):
        assert len(result.to_pandas()) == (4 if result is states else 1)
        page = result._repr_html_()
        assert page.startswith("<p>&lt;")
        assert "<table" in page
        assert "<svg" in page
        assert "{" not in page.partition("<svg")[0], "a dict is nothing to read"
    explanation = fl.explain(comparison)
    assert str(explanation) == explanation.text
    assert explanation._repr_html_().startswith("<pre>")
    assert len(recording.to_pandas()) == len(recording)
    assert "<svg" in recording._repr_html_()
    assert all(fl.plot(result).get_axes() for result in (recording, comparison))
    fl.write_rows([measurement.row()], tmp_path / "m.jsonl")
    assert fl.evaluate(tmp_path, SCENE).materials == campaign.materials
    with pytest.raises(fl.UsageError, match=r"expected measurements, rows or files of them; got a Recording"):
        fl.evaluate(recording, SCENE)  # type: ignore[arg-type]
    with pytest.raises(fl.UsageError, match="law: explain finds the law"):
        fl.explain(recording, SCENE, law="coulomb")
    assert explanation.comparison is comparison
    assert explanation.text.startswith("steel_N1.25_r0.3.csv: coulomb at r = 0.3")
    assert "Energy per cycle: 1.215 ± 0.021 k Y^2 = 4.69 ± 0.08 mJ measured" in " ".join(explanation.text.split())


def test_the_readme_example_runs_and_prints_what_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    said = re.findall(r"# (\d[\d.]*)$", code, re.MULTILINE)
    monkeypatch.chdir(ROOT)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "README.md", "exec"), {})  # noqa: S102  # the document is what is tested
    assert printed.getvalue().split() == said


def test_results_tell_what_they_are_in_a_line() -> None:
    problem = fl.Problem(r=0.5, beta=0.4)
    assert repr(problem) == "<Problem r = 0.5, coulomb: beta 0.4, frame_damping_ratio 0, fixed wall>"
    assert repr(problem.law) == "<Law coulomb>"
    assert repr(fl.sweep([0.3, 0.5], [0.4])) == "<StateMap coulomb: 2 r 0.3 to 0.5, beta 0.4, mu 1, zeta 0; fixed wall>"
    told = repr(fl.simulate(problem))
    assert told.startswith("<SteadyState r = 0.5, coulomb: The motion repeats every cycle: stick-slip with 2 stops")
    scene = fl.scene_from_tables(
        {
            "rig": {"stiffness_n_per_m": 1191.0, "natural_frequency_hz": 3.13},
            "plan": {"normal_forces_n": [1.0], "friction_coefficient": [0.5, 0.1], "frequency_ratios": [0.3, 0.5]},
        }
    )
    assert repr(scene).startswith("Scene(rig=Rig(natural_frequency_hz=3.13, stiffness_n_per_m=1191.0), plan=PlanTable(")
    assert repr(fl.plan(scene, tests=1)).startswith("<Plan coulomb: 1 tests, r = 0.")
    resonant = fl.Problem(r=1.0, beta=0.3)
    response = fl.respond(ROOT / "sample_data" / "steel_N1.25_r0.3.csv", resonant, natural_frequency_hz=3.13)
    assert repr(response).startswith("<RecordResponse to ")
    assert len(repr(response)) < 250


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
    ax = draw_motion(state, new_figure().subplots())
    shaded = [patch.get_extents().transformed(ax.transData.inverted()) for patch in ax.patches]
    for place in (0.02, 1.98, 2.02, 3.98):  # the mass stands where the base turns
        assert any(box.x0 < place < box.x1 for box in shaded)
    assert ax.get_xlim() == pytest.approx((0.0, 4.0))
    ax = draw_motion(last_cycle(Problem(0.95, 0.1), cycles=7), new_figure().subplots())  # from rest all are drawn
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
