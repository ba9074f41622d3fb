"""Against a peer nobody here wrote: heyoka's Taylor integrator with its own event detection."""

import pytest

from frictionlab.simulator import Problem, steady_state
from tests.simulator import peer

pytest.importorskip("heyoka", reason="heyoka is not installed: pip install 'frictionlab[peers]'")


@pytest.mark.parametrize(
    ("r", "beta"), [(0.5, 0.4), (0.7, 0.5), (0.3, 0.6), (0.2, 0.3), (1.4, 0.8), (0.8, 0.9)], ids=str
)
def test_agrees_with_a_taylor_integrator(r: float, beta: float) -> None:
    theirs = peer.run(r, beta, cycles=60)
    ours = steady_state(Problem(r, beta))
    assert ours.energy_per_cycle == pytest.approx(theirs.energy, rel=1e-11)
    assert ours.response_amplitude == pytest.approx(theirs.amplitude, rel=1e-11)
    assert ours.stops_per_cycle == theirs.stops
