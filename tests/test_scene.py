"""A scene is read once, validated and frozen; what is wrong with it is said all at once, with key paths."""

import math
import re
from pathlib import Path

import pydantic
import pytest

from frictionlab.errors import SceneError
from frictionlab.scene import Scene, read_scene, scene_from_tables

GROUP = """[[synthetic.tests]]
material = "a"
normal_forces_n = [1.0]
frequency_ratios = [0.5]
friction_coefficient = 0.4
"""
TWO_STOREYS = """
[[rig.masses]]
mass_kg = 2.0
stiffness_n_per_m = 800.0
damping_ratio = 0.01
[[rig.masses]]
mass_kg = 1.0
stiffness_n_per_m = 400.0
[[rig.contacts]]
mass = 2
against = 1
law = "coulomb+place"
coefficient = 0.3
normal_force_n = 2.0
gradient = 0.1
"""
CONFIGS = Path(__file__).parents[1] / "configs"


def scene_file(folder: Path, text: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_of_mass_stiffness_and_natural_frequency_two_give_the_third() -> None:
    stiffness = 8.0 * math.pi**2
    by_stiffness = scene_from_tables({"rig": {"mass_kg": 2.0, "stiffness_n_per_m": stiffness}}).rig
    assert by_stiffness.natural_frequency == pytest.approx(1.0, rel=1e-15)
    by_frequency = scene_from_tables({"rig": {"mass_kg": 2.0, "natural_frequency_hz": 1.0}}).rig
    assert by_frequency.stiffness == pytest.approx(stiffness, rel=1e-15)
    assert Scene().rig.natural_frequency is None
    assert read_scene(CONFIGS / "frame.toml").rig.natural_frequency == pytest.approx(3.13, abs=0.005)


def test_all_faults_are_told_at_once_in_the_order_of_their_lines(tmp_path: Path) -> None:
    text = (
        "[rig]\nmass_kg = -1\ncolour = 'red'\n[analysis]\ncycles = 'first'\n[weather]\n[model]\nlaw = 'coulomb+plce'\n"
    )
    path = scene_file(tmp_path, text)
    with pytest.raises(SceneError, match=r"scene\.toml") as caught:
        read_scene(path)
    faults = (
        (2, r"rig.mass_kg: expected more than 0; got -1$"),
        (3, "rig.colour: unknown key"),
        (5, "analysis.cycles: .*'first'"),
        (6, "weather: unknown"),
        (8, r"model.law: law 'coulomb\+plce': 'plce' is no term; expected coulomb or a sum of"),
    )
    for line, (number, fault) in zip(str(caught.value).splitlines(), faults, strict=True):
        assert re.match(f"{re.escape(f'scene {path}, line {number}: ')}{fault}", line)
    assert "nput should" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("[rig]\nnatural_frequency = 3\n", r"line 2: rig\.natural_frequency: .*did you mean natural_frequency_hz\?"),
        ("[log]\nunitt = 'mm'\n", r"line 2: log\.unitt: unknown key; did you mean unit\?"),
        ("log.unit = 'parsec'\n", r"line 1: log\.unit: expected a unit of displacement, one of m, mm"),
        ("[log]\nmass = true\n", r"line 2: log\.mass: .*a text in quotes.* or .*a whole number"),
        ("[log]\nseparator = ','\ndecimal = ','\n", r"line 1: log: decimal: expected another mark than the separator"),
        ("[experiment]\nnote = '''\nx = 1\n'''\nmateral = 'steel'\n", r"line 5: experiment\.materal.*material\?"),
        ("[plan]\nfrequency_ratios = [\n  # none\n  -1.0,\n]\n", r"line 2: plan\.frequency_ratios\.0: expected more"),
        ("[[synthetic.tests]]\n[[synthetic.tests]]\nlable = 'a'\n", r"line 3: synthetic\.tests\.1\.lable.*label\?"),
        ("[[synthetic.tests]]\nmaterial = 'steel'\n", r"synthetic\.tests\.0\.friction_coefficient: is not given"),
        ("[analysis]\ntransient_s = 'long'\n", r"analysis\.transient_s: expected a number; got 'long'"),
        ("[analysis]\ncycles = 'window:-3'\n", r"analysis\.cycles: expected 'last', 'all' or 'window:SECONDS'"),
        ("[model]\ndamping = true\n", r"needs rig\.damping_ratio"),
        (
            "[model]\nlaw = 'coulomb+compliance'\nparameters = {stiffness_ratio = 0}",
            "stiffness_ratio: expected a .* > 0",
        ),
        ("[model.parameters]\ngradien = 0.1", "gradien: no law has such a parameter; expected one of beta, gradient"),
        ("[model]\nlaw = 'coulomb'\nparameters = {static_ratio_up = 1.2}", "static_ratio_up: law coulomb has no such"),
        (f"{GROUP}law = 'coulomb+iwan'\nparameters = {{sliders = 2.5}}", "sliders: expected a whole number"),
        ("[rig]\nmass_kg = 1\nstiffness_n_per_m = 1\nnatural_frequency_hz = 9\n", r"rig: .*contradicts"),
        ("[rig]\nkind = 'shaken'\n", r"line 2: rig\.kind: expected 'base-excited' or 'prescribed'"),
        (
            "[infer]\nlevels = {gradient = 'house'}\n",
            r"infer\.levels\.gradient: expected 'material' or 'test'; got 'house'",
        ),
        ("[infer]\nlevels = {lag_s = 'test'}\n", r"infer: levels\.lag_s: no law has such a parameter; expected one of"),
        ("[infer]\npriors = {beta = [-0.3, 0.1]}\n", r"priors\.beta: expected a .*; got -0\.3"),
        ("[infer]\npriors = {beta = [0.3, 0.0]}\n", r"priors\.beta: expected \[value, standard deviation > 0\]"),
        ("[rig\n", r"expected TOML"),
        ("[analysis]\ntransient_s = nan\n", r"analysis\.transient_s"),
        ("folder = '/etc'\n", r"folder: unknown key"),
        (TWO_STOREYS.replace("[[rig.masses]]", "[rig]\nmass_kg = 1\n[[rig.masses]]", 1), "mass_kg: say the same as"),
        (TWO_STOREYS.replace("mass = 2", "mass = 3"), r"rig: contacts\.0: expected a mass from 1 to 2; got 3"),
        (TWO_STOREYS.replace("against = 1", "against = 2"), r"contacts\.0: against: .* got 2, the mass itself"),
        (TWO_STOREYS + "beta = 0.2\n", "expected the friction once, .* got beta, coefficient"),
        (TWO_STOREYS.replace("stiffness_n_per_m = 400.0", ""), r"masses\.1\.stiffness_n_per_m: is not given"),
    ],
)
def test_a_faulty_scene_is_refused_with_its_line_and_the_name_that_was_meant(
    tmp_path: Path, text: str, match: str
) -> None:
    with pytest.raises(SceneError, match=match):
        read_scene(scene_file(tmp_path, text))


def test_a_file_that_cannot_be_read_is_a_scene_error(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"nowhere\.toml: cannot be read \(No such file"):
        read_scene(tmp_path / "nowhere.toml")
    path = tmp_path / "latin.toml"
    path.write_bytes("[experiment]\nnote = 'gr\u00fcn'\n".encode("latin-1"))
    with pytest.raises(SceneError, match="expected UTF-8 text; byte 23"):
        read_scene(path)


def test_settings_are_changed_by_one_validated_call_and_a_scene_is_frozen() -> None:
    scene = scene_from_tables({"rig": {"natural_frequency_hz": 3.13}}, folder=CONFIGS)
    other = scene.changed(analysis={"cycles": "last"}, log={"unit": "µm"})
    assert (other.analysis.cycles, other.log.unit, other.rig, other.folder) == ("last", "um", scene.rig, CONFIGS)
    assert scene.analysis.cycles == "all"
    with pytest.raises(SceneError, match=r"analysis\.cycle: unknown key; did you mean cycles\?"):
        scene.changed(analysis={"cycle": "all"})
    with pytest.raises(SceneError, match=r"folder: unknown key"):
        scene.changed(folder={})
    with pytest.raises(pydantic.ValidationError, match="frozen"):
        scene.analysis.transient_s = 1.0


def test_parameters_may_be_held_for_a_law_that_is_named_later() -> None:
    assert scene_from_tables({"model": {"parameters": {"gradient": 0.1}}}).model.parameters == {"gradient": 0.1}
    both = {"law": "coulomb+place", "static_ratio": 1.2, "parameters": {"static_ratio_down": 1.1}}
    assert scene_from_tables({"model": both}).model.static_ratio == 1.2
    assert scene_from_tables({"model": {"law": "auto"}}).model.law == "auto"


def test_a_frame_of_several_masses_refers_to_its_first_storey(tmp_path: Path) -> None:
    rig = read_scene(scene_file(tmp_path, TWO_STOREYS)).rig
    assert rig.natural_frequency == pytest.approx(20.0 / (2 * math.pi))
    assert (rig.stiffness, rig.damping) == (800.0, 0.01)
    (contact,) = rig.contacts
    assert (contact.mass, contact.against, contact.parameters) == (2, 1, {"gradient": 0.1})
