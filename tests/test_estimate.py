"""A number and its errors: one type, one way to say not known, and flat names that cannot part from them."""

import math
import pickle
from dataclasses import FrozenInstanceError, dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab.analysis.measurement import Measurement
from frictionlab.estimate import Average, Estimate, Flat, FlatKnown, average
from frictionlab.inference.comparison import Comparison
from frictionlab.schema import COMPARISONS, MEASUREMENTS, Table

NUMBERS = st.floats(-1e9, 1e9).filter(lambda x: abs(x) > 1e-9)


@dataclass(frozen=True)
class Result:
    energy: Estimate
    energy_per_cycle = FlatKnown("energy")
    energy_per_cycle_se = Flat("energy", "se")
    energy_per_cycle_u = Flat("energy", "u")


@pytest.mark.parametrize("nothing", [None, math.nan, math.inf])
def test_not_known_is_none_however_it_is_said(nothing: float | None) -> None:
    assert Estimate(nothing, nothing, nothing) == Estimate()
    assert not Estimate(nothing, 0.1).known
    assert Estimate(1.0, nothing).relative_se is None
    assert str(Estimate(nothing)) == "not known"


@given(NUMBERS, st.floats(1e-9, 1e9), NUMBERS)
def test_an_exact_factor_keeps_the_relative_error(value: float, se: float, factor: float) -> None:
    scaled = Estimate(value, se, 2 * se).scaled(factor)
    assert scaled.value == value * factor
    assert scaled.se == pytest.approx(abs(se * factor))
    assert Estimate(value, se).over(factor).value == value / factor
    assert scaled.relative_se == pytest.approx(Estimate(value, se).relative_se)


def test_the_widest_known_error_is_told() -> None:
    assert str(Estimate(2.126, 0.0031)) == "2.1260 ± 0.0031"
    assert str(Estimate(2.126, 0.0031).with_u(0.031)) == "2.126 ± 0.031"
    assert str(Estimate(1e-20, 1e-24)) == "1e-20 ± 1e-24"
    assert str(Estimate(0.4)) == "0.4"


def test_flat_names_are_read_off_the_estimate() -> None:
    result = Result(Estimate(2.0, 0.1))
    assert (result.energy_per_cycle, result.energy_per_cycle_se, result.energy_per_cycle_u) == (2.0, 0.1, None)
    assert math.isnan(Result(Estimate()).energy_per_cycle)
    assert pickle.loads(pickle.dumps(result)) == result  # noqa: S301 (our own bytes)
    with pytest.raises(FrozenInstanceError, match="energy"):
        result.energy = Estimate()  # type: ignore[misc]  # that is the point
    with pytest.raises(FrozenInstanceError, match="value"):
        result.energy.value = 1.0  # type: ignore[misc]  # that is the point


def test_an_average_weighs_errors_and_scatter() -> None:
    assert average([3.0], [0.1]) == Average(3.0, 0.1, None)
    alike = average([3.1, 3.2, 3.3], [1e-6] * 3)
    assert (alike.mean, alike.spread, alike.se) == pytest.approx((3.2, 0.1, 0.1 / math.sqrt(3)), rel=1e-6)
    assert average([1.0, 2.0], [1e-3, 1.0]).mean == pytest.approx(1.0, abs=0.01)
    assert average([1.0, 1.0], [0.1, 0.1]).se == pytest.approx(0.1 / math.sqrt(2))


@pytest.mark.parametrize(("result", "table"), [(Measurement, MEASUREMENTS), (Comparison, COMPARISONS)])
def test_every_number_of_a_row_with_an_error_is_an_estimate(result: type, table: Table) -> None:
    """A flat name for each column of errors, and all of one number read off one estimate."""
    for column in table.columns:
        if column.error_of:
            error, value = (getattr(result, name) for name in (column.name, column.error_of))
            assert vars(error)["_estimate"] == vars(value)["_estimate"]
            assert column.name.endswith(vars(error)["_part"])
