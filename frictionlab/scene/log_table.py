"""The ``[log]`` table: the reader's options, whose keys and domains stand in `frictionlab.log_options` alone."""

from dataclasses import fields
from typing import Any, get_type_hints

from pydantic import ValidationError, create_model
from pydantic_core import InitErrorDetails, PydanticCustomError

from frictionlab.log_options import LogOptions, faults_of
from frictionlab.scene.table import Table

_HINTS = get_type_hints(LogOptions)
_KEYS: dict[str, Any] = {f.name: (_HINTS[f.name], f.default) for f in fields(LogOptions)}
_Types = create_model("_Types", __base__=Table, **_KEYS)


def log_options(table: dict[str, Any]) -> LogOptions:
    """The reader's options of a ``[log]`` table.

    Raises
    ------
    ValidationError
        All faults, each with its key: pydantic puts ``log`` before it.
    """
    said = _Types.model_validate(table).model_dump()
    faults = [_fault(name, text, said[name]) for name, text in faults_of(said)]
    if faults:
        raise ValidationError.from_exception_data("log", faults)
    return LogOptions(**said)


def _fault(key: str, text: str, said: object) -> InitErrorDetails:
    return InitErrorDetails(type=PydanticCustomError("value_error", "{text}", {"text": text}), loc=(key,), input=said)
