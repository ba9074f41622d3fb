"""A scene is read once, validated and frozen; the facts of a test: from it, the file name and the sheet."""

import math
import re
from pathlib import Path

import pydantic
import pytest

from frictionlab.errors import SceneError
from frictionlab.experiment import facts_of, is_sheet
from frictionlab.scene import Scene, read_scene, scene_from_tables
from tests.desk import STOREYS

GROUP = """[[synthetic.tests]]
material = "a"
normal_forces_n = [1.0]
frequency_ratios = [0.5]
friction_coefficient = 0.4
"""
TWO_STOREYS = f"""{STOREYS}[[rig.contacts]]
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
        (8, r"model.law: law 'coulomb\+plce': 'plce' is no term; expected coulomb or a sum of .*; did you mean place"),
    )
    for line, (number, fault) in zip(str(caught.value).splitlines(), faults, strict=True):
        assert re.match(f"{re.escape(f'scene {path}, line {number}: ')}{fault}", line)
    assert "nput should" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("[rig]\nnatural_frequency = 3\n", r"line 2: rig\.natural_frequency: .*did you mean natural_frequency_hz\?"),
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
        ("[infer]\nlevels = {gradient = 'house'}\n", r"infer\.levels\.gradient: expected 'material' or 'test'"),
        ("[infer]\nlevels = {lag_s = 'test'}\n", r"infer: levels\.lag_s: no law has such a parameter; expected one of"),
        ("[infer]\npriors = {beta = [-0.3, 0.1]}\n", r"priors\.beta: expected a .*; got -0\.3"),
        ("[infer]\npriors = {beta = [0.3, 0.0]}\n", r"priors\.beta: expected \[value, standard deviation > 0\]"),
        ("[rig]\nmass_kg = 3,1  # kg\n", r"expected TOML.*mass_kg = 3,1  # kg: TOML writes a decimal point, 3\.1$"),
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


def test_a_file_that_is_no_utf_8_is_a_scene_error(tmp_path: Path) -> None:
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


PATTERN = "{material}_N{normal_force_n}_r{nominal_frequency_ratio}"
SHEET = 'log,material,normal_force_n,humidity\nsteel_N10_r0.5.csv,steel,10,40 %\nb,rubber,"2,5",\n'


def scene(folder: Path = Path(), **facts: str | float) -> Scene:
    return scene_from_tables({"experiment": facts}, folder=folder)


def test_the_scene_alone_says_what_it_says_and_the_defaults_nothing() -> None:
    facts = facts_of(scene(material="steel", normal_force_n=10.0), Path("x.csv"))
    assert facts.values == {"material": "steel", "normal_force_n": 10.0}
    assert facts.warnings == ()
    assert facts_of(Scene(), Path("a.csv")).values == {}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("steel_N10_r0.5.csv", ("steel", 10.0, 0.5)),
        ("steel _N10_r0.5.csv", ("steel", 10.0, 0.5)),
        ("a/b/steel_wet_N2.5_r1.csv.gz", ("steel_wet", 2.5, 1.0)),
        ("PTFE on steel_N1,25_r0,3.lvm", ("PTFE on steel", 1.25, 0.3)),
    ],
)
def test_the_file_name(name: str, expected: tuple[str, float, float]) -> None:
    facts = facts_of(scene(name_pattern=PATTERN), Path(name))
    assert tuple(facts.values.values()) == expected


def test_a_name_that_does_not_follow_is_said() -> None:
    facts = facts_of(scene(name_pattern=PATTERN), Path("test1.csv"))
    assert facts.values == {}
    assert facts.warnings == (f"the file name does not follow name_pattern {PATTERN!r}: its facts are not known",)


def test_a_contradiction_is_said_and_the_nearer_source_wins(tmp_path: Path) -> None:
    (tmp_path / "tests.csv").write_text("log;material\nsteel_N10_r0.5;brass\n")
    what = scene(tmp_path, name_pattern=PATTERN, sheet="tests.csv", normal_force_n=5.0)
    facts = facts_of(what, Path("steel_N10_r0.5.csv"))
    assert facts.values == {"material": "brass", "normal_force_n": 10.0, "nominal_frequency_ratio": 0.5}
    assert facts.warnings == (
        "normal_force_n: the file name says 10.0, the scene says 5.0: 10.0 is taken",
        "material: the sheet says brass, the file name says steel: brass is taken",
    )


def test_the_sheet(tmp_path: Path) -> None:
    (tmp_path / "tests.csv").write_text(SHEET)
    what = scene(tmp_path, sheet="tests.csv")
    found = facts_of(what, Path("logs/steel_N10_r0.5.csv")).values
    assert found == {"material": "steel", "normal_force_n": 10.0, "humidity": "40 %"}
    assert facts_of(what, Path("b.txt")).values == {"material": "rubber", "normal_force_n": 2.5}
    assert "no row for c.csv" in facts_of(what, Path("c.csv")).warnings[0]


def test_headings_in_words_with_units_are_read(tmp_path: Path) -> None:
    for head, force in (("log;material;normal force [N];f", "2,5"), ("Datei;Werkstoff;Normalkraft [kN];f", "0,0025")):
        (tmp_path / "tests.csv").write_text(f"{head} [Hz]\na;oak;{force};1,9\n")
        facts = facts_of(scene(tmp_path, sheet="tests.csv"), Path("a.csv")).values
        assert (is_sheet(tmp_path / "tests.csv"), facts["material"], facts["normal_force_n"]) == (True, "oak", 2.5)


def test_a_sheet_as_excel_saves_it_is_read_and_a_workbook_is_named(tmp_path: Path) -> None:
    what = scene(tmp_path, sheet="tests.csv")
    (tmp_path / "tests.csv").write_bytes("log;material\na;Gu\u00dfeisen\n".encode("cp1252"))
    assert facts_of(what, Path("a.csv")).values == {"material": "Gu\u00dfeisen"}
    (tmp_path / "tests.csv").write_bytes(b"PK\x03\x04" + bytes(range(256)))
    with pytest.raises(SceneError, match=r"tests\.csv: expected text; got a workbook: save its sheet as CSV \(UTF-8\)"):
        facts_of(what, Path("a.csv"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name,material\na,steel\n", "expected a `log` column"),
        ("log,material\na\n", "row 2: expected 2 cells; got 1"),
        ("log,material\na,x\na.csv,y\n", "2 rows for a.csv: expected one"),
        ("log,normal_force_n\na,heavy\n", "row 2: normal_force_n: expected a number above 0; got 'heavy'"),
        ("log,normal_force_n\n,\n\nb,10\na,-3\n", "row 5: normal_force_n: expected a number above 0; got '-3'"),
        ("log,normal_force_n\na,inf\n", "row 2: normal_force_n: expected a number above 0; got 'inf'"),
        ("log,normal force [mm]\na,3\n", r"column 'normal force \[mm\]': expected a unit like N; got mm"),
        ("log,material\n../../etc/passwd,steel\n", "leaves the sheet's folder"),
        ("log,base log\na,../passwd\n", "leaves the sheet's folder"),
        ("", "expected a `log` column"),
    ],
)
def test_a_faulty_sheet_is_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "tests.csv").write_text(text)
    with pytest.raises(SceneError, match=rf"experiment\.sheet: tests\.csv: .*{words}"):
        facts_of(scene(tmp_path, sheet="tests.csv"), Path("a.csv"))


def test_a_sheet_cannot_leave_the_scenes_folder(tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("log,material\na,steel\n")
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "link.csv").symlink_to(tmp_path / "secret.csv")
    for name in ("../secret.csv", str(tmp_path / "secret.csv"), "link.csv"):
        with pytest.raises(SceneError, match="lies outside the scene's folder"):
            facts_of(scene(inner, sheet=name), Path("a.csv"))
    with pytest.raises(SceneError, match="cannot be read"):
        facts_of(scene(inner, sheet="none.csv"), Path("a.csv"))


def test_a_weight_is_a_normal_force() -> None:
    found = facts_of(scene(name_pattern="{material}_{normal_force_g}g"), Path("steel_250g.csv")).values
    assert found == {"material": "steel", "normal_force_n": pytest.approx(2.4516625)}


@pytest.mark.timeout(5)
def test_a_long_name_of_many_fields_is_done_in_a_moment() -> None:
    pattern = "{material}_{repeat}_{operator}_{date}_{note}x"
    facts = facts_of(scene(name_pattern=pattern), Path("_" * 230))
    assert "does not follow" in facts.warnings[0]


@pytest.mark.parametrize("pattern", ["{weight}", "no keys", "{material}{material}", "{material}{note}"])
def test_a_faulty_pattern_is_refused(pattern: str) -> None:
    with pytest.raises(SceneError, match=r"experiment\.name_pattern: expected keys in braces"):
        facts_of(scene(name_pattern=pattern), Path("a.csv"))


def test_a_column_that_is_no_fact_is_named_where_a_fact_is_not_known(tmp_path: Path) -> None:
    (tmp_path / "tests.csv").write_text("log,material,weight [g]\na,steel,250\n")
    (said,) = facts_of(scene(tmp_path, sheet="tests.csv"), Path("a.csv")).warnings
    assert said.startswith("normal_force_n of this test is not known; the sheet's weight [g] is taken as a remark")
    assert "normal_force_g" in said
