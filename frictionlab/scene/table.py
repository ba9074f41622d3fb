"""What all tables of a scene have in common."""

from pydantic import BaseModel, ConfigDict


class Table(BaseModel):
    """One table of a scene: frozen, strict, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
