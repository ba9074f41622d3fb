"""Do the errors of a campaign hold, and the bands of tests left out, and is the law found the one it was made with?

Run: ``python -m tests.benchmarks.campaign_coverage [CAMPAIGNS [FIRST SEED [frame|tribometer]]]``, to
results/campaign_coverage_SEED.txt; ``tribometer``: 4 to 12 tests of 20 s under a given motion, their force measured,
with the same scatter of friction, and of a dashpot that every other material has; load cell and normal force are exact.
Every campaign is one material on a rig of its own: 4 to 12 tests of 40 s at 250 Hz under three normal forces, its law
one of three; friction and dashpot scatter by 0 to 5 % from test to test, the gradient is another in each test. Nobody
has declared the lag (5 ms, one standard deviation), and the natural frequency is off by 0.5 %, as declared.
"""

import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np

from frictionlab.analysis.measurement import measure
from frictionlab.campaign import Campaign, Tested, evaluate
from frictionlab.campaign.trials import Trial, trial_of
from frictionlab.errors import FrictionlabError
from frictionlab.inference.force import observe_force
from frictionlab.inference.material_law import COEFFICIENT
from frictionlab.inference.observations import observe
from frictionlab.recording import Recording
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.simulator import Problem
from tests.benchmarks import study
from tests.campaign.test_tribometer import GIVEN, stroked
from tests.inference.contacts import BASE_M, NATURAL_HZ, recorded, scene

STIFFNESS, FREQUENCY, LAG_S, MOST_SCATTER, GRADIENT = 1191.0, 0.005, 5e-3, 0.05, 0.04
FORCES, RATIOS = (0.8, 1.4, 2.0), (0.28, 0.33, 0.4, 0.5, 0.62)
NEWTONS = (10.0, 20.0, 15.0)
LAWS = ("coulomb+place", "coulomb+speed", "coulomb+place+speed")
OF_GIVEN: dict[str, dict[str, object]] = {**GIVEN, "experiment": {"normal_force_n_u": 1e-4}}
DASHPOT = "contact_damping_n_s_per_m"


def rig() -> Scene:
    """What the scene declares."""
    return scene(
        rig={
            "stiffness_n_per_m": STIFFNESS,
            "stiffness_n_per_m_u": 1e-4 * STIFFNESS,
            "natural_frequency_hz_u": FREQUENCY * NATURAL_HZ,
        },
        sensors={"gain_error": 1e-4, "linearity": 0.0},
        experiment={"normal_force_n_u": 1e-4},
    )


Drawn = tuple[list[tuple[Recording, float]], str, dict[str, float]]
"""Recordings of the tests of a campaign and their normal forces, N; its law; the material's values in N, m, s."""


def drawn(seed: int) -> Drawn:
    """The tests of one campaign on a frame."""
    generator = np.random.default_rng([20261123, seed])
    count, law = int(generator.integers(4, 13)), LAWS[seed % len(LAWS)]
    scatter, lag = MOST_SCATTER * generator.random(), LAG_S * generator.standard_normal()
    tuned = 1.0 + FREQUENCY * generator.standard_normal()
    coefficient, dashpot = generator.uniform(0.2, 0.5), generator.uniform(1.5, 4.0)
    tests: list[tuple[Recording, float]] = []
    while len(tests) < count:
        force, r = FORCES[len(tests) % len(FORCES)], float(generator.choice(RATIOS))
        own = np.exp(scatter * generator.standard_normal(2))
        beta = float(own[0]) * coefficient * force / (STIFFNESS * BASE_M)
        parameters: dict[str, float] = {}
        if "place" in law:
            parameters["gradient"] = GRADIENT * generator.standard_normal()
        if "speed" in law:  # force c v over k Y: 2 zeta_c r = c omega / k
            turn = 2.0 * np.pi * NATURAL_HZ * tuned
            parameters["contact_damping_ratio"] = 0.5 * float(own[1]) * dashpot * turn / STIFFNESS
        problem = Problem(r, beta, law=law, parameters=parameters)
        tests.append((recorded(problem, generator, seconds=40.0, lag_s=lag, tuned=tuned), force))
    return tests, law, {COEFFICIENT: coefficient, **({DASHPOT: dashpot} if "speed" in law else {})}


def turned(seed: int) -> Drawn:
    """The tests of one campaign on a tribometer."""
    generator, law = np.random.default_rng([20261127, seed]), ("coulomb", "coulomb+speed")[seed % 2]
    scatter, dashpot = MOST_SCATTER * generator.random(), generator.uniform(5.0, 20.0) * (seed % 2)
    values, tests = np.array([generator.uniform(0.15, 0.5), dashpot]), list[tuple[Recording, float]]()
    for n in range(int(generator.integers(4, 13))):
        force, own = NEWTONS[n % len(NEWTONS)], np.exp(scatter * generator.standard_normal(2))
        setting = force, float(generator.uniform(2e-3, 6e-3)), float(generator.uniform(0.5, 1.6))
        tests.append((stroked("steel", setting, generator, true=(values * own).tolist()), force))
    return tests, law, dict([*zip((COEFFICIENT, DASHPOT), values.tolist(), strict=True)][: 1 + seed % 2])


def result_of(found: Campaign, made: str, values: dict[str, float]) -> dict[str, Any]:
    """What one campaign found: its law, errors of its values over their uncertainties, and which bands held."""
    law = found.material_laws[0]
    errors = dict(zip(law.values, np.sqrt(np.diag(law.covariance)).tolist(), strict=True))
    return {
        "made": made,
        "law": law.law,
        "scores": {n: (law.values[n] - v) / errors[n] for n, v in values.items() if errors.get(n, 0.0) > 0.0},
        "relative u": errors[COEFFICIENT] / law.values[COEFFICIENT] if COEFFICIENT in law.values else None,
        "held": [row["band_holds"] for row in found.left_out if row["band_holds"] is not None],
    }


def report(rows: list[dict[str, Any]], first: int) -> list[str]:
    """The table."""
    held = [x for row in rows for x in row["held"]]
    known = [row["relative u"] for row in rows if row["relative u"] is not None]
    laws = [(row["made"], row["law"]) for row in rows]
    richer = sum(set(law.split("+")) < set(found.split("+")) for law, found in laws)
    scores = {n: [row["scores"][n] for row in rows if n in row["scores"]] for n in (COEFFICIENT, DASHPOT)}
    return [
        f"{len(rows)} campaigns from seed {first} on, of 4 to 12 tests",
        f"{'error over u':32s}{study.COVERAGE}",
        *(f"{n:26s} ({len(of):3d}){study.coverage(of)}" for n, of in scores.items() if of),
        f"relative u of the coefficient: median {np.median(known):.2%}",
        f"Amontons' law, which holds, is denied (p < 0.05) in {len(rows) - len(known)}",
        f"bands (95 %) of tests left out hold {np.mean(held):.0%} of {len(held)}",
        f"law: right in {sum(a == b for a, b in laws)}, richer in {richer} of {len(laws)}",
        *(f"  made with {law}: found {', '.join(f for m, f in laws if m == law)}" for law in sorted(dict(laws))),
        f"CPU seconds of an evaluation with --law auto: median {np.median([row['seconds'] for row in rows]):.0f}",
    ]


def main() -> None:
    """Run the campaigns and write the table."""
    campaigns, first = (int(sys.argv[i]) if len(sys.argv) > i else d for i, d in ((1, 40), (2, 0)))
    given, rows = sys.argv[3:] == ["tribometer"], list[dict[str, Any]]()
    known, make, see = (scene_from_tables(OF_GIVEN), turned, observe_force) if given else (rig(), drawn, observe)
    for seed in range(first, first + campaigns):
        trials, observations = list[Trial](), dict[str, Tested]()
        try:
            tests, law, values = make(seed)
            known = known.changed(model={"law": law}) if given else known  # of a force the law is not looked for
            for source, (seen, force) in ((f"test_{n}", test) for n, test in enumerate(tests)):
                measured = replace(measure(seen, known), source=source, material="steel", normal_force_n=force)
                trials.append(trial_of({**measured.row(), "warnings": []}))
                observations[source] = see(measured, known)
        except FrictionlabError as error:
            sys.stdout.write(f"seed {seed}: not drawn: {error}\n")
            continue
        begin = time.process_time()
        found = evaluate(trials, known, observations=observations, find_law=not given)
        rows.append({**result_of(found, law, values), "seconds": time.process_time() - begin})
        sys.stdout.write(f"seed {seed}: {len(trials)} tests: {rows[-1]}\n")
        sys.stdout.flush()
    study.write(f"campaign_coverage_{first}", report(rows, first))


if __name__ == "__main__":
    main()
