"""A campaign on a tribometer: motions are given, forces measured; there is no frame, and so no frequency ratio."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

import frictionlab as fl
from frictionlab.analysis.measurement import measure
from frictionlab.campaign import Campaign
from frictionlab.errors import UsageError
from frictionlab.hdf5 import write_recording
from frictionlab.inference.material_law import read_material_law
from frictionlab.inference.predictive import predict_tests
from frictionlab.recording import Channel, Recording
from frictionlab.scene import scene_from_tables
from frictionlab.tables import read_rows
from frictionlab.verbs.evaluate import evaluate, publish
from tests.desk import present

GIVEN: dict[str, dict[str, object]] = {"rig": {"kind": "prescribed"}, "sensors": {"gain_error": 1e-4}}
TRUE = {"brass": (0.31, 12.0), "felt": (0.22, 0.0)}  # friction coefficient, dashpot in N s/m
SETTINGS = ((10.0, 4e-3, 0.8), (10.0, 6e-3, 1.1), (20.0, 5e-3, 0.6), (20.0, 3e-3, 1.5))  # N, m, Hz


def stroked(
    material: str,
    setting: tuple[float, float, float],
    generator: np.random.Generator,
    *,
    times: float = 1.0,
    channel: bool = False,
    true: Sequence[float] = (),
) -> Recording:
    """20 s of a contact that is moved to and fro; ``times`` its friction; ``channel``: the normal force is measured."""
    (newtons, stroke, hz), (coefficient, dashpot) = setting, true or TRUE[material]
    t = np.arange(0.0, 20.0, 0.004)
    turn = 2.0 * math.pi * hz
    x, v = stroke * np.sin(turn * t + 0.4), stroke * turn * np.cos(turn * t + 0.4)
    force = times * coefficient * newtons * np.sign(v) + dashpot * v
    force = force + 0.01 * newtons * generator.standard_normal(len(t))
    normal = newtons * (1.0 + 0.002 * generator.standard_normal(len(t))) * (1.0 + 0.004 * generator.standard_normal())
    more = (Channel("normal_force", normal),) if channel else ()
    shown = x + 1e-6 * generator.standard_normal(len(t))
    known = {"material": material} | ({} if channel else {"normal_force_n": newtons})
    return Recording(t, shown, None, channels=(Channel("contact_force", force), *more), experiment=known)


def campaign_of(
    folder: Path, seed: int, *, scatter: float = 0.01, falls: float = 0.0, channel: bool = False, law: str | None = None
) -> Campaign:
    """Both materials under all settings, each test seated anew; friction ``falls`` by a power of the normal force."""
    generator, rows, known = np.random.default_rng(seed), list[Mapping[str, object]](), scene_from_tables(GIVEN)
    for material in TRUE:
        for n, setting in enumerate(SETTINGS):
            times = (1.0 + scatter * generator.standard_normal()) * (setting[0] / 10.0) ** -falls
            made = stroked(material, setting, generator, times=times, channel=channel)
            write_recording(made, path := folder / f"{seed}_{material}_{n}.h5")
            rows.append({**measure(made, known).row(), "source": path.name})
    return evaluate(rows, known, folders=[folder], law=law)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    return campaign_of(tmp_path_factory.mktemp("tests"), 1, law="auto")


def test_each_material_has_one_coefficient_and_its_law(campaign: Campaign) -> None:
    assert not campaign.failures
    for (material, (coefficient, dashpot)), test, law in zip(
        TRUE.items(), campaign.amontons, campaign.material_laws, strict=True
    ):
        assert test.holds, test.verdict
        assert abs(present(test.coefficient) - coefficient) < 2.5 * present(test.coefficient_se) < 0.1 * coefficient
        assert law.law == ("coulomb+speed" if dashpot else "coulomb")
        assert law.values["friction_coefficient"] == pytest.approx(present(test.coefficient))
        if dashpot:
            found, u = law.values["contact_damping_n_s_per_m"], math.sqrt(law.covariance[1, 1])
            assert abs(found - dashpot) < 2.5 * u < 0.2 * dashpot
        rows = [row for row in campaign.rows() if row["material"] == material]
        assert [row["normal_force_n"] for row in rows] == [10.0, 20.0]
        for row in rows:
            value, newtons = (row[key] for key in ("friction_coefficient", "friction_force_n"))
            assert isinstance(value, float)
            assert newtons == pytest.approx(value * float(str(row["normal_force_n"])))


@pytest.mark.usefixtures("one_format")
def test_it_says_what_it_cannot_give(campaign: Campaign, tmp_path: Path) -> None:
    (said,) = (note for note in campaign.notes if "tribometer" in note)
    assert all(words in said for words in ("no frequency ratio", "no energy of a loop"))
    assert not any("stiffness" in note for note in campaign.notes)
    assert {rank.rank for rank in campaign.ranking} == {None}
    page = publish(campaign, tmp_path / "out").read_text()
    assert said in page
    assert "kY²" not in page
    drawn = {path.stem for path in (tmp_path / "out" / "figures").iterdir()}
    assert drawn == {"friction", "law_brass", "law_felt"}
    law = read_material_law(tmp_path / "out" / "law_brass.toml")
    assert dict(law.rig) == {}
    with pytest.raises(UsageError, match=r"brass: found on a tribometer.*under \[rig\] of the law's file"):
        predict_tests(law, [0.5], normal_force_n=10.0, base_amplitude_m=1.8e-3)
    (measured,) = (row for row in read_rows(tmp_path / "out" / "measurements.csv") if "brass_0" in str(row["source"]))
    assert measured["predicted_energy_per_cycle"] is None
    assert measured["test_friction_ratio"] == pytest.approx(0.31, rel=0.04)


def test_tests_left_out_are_predicted_by_the_others(campaign: Campaign) -> None:
    for row in campaign.left_out:
        assert row["reason"] is None
        assert row["predicted_response_amplitude"] is None
        low, value, high = (row[f"predicted_energy_per_cycle{end}"] for end in ("_low", "", "_high"))
        assert low < value < high < 1.5 * low
        assert row["measured_energy_per_cycle"] == pytest.approx(value, rel=0.05)
        assert row["response_nrmse_own"] < 0.03
    assert sum(bool(row["band_holds"]) for row in campaign.left_out) >= 6


def test_a_law_found_on_a_tribometer_predicts_another_test(campaign: Campaign) -> None:
    """As one found on a frame does there: `--law-file` was refused for want of a frequency ratio."""
    (_, law), known, generator = campaign.material_laws, scene_from_tables(GIVEN), np.random.default_rng(7)
    for times in 1.0 + 0.01 * generator.standard_normal(8):
        found = fl.compare(stroked("felt", (15.0, 5e-3, 0.9), generator, times=times), known, law_file=law)
        assert found.friction_coefficient == pytest.approx(
            0.22 * times, abs=2.5 * present(found.friction_coefficient_u)
        )
        assert (found.verdict, found.levels["beta"]) == ("explained", "test")
        for name in ("friction_coefficient", "force_energy_per_cycle_j"):
            value, low, high = found.expected[f"predicted_{name}"]
            assert low < getattr(found, name) < high < low + 0.2 * value  # the tests have scattered by 1.8 %
    other = fl.compare(stroked("brass", SETTINGS[0], generator), known, law_file=law)
    assert any("the law does not hold here" in said for said in other.warnings)
    assert "material: brass by its name, sheet or scene, and the law is that of felt" in other.warnings
    with pytest.raises(UsageError, match="a law of a material needs the test's normal force"):
        fl.compare(stroked("felt", SETTINGS[0], generator).changed(experiment={}), known, law_file=law)


def test_a_normal_force_that_is_measured_needs_no_fact(tmp_path: Path) -> None:
    found = campaign_of(tmp_path, 2, channel=True)
    assert [round(fit.normal_force_n) for fit in found.fits] == [10, 20, 10, 20]
    felt = found.amontons[1]
    assert abs(present(felt.coefficient) - 0.22) < 2.5 * present(felt.coefficient_se)


def test_a_coefficient_that_falls_with_the_force_breaks_amontons_law(tmp_path: Path) -> None:
    found = campaign_of(tmp_path, 3, scatter=0.003, falls=0.4)
    assert [test.holds for test in found.amontons] == [False, False]
    law = found.material_laws[1]
    assert law.values["friction_n_at_10.0"] == pytest.approx(2.2, rel=0.02)
    assert law.values["friction_n_at_20.0"] == pytest.approx(4.4 * 2.0**-0.4, rel=0.02)


def test_harmonics_of_a_motion_that_is_given_are_no_doubt() -> None:
    made = stroked("felt", SETTINGS[0], np.random.default_rng(1))
    bent = made.changed(mass_displacement=made.mass_displacement + 2e4 * made.mass_displacement**3)
    assert not any("base_distortion" in said for said in measure(bent, scene_from_tables(GIVEN)).warnings)
