"""`explain`: the law that a recording requires, in a dozen lines that agree with the comparison they tell."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import frictionlab as fl
from frictionlab.figures.judged import contact_figure
from frictionlab.inference.explain import Explanation, missed
from frictionlab.simulator import Problem
from tests.desk import SAMPLE, SCENE, invoke, present
from tests.inference.contacts import BASE_M, NATURAL_HZ, recorded, scene

R, BETA, DAMPING, STIFFNESS = 0.35, 0.4, 0.03, 1191.0


@pytest.fixture(scope="module")
def told() -> Explanation:
    truth = Problem(R, BETA, law="coulomb+speed", parameters={"contact_damping_ratio": DAMPING})
    rig = scene(rig={"stiffness_n_per_m": STIFFNESS})
    return fl.explain(recorded(truth, np.random.default_rng(11)), rig)


def test_an_explanation_is_short_and_tells_what_the_comparison_found(told: Explanation) -> None:
    lines = told.text.splitlines()
    assert 8 <= len(lines) <= 20
    assert max(map(len, lines)) <= 80
    assert "coulomb+speed at r = 0.35" in lines[0]
    assert "It explains the cycle" in told.text
    assert "A simpler law, coulomb, leaves" in told.text
    assert "Not tried, because only noise is left to explain: stribeck," in " ".join(told.text.split())
    assert f"{1e3 * (told.energy_j or 0.0):.4g} mJ" in told.text
    assert told.comparison.law == "coulomb+speed"
    assert present(told.simpler)["law"] == "coulomb"


def test_a_dozen_lines_keep_law_values_doubts_and_what_to_do_next(told: Explanation) -> None:
    said = (
        "friction_ratio: the fit moved the lag by 12 ms: measure it and declare it",
        *(f"odd {n}" for n in "abcdef"),
    )
    much = replace(told, comparison=replace(told.comparison, warnings=said))
    lines = much.short(11)
    assert 8 <= len(lines) <= 11
    assert all(line in much.text.splitlines() for line in lines)
    short = "\n".join(lines)
    for words in (
        "coulomb+speed at r = 0.35",
        "friction force:",
        "Next: tests at another",
        "! friction_ratio: the fit",
    ):
        assert words in short
    assert "Not tried" not in short


def test_values_in_newtons_are_those_of_the_contact_that_made_the_recording(told: Explanation) -> None:
    force, force_u, unit, _ = told.physical["beta"]
    assert unit == "N"
    assert force_u is not None
    assert force == pytest.approx(BETA * STIFFNESS * BASE_M, abs=3 * force_u)
    assert force == told.comparison.friction_force_n
    dashpot, dashpot_u, unit, _ = told.physical["contact_damping_ratio"]
    assert unit == "N s/m"
    assert dashpot_u is not None
    mass = STIFFNESS / (2 * math.pi * NATURAL_HZ) ** 2
    assert dashpot == pytest.approx(2 * DAMPING * math.sqrt(STIFFNESS * mass), abs=3 * dashpot_u)  # c = 2 zeta sqrt(km)


def test_what_a_law_misses_is_the_residual_part_by_part(told: Explanation) -> None:
    contact = present(told.contact)
    parts, residual = missed(contact), contact.residual
    assert residual is not None
    assert set(parts) == {"stops", "slides up", "slides down"}
    assert min(parts.values()) <= math.sqrt(float(np.mean(residual**2))) <= max(parts.values())
    assert present(told.simpler)["response_nrmse"] > 3 * (told.comparison.response_nrmse or math.inf)


def test_a_law_that_was_not_tried_for_another_reason_is_not_among_those_that_noise_made_needless(
    told: Explanation,
) -> None:
    """The bound of the ladder's work had stopped it, as a warning said, and the text gave noise as the reason too."""
    spent = "law coulomb+lugre: not tried: the ladder had used up its steps"
    comparison = replace(told.comparison, warnings=(spent,))
    text = " ".join(replace(told, comparison=comparison).text.split())
    needless = text.split("because only noise is left to explain: ")[1].split(".")[0]
    assert "rate-state" in needless
    assert "lugre" not in needless
    assert f"! {spent}" in text


def test_the_figure_has_newtons_and_millimetres_every_law_tried_the_verdict_and_the_warnings(told: Explanation) -> None:
    contact = present(told.contact)
    figure = contact_figure(replace(contact, warnings=("friction_ratio: a warning",)))
    way, speed, left, misfit, evidence = figure.axes
    assert (way.get_xlabel(), speed.get_xlabel()) == ("displacement of the mass [mm]", "speed of the mass [mm/s]")
    assert way.get_ylabel() == "force of the contact [N]"
    assert left.get_ylabel() == "measured - predicted [µm]"
    recovered = way.lines[0].get_xydata()
    assert np.abs(recovered).max(axis=0) == pytest.approx(  # half the swing [mm]; force of friction and dashpot [N]
        [1e3 * BASE_M * (told.comparison.response_amplitude or 0.0), STIFFNESS * BASE_M * 0.43], rel=0.1
    )
    jump = np.unique(np.abs(np.asarray(speed.lines[1].get_xydata())[:, 0]) < 1e-9)
    assert jump.tolist() == [False, True]
    assert len(misfit.get_yticklabels()) == len(evidence.get_yticklabels()) == len(told.comparison.laws or ())
    assert "coulomb+speed: explained" in figure.get_suptitle()
    assert "! friction_ratio: a warning" in figure.get_supxlabel()
    laws = {**contact.laws, "coulomb+place": (2, 0.01, contact.laws[contact.law][2] + 300.0)}
    richer = contact_figure(replace(contact, laws=laws)).axes[-1]
    assert np.asarray(richer.collections[0].get_offsets())[:, 0].max() == pytest.approx(300.0)
    assert richer.get_xlim()[1] > 300.0
    over_k = contact_figure(replace(contact, unit_n=None, laws={}))
    assert over_k.axes[0].get_ylabel() == "force of the contact, n / kY"
    assert len(over_k.axes) == 3


def test_the_command_prints_the_text_draws_the_figure_and_tells_the_same_in_json(tmp_path: Path) -> None:
    scened = ["--scene", str(SCENE)]
    shown, told, lost = (
        invoke("explain", *words, *scened)
        for words in ([str(SAMPLE), "--plot", f"{tmp_path}/figures"], [str(SAMPLE), "--json"], ["nothing.h5"])
    )
    assert (shown.exit_code, told.exit_code, lost.exit_code) == (0, 0, 1)
    (row,) = [json.loads(line) for line in told.stdout.splitlines()]
    *lines, rest = shown.stdout.splitlines()
    assert len(lines) <= 11
    assert set(lines) < set(row["text"])
    assert rest == f"... {len(row['text']) - len(lines)} more lines: --wide"
    assert row["law"] == "coulomb"
    assert row["simpler_law"] is None
    assert (tmp_path / "figures" / f"{SAMPLE.stem}.contact.png").is_file()
    assert "nothing.h5" in lost.stderr
