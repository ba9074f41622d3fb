"""The thesis's chapter 3 as physics: its claims where they hold, and where they do not, the proof."""

from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from frictionlab.errors import SimulationError
from frictionlab.simulator import Problem, last_cycle, steady_state, sweep, thesis_run
from tests.simulator.closed_form import (
    continuous_amplitude,
    continuous_energy,
    friction_limit,
    viscous_energy,
)

BETAS = tuple(round(0.1 * i, 1) for i in range(1, 10))
RATIOS = tuple(round(0.05 * i, 2) for i in range(1, 51))


@cache
def over_the_map(key: str) -> np.ndarray:
    return sweep(RATIOS, BETAS).datasets()[key][:, :, 0, 0]


@settings(deadline=None, max_examples=30)
@given(r=st.floats(0.05, 20.0), share=st.floats(1e-6, 1.0 - 1e-9))
def test_below_the_limit_the_closed_form_is_the_orbit(r: float, share: float) -> None:
    beta = share * friction_limit(r)
    assume(beta >= 1e-9)
    assume(r != 1.0)  # there the motion grows without bound: test_steady_state.py
    state = steady_state(Problem(r, beta), solver="exact")
    assert state.stops_per_cycle == 0
    assert state.energy_per_cycle == pytest.approx(continuous_energy(r, beta), rel=1e-10)
    assert state.response_amplitude == pytest.approx(continuous_amplitude(r, beta), rel=1e-10)


@settings(deadline=None, max_examples=30)
@given(r=st.floats(0.05, 20.0))
def test_at_the_limit_stops_begin(r: float) -> None:
    limit = friction_limit(r)
    if limit < 1e-6 or abs(r - 1.0) < 1e-3:
        return
    assert steady_state(Problem(r, limit * (1 - 1e-9))).solver == "closed-form"
    above = steady_state(Problem(r, limit * (1 + 1e-9)))
    if above.outcome == "not found":  # refused by name next to resonance, where the map has a kink beside the orbit
        assert abs(r - 1.0) < 0.05
        return
    assert above.solver == "exact"
    assert (above.stops_per_cycle or 0) > 0


@pytest.mark.parametrize("n", range(1, 9))
def test_the_limit_at_even_subharmonics_is_the_bound_of_eq_3_3(n: int) -> None:
    assert friction_limit(1 / (2 * n)) == pytest.approx(1 / (4 * n * n - 1), rel=1e-12)
    assert friction_limit(1 / (2 * n + 1)) < 1e-14


def test_beta_nine_tenths_only_sticks_and_slips() -> None:
    assert (over_the_map("stops_per_cycle")[:, 8] > 0).all()
    assert max(friction_limit(r) for r in np.linspace(0.02, 5.0, 400)) < 0.9
    continuous = [r for r in np.linspace(0.5, 1.2, 141) if friction_limit(float(r)) > 0.8]
    assert continuous[0] == pytest.approx(0.77, abs=0.01)  # Fig. 3.4's range at beta = 0.8
    assert continuous[-1] == pytest.approx(0.96, abs=0.01)


def test_friction_and_the_peaks() -> None:
    """Above resonance more friction dissipates less, and 0.5 the most; friction moves the peak left."""
    energy, high = over_the_map("energy_per_cycle"), np.array(RATIOS) > 1.2
    assert (np.argmax(energy[high], axis=1) == BETAS.index(0.5)).all()
    assert (energy[high, 8] < energy[high, 0]).all()
    peaks = [RATIOS[int(np.nanargmax(energy[:, j]))] for j in (7, 8)]
    assert peaks[0] < 1.0  # beta = 0.8
    assert peaks[1] < peaks[0] - 0.2  # beta = 0.9: considerably more


def test_bumps_at_low_frequency_come_with_changing_stops() -> None:
    r = np.arange(0.02, 0.3, 0.002)
    for beta in (0.1, 0.3, 0.5):
        states = sweep(r.tolist(), [beta]).datasets()
        slope = np.diff(states["energy_per_cycle"].ravel())
        assert (np.diff(np.sign(slope)) != 0).sum() >= 4
        assert len(set(states["stops_per_cycle"].ravel().tolist())) >= 4


def test_high_friction_has_two_stick_slip_regions() -> None:
    for beta in (0.6, 0.7, 0.8):
        slips = over_the_map("stops_per_cycle")[:, BETAS.index(beta)] > 0
        slips[RATIOS.index(1.0)] = False
        assert slips[0]
        assert not slips.all()
        assert (np.diff(slips.astype(int)) != 0).sum() == (1 if beta == 0.6 and not slips[-1] else 2)


def test_the_thesis_method_converges_to_the_exact_orbit() -> None:
    exact = steady_state(Problem(0.5, 0.4)).energy_per_cycle
    errors = []
    for rtol in (1e-3, 1e-5, 1e-7):
        run = thesis_run(Problem(0.5, 0.4), cycles=30, rtol=rtol, atol=rtol * 1e-3)
        assert run.stops_per_cycle == 2.0
        errors.append(abs((run.energy_per_cycle or 0.0) / exact - 1.0) if exact else 1.0)
    assert errors[0] < 2e-3  # default tolerances
    assert errors[2] < 1e-5
    assert errors[2] < errors[0]


def test_the_thesis_viscous_oscillator_and_what_has_not_settled() -> None:
    run = thesis_run(Problem(0.8, 0.0, zeta=0.3), cycles=15, rtol=1e-6, atol=1e-9)
    assert run.energy_per_cycle == pytest.approx(viscous_energy(0.8, 0.3), rel=1e-4)
    assert (run.closure_error or 0.0) < 1e-5 * viscous_energy(0.8, 0.3)
    state = last_cycle(Problem(0.95, 0.1), cycles=20, solver="thesis")
    assert (state.outcome, state.solver) == ("not settled", "thesis")
    with pytest.raises(SimulationError, match="cycles; expected >= 1"):
        thesis_run(Problem(0.5, 0.4), cycles=0)
