"""What the numbers of a steady state do not say: each note stands once, as a bit of a map's row and as a sentence."""

from collections.abc import Callable, Mapping
from enum import IntFlag, auto
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionlab.simulator import row as places
from frictionlab.simulator.problem import bound_of_force

if TYPE_CHECKING:
    from frictionlab.simulator.problem import Base, Wall
    from frictionlab.simulator.state import SteadyState

LOOSE = 1e-10  # relative closure error of exact phases above which it is said
COARSE = 1e-6  # the same of a law that is integrated
ROUNDING = 1e-14  # of the force times the amplitude: what rounding leaves of the work put in
EPSILON = 2e-16  # of the drive
ROUNDED = 1e-15  # of a motion, by rounding in a cycle; what is left of it in the next adds up
SLOW = 1e-3  # of a disturbance is forgotten in a period, or less: that is said


class Note(IntFlag):
    """What a reader of a steady state must know; in the order in which the sentences stand."""

    FAILED = auto()
    RUNS_AWAY = auto()
    PULLS = auto()
    CHATTERS = auto()
    GIVEN_UP = auto()
    UNSETTLED = auto()
    NOT_PASSIVE = auto()
    UNDAMPED = auto()
    CONTINUUM = auto()
    FORGETS_SLOWLY = auto()
    MAY_COEXIST = auto()
    MAY_GO_ON = auto()
    FEWER_DIGITS = auto()


def notes_of(values: Mapping[str, Any], wall: "Wall", base: "Base", row: Any, *, rigid: bool) -> Any:
    """Return the notes of a row of a law with exact phases, as bits: numbers, or columns over the points of a map.

    `values`: r and the law's parameters by name, of one problem, or arrays over the points.
    """
    r, beta, zeta, frame, gradient = (
        values.get(name, 0.0) for name in ("r", "beta", "contact_damping_ratio", "frame_damping_ratio", "gradient")
    )
    up, down = (values.get(f"static_ratio_{way}", 1.0) for way in ("up", "down"))
    drive, static = bound_of_force(r, frame, wall, base), (up > 1.0) | (down > 1.0)
    outcome, multiplier = row[places.OUTCOME], row[places.MULTIPLIER]
    moves, rests = outcome == places.PERIODIC, outcome == places.STUCK
    undamped = (zeta == 0.0) & (frame == 0.0)
    free = (beta == 0.0) & undamped
    n = (0.5 / r + 0.5) // 1.0
    many = undamped & _not(free) & _not(static) & (gradient == 0.0) & rigid & (base.harmonics == 1) & (n >= 1.0)
    many &= (abs(r * 2.0 * n - 1.0) <= 1e-12) & (beta * abs(4.0 * n * n - 1.0) <= drive)  # eq. (3.3)
    taken = row[places.CONTACT_ENERGY] + row[places.FRAME_ENERGY]
    left = row[places.CLOSURE] - ROUNDING * drive * row[places.AMPLITUDE]
    lasts = moves & (LOOSE * (1.0 - abs(multiplier)) < ROUNDED) & _not(free)
    lasts |= free & moves & (LOOSE * away_from_resonance(r) < ROUNDED)
    small = moves & rigid & (LOOSE * row[places.AMPLITUDE] < EPSILON)  # beside the drive, whose rounding it has
    loose = (((left > LOOSE * taken) & (taken > 0.0)) | lasts | small) & _not(many)
    held = rests & (not rigid)
    said = {
        Note.FAILED: np.isnan(outcome),
        Note.RUNS_AWAY: outcome == places.RUNAWAY,
        Note.PULLS: outcome == places.PULLING,
        Note.CHATTERS: outcome == places.CHATTERED,
        Note.GIVEN_UP: outcome == places.COSTLY,
        Note.UNSETTLED: outcome == places.NOT_FOUND,
        Note.UNDAMPED: (moves & free) | (held & undamped),
        Note.CONTINUUM: moves & many,
        Note.FORGETS_SLOWLY: moves & _not(free) & _not(many) & (1.0 - abs(multiplier) < SLOW),
        Note.MAY_COEXIST: moves & static,
        Note.MAY_GO_ON: rests & _not(held) & static & (beta < drive),
        Note.FEWER_DIGITS: (moves | rests) & _not(held) & loose,
    }
    return sum(int(note) * found for note, found in said.items())


def away_from_resonance(r: Any) -> Any:
    """Return |1 - k r| of the harmonic k that is nearest to resonance."""
    return abs(1.0 - np.maximum(1.0, (1.0 / r + 0.5) // 1.0) * r)


def _not(truth: Any) -> Any:
    return truth ^ True


def sentences(state: "SteadyState") -> tuple[str, ...]:
    """Return the notes of a steady state as sentences, with its numbers."""
    return tuple(MORE[note](state) if note in MORE else f"{WORDS[note]}." for note in Note if note & state.notes)


def _given_up(state: "SteadyState") -> str:
    miss = f" When it was, the motion missed itself by {state.residual:.1g} Y." if state.residual else ""
    return (
        "the search was given up after a second of work: this motion makes thousands of slides in a cycle, or is braked"
        f" so little that it takes too long to settle.{miss} {LAST_OF}; with more friction or damping, or a larger r,"
        " there is less to do."
    )


def _fewer_digits(state: "SteadyState") -> str:
    """What the energies differ by beyond what rounding leaves of the work put in, or what disturbances add up to."""
    problem, off, energy = state.problem, state.closure_error or 0.0, state.energy_taken or 0.0
    lasting, why = 0.0, "energies in and out differ so"
    if problem.law.is_exact:
        off = max(0.0, off - ROUNDING * problem.force_size * (state.response_amplitude or 0.0))
        kept = 1.0 - abs(state.floquet_multiplier or 0.0) if problem.beta else away_from_resonance(problem.r)
        lasting = max(ROUNDED / max(ROUNDED, kept), EPSILON / max(EPSILON, state.response_amplitude or 1.0))
    off = off / energy if energy > 0.0 else 0.0
    if lasting > off:
        why = "what rounding disturbs in a cycle lasts so long, next to resonance or rest"
    return f"The numbers are good to about {max(off, lasting):.0e} only: {why}."


LAST_OF = "--cycles N gives the last of N cycles"
WORDS: Mapping[Note, str] = {
    Note.FAILED: "could not be solved: `frictionlab simulate` says why",
    Note.RUNS_AWAY: (
        "gradient: beta |gradient| >= 1: friction changes along the path faster than the spring's force and the mass"
        " runs away: take a smaller gradient"
    ),
    Note.PULLS: (
        "gradient: the mass goes where the friction force beta (1 + gradient z) is below 0, which no contact does:"
        " take a smaller gradient"
    ),
    Note.CHATTERS: "events without end: more phases in a cycle than any motion has",
    Note.GIVEN_UP: "the search was given up after its share of work",
    Note.UNSETTLED: (
        "the motion from rest was not seen to settle on an orbit within the work allowed: it settles slowly, or is"
        f" chaos; {LAST_OF}"
    ),
    Note.NOT_PASSIVE: (
        "LuGre friction is not passive: it may give energy back; passive needs 2 contact_damping_ratio r >"
        " bristle_damping (static_ratio - 1): term speed, or a smaller bristle_damping"
    ),
    Note.UNDAMPED: "nothing damps this motion: free vibration never dies out; this is the motion without",
    Note.CONTINUUM: "this is the symmetric one of a continuum of motions (3.3) of one energy; rest leads to another",
    Note.FORGETS_SLOWLY: f"the motion forgets its start slowly: a disturbance lasts {1 / SLOW:g} periods or more",
    Note.MAY_COEXIST: (
        "friction that is larger at rest, falls with speed or varies along the path may have other motions beside this"
        " one, which rest settles on: `frictionlab simulate --all` lists them with their shares"
    ),
    Note.MAY_GO_ON: "the mass rests, but a motion once begun might go on: kinetic friction alone does not hold it",
    Note.FEWER_DIGITS: "numbers are good to fewer digits than usual: energies in and out differ",
}
"""What each note says, of many points as of one state ..."""
MORE: Mapping[Note, Callable[["SteadyState"], str]] = {Note.GIVEN_UP: _given_up, Note.FEWER_DIGITS: _fewer_digits}
"""... unless it has numbers of the state."""
