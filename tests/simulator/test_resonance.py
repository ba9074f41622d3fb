"""Next to resonance a disturbance lasts as many cycles as the motion is large, and digits go as the distance does."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.simulator import Base, Problem, steady_state

REFERENCE = json.loads((Path(__file__).parent / "reference" / "resonance.json").read_text(encoding="utf-8"))


def rounding(r: float, zeta: float, base: Base) -> float:
    """What rounding may do so near to the resonance of a harmonic (design, "One engine")."""
    return 3e-15 / min(abs(complex(1.0 - k * r, zeta)) for k in range(1, base.harmonics + 1))


@pytest.mark.parametrize("row", REFERENCE, ids=lambda row: f"r={row['r']!r} zeta={row['zeta']:g}")
def test_motions_driven_next_to_resonance_agree_with_fifty_digits(row: dict[str, Any]) -> None:
    base = Base(tuple(row["cosine"]), tuple(row["sine"]))
    state = steady_state(Problem(row["r"], row["beta"], 1.0, row["zeta"], base=base))
    lost = rounding(row["r"], row["zeta"], base)
    if state.outcome == "not found":  # refused by name, where the distance leaves too few digits
        assert lost > 1e-6
        return
    assert state.response_amplitude is not None
    assert state.response_amplitude == pytest.approx(float(row["response_amplitude"]), rel=max(2e-15, lost))
    if row["zeta"] == 0.0:
        path = float(row["path_per_cycle"])
        assert state.energy_per_cycle == pytest.approx(row["beta"] * path, rel=max(4e-15, lost))
    assert abs(state.floquet_multiplier or 2.0) <= 1.0
    told = any("good to about" in said for said in state.warnings)
    assert told or abs(state.response_amplitude / float(row["response_amplitude"]) - 1.0) <= 1e-10
    assert not told or lost > 1e-10


@settings(max_examples=20, deadline=None)
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
    r = (1.0 + side * away) / n
    state, lost = (
        steady_state(Problem(r, 0.25 * np.pi * share * drive, 1.0, damped, base=base)),
        rounding(r, damped, base),
    )
    if state.outcome == "not found":  # as above
        assert lost > 1e-9
        return
    assert state.outcome == "periodic"
    assert state.energy_per_cycle is not None
    assert state.closure_error is not None
    assert state.closure_error <= max(1e-12, lost) * state.energy_per_cycle
    assert any("good to about" in w for w in state.warnings) or state.closure_error <= 1e-10 * state.energy_per_cycle
