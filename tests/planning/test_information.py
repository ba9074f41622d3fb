"""What candidates tell in one call, against one after the other with whole matrices."""

import math

import numpy as np
import pytest

from frictionlab.identification.coordinates import nuisances, of_parameter, point_of
from frictionlab.identification.forward import Forward
from frictionlab.identification.observed import by_base, parts
from frictionlab.planning.candidates import Candidate, candidates, laboratory
from frictionlab.planning.information import Noise, noise_of, told_by
from frictionlab.planning.outlook import HARMONICS, outlook_of
from frictionlab.planning.weights import as_weighed, losses, seen_by_fit, weighed
from tests.identification.contacts import BASE_M, NATURAL_HZ
from tests.planning.rig import STIFFNESS, scene

TESTS = [Candidate(0.3, 1.0, BASE_M, 60.0), Candidate(0.7, 1.5, 0.8 * BASE_M, 40.0), Candidate(1.4, 0.5, BASE_M, 90.0)]
LAW = "coulomb+place+speed"


def test_slopes_are_those_of_a_fit() -> None:
    """The twin: the fit's own finite differences, one candidate after the other, scaled to the shared coordinates."""
    lab = laboratory(scene(), LAW)
    outlook = outlook_of(lab, TESTS)
    here = outlook.show(outlook.expected)
    slopes = outlook.slopes(outlook.expected, here)
    names = [c.name for c in outlook.coordinates]
    assert names[:3] == ["beta", "gradient", "contact_damping_ratio"]
    for i, test in enumerate(TESTS):
        family = lab.family(test.frequency_ratio)
        turn = 2.0 * math.pi * test.frequency_ratio * NATURAL_HZ
        own = tuple(of_parameter(lab.law.parameter(name)) for name in family.free)
        forward = Forward(family, (*own, *nuisances(family, lab.sources, turn=turn)), HARMONICS)
        values = {name: float(value[i]) for name, value in outlook.values(outlook.expected).items()}
        point = point_of(forward.coordinates, values)
        predicted = forward.predict(point)
        assert predicted is not None
        np.testing.assert_allclose(here.mean[i], predicted, atol=1e-11)
        slow = forward.jacobian(point, predicted)
        for c, column in zip(forward.coordinates, slow.T, strict=True):
            mine = outlook.coordinates[names.index(c.name)]
            ratio = mine.width / c.width * (1.0 if c.is_log else outlook.scales[i, names.index(c.name)])
            np.testing.assert_allclose(slopes[i, :, names.index(c.name)], ratio * column, rtol=2e-3, atol=2e-5)


def test_expected_values_scale_with_amplitude_and_friction_with_the_force() -> None:
    lab = laboratory(scene(expected={"gradient": 0.02}), "coulomb+place")
    outlook = outlook_of(lab, [Candidate(0.5, 1.0, 1e-3, 60.0), Candidate(0.5, 2.0, 4e-3, 60.0)])
    values = outlook.values(outlook.expected)
    np.testing.assert_allclose(values["gradient"], [0.01, 0.04])  # 0.02 at 2 mm: the same slope of friction in metres
    np.testing.assert_allclose(values["beta"], [0.6 / (STIFFNESS * 1e-3), 0.6 * 2.0 / (STIFFNESS * 4e-3)])


def test_candidates_in_proportion_share_a_state_and_tell_the_same_of_friction() -> None:
    lab = laboratory(scene(noise_m=0.0, step_m=1e-9))
    told = told_by(outlook_of(lab, [Candidate(0.5, 1.0, 1e-3, 60.0), Candidate(0.5, 2.0, 2e-3, 60.0)]))
    np.testing.assert_array_equal(told.here.mean[0], told.here.mean[1])
    assert told.own[0, 0, 0] == pytest.approx(told.own[1, 0, 0], rel=1e-3)


def test_noise_is_what_it_is_made_of() -> None:
    """The twin: covariances (2 K, 2 K) written out, base by the function that a fit uses, and inverted."""
    plan = {"cycle_scatter": 0.01, "repeatability": 0.02, "drift_per_hour": 0.5, "model_error": 0.001}
    lab = laboratory(scene(**plan))
    outlook = outlook_of(lab, TESTS)
    here = outlook.show(outlook.expected)
    slopes = outlook.slopes(outlook.expected, here)
    by_friction = slopes[:, :, 0] / outlook.coordinates[0].width
    noise = noise_of(outlook, here, by_friction)
    found = noise.within(slopes, slopes)
    for i, test in enumerate(TESTS):
        drive = test.frequency_ratio * NATURAL_HZ
        cycles = math.floor((test.duration_s - 2.0) * drive)
        one = (0.8e-6**2 + (1.02 * 0.05 / 65520) ** 2 / 12.0) / test.base_amplitude_m**2
        white = 2.0 * one * drive / 250.0 / cycles
        unexplained = 1e-6 * float((here.mean[i] ** 2).sum()) / len(here.mean[i])
        between = math.hypot(0.02, 0.25 * test.duration_s / 3600.0)
        b = by_friction[i]
        whole = (white + unexplained) * np.eye(len(b)) + by_base(here.mean[i], math.sqrt(white))
        whole += (1e-4 / cycles + between**2) * np.outer(b, b)
        cut = noise.columns[i, :, 3:-1]
        assert np.trace(cut @ cut.T) < 2e-4 / cycles**2 * float(b @ b)  # the first and the last cycle, in part
        whole += cut @ cut.T
        slow = slopes[i].T @ np.linalg.solve(whole, slopes[i])
        np.testing.assert_allclose(found[i], slow, rtol=1e-6, atol=1e-6 * np.abs(slow).max())
        np.testing.assert_allclose(told_by(outlook).information[i], slow, rtol=1e-5, atol=1e-6 * np.abs(slow).max())


def test_no_columns_of_noise_but_white_is_least_squares() -> None:
    slopes = np.random.default_rng(3).standard_normal((2, 6, 3))
    noise = Noise(np.array([[0.5], [2.0]]), np.zeros((2, 6, 1)))
    slow = np.stack([slopes[0].T @ slopes[0] / 0.5, slopes[1].T @ slopes[1] / 2.0])
    np.testing.assert_allclose(noise.within(slopes, slopes), slow)


def test_a_test_tells_nothing_if_the_mass_may_stand_or_no_cycle_is_left() -> None:
    lab = laboratory(scene(durations_s=[3.0, 60.0], frequency_ratios=[0.1], normal_forces_n=[0.5, 3.2]))
    tests = candidates(lab)
    tells = told_by(outlook_of(lab, tests)).tells
    told = [(t.normal_force_n, t.duration_s) for t, tell in zip(tests, tells, strict=True) if tell]
    assert told == [(0.5, 60.0)]


def test_parts_of_what_is_shown_pass_gain_and_lag() -> None:
    lab = laboratory(scene({"sensors": {"gain_error": 0.01}}))
    outlook = outlook_of(lab, TESTS)
    point = outlook.expected
    for name, value in (("gain", 0.02), ("lag", 0.3)):
        i = [c.name for c in outlook.coordinates].index(name)
        point[i] = value / outlook.coordinates[i].width
    plain, seen = outlook.show(outlook.expected).mean, outlook.show(point).mean
    lag = 0.3 * outlook.scales[:, [c.name for c in outlook.coordinates].index("lag")]
    lines = plain[:, :HARMONICS] - 1j * plain[:, HARMONICS:]
    turned = 1.02 * lines * np.exp(1j * np.outer(lag, np.arange(1, HARMONICS + 1)))
    np.testing.assert_allclose(seen, parts(turned), atol=1e-12)


def test_weights_that_few_cycles_give_cost_more_the_more_friction_scatters() -> None:
    def loss(tests: list[Candidate], **plan: object) -> list[float]:
        outlook = outlook_of(laboratory(scene(**plan), LAW), tests)
        told = told_by(outlook)
        seen = seen_by_fit(outlook, range(len(tests)))
        lossy = weighed(outlook, told, seen)
        ratio = np.sqrt(np.diagonal(told.own, axis1=1, axis2=2) / np.diagonal(lossy.own, axis1=1, axis2=2))
        np.testing.assert_allclose(ratio[0, :3], losses(seen[0]))
        np.testing.assert_allclose(ratio[:, 3:], 1.0)
        return [float(value) for value in ratio[0, :3]]

    still, scattering = loss(TESTS, cycle_scatter=0.0), loss(TESTS, cycle_scatter=0.01)
    assert max(still) < 1.05
    assert scattering[2] > 1.2
    assert loss([Candidate(0.3, 1.0, BASE_M, 4.5)]) == [1.0, 1.0, 1.0]  # two cycles tell nothing of their scatter


def test_what_a_fit_takes_for_noise_is_found_without_drawing() -> None:
    """The twin: the median over draws of cycles, shrunk as a fit shrinks them, of what the harmonics tell."""
    outlook = outlook_of(laboratory(scene(cycle_scatter=0.01), LAW), TESTS)
    roughly = as_weighed(outlook, told_by(outlook)).own
    for i, seen in seen_by_fit(outlook, range(len(TESTS))).items():
        slopes = seen.told.slopes[0][:, :3]
        drawn = np.median([np.diag(slopes.T @ np.linalg.solve(found, slopes)) for found in seen.found], axis=0)
        ratio = np.diag(roughly[i])[:3] / drawn
        assert (ratio > 0.25).all()
        assert (ratio < 4.0).all()
