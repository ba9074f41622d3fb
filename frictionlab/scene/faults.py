"""What all tables of a scene have in common; what is wrong with them, in sentences.

One sentence a fault, with its line, its key path and the key that was meant.
"""

import difflib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
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
_HEAD = re.compile(r"^\s*(\[\[?)\s*([^\[\]]+?)\s*\]")
_KEY = re.compile(r"^\s*([\w.\-\"' ]+?)\s*=")


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


class SceneTable(BaseModel):
    """One table of a scene: frozen, strict, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, defer_build=True)

    def __repr_args__(self) -> Iterator[tuple[str | None, object]]:
        """What was given, without the defaults: a notebook shows it."""
        return ((key, value) for key, value in super().__repr_args__() if key in self.model_fields_set - {"folder"})


def refusal(
    error: ValidationError, root: type[BaseModel], *, name: str = "scene", lines: Lines | None = None
) -> SceneError:
    """The error that names all faults, one an argument and so one a line.

    ``root`` is the model of the whole scene, ``name`` what the faults are of, ``lines`` where which key stands.
    """
    found: dict[tuple[str, ...], list[str]] = {}
    known = lines or {}
    for fault in error.errors():
        path = tuple(str(part) for part in fault["loc"] if not _UNION.match(str(part)))
        found.setdefault(path, []).append(_sentence(path, dict(fault), root))
    told = sorted(found.items(), key=lambda fault: _line(fault[0], known) or math.inf)
    places = ("" if (line := _line(path, known)) is None else f", line {line}" for path, _ in told)
    return SceneError(*(f"{name}{at}: {_told(*fault)}" for at, fault in zip(places, told, strict=True)))


def check_hidden(tables: Mapping[str, object], root: type[BaseModel], name: str = "scene") -> None:
    """Refuse fields of the model that are no keys of a scene."""
    for key in HIDDEN:
        if key in tables:
            raise SceneError(f"{name}: {key}: unknown key; expected one of {', '.join(keys_of(root))}")


def _line(path: tuple[str, ...], lines: Lines) -> int | None:
    """The line of a key, or of the table it belongs to."""
    return next((lines[path[:n]] for n in range(len(path), 0, -1) if path[:n] in lines), None)


def _told(path: tuple[str, ...], texts: Sequence[str]) -> str:
    where = ".".join(path)
    return f"{where}: {' or '.join(dict.fromkeys(texts))}" if where else texts[0]


def _sentence(path: tuple[str, ...], fault: Mapping[str, Any], root: type[BaseModel]) -> str:
    text = str(fault["msg"]).removeprefix("Value error, ")
    if fault["type"] == "extra_forbidden":
        return f"unknown key; {_meant(path[-1], keys_of(_table(path[:-1], root)))}"
    if fault["type"] in WORDS:
        text = WORDS[fault["type"]].format(**fault.get("ctx", {}))
    got = "" if fault["type"] in ("value_error", "missing") else f"; got {fault['input']!r}"
    return f"{text[0].lower()}{text[1:]}{got}"


def _meant(key: str, known: Sequence[str]) -> str:
    near = [name for name in known if name.startswith(f"{key}_")] or difflib.get_close_matches(key, known, n=1)
    guess = f"did you mean {near[0]}? " if near else ""
    return f"{guess}expected one of {', '.join(known)}"


def keys_of(table: type) -> list[str]:
    """The keys of a table: of a model its fields, of a dataclass too."""
    if issubclass(table, BaseModel):
        return [name for name in table.model_fields if name not in HIDDEN]
    return [f.name for f in fields(table)] if is_dataclass(table) else []


def _table(path: Sequence[str], root: type[BaseModel]) -> type:
    """The model of the table at a path."""
    table: type = root
    for key in path:
        field = table.model_fields.get(key) if issubclass(table, BaseModel) else None
        if field is not None:
            table = next(tables_in(field.annotation), table)
    return table


def tables_in(annotation: Any) -> Iterator[type]:
    """The tables that a key may hold, by its annotation: models and dataclasses, in lists too."""
    if isinstance(annotation, type) and (issubclass(annotation, BaseModel) or is_dataclass(annotation)):
        yield annotation
    for inner in get_args(annotation):
        yield from tables_in(inner)


def lines_of(text: str) -> dict[tuple[str, ...], int]:
    r"""Where which key and table of a TOML text stands; of a value over several lines its first.

    Examples
    --------
    >>> lines_of("[rig]\nmass_kg = 3.0\n[[synthetic.tests]]\n")
    {('rig',): 1, ('rig', 'mass_kg'): 2, ('synthetic', 'tests', '0'): 3}
    """
    found: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    inside = False
    for number, line in enumerate(text.splitlines(), 1):
        if not inside and (head := _HEAD.match(line)):
            table = _numbered(_parts(head[2]), found, many=head[1] == "[[")
            found.setdefault(table, number)
        elif not inside and (key := _KEY.match(line)):
            found.setdefault((*table, *_parts(key[1])), number)
        inside ^= (line.count('"""') + line.count("'''")) % 2 == 1
    return found


def _parts(dotted: str) -> tuple[str, ...]:
    return tuple(part.strip(" \t\"'") for part in dotted.split("."))


def _numbered(path: tuple[str, ...], found: Mapping[tuple[str, ...], int], *, many: bool) -> tuple[str, ...]:
    if not many:
        return path
    return (*path, str(next(n for n in range(len(found) + 1) if (*path, str(n)) not in found)))
