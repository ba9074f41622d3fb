"""Is Laplace's evidence that of nested sampling, and are friction ratio and error alike?

Run: ``python -m tests.benchmarks.evidence_oracle`` (some four minutes of one core); dynesty comes with the extra
"test"; the result goes to results/evidence_oracle.txt. Likelihood, priors and nuisances are those of the ladder's
rungs, of three recordings of 60 s whose law is known. Nested sampling searches the whole prior; points drawn about the
best values (importance sampling) know only that valley, but tell its integral to a few hundredths where they are worth
many. Columns: number of unknowns; ln Z by Laplace, by nested sampling with its own error, Laplace's minus that, by
points drawn, and how many even points these are worth; friction ratio and its deviation by each way; CPU seconds of
nested sampling.
"""

import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from dynesty import NestedSampler

from frictionlab.analysis.measure import measure
from frictionlab.identification.family import family_of
from frictionlab.identification.fit import fit
from frictionlab.identification.ladder import Rung, climb
from frictionlab.simulator import Problem
from tests.identification.contacts import recorded, scene
from tests.identification.oracle import likelihood, prior_transform, weighed

RESULT = Path(__file__).parent / "results" / "evidence_oracle.txt"
LIVE, SLICES, MOST_CALLS, DLOGZ = 100, 10, 200_000, 0.1
DRAWS = 4000


@dataclass(frozen=True)
class Case:
    """A recording, what its scene says beside the usual, and two rungs of its ladder."""

    words: str
    truth: Problem
    scene: Mapping[str, Mapping[str, object]]
    laws: tuple[str, str]
    lag_s: float = 0.0


CASES = (
    Case(
        "r 0.7, all declared",
        Problem(0.7, 0.35),
        {"sensors": {"lag_s_u": 2e-4}},
        ("coulomb", "coulomb+speed"),
    ),
    Case(
        "r 0.4, a lag of 4 ms undeclared",
        Problem(0.4, 0.35, law="coulomb+speed", parameters={"contact_damping_ratio": 0.03}),
        {},
        ("coulomb+speed", "coulomb+place+speed"),
        lag_s=0.004,
    ),
    Case(
        "r 0.4, frame damping undeclared",
        Problem(0.4, 0.35, law="coulomb+place", parameters={"gradient": 0.05}),
        {"rig": {"damping_ratio": None}, "sensors": {"lag_s_u": 2e-4}},
        ("coulomb+place", "coulomb+place+speed"),
    ),
)


def line_of(case: Case, rung: Rung) -> str:
    """One rung: evidence by three ways, and the friction ratio with its deviation by each."""
    given = rung.identified.fit
    found = fit(given.forward, given.observed, [given.point], excess=1.0)
    i = [c.name for c in found.coordinates].index("beta")
    beta = found.coordinates[i]
    begin = time.process_time()
    sampler = NestedSampler(
        likelihood(found),
        prior_transform(found),
        len(found.point),
        nlive=LIVE,
        bound="multi",
        sample="rslice",
        slices=SLICES,
        rstate=np.random.default_rng(1),
    )
    sampler.run_nested(dlogz=DLOGZ, maxcall=MOST_CALLS, print_progress=False)
    nested, seconds = sampler.results, time.process_time() - begin
    even = np.array([beta.value(c) for c in nested.samples_equal(rstate=np.random.default_rng(2))[:, i]])
    drawn = weighed(found, DRAWS, np.random.default_rng(3))
    values = np.array([beta.value(c) for c in drawn.points[:, i]])
    mean = float(drawn.weights @ values)
    spread = float(np.sqrt(drawn.weights @ (values - mean) ** 2))
    ours = beta.slope(float(found.point[i])) * float(np.sqrt(np.linalg.inv(found.precision)[i, i]))
    evidence = (
        f"{rung.log_evidence:9.2f}{nested.logz[-1]:9.2f}{nested.logzerr[-1]:6.2f}"
        f"{rung.log_evidence - nested.logz[-1]:+7.2f}{drawn.log_evidence:9.2f}{drawn.worth:7.0f}"
    )
    told = [(beta.value(float(found.point[i])), ours), (float(even.mean()), float(even.std())), (mean, spread)]
    ratios = "".join(f"  {value:.5f} {error:.5f}" for value, error in told)
    return f"{case.words:33s}{rung.law.name:21s}{len(found.point):2d}{evidence}{ratios}{seconds:7.1f}"


def main() -> None:
    """Write the table."""
    heads = f"{'ln Z':>9s}{'nested':>9s}{'+-':>6s}{'gap':>7s}{'draws':>9s}{'worth':>7s}"
    ratios = "".join(f"  {words:15s}" for words in ("beta, Laplace", "nested", "draws"))
    lines = [f"{'':33s}{'law':21s}{'n':>2s}{heads}{ratios}{'s':>7s}"]
    for number, case in enumerate(CASES):
        known = scene(**case.scene)
        measurement = measure(recorded(case.truth, np.random.default_rng(11 + number), lag_s=case.lag_s), known)
        ladder = climb(measurement, family_of(measurement, known).under_plain_coulomb(), measurement.sources)
        for rung in ladder.rungs:
            if rung.law.name in case.laws:
                lines.append(line_of(case, rung))
                sys.stdout.write(lines[-1] + "\n")
                sys.stdout.flush()
    RESULT.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
