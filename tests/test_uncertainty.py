"""A number and its errors; the uncertainty budget: each share against the change it stands for, sources, coverage."""

import math
import pickle
from collections.abc import Mapping
from dataclasses import FrozenInstanceError, dataclass, replace
from inspect import getattr_static

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab import compare, uncertainty
from frictionlab.analysis.channels import SensorChannel, low_pass, restored
from frictionlab.analysis.measurement import Measurement, measure
from frictionlab.arrays import FloatArray
from frictionlab.cli.screen import assumed
from frictionlab.inference.comparison import Comparison
from frictionlab.inference.observations import CycleObservation, observe
from frictionlab.scene import Scene
from frictionlab.schema import COMPARISONS, MEASUREMENTS, Table
from frictionlab.simulator import Problem
from frictionlab.uncertainty import (
    STATISTICAL,
    Average,
    Estimate,
    Flat,
    FlatKnown,
    average,
    combined,
    sources_of,
    unit_share,
)
from tests.desk import present
from tests.inference.contacts import NATURAL_HZ, assert_slopes_of_sensors, recorded, scene

Shown = tuple[FloatArray, FloatArray]
KEYS = ("frequency_ratio", "base_amplitude_m", "energy_per_cycle", "response_amplitude")


def measured(
    *, lag_s: float = 0.0, gain: float = 1.0, r: float = 0.8, what: Mapping[str, Mapping[str, object]] | None = None
) -> Measurement:
    recording = recorded(
        Problem(r, 0.35), np.random.default_rng(1), scatter=0.0, seconds=25.0, lag_s=lag_s, gain=gain, rate=500.0
    )
    return measure(recording, scene(**(what or {})))


def test_the_shares_make_the_combined_uncertainty_and_the_standard_error_is_one_of_them() -> None:
    m = measured()
    assert set(m.budget) == set(KEYS)
    for key in KEYS:
        row = m.row()
        assert combined(m.budget[key]) == pytest.approx(row[f"{key}_u"])
        assert m.budget[key][STATISTICAL] == pytest.approx(row[f"{key}_se"] or 0.0)
    assert present(m.energy_per_cycle_u) > 10 * m.energy_per_cycle_se


@pytest.mark.parametrize(
    ("r", "change", "declared", "share", "key"),
    [
        *((r, {"lag_s": 5e-4}, {"lag_s_u": 5e-4}, "lag between the channels", KEYS[2]) for r in (0.3, 0.8, 1.2)),
        *((0.8, {"gain": 1.001}, {"gain_error": 0.001}, "gain of the mass sensor", key) for key in KEYS[2:]),
    ],
)
def test_the_share_of_a_source_is_what_it_does(
    r: float, change: dict[str, float], declared: dict[str, object], share: str, key: str
) -> None:
    still = measured(r=r, what={"sensors": declared})
    there = getattr(measured(r=r, **change), key) - getattr(still, key)  # type: ignore[arg-type]
    assert abs(there) == pytest.approx(still.budget[key][share], rel=0.03)


def test_half_a_sampling_interval_of_lag_is_assumed_where_nothing_is_declared() -> None:
    assumed = sources_of(Scene(), 250.0)
    assert assumed.lag == pytest.approx(0.002 / math.sqrt(3.0))
    assert "sensors.lag_s_u" in assumed.assumed
    declared = sources_of(scene(sensors={"lag_s_u": 1e-4}), 250.0)
    assert declared.lag == 1e-4
    assert "sensors.lag_s_u" not in declared.assumed


def test_a_lag_that_is_declared_is_taken_back() -> None:
    still = measured()
    corrected = measured(lag_s=0.0012, what={"sensors": {"lag_s": 0.0012}})
    assert corrected.energy_per_cycle == pytest.approx(still.energy_per_cycle, rel=2e-4)
    assert measured(lag_s=0.0012).energy_per_cycle != pytest.approx(still.energy_per_cycle, rel=5e-3)


@pytest.mark.parametrize("order", [1, 2, 4])
def test_a_filter_that_is_declared_is_taken_back(order: int) -> None:
    t = np.arange(4000) * 0.002
    tones = [(1.1, 1.0), (3.3, 0.2)]
    seen = np.zeros_like(t)
    for f, size in tones:
        h = low_pass(np.array([f]), 20.0, order)[0]
        seen += size * abs(h) * np.sin(2 * np.pi * f * t + np.angle(h))
    truth = sum((size * np.sin(2 * np.pi * f * t) for f, size in tones), np.zeros_like(t))
    found = restored(seen, 0.002, SensorChannel(cutoff=20.0, order=order))
    np.testing.assert_allclose(found[600:-600], truth[600:-600], atol=2e-3)


def test_the_combined_uncertainty_holds_what_laboratories_do() -> None:
    """Lags and gains drawn from their declared uncertainties: rms of the error over the stated one is about 1."""
    generator, keys = np.random.default_rng(12), KEYS[2:]
    declared = {"gain_error": 0.004, "linearity": 0.0, "lag_s_u": 0.0008}
    truth, misses = measured(), []
    for _ in range(30):
        gain, lag = 1 + 0.004 * math.sqrt(2.0) * generator.standard_normal(), 0.0008 * generator.standard_normal()
        m = measured(gain=gain, lag_s=lag, what={"sensors": declared})
        misses.append([(getattr(m, key) - getattr(truth, key)) / getattr(m, f"{key}_u") for key in keys])
    rms = np.sqrt(np.mean(np.square(misses), axis=0))
    assert np.all((rms > 0.65) & (rms < 1.35))


def test_the_share_of_crosstalk_is_what_crosstalk_does() -> None:
    """Also to the energy, by the base's amplitude that all is over: it was not counted there."""
    mixed = {"sensors": {"crosstalk": 0.002}}
    still = measured(what=mixed)
    changes, keys = [], KEYS[2:]
    for of_mass, of_base in ((0.002, 0.0), (0.0, 0.002)):

        def show(_: FloatArray, x: FloatArray, y: FloatArray, a: float = of_mass, b: float = of_base) -> Shown:
            return x + a * y, y + b * x

        recording = recorded(
            Problem(0.8, 0.35), np.random.default_rng(1), scatter=0.0, seconds=25.0, rate=500.0, sensors=show
        )
        seen = measure(recording, scene(**mixed))
        changes.append([getattr(seen, key) - getattr(still, key) for key in keys])
    for key, change in zip(keys, np.hypot(*np.array(changes)), strict=True):
        assert still.budget[key]["crosstalk"] == pytest.approx(change, rel=0.02)


def test_a_cubic_sensor_moves_the_numbers_by_their_share() -> None:
    """0.2 % of the range at its ends, the range filled: 0.3 % of the energy, 0.1 % of the amplitude left over Y."""
    tau = 2 * np.pi * np.arange(512) / 512
    mass, base = 0.8 * np.cos(tau - 0.6), np.cos(tau)
    sources = replace(sources_of(scene(), 250.0), linearity=0.002)
    share = uncertainty.cycle_budget(mass, base, sources, turn=6.0, unit=1.0)
    assert share["energy_per_cycle"]["linearity of the sensors"] == pytest.approx(
        0.8 * math.pi * math.sin(0.6) * 0.003 * math.sqrt(2.0), rel=0.01
    )
    assert share["response_amplitude"]["linearity of the sensors"] == pytest.approx(
        0.8 * math.hypot(0.004, 0.003), rel=0.01
    )


def test_sensors_move_the_cycle_as_the_fit_thinks() -> None:
    """Slopes of what sensors do are taken from one cycle; differences of whole predictions say the same."""
    m = measured()
    m = replace(m, sources=sources_of(scene(sensors={"crosstalk": 0.002}, log={"measuring_range_m": 0.012}), 500.0))
    observation = observe(m, scene())
    assert {u.name for u in observation.rig_unknowns} >= set(CycleObservation.by_sensors)
    assert_slopes_of_sensors(observation, CycleObservation.by_sensors, {"beta": 0.35}, 1e-4, 2e-6)


DECLARED: dict[str, dict[str, object]] = {
    "sensors": {"gain_error": 0.002, "linearity": 0.001, "lag_s_u": 5e-4, "crosstalk": 0.001},
    "rig": {
        "natural_frequency_hz_u": 0.01,
        "damping_ratio": 0.01,
        "damping_ratio_u": 0.002,
        "stiffness_n_per_m": 1190.0,
        "stiffness_n_per_m_u": 6.0,
    },
    "experiment": {"material": "steel", "normal_force_n": 1.25, "normal_force_n_u": 0.0125},
}
LENGTHS = ("energy_per_cycle", "response_amplitude", "base_amplitude_m")
SHARES: dict[tuple[str, str], dict[str, tuple[str, ...]]] = {
    ("sensors", "gain_error"): {
        **dict.fromkeys(LENGTHS[:2], ("gain of the mass sensor", "gain of the base sensor")),
        "base_amplitude_m": ("gain of the base sensor",),
        "friction_ratio": ("gain",),
    },
    ("sensors", "linearity"): {**dict.fromkeys(LENGTHS, ("linearity of the sensors",)), "friction_ratio": ("cubic",)},
    ("sensors", "lag_s_u"): {"energy_per_cycle": ("lag between the channels",), "friction_ratio": ("lag_s",)},
    ("sensors", "crosstalk"): {
        **dict.fromkeys(LENGTHS, ("crosstalk",)),
        "friction_ratio": ("base_in_mass", "mass_in_base"),
    },
    ("rig", "natural_frequency_hz_u"): {
        "frequency_ratio": ("natural frequency",),
        "friction_ratio": ("natural_frequency",),
    },
    ("rig", "damping_ratio_u"): {"friction_ratio": ("frame_damping_ratio",)},
    ("rig", "stiffness_n_per_m_u"): dict.fromkeys(("friction_force_n", "friction_coefficient"), ("stiffness",)),
    ("experiment", "normal_force_n_u"): {"friction_coefficient": ("normal force",)},
}


def budgets(tables: Mapping[str, Mapping[str, object]]) -> Mapping[str, Mapping[str, float]]:
    """Budgets of one scattering test, whose friction ratio needs sensors and rig moved by nothing."""
    recording = recorded(Problem(0.8, 0.35, frame_damping_ratio=0.01), np.random.default_rng(2), seconds=20.0)
    found = compare(recording, scene(**tables))
    row = found.row()
    for quantity, shares in found.budget.items():
        if row.get(f"{quantity}_u") is not None:
            assert combined(shares) == pytest.approx(row[f"{quantity}_u"], rel=1e-6), quantity
    return found.budget


def test_each_source_adds_to_each_number_what_is_declared_of_it() -> None:
    """Half of what is declared of a source is half of its share.

    Not in a fit, which tells the sources too and trades them: there half of all halves what they add.
    """
    whole = budgets(DECLARED)
    halves: dict[str, dict[str, object]] = {name: dict(table) for name, table in DECLARED.items()}
    for table, key in SHARES:
        value = DECLARED[table][key]
        assert isinstance(value, float)
        halves[table][key] = 0.5 * value
    half = budgets(halves)
    for told in SHARES.values():
        for quantity, sources in told.items():
            for source in sources:
                assert whole[quantity][source] > 0.0
                if quantity != "friction_ratio":
                    assert half[quantity][source] == pytest.approx(0.5 * whole[quantity][source], rel=0.02)
    fits = [
        math.hypot(*(u for source, u in b["friction_ratio"].items() if "noise" not in source)) for b in (half, whole)
    ]
    assert 0.4 < fits[0] / fits[1] < 0.7
    counted = {(q, source) for told in SHARES.values() for q, sources in told.items() for source in sources}
    rest = {(q, source) for q, shares in whole.items() for source in shares} - counted
    assert {source for _, source in rest} <= {
        "noise and scatter", "hum and other lines", "noise and misfit", "friction ratio", "base amplitude", "parabola",
        "sensors and rig as known, or as fitted",
    }  # fmt: skip


NUMBERS = st.floats(-1e9, 1e9).filter(lambda x: abs(x) > 1e-9)


@dataclass(frozen=True)
class Result:
    energy: Estimate
    energy_per_cycle = FlatKnown("energy")
    energy_per_cycle_se = Flat("energy", "se")
    energy_per_cycle_u = Flat("energy", "u")


@pytest.mark.parametrize(("unit", "share"), [("N/m", 0.03), ("N s/m", 0.05), ("1/m", 0.02), ("N", 0.03606), ("", 0.0)])
def test_a_physical_parameter_has_the_error_of_what_makes_it_physical(unit: str, share: float) -> None:
    """A contact's stiffness of 15149 +- 3 N/m under a frame whose stiffness is known to 0.5 %."""
    rig = {"stiffness_n_per_m": 1000.0, "stiffness_n_per_m_u": 30.0, "natural_frequency_hz_u": 0.04 * NATURAL_HZ}
    sources = sources_of(scene(rig=rig, sensors={"gain_error": 0.02, "linearity": 0.0}), 250.0)
    assert unit_share(unit, sources) == pytest.approx(share, rel=1e-3)


def test_what_is_assumed_of_newtons_is_said_and_three_keys_that_disagree_are_doubted() -> None:
    """A mass 10 % wrong gave 0.880 +- 0.005 N for 0.8, without a word: no test can show it."""
    stiffness = 1.0065 * 3.0 * (2.0 * math.pi * NATURAL_HZ) ** 2
    by_mass, both = scene(rig={"mass_kg": 3.0}), scene(rig={"mass_kg": 3.0, "stiffness_n_per_m": stiffness})
    assert any("0.5 % of 1160 N/m is assumed, also where mass" in note for note in assumed(by_mass, [{}]))
    assert not any("N/m" in note for note in assumed(by_mass.changed(rig={"stiffness_n_per_m_u": 12.0}), [{}]))
    assert [by_mass.rig.doubts, "make 3.14 Hz, natural_frequency_hz = 3.13" in both.rig.doubts[0]] == [(), True]


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
    assert str(Estimate(2.126, 0.0031)) == "2.126 ± 0.003"
    assert str(Estimate(2.126, 0.0031).with_u(0.031)) == "2.13 ± 0.03"
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
        if column.error_of and not column.name.endswith(("_low", "_high")):  # a band is no error of an estimate
            error, value = (vars(getattr_static(result, name)) for name in (column.name, column.error_of))
            assert error["_estimate"] == value["_estimate"]
            assert column.name.endswith(error["_part"])
