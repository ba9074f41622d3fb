"""Every kind of damage: caught, flagged or quarantined with its line and text; the intact lines stay bit for bit."""

import errno
import hashlib
import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from frictionlab.analysis.measurement import measure
from frictionlab.arrays import holes_of
from frictionlab.errors import LogError
from frictionlab.logs import LogOptions, read_log
from frictionlab.logs.sensor import examine, flag_dead, step_and_range
from frictionlab.recording import LineCount, Quality, Recording
from tests.analysis.seen import STEP_M, as_read, clipped, motion, scene, seen, through_laser
from tests.logs.fuzz import case, check
from tests.logs.samples import Truth, table, truth, write

DATA = truth(1000)
HEADER = "time [s],mass [mm],base [mm]"
GOOD = table(DATA, HEADER, ",").splitlines()


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Recording]:
    """Read lines as a log; the lines must add up."""

    def reader(lines: list[str], *, end: str = "\n", options: LogOptions | None = None) -> Recording:
        text = "\n".join(lines) + end
        recording = read_log(write(tmp_path / "log.csv", text), options)
        assert recording.source.lines.read == text.count("\n") + (not text.endswith("\n"))
        return recording

    return reader


def flags(recording: Recording, flag: Quality) -> list[int]:
    return np.flatnonzero(recording.quality & flag).tolist()


def with_mass(cell: str, *samples: int) -> list[str]:
    """The good log with another cell for the mass at some samples."""
    lines = list(GOOD)
    for i in samples:
        lines[i + 1] = f"{DATA.rows[i][0]},{cell},{DATA.rows[i][2]}"
    return lines


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("0.1,1.2", "expected 3 fields; got 2"),
        ("0.1,1.2,3.4,5.6", "expected 3 fields; got 4"),
        ("0.196000,1.880.200000,1.9,0.4", "expected 3 fields; got 4"),
        ("0.196000,1.88,0.40.200000,1.9,0.4", "expected 3 fields; got 5"),
        ("0.196000,1.8.8,0.400000", "field 2: not a number: '1.8.8'"),
        ("0.196000,abc,0.400000", "field 2: not a number: 'abc'"),
        ("abc,1.880000,0.400000", "field 1: not a number: 'abc'"),
        (",1.880000,0.400000", "no time stamp: ''"),
        ("nan,1.880000,0.400000", "no time stamp: 'nan'"),
        ("1e999,1.880000,0.400000", "no time stamp: '1e999'"),
        ("0.196000,1.880000,0.4", "last number cut: expected 6 decimals"),
        ("\0" * 40, "NUL bytes"),
        ("0.196000,1.8\x0080000,0.400000", "NUL bytes"),
        ("logger restarted by user", "expected 3 fields; got 1"),
        ("0.000000,1.000000,1.000000", "the time stamp runs backward"),
        ("99.000000,1.000000,1.000000", "the time stamp runs backward"),
    ],
)
def test_a_line_that_is_no_data_is_quarantined(line: str, reason: str, read: Callable[..., Recording]) -> None:
    recording = read([*GOOD[:50], line, *GOOD[51:]])
    assert [(q.number, q.text, q.reason) for q in recording.source.quarantined] == [(51, line, reason)]
    assert recording.source.lines == LineCount(read=1001, header=1, data=999, quarantined=1)
    np.testing.assert_array_equal(recording.mass_displacement, np.delete(DATA.mass, 49))
    assert flags(recording, Quality.GAP_BEFORE) == [49]
    assert len(recording.stretches()) == 1
    assert any("1 of 1001 lines are quarantined; line 51" in w for w in recording.source.warnings)


@pytest.mark.parametrize(
    "cell", ["", "-", "---", "nan", "NaN", "inf", "-inf", "∞", "-∞", "1e999", "+FFFFFFF", "XXXXXXX", "n/a", "-1.#IND"]
)
def test_a_cell_without_value_is_bridged_and_flagged(cell: str, read: Callable[..., Recording]) -> None:
    recording = read(with_mass(cell, 49))
    assert flags(recording, Quality.NO_VALUE) == flags(recording, Quality.INTERPOLATED) == [49]
    assert recording.source.lines == LineCount(read=1001, header=1, data=1000)
    by_cubic = DATA.mass[[47, 48, 50, 51]] @ [-1.0, 4.0, 4.0, -1.0] / 6.0
    assert recording.mass_displacement[49] == pytest.approx(by_cubic, rel=1e-12)
    np.testing.assert_array_equal(np.delete(recording.mass_displacement, 49), np.delete(DATA.mass, 49))
    np.testing.assert_array_equal(recording.base_displacement, DATA.base)


@pytest.mark.parametrize("code", ["203.496825", "203.50", "203.502"])
def test_error_codes_are_flagged_and_bridged(code: str, read: Callable[..., Recording]) -> None:
    recording = read(with_mass(code, 50, 51, 300))
    assert flags(recording, Quality.ERROR_CODE) == flags(recording, Quality.INTERPOLATED) == [50, 51, 300]
    assert np.abs(recording.mass_displacement).max() < 3e-3
    assert any("3 values near 203.50 mm are error codes" in w for w in recording.source.warnings)
    assert len(recording.stretches()) == 1


@pytest.mark.parametrize("offset", [0.0, 20000.0])
@pytest.mark.parametrize("none", ["9999", "-9999", "99999"])
def test_numbers_that_loggers_write_for_no_value_are_none(
    none: str, offset: float, read: Callable[..., Recording]
) -> None:
    rows = [f"{t},{1e3 * float(x) + offset:.6f},{1e3 * float(y):.6f}" for t, x, y in DATA.rows]
    rows[50] = ",".join((rows[50].split(",")[0], none, rows[50].split(",")[2]))
    recording = read(["time [s],mass [um],base [um]", *rows])
    assert flags(recording, Quality.NO_VALUE) == flags(recording, Quality.INTERPOLATED) == [50]
    assert any(f"1 values of {none} say that there is none" in w for w in recording.source.warnings)
    moving = read(["time [s],mass [um],base [um]", *(f"{0.004 * i:.3f},{9999 - i % 500},{i % 7}" for i in range(1000))])
    assert not flags(moving, Quality.NO_VALUE)


def test_a_long_run_of_error_codes_cuts_the_recording(read: Callable[..., Recording]) -> None:
    recording = read(with_mass("203.50", *range(400, 440)))
    assert flags(recording, Quality.NOT_BRIDGED) == list(range(400, 440))
    assert np.isnan(recording.mass_displacement[400:440]).all()
    assert [len(part) for part in recording.stretches()] == [400, 560]
    assert recording.gaps == ((DATA.time[399], DATA.time[440]),)
    assert any("holes longer than 0.02 s: left empty" in w for w in recording.source.warnings)
    assert [len(part) for part in read(with_mass("XXXXXXX", *range(400, 700))).stretches()] == [400, 300]
    with pytest.raises(LogError, match="998 values in 1000 lines are missing"):
        read(with_mass("XXXXXXX", *range(2, 1000)))


def test_dropped_samples_are_counted_and_a_long_gap_is_respected(read: Callable[..., Recording]) -> None:
    recording = read([*GOOD[:101], *GOOD[103:501], *GOOD[601:]])
    assert flags(recording, Quality.GAP_BEFORE) == [100, 498]
    assert flags(recording, Quality.NOT_BRIDGED) == [498]
    assert recording.source.dialect["missing_samples"] == 102
    np.testing.assert_allclose(recording.sampling_rate_hz, 250.0, rtol=1e-12)
    assert [len(part) for part in recording.stretches()] == [498, 400]
    assert any("a gap of 0.404 s after 1.996 s is longer than 0.02 s" in w for w in recording.source.warnings)
    bridged = read([*GOOD[:101], *GOOD[111:]], options=LogOptions(bridge_s=0.1))
    assert flags(bridged, Quality.GAP_BEFORE) == [100]
    assert len(bridged.stretches()) == 1


def test_repeated_stamps_are_kept_and_flagged(read: Callable[..., Recording]) -> None:
    recording = read([*GOOD[:101], GOOD[100], GOOD[100], *GOOD[101:]])
    assert flags(recording, Quality.DUPLICATED) == [100, 101]
    assert len(recording) == 1002
    (part,) = recording.stretches()
    np.testing.assert_array_equal(part.time, DATA.time)


def test_a_restart_repeats_the_header_and_is_not_measured_across(read: Callable[..., Recording]) -> None:
    recording = read([*GOOD, "", *GOOD])
    assert recording.source.lines == LineCount(read=2003, header=2, data=2000, blank=1)
    assert flags(recording, Quality.NOT_BRIDGED) == [1000]
    np.testing.assert_allclose(recording.time[1000], DATA.time[-1] + 0.004)
    assert [len(part) for part in recording.stretches()] == [1000, 1000]
    said = " ".join(recording.source.warnings)
    assert "the header is repeated (before line 1004)" in said
    assert "the clock restarted (at " in said


def test_one_of_several_tests_below_repeated_headers_is_read(read: Callable[..., Recording], tmp_path: Path) -> None:
    """--test was ignored: tests of several frequencies were one recording."""
    lines = [*GOOD, "", *with_mass("1.5", *range(900))[:901], GOOD[0]]
    second = read(lines, options=LogOptions(test=2))
    assert second.source.lines == LineCount(read=1904, header=2, data=900, preamble=1002)
    assert (len(second), float(np.ptp(second.mass_displacement)), float(second.time[0])) == (900, 0.0, DATA.time[0])
    first = read_log(tmp_path / "log.csv", LogOptions(test=1))
    np.testing.assert_array_equal(first.mass_displacement, DATA.mass)
    assert not first.quality.any()
    assert first.source.lines == LineCount(read=1002, header=1, data=1000, blank=1)
    assert not first.source.warnings
    with pytest.raises(LogError, match=r"log\.csv: --test 3: expected 1 to 2, as often as the log has its header"):
        read(lines, options=LogOptions(test=3))


def test_repeated_headers_blank_and_comment_lines_are_counted(read: Callable[..., Recording]) -> None:
    recording = read([*GOOD[:10], "", "  ", "# a note, with, commas", ",,", *GOOD[10:500], GOOD[0], *GOOD[500:], ""])
    assert recording.source.lines == LineCount(read=1007, header=2, data=1000, blank=4, comment=1)
    np.testing.assert_array_equal(recording.mass_displacement, DATA.mass)
    assert not recording.quality.any()


@pytest.mark.parametrize("cut", [1, 4, 9, 15])
def test_a_cut_last_line_is_quarantined(cut: int, read: Callable[..., Recording]) -> None:
    recording = read([*GOOD[:-1], GOOD[-1][:-cut]], end="")
    assert recording.source.lines == LineCount(read=1001, header=1, data=999, quarantined=1)
    assert [q.number for q in recording.source.quarantined] == [1001]


def test_a_last_line_without_line_end_is_data_if_it_is_provably_whole(read: Callable[..., Recording]) -> None:
    recording = read(GOOD, end="")
    assert recording.source.lines == LineCount(read=1001, header=1, data=1000)
    assert not recording.source.warnings
    rows = Truth(tuple((t, x, str(i)) for i, (t, x, _) in enumerate(DATA.rows)))
    lines = table(rows, "time [s],mass [mm],base [um]", ",").splitlines()
    unsure = read(lines, end="", options=LogOptions(unit="um"))
    assert [q.reason for q in unsure.source.quarantined] == ["the file ends inside this line: it may be cut"]


def test_values_held_at_the_end_of_the_range_are_no_stop(read: Callable[..., Recording]) -> None:
    clipped = [i for i, (_, x, _) in enumerate(DATA.rows) if float(x) > 1.6]
    recording = read(with_mass("1.600365", *clipped))
    assert flags(recording, Quality.HELD) == clipped
    assert len(recording.stretches()) > 1


def test_a_stated_interval_is_checked(read: Callable[..., Recording]) -> None:
    stated = ["Sampling time interval(ms),4.001", *GOOD]
    assert any("states a sampling interval of 0.004001 s" in w for w in read(stated).source.warnings)
    stated[0] = "Sampling time interval(ms),4"
    assert not read(stated).source.warnings


@pytest.mark.parametrize("lost", [(), (300,), (300, 301, 700)])
@pytest.mark.parametrize("stray_s", [2e-4, 7e-4])
def test_jitter_does_not_bend_the_rate(read: Callable[..., Recording], stray_s: float, lost: tuple[int, ...]) -> None:
    times = np.sort(DATA.time + np.random.default_rng(3).normal(0, stray_s, 1000))
    rows = [(f"{t:.7f}", x, y) for t, (_, x, y) in zip(times, DATA.rows, strict=True)]
    recording = read(table(Truth(tuple(np.delete(rows, lost, axis=0).tolist())), HEADER, ",").splitlines())
    np.testing.assert_allclose(recording.sampling_rate_hz, 250.0, rtol=1e-1 * stray_s)
    assert recording.source.dialect["missing_samples"] == len(lost)
    assert np.flatnonzero(recording.quality).tolist() == sorted({300, 698} & {n - (n == 700) * 2 for n in lost})


def test_holes_are_found_after_a_clock_was_set_by_years() -> None:
    time = np.arange(300_000) * 1e-4
    time[1000:] += 1e9
    assert holes_of(np.delete(time, [200_000]), 1e-4).tolist() == [1000, 200_000]


def test_a_stamp_that_strays_beside_a_hole_is_none() -> None:
    """Of three missing samples and a stamp 0.7 late within eight samples, two holes were made."""
    for beside in (-7, -4, -2, 2, 5, 8):
        time = np.arange(300.0)
        time[150:] += 3.0
        time[150 + beside] += 0.7
        assert holes_of(time, 1.0).tolist() == [150]


def test_stamps_too_coarse_to_tell_samples_apart_are_counted(read: Callable[..., Recording]) -> None:
    data = truth(4000, 4000.0)
    rows = Truth(tuple((f"{int(float(t) * 1000 + 1e-9) / 1000:.3f}", x, y) for t, x, y in data.rows))
    recording = read(table(rows, HEADER, ",").splitlines())
    assert np.diff(recording.time).min() > 0
    np.testing.assert_allclose(recording.sampling_rate_hz, 4000.0, rtol=1e-3)
    assert any("samples are counted along a straight line" in w for w in recording.source.warnings)


def test_the_unit_is_checked_by_the_sensors_step(read: Callable[..., Recording]) -> None:
    lines = table(DATA, "time [s],mass [um],base [um]", ",").splitlines()
    said = " ".join(read(lines).source.warnings)
    assert "the unit looks wrong: the log says um, but its values step like those of a laser in mm (50" in said


def test_too_much_damage_is_refused(read: Callable[..., Recording]) -> None:
    lines = list(GOOD)
    lines[1::8] = ["broken"] * len(lines[1::8])
    with pytest.raises(LogError, match=r"damaged beyond use: 125 of 1000 lines .*accepted are 10%.*first: line 2"):
        read(lines)
    assert read(lines, options=LogOptions(most_damage=0.2)).source.lines.data == 875


def test_stamps_that_do_not_increase_are_refused(read: Callable[..., Recording]) -> None:
    flat = Truth(tuple(("1.000000", x, y) for _, x, y in DATA.rows))
    with pytest.raises(LogError, match="do not increase"):
        read(table(flat, HEADER, ",").splitlines())
    backward = Truth(tuple((f"{9 - float(t):.6f}", x, y) for t, x, y in DATA.rows))
    with pytest.raises(LogError, match="run backward 999 times"):
        read(table(backward, HEADER, ",").splitlines())


def test_damage_in_the_first_data_lines_is_not_taken_for_a_header(read: Callable[..., Recording]) -> None:
    for i in (1, 2, 3):
        recording = read([*GOOD[:i], "0.1,0.2", *GOOD[i:]])
        assert recording.source.lines == LineCount(read=1002, header=1, data=1000, quarantined=1)


QUIET = [  # r, beta, rate (Hz), base amplitude (m), noise (m): a tenth of a step and less
    (0.1, 0.3, 1000.0, 0.1e-3, 0.05e-6),
    (0.3, 0.6, 4000.0, 0.5e-3, 0.07e-6),
    (0.7, 0.5, 4000.0, 1.8e-3, 0.02e-6),
    (1.2, 0.3, 4000.0, 0.1e-3, 0.25e-6),
]


def held(values: np.ndarray) -> int:
    channel = examine(np.array(values), "mass")
    assert bool(channel.warnings) == bool(channel.quality.any())
    return int(np.count_nonzero(channel.quality & np.uint8(Quality.HELD)))


@pytest.mark.parametrize(("r", "beta", "rate", "size", "noise"), QUIET)
def test_turning_points_of_a_quiet_sensor_are_no_end_of_its_range(
    r: float, beta: float, rate: float, size: float, noise: float
) -> None:
    """Up to a quarter of such logs was flagged, and the analysis refused for want of a whole cycle."""
    recording = seen(motion(r, beta), noise=noise, size=size, rate=rate, seconds=30.0)
    assert held(recording.mass_displacement) == held(recording.base_displacement) == 0
    assert held(clipped(recording.mass_displacement, 0.8)) > 1000


def test_one_excursion_beyond_the_range_is_held_whatever_the_other_turning_points() -> None:
    x = np.array(seen(motion(0.5, 0.4), noise=0.05e-6, rate=1000.0, seconds=30.0).mass_displacement)
    x[10_000:20_000] *= 1.4
    end = np.round(1.1 * np.abs(x[:10_000]).max() / STEP_M) * STEP_M
    flagged = examine(np.minimum(x, end), "mass").quality & np.uint8(Quality.HELD)
    assert np.count_nonzero(flagged[10_000:20_000]) == np.count_nonzero(x > end)
    assert not flagged[:10_000].any()


def test_a_sensor_that_dies_and_single_jumps_are_flagged() -> None:
    made = seen(motion(0.5, 0.4), noise=0.8e-6, rate=250.0, seconds=30.0)
    x, y = np.array(made.mass_displacement), np.array(made.base_displacement)
    x[5000:], x[[500, 3000]] = x[5000], 0.02
    channels = {"mass": examine(x, "mass"), "base": examine(y, "base")}
    flag_dead(made.time, channels)
    assert [channel.quality.any() for channel in channels.values()] == [True, False]
    for flag, places in ((Quality.ERROR_CODE, [500, 3000]), (Quality.HELD, list(range(5000, len(x))))):
        assert np.flatnonzero(channels["mass"].quality & np.uint8(flag)).tolist() == places


@pytest.mark.parametrize(("r", "rate"), [(0.3, 250.0), (1.4, 1000.0)])
@pytest.mark.parametrize(("size", "longest"), [(1e-3, 1), (1e-4, 1), (5e-4, 5)])
def test_spikes_in_a_hundredth_of_the_samples_are_set_aside(r: float, rate: float, size: float, longest: int) -> None:
    """They made one stop in four of two stops, the amplitude seven errors large, and were not said."""
    of, generator = motion(r, 0.4), np.random.default_rng(6)
    made = seen(of, rate=rate, seconds=60.0)
    values, hit = np.array(made.mass_displacement), np.zeros(len(made), bool)
    for first in generator.choice(len(values) - longest, len(values) // (100 * longest), replace=False):
        values[first : first + longest] += size * generator.choice([-1.0, 1.0])
        hit[first : first + longest] = True
    read = as_read(made.changed(mass_displacement=values))
    found = (read.quality & np.uint8(Quality.ERROR_CODE)) != 0
    assert np.count_nonzero(hit & ~found) < 0.02 * np.count_nonzero(hit)
    assert np.count_nonzero(found & ~hit) < 1e-4 * len(hit)
    assert re.search(r"mass: \d+ values \((1|0.9\d*) %\) jump off .* \(spikes\)", read.source.warnings[0])
    sound, m = measure(made, scene()), measure(read, scene())
    assert m.stops_per_cycle == pytest.approx(sound.stops_per_cycle, abs=0.01)
    assert m.energy_per_cycle == pytest.approx(sound.energy_per_cycle, abs=sound.energy_per_cycle_se)
    assert m.response_amplitude == pytest.approx(sound.response_amplitude, abs=2.0 * sound.response_amplitude_se)


def test_corners_and_steps_of_a_motion_are_no_spikes() -> None:
    t, generator = np.arange(0.0, 60.0, 0.002), np.random.default_rng(1)
    for hz in (0.5, 2.3, 7.1):
        turn = np.sin(2.0 * np.pi * hz * t)
        tap = np.exp(-0.5 * (t % 15.0)) * np.sin(2.0 * np.pi * hz * (t % 15.0))
        for signal in (np.arcsin(turn), np.sign(turn), np.abs(turn), np.floor(0.4 * t), tap):
            assert not examine(through_laser(1e-3 * signal, generator), "mass").quality.any()


@pytest.mark.parametrize(("measuring_range", "spikes"), [(0.010, 3), (0.050, 0), (0.050, 20), (0.200, 3)])
def test_spikes_do_not_make_the_range_look_smaller(measuring_range: float, spikes: int) -> None:
    """A handful of values between two levels made 50 mm look like 25 mm."""
    step = 1.02 * measuring_range / 65520
    values = np.array(seen(motion(0.5, 0.4), step=step, noise=step).mass_displacement)
    generator = np.random.default_rng(spikes)
    values[generator.integers(0, len(values), spikes)] += generator.normal(0.0, 1e-3, spikes)
    found, betrayed = step_and_range(values)
    assert found == pytest.approx(step, rel=1e-12)
    assert betrayed == measuring_range


TEXT = table(truth(200), "time [s],mass [mm],base [mm]", ",")


def test_mutated_logs_are_read_or_refused(tmp_path: Path) -> None:
    assert {"refused", "damaged"} <= {check(*case(1, number), tmp_path) for number in range(120)}


def test_a_log_cut_at_any_byte_is_read_or_refused(tmp_path: Path) -> None:
    sizes = range(0, 2000, 37)
    found = [check(TEXT[:size].encode(), ".csv", LogOptions(unit="mm"), tmp_path) for size in sizes]
    assert len(sizes) - found.count("refused") > 1800 // 37


def test_an_endless_line_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(b"time [s],mass [mm],base [mm]\n" + b"0.1,1,2\n0.2,1,2\n0.3,1,2\n" + b"7" * (1 << 25))
    with pytest.raises(LogError, match="a line longer than"):
        read_log(path)


def test_a_log_that_changes_while_it_is_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "log.csv", TEXT)
    state = os.fstat

    def grown(descriptor: int) -> os.stat_result:
        with path.open("a") as file:
            file.write("9.0,1,2\n")
        return state(descriptor)

    monkeypatch.setattr("frictionlab.logs.text.os.fstat", grown)
    with pytest.raises(LogError, match="changed while it was read"):
        read_log(path)


def test_a_disk_that_fails_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "log.csv", TEXT)

    def fail(*_: object) -> int:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(Path, "open", fail)
    with pytest.raises(LogError, match=r"log\.csv: cannot be read \(Input/output error\)"):
        read_log(path)


def test_the_digest_is_that_of_the_file_as_it_is(tmp_path: Path) -> None:
    for name in ("log.csv", "log.csv.gz"):
        path = write(tmp_path / name, TEXT)
        (file,) = read_log(path).source.files
        assert file.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
        assert file.size_bytes == path.stat().st_size
