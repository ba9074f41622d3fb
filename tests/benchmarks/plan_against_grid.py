"""By how much does a planned set of tests beat an even grid of the same number: in error, and in the choice of law?

Run: ``python -m tests.benchmarks.plan_against_grid [REPEATS]``; the result goes to results/plan_against_grid.txt. Each
repeat is a laboratory of its own: its friction, rig, lag and noise, friction that scatters from cycle to cycle and from
test to test. The tests of a laboratory are fitted together, as `frictionlab campaign` does.
"""

import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement
from frictionlab.campaign import cycle_of
from frictionlab.campaign.joined import Joined, join
from frictionlab.errors import FrictionlabError
from frictionlab.identification.family import family_of
from frictionlab.identification.fit import fit, log_evidence
from frictionlab.identification.identify import forward_of
from frictionlab.identification.observed import observe_cycle
from frictionlab.identification.valleys import starts_of
from frictionlab.planning import plan_tests
from frictionlab.planning.candidates import Candidate, candidates
from frictionlab.planning.candidates import laboratory as lab_of
from frictionlab.planning.information import of_contact, told_by
from frictionlab.planning.outlook import Outlook, outlook_of
from frictionlab.planning.weights import as_weighed
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.engine import compiled
from frictionlab.simulator.laws import law_of
from frictionlab.uncertainty import sources_of
from tests.benchmarks.laboratory import COEFFICIENT, STIFFNESS, laboratory
from tests.identification.contacts import BASE_M, NATURAL_HZ, recorded

RESULT = Path(__file__).parent / "results" / "plan_against_grid.txt"
REPEATABILITY = 0.001  # of friction from test to test
RATIOS = [round(0.15 + 0.05 * i, 2) for i in range(14)] + [round(1.2 + 0.1 * i, 2) for i in range(9)]
FORCES = [0.5, 0.75, 1.0, 1.25, 1.5, 1.75]
GRIDS = {4: (2, 2), 9: (3, 3)}
RANDOM = 300  # sets drawn to see what chance promises
VALUES = {"gradient": 0.03, "contact_damping_ratio": 0.03}
LAWS = ("coulomb", "coulomb+speed", "coulomb+place+speed")
PAIR = ("coulomb+place", "coulomb+speed")
EFFECTS = ({"gradient": 3e-4, "contact_damping_ratio": 1e-4}, {"gradient": 1e-3, "contact_damping_ratio": 3e-4})
POOR = {"noise_m": 20e-6, "duration_s": 20.0, "cycle_scatter": 0.01}  # sensors and tests for the choice of law
HEADS = ("grid", "plan", "factor", "promised", "chance")
Point = tuple[float, float]


def rig(expected: Mapping[str, float], **plan: object) -> Scene:
    """A laboratory that may set all of these."""
    ranges = {"frequency_ratios": RATIOS, "normal_forces_n": FORCES, "repeatability": REPEATABILITY}
    return laboratory({**ranges, "expected": expected, **plan})


def grid(count: int) -> list[Point]:
    """An even grid of tests: the middles of as many cells of the ranges."""
    wide, high = GRIDS[count]
    return [(r, force) for r in _even(RATIOS, wide) for force in _even(FORCES, high)]


def _even(values: Sequence[float], count: int) -> list[float]:
    return [values[int((i + 0.5) * len(values) / count)] for i in range(count)]


def planned(what: Scene, law: str, count: int, against: str | None = None) -> list[Point]:
    """The tests of a plan."""
    tests = plan_tests(what, law=law, against=against, tests=count).tests
    return [(t.frequency_ratio, t.normal_force_n) for t in tests]


def truth(law: str, point: Point, coefficient: float, values: dict[str, float]) -> Problem:
    """The problem of one test."""
    beta = coefficient * point[1] / (STIFFNESS * BASE_M)
    own = {name: value for name, value in values.items() if name in {"gradient", "contact_damping_ratio"}}
    names = {"coulomb+place": ["gradient"], "coulomb+speed": ["contact_damping_ratio"], "coulomb": []}
    return Problem(point[0], beta, law=law, parameters={n: own[n] for n in names.get(law, list(own))})


def promised(what: Scene, law: str, points: list[Point]) -> dict[str, float]:
    """Joint standard error of each parameter after a set of tests, with what is not known of sensors and rig."""
    lab = lab_of(what, law)
    outlook = outlook_of(lab, [Candidate(r, force, BASE_M, what.plan.duration_s) for r, force in points])
    total = np.eye(len(outlook.coordinates)) + _information(outlook).sum(axis=0)
    rows = np.flatnonzero(outlook.law)
    spread = np.sqrt(np.diag(np.linalg.inv(total)))[rows]
    return {
        outlook.coordinates[i].name: float(s * outlook.coordinates[i].width) for i, s in zip(rows, spread, strict=True)
    }


def _information(outlook: Outlook) -> NDArray[np.float64]:
    return of_contact(outlook, as_weighed(outlook, told_by(outlook)).own)


def by_chance(what: Scene, law: str, count: int) -> NDArray[np.float64]:
    """Geometric mean of the promised errors of random sets."""
    generator, lab = np.random.default_rng(11), lab_of(what, law)
    outlook = outlook_of(lab, candidates(lab))
    information, rows = _information(outlook), np.flatnonzero(outlook.law)
    found = []
    for _ in range(RANDOM):
        total = np.eye(len(outlook.coordinates)) + information[generator.choice(len(information), count)].sum(axis=0)
        found.append(0.5 * np.linalg.slogdet(np.linalg.inv(total)[np.ix_(rows, rows)])[1] / len(rows))
    return np.asarray(np.exp(np.array(found)) * _middle([outlook.coordinates[i].width for i in rows]))


def _middle(values: Sequence[float]) -> float:
    return math.exp(float(np.mean(np.log(values))))


def achieved(what: Scene, law: str, points: list[Point], repeats: int) -> dict[str, float]:
    """Root mean square error of each parameter over laboratories, each of which fits its tests together."""
    misses = []
    for seed in range(repeats):
        generator = np.random.default_rng([23, seed])
        coefficient = COEFFICIENT * (1.0 + 0.02 * generator.standard_normal())
        off = _off(what, generator)
        misses.append(_misses(joined_of(what, law, points, coefficient, generator, off), coefficient))
    return {name: float(np.sqrt(np.mean([miss[name] ** 2 for miss in misses]))) for name in misses[0]}


def joined_of(
    what: Scene,
    law: str,
    points: list[Point],
    coefficient: float,
    generator: np.random.Generator,
    off: tuple[float, float],
) -> Joined:
    """The tests of one laboratory, as a campaign fits them together."""
    cycles = []
    for i, point in enumerate(points):
        own = coefficient * (1.0 + REPEATABILITY * generator.standard_normal())
        seen = _seen(what, truth(law, point, own, VALUES), generator, off)
        cycles.append(cycle_of(f"{i}", ("contact", point[1]), measure(seen, what), what, law=law))
    starts = {("contact", force): coefficient * force / (STIFFNESS * BASE_M) for _, force in points}
    return join(cycles, law_of(law), {}, starts)


def _misses(found: Joined, coefficient: float) -> dict[str, float]:
    """How far each parameter is from the truth; the coefficient by all forces, as they are known, relative."""
    own = {told.name: (told.value.value or 0.0) - VALUES[told.name] for told in found.parameters()}
    relative, weights = [], []
    for k, (_, force) in enumerate(found.best.shared.groups):
        ratio = found.friction(k)
        value, u = ratio.value or math.nan, ratio.u or math.nan
        relative.append(value * STIFFNESS * BASE_M / (coefficient * force) - 1.0)
        weights.append((value / u) ** 2)
    return {"beta": float(np.average(relative, weights=weights)), **own}


def _off(what: Scene, generator: np.random.Generator) -> tuple[float, float]:
    """How far this laboratory's natural frequency (a factor) and lag (s) are from what it declares of them."""
    detuned, late = generator.standard_normal(2) * (what.rig.natural_frequency_hz_u or 0.0, what.sensors.lag_s_u or 0.0)
    return 1.0 + detuned / NATURAL_HZ, late


def _seen(
    what: Scene, problem: Problem, generator: np.random.Generator, off: tuple[float, float] = (1.0, 0.0)
) -> Recording:
    plan = what.plan
    start, change = generator.uniform(0.0, 2.0 * math.pi, 2)
    return recorded(
        problem,
        generator,
        scatter=plan.cycle_scatter,
        seconds=plan.duration_s,
        noise=plan.noise_m,
        tuned=off[0],
        lag_s=off[1],
        start=start,
        change=change,
    )


def errors(repeats: int) -> list[str]:
    """Lines: promised and achieved errors of planned sets, over those of the grid."""
    lines = [
        f"Errors of the even grid over those of the plan; {repeats} laboratories; chance: share of random sets that",
        f"promise less error than the plan. Factors are known to {100.0 / math.sqrt(repeats):.0f} %.",
        f"{'law':20s}{'tests':>6s}  {'parameter':22s}" + "{:>9s}{:>9s}{:>8s}{:>9s}{:>7s}".format(*HEADS),
    ]
    for law in LAWS:
        for count in GRIDS:
            what = rig(VALUES)
            sets = {"grid": grid(count), "plan": planned(what, law, count)}
            hope = {name: promised(what, law, points) for name, points in sets.items()}
            real = {name: achieved(what, law, points, repeats) for name, points in sets.items()}
            better = float(np.mean(by_chance(what, law, count) < _middle(list(hope["plan"].values()))))
            for name in real["plan"]:
                factor = real["grid"].get(name, math.nan) / real["plan"][name]
                lines.append(
                    f"{law:20s}{count:6d}  {name:22s}{real['grid'].get(name, math.nan):9.2e}{real['plan'][name]:9.2e}"
                    f"{factor:8.2f}{hope['grid'][name] / hope['plan'][name]:9.2f}{better:7.1%}"
                )
                _tell(lines[-1])
    return lines


def evidence(measured: Measurement, what: Scene, law: str) -> float:
    """Log evidence of a law for one test, as a ladder counts it."""
    observed, sources = observe_cycle(measured), sources_of(what, what.plan.sampling_rate_hz)
    forward = forward_of(family_of(measured, what, law), measured, sources, observed)
    return max(log_evidence(fit(forward, observed, [s], excess=1.0)) for s in starts_of(measured, forward, observed))


def choices(what: Scene, values: dict[str, float], points: list[Point], repeats: int) -> tuple[int, int, int]:
    """How many laws were chosen rightly, of how many, and how many of them by more than 5."""
    right, sure = 0, 0
    for law in PAIR:
        for seed in range(repeats):
            generator, total = np.random.default_rng([29, seed]), 0.0
            coefficient = COEFFICIENT * (1.0 + 0.02 * generator.standard_normal())
            for point in points:
                own = coefficient * (1.0 + REPEATABILITY * generator.standard_normal())
                total += _told(what, law, truth(law, point, own, values), generator)
            right, sure = right + (total > 0.0), sure + (total > 5.0)
    return right, len(PAIR) * repeats, sure


def _told(what: Scene, law: str, problem: Problem, generator: np.random.Generator) -> float:
    """Log evidence for the law that holds over the other, of one test; none where it cannot be fitted."""
    seen = _seen(what, problem, generator)
    try:
        measured = measure(seen, what)
        one, other = (evidence(measured, what, name) for name in PAIR)
    except FrictionlabError:
        return 0.0
    return one - other if law == PAIR[0] else other - one


def laws(repeats: int) -> list[str]:
    """Lines: shares of laws chosen rightly, by planned tests and by the grid."""
    lines = [
        "",
        f"Right choice between {PAIR[0]} and {PAIR[1]} of equal chances, by summed evidence; decided: by more than 5",
        f"{'effects':44s}{'tests':>6s}{'grid right':>12s}{'decided':>9s}{'plan right':>12s}{'decided':>9s}",
    ]
    for values in EFFECTS:
        what = rig(values, **POOR)
        for count in (2, 4):
            sets = [grid(4)[::2] if count == 2 else grid(count), planned(what, PAIR[0], count, PAIR[1])]
            told = [choices(what, values, points, repeats) for points in sets]
            shares = "".join(f"{right / of:12.0%}{sure / of:9.0%}" for right, of, sure in told)
            said = ", ".join(f"{name} {value:g}" for name, value in values.items())
            lines.append(f"{said:44s}{count:6d}{shares}")
            _tell(lines[-1])
    return lines


def _tell(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main(repeats: int) -> None:
    """Write the table."""
    compiled()
    RESULT.write_text("\n".join([*errors(repeats), *laws(repeats)]) + "\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
