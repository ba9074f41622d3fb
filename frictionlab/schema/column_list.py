"""What a column and a table are; the one list of columns: name, unit, title and sentence of every column.

A table names its columns (in `frictionlab.schema`); here stands what they are. ``X_se`` and ``X_u`` need no line of
their own: they are the errors of ``X``; nor do ``X_low`` and ``X_high``, the ends of its band. Where a table means
something else by a name, it says so in its own list.
"""

import math
from dataclasses import dataclass
from enum import Enum

_CF_UNITS = {"": "1", "kY²": "1", "Y": "1", "kY²/h": "h-1", "1/h": "h-1"}
"""Units as CF conventions (UDUNITS) write them, where a reader's table says what a number is counted in."""


class Type(Enum):
    """What stands in the cells of a column; beside it every cell may be empty, for what is not known."""

    NUMBER = "number"
    WHOLE = "whole number"
    YES_NO = "yes/no"
    TEXT = "text"
    SENTENCES = "list of sentences"
    OBJECT = "object"

    @property
    def is_number(self) -> bool:
        """Whether the cells can be reckoned with."""
        return self in (Type.NUMBER, Type.WHOLE)


@dataclass(frozen=True)
class Column:
    """One column, the same in every file and table it stands in.

    Attributes
    ----------
    name
        Key in JSON, head in CSV, name of the dataset in HDF5.
    type
        What its cells hold.
    unit
        As readers write it: ``Hz``, ``kY²`` (k Y^2), empty for a plain number and for text.
    title
        Short, for tables on a screen; no two columns of a table have the same.
    sentence
        What it is, in plain English.
    error_of
        Name of the column whose error this is; empty if it is none.

    Examples
    --------
    >>> force = Column("normal_force_n", Type.NUMBER, "N", "normal force", "Force that presses the contact together.")
    >>> force.head, force.units, se_of(force).name
    ('normal force [N]', 'N', 'normal_force_n_se')
    """

    name: str
    type: Type
    unit: str
    title: str
    sentence: str
    error_of: str = ""

    @property
    def head(self) -> str:
        """The title with its unit; of an error without, for the number that it belongs to has the same."""
        return f"{self.title} [{self.unit}]" if self.unit and not self.error_of else self.title

    @property
    def units(self) -> str:
        """The unit as a file says it (CF conventions); ``1`` for a plain number, empty for what is no number."""
        has_unit = self.type.is_number or self.type is Type.YES_NO
        return _CF_UNITS.get(self.unit, self.unit) if has_unit else ""


def se_of(column: Column) -> Column:
    """The column of the standard errors of another."""
    said = f"Standard error of {column.name}: noise, and the scatter from cycle to cycle or test to test."
    return Column(f"{column.name}_se", Type.NUMBER, column.unit, f"{column.title} se", said, column.name)


def u_of(column: Column) -> Column:
    """The column of the combined standard uncertainties of another."""
    said = f"Combined standard uncertainty of {column.name}: its standard error, and what sensors, clock and rig add."
    return Column(f"{column.name}_u", Type.NUMBER, column.unit, f"{column.title} u", said, column.name)


def end_of(column: Column, end: str) -> Column:
    """The column of the "low" or "high" end of another's 95 % band."""
    which = {"low": "Lower", "high": "Upper"}[end]
    said = f"{which} end of the 95 % band of {column.name}: errors of the law, and the scatter from test to test."
    return Column(f"{column.name}_{end}", Type.NUMBER, column.unit, f"{column.title} {end}", said, column.name)


@dataclass(frozen=True)
class Table:
    """One kind of table.

    Attributes
    ----------
    kind
        Its name, in the plural.
    sentence
        What one row is.
    columns
        All its columns, in order.
    lead
        So many of them, from the first on, are the mark by which a file is known to be of this kind: all of them, in
        this order, before any other column.
    shown
        Names of the columns for a screen, the most telling first: those that find no room are left out from the end.
    shown_where_known
        Those of the shown columns that are left out where no row knows them.
    series
        Columns of the arrays that may stand behind a row (one value per cycle, a mean cycle), in HDF5 only.
    takes_facts
        Whether columns of the user's own (facts of a test, from a sheet) may follow.
    """

    kind: str
    sentence: str
    columns: tuple[Column, ...]
    lead: int
    shown: tuple[str, ...]
    shown_where_known: tuple[str, ...] = ()
    series: tuple[Column, ...] = ()
    takes_facts: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all its columns, in order."""
        return tuple(column.name for column in self.columns)

    @property
    def mark(self) -> tuple[str, ...]:
        """The names that stand first in every file of this kind."""
        return self.names[: self.lead]

    @property
    def format(self) -> str:
        """What an HDF5 file of this kind calls itself."""
        return f"frictionlab {self.kind}"

    def row(self, result: object) -> dict[str, object]:
        """The row of a result that has an attribute for each column; NaN is not known, which is None."""
        values = ((name, getattr(result, name)) for name in self.names)
        return {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in values}

    def column(self, name: str) -> Column | None:
        """The column of this name, of the rows or of the series behind them; None if it is the user's own."""
        return next((column for column in (*self.columns, *self.series) if column.name == name), None)


def number(name: str, unit: str, title: str, sentence: str) -> Column:
    """A column of numbers."""
    return Column(name, Type.NUMBER, unit, title, sentence)


def whole(name: str, unit: str, title: str, sentence: str) -> Column:
    """A column of whole numbers."""
    return Column(name, Type.WHOLE, unit, title, sentence)


def yes_no(name: str, title: str, sentence: str) -> Column:
    """A column of yes or no."""
    return Column(name, Type.YES_NO, "", title, sentence)


def text(name: str, title: str, sentence: str) -> Column:
    """A column of text."""
    return Column(name, Type.TEXT, "", title, sentence)


def thing(name: str, title: str, sentence: str) -> Column:
    """A column whose cells are objects: name -> value, or lists of such."""
    return Column(name, Type.OBJECT, "", title, sentence)


_INPUT = (
    text("source", "source", "The file that was read, as it was named."),
    text("status", "status", "`ok` or `failed`."),
    text("reason", "reason", "Why it failed; empty where it did not."),
    Column("warnings", Type.SENTENCES, "", "warnings", "What a reader of the numbers must know, a sentence each."),
)
_TEST = (
    text("material", "material", "What rubs, as the scene, the sheet or the file name says."),
    number("normal_force_n", "N", "normal force", "Force that presses the contact together."),
    number("sampling_rate_hz", "Hz", "rate", "Samples per second."),
    number("duration_s", "s", "duration", "Length of the recording, or of the test to make."),
    number("transient_s", "s", "transient", "Time cut off the start: as given, or where the motion settles."),
    number("settled_s", "s", "settled", "When the motion had settled, from the start of the recording."),
    number("drive_frequency_hz", "Hz", "drive", "Frequency of the base motion."),
    number("natural_frequency_hz", "Hz", "natural", "Natural frequency of the frame."),
    number("frequency_ratio", "", "r", "Drive frequency over natural frequency, eq. (2.7)."),
    number("base_amplitude_m", "m", "Y", "Amplitude of the base motion's fundamental; all lengths in Y."),
    number("base_distortion", "", "distortion", "Rms of the base motion's harmonics 2 to 9 over its fundamental."),
    text("accuracy", "accuracy", "Level of the knobs that trade speed for accuracy."),
    thing("budget", "budget", "Quantity -> source -> standard uncertainty that it adds."),
)
_CYCLE = (
    whole("cycles", "", "cycles", "Full cycles after the transient."),
    number("energy_per_cycle", "kY²", "energy", "Area of the loop y over x1 per cycle, eq. (2.18)."),
    number("energy_per_cycle_j", "J", "joules", "The energy per cycle in joules: times k Y^2."),
    number("contact_energy_per_cycle", "kY²", "contact energy", "Energy that the contacts take per cycle."),
    number("frame_energy_per_cycle", "kY²", "frame energy", "Energy that the frame's dashpots take per cycle."),
    number("energy_input_per_cycle", "kY²", "input", "Energy that the base puts in per cycle, eq. (2.16)."),
    number("energy_trend_per_hour", "kY²/h", "trend", "Slope of the energy over time; long tests only."),
    text("energy_rule", "rule", "Which cycles the energy is of: `last`, `all` or `window:S`."),
    number("steady_energy_per_cycle", "kY²", "steady energy", "The energy over all settled cycles, whatever the rule."),
    number("response_amplitude", "Y", "amplitude", "(max - min) / 2 of the mass's motion over a cycle, mean."),
    number("response_amplitude_m", "m", "amplitude in m", "The same in metres."),
    thing("response_amplitudes", "amplitudes", "Amplitude of each mass, from the base up, in Y."),
    number("steady_response_amplitude", "Y", "steady amplitude", "The amplitude over all settled cycles."),
    number("irregularity_index", "", "irregularity", "How much cycles differ from each other, eq. (4.1)."),
    number("irregularity_floor", "", "floor", "The irregularity index that sensor noise alone would give."),
    number("base_irregularity_index", "", "base irregularity", "The irregularity index of the base motion."),
    number("irregularity_low", "", "irregularity low", "The motion's own irregularity is at least this."),
    number("irregularity_high", "", "irregularity high", "The motion's own irregularity is at most this."),
    number("stops_per_cycle", "", "stops", "Times the mass stands still in a cycle, mean over the cycles used."),
    number("stuck_fraction", "", "stuck", "Share of the time in which the contact does not slip."),
    text("regime", "regime", "`continuous`, `stick-slip` or `stuck`."),
    number("asymmetry", "", "asymmetry", "How much the two halves of a cycle differ; 0: each mirrors the other."),
    number("shortest_stop", "", "shortest stop", "The shortest stop that could be seen, as a share of a cycle."),
    number("smallest_slip", "", "smallest slip / Y", "Smallest slip seen in a stop of a tenth of a cycle, over Y."),
    number("mass_noise_m", "m", "mass noise", "Rms of the mass sensor's white noise."),
    number("base_noise_m", "m", "base noise", "Rms of the base sensor's white noise."),
)
_FORCE = (
    number("force_energy_per_cycle", "kY²", "force energy", "Area of the loop of measured force over displacement."),
    number("force_energy_per_cycle_j", "J", "force joules", "The same in joules."),
    number("measured_friction_force_n", "N", "measured force", "Friction force by the load cell, mean of a cycle."),
    number("measured_friction_coefficient", "", "measured mu", "Measured friction force over normal force."),
)
_LAW = (
    text("law", "law", "The contact's law: `coulomb`, or a sum of terms that starts with it."),
    thing("parameters", "parameters", "Parameter of the law -> `value`, `se`, `told` (known by the test), limits."),
    number("friction_ratio", "", "beta", "Friction force over k Y, eq. (2.8)."),
    number("friction_force_n", "N", "friction", "Friction force: friction ratio times k Y."),
    number("friction_coefficient", "", "coefficient", "Friction force over normal force."),
    number("friction_coefficient_low", "", "coefficient low", "Lower end of its 95 % confidence (Student's t)."),
    number("friction_coefficient_high", "", "coefficient high", "Upper end of its 95 % confidence (Student's t)."),
    number("predicted_energy_per_cycle", "kY²", "predicted", "Energy per cycle of the simulated motion."),
    number("predicted_response_amplitude", "Y", "predicted amplitude", "Amplitude of the simulated motion."),
    number("predicted_stops_per_cycle", "", "predicted stops", "Stops per cycle of the simulated motion."),
    text("predicted_regime", "predicted regime", "Regime of the simulated motion."),
    number("energy_difference", "", "difference", "Predicted over measured energy per cycle - 1."),
    number("response_nrmse", "", "nrmse", "Rms of measured minus predicted cycle over the rms of the measured one."),
    number("response_floor", "", "floor", "Standard error of the measured mean cycle over its rms."),
    number("misfit", "", "misfit", "The response_nrmse over the response_floor: 1 where only noise is left."),
    text("verdict", "verdict", "`explained`, `strained` (only by a rig far from the scene's) or `misfit`."),
    text("model", "model", "The physics that was switched on, in words."),
    text("solver", "solver", "What solved the motion: `closed-form`, `exact`, `numeric` or `thesis`."),
    number("closure_error", "", "closure", "Energy put in minus energy dissipated per cycle: 0 but for rounding."),
    thing("laws", "laws", "The ladder of laws that `--law auto` climbed, one object a law."),
    number("record_nrmse", "", "record nrmse", "The nrmse of the whole record, from its first sample."),
    number("record_energy_difference", "", "record difference", "The energy_difference over the whole record."),
    text("cycle_law", "law of the cycle", "With `--law auto`: the law that the steady cycle requires."),
    thing("record_laws", "laws of the record", "The laws that the whole record tried from there, one object each."),
    thing("nuisances", "nuisances", "What else the fit moved -> `value`, `u`, and what was known of it (`known_to`)."),
    thing("levels", "levels", "Unknown -> what it is shared by: `rig`, `material` or `test`."),
    number("log_evidence", "", "log evidence", "Log of how probable the law makes the data; only differences count."),
    number("log_evidence_gain", "", "gain", "Log evidence over the best simpler law tried."),
    number("held_out_nrmse", "", "held-out nrmse", "The nrmse over cycles that the fit did not see."),
    yes_no("required", "required", "Whether the data require this law and no simpler one."),
    number("seconds", "s", "time", "Seconds it took on this machine."),
    number("wall_s", "s", "time", "Seconds it took on this machine."),
)
_DECAY = (
    whole("tap", "", "tap", "Number of the tap in the file, from 1."),
    number("start_s", "s", "start", "When the part fitted begins."),
    number("damped_frequency_hz", "Hz", "damped", "Frequency of the swing itself, with the damping."),
    number("damping_ratio", "", "zeta", "Viscous damping ratio of the dashpot between mass and base."),
    number("damping_ratio_upper", "", "zeta at most", "One-sided 95 % limit of a damping ratio that is held at 0."),
    number("friction_m", "m", "F/k", "Friction force over stiffness."),
    number("friction_m_upper", "m", "F/k at most", "One-sided 95 % limit of a friction that is held at 0."),
    number("friction_over_swing", "", "F/(k a)", "Friction force over stiffness and first swing."),
    number("cubic_share", "", "cubic", "Share of the spring's force at the first swing that grows with its cube."),
    number("amplitude_m", "m", "first swing", "Amplitude of the first swing that is fitted."),
    whole("half_cycles", "", "half-cycles", "Half-cycles that are fitted."),
    number("friction_n", "N", "friction", "Friction force, where the scene gives the stiffness."),
)
_CAMPAIGN = (
    number("test_friction_ratio", "", "beta", "Friction ratio that this test alone would give."),
    number("test_misfit", "", "test misfit", "Root of its chi-square per degree of freedom; 1: only noise."),
    number("energy_residual", "", "residual", "Measured over predicted energy per cycle - 1."),
    text("left_out_of_fit", "left out", "Why the fit leaves this test out; empty where it uses it."),
    text("left_out_code", "code", "The same in one word, for programs: `long`, `stuck`, `unsteady` ..."),
    whole("tests", "", "tests", "Number of tests; long ones are not counted."),
    whole("tests_used", "", "used", "Tests that the fit rests on."),
    number("scatter", "", "scatter", "Relative standard deviation from test to test beyond measurement error."),
    number("amontons_p", "", "Amontons p", "How often a constant coefficient would look at least this uneven."),
    number("tests_chi_square", "", "tests χ²", "Chi-square of its tests about it, by each test's own error alone."),
    whole("tests_freedom", "", "freedom", "Degrees of freedom of that chi-square."),
    number("tests_p", "", "tests p", "How often one value in all tests would look at least this uneven."),
    text("note", "note", "What else is to be known of this row."),
    number("gain", "", "over coulomb", "The log evidence less that of plain Coulomb friction."),
    whole("chosen_in", "", "chosen in", "Tests that require this law on their own."),
    yes_no("screened", "screened", "Whether its evidence is that of straight lines about a simpler law's fit."),
    text("parameter", "parameter", "Its name; the friction ratio is in `friction.csv`, by normal force."),
    number("value", "", "value", "What the row is about; `unit` says what that is."),
    number("physical_value", "", "in units", "The same in `unit`; empty where the scene does not say enough."),
    text("unit", "unit", "Of the value beside it."),
    yes_no("is_told", "known", "Whether the tests determine this parameter at all."),
    text("criterion", "criterion", "`energy`, `consistency` or `drift`."),
    whole("rank", "", "rank", "Place, best first; one more than the number of those that are surely better."),
    text("tied_with", "tied with", "Materials that the data do not tell apart from this one."),
    text("evidence", "evidence", "What the comparison rests on."),
    number("slope_per_hour", "kY²/h", "slope", "Slope of the energy per cycle over time."),
    number("slope_per_hour_low", "kY²/h", "slope low", "Lower end of the slope's 95 % confidence."),
    number("slope_per_hour_high", "kY²/h", "slope high", "Upper end of the slope's 95 % confidence."),
    number("relative_slope_per_hour", "1/h", "relative", "The slope over the test's mean energy."),
    number("friction_slope_per_hour", "1/h", "friction", "Change of the friction force that explains the slope."),
)
_STATE = (
    number("r", "", "r", "Frequency ratio: drive over natural frequency, eq. (2.7)."),
    number("beta", "", "beta", "Friction ratio: friction force over k Y, eq. (2.8)."),
    number("mu", "", "mu", "Static over kinetic friction."),
    number("zeta", "", "zeta", "Viscous damping ratio of a dashpot beside the contact."),
    text("wall", "wall", "What the mass rubs against: `fixed`, or `base` (a wall that moves with the base)."),
    text("outcome", "outcome", "`periodic`, `stuck`, `unbounded`, `not settled` or `not found`."),
    yes_no("symmetric", "symmetric", "Whether the motion half a cycle later is its own negative."),
    whole("period_cycles", "", "period", "Cycles of the drive after which the motion repeats."),
    number("floquet_multiplier", "", "multiplier", "What a small disturbance is multiplied by in one period."),
    number("residual", "Y", "residual", "By how much the state misses itself after one period."),
    number("growth_per_cycle", "", "growth", "Of a motion that does not repeat: growth of a disturbance in a cycle."),
    number("basin_share", "", "share", "Share of the starts that end in this motion, where all are asked for."),
    thing("contacts", "contacts", "Each contact: mass, against, law, energy per cycle, stops, stuck fraction."),
)
_RESPONSE = (
    number("base_largest_m", "m", "Y", "Largest displacement of the base from its first value; all lengths in Y."),
    number("base_u_m", "m", "base u", "What an accelerometer's noise is integrated to, rms."),
    whole("samples", "", "samples", "Samples of the base."),
    number("energy", "kY²", "energy", "All that friction and dashpots have dissipated."),
    number("energy_j", "J", "joules", "The same in joules, where the stiffness is known."),
    number("record_energy", "kY²", "record energy", "What a whole record dissipates, as predicted."),
    number("record_energy_j", "J", "record joules", "The same in joules."),
    number("record_stops", "", "record stops", "Stops in a whole record, as predicted."),
    number("friction_energy", "kY²", "friction energy", "What dry friction alone has dissipated."),
    number("path", "Y", "path", "Way of the mass along the wall while the contact slips."),
    number("path_m", "m", "path in m", "The same in metres."),
    whole("stops", "", "stops", "Times that the slipping contact came to hold."),
    number("time_stuck_s", "s", "time stuck", "Time in which the contact does not slip."),
    number("peak_displacement", "Y", "peak", "Largest displacement of the mass from where it began."),
    number("peak_displacement_m", "m", "peak in m", "The same in metres."),
    number("peak_relative_displacement", "Y", "peak of x - y", "Largest displacement of the mass from the base."),
    number("peak_velocity_m_per_s", "m/s", "peak speed", "Largest speed of the mass."),
    number("peak_contact_force", "kY", "peak force", "Largest force of the contact."),
    number("peak_contact_force_n", "N", "peak force in N", "The same in newtons, where the stiffness is known."),
    number("sampling_error", "Y", "sampling error", "Rms error by what the base does between samples."),
)
_PLAN = (
    thing("expected", "expected", "Law parameter -> standard error to expect from this test alone."),
    thing("expected_u", "expected u", "Law parameter -> combined uncertainty to expect from this test alone."),
    thing("cumulative", "cumulative", "Law parameter -> standard error after this and all better tests."),
    thing("cumulative_u", "cumulative u", "Law parameter -> combined uncertainty after this and all better ones."),
    number("response_m", "m", "response", "Amplitude of the mass to expect."),
    number("log_bayes", "", "log Bayes", "Evidence to expect for the law over Coulomb or `--against`, if it holds."),
    number("log_bayes_against", "", "log Bayes against", "The same for the law `--against`, if that one holds."),
    number("log_bayes_after", "", "log Bayes after", "Evidence after this and all better tests: the lesser way."),
    number("laboratory_s", "s", "laboratory", "Laboratory time that this test adds: length, start, changes."),
    number("total_s", "s", "total", "Laboratory time of this and all better tests."),
    thing("values", "values", "Law parameter -> its value to expect in this test."),
    thing("told", "told", "Law parameter -> whether this test alone would determine it."),
)
_TRADE = (
    text("knob", "knob", "What is set."),
    text("setting", "setting", "What it is set to."),
    text("quantity", "quantity", "What the error is of."),
    number("error", "", "error", "Relative error, against the reference."),
    yes_no("default", "default", "Whether commands use it unless another is asked for."),
    yes_no("dominated", "dominated", "Whether another setting beats it in both error and time."),
    number("over_bound", "", "over bound", "The error over the Cramer-Rao bound, where there is one."),
    whole("size_bytes", "byte", "size", "Size of the file, where one is written."),
    text("reference", "reference", "What the error is against."),
)
_SERIES = (
    number("time", "s", "time", "Start of each cycle, or time of each point."),
    number("used", "", "used", "Whether the energy rule uses the cycle: 1 or 0."),
    number("amplitude", "Y", "amplitude of a cycle", "Amplitude of the mass, cycle by cycle."),
    number("position", "Y", "position", "Mean place of the mass in a cycle, about its mean over all cycles."),
    number("stuck", "", "stuck", "Share of the cycle in which the mass stands."),
    number("tau", "rad", "tau", "Phase of the drive; 0 where the base's fundamental is at its top."),
    number("mass", "Y", "mass", "Mean cycle of the mass about its mean, as measured."),
    number("base", "Y", "base", "Displacement of the base, about its mean where it is a measured cycle."),
    number("mass_smooth", "Y", "smooth mass", "Mean cycle of the mass without the noise."),
    number("mass_velocity", "Y", "velocity", "Derivative by tau of the mean cycle of the mass."),
    number("base_cosine", "Y", "base cosine", "Cosine terms of the base motion's Fourier series, harmonics 1 to 9."),
    number("base_sine", "Y", "base sine", "Sine terms of the base motion's Fourier series, harmonics 1 to 9."),
    number("each", "Y", "each cycle", "Complex amplitudes of the mass's harmonics in single cycles, a row each."),
    number("kept", "", "kept", "Share of the mass's harmonics 1, 2, ... that its declared filter leaves."),
    number("displacement", "Y", "displacement", "Displacement of the mass."),
    number("velocity", "Y", "velocity", "Derivative by tau of the mass's displacement."),
    number("contact_force", "N", "contact force", "Force of the contact on the mass."),
)
GROUPS = (*(_INPUT, _TEST, _CYCLE, _FORCE, _LAW, _DECAY, _CAMPAIGN, _STATE, _RESPONSE, _PLAN, _TRADE, _SERIES),)
COLUMNS = {column.name: column for group in GROUPS for column in group}


def column_named(name: str) -> Column:
    """The column of a name; of ``X_se`` and ``X_u`` the error of ``X``, of ``X_low`` and ``X_high`` an end of its band.

    Examples
    --------
    >>> column_named("friction_force_n_u").head
    'friction u'
    """
    if name in COLUMNS:
        return COLUMNS[name]
    stem, _, kind = name.rpartition("_")
    if kind in ("low", "high"):
        return end_of(COLUMNS[stem], kind)
    return {"se": se_of, "u": u_of}[kind](COLUMNS[stem])
