"""The library as the README shows it: its example runs, and prints what its comments say."""

import contextlib
import io
import re
from pathlib import Path

import pytest

import frictionlab as fl

ROOT = Path(__file__).parents[1]


def test_the_readme_example_runs_and_prints_what_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    said = re.findall(r"# (\d[\d.]*)$", code, re.MULTILINE)
    monkeypatch.chdir(ROOT)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "README.md", "exec"), {})  # noqa: S102  # the document is what is tested
    assert printed.getvalue().split() == said


def test_results_tell_what_they_are_in_a_line() -> None:
    problem = fl.Problem(r=0.5, beta=0.4)
    assert repr(problem) == "<Problem r = 0.5, coulomb: beta 0.4, frame_damping_ratio 0, fixed wall>"
    assert repr(problem.law) == "<Law coulomb>"
    assert repr(fl.sweep([0.3, 0.5], [0.4])) == "<StateMap coulomb: 2 r 0.3 to 0.5, beta 0.4, mu 1, zeta 0; fixed wall>"
    told = repr(fl.simulate(problem))
    assert told.startswith("<SteadyState r = 0.5, coulomb: The motion repeats every cycle: stick-slip with 2 stops")
    scene = fl.scene_from_tables(
        {
            "rig": {"stiffness_n_per_m": 1191.0, "natural_frequency_hz": 3.13},
            "plan": {"normal_forces_n": [1.0], "friction_coefficient": [0.5, 0.1], "frequency_ratios": [0.3, 0.5]},
        }
    )
    assert repr(scene).startswith("Scene(rig=Rig(natural_frequency_hz=3.13, stiffness_n_per_m=1191.0), plan=PlanTable(")
    assert repr(fl.plan(scene, tests=1)).startswith("<Plan coulomb: 1 tests, r = 0.")
    resonant = fl.Problem(r=1.0, beta=0.3)
    response = fl.respond(ROOT / "sample_data" / "steel_N1.25_r0.3.csv", resonant, natural_frequency_hz=3.13)
    assert repr(response).startswith("<RecordResponse to ")
    assert len(repr(response)) < 250
