"""Two logs, two clocks, and what logs call their columns: aligned, taken or asked for, and what that costs is said."""

import math
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.logs import LogOptions, read_log, read_mass_log, read_two_logs
from frictionlab.logs.dialect import moment
from frictionlab.logs.sensor import unit_by_step
from frictionlab.recording import Quality, Recording
from tests.logs.samples import Truth, assert_is, comma, log, sensortool, table, truth, write

FREQUENCY = 1.1
START = datetime(2024, 9, 14, 23, 59, 59, tzinfo=UTC)


def mass_at(t: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(2.0 * np.sin(2 * math.pi * FREQUENCY * t + 0.7) * (1.0 - np.exp(-t)))


def base_at(t: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(1.5 * np.cos(2 * math.pi * FREQUENCY * t) * (1.0 - np.exp(-t)))


def two(
    folder: Path, rates: tuple[float, float] = (250.0, 250.0), lag: float = 0.0, drift: float = 0.0
) -> tuple[Path, Path]:
    """A mass's log and a base's whose clock is ahead by ``lag`` and gains ``drift``."""
    t, u = (np.arange(0, 60, 1 / rate) for rate in rates)
    return (
        log(folder / "mass.csv", "t [s],x [mm]", t, mass_at(t)),
        log(folder / "base.csv", "t [s],x [mm]", (u + lag) * (1 + drift), base_at(u)),
    )


def absolute(
    folder: Path, *, drift: float = 0.0, creep: float = 0.0, rate: int = 250, each_s: float = 1e-3, form: str = ""
) -> tuple[Path, Path]:
    """Sixty seconds by two clocks of absolute time in whole milliseconds, or seconds; the mass's phase may creep."""
    t = np.arange(60 * rate) / rate
    seen = {"mass": (t, mass_at(t + creep * t)), "base": (t * (1 + drift), base_at(t))}
    for name, (stamps, x) in seen.items():
        moments = [START + timedelta(seconds=each_s * math.floor(stamp / each_s + 0.5)) for stamp in stamps.tolist()]
        shown = [m.strftime(form) or f"{1e3 * m.timestamp():.0f}" for m in moments]
        log(folder / f"{name}.csv", f"{'time' if form else 'epoch [ms]'},{name} [mm]", shown, x)
    return folder / "mass.csv", folder / "base.csv"


def error(recording: Recording) -> float:
    """Largest error of the base against the truth on the mass's clock [mm], ends left out."""
    inside = slice(20, -20)
    return float(np.abs(recording.base_displacement * 1e3 - base_at(recording.time))[inside].max())


@pytest.mark.parametrize(
    ("late_ms", "separator", "mark"), [(0, ";", str), (8, ";", comma), (501, "\t", comma), (3000, ";", str)]
)
def test_sensortool_pairs_are_aligned_on_epoch_time(
    late_ms: int, separator: str, mark: type[str], tmp_path: Path
) -> None:
    data = truth(2000)
    later = Truth(data.rows[: 2000 - late_ms // 4])
    mass = write(tmp_path / "protocol_ILD1420_2024-09-14_02-16-47.647.csv", sensortool(data, 1, separator, mark=mark))
    base = write(
        tmp_path / "protocol_ILD1420_2024-09-14_02-16-48.147.csv",
        sensortool(later, 2, separator, mark=mark, late_ms=late_ms),
    )
    recording = read_two_logs(mass, base)
    facts = recording.source.dialect
    assert facts["layout"] == "optoNCDT sensorTOOL"
    assert facts["alignment"] == "absolute time"
    assert facts["lag_s"] == pytest.approx(-late_ms / 1000, abs=1e-9)
    assert 0.0 < float(facts["lag_s_u"]) < 1e-3
    assert facts["base_resampled"] == ("cubic" if late_ms == 501 else "no")
    np.testing.assert_allclose(recording.time[0], math.ceil(late_ms / 4) * 0.004, atol=1e-9)
    shift = recording.time - late_ms / 1000
    inside = slice(5, -5)
    np.testing.assert_allclose(
        recording.base_displacement[inside], np.interp(shift, data.time, data.base)[inside], atol=2e-6
    )
    assert [f.lines.preamble for f in recording.source.files] == [5, 5]
    assert recording.source.lines.read == sum(f.lines.read for f in recording.source.files)


@pytest.mark.parametrize(
    ("rates", "lag"),
    [
        ((250.0, 250.0), 0.0),
        ((250.0, 250.0), 0.0123),
        ((250.0, 4000.0), 0.0),
        ((1000.0, 250.0), -2.5),
        ((500.0, 333.0), 0.0123),
    ],
)
def test_a_given_lag_and_different_rates(rates: tuple[float, float], lag: float, tmp_path: Path) -> None:
    for given, said in ((None, True), (lag, False)):
        recording = read_two_logs(*two(tmp_path, rates, lag), LogOptions(lag_s=given))
        told = [w for w in recording.source.warnings if "taken to have begun together: give --lag" in w]
        assert bool(told) == (said and rates[0] == rates[1] and lag == 0.0)
    assert recording.source.dialect["alignment"] == "lag as given"
    same = rates == (250.0, 250.0) and lag == 0.0
    assert not same or recording.source.dialect["base_resampled"] == "no"
    assert error(recording) < (1e-9 if same else 2e-6)
    assert recording.sampling_rate_hz == pytest.approx(rates[0], rel=1e-9)


@pytest.mark.parametrize(
    ("make", "drift", "options", "alignment"),
    [
        (two, 3e-4, LogOptions(lag_s=0.0), "lag as given"),
        (two, -2e-4, LogOptions(lag_s=0.0), "lag as given"),
        (absolute, 1e-4, LogOptions(), "absolute time"),
    ],
)
def test_a_slow_drift_is_found_from_the_drive(
    make: Callable[..., tuple[Path, Path]], drift: float, options: LogOptions, alignment: str, tmp_path: Path
) -> None:
    recording = read_two_logs(*make(tmp_path, drift=drift), options)
    facts = recording.source.dialect
    assert (facts["alignment"], facts["clock_drift_applied"]) == (alignment, "yes")
    assert float(facts["clock_drift"]) == pytest.approx(drift, abs=4 * float(facts["clock_drift_u"]))
    assert float(facts["clock_drift_u"]) < 1e-5
    assert error(recording) < 0.01
    assert any("clocks drift apart" in w for w in recording.source.warnings)
    left = read_two_logs(*make(tmp_path, drift=drift), options.model_copy(update={"clock_drift": 0.0}))
    assert error(left) > 0.03


def test_an_unknown_lag_is_estimated_and_said_to_be_unsure(tmp_path: Path) -> None:
    recording = read_two_logs(*two(tmp_path, lag=1.5))
    facts = recording.source.dialect
    assert facts["alignment"] == "estimated from the motions"
    assert float(facts["lag_s"]) == pytest.approx(1.5, abs=2 * float(facts["lag_s_u"]))
    assert any("looks the same as their mechanical phase" in w for w in recording.source.warnings)


@pytest.mark.parametrize(("each_s", "rate", "form"), [(1e-3, 250, ""), (1.0, 50, ""), (1.0, 50, "%H:%M:%S")])
def test_whole_milliseconds_or_seconds_are_in_the_lags_uncertainty(
    each_s: float, rate: int, form: str, tmp_path: Path
) -> None:
    """Of stamps in milliseconds that count whole seconds 0.4 ms were told."""
    recording = read_two_logs(*absolute(tmp_path, each_s=each_s, rate=rate, form=form))
    facts = recording.source.dialect
    assert facts["alignment"] == "absolute time"
    assert float(facts["lag_s_u"]) == pytest.approx(0.41 * each_s, rel=0.05)
    said = [w for w in recording.source.warnings if "to +- 0.41 s only: energy per cycle" in w]
    assert len(said) == (each_s == 1.0)


def test_a_phase_that_creeps_faster_than_clocks_drift_is_left_and_said(tmp_path: Path) -> None:
    recording = read_two_logs(*absolute(tmp_path, creep=1e-3))
    facts = recording.source.dialect
    assert facts["clock_drift_applied"] == "no"
    assert float(facts["lag_s_u"]) == pytest.approx(0.5 * 1e-3 * 60, rel=0.1)
    assert any("more than clocks do" in w for w in recording.source.warnings)
    assert any("aligned (absolute time) to +- 0.03 s only" in w for w in recording.source.warnings)


def test_a_lag_that_is_given_may_have_its_uncertainty(tmp_path: Path) -> None:
    logs = two(tmp_path, lag=0.5)
    for given, expected in ((None, 0.004 / math.sqrt(12)), (1e-4, 1e-4)):
        recording = read_two_logs(*logs, LogOptions(lag_s=0.5, lag_s_u=given, clock_drift=0.0))
        assert recording.source.dialect["lag_s_u"] == pytest.approx(expected)


def test_a_clock_that_was_set_inside_a_log_is_refused_by_size(tmp_path: Path) -> None:
    t = np.arange(5000) / 250
    mass = log(tmp_path / "mass.csv", "t [s],x [mm]", np.where(t < 1.0, t, t + 1.7e9), mass_at(t))
    base = log(tmp_path / "base.csv", "t [s],x [mm]", t, base_at(t))
    with pytest.raises(LogError, match=r"the stamps jump from 0.996 to 1.7e\+09 s: 5000 samples"):
        read_two_logs(mass, base)


def test_what_is_trimmed_is_counted_and_logs_that_do_not_overlap_are_refused(tmp_path: Path) -> None:
    recording = read_two_logs(*two(tmp_path, lag=-1.0), LogOptions(lag_s=-1.0))
    assert recording.source.dialect["trimmed_mass_samples"] == 0
    shorter = read_two_logs(*two(tmp_path), LogOptions(lag_s=-1.0)).source.dialect
    assert (shorter["trimmed_mass_samples"], shorter["trimmed_base_samples"]) == (250, 250)
    with pytest.raises(LogError, match=r"do not overlap: on the mass's clock it runs from 0 to 59\.996 s"):
        read_two_logs(*two(tmp_path), LogOptions(lag_s=1000.0))


def test_damage_of_either_log_is_flagged(tmp_path: Path) -> None:
    mass, base = two(tmp_path)
    lines = base.read_text().splitlines()
    lines[1000] = lines[1000].split(",")[0] + ",---"
    del lines[5000:5100]
    base.write_text("\n".join(lines) + "\n")
    recording = read_two_logs(mass, base, LogOptions(lag_s=0.0))
    assert recording.quality[999] & Quality.INTERPOLATED
    assert len(recording.stretches()) == 2
    (gap,) = recording.gaps
    assert gap[1] - gap[0] > 0.39


DATA = truth(300)
T, X, Y = DATA.columns
MOMENTS = [START + timedelta(seconds=float(t)) for t in T]


@pytest.mark.parametrize(
    ("titles", "forms"),
    [
        ("Date,Time", ("%Y-%m-%d", "%H:%M:%S.%f")),
        ("Date,Time", ("%d.%m.%Y", "%H:%M:%S.%f")),
        ("Date,Time", ("%m/%d/%Y", "%I:%M:%S.%f %p")),
        ("Date,Time", ("%d/%m/%Y", "%H:%M:%S.%f")),
        ("Timestamp", ("%m/%d/%Y %I:%M:%S.%f %p",)),
        ("Timestamp,x,y\nMM/DD/YYYY hh:mm:ss.ms,mm,mm", ("%m/%d/%Y %I:%M:%S.%f %p",)),
        ("Datum", ("%Y-%m-%d %H:%M:%S.%f",)),
        ("Datum", ("%d.%m.%Y %H:%M:%S.%f",)),
        ("epoch", ("",)),
    ],
)
def test_moments_in_one_column_or_two_are_read_over_midnight(
    titles: str, forms: tuple[str, ...], tmp_path: Path
) -> None:
    stamps = [[m.strftime(form) or f"{1e3 * m.timestamp():.0f}" for m in MOMENTS] for form in forms]
    head = titles if "\n" in titles else f"{titles},x [mm],y [mm]"
    recording = read_log(log(tmp_path / "a.csv", head, *stamps, X, Y))
    assert_is(recording, DATA, within=1e-9)
    assert recording.source.dialect["start_time"] == "2024-09-14T23:59:59.000+00:00"


def test_a_clock_of_twelve_hours_has_no_thirteenth_and_a_month_its_days() -> None:
    assert moment("12:30:00 AM") == 1800.0
    assert moment("13:30:00 PM") is moment("2/30/2024 1:00:00 AM") is None
    zones = ("2026-03-01T10:00:00.5+02:00", "2026-03-01 03:30:00.5-0430", "2026-03-01T08:00:00.5Z")
    assert len({moment(zone) for zone in zones}) == 1


def test_a_german_clock_and_marks_between_thousands(tmp_path: Path) -> None:
    """The cause of the second was said only once mass, base and decimal mark had been given."""
    clocks = [m.strftime("%H:%M:%S,%f") for m in MOMENTS]
    t, x, y = ([comma(cell) for cell in cells] for cells in zip(*DATA.rows, strict=True))
    german = log(tmp_path / "a.csv", "Uhrzeit;Masse [mm];Basis [mm]", clocks, x, y, separator=";")
    assert_is(read_log(german), DATA, within=1e-9)
    grouped = [f"{1e3 * v:,.2f}".translate(str.maketrans(",.", ".,")) for v in X]
    path = log(tmp_path / "b.csv", "Zeit/s;Masse/um;Basis/um", t, grouped, y, separator=";")
    for options in (LogOptions(), LogOptions(mass=2, base=3), LogOptions(mass=2, base=3, decimal=",")):
        with pytest.raises(LogError, match=r"column 2 .*has marks between thousands: .*got '-?\d\.\d{3},"):
            read_log(path, options)


def test_a_log_without_names_is_asked_about_once(tmp_path: Path) -> None:
    path = log(tmp_path / "a.csv", "", T, X, Y)
    with pytest.raises(LogError, match=r"\(time is 1\): give --mass 2 --base 3, or --mass 3 --base 2.* and --unit"):
        read_log(path)
    assert_is(read_log(path, LogOptions(mass=2, base=3)), DATA, within=1e-9)
    alone = log(tmp_path / "tap.csv", "", T, X)
    assert read_mass_log(alone, LogOptions(unit="mm")).mass_displacement == pytest.approx(DATA.mass, abs=1e-9)


def test_a_relative_displacement_is_not_taken_for_the_mass(tmp_path: Path) -> None:
    path = log(tmp_path / "a.csv", "time [s],relative [mm],base [mm]", T, X - Y, Y)
    with pytest.raises(
        LogError, match="relative displacement by its name: if it is mass minus base, give --relative 2"
    ):
        read_log(path)
    recording = read_log(path, LogOptions(relative=2))
    assert_is(recording, DATA, within=1e-9)
    assert recording.source.dialect["relative_column"] == "relative [mm]"
    own = read_log(path, LogOptions(mass="relative"))
    assert own.mass_displacement == pytest.approx(DATA.mass - DATA.base, abs=1e-9)


@pytest.mark.parametrize("unit", ["V", "mV"])
def test_volts_with_the_sensors_calibration(unit: str, tmp_path: Path) -> None:
    size = 1e3 if unit == "mV" else 1.0
    path = log(tmp_path / "a.csv", f"time [s],mass [{unit}],base [{unit}]", T, size * X / 5.0, size * Y / -2.5)
    with pytest.raises(LogError, match="for volts say what one is, --units 'mass=5 mm/V"):
        read_log(path)
    assert_is(read_log(path, LogOptions(units="mass=5 mm/V, base=-2.5 mm/V")), DATA, within=1e-9)
    said = read_log(path, LogOptions(unit="mm", mass="mass", base="base"))  # whatever the log says
    assert said.mass_displacement == pytest.approx(size * DATA.mass / 5.0, abs=1e-9 * size)
    with pytest.raises(ValueError, match=r"units\n.* expected the options that name columns, each with its unit"):
        LogOptions(units="mass=0.0 mm/V")


def test_volts_of_one_sensor_and_millimetres_of_the_other(tmp_path: Path) -> None:
    mass = log(tmp_path / "m.csv", "time [s],mass [V]", T, X / 5.0)
    base = log(tmp_path / "b.csv", "time [s],base [mm]", T, Y)
    assert_is(read_two_logs(mass, base, LogOptions(lag_s=0.0, units={"mass": "5 mm/V"})), DATA, within=1e-9)
    both = write(tmp_path / "both.csv", table(DATA, "time [s],mass [mm],base [mm]", ","))
    with pytest.raises(
        LogError, match=r"is in mm \(displacement\): expected volts, for which the units of mass say 5 mm"
    ):
        read_log(both, LogOptions(units="mass=5 mm/V"))
    assert (read_log(both, LogOptions(units="mass=-mm")).mass_displacement == -read_log(both).mass_displacement).all()


def test_steps_that_are_no_sensors_betray_no_unit(tmp_path: Path) -> None:
    """Single precision near 100 mm has steps of 7.63e-6 mm: a 500 mm sensor's, were they metres."""
    x = (100.0 + X).astype(np.float32).astype(float)
    x += np.float32(2.0**-17) * np.arange(len(x)) % 7
    assert unit_by_step(x) is None
    path = log(tmp_path / "a.csv", "time [s],mass [mm],base [mm]", T, x, Y)
    assert not any("--unit m" in w for w in read_log(path).source.warnings)


def test_a_column_that_is_no_displacement_alone_is_refused(tmp_path: Path) -> None:
    """It was taken for a log without any channel, and ended in an IndexError."""
    path = log(tmp_path / "a.csv", "load [kg]", X)
    with pytest.raises(LogError, match=r"no column for mass and base: .*; got 1 \('load \[kg\]'\) in kg"):
        read_log(path, LogOptions(sampling_rate_hz=250.0))
