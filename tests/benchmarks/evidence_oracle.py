"""Is Laplace's evidence that of nested sampling, and are the widths alike?

Run: ``python -m tests.benchmarks.evidence_oracle``; dynesty comes with the extra "test"; the result goes to
results/evidence_oracle.txt. The likelihood, the priors and the nuisances are those of the ladder's rungs, on the
frame's two real recordings.
"""

import sys
import time
from pathlib import Path

import numpy as np
from dynesty import NestedSampler

from frictionlab.analysis.measure import measure
from frictionlab.identification.family import family_of
from frictionlab.identification.ladder import Rung, climb
from frictionlab.logs import read_log
from frictionlab.scene import read_scene
from tests.identification.oracle import likelihood, prior_transform

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
RESULT = Path(__file__).parent / "results" / "evidence_oracle.txt"
LAWS = ("coulomb", "coulomb+speed", "coulomb+place+speed")
LIVE = 250


def line_of(log: str, rung: Rung) -> str:
    """One rung: both evidences, and the deviation of each of the law's parameters by both."""
    fit = rung.identified.fit
    names = [c.name for c in fit.coordinates]
    begin = time.process_time()
    sampler = NestedSampler(
        likelihood(fit), prior_transform(fit), len(names), nlive=LIVE, sample="rwalk", rstate=np.random.default_rng(1)
    )
    sampler.run_nested(dlogz=0.1, print_progress=False)
    found, seconds = sampler.results, time.process_time() - begin
    samples = found.samples_equal(rstate=np.random.default_rng(2))
    ours = np.sqrt(np.diag(np.linalg.inv(fit.precision)))
    told = [f"{name} {ours[i]:.3f} {samples[:, i].std():.3f}" for i, name in enumerate(names) if fit.coordinates[i].law]
    gap = rung.log_evidence - found.logz[-1]
    evidence = f"{rung.log_evidence:9.2f}{found.logz[-1]:9.2f}{found.logzerr[-1]:6.2f}{gap:+7.2f}"
    return f"{log:15s}{rung.law.name:21s}{evidence}{rung.seconds:8.2f}{seconds:8.1f}  {', '.join(told)}"


def main() -> None:
    """Write the table."""
    heads = f"{'ln Z':>9s}{'nested':>9s}{'+-':>6s}{'gap':>7s}{'s':>8s}{'s':>8s}"
    lines = [f"{'':15s}{'':21s}{heads}  deviation by Laplace and by the samples, in the prior's"]
    scene = read_scene(ROOT / "configs" / "frame.toml")
    for log in ("frame_250g.csv", "frame_450g.csv"):
        measurement = measure(read_log(DATA / log), scene)
        ladder = climb(measurement, family_of(measurement, scene).under_plain_coulomb(), measurement.sources)
        for rung in ladder.rungs:
            if rung.law.name in LAWS:
                lines.append(line_of(log, rung))
                sys.stdout.write(lines[-1] + "\n")
                sys.stdout.flush()
    RESULT.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
