"""A campaign of one recording says what `compare-numeric` says of it: value, errors, the contact's force."""

from pathlib import Path

import numpy as np
import pytest

from frictionlab.analysis.measure import measure
from frictionlab.campaign import Campaign
from frictionlab.hdf5 import write_recording
from frictionlab.identification import compare
from frictionlab.identification.contact_force import contact_force
from frictionlab.recording import Recording
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.simulator import COSINE, Base, Problem
from frictionlab.verbs.evaluate import evaluate
from tests.campaign.fabricate import SCENE
from tests.identification.contacts import recorded

KNOWN = SCENE | {"sensors": {"lag_s_u": 1e-4, "gain_error": 0.002}}


def made(
    law: str, parameters: dict[str, float], *, lag_s: float = 0.0, seed: int = 5, base: Base = COSINE
) -> Recording:
    """40 s of a contact whose friction scatters by 0.3 % from cycle to cycle."""
    problem = Problem(0.6, 0.36, law=law, parameters=parameters, base=base)
    return recorded(problem, np.random.default_rng(seed), seconds=40.0, lag_s=lag_s)


def campaign_of(recordings: dict[str, Recording], scene: Scene, folder: Path, law: str | None = None) -> Campaign:
    """The campaign of recordings by the name of their material: one test each."""
    rows = []
    for material, recording in recordings.items():
        write_recording(recording, folder / f"{material}.h5")
        measured = measure(recording, scene).row()
        rows.append({**measured, "source": f"{material}.h5", "material": material, "normal_force_n": 1.5})
    return evaluate(rows, scene, folders=[folder], law=law)


@pytest.mark.parametrize(
    ("law", "asked", "parameters"),
    [
        ("coulomb", None, {}),
        ("coulomb+speed", "coulomb+speed", {"contact_damping_ratio": 0.05}),
        ("coulomb+place", "coulomb+place", {"gradient": 0.04}),
        ("coulomb+speed", "auto", {"contact_damping_ratio": 0.05}),
    ],
)
def test_value_and_errors_are_the_single_comparisons(
    tmp_path: Path, law: str, asked: str | None, parameters: dict[str, float]
) -> None:
    scene, recording = scene_from_tables(KNOWN), made(law, parameters)
    found, alone = campaign_of({"steel": recording}, scene, tmp_path, asked), compare(recording, scene, law=asked)
    (fit,) = found.fits
    assert fit.law == alone.law == law
    assert fit.friction_ratio == pytest.approx(alone.friction_ratio, rel=1e-6)
    assert fit.friction_ratio_se == pytest.approx(alone.friction_ratio_se, rel=1e-5)
    assert fit.friction_ratio_u == pytest.approx(alone.friction_ratio_u, rel=1e-5)
    for told in found.parameters:
        single = alone.parameters[told.parameter]
        assert told.value == pytest.approx(single["value"], rel=1e-6)
        assert (told.value_se, told.value_u) == pytest.approx((single["se"], single["u"]), rel=1e-5)
        assert told.is_told == single["told"]


def test_the_force_of_the_contact_is_recovered_with_the_rig_as_fitted(tmp_path: Path) -> None:
    """A lag of 8 ms that no scene declares: a page and a material's loop showed the force at the lag as known."""
    scene, recording = scene_from_tables(SCENE), made("coulomb", {}, lag_s=8e-3)
    found, alone = campaign_of({"steel": recording}, scene, tmp_path), compare(recording, scene)
    assert alone.contact is not None
    fitted, measured = found.rigs["steel.h5"], measure(recording, scene)
    assert abs(fitted.lag) > 0.05
    force = contact_force(measured, fitted=fitted)
    assert force == pytest.approx(alone.contact.force, abs=1e-6)
    assert np.abs(contact_force(measured) - force).max() > 0.02
    (loop,) = found.loops
    scale = 1191.0 * (measured.base_amplitude.value or 0.0)
    tau = 2.0 * np.pi * np.arange(len(loop.force)) / len(loop.force)
    at = np.interp(tau, np.append(measured.cycle.tau, 2.0 * np.pi + measured.cycle.tau[0]), np.append(force, force[0]))
    apart = np.sqrt(np.mean((loop.force / scale - at) ** 2))
    assert apart < 0.4 * np.sqrt(np.mean((contact_force(measured) - force) ** 2))  # not smoothed: its noise is left


def test_base_harmonics_are_used_where_recordings_are_at_hand(tmp_path: Path) -> None:
    base = Base((1.0, 0.03, 0.0), (0.0, 0.02, -0.02))
    scene = scene_from_tables(KNOWN | {"model": {"base_harmonics": 3}})
    recording = made("coulomb", {}, base=base)
    found, alone = campaign_of({"steel": recording}, scene, tmp_path), compare(recording, scene)
    (fit,) = found.fits
    assert fit.friction_ratio == pytest.approx(alone.friction_ratio, rel=1e-6)
    assert fit.friction_ratio == pytest.approx(0.36, rel=2e-3)
    (verdict,) = fit.verdicts
    assert verdict.residual == pytest.approx(0.0, abs=2e-3)  # 1 % and more with a cosine base


def test_recordings_of_one_contact_together_stand_among_those_alone(tmp_path: Path) -> None:
    scene = scene_from_tables(KNOWN)
    recordings, rows = [made("coulomb+speed", {"contact_damping_ratio": 0.05}, seed=seed) for seed in range(3)], []
    for i, recording in enumerate(recordings):
        write_recording(recording, tmp_path / f"{i}.h5")
        rows.append(
            {**measure(recording, scene).row(), "source": f"{i}.h5", "material": "steel", "normal_force_n": 1.5}
        )
    (fit,) = evaluate(rows, scene, folders=[tmp_path], law="coulomb+speed").fits
    alone = [compare(recording, scene, law="coulomb+speed") for recording in recordings]
    values = np.array([one.friction_ratio for one in alone])
    errors = np.array([one.friction_ratio_u for one in alone])
    assert values.min() <= (fit.friction_ratio or 0.0) <= values.max()
    assert 0.5 * errors.min() <= (fit.friction_ratio_u or 0.0) <= 1.05 * errors.max()  # the rig's part does not fall


def test_the_force_that_is_recovered_lies_on_a_law_whose_motion_is_off_its_middle(tmp_path: Path) -> None:
    """A gradient draws the motion to one side: the spring's mean force is not in a cycle about its mean."""
    scene = scene_from_tables(KNOWN)
    (loop,) = campaign_of({"steel": made("coulomb+place", {"gradient": 0.2})}, scene, tmp_path, "coulomb+place").loops
    largest = float(np.abs(loop.law_force).max())
    assert abs(loop.law_force.mean()) > 0.02 * largest
    assert abs(float(np.median(loop.force - loop.law_force))) < 0.005 * largest
