"""The columns of a campaign's tables."""

from frictionlab.schema.column import Table, number, se_of, text, u_of, whole, yes_no
from frictionlab.schema.measured import (
    COEFFICIENT,
    DURATION,
    FRICTION_FORCE,
    FRICTION_RATIO,
    LAW,
    MATERIAL,
    MEASUREMENT,
    NORMAL_FORCE,
    PREDICTED_AMPLITUDE,
    PREDICTED_ENERGY,
    PREDICTED_STOPS,
    RATIO,
    SOURCE,
)

_TEST_RATIO = number("test_friction_ratio", "", "beta", "Friction ratio that this test alone would give.")
TESTS = Table(
    kind="tests",
    sentence="One test of a campaign (`measurements.csv`): its measurement, and what the fit says of it.",
    columns=(
        *MEASUREMENT,
        number("irregularity_low", "", "irregularity low", "The motion's own irregularity is at least this."),
        number("irregularity_high", "", "irregularity high", "The motion's own irregularity is at most this."),
        _TEST_RATIO,
        se_of(_TEST_RATIO),
        PREDICTED_ENERGY,
        PREDICTED_AMPLITUDE,
        PREDICTED_STOPS,
        number("energy_residual", "", "residual", "Measured over predicted energy per cycle - 1."),
        text("left_out_of_fit", "left out", "Why the fit leaves this test out; empty where it uses it."),
        text("left_out_code", "code", "The same in one word, for programs: `long`, `stuck`, `unsteady` ..."),
        u_of(_TEST_RATIO),
        number(
            "test_misfit",
            "",
            "test misfit",
            "Root of chi-square per degree of freedom of its cycle, or of energy and amplitude without one; 1: noise.",
        ),
    ),
    lead=6,
    shown=(
        *("source", "material", "normal_force_n", "frequency_ratio", "energy_per_cycle"),
        *("predicted_energy_per_cycle", "energy_residual", "regime", "left_out_code"),
    ),
    takes_facts=True,
)

FRICTION = Table(
    kind="friction",
    sentence="One material under one normal force (`friction.csv`).",
    columns=(
        MATERIAL,
        NORMAL_FORCE,
        whole("tests", "tests", "Tests of this material under this force, long ones not counted."),
        FRICTION_RATIO,
        se_of(FRICTION_RATIO),
        FRICTION_FORCE,
        se_of(FRICTION_FORCE),
        COEFFICIENT,
        se_of(COEFFICIENT),
        number("friction_coefficient_low", "", "coefficient low", "Lower end of its 95 % confidence (Student's t)."),
        number("friction_coefficient_high", "", "coefficient high", "Upper end of its 95 % confidence (Student's t)."),
        whole("tests_used", "used", "Tests that the fit rests on."),
        number("scatter", "", "scatter", "Relative standard deviation from test to test beyond measurement error."),
        number("amontons_p", "", "Amontons p", "How often a constant coefficient would look at least this uneven."),
        text("note", "note", "What else is to be known of this fit."),
        u_of(FRICTION_RATIO),
        u_of(FRICTION_FORCE),
        u_of(COEFFICIENT),
        text("law", "law", "Contact law that its cycles were fitted with; empty where energies and amplitudes were."),
        number("tests_chi_square", "", "tests χ²", "Chi-square of its tests about it, by each test's own error alone."),
        whole("tests_freedom", "freedom", "Degrees of freedom of that chi-square."),
        number("tests_p", "", "tests p", "How often equal friction in all tests would look at least this uneven."),
    ),
    lead=9,
    shown=(
        *("material", "normal_force_n", "tests", "friction_ratio", "friction_ratio_u"),
        *("friction_coefficient", "friction_coefficient_u"),
    ),
)

MATERIAL_LAWS = Table(
    kind="material laws",
    sentence="One contact law for one material, by the evidence of all its tests (`laws.csv`).",
    columns=(
        MATERIAL,
        LAW,
        whole("tests", "tests", "Tests with a ladder of laws; every law listed was tried in all of them."),
        number(
            "log_evidence", "", "log evidence", "Sum of the tests' log evidence; only differences between laws count."
        ),
        yes_no("required", "required", "Whether it is the simplest law within 5 of the best joint log evidence."),
        number("gain", "", "over coulomb", "The log evidence less that of plain Coulomb friction."),
        number("response_nrmse", "", "nrmse", "The nrmse of the fitted cycles, rms over the tests."),
        whole("chosen_in", "chosen in", "Tests that require this law on their own, where single ladders were climbed."),
        yes_no("screened", "screened", "Whether its evidence is that of straight lines about a simpler law's fit."),
    ),
    lead=5,
    shown=("material", "law", "tests", "gain", "response_nrmse", "chosen_in", "required"),
)

_NUMBER = number("value", "", "value", "Dimensionless, of a test at the mean base amplitude and drive frequency.")
_PHYSICAL = number("physical_value", "", "in units", "The same in `unit`; empty where the scene does not say enough.")
LAW_PARAMETERS = Table(
    kind="law parameters",
    sentence="One parameter of the contact law of one material, by all its tests (`parameters.csv`).",
    columns=(
        MATERIAL,
        LAW,
        text("parameter", "parameter", "Its name; the friction ratio is in `friction.csv`, by normal force."),
        _NUMBER,
        se_of(_NUMBER),
        u_of(_NUMBER),
        _PHYSICAL,
        se_of(_PHYSICAL),
        u_of(_PHYSICAL),
        text("unit", "unit", "Of `physical_value`."),
        yes_no("is_told", "told", "Whether the tests tell this parameter at all."),
        number(
            "scatter", "", "scatter", "Standard deviation of `value` from test to test beyond each test's own error."
        ),
        number("tests_p", "", "tests p", "How often one value in all tests would look at least this uneven."),
    ),
    lead=5,
    shown=("material", "law", "parameter", "value", "value_u", "physical_value", "physical_value_u", "unit", "is_told"),
)

VALUE = number("value", "", "value", "What the material is ranked by; `unit` says what that is.")
RANKING = Table(
    kind="ranking",
    sentence="One material by one criterion, best first (`ranking.csv`).",
    columns=(
        text("criterion", "criterion", "`energy`, `consistency` or `drift`."),
        whole(
            "rank",
            "rank",
            "One more than the number of materials that are better beyond doubt (95 %).",
        ),
        MATERIAL,
        VALUE,
        se_of(VALUE),
        text("unit", "unit", "What the value is."),
        text("tied_with", "tied with", "Materials that the evidence does not tell apart from this one."),
        text("evidence", "evidence", "What the comparison rests on."),
        u_of(VALUE),
    ),
    lead=5,
    shown=("criterion", "rank", "material", "value", "value_u"),
)

_SLOPE = number("slope_per_hour", "kY²/h", "slope", "Slope of the energy per cycle over time.")
_RELATIVE = number("relative_slope_per_hour", "1/h", "relative", "The slope over the test's mean energy.")
_FRICTION_SLOPE = number(
    "friction_slope_per_hour", "1/h", "friction", "Relative change of the friction force that explains the slope."
)
DRIFTS = Table(
    kind="drifts",
    sentence="One long test (`drift.csv`).",
    columns=(
        SOURCE,
        MATERIAL,
        NORMAL_FORCE,
        RATIO,
        DURATION,
        _SLOPE,
        se_of(_SLOPE),
        number("slope_per_hour_low", "kY²/h", "slope low", "Lower end of the slope's 95 % confidence."),
        number("slope_per_hour_high", "kY²/h", "slope high", "Upper end of the slope's 95 % confidence."),
        _RELATIVE,
        se_of(_RELATIVE),
        _FRICTION_SLOPE,
        se_of(_FRICTION_SLOPE),
        text("verdict", "verdict", "`rises`, `falls`, `no drift shown` or `not known`."),
        text("note", "note", "What else is to be known of this drift."),
    ),
    lead=7,
    shown=(
        *("source", "material", "normal_force_n", "frequency_ratio", "relative_slope_per_hour"),
        *("relative_slope_per_hour_se", "friction_slope_per_hour", "verdict"),
    ),
)
