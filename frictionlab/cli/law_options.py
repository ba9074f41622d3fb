"""``--law`` and ``--parameter NAME=VALUE``: a contact law on the command line."""

from collections.abc import Mapping, Sequence
from typing import Annotated

import typer

from frictionlab.errors import UsageError

LawName = Annotated[
    str, typer.Option("--law", metavar="LAW", help="The contact's law: coulomb, or a sum like coulomb+place+speed.")
]
Parameters = Annotated[
    list[str] | None,
    typer.Option(
        "--parameter", metavar="NAME=VALUE", help="A parameter of the law, or frame_damping_ratio; repeatable."
    ),
]
OWN_OPTION = {"beta": "--beta"}
SAME_AS = {"mu": ("static_ratio_up", "static_ratio_down", "static_ratio"), "zeta": ("contact_damping_ratio",)}


def named_values(said: Sequence[str] | None, given: Mapping[str, object]) -> dict[str, str]:
    """What each ``--parameter NAME=VALUE`` says, by name.

    Parameters
    ----------
    said : sequence of str
    given : mapping
        What ``--mu`` and ``--zeta`` say, or None.

    Raises
    ------
    UsageError
        One has no ``=``, stands twice, or has an option of its own.

    Examples
    --------
    >>> named_values(["gradient=0.05"], {})
    {'gradient': '0.05'}
    """
    values: dict[str, str] = {}
    for text in said or ():
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise UsageError(f"--parameter: expected NAME=VALUE; got {text!r}")
        if name in OWN_OPTION:
            raise UsageError(f"--parameter {name}: it has an option of its own: give {OWN_OPTION[name]} {value}")
        if name in values:
            raise UsageError(f"--parameter {name}: given twice; expected one value")
        values[name] = value
    for option, names in SAME_AS.items():
        for name in values if given.get(option) is not None else ():
            if name in names:
                raise UsageError(f"--{option} and --parameter {name} say the same: leave one out")
    return values


def numbers(said: Sequence[str] | None, given: Mapping[str, object]) -> dict[str, float]:
    """As `named_values`, each value read as one number."""
    return {name: _number(name, text) for name, text in named_values(said, given).items()}


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise UsageError(f"--parameter {name}: expected a number; got {text!r}") from error
