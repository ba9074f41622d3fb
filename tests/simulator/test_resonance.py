"""Next to resonance a disturbance lasts as many cycles as the motion is large: no digit may be lost for that."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.simulator import Base, Problem, steady_state

REFERENCE = json.loads((Path(__file__).parent / "reference" / "resonance.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("row", REFERENCE, ids=lambda row: f"r={row['r']!r} zeta={row['zeta']:g}")
def test_motions_driven_next_to_resonance_agree_with_fifty_digits(row: dict[str, Any]) -> None:
    base = Base(tuple(row["cosine"]), tuple(row["sine"]))
    state = steady_state(Problem(row["r"], row["beta"], 1.0, row["zeta"], base=base))
    assert state.response_amplitude == pytest.approx(float(row["response_amplitude"]), rel=2e-15)
    if row["zeta"] == 0.0:
        assert state.energy_per_cycle == pytest.approx(row["beta"] * float(row["path_per_cycle"]), rel=4e-15)
    assert abs(state.floquet_multiplier or 2.0) <= 1.0
    assert not any("good to about" in said for said in state.warnings)


@settings(max_examples=40, deadline=None)
@given(
    n=st.integers(1, 3),
    away=st.floats(-13.0, -2.5).map(lambda power: 10.0**power),
    side=st.sampled_from([-1.0, 1.0]),
    share=st.floats(0.05, 0.95),
    damped=st.sampled_from([0.0, 1e-12, 1e-6]),
    more=st.tuples(*[st.floats(-0.3, 0.3)] * 5),
)
def test_energies_close_next_to_the_resonance_of_any_harmonic(
    n: int, away: float, side: float, share: float, damped: float, more: tuple[float, ...]
) -> None:
    base = Base((1.0, 0.4 + more[0], 0.4 + more[1]), more[2:])
    drive = float(np.hypot(base.cosine[n - 1], base.sine[n - 1]))
    state = steady_state(Problem((1.0 + side * away) / n, 0.25 * np.pi * share * drive, 1.0, damped, base=base))
    assert state.outcome == "periodic"
    assert state.energy_per_cycle is not None
    assert state.closure_error is not None
    assert state.closure_error <= 1e-12 * state.energy_per_cycle


def test_far_and_near_the_two_ways_to_the_orbit_meet() -> None:
    base = Base((1.0, 0.2, 0.1), (0.0, 0.1, 0.05))
    inner, outer = (steady_state(Problem(1.0 + away, 0.3, base=base)) for away in (0.00999999999, 0.01000000001))
    assert inner.response_amplitude == pytest.approx(outer.response_amplitude, rel=1e-8)
    assert inner.energy_per_cycle == pytest.approx(outer.energy_per_cycle, rel=1e-8)
