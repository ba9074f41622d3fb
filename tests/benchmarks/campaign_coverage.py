"""Do the errors of a campaign hold, are its p-values even, and is each material's law the right one?

Run: ``python -m tests.benchmarks.campaign_coverage [CAMPAIGNS]``; the result goes to results/campaign_coverage.txt.
Every campaign has a rig of its own, drawn from what its scene declares: gain (0.3 %), lag (0.5 ms), natural frequency
(0.1 %), stiffness (0.5 %). Four materials of four laws, two normal forces (each off by 1 %), six frequency ratios;
tests of 40 s at 250 Hz through the optoNCDT's noise and step, friction scattering by 0.3 % from cycle to cycle and, in
every second campaign, by 1 % from test to test.
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
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from tests.identification.contacts import BASE_M, NATURAL_HZ, recorded, scene

RESULT = Path(__file__).parent / "results" / "campaign_coverage.txt"
STIFFNESS = 1191.0
RATIOS, FORCES = (0.3, 0.42, 0.57, 0.75, 1.3, 1.7), (1.0, 1.6)
GAIN, LAG_S, FREQUENCY, STIFF, NORMAL = 0.003, 5e-4, 0.001, 0.005, 0.01
BETWEEN = 0.01


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


def drawn(seed: int, known: Scene) -> Campaign:
    """One campaign, evaluated."""
    generator = np.random.default_rng([20261122, seed])
    trials: list[Trial] = []
    cycles: dict[str, Cycle] = {}
    for trial, cycle in _tests(generator, known, between=BETWEEN * (seed % 2)):
        trials.append(trial)
        cycles[trial.source] = cycle
    return evaluate(trials, known, cycles=cycles, find_law=True)


def _tests(generator: np.random.Generator, known: Scene, *, between: float) -> Iterator[tuple[Trial, Cycle]]:
    base_gain, mass_gain = 1.0 + GAIN * generator.standard_normal(2)
    lag, tuned = LAG_S * generator.standard_normal(), 1.0 + FREQUENCY * generator.standard_normal()
    stiffness = STIFFNESS * (1.0 + STIFF * generator.standard_normal())
    for name, contact in CONTACTS.items():
        for force in FORCES:
            pressed = force * (1.0 + NORMAL * generator.standard_normal())
            for r in RATIOS:
                own = contact.coefficient * np.exp(between * generator.standard_normal())
                beta = own * pressed / (stiffness * BASE_M)
                problem = Problem(r, beta, law=contact.law, parameters=contact.parameters)
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


@dataclass
class Tally:
    """Scores (error over stated uncertainty), intervals that hold the truth, p-values, laws, seconds."""

    scores: list[float] = field(default_factory=list)
    inside: list[bool] = field(default_factory=list)
    tests_p: list[float] = field(default_factory=list)
    amontons_p: list[float] = field(default_factory=list)
    laws: dict[str, dict[str, int]] = field(default_factory=dict)
    seconds: list[float] = field(default_factory=list)

    def add(self, found: Campaign, seconds: float, *, even: bool) -> None:
        """Count one campaign; `even`: its tests have equal friction."""
        self.seconds.append(seconds)
        for fit in found.fits:
            truth, (low, high) = CONTACTS[fit.material].coefficient, fit.coefficient_interval
            if fit.friction_coefficient is None or fit.friction_coefficient_u is None or low is None or high is None:
                continue
            self.scores.append((fit.friction_coefficient - truth) / fit.friction_coefficient_u)
            self.inside.append(low <= truth <= high)
            if even and fit.tests_p is not None:
                self.tests_p.append(fit.tests_p)
        self.amontons_p += [test.p for test in found.amontons if test.p is not None]
        for name, material in found.joined.items():
            of_this = self.laws.setdefault(name, {})
            of_this[material.law.name] = of_this.get(material.law.name, 0) + 1


def _share(values: list[float], below: float) -> float:
    return float(np.mean(np.array(values) < below))


def _even(name: str, values: list[float]) -> str:
    shares = ", ".join(f"{_share(values, p):.0%} below {p}" for p in (0.01, 0.05, 0.25, 0.5, 0.75, 0.95))
    test = stats.kstest(values, "uniform").pvalue
    return f"{name} ({len(values)}): {shares}; Kolmogorov-Smirnov p = {test:.2g}"


def report(tally: Tally, campaigns: int) -> str:
    """The table."""
    scores = np.abs(tally.scores)
    within = [f"{np.mean(scores < reach):.1%}" for reach in (1.0, 1.96)]
    inside = f"{np.mean(tally.inside):.1%} of the 95 % intervals hold it"
    lines = [
        f"{campaigns} campaigns of {len(CONTACTS) * len(FORCES) * len(RATIOS)} tests",
        f"friction coefficients ({len(scores)}): {within[0]} within u, {within[1]} within 1.96 u; {inside}",
        f"rms of their error over u: {np.sqrt(np.mean(scores**2)):.2f}",
        _even("p of equal tests, where they are equal", tally.tests_p),
        _even("Amontons' p", tally.amontons_p),
        *(
            f"{name}, made with {CONTACTS[name].law}: "
            + ", ".join(f"{law} {n}" for law, n in sorted(laws.items(), key=lambda item: -item[1]))
            for name, laws in tally.laws.items()
        ),
        f"CPU seconds of an evaluation with the laws, recordings read: median {np.median(tally.seconds):.1f}",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run the campaigns and write the table."""
    campaigns = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    known, tally = rig(), Tally()
    for seed in range(campaigns):
        begin = time.process_time()
        tally.add(drawn(seed, known), time.process_time() - begin, even=seed % 2 == 0)
    text = report(tally, campaigns)
    RESULT.write_text(text)
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
