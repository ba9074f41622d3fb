"""What the numbers of a steady state do not say: each note stands once, as a bit of a map's row and as a sentence."""

from collections.abc import Callable, Mapping
from enum import IntFlag, auto
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionlab.simulator import row as places
from frictionlab.simulator.meter import WAITED_CYCLES, WAITED_STEPS

if TYPE_CHECKING:
    from frictionlab.simulator.problem import Problem
    from frictionlab.simulator.state import SteadyState

LOOSE = 1e-10  # relative closure error of exact phases above which it is said
COARSE = 1e-6  # the same of a law that is integrated
ROUNDING = 1e-14  # of the force times the amplitude: what rounding leaves of the work put in
LONGEST, PATIENCE = 512, 4096  # cycles of the longest orbit that exact phases look for; cycles waited for it
EPSILON = 2e-16  # of the drive
ROUNDED = 1e-15  # of a motion, by rounding in a cycle; what is left of it in the next adds up
SLOW = 1e-3  # of a disturbance is forgotten in a period, or less: that is said


class Note(IntFlag):
    """What a reader of a steady state must know; in the order in which the sentences are told."""

    FAILED = auto()
    RUNS_AWAY = auto()
    PULLS = auto()
    CHATTERS = auto()
    PARTS = auto()
    GIVEN_UP = auto()
    UNSETTLED = auto()
    FRICTION_HIDDEN = auto()
    NOT_PASSIVE = auto()
    UNDAMPED = auto()
    CONTINUUM = auto()
    CREEPS = auto()
    FORGETS_SLOWLY = auto()
    REST_STILL_FAR = auto()
    MAY_COEXIST = auto()
    MAY_GO_ON = auto()
    FEWER_DIGITS = auto()


WORDS: Mapping[Note, str] = {
    Note.FAILED: "could not be solved: `frictionlab simulate` says why",
    Note.RUNS_AWAY: "the gradient is so steep that the mass runs away",
    Note.PULLS: "friction would turn into a pull on the way",
    Note.CHATTERS: "events without end",
    Note.PARTS: "the motion does not repeat (chaos)",
    Note.GIVEN_UP: "the search was given up after its share of work",
    Note.UNSETTLED: "the motion from rest was not seen to settle on an orbit",
    Note.FRICTION_HIDDEN: "friction is too weak for the solver",
    Note.NOT_PASSIVE: "LuGre friction is not passive: it may give energy back",
    Note.UNDAMPED: "nothing damps: free vibration never dies out",
    Note.CONTINUUM: "one of a continuum of motions is told",
    Note.CREEPS: "the contact holds but creeps",
    Note.FORGETS_SLOWLY: "the motion forgets its start slowly",
    Note.REST_STILL_FAR: "the run from rest was still far from this motion: rest may settle on another",
    Note.MAY_COEXIST: "other motions may coexist with this one",
    Note.MAY_GO_ON: "the mass stays at rest, but a motion once begun might go on",
    Note.FEWER_DIGITS: "numbers are good to fewer digits than usual: energies in and out differ",
}
"""What each note says of many points, in few words."""


class Asked(NamedTuple):
    """What was asked, as far as notes depend on it: numbers of one problem, or arrays over the points of a map."""

    r: Any
    beta: Any
    mu: Any
    zeta: Any
    frame: Any
    gradient: Any
    drive: Any  # bound of the force
    plain: bool  # whether the base is one cosine
    rigid: bool


def asked_of(problem: "Problem") -> Asked:
    """Return what was asked by one problem."""
    numbers = (problem.r, problem.beta, problem.mu, problem.zeta, problem.frame_damping_ratio)
    plain, rigid = problem.base.harmonics == 1, problem.law.kind == "rigid"
    return Asked(*numbers, problem.parameter("gradient"), problem.force_size, plain, rigid)


def notes_of(asked: Asked, row: Any) -> Any:
    """Return the notes of a row (or of columns of rows) of a law with exact phases, as bits.

    Parameters
    ----------
    asked : Asked
    row : sequence
        What `row` says stands in a row: numbers, or arrays over the points of a map.
    """
    outcome, multiplier, beta = row[places.OUTCOME], row[places.MULTIPLIER], asked.beta
    moves, rests, unawaited = outcome == places.PERIODIC, outcome == places.STUCK, row[places.UNAWAITED] == 1.0
    undamped = (asked.zeta == 0.0) & (asked.frame == 0.0)
    free = (beta == 0.0) & undamped
    many = in_continuum(asked) & _not(free)
    static = asked.mu > 1.0
    taken = row[places.CONTACT_ENERGY] + row[places.FRAME_ENERGY]
    left = row[places.CLOSURE] - ROUNDING * asked.drive * row[places.AMPLITUDE]
    lasts = moves & (LOOSE * (1.0 - abs(multiplier)) < ROUNDED) & _not(free)
    lasts |= free & moves & (LOOSE * away_from_resonance(asked.r) < ROUNDED)
    small = moves & asked.rigid & (LOOSE * row[places.AMPLITUDE] < EPSILON)  # beside the drive, whose rounding it has
    loose = (((left > LOOSE * taken) & (taken > 0.0)) | lasts | small) & _not(many)
    held = rests & (not asked.rigid)
    said = {
        Note.FAILED: outcome != outcome,  # noqa: PLR0124 - not a number
        Note.RUNS_AWAY: outcome == places.RUNAWAY,
        Note.PULLS: outcome == places.PULLING,
        Note.CHATTERS: outcome == places.CHATTERED,
        Note.PARTS: outcome == places.PARTING,
        Note.GIVEN_UP: outcome == places.COSTLY,
        Note.UNSETTLED: outcome == places.NOT_FOUND,
        Note.UNDAMPED: (moves & free) | (held & undamped),
        Note.CONTINUUM: moves & many,
        Note.FORGETS_SLOWLY: moves & _not(free) & _not(many) & (1.0 - abs(multiplier) < SLOW),
        Note.REST_STILL_FAR: moves & unawaited,
        Note.MAY_COEXIST: moves & _not(unawaited) & static,
        Note.MAY_GO_ON: rests & _not(held) & static & (beta < asked.drive),
        Note.FEWER_DIGITS: (moves | rests) & _not(held) & loose,
    }
    return sum(int(note) * found for note, found in said.items())


def away_from_resonance(r: Any) -> Any:
    """Return |1 - k r| of the harmonic k that is nearest to resonance."""
    return abs(1.0 - np.maximum(1.0, (1.0 / r + 0.5) // 1.0) * r)


def _not(truth: Any) -> Any:
    return truth ^ True


def in_continuum(asked: Asked) -> Any:
    """Tell whether the problem lies on the continuum of asymmetric motions, eq. (3.3)."""
    n = (0.5 / asked.r + 0.5) // 1.0
    cosine = (asked.zeta == 0.0) & (asked.frame == 0.0) & (asked.mu == 1.0) & (asked.gradient == 0.0) & asked.plain
    there = (n >= 1.0) & (abs(asked.r * 2.0 * n - 1.0) <= 1e-12)
    return cosine & asked.rigid & there & (asked.beta * abs(4.0 * n * n - 1.0) <= asked.drive)


def sentences(state: "SteadyState") -> tuple[str, ...]:
    """Return the notes of a steady state as sentences, with its numbers."""
    return tuple(_sentence(note, state) for note in Note if note & state.notes)


def _sentence(note: Note, state: "SteadyState") -> str:
    """The first of a note's sentences that is for such a law, with the numbers that it names."""
    problem, kind = state.problem, state.problem.law.kind
    one = kind == "rigid" and problem.mu == 1.0 and not problem.parameter("gradient")
    groups = {"one motion": one, kind: True, "exact": problem.law.is_exact, "stuck": state.outcome == "stuck", "": True}
    found = next(words for group, words in SENTENCES[note].items() if groups.get(group))
    numbers = {name: number(state) for name, number in NUMBERS.items() if f"{{{name}" in found}
    return found.format(**numbers)


def _told_growth(state: "SteadyState") -> str:
    grown = state.growth_per_cycle
    return "" if grown is None else f", in the mean by a factor of {grown:.3g} in each cycle"


def _told_miss(state: "SteadyState") -> str:
    miss = state.residual
    return "" if not miss or not isfinite(miss) else f" When it was, the motion missed itself by {miss:.1g} Y."


def _lasts(state: "SteadyState") -> str:
    kept = abs(state.floquet_multiplier or 0.0)
    return f"{1.0 / (1.0 - kept):.1g}" if kept < 1.0 else "endlessly many"


def _needed(state: "SteadyState") -> float:
    p = state.problem.parameters
    return p["bristle_damping"] * (p["static_ratio"] - 1.0)


def _off(state: "SteadyState") -> float:
    """Relative difference of the energies in and out, beyond what rounding leaves of the work put in."""
    off, energy, problem = state.closure_error or 0.0, state.energy_taken or 0.0, state.problem
    if problem.law.is_exact:
        off = max(0.0, off - ROUNDING * problem.force_size * (state.response_amplitude or 0.0))
    return off / energy if energy > 0.0 else 0.0


def _lasting(state: "SteadyState") -> float:
    """What rounding disturbs in a cycle, and by how much it adds up."""
    problem = state.problem
    kept = 1.0 - abs(state.floquet_multiplier or 0.0) if problem.beta else away_from_resonance(problem.r)
    return max(ROUNDED / max(ROUNDED, kept), EPSILON / max(EPSILON, state.response_amplitude or 1.0))


NUMBERS: Mapping[str, Callable[["SteadyState"], object]] = {
    "growth": _told_growth,
    "miss": _told_miss,
    "lasts": _lasts,
    "needed": _needed,
    "off": _off,
    "good": lambda state: max(_off(state), _lasting(state)),
    "why": lambda state: (
        "energies in and out differ so"
        if _off(state) >= _lasting(state)
        else "what rounding disturbs in a cycle lasts so long"
    ),
    "beta": lambda state: state.problem.beta,
    "even": lambda state: 2 * round(0.5 / state.problem.r),
    "residual": lambda state: state.residual,
}
"""Numbers that sentences name."""
UNSETTLED = "the motion from rest was not seen to settle on an orbit"
LAST_OF = "--cycles N tells the last of N cycles"
SENTENCES: Mapping[Note, Mapping[str, str]] = {
    Note.FAILED: {"": f"{WORDS[Note.FAILED]}."},
    Note.RUNS_AWAY: {
        "": "gradient: beta |gradient| >= 1: friction changes along the path faster than the spring's force "
        "and the mass runs away; this is not computed: take a smaller gradient."
    },
    Note.PULLS: {
        "": "gradient: on this motion the mass goes where the friction force beta (1 + gradient z) is below 0, "
        "which no contact does; no numbers are given: take a smaller gradient."
    },
    Note.CHATTERS: {
        "": "events without end: more phases in a cycle than any motion has; `frictionlab simulate` tells the last"
        " state."
    },
    Note.PARTS: {
        "": f"the motion does not repeat: motions beside it move apart{{growth}} (chaos). {LAST_OF}, and --all whether"
        " other starts settle."
    },
    Note.GIVEN_UP: {
        "": "the search was given up after a second of work: this motion makes thousands of slides in a cycle, or is "
        f"braked so little that it takes too long to settle.{{miss}} {LAST_OF}; with more friction or damping, or a"
        " larger r, there is less to do."
    },
    Note.UNSETTLED: {
        "one motion": "friction and dashpots bring motions together by less than rounding in a cycle, so that the one"
        " that repeats cannot be told; with more of either, or a smaller r, it can.",
        "rigid": f"within {PATIENCE} cycles the motion has not settled on an orbit of up to {LONGEST} cycles.",
        "elastic": f"{UNSETTLED}; {LAST_OF}.",
        "": f"{UNSETTLED} within {WAITED_CYCLES} cycles and {WAITED_STEPS:,} steps; {LAST_OF}.",
    },
    Note.FRICTION_HIDDEN: {
        "": "friction of {beta:.3g} k Y is too weak for this solver: it does less work than the steps' tolerance leaves"
        " open, so that the size of the motion is not known. Take the plain law coulomb (exact), or no friction."
    },
    Note.NOT_PASSIVE: {
        "": "LuGre friction is not passive here: it may give energy back; passive needs 2 contact_damping_ratio r >"
        " bristle_damping (static_ratio - 1) = {needed:.3g} (term speed, or a smaller bristle_damping)."
    },
    Note.UNDAMPED: {
        "stuck": "The contact never slips and nothing else damps it: free vibration never dies out; this is the motion"
        " without.",
        "": "Nothing damps this oscillator: free vibration never dies out, and this is the motion without any.",
    },
    Note.CONTINUUM: {
        "": "At r = 1/{even} with beta <= 1/(4 n^2 - 1) a continuum of asymmetric motions (3.3) has the same energy "
        "and amplitude; this is the symmetric one. A run from rest creeps towards its edge like N^(-1/2)."
    },
    Note.CREEPS: {"": "The contact holds but creeps: after a cycle the state misses itself by {residual:.1g}."},
    Note.FORGETS_SLOWLY: {"": "The motion forgets its start slowly: a disturbance lasts {lasts} periods."},
    Note.REST_STILL_FAR: {
        group: "This motion is stable, but the run from rest was still far from it after"
        f" {waited} cycles: rest may settle on another."
        for group, waited in (("exact", PATIENCE), ("", WAITED_CYCLES))
    },
    Note.MAY_COEXIST: {
        "elastic": "With static friction (mu > 1) other motions may coexist, and rest may settle on one of several"
        f" cycles instead: --all tells them with their shares, {LAST_OF.replace('tells ', '')} from rest.",
        "exact": "With static friction (mu > 1) other motions may coexist; this is the one that rest settles on.",
        "": "Friction that falls with speed or varies along the path may have other motions beside this one, which rest"
        " settles on.",
    },
    Note.MAY_GO_ON: {"": "A motion once begun might go on: kinetic friction alone does not hold the mass."},
    Note.FEWER_DIGITS: {
        "exact": "So close to resonance or rest, numbers are good to about {good:.0e} only: {why}.",
        "": "Numbers are good to about {off:.0e} only: energies in and out differ so. Friction this weak, or that"
        " changes within so small a speed, is lost in the tolerance of the steps.",
    },
}
"""Note -> what laws it is said of so -> the sentence; the first that holds."""
