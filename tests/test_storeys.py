"""A frame of two storeys from log to law: simulated, logged, read, measured, and the law of a contact found."""

import json
import math
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionlab as fl
from frictionlab.errors import SceneError, UsageError
from frictionlab.hdf5 import read_recording
from frictionlab.inference.observations import observe
from frictionlab.recording import Channel, Recording
from frictionlab.scene import read_scene, scene_from_tables
from frictionlab.scene.physical import structure_of
from frictionlab.simulator import Contact, steady_state
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.state import KEYS
from tests.desk import STOREYS, log_of, present, truths
from tests.desk import invoke as run

SCENE = f"""{STOREYS}damping_ratio = 0.005
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
    assert "frame_damping_ratio" not in shown
    assert "contact of mass  against  law" in shown


def test_the_motion_of_each_mass_is_written_and_drawn(desk: Path) -> None:
    words = ("simulate", "--scene", desk / "two.toml", "--r", "0.4", "--base-amplitude", "2e-3")
    assert run(*words, "-o", desk / "two.h5", "--plot", desk / "two.svg").exit_code == 0
    with h5py.File(desk / "two.h5") as file:
        moved = [float(np.ptp(file[f"motion/displacement_{mass}"][:])) / 2.0 for mass in (1, 2)]
    row = json.loads(run(*words, "--json").stdout)
    assert moved == pytest.approx(row["response_amplitudes"], rel=1e-4)
    assert "mass 2" in (desk / "two.svg").read_text(encoding="utf-8")


def test_a_law_with_a_state_of_its_own_and_a_record_move_a_frame(desk: Path) -> None:
    law = 'law = "coulomb+dahl"\nstiffness_ratio = 50.0\nbeta = 0.05'
    (desk / "mixed.toml").write_text(SCENE.replace("beta = 0.05", law), encoding="utf-8")
    row = json.loads(run("simulate", "--scene", desk / "mixed.toml", "--r", "0.4", "--json").stdout)
    assert (row["outcome"], row["solver"], len(row["response_amplitudes"])) == ("periodic", "numeric", 2)
    assert [each["law"] for each in row["contacts"]] == ["coulomb", "coulomb+dahl"]
    t = np.arange(200) / 50.0
    log_of(desk / "quake.csv", {"time [s]": t, "base [mm]": 2.0 * np.sin(10.0 * t)})
    words = ("simulate", "--scene", desk / "mixed.toml", "--base-motion", desk / "quake.csv")
    row = json.loads(run(*words, "--json", "-o", desk / "out.h5").stdout)
    assert (row["status"], row["solver"], len(row["peak_displacements"])) == ("ok", "numeric", 2)
    assert sum(each["energy"] for each in row["contacts"]) == pytest.approx(row["energy"], rel=0.1)
    assert "mass_2_displacement" in read_recording(desk / "out.h5").measured()
    assert "--beta: belongs to one mass with one contact" in run(*words, "--beta", "0.3").output


def test_logs_of_two_storeys_are_read_and_measured_to_their_truth(desk: Path) -> None:
    (test,) = fl.synthesize(desk / "two.toml", desk / "logs")
    (truth,) = truths(desk / "logs")
    recording = fl.ingest(desk / "logs" / test.log)
    assert {"mass_displacement", "mass_2_displacement", "base_displacement"} <= set(recording.measured())
    measured = fl.analyze(recording, desk / "two.toml")
    assert measured.energy_per_cycle == pytest.approx(
        truth["energy_per_cycle"], abs=3 * present(measured.energy_per_cycle_u)
    )
    assert measured.response_amplitude == pytest.approx(truth["response_amplitude"], rel=3e-3)
    assert measured.stops_per_cycle == truth["stops_per_cycle"]
    assert truth["response_amplitudes"][0] == truth["response_amplitude"]
    assert truth["natural_frequencies_hz"] == pytest.approx([2.25079, 4.50158], rel=1e-5)


def test_the_law_of_a_contact_is_found_by_the_motion_of_all_masses(desk: Path) -> None:
    (test,) = fl.synthesize(desk / "two.toml", desk / "logs")
    found = fl.compare(desk / "logs" / test.log, desk / "two.toml")
    beta = found.parameters["beta"]
    assert (found.law, found.verdict) == ("coulomb", "explained")
    assert abs(beta["value"] - test.friction_ratio) < 2.0 * beta["u"] < 0.02
    assert found.friction_coefficient == pytest.approx(0.3, abs=2.0 * (found.friction_coefficient_u or 0.0))
    assert {"storey_2_frequency", "storey_2_damping", "gain_2"} <= set(found.nuisances)
    assert "mass 1 of 2 against the wall, 1 more contacts as the scene says" in found.model
    assert np.nanmedian(np.abs(present(found.contact).seen.force)) == pytest.approx(test.friction_ratio, rel=0.02)


def test_a_contact_between_two_masses_is_found_and_its_force_is_recovered() -> None:
    law = law_of("coulomb+place")
    truth = (0.08, 0.1)
    scene = scene_from_tables(
        {
            "rig": {
                "masses": [
                    {"mass_kg": 2.0, "stiffness_n_per_m": 800.0, "damping_ratio": 0.01},
                    {"mass_kg": 1.0, "stiffness_n_per_m": 300.0, "damping_ratio": 0.01},
                ],
                "contacts": [{"mass": 2, "against": 1, "law": law.name}],
            },
            "analysis": {"transient_s": 2.0},
        }
    )
    rubs = Contact(2, 1, law, law.complete({"beta": truth[0], "gradient": truth[1]}))
    motion = present(steady_state(structure_of(scene, 0.5, 2e-3, first=rubs)).orbit)
    t, noise = np.arange(6000) / 400.0, np.random.default_rng(4).normal(0.0, 1e-6, (3, 6000))
    tau = math.pi * (scene.rig.natural_frequency or 0.0) * t
    (q, _, _), base = motion.all_at(np.mod(tau, math.tau)), np.cos(tau)
    x, upper, y = 2e-3 * np.array([q[:, 0], q[:, 1], base]) + noise
    found = fl.compare(Recording(t, x, y, channels=(Channel("mass_2_displacement", upper),)), scene)
    for name, value in zip(("beta", "gradient"), truth, strict=True):
        estimate = found.parameters[name]
        assert abs(estimate["value"] - value) < 2.0 * estimate["u"] < 0.1 * value
    contact = present(found.contact)
    gap = contact.seen.force - present(contact.predicted).force
    assert float(np.sqrt(np.mean(gap**2))) < 0.2 * truth[0]  # harmonics beyond 25 fade in what is recovered


@pytest.mark.parametrize(
    ("asked", "match"),
    [
        ({"law": "coulomb+lugre"}, "in a frame of several masses the contact that is fitted is a sum of coulomb"),
        ({"law": "coulomb+compliance"}, r"give stiffness_ratio in \[\[rig\.contacts\]\]"),
        ({"whole": True}, r"expected one mass with one contact, .* got 2 \[\[rig\.masses\]\]"),
    ],
)
def test_a_fit_of_several_masses_refuses_by_name_what_it_cannot_do(
    desk: Path, asked: dict[str, Any], match: str
) -> None:
    (test,) = fl.synthesize(desk / "two.toml", desk / "logs")
    with pytest.raises(UsageError, match=match):
        fl.compare(desk / "logs" / test.log, desk / "two.toml", **asked)


def test_more_masses_than_the_scene_has_are_refused(desk: Path) -> None:
    (test,) = fl.synthesize(desk / "two.toml", desk / "logs")
    measured = fl.analyze(desk / "logs" / test.log, desk / "two.toml")
    scene = read_scene(desk / "two.toml")
    one = scene.model_copy(update={"rig": scene.rig.model_copy(update={"masses": scene.rig.masses[:1]})})
    with pytest.raises(UsageError, match=r"expected 1 masses, as \[\[rig\.masses\]\] has them; got 2 measured"):
        observe(measured, one)


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
