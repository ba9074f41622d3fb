"""What all tables of a scene have in common; what is wrong with them, in sentences.

One sentence a fault, with its line, its key path and the key that was meant.
"""

import difflib
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Annotated, Any, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from frictionlab.errors import ParameterError, SceneError

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Lines = Mapping[tuple[str, ...], int]
HIDDEN = ("folder", "origin")  # fields that are no keys
WORDS = {
    "float_type": "expected a number",
    "int_type": "expected a whole number",
    "int_from_float": "expected a whole number",
    "string_type": "expected a text in quotes",
    "bool_type": "expected true or false",
    "dict_type": "expected a table",
    "model_type": "expected a table",
    "list_type": "expected a list",
    "finite_number": "expected a finite number",
    "greater_than": "expected more than {gt:g}",
    "greater_than_equal": "expected {ge:g} or more",
    "less_than_equal": "expected {le:g} or less",
    "multiple_of": "expected a multiple of {multiple_of:g}",
    "too_short": "expected at least {min_length} values",
    "too_long": "expected at most {max_length} values",
    "literal_error": "expected {expected}",
    "missing": "is not given, and has no default",
    "float_parsing": "expected a number",
    "int_parsing": "expected a whole number",
}
"""What pydantic finds, in the words that all refusals use."""
_UNION = re.compile(r"^(?:str|int|float|bool|constrained-.*|list\[.*)$")  # pydantic's names of a union's branches


class SceneTable(BaseModel):
    """One table of a scene: frozen, strict, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, defer_build=True)

    def __repr_args__(self) -> Iterator[tuple[str | None, object]]:
        """What was given, without the defaults: a notebook shows it."""
        return ((key, value) for key, value in super().__repr_args__() if key in self.model_fields_set - {"folder"})


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


def check_held(values: Mapping[str, float], law: str | None, *, breaks_away: bool = False) -> None:
    """Refuse parameters that a law lacks, or values outside their domain, with a ValueError that names them.

    Of a law that is chosen later on (None, or "auto") those that no law has; ``breaks_away``: a static ratio of the
    scene adds the term breakaway.
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
            raise ValueError(f"parameters.{name}: {whose}; expected one of {', '.join(known)}")
        try:
            known[name].checked(value)
        except ParameterError as error:
            raise ValueError(f"parameters.{name}: expected {known[name].domain}; got {value!r}") from error


def refusal(
    error: ValidationError, root: type[BaseModel], *, name: str = "scene", lines: Lines | None = None
) -> SceneError:
    """The error that names all faults, one an argument and so one a line.

    ``root`` is the model of the whole scene, ``name`` what the faults are of, ``lines`` where which key stands.
    """
    found: dict[tuple[str, ...], list[str]] = {}
    for fault in error.errors():
        path = tuple(str(part) for part in fault["loc"] if not _UNION.match(str(part)))
        found.setdefault(path, []).append(_sentence(path, dict(fault), root))
    faults = []
    for path, texts in found.items():
        above = (path[:n] for n in range(len(path), 0, -1))  # the key's line, or that of the table it belongs to
        line = next((lines[part] for part in above if part in lines), None) if lines else None
        where = f"{name}: " if line is None else f"{name}, line {line}: "
        said = f"{'.'.join(path)}: {' or '.join(dict.fromkeys(texts))}" if path else texts[0]
        faults.append((math.inf if line is None else line, where + said))
    return SceneError(*(said for _, said in sorted(faults, key=lambda fault: fault[0])))


def check_hidden(tables: Mapping[str, object], root: type[BaseModel], name: str = "scene") -> None:
    """Refuse fields of the model that are no keys of a scene."""
    for field in HIDDEN:
        if field in tables:
            raise SceneError(f"{name}: {field}: unknown key; expected one of {', '.join(keys_of(root))}")


def _sentence(path: tuple[str, ...], fault: Mapping[str, Any], root: type[BaseModel]) -> str:
    text = str(fault["msg"]).removeprefix("Value error, ")
    if fault["type"] == "extra_forbidden":
        table: type = root
        for part in path[:-1]:  # the model of the table at that path
            field = table.model_fields.get(part) if issubclass(table, BaseModel) else None
            table = table if field is None else next(tables_in(field.annotation), table)
        known = keys_of(table)
        near = [name for name in known if name.startswith(f"{path[-1]}_")]
        near = near or difflib.get_close_matches(path[-1], known, n=1)
        return f"unknown key; {f'did you mean {near[0]}? ' if near else ''}expected one of {', '.join(known)}"
    if fault["type"] in WORDS:
        text = WORDS[fault["type"]].format(**fault.get("ctx", {}))
    got = "" if fault["type"] in ("value_error", "missing") else f"; got {fault['input']!r}"
    return f"{text[0].lower()}{text[1:]}{got}"


def keys_of(table: type) -> list[str]:
    """The keys of a table: of a model its fields, of a dataclass too."""
    if issubclass(table, BaseModel):
        return [name for name in table.model_fields if name not in HIDDEN]
    return [f.name for f in fields(table)] if is_dataclass(table) else []


def tables_in(annotation: Any) -> Iterator[type]:
    """The tables that a key may hold, by its annotation: models and dataclasses, in lists too."""
    if isinstance(annotation, type) and (issubclass(annotation, BaseModel) or is_dataclass(annotation)):
        yield annotation
    for inner in get_args(annotation):
        yield from tables_in(inner)
