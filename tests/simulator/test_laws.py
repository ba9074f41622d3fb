"""The contact laws as data; what the numbers of a steady state do not say reaches row, file, figure and screen."""

import itertools
import json
import math
import pickle
import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from frictionlab.errors import ParameterError, UsageError
from frictionlab.maps import Grid, make_map
from frictionlab.simulator import Base, Problem, Solver, steady_state, sweep
from frictionlab.simulator import row as places
from frictionlab.simulator.laws import TERMS, excluded_by, law_of
from frictionlab.simulator.notes import WORDS, Note
from frictionlab.simulator.numeric.integrated import Integrated
from frictionlab.simulator.problem import Wall
from frictionlab.simulator.state import from_numbers
from frictionlab.simulator.sweep import warm_up
from frictionlab.tables import read_rows
from tests.desk import invoke, rows_of

WALLS: tuple[Wall, Wall] = ("fixed", "base")
CONTRACT = """
coulomb: beta
speed: contact_damping_ratio
place: gradient
breakaway: static_ratio_up static_ratio_down
compliance: stiffness_ratio
iwan: stiffness_ratio sliders chi
stribeck: static_ratio stribeck_speed stribeck_exponent
logarithm: rate_strength rate_speed
dahl: stiffness_ratio
bouc-wen: stiffness_ratio exponent
lugre: stiffness_ratio bristle_damping static_ratio stribeck_speed
rate-state: direct_effect evolution_effect slip_distance reference_speed stiffness_ratio
"""


def test_terms_and_parameters_are_the_contracts() -> None:
    told = [f"{name}: {' '.join(p.name for p in term.parameters)}" for name, term in TERMS.items()]
    assert sorted(told) == sorted(CONTRACT.split("\n")[1:-1])


def test_every_pair_of_terms_is_solved_or_excluded_by_name() -> None:
    for one, other in itertools.combinations([name for name in TERMS if name != "coulomb"], 2):
        name = f"coulomb+{one}+{other}"
        if other in excluded_by(TERMS[one]):
            with pytest.raises(ParameterError, match=f"{one} and {other} exclude each other: leave one out"):
                law_of(name)
        elif law_of(name).kind in ("smooth", "inner"):
            usual = {p.name: p.usual[1] for p in law_of(name).own if p.name != "beta"}
            Integrated(Problem(0.5, 0.4, law=name, parameters=usual))


@pytest.mark.parametrize(
    ("law", "solver", "known"),
    [("coulomb+compliance", "numeric", "auto, exact"), ("coulomb+dahl", "exact", "auto, numeric")],
)
def test_a_solver_that_does_not_know_the_law_is_refused_by_name(law: str, solver: Solver, known: str) -> None:
    said = f"solver '{solver}' does not know law {re.escape(law)}; expected one of {known}"
    with pytest.raises(UsageError, match=said):
        steady_state(Problem(0.5, 0.4, law=law, parameters={"stiffness_ratio": 10.0}), solver=solver)


def test_mu_and_zeta_stand_for_terms() -> None:
    problem = Problem(0.5, 0.4, mu=1.2, zeta=0.03)
    assert problem.law.name == "coulomb+breakaway+speed"
    assert problem.parameters == {
        "beta": 0.4,
        "static_ratio_up": 1.2,
        "static_ratio_down": 1.2,
        "contact_damping_ratio": 0.03,
        "frame_damping_ratio": 0.0,
    }
    assert Problem(0.5, 0.4, mu=1.3, law="coulomb+stribeck", parameters={"stribeck_speed": 0.1}).law.name == (
        "coulomb+stribeck"
    )


def test_the_frames_dashpot_is_driven_by_the_base_only_where_the_wall_stands() -> None:
    fixed, moving = (Problem(0.5, 0.4, frame_damping_ratio=0.01, wall=wall) for wall in WALLS)
    assert (fixed.force, moving.force) == (((1.0,), (-0.01,)), ((0.25,), (0.0,)))
    for problem in (fixed, moving):
        assert problem.force_size == pytest.approx(np.hypot(*np.ravel(problem.force)), rel=1e-14)


def test_a_problem_travels_and_compares() -> None:
    problem = Problem(0.5, 0.4, law="coulomb+place", parameters={"gradient": 0.02})
    assert pickle.loads(pickle.dumps(problem)) == problem  # noqa: S301 - our own bytes
    assert hash(problem) == hash(Problem(0.5, 0.4, law="coulomb+place", parameters={"gradient": 0.02}))
    assert problem.with_parameters({"gradient": 0.0}) != problem


@pytest.mark.parametrize(
    ("given", "match"),
    [
        ({"r": "fast"}, "r; expected a finite number >= 1e-06 and <= 1e[+]06; got 'fast'"),
        ({"r": None}, "r; expected a finite number .*; got None"),
        ({"r": 10**400}, "r; expected a finite number .*; got 1000"),
        ({"beta": 10**400}, "beta; expected a finite number >= 0; got 1000"),
        ({"beta": "much"}, "beta; expected a finite number >= 0; got 'much'"),
        *(
            ({"law": "coulomb", "parameters": {}, name: value}, rf"simulation: {name}; expected a finite number")
            for name in ("r", "beta", "mu", "zeta")
            for value in (math.nan, math.inf, -1.0)
        ),
        ({"parameters": {"gradient": [0.1]}}, r"gradient; expected a finite number; got \[0.1\]"),
        (
            {"law": "coulomb+dahl", "mu": 1.2, "parameters": {"stiffness_ratio": 10.0}},
            r"dahl: mu stands for the term breakaway, and dahl and breakaway exclude each other: leave one out",
        ),
        ({"law": None}, "law None: expected a text like 'coulomb[+]place'"),
        ({"law": "place"}, "expected a sum that starts with coulomb"),
        ({"law": "coulomb+wear"}, "'wear' is no term"),
        ({"law": "coulomb+place+place"}, "each term once"),
        ({"law": "coulomb+dahl+lugre"}, "dahl and lugre exclude each other"),
        ({"law": "coulomb+stribeck+logarithm"}, "stribeck and logarithm exclude each other"),
        ({"parameters": {}}, r"gradient \(relative change of the friction force over a way of Y\); expected a finite"),
        ({"law": "coulomb+iwan", "parameters": {"stiffness_ratio": 9.0, "chi": -1.0}}, "chi; expected"),
        ({"law": "coulomb+lugre", "parameters": {}}, "stiffness_ratio=1000 --parameter bristle_damping=1 --para"),
        ({"law": "coulomb"}, "'gradient' is none of its parameters; expected beta, frame_damping_ratio"),
        (
            {"law": "coulomb+compliance", "parameters": {"stiffness_ratio": 0.0}},
            "stiffness_ratio; expected a finite number > 0; got 0.0",
        ),
        (
            {"law": "coulomb+iwan", "parameters": {"stiffness_ratio": 9.0, "sliders": 2.5}},
            "sliders; expected a whole number >= 1 and <= 200",
        ),
    ],
)
def test_what_is_no_number_and_what_no_law_allows_is_refused_by_name(given: dict[str, Any], match: str) -> None:
    usual: dict[str, Any] = {"r": 0.5, "beta": 0.4, "law": "coulomb+place", "parameters": {"gradient": 0.1}}
    with pytest.raises(ParameterError, match=match):
        Problem(**(usual | given))


CHAOS = (0.36543323682064005, 0.1186830137216871, 2.5182266324590397)
SAID = {  # r, beta, mu, zeta, law, parameters: a word of what is to be said
    "continuum": ((0.5, 0.2, 1.0, 0.0), "coulomb", {}),
    "kinetic friction alone": ((0.9, 0.6, 1.7, 0.0), "coulomb", {}),
    "nothing damps": ((0.5, 0.0, 1.0, 0.0), "coulomb", {}),
    "a disturbance lasts": ((1.0 + 1e-6, 0.1, 1.0, 0.0), "coulomb", {}),
    "or is chaos": ((*CHAOS, 0.0), "coulomb", {}),
    "rest settles on": ((0.3, 0.2, 3.0, 0.0), "coulomb", {}),
    "friction that is larger at rest": ((0.3, 0.4, 1.2, 0.0), "coulomb+compliance", {"stiffness_ratio": 50.0}),
    "might go on": ((0.3, 0.4, 3.0, 0.0), "coulomb", {}),
    "mass runs away": ((0.5, 0.5, 1.0, 0.0), "coulomb+place", {"gradient": 2.5}),
    "which no contact does": ((1.0001, 0.3, 1.0, 0.0), "coulomb+place", {"gradient": 0.1}),
    "free vibration never dies out": ((0.3, 3.0, 1.0, 0.0), "coulomb+compliance", {"stiffness_ratio": 10.0}),
    "falls with speed": ((0.5, 0.4, 1.0, 0.0), "coulomb+stribeck", {"static_ratio": 1.3, "stribeck_speed": 0.1}),
    "not passive": (
        (0.7, 0.4, 1.0, 0.0),
        "coulomb+lugre",
        {"stiffness_ratio": 50.0, "bristle_damping": 0.1, "static_ratio": 1.05, "stribeck_speed": 1.0},
    ),
}


@pytest.mark.parametrize("words", SAID)
def test_a_row_of_a_map_says_what_the_steady_state_says(words: str) -> None:
    point, law, parameters = SAID[words]
    told = steady_state(Problem(*point, law=law, parameters=parameters))
    r, beta, mu, zeta = point
    states = sweep([r], [beta], [mu], [zeta], law=law, parameters={name: [value] for name, value in parameters.items()})
    (row,) = states.rows()
    assert any(words in sentence for sentence in told.warnings)
    assert row["warnings"] == list(told.warnings) == list(told.row()["warnings"])  # type: ignore[call-overload]
    for key in ("energy_per_cycle", "residual"):
        value = told.row()[key]
        assert row[key] == (None if value is None else pytest.approx(value, rel=1e-12, abs=1e-14)), key


@pytest.mark.parametrize(
    "problem",
    [
        Problem(1e5, 0.0, wall="base", base=Base((1.0, 0.2))),  # it hardly moves: a difference of two large motions
        Problem(1 + 1e-8, 0.3, base=Base((1.0, 0.0, 0.1)), law="coulomb+place", parameters={"gradient": 1e-9}),
    ],
)
def test_an_orbit_that_rounding_nearly_hides_or_moves_is_said(problem: Problem) -> None:
    state = steady_state(problem)
    assert state.outcome == "periodic"
    assert any("numbers are good to about" in said for said in state.warnings)


def test_a_mass_that_never_moves_loses_no_digits() -> None:
    assert steady_state(Problem(0.5, 1.4)).warnings == ()


@pytest.mark.parametrize(("miss", "residual"), [(np.inf, None), (0.01, 0.01)])
def test_a_search_given_up_before_it_came_anywhere_has_no_residual(miss: float, residual: float | None) -> None:
    """A file of a map says not known by NaN; it had infinity there."""
    row = np.full(places.ROW, np.nan)
    row[places.OUTCOME], row[places.MISS] = places.COSTLY, miss
    state = from_numbers(Problem(0.5, 0.4), row)
    assert (state.outcome, state.notes, state.residual) == ("not found", Note.GIVEN_UP, residual)
    assert ("missed itself by" in state.verdict) is (residual is not None)


def test_notes_of_many_points_are_those_of_each() -> None:
    """The rules are elementwise: arrays and numbers go through the same lines."""
    warm_up("coulomb")
    rng = np.random.default_rng(20)
    r, beta = np.append(rng.uniform(0.3, 1.5, 2), [0.5, 1.0]), np.append(rng.uniform(0.0, 0.9, 2), [0.0, 0.05])
    gradients = [0.0, 0.1]
    states = sweep(
        r.tolist(), beta.tolist(), [1.0, 2.0], [0.0, 0.02], law="coulomb+place", parameters={"gradient": gradients}
    )
    seen = set()
    for row in states.rows():
        r0, b0, mu, zeta, gradient = (float(str(row[key])) for key in ("r", "beta", "mu", "zeta", "gradient"))
        told = steady_state(Problem(r0, b0, mu, zeta, law="coulomb+place", parameters={"gradient": gradient}))
        assert row["warnings"] == list(told.warnings), told
        seen |= {note for note in Note if note & told.notes}
    assert len(seen) >= 4


def test_every_note_has_words() -> None:
    assert set(WORDS) == set(Note)
    assert not any(words.endswith(".") for words in WORDS.values())


def test_the_file_of_a_map_has_flags_with_their_meanings(tmp_path: Path) -> None:
    for _ in make_map(Grid((0.5, 0.6), (0.2,)), tmp_path / "map.h5", workers=1):
        pass
    with h5py.File(tmp_path / "map.h5") as file:
        flags = file["warnings"]
        meanings, masks = flags.attrs["flag_meanings"].split(), flags.attrs["flag_masks"]
        said = dict(zip(meanings, zip(masks, flags.attrs["flag_sentences"], strict=True), strict=True))
        mask, sentence = said["continuum"]
        assert flags[...].ravel().tolist() == [mask, 0]
        assert sentence == WORDS[Note.CONTINUUM]
        assert len(meanings) == len(masks) == len(Note)


def test_a_sweep_tells_each_kind_of_warning_once_with_its_place(tmp_path: Path) -> None:
    grid = ("sweep", "--r", "0.5,0.6", "--beta", "0.1,0.2", "-o", str(tmp_path / "map.csv"), "--force")
    ran = invoke(*grid)
    assert ran.stderr.count("warning") == 1
    assert "warning: at 2 of 4 points this is the symmetric one of a continuum of motions (3.3)" in ran.stderr
    assert "(the first: r = 0.5, beta = 0.1" in ran.stderr
    assert "continuum" not in invoke(*grid, "--quiet").stderr
    rows = rows_of(invoke(*grid, "--json"))
    assert [len(row["warnings"]) for row in rows] == [1, 1, 0, 0]
    assert [row["warnings"] for row in read_rows(tmp_path / "map.csv")] == [row["warnings"] for row in rows]
    shown = invoke("show", str(tmp_path / "map.csv")).stderr
    assert shown.count("continuum") == 1
    assert shown.endswith("    in row 1, row 2\n")


def test_simulate_has_its_warnings_in_the_row_and_once_on_the_screen() -> None:
    row = json.loads(invoke("simulate", "--r", "0.5", "--beta", "0.2", "--json").stdout)
    assert row["warnings"] == list(steady_state(Problem(0.5, 0.2)).warnings)
    ran = invoke("simulate", "--r", "0.5", "--beta", "0.2")
    assert (ran.stdout + ran.stderr).count("continuum") == 1
