"""Materials tested on one rig share its gain, lag and natural frequency: one fit to all of their tests."""

from collections.abc import Iterable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

from frictionlab.analysis.measure import measure
from frictionlab.campaign import Cycle, Material, Model, cycle_of
from frictionlab.campaign.across import of_energies, of_frictions
from frictionlab.campaign.joined import Joined, join
from frictionlab.campaign.joint import Joint
from frictionlab.campaign.rig import Rig, found_of, on_one_rig
from frictionlab.campaign.scores import Stated
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.laws import law_of
from tests.identification.contacts import recorded, scene

FloatArray = NDArray[np.float64]
GAIN, LAG_S, FREQUENCY = 0.004, 4e-4, 0.001
LAWS = {"plain": ("coulomb", {}), "greased": ("coulomb+speed", {"contact_damping_ratio": 0.05})}


def declared() -> Scene:
    return scene(
        rig={"natural_frequency_hz_u": FREQUENCY * 3.13},
        sensors={"gain_error": GAIN, "lag_s_u": LAG_S, "linearity": 0.0},
    )


def made(name: str, ratios: Iterable[float], known: Scene) -> list[Cycle]:
    """Tests on a rig whose gain, lag and natural frequency are off by one uncertainty each."""
    (law, parameters), generator, found = LAWS[name], np.random.default_rng(len(name)), []
    for r in ratios:
        problem = Problem(r, 0.36, law=law, parameters=parameters)
        seen = recorded(problem, generator, seconds=25.0, lag_s=LAG_S, gain=1.0 + GAIN, tuned=1.0 + FREQUENCY)
        found.append(cycle_of(f"{name}{r}", (name, 1.0), measure(seen, known), known))
    return found


def together() -> tuple[dict[str, Joined], dict[str, Joint], Rig]:
    """Each material for itself, and on the rig of both."""
    known = declared()
    ratios = {"plain": (0.4, 0.7, 1.5), "greased": (0.3, 0.6, 1.3)}
    alone = {
        name: join(made(name, ratios[name], known), law_of(law), {}, {(name, 1.0): 0.36})
        for name, (law, _) in LAWS.items()
    }
    joint, rig = on_one_rig({n: j.held for n, j in alone.items()}, {n: j.moved for n, j in alone.items()})
    assert rig is not None
    return alone, joint, rig


def dense(joints: dict[str, Joint], rig: Rig) -> tuple[FloatArray, FloatArray]:
    """The slow twin: all unknowns of all tests in one least-squares problem; its best point and covariance."""
    size = 1 + max(int(at.max()) for at in rig.columns.values())
    tests = [(n, j, i) for n, j in joints.items() for i in range(len(j.fits))]

    def residuals(unknown: FloatArray) -> FloatArray:
        parts = [unknown]
        for k, (name, joint, i) in enumerate(tests):
            place, found = joint.places[i], joint.fits[i]
            own = place.scale @ unknown[rig.columns[name]] + place.offset
            own[place.friction or 0] += joint.solution.scatter * unknown[size + k]
            gap = joint.cycles[i].residual(found.forward, own)
            assert gap is not None
            parts.append(gap / np.sqrt(found.excess))
        return np.concatenate(parts)

    start = np.zeros(size + len(tests))
    for name, joint in joints.items():
        start[rig.columns[name]] = joint.solution.point
    low = np.full(len(start), -np.inf)
    for name, joint in joints.items():
        low[rig.columns[name]] = [c.low - 1e-9 for c in joint.shared.coordinates]
    found = least_squares(residuals, start + 0.02, bounds=(low, np.inf), x_scale="jac", xtol=1e-12, ftol=1e-14)
    slopes = np.asarray(found.jac, dtype=np.float64)
    covariance: FloatArray = np.asarray(np.linalg.inv(slopes.T @ slopes))
    return found.x[:size], covariance[:size, :size]


def test_block_elimination_is_the_fit_to_all_tests_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = property(lambda self: tuple(Stated(f.jacobian.T @ f.jacobian / f.excess) for f in self.fits))
    monkeypatch.setattr(Joint, "meat", plain)  # errors by noise alone, as the twin's
    _, joint, rig = together()
    point, covariance = dense(joint, rig)
    error = np.sqrt(np.diag(covariance))
    for name, columns in rig.columns.items():
        assert joint[name].solution.point == pytest.approx(point[columns], abs=0.02 * error.min())
    assert rig.spread.total == pytest.approx(covariance, abs=2e-3 * error.max() ** 2)
    assert np.sqrt(np.diag(rig.spread.total)) == pytest.approx(error, rel=2e-3)


def test_a_rig_that_two_materials_share_is_better_known_than_by_either() -> None:
    alone, joint, rig = together()
    lags = {j.solution.point[j.shared.names.index("lag")] for j in joint.values()}
    assert max(lags) - min(lags) < 0.01
    for name, found in joint.items():
        k = found.shared.names.index("lag")
        assert np.sqrt(rig.of(name).total[k, k]) < np.sqrt(alone[name].moved.spread.total[k, k])
    (said,) = found_of(joint["plain"])
    assert "the natural frequency (rig.natural_frequency_hz) +0.098 % ± " in said
    assert "the lag between the channels (sensors.lag_s) +0.4 ms ± " in said
    assert "known to 0.4 ms" in said
    shared = rig.spread.total[rig.columns["plain"][0], rig.columns["greased"][0]]
    assert abs(shared) > 1e-3 * rig.spread.total[0, 0]  # what the rig does to both is in their covariance


def test_one_material_has_its_rig_for_itself() -> None:
    known = declared()
    found = join(made("plain", (0.4, 0.7), known), law_of("coulomb"), {}, {("plain", 1.0): 0.36})
    joint, rig = on_one_rig({"plain": found.held}, {"plain": found.moved})
    assert rig is None
    assert joint["plain"] is found.moved


@pytest.mark.parametrize(("lag", "is_held"), [(5e-6, True), (4e-4, False)])
def test_a_lag_of_microseconds_is_corrected_only_where_it_matters(lag: float, *, is_held: bool) -> None:
    """Six tests know the lag to 3 us; the value moves by less than its error, which holds it."""
    generator, known, cycles = np.random.default_rng(4), declared(), []
    for r in (0.35, 0.5, 0.65, 0.8, 1.3, 1.7):
        seen = recorded(Problem(r, 0.36), generator, seconds=25.0, lag_s=lag)
        cycles.append(cycle_of(f"{r}", ("plain", 1.0), measure(seen, known), known))
    found = join(cycles, law_of("coulomb"), {}, {("plain", 1.0): 0.36})
    assert found.held.cost(found.moved) - found.moved.cost(found.moved) > 14.0  # far more than chance
    assert found.is_held == is_held
    told = found.friction(0)
    assert told.value is not None
    assert told.u is not None
    assert told.value == pytest.approx(0.36, abs=2.0 * told.u)


def test_a_rig_that_is_off_falls_out_of_the_difference_of_two_materials() -> None:
    """Errors of coefficients and energies are vectors: their dot products are the covariances of the joint fit."""
    alone, joint, rig = together()
    found = {n: Material(n, Joined(alone[n].held, joint[n], rig), (), Model(), {}) for n in LAWS}
    ratio = of_frictions(found)
    one, two = (ratio[name, 1.0] for name in LAWS)
    width = joint["plain"].shared.coordinates[0].width
    for name, vector in (("plain", one), ("greased", two)):
        assert vector @ vector == pytest.approx(width**2 * found[name].joined.covariance[0, 0], rel=1e-9)
    assert (one - two) @ (one - two) < one @ one + two @ two
    energy = of_energies(found)
    for name, fitted in joint.items():
        at = [fitted.shared.names.index(n) for n in ("gain", "lag")]
        off = fitted.solution.point[at]
        moment = rig.of(name).total[np.ix_(at, at)] + np.outer(off, off)  # about the sensors as they are known
        for cycle in fitted.cycles:
            slopes = np.array([_energy_by(cycle, "gain"), _energy_by(cycle, "lag")])
            assert np.linalg.norm(energy[cycle.source]) == pytest.approx(np.sqrt(slopes @ moment @ slopes), rel=0.03)


def _energy_by(cycle: Cycle, name: str) -> float:
    """Change of the area of a cycle's loop over a cosine base if a sensor is off by one uncertainty."""
    c = next(c for c in cycle.nuisances if c.name == name)
    first = complex(cycle.observed.cosine_sine[0], -cycle.observed.cosine_sine[cycle.observed.harmonics])
    seen = first * (1.0 + c.width) if name == "gain" else first * np.exp(1j * 1e-6 * c.width)
    return float(-np.pi * (seen - first).imag) / (1.0 if name == "gain" else 1e-6)
