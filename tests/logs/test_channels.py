"""Further channels: force, velocity, acceleration, angle, several masses; units of the wrong kind are refused."""

import re
from pathlib import Path

import numpy as np
import pytest

from frictionlab.errors import LogError, RecordingError
from frictionlab.hdf5 import read_recording, write_recording
from frictionlab.log_options import LogOptions
from frictionlab.logs import read_log
from tests.desk import invoke, published
from tests.logs import samples

T = np.arange(400) / 200.0
X = 2.0 * np.sin(2 * np.pi * T)
FORCE = 3.0 * np.cos(2 * np.pi * T)


def log(folder: Path, **columns: np.ndarray) -> Path:
    return samples.log(folder / "log.csv", ",".join(columns), *columns.values())


def test_channels_are_found_by_name_and_unit_and_kept_in_si(tmp_path: Path) -> None:
    path = log(
        tmp_path,
        **{"time [s]": T, "mass 1 [mm]": X, "mass 2 [mm]": 2 * X, "base [mm]": X, "friction [kN]": FORCE},
        **{"normal [lbf]": FORCE, "mass velocity [mm/s]": X, "acc base [g]": X, "torque [Nmm]": X, "angle [deg]": X},
    )
    recording = read_log(path)
    found = recording.measured()
    assert list(found) == [
        *("mass_displacement", "base_displacement", "mass_2_displacement", "contact_force", "normal_force"),
        *("mass_velocity", "base_acceleration", "torque", "angle"),
    ]
    factors = [1e-3, 1e-3, 2e-3, 1e3, 4.4482216152605, 1e-3, 9.80665, 1e-3, np.pi / 180]
    values = [X, X, X, FORCE, FORCE, X, X, X, X]
    for name, factor, column in zip(found, factors, values, strict=True):
        np.testing.assert_allclose(found[name], factor * column, rtol=1e-12, atol=1e-8 * factor)
    assert recording.source.dialect["contact_force_column"] == "friction [kN]"
    write_recording(recording, tmp_path / "a.h5")
    again = read_recording(tmp_path / "a.h5")
    one, other = ([(c.name, c.unit, c.sensor) for c in each.channels] for each in (again, recording))
    assert one == other
    for name, column in again.measured().items():
        np.testing.assert_array_equal(column, found[name])


def test_units_in_capitals_and_without_brackets_are_read_and_what_may_be_two_is_asked(tmp_path: Path) -> None:
    found = read_log(log(tmp_path, **{"TIME [S]": T, "TORQUE [NM]": X, "ANGLE [DEG]": X, "friction force / kN": FORCE}))
    np.testing.assert_allclose(found.torque, X, atol=1e-8)
    np.testing.assert_allclose(found.contact_force, 1e3 * FORCE, atol=1e-5)
    with pytest.raises(LogError, match=r"no column for mass and base: .*in NM, .*: correct the units in"):
        read_log(log(tmp_path, **{"t [s]": T, "M1 [NM]": X, "M2 [NM]": X}))
    with pytest.raises(LogError, match=r"no column for mass and base: .*: if it is the mass's, give --mass-accel.* 2;"):
        read_log(log(tmp_path, **{"t [s]": T, "acceleration [g]": X}))
    for title, words in (("acc_m/s2", "--mass-acceleration 2"), ("v_mm/s", "--mass-velocity 2")):
        with pytest.raises(LogError, match=f"no column for mass: .*{words}"):  # were taken as mm after --unit mm
            read_log(log(tmp_path, **{"t_s": T, title: X, "y_mm": X}), LogOptions(unit="mm"))
    turned = read_log(log(tmp_path, t_s=T, angle_deg=X, torque_Nm=X))
    np.testing.assert_allclose(turned.angle, np.deg2rad(X), atol=1e-8)
    with pytest.raises(ValueError, match="such as force=kN or mass=5 mm/V"):
        LogOptions(units="mass=1.2.3 mm/V")
    mils = read_log(log(tmp_path, **{"t [s]": T, "mass [mil]": X, "base [thou]": X}))
    np.testing.assert_allclose(mils.mass_displacement, 2.54e-5 * X, atol=1e-13)
    np.testing.assert_array_equal(mils.mass_displacement, mils.base_displacement)


@pytest.mark.parametrize(
    ("unit", "size"), [("cN", 1e-2), ("daN", 10.0), ("nN", 1e-9), ("MN", 1e6), ("parsec", 0.0), ("V", 0.0)]
)
def test_a_normal_force_in_any_unit_is_read_or_named(unit: str, size: float, tmp_path: Path) -> None:
    """In cN it was dropped without a word, and the coefficient rested on the scene's normal force."""
    path = log(tmp_path, **{"t [s]": T, "mass [mm]": X, "base [mm]": X, f"normal [{unit}]": FORCE, "index": T})
    recording = read_log(path)
    said = recording.source.warnings
    if size:
        assert not said
        np.testing.assert_allclose(recording.normal_force, size * FORCE, atol=1e-8 * size)
    else:
        assert "normal_force" not in recording.measured()
        units = "'normal_force=50 N/V', or" if unit == "V" else "normal_force=UNIT, which is one of N, mN, uN"
        assert [f"--normal-force 4 --units {units}" in w for w in said] == [True]
        assert read_log(path, LogOptions(normal_force=4, units=f"normal_force={'50 N/V' if unit == 'V' else 'N'}"))


CALIBRATED = {  # title, role, unit of its calibration
    "friction [V]": ("contact_force", "N/V"), "friction": ("contact_force", "N/V"), "Fn": ("normal_force", "kN/V"),
    "mass velocity [mV]": ("mass_velocity", "m/s/mV"), "moment": ("torque", "Nm/mV"),
}  # fmt: skip


@pytest.mark.parametrize("title", CALIBRATED)
def test_a_declared_calibration_takes_the_column_that_is_called_so_or_named(title: str, tmp_path: Path) -> None:
    """Of "friction [V]" and "4 N/V" of the scene, newtons were advised: a quarter of the friction, without a word."""
    (role, unit), plain = CALIBRATED[title], {"t [s]": T, "mass [mm]": X, "base [mm]": X}
    options = LogOptions(units=f"{role}=4 {unit}")
    for name, said in ((title, options), (title.replace("i", "o").replace("F", "C"), options.but(**{role: 4}))):
        recording = read_log(log(tmp_path, **plain, **{name: FORCE}), said)
        assert recording.source.warnings == ()
        times = 4 * 1e3 ** (unit[0] == "k") * 1e3 ** (unit.endswith("mV") and "mV" not in title)
        np.testing.assert_allclose(recording.measured()[role], times * FORCE, rtol=1e-6, atol=1e-4)


def test_volts_that_are_not_taken_are_said(tmp_path: Path) -> None:
    one = read_log(
        log(tmp_path, **{"t [s]": T, "mass [V]": X, "[V]": FORCE}),
        LogOptions(units="contact_force=4 N/V", contact_force=3),
    )
    assert list(one.measured()) == ["contact_force"]
    assert one.source.warnings == ("column 2 ('mass [V]') is not taken: say what a volt is, --units 'mass=5 mm/V'",)
    path = log(tmp_path, **{"t [s]": T, "mass [mm]": X, "base [mm]": X, "[V]": FORCE, "side [mm]": X})
    said = read_log(path, LogOptions(units="contact_force=4 N/V,normal_force=9 N/V")).source.warnings
    assert said[0] == "contact_force: a volt of it is declared, but no column is called so: give --contact-force"
    assert said[-1].startswith("column 5 ('side [mm]') is a length, and not taken: ")
    assert "--mass 2+5 or --base 3+5" in said[-1]
    said = read_log(
        log(tmp_path, **{"t [s]": T, "torque [N]": FORCE, "speed [m/s]": X, "angle [deg]": X})
    ).source.warnings
    assert [w.partition(":")[0] for w in said] == [
        f"{q}, not taken, for no name says of what" for q in ("force", "velocity")
    ]
    path = log(tmp_path, **{"side [mm]": X, "base [mm]": X, "t [s]": T, "mass [mm]": X})
    assert "--mass 4+1 or --base 2+1" in read_log(path).source.warnings[-1]  # as if the mass were always the second


def test_a_log_without_displacements_is_a_recording_that_says_what_it_lacks(tmp_path: Path) -> None:
    path = log(tmp_path, **{"t [s]": T, "Normal [N]": FORCE, "Friction [N]": FORCE, "Position [mm]": X})
    recording = read_log(path)
    assert list(recording.measured()) == ["mass_displacement", "normal_force", "contact_force"]
    with pytest.raises(RecordingError, match=r"base_displacement: not measured here: .*got mass_displacement, normal"):
        _ = recording.base_displacement
    write_recording(recording, tmp_path / "a.h5")
    assert list(read_recording(tmp_path / "a.h5").measured()) == list(recording.measured())
    assert len(recording.changed(experiment={"material": "steel"}).stretches()) == 1


WRONG: list[tuple[str, str, dict[str, object], str]] = [  # a column's title, in place of mass or beside; options; words
    *(
        ("mass", f"mass [{unit}]", {"mass": 2, "base": 3, **said}, rf"column 2 .* is in {re.escape(unit)}.*a length")
        for unit in ("kip", "uN", "kN", "lbf", "m/s", "mm/s", "g", "m/s^2", "deg", "rad", "rpm", "Nm", "bar", "kg", "s")
        for said in ({}, {"unit": "mm"})
    ),
    ("mass", "mass [V]", {"mass": 2}, r"expected a length, .*or give what a volt is, such as mass = .5 mm/V"),
    ("mass", "mass [parsec]", {"mass": 2}, r"the unit of column 2 .* is not known: expected a length: give --unit"),
    ("time", "time [mm]", {"time": 1}, r"time column 1 .* is in mm: give --time, or --time-unit"),
    ("F", "F [mm]", {"contact_force": "F"}, r"is in mm \(displacement\): expected a force, one of N, mN"),
    ("F", "F [g]", {"contact_force": "F"}, r"expected a force.*if the grams are a load say --units contact_force=gf"),
    ("F", "F [V]", {"contact_force": "F"}, r"expected a force.*or give what a volt is, such as contact_force = .50 N"),
    ("F", "F", {"contact_force": "F"}, "unit of column 4 .* is not said: expected a force: give --units contact_force"),
    ("F", "F [N]", {"contact_force": "F", "units": "force=2 N/V"}, "expected volts, for which the units of"),
    ("F", "F [m/s]", {"contact_force": "F"}, r"is in m/s \(velocity\): expected a force"),
    ("v", "v [Nm]", {"mass_velocity": "v"}, r"is in Nm \(torque\): expected a velocity"),
    ("v", "v [g]", {"mass_velocity": "v"}, r"is in g \(acceleration\): expected a velocity"),
    ("a", "a [mm]", {"base_acceleration": "a"}, r"is in mm \(displacement\): expected an acceleration"),
    ("M", "M [N]", {"torque": "M"}, r"is in N \(force\): expected a torque"),
    ("phi", "phi [rpm]", {"angle": "phi"}, r"is in rpm \(angular velocity\): expected an angle"),
    ("F", "F [N]", {"torque": 9}, "--torque '9': no such column"),
]


@pytest.mark.parametrize(("place", "title", "options", "words"), WRONG)
def test_a_column_in_a_wrong_or_doubtful_unit_is_refused_by_name(
    place: str, title: str, options: dict[str, object], words: str, tmp_path: Path
) -> None:
    columns = {"time": ("time [s]", T), "mass": ("mass [mm]", X), "base": ("base [mm]", X)}
    columns[place] = title, (T if place == "time" else FORCE)
    path = log(tmp_path, **dict(columns.values()))
    with pytest.raises(LogError, match=words):
        read_log(path, LogOptions(**options))  # type: ignore[arg-type]


def test_force_names_a_column_or_replaces_an_output(tmp_path: Path) -> None:
    path = log(tmp_path, **{"time [s]": T, "mass [mm]": X, "base [mm]": X, "p": FORCE})
    for words in (["--force", "p", "--units", "force=N"], ["--force", "--force=4", "--units", "force=N"], ["--force"]):
        invoke("ingest", path, *words, "-o", tmp_path / "a.h5", status=0)
        found = read_recording(tmp_path / "a.h5").measured()
        assert ("contact_force" in found) == (len(words) > 1)


def test_grams_of_a_load_are_newtons_where_the_options_say_so(tmp_path: Path) -> None:
    """A tribometer's head: names, units below, a comma at the end, a blank line, the title of a time in sec."""
    rows = (f"{x},{v},{g},{t}" for x, v, g, t in zip(X, X, FORCE, T, strict=True))
    path = tmp_path / "umt.csv"
    path.write_text("\n".join(["X,V,Fx,T", "mm,mm/sec,g,sec,", "", *rows, ""]))
    recording = read_log(path, LogOptions(mass="X", contact_force="Fx", units="contact_force=gf"))
    assert recording.contact_force == pytest.approx(FORCE * 9.80665e-3)
    assert recording.mass_displacement == pytest.approx(X * 1e-3)


def test_what_fits_twice_is_left_out_and_said(tmp_path: Path) -> None:
    path = log(tmp_path, **{"time [s]": T, "mass [mm]": X, "base [mm]": X, "force 1 [N]": X, "force 2 [N]": X})
    recording = read_log(path)
    assert list(recording.measured()) == ["mass_displacement", "base_displacement"]
    assert "could each be contact force: none is taken; give --contact-force" in recording.source.warnings[0]
    assert list(read_log(path, LogOptions(contact_force="force 2")).contact_force) == list(FORCE * 0 + X.round(9))


def test_two_lasers_of_one_place_are_one_channel_by_their_noise(tmp_path: Path) -> None:
    noisy = {s: X + s * np.random.default_rng(1).standard_normal((2, 400))[int(s > 0.01)] for s in (0.01, 0.02)}
    path = log(tmp_path, **{"t [s]": T, **{f"mass {s} [mm]": x for s, x in noisy.items()}, "base [mm]": X})
    with pytest.raises(LogError, match=r"fit equally well: give --mass, or if all see one place --mass 2\+3$"):
        read_log(path)
    found = read_log(path, LogOptions(mass="2+mass 0.02")).mass_displacement
    assert np.std(found - 1e-3 * X) == pytest.approx(1e-5 * np.sqrt(0.8), rel=0.06)


def test_a_hole_in_a_force_is_bridged_or_cuts(tmp_path: Path) -> None:
    path = log(tmp_path, **{"time [s]": T, "mass [mm]": X, "base [mm]": X, "force [N]": FORCE})
    lines = path.read_text().splitlines()
    for i in (50, *range(200, 240)):
        lines[i] = lines[i].rpartition(",")[0] + ",nan"
    path.write_text("\n".join(lines) + "\n")
    recording = read_log(path)
    assert [recording.flag_counts()[name] for name in ("no_value", "interpolated")] == [41, 1]
    assert [len(part) for part in recording.stretches()] == [199, 161]


def test_spikes_of_a_force_a_velocity_and_an_acceleration_are_set_aside(tmp_path: Path) -> None:
    """60 of 20,000 samples made 0.94 N of 0.857, no stop of two, and an amplitude of 20 mm of 2.4; a flip is none."""
    t, rng = np.arange(0.0, 20.0, 0.002), np.random.default_rng(5)
    v, hit = np.maximum(np.sin(2 * np.pi * t), 0.3) - 0.3, rng.choice(len(t), 30, replace=False)
    for head, signal in (("friction [N]", np.sign(v - 0.2)), ("mass velocity [m/s]", v), ("mass acc [g]", np.sign(v))):
        seen = signal + 0.003 * rng.standard_normal(len(t))
        for times in (0.0, 3.0):
            seen[hit] += times * rng.choice([-1.0, 1.0], len(hit))
            found = read_log(log(tmp_path, **{"t [s]": t, head: seen}))
            assert np.flatnonzero(found.quality).tolist() == (sorted(hit.tolist()) if times else [])
        assert "30 values (0.3 %) jump off the motion and back (spikes), by up to" in found.source.warnings[0]


MODELS, KONRAD = "jchristopherson+FrictionModels.jl/examples", "KonradMnich+friction-identification/input"
LADISK, G = "ladisk+lvm_read/data", 9.80665
SAID = "mass_velocity=m/s,mass_acceleration=m/s2,normal_force=N,contact_force=N"
PUBLISHED: list[tuple[str, dict[str, str], dict[str, tuple[float, float]]]] = [
    (f"{MODELS}/test_data_2.txt", {},
     {"mass_displacement": (-0.1100356, -0.1097959), "normal_force": (-0.0008834, 5.0035969)}),
    (f"{MODELS}/test_data_1.csv",
     {"mass_velocity": "Velocity", "normal_force": "Normal", "contact_force": "Friction", "units": SAID},
     {"contact_force": (-24.660393, 24.629006), "normal_force": (100.0, 100.0)}),
    ("okilitive+CETR-tribometer/data/HT-2n-6-4 2_002.csv",
     {"mass": "X", "contact_force": "Fx", "normal_force": "Fz", "units": "contact_force=gf,normal_force=gf"},
     {"contact_force": (-0.16115271 * G, 0.184470566 * G), "normal_force": (-0.205976547 * G, -0.19612326 * G)}),
    (f"{KONRAD}/sample_workspace_3.mat",
     {"mass_velocity": "v", "mass_acceleration": "a", "contact_force": "F_fric", "unit": "m", "units": SAID},
     {"mass_displacement": (0.0, 0.15392032596992083), "contact_force": (-0.06835377698107492, 56.8449579334)}),
    (f"{KONRAD}/a3NI.csv", {"contact_force": "Force", "units": "contact_force=50 N/V"},
     {"contact_force": (-48.0928686, 21.81582037)}),
    (f"{LADISK}/short.lvm", {}, {"mass_acceleration": (1.204792, 1.222088)}),
    (f"{LADISK}/short_new_line_end.lvm", {}, {"mass_acceleration": (1.204792, 1.222088)}),
    (f"{LADISK}/with_comments.lvm", {}, {"temperature": (5.310735, 5.619287)}),
    (f"{LADISK}/long_single_header_multi_ch.lvm", {}, {"mass_acceleration": (-1.740318, 1.554889)}),
    (f"{LADISK}/multi_time_column.lvm", {"mass_acceleration": "Acceleration"},
     {"mass_acceleration": (0.467541 * G, 0.532608 * G)}),
    (f"{LADISK}/no_decimal_separator.lvm", {"mass_acceleration": "ax", "base_acceleration": "ay"},
     {"mass_acceleration": (-0.025979 * G, 0.059248 * G), "base_acceleration": (-0.031060 * G, -0.013517 * G)}),
    (f"{LADISK}/with_empty_fields.lvm", {"mass": "Dev0/Ai0", "base": "Dev0/Ai2", "unit": "mm"},
     {"mass_displacement": (-20.074e-6, -9.206e-6), "base_displacement": (7.250977e-3, 7.254639e-3)}),
]  # fmt: skip


@pytest.mark.parametrize(("path", "options", "ranges"), PUBLISHED)
def test_recordings_that_others_have_published_are_read(
    path: str, options: dict[str, str], ranges: dict[str, tuple[float, float]]
) -> None:
    found = read_log(published(path), LogOptions(**options)).measured()  # type: ignore[arg-type]
    for name, (low, high) in ranges.items():
        assert (found[name].min(), found[name].max()) == pytest.approx((low, high), rel=1e-8)
