"""Random frames of two and three masses with one to three contacts, and OpenSees beside a frame of two storeys.

    python -m tests.benchmarks.several_masses 500 100
    PYTHONPATH=FOLDER_WITH_OPENSEESPY python -m tests.benchmarks.several_masses 0    # OpenSees alone

Of so many problems: outcomes, energy balance, time. Of the first so many without Iwan's many sliders: the twin is
started on the orbit; told is by how much it misses the orbit's end and energies after a cycle.

OpenSees has no rigid Coulomb contact: its nearest is an elastic, perfectly plastic spring of zero length (ElasticPP,
the model of its sliding bearings too), as stiff as one likes. Both programs are given the same base, piecewise linear
in its acceleration, and held against scipy's Radau at 1e-12, led from event to event by the twin.
"""

import statistics
import sys
import time
from collections import Counter

import numpy as np
from scipy.interpolate import CubicSpline

from frictionlab.errors import FrictionlabError
from frictionlab.simulator import Base, Contact, SteadyState, Structure, steady_state
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.motion import Motion
from frictionlab.simulator.record import BaseRecord, respond
from tests.simulator.twin import TURN, Twin, rubs

LAWS = (
    *("coulomb", "coulomb", "coulomb+place", "coulomb+speed", "coulomb+breakaway"),
    *("coulomb+compliance", "coulomb+compliance+breakaway", "coulomb+iwan", "coulomb+place+speed"),
)

RUBBING: tuple[tuple[int, int | str, float], ...] = ((1, "base", 0.3), (2, 1, 0.15))


def draw(seed: int) -> Structure:
    """A random frame; its base has one harmonic or two."""
    g = np.random.default_rng(seed)
    n, contacts = int(g.integers(2, 4)), []
    for _ in range(g.integers(1, 4)):
        law, mass = law_of(str(g.choice(LAWS))), int(g.integers(1, n + 1))
        against: int | str = str(g.choice(["wall", "base", "mass"]))
        if against == "mass":
            against = int(g.choice([other for other in range(1, n + 1) if other != mass]))
        ranges = {
            "beta": (0.02, 0.6),
            "gradient": (-0.2, 0.2),
            "contact_damping_ratio": (0.0, 0.1),
            "static_ratio_up": (1.0, 1.6),
            "static_ratio_down": (1.0, 1.6),
            "stiffness_ratio": (2.0, 60.0),
            "chi": (-0.5, 0.0),
        }
        values = {p.name: float(g.uniform(*ranges[p.name])) for p in law.own if p.name in ranges}
        values |= {"sliders": float(g.integers(2, 6))} if law.has("iwan") else {}
        contacts.append(Contact(mass, against, law, law.complete(values)))
    second = [float(x) for x in g.uniform(-0.2, 0.2, 2)] if g.integers(2) else [0.0, 0.0]
    base = Base((1.0, second[0]), (0.0, second[1]))
    masses, stiffness, damping = g.uniform(0.5, 2.0, n), g.uniform(0.5, 2.0, n), g.uniform(0.002, 0.05, n)
    return Structure.of_storeys(float(g.uniform(0.1, 2.0)), masses, stiffness, damping, contacts, base)


def anchors_at_begin(structure: Structure, motion: Motion, twin: Twin, start: np.ndarray) -> np.ndarray:
    """Where the springs of elastic contacts are relaxed at tau = 0; none of them has several sliders."""
    n, contacts = structure.masses, len(structure.contacts)
    places, index = twin.places(0.0, start)[0], motion.place([0.0], None)[1]
    sides, _, offsets = np.split(motion.rows[index[0], 2:], (contacts, 2 * n + 2 * contacts))
    slips = [places[i] - sides[i] * twin.kinetic(i, places[i]) / spring for i, _, spring in twin.elements]
    return np.array([slips[i] if sides[i] else -offsets[i] / spring for i, _, spring in twin.elements])


def missed_by_twin(state: SteadyState) -> tuple[float, float]:
    """By how much the twin, started on an orbit of one cycle, misses its end, and its energies."""
    if state.structure is None or state.orbit is None:
        raise ValueError("no motion")
    twin, start = Twin(state.structure), np.concatenate([values[0] for values in state.orbit.all_at([0.0])[:2]])
    end = twin.run([0.0, TURN], start, anchors_at_begin(state.structure, state.orbit, twin, start))
    energies = np.array([state.energy_per_cycle, state.contact_energy_per_cycle], dtype=np.float64)
    missed = np.array([twin.loop, twin.friction + twin.viscous]) - energies
    return float(np.abs(end - start).max()), float(np.abs(missed).max())


def two_storeys() -> Structure:
    """Two storeys, both rubbing on what they stand on."""
    contacts = [rubs("coulomb", mass, against, beta=beta) for mass, against, beta in RUBBING]
    return Structure.of_storeys(1.0, [1.0, 0.8], [1.0, 0.9], [0.01, 0.01], contacts)


def by_opensees(frame: Structure, spline: CubicSpline, step: float, stiffness: float) -> tuple[np.ndarray, float]:
    """Displacements (k, 2) from the base at whole radians, and seconds, by Newmark's average acceleration."""
    import openseespy.opensees as ops  # noqa: PLC0415 - no dependency of this package

    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    for number, mass in enumerate((0.0, *np.diag(frame.mass)), 0):
        ops.node(number, 0.0, "-mass", float(mass))
    ops.fix(0, 1)
    springs, dashpots = (-np.diag(matrix, 1)[0] for matrix in (frame.stiffness, frame.damping))
    storeys = ((frame.stiffness[0, 0] - springs, frame.damping[0, 0] - dashpots), (springs, dashpots))
    for number, (k, c) in enumerate(storeys, 1):
        ops.uniaxialMaterial("Elastic", number, float(k), float(c))
        ops.uniaxialMaterial("ElasticPP", 10 + number, stiffness, frame.contacts[number - 1].beta / stiffness)
        for tag in (number, 10 + number):
            ops.element("zeroLength", tag, number - 1, number, "-mat", tag, "-dir", 1, "-doRayleigh", 0)
    knots = spline.x
    bends = [float(value) for value in spline(knots, 2)]
    ops.timeSeries("Path", 1, "-time", *map(float, knots), "-values", *bends)
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1, "-vel0", float(spline(0.0, 1)))
    for words in (["constraints", "Plain"], ["numberer", "Plain"], ["system", "BandGeneral"], ["algorithm", "Newton"]):
        getattr(ops, words[0])(*words[1:])
    ops.test("NormDispIncr", 1e-12, 100)
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    found, begin = [], time.perf_counter()
    for _ in range(round(knots[-1])):
        if ops.analyze(round(1.0 / step), step):
            return np.full((1, 2), np.nan), time.perf_counter() - begin
        found.append([ops.nodeDisp(1, 1), ops.nodeDisp(2, 1)])
    return np.array(found), time.perf_counter() - begin


def beside_opensees(length: int = 60, knot: float = 0.05) -> None:
    """Print time and error of this package and of OpenSees."""
    tau = np.linspace(0.0, length, round(length / knot) + 1)
    waves = [(0.9, 0.55, 0.3), (0.7, 1.1, 1.2), (0.4, 1.9, 0.4)]
    y = sum(a * (np.sin(w * tau + p) - np.sin(p) - w * tau * np.cos(p) * np.exp(-tau)) for a, w, p in waves)
    base = BaseRecord(tau, y)
    spline, samples = CubicSpline(tau, base.values), np.arange(round(1.0 / knot), len(tau), round(1.0 / knot))
    try:
        import openseespy.opensees  # noqa: F401, PLC0415 - as above
    except (ImportError, RuntimeError) as error:
        print(f"OpenSees: not here ({error}); do: pip install openseespy into a folder, and put it on PYTHONPATH")
        return
    print("\n| by | step / rad | contact stiffness / k1 | time / ms | largest error / Y |\n|---|---|---|---|---|")
    frame = two_storeys()
    twin, radians, ours = Twin(frame, spline, "Radau"), np.arange(length + 1.0), []
    twin.run(radians.tolist())
    truth = (np.array(twin.states)[:, :2] - spline(radians)[:, None])[1:]
    for _ in range(4):
        begin = time.perf_counter()
        response = respond(frame, base)
        ours.append(time.perf_counter() - begin)
    seen = response.displacements[samples] - base.values[samples, None]
    print(f"| this package | none | rigid | {1e3 * min(ours):.1f} | {np.abs(seen - truth).max():.1e} |")
    for stiffness in (1e2, 1e4, 1e6):
        for parts in (1, 4, 16, 64):
            found, seconds = by_opensees(frame, spline, knot / parts, stiffness)
            miss = f"{np.abs(found - truth).max():.1e}" if len(found) == len(truth) else "does not converge"
            print(f"| OpenSees | {knot / parts:g} | {stiffness:g} | {1e3 * seconds:.1f} | {miss} |")


def main(count: int, twins: int) -> None:
    """Solve, compare and print."""
    outcomes: Counter[str] = Counter()
    times: list[float] = []
    closures: list[float] = []
    misses: list[tuple[int, float, float]] = []
    for seed in range(count):
        begin = time.perf_counter()
        try:
            frame = draw(seed)
            state = steady_state(frame)
        except FrictionlabError as error:
            outcomes[str(error)[:70]] += 1
            continue
        times.append(time.perf_counter() - begin)
        outcomes[state.outcome] += 1
        closures.append(state.closure_error or 0.0)
        plain = not any(contact.law.has("iwan") for contact in frame.contacts)
        if plain and state.outcome == "periodic" and state.period_cycles == 1 and len(misses) < twins:
            misses.append((seed, *missed_by_twin(state)))
    for outcome, number in outcomes.most_common():
        print(f"{number:5d}  {outcome}")
    print(f"energy balance: largest {max(closures):.1e} k Y^2")
    print(f"time: median {1e3 * statistics.median(times):.0f} ms, longest {max(times):.1f} s")
    if misses:
        for k, what in ((1, "state after a cycle"), (2, "energies")):
            values = [miss[k] for miss in misses]
            print(f"twin of {len(misses)}, {what}: median {statistics.median(values):.1e}, largest {max(values):.1e}")
        print("largest three by energy:", sorted(misses, key=lambda miss: -miss[2])[:3])


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:]] or [500, 100]
    if numbers[0]:
        main(numbers[0], numbers[1] if len(numbers) > 1 else 100)
    beside_opensees()
