"""What a row is."""

from collections.abc import Mapping

Row = Mapping[str, object]
"""A result from the schema's keys to values; ``None`` is not known."""
