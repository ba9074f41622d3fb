"""Why a test is left out of a campaign's fit: a code for programs, which carries its sentence for people.

Programs compare causes, never words: rewording a sentence changes no fit.
"""

from dataclasses import dataclass
from enum import Enum


class Cause(Enum):
    """Why a test is left out; the value is the code in ``measurements.csv``, ``sentence`` the words."""

    LONG = "long", "a long test: in drift.csv"
    STUCK = "stuck", "stuck: all it tells is that the friction ratio is 1 / (static over kinetic friction) or more"
    UNSTEADY = (
        "unsteady",
        "unsteady: irregularity {:.2g} beyond noise and base; one steady state cannot stand for it",
    )
    ASYMMETRIC = "asymmetric", "asymmetric ({:.2g}): Coulomb's law on a symmetric contact cannot explain it"
    NEAR_RESONANCE = "near resonance", "near resonance: by Coulomb's law the response grows without bound"
    UNSETTLED = (
        "unsettled",
        "unsettled: by Coulomb's own reckoning {:.0%} of the transient is left where it was measured",
    )
    UNEXPLAINED = "unexplained", "unexplained: alone it would say {:.3g} where the group says {:.3g}"
    NO_CYCLE = "no cycle", "no recording at hand, or no cycle in it that a law can be fitted to"
    NOT_UNIQUE = (
        "not unique",
        "not unique: by Coulomb's law the motion keeps the asymmetry it began with: no one cycle stands for it",
    )
    DEAR = "dear", "dear: its law has no exact slides, and some tests of each normal force stand for all"
    UNPREDICTED = "no prediction", "no prediction: Coulomb's law finds no steady state here"

    sentence: str

    def __new__(cls, code: str, sentence: str) -> "Cause":
        """Take the code for the value."""
        cause = object.__new__(cls)
        cause._value_ = code
        cause.sentence = sentence
        return cause

    def because(self, *numbers: float) -> "LeftOut":
        """The cause for one test, with its numbers in the sentence."""
        return LeftOut(self, self.sentence.format(*numbers))


SCREENED = frozenset({Cause.LONG, Cause.STUCK})
"""Such a test says nothing of a friction ratio, and none is predicted for it."""
SOFT = frozenset({Cause.UNSTEADY, Cause.ASYMMETRIC, Cause.UNSETTLED})
"""Such a test is left out for what it is like, and could still say something where there is no other."""
JUDGED_ANEW = frozenset({Cause.NEAR_RESONANCE, Cause.UNSETTLED, Cause.UNEXPLAINED})
"""What depends on the friction ratio itself, and is asked again at each step of the fit."""
TRANSIENT = frozenset({Cause.UNSETTLED, Cause.NEAR_RESONANCE})
"""A transient still decays: that is the frame's doing, not the material's."""


@dataclass(frozen=True)
class LeftOut:
    """One test left out: the ``cause`` to compare, the ``sentence`` to read, with this test's numbers."""

    cause: Cause
    sentence: str

    def __str__(self) -> str:
        return self.sentence
