"""The columns of what is simulated, planned and traded: steady states, plans, settings of the knobs."""

from frictionlab.schema.column import Table, number, text, thing, whole, yes_no
from frictionlab.schema.measured import (
    CLOSURE,
    DRIVE,
    DURATION,
    LAW,
    NORMAL_FORCE,
    OUTCOME,
    RATIO,
    REGIME,
    SECONDS,
    SOLVER,
    WARNINGS,
)

_BETA = number("beta", "", "beta", "Friction ratio: friction force over k Y, eq. (2.8).")
_STATE = (
    number("r", "", "r", "Frequency ratio: drive over natural frequency, eq. (2.7)."),
    _BETA,
    number("mu", "", "mu", "Static over kinetic friction."),
    number("zeta", "", "zeta", "Viscous damping ratio of a dashpot beside the contact."),
    text("wall", "wall", "What the mass rubs against: `fixed`, or `base` (a wall that moves with the base)."),
    SOLVER,
    text("outcome", "outcome", "`periodic`, `stuck`, `unbounded`, `not settled` or `not found`."),
    number("energy_per_cycle", "kY²", "energy", "Energy dissipated per cycle."),
    number("response_amplitude", "Y", "amplitude", "(max - min) / 2 of the mass's motion."),
    number("stops_per_cycle", "", "stops", "Times the mass stands still in a cycle."),
    number("stuck_fraction", "", "stuck", "Share of the cycle in which the mass stands still."),
    REGIME,
    yes_no("symmetric", "symmetric", "Whether the motion half a cycle later is its own negative."),
    whole("period_cycles", "period", "Cycles of the drive after which the motion repeats."),
    number("floquet_multiplier", "", "multiplier", "What a small disturbance is multiplied by in one period."),
    CLOSURE,
    number("residual", "Y", "residual", "By how much the state misses itself after one period."),
    number(
        "growth_per_cycle",
        "",
        "growth",
        "Of a motion that does not repeat: the factor by which motions close to it move apart in a cycle, in the mean.",
    ),
    WARNINGS,
)
_SHOWN = ("r", "beta", "mu", "zeta", "energy_per_cycle", "response_amplitude", "stops_per_cycle", "outcome")
STEADY_STATES = Table(
    kind="map",
    sentence="One steady state of a map (`sweep`).",
    columns=_STATE,
    lead=7,
    shown=_SHOWN,
)
MOTIONS = Table(
    kind="motion",
    sentence="One steady state, or the last of N cycles from rest (`simulate`).",
    columns=(
        *_STATE,
        number("wall_s", "s", "time", "Seconds it took on this machine."),
        LAW,
        thing("parameters", "parameters", "Parameter of the law -> its number."),
        number("basin_share", "", "share", "Share of the starts that end in this motion, where all are asked for."),
    ),
    lead=7,
    shown=_SHOWN,
    series=(
        number("tau", "rad", "tau", "Phase of the drive."),
        number("displacement", "Y", "displacement", "Displacement of the mass."),
        number("velocity", "Y", "velocity", "Derivative by tau of the mass's displacement."),
        number("base", "Y", "base", "Displacement of the base."),
        number("stops", "rad", "stops at", "Where each stop begins and ends."),
    ),
)

RESPONSES = Table(
    kind="response",
    sentence="The response to any motion of the base, from rest (`simulate --base-motion`).",
    columns=(
        *OUTCOME,
        WARNINGS,
        number("natural_frequency_hz", "Hz", "natural", "Natural frequency of the frame."),
        number("base_largest_m", "m", "Y", "Largest displacement of the base from its first value; all lengths in Y."),
        number("base_u_m", "m", "base u", "What an accelerometer's noise is integrated to, rms."),
        _BETA,
        text("wall", "wall", "What the mass rubs against: `fixed`, or `base` (a wall that moves with the base)."),
        LAW,
        thing("parameters", "parameters", "Parameter of the law -> its number."),
        SOLVER,
        whole("samples", "samples", "Samples of the base."),
        DURATION,
        number("energy", "kY²", "energy", "All that friction and dashpots have dissipated."),
        number("energy_j", "J", "joules", "The same in joules, where the stiffness is known."),
        number("friction_energy", "kY²", "friction energy", "What dry friction alone has dissipated."),
        number(
            "closure_error", "kY²", "closure error", "Energy put in minus dissipated minus stored: 0 but for rounding."
        ),
        number("path", "Y", "path", "Way of the mass along the wall while the contact slips."),
        number("path_m", "m", "path in m", "The same in metres."),
        whole("stops", "stops", "Times that the slipping contact came to hold."),
        number("time_stuck_s", "s", "time stuck", "Time in which the contact does not slip."),
        number("stuck_fraction", "", "stuck", "Share of the time in which the contact does not slip."),
        number("peak_displacement", "Y", "peak", "Largest displacement of the mass from where it began."),
        number("peak_displacement_m", "m", "peak in m", "The same in metres."),
        number("peak_relative_displacement", "Y", "peak of x - y", "Largest displacement of the mass from the base."),
        number("peak_velocity_m_per_s", "m/s", "peak speed", "Largest speed of the mass."),
        number("peak_contact_force", "kY", "peak force", "Largest force of the contact."),
        number("peak_contact_force_n", "N", "peak force in N", "The same in newtons, where the stiffness is known."),
        number(
            "sampling_error", "Y", "sampling error", "Rms error of the response by what the base does between samples."
        ),
        number("wall_s", "s", "time", "Seconds it took on this machine."),
    ),
    lead=7,
    shown=("source", "base_largest_m", "energy", "path", "stops", "time_stuck_s", "peak_displacement"),
    series=(number("contact_force", "N", "contact force", "Force of the contact on the mass."),),
)

PLANS = Table(
    kind="plan",
    sentence="One test to make, best first (`plan`).",
    columns=(
        whole("rank", "rank", "Place in the plan, from 1."),
        RATIO,
        NORMAL_FORCE,
        number("base_amplitude_m", "m", "Y", "Amplitude to give the base."),
        number("duration_s", "s", "duration", "How long to record."),
        text("regime", "regime", "The regime to expect."),
        thing("expected", "expected", "Law parameter -> standard error to expect from this test alone."),
        thing("cumulative", "cumulative", "Law parameter -> standard error to expect after this and all better ones."),
        number("response_m", "m", "response", "Amplitude of the mass to expect."),
        thing("expected_u", "expected u", "Law parameter -> combined uncertainty to expect from this test alone."),
        thing("cumulative_u", "cumulative u", "Law parameter -> combined uncertainty after this and all better ones."),
        number(
            "log_bayes",
            "",
            "log Bayes",
            "Evidence to expect from this test for the law, if it holds, over Coulomb friction or over `--against`.",
        ),
        number("log_bayes_against", "", "log Bayes against", "The same for the law `--against`, if that one holds."),
        number(
            "log_bayes_after",
            "",
            "log Bayes after",
            "Evidence for the law that holds after this and all better tests: the lesser of both ways.",
        ),
        number("laboratory_s", "s", "laboratory", "Laboratory time that this test adds: length, start, changes."),
        number("total_s", "s", "total", "Laboratory time of this and all better tests."),
        DRIVE,
        thing("values", "values", "Law parameter -> its value to expect in this test."),
        thing("told", "told", "Law parameter -> whether this test alone would tell it, as `compare-numeric` says so."),
    ),
    lead=7,
    shown=("rank", "frequency_ratio", "normal_force_n", "base_amplitude_m", "duration_s", "regime", "total_s"),
)

TRADES = Table(
    kind="trade",
    sentence="One setting of one accuracy knob (`tradeoff`).",
    columns=(
        text("knob", "knob", "What is set."),
        text("setting", "setting", "What it is set to."),
        text("quantity", "quantity", "What the error is of."),
        number("error", "", "error", "Relative error, against the reference."),
        SECONDS,
        yes_no("default", "default", "Whether commands use it unless told otherwise."),
        yes_no("dominated", "dominated", "Whether another setting beats it in both error and time."),
        number("over_bound", "", "over bound", "The error over the Cramer-Rao bound, where there is one."),
        whole("size_bytes", "size", "Size of the file, where one is written.", "byte"),
        text("reference", "reference", "What the error is against."),
    ),
    lead=7,
    shown=("knob", "setting", "quantity", "error", "seconds", "default", "dominated", "over_bound", "size_bytes"),
)
