"""The contact laws as data: names, parameters, domains, what excludes what."""

import itertools
import pickle
import re
from typing import Any

import pytest

from frictionlab.errors import ParameterError, UsageError
from frictionlab.simulator import Problem, Solver, steady_state
from frictionlab.simulator.laws import TERMS, excluded_by, law_of
from frictionlab.simulator.numeric import Integrated

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


@pytest.mark.parametrize(
    ("law", "parameters", "fault"),
    [
        ("place", {}, "expected a sum that starts with coulomb"),
        ("coulomb+wear", {}, "'wear' is no term"),
        ("coulomb+place+place", {}, "each term once"),
        ("coulomb+dahl+lugre", {}, "dahl and lugre exclude each other"),
        ("coulomb+stribeck+logarithm", {}, "stribeck and logarithm exclude each other"),
        ("coulomb+place", {}, "gradient (relative change of the friction force over a way of Y); expected a finite"),
        ("coulomb+iwan", {"stiffness_ratio": 9.0, "chi": -1.0}, "chi; expected"),
        ("coulomb", {"gradient": 0.1}, "'gradient' is none of its parameters; expected beta, frame_damping_ratio"),
        ("coulomb+compliance", {"stiffness_ratio": 0.0}, "stiffness_ratio; expected a finite number > 0; got 0.0"),
        ("coulomb+iwan", {"stiffness_ratio": 9.0, "sliders": 2.5}, "sliders; expected a whole number >= 1 and <= 200"),
    ],
)
def test_what_no_law_allows_is_refused_by_name(law: str, parameters: dict[str, float], fault: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(fault)):
        Problem(0.5, 0.4, law=law, parameters=parameters)


def test_every_pair_of_terms_is_solved_or_excluded_by_name() -> None:
    for one, other in itertools.combinations([name for name in TERMS if name != "coulomb"], 2):
        name = f"coulomb+{one}+{other}"
        if other in excluded_by(TERMS[one]):
            with pytest.raises(ParameterError, match=f"{one} and {other} exclude each other: leave one out"):
                law_of(name)
        elif law_of(name).kind in ("smooth", "inner"):
            usual = {p.name: p.usual[1] for p in law_of(name).own if p.name != "beta"}
            Integrated(Problem(0.5, 0.4, law=name, parameters=usual))


def test_mu_is_refused_by_its_own_name_where_the_law_has_no_break_away() -> None:
    said = (
        "law coulomb+dahl: mu stands for the term breakaway, and dahl and breakaway exclude each other: leave one out"
    )
    with pytest.raises(ParameterError, match=re.escape(said)):
        Problem(0.5, 0.4, mu=1.2, law="coulomb+dahl", parameters={"stiffness_ratio": 10.0})


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
    assert Problem(0.5, 0.4, frame_damping_ratio=0.01).force == ((1.0,), (-0.01,))
    assert Problem(0.5, 0.4, frame_damping_ratio=0.01, wall="base").force == ((0.25,), (0.0,))


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
        ({"parameters": {"gradient": [0.1]}}, r"gradient; expected a finite number; got \[0.1\]"),
        ({"law": None}, "law None: expected a text like 'coulomb[+]place'"),
    ],
)
def test_what_is_no_number_is_refused_by_name(given: dict[str, Any], match: str) -> None:
    usual: dict[str, Any] = {"r": 0.5, "beta": 0.4, "law": "coulomb+place", "parameters": {"gradient": 0.1}}
    with pytest.raises(ParameterError, match=match):
        Problem(**(usual | given))
