"""``[rig]``: the frame, its masses and storeys, and where it rubs."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from frictionlab.scene.faults import LawName, NonNegative, Positive, SceneTable, check_held


class RigMass(SceneTable):
    """``[[rig.masses]]``: one mass and the storey below it; a frame of several, from the base up."""

    mass_kg: Positive
    """Mass of this floor."""
    stiffness_n_per_m: Positive
    """Stiffness of the storey below it."""
    damping_ratio: NonNegative | None = None
    """Viscous damping ratio of that storey, as if it stood alone."""


class RigContact(SceneTable):
    """``[[rig.contacts]]``: a place that rubs; beside the keys below, parameters of its law by their names."""

    mass: Annotated[int, Field(ge=1)] = 1
    """Number of the mass that rubs, from the base up."""
    against: Literal["wall", "base"] | Annotated[int, Field(ge=1)] = "wall"
    """What it rubs against: "wall", "base" or the number of another mass."""
    law: LawName = "coulomb"
    """Contact law, like "coulomb+place"."""
    beta: NonNegative | None = None
    """Friction ratio: friction force over k Y of the first storey."""
    friction_n: NonNegative | None = None
    """Or the friction force."""
    coefficient: NonNegative | None = None
    """Or the friction coefficient, with normal_force_n."""
    normal_force_n: Positive | None = None
    """Force that presses this contact together; by default that of [experiment]."""
    parameters: dict[str, float] = Field(default={})
    """Parameters of the law; each may stand beside the other keys, by its name."""

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
        check_held(self.parameters, self.law)
        return self


class Rig(SceneTable):
    """``[rig]``: the frame without its contact."""

    natural_frequency_hz: Positive | None = None
    """Natural frequency of the frame; by default from mass and stiffness."""
    mass_kg: Positive | None = None
    """Mass that moves; of mass, stiffness and natural frequency two give the third."""
    stiffness_n_per_m: Positive | None = None
    """Stiffness of the frame; it turns k Y into newtons and k Y² into joules."""
    damping_ratio: NonNegative | None = None
    """Viscous damping ratio of the frame (`frictionlab free-vibration` measures it); given, it is simulated."""
    natural_frequency_hz_u: NonNegative | None = None
    """Standard uncertainty of the natural frequency."""
    stiffness_n_per_m_u: NonNegative | None = None
    """Standard uncertainty of the stiffness."""
    damping_ratio_u: NonNegative | None = None
    """Standard uncertainty of the damping ratio."""
    kind: Literal["base-excited", "prescribed"] = "base-excited"
    """"base-excited", or "prescribed": the motion is given, as on a tribometer; there is no frequency ratio."""
    restoring: Literal["spring", "pendulum"] = "spring"
    """What pulls the mass back: "spring" or "pendulum"."""
    masses: list[RigMass] = Field(default=[])
    """A frame of several masses, as [[rig.masses]]; frequency and stiffness are then those of the first storey."""
    contacts: list[RigContact] = Field(default=[])
    """Where the frame rubs, as [[rig.contacts]]; by default mass 1, as [model] says."""

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
        return self

    @model_validator(mode="after")
    def _agree(self) -> Self:
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
        mass, stiffness, found = self.first.mass_kg, self.first.stiffness_n_per_m, []
        if mass is not None and not 0.01 <= mass <= 300.0:
            meant = "g" if mass > 300.0 else "t"
            found.append(f"rig: mass_kg = {mass:g}: a frame on a bench has 0.01 to 300 kg: is this in {meant}?")
        if stiffness is not None and stiffness < 10.0:
            found.append(
                f"rig: stiffness_n_per_m = {stiffness:g}: a frame on a bench has more than 10 N/m: is this in N/mm?"
            )
        derived = self._derived_natural_frequency_hz()
        if derived is not None and not 0.2 <= derived <= 200.0 and not found:
            found.append(
                f"rig: mass_kg = {mass:g} and stiffness_n_per_m = {stiffness:g} make a natural frequency of"
                f" {derived:.3g} Hz: is one of them in another unit (g, N/mm)?"
            )
        return tuple(found)
