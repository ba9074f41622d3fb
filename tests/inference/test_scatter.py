"""Errors of what many tests share, held against a linear twin whose values scatter from test to test."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

from frictionlab.arrays import FloatArray
from frictionlab.inference.fit import fit_from
from frictionlab.inference.observation import Observation, Reached, Values
from frictionlab.inference.posterior import model_of, of_several
from frictionlab.inference.unknowns import Unknown
from frictionlab.scene import Scene
from frictionlab.simulator.laws import law_of
from frictionlab.uncertainty import sources_of

NOISE, SCATTER = 1e-3, 0.01
MATERIAL = Unknown("beta", "friction ratio", "material", mean=0.3, sd=0.1, law=True, scatter=0.03)
RIG = Unknown("gain", "gain of a sensor", sd=0.1)


@dataclass(frozen=True, kw_only=True)
class Line(Observation):
    """A test whose data are linear in two unknowns, and whose noise is ``over`` times what it assumes."""

    design: FloatArray
    over: float
    steps: ClassVar = (1e-3,)

    @property
    def law_unknowns(self) -> tuple[Unknown, ...]:
        return (MATERIAL,)

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        return (RIG,)

    def motion(self, values: Values, near: Any = None) -> FloatArray:  # noqa: ARG002 - linear
        return np.asarray(self.design @ [values["beta"], values["gain"]])

    def covariance(self, at: Reached) -> FloatArray:
        return np.asarray(self.over**2 * at.gain @ at.gain.T)


def scores(over: float, tests: int, seed: int) -> tuple[float, float]:
    """Errors over u of the material's value and the rig's, of one campaign; two frequencies hardly tell them apart."""
    rng = np.random.default_rng([seed, tests])
    lines, rig = list[Line](), RIG.sd * rng.standard_normal()
    for i in range(tests):
        design = np.column_stack([np.ones(8), 1.0 + (0.02 + 0.02 * (i % 2)) * np.arange(8)])
        own = 0.3 + SCATTER * rng.standard_normal()
        data = design @ [own, rig] + NOISE * rng.standard_normal(8)
        lines.append(
            Line(
                source=str(i),
                law=law_of("coulomb"),
                held={},
                wall="fixed",
                material="steel",
                normal_force=1.0,
                r=0.5,
                unit=1.0,
                turn=1.0,
                sources=sources_of(Scene(), 100.0),
                swing=1.0,
                data=data,
                variances=(NOISE / over) ** 2,
                powers=1.0,
                floor=1.0,
                design=design,
                over=over,
            )
        )
    model = model_of(lines)
    found = of_several(fit_from(model, [np.zeros(2)]))
    errors = np.sqrt(np.diag(found.covariance))
    off = found.fit.point - [u.at(v) for u, v in zip(model.unknowns, (0.3, rig), strict=True)]
    return float(off[0] / errors[0]), float(off[1] / errors[1])


def test_errors_of_few_tests_are_as_large_as_they_say() -> None:
    """Student's factor stood on a scatter that counts already that few tests show it badly."""
    rms = np.sqrt(np.mean(np.array([scores(1.0, 5, seed) for seed in range(60)]) ** 2, axis=0))
    assert 0.9 < rms[0] < 1.15
    assert rms[1] < 1.15


def test_weights_that_assume_too_much_noise_do_not_make_the_rig_sure() -> None:
    """Errors were those of the best weights, which were not used: 52 % of them held within one u."""
    found = np.array([scores(0.2, 4, seed) for seed in range(60)])
    assert np.mean(np.abs(found[:, 1]) < 1.0) > 0.65
    assert np.sqrt(np.mean(found**2, axis=0)) == pytest.approx([0.85, 0.85], abs=0.2)
