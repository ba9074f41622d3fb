"""Scene + measured cycle -> what is simulated: the one translation, for one test, a campaign and a plan alike."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError, UsageError
from frictionlab.scene import Scene
from frictionlab.simulator import COSINE, Base, Problem
from frictionlab.simulator.laws import Law, law_of
from frictionlab.simulator.problem import Wall

FloatArray = NDArray[np.float64]
HIGHER = "base_higher"  # the nuisance: share of the base's higher harmonics that the sensor shows and the base has
SEEN = 1e-3  # of Y: smaller harmonics of the base are left out, for each makes a steady state dearer


@dataclass(frozen=True)
class Family:
    """All problems that one test may be: everything is known but some of the law's parameters.

    Parameters
    ----------
    r : float
        Frequency ratio.
    law : Law
    held : mapping of str to float
        Parameters of the law that the scene holds fixed.
    wall : {"fixed", "base"}
    base : Base
        Motion of the base over Y.
    higher : Base, optional
        Harmonics from the third on that the base's sensor shows and that `base` leaves out: the base's or the sensor's.
    """

    r: float
    law: Law
    held: Mapping[str, float]
    wall: Wall
    base: Base = COSINE
    higher: Base | None = None

    @property
    def free(self) -> tuple[str, ...]:
        """The law's own parameters that are to be found, in order: those not held, without counts."""
        return tuple(p.name for p in self.law.own if p.name not in self.held and not p.whole)

    def problem_at(self, values: Mapping[str, float], *, without: tuple[str, ...] = ()) -> Problem:
        """Return the problem at the values of a fit, by name, nuisances included; some parameters may be left out."""
        names = {p.name for p in self.law.parameters}.difference(without)
        return self.problem(
            {name: value for name, value in values.items() if name in names},
            detuning=values.get("natural_frequency", 0.0),
            second=complex(values.get("second_cosine", 0.0), -values.get("second_sine", 0.0)),
            share=values.get(HIGHER, 0.0),
        )

    def problem(
        self, values: Mapping[str, float], *, detuning: float = 0.0, second: complex = 0.0, share: float = 0.0
    ) -> Problem:
        """Return the problem with these parameters.

        Parameters
        ----------
        values : mapping of str to float
            Parameters beside the held ones.
        detuning : float
            Relative error of the natural frequency: r / (1 + detuning) is simulated.
        second : complex
            A second harmonic added to the base, cosine - i sine part, over Y.
        share : float
            Of the higher harmonics that its sensor shows, added to the base.
        """
        given = (
            {p.name: p.default for p in self.law.parameters if p.default is not None} | dict(self.held) | dict(values)
        )
        beta, frame = given.pop("beta"), given.pop("frame_damping_ratio", 0.0)
        two = (0.0, second.real), (0.0, -second.imag)
        base = self.base if second == 0.0 else _with_share(self.base, Base(*two), 1.0)
        base = _with_share(base, self.higher, share) if self.higher is not None and share else base
        return Problem(
            self.r / (1.0 + detuning),
            beta,
            wall=self.wall,
            base=base,
            law=self.law,
            parameters=given,
            frame_damping_ratio=frame,
        )

    def holding(self, values: Mapping[str, float]) -> "Family":
        """Return the family with more of the law's parameters held fixed."""
        return replace(self, held=dict(self.held) | dict(values))

    def under_plain_coulomb(self) -> "Family":
        """Return the family of the same test under plain Coulomb friction, where a ladder begins."""
        return self.under(law_of("coulomb"))

    def under(self, law: Law) -> "Family":
        """Return the family of the same test under another law; what that law lacks is no longer held."""
        names = {p.name for p in law.parameters}
        return replace(self, law=law, held={k: v for k, v in self.held.items() if k in names})


def _with_share(base: Base, more: Base, share: float) -> Base:
    """A base with so much of some more harmonics (1.0: all) added."""
    both = zip((base.cosine, base.sine), (more.cosine, more.sine), strict=True)
    pairs = ([a + share * b for a, b in zip_longest(*one, fillvalue=0.0)] for one in both)
    cosine, sine = (tuple(values) for values in pairs)
    return Base(cosine, sine)


def law_and_held(scene: Scene, law: str | Law | None = None) -> tuple[Law, dict[str, float]]:
    """Return the law that a scene (or the caller) names, and the parameters that the scene holds fixed.

    ``static_ratio`` of ``[model]`` is the static ratio of both directions; a `damping_ratio` of the rig is simulated.

    Raises
    ------
    UsageError
        The scene holds a parameter that the law lacks.
    """
    model = scene.model
    chosen = law_of(model.law if law is None else law)
    held = dict(model.parameters) if law is None or law_of(law).name == law_of(model.law).name else {}
    names = {p.name for p in chosen.own}
    if model.static_ratio != 1.0 and "static_ratio" not in names and not chosen.has("breakaway"):
        chosen = law_of(f"{chosen.name}+breakaway")
        held |= dict.fromkeys(("static_ratio_up", "static_ratio_down"), model.static_ratio)
    if scene.rig.damping_ratio is not None:
        held.setdefault("frame_damping_ratio", scene.frame_damping_ratio)
    strangers = sorted(set(held) - {p.name for p in chosen.parameters})
    if strangers:
        known = ", ".join(p.name for p in chosen.parameters)
        raise UsageError(f"model.parameters: law {chosen.name} has no {', '.join(strangers)}; expected {known}")
    return chosen, held


def family_of(measurement: Measurement, scene: Scene, law: str | Law | None = None) -> Family:
    """Return what one measured test may be under a law, with the physics that the scene names.

    Raises
    ------
    AnalysisError
        The natural frequency is not known.
    """
    ratio = measurement.frequency_ratio
    if ratio is None or not math.isfinite(ratio):
        raise AnalysisError(
            "no frequency ratio: the natural frequency is not known: give rig.natural_frequency_hz in the scene, or"
            " mass_kg and stiffness_n_per_m; `frictionlab free-vibration` measures it"
        )
    chosen, held = law_and_held(scene, law)
    base = measured_base(measurement, scene.model.base_harmonics)
    return Family(ratio, chosen, held, scene.model.wall, base, higher_harmonics(measurement, base))


def higher_harmonics(measurement: Measurement, base: Base) -> Base | None:
    """The base's harmonics from the third on that its sensor shows; None where they are noise, or simulated anyway."""
    cycle = measurement.cycle
    cosine, sine = (np.array(side) for side in (cycle.base_cosine, cycle.base_sine))
    cosine[:2], sine[:2] = 0.0, 0.0
    noise = measurement.base_amplitude_m_se / measurement.base_amplitude_m
    told = np.hypot(cosine, sine) > max(3.0 * noise, SEEN)
    if base.harmonics > 1 or not told.any():
        return None
    return Base(tuple((cosine * told).tolist()), tuple((sine * told).tolist()))


def measured_base(measurement: Measurement, harmonics: int) -> Base:
    """Return the base motion with so many of its measured harmonics; a pure cosine with one.

    Raises
    ------
    UsageError
        More harmonics are asked for than are measured.
    """
    cycle = measurement.cycle
    if harmonics > len(cycle.base_cosine):
        raise UsageError(
            f"model.base_harmonics: expected at most {len(cycle.base_cosine)}, as many as are measured; got {harmonics}"
        )
    if harmonics == 1:
        return COSINE
    return Base(tuple(cycle.base_cosine[:harmonics].tolist()), tuple(cycle.base_sine[:harmonics].tolist()))
