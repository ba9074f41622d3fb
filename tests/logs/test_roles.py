"""What logs call their columns, and what has to be said of those that call them nothing, or something else."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from frictionlab.errors import LogError
from frictionlab.logs import LogOptions, read_log, read_mass_log, read_two_logs
from frictionlab.logs.dialect import moment
from frictionlab.logs.sensor import unit_by_step
from frictionlab.recording import Recording
from tests.logs.samples import table, truth, write

DATA = truth(300)
T, X, Y = (np.array([float(row[i]) for row in DATA.rows]) for i in range(3))
START = datetime(2024, 9, 14, 14, 16, 47, tzinfo=UTC)
MOMENTS = [START + timedelta(seconds=float(t)) for t in T]


def log(path: Path, header: str, *columns: list[str], separator: str = ",") -> Path:
    rows = "".join(separator.join(row) + "\n" for row in zip(*columns, strict=True))
    return write(path, f"{header}\n{rows}" if header else rows)


def shown(values: np.ndarray, form: str = "{:.6f}") -> list[str]:
    return [form.format(value) for value in values]


def assert_is_the_motion(recording: Recording) -> None:
    assert recording.time == pytest.approx(DATA.time, abs=1e-6)
    assert recording.mass_displacement == pytest.approx(DATA.mass, abs=1e-9)
    assert recording.base_displacement == pytest.approx(DATA.base, abs=1e-9)


@pytest.mark.parametrize(
    ("date", "clock"),
    [
        ("%Y-%m-%d", "%H:%M:%S.%f"),
        ("%d.%m.%Y", "%H:%M:%S.%f"),
        ("%m/%d/%Y", "%I:%M:%S.%f PM"),
        ("%d/%m/%Y", "%H:%M:%S.%f"),
    ],
)
def test_date_and_time_in_two_columns(date: str, clock: str, tmp_path: Path) -> None:
    days, clocks = ([m.strftime(form) for m in MOMENTS] for form in (date, clock))
    recording = read_log(log(tmp_path / "a.csv", "Date,Time,mass [mm],base [mm]", days, clocks, shown(X), shown(Y)))
    assert_is_the_motion(recording)
    assert recording.source.dialect["start_time"] == "2024-09-14T14:16:47.000+00:00"


def test_stamps_as_in_the_usa(tmp_path: Path) -> None:
    stamps = [m.strftime("%m/%d/%Y %I:%M:%S.%f PM") for m in MOMENTS]
    path = log(tmp_path / "a.csv", "Timestamp,mass [mm],base [mm]", stamps, shown(X), shown(Y))
    assert_is_the_motion(read_log(path))
    assert moment("12:30:00 AM") == 1800.0
    assert moment("13:30:00 PM") is moment("2/30/2024 1:00:00 AM") is None


def test_a_column_called_epoch(tmp_path: Path) -> None:
    stamps = [str(1726280207647 + 4 * i) for i in range(len(T))]
    assert_is_the_motion(read_log(log(tmp_path / "a.csv", "epoch,x [mm],y [mm]", stamps, shown(X), shown(Y))))


def test_a_german_clock_and_marks_between_thousands(tmp_path: Path) -> None:
    """The cause of the second was said only once mass, base and decimal mark had been given."""
    clocks = [m.strftime("%H:%M:%S,%f") for m in MOMENTS]
    x, y = ([text.replace(".", ",") for text in shown(values)] for values in (X, Y))
    assert_is_the_motion(
        read_log(log(tmp_path / "a.csv", "Uhrzeit;Masse [mm];Basis [mm]", clocks, x, y, separator=";"))
    )
    grouped = [f"{1e3 * v:,.2f}".translate(str.maketrans(",.", ".,")) for v in X]
    path = log(tmp_path / "b.csv", "Zeit/ms;Masse/um;Basis/um", shown(1e3 * T, "{:.0f}"), grouped, y, separator=";")
    for options in (LogOptions(), LogOptions(mass=2, base=3), LogOptions(mass=2, base=3, decimal=",")):
        with pytest.raises(LogError, match=r"column 2 .*has marks between thousands: .*got '-?\d\.\d{3},"):
            read_log(path, options)


def test_a_log_without_names_is_asked_about_once(tmp_path: Path) -> None:
    path = log(tmp_path / "a.csv", "", shown(T), shown(X), shown(Y))
    with pytest.raises(LogError, match=r"\(time is 1\): give --mass 2 --base 3, or --mass 3 --base 2.* and --unit"):
        read_log(path)
    assert_is_the_motion(read_log(path, LogOptions(mass=2, base=3)))
    alone = log(tmp_path / "tap.csv", "", shown(T), shown(X))
    assert read_mass_log(alone, LogOptions(unit="mm")).mass_displacement == pytest.approx(DATA.mass, abs=1e-9)


def test_a_relative_displacement_is_not_taken_for_the_mass(tmp_path: Path) -> None:
    path = log(tmp_path / "a.csv", "time [s],relative [mm],base [mm]", shown(T), shown(X - Y), shown(Y))
    with pytest.raises(
        LogError, match="relative displacement by its name: if it is mass minus base, give --relative 2"
    ):
        read_log(path)
    recording = read_log(path, LogOptions(relative=2))
    assert_is_the_motion(recording)
    assert recording.source.dialect["relative_column"] == "relative [mm]"
    own = read_log(path, LogOptions(mass="relative"))
    assert own.mass_displacement == pytest.approx(DATA.mass - DATA.base, abs=1e-9)


@pytest.mark.parametrize("unit", ["V", "mV"])
def test_volts_with_the_sensors_calibration(unit: str, tmp_path: Path) -> None:
    size = 1e3 if unit == "mV" else 1.0
    volts = [shown(size * v, "{:.9f}") for v in (X / 5.0, Y / -2.5)]
    path = log(tmp_path / "a.csv", f"time [s],mass [{unit}],base [{unit}]", shown(T), *volts)
    with pytest.raises(LogError, match="for volts say what one is, --units 'mass=5 mm/V"):
        read_log(path)
    assert_is_the_motion(read_log(path, LogOptions(units="mass=5 mm/V, base=-2.5 mm/V")))
    with pytest.raises(ValueError, match=r"units\n.* expected the options that name columns, each with its unit"):
        LogOptions(units="mass=0.0 mm/V")


def test_volts_of_one_sensor_and_millimetres_of_the_other(tmp_path: Path) -> None:
    mass = log(tmp_path / "m.csv", "time [s],mass [V]", shown(T), shown(X / 5.0, "{:.9f}"))
    base = log(tmp_path / "b.csv", "time [s],base [mm]", shown(T), shown(Y))
    assert_is_the_motion(read_two_logs(mass, base, LogOptions(lag_s=0.0, units={"mass": "5 mm/V"})))
    both = write(tmp_path / "both.csv", table(DATA, "time [s],mass [mm],base [mm]", ","))
    with pytest.raises(
        LogError, match=r"is in mm \(displacement\): expected volts, for which the units of mass say 5 mm"
    ):
        read_log(both, LogOptions(units="mass=5 mm/V"))


def test_steps_that_are_no_sensors_betray_no_unit(tmp_path: Path) -> None:
    """Single precision near 100 mm has steps of 7.63e-6 mm: a 500 mm sensor's, were they metres."""
    x = (100.0 + X).astype(np.float32).astype(float)
    x += np.float32(2.0**-17) * np.arange(len(x)) % 7
    assert unit_by_step(x) is None
    path = log(tmp_path / "a.csv", "time [s],mass [mm],base [mm]", shown(T), shown(x, "{:.9f}"), shown(Y))
    assert not any("--unit m" in w for w in read_log(path).source.warnings)


def test_a_column_that_is_no_displacement_alone_is_refused(tmp_path: Path) -> None:
    """It was taken for a log without any channel, and ended in an IndexError."""
    path = log(tmp_path / "a.csv", "load [kg]", shown(X))
    with pytest.raises(LogError, match=r"no column for mass and base: .*; got 1 \('load \[kg\]'\) in kg"):
        read_log(path, LogOptions(sampling_rate_hz=250.0))
