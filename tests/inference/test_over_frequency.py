"""Tables over frequency: read in any dialect, and the law that was put in is found again within its errors."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import frictionlab as fl
from frictionlab.errors import AnalysisError, LogError, UsageError
from frictionlab.inference import ladder
from frictionlab.inference.table import TableObservation
from frictionlab.logs.frequencies import read_frequency_table
from frictionlab.recording import FrequencyTable
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.simulator import Problem, steady_state
from tests.desk import present, published

RATIOS = np.array([0.3, 0.5, 0.7, 0.85, 1.15, 1.3, 1.5, 1.8])
NOISE = 0.01
PUBLIC = "Adolphus8+Sequential_Ensemble_Monte_Carlo/Experimental_Example/experimental_data.mat"
FORCES = (1.4126, 0.9406, 0.6310, 0.2305)  # N, of 36 published phases by least squares on the exact steady states


def rows(beta: float = 0.4, seed: int | None = None, law: str = "coulomb", **parameters: float) -> np.ndarray:
    """r, amplitude (Y), phase (degrees behind the base) of steady states, with noise where a seed is given."""
    found = []
    for r in RATIOS:
        state = steady_state(Problem(float(r), beta, law=law, parameters=parameters))
        first = np.fft.rfft(present(state.orbit).at(np.arange(512) * np.pi / 256)[0])[1]
        found.append((r, present(state.response_amplitude), -np.rad2deg(np.angle(first))))
    made = np.array(found)
    if seed is not None:
        noise = NOISE * np.random.default_rng(seed).standard_normal((2, len(made)))
        made[:, 1] *= 1.0 + noise[0]
        made[:, 2] += np.rad2deg(noise[1])
    return made


def table(made: np.ndarray, *, stated: bool = True) -> FrequencyTable:
    none = np.full(len(made), np.nan)
    u = (NOISE * made[:, 1], np.full(len(made), NOISE)) if stated else (none, none)
    return FrequencyTable("t.csv", True, False, made[:, 0], none, made[:, 1], u[0], np.deg2rad(made[:, 2]), u[1], none)


def written(path: Path, head: str, made: np.ndarray, separator: str = ",") -> Path:
    text = "\n".join([head, *(separator.join(f"{value:.10g}" for value in row) for row in made), ""])
    path.write_text(text.replace(".", ",") if separator == ";" else text)
    return path


def scene(**experiment: object) -> Scene:
    rig = {"natural_frequency_hz": 3.0, "stiffness_n_per_m": 2000.0, "damping_ratio": 0.0, "damping_ratio_u": 1e-6}
    return scene_from_tables({"rig": rig, "experiment": experiment})


def test_a_table_without_noise_gives_the_law_that_made_it() -> None:
    made = rows(0.3, law="coulomb+compliance+speed", stiffness_ratio=15.0, contact_damping_ratio=0.05)
    found = fl.compare(table(made), scene(), law="coulomb+compliance+speed")
    values = {name: e["value"] for name, e in found.parameters.items() if name != "frame_damping_ratio"}
    assert values["beta"] == pytest.approx(0.3, rel=2e-3)
    assert values["contact_damping_ratio"] == pytest.approx(0.05, rel=2e-2)
    assert values["stiffness_ratio"] == pytest.approx(15.0, rel=0.1)
    assert (found.verdict, found.frequency_ratio, found.levels["beta"]) == ("explained", None, "material")


@pytest.mark.parametrize("stated", [True, False])
def test_errors_cover_the_truth(stated: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """20 tables a case: with errors stated, and with errors from the scatter alone."""
    monkeypatch.setattr(TableObservation, "curve", lambda *_: None)  # what is drawn takes a third of the time
    scores = []
    for seed in range(20):
        found = fl.compare(table(rows(0.4, seed), stated=stated), scene())
        scores.append(abs(found.friction_ratio - 0.4) / (found.friction_ratio_u or 1e-9))
        assert found.verdict == ("explained" if stated else None)
        assert not any("% of the table" in said for said in found.warnings)
    assert 0.5 <= np.mean(np.array(scores) < 1.0) <= 0.85
    assert np.mean(np.array(scores) < 1.96) >= 0.9


def test_millimetres_and_hertz_give_newtons(tmp_path: Path) -> None:
    """With Y as the scene says it: friction is beta k Y = 0.4 * 2000 N/m * 1.8 mm."""
    made = rows()[:, [0, 1, 1, 2, 2]] * (3.0, 1.8, 0.018, 1.0, 0.0) + (0, 0, 0, 0, 0.5)
    head = "frequency [Hz];amplitude [mm];amplitude_u [mm];phase [deg];phase_u [deg]"
    log = written(tmp_path / "t.csv", head, made, ";")
    found = fl.compare(log, scene(base_amplitude_m=1.8e-3, normal_force_n=3.6))
    assert (found.friction_force_n, found.friction_coefficient) == pytest.approx((1.44, 0.4), rel=1e-3)
    assert 0.0 < (found.friction_force_n_u or 0.0) < 0.05
    german = "Frequenz [Hz];Amplitude [mm];Phase [Grad];Basisamplitude [mm]"
    table = written(tmp_path / "de.csv", german, made[:, [0, 1, 3, 4]] * (1, 1, 1, 0) + (0, 0, 0, 1.8), ";")
    assert fl.compare(table, scene()).friction_force_n == pytest.approx(1.44, rel=1e-3)
    with pytest.raises(AnalysisError, match=r"amplitude \[mm\]: expected the base's amplitude .* base_amplitude_m"):
        fl.compare(log, scene(normal_force_n=3.6))


def test_a_base_that_differs_from_row_to_row_is_taken_into_account(tmp_path: Path) -> None:
    """The same newtons at twice the base amplitude are half the friction ratio."""
    one, two = rows(0.4), rows(0.2)
    made = np.vstack([np.column_stack([one, 0 * RATIOS + 1.0]), np.column_stack([two, 0 * RATIOS + 2.0])])
    head = "r\tamplitude [Y]\tphase [deg]\tbase amplitude [mm]"
    found = fl.compare(written(tmp_path / "t.txt", head, made, "\t"), scene())
    assert found.friction_force_n == pytest.approx(0.8, rel=1e-4)
    assert found.response_nrmse == pytest.approx(0.0, abs=1e-4)


def test_a_law_that_is_too_simple_is_said() -> None:
    found = fl.compare(table(rows(0.4, law="coulomb+speed", contact_damping_ratio=0.1)), scene())
    assert found.verdict == "misfit"
    assert any("coulomb does not explain this table" in said for said in found.warnings)
    assert fl.plot(found).axes[0].get_ylabel() == "amplitude, X / Y"
    assert fl.plot(found).axes[0].get_yscale() == "log"  # the peak at r = 1 would flatten the points
    rms = fl.compare(table(rows(0.4, 1) * (1.0, 0.5**0.5, 1.0), stated=False), scene())  # 5 errors off, without a word
    assert any("% of the table, more than errors of a measurement: are amplitudes" in said for said in rms.warnings)


@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize(("law", "known"), [("coulomb", {}), ("coulomb+speed", {"contact_damping_ratio": 0.1})])
def test_a_table_climbs_as_far_as_it_must(
    law: str, known: dict[str, float], stated: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not stated:  # nothing says what noise is, and pairs of terms are tried: those of some, for time
        monkeypatch.setattr(ladder, "EXACT", ("speed", "breakaway") if known else ("place", "speed", "compliance"))
    found = fl.compare(table(rows(0.4, 1, law, **known), stated=stated), scene(), law="auto")
    assert found.law == law
    assert [rung["law"] for rung in found.laws or () if rung["required"]] == [law]
    for name, value in {"beta": 0.4, **known}.items():
        assert found.parameters[name]["value"] == pytest.approx(value, abs=3.0 * found.parameters[name]["u"])


def test_an_error_of_r_is_an_error_of_friction() -> None:
    exact = table(rows(0.4, 3) * (1.0, 1.0, np.nan))
    vague = FrequencyTable(**{**vars(exact), "drive_u": 0.02 * exact.drive})
    plain, doubted = (fl.compare(one, scene()).friction_ratio_u or 0.0 for one in (exact, vague))
    assert doubted > 1.2 * plain > 0.0


def test_phases_of_x_over_y_and_unused_columns_are_said(tmp_path: Path) -> None:
    made = np.column_stack([rows()[:, [0, 2]] * (1.0, -1.0), RATIOS])
    found = present(read_frequency_table(written(tmp_path / "t.csv", "r,phase [deg],load", made)))
    assert np.rad2deg(found.phase) == pytest.approx(rows()[:, 2])
    assert "column 3 ('load') is not used" in found.said
    assert "phase: every one is below 0" in found.said[-1]
    made = rows()[:, [0, 1, 1]] * (1.0, 1.0, 0.01)
    for head in ("r,X / Y,X/Y_u", "r,amplitude [Y],amplitude_u"):  # an error without a unit has that of its number
        found = present(read_frequency_table(written(tmp_path / "t.csv", head, made)))
        assert np.array([found.amplitude, found.amplitude_u]) == pytest.approx(made[:, 1:].T)


@pytest.mark.parametrize(
    "head", ["frequency_Hz,gain,phase_deg", "freq [Hz];X/Y [-];phi [deg]", "f [Hz],amplitude_Y,phase_deg"]
)
def test_heads_that_laboratories_write_are_those_of_a_table(head: str, tmp_path: Path) -> None:
    mark = ";" if ";" in head else ","
    path = tmp_path / "frf.csv"
    path.write_text("\n".join([head, *([mark.join(("1.5", "1.2", "20"))] * 4)]))
    table = present(read_frequency_table(path))
    assert (table.drive[0], table.amplitude[0], table.in_metres) == (1.5, 1.2, False)
    assert np.rad2deg(table.phase[0]) == pytest.approx(20.0)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("r,amplitude,phase [deg]", r"column 2 \('amplitude'\): expected \[Y\] .* or a length .*; got no unit"),
        ("r,amplitude [Y],phase [Hz]", r"expected \[deg\] or \[rad\]; got hz"),
        ("frequency,amplitude [Y],phase [deg]", r"column 1 \('frequency'\): expected \[Hz\] or \[rad/s\]; got no unit"),
        ("r,phase [rad],phase [deg]", "are both phase: expected one"),
    ],
)
def test_units_that_are_not_said_or_wrong_are_refused(head: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(LogError, match=words):
        read_frequency_table(written(tmp_path / "t.csv", head, rows()))


def test_what_a_table_cannot_say_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="a table over frequency: expected neither law_file, whole nor fit"):
        fl.compare(table(rows()), scene(), whole=True)
    with pytest.raises(AnalysisError, match="expected more numbers than the 1 unknowns; got 1"):
        fl.compare(table(np.array([[0.5, 1.2, np.nan]])), scene())
    log = written(tmp_path / "t.csv", "omega [rad/s],phase [deg]", rows()[:, [0, 2]])
    assert present(read_frequency_table(log)).drive == pytest.approx(rows()[:, 0] / (2.0 * np.pi))
    with pytest.raises(AnalysisError, match=r"frequency \[Hz\]: the natural frequency is not known"):
        fl.compare(log)
    assert read_frequency_table(written(tmp_path / "t.csv", "f (Hz),amplitude ratio [-]", rows()[:, :2])) is not None
    assert read_frequency_table(written(tmp_path / "log.csv", "t [s],r,phase [deg]", rows())) is None


def test_a_friction_ratio_that_is_given_is_predicted_with() -> None:
    found = fl.compare(table(rows(0.4, 1)), scene(), friction_ratio=0.4)
    assert (found.friction_ratio, found.friction_ratio_u, found.verdict) == (0.4, None, "explained")


@pytest.mark.parametrize("force", range(4))
def test_the_published_phases_of_the_rig_give_its_friction_force(force: int) -> None:
    """Marino and Cicirello (2020): 1.435, 0.980, 0.663, 0.218 N; the drive is k Y = 2.5 N."""
    found, none = loadmat(published(PUBLIC), simplify_cells=True)["data"], np.full(9, np.nan)
    r, phase = found["r_exp"][:, force], np.deg2rad(found["phi"][:, force])
    seen = fl.compare(FrequencyTable("phases", True, False, r, none, none, none, phase, none, none))
    assert 2.5 * seen.friction_ratio == pytest.approx(FORCES[force], abs=2e-4)
    assert abs(seen.friction_ratio - found["coulomb_friction"][force] / 2.5) < 1.96 * (seen.friction_ratio_u or 0.0)
