"""What all tables of a scene have in common."""

from collections.abc import Iterator
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


def _is_law(name: str) -> str:
    """A contact law that exists, or "auto"."""
    if name not in ("coulomb", "auto"):
        from frictionlab.simulator.laws import law_of  # noqa: PLC0415 - 0.1 s that a scene without a law need not wait for

        law_of(name)
    return name


LawName = Annotated[str, AfterValidator(_is_law)]


class Table(BaseModel):
    """One table of a scene: frozen, strict, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, defer_build=True)

    def __repr_args__(self) -> Iterator[tuple[str | None, object]]:
        """What was given, without the defaults: a notebook shows it."""
        return ((key, value) for key, value in super().__repr_args__() if key in self.model_fields_set - {"folder"})
