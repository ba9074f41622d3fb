"""A small recording whose stamps jump must not ask for terabytes."""

import numpy as np
import pytest

from frictionlab.analysis.signals import evenly
from frictionlab.errors import AnalysisError


def test_unflagged_jumps_are_refused_by_size() -> None:
    t = np.arange(2000) / 250
    t[1000:] += 1.7e9
    with pytest.raises(AnalysisError, match=r"jump from 3.996 to 1.7e\+09 s, unflagged: 2000 samples would become"):
        evenly(t, 0.004, {"mass": t})
