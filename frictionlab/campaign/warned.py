"""Warnings of many tests, told once for all tests of a kind: hundreds of alike sentences hide the one that differs."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

_NUMBER = re.compile(r"\d[\d.]*(?:e[+-]?\d+)?")


@dataclass(frozen=True)
class Warned:
    """A warning and the tests it was given for; its numbers are those of the first."""

    sentence: str
    sources: tuple[str, ...]


def kinds_of(warnings: Iterable[tuple[str, str]]) -> list[Warned]:
    """Sort warnings (source, sentence) by kind: sentences that differ in their numbers alone are one.

    Examples
    --------
    >>> kinds_of([("a", "lag: 3 s"), ("b", "no unit"), ("c", "lag: 4.5e-3 s")])
    [Warned(sentence='lag: 3 s', sources=('a', 'c')), Warned(sentence='no unit', sources=('b',))]
    """
    found: dict[str, list[tuple[str, str]]] = {}
    for source, sentence in warnings:
        found.setdefault(_NUMBER.sub("0", sentence), []).append((source, sentence))
    return [Warned(alike[0][1], tuple(dict.fromkeys(source for source, _ in alike))) for alike in found.values()]
