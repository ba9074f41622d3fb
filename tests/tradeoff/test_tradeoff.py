"""The trade: what is measured is deterministic but for seconds, referenced, and marked as the contract says."""

import json
import math
import re
import time
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab import tradeoff
from frictionlab.errors import SceneError
from frictionlab.scene import Scene
from frictionlab.scene.keys import LEVELS
from frictionlab.simulator import Problem
from frictionlab.tradeoff import Setting, marked
from frictionlab.verbs.inputs import scene_given

ROOT = Path(__file__).parents[2]
README = ROOT / "frictionlab" / "tradeoff" / "README.md"
ORBITS = json.loads((ROOT / "tests" / "simulator" / "reference" / "rigid.json").read_text(encoding="utf-8"))
LEVELS_OF = {command: partial(tradeoff.accuracy_of, command) for command in ("analyze", "compare-numeric")}
IN_README = (*LEVELS_OF.values(), tradeoff.padding)
Knob = Callable[[], tuple[Setting, ...]]


@pytest.mark.parametrize(
    ("problem", "energy"),
    [
        (tradeoff.CONTINUOUS, tradeoff.CONTINUOUS_ENERGY),
        (tradeoff.STICK_SLIP, tradeoff.STICK_SLIP_ENERGY),
        (tradeoff.SLOW, tradeoff.SLOW_ENERGY),
    ],
)
def test_the_references_are_the_fifty_digit_orbits(problem: Problem, energy: float) -> None:
    (row,) = [row for row in ORBITS if (row["r"], row["beta"], row["parameters"]) == (problem.r, problem.beta, {})]
    assert energy == float(row["energy_per_cycle"])


@pytest.mark.parametrize("knob", IN_README)
def test_a_knob_has_one_default_a_reference_and_the_errors_of_the_readme(
    knob: Knob, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tradeoff, "timeit", lambda *_, **__: 1.0)
    settings = knob()
    assert [s.default for s in settings].count(True) == 1
    assert all(s.reference and math.isfinite(s.error) and s.seconds > 0 for s in settings)
    text = README.read_text("utf-8")
    written = dict(re.findall(r"^\| (.+? \| .+?) \| ([-+.e0-9]+) \|", text, re.MULTILINE))
    for s in settings:
        assert float(written[f"{s.knob} | {s.setting}"]) == pytest.approx(s.error, rel=0.02)


def test_a_first_run_that_compiles_is_not_timed() -> None:
    @cache
    def run() -> float:
        time.sleep(0.2)
        return 1.0

    (setting,) = tradeoff.run_trials("k", "q", 1.0, "truth", {"auto": run}, "auto")
    assert setting.seconds < 0.1


POSITIVE = st.floats(1e-12, 1e3)


@given(st.lists(st.tuples(POSITIVE, POSITIVE), min_size=1, max_size=12))
def test_of_any_settings_the_fastest_and_the_most_accurate_are_never_beaten(pairs: list[tuple[float, float]]) -> None:
    settings = marked([Setting("k", str(i), "q", error, seconds) for i, (error, seconds) in enumerate(pairs)])
    front = [s for s in settings if not s.dominated]
    assert min(settings, key=lambda s: (s.seconds, s.error)) in front
    assert min(settings, key=lambda s: (s.error, s.seconds)) in front
    assert all(any(tradeoff.beats(other, s) for other in settings) == s.dominated for s in settings)


def test_a_level_of_accuracy_is_its_knobs_and_what_is_given_beside_it_wins() -> None:
    assert Scene().accuracy == "balanced"
    for level, knobs in LEVELS.items():
        said = scene_given(None, {"accuracy": level}, ("analysis", "rig"))
        assert (said.accuracy, said.analysis.knobs) == (level, knobs)
    said = scene_given(None, {"accuracy": "fast", "padding": 7}, ("analysis", "rig"))
    assert said.analysis.knobs == {**LEVELS["fast"], "padding": 7}
    with pytest.raises(SceneError, match="accuracy: expected 'fast', 'balanced' or 'exact'; got 'sloppy'"):
        scene_given(None, {"accuracy": "sloppy"}, ("analysis",))
