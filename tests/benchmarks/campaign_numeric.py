"""Contacts whose laws have no exact slides, in a campaign: is each material's law found, and are its values right?

Run: ``python -m tests.benchmarks.campaign_numeric [auto|given]...``; the result goes to results/campaign_numeric.txt.
Parameters are the same in newtons, metres and seconds in all tests of a material, so that the dimensionless ones differ
with the frequency. With ``given`` each campaign is of one material under its own law; with ``auto`` all are evaluated
together and their laws are looked for. Seconds hold no compilation.
"""

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement
from frictionlab.campaign import Campaign, cycle_of, evaluate, trial_of
from frictionlab.identification import predict
from frictionlab.identification.engines import warm
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.laws import law_of
from frictionlab.tables import Row
from tests.identification.contacts import recorded, scene

RESULT = Path(__file__).parent / "results" / "campaign_numeric.txt"
RATIOS, FORCE, STIFFNESS = (0.3, 0.45, 0.6, 0.8, 1.3, 1.6), 1.25, 1191.0
MIDDLE = float(np.mean(RATIOS))  # of the test that stands for all
MATERIALS: dict[str, tuple[str, float, dict[str, float]]] = {
    "rubber": (
        "coulomb+rate-state",
        0.44,
        {
            "stiffness_ratio": 20.0,
            "direct_effect": 0.06,
            "evolution_effect": 0.02,
            "slip_distance": 0.05,
            "reference_speed": 0.1,
        },
    ),
    "bronze": ("coulomb+stribeck", 0.30, {"static_ratio": 1.4, "stribeck_speed": 0.2, "stribeck_exponent": 2.0}),
    "steel": ("coulomb+place", 0.35, {"gradient": 0.05}),
}


def known(law: str) -> Scene:
    """What is declared of the rig."""
    return scene(
        model={"law": law}, rig={"stiffness_n_per_m": STIFFNESS}, sensors={"lag_s_u": 1e-4, "gain_error": 0.001}
    )


def tests_of(name: str, seed: int) -> dict[str, Measurement]:
    """The measured tests of a material, by source."""
    law, beta, middle = MATERIALS[name]
    generator, found = np.random.default_rng([20261122, seed]), {}
    for r in RATIOS:
        rates = {p.name: p.rates for p in law_of(law).parameters}
        own = {key: value * (MIDDLE / r) ** rates[key] for key, value in middle.items()}
        problem = Problem(r, beta, law=law, parameters=own)
        seen = recorded(problem, generator, seconds=30.0)
        found[f"{name}_r{r}"] = measure(seen, known("coulomb"))
    return found


def evaluated(names: Sequence[str], measured: dict[str, Measurement], law: str | None) -> tuple[Campaign, float]:
    """The campaign of some materials, under a law or with their laws to be found; and its CPU seconds."""
    what = known(law or "coulomb")

    def probe(sources: Sequence[str], under: str) -> list[Row]:
        return [{**predict(measured[s], what, law=under).row(), "source": s} for s in sources]

    own = {s: m for s, m in measured.items() if s.split("_")[0] in names}
    facts = {s: {"source": s, "material": s.split("_")[0], "normal_force_n": FORCE, "warnings": []} for s in own}
    trials = [trial_of({**m.row(), **facts[s]}) for s, m in own.items()]
    begin = time.process_time()
    cycles = {s: cycle_of(s, (s.split("_")[0], FORCE), m, what) for s, m in own.items()}
    found = evaluate(trials, what, cycles=cycles, find_law=law is None, probe=probe)
    return found, time.process_time() - begin


def lines(found: Campaign) -> list[str]:
    """What was found of each material, beside what it was made with."""
    told = []
    for fit in found.fits:
        law, beta, middle = MATERIALS[fit.material]
        told.append(
            f"{fit.material}, made with {law}: {fit.law}; beta {beta:g} found {fit.ratio}; {fit.note or 'all used'}"
        )
        for one in found.parameters:
            if one.material == fit.material:
                truth = middle.get(one.parameter)
                made = "" if truth is None else f" (made with {truth:g})"
                told.append(f"    {one.parameter} {one.number}{made}{'' if one.is_told else ', not told'}")
    return told


def main() -> None:
    """Evaluate them and write the table."""
    for kind in ("coulomb+compliance", "coulomb+stribeck"):
        warm(law_of(kind))
    measured = {s: m for seed, name in enumerate(MATERIALS) for s, m in tests_of(name, seed).items()}
    told = [f"{len(RATIOS)} tests of each material"]
    for way in sys.argv[1:] or ("given", "auto"):
        for names in ([name] for name in MATERIALS) if way == "given" else [list(MATERIALS)]:
            found, seconds = evaluated(names, measured, MATERIALS[names[0]][0] if way == "given" else None)
            told += ["", f"{way}, {', '.join(names)}: {seconds:.0f} CPU s", *lines(found)]
            sys.stdout.write("\n".join(told[-len(lines(found)) - 1 :]) + "\n")
            sys.stdout.flush()
    RESULT.write_text("\n".join(told) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
