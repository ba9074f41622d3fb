"""What a recording says of its contact, in a dozen lines: the law, its values in newtons, what simpler laws get wrong.

Everything here is a `Comparison` in words; nothing is found anew but the simpler law's own comparison, made by
the same verb.
"""

import math
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError
from frictionlab.inference.compare import AUTO, predict
from frictionlab.inference.comparison import Comparison, ContactForce
from frictionlab.inference.diagnose import OTHER_CAUSE
from frictionlab.inference.ladder import DEAR, EXACT, NOT_TOLD_APART, NUMERIC, REQUIRED
from frictionlab.inference.posterior import AS_KNOWN, MISSED, NOISE, limits_in_words
from frictionlab.scene import Scene
from frictionlab.scene.physical import to_physical
from frictionlab.simulator.laws import law_of

WIDTH = 80
STILL = 1e-9  # of omega Y: a contact that is slower stands
TELLS = {
    "gradient": "a larger amplitude of the base, or several loads in one campaign",
    "contact_damping_ratio": "rig.damping_ratio and sensors.lag_s measured, or a test nearer to resonance",
    "static_ratio_up": "a slower test, in which the mass stops for longer",
    "static_ratio_down": "a slower test, in which the mass stops for longer",
    "stiffness_ratio": "a smaller amplitude of the base, in which the contact bends more than it slides",
}
"""What would tell a parameter that a test does not."""
SHOWN = {
    "gradient": (0.1, "%/mm", "change of friction along the path"),
    "contact_damping_ratio": (1.0, "N s/m", "dashpot in the contact"),
    "stiffness_ratio": (1e-3, "N/mm", "stiffness of the contact"),
    "stribeck_speed": (1e3, "mm/s", "speed at which friction has weakened"),
    "rate_speed": (1e3, "mm/s", "speed from which friction changes"),
    "slip_distance": (1e6, "um", "way in which the contact is renewed"),
}
"""What is told in units that people read: times its size in newtons, metres and seconds, unit, words."""
PARTS = {"stops": "at stops", "slides up": "while the mass slides up", "slides down": "while the mass slides down"}
"""Parts of a cycle, as they stand in a sentence."""
SOURCES = {
    NOISE: "noise, and what the law misses",
    AS_KNOWN: "sensors and rig, which the fit finds unlike what is known of them",
    NOT_TOLD_APART: "other laws, which the recording does not tell apart",
    MISSED: "the law: found in another way, beta is another",
    OTHER_CAUSE: "another cause than the law",
    "natural_frequency": "the natural frequency (rig.natural_frequency_hz)",
    "gain": "the gain of a sensor (sensors.gain_error)",
    "lag_s": "the lag between the channels (sensors.lag_s)",
    "frame_damping_ratio": "the frame's damping (rig.damping_ratio)",
    "parabola": "the linearity of the mass's sensor (sensors.linearity)",
    "cubic": "the linearity of the mass's sensor (sensors.linearity)",
    "base_parabola": "the linearity of the base's sensor (sensors.linearity)",
    "base_cubic": "the linearity of the base's sensor (sensors.linearity)",
    "base_in_mass": "the base's channel in the mass's (sensors.crosstalk)",
    "mass_in_base": "the mass's channel in the base's (sensors.crosstalk)",
}
"""Where an uncertainty comes from, in words."""
ANY = "tests at another amplitude and another speed; frictionlab plan says which"


@dataclass(frozen=True)
class Explanation:
    """What a recording says of its contact.

    ``comparison``: under the law that the recording requires; ``simpler``: under the best of the laws with fewer terms,
    None where it is plain Coulomb friction already; ``physical``: parameter -> value, uncertainty, unit, words;
    ``unit_m``: Y, the base's amplitude [m]; ``energy_j``: the measured energy per cycle [J], None without a stiffness.
    """

    comparison: Comparison
    simpler: Comparison | None
    physical: Mapping[str, tuple[float, float | None, str, str]]
    unit_m: float
    energy_j: float | None

    @property
    def contact(self) -> ContactForce | None:
        """What the one figure shows; None where there is nothing to compare."""
        return self.comparison.contact

    @property
    def text(self) -> str:
        """The explanation, in lines of at most 80 letters."""
        return "\n".join(said for _, said in self._sentences())

    def short(self, most: int) -> list[str]:
        """So many lines of the text, those of what matters most: law, values, what decides, what is doubtful, next."""
        kept: dict[int, list[str]] = {}
        for place, (_, said) in sorted(enumerate(self._sentences()), key=lambda sentence: sentence[1][0]):
            if sum(map(len, kept.values())) + len(lines := said.splitlines()) <= most:
                kept[place] = lines
        return [line for place in sorted(kept) for line in kept[place]]

    def _sentences(self) -> list[tuple[int, str]]:
        """Each sentence in lines; before it its rank, 0 for what matters most."""
        parts = (
            (0, _law),
            (3, _energy),
            (1, _values),
            (4, _cause),
            (3, _simpler),
            (6, _details),
            (2, _next),
            (5, _warned),
        )
        told = [(rank, said) for rank, part in parts for said in part(self)]
        own = {"declare it": 1, "not told by": 3}
        return [
            (next((own[part] for part in own if part in " ".join(said.split())), rank), said) for rank, said in told
        ]

    def row(self) -> dict[str, object]:
        """The comparison's row, with the text and what the simpler law misses."""
        simpler = self.simpler
        return {
            **self.comparison.row(),
            "simpler_law": None if simpler is None else simpler.law,
            "simpler_nrmse": None if simpler is None else simpler.response_nrmse,
            "missed": missed(self.comparison.contact),
            "simpler_missed": None if simpler is None else missed(simpler.contact),
            "physical": {n: {"value": v, "u": u, "unit": unit} for n, (v, u, unit, _) in self.physical.items()},
            "text": self.text.splitlines(),
        }

    def __repr__(self) -> str:
        return f"<Explanation of {self.comparison!r}>"


def explain(measurement: Measurement, scene: Scene) -> Explanation:
    """Say which law a measured test requires, what it is made of, and what the next simpler law gets wrong.

    Raises
    ------
    AnalysisError
        As `compare`: not even Coulomb friction has a steady state here.
    """
    comparison = predict(measurement, scene, law=AUTO)
    name = simpler_law(comparison)
    simpler = None if name is None else predict(measurement, scene, law=name)
    known = physical(comparison, measurement, scene)
    return Explanation(comparison, simpler, known, measurement.base_amplitude_m, measurement.energy_per_cycle_j)


def explain_comparison(comparison: Comparison) -> Explanation:
    """Put a comparison into words as it is, without looking for a simpler law.

    Raises
    ------
    AnalysisError
        It has no steady cycle.
    """
    contact = comparison.contact
    if contact is None or comparison.energy_per_cycle is None:
        raise AnalysisError("explain: the comparison has no steady cycle: expected one of compare(recording)")
    force = {}
    if comparison.friction_force_n is not None:
        force["beta"] = (comparison.friction_force_n, comparison.friction_force_n_u, "N", "friction force")
    energy = None if contact.unit_n is None else comparison.energy_per_cycle * contact.unit_n * contact.unit_m
    return Explanation(comparison, None, force, contact.unit_m, energy)


def simpler_law(comparison: Comparison) -> str | None:
    """The law of the best evidence on the ladder that lacks a term of the one required; None: there is none."""
    terms = {t.name for t in law_of(comparison.law).terms}
    fewer = [
        rung
        for rung in comparison.laws or ()
        if {t.name for t in law_of(str(rung["law"])).terms} < terms and rung["log_evidence"] is not None
    ]
    return str(max(fewer, key=lambda rung: float(str(rung["log_evidence"])))["law"]) if fewer else None


def missed(contact: ContactForce | None) -> dict[str, float]:
    """Rms of what a law misses, over Y: while the contact stands, slides up, slides down, as the law has it."""
    if contact is None or contact.residual is None or contact.law_velocity is None:
        return {}
    speed = contact.law_velocity
    parts = {"stops": np.abs(speed) < STILL, "slides up": speed >= STILL, "slides down": speed <= -STILL}
    square = contact.residual**2
    return {name: math.sqrt(float(square[there].mean())) for name, there in parts.items() if there.any()}


def physical(
    comparison: Comparison, measurement: Measurement, scene: Scene
) -> dict[str, tuple[float, float | None, str, str]]:
    """Parameters that were found, in newtons, metres and seconds, as far as the stiffness is known."""
    law = law_of(comparison.law)
    found: dict[str, tuple[float, float | None, str, str]] = {}
    if comparison.friction_force_n is not None:
        found["beta"] = (comparison.friction_force_n, comparison.friction_force_n_u, "N", "friction force")
    turn = 2.0 * math.pi * measurement.drive_frequency_hz
    for name, told in comparison.parameters.items():
        if name not in SHOWN or told["u"] is None:
            continue
        times, unit, words = SHOWN[name]
        factor, _ = to_physical(law.parameter(name), scene, amplitude=measurement.base_amplitude_m, turn=turn)
        if factor is not None:
            size = times * factor
            found[name] = (size * told["value"], size * told["u"], unit, words)
    return found


def _wrapped(text: str, *, indent: str = "") -> str:
    return textwrap.fill(text, WIDTH, initial_indent=indent, subsequent_indent=indent + "  ")


def _law(told: Explanation) -> Iterator[str]:
    c = told.comparison
    yield _wrapped(f"{c.source}: {c.law} at r = {c.frequency_ratio:.4g} ({law_of(c.law).words})")
    if c.response_nrmse is None or c.response_floor is None:
        yield "No prediction: this law has no steady state here."
        return
    verdict = {
        "explained": "It explains the cycle: it",
        "strained": "It explains the cycle only with sensors or rig unlike the scene (below): it",
    }.get(c.verdict or "", "No law that was tried explains the cycle. The best one")
    noise = f"the measurement's own error is {100 * c.response_floor:.2g} %"
    yield _wrapped(f"{verdict} leaves {100 * c.response_nrmse:.2g} % of the motion unexplained; {noise}.")


def _energy(told: Explanation) -> Iterator[str]:
    c = told.comparison
    if c.energy_difference is not None:
        joules = "" if told.energy_j is None else f" = {1e3 * told.energy_j:.4g} mJ"
        more = f"predicted {abs(100 * c.energy_difference):.2g} % {'more' if c.energy_difference > 0 else 'less'}"
        yield _wrapped(f"Energy per cycle: {c.energy_per_cycle:.4g} k Y^2{joules} measured, {more}.")


def _values(told: Explanation) -> Iterator[str]:
    law = law_of(told.comparison.law)
    for name, e in told.comparison.parameters.items():
        if e["u"] is None:
            continue
        own = f"{name} {_with_error(e['value'], e['u'])}"
        if not e["told"]:
            limits = limits_in_words(e["lower"], e["upper"])
            value = f"{law.parameter(name).words}: not told by this recording ({own}; {limits}, 95 %)"
        elif name in told.physical:
            size, error, unit, words = told.physical[name]
            value = f"{words}: {_with_error(size, error)} {unit} ({own})"
        else:
            value = f"{law.parameter(name).words}: {_with_error(e['value'], e['u'])} ({name})"
        yield _wrapped(value, indent="  ")


def _cause(told: Explanation) -> Iterator[str]:
    shares = told.comparison.budget.get("friction_ratio", {})
    if shares:
        most = max(shares, key=lambda name: shares[name])
        yield _wrapped(f"What adds most to the error of beta: {SOURCES.get(most, most)}.")


def _with_error(value: float, error: float | None) -> str:
    """A value with its uncertainty, to two digits of that.

    Examples
    --------
    >>> _with_error(0.31641, 0.0106), _with_error(1234.5, 27.0), _with_error(2.0, None)
    ('0.316 +- 0.011', '1234 +- 27', '2')
    """
    if not error or not math.isfinite(error):
        return f"{value:.4g}"
    digits = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{digits}f} +- {error:.{digits}f}"


def _simpler(told: Explanation) -> Iterator[str]:
    c, simpler = told.comparison, told.simpler
    if simpler is not None and simpler.response_nrmse is not None:
        where = missed(simpler.contact)
        most = max(where, key=lambda name: where[name], default="")
        yield _wrapped(
            f"A simpler law, {simpler.law}, leaves {100 * simpler.response_nrmse:.2g} %, most of it"
            f" {PARTS.get(most, '')}. Its log evidence is {_gain(c, simpler):.0f} lower; {REQUIRED:.0f} is enough."
        )


def _details(told: Explanation) -> Iterator[str]:
    """What the law misses, which other laws were tried, and which were not."""
    c = told.comparison
    here = ", ".join(f"{1e6 * told.unit_m * size:.2g} um {PARTS[name]}" for name, size in missed(c.contact).items())
    if here:
        yield _wrapped(f"{c.law} misses (rms): {here}.")
    tried = [str(rung["law"]) for rung in c.laws or ()]
    if spare := [str(rung["law"]) for rung in c.laws or () if not rung["required"]]:
        yield _wrapped(f"Tried, not needed: {', '.join(spare)}.")
    seen = {term.name for name in tried for term in law_of(name).terms} | _said_of(c)
    if c.verdict == "explained" and (rest := [term for term in (*EXACT, *NUMERIC, *DEAR) if term not in seen]):
        yield _wrapped(f"Not tried, because only noise is left to explain: {', '.join(rest)}.")


def _said_of(c: Comparison) -> set[str]:
    """Terms of laws of which a warning says for what other reason they were not tried, or not to the end."""
    laws = [said.removeprefix("law ").split(":")[0] for said in c.warnings if said.startswith("law ")]
    return {term for name in laws for term in name.split("+")}


def _gain(c: Comparison, simpler: Comparison) -> float:
    evidence = {str(rung["law"]): float(str(rung["log_evidence"])) for rung in c.laws or ()}
    return evidence[c.law] - evidence[simpler.law]


def _next(told: Explanation) -> Iterator[str]:
    """What to measure next."""
    untold = [name for name, e in told.comparison.parameters.items() if e["u"] is not None and not e["told"]]
    for name in untold:
        yield _wrapped(f"To measure {name}: {TELLS.get(name, ANY)}.")
    if not untold:
        yield _wrapped(f"Next: {ANY}.")


def _warned(told: Explanation) -> Iterator[str]:
    for sentence in told.comparison.warnings:
        if "does not tell it" not in sentence:
            yield _wrapped(f"! {sentence}")
