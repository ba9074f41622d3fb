"""Habits of a desk that every command shares: what an input may be and what is told of it; what `explain` says."""

import io
import json
import math
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

import frictionlab as fl
from frictionlab.figures.judged import contact_figure
from frictionlab.inference.explain import Explanation
from frictionlab.simulator import Problem
from frictionlab.verbs.inputs import files_of, logs_in, tables_in
from tests.desk import ROOT, SAMPLE, SCENE, STOREYS, invoke, log_of, present, rows_of, short_of
from tests.desk import invoke as run
from tests.inference.contacts import BASE_M, NATURAL_HZ, recorded, scene

LOG = ROOT / "sample_data" / "aramid_N1.25_r1.2.csv"
SCENED = ("--scene", SCENE)


@pytest.fixture(scope="module")
def short() -> bytes:
    return short_of(LOG)


def test_a_folder_and_a_pattern_are_opened_up(short: bytes, tmp_path: Path) -> None:
    for name in ("a b.csv", "C.CSV", "t.jsonl"):
        (tmp_path / name).write_bytes(short)
    for what, names in (("", "C.CSV a b.csv"), ("*.[cC]*", "C.CSV a b.csv"), ("* b.*", "a b.csv")):
        assert " ".join(path.name for path in files_of([tmp_path / what], logs_in)) == names
    assert files_of([tmp_path], tables_in) == [tmp_path / name for name in ("a b.csv", "t.jsonl")]
    (tmp_path / "batch" / "measurements").mkdir(parents=True)
    for name in ("comparisons.jsonl", "measurements/a.jsonl"):
        (tmp_path / "batch" / name).write_bytes(b"")
    assert files_of([tmp_path / "batch"], tables_in) == [tmp_path / "batch" / "comparisons.jsonl"], "no batch made it"
    (tmp_path / "batch" / "made").mkdir()
    assert files_of([tmp_path / "batch"], tables_in) == [tmp_path / "batch" / "measurements" / "a.jsonl"]
    assert [json.loads(line)["status"] for line in run("analyze", tmp_path, *SCENED, "--json").stdout.splitlines()] == [
        "ok",
        "ok",
    ]
    assert "no file fits this pattern" in run("analyze", tmp_path / "*.h5", *SCENED, status=2).stderr


@pytest.mark.parametrize("command", ["analyze", "compare-numeric", "free-vibration", "ingest"])
def test_an_input_that_fails_is_one_line_and_no_table(command: str, tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("nothing")
    told = run(command, bad, status=1)
    assert not told.stdout
    assert len(told.stderr.splitlines()) == 1
    assert "fault of the program" not in told.stderr


@pytest.mark.parametrize("turned", ["swapped", "inverted"])
def test_a_loop_that_gives_energy_is_told_by_every_command(turned: str, short: bytes, tmp_path: Path) -> None:
    t, x, y = np.genfromtxt(io.BytesIO(short), delimiter=",", skip_header=3).T
    mass, base = (y, x) if turned == "swapped" else (-x, y)
    path = log_of(tmp_path / "log.csv", {"time [s]": t, "mass [mm]": mass, "base [mm]": base})
    measured, compared = run("analyze", path, *SCENED, status=0), run("compare-numeric", path, *SCENED, status=1)
    assert "a contact takes energy, this one would give it" in measured.stderr
    assert "the right way round, and does no sensor count the other way" in compared.stderr


def test_one_file_per_sensor_says_how_and_that_its_clocks_may_be_to_blame(short: bytes, tmp_path: Path) -> None:
    """Of two clocks that likeness laid on each other it was said that a sensor counts the other way."""
    t, x, y = np.genfromtxt(io.BytesIO(short), delimiter=",", skip_header=3).T
    alone = " ".join(run("analyze", log_of(tmp_path / "m.csv", {"t [s]": t, "mass [mm]": x}), *SCENED).stderr.split())
    assert "`frictionlab ingest --mass-log FILE --base-log FILE -o NAME.h5`" in alone
    assert "keys of [log]" not in alone
    both, scene = log_of(tmp_path / "both.csv", {"time [s]": t, "mass [mm]": -x, "base [mm]": y}), tmp_path / "a.toml"
    scene.write_text("[rig]\nnatural_frequency_hz = 3.13\n[sensors]\nlag_s_u = 0.3\n")
    seen = " ".join(run("compare-numeric", both, "--scene", scene, "-v").stderr.split())
    assert "counts the other way" not in seen
    assert "the channels' clocks may make it anything: give lag_s and lag_s_u in [log]" in seen


@pytest.mark.parametrize(
    ("command", "name"),
    [
        (("simulate", "--r", "0.5", "--beta", "0.4"), "motion.png"),
        (("simulate", "--base-motion", LOG, "--natural-frequency", "3.13", "--beta", "0.2"), "response.png"),
    ],
)
def test_a_single_figure_goes_into_a_folder_too(
    command: tuple[str | Path, ...], name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run(*command, "-q", "--plot", "new/figures", status=0)
    assert [path.name for path in (tmp_path / "new" / "figures").iterdir()] == [name]
    told = run(*command, "-q", "--plot", "figure.docx", status=2)
    assert "expected a figure ending in .pdf, .svg or .png, or a folder" in told.stderr


QUOTED = "t,mass [mm],base [mm]\n" + "".join(f'"0,{i:02}","1,{i % 7}","2,{i % 5}"\n' for i in range(60))
STUMBLES = [
    (("ingest", "quoted.csv"), 'cells like "0,12" have a decimal comma in quotes, between commas'),
    (("plan", "--scene", "rig.toml"), "such as normal_forces_n = [2.5, 5.0], under [plan]"),
    (
        ("sweep", "--r", "0.3", "--beta", "0,3", "-o", "map.h5"),
        "--beta: 0 and 3 are two values; a decimal is written 0.3",
    ),
    (("simulate", "--r", "0.5", "--beta", "0.4", "--base-amplitude", "1.8"), "metres are meant; 1.8 mm are 0.0018"),
    (("campaign", "empty", "-o", "campaign"), "no tables in empty: expected files ending in"),
    (("analyze", LOG, SAMPLE, "--plot", "x.pdf"), "expected a folder"),
    (("init", "typo"), "typo was not there: it was made new and is empty"),
    (("init", "emtpy"), "emtpy: there is no such folder: did you mean empty?"),
    (("campaign", "quoted.csv", "-o", "out"), "of raw logs, `frictionlab batch LOGS --campaign`"),
    (("batch", LOG, "--scene", "rig.toml", "--campaign", "--law", "coulomb+place"), "no normal_force_n"),
    (("compare-numeric", LOG, *SCENED, "--law-file", "law.toml", "--whole"), "`frictionlab predict --law-file LAW"),
    (("batch", LOG, "--scene", "storeys.toml", "--campaign"), "frictionlab: rig: expected one mass with one contact"),
]


@pytest.mark.parametrize(("command", "said"), STUMBLES, ids=[str(command[0]) for command, _ in STUMBLES])
def test_what_made_people_stumble_is_said(
    command: tuple[str | Path, ...], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("quoted.csv").write_text(QUOTED)
    Path("empty").mkdir()
    rig, disc = "[rig]\nnatural_frequency_hz = 3.13\nmass_kg = 3.08\n", '[rig]\nkind = "prescribed"\n'
    for name, text in (("rig", rig), ("disc", disc), ("storeys", STOREYS)):
        Path(f"{name}.toml").write_text(text)
    done = run(*command)
    assert said in done.output
    assert command[0] != "campaign" or done.exit_code
    assert said[:5] != "frict" or "to do" not in done.output, "refused before the work"


def test_figures_and_columns_left_out_are_named_and_a_single_figure_has_the_name_asked_for(tmp_path: Path) -> None:
    t = np.arange(0.0, 20.0, 0.01)
    (tmp_path / "disc.toml").write_text('[rig]\nkind = "prescribed"\nradius_m = 0.02\n')
    columns = {"t [s]": t, "angle [deg]": np.degrees(3.0 * t), "torque [Nmm]": 100.0 + 0.1 * np.sin(t**2)}
    log_of(tmp_path / "disc.csv", columns)
    done = run(
        "compare-numeric", tmp_path / "disc.csv", "--scene", tmp_path / "disc.toml", "--plot", tmp_path / "d.png"
    )
    assert [path.name for path in tmp_path.glob("*.png")] == ["d.png"]
    assert f"drawn: {tmp_path / 'd.png'}" in done.stderr
    shown = run("analyze", LOG, *SCENED, "--transient", "4.5").stdout.splitlines()
    assert "no space" not in shown[-1]
    assert "stops" in shown[1] or shown[-1].startswith("no space for stops")


def test_a_simulated_force_over_the_stiffness_makes_no_newtons_and_two_lags_are_one_sentence(tmp_path: Path) -> None:
    response = tmp_path / "response.h5"
    run("simulate", "--base-motion", LOG, "--natural-frequency", "3.13", "--beta", "0.2", "-o", response)
    alone = json.loads(run("compare-numeric", response, "--natural-frequency", "3.13", "--json").stdout)
    assert alone["friction_force_n"] is None
    assert "contact_force: is over the stiffness" in alone["warnings"][0]
    known = json.loads(run("compare-numeric", response, *SCENED, "--json").stdout)
    assert known["friction_force_n"] == pytest.approx(known["friction_ratio"] * 1191.0 * 0.0018, rel=0.01)
    t, x, y = np.genfromtxt(LOG, delimiter=",", skip_header=3)[:8000].T
    for name, values in (("mass", x), ("base", y)):
        log_of(tmp_path / f"{name}.csv", {"t [s]": t, "x [mm]": values})
    (tmp_path / "two.toml").write_text(
        "[rig]\nnatural_frequency_hz = 3.13\n[log]\nlag_s = 1e-3\nlag_s_u = 5e-4\n[sensors]\nlag_s = 2e-3\n"
    )
    scene = ("--scene", tmp_path / "two.toml")
    pair = ("--mass-log", tmp_path / "mass.csv", "--base-log", tmp_path / "base.csv")
    assert run("ingest", *pair, *scene, "-o", tmp_path / "two.h5").exit_code == 0
    said = run("analyze", tmp_path / "two.h5", *scene).stderr
    assert said.count("moves it by 2 ms more: 3 ms in all") == 1
    assert "lag_s_u of [sensors] is not declared" not in said


@pytest.mark.parametrize(
    ("rig", "asked"),
    [
        ("mass_kg = 3079.9\nstiffness_n_per_m = 1191.0", "rig: mass_kg = 3079.9: a frame on a bench has"),
        ("mass_kg = 3.0799\nstiffness_n_per_m = 1.191", "is this in N/mm?"),
        ("natural_frequency_hz = 0.1", "frequency_ratio: 37.6 lies outside 0.02 to 5"),
    ],
)
def test_a_rig_off_by_a_thousand_is_told(rig: str, asked: str, short: bytes, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_bytes(short)
    scene = tmp_path / "scene.toml"
    scene.write_text(f"[rig]\n{rig}\n", encoding="utf-8")
    assert asked in run("analyze", tmp_path / "log.csv", "--scene", scene, status=0).stderr


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
    assert f"= {1e3 * (told.comparison.energy_joules.value or 0.0):.2f} ± " in told.text
    assert told.comparison.law == "coulomb+speed"
    assert present(told.simpler)["law"] == "coulomb"
    assert present(told.simpler)["response_nrmse"] > 3 * present(told.comparison.response_nrmse)


def test_a_dozen_lines_keep_law_values_doubts_and_what_to_do_next(told: Explanation) -> None:
    said = ("friction_ratio: the fit moved the lag by 12 ms: measure it and declare it", *"abcdef")
    much = replace(told, comparison=replace(told.comparison, warnings=said))
    lines = much.short(11)
    assert 8 <= len(lines) <= 11
    assert all(line in much.text.splitlines() for line in lines)
    kept = "coulomb+speed at r = 0.35", "friction force:", "Next: tests at another", "! friction_ratio: the fit"
    assert all(words in "\n".join(lines) for words in kept)


def test_values_in_newtons_are_those_of_the_contact_that_made_the_recording(told: Explanation) -> None:
    force, force_u, unit, _ = told.physical["beta"]
    assert unit == "N"
    assert force == pytest.approx(BETA * STIFFNESS * BASE_M, abs=3 * present(force_u))
    assert force == told.comparison.friction_force_n
    dashpot, dashpot_u, unit, _ = told.physical["contact_damping_ratio"]
    assert unit == "N s/m"
    mass = STIFFNESS / (2 * math.pi * NATURAL_HZ) ** 2
    assert dashpot == pytest.approx(2 * DAMPING * math.sqrt(STIFFNESS * mass), abs=3 * present(dashpot_u))


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
    x, y = np.asarray(speed.lines[1].get_xydata()).T
    steep = np.flatnonzero(np.abs(np.diff(y)) > 0.2 * y.max())
    assert np.abs(x[[steep, steep + 1]]).max() < 1e-9, "friction jumps where the mass rests, and nowhere else"
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


@patch("frictionlab.cli.analyze.MOST", 9)
def test_the_command_prints_the_text_draws_the_figure_and_tells_the_same_in_json(tmp_path: Path) -> None:
    scened = ["--scene", str(SCENE)]
    shown, told, lost = (
        invoke("explain", *words, *scened)
        for words in ([str(SAMPLE), "--plot", f"{tmp_path}/figures"], [str(SAMPLE), "--json"], ["nothing.h5"])
    )
    assert (shown.exit_code, told.exit_code, lost.exit_code) == (0, 0, 1)
    (row,) = rows_of(told)
    *lines, rest = shown.stdout.splitlines()
    assert len(lines) <= 8
    assert set(lines) < set(row["text"])
    assert rest == f"... {len(row['text']) - len(lines)} more lines: --wide"
    assert row["law"] == "coulomb"
    assert (tmp_path / "figures" / f"{SAMPLE.stem}.contact.png").is_file()
    assert "nothing.h5" in lost.stderr
