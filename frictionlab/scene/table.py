"""What all tables of a scene have in common."""

from collections.abc import Iterator, Mapping
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from frictionlab.errors import ParameterError

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


def _is_law(name: str) -> str:
    """A contact law that exists, or "auto"."""
    if name not in ("coulomb", "auto"):
        from frictionlab.simulator.laws import law_of  # noqa: PLC0415 - 0.1 s that a scene without a law need not wait for

        law_of(name)
    return name


def check_held(values: Mapping[str, float], law: str | None, *, breaks_away: bool = False) -> None:
    """Refuse parameters that a law lacks, or values outside their domain; without a law, those that no law has.

    Parameters
    ----------
    values : mapping of str to float
    law : str, optional
        The law that the scene names; None, or "auto": it is chosen later on.
    breaks_away : bool
        Whether the scene adds the term breakaway by a static ratio.

    Raises
    ------
    ValueError
        As said, with the parameter's name.
    """
    if not values:
        return
    from frictionlab.simulator.laws import TERMS, law_of  # noqa: PLC0415 - as above

    parts = TERMS.values() if law in (None, "auto") else law_of(str(law)).terms
    terms = (*parts, *((TERMS["breakaway"],) if breaks_away else ()))
    own = [parameter for term in terms for parameter in term.parameters]
    for name, value in values.items():
        meant = [parameter for parameter in (*own, *law_of("coulomb").parameters) if parameter.name == name]
        if not meant:
            whose = "no law has such a parameter" if law in (None, "auto") else f"law {law} has no such parameter"
            known = ", ".join(dict.fromkeys(parameter.name for parameter in (*own, *law_of("coulomb").common)))
            raise ValueError(f"parameters.{name}: {whose}; expected one of {known}")
        try:
            meant[0].checked(value)
        except ParameterError as error:
            raise ValueError(f"parameters.{name}: expected {meant[0].domain}; got {value!r}") from error


LawName = Annotated[str, AfterValidator(_is_law)]


class Table(BaseModel):
    """One table of a scene: frozen, strict, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, defer_build=True)

    def __repr_args__(self) -> Iterator[tuple[str | None, object]]:
        """What was given, without the defaults: a notebook shows it."""
        return ((key, value) for key, value in super().__repr_args__() if key in self.model_fields_set - {"folder"})
