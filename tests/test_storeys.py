"""A frame of two storeys from scene to numbers: simulated, logged, read and measured; fits refuse it by name."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner, Result

import frictionlab as fl
from frictionlab.cli import app
from frictionlab.errors import SceneError, UsageError
from frictionlab.scene import read_scene
from frictionlab.scene.storeys import structure_of
from frictionlab.simulator.state import KEYS

SCENE = """
[[rig.masses]]
mass_kg = 2.0
stiffness_n_per_m = 800.0
damping_ratio = 0.01
[[rig.masses]]
mass_kg = 1.0
stiffness_n_per_m = 400.0
damping_ratio = 0.005
[[rig.contacts]]
mass = 1
coefficient = 0.3
normal_force_n = 2.0
[[rig.contacts]]
mass = 2
against = 1
beta = 0.05
[synthetic]
base_amplitude_m = 2e-3
sampling_rate_hz = 500.0
duration_s = 20.0
noise_m = 1e-6
seed = 3
[[synthetic.tests]]
material = "brass"
friction_coefficient = 0.3
normal_forces_n = [2.0]
frequency_ratios = [0.4]
"""
CONTACTS = [(1, "wall", "coulomb"), (2, 1, "coulomb")]


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    (tmp_path / "two.toml").write_text(SCENE, encoding="utf-8")
    return tmp_path


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_the_command_gives_a_list_over_masses_and_contacts(desk: Path) -> None:
    words = ("simulate", "--scene", desk / "two.toml", "--r", "0.4", "--base-amplitude", "2e-3")
    row = json.loads(run(*words, "--json").stdout)
    assert set(KEYS) | {"law", "parameters"} <= set(row)
    assert (row["outcome"], len(row["response_amplitudes"])) == ("periodic", 2)
    assert row["response_amplitude"] == row["response_amplitudes"][0]
    assert [(each["mass"], each["against"], each["law"]) for each in row["contacts"]] == CONTACTS
    assert row["friction_force_n"] == pytest.approx(0.6)
    assert sum(each["energy_per_cycle"] for each in row["contacts"]) == pytest.approx(row["contact_energy_per_cycle"])
    taken = row["contact_energy_per_cycle"] + row["frame_energy_per_cycle"]
    assert taken == pytest.approx(row["energy_per_cycle"], rel=0.01)  # the frame's dashpots pull at the base too
    assert row["energy_per_cycle_j"] == pytest.approx(row["energy_per_cycle"] * 800.0 * 4e-6)
    assert "amplitude of each mass: 1.09" in (shown := run(*words).stdout)
    assert "contact 2, mass 2 against mass 1 (coulomb)" in shown


def test_the_motion_of_each_mass_is_written_and_drawn(desk: Path) -> None:
    words = ("simulate", "--scene", desk / "two.toml", "--r", "0.4", "--base-amplitude", "2e-3")
    assert run(*words, "-o", desk / "two.h5", "--plot", desk / "two.svg").exit_code == 0
    with h5py.File(desk / "two.h5") as file:
        moved = [float(np.ptp(file[f"motion/displacement_{mass}"][:])) / 2.0 for mass in (1, 2)]
    row = json.loads(run(*words, "--json").stdout)
    assert moved == pytest.approx(row["response_amplitudes"], rel=1e-4)
    assert "mass 2" in (desk / "two.svg").read_text(encoding="utf-8")


def test_options_of_one_contact_are_refused(desk: Path) -> None:
    told = run("simulate", "--scene", desk / "two.toml", "--r", "0.4", "--mu", "1.2")
    assert told.exit_code == 2
    assert "--mu: belongs to one mass with one contact" in told.output


def test_logs_of_two_storeys_are_read_and_measured_to_their_truth(desk: Path) -> None:
    (test,) = fl.synthesize(desk / "two.toml", desk / "logs")
    truth = json.loads((desk / "logs" / "truth.jsonl").read_text(encoding="utf-8"))
    recording = fl.ingest(desk / "logs" / test.log)
    assert {"mass_displacement", "mass_2_displacement", "base_displacement"} <= set(recording.measured())
    measured = fl.analyze(recording, desk / "two.toml")
    assert measured.energy_per_cycle_u is not None
    assert measured.energy_per_cycle == pytest.approx(truth["energy_per_cycle"], abs=3 * measured.energy_per_cycle_u)
    assert measured.response_amplitude == pytest.approx(truth["response_amplitude"], rel=3e-3)
    assert measured.stops_per_cycle == truth["stops_per_cycle"]
    assert truth["response_amplitudes"][0] == truth["response_amplitude"]
    assert truth["natural_frequencies_hz"] == pytest.approx([2.25079, 4.50158], rel=1e-5)


def test_a_fit_refuses_several_masses_by_name(desk: Path) -> None:
    (test,) = fl.synthesize(desk / "two.toml", desk / "logs")
    with pytest.raises(UsageError, match=r"a law is fitted to one mass with one contact, .* got 2 \[\[rig\.masses\]\]"):
        fl.compare(desk / "logs" / test.log, desk / "two.toml")


def test_a_contact_without_friction_is_refused(desk: Path) -> None:
    scene = read_scene(desk / "two.toml")
    nothing = [scene.rig.contacts[0].model_copy(update={"coefficient": None}), scene.rig.contacts[1]]
    lacking = scene.model_copy(update={"rig": scene.rig.model_copy(update={"contacts": nothing})})
    with pytest.raises(
        SceneError, match=r"rig\.contacts\.0: expected its friction: beta, or friction_n, or coefficient"
    ):
        structure_of(lacking, 0.5, 1e-3)
    assert structure_of(lacking, 0.5, 1e-3, coefficient=0.3).contacts[0].beta == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("seed = 3", 'seed = 3\nchannels = ["contact_force"]', "channels: expected none for a frame with"),
        ("frequency_ratios = [0.4]", "frequency_ratios = [0.4]\nfriction_scatter = 0.1", "got friction that drifts"),
    ],
)
def test_what_only_one_mass_can_do_is_refused(desk: Path, old: str, new: str, match: str) -> None:
    (desk / "two.toml").write_text(SCENE.replace(old, new), encoding="utf-8")
    with pytest.raises(SceneError, match=match):
        fl.synthesize(desk / "two.toml", desk / "logs")
