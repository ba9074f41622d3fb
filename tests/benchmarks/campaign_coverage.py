"""Do the errors of a campaign hold, are its p-values even, and is each material's law the right one?

Run: ``python -m tests.benchmarks.campaign_coverage [CAMPAIGNS [FIRST SEED [KIND]]]``; the result goes to
results/campaign_coverage.txt (of another kind: campaign_coverage_KIND.txt). Seeds 0 to 7 are those it was made with.
Every campaign has a rig of its own, drawn from what its scene declares: gain (0.3 %), lag (0.5 ms), natural frequency
(0.1 %), stiffness (0.5 %). Four materials of four laws, two normal forces (each off by 10 mN), six frequency ratios;
tests of 40 s at 250 Hz through the optoNCDT's noise and step, friction scattering by 0.3 % from cycle to cycle and, in
every second campaign, by 1 % from test to test. Of the kind ``harmonic`` the base has a second harmonic of 1 % that no
scene declares, at a phase drawn for each campaign; of the kind ``uneven`` gradient, dashpot and break-away differ from
test to test by 15 %, one deviation, beside the friction.
"""

import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy import stats

from frictionlab.analysis.measure import measure
from frictionlab.campaign import Campaign, Cycle, Trial, cycle_of, evaluate, trial_of
from frictionlab.campaign.joint import Joint
from frictionlab.scene import Scene
from frictionlab.simulator import COSINE, Base, Problem
from tests.identification.contacts import BASE_M, NATURAL_HZ, recorded, scene

RESULTS = Path(__file__).parent / "results"
KINDS = ("plain", "harmonic", "uneven")
STIFFNESS = 1191.0
RATIOS, FORCES = (0.3, 0.42, 0.57, 0.75, 1.3, 1.7), (1.0, 1.6)
GAIN, LAG_S, FREQUENCY, STIFF, NORMAL = 0.003, 5e-4, 0.001, 0.005, 0.01
BETWEEN = 0.01
SECOND = 0.01  # of Y
UNEVEN = 0.15


@dataclass(frozen=True)
class Contact:
    """A material: its coefficient, its law, its parameters for the amplitude of the base."""

    coefficient: float
    law: str
    parameters: Mapping[str, float] = field(default_factory=dict)


CONTACTS = {
    "plain": Contact(0.45, "coulomb"),
    "tilted": Contact(0.60, "coulomb+place", {"gradient": 0.04}),
    "greased": Contact(0.35, "coulomb+speed", {"contact_damping_ratio": 0.05}),
    "sticky": Contact(0.75, "coulomb+breakaway", {"static_ratio_up": 1.2, "static_ratio_down": 1.2}),
}


def rig() -> Scene:
    """What the scene declares."""
    return scene(
        rig={
            "stiffness_n_per_m": STIFFNESS,
            "stiffness_n_per_m_u": STIFF * STIFFNESS,
            "natural_frequency_hz_u": FREQUENCY * NATURAL_HZ,
        },
        sensors={"gain_error": GAIN, "lag_s_u": LAG_S, "linearity": 0.0},
        experiment={"normal_force_n_u": NORMAL},
    )


@dataclass
class Truth:
    """What one campaign was made with: relative ``rig`` by the fit's names, friction ratio by material and force."""

    rig: dict[str, float] = field(default_factory=dict)
    ratios: dict[tuple[str, float], float] = field(default_factory=dict)


def drawn(seed: int, known: Scene, kind: str) -> tuple[list[Trial], dict[str, Cycle], Truth]:
    """The tests of one campaign, and what they were made with."""
    generator = np.random.default_rng([20261122, seed])
    trials: list[Trial] = []
    cycles: dict[str, Cycle] = {}
    truth = Truth()
    for trial, cycle in _tests(generator, known, kind, truth, between=BETWEEN * (seed % 2)):
        trials.append(trial)
        cycles[trial.source] = cycle
    return trials, cycles, truth


def _tests(
    generator: np.random.Generator, known: Scene, kind: str, truth: Truth, *, between: float
) -> Iterator[tuple[Trial, Cycle]]:
    base_gain, mass_gain = 1.0 + GAIN * generator.standard_normal(2)
    lag, tuned = LAG_S * generator.standard_normal(), 1.0 + FREQUENCY * generator.standard_normal()
    truth.rig.update(gain=mass_gain / base_gain - 1.0, lag=lag / LAG_S, natural_frequency=tuned - 1.0)
    stiffness = STIFFNESS * (1.0 + STIFF * generator.standard_normal())
    second = SECOND * np.exp(2j * np.pi * generator.random()) if kind == "harmonic" else 0j
    for name, contact in CONTACTS.items():
        for force in FORCES:
            pressed = force + NORMAL * generator.standard_normal()
            truth.ratios[name, force] = contact.coefficient * pressed / (stiffness * BASE_M)
            for r in RATIOS:
                own = contact.coefficient * np.exp(between * generator.standard_normal())
                beta = own * pressed / (stiffness * BASE_M)
                spread = UNEVEN if kind == "uneven" else 0.0
                parameters = _drawn(contact, spread, generator)
                base = Base((1.0, second.real), (0.0, second.imag)) if second else COSINE
                problem = Problem(r, beta, base=base, law=contact.law, parameters=parameters)
                seen = recorded(
                    problem,
                    generator,
                    seconds=40.0,
                    lag_s=lag,
                    tuned=tuned,
                    sensors=lambda _, mass, base: (mass_gain * mass, base_gain * base),
                )
                measured = measure(seen, known)
                source = f"{name}_N{force}_r{r}"
                facts = {"source": source, "material": name, "normal_force_n": force}
                yield (
                    trial_of({**measured.row(), **facts, "warnings": []}),
                    cycle_of(source, (name, force), measured, known),
                )


def _drawn(contact: Contact, spread: float, generator: np.random.Generator) -> dict[str, float]:
    """A contact's parameters in one test; a static ratio differs in what it is beyond 1."""
    return {
        name: (value - 1.0) * factor + 1.0 if name.startswith("static") else value * factor
        for name, value in contact.parameters.items()
        for factor in (1.0 + spread * generator.standard_normal() if spread else 1.0,)
    }


@dataclass
class Tally:
    """Scores (error over stated uncertainty) of coefficients, friction ratios, other parameters and the rig, intervals
    that hold the truth, p-values, laws, seconds.
    """

    scores: list[float] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)
    others: dict[str, list[float]] = field(default_factory=dict)
    rig: list[float] = field(default_factory=list)
    inside: list[bool] = field(default_factory=list)
    tests_p: list[float] = field(default_factory=list)
    amontons_p: list[float] = field(default_factory=list)
    laws: dict[str, dict[str, int]] = field(default_factory=dict)
    seconds: list[float] = field(default_factory=list)

    def add(self, found: Campaign, made: Truth, seconds: float, *, even: bool) -> None:
        """Count one campaign; `even`: its tests have equal friction."""
        self.seconds.append(seconds)
        for fit in found.fits:
            if fit.friction_ratio and fit.friction_ratio_u:
                truth = made.ratios[fit.material, fit.normal_force_n]
                self.ratios.append((fit.friction_ratio - truth) / fit.friction_ratio_u)
            truth, (low, high) = CONTACTS[fit.material].coefficient, fit.coefficient_interval
            if fit.friction_coefficient is None or fit.friction_coefficient_u is None or low is None or high is None:
                continue
            self.scores.append((fit.friction_coefficient - truth) / fit.friction_coefficient_u)
            self.inside.append(low <= truth <= high)
            if even and fit.tests_p is not None:
                self.tests_p.append(fit.tests_p)
        for told in found.parameters:
            if told.value is not None and told.value_u and told.parameter in CONTACTS[told.material].parameters:
                truth = CONTACTS[told.material].parameters[told.parameter]
                self.others.setdefault(told.parameter, []).append((told.value - truth) / told.value_u)
        if found.joined:
            self.rig += _rig_scores(next(iter(found.joined.values())).joined.moved, made.rig)
        self.amontons_p += [test.p for test in found.amontons if test.p is not None]
        for name, material in found.joined.items():
            of_this = self.laws.setdefault(name, {})
            of_this[material.law.name] = of_this.get(material.law.name, 0) + 1


def _rig_scores(joint: Joint, made: Mapping[str, float]) -> list[float]:
    """Error over uncertainty of what the fit says of gain, lag and natural frequency, which all materials share."""
    told = zip(joint.shared.coordinates, joint.solution.point, np.diag(joint.spread.total), strict=True)
    return [
        (float(point) - made[c.name] / (1.0 if c.name == "lag" else c.width)) / np.sqrt(variance)
        for c, point, variance in told
        if c.name in made
    ]


def _share(values: list[float], below: float) -> float:
    return float(np.mean(np.array(values) < below))


def _even(name: str, values: list[float]) -> str:
    shares = ", ".join(f"{_share(values, p):.0%} below {p}" for p in (0.01, 0.05, 0.25, 0.5, 0.75, 0.95))
    test = stats.kstest(values, "uniform").pvalue
    return f"{name} ({len(values)}): {shares}; Kolmogorov-Smirnov p = {test:.2g}"


def _within(name: str, values: list[float]) -> str:
    scores = np.abs(values)
    within = [f"{np.mean(scores < reach):.1%}" for reach in (1.0, 1.96)]
    rms = f"rms of their error over u {np.sqrt(np.mean(scores**2)):.2f}"
    return f"{name} ({len(scores)}): {within[0]} within u, {within[1]} within 1.96 u; {rms}"


def report(tally: Tally, first: int, campaigns: int, kind: str) -> str:
    """The table."""
    inside = f"{np.mean(tally.inside):.1%} of the 95 % intervals hold it"
    tests = len(CONTACTS) * len(FORCES) * len(RATIOS)
    lines = [
        f"{campaigns} campaigns ({kind}, seeds {first} to {first + campaigns - 1}) of {tests} tests",
        f"{_within('friction coefficients', tally.scores)}; {inside}",
        _within("friction ratios", tally.ratios),
        _within("other parameters of the laws", [score for scores in tally.others.values() for score in scores]),
        *(_within(f"  {name}", scores) for name, scores in sorted(tally.others.items())),
        _within("gain, lag and natural frequency of the rig", tally.rig),
        _even("p of equal tests, where they are equal", tally.tests_p),
        _even("Amontons' p", tally.amontons_p),
        *(
            f"{name}, made with {CONTACTS[name].law}: "
            + ", ".join(f"{law} {n}" for law, n in sorted(laws.items(), key=lambda item: -item[1]))
            for name, laws in tally.laws.items()
        ),
        f"CPU seconds of an evaluation with the laws, cycles at hand: median {np.median(tally.seconds):.1f}",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run the campaigns and write the table."""
    campaigns, first = (int(sys.argv[i]) if len(sys.argv) > i else default for i, default in ((1, 40), (2, 0)))
    kind = sys.argv[3] if len(sys.argv) > 3 else KINDS[0]
    known, tally = rig(), Tally()
    for seed in range(first, first + campaigns):
        trials, cycles, made = drawn(seed, known, kind)
        begin = time.process_time()
        found = evaluate(trials, known, cycles=cycles, find_law=True)
        tally.add(found, made, time.process_time() - begin, even=seed % 2 == 0)
    text = report(tally, first, campaigns, kind)
    ending = "" if kind == KINDS[0] else f"_{kind}"
    (RESULTS / f"campaign_coverage{ending}.txt").write_text(text, encoding="utf-8")
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
