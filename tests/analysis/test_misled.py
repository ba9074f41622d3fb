"""What misleads is measured right, or its cause is named: motions, sensors, clocks and columns whose truth is known."""

import numpy as np
import pytest

from frictionlab.analysis.measure import measure
from frictionlab.errors import AnalysisError
from tests.analysis.hostile import ALL, as_read, changed, motion, seen


def test_a_range_that_cuts_every_cycle_is_named_and_not_the_transient() -> None:
    of = motion(0.5, 0.4)
    one = seen(of, seconds=40.0)
    cut = np.minimum(one.mass_displacement, 0.8 * one.mass_displacement.max())
    with pytest.raises(AnalysisError, match=r"held at the end of a sensor's range.*enlarge its range"):
        measure(as_read(changed(one, mass=cut)), ALL)


def test_many_gaps_are_counted_not_listed() -> None:
    one = seen(motion(0.5, 0.4), seconds=60.0)
    mass, far = np.array(one.mass_displacement), one.mass_displacement.max() + 1e-4
    for late in range(22, 58, 4):
        mass[late * 500 : late * 500 + 20] = far  # a hand on the sensor's beam
    said = [w for w in measure(as_read(changed(one, mass=mass)), ALL).warnings if w.startswith("gap: ")]
    assert len(said) == 6
    assert said[-1].startswith("gap: 4 more")
