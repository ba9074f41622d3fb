"""The columns of what is measured: one recording's measurement, a comparison, free vibration."""

from frictionlab.schema.column import Table, number, se_of, sentences, text, thing, u_of, whole, yes_no

SOURCE = text("source", "source", "The file that was read, as it was named.")
STATUS = text("status", "status", "`ok` or `failed`.")
REASON = text("reason", "reason", "Why it failed; empty where it did not.")
WARNINGS = sentences("warnings", "warnings", "What a reader of the numbers must know, a sentence each.")
OUTCOME = (SOURCE, STATUS, REASON)
"""All that a row has whose input failed."""

MATERIAL = text("material", "material", "What rubs against the rod, as the scene, the sheet or the file name says.")
NORMAL_FORCE = number("normal_force_n", "N", "normal force", "Force that presses the contact together.")
RATIO = number("frequency_ratio", "", "r", "Drive frequency over natural frequency, eq. (2.7).")
BASE_AMPLITUDE = number("base_amplitude_m", "m", "Y", "Amplitude of the base motion's fundamental; all lengths in Y.")
ENERGY = number(
    "energy_per_cycle", "kY²", "energy", "Energy the contact takes per cycle: area of the loop y over x, eq. (2.18)."
)
AMPLITUDE = number("response_amplitude", "Y", "amplitude", "(max - min) / 2 of the mass's motion over a cycle, mean.")
STOPS = number("stops_per_cycle", "", "stops", "Times the mass stands still in a cycle, mean over the cycles used.")
REGIME = text("regime", "regime", "`continuous`, `stick-slip` or `stuck`.")
DURATION = number("duration_s", "s", "duration", "Length of the recording.")
DRIVE = number("drive_frequency_hz", "Hz", "drive", "Frequency of the base motion.")
NATURAL = number("natural_frequency_hz", "Hz", "natural", "Natural frequency of the frame, from the scene.")
ENERGY_TREND = number("energy_trend_per_hour", "kY²/h", "trend", "Slope of the energy over time; long tests only.")
STEADY_ENERGY = number(
    "steady_energy_per_cycle", "kY²", "steady energy", "The energy over all settled cycles, whatever the rule."
)
STEADY_AMPLITUDE = number(
    "steady_response_amplitude", "Y", "steady amplitude", "The amplitude over all settled cycles, whatever the rule."
)
IRREGULARITY = number("irregularity_index", "", "irregularity", "How much cycles differ from each other, eq. (4.1).")
BUDGET = thing("budget", "budget", "Quantity -> source -> standard uncertainty that it adds.")
ACCURACY = text("accuracy", "accuracy", "Level of the knobs that trade speed for accuracy.")

_CYCLES_BEHIND = (
    number("time", "s", "time", "Start of each cycle, or time of each point."),
    number("used", "", "used", "Whether the energy rule uses the cycle: 1 or 0."),
    number("energy", "kY²", "energy of a cycle", "Energy per cycle, cycle by cycle."),
    number("amplitude", "Y", "amplitude of a cycle", "Amplitude of the mass, cycle by cycle."),
    number("position", "Y", "position", "Mean place of the mass in a cycle, about its mean over all cycles."),
    number("stops", "", "stops of a cycle", "Stops that begin in the cycle."),
    number("stuck", "", "stuck", "Share of the cycle in which the mass stands."),
)
_MEAN_CYCLE_BEHIND = (
    number("tau", "rad", "tau", "Phase of the drive; 0 where the base's fundamental is at its top."),
    number("mass", "Y", "mass", "Mean cycle of the mass about its mean, as measured."),
    number("base", "Y", "base", "Mean cycle of the base about its mean, as measured."),
    number("mass_smooth", "Y", "smooth mass", "Mean cycle of the mass without the noise."),
    number("mass_velocity", "Y", "velocity", "Derivative by tau of the mean cycle of the mass."),
    number("base_cosine", "Y", "base cosine", "Cosine terms of the base motion's Fourier series, harmonics 1 to 9."),
    number(
        "each", "Y", "each cycle", "Complex amplitudes of the mass's harmonics in single steady cycles, a row each."
    ),
    number("kept", "", "kept", "Share of the mass's harmonics 1, 2, ... that its declared filter leaves."),
    number("base_sine", "Y", "base sine", "Sine terms of the base motion's Fourier series, harmonics 1 to 9."),
)
_TREND_BEHIND = (number("value", "kY²", "value", "Energy per cycle at the points of the trend."),)

MEASUREMENT = (
    *OUTCOME,
    WARNINGS,
    MATERIAL,
    NORMAL_FORCE,
    number("sampling_rate_hz", "Hz", "rate", "Samples per second."),
    DURATION,
    number("transient_s", "s", "transient", "Time cut off the start."),
    DRIVE,
    se_of(DRIVE),
    NATURAL,
    RATIO,
    se_of(RATIO),
    BASE_AMPLITUDE,
    se_of(BASE_AMPLITUDE),
    number("base_distortion", "", "distortion", "Rms of the base motion's harmonics 2 to 9 over its fundamental."),
    whole("cycles", "cycles", "Full cycles after the transient."),
    ENERGY,
    se_of(ENERGY),
    number("energy_per_cycle_j", "J", "joules", "The energy per cycle in joules: times k Y^2."),
    text("energy_rule", "rule", "Which cycles the energy is of: `last`, `all` or `window:S`."),
    AMPLITUDE,
    se_of(AMPLITUDE),
    IRREGULARITY,
    number("irregularity_floor", "", "floor", "The irregularity index that sensor noise alone would give."),
    number("base_irregularity_index", "", "base irregularity", "The irregularity index of the base motion."),
    STOPS,
    number("stuck_fraction", "", "stuck", "Share of the cycle in which the mass stands still."),
    REGIME,
    number("asymmetry", "", "asymmetry", "How much the two halves of a cycle differ; 0 where each mirrors the other."),
    number("energy_input_per_cycle", "kY²", "input", "Energy that the base puts in per cycle, eq. (2.16)."),
    ENERGY_TREND,
    se_of(ENERGY_TREND),
    STEADY_ENERGY,
    se_of(STEADY_ENERGY),
    STEADY_AMPLITUDE,
    se_of(STEADY_AMPLITUDE),
    number("settled_s", "s", "settled", "When the motion had settled, from the start of the recording."),
    number("shortest_stop", "", "shortest stop", "The shortest stop that could be told, as a share of a cycle."),
    number(
        "smallest_slip",
        "",
        "smallest slip / Y",
        "The smallest slip in a stop of a tenth of a cycle that would be seen, over Y.",
    ),
    number("mass_noise_m", "m", "mass noise", "Rms of the mass sensor's white noise."),
    number("base_noise_m", "m", "base noise", "Rms of the base sensor's white noise."),
    ACCURACY,
    u_of(RATIO),
    u_of(BASE_AMPLITUDE),
    u_of(ENERGY),
    u_of(AMPLITUDE),
    BUDGET,
)
MEASUREMENTS = Table(
    kind="measurements",
    sentence="One recording: its drive, its response and the energy its contact takes.",
    columns=MEASUREMENT,
    lead=6,
    shown=(
        *("source", "frequency_ratio", "energy_per_cycle", "energy_per_cycle_se", "response_amplitude"),
        *("irregularity_index", "stops_per_cycle", "regime"),
    ),
    series=(*_CYCLES_BEHIND, *_MEAN_CYCLE_BEHIND, *_TREND_BEHIND),
)

FRICTION_RATIO = number("friction_ratio", "", "beta", "Friction force over k Y, eq. (2.8).")
FRICTION_FORCE = number("friction_force_n", "N", "friction", "Friction force: friction ratio times k Y.")
COEFFICIENT = number("friction_coefficient", "", "coefficient", "Friction force over normal force.")
PREDICTED_ENERGY = number("predicted_energy_per_cycle", "kY²", "predicted", "Energy per cycle of the simulated motion.")
PREDICTED_AMPLITUDE = number(
    "predicted_response_amplitude", "Y", "predicted amplitude", "Amplitude of the simulated motion."
)
PREDICTED_STOPS = number("predicted_stops_per_cycle", "", "predicted stops", "Stops per cycle of the simulated motion.")
NRMSE = number(
    "response_nrmse",
    "",
    "nrmse",
    "Rms of measured minus predicted cycle over the rms of the measured cycle about its mean.",
)
LAW = text("law", "law", "The contact's law: `coulomb`, or a sum of terms that starts with it.")
SOLVER = text("solver", "solver", "What solved the motion: `closed-form`, `exact`, `numeric` or `thesis`.")
CLOSURE = number("closure_error", "", "closure", "Energy put in minus energy dissipated per cycle: 0 but for rounding.")
SECONDS = number("seconds", "s", "time", "Seconds it took on this machine.")

COMPARISONS = Table(
    kind="comparisons",
    sentence="One recording's steady cycle over its prediction.",
    columns=(
        *OUTCOME,
        WARNINGS,
        RATIO,
        ENERGY,
        AMPLITUDE,
        STOPS,
        REGIME,
        FRICTION_RATIO,
        se_of(FRICTION_RATIO),
        FRICTION_FORCE,
        COEFFICIENT,
        PREDICTED_ENERGY,
        PREDICTED_AMPLITUDE,
        PREDICTED_STOPS,
        text("predicted_regime", "predicted regime", "Regime of the simulated motion."),
        number("energy_difference", "", "difference", "Predicted over measured energy per cycle - 1."),
        NRMSE,
        text("model", "model", "The physics that was switched on, in words."),
        SOLVER,
        CLOSURE,
        se_of(FRICTION_FORCE),
        se_of(COEFFICIENT),
        ACCURACY,
        LAW,
        thing(
            "parameters",
            "parameters",
            "Parameter of the law -> `value`, `se`, `told` (whether the recording tells it) and its limits.",
        ),
        number("response_floor", "", "floor", "Standard error of the measured mean cycle over its rms."),
        number("misfit", "", "misfit", "The response_nrmse over the response_floor: 1 where only noise is left."),
        text("verdict", "verdict", "`explained` if the law leaves little more than noise, else `misfit`."),
        thing("laws", "laws", "The ladder of laws that `--law auto` climbed, one object per rung."),
        number("record_nrmse", "", "record nrmse", "The nrmse of the whole record, from its first sample."),
        number("record_energy_difference", "", "record difference", "The energy_difference over the whole record."),
        text("cycle_law", "law of the cycle", "With `--law auto`: the law that the steady cycle requires."),
        thing("record_laws", "laws of the record", "The ladder that the whole record climbed from there, a rung each."),
        u_of(FRICTION_RATIO),
        u_of(FRICTION_FORCE),
        u_of(COEFFICIENT),
        thing(
            "nuisances",
            "nuisances",
            "What else the fit moved -> `value`, `u` and what was known of it, `known_to`: `lag_s` in s, ratios else.",
        ),
        BUDGET,
    ),
    lead=6,
    shown=(
        *("source", "frequency_ratio", "energy_per_cycle", "friction_ratio", "friction_ratio_u"),
        *("predicted_energy_per_cycle", "response_nrmse", "misfit", "verdict", "friction_force_n"),
        *(
            "friction_coefficient",
            "record_nrmse",
            "record_energy_difference",
            "stops_per_cycle",
            "predicted_stops_per_cycle",
            "regime",
        ),
    ),
    shown_where_known=("friction_force_n", "friction_coefficient", "record_nrmse", "record_energy_difference"),
)

LAWS = Table(
    kind="laws",
    sentence="One law of the ladder that `--law auto` climbs.",
    columns=(
        LAW,
        thing("parameters", "parameters", "Parameter of the law -> `value`, `se`, `told` and its limits."),
        number("log_evidence", "", "log evidence", "Logarithm of how probable the law makes the recording."),
        NRMSE,
        number("held_out_nrmse", "", "held-out nrmse", "The nrmse over cycles that the fit did not see."),
        yes_no("required", "required", "Whether the recording requires this law and no simpler one."),
        SECONDS,
    ),
    lead=4,
    shown=("law", "log_evidence", "response_nrmse", "held_out_nrmse", "required", "seconds"),
)

RECORD_LAWS = Table(
    kind="laws of a record",
    sentence="One law of the ladder that a whole record climbs (`--law auto --fit whole`).",
    columns=(
        LAW,
        thing("parameters", "parameters", "Parameter of the law -> its value."),
        number("log_evidence_gain", "", "gain", "Log evidence over the best simpler law tried."),
        number("record_nrmse", "", "record nrmse", "Rms of what the law leaves of the record over the record's rms."),
        yes_no("required", "required", "Whether the record requires this law over the simpler ones."),
        SECONDS,
    ),
    lead=4,
    shown=("law", "log_evidence_gain", "record_nrmse", "required", "seconds"),
)

_FREQUENCY = number("natural_frequency_hz", "Hz", "natural", "Natural frequency, without the damping.")
_DAMPING = number("damping_ratio", "", "zeta", "Viscous damping ratio of the dashpot between mass and base.")
_FRICTION = number("friction_m", "m", "F/k", "Friction force over stiffness.")
FREE_VIBRATIONS = Table(
    kind="free vibrations",
    sentence="One tap: one free decay of the mass.",
    columns=(
        *OUTCOME,
        whole("tap", "tap", "Its number in the file, from 1."),
        number("start_s", "s", "start", "When the part fitted begins."),
        _FREQUENCY,
        se_of(_FREQUENCY),
        number("damped_frequency_hz", "Hz", "damped", "Frequency of the swing itself, with the damping."),
        _DAMPING,
        se_of(_DAMPING),
        number("damping_ratio_upper", "", "zeta at most", "One-sided 95 % limit of a damping ratio that is held at 0."),
        _FRICTION,
        se_of(_FRICTION),
        number("friction_m_upper", "m", "F/k at most", "One-sided 95 % limit of a friction that is held at 0."),
        number("friction_over_swing", "", "F/(k a)", "Friction force over stiffness and first swing."),
        number("amplitude_m", "m", "first swing", "Amplitude of the first swing that is fitted."),
        whole("half_cycles", "half-cycles", "Half-cycles that are fitted."),
        number("misfit", "", "misfit", "Rms of what the fit leaves over the first swing."),
        WARNINGS,
        number("friction_n", "N", "friction", "Friction force, where the scene tells the stiffness."),
    ),
    lead=6,
    shown=(
        *("source", "tap", "natural_frequency_hz", "natural_frequency_hz_se", "damping_ratio", "damping_ratio_se"),
        *("friction_m", "friction_m_se", "half_cycles"),
    ),
)
