"""What all tables of a scene have in common; ``[rig]``, its masses and contacts; ``[synthetic]``, a virtual one.

Of that also how its base may move, and what its contacts are like.
"""

import math
import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from frictionlab.errors import ParameterError

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Some = Field(min_length=1)
APART, MEND = 0.003, "N and J follow the stiffness, r the frequency: mend or leave out one of the three"
_NAME = re.compile(r'[^/\\:*?"<>|\x00-\x1f\x7f-\x9f\ud800-\udfff]{1,100}')


def _file_word(word: str) -> str:
    if not _NAME.fullmatch(word):
        raise ValueError(
            "expected a word that can name a file (1 to 100 characters, none of"
            f' / \\ : * ? " < > | and no control characters); got {word!r}'
        )
    return word


FileWord = Annotated[str, AfterValidator(_file_word)]


class SceneTable(BaseModel):
    """One table of a scene: frozen, strict, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, defer_build=True)

    def __repr_args__(self) -> Iterator[tuple[str | None, object]]:
        """What was given, without the defaults: a notebook shows it."""
        return ((key, value) for key, value in super().__repr_args__() if key in self.model_fields_set)


def key(words: str, default: Any = None, **limits: Any) -> Any:
    """A key of a table: the sentence that documents it everywhere, its default (None: not known), its limits.

    Without a default (``...``) it must be given. ``limits`` are those of `pydantic.Field`.
    """
    return Field(default, description=words, **limits)


def _law(name: str) -> str:
    if name not in ("coulomb", "auto"):
        from frictionlab.simulator.laws import law_of  # noqa: PLC0415 - 0.1 s that a scene without a law need not wait for

        law_of(name)
    return name


LawName = Annotated[str, AfterValidator(_law)]
"""A contact law that exists, or "auto"."""


def check_parameters(
    values: Mapping[str, float], law: str | None, *, breaks_away: bool = False, table: str = "parameters"
) -> None:
    """Refuse parameters that a law lacks, or values outside their domain, with a ValueError that names them.

    Of a law that is chosen later on (None, or "auto") those that no law has; ``breaks_away``: a static ratio of the
    scene adds the term breakaway; ``table``: the scene's, for the words.
    """
    if not values:
        return
    from frictionlab.simulator.laws import TERMS, law_of  # noqa: PLC0415 - as above

    named = law not in (None, "auto")
    terms = [*(law_of(str(law)).terms if named else TERMS.values()), *([TERMS["breakaway"]] if breaks_away else [])]
    parameters = [*(parameter for term in terms for parameter in term.parameters), *law_of("coulomb").parameters]
    known = {parameter.name: parameter for parameter in parameters}
    for name, value in values.items():
        if name not in known:
            whose = f"law {law} has no such parameter" if named else "no law has such a parameter"
            raise ValueError(f"{table}.{name}: {whose}; expected one of {', '.join(known)}")
        try:
            known[name].checked(value)
        except ParameterError as error:
            raise ValueError(f"{table}.{name}: expected {known[name].domain}; got {value!r}") from error


class RigMass(SceneTable):
    """``[[rig.masses]]``: one mass and the storey below it; a frame of several, from the base up."""

    mass_kg: Positive = key("Mass of this floor.", ...)
    stiffness_n_per_m: Positive = key("Stiffness of the storey below it.", ...)
    damping_ratio: NonNegative | None = key("Viscous damping ratio of that storey, as if it stood alone.")


class RigContact(SceneTable):
    """``[[rig.contacts]]``: a place that rubs; beside the keys below, parameters of its law by their names."""

    mass: int = key("Number of the mass that rubs, from the base up.", 1, ge=1)
    against: Literal["wall", "base"] | Annotated[int, Field(ge=1)] = key(
        'What it rubs against: "wall", "base" or the number of another mass.', "wall"
    )
    law: LawName = key('Contact law, like "coulomb+place".', "coulomb")
    beta: NonNegative | None = key("Friction ratio: friction force over k Y of the first storey.")
    friction_n: NonNegative | None = key("Or the friction force.")
    coefficient: NonNegative | None = key("Or the friction coefficient, with normal_force_n.")
    normal_force_n: Positive | None = key("Force that presses this contact together; by default that of [experiment].")
    parameters: dict[str, float] = key("Parameters of the law; each may stand beside the other keys, by its name.", {})

    @model_validator(mode="before")
    @classmethod
    def _parameters_by_name(cls, table: object) -> object:
        if not isinstance(table, dict):
            return table
        named = {k: v for k, v in table.items() if k not in cls.model_fields and isinstance(v, (int, float))}
        if not named:
            return table
        rest = {key: value for key, value in table.items() if key not in named}
        return {**rest, "parameters": {**rest.get("parameters", {}), **{k: float(v) for k, v in named.items()}}}

    @model_validator(mode="after")
    def _is_one_contact(self) -> Self:
        given = [name for name in ("beta", "friction_n", "coefficient") if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"expected the friction once, as beta, friction_n or coefficient; got {', '.join(given)}")
        if self.against == self.mass:
            raise ValueError(f'against: expected "wall", "base" or another mass; got {self.against}, the mass itself')
        check_parameters(self.parameters, self.law)
        return self


class Rig(SceneTable):
    """``[rig]``: the frame without its contact."""

    natural_frequency_hz: Positive | None = key("Natural frequency of the frame; by default from mass and stiffness.")
    mass_kg: Positive | None = key("Mass that moves; of mass, stiffness and natural frequency two give the third.")
    stiffness_n_per_m: Positive | None = key("Stiffness of the frame; it turns k Y into newtons and k Y² into joules.")
    damping_ratio: NonNegative | None = key(
        "Viscous damping ratio of the frame, as taps give it; given, it is simulated."
    )
    natural_frequency_hz_u: NonNegative | None = key("Standard uncertainty of the natural frequency.")
    stiffness_n_per_m_u: NonNegative | None = key("Standard uncertainty of the stiffness; F in N, mu and J go with it.")
    damping_ratio_u: NonNegative | None = key("Standard uncertainty of the damping ratio.")
    kind: Literal["base-excited", "prescribed"] = key(
        '"base-excited", or "prescribed", as on a tribometer: there is no frequency ratio.', "base-excited"
    )
    radius_m: Positive | None = key("Of a turning contact: makes metres of an angle and newtons of a torque.")
    restoring: Literal["spring", "pendulum"] = key('What pulls the mass back: "spring" or "pendulum".', "spring")
    masses: list[RigMass] = key("Several masses, as [[rig.masses]]; frequency is the first storey's.", [])
    contacts: list[RigContact] = key("Where it rubs, as [[rig.contacts]]; by default mass 1, by [model].", [])

    @model_validator(mode="after")
    def _masses_agree(self) -> Self:
        double = [key for key in ("mass_kg", "stiffness_n_per_m", "damping_ratio") if getattr(self, key) is not None]
        if self.masses and double:
            raise ValueError(f"{', '.join(double)}: say the same as the first of [[rig.masses]]: leave one of both out")
        count = len(self.masses) or 1
        for number, contact in enumerate(self.contacts):
            for named in (contact.mass, contact.against):
                if isinstance(named, int) and named > count:
                    raise ValueError(f"contacts.{number}: expected a mass from 1 to {count}; got {named}")
        given, derived = self.natural_frequency_hz, self._derived_natural_frequency_hz()
        if given and derived and abs(given / derived - 1) > 0.02:
            raise ValueError(
                f"natural_frequency_hz = {given:g} contradicts sqrt(stiffness_n_per_m / mass_kg) / (2 pi) = {derived:g}"
                " by more than 2 %: leave one of the three out"
            )
        return self

    @property
    def first(self) -> "RigMass | Rig":
        """The storey that dimensionless numbers refer to: the first of the masses, else the rig itself."""
        return self.masses[0] if self.masses else self

    @property
    def damping(self) -> float | None:
        """Viscous damping ratio of the first storey, where it is known."""
        return self.first.damping_ratio

    def _derived_natural_frequency_hz(self) -> float | None:
        mass, stiffness = self.first.mass_kg, self.first.stiffness_n_per_m
        return None if mass is None or stiffness is None else math.sqrt(stiffness / mass) / (2 * math.pi)

    @property
    def natural_frequency(self) -> float | None:
        """Natural frequency in Hz: as given, else from mass and stiffness, else ``None``."""
        return self.natural_frequency_hz or self._derived_natural_frequency_hz()

    @property
    def stiffness(self) -> float | None:
        """Stiffness in N/m: as given, else from mass and natural frequency, else ``None``."""
        first = self.first
        if first.stiffness_n_per_m is not None or first.mass_kg is None or self.natural_frequency_hz is None:
            return first.stiffness_n_per_m
        return first.mass_kg * (2 * math.pi * self.natural_frequency_hz) ** 2

    @property
    def doubts(self) -> tuple[str, ...]:
        """Sentences on numbers that look a thousand times too large or small for a frame on a bench.

        Examples
        --------
        >>> Rig(mass_kg=3.08, stiffness_n_per_m=1191.0).doubts
        ()
        >>> Rig(mass_kg=3080.0, natural_frequency_hz=3.13).doubts
        ('rig: mass_kg = 3080: a frame on a bench has 0.01 to 300 kg: is this in g?',)
        """
        mass, stiffness, given = self.first.mass_kg, self.first.stiffness_n_per_m, self.natural_frequency_hz
        found, derived = [], self._derived_natural_frequency_hz()
        if mass is not None and not 0.01 <= mass <= 300.0:
            unit = "g" if mass > 300.0 else "t"
            found.append(f"mass_kg = {mass:g}: a frame on a bench has 0.01 to 300 kg: is this in {unit}?")
        if stiffness is not None and stiffness < 10.0:
            found.append(f"stiffness_n_per_m = {stiffness:g}: a frame has more than 10 N/m: is this in N/mm?")
        if given and derived is not None and abs(derived / given - 1.0) > APART:
            found.append(
                f"mass_kg and stiffness_n_per_m make {derived:.4g} Hz, natural_frequency_hz = {given:g}: {MEND}"
            )
        if derived is not None and not 0.2 <= derived <= 200.0 and not found:
            both = f"mass_kg = {mass:g} and stiffness_n_per_m = {stiffness:g}"
            found.append(f"{both} make {derived:.3g} Hz: is one of them in another unit (g, N/mm)?")
        return tuple(f"rig: {sentence}" for sentence in found)


class VirtualTests(SceneTable):
    """``[[synthetic.tests]]``: one material over normal forces x frequency ratios, and how it behaves.

    The friction force is ``friction_coefficient * normal_force``; the behaviours below default to plain Coulomb.
    """

    material: FileWord = key("Material of these tests; it names their logs.", ...)
    normal_forces_n: Annotated[list[Positive], Some] = key("Normal forces, each with each frequency ratio.", ...)
    frequency_ratios: Annotated[list[Positive], Some] = key("Frequency ratios, each with each normal force.", ...)
    friction_coefficient: NonNegative = key("True friction coefficient.", ...)
    law: LawName | None = key('True contact law, like "coulomb+place"; by default that of [model].')
    parameters: dict[str, float] = key("Parameters of that law other than beta, dimensionless: {gradient = 0.05}.", {})
    physical: dict[str, float] = key("The same in newtons, metres, seconds: {gradient = 28.0} is 28 1/m.", {})
    label: FileWord | None = key("Ends the log's name, to distinguish tests of the same material, force and ratio.")
    duration_s: Positive | None = key("Length of these tests; by default [synthetic] duration_s.")
    friction_drift_per_hour: float = key("Relative change of the friction force in an hour of running.", 0.0)
    friction_scatter: NonNegative = key("Relative rms of the friction force from cycle to cycle.", 0.0)
    jump_s: Positive | None = key("At this time the friction force changes for good.")
    jump_factor: NonNegative = key("By this factor it changes then.", 1.0)

    @model_validator(mode="after")
    def _parameters_can_be(self) -> Self:
        check_parameters(self.parameters, self.law, breaks_away=True)
        for table in ("parameters", "physical"):
            if "beta" in getattr(self, table):
                raise ValueError(f"{table}.beta: it follows from friction_coefficient and normal force: leave it out")
        if both := sorted(self.parameters.keys() & self.physical):
            raise ValueError(f"physical: {both[0]} stands in parameters too, dimensionless: give one of the two")
        return self


VirtualChannel = Literal[
    "angle", "contact_force", "normal_force", "mass_velocity", "base_velocity", "mass_acceleration", "base_acceleration"
]


class Synthetic(SceneTable):
    """``[synthetic]``: a virtual rig watched by two virtual lasers."""

    seed: int = key("Of the random numbers; the same seed gives the same bytes.", 0, ge=0)
    sampling_rate_hz: Positive = key("Samples per second.", 250.0)
    duration_s: Positive = key("Length of a test.", 60.0)
    base_amplitude_m: Positive = key("Amplitude of the base.", 1.8e-3)
    noise_m: NonNegative = key("Noise of each sensor, rms.", 0.8e-6)
    step_m: NonNegative = key("Smallest step of the sensors (optoNCDT 1420, 50 mm).", 1.02 * 0.05 / 65520)
    channels: list[VirtualChannel] = key(
        'Measured beside the displacements: ["contact_force", "mass_velocity", ...]; "angle": in place of the mass\'s.',
        [],
    )
    channel_noise: NonNegative = key("Noise of each further channel, rms over its own rms.", 1e-3)
    start: Literal["rest", "steady"] = key('"rest", or "steady": from the steady state.', "rest")
    tests: list[VirtualTests] = key("The tests, as [[synthetic.tests]].", [])
