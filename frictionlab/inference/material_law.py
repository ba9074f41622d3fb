"""The law of a material, as a campaign has found it: physical values, one covariance, scatter from test to test.

The file ``law_MATERIAL.toml`` holds it. What it says of a test not made has two parts: the errors of the values, which
all tests of the material share, and the scatter, which each test draws anew.
"""

import json
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, ValidationError
from scipy.special import ndtri

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError, UsageError
from frictionlab.files import check_regular, write_whole
from frictionlab.scene.keys import refusal
from frictionlab.scene.physical import to_physical
from frictionlab.scene.rig import Positive, SceneTable
from frictionlab.schema import with_error
from frictionlab.simulator import Problem
from frictionlab.simulator.laws import Parameter, law_of
from frictionlab.simulator.problem import Wall

if TYPE_CHECKING:
    from frictionlab.inference.posterior import Posterior


FORMAT, VERSION = "frictionlab law", 1
COEFFICIENT = "friction_coefficient"
AT_FORCE = "friction_n_at_"  # and the normal force in N: friction where Amontons' law fails
DETUNING = "natural_frequency_ratio"  # the frame's natural frequency over the scene's, as the tests have found it
FRAME = "frame_damping_ratio"
SUFFIXES = {"m/s": "_m_per_s", "m": "_m", "1/m": "_per_m"}
RANGES = {"normal_force_n": "N", "base_amplitude_m": "m", "frequency_ratio": ""}
EDGE = 1e-2  # relative: how far beyond the conditions of its tests a law is used without a word
Finite = Annotated[float, Field(allow_inf_nan=False)]
Pair = Annotated[list[Finite], Field(min_length=2, max_length=2)]
HEAD = """\
# The contact law of one material, by all its tests: frictionlab campaign wrote it, frictionlab predict reads it.
# Values in N, m and s; "scatter" is their standard deviation from test to test, "scatter_u" what more of it the tests
# leave possible: 1.96 times both in quadrature holds 95 % of tests.
# Errors are those of the tests; the rig's own (stiffness, normal force) are in none: predictions on it share them.
# A value of level "test" is another in each test of the material: re-seating the contact changes it.
"""


def physical_name(parameter: Parameter) -> str:
    """Return the name of a law's parameter in newtons, metres and seconds."""
    unit = to_physical(parameter, None, None, amplitude=1.0, turn=1.0)[1]
    return parameter.physical or parameter.name + SUFFIXES.get(unit, "")


@dataclass(frozen=True, kw_only=True, eq=False)
class MaterialLaw:
    """The law of one material; UsageError where a value lacks or is none of the law's, or the covariance is not theirs.

    ``law``: a sum of terms, ``coulomb+place``. ``values``: ``friction_coefficient`` (or ``friction_n_at_F`` for each
    normal force F, in N, where Amontons' law fails) and the law's other parameters by `physical_name`;
    ``frame_damping_ratio`` and ``natural_frequency_ratio`` (the frame's over `rig`'s) where the tests have moved them.
    ``covariance`` (n, n): of the values, in their order. ``scatter``: standard deviation from test to test of a value,
    and what more of it the tests leave possible (in quadrature); a name without one has none. ``test_level``: values
    that are another in each test: their mean is what stands in `values`. ``rig``: ``natural_frequency_hz``,
    ``stiffness_n_per_m``, ``frame_damping_ratio``, and ``lag_s``: by how much the base's channel is behind, as the
    tests have found it (0 where that is not known); nothing of a law found on a tribometer. ``conditions``: lowest and
    highest ``normal_force_n``, ``base_amplitude_m`` and ``frequency_ratio`` of the tests.
    """

    material: str
    law: str
    values: Mapping[str, float]
    covariance: FloatArray
    scatter: Mapping[str, tuple[float, float]]
    rig: Mapping[str, float]
    conditions: Mapping[str, tuple[float, float]]
    tests: int
    test_level: tuple[str, ...] = ()
    wall: Wall = "fixed"

    def __post_init__(self) -> None:
        """Refuse values that are not the law's."""
        n, names = len(self.values), {physical_name(p) for p in law_of(self.law).own}
        friction = [name for name in self.values if name == COEFFICIENT or name.startswith(AT_FORCE)]
        lacking = names - {COEFFICIENT} - set(self.values)
        stray = set(self.values) - names - set(friction) - {FRAME, DETUNING}
        if lacking or stray or not friction or (len(friction) > 1 and COEFFICIENT in friction):
            raise UsageError(
                f"law of {self.material}, {self.law}: expected the values {', '.join(sorted(names))} ({AT_FORCE}F in"
                f" place of {COEFFICIENT}); got {', '.join(self.values) or 'none'}"
            )
        matrix = np.asarray(self.covariance, dtype=np.float64)
        if matrix.shape != (n, n) or not np.all(np.isfinite(matrix)) or not np.allclose(matrix, matrix.T, rtol=1e-6):
            raise UsageError(
                f"law of {self.material}: covariance: expected a symmetric matrix of {n} rows, one a value; got the"
                f" shape {matrix.shape}"
            )
        object.__setattr__(self, "covariance", matrix)

    def __repr__(self) -> str:
        errors = np.sqrt(np.diag(self.covariance))
        said = ", ".join(f"{k} {with_error(v, u)}" for (k, v), u in zip(self.values.items(), errors, strict=True))
        return f"<MaterialLaw of {self.material}, {self.law}: {said}>"

    @property
    def frame(self) -> Mapping[str, float]:
        """The numbers of the rig; `UsageError` of a law found on a tribometer, which has none."""
        if not self.rig:
            raise UsageError(
                f"law of {self.material}: found on a tribometer, whose motion is given: expected the frame that it is"
                " to be used on; got none; do: write natural_frequency_hz, stiffness_n_per_m and frame_damping_ratio"
                " under [rig] of the law's file"
            )
        return self.rig

    @property
    def natural_frequency_hz(self) -> float:
        """Natural frequency of the rig."""
        return self.frame["natural_frequency_hz"]

    def problem(
        self, normal_force_n: float, base_amplitude_m: float, r: float, *, values: Mapping[str, float] | None = None
    ) -> Problem:
        """Return the oscillator of a test: friction from the normal force, eq. (2.8), all else over k, Y and omega.

        ``r``: drive over the natural frequency of `rig`; ``values``: in place of the law's own, as `draws` gives them.

        Raises
        ------
        UsageError
            A normal force outside those of the tests, where Amontons' law fails.
        ParameterError
            A value has no meaning in this test.

        Examples
        --------
        >>> law = example_law()
        >>> round(law.problem(4.0, 1.6e-3, 0.5).beta, 3)
        0.395
        """
        given = dict(self.values if values is None else values)
        natural, detuned = self.natural_frequency_hz, given.get(DETUNING, 1.0)
        frame = {"stiffness": self.frame["stiffness_n_per_m"], "frequency": natural * detuned}
        frame |= {"amplitude": base_amplitude_m, "turn": 2.0 * math.pi * natural * r}
        parameters = self.over(given, normal_force_n, frame)
        damping, beta = given.get(FRAME, self.rig.get(FRAME, 0.0)), parameters.pop("beta")
        law, r = law_of(self.law), r / detuned
        return Problem(r, beta, wall=self.wall, law=law, parameters=parameters, frame_damping_ratio=damping)

    def over(self, values: Mapping[str, float], normal_force_n: float, frame: Mapping[str, float]) -> dict[str, float]:
        """Return the law's own parameters at some values, dimensionless by a ``frame`` as `to_physical` takes it."""
        found = {}
        for parameter in law_of(self.law).own:
            name = physical_name(parameter)
            value = self._friction(values, normal_force_n) if name == COEFFICIENT else values[name]
            found[parameter.name] = value / (to_physical(parameter, **frame)[0] or 1.0)
        return found

    def _friction(self, values: Mapping[str, float], normal_force_n: float) -> float:
        """Friction force, N: by the coefficient, or between those at the normal forces of the tests."""
        if COEFFICIENT in values:
            return values[COEFFICIENT] * normal_force_n
        at_force = {float(n.removeprefix(AT_FORCE)): f for n, f in values.items() if n.startswith(AT_FORCE)}
        forces = sorted(at_force)
        if not forces[0] * (1.0 - EDGE) <= normal_force_n <= forces[-1] * (1.0 + EDGE):
            raise UsageError(
                f"law of {self.material}: normal force: friction is not proportional to it (Amontons' law fails);"
                f" expected one from {forces[0]:g} to {forces[-1]:g} N, as tested; got {normal_force_n:g} N"
            )
        return float(np.interp(normal_force_n, forces, [at_force[force] for force in forces]))

    def draws(self, n: int, seed: int = 0) -> list[dict[str, float]]:
        """Return values of so many tests not made: errors, and scatter from test to test with what is not known of it.

        They lie evenly: a Latin hypercube and its mirror image. A value that is positive by its law is drawn on a
        logarithmic scale, others are kept inside their domain. The same seed, the same draws.
        """
        from scipy.stats.qmc import LatinHypercube  # noqa: PLC0415 - half a second, for predictions alone

        names, best = list(self.values), np.array(list(self.values.values()))
        spread = np.array([math.hypot(*self.scatter.get(name, ())) for name in names])
        values, vectors = np.linalg.eigh(self.covariance + np.diag(spread**2))
        evenly = LatinHypercube(len(names), rng=seed).random((n + 1) // 2)
        normal = np.concatenate([ndtri(evenly), -ndtri(evenly)])[:n]
        steps = normal * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
        own = {physical_name(p): p for p in law_of(self.law).own}
        domains = [own[COEFFICIENT] if name.startswith(AT_FORCE) else own.get(name) for name in names]
        low = [p.low if p else -math.inf if n == DETUNING else 0.0 for n, p in zip(names, domains, strict=True)]
        high = [p.high if p else math.inf for p in domains]
        logs = np.array([p is not None and p.scale == "log" for p in domains]) & (best > 0.0)
        drawn = best + steps
        drawn[:, logs] = best[logs] * np.exp(steps[:, logs] / best[logs])
        return [dict(zip(names, row, strict=True)) for row in np.clip(drawn, low, high).tolist()]

    def beyond(self, **test: float) -> tuple[str, ...]:
        """Return a sentence for each number of a test that lies outside the conditions of the tests."""
        said = []
        for name, value in test.items():
            low, high = self.conditions.get(name, (-math.inf, math.inf))
            if not low * (1.0 - EDGE) <= value <= high * (1.0 + EDGE):
                unit = f" {RANGES[name]}".rstrip()
                where = f"the tests of {self.material} ({low:.4g} to {high:.4g}{unit})"
                said.append(f"{name}: {value:.4g}{unit} lies beyond {where}: nothing was measured there")
        return tuple(said)

    def text(self) -> str:
        """Return the file as text."""
        lines = [
            HEAD,
            f"format = {_said(FORMAT)}",
            f"format_version = {VERSION}",
            *(f"{key} = {_said(getattr(self, key))}" for key in ("material", "law", "wall", "tests")),
            f"covariance = [  # of the values below, in their order: {', '.join(self.values)}",
            *(f"    {_said(row)}," for row in self.covariance.tolist()),
            "]",
        ]
        for (name, value), variance in zip(self.values.items(), np.diag(self.covariance), strict=True):
            key = name if name.replace("_", "").isalnum() else _said(name)
            lines += ["", f"[values.{key}]", f"value = {_said(value)}  # +- {math.sqrt(max(variance, 0.0)):.2g}"]
            spread = zip(("scatter", "scatter_u"), self.scatter.get(name, ()), strict=False)
            level = "test" if name in self.test_level else "rig" if name in (FRAME, DETUNING) else "material"
            lines += [*(f"{part} = {_said(number)}" for part, number in spread), f'level = "{level}"']
        lines += ["", "[rig]"] * bool(self.rig) + [f"{key} = {_said(value)}" for key, value in self.rig.items()]
        lines += ["", "[conditions]", *(f"{key} = {_said(list(pair))}" for key, pair in self.conditions.items()), ""]
        return "\n".join(lines)

    def write(self, path: str | PathLike[str], *, force: bool = False) -> None:
        """Write the law as a file, whole or not at all; it replaces only a law, unless forced."""
        write_whole(Path(path), self.text().encode(), replace=True if force else is_material_law)


def _said(value: object) -> str:
    """A value as TOML writes it: its strings and lists are JSON's, without escapes of what is no ASCII."""
    return json.dumps(value, ensure_ascii=False)


def material_law_of(
    posterior: "Posterior",
    material: str,
    *,
    stiffness_n_per_m: float | None,
    natural_frequency_hz: float | None,
    lag_s: float = 0.0,
) -> MaterialLaw | None:
    """Return what a joint fit says of one material, in physical units; None where a normal force is not known.

    A fit with a friction ratio at each normal force gives a friction force at each, one with a single ratio (Amontons'
    law) a coefficient. Values that the scene holds have no error. ``lag_s``: that the scene declares; stiffness and
    frequency are None where motions are given and forces measured.
    """
    places = [i for i, o in enumerate(posterior.observations) if o.material == material]
    seen = [posterior.observations[i] for i in places]
    forces = [o.normal_force for o in seen if o.normal_force is not None]
    if len(forces) < len(seen) or not seen:
        return None
    first, values = places[0], posterior.values(places[0])
    index = [{posterior.unknowns[k].name: int(k) for k in posterior.tests[i].index} for i in places]
    several = len({own.get("beta") for own in index}) > 1
    known = seen[0].problem(values).parameters
    rig, frame = dict[str, float](), dict[str, float]()
    if stiffness_n_per_m and natural_frequency_hz:
        lag = posterior.shared(index[0]["lag_s"], first)[0] if "lag_s" in index[0] else 0.0
        rig = {"natural_frequency_hz": natural_frequency_hz, "stiffness_n_per_m": stiffness_n_per_m}
        rig |= {FRAME: known[FRAME], "lag_s": lag_s + lag}
        tuned = natural_frequency_hz * (1.0 + values.get("natural_frequency", 0.0))
        frame = {"stiffness": stiffness_n_per_m, "frequency": tuned}
    found: dict[str, tuple[float, int | None, float]] = {}  # value; its unknown, and the change of the value with that
    for i, o, own in list(zip(places, seen, index, strict=True))[: None if several else 1]:
        for parameter in o.law.own:
            k, name = own.get(parameter.name), physical_name(parameter)
            times = to_physical(parameter, **(o.frame | frame))[0] or 1.0
            if name == COEFFICIENT and several:
                name = f"{AT_FORCE}{o.normal_force!r}"
            elif name == COEFFICIENT:
                times /= o.normal_force or 1.0
            value, slope = (known[parameter.name], 0.0) if k is None else posterior.shared(k, i)
            found.setdefault(name, (value * times, k, slope * times))
    for unknown, name, add in (("natural_frequency", DETUNING, 1.0), (FRAME, FRAME, 0.0)):
        if unknown in index[0]:
            value, slope = posterior.shared(index[0][unknown], first)
            found[name] = (add + value, index[0][unknown], slope)
    rows, slopes = [k or 0 for _, k, _ in found.values()], np.array([slope for _, _, slope in found.values()])
    scatter = posterior.fit.model.scatter
    error = np.sqrt(np.maximum(posterior.scatter**2 - scatter**2, 0.0))
    ranges = {
        "normal_force_n": forces,
        "base_amplitude_m": [o.unit for o in seen],
        "frequency_ratio": [o.r for o in seen],
    }
    fitted = {name: (k, abs(slope)) for name, (_, k, slope) in found.items() if k is not None}
    return MaterialLaw(
        material=material,
        law=seen[0].law.name,
        values={name: value for name, (value, _, _) in found.items()},
        covariance=posterior.covariance[np.ix_(rows, rows)] * np.outer(slopes, slopes),
        scatter={n: (float(scatter[k]) * s, float(error[k]) * s) for n, (k, s) in fitted.items() if scatter[k] > 0.0},
        test_level=tuple(name for name, (k, _) in fitted.items() if posterior.unknowns[k].level == "test"),
        rig=rig,
        conditions={name: (min(some), max(some)) for name, some in ranges.items() if rig or name != "frequency_ratio"},
        tests=len(seen),
        wall=seen[0].wall,
    )


def is_material_law(path: Path) -> bool:
    """Whether a file is the law of a material."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8")).get("format") == FORMAT
    except (OSError, ValueError, RecursionError):
        return False


def read_material_law(path: str | PathLike[str]) -> MaterialLaw:
    """Read the law of a material."""
    path = Path(path)
    try:
        check_regular(path)
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(
            f"{path}: cannot be read ({error.strerror}): give a law_MATERIAL.toml of a campaign"
        ) from error
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{path}: expected TOML, a law_MATERIAL.toml of a campaign: {error}") from error
    if tables.get("format") != FORMAT or tables.get("format_version") != VERSION:
        found = f"{tables.get('format')!r}, version {tables.get('format_version')!r}"
        raise UsageError(f"{path}: format: expected {FORMAT!r}, version {VERSION}; got {found}")
    try:
        file = _File.model_validate(tables)
    except ValidationError as error:
        raise UsageError("; ".join(refusal(error, _File, name=str(path)).args)) from error
    if any(len(row) != len(file.values) for row in file.covariance):
        raise UsageError(f"{path}: covariance: expected {len(file.values)} rows of as many numbers, one a value")
    try:
        return MaterialLaw(
            material=file.material,
            law=file.law,
            values={name: value.value for name, value in file.values.items()},
            covariance=np.array(file.covariance).reshape(len(file.covariance), len(file.values)),
            scatter={n: (v.scatter, v.scatter_u or 0.0) for n, v in file.values.items() if v.scatter is not None},
            test_level=tuple(name for name, value in file.values.items() if value.level == "test"),
            rig={} if file.rig is None else file.rig.model_dump(exclude_unset=True),
            conditions={name: (pair[0], pair[1]) for name, pair in file.conditions.items()},
            tests=file.tests,
            wall=file.wall,
        )
    except (UsageError, SimulationError) as error:
        raise UsageError(f"{path}: {error}") from error


class _Value(SceneTable):
    value: Finite
    scatter: Finite | None = None
    scatter_u: Finite | None = None
    level: Literal["rig", "material", "test"]


class _Rig(SceneTable):
    natural_frequency_hz: Positive
    stiffness_n_per_m: Positive
    frame_damping_ratio: Finite
    lag_s: Finite = 0.0


class _File(SceneTable):
    """The file of a law, as it is checked."""

    format: str
    format_version: int
    material: str
    law: str
    wall: Wall
    tests: int
    covariance: list[list[Finite]]
    values: dict[str, _Value]
    rig: _Rig | None = None
    conditions: dict[Literal["normal_force_n", "base_amplitude_m", "frequency_ratio"], Pair]


def example_law() -> MaterialLaw:
    """Return a law like that of a brass contact on a frame of 3.13 Hz, for examples.

    Examples
    --------
    >>> example_law().law
    'coulomb+place'
    """
    return MaterialLaw(
        material="brass",
        law="coulomb+place",
        values={COEFFICIENT: 0.309, "gradient_per_m": 0.0},
        covariance=np.diag([0.005**2, 4.0**2]),
        scatter={COEFFICIENT: (0.004, 0.003), "gradient_per_m": (25.0, 9.0)},
        test_level=("gradient_per_m",),
        rig={"natural_frequency_hz": 3.13, "stiffness_n_per_m": 1955.0, FRAME: 0.0},
        conditions={"normal_force_n": (2.5, 4.4), "base_amplitude_m": (1.5e-3, 1.9e-3), "frequency_ratio": (0.3, 0.35)},
        tests=3,
    )
