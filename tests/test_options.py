"""The reader's options have one home: said in a scene, on the command line or in a notebook they mean the same."""

import json
from pathlib import Path

import pytest

import frictionlab as fl
from frictionlab.cli.options import ANALYSIS, LOG, Settings, values_of
from frictionlab.errors import UsageError
from frictionlab.simulator.laws import TERMS
from tests.desk import invoke

LINES = "\n".join(f"{4000 * i}|{1.5 + 0.001 * (i % 7):.3f}|{2.25 + 0.001 * (i % 5):.3f}" for i in range(100))
LOG_TEXT = f"t|mass|base\n{LINES}\n"
SAID = {"separator": "pipe", "time_unit": "µs", "unit": "µm", "mass": "2", "bridge_s": 0.1}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.txt"
    path.write_text(LOG_TEXT)
    return path


def ingested(log: Path, *words: str) -> dict[str, object]:
    done = invoke("ingest", log, "--dry-run", "--json", *words)
    assert done.exit_code == 0, done.output
    row: dict[str, object] = json.loads(done.stdout)
    return row


def test_an_option_means_the_same_wherever_it_is_said(log: Path) -> None:
    (log.parent / "scene.toml").write_text(
        "[log]\n" + "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in SAID.items())
    )
    by_scene = ingested(log, "--scene", str(log.parent / "scene.toml"))
    flags = {key: words.flags for key, (_, words) in LOG.items()}
    by_line = ingested(log, *(word for key, value in SAID.items() for word in (flags[key], str(value))))
    recording = fl.ingest(log, None, **SAID)  # type: ignore[arg-type]
    assert by_line == by_scene
    assert by_line["sampling_rate_hz"] == pytest.approx(250.0, rel=1e-9)
    assert recording.sampling_rate_hz == pytest.approx(250.0, rel=1e-9)
    assert float(recording.mass_displacement[0]) == pytest.approx(1.5e-6, rel=1e-12)
    assert recording.source.options == {**fl.LogOptions(**SAID).given()}  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("command", "settings", "named"),
    [
        ("ingest", LOG, "--separator --decimal --encoding --time --mass --base --unit --time-unit --sampling-rate"),
        ("analyze", ANALYSIS, "--natural-frequency --transient --cycles --padding"),
        ("compare-numeric", ANALYSIS, "--natural-frequency --transient --cycles --padding"),
    ],
)
def test_every_key_of_a_table_is_an_option_with_its_words(command: str, settings: Settings, named: str) -> None:
    helped = invoke(command, "--help-all", env={"COLUMNS": "200"}).stdout
    helped = " ".join(helped.split())
    for _, words in settings.values():
        assert f" {words.flags} {words.takes} " in helped
        assert words.words in helped
    assert set(named.split()) <= {words.flags for _, words in settings.values()}
    assert settings is ANALYSIS or list(settings) == list(fl.LogOptions.model_fields)


def test_a_wrong_option_is_one_line_that_names_it(log: Path) -> None:
    done = invoke("ingest", log, "--unit", "parsec", "--time-unit", "mm")
    assert done.exit_code == 2
    first, second = done.stderr.splitlines()
    assert first.startswith("frictionlab: setting: log.unit: expected a unit of displacement, one of m, mm")
    assert second.startswith("frictionlab: setting: log.time_unit: expected a unit of time, one of s, ms")


def test_laws_are_listed_with_parameters_and_one_is_drawn(tmp_path: Path) -> None:
    every = [json.loads(line) for line in invoke("laws", "--json").stdout.splitlines()]
    assert [row["law"] for row in every] == list(TERMS)
    assert all(
        set(parameter) > {"words", "low", "high", "usual"} for row in every for parameter in row["parameters"].values()
    )
    listed = invoke("laws").stdout.splitlines()
    assert [line.split()[0] for line in listed[1:-1]] == list(TERMS)
    assert max(map(len, listed)) <= 80
    figure = tmp_path / "loop.svg"
    done = invoke("laws", "place", "--plot", figure)
    assert (done.exit_code, figure.exists()) == (0, True)
    assert done.stdout.splitlines()[2].startswith("place: friction varying along the path: ")
    assert invoke("laws", "coulomb+nothing").exit_code == 2


def test_a_step_beyond_its_range_is_refused_not_one_value() -> None:
    with pytest.raises(UsageError, match="--r: expected a range of up to 10000000 values going up"):
        values_of("0.1:2:20", "--r")
    assert values_of("0.5:0.5:0.1", "--r") == [0.5]
