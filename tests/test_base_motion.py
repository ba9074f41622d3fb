"""Any recorded motion of the base, from a file to a response: what drives, what is refused, what is said."""

import json
import math
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.interpolate import CubicSpline, make_interp_spline

import frictionlab as fl
from frictionlab.base_motion import respond_to
from frictionlab.errors import LogError, RecordingError, SimulationError, UsageError
from frictionlab.hdf5 import describe, read_recording
from frictionlab.recording import Quality, Recording
from frictionlab.schema import RESPONSES
from frictionlab.simulator import Problem, steady_state
from frictionlab.simulator.record import BaseRecord, respond
from tests.desk import invoke, log_of, present

FN = 3.0
PLAIN = Problem(1.0, 0.4)


def base_of(rate: float = 200.0, cycles: int = 20, r: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """A cosine base of 2 mm at r that starts at its middle: 0 s, 0 m."""
    t = np.arange(int(cycles / (r * FN) * rate) + 1) / rate
    return t, 2e-3 * np.sin(2 * math.pi * r * FN * t)


def test_the_numbers_are_those_of_the_simulator_in_si_units() -> None:
    t, y = base_of()
    recording = Recording(t, np.zeros(len(t)), y, experiment={"material": "steel"})
    answer = respond_to(recording, PLAIN, natural_frequency_hz=FN, stiffness_n_per_m=1000.0)
    row, response = answer.row(), answer.response
    assert row["base_largest_m"] == pytest.approx(2e-3, rel=1e-6)
    energy = present(steady_state(Problem(0.5, 0.4)).energy_per_cycle)
    assert row["energy"] == pytest.approx(20 * energy, rel=0.05)  # the first cycles differ
    assert row["energy_j"] == pytest.approx(response.energy * 1000.0 * 4e-6, rel=1e-6)
    assert row["peak_contact_force_n"] == pytest.approx(0.4 * 1000.0 * 2e-3, rel=1e-6)
    assert row["time_stuck_s"] == pytest.approx(response.stuck_fraction * t[-1])
    assert answer.recording.mass_displacement == pytest.approx(2e-3 * response.displacement)
    assert answer.recording.experiment["material"] == "steel"
    assert row["sampling_error"] == pytest.approx(0.0, abs=1e-6)


def test_a_log_one_column_of_a_table_and_a_recording_say_the_same(tmp_path: Path) -> None:
    t, y = base_of()
    both = log_of(tmp_path / "both.csv", {"time [s]": t, "mass [mm]": 0 * t, "base [mm]": 1e3 * y})
    alone = log_of(tmp_path / "alone.csv", {"time [s]": t, "y [um]": 1e6 * y})
    table = log_of(tmp_path / "table.csv", {"t": t, "p": 5.0 + y, "q": 1e3 * y, "temperature": 20.0 + 0.01 * t})
    rows = [
        fl.respond(both, PLAIN, natural_frequency_hz=FN).row(),
        fl.respond(alone, PLAIN, natural_frequency_hz=FN).row(),
        fl.respond(table, PLAIN, natural_frequency_hz=FN, base="q", unit="mm", time_unit="s").row(),
        fl.respond(fl.ingest(both), PLAIN, natural_frequency_hz=FN).row(),
    ]
    for row in rows[1:]:
        assert row["energy"] == pytest.approx(rows[0]["energy"], rel=1e-5)
        assert row["stops"] == rows[0]["stops"]


def shaken(rate: float = 200.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A base that starts and ends at rest, 1.4 Hz, and its acceleration: t [s], y [m], a [m/s^2]."""
    t = np.arange(int(20.0 * rate) + 1) / rate
    inside = np.clip(t - 1.0, 0.0, 18.0)
    size = 2e-3 * np.sin(np.pi * inside / 18.0) ** 4
    fine: Any = CubicSpline(t, size * np.sin(2 * np.pi * 1.4 * t))
    exact = make_interp_spline(t, size * np.sin(2 * np.pi * 1.4 * t), k=7)
    return t, fine(t), exact.derivative(2)(t)


def test_a_wall_that_moves_with_the_base_feels_its_acceleration_itself(tmp_path: Path) -> None:
    """Nothing is integrated: the motion from the base is that under the displacement, over another Y."""
    t, y, a = shaken()
    law = Problem(1.0, 0.04, wall="base", frame_damping_ratio=0.02)
    moved = fl.respond(Recording(t, 0 * t, y), law, natural_frequency_hz=FN)
    largest = float(np.abs(a).max()) / (2 * np.pi * FN) ** 2
    same = law.with_parameters({"beta": 0.04 * moved.response.base.scale / largest})
    for name, column in (("acc [m/s^2]", a), ("acceleration [g]", a / 9.80665)):
        log = log_of(tmp_path / "a.csv", {"time [s]": t, name: column})
        felt = fl.respond(log, same, natural_frequency_hz=FN)
        assert felt.response.base.scale == pytest.approx(largest, rel=1e-6)
        z = moved.recording.mass_displacement - (y - y[0])
        assert felt.recording.mass_displacement == pytest.approx(z, abs=1e-4 * float(np.abs(z).max()))
        assert felt.response.energy * largest**2 == pytest.approx(
            moved.response.energy * moved.response.base.scale**2, rel=1e-4
        )
        assert any("drives the wall as it is" in sentence for sentence in felt.warnings)
        assert not felt.recording.base_displacement.any()


def test_an_acceleration_is_integrated_with_its_cost_said(tmp_path: Path) -> None:
    t, y, a = shaken()
    noise, offset = 0.01 * np.random.default_rng(2).standard_normal(len(t)), 0.3 + 0.01 * t
    clean = log_of(tmp_path / "a.csv", {"time [s]": t, "acc [m/s^2]": a + offset})
    noisy = log_of(tmp_path / "b.csv", {"time [s]": t, "acc [mm/s^2]": 1e3 * (a + noise + offset)})
    law = Problem(1.0, 0.3)
    answer = fl.respond(clean, law, natural_frequency_hz=FN, highpass_hz=0.3)
    assert answer.recording.base_displacement == pytest.approx(y, abs=2e-5)
    rough = fl.respond(noisy, law, natural_frequency_hz=FN, highpass_hz=0.3)
    off = rough.recording.base_displacement - answer.recording.base_displacement
    assert 0.5 < float(np.std(off)) / present(rough.base_u_m) < 2.0
    assert any("slower than 0.3 Hz, drift" in s and "um rms of displacement" in s for s in rough.warnings)
    assert rough.row()["base_u_m"] == present(rough.base_u_m)


def test_what_an_acceleration_needs_is_asked_for(tmp_path: Path) -> None:
    t, y = base_of()
    alone = log_of(tmp_path / "a.csv", {"time [s]": t, "acc [m/s^2]": y})
    with pytest.raises(RecordingError, match=r"integrated twice; expected --highpass HZ.*or --wall base"):
        fl.respond(alone, PLAIN, natural_frequency_hz=FN)
    named = log_of(tmp_path / "b.csv", {"time [s]": t, "x [mm]": y, "shaker acceleration": y})
    with pytest.raises(LogError, match=r"is in m \(displacement\): expected an acceleration, one of m/s"):
        fl.respond(named, PLAIN, natural_frequency_hz=FN, base="3", unit="m")
    assert fl.respond(named, PLAIN, natural_frequency_hz=FN, base="3", unit="g", highpass_hz=0.2).base_u_m is not None
    with pytest.raises(UsageError, match="belongs to a base that is an acceleration"):
        fl.respond(named, PLAIN, natural_frequency_hz=FN, base="2", highpass_hz=0.2)
    with pytest.raises(SimulationError, match="expected a wall that moves with the base"):
        respond(PLAIN, BaseRecord(t, y, quantity="acceleration"))


def test_nothing_is_simulated_across_a_gap_and_what_was_bridged_is_said() -> None:
    t, y = base_of()
    quality = np.zeros(len(t), np.uint8)
    quality[500:502] = Quality.INTERPOLATED
    answer = fl.respond(Recording(t, 0 * t, y, quality), PLAIN, natural_frequency_hz=FN)
    assert "base: 2 of 2667 samples are straight lines over short holes, not measured" in answer.warnings
    quality[500] = Quality.NOT_BRIDGED
    with pytest.raises(RecordingError, match=r"no samples from 2.495 s to 2.5 s: nothing is simulated across a gap"):
        fl.respond(Recording(t, 0 * t, y, quality), PLAIN, natural_frequency_hz=FN)


def test_a_spike_in_a_log_of_the_base_is_set_aside_when_it_is_read(tmp_path: Path) -> None:
    t, y = base_of()
    clean = fl.respond(Recording(t, 0 * t, y), PLAIN, natural_frequency_hz=FN).response
    log = log_of(tmp_path / "a.csv", {"time [s]": t, "base [mm]": 1e3 * y + 0.5 * (np.arange(len(t)) == 700)})
    found = fl.respond(log, PLAIN, natural_frequency_hz=FN)
    np.testing.assert_allclose(found.response.displacement, clean.displacement, atol=1e-4)
    assert any("1 of 2667 samples are" in said for said in found.warnings)


def test_a_shock_and_a_step_are_drives_and_a_coarse_sampling_is_said() -> None:
    t = np.arange(2000) / 200.0
    pulse = np.where((t > 2) & (t < 2.2), 1e-3 * np.sin(np.pi * (t - 2) / 0.2) ** 2, 0.0)
    for drive in (pulse, 1e-3 * (t > 2.0)):
        assert fl.respond(Recording(t, 0 * t, drive), PLAIN, natural_frequency_hz=FN).row()["status"] == "ok"
    t, y = base_of(rate=8.0)
    answer = fl.respond(Recording(t, 0 * t, y), PLAIN, natural_frequency_hz=FN)
    assert any("sample faster than 8 Hz" in sentence for sentence in answer.warnings)


def test_a_moving_wall_does_not_feel_the_noise_of_the_bases_sensor() -> None:
    t, y = base_of(cycles=30)
    noisy = y + 1e-6 * np.random.default_rng(1).standard_normal(len(t))
    wall = Problem(1.0, 0.1, wall="base")
    clean = fl.respond(Recording(t, 0 * t, y), wall, natural_frequency_hz=FN)
    seen = fl.respond(Recording(t, 0 * t, noisy), wall, natural_frequency_hz=FN)
    assert seen.response.energy == pytest.approx(clean.response.energy, rel=0.02)
    assert any("um rms was smoothed away" in sentence for sentence in seen.warnings)


def test_a_base_at_rest_and_an_unknown_frequency_are_refused() -> None:
    t, y = base_of()
    with pytest.raises(SimulationError, match="a base at rest drives nothing"):
        fl.respond(Recording(t, y, 0 * t), PLAIN, natural_frequency_hz=FN)
    with pytest.raises(UsageError, match="--natural-frequency HZ"):
        fl.respond(Recording(t, y, y), PLAIN)


run = partial(invoke, "simulate")


@pytest.fixture
def quake(tmp_path: Path) -> Path:
    t, y = base_of(rate=100.0, cycles=8)
    return log_of(tmp_path / "quake.csv", {"time [s]": t, "base [mm]": 1e3 * y})


def test_the_command_writes_a_recording_that_analyze_reads_and_a_figure(tmp_path: Path) -> None:
    t, y = base_of(cycles=30)
    log, output = log_of(tmp_path / "base.csv", {"time [s]": t, "base [mm]": 1e3 * y}), tmp_path / "a.h5"
    given = ("--base-motion", log, "--natural-frequency", FN, "--beta", 0.4, "--json")
    row = json.loads(run(*given, "-o", output, "--plot", tmp_path / "a.png").stdout)
    assert set(row) == set(RESPONSES.names)
    assert row["law"] == "coulomb"
    assert (tmp_path / "a.png").exists()
    recording = read_recording(output)
    assert list(recording.measured()) == ["mass_displacement", "base_displacement", "contact_force"]
    measured = fl.analyze(recording, natural_frequency_hz=FN, transient_s=10.0)
    assert measured.energy_per_cycle == pytest.approx(steady_state(Problem(0.5, 0.4)).energy_per_cycle, rel=1e-3)
    with h5py.File(output) as file:
        assert file["contact_force"].attrs["units"] == "m"
        assert file["contact_force"].dims[0][0] == file["time"]
        assert np.abs(file["contact_force"][:]).max() == pytest.approx(0.4 * row["base_largest_m"])
    assert any("contact_force" in line for line in describe(output))
    assert run(*given, "-o", output).exit_code == 0  # its own kind of file is replaced
    np.testing.assert_array_equal(read_recording(output).mass_displacement, recording.mass_displacement)
    assert run(*given, "-o", log, "--force").exit_code == 2


def test_the_law_is_that_of_the_other_commands(quake: Path) -> None:
    law = ("--law", "coulomb+place+speed", "--parameter", "gradient=0.05", "--zeta", 0.02)
    row = json.loads(run("--base-motion", quake, "--natural-frequency", FN, "--beta", 0.4, *law, "--json").stdout)
    assert row["parameters"] == {
        "beta": 0.4,
        "gradient": 0.05,
        "contact_damping_ratio": 0.02,
        "frame_damping_ratio": 0.0,
    }


def test_a_scene_without_damping_has_none_under_a_record_too(quake: Path) -> None:
    """`[model] damping = false` held for steady states alone: a record was damped as the rig is."""
    rig = fl.scene_from_tables({"rig": {"natural_frequency_hz": FN, "damping_ratio": 0.05}})
    both = (fl.respond(quake, PLAIN, one).response.problem for one in (rig, rig.changed(model={"damping": False})))
    assert [problem.parameters["frame_damping_ratio"] for problem in both] == [0.05, 0.0]


def test_friction_in_newtons_is_over_the_largest_excursion_of_the_base(quake: Path, tmp_path: Path) -> None:
    """It was refused, and beta over an excursion asked for that nobody has in hand."""
    scene = tmp_path / "rig.toml"
    scene.write_text(f"[rig]\nstiffness_n_per_m = 1000.0\nnatural_frequency_hz = {FN}\ndamping_ratio = 0.01\n")
    y = np.loadtxt(quake, delimiter=",", skiprows=1)[:, 1]
    beta = 0.3 * 2.0 / (1000.0 * 1e-3 * float(np.abs(y - y[0]).max()))
    common = ("--base-motion", quake, "--scene", scene, "--json")
    by_force = json.loads(run(*common, "--coefficient", 0.3, "--normal-force", 2.0).stdout)
    by_ratio = json.loads(run(*common, "--beta", repr(beta)).stdout)
    assert by_force["parameters"] == pytest.approx(by_ratio["parameters"], rel=1e-9)
    assert by_force["peak_displacement"] == pytest.approx(by_ratio["peak_displacement"], rel=1e-9)
