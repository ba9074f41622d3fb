"""Which cycles an energy is of: the rule as a scene, a command line and the row of a measurement write it."""

import math

EXPECTED = "'last', 'all' or 'window:SECONDS' (like 'window:15')"


def window_of(rule: str) -> float | None:
    """Return the window of a rule, s; None for ``last`` and ``all``, which have none.

    Raises
    ------
    ValueError
        It is no rule: what was expected, and what came.

    Examples
    --------
    >>> window_of("window:15"), window_of("last")
    (15.0, None)
    >>> window_of("window:-3")
    Traceback (most recent call last):
    ValueError: expected 'last', 'all' or 'window:SECONDS' (like 'window:15'); got 'window:-3'
    """
    if rule in ("last", "all"):
        return None
    kind, _, text = rule.partition(":")
    try:
        is_plain = text.isascii() and "_" not in text  # Python reads more as numbers than people do
        seconds = float(text) if kind == "window" and is_plain else math.nan
    except ValueError:
        seconds = math.nan
    if not 0.0 < seconds < math.inf:
        msg = f"expected {EXPECTED}; got {rule!r}"
        raise ValueError(msg)
    return seconds
