"""The facts of a test: from the scene, the file name and the sheet; what is missing or contradicts is said."""

from pathlib import Path

import pytest

from frictionlab.errors import SceneError
from frictionlab.experiment import facts_of
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.verbs.starting import pattern_of

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


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name,material\na,steel\n", "expected a `log` column"),
        ("log,material\na\n", "row 2: expected 2 cells; got 1"),
        ("log,material\na,x\na.csv,y\n", "2 rows for a.csv: expected one"),
        ("log,normal_force_n\na,heavy\n", "row 2: normal_force_n: expected a number; got 'heavy'"),
        ("log,normal_force_n\n,\n\nb,10\na,-3\n", "row 5: normal_force_n: expected a number above 0; got '-3'"),
        ("log,normal_force_n\na,inf\n", "row 2: normal_force_n: expected a number above 0; got 'inf'"),
        ("log,material\n../../etc/passwd,steel\n", "leaves the sheet's folder"),
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


def test_one_odd_name_leaves_the_pattern_of_the_others() -> None:
    assert pattern_of(["steel_250g", "steel_500g", "trial"]) == ("{material}_{normal_force_g}g", ("trial",))
    assert pattern_of(["steel_250g", "trial"]) == (None, ())
