"""Every column of every table: its name, type, unit, title and a sentence; the one home of these facts.

From here follow the files (CSV, JSON Lines, Excel, HDF5 with ``units`` and ``long_name``), what ``show`` and
the commands print, and the list of columns in this folder's README. Nothing but the standard library is imported.

- here: the kinds of tables: which columns stand in each, in their order, and which of them a screen shows
- ``columns.csv``: the one list, a line a column; ``column_list``: what a column and a table are
"""

from collections.abc import Sequence

from frictionlab.schema.column_list import Column, Table, Type, column_named

__all__ = ["Column", "Table", "Type", "column_of", "is_marked", "table_of"]  # beside the kinds below


def _table(
    kind: str,
    sentence: str,
    names: str,
    *,
    lead: int,
    shown: str,
    where_known: str = "",
    series: str = "",
    takes_facts: bool = False,
) -> Table:
    """A table of columns by their names."""
    found = tuple(column_named(name, kind) for name in names.split())
    behind = tuple(column_named(name, kind) for name in series.split())
    return Table(kind, sentence, found, lead, tuple(shown.split()), tuple(where_known.split()), behind, takes_facts)


_OUTCOME = "source status reason"
OUTCOME = tuple(column_named(name) for name in _OUTCOME.split())
"""All that a row has whose input failed."""

_MEASUREMENT = f"""{_OUTCOME} warnings material normal_force_n sampling_rate_hz duration_s transient_s
    drive_frequency_hz drive_frequency_hz_se natural_frequency_hz frequency_ratio frequency_ratio_se
    base_amplitude_m base_amplitude_m_se base_distortion cycles energy_per_cycle energy_per_cycle_se
    energy_per_cycle_j energy_rule response_amplitude response_amplitude_se irregularity_index irregularity_floor
    base_irregularity_index stops_per_cycle stuck_fraction regime asymmetry energy_input_per_cycle
    energy_trend_per_hour energy_trend_per_hour_se steady_energy_per_cycle steady_energy_per_cycle_se
    steady_response_amplitude steady_response_amplitude_se settled_s shortest_stop smallest_slip mass_noise_m
    base_noise_m accuracy frequency_ratio_u base_amplitude_m_u energy_per_cycle_u response_amplitude_u budget
    force_energy_per_cycle force_energy_per_cycle_j measured_friction_coefficient measured_friction_coefficient_u
    measured_friction_force_n"""
MEASUREMENTS = _table(
    "measurements",
    "One recording: its drive, its response and the energy its contact takes.",
    _MEASUREMENT,
    lead=6,
    shown="""source frequency_ratio energy_per_cycle energy_per_cycle_se response_amplitude irregularity_index
        stops_per_cycle regime""",
    series="""time used energy amplitude position stops stuck tau mass base mass_smooth mass_velocity base_cosine each
        kept base_sine value force""",
)
COMPARISONS = _table(
    "comparisons",
    "One recording's steady cycle over its prediction.",
    f"""{_OUTCOME} warnings frequency_ratio energy_per_cycle response_amplitude stops_per_cycle regime friction_ratio
        friction_ratio_se friction_force_n friction_coefficient predicted_energy_per_cycle
        predicted_response_amplitude predicted_stops_per_cycle predicted_regime energy_difference response_nrmse model
        solver closure_error friction_force_n_se friction_coefficient_se accuracy law parameters response_floor misfit
        verdict laws record_nrmse record_energy_difference cycle_law record_laws friction_ratio_u friction_force_n_u
        friction_coefficient_u nuisances levels budget""",
    lead=6,
    shown="""source frequency_ratio energy_per_cycle friction_ratio friction_ratio_u predicted_energy_per_cycle
        response_nrmse misfit verdict friction_force_n friction_coefficient record_nrmse record_energy_difference
        stops_per_cycle predicted_stops_per_cycle regime""",
    where_known="friction_force_n friction_coefficient record_nrmse record_energy_difference",
)
LAWS = _table(
    "laws",
    "One law of the ladder that `--law auto` climbs.",
    "law parameters log_evidence response_nrmse held_out_nrmse required seconds note",
    lead=4,
    shown="law log_evidence response_nrmse held_out_nrmse required seconds",
)
RECORD_LAWS = _table(
    "laws of a record",
    "One law that a whole record tries (`--law auto --fit whole`).",
    "law parameters log_evidence_gain record_nrmse required seconds note",
    lead=4,
    shown="law log_evidence_gain record_nrmse required seconds",
)
FREE_VIBRATIONS = _table(
    "free vibrations",
    "One tap: one free decay of the mass.",
    f"""{_OUTCOME} tap start_s natural_frequency_hz natural_frequency_hz_se damped_frequency_hz damping_ratio
        damping_ratio_se damping_ratio_upper friction_m friction_m_se friction_m_upper friction_over_swing amplitude_m
        half_cycles misfit cubic_share cubic_share_se warnings friction_n""",
    lead=6,
    shown="""source tap natural_frequency_hz natural_frequency_hz_se damping_ratio damping_ratio_se friction_m
        friction_m_se half_cycles""",
)
TESTS = _table(
    "tests",
    "One test of a campaign (`measurements.csv`): its measurement, and what the fit says of it.",
    f"""{_MEASUREMENT} irregularity_low irregularity_high test_friction_ratio test_friction_ratio_se
        predicted_energy_per_cycle predicted_response_amplitude predicted_stops_per_cycle energy_residual
        left_out_of_fit left_out_code test_friction_ratio_u test_misfit""",
    lead=6,
    shown="""source material normal_force_n frequency_ratio energy_per_cycle predicted_energy_per_cycle energy_residual
        regime left_out_code""",
    takes_facts=True,
)
FRICTION = _table(
    "friction",
    "One material under one normal force (`friction.csv`).",
    """material normal_force_n tests friction_ratio friction_ratio_se friction_force_n friction_force_n_se
        friction_coefficient friction_coefficient_se friction_coefficient_low friction_coefficient_high tests_used
        scatter amontons_p note friction_ratio_u friction_force_n_u friction_coefficient_u law tests_chi_square
        tests_freedom tests_p""",
    lead=9,
    shown="""material normal_force_n tests friction_ratio friction_ratio_u friction_coefficient
        friction_coefficient_u""",
)
MATERIAL_LAWS = _table(
    "material laws",
    "One contact law for one material, by the evidence of all its tests (`laws.csv`).",
    "material law tests log_evidence required gain response_nrmse",
    lead=5,
    shown="material law tests gain response_nrmse required",
)
LAW_PARAMETERS = _table(
    "law parameters",
    "One parameter of the contact law of one material, by all its tests (`parameters.csv`).",
    """material law parameter value value_se value_u physical_value physical_value_se physical_value_u unit is_told
        scatter tests_p""",
    lead=5,
    shown="material law parameter value value_u physical_value physical_value_u unit is_told",
)
LEFT_OUT = _table(
    "left out",
    "One test predicted by the law of all others (`left_out.csv`).",
    """source material predicted_energy_per_cycle measured_energy_per_cycle predicted_response_amplitude response_nrmse
        response_nrmse_own band_holds measured_response_amplitude predicted_energy_per_cycle_low
        predicted_energy_per_cycle_high predicted_response_amplitude_low predicted_response_amplitude_high reason""",
    lead=4,
    shown="""source material predicted_energy_per_cycle measured_energy_per_cycle response_nrmse response_nrmse_own
        band_holds""",
)
RANKING = _table(
    "ranking",
    "One material by one criterion, best first (`ranking.csv`).",
    "criterion rank material value value_se unit tied_with evidence value_u",
    lead=5,
    shown="criterion rank material value value_u",
)
DRIFTS = _table(
    "drifts",
    "One long test (`drift.csv`).",
    """source material normal_force_n frequency_ratio duration_s slope_per_hour slope_per_hour_se slope_per_hour_low
        slope_per_hour_high relative_slope_per_hour relative_slope_per_hour_se friction_slope_per_hour
        friction_slope_per_hour_se verdict note""",
    lead=7,
    shown="""source material normal_force_n frequency_ratio relative_slope_per_hour relative_slope_per_hour_se
        friction_slope_per_hour verdict""",
)
_STATE = """r beta mu zeta wall solver outcome energy_per_cycle response_amplitude stops_per_cycle stuck_fraction regime
    symmetric period_cycles floquet_multiplier closure_error residual growth_per_cycle
    contact_energy_per_cycle frame_energy_per_cycle warnings"""
_STATE_SHOWN = "r beta mu zeta energy_per_cycle response_amplitude stops_per_cycle outcome"
STEADY_STATES = _table("map", "One steady state of a map (`sweep`).", _STATE, lead=7, shown=_STATE_SHOWN)
MOTIONS = _table(
    "motion",
    "One steady state, or the last of N cycles from rest (`simulate`).",
    f"""{_STATE} wall_s law parameters basin_share response_amplitudes contacts response_amplitude_m energy_per_cycle_j
        friction_force_n""",
    lead=7,
    shown=_STATE_SHOWN,
    series="tau displacement velocity base stops",
)
_AMPLITUDE = ("response_amplitude", "response_amplitude_m")
PREDICTED = (*_AMPLITUDE, "energy_per_cycle", "energy_per_cycle_j", "stops_per_cycle")
PREDICTED_RECORD = (*_AMPLITUDE, "record_energy", "record_energy_j", "record_stops")
"""What a law predicts of a steady cycle, and of a whole record (largest displacement), each with its band."""
PREDICTIONS = _table(
    "predictions",
    "A test not made, by the law of its material (`predict`).",
    f"""material law frequency_ratio normal_force_n base_amplitude_m regime
        {" ".join(f"{n} {n}_low {n}_high" for n in dict.fromkeys((*PREDICTED, *PREDICTED_RECORD)))} warnings""",
    lead=6,
    shown="""frequency_ratio normal_force_n base_amplitude_m response_amplitude_m energy_per_cycle_j stops_per_cycle
        regime""",
)
RESPONSES = _table(
    "response",
    "The response to any motion of the base, from rest (`simulate --base-motion`).",
    f"""{_OUTCOME} warnings natural_frequency_hz base_largest_m base_u_m beta wall law parameters solver samples
        duration_s energy energy_j friction_energy closure_error path path_m stops time_stuck_s stuck_fraction
        peak_displacement peak_displacement_m peak_relative_displacement peak_velocity_m_per_s peak_contact_force
        peak_contact_force_n sampling_error wall_s""",
    lead=7,
    shown="source base_largest_m energy path stops time_stuck_s peak_displacement",
    series="contact_force",
)
PLANS = _table(
    "plan",
    "One test to make, best first (`plan`).",
    """rank frequency_ratio normal_force_n base_amplitude_m duration_s regime expected cumulative response_m expected_u
        cumulative_u log_bayes log_bayes_against log_bayes_after laboratory_s total_s drive_frequency_hz values told""",
    lead=7,
    shown="rank frequency_ratio normal_force_n base_amplitude_m duration_s regime total_s",
)
TRADES = _table(
    "trade",
    "One setting of one accuracy knob (`tradeoff`).",
    "knob setting quantity error seconds default dominated over_bound size_bytes reference",
    lead=7,
    shown="knob setting quantity error seconds default dominated over_bound size_bytes",
)
TABLES = (
    *(
        MEASUREMENTS,
        COMPARISONS,
        LAWS,
        RECORD_LAWS,
        FREE_VIBRATIONS,
        TESTS,
        FRICTION,
        RANKING,
        DRIFTS,
        MATERIAL_LAWS,
        LEFT_OUT,
    ),
    *(LAW_PARAMETERS, STEADY_STATES, MOTIONS, PREDICTIONS, RESPONSES, PLANS, TRADES),
)


def is_marked(names: Sequence[str], table: Table) -> bool:
    """Whether columns of these names bear the mark of a kind: all of its first columns, first and in order.

    Examples
    --------
    >>> is_marked(("log", "material", "normal_force_n"), FRICTION)
    False
    """
    return tuple(names[: table.lead]) == table.mark


def table_of(names: Sequence[str]) -> Table | None:
    """The kind of table that columns of these names belong to; None if to none.

    Columns may be added, taken away behind the mark, or moved by hand: the kind is that which has most of them.

    Examples
    --------
    >>> found = table_of(("material", *FRICTION.names))
    >>> found is not None and found.kind
    'friction'
    """
    known = set(names)
    fitting = [table for table in TABLES if known.issuperset(table.mark)]
    return max(fitting, key=lambda t: (len(known & set(t.names)), -len(t.names)), default=None)


def column_of(name: str, table: Table | None = None) -> Column | None:
    """The column of this name in a table or, without one, in the first that has it; None for a user's own column."""
    found = (t.column(name) for t in (TABLES if table is None else (table,)))
    return next((column for column in found if column is not None), None)
